"""`damper.events` against independent solutions: known numbers, 40 digits, brute force, DOP853."""

import functools
import math
import random
from typing import Any

import numpy as np
import pytest
from event_pairs import KINDS, assert_agree, distance, paired
from mpmath import mp, mpf
from reference import dop853, fine_step
from reference.accumulation import accumulation_time

import damper
from damper.sweep.events import EVENT
from damper.verification.comparison import reference_rigid as mp_reference

IMPACT, STICK, RELEASE, STOPPED = range(4)


def events(scene: tuple, state: tuple = (0.0, 0.0, 0.0, 0.0), **settings: Any) -> np.ndarray:
    """Run the engine on a scene (mu, zeta, omega, d, r[, phase])."""
    return damper.events(damper.Parameters(*scene), damper.State(*state), **settings)


def of_kind(found: np.ndarray, kind: int) -> np.ndarray:
    """Return the rows of one kind."""
    return found[found["kind"] == kind]


# --- the known numbers of the model's notes

CHATTER = (0.1, 0.05, 0.2, 0.25, 0.6)
LOW_RESTITUTION = (0.1, 0.05, 0.2, 0.25, 0.3)


def test_known_impacts_burst_and_release() -> None:
    found = events(CHATTER, until=47.0)
    impacts = of_kind(found, IMPACT)
    assert impacts["side"][:3].tolist() == [-1, 1, 1]
    printed = [2.15860318928243951, 5.25460925811892195, 14.2978156676934251]
    assert np.abs(impacts["time"][:3] - printed).max() < 1e-13
    (stick,), (release,) = of_kind(found, STICK), of_kind(found, RELEASE)
    assert (stick["side"], release["side"]) == (1, 1)
    assert abs(stick["time"] - 44.249718778208865) < 1e-11
    assert abs(release["time"] - 46.2709500002439) < 1e-11


def test_known_scene_to_forty_digits() -> None:
    """Each impact down to the tail, the stick and the release: 1e-12, ten times the targets."""
    exact = mp_reference.events(*CHATTER, until=60, dps=40)
    pairs = paired(events(CHATTER, until=60), exact)
    assert {event.kind for _, event in pairs} == set(KINDS)
    assert pairs[-1][1] is exact[-1]
    assert_agree(pairs, 1e-12)


def test_low_restitution_burst_and_release() -> None:
    found = events(LOW_RESTITUTION, until=20.0)
    assert abs(of_kind(found, STICK)["time"][0] - 17.868561780955439) < 1e-11
    assert abs(of_kind(found, RELEASE)["time"][0] - 18.992457098508703) < 1e-11


def test_low_restitution_has_399_complete_bursts_in_200_periods() -> None:
    period = damper.Parameters(*LOW_RESTITUTION).period
    found = events(LOW_RESTITUTION, until=200 * period)
    assert len(of_kind(found, STICK)) == 399


ON_WALL = (0.5, 0.2, 0.3, 0.6)  # mass ratio, zeta, omega, r; at t = 2, x = 2, x' = .1


@pytest.mark.parametrize(("w", "printed"), [(0.01, 0.0340400694), (0.005, 0.0169819753)])
def test_accumulation_of_a_burst_on_the_right_wall(w: float, printed: float) -> None:
    mu, zeta, omega, r = ON_WALL
    state = (2.0, 0.1, 2.5, 0.1 - w, 2.0)
    found = events((mu, zeta, omega, 0.5, r), state, until=2.1)
    stick = of_kind(found, STICK)[0]
    before = found[found["time"] < stick["time"]]
    assert len(before) > 5
    assert np.all((before["kind"] == IMPACT) & (before["side"] == 1))
    assert abs(stick["time"] - 2.0 - printed) < 0.51e-10
    exact = accumulation_time(
        *ON_WALL, time=2, position=2, velocity=0.1, rebound_speed=mpf(0.1) - mpf(0.1 - w)
    )
    assert abs(stick["time"] - 2.0 - float(exact)) < 2e-13


@functools.cache
def completion_time(scene: tuple) -> float:
    """Return the end of the first complete burst from rest."""
    near = of_kind(events(scene, until=50.0), STICK)["time"][0]
    exact = mp_reference.events(*scene, until=near + 0.1, dps=25, burst_floor=1e-13)
    return next(float(event.time) for event in exact if event.kind == "stick")


