"""The segment log of one run: conservation laws, ordinary cases, long runs, resuming."""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference.two_impacts import two_impacts
from scipy.linalg import expm

import damper
from damper import Parameters, State
from damper.comparison import reference_rigid as mp_reference
from damper.engine.compiled import COMPILED
from damper.engine.segment import (
    CAUSE,
    COLUMNS,
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
    SIDE,
    SPEED,
    STICK,
    STICKING,
    TAIL,
    TIME,
    TOO_MANY_EVENTS,
    V,
    X,
)
from damper.engine.trajectory import Trajectory
from damper.models import motion

EPS = np.finfo(float).eps
# Error of the energy lost in a tail, whose bounces are those of a constant push (2e-5 measured).
TAIL_PART = 1e-3
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)


def log_of(run: Trajectory, until: float, rows: int = 1024) -> np.ndarray:
    """Return all segments up to a time in one array."""
    buffer = np.empty((rows, COLUMNS))
    pieces = [piece.copy() for piece in run.segments(*run.whole_periods(until), buffer)]
    return np.concatenate(pieces)


class Both(NamedTuple):
    """Position and velocity of the primary, then of the free mass."""

    x: float
    v: float
    y: float
    u: float


def both(p: Parameters, row: np.ndarray, motion_there: tuple) -> Both:
    """Return both masses from what `motion` gives."""
    x, v, gap, rate = motion_there
    side = row[SIDE]
    return Both(x, v, x + side * (p.clearance - gap), v - side * rate)


def energy(p: Parameters, now: Both) -> float:
    """Return the mechanical energy over K (F0/K)^2."""
    return 0.5 * (now.v**2 + now.x**2 + p.mass_ratio * now.u**2)


# --- conservation laws over the whole parameter range


def powers(low: float, high: float) -> st.SearchStrategy[float]:
    """Floats spread evenly over decades."""
    return st.floats(low, high).map(lambda k: 10.0**k)


parameters = st.builds(
    Parameters,
    mass_ratio=powers(-4, 2),
    damping_ratio=st.one_of(st.just(0.0), st.just(1.0), powers(-3, 1.3)),
    frequency_ratio=st.one_of(st.just(1.0), powers(-1, 1)),
    clearance=powers(-2, 0.5),
    restitution=st.one_of(st.just(0.0), st.just(1.0), st.floats(0, 0.95)),
    phase=st.floats(-3.2, 3.2),
)
starts = st.tuples(st.floats(-2, 2), st.floats(-2, 2), st.floats(-1, 1), st.floats(-2, 2))
SPAN = 12.0


def begin(p: Parameters, start: tuple[float, float, float, float]) -> Trajectory:
    """Start with the free mass somewhere inside the box."""
    x, v, place, u = start
    return Trajectory(p, State(x, v, x + place * p.clearance, u), max_events=300)


def work(p: Parameters, model: tuple, row: np.ndarray) -> tuple[float, float]:
    """Return the work of force and dashpot over a segment, and the sum of its sizes."""
    rate = 1.0 + p.frequency_ratio + 2.0 * p.damping_ratio
    whole = row[DURATION]
    cuts = np.linspace(0.0, whole, 1 + max(1, math.ceil(rate * whole)))
    if row[MODE] == TAIL and row[RATE] > 0.0:
        # A piece per bounce until the bounces no longer count.
        bounces = math.ceil(math.log(1e-7) / math.log(p.restitution))
        cuts = np.append(whole * (1.0 - p.restitution ** np.arange(bounces + 1)), whole)
    total = size = 0.0
    for start, end in pairwise(cuts.tolist()):
        for node, weight in zip(NODES.tolist(), WEIGHTS.tolist(), strict=True):
            tau = start + 0.5 * (1.0 + node) * (end - start)
            _, v, _, _ = motion(model, row, tau)
            force = math.sin(p.frequency_ratio * (row[TIME] + tau) + p.phase)
            loss = 2.0 * p.damping_ratio * v
            total += 0.5 * (end - start) * weight * (force - loss) * v
            size += 0.5 * (end - start) * weight * (abs(force) + abs(loss)) * abs(v)
    return total, size


