"""Points: names and values -> parameters, units and a start inside the box."""

import math
import re
import warnings
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import SI as SCENE_SI
from scenes import STUDY

from damper import Parameters, SIParameters, State, events, simulate
from damper.engine.segment import CAUSE, FLIGHT, GAP, GAP_RATE, MODE, SIDE, STICKING
from damper.models import start_run
from damper.parameters import NO_UNITS
from damper.sweep.points import read_point
from damper.theory.steady import steady_state

POINT: dict[str, float] = STUDY | {"phase": 0.4}
SI: dict[str, float] = SCENE_SI | {"gap": 0.02, "restitution": 0.6, "phase": 0.4}
RATIOS = st.floats(1e-3, 1e3)
NUMBERS = st.floats(-1e3, 1e3)
PLACES = st.floats(-1, 1)


def exact(*values: float) -> list[Fraction]:
    return [Fraction(value) for value in values]


# --- the start


def test_nothing_given_is_rest_with_the_free_mass_at_the_centre() -> None:
    point = read_point(POINT)
    assert point.parameters == Parameters(**POINT)
    assert point.units is NO_UNITS
    assert point.start() is None
    zeros = dict.fromkeys(
        (
            "initial_displacement",
            "initial_velocity",
            "initial_position",
            "initial_relative_velocity",
        ),
        0.0,
    )
    assert read_point(POINT | zeros).start() == State(0.0, 0.0, 0.0, 0.0)


@given(clearance=st.floats(0, 1e6), x=NUMBERS, v=NUMBERS, place=PLACES, relative=NUMBERS)
def test_start_is_what_was_given(
    clearance: float, x: float, v: float, place: float, relative: float
) -> None:
    """Against rational arithmetic, and always a state that the engine takes."""
    point = read_point(
        {
            **POINT,
            "clearance": clearance,
            "initial_displacement": x,
            "initial_velocity": v,
            "initial_position": place,
            "initial_relative_velocity": relative,
        }
    )
    start = point.start()
    d, x_, v_, place_, relative_ = exact(clearance, x, v, place, relative)
    assert (start.x, start.v, start.time) == (x, v, 0.0)
    least = Fraction(5e-324)  # which a product may be rounded to
    assert abs(Fraction(start.y) - (x_ + place_ * d)) <= Fraction(3e-16) * (abs(x_) + d) + least
    assert abs(Fraction(start.u) - (v_ + relative_)) <= Fraction(2e-16) * (abs(v_) + abs(relative_))
    start_run(point.parameters, start)


@given(clearance=st.floats(1e-6, 1e6), x=NUMBERS, v=NUMBERS, side=st.sampled_from([-1.0, 1.0]))
def test_position_of_one_is_on_the_wall(clearance: float, x: float, v: float, side: float) -> None:
    """With gap exactly 0, on the right side, whatever the displacement."""
    given = {"initial_displacement": x, "initial_velocity": v, "initial_position": side}
    for relative in (0.0, 0.5, -0.5):
        values = {**POINT, "clearance": clearance, "initial_relative_velocity": relative, **given}
        point = read_point(values)
        row = start_run(point.parameters, point.start())._state
        assert row[SIDE] == side
        assert row[GAP] == 0.0
        assert row[GAP_RATE] == pytest.approx(-side * relative, abs=1e-12)
        if relative == 0.0:
            # Kept together where the wall pushes the free mass inwards: -s x'' > 0.
            push = -side * (math.sin(0.4) - 2 * 0.02 * v - x)
            if abs(push) > 1e-9:
                assert (row[MODE] == STICKING) == (push > 0)
        else:
            assert row[MODE] == FLIGHT


@pytest.mark.parametrize("side", [-1, 1])
def test_start_on_a_wall(side: int) -> None:
    """Approaching hits at once, separating flies, and no relative velocity may stick."""
    given = {**POINT, "initial_position": side}
    point = read_point({**given, "initial_relative_velocity": 0.5 * side})
    first = events(point.parameters, point.start(), until=10.0)[0]
    assert (first["time"], first["kind"], first["side"]) == (0.0, 0, side)
    assert first["approach_speed"] == 0.5
    point = read_point({**given, "initial_relative_velocity": -0.5 * side})
    first = events(point.parameters, point.start(), until=10.0)[0]
    assert (first["kind"], first["side"]) == (0, -side)
    assert 0.0 < first["time"] < 1.0
    point = read_point({**given, "initial_displacement": side})  # the spring pulls back
    first = events(point.parameters, point.start(), until=10.0)[0]
    assert (first["time"], first["kind"], first["side"]) == (0.0, 1, side)


