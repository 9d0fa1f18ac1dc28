"""The grounded free mass: many digits, another solver, matrix exponentials between the events."""

import math
import random

import numpy as np
import pytest
from cases import thinned
from event_pairs import KINDS, NAMES, assert_same, exact_events
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from tails import completed, largest_rate, tail

from damper import Parameters, State, events
from damper.engine.model import motion
from damper.engine.segment import (
    CAUSE,
    DURATION,
    FLIGHT,
    GAP,
    GAP_RATE,
    IMPACT,
    MODE,
    SIDE,
    SPEED,
    STICKING,
    TIME,
    V,
    X,
    segment_at,
)
from damper.engine.trajectory import Trajectory
from damper.models import model_of, start_run


def parameters(values: tuple) -> Parameters:
    """Return the parameters of a scene of the reference."""
    *rigid, stiffness, damping = values
    return Parameters(*rigid, support_stiffness_ratio=stiffness, support_damping_ratio=damping)


def log_of(run: Trajectory, periods: float) -> np.ndarray:
    return np.concatenate([piece.copy() for piece in run.segments(periods)])


REST = (0, 0, 0, 0)
# Mass ratio, damping ratio, frequency ratio, clearance, restitution, phase; support's stiffness
# and damping ratio; state; end; least number of impacts, of complete sequences, of releases.
SCENES: dict[str, tuple[tuple, tuple | None, float, tuple]] = {
    "weak support": ((0.1, 0.05, 0.2, 0.25, 0.6, 0.0, 0.01, 0.002), None, 60.0, (15, 0, 0)),
    "chatter": ((0.1, 0.05, 0.2, 0.25, 0.6, 0.0, 0.05, 0.02), None, 40.0, (40, 2, 2)),
    "dashpot alone": ((0.1, 0.0, 0.2, 0.25, 0.6, 0.0, 0.0, 0.02), None, 40.0, (10, 1, 0)),
    "plastic, spring alone": ((0.1, 0.05, 0.2, 0.25, 0.0, 0.0, 0.02, 0.0), None, 40.0, (3, 3, 2)),
    "elastic": ((0.1, 0.05, 0.9, 0.25, 1.0, 0.3, 0.02, 0.01), None, 12.0, (10, 0, 0)),
    "start in flight": (
        (0.5, 0.2, 0.3, 0.5, 0.6, 0.4, 0.3, 0.1),
        (0.2, 0.1, 0.7, -0.3),
        30.0,
        (30, 2, 1),
    ),
    "overdamped": (
        (2.0, 3.0, 0.5, 0.2, 0.8, 0.0, 1.0, 4.0),
        (0.1, 0.0, 0.0, 1.0),
        20.0,
        (50, 2, 2),
    ),
    "light": ((1e-3, 0.02, 1.3, 0.05, 0.6, 0.0, 0.01, 0.0002), None, 8.0, (20, 1, 1)),
    "stiff": ((0.05, 0.02, 0.4, 0.4, 0.7, 0.0, 100.0, 0.05), None, 8.0, (20, 1, 1)),
    "heavily damped": ((0.05, 0.02, 0.4, 0.4, 0.7, 0.0, 2.0, 5.0), None, 6.0, (20, 1, 0)),
    # The fastest supports that are promised: 2000 sqrt(K/M).
    "fast spring": (
        (0.01, 0.02, 0.7, 0.3, 0.6, 0.0, 4e4, 0.0),
        (0.0, 0.1, 0.29, 400.0),
        0.05,
        (5, 0, 0),
    ),
    "fast dashpot": (
        (1e-3, 0.02, 0.7, 0.3, 0.6, 0.0, 0.1, 0.99),
        (0.0, 1.0, 0.299, 0.0),
        1.0,
        (5, 1, 0),
    ),
}