@pytest.mark.parametrize("accuracy", [1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13, 1e-15])
@pytest.mark.parametrize("scene", [CHATTER, LOW_RESTITUTION, (5.0, 0.3, 0.4, 0.1, 0.8)])
def test_accuracy_is_the_error_of_the_accumulation_time(scene: tuple, accuracy: float) -> None:
    """And of nothing else: what lies before the tail is bit-identical."""
    fine = events(scene, until=50.0)
    coarse = events(scene, until=50.0, accuracy=accuracy)
    first = completion_time(scene)
    stick = of_kind(coarse, STICK)["time"][0]
    assert abs(stick - first) <= accuracy + 5e-13
    same = min(np.argmax(fine["kind"] == STICK), np.argmax(coarse["kind"] == STICK))
    assert same >= 3
    assert np.array_equal(coarse[:same], fine[:same])


def test_accuracy_buys_shorter_bursts() -> None:
    rows = [len(events(CHATTER, until=46.0, accuracy=a)) for a in (1e-3, 1e-6, 1e-9, 1e-12, 1e-15)]
    assert rows == sorted(set(rows))


# --- random scenes against 40 digits, event by event


def random_scene(rng: random.Random) -> tuple[tuple, tuple]:
    """Return parameters over the whole range, and a state inside the box."""
    zeta = rng.choice([0.0, 10 ** rng.uniform(-3, 0.5), 10 ** rng.uniform(-3, 0)])
    omega = rng.choice([1.0] + 9 * [10 ** rng.uniform(-1.3, 1)])
    size = 1 / max(math.hypot(1 - omega**2, 2 * zeta * omega), 0.2)
    mu = 10 ** rng.uniform(-4, 2)
    d = size * 10 ** rng.uniform(-2, 0.3)
    r = rng.choice([0.0, 1.0] + 4 * [rng.random()])
    x, v = rng.uniform(-1, 1) * size, rng.uniform(-1, 1) * size * omega
    y, u = x + rng.uniform(-1, 1) * d, rng.uniform(-1, 1) * size * omega
    return (mu, zeta, omega, d, r, rng.uniform(-4, 4)), (x, v, y, u)


SHIFT = 1e-14  # of the perturbed run: relative in the state, absolute in the phase
CHAOS = 5e-12  # where the perturbed run has left the exact one by this much, comparing ends


def shifted(state: tuple) -> tuple:
    """Return the state with its primary and the relative motion moved by SHIFT of themselves."""
    x, v, y, u = (mpf(value) for value in state)
    grow = 1 + mpf(SHIFT)
    return x * grow, v / grow, x * grow + (y - x) / grow, v / grow + (u - v) * grow


def compare(scene: tuple, state: tuple, until: float, impacts: int = 15) -> int:
    """Compare with the reference as far as the scene's own sensitivity allows; count the events.

    A second reference run starts SHIFT away. Where the two runs differ by more than CHAOS the
    scene amplifies rounding some 500 times, and nothing can be expected of double precision.
    """
    phase = scene[5] if len(scene) > 5 else 0.0
    found = events(scene, state, until=until)
    if np.count_nonzero(found["kind"] == IMPACT) > impacts:
        last = np.flatnonzero(found["kind"] == IMPACT)[impacts]
        found = found[:last]
        until = float(found["time"][-1]) + 1e-9
    exact = mp_reference.events(*scene, state=state, until=until, dps=30, burst_floor=1e-16)
    other = mp_reference.events(
        *scene[:5],
        phase + mpf(SHIFT),
        state=shifted(state),
        until=until,
        dps=30,
        burst_floor=1e-16,
    )
    twin = {id(event): twin for event, twin in zip(exact, other, strict=False)}
    compared = 0
    for row, event in paired(found, exact):
        near = twin.get(id(event))
        if near is None or (near.kind, near.side) != (event.kind, event.side):
            break
        if distance(near, event) > CHAOS:
            break
        assert (row["kind"], row["side"]) == (KINDS[event.kind], event.side)
        assert distance(row, event) <= 1e-11
        compared += 1
    else:
        # Neither run has events that the other lacks.
        assert compared == len(found)
    return compared