@settings(max_examples=120)
@given(p=parameters, start=starts)
def test_momentum_and_energy_balance(p: Parameters, start: tuple) -> None:
    """Across every segment and every event, from the state at the ends of neighbouring segments.

    In a segment the energy changes by the work of force and dashpot; at an impact by
    -mu / (1 + mu) (1 - r^2) s^2 / 2 with s the approach speed, at constant momentum. A tail
    is closed within the accuracy of 1e-12 and loses what is left of the relative motion.
    """
    run = begin(p, start)
    log = log_of(run, SPAN)
    mu, r = p.mass_ratio, p.restitution
    reduced = mu / (1.0 + mu)
    for row, following in zip(log, [*log[1:], None], strict=True):
        first = both(p, row, motion(run.model, row, 0.0))
        last = both(p, row, motion(run.model, row, row[DURATION]))
        done, size = work(p, run.model, row)
        lost = 0.5 * reduced * row[RATE] ** 2 if row[MODE] == TAIL else 0.0
        scale = energy(p, first) + energy(p, last) + size
        if not (row[MODE] == TAIL and following is None):
            change = energy(p, last) - energy(p, first)
            assert abs(change - done + lost) <= 2e-13 * scale + TAIL_PART * lost
        if following is None:
            break
        after = both(p, following, motion(run.model, following, 0.0))
        length = 1.0 + abs(last.x) + p.clearance
        speeds = abs(last.v) + abs(last.u)
        assert abs(after.x - last.x) <= 1e-14 * length * (1 + speeds)
        assert abs(after.y - last.y) <= 1e-14 * length * (1 + speeds)
        momentum = last.v + mu * last.u
        assert abs(after.v + mu * after.u - momentum) <= 1e-14 * (1 + mu) * (1 + speeds)
        if following[CAUSE] == IMPACT:
            side, approach = following[SIDE], following[SPEED]
            assert side * (last.u - last.v) == pytest.approx(approach, abs=1e-14 * (1 + speeds))
            assert -side * (after.u - after.v) == pytest.approx(r * approach, abs=1e-15 * speeds)
            loss = 0.5 * reduced * (1.0 - r * r) * approach**2
            drop = energy(p, last) - energy(p, after)
            assert abs(drop - loss) <= 1e-14 * energy(p, last) + 1e-14 * (1 + mu) * speeds**2
        else:
            assert after.v == pytest.approx(last.v, abs=4 * EPS * (1 + speeds))
            assert after.u == pytest.approx(last.u, abs=4 * EPS * (1 + speeds))


@settings(max_examples=150)
@given(p=parameters, start=starts)
def test_no_penetration_and_a_constant_free_velocity(p: Parameters, start: tuple) -> None:
    """The free mass is placed by its own straight flight here, not by the clipped gap."""
    run = begin(p, start)
    for row in log_of(run, SPAN):
        first = both(p, row, motion(run.model, row, 0.0))
        speeds = abs(first.v) + abs(first.u) + 1.0
        for tau in (np.linspace(0.0, 1.0, 41) ** 2 * row[DURATION]).tolist():
            now = both(p, row, motion(run.model, row, tau))
            y = now.y
            if row[MODE] == FLIGHT:
                assert abs(now.u - first.u) <= 1e-14 * speeds
                y = first.y + first.u * tau
                assert abs(now.y - y) <= 1e-12 * (1 + abs(now.x))
            assert abs(y - now.x) - p.clearance <= 1e-12 * (1 + abs(now.x))
            if row[MODE] == STICKING:
                assert abs(y - now.x) == pytest.approx(p.clearance, abs=1e-15 * (1 + abs(now.x)))
                assert now.u == now.v


@settings(max_examples=60)
@given(p=parameters, start=starts)
def test_sticking_pushes_and_ends_without_push(p: Parameters, start: tuple) -> None:
    """While stuck -side x'' >= 0; a release is where it has fallen to zero."""
    run = begin(p, start)
    heavier = 1.0 + p.mass_ratio
    for row in log_of(run, 3 * SPAN):
        if row[MODE] != STICKING:
            continue
        for tau in np.linspace(0.0, row[DURATION], 30).tolist():
            x, v, _, _ = motion(run.model, row, tau)
            force = math.sin(p.frequency_ratio * (row[TIME] + tau) + p.phase)
            thrust = -row[SIDE] * (force - 2.0 * p.damping_ratio * v - x) / heavier
            size = (1.0 + 2.0 * p.damping_ratio * abs(v) + abs(x)) / heavier
            angle = p.frequency_ratio * (row[TIME] + row[DURATION])
            assert thrust >= -8 * EPS * size * (1 + angle)


