"""The damper with walls that give: against independent solvers, in its limits, at its extremes."""

import math
import random
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from new_process import in_new_process
from reference.compliant import Scene, exact_events, integrated_events

from damper import Parameters, State, events
from damper.engine.segment import (
    CAUSE,
    CONTACT,
    DURATION,
    FINISHED,
    FLIGHT,
    GAP,
    IMPACT,
    MODE,
    NOTHING,
    PERIOD,
    RATE,
    RELEASE,
    SEPARATION,
    SIDE,
    SPEED,
    STICK,
    STICKING,
    TIME,
    V,
    X,
)
from damper.engine.trajectory import Trajectory
from damper.models import motion
from damper.models.compliant.restitution import contact_damping
from damper.sweep.runs import run_lanes

GENERIC = (0.1, 0.05, 0.2, 0.25, 0.6)
QUIET = (0.1, 0.05, 0.2, 0.25, 0.3)
NAMES = ("mass_ratio", "damping_ratio", "frequency_ratio", "clearance", "restitution")


def compliant(scene: tuple, k: float, tension: int, **more: float) -> Parameters:
    return Parameters(*scene, contact_stiffness_ratio=k, contact_tension=tension, **more)


def rows_of(p: Parameters, until: float, state: State | None = None) -> np.ndarray:
    run = Trajectory(p, state)
    return np.concatenate([log.copy() for log in run.segments(*run.whole_periods(until))])


def changes(p: Parameters, until: float, state: State | None = None) -> list[tuple]:
    """Time, kind, side, speed, x, v of every start and end of a force."""
    found, before = [], FLIGHT
    for row in rows_of(p, until, state):
        kind = None
        if row[CAUSE] == IMPACT:
            kind = "touch"
        elif row[CAUSE] in (SEPARATION, RELEASE):
            kind = "part"
        elif row[MODE] == CONTACT and row[CAUSE] == NOTHING and before == FLIGHT:
            kind = "again"
        if kind:
            time = row[PERIOD] * p.period + row[TIME]
            found.append((time, kind, int(row[SIDE]), row[SPEED], row[X], row[V]))
        before = row[MODE]
    return found


@pytest.mark.parametrize(
    ("scene", "k", "tension", "until"),
    [
        (GENERIC, 1e10, 0, 20.0),
        (GENERIC, 1e10, 1, 20.0),
        # A burst that ends in a lasting contact, and its release.
        (QUIET, 1e4, 1, 19.5),
        (QUIET, 1e4, 0, 17.6),
        ((0.5, 0.2, 0.7, 0.1, 0.05), 30.0, 0, 8.0),
        ((0.3, 0.02, 0.9, 0.4, 0.8), 30.0, 0, 11.4),
    ],
)
def test_changes_against_forty_digits(scene: tuple, k: float, tension: int, until: float) -> None:
    z = contact_damping(scene[4], bool(tension))
    right = exact_events(Scene(*scene[:4], k, z, bool(tension)), (0, 0, 0, 0), until)
    found = changes(compliant(scene, k, tension), until)
    assert [(c.kind, c.side) for c in right] == [one[1:3] for one in found]
    assert len(right) >= 4
    for one, other in zip(right, found, strict=True):
        assert abs(one.time - other[0]) < 1e-12
        if one.kind == "touch":
            assert abs(one.speed - other[3]) < 1e-12
        assert abs(one.x - other[4]) < 1e-12
        assert abs(one.v - other[5]) < 1e-12


@pytest.mark.parametrize("seed", range(6))
def test_changes_against_dop853(seed: int) -> None:
    """Soft and moderately stiff scenes, both conventions."""
    chance = random.Random(seed)
    scene = (
        chance.uniform(0.05, 1.0),
        chance.uniform(0.0, 0.3),
        chance.uniform(0.5, 1.5),
        chance.uniform(0.05, 0.6),
        chance.uniform(0.3, 0.95),
    )
    k, tension = 10 ** chance.uniform(0, 3.5), seed % 2
    z = contact_damping(scene[4], bool(tension))
    p = Scene(*scene[:4], k, z, bool(tension))
    right = integrated_events(p, (0.1, 0.2, 0.1, -0.3), 8.0)
    found = changes(compliant(scene, k, tension), 8.0, State(0.1, 0.2, 0.1, -0.3))
    count = min(len(right), 8)
    assert count >= 2
    for one, other in zip(right[:count], found[:count], strict=True):
        assert one[1:3] == other[1:3]
        assert one[0] == pytest.approx(other[0], abs=2e-8)
        assert one[3] == pytest.approx(other[3], abs=2e-8)