@pytest.mark.parametrize("part", range(8))
def test_random_scenes_against_forty_digits(part: int) -> None:
    rng = random.Random(part)
    compared = 0
    for _ in range(4):
        scene, state = random_scene(rng)
        compared += compare(scene, state, until=min(250.0 / scene[2], 150.0))
    assert compared >= 25


EXTREMES = {
    "slow force": ((0.01, 0.5, 1e-3, 0.25, 0.9), (0.0, 0.0, 0.1, 1.0), 20.0),
    "fast force": ((0.1, 0.05, 1e3, 1e-7, 0.6), (0.0, 0.0, 0.0, 1e-3), 0.05),
    "fast force on a swinging primary": ((0.3, 0.1, 1e3, 1e-3, 0.7), (1.0, 0.0, 1.0, 0.0), 1.0),
    "overdamped": ((0.1, 10.0, 0.5, 0.05, 0.8), (0.0, 0.0, 0.0, 1.0), 3.0),
    "tiny free mass": ((1e-6, 0.05, 0.7, 0.4, 0.6), (0.0, 0.0, 0.0, 0.0), 60.0),
    "huge free mass": ((1e6, 0.05, 0.7, 0.4, 0.6), (0.0, 0.0, 0.0, 0.0), 60.0),
    "huge free mass, chatter": ((1e6, 0.05, 0.05, 0.1, 0.7), (0.0, 0.0, 0.0, 0.0), 60.0),
    "undamped at resonance": ((0.1, 0.0, 1.0, 2.0, 0.7), (0.0, 0.0, 0.0, 0.0), 60.0),
    "next to resonance": ((0.1, 0.0, 1.0 + 1e-9, 2.0, 0.7), (0.0, 0.0, 0.0, 0.0), 60.0),
    "critical damping": ((0.1, 1.0, 0.3, 0.2, 0.7), (0.0, 0.0, 0.0, 0.0), 60.0),
    "no clearance to speak of": ((0.1, 0.05, 0.8, 1e-9, 0.5), (0.0, 0.0, 0.0, 0.0), 12.0),
    "wide box": ((0.1, 0.05, 0.8, 500.0, 0.9), (0.0, 0.0, 3.0, 200.0), 90.0),
}


@pytest.mark.parametrize("name", EXTREMES)
def test_extreme_scenes_against_forty_digits(name: str) -> None:
    scene, state, until = EXTREMES[name]
    assert compare(scene, state, until) >= 4


def test_slow_chatter_to_what_a_double_position_allows() -> None:
    """At omega = 1e-3 all but the time scale is small: speeds 1e-3, accelerations 1e-6, jerk 1e-9.

    Rounding of x alone moves the release by eps / jerk, an impact by eps / approach speed.
    """
    omega = 1e-3
    scene, state = (0.1, 0.5, omega, 0.05, 0.4, 1.5), (1.0, 7e-5, 1.0, 7e-5)
    exact = mp_reference.events(*scene, state=state, until=1700, dps=25, burst_floor=1e-13)
    found = events(scene, state, until=1700.0)
    pairs = paired(found, exact)
    assert [row["kind"] for row, _ in pairs][-2:] == [STICK, RELEASE]
    assert_agree(pairs[:-1], 1e-12 / omega)
    assert_agree(pairs[-1:], 4 * np.finfo(float).eps / omega**3)


# --- brute force and DOP853, without chatter

PLAIN_SCENES = {
    "plain": (0.1, 0.05, 0.8, 1.0, 0.6),
    "undamped resonance": (0.1, 0.0, 1.0, 3.0, 0.6),
    "over-damped": (0.2, 3.0, 0.5, 0.2, 0.9),
    "heavy free mass": (2.0, 0.1, 1.3, 0.5, 0.8),
    "elastic": (0.05, 0.2, 0.9, 1.0, 1.0),
}