# --- the orbit with two impacts per cycle, in closed form


@pytest.fixture(scope="module")
def orbit_run() -> tuple:
    """The stable example of model section 5 and its run over 1000 periods."""
    orbit = two_impacts(0.1, 0.1, 1.0, 5.5, 0.5)[0]
    p = Parameters(0.1, 0.1, 1.0, 5.5, 0.5, orbit.forcing_phase)
    return orbit, p, damper.events(p, State(*orbit.state), until=2000.5 * math.pi)


def test_two_impact_orbit_holds_for_1000_periods(orbit_run: tuple) -> None:
    orbit, _, found = orbit_run
    assert len(found) == 2000
    assert set(found["kind"]) == {0}
    count = np.arange(1, 2001)
    sides = np.where(count % 2 == 1, -1, 1)
    assert np.array_equal(found["side"], sides)
    # Local times are exact; the printed time itself is rounded at 6000.
    assert np.abs(found["time"] - count * math.pi).max() < 5e-12
    assert np.abs(found["approach_speed"] - orbit.approach_speed).max() < 1e-13
    assert np.abs(found["x"] - sides * orbit.x0).max() < 1e-13
    assert np.abs(found["v"] - sides * orbit.velocity_after).max() < 1e-13


def test_two_impact_orbit_numbers(orbit_run: tuple) -> None:
    orbit, p, found = orbit_run
    assert found["approach_speed"][-1] == pytest.approx(6.737868611987, abs=1e-12)
    assert -found["x"][-2] == pytest.approx(1.716240408729, abs=1e-12)
    run = Trajectory(p, State(*orbit.state))
    log = log_of(run, 2 * math.pi)
    times = np.linspace(0.0, 1.0, 4001)
    peak = max(
        abs(motion(run.model, row, float(part * row[DURATION]))[0]) for row in log for part in times
    )
    assert peak == pytest.approx(2.58569621, abs=1e-6)


def test_two_impact_orbit_attracts_at_its_multiplier() -> None:
    """A disturbance dies by .727671 in modulus each half cycle (a complex pair)."""
    orbit = two_impacts(0.1, 0.1, 1.0, 5.5, 0.5)[0]
    x, v, y, u = orbit.state
    p = Parameters(0.1, 0.1, 1.0, 5.5, 0.5, orbit.forcing_phase)
    found = damper.events(p, State(x, v, y, u * (1 + 1e-4)), until=60 * math.pi)
    off = np.abs(found["approach_speed"] - orbit.approach_speed)
    rate = (np.abs(off[40:44]).max() / np.abs(off[10:14]).max()) ** (1 / 30)
    assert rate == pytest.approx(0.727671, abs=0.01)


def test_unstable_orbit_is_left_at_its_multiplier() -> None:
    orbit = two_impacts(0.1, 0.1, 1.0, 5.5, 0.5)[1]
    p = Parameters(0.1, 0.1, 1.0, 5.5, 0.5, orbit.forcing_phase)
    found = damper.events(p, State(*orbit.state), until=4.5 * math.pi)
    off = np.abs(found["approach_speed"][:4] - orbit.approach_speed)
    assert off[0] < 1e-11
    assert np.all(off < 1e-14 * 60.0 ** np.arange(2, 6))


# --- ordinary cases that have a rule each


@pytest.mark.parametrize("p", [(0.1, 0.05, 0.2, 0.1, 0.0), (0.1, 0.05, 2.0, 0.3, 0.0)])
def test_plastic_impact_sticks_at_the_same_time_or_flies(p: tuple) -> None:
    _, zeta, omega, _, _ = p
    found = damper.events(Parameters(*p), until=400.0)
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
    found = damper.events(Parameters(0.1, 0.05, 0.2, 0.25, 1.0), until=1e9, max_events=20_000)
    assert set(found["kind"][:-1]) == {0}
    assert (found["kind"] == 0).sum() == 20_000