@pytest.mark.parametrize("scene", thinned(SCENES, ["chatter"].__contains__))
def test_events_are_those_of_forty_digits(scene: str) -> None:
    values, state, until, least = SCENES[scene]
    found = events(parameters(values), State(*state) if state else None, until=until)
    exact = exact_events(values, state or REST, until=until, digits=40)
    assert_same(found, exact, 2e-13, relative=True)
    for kind, number in enumerate(least):
        assert (found["kind"] == kind).sum() >= number


# --- between the events


def path_of(run: Trajectory, row: np.ndarray, count: int) -> np.ndarray:
    """(x, v, y, u, sin, cos) at equal times within a segment, by a matrix exponential."""
    model = run.model
    free, support, side = model.free, model.mass, row[SIDE]
    mu, d = model.mass_ratio, model.clearance
    a = np.zeros((7, 7))
    a[4, 5], a[5, 4] = free.forcing.omega, -free.forcing.omega
    if row[MODE] == FLIGHT:
        a[0, 1] = a[2, 3] = a[1, 4] = 1.0
        a[1, :2] = -1.0, -2.0 * free.damping
        a[3, 2:4] = -support.stiffness, -2.0 * support.damping
        y = row[X] + side * (d - row[GAP])
    else:
        a[0, 1] = a[2, 3] = 1.0
        common = np.zeros(7)
        common[[0, 1, 4, 6]] = (
            -(1.0 + mu * support.stiffness),
            -2.0 * (free.damping + mu * support.damping),
            1.0,
            -mu * support.stiffness * side * d,
        )
        a[1] = a[3] = common / (1.0 + mu)
        y = row[X] + side * d
    angle = free.forcing.omega * row[TIME] + free.forcing.phase
    u = row[V] - side * row[GAP_RATE]
    z = np.array([row[X], row[V], y, u, math.sin(angle), math.cos(angle), 1.0])
    step = expm(row[DURATION] / count * a)
    path = [z]
    for _ in range(count):
        path.append(step @ path[-1])
    return np.array(path)


def random_scene(rng: random.Random) -> tuple[Parameters, State | None]:
    """Return a random scene, and a state inside the box or none."""

    def decades(low: float, high: float) -> float:
        return 10 ** rng.uniform(low, high)

    mu = decades(-3, 1)
    rigid = [mu, rng.choice([0.0, decades(-3, 1)]), decades(-1.5, 1), decades(-2, 1)]
    rigid += [rng.choice([0.0, 1.0, rng.random(), rng.random()]), rng.uniform(-3, 3)]
    # Up to the fastest support that is promised.
    stiffness = rng.choice([0.0, decades(-3, 2), 1e6 * mu])
    damping = rng.choice([decades(-3, 0), 400.0 * mu])
    state = None
    if rng.random() < 0.6:
        x, v = rng.uniform(-3, 3), rng.gauss(0, 1)
        y = x + rigid[3] * rng.choice([-1, 1, rng.uniform(-1, 1)])
        state = State(x, v, y, rng.choice([v, rng.gauss(0, 1)]))
    return parameters((*rigid, stiffness, min(damping, 900.0 * mu))), state


def test_no_wall_is_passed_and_none_pulls() -> None:
    """Dense samples between events that know nothing of the search."""
    rng = random.Random(0)
    flights = sticks = 0
    for _ in range(12):
        scene, state = random_scene(rng)
        run = start_run(scene, state, max_events=40)
        log = log_of(run, 4.0)
        assert np.isfinite(log).all()
        assert run.status in (0, 1), scene
        fast = run.model.mass.rate + run.model.free.rate
        for row in log[-40:-1]:
            if row[MODE] not in (FLIGHT, STICKING) or row[SIDE] == 0.0:
                continue
            count = int(min(max(100.0, 8.0 * fast * row[DURATION]), 2000.0))
            x, v, y, u, sin, *_ = path = path_of(run, row, count).T
            size = (1.0 + np.abs(path[:4]).max()) * (1.0 + scene.clearance)
            # Products of many short exponentials: roundoff of each.
            roundoff = 1e-15 * count * size
            if row[MODE] == FLIGHT:
                flights += 1
                assert np.abs(y - x).max() - scene.clearance < roundoff, (scene, state)
                continue
            sticks += 1
            a = sin - 2.0 * scene.damping_ratio * v - x
            pull = row[SIDE] * (a + 2.0 * run.model.mass.damping * u)
            pull += row[SIDE] * run.model.mass.stiffness * y
            rates = 1.0 + run.model.mass.rate**2 + 2.0 * scene.damping_ratio
            assert pull.max() < roundoff * rates, (scene, state)
    assert flights > 40
    assert sticks > 2