@pytest.mark.parametrize("method", [fine_step, dop853], ids=["brute force", "DOP853"])
@pytest.mark.parametrize("name", PLAIN_SCENES)
def test_against_numerical_integration(name: str, method: Any) -> None:
    scene = PLAIN_SCENES[name]
    impacts = of_kind(events(scene, until=50.0), IMPACT)[:15]
    hits = method.impacts(*scene, until=impacts["time"][-1] + 0.01)
    assert [hit.side for hit in hits] == impacts["side"].tolist()
    late = np.abs(impacts["time"] - [hit.time for hit in hits])
    fast = np.abs(impacts["approach_speed"] - [hit.approach_speed for hit in hits])
    assert max(*late[:5], *fast[:5]) < 1e-11
    assert max(*late, *fast) < 1e-9


# --- symmetries


SYMMETRIC_SCENES = [
    ((0.1, 0.05, 0.2, 0.25, 0.6, 0.4), (0.1, -0.2, 0.15, 0.3)),
    ((0.3, 0.0, 1.0, 0.8, 0.9, -2.0), (1.0, 0.3, 0.4, -0.8)),
    ((20.0, 2.0, 3.0, 0.02, 0.2, 1.0), (0.05, 0.1, 0.04, 0.2)),
]


@pytest.mark.parametrize(("scene", "state"), SYMMETRIC_SCENES)
def test_mirror_symmetry(scene: tuple, state: tuple) -> None:
    """(x, y) -> -(x, y) with the force reversed gives the same run on the other walls."""
    here = events(scene, state, until=25.0)[:20]
    there = events((*scene[:5], scene[5] + math.pi), tuple(-s for s in state), until=25.0)[:20]
    assert len(here) >= 5
    assert here["kind"].tolist() == there["kind"].tolist()
    assert here["side"].tolist() == (-there["side"]).tolist()
    for name, sign in (("time", 1), ("approach_speed", 1), ("x", -1), ("v", -1)):
        # phase + pi is rounded, and chaos carries that on tenfold in every three impacts.
        difference = np.abs(here[name] - sign * there[name])
        assert difference[:6].max() < 2e-14
        assert (difference < 2e-15 * 10.0 ** (np.arange(len(difference)) / 3.0)).all()


@pytest.mark.parametrize(("scene", "state"), SYMMETRIC_SCENES)
@pytest.mark.parametrize("periods", [1, 4, 1024, -2, 2**40])
def test_a_start_whole_periods_later_changes_nothing(
    scene: tuple, state: tuple, periods: int
) -> None:
    """Bit-identical for powers of two, as the shift itself is exact then; only the times blur."""
    shift = periods * damper.Parameters(*scene).period
    here = events(scene, state, until=25.0)[:20]
    there = events(scene, (*state, shift), until=shift + 25.0)[:20]
    for name in ("kind", "side", "approach_speed", "x", "v", "time_in_period"):
        assert np.array_equal(here[name], there[name])
    assert np.array_equal(here["period"] + periods, there["period"])
    assert np.abs(here["time"] - (there["time"] - shift)).max() <= 4 * np.spacing(abs(shift) + 25)


def test_a_start_at_another_time_is_another_phase() -> None:
    scene, state = SYMMETRIC_SCENES[0]
    late = events(scene, (*state, 3.7), until=30.0)[:8]
    turned = events((*scene[:5], scene[5] + scene[2] * 3.7), state, until=26.3)[:8]
    assert late["kind"].tolist() == turned["kind"].tolist()
    assert np.abs(late["time"] - 3.7 - turned["time"]).max() < 1e-12


def test_a_whole_turn_of_phase_changes_next_to_nothing() -> None:
    scene, state = SYMMETRIC_SCENES[0]
    here = events(scene, state, until=20.0)
    there = events((*scene[:5], scene[5] + 2 * math.pi), state, until=20.0)
    assert np.abs(here["time"] - there["time"]).max() < 1e-13


# --- the array, its end and its errors


def test_rows_are_in_order_and_within_the_run() -> None:
    found = events(CHATTER, until=200.0)
    assert found.dtype == EVENT
    assert found.dtype.names == (
        *("time", "kind", "side", "approach_speed", "x", "v"),
        *("period", "time_in_period"),
    )
    assert np.all(np.diff(found["time"]) >= 0)
    assert 0 <= found["time"][0] <= found["time"][-1] <= 200.0
    assert set(np.abs(found["side"])) == {1}
    assert np.all((found["approach_speed"] > 0) == (found["kind"] == IMPACT))
    after_stick = np.flatnonzero(found["kind"] == STICK) + 1
    assert np.all(found["kind"][after_stick[after_stick < len(found)]] == RELEASE)