@given(place=PLACES, relative=NUMBERS, phase=st.floats(-7, 7), omega=st.floats(0.1, 10))
def test_steady_primary_with_a_free_mass_anywhere(
    place: float, relative: float, phase: float, omega: float
) -> None:
    values = POINT | {"frequency_ratio": omega, "phase": phase}
    free = {"initial_position": place, "initial_relative_velocity": relative}
    start = read_point(values | free, "steady").start()
    assert (start.x, start.v) == steady_state(Parameters(**values))
    assert start.y - start.x == pytest.approx(0.05 * place, abs=1e-15 * (1 + abs(start.x)))
    assert start.u - start.v == pytest.approx(relative, abs=1e-15 * (abs(start.v) + abs(relative)))


# --- a neighbour's end


@given(
    clearances=st.tuples(st.floats(1e-3, 10), st.floats(1e-3, 10)),
    frequencies=st.tuples(RATIOS, RATIOS),
    x=st.floats(-5, 5),
    v=st.floats(-5, 5),
    place=PLACES,
    relative=st.floats(-5, 5),
    part=st.floats(0, 1, exclude_max=True),
)
def test_carried_over_by_the_formula(
    clearances: tuple[float, float],
    frequencies: tuple[float, float],
    x: float,
    v: float,
    place: float,
    relative: float,
    part: float,
) -> None:
    """Primary and relative velocity go on, place and phase are parts of clearance and period."""
    one, two = (
        read_point({**POINT, "clearance": d, "frequency_ratio": omega})
        for d, omega in zip(clearances, frequencies, strict=True)
    )
    end = State(x, v, x + place * clearances[0], v + relative, part * one.parameters.cycle)
    if abs(end.y - end.x) > clearances[0]:
        end = State(x, v, x, v + relative, end.time)
    start = two.carried_over(one, end)
    assert (start.x, start.v) == (x, v)
    before, after = exact(*clearances)
    x_, y_, v_, u_ = exact(end.x, end.y, end.v, end.u)
    y = x_ + (y_ - x_) / before * after
    assert abs(Fraction(start.y) - y) < Fraction(1e-15) * (
        after + abs(x_) + (abs(x_) + abs(y_)) / before * after
    )
    assert abs(Fraction(start.u) - u_) <= Fraction(4e-16) * (2 * abs(v_) + abs(u_))
    assert start.time / two.parameters.cycle == pytest.approx(
        end.time / one.parameters.cycle, rel=1e-15
    )
    start_run(two.parameters, start)


@given(
    before=st.floats(1e-4, 10),
    after=st.floats(1e-4, 10),
    x=st.floats(-5, 5),
    v=st.floats(-5, 5),
    side=st.sampled_from([-1.0, 1.0]),
)
def test_contact_stays_contact(
    before: float, after: float, x: float, v: float, side: float
) -> None:
    """The engine's own end of a sticking pair, at any other clearance."""
    one, two = (read_point({**POINT, "clearance": d}) for d in (before, after))
    trajectory = start_run(
        one.parameters, State(x, v, x + side * before, v, 0.3 * one.parameters.cycle)
    )
    row = trajectory._state
    assert (row[GAP], row[SIDE]) == (0.0, side)
    end = trajectory.state_at(*trajectory.start)
    start = two.carried_over(one, end)
    found = start_run(two.parameters, start)._state
    assert (found[GAP], found[SIDE], found[GAP_RATE]) == (0.0, side, 0.0)
    assert (found[MODE], found[CAUSE]) == (row[MODE], row[CAUSE])


def test_clearance_of_nothing_is_left_and_reached() -> None:
    """From 0 the free mass comes to lie at the centre; into 0 it keeps its velocity."""
    none, some = (read_point({**POINT, "clearance": d}) for d in (0.0, 2.0))
    assert some.carried_over(none, State(0.3, 0.5, 0.3, 0.5)) == State(0.3, 0.5, 0.3, 0.5)
    assert none.carried_over(some, State(0.3, 0.5, 1.3, 0.75)) == State(0.3, 0.5, 0.3, 0.75)


def test_local_time_stays_in_the_period() -> None:
    """A part of the period just below 1 may round up to it; that is the start of the next one."""
    one = read_point(POINT)
    for omega in np.linspace(0.1, 3.0, 300):
        two = read_point({**POINT, "frequency_ratio": float(omega)})
        end = State(0.0, 0.0, 0.0, 0.0, math.nextafter(one.parameters.cycle, 0.0))
        trajectory = start_run(two.parameters, two.carried_over(one, end))
        periods, rest = trajectory.start
        assert 0.0 <= rest < trajectory.cycle
        assert periods + rest / trajectory.cycle == pytest.approx(1.0, abs=1e-15)