@pytest.mark.parametrize("zeta", [0.0, 0.05, 2.0])
@pytest.mark.parametrize("u", [0.7, -0.2])
def test_no_clearance_moves_as_one(zeta: float, u: float) -> None:
    """No events; the pair is the oscillator of mass 1 + mu, started with the momentum kept."""
    p = Parameters(0.4, zeta, 0.8, 0.0, 0.6, 0.3)
    start = State(0.3, -0.2, 0.3, u)
    assert len(damper.events(p, start, until=100.0)) == 0
    run = Trajectory(p, start)
    log = log_of(run, 100.0)
    assert set(log[:, MODE]) == {STICKING}
    matrix = np.zeros((4, 4))
    matrix[0, 1] = 1.0
    matrix[1, :3] = np.array([-1.0, -2.0 * zeta, 1.0]) / 1.4
    matrix[2, 3], matrix[3, 2] = 0.8, -0.8
    z0 = np.array([0.3, (-0.2 + 0.4 * u) / 1.4, math.sin(0.3), math.cos(0.3)])
    for row in log:
        for part in (0.0, 0.4, 1.0):
            time = row[PERIOD] * p.period + row[TIME] + part * row[DURATION]
            x, v, gap, rate = motion(run.model, row, part * row[DURATION])
            assert (gap, rate) == (0.0, 0.0)
            assert (x, v) == pytest.approx((expm(time * matrix) @ z0)[:2], abs=1e-12)


SCENE = Parameters(0.1, 0.05, 0.2, 0.5, 0.6)


@pytest.mark.parametrize("side", [1, -1])
def test_start_on_a_wall_approaching_is_an_impact_at_once(side: int) -> None:
    first = damper.events(SCENE, State(0.0, 0.0, 0.5 * side, 0.25 * side), until=1.0)[0]
    assert (first["time"], first["kind"], first["side"]) == (0.0, 0, side)
    assert first["approach_speed"] == 0.25
    assert first["v"] == pytest.approx(side * 0.1 * 1.6 / 1.1 * 0.25, rel=1e-15)


def test_start_on_a_wall_separating_is_a_flight_from_gap_zero() -> None:
    state = State(0.3, 0.1, 0.3 + 0.5, -1.0)
    row = log_of(Trajectory(SCENE, state), 0.5)[0]
    assert (row[MODE], row[CAUSE], row[GAP], row[SIDE]) == (FLIGHT, NOTHING, 0.0, 1.0)
    assert row[RATE] == pytest.approx(1.1, rel=1e-15)
    first = damper.events(SCENE, state, until=5.0)[0]
    assert (first["kind"], first["side"]) == (0, -1)


def test_start_on_a_wall_at_rest_sticks_or_flies_by_the_sign() -> None:
    """Neither counts as an impact; at zero acceleration the third derivative decides."""
    pushed = damper.events(SCENE, State(1.0, 0.0, 1.5, 0.0), until=1.0)
    assert [(row["time"], row["kind"], row["side"]) for row in pushed] == [(0.0, 1, 1)]
    free = damper.events(SCENE, State(1.0, 0.0, 0.5, 0.0), until=5.0)[0]
    assert (free["kind"], free["side"]) == (0, 1)
    lifted = damper.events(SCENE, State(0.0, 0.0, 0.5, 0.0), until=10.0)[0]
    assert lifted["kind"] == 0
    assert lifted["time"] > 0.5
    held = damper.events(SCENE, State(0.0, 0.0, -0.5, 0.0), until=20.0)[:2]
    assert held["kind"].tolist() == [1, 2]
    assert held["side"].tolist() == [-1, -1]
    assert held["time"][0] == 0.0
    assert held["time"][1] > 0.5


@pytest.mark.parametrize("state", [(1, 0, 1.5, 0), (1, 0, 0.5, 0), (0, 0, 0.5, 0), (0, 0, -0.5, 0)])
def test_start_on_a_wall_at_rest_against_the_reference(state: tuple) -> None:
    p = (0.1, 0.05, 0.2, 0.5, 0.6)
    found = damper.events(SCENE, State(*state), until=12.0)
    exact = mp_reference.events(*p, state=state, until=12, dps=25)
    for row, event in zip(found[:2], exact, strict=False):
        assert row["kind"] == ("impact", "stick", "release").index(event.kind)
        assert row["time"] == pytest.approx(float(event.time), abs=1e-12)