@pytest.mark.parametrize("tension", [0, 1])
@pytest.mark.parametrize("r", [0.2, 0.7, 0.99])
def test_free_contact_has_the_restitution_to_first_order(r: float, tension: int) -> None:
    """What spring and force do meanwhile vanishes as the time of contact, k^(-1/2)."""
    errors = []
    for k in (1e4, 1e6, 1e8):
        p = compliant((0.3, 0.1, 0.7, 0.5, r), k, tension)
        rows = rows_of(p, 1.0, State(0.2, 0.1, 0.7, 1.1))
        (first,) = np.flatnonzero(rows[:, CAUSE] == IMPACT)[:1]
        after = rows[first + 1]
        assert after[CAUSE] == SEPARATION
        errors.append(abs(after[RATE] / rows[first, SPEED] - r))
        if r > 0.0044 and tension:
            assert rows[first, DURATION] < 0.9 * Trajectory(p).model.lasting
    slopes = np.log10(np.array(errors[1:]) / errors[:-1]) / 2.0
    np.testing.assert_allclose(slopes, -0.5, atol=0.05)


@pytest.mark.parametrize("tension", [0, 1])
def test_convergence_to_the_rigid_damper(tension: int) -> None:
    """Impacts, accumulation, release and section approach the rigid ones as k^(-1/2)."""
    rigid = events(Parameters(*QUIET), until=21.0)
    stiffness = [1e7, 1e8, 1e9, 1e10]
    distances = []
    for k in stiffness:
        found = events(compliant(QUIET, k, tension), until=21.0)
        row = [abs(found["time"][i] - rigid["time"][i]) for i in (1, 2, 3)]
        for kind in (1, 2):
            one, other = (e["time"][e["kind"] == kind][0] for e in (found, rigid))
            row.append(abs(one - other))
        distances.append(row)
    slopes = np.polyfit(np.log(stiffness), np.log(distances), 1)[0]
    # The release forgets the way to it: it may converge faster.
    assert np.all(slopes < -0.44)
    assert np.all(slopes[:3] > -0.53)
    assert max(distances[-1]) < 2e-3


@pytest.mark.parametrize("tension", [0, 1])
@pytest.mark.parametrize("k", [3.0, 1e5, 1e10])
def test_mirror_image(k: float, tension: int) -> None:
    """The opposite force and state give the opposite motion."""
    one = compliant(GENERIC, k, tension, phase=0.5)
    other = compliant(GENERIC, k, tension, phase=0.5 - math.pi)
    state = State(0.3, 0.1, 0.4, -0.2)
    mirrored = State(-0.3, -0.1, -0.4, 0.2)
    left, right = events(one, state, until=12.0), events(other, mirrored, until=12.0)
    assert len(left) >= 2
    np.testing.assert_array_equal(left["kind"], right["kind"])
    np.testing.assert_array_equal(left["side"], -right["side"])
    np.testing.assert_allclose(left["time"], right["time"], atol=1e-11)
    np.testing.assert_allclose(left["x"], -right["x"], atol=1e-11)


def test_run_is_the_same_however_it_is_split() -> None:
    p = compliant(QUIET, 1e5, 0)
    whole = rows_of(p, 60.0)
    run = Trajectory(p)
    pieces = []
    for stop in np.linspace(0.01, 60.0, 157):
        log = np.concatenate(
            [piece.copy() for piece in run.segments(*run.whole_periods(float(stop)))]
        )
        pieces.append(log)
    starts = {tuple(row[:DURATION]) for log in pieces for row in log}
    assert starts == {tuple(row[:DURATION]) for row in whole}


