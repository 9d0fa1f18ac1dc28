"""The rigid damper: against 50 digits and closed forms, conservation laws, one rule a case."""

import functools
import math
import random
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from cases import thinned
from event_pairs import KINDS, assert_agree, distance, exact_events, log_of, paired
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mpf
from scipy.linalg import expm
from scipy.optimize import brentq

import damper
from damper import Parameters, State
from damper.engine.segment import (
    CAUSE,
    DURATION,
    FLIGHT,
    GAP,
    GAP_RATE,
    MODE,
    PERIODS,
    RELEASE,
    SIDE,
    STICK,
    STICKING,
    TAIL,
    TIME,
    V_BEFORE,
    V,
    X,
)
from damper.engine.trajectory import Trajectory
from damper.models import start_run

EPS = np.finfo(float).eps
REST = (0.0, 0.0, 0.0, 0.0)


def events(scene: tuple, state: tuple = REST, **settings: Any) -> np.ndarray:
    """Run the engine on a scene (mu, zeta, omega, d, r[, phase])."""
    return damper.events(Parameters(*scene), State(*state), **settings)


# --- against many digits

CHATTER = (0.1, 0.05, 0.2, 0.25, 0.6)


@pytest.mark.parametrize(
    "scene",
    [(0.1, 0.05, 0.8, 1.0, 0.6), (0.1, 0.0, 1.0, 3.0, 0.6), (0.05, 0.2, 0.9, 1.0, 1.0)],
    ids=str,
)
def test_first_twenty_impacts_to_fifty_digits(scene: tuple) -> None:
    found = events(scene, until=200, max_events=20)[:20]
    pairs = paired(found, exact_events(scene, until=found["time"][-1] + 1e-9))
    assert len(pairs) == len(found) == 20
    # Each impact multiplies roundoff, most where they are slow.
    assert_agree(pairs[:5], 3e-14)
    assert_agree(pairs, 2e-12)