def test_no_swing_into_a_wall_is_missed() -> None:
    """Undamped swings against motions in closed form, sampled thirty times a radian."""
    rng = random.Random(1)
    hits = 0
    for _ in range(60):
        rate, mass_ratio = 10 ** rng.uniform(0.5, 2.5), 0.1
        omega, clearance = rng.choice([0.3, 0.7, 2.5]), 10 ** rng.uniform(-0.5, 0.5)
        stiffness = rate * rate * mass_ratio
        scene = parameters((mass_ratio, 0.0, omega, clearance, 0.5, 0.0, stiffness, 0.0))
        x0, v0 = rng.uniform(-1, 1) * clearance, rng.uniform(-0.3, 0.3)
        swing = rng.uniform(0, 1.2) * clearance
        turn = rng.uniform(0, 2 * math.pi)
        y0, u0 = swing * math.cos(turn), -rate * swing * math.sin(turn)
        if abs(y0 - x0) >= clearance:
            continue
        run = start_run(scene, State(x0, v0, y0, u0), max_events=1)
        log = log_of(run, 1.0)
        until = run.cycle
        if run.events:
            end = log[log[:, SPEED] > 0][0]
            until = end[0] * run.cycle + end[TIME]
            hits += 1
        t = np.append(np.arange(0.0, until, 1 / (30 * rate)), until)
        gain = 1 / (1 - omega * omega)
        x = x0 * np.cos(t) + (v0 - gain * omega) * np.sin(t) + gain * np.sin(omega * t)
        y = y0 * np.cos(rate * t) + u0 / rate * np.sin(rate * t)
        outside = abs(y - x) - clearance
        assert outside[:-1].max() < 1e-11 * (1 + swing), scene
        if run.events:
            assert abs(outside[-1]) < 1e-10 * (1 + rate), scene
    assert hits > 15


# --- the rest of a chatter sequence

SEQUENCE = (0.5, 0.2, 0.3, 0.5, 0.6, 0.6, 0.05, 0.1)


@pytest.mark.parametrize("values", [SEQUENCE, (0.1, 0.0, *SEQUENCE[2:6], 0.0, 0.03)])
def test_tail_is_of_second_order(values: tuple) -> None:
    """Time, place and velocity: halving the rebound speed divides the errors by eight."""
    model = model_of(parameters(values))
    errors = []
    for rebound in (0.0004, 0.0002):
        duration, _, x, v = tail(model, 0.0, 1.0, 2.0, 0.1, rebound)
        given = dict(zip(NAMES, values, strict=True))
        exact = completed(given, 0.0, 1.0, 2.0, 0.1, rebound, within=1.1 * duration)
        pairs = ((duration, exact.time), (x, exact.x), (v, exact.v))
        errors.append([float(abs(value - ev)) for value, ev in pairs])
    for larger, smaller in zip(*errors, strict=True):
        assert larger / smaller == pytest.approx(8.0, rel=0.03)