def test_segments_join() -> None:
    """The state at the end of each row is that at the start of the next."""
    for tension in (0, 1):
        run = Trajectory(compliant(QUIET, 1e5, tension))
        rows = np.concatenate([log.copy() for log in run.segments(*run.whole_periods(60.0))])
        for row, following in pairwise(rows):
            x, v, gap, rate = motion(run.model, row, float(row[DURATION]))
            assert x == pytest.approx(following[X], abs=1e-13)
            assert v == pytest.approx(following[V], abs=1e-13)
            if row[SIDE] == following[SIDE]:
                assert gap == pytest.approx(following[GAP], abs=1e-13)
                assert rate == pytest.approx(following[RATE], abs=1e-12)


def test_a_contact_sticks_once_it_has_lasted_one_period() -> None:
    p = compliant(QUIET, 1e6, 1)
    rows = rows_of(p, 20.0)
    (stick,) = np.flatnonzero(rows[:, CAUSE] == STICK)
    before = rows[stick - 1]
    frequency = math.sqrt(1e6 * 1.1 / 0.1)
    assert before[MODE] == CONTACT
    assert before[DURATION] == pytest.approx(2 * math.pi / frequency, rel=1e-12)
    assert rows[stick, MODE] == STICKING
    assert rows[stick + 1, CAUSE] == RELEASE


@pytest.mark.parametrize("z", [1e-4, 0.01, 0.05, 0.3, 0.7, 0.99])
def test_under_a_constant_push_no_longer_contact_reopens(z: float) -> None:
    """Why one period: scan the approach speeds of the damped oscillator that is pushed."""
    longest = 0.0
    t = np.linspace(1e-3, 40.0, 40_000)
    root = math.sqrt(1 - z * z)
    for speed in np.geomspace(1e-4, 1e3, 400):
        # g'' + 2 z g' + g = -1 from g = 0, g' = -speed.
        decay = np.exp(-z * t)
        c, s = decay * np.cos(root * t), decay * np.sin(root * t) / root
        gap = -1.0 + (c + z * s) - speed * s
        reopened = np.flatnonzero(gap > 0.0)
        if len(reopened):
            longest = max(longest, t[reopened[0]])
    assert longest <= 2 * math.pi


@pytest.mark.parametrize("tension", [0, 1])
@pytest.mark.parametrize("side", [-1, 1])
def test_pressed_start_on_the_wall_stays_in_touch(side: int, tension: int) -> None:
    p = compliant(GENERIC, 1e8, tension, phase=-side * math.pi / 2)
    found = events(p, State(0.0, 0.0, side * 0.25, 0.0), until=1.0)
    assert [(e["kind"], e["side"]) for e in found] == [(1, side)]
    opposite = compliant(GENERIC, 1e8, tension, phase=side * math.pi / 2)
    rows = rows_of(opposite, 1.0, State(0.0, 0.0, side * 0.25, 0.0))
    assert rows[0, MODE] == FLIGHT


def test_penetrated_start_is_allowed() -> None:
    p = compliant(GENERIC, 100.0, 0)
    rows = rows_of(p, 1.0, State(0.0, 0.0, 0.3, 0.0))
    assert (rows[0, MODE], rows[0, SIDE]) == (CONTACT, 1.0)
    assert rows[0, GAP] == pytest.approx(-0.05)
    with pytest.raises(ValueError, match="outside the box"):
        Trajectory(Parameters(*GENERIC), State(0.0, 0.0, 0.3, 0.0))


@pytest.mark.parametrize("tension", [0, 1])
def test_without_clearance_both_walls_touch(tension: int) -> None:
    """One mass between two springs: with no damping, no force and both conventions alike, an
    oscillator."""
    p = compliant((1e-6, 0.0, 1e-3, 0.0, 1.0), 1e-2, tension, phase=0.0)
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
        assert -first[SIDE] * first[RATE] == pytest.approx(2.0 * toward)


@pytest.mark.parametrize("phase", [0.0, 1.0, -2.0])
@pytest.mark.parametrize("k", [1.0, 1e4, 1e10])
def test_without_clearance_a_start_at_rest_is_that_of_a_tiny_one(k: float, phase: float) -> None:
    def end(clearance: float) -> tuple[float, ...]:
        run = Trajectory(compliant((0.1, 0.05, 0.2, clearance, 0.6), k, 0, phase=phase))
        run.skip(0, 3.0)
        assert run.status == FINISHED
        state = run.state_at(0, 3.0)
        return state.x, state.v, state.y, state.u

    assert end(0.0) == pytest.approx(end(1e-13), abs=1e-7)


