"""Compliant contact: against independent solvers, in its limits, at its extremes."""

import math
import random
from itertools import pairwise, product
from typing import Any

import numpy as np
import pytest
from event_pairs import rows_of

from damper import Parameters, State, events, simulate
from damper.engine.segment import (
    CAUSE,
    CONTACT,
    DURATION,
    FLIGHT,
    GAP,
    GAP_RATE,
    IMPACT,
    MODE,
    RELEASE,
    SEPARATION,
    SIDE,
    SPEED,
    STICK,
    STICKING,
)
from damper.models import start_run
from damper.parameters.forcing import Forcing, NoForce, Record

GENERIC = (0.1, 0.05, 0.2, 0.25, 0.6)
QUIET = (0.1, 0.05, 0.2, 0.25, 0.3)
NAMES = ("mass_ratio", "damping_ratio", "frequency_ratio", "clearance", "restitution")


def compliant(scene: tuple, k: float, tension: int, **more: Any) -> Parameters:
    return Parameters(*scene, contact_stiffness_ratio=k, contact_tension=tension, **more)


@pytest.mark.parametrize("tension", [0, 1])
@pytest.mark.parametrize("r", [0.2, 0.99])
def test_free_contact_has_the_restitution_to_first_order(r: float, tension: int) -> None:
    """What spring and force do meanwhile vanishes as the time of contact, k^(-1/2)."""
    errors = []
    for k in (1e4, 1e6, 1e8):
        rows = rows_of(
            compliant((0.3, 0.1, 0.7, 0.5, r), k, tension), 1.0, State(0.2, 0.1, 0.7, 1.1)
        )
        first = int(np.argmax(rows[:, CAUSE] == IMPACT))
        after = rows[first + 1]
        assert after[CAUSE] == SEPARATION
        errors.append(abs(after[GAP_RATE] / rows[first, SPEED] - r))
    slopes = np.log10(np.array(errors[1:]) / errors[:-1]) / 2.0
    np.testing.assert_allclose(slopes, -0.5, atol=0.05)


def test_a_contact_sticks_once_it_has_lasted_one_period() -> None:
    rows = rows_of(compliant(QUIET, 1e6, 1), 20.0)
    (stick,) = np.flatnonzero(rows[:, CAUSE] == STICK)
    before = rows[stick - 1]
    frequency = math.sqrt(1e6 * 1.1 / 0.1)
    assert before[MODE] == CONTACT
    assert before[DURATION] == pytest.approx(2 * math.pi / frequency, rel=1e-12)
    assert rows[stick, MODE] == STICKING
    assert rows[stick + 1, CAUSE] == RELEASE


@pytest.mark.parametrize("z", [0.05, 0.99])
def test_under_a_constant_force_no_longer_contact_reopens(z: float) -> None:
    """Why one period: scan the approach speeds of the damped oscillator that is pressed."""
    longest = 0.0
    t = np.linspace(1e-3, 40.0, 20_000)
    root = math.sqrt(1 - z * z)
    for speed in np.geomspace(1e-4, 1e3, 100):
        # g'' + 2 z g' + g = -1 from g = 0, g' = -speed.
        decay = np.exp(-z * t)
        c, s = decay * np.cos(root * t), decay * np.sin(root * t) / root
        gap = -1.0 + (c + z * s) - speed * s
        reopened = np.flatnonzero(gap > 0.0)
        if len(reopened):
            longest = max(longest, t[reopened[0]])
    assert longest <= 2 * math.pi


def test_a_flight_out_of_the_wall_ends_at_its_surface() -> None:
    rows = rows_of(Parameters(0.3, 0.0, 1.0, 1e-3, 0.5, contact_stiffness_ratio=1e6), 50.0)
    run = start_run(Parameters(0.3, 0.0, 1.0, 1e-3, 0.5, contact_stiffness_ratio=1e6))
    ends = 0
    for row, end in pairwise(rows):
        if row[MODE] == FLIGHT and row[GAP] < 0.0 and end[MODE] == FLIGHT:
            _, _, gap, _ = run.motion_in(row, row[DURATION])
            assert abs(gap) < 1e-16
            ends += 1
    assert ends > 20


# --- no clearance: both walls touch at once