def test_tail_error_estimate_bounds_the_true_error() -> None:
    rng = random.Random(0)
    ratios = []
    while len(ratios) < 5:
        mu = 10 ** rng.uniform(-4, 2)
        scene = (
            mu,
            rng.choice([0.0, 0.02, 0.2, 1.0, 3.0, 10.0]),
            10 ** rng.uniform(-1, 1),
            10 ** rng.uniform(-2, 1),
            rng.choice([0.05, 0.3, 0.6, 0.8, 0.9]),
            rng.uniform(-3, 3),
            rng.choice([0.0, mu * 10 ** rng.uniform(-3, 6)]),
            mu * 10 ** rng.uniform(-3, 2.5),
        )
        x, v, side = rng.uniform(-2, 2), rng.uniform(-2, 2), rng.choice([1.0, -1.0])
        model = model_of(parameters(scene))
        rate = largest_rate(model, 0.0, side, x, v, 10 ** rng.uniform(-11, -5))
        if rate == 0.0:
            continue  # the wall does not press, or the bound on the lag comes first
        duration, error, _, _ = tail(model, 0.0, side, x, v, rate)
        given = dict(zip(NAMES, scene, strict=True))
        within = 1.2 * duration + 1.5 * error
        exact = completed(given, 0.0, side, x, v, rate, within=within)
        ratios.append(float(abs(exact.time - duration)) / error)
    assert max(ratios) <= 1.0
    assert max(ratios) > 1e-3


# --- sticking and release


def test_stuck_between_both_walls() -> None:
    """No clearance: one mass on both springs and dashpots, and no event."""
    scene = Parameters(
        0.5, 0.1, 0.7, 0.0, 0.5, support_stiffness_ratio=2.0, support_damping_ratio=3 * 0.1
    )
    run = start_run(scene, State(0.3, 0.1, 0.3, 0.4))
    run.skip(11.0)
    assert run.events == 0
    end = run.state_at(11.0)
    exact = solve_ivp(
        lambda t, z: [z[1], (math.sin(0.7 * t) - 0.8 * z[1] - 3 * z[0]) / 1.5],
        (0, 11 * run.cycle),
        [0.3, (0.1 + 0.5 * 0.4) / 1.5],
        "DOP853",
        rtol=1e-12,
        atol=1e-13,
    )
    assert (end.x, end.v) == pytest.approx(tuple(exact.y[:, -1]), abs=1e-10)
    assert (end.y, end.u) == (end.x, end.v)


def test_a_release_is_where_the_contact_force_vanishes_however_heavy_the_support_damping() -> None:
    """Damping over the free mass, squared, would have to cancel in the force's slope."""
    p = Parameters(
        *(1e-3, 0.000327676, 1.19794, 0.000574656, 1e-6),
        support_stiffness_ratio=0.0466184,
        support_damping_ratio=0.99,
    )
    found = events(p, State(-2.97, 0.0, -2.97, 2.27), until=60.0)
    releases = found[found["kind"] == KINDS["release"]]
    assert len(releases) >= 5
    for row in releases:
        x, v, side = float(row["x"]), float(row["v"]), int(row["side"])
        spring = p.support_stiffness_ratio * (x + side * p.clearance)
        dashpots = 2.0 * (p.damping_ratio + p.support_damping_ratio) * v
        force = math.sin(p.frequency_ratio * row["time_in_cycle"]) - dashpots - x - spring
        common = force / (1.0 + p.mass_ratio)
        contact = p.mass_ratio * common + 2.0 * p.support_damping_ratio * v + spring
        assert abs(contact) < 1e-12


def test_a_flight_that_is_cut_goes_on_as_it_was_however_far_the_walls_are() -> None:
    """The free mass's place, 1e6 from the middle, rounds by 1e-10; gap and rate must not."""
    p = Parameters(
        *(1e18, 0.00089056, 0.00192579, 1e6, 0.764261, 2.06194),
        support_stiffness_ratio=0.102989,
        support_damping_ratio=1.48324e-06,
    )
    run = start_run(p, State(0.661809, 0.0, 1e6 + 0.661809, -1e-9))
    log = log_of(run, 1)
    cut = [k for k in range(len(log) - 1) if log[k, MODE] == FLIGHT and log[k + 1, CAUSE] < IMPACT]
    assert cut
    for k in cut:
        before, after = segment_at(log[k]), segment_at(log[k + 1])
        _, _, gap, rate = motion(run.model, before, before.duration)
        assert after.gap == pytest.approx(gap, abs=1e-15)
        assert after.gap_rate == pytest.approx(rate, abs=1e-16)