# --- names


SECOND = "must be one of mass_ratio, damping_ratio, frequency_ratio, clearance, restitution, phase"
SI_SECOND = "must be one of primary_mass, damping, stiffness, force_amplitude, forcing_frequency"


@pytest.mark.parametrize(
    ("values", "error", "message"),
    [
        ({**POINT, "gap": 1.0}, ValueError, "gap (SI units) and mass_ratio, damping_ratio"),
        ({**SI, "clearance": 1.0}, ValueError, "clearance (dimensionless) are mixed"),
        ({**POINT, "clearence": 1.0}, TypeError, f"(did you mean 'clearance'?): {SECOND}"),
        ({**SI, "K": 1.0}, TypeError, f"'K' (did you mean 'stiffness'?): {SI_SECOND}"),
        ({"restitution": 0.5, "mass_ratio": 0.1}, TypeError, "missing parameters: damping_ratio"),
        ({"restitution": 0.5, "gap": 0.1}, TypeError, "missing parameters: primary_mass, damping"),
        ({**POINT, "initial_position": 1.5}, ValueError, "initial_position = 1.5: must be a"),
        ({**POINT, "initial_position": -1.1}, ValueError, "-1 <= initial_position <= 1 (-1 at"),
        ({**POINT, "initial_velocity": math.nan}, ValueError, "initial_velocity = nan"),
        ({**POINT, "initial_displacement": "0"}, TypeError, "initial_displacement = '0'"),
        ({**POINT, "initial_displacement": True}, TypeError, "initial_displacement = True"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_refused(values: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=re.escape(message)):
        read_point(values)


def test_primary_is_at_rest_or_steady() -> None:
    with pytest.raises(ValueError, match="primary = 'stedy': must be one of rest, steady"):
        read_point(POINT, "stedy")
    for name in ("initial_displacement", "initial_velocity"):
        with pytest.raises(ValueError, match=f"{name} is given, but the primary starts on its st"):
            read_point({**POINT, name: 0.0}, "steady")
        with pytest.raises(ValueError, match=f"{name} is given, but the primary starts on its st"):
            simulate(**POINT, **{name: 0.0}, initial="steady")


@pytest.mark.filterwarnings("default:.* is unusual")
@pytest.mark.parametrize(
    ("changed", "asked"),
    [
        ({"gap": "20 mm"}, []),
        ({"gap": 20}, ["gap"]),
        (
            {"stiffness": 1e13, "forcing_frequency": "30 kHz"},
            ["forcing_frequency", "natural_frequency"],
        ),
    ],
)
def test_a_run_asks_about_values_that_few_machines_have(changed: dict, asked: list) -> None:
    si: dict = {"primary_mass": 100, "damping": 800, "stiffness": 4e6, "free_mass": 10, "gap": 1e-3}
    si |= {"force_amplitude": 200, "forcing_frequency": 200, "restitution": 0.3} | changed
    for run in (
        lambda: events(**si, until=1e-5),
        lambda: events(SIParameters(**si), until=1e-5),
        lambda: simulate(**si | {"restitution": [0.3, 0.4]}, transient=0, periods=1),
    ):
        with warnings.catch_warnings(record=True) as found:
            run()
        assert [str(one.message).partition(" =")[0] for one in found] == asked
        assert {one.filename for one in found} <= {__file__}


def test_sequences_of_simulate_are_numbers_with_units_as_well() -> None:
    cube = simulate(
        primary_mass="0.1 t",
        damping=800,
        stiffness=4e6,
        free_mass=10,
        gap=["10 mm", 0.02],
        force_amplitude="1 mm",
        forcing="base",
        forcing_frequency="30 Hz",
        restitution=0.3,
        transient=0,
        periods=1,
    )
    assert cube.gap.values.tolist() == [0.01, 0.02]
    assert (cube.primary_mass, cube.force_amplitude) == (100.0, 1e-3)


def test_a_spacing_sets_several_masses_apart() -> None:
    """From 0.5 in steps of 0.75 clearances: 0.5, 1.25, 2.0 and 2.75, thrown back at 1."""
    values = POINT | {"masses": [{}] * 4, "initial_position": 0.5, "initial_spacing": 0.75}
    start, d = read_point(values).start(), POINT["clearance"]
    assert np.allclose(np.array(start.y) / d, [0.5, 0.75, 0.0, -0.75], atol=1e-12)
    alike = read_point(values | {"initial_spacing": 0.0}).start()
    assert alike == State(0.0, 0.0, [0.5 * d] * 4, 0.0)
    with pytest.raises(ValueError, match=r"^initial_spacing = 0.75 with one free mass"):
        read_point(values | {"masses": None})