@pytest.mark.parametrize("tension", [0, 1])
def test_between_two_springs_it_is_an_oscillator(tension: int) -> None:
    """With no damping and next to no force."""
    p = compliant((1e-6, 0.0, 1e-3, 0.0, 1.0), 1e-2, tension)
    found = events(p, State(0.0, 0.0, 0.0, 1.0), until=0.2)
    frequency = math.sqrt(1e-2 * (1 + 1e-6) / 1e-6)
    impacts = found[found["kind"] == 0]
    np.testing.assert_allclose(np.diff(impacts["time"]), math.pi / frequency, rtol=1e-4)
    np.testing.assert_array_equal(np.abs(np.diff(impacts["side"])), 2)


@pytest.mark.parametrize("tension", [0, 1])
def test_without_clearance_a_start_into_a_wall_touches_that_one(tension: int) -> None:
    p = compliant((0.1, 0.05, 0.2, 0.0, 0.6), 1e4, tension)
    for toward in (-1.0, 1.0):
        # Both walls are at hand; what decides is where the free mass goes.
        start = State(0.3, 0.1, 0.3, 0.1 + 2.0 * toward)
        first = next(row for row in rows_of(p, 1.0, start) if row[CAUSE] == IMPACT)
        assert first[SIDE] == toward
        assert -first[SIDE] * first[GAP_RATE] == pytest.approx(2.0 * toward)


@pytest.mark.parametrize(("k", "phase"), [(1.0, 1.0), (1e8, -2.0)])
def test_without_clearance_a_start_at_rest_is_that_of_a_tiny_one(k: float, phase: float) -> None:
    def end(clearance: float) -> tuple[float, ...]:
        run = start_run(compliant((0.1, 0.05, 0.2, clearance, 0.6), k, 0, phase=phase))
        run.skip(0, 3.0)
        assert run.status == 0
        state = run.state_at(0, 3.0)
        return state.x, state.v, state.y, state.u

    assert end(0.0) == pytest.approx(end(1e-13), abs=1e-7)


# --- forces


def assert_same_events(one: np.ndarray, other: np.ndarray, error: float) -> None:
    assert len(one) == len(other) >= 3
    for name in ("kind", "side"):
        np.testing.assert_array_equal(one[name], other[name])
    for name in ("time", "x", "v", "approach_speed"):
        np.testing.assert_allclose(one[name], other[name], rtol=0.0, atol=error)


@pytest.mark.parametrize("of", ["force", "base_acceleration"])
@pytest.mark.parametrize(("k", "tension"), [(1e8, 0), (1e6, 1), (30.0, 0), (30.0, 1)])
def test_samples_on_the_lines_of_a_record_change_nothing(k: float, tension: int, of: str) -> None:
    """Steps from far shorter than a contact to far longer ones; contacts stick when they did."""
    time = np.array([0.0, 2.0, 2.5, 7.0, 12.0])
    value = np.array([0.8, -1.1, 0.9, -0.7, 1.2])
    coarse = compliant(QUIET, k, tension, forcing=Record(time, value, of=of))
    found = events(coarse, State(0.0, 0.0, 0.1, 0.5), until=14.0)
    assert {0, 1, 2} <= set(found["kind"])
    contact = math.pi / math.sqrt(k * 1.1 / 0.1)
    near = np.concatenate([t + contact * np.linspace(-1.2, 1.2, 25) for t in found["time"]])
    finer = np.unique([*time, *near[(near > 0.0) & (near < 12.0)]])
    fine = compliant(QUIET, k, tension, forcing=Record(finer, np.interp(finer, time, value), of=of))
    assert_same_events(found, events(fine, State(0.0, 0.0, 0.1, 0.5), until=14.0), 1e-11)


@pytest.mark.parametrize("d", [0.0, 0.25])
@pytest.mark.parametrize("forcing", [NoForce(), Record([3.0, 4.0], [1.0, 1.0])])
def test_rest_lasts_until_a_force_acts(forcing: Forcing, d: float) -> None:
    p = compliant((0.1, 0.05, 0.2, d, 0.6), 1e4, 0, forcing=forcing)
    run = start_run(p, State(0.0, 0.0, 0.0, 0.0))
    run.skip(*run.whole_periods(2.9))
    end = run.state_at(*run.whole_periods(2.9))
    assert (end.x, end.v, end.y, end.u, run.status) == (0.0, 0.0, 0.0, 0.0, 0)
    run.skip(*run.whole_periods(5.0))
    assert (run.state_at(*run.whole_periods(5.0)).x != 0.0) == (forcing.kind == "record")


