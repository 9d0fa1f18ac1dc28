"""Dry friction of several free masses: each rule in a scene of its own."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scenes import scene_of
from scipy.optimize import brentq

from damper import Base, Parameters, SIParameters, State, events, simulate
from damper.engine.model import read_segment
from damper.engine.segment import IMPACT, TAIL
from damper.models import start_run
from damper.models.many import MODE
from damper.models.response import integrate_segment, prepare_tables, stored_energy
from damper.models.several.bodies import FOLLOWS, LEVEL, MOST, WALL, WIDTH
from damper.models.several.contacts import balance
from damper.observers.common.laws import broken
from damper.sweep.runs import run_points

STICK, RELEASE, STOPPED, REST, SLIP, REVERSAL = range(1, 7)
#: The primary swings freely.
CALM: dict[str, Any] = {"damping_ratio": 0.0, "frequency_ratio": 1.0, "force_amplitude": 0.0}


def damper_of(*masses: dict[str, float], **given: Any) -> Parameters:
    values = {"mass_ratio": 0.1, "clearance": 5.0, "restitution": 0.5} | CALM | given
    return Parameters(**values, masses=masses)


def told(table: np.ndarray) -> list[tuple[int, int, int]]:
    return [(row["kind"], row["body"], row["side"]) for row in table]


# --- rules


def test_the_balance_is_the_only_root() -> None:
    """Of a monotone function: against bisection, on random masses, walls and frictions."""
    random = np.random.default_rng(5)
    for _ in range(300):
        count = int(random.integers(1, 6))
        ratios, levels = random.uniform(0.01, 2.0, count), random.normal(size=count)
        most = random.uniform(0.0, 1.0, count) * (random.random(count) < 0.8)
        walls = random.integers(-1, 2, count).astype(float)
        low = np.where(walls > 0, -math.inf, -most)
        high = np.where(walls < 0, math.inf, most)
        free = float(random.normal())

        def excess(a: float, *of: Any) -> float:
            free, ratios, levels, low, high = of
            return float(a - free + ratios @ np.clip(a - levels, low, high))

        of = free, ratios, levels, low, high
        root = brentq(excess, -50.0, 50.0, args=of, xtol=1e-14)
        bodies = np.zeros((count, WIDTH))
        bodies[:, LEVEL], bodies[:, WALL], bodies[:, MOST] = levels, walls, most
        found = balance(free, ratios[:, None], bodies)
        assert found == pytest.approx(root, abs=1e-12)
        inside = (low < found - levels) & (found - levels < high)
        assert (bodies[:, FOLLOWS] == inside).all()


# --- the closed rest of chatter


def chattering(
    w: float, friction: float, speed: float, held: float, **more: Any
) -> tuple[Parameters, State]:
    """A mass that hits the right wall, which presses with about 1, and one that slides far off."""
    given = {"clearance": 1.0, "restitution": 0.6, "gravity": -0.2}
    p = damper_of({"friction": friction}, {"friction": held, "clearance": 50.0}, **given | more)
    return p, State(1.0, -0.5, [2.0, 0.0], [w - 0.5, speed - 0.5])


def tails_in(p: Parameters, state: State, accuracy: float) -> list[Any]:
    run = start_run(p, state, accuracy)
    rows = [row for log in run.segments(*run.whole_periods(0.3)) for row in log.copy()]
    found = [read_segment(run.model, row) for row in rows]
    return [s for s in found if s.cause == IMPACT and s.bodies[0, MODE] == TAIL and s.accumulation]


@pytest.mark.parametrize(("friction", "order"), [(0.3, 2), (0.0, 3)])
def test_a_tail_is_closed_beside_a_slide(friction: float, order: int) -> None:
    """At the first impact; its error falls with the square of the speed, or its third power."""
    errors = []
    for w in (0.008, 0.004, 0.002):
        p, state = chattering(w, friction, 2.0, 0.1)
        assert len(tails_in(p, state, 1e-3)) == 1
        closed, exact = (events(p, state, until=0.3, accuracy=a) for a in (1e-3, 1e-15))
        assert told(closed) == [(IMPACT, 0, 1), (STICK, 0, 1)]
        last = exact[exact["kind"] == STICK][0]
        errors.append(max(abs(closed[1][name] - last[name]) for name in ("time", "x", "v")))
    ratios = [one / other for one, other in pairwise(errors)]
    assert ratios == pytest.approx([2.0**order] * 2, rel=0.05)


@pytest.mark.parametrize(("speed", "held"), [(0.008, 3.0), (-0.008, 0.1)], ids=["rests", "turns"])
def test_no_tail_is_closed_while_another_slide_ends(speed: float, held: float) -> None:
    p, state = chattering(0.01, 0.3, speed, held)
    table = events(p, state, until=0.3, accuracy=1e-3)
    [stop] = table[(table["body"] == 1) & np.isin(table["kind"], (REST, REVERSAL))][:1]
    hits = table[(table["kind"] == IMPACT) & (table["time"] < stop["time"])]
    assert len(hits) >= 1
    for tail in tails_in(p, state, 1e-3):
        assert tail.time > stop["time"]


def test_a_tail_is_closed_while_the_opposite_wall_holds_another() -> None:
    """It slips off at 2 (gravity - 0.92), by the balance of forces on the way out of a bounce."""
    for gravity, closed in ((0.95, True), (0.9215, False)):
        p = damper_of({}, {"friction": 0.1, "gravity": gravity}, friction=0.3, restitution=0.6)
        state = State(1.0, 0.5, [6.0, -4.0], [0.51, 0.5])
        table = events(p, state, until=0.1, accuracy=1e-3)
        if closed:
            assert told(table) == [(STICK, 1, -1), (IMPACT, 0, 1), (STICK, 0, 1)]
        else:
            assert told(table)[:3] == [(STICK, 1, -1), (IMPACT, 0, 1), (RELEASE, 1, -1)]
            assert table["time"][2] == pytest.approx(2.0 * (gravity - 0.92), rel=1e-3)
        assert len(tails_in(p, state, 1e-3)) == closed


@pytest.mark.parametrize("friction", [0.3, 0.0])
def test_energy_in_any_part_of_a_tail(friction: float) -> None:
    """Of a bounce's energy what is left over falls with the speed: the centre's own error."""
    left = []
    for w in (0.008, 0.004):
        more = {"damping_ratio": 0.3, "force_amplitude": 0.7, "forcing": Base("base")}
        p, state = chattering(w, friction, 2.0, 0.1, **more)
        [s], model = tails_in(p, state, 1e-3), start_run(p).model
        found = []
        for low, high in pairwise((0.0, 0.07, 0.2, 0.35, 0.77, 1.0)):
            ends = low * s.accumulation, high * s.accumulation
            part = integrate_segment(model, prepare_tables(model), s, *ends, 0.0)
            stored = [stored_energy(model, s, tau) for tau in ends]
            lost = (
                2.0 * p.damping_ratio * part.speed_square + part.loss + part.support + part.friction
            )
            found.append(abs(part.work - lost - (stored[1] - stored[0])))
        left.append(max(found) / (0.5 * p.mass_ratio * s.gap_rate**2))
    assert left[0] < 0.01
    assert left[0] / left[1] == pytest.approx(2.0, rel=0.1)


def test_observers_see_the_impacts_of_a_tail() -> None:
    p, state = chattering(0.008, 0.3, 2.0, 0.1)
    observers = {
        "bursts": {"bodies": [0], "threshold": 1e-4, "records": 1},
        "response": {"friction_loss": True},
    }
    ask = {"state": state, "transient": 0, "periods": 1, "observers": observers}
    closed, resolved = (simulate(p, accuracy=a, **ask) for a in (1e-3, 1e-12))
    assert closed.burst_visible_impacts == resolved.burst_visible_impacts == 12
    assert float(closed.impact_loss) == pytest.approx(float(resolved.impact_loss), rel=2e-3)
    assert float(closed.friction_loss) == pytest.approx(float(resolved.friction_loss), rel=1e-8)


# --- extreme places of the box

#: Mass ratio, clearance, restitution, its left wall's, friction, gravity, x, v, place and velocity.
EXTREME: dict[str, tuple[dict[str, float], list[dict[str, float]], tuple[float, ...]]] = {
    # An impact whose rebound ends in no time turns the slide round that pressed others on walls.
    "turned slide": (
        {"damping_ratio": 1.8e-4, "frequency_ratio": 0.063, "phase": 2.7, "mass_ratio": 1e3}
        | {"restitution": 0.073, "restitution_left": 0.14, "clearance": 8.9e-4, "friction": 170.0},
        [
            {"mass_ratio": 6.8, "clearance": 0.094, "friction": 2.2e-6},
            {"restitution": 0.49, "gravity": -55.0, "friction": 1.5e-6},
        ],
        (2.3, -0.64, -0.59, -3.5),
    ),
    # In a box of 1e6 a gap rounds in 1e-10, and friction of 5000 takes this times 5000.
    "long box": (
        {"damping_ratio": 10.0, "frequency_ratio": 210.0, "phase": -0.76, "mass_ratio": 1e-6}
        | {"restitution": 0.15, "restitution_left": 0.8, "clearance": 1e6, "friction": 1.8},
        [{"mass_ratio": 55.0, "friction": 91.0}, {"restitution": 0.73, "gravity": 940.0}],
        (1.4, -0.67, 0.81, 1.2),
    ),
    # A mass rests at once since another one, which sticks, weighs on the primary.
    "heavy neighbour": (
        {"damping_ratio": 1.0, "frequency_ratio": 0.49, "phase": -0.54, "mass_ratio": 0.7}
        | {"restitution": 0.5, "restitution_left": 0.7, "clearance": 1.5e-5, "friction": 3e-4},
        [
            {"mass_ratio": 100.0, "clearance": 52.0, "friction": 5.2e-5},
            {"restitution": 0.0, "gravity": 960.0},
        ],
        (0.0, 1.24, -0.22, -0.135),
    ),
    # Speeds fall without end in no time: what is left of them must be taken for none.
    "vanishing speeds": (
        {"damping_ratio": 4e-4, "frequency_ratio": 0.0065, "phase": 1.3, "mass_ratio": 0.99}
        | {"restitution": 0.95, "restitution_left": 1.0, "clearance": 1.1e-4},
        [
            {"mass_ratio": 380.0, "clearance": 8.9e-5, "friction": 300.0},
            {"restitution": 0.42, "gravity": 730.0},
        ],
        (1.5, -0.93, 0.59, -2.6),
    ),
}


@pytest.mark.parametrize("name", EXTREME)
def test_extreme_runs_keep_the_laws(name: str) -> None:
    values, masses, (x, v, place, velocity) = EXTREME[name]
    places = [x + place * one.get("clearance", values["clearance"]) for one in [values, *masses]]
    found, _ = run_points(
        [{**values, "masses": [{}, *masses]}],
        ["laws"],
        state=State(x, v, places, [velocity] * 3),
        transient=0,
        periods=1,
        max_events=500,
    )
    assert not broken(found).any()
    assert found["not_finite"] == 0
    assert found["status"] != 2


def test_a_sequence_on_one_wall_ends_before_a_slide_that_its_impacts_reverse() -> None:
    """In many digits the slide ends some 1e-27 after mass 1 sticks, at the same time in doubles."""
    values, state = scene_of("several, grounded, sliding", "none", 306)
    found = events(Parameters(**values), State(*state), until=1.3229)
    [stick] = np.flatnonzero((found["kind"] == STICK) & (found["body"] == 1))
    assert found[["kind", "body"]][stick - 1 :].tolist() == [(REVERSAL, 0), (STICK, 1), (REST, 0)]
    assert found["time"][stick + 1] == pytest.approx(found["time"][stick], abs=1e-14)


# --- units of measure, and what is refused


def test_machine_in_si_units() -> None:
    """A coefficient for each, under one transverse acceleration."""
    values = (2.0, 4.0, 200.0, 10.0, 11.0, 0.2, 0.02, 0.6)
    masses = [{}, {"friction_coefficient": 0.02, "gap": 0.1}]
    p = SIParameters(
        *values, friction_coefficient=0.05, transverse_acceleration=10.0, masses=masses
    )
    assert [one.friction for one in p.dimensionless.each] == pytest.approx([0.1, 0.04])
    again = SIParameters.of(p.dimensionless, 2.0, 200.0, 10.0)
    assert [one.friction for one in again.dimensionless.each] == pytest.approx([0.1, 0.04])
    one, other = events(p, until=2.0), events(p.dimensionless, until=2.0 / p.units.time)
    assert len(one) >= 5
    assert told(one) == told(other)
    message = r"^masses\[1\]\.friction_coefficient = 0\.02 without transverse_acceleration"
    with pytest.raises(ValueError, match=message):
        SIParameters(*values, masses=masses)


def _log(p: Parameters, state: State, until: float) -> list[list[Any]]:
    run = start_run(p, state)
    whole = run.whole_periods(until)
    return [[read_segment(run.model, row.copy()) for row in log] for log in run.segments(*whole)]