@pytest.mark.parametrize("speed", [1e-12, 1e-9, 1e-6, 1e-3])
@pytest.mark.parametrize("tension", [0, 1])
@pytest.mark.parametrize("k", [1.0, 1e10])
def test_grazing_contacts(k: float, tension: int, speed: float) -> None:
    """Approach at almost no speed to a wall that presses, and to one that parts."""
    for phase in (math.pi / 2, -math.pi / 2):
        p = compliant(GENERIC, k, tension, phase=phase)
        run = Trajectory(p, State(0.0, 0.0, 0.25, speed), max_events=5000)
        run.skip(0.0, 3.0)
        assert run.status == 0


def test_extremes_finish_or_say_so() -> None:
    chance = random.Random(2)
    stopped = 0
    for _ in range(150):
        tension = chance.choice([0, 1])
        d = chance.choice([0.0, 10 ** chance.uniform(-6, 1)])
        p = compliant(
            (
                10 ** chance.uniform(-9, 6),
                chance.choice([0.0, 0.02, 1.0, 100.0, 1e6]),
                10 ** chance.uniform(-4, 4),
                d,
                chance.choice([0.05, 0.5, 0.95, 1.0, 0.0 if tension else 1e-6]),
            ),
            10 ** chance.uniform(0, 10),
            tension,
            phase=chance.uniform(-3, 3),
        )
        x, v = chance.uniform(-2, 2), chance.uniform(-2, 2)
        run = Trajectory(
            p, State(x, v, x + d, v + chance.choice([0.0, 1e-12, 1.0])), max_events=300
        )
        run.skip(*run.whole_periods(5.0))
        end = run.state_at(*run.whole_periods(0.0))
        assert all(math.isfinite(value) for value in (end.x, end.v, end.y, end.u))
        assert run.status in (0, 1, 2)
        stopped += run.status == 2
    assert stopped < 15


def test_a_contact_beyond_numbers_is_refused() -> None:
    with pytest.raises(ValueError, match=r"contact_stiffness_ratio = 1e\+200.*too fast"):
        Trajectory(compliant(GENERIC, 1e200, 0))


RUN = """
import json, damper
p = [damper.Parameters(0.1, 0.05, 0.2, 0.25, 0.3, contact_stiffness_ratio=k, contact_tension=t)
     for k in (30.0, 1e10) for t in (0, 1)]
found = [damper.events(one, until=21.0) for one in p]
print(json.dumps([[float(x).hex() for name in ("time", "approach_speed", "x", "v") for x in e[name]]
                  for e in found]))
"""


def test_plain_python_gives_the_same_bits() -> None:
    fast = in_new_process(RUN, "-W", "error", DAMPER_COMPILE="1")
    plain = in_new_process(RUN, "-W", "error", DAMPER_COMPILE="0")
    assert fast == plain
    assert sum(map(len, fast)) > 100


# Observers.


def observed(k: float, tension: int, scene: tuple = QUIET, **settings: Any) -> dict:
    point = dict(zip(NAMES, scene, strict=True))
    point |= {"contact_stiffness_ratio": k, "contact_tension": tension}
    observers = settings.pop("observers", ["response"])
    arrays, _ = run_lanes([point], observers, **({"transient": 1, "periods": 3} | settings))
    return {name: array[0] for name, array in arrays.items()}


@pytest.mark.parametrize("tension", [0, 1])
@pytest.mark.parametrize("k", [1.0, 30.0, 1e4, 1e10])
@pytest.mark.parametrize(
    "scene", [QUIET, (0.3, 0.0, 0.9, 0.4, 0.8), (0.5, 0.2, 0.7, 0.1, 0.05), (2, 3, 1.3, 0.1, 0.999)]
)
def test_energy_balance_closes(scene: tuple, k: float, tension: int) -> None:
    """Flow, switching, the contact's loss and all integrals at once."""
    found = observed(k, tension, scene)
    scale = max(found["energy_input"], found["dashpot_loss"], found["impact_loss"])
    assert abs(found["energy_residual"]) < 2e-14 * scale
    assert found["impact_loss"] > 0.0