def test_rounding_outside_the_wall_is_on_the_wall() -> None:
    x = 1.0 / 3.0
    y = math.nextafter(math.nextafter(x + 0.1, 9.0), 9.0)
    p = Parameters(0.1, 0.05, 0.2, 0.1, 0.6)
    assert y - x > 0.1
    row = log_of(Trajectory(p, State(x, 0.0, y, 0.0)), 0.1)[0]
    assert (row[GAP], row[SIDE]) == (0.0, 1.0)
    with pytest.raises(ValueError, match="outside the box"):
        Trajectory(p, State(x, 0.0, y + 1e-12, 0.0))


@pytest.mark.parametrize(("zeta", "omega"), [(0.05, 1.7), (0.0, 0.6), (1.5, 0.9)])
def test_grazing_start_from_rest(zeta: float, omega: float) -> None:
    """The free mass rests at 0; with the wall just beyond max|x| nothing ever happens."""
    until = 30.0
    run = Trajectory(Parameters(0.1, zeta, omega, 1e3, 0.5))
    times = np.linspace(0.0, 1.0, 40_001)
    peak = 0.0
    for row in log_of(run, until):
        path = [abs(motion(run.model, row, float(part * row[DURATION]))[0]) for part in times]
        k = min(max(int(np.argmax(path)), 1), len(path) - 2)
        low, middle, high = path[k - 1 : k + 2]
        bend = 2.0 * middle - low - high
        top = middle + (high - low) ** 2 / (8.0 * bend) if bend > 0.0 else middle
        peak = max(peak, top)
    for off in (1e-3, 1e-6, 1e-9, 1e-11):
        beyond = Parameters(0.1, zeta, omega, peak * (1.0 + off), 0.5)
        assert len(damper.events(beyond, until=until)) == 0
        within = Parameters(0.1, zeta, omega, peak * (1.0 - off), 0.5)
        first = damper.events(within, until=until)[0]
        assert first["kind"] == 0
        # At depth h under the crest the speed is sqrt(2 |x''| h).
        assert 0.0 < first["approach_speed"] < 4.0 * (1.0 + omega) * math.sqrt(off) * peak


def test_lift_off_is_of_third_order() -> None:
    """After a release the gap is j tau^3 / 6, without noise and without an impact at once."""
    p = Parameters(0.1, 0.05, 0.2, 0.25, 0.6)
    run = Trajectory(p)
    log = log_of(run, 60.0)
    k = int(np.argmax(log[:, CAUSE] == RELEASE))
    row = log[k]
    assert (row[MODE], row[GAP], row[RATE]) == (FLIGHT, 0.0, 0.0)
    assert log[k - 1, MODE] == STICKING
    assert log[k - 1, CAUSE] == STICK
    assert row[DURATION] > 0.5
    jerk = row[SIDE] * (0.2 * math.cos(0.2 * row[TIME]) - row[V])  # x'' = 0
    assert jerk > 0.0
    for tau in (1e-1, 1e-2, 1e-3):
        gap = motion(run.model, row, tau)[2]
        assert gap == pytest.approx(jerk * tau**3 / 6.0, rel=0.3 * tau + 1e-4)


def test_starting_far_from_any_contact() -> None:
    assert len(damper.events(Parameters(0.1, 0.05, 0.8, 1e6, 0.5), until=1000.0)) == 0


# --- long runs


def test_a_million_periods_without_blur() -> None:
    """Whole periods plus a local time: the steady state keeps its phase to the last digit."""
    periods = 1e6 if COMPILED else 1e4
    omega, zeta = 0.7, 0.05
    run = Trajectory(Parameters(0.1, zeta, omega, 100.0, 0.5, 0.2))
    run.skip(periods)
    row = next(run.segments(periods, 3.0))[-1].copy()
    time = row[TIME] + row[DURATION] + (row[PERIOD] - periods) * run.period
    assert time == pytest.approx(3.0, abs=1e-12)
    x, v, _, _ = motion(run.model, row, row[DURATION])
    steady = np.exp(1j * (omega * 3.0 + 0.2)) / (1 - omega**2 + 2j * zeta * omega)
    assert x == pytest.approx(steady.imag, abs=5e-14)
    assert v == pytest.approx((1j * omega * steady).imag, abs=5e-14)