def test_a_complete_sequence_and_its_release_to_forty_digits() -> None:
    exact = exact_events(CHATTER, until=60, digits=40)
    pairs = paired(events(CHATTER, until=60), exact)
    assert {event.kind for _, event in pairs} == {"impact", "stick", "release"}
    assert pairs[-1][1] is exact[-1]
    assert_agree(pairs, 5e-13)


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
    scene amplifies roundoff some 500 times, and nothing can be expected of double precision.
    """
    found = events(scene, state, until=until)
    if np.count_nonzero(found["kind"] == 0) > impacts:
        found = found[: np.flatnonzero(found["kind"] == 0)[impacts]]
        until = float(found["time"][-1]) + 1e-9
    exact = exact_events(scene, state, until=until, digits=30)
    phase = scene[5] if len(scene) > 5 else 0.0
    moved = (*scene[:5], phase + mpf(SHIFT))
    other = exact_events(moved, shifted(state), until=until, digits=30)
    near_by = {id(event): near for event, near in zip(exact, other, strict=False)}
    compared = 0
    for row, event in paired(found, exact):
        near = near_by.get(id(event))
        if near is None or (near.kind, near.side) != (event.kind, event.side):
            break
        if distance(near, event) > CHAOS:
            break
        assert_agree([(row, event)], 1e-11)
        compared += 1
    else:
        # Neither run has events that the other lacks.
        assert compared == len(found)
    return compared


#: Corners of the promised range, and cases of their own.
CORNERS = {
    "slow force": ((0.01, 0.5, 1e-3, 0.25, 0.9), (0.0, 0.0, 0.1, 1.0), 20.0),
    "fast force": ((0.1, 0.05, 1e3, 1e-7, 0.6), (0.0, 0.0, 0.0, 1e-3), 0.05),
    "fast force on a swing": ((0.3, 0.1, 1e3, 1e-3, 0.7), (1.0, 0.0, 1.0, 0.0), 1.0),
    "overdamped": ((0.1, 10.0, 0.5, 0.05, 0.8), (0.0, 0.0, 0.0, 1.0), 3.0),
    "light": ((1e-6, 0.05, 0.7, 0.4, 0.6), REST, 40.0),
    "heavy": ((1e18, 0.05, 0.7, 0.4, 0.6), REST, 60.0),
    "heavy, chatter": ((1e6, 0.05, 0.05, 0.1, 0.7), REST, 60.0),
    "undamped at resonance": ((0.1, 0.0, 1.0, 2.0, 0.7), REST, 40.0),
    "next to resonance": ((0.1, 0.0, 1.0 + 1e-9, 2.0, 0.7), REST, 40.0),
    "critical damping": ((0.1, 1.0, 0.3, 0.2, 0.7), REST, 40.0),
    "hardly a clearance": ((0.1, 0.05, 0.8, 1e-9, 0.5), REST, 12.0),
    "wide box": ((0.1, 0.05, 0.8, 500.0, 0.9), (0.0, 0.0, 3.0, 200.0), 90.0),
}


@pytest.mark.parametrize(
    "name", thinned(CORNERS, {"light", "heavy, chatter", "critical damping"}.__contains__)
)
def test_corners_against_thirty_digits(name: str) -> None:
    assert compare(*CORNERS[name]) >= 4


def random_scene(rng: random.Random) -> tuple[tuple, tuple]:
    """Return parameters over the whole range, and a state inside the box."""
    zeta = rng.choice([0.0, 10 ** rng.uniform(-3, 1), 10 ** rng.uniform(-3, 0)])
    omega = rng.choice([1.0] + 9 * [10 ** rng.uniform(-1.3, 1)])
    size = 1 / max(math.hypot(1 - omega**2, 2 * zeta * omega), 0.2)
    mu = 10 ** rng.uniform(-4, 2)
    d = size * 10 ** rng.uniform(-2, 0.3)
    r = rng.choice([0.0, 1.0] + 4 * [rng.random()])
    x, v = rng.uniform(-1, 1) * size, rng.uniform(-1, 1) * size * omega
    y, u = x + rng.uniform(-1, 1) * d, rng.uniform(-1, 1) * size * omega
    return (mu, zeta, omega, d, r, rng.uniform(-4, 4)), (x, v, y, u)


@pytest.mark.parametrize(
    ("seed", "scenes"), [(0, 3), pytest.param(1, 100, marks=pytest.mark.exhaustive)]
)
def test_random_scenes_against_thirty_digits(seed: int, scenes: int) -> None:
    rng = random.Random(seed)
    compared = 0
    for _ in range(scenes):
        scene, state = random_scene(rng)
        compared += compare(scene, state, until=min(100.0 / scene[2], 100.0), impacts=12)
    assert compared >= 6 * scenes


def test_slow_chatter_to_what_a_double_position_allows() -> None:
    """At omega = 1e-3 all but the time scale is small: speeds 1e-3, accelerations 1e-6, jerk 1e-9.

    Roundoff of x alone moves the release by eps / jerk, an impact by eps / approach speed.
    """
    omega = 1e-3
    scene, state = (0.1, 0.5, omega, 0.05, 0.4, 1.5), (1.0, 7e-5, 1.0, 7e-5)
    exact = exact_events(scene, state, until=1700, digits=25)
    pairs = paired(events(scene, state, until=1700.0), exact)
    assert [row["kind"] for row, _ in pairs][-2:] == [1, 2]
    assert_agree(pairs[:-1], 1e-12 / omega)
    assert_agree(pairs[-1:], 4 * EPS / omega**3)


# --- the accuracy setting


@functools.cache
def completion_time(scene: tuple) -> float:
    """Return the end of the first complete chatter sequence from rest."""
    found = events(scene, until=50.0)
    near = found["time"][found["kind"] == 1][0]
    exact = exact_events(scene, until=near + 0.1, digits=25)
    return next(float(event.time) for event in exact if event.kind == "stick")


@pytest.mark.parametrize("accuracy", [1e-3, 1e-11])
@pytest.mark.parametrize("scene", [CHATTER, (5.0, 0.3, 0.4, 0.1, 0.8)])
def test_accuracy_is_the_error_of_the_completion_time(scene: tuple, accuracy: float) -> None:
    """And of nothing else: what lies before the tail is bit-identical."""
    fine = events(scene, until=50.0)
    coarse = events(scene, until=50.0, accuracy=accuracy)
    stick = coarse["time"][coarse["kind"] == 1][0]
    assert abs(stick - completion_time(scene)) <= accuracy + 5e-13
    same = min(np.argmax(fine["kind"] == 1), np.argmax(coarse["kind"] == 1))
    assert same >= 3
    assert np.array_equal(coarse[:same], fine[:same])


def test_nothing_is_closed_that_still_meets_the_other_wall() -> None:
    """With hardly any clearance the speed is small enough for that some 30 impacts before."""
    scene, state = (0.1, 0.24, 0.035, 1e-12, 0.7, 2.96), (-2.6, -2.0, -2.6, 0.8)
    found = events(scene, state, until=1e-4)
    exact = exact_events(scene, state, until=1e-4, digits=30)
    stick = next(float(event.time) for event in exact if event.kind == "stick")
    assert found["time"][found["kind"] == 1].tolist() == pytest.approx([stick], abs=1e-12)


# --- conservation laws over the whole range


def powers(low: float, high: float) -> st.SearchStrategy[float]:
    """Floats spread evenly over decades."""
    return st.floats(low, high).map(lambda k: 10.0**k)


parameters = st.builds(
    Parameters,
    mass_ratio=powers(-4, 2),
    damping_ratio=st.one_of(st.just(0.0), st.just(1.0), powers(-3, 1)),
    frequency_ratio=st.one_of(st.just(1.0), powers(-1, 1)),
    clearance=powers(-2, 0.5),
    restitution=st.one_of(st.just(0.0), st.just(1.0), st.floats(0, 0.95)),
    phase=st.floats(-3.2, 3.2),
)
starts = st.tuples(st.floats(-2, 2), st.floats(-2, 2), st.floats(-1, 1), st.floats(-2, 2))
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)


def work(p: Parameters, run: Trajectory, row: np.ndarray) -> tuple[float, float]:
    """Return the work of force and dashpot over a segment, and the sum of its sizes."""
    rate = 1.0 + p.frequency_ratio + 2.0 * p.damping_ratio
    cuts = np.linspace(0.0, row[DURATION], 1 + max(1, math.ceil(rate * row[DURATION])))
    total = size = 0.0
    for start, end in pairwise(cuts.tolist()):
        for node, weight in zip(NODES.tolist(), WEIGHTS.tolist(), strict=True):
            tau = start + 0.5 * (1.0 + node) * (end - start)
            _, v, _, _ = run.motion_in(row, tau)
            force = math.sin(p.frequency_ratio * (row[TIME] + tau) + p.phase)
            loss = 2.0 * p.damping_ratio * v
            total += 0.5 * (end - start) * weight * (force - loss) * v
            size += 0.5 * (end - start) * weight * (abs(force) + abs(loss)) * abs(v)
    return total, size


@settings(max_examples=20)
@given(p=parameters, start=starts)
def test_energy_and_place(p: Parameters, start: tuple) -> None:
    """In each flight and each stretch of sticking, from the motion inside it.

    Energy changes by the work of force and dashpot. The free mass flies straight and stays in its
    box; it sticks while the wall presses. (What happens at impacts: tests/engine/test_impact.py.)
    """
    x, v, place, u = start
    run = start_run(p, State(x, v, x + place * p.clearance, u), max_events=300)
    mu, d = p.mass_ratio, p.clearance
    for row, following in pairwise(log_of(run, 12.0)):
        side, whole = row[SIDE], float(row[DURATION])
        path = []
        for part in (np.linspace(0.0, 1.0, 21) ** 2).tolist():
            x, v, gap, rate = run.motion_in(row, part * whole)
            path.append((part * whole, x, v, x + side * (d - gap), v - side * rate))
        if row[MODE] == TAIL:
            continue
        _, x, v, y, u = first = path[0]
        _, x1, v1, _, u1 = last = path[-1]
        before, after = (0.5 * (z[2] ** 2 + z[1] ** 2 + mu * z[4] ** 2) for z in (first, last))
        done, size = work(p, run, row)
        assert abs(after - before - done) <= 2e-13 * (before + after + size)
        # The next segment begins where this one ends.
        length = 1e-14 * (1.0 + abs(x1) + d) * (1.0 + abs(v1) + abs(u1))
        assert abs(following[X] - x1) <= length
        assert abs(following[V_BEFORE] - v1) <= 4 * EPS * (1.0 + abs(v1) + abs(u1))
        for tau, x, v, y_now, u_now in path:
            if row[MODE] == FLIGHT:
                assert abs(u_now - u) <= 1e-14 * (1.0 + abs(v) + abs(u))
                # Placed by its own straight flight, not by the clipped gap.
                assert abs(y + u * tau - x) - d <= 1e-12 * (1 + abs(x))
                continue
            assert u_now == v
            assert abs(y_now - x) == pytest.approx(d, abs=1e-15 * (1 + abs(x)))
            force = math.sin(p.frequency_ratio * (row[TIME] + tau) + p.phase)
            thrust = -side * (force - 2.0 * p.damping_ratio * v - x)
            size = 1.0 + 2.0 * p.damping_ratio * abs(v) + abs(x)
            angle = p.frequency_ratio * (row[TIME] + tau)
            assert thrust >= -8 * EPS * size * (1 + angle)


# --- cases that have a rule each


def test_plastic_impact_sticks_at_the_same_time_or_flies() -> None:
    _, zeta, omega, _, _ = p = (0.1, 0.05, 2.0, 0.3, 0.0)
    found = events(p, until=400.0)
    impacts = np.flatnonzero(found["kind"] == 0)[:-1]
    stuck = 0
    for k in impacts:
        row, following = found[k], found[k + 1]
        force = math.sin(omega * row["time"]) - 2.0 * zeta * row["v"] - row["x"]
        if -row["side"] * force > 0:
            assert (following["kind"], following["side"]) == (1, row["side"])
            assert following["time"] == row["time"]
            assert (following["x"], following["v"]) == (row["x"], row["v"])
            stuck += 1
        else:
            assert following["kind"] == 0
            assert following["time"] > row["time"]
    assert 3 < stuck < len(impacts)


def test_elastic_impacts_never_stick() -> None:
    found = events((0.1, 0.05, 0.2, 0.25, 1.0), until=1e9, max_events=2000)
    assert set(found["kind"][:-1]) == {0}
    assert (found["kind"] == 0).sum() == 2000


@pytest.mark.parametrize(("zeta", "u"), [(0.05, -0.2), (2.0, 0.7)])
def test_no_clearance_moves_as_one(zeta: float, u: float) -> None:
    """No events; the pair is the oscillator of mass 1 + mu, started with the momentum kept."""
    p = Parameters(0.4, zeta, 0.8, 0.0, 0.6, 0.3)
    start = State(0.3, -0.2, 0.3, u)
    assert len(damper.events(p, start, until=100.0)) == 0
    run = start_run(p, start)
    log = log_of(run, 100.0)
    assert set(log[:, MODE]) == {STICKING}
    matrix = np.zeros((4, 4))
    matrix[0, 1] = 1.0
    matrix[1, :3] = np.array([-1.0, -2.0 * zeta, 1.0]) / 1.4
    matrix[2, 3], matrix[3, 2] = 0.8, -0.8
    z0 = np.array([0.3, (-0.2 + 0.4 * u) / 1.4, math.sin(0.3), math.cos(0.3)])
    for row in log:
        for part in (0.0, 0.4, 1.0):
            time = row[PERIODS] * p.cycle + row[TIME] + part * row[DURATION]
            x, v, gap, rate = run.motion_in(row, part * row[DURATION])
            assert (gap, rate) == (0.0, 0.0)
            assert (x, v) == pytest.approx((expm(time * matrix) @ z0)[:2], abs=1e-12)


SCENE = (0.1, 0.05, 0.2, 0.5, 0.6)


@pytest.mark.parametrize("side", [1, -1])
def test_start_on_a_wall_approaching_is_an_impact_at_once(side: int) -> None:
    first = events(SCENE, (0.0, 0.0, 0.5 * side, 0.25 * side), until=1.0)[0]
    assert (first["time"], first["kind"], first["side"]) == (0.0, 0, side)
    assert first["approach_speed"] == 0.25
    assert first["v"] == pytest.approx(side * 0.1 * 1.6 / 1.1 * 0.25, rel=1e-15)


@pytest.mark.parametrize(
    ("state", "kinds"),
    [
        ((1, 0, 1.5, 0), [1]),
        ((1, 0, 0.5, 0), [0]),
        ((0, 0, 0.5, 0), [0]),
        ((0, 0, -0.5, 0), [1, 2]),
    ],
)
def test_start_on_a_wall_at_rest_sticks_or_flies_by_the_sign(state: tuple, kinds: list) -> None:
    """Neither counts as an impact; at zero acceleration the third derivative decides."""
    found = events(SCENE, state, until=12.0)
    exact = exact_events(SCENE, state, until=12, digits=25)
    assert found["kind"][: len(kinds)].tolist() == kinds
    for row, event in zip(found[:2], exact, strict=False):
        assert row["kind"] == KINDS[event.kind]
        assert row["time"] == pytest.approx(float(event.time), abs=1e-12)


def test_roundoff_outside_the_wall_is_on_the_wall() -> None:
    x = 1.0 / 3.0
    y = math.nextafter(math.nextafter(x + 0.1, 9.0), 9.0)
    p = Parameters(0.1, 0.05, 0.2, 0.1, 0.6)
    assert y - x > 0.1
    row = log_of(start_run(p, State(x, 0.0, y, 0.0)), 0.1)[0]
    assert (row[GAP], row[SIDE]) == (0.0, 1.0)
    with pytest.raises(ValueError, match="outside the box"):
        start_run(p, State(x, 0.0, y + 1e-12, 0.0))


@pytest.mark.parametrize(("zeta", "omega"), [(0.05, 1.7), (1.5, 0.9)])
def test_grazing(zeta: float, omega: float) -> None:
    """The free mass rests at 0; with the wall just beyond max|x| nothing ever happens."""
    until = 30.0
    rates = np.roots([1.0, 2.0 * zeta, 1.0]).astype(complex)
    gain = 1 / complex(1 - omega**2, 2 * zeta * omega)
    shares = np.linalg.solve([[1, 1], rates], [-gain.imag, -omega * gain.real])

    def motion(time: Any) -> tuple[Any, Any]:
        free = shares * np.exp(np.multiply.outer(time, rates))
        steady = gain * np.exp(1j * omega * np.asarray(time))
        return free.sum(-1).real + steady.imag, (free @ rates).real + omega * steady.real

    times = np.linspace(0.0, until, 3001)
    speeds = motion(times)[1]
    crests = [
        brentq(lambda t: motion(t)[1], *times[k : k + 2], xtol=1e-14)
        for k in np.flatnonzero(speeds[1:-1] * speeds[2:] < 0.0) + 1
    ]
    peak = float(np.abs(motion(np.array(crests))[0]).max())
    for off in (1e-3, 1e-6, 1e-9, 1e-11):
        assert len(events((0.1, zeta, omega, peak * (1.0 + off), 0.5), until=until)) == 0
        first = events((0.1, zeta, omega, peak * (1.0 - off), 0.5), until=until)[0]
        assert first["kind"] == 0
        # At depth h under the crest the speed is sqrt(2 |x''| h).
        assert 0.0 < first["approach_speed"] < 4.0 * (1.0 + omega) * math.sqrt(off) * peak


# --- lift-off


def test_lift_off_is_of_third_order() -> None:
    """After a release the gap is j tau^3 / 6, without noise and without an impact at once."""
    run = start_run(Parameters(*CHATTER))
    log = log_of(run, 60.0)
    k = int(np.argmax(log[:, CAUSE] == RELEASE))
    row = log[k]
    assert (row[MODE], row[GAP], row[GAP_RATE]) == (FLIGHT, 0.0, 0.0)
    assert (log[k - 1, MODE], log[k - 1, CAUSE]) == (STICKING, STICK)
    assert row[DURATION] > 0.5
    jerk = row[SIDE] * (0.2 * math.cos(0.2 * row[TIME]) - row[V])  # x'' = 0
    assert jerk > 0.0
    for tau in (1e-1, 1e-2, 1e-3):
        gap = run.motion_in(row, tau)[2]
        assert gap == pytest.approx(jerk * tau**3 / 6.0, rel=0.3 * tau + 1e-4)


@pytest.mark.parametrize("side", [1, -1])
def test_contact_with_zero_acceleration_and_jerk(side: int) -> None:
    """x'' = x''' = x'''' = 0 exactly; the fifth derivative decides: right sticks, left flies."""
    found = events((0.1, 0.0, 0.5, 0.25, 0.6), (0.0, 0.5, 0.25 * side, 0.5), until=10.0)
    assert len(found) < 20
    early = found[found["time"] < 0.5]
    assert set(early["side"]) <= {side}
    assert (side == 1) == (early["kind"].tolist() == [1])