def test_an_event_at_the_end_still_counts() -> None:
    first = events(CHATTER, until=3.0)[0]
    assert len(events(CHATTER, until=float(first["time"]))) == 1
    assert len(events(CHATTER, until=np.nextafter(first["time"], 0))) == 0


@pytest.mark.parametrize("max_events", [1, 2, 5, 30, 34])
def test_max_events_ends_with_a_stopped_row(max_events: int) -> None:
    whole = events(CHATTER, until=60.0)
    found = events(CHATTER, until=60.0, max_events=max_events)
    assert len(found) == max_events + 1
    assert np.array_equal(found[:-1], whole[:max_events])
    last = found[-1]
    assert (last["kind"], last["side"], last["approach_speed"]) == (STOPPED, 0, 0.0)
    # It stops where the next event would be: same place, just before it.
    following = whole[max_events]
    assert last["time"] == pytest.approx(following["time"], abs=1e-13)
    assert last["x"] == pytest.approx(following["x"], abs=1e-13)


def test_max_events_that_suffice_leave_no_stopped_row() -> None:
    whole = events(CHATTER, until=60.0)
    assert np.array_equal(events(CHATTER, until=60.0, max_events=len(whole)), whole)
    assert STOPPED not in whole["kind"]
    assert events(CHATTER, until=60.0, max_events=len(whole) - 1)["kind"][-1] == STOPPED


def test_no_events_is_an_empty_array() -> None:
    assert events((0.1, 0.05, 0.8, 100.0, 0.5), until=50.0).shape == (0,)
    assert events(CHATTER, until=0.0).shape == (0,)


@pytest.mark.parametrize("until", [math.nan, math.inf, -1.0])
def test_until_is_checked(until: float) -> None:
    with pytest.raises(ValueError, match=f"^until = {until!r}: must be a finite time >= 0.0"):
        events(CHATTER, until=until)
    with pytest.raises(ValueError, match=r"^until = 1.0: must be a finite time >= 2.0"):
        events(CHATTER, (0.0, 0.0, 0.0, 0.0, 2.0), until=1.0)


@pytest.mark.parametrize("accuracy", [0.0, -1e-12, 1e-2, math.nan, math.inf])
def test_accuracy_is_checked(accuracy: float) -> None:
    with pytest.raises(ValueError, match=r"^accuracy = .*: must be a number from 1e-15 to 1e-3$"):
        events(CHATTER, until=1.0, accuracy=accuracy)


@pytest.mark.parametrize("max_events", [0, -3, 2.5])
def test_max_events_is_checked(max_events: float) -> None:
    with pytest.raises(ValueError, match=r"^max_events = .*: must be a whole number >= 1$"):
        events(CHATTER, until=1.0, max_events=max_events)


def test_a_state_outside_the_box_is_refused() -> None:
    with pytest.raises(ValueError, match=r"\|y - x\| = 0.3 .*clearance = 0.25"):
        events(CHATTER, (0.0, 0.0, -0.3, 0.0), until=1.0)


def test_parameters_may_be_any_numbers() -> None:
    """mpf decimals for the reference, ints and NumPy scalars for the engine."""
    assert len(events((np.float64(0.1), 0, 1, np.int32(2), 1), until=20)) > 0
    with mp.workdps(30):
        assert mp_reference.events(mpf("0.1"), 0, 1, 2, 1, until=20, dps=20)


@pytest.mark.parametrize(
    ("slip", "message"),
    [
        ({"parameters": {}}, "parameters = {}: must be damper.Parameters or SIParameters"),
        ({"state": (0, 0, 0, 0)}, r"state = \(0, 0, 0, 0\): must be a damper.State"),
        ({"until": "x"}, "until = 'x': must be a real number"),
    ],
)
def test_slips_are_named(slip: dict[str, Any], message: str) -> None:
    given: dict[str, Any] = {"parameters": damper.Parameters(*CHATTER), "until": 1.0}
    with pytest.raises(TypeError, match=message):
        damper.events(**(given | slip))