def test_long_chatter_stays_in_its_box() -> None:
    """Thousands of bursts: the log always knows x, and the gap is never negative."""
    p = Parameters(0.2, 0.01, 0.2, 0.03, 0.8)
    run = Trajectory(p)
    rows = log_of(run, (500 if COMPILED else 20) * p.period)
    assert run.status == FINISHED
    assert rows[:, GAP].min() >= 0.0
    assert rows[:, GAP].max() <= 2 * p.clearance
    assert np.abs(rows[:, X]).max() < 3.0
    assert (rows[:, CAUSE] == STICK).sum() > (900 if COMPILED else 30)


# --- resuming


SPLIT_SCENES = [
    (Parameters(0.1, 0.05, 0.2, 0.25, 0.6), None),
    (Parameters(0.1, 0.05, 0.8, 1.0, 0.9), State(0.1, 0.2, 0.3, 0.4, time=5.0)),
    (Parameters(0.1, 0.05, 0.2, 0.25, 0.0), None),
    (Parameters(0.1, 0.05, 0.7, 50.0, 0.5), None),
]


@pytest.mark.parametrize(("p", "state"), SPLIT_SCENES)
@pytest.mark.parametrize("rows", [1, 2, 7, 64])
def test_rows_do_not_depend_on_the_buffer(p: Parameters, state: State | None, rows: int) -> None:
    whole = log_of(Trajectory(p, state), 150.0)
    assert np.array_equal(log_of(Trajectory(p, state), 150.0, rows), whole)


@pytest.mark.parametrize(("p", "state"), SPLIT_SCENES)
@pytest.mark.parametrize("seed", range(4))
def test_rows_do_not_depend_on_how_the_run_is_split(
    p: Parameters, state: State | None, seed: int
) -> None:
    """Skips and pieces at random times, also inside tails and exactly at events."""
    whole = log_of(Trajectory(p, state), 150.0)
    ends = whole[:, PERIOD] * p.period + whole[:, TIME]
    rng = np.random.default_rng(seed)
    first = ends[0]
    stops = [*rng.uniform(first, 150.0, 12), *rng.choice(ends[ends > first], 6)]
    run = Trajectory(p, state)
    rows = {}
    skipped = False
    for stop in [*sorted(stops), 150.0]:
        if rng.random() < 0.4 and stop < 150.0:
            run.skip(*run.whole_periods(stop))
            skipped = True
            continue
        for row in log_of(run, float(stop), int(rng.integers(1, 9))):
            # A segment that a stop has cut comes again from its start, then to its end.
            rows[tuple(row[[PERIOD, TIME, MODE, CAUSE]])] = row
    pieces = np.array(list(rows.values()))
    known = {tuple(row[[PERIOD, TIME, MODE, CAUSE]]): row for row in whole}
    assert skipped or len(pieces) == len(whole)
    for row in pieces:
        same = known[tuple(row[[PERIOD, TIME, MODE, CAUSE]])]
        assert np.array_equal(row[:DURATION], same[:DURATION])
    assert np.array_equal(pieces[-1], whole[-1])
    assert run.events == np.count_nonzero(whole[:, CAUSE] >= IMPACT) - (whole[0, CAUSE] != NOTHING)


def test_skip_keeps_nothing_and_counts_everything() -> None:
    p = Parameters(0.1, 0.05, 0.2, 0.25, 0.6)
    run, other = Trajectory(p), Trajectory(p)
    run.skip(10)
    log_of(other, 10 * p.period)
    assert run.events == other.events > 0
    assert run.evaluations > 3 * run.events


def test_max_events_stops_for_good() -> None:
    run = Trajectory(Parameters(0.1, 0.05, 0.2, 0.25, 0.6), max_events=7)
    run.skip(10)
    assert (run.status, run.events) == (TOO_MANY_EVENTS, 7)
    run.skip(20)
    assert [len(piece) for piece in run.segments(30)] == [0]
    assert run.events == 7


@pytest.mark.parametrize("time", [0.0, 1e-300, 3.0, -3.0, -1e-300, 7.0, -7.0, 1e9, -1e9])
def test_whole_periods(time: float) -> None:
    p = Parameters(0.1, 0.05, 0.9, 0.25, 0.6)
    periods, rest = Trajectory(p).whole_periods(time)
    assert periods == int(periods)
    assert 0.0 <= rest < p.period
    assert periods * p.period + rest == pytest.approx(time, abs=4 * EPS * abs(time) + 1e-15)