# --- extremes


@pytest.mark.parametrize("runs", [12, pytest.param(400, marks=pytest.mark.exhaustive)])
def test_corners_of_the_range_finish_or_say_so(runs: int) -> None:
    chance = random.Random(2)
    stopped = 0
    for _ in range(runs):
        tension = chance.choice([0, 1])
        d = chance.choice([0.0, 10 ** chance.uniform(-6, 1)])
        scene = (
            10 ** chance.choice([-6, 18, chance.uniform(-6, 6)]),
            chance.choice([0.0, 0.02, 1.0, 10.0]),
            10 ** chance.uniform(-3, 3),
            d,
            chance.choice([0.05, 0.5, 0.95, 1.0, 0.0 if tension else 1e-3]),
        )
        k = 10 ** chance.uniform(-3, 8)
        x, v = chance.uniform(-2, 2), chance.uniform(-2, 2)
        state = State(x, v, x + d, v + chance.choice([0.0, 1e-12, 1.0]))
        time = np.cumsum([10 ** chance.uniform(-6, 0.3) for _ in range(9)])
        samples = Record(time, np.sin(9.0 * time), of=chance.choice(["force", "base_acceleration"]))
        harmonic = {"phase": chance.uniform(-3, 3)}
        force = chance.choice([harmonic, {"forcing": NoForce()}, {"forcing": samples}])
        gravity = chance.choice([0.0, chance.choice([-1, 1]) * 10 ** chance.uniform(-3, 3)])
        weight = {"gravity": gravity * min(1.0, 1e3 / scene[0])}
        run = start_run(compliant(scene, k, tension, **force, **weight), state, max_events=300)
        run.skip(*run.whole_periods(5.0))
        end = run.state_at(*run.whole_periods(0.0))
        assert all(math.isfinite(value) for value in (end.x, end.v, end.y, end.u))
        stopped += run.status == 2
    assert stopped == 0


# --- observers


def test_loss_of_an_impact_and_the_state_after_it_are_those_of_the_restitution() -> None:
    """The section shows the state after the contact."""
    ask = {"impact_section": {"wall": "left", "samples": 2, "free_mass": True}, "response": {}}
    point = dict(zip(NAMES, GENERIC, strict=True))
    run = {"transient": 0, "periods": 1, "observers": ask}
    rigid = simulate(**point, **run)
    for tension in (0, 1):
        errors = []
        for k in (1e6, 1e8):
            found = simulate(**point, contact_stiffness_ratio=k, contact_tension=tension, **run)
            errors.append(
                [
                    abs(float(found[name][0] - rigid[name][0]))
                    for name in ("velocity", "free_velocity")
                ]
            )
        np.testing.assert_allclose(np.divide(*errors), 10.0, rtol=0.1)
        assert float(found.impact_loss) == pytest.approx(float(rigid.impact_loss), rel=1e-2)


def test_the_peak_in_a_contact_under_a_fast_force() -> None:
    """Against dense samples: none is passed over between two turns of the force."""
    state = State(-0.3, -0.07, -0.365, -0.07)
    start = {"initial_displacement": -0.3, "initial_velocity": -0.07, "initial_position": -1.0}
    for mu, force, gravity in product((0.02, 0.03, 0.2), (0.3, 1.0, 2.2), (0.0, 1.7)):
        scene = mu, 0.0, 11.5, 0.065, 0.16, -2.2
        p = compliant(scene, 1e5, 1, force_amplitude=force, gravity=gravity)
        run = start_run(p, state)
        samples = [
            run.motions_in(row, np.linspace(0.0, row[DURATION], 300))[:, 0]
            for row in rows_of(p, p.cycle, state)
        ]
        largest = np.abs(np.concatenate(samples)).max()
        found = simulate(**p.acting, **start, transient=0, periods=1, observers=["response"])
        assert -1e-14 < found.peak_displacement.item() - largest < 1e-4