def test_heavy_damping_releases_for_good() -> None:
    """A release is x'' = 0, whatever velocity sticking began with; time does not go back."""
    draw = random.Random(1)
    releases = 0
    for _ in range(15):
        zeta = 10 ** draw.uniform(0, 1)
        p = Parameters(
            mass_ratio=10 ** draw.uniform(-3, 2),
            damping_ratio=zeta,
            frequency_ratio=10 ** draw.uniform(-3, 1),
            clearance=10 ** draw.uniform(-9, -2) / zeta,
            restitution=draw.choice([0, 0.3, 0.6, 0.9]),
            phase=draw.uniform(-3, 3),
        )
        v = draw.uniform(-1, 1)
        run = start_run(p, State(-1.0, v, -1.0, 2.0 * v), max_events=300)
        log = log_of(run, 3 * p.cycle)
        assert (np.diff(log[:, PERIODS] * p.cycle + log[:, TIME]) >= 0.0).all(), p
        for row in log[log[:, CAUSE] == RELEASE]:
            releases += 1
            force = math.sin(p.phase + p.frequency_ratio * row[TIME]) - row[X]
            size = 1.0 + abs(row[X]) + 2.0 * zeta * abs(row[V])
            assert abs(force - 2.0 * zeta * row[V]) < 8 * EPS * size * (1 + p.frequency_ratio)
    assert releases > 15