@pytest.mark.parametrize("tension", [0, 1])
@pytest.mark.parametrize("k", [2.0, 300.0, 1e8])
def test_rms_and_peak_against_samples(k: float, tension: int) -> None:
    found = observed(
        k,
        tension,
        (0.5, 0.1, 0.7, 0.1, 0.4),
        observers={"response": None, "trajectory": {"samples_per_period": 20_000}},
    )
    x = found["trajectory_displacement"][found["trajectory_event"] < 0]
    x = x[np.isfinite(x)]
    assert found["peak_displacement"] == pytest.approx(np.abs(x).max(), rel=1e-7)
    assert found["peak_displacement"] >= np.abs(x).max() * (1 - 1e-15)
    mean = np.trapezoid(x * x) / (len(x) - 1)
    assert found["rms_displacement"] == pytest.approx(math.sqrt(mean), rel=1e-7)


def test_loss_of_an_impact_is_that_of_the_restitution() -> None:
    rigid = {**dict(zip(NAMES, GENERIC, strict=True))}
    arrays, _ = run_lanes([rigid], ["response"], transient=0, periods=1)
    for tension in (0, 1):
        found = observed(1e10, tension, GENERIC, transient=0, periods=1)
        assert found["impact_loss"] == pytest.approx(arrays["impact_loss"][0], rel=1e-3)


def test_impact_section_shows_the_state_after_the_contact() -> None:
    rigid = dict(zip(NAMES, GENERIC, strict=True))
    ask = {"impact_section": {"wall": "left", "samples": 2, "free_mass": True}}
    right, _ = run_lanes([rigid], ask, transient=0, periods=1)
    errors = []
    for k in (1e8, 1e10):
        found = observed(k, 0, GENERIC, observers=ask, transient=0, periods=1)
        errors.append(
            [abs(found[name][0] - right[name][0][0]) for name in ("velocity", "free_velocity")]
        )
    np.testing.assert_allclose(np.divide(*errors), 10.0, rtol=0.1)


def test_bursts_and_trajectory() -> None:
    ask = {
        "bursts": {"records": 3},
        "impacts": None,
        "trajectory": {"samples_per_period": 50, "events": 50},
    }
    found = observed(1e6, 0, QUIET, observers=ask, transient=0, periods=1)
    rows = rows_of(compliant(QUIET, 1e6, 0), compliant(QUIET, 1e6, 0).period)
    listed = rows[rows[:, CAUSE] >= IMPACT]
    kinds = found["trajectory_event"][found["trajectory_event"] >= 0]
    impacts = int((listed[:, CAUSE] == IMPACT).sum())
    assert (kinds == 0).sum() == 2 * impacts
    assert len(kinds) == len(listed) + impacts
    shown = found["trajectory_event"] == 0
    v = found["trajectory_velocity"][shown]
    np.testing.assert_array_equal(v[::2], v[1::2])
    assert found["complete_fraction"] > 0.0
    assert found["burst_complete"][:2].max() == 1.0
    lasting = rows[rows[:, MODE] == STICKING][:, DURATION].sum()
    assert found["sticking_fraction"] == pytest.approx(lasting / compliant(QUIET, 1, 0).period)


def test_a_flight_out_of_the_wall_ends_at_its_surface() -> None:
    """The root was corrected once too few where the rate changes on the way: off by 1e-6 of it."""
    p = Parameters(0.3, 0.0, 1.0, 1e-3, 0.5, contact_stiffness_ratio=1e6)
    run = Trajectory(p, State(0.0, 0.0, 0.0, 0.0))
    rows = np.concatenate([piece.copy() for piece in run.segments(8.0, 0.0)])
    ends = 0
    for row, end in pairwise(rows):
        if row[MODE] == FLIGHT and row[GAP] < 0.0 and end[MODE] == FLIGHT:
            _, _, gap, _ = motion(run.model, row, float(row[DURATION]))
            assert abs(gap) < 1e-16
            ends += 1
    assert ends > 20
