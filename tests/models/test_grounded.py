"""The grounded free mass against many digits, other solvers, conservation laws and its limits."""

import importlib.util
import math
import random
from itertools import pairwise

import numpy as np
import pytest
from mpmath import mp, mpf
from new_process import in_new_process
from reference import grounded as reference
from scipy.integrate import solve_ivp

from damper import Parameters, SIParameters, State, events, simulate
from damper.engine.oscillator import acceleration, increments
from damper.engine.search import impact
from damper.engine.segment import (
    CAUSE,
    DURATION,
    FLIGHT,
    GAP,
    IMPACT,
    MODE,
    PERIOD,
    RATE,
    RELEASE,
    SIDE,
    SPEED,
    STICKING,
    TAIL,
    TIME,
    V,
    X,
)
from damper.engine.trajectory import Trajectory
from damper.models import model_of, motion, settle, time_to_sticking
from damper.observers.base import Window
from damper.observers.response import Response
from damper.sweep.runs import run_lanes

KINDS = ("impact", "stick", "release")


def parameters(values):
    """Return the parameters of a scene of the reference."""
    *rigid, stiffness, damping = values
    return Parameters(*rigid, support_stiffness_ratio=stiffness, support_damping_ratio=damping)


def worst_difference(found, exact):
    """Compare event by event; impacts inside closed bursts stand in the reference only."""
    worst = 0.0
    rest = iter(exact)
    for row in found:
        kind = KINDS[row["kind"]]
        event = next(rest)
        while event.kind == "impact" != kind:
            event = next(rest)
        assert (event.kind, event.side) == (kind, row["side"])
        for name in ("time", "approach_speed", "x", "v"):
            worst = max(worst, abs(float(row[name] - getattr(event, name))))
    assert not [event for event in rest if event.kind != "impact"]
    return worst


# Mass ratio, damping ratio, frequency ratio, clearance, restitution, phase; support's stiffness
# and damping ratio; state; end; least number of impacts, of bursts that complete, of releases.
SCENES = {
    "weak support": ((0.1, 0.05, 0.2, 0.25, 0.6, 0.0, 0.01, 0.002), None, 60.0, (15, 0, 0)),
    "bursts": ((0.1, 0.05, 0.2, 0.25, 0.6, 0.0, 0.05, 0.02), None, 40.0, (40, 2, 2)),
    "spring alone": ((0.1, 0.05, 0.2, 0.25, 0.3, 0.0, 0.1, 0.0), None, 60.0, (30, 3, 2)),
    "dashpot alone": ((0.1, 0.0, 0.2, 0.25, 0.6, 0.0, 0.0, 0.02), None, 60.0, (30, 2, 2)),
    "plastic": ((0.1, 0.05, 0.2, 0.25, 0.0, 0.0, 0.02, 0.01), None, 40.0, (3, 3, 2)),
    "elastic": ((0.1, 0.05, 0.9, 0.25, 1.0, 0.3, 0.02, 0.01), None, 12.0, (10, 0, 0)),
    "start in flight": (
        (0.5, 0.2, 0.3, 0.5, 0.6, 0.4, 0.3, 0.1),
        (0.2, 0.1, 0.7, -0.3),
        40.0,
        (50, 3, 2),
    ),
    "overdamped": (
        (2.0, 3.0, 0.5, 0.2, 0.8, 0.0, 1.0, 4.0),
        (0.1, 0.0, 0.0, 1.0),
        20.0,
        (50, 2, 2),
    ),
    "light": ((1e-3, 0.02, 1.3, 0.05, 0.6, 0.0, 0.01, 0.0002), None, 8.0, (20, 1, 1)),
    "stiff": ((0.05, 0.02, 0.4, 0.4, 0.7, 0.0, 100.0, 0.05), None, 8.0, (20, 1, 1)),
    "heavily damped": ((0.05, 0.02, 0.4, 0.4, 0.7, 0.0, 2.0, 5.0), None, 8.0, (20, 1, 0)),
}


@pytest.mark.parametrize("scene", SCENES)
def test_events_are_those_of_forty_digits(scene):
    values, state, until, (impacts, sticks, releases) = SCENES[scene]
    found = events(parameters(values), State(*state) if state else None, until=until)
    exact = reference.events(values, state or (0, 0, 0, 0), until=until)
    assert worst_difference(found, exact) < 2e-13
    kinds = [int((found["kind"] == kind).sum()) for kind in range(3)]
    assert kinds[0] >= impacts
    assert kinds[1] >= sticks
    assert kinds[2] >= releases


@pytest.mark.parametrize(
    ("values", "until"),
    [
        ((0.1, 0.05, 0.9, 1.0, 0.8, 0.2, 0.3, 0.02), 30.0),
        ((0.5, 0.02, 1.3, 0.4, 0.9, 0.0, 0.0, 0.1), 20.0),
        ((0.2, 0.3, 0.6, 0.3, 1.0, 1.0, 2.0, 0.0), 20.0),
    ],
)
def test_impacts_are_those_of_a_general_solver(values, until):
    mu, zeta, omega, d, r, phase, stiffness, damping = values

    def slope(t, z):
        x, v, y, u = z
        force = math.sin(omega * t + phase)
        return [v, force - 2 * zeta * v - x, u, -(2 * damping * u + stiffness * y) / mu]

    walls = [lambda t, z: d - (z[2] - z[0]), lambda t, z: d + (z[2] - z[0])]
    for wall in walls:
        wall.terminal, wall.direction = True, -1
    found = events(parameters(values), until=until)
    found = found[: min(10, len(found))]
    assert len(found) >= 5
    assert (found["kind"] == 0).all()
    t, z = 0.0, np.zeros(4)
    for row in found:
        run = solve_ivp(
            slope, (t, until), z, "DOP853", events=walls, rtol=1e-12, atol=1e-13, max_step=0.05
        )
        side = 1 if run.t_events[0].size else -1
        t, (x, v, _, u) = run.t[-1], run.y[:, -1]
        assert row["side"] == side
        assert row["time"] == pytest.approx(t, abs=1e-9)
        assert row["approach_speed"] == pytest.approx(side * (u - v), abs=1e-8)
        after = ((1 - mu * r) * v + mu * (1 + r) * u) / (1 + mu)
        u = ((1 + r) * v + (mu - r) * u) / (1 + mu)
        z = np.array([x, after, x + side * d * (1 - 1e-15), u])


RIGID = [
    (0.1, 0.05, 0.2, 0.25, 0.6, 0.0),
    (0.1, 0.05, 0.2, 0.25, 0.3, 0.7),
    (0.5, 0.2, 0.3, 0.5, 0.0, 0.0),
]


@pytest.mark.parametrize("values", RIGID)
@pytest.mark.parametrize("support", [(1e-16, 0.0), (0.0, 1e-16), (1e-16, 1e-16)])
def test_a_vanishing_support_gives_the_classical_damper(values, support):
    classical = events(Parameters(*values), until=20.0)
    limit = events(parameters((*values, *support)), until=20.0)
    assert model_of(parameters((*values, *support)), 1e-12).__class__.__name__ == "Grounded"
    # How many impacts of a burst are resolved may differ by one; what they lead to may not.
    kept = [rows[rows["kind"] > 0] for rows in (classical, limit)]
    kept += [rows[rows["kind"] == 0][:3] for rows in (classical, limit)]
    for one, other in zip(kept[::2], kept[1::2], strict=True):
        assert len(one) == len(other)
        for name in ("time", "side", "kind", "approach_speed", "x", "v"):
            assert one[name] == pytest.approx(other[name], rel=0, abs=2e-12)


def test_a_support_below_rounding_changes_nothing():
    tiny = events(parameters((1e6, 0.05, 0.9, 0.3, 0.8, 0.0, 0.0, 5e-324)), until=20.0)
    none = events(Parameters(1e6, 0.05, 0.9, 0.3, 0.8), until=20.0)
    assert len(tiny) == len(none) > 5
    assert tiny["time"] == pytest.approx(none["time"], abs=1e-11)


def test_no_support_is_the_classical_damper_byte_for_byte():
    """And its code: the grounded damper's is not even imported."""
    code = """
import json, sys
import damper
from damper import Parameters
p = Parameters(0.1, 0.05, 0.2, 0.25, 0.6, support_stiffness_ratio=0.0, support_damping_ratio=0.0)
q = Parameters(0.1, 0.0, 0.2, 0.25, 0.6, support_damping_factor=3.0)
def same(one, other):
    return damper.events(one, until=100).tobytes() == damper.events(other, until=100).tobytes()
unused = not [name for name in sys.modules if "grounded" in name]
print(json.dumps([same(p, Parameters(0.1, 0.05, 0.2, 0.25, 0.6)),
                  same(q, Parameters(0.1, 0.0, 0.2, 0.25, 0.6)), unused]))
"""
    assert in_new_process(code, "-W", "error") == [True, True, True]


RUNS = """
import json, os
from damper import Parameters, State, events
from damper.sweep.runs import run_lanes
runs = [
    ((0.1, 0.05, 0.2, 0.25, 0.6, 0.0), 0.05, 0.02, None, 60.0),
    ((0.1, 0.0, 1.0, 2.0, 0.9, 0.5), 0.1, 0.0, State(0.1, 0.2, 0.3, -0.4), 60.0),
    ((2.0, 3.0, 0.5, 0.2, 0.8, 0.0), 1.0, 4.0, State(0.1, 0.0, 0.0, 1.0), 20.0),
    ((1e-9, 1.0, 10.0, 0.005, 0.7, 0.0), 1e6, 1e6, None, 2.0),
    ((1e6, 2000.0, 0.7, 0.05, 0.8, 0.0), 0.0, 1e-3, State(0.0, 0.0, 0.0, 1.0), 5.0),
    ((1e-6, 0.1, 0.7, 0.05, 0.5, 0.0), 1e3, 0.0, None, 5.0),
    ((0.3, 0.1, 1e3, 1e-3, 0.0, 0.0), 0.0, 20.0, State(1.0, 0.0, 1.001, 0.0), 0.2),
    ((0.3, 0.1, 0.5, 0.0, 0.5, 0.0), 2.0, 0.1, None, 40.0),
]
result = []
for rigid, stiffness, damping, state, until in runs:
    p = Parameters(*rigid, support_stiffness_ratio=stiffness, support_damping_ratio=damping)
    for row in events(p, state, until=until, max_events=60):
        result.append([float(row[name]).hex() for name in ("time", "approach_speed", "x", "v")])
point = dict(mass_ratio=0.1, damping_ratio=0.05, frequency_ratio=0.2, clearance=0.25,
             restitution=0.6, support_stiffness_ratio=0.05, support_damping_ratio=0.02)
arrays, _ = run_lanes([point], ["response", "bursts", "impacts"], transient=0, periods=2)
print(json.dumps([result, {name: str(array) for name, array in arrays.items()}]))
"""


@pytest.mark.skipif(importlib.util.find_spec("numba") is None, reason="numba is not installed")
def test_compiled_and_plain_give_the_same_bits():
    """Plain Python raises where compiled code passes inf or nan on: none comes up."""
    fast = in_new_process(RUNS, "-W", "error", DAMPER_COMPILE="1")
    plain = in_new_process(RUNS, "-W", "error", DAMPER_COMPILE="0")
    assert fast == plain
    assert len(fast[0]) > 150
    assert not [row for row in fast[0] if "nan" in row or "inf" in row]


def random_scene(rng, wide):
    """Return a random scene, and a state inside the box or none."""

    def decades(low, high):
        return 10 ** rng.uniform(low, high)

    if wide:
        rigid = [decades(-9, 6), rng.choice([0.0, decades(-4, 6)]), decades(-4, 4)]
        rigid.append(rng.choice([0.0, decades(-6, 6), decades(-2, 1)]))
        stiffness = rng.choice([0.0, decades(-6, 6)])
        damping = rng.choice([decades(-6, 6), decades(-6, 1)])
    else:
        rigid = [decades(-3, 1), rng.choice([0.0, decades(-3, 1)]), decades(-1.5, 1)]
        rigid.append(decades(-2, 1))
        stiffness = rng.choice([0.0, decades(-3, 2)])
        damping = rng.choice([decades(-3, 2), decades(-3, 0)])
    rigid += [rng.choice([0.0, 1.0, rng.random(), rng.random()]), rng.uniform(-3, 3)]
    state = None
    if rng.random() < 0.6:
        x, v = rng.uniform(-3, 3), rng.gauss(0, 1)
        y = x + rigid[3] * rng.choice([-1, 1, rng.uniform(-1, 1)])
        state = State(x, v, y, rng.choice([v, rng.gauss(0, 1)]))
    return parameters((*rigid, stiffness, damping)), state


def worst_overlap(model, row):
    """How far the free mass is outside its box at most within a flight, over the terms' sizes."""
    free, support, clearance = model.free, model.support, model.clearance
    x, v, gap0, rate, side = (float(row[k]) for k in (X, V, GAP, RATE, SIDE))
    angle = free[3] * float(row[TIME]) + model.phase
    sin, cos = math.sin(angle), math.cos(angle)
    y, u = x + side * (clearance - gap0), v - side * rate
    a, j = acceleration(free, x, v, sin, cos)
    b, k = acceleration(support, y, u, 0.0, 0.0)
    worst = 0.0
    for part in range(1, 120):
        tau = float(row[DURATION]) * (part / 120) ** (4 if part % 2 else 1)
        dx, _, _, _ = increments(free, x, v, a, j, sin, cos, tau)
        dy, _, _, _ = increments(support, y, u, b, k, 0.0, 0.0, tau)
        gap = gap0 + rate * tau + side * (dx - dy)
        size = clearance + abs(x) + abs(y) + abs(x + dx) + (abs(v) + abs(u) + abs(rate)) * tau
        worst = max(worst, max(-gap, gap - 2 * clearance) / size)
    return worst


def worst_pull(model, row):
    """How hard the wall pulls at most within a segment of sticking, over the terms' sizes."""
    side, clearance = float(row[SIDE]), model.clearance
    worst = 0.0
    for part in range(60):
        tau = float(row[DURATION]) * part / 60
        x, v, _, _ = motion(model, row, tau)
        sin = math.sin(model.free[3] * (float(row[TIME]) + tau) + model.phase)
        a, _ = acceleration(model.free, x, v, sin, 0.0)
        b, _ = acceleration(model.support, x + side * clearance, v, 0.0, 0.0)
        rates = 2 * (model.free[0] + model.support[0])
        size = 1 + rates * (abs(v) + 1e-16 * abs(row[V]))
        size += (1 + model.support[1]) * (abs(x) + clearance)
        worst = max(worst, side * (a - b) / size)
    return worst


@pytest.mark.parametrize("wide", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_no_wall_is_passed_and_none_pulls(seed, wide):
    """Dense samples between events that know nothing of the search; corners of all ranges."""
    rng = random.Random(seed)
    flights = sticks = 0
    for _ in range(12 if wide else 25):
        scene, state = random_scene(rng, wide)
        trajectory = Trajectory(scene, state, max_events=40)
        log = np.concatenate([piece.copy() for piece in trajectory.segments(4.0)])
        assert np.isfinite(log).all()
        assert trajectory.status in (0, 1), scene
        for row in log[-60:]:
            if row[MODE] == FLIGHT:
                flights += 1
                assert worst_overlap(trajectory.model, row) < 1e-14, (scene, state)
            elif row[MODE] == STICKING and row[SIDE] != 0.0:
                sticks += 1
                assert worst_pull(trajectory.model, row) < 1e-11, (scene, state)
    assert flights > 60
    assert sticks > 3


def test_a_fast_support_is_stepped_over_where_it_cannot_reach_a_wall():
    """1e8 swings of the free mass, a tenth of the clearance wide, in some evaluations."""
    trajectory = Trajectory(
        parameters((1e-9, 0.1, 0.5, 3.0, 0.5, 0.0, 1e6, 0.0)), State(0, 0, 0.3, 0)
    )
    trajectory.skip(2.0)
    assert (trajectory.status, trajectory.events) == (0, 0)
    assert trajectory.evaluations < 3000


def test_a_free_mass_that_would_swing_into_a_wall_is_stopped_there():
    """The same with a clearance that the swings reach only when the wall comes close."""
    trajectory = Trajectory(
        parameters((1e-4, 0.1, 0.5, 1.0, 0.5, 0.0, 1e2, 0.0)), State(0, 0, 0.3, 0), max_events=1
    )
    (log,) = trajectory.segments(2.0)
    stiffness = trajectory.model.support
    end = log[-1]
    # No earlier than the envelopes meet, no later than a swing after that.
    times = np.linspace(2, 3, 100_001)
    x, v = 0.0, 0.0
    sin, cos = math.sin(0.0), math.cos(0.0)
    a, j = acceleration(trajectory.model.free, x, v, sin, cos)
    gap = np.array(
        [
            1.0
            - abs(
                0.3 * math.cos(math.sqrt(stiffness[1]) * t)
                - increments(trajectory.model.free, x, v, a, j, sin, cos, t)[0]
            )
            for t in times
        ]
    )
    first = times[np.argmax(gap < 0)]
    assert end[SIDE] != 0
    assert end[PERIOD] * trajectory.period + end[TIME] == pytest.approx(first, abs=1e-3)


def test_motion_is_mirror_symmetric():
    values = (0.1, 0.05, 0.2, 0.25, 0.6, 0.3, 0.05, 0.02)
    mirrored = (*values[:5], 0.3 - math.pi, *values[6:])
    one = events(parameters(values), State(0.1, 0.2, 0.3, -0.4), until=30.0)
    other = events(parameters(mirrored), State(-0.1, -0.2, -0.3, 0.4), until=30.0)
    assert len(one) > 30
    first = one["time"] < 15
    assert (one["side"][first] == -other["side"][first]).all()
    assert one["time"][first] == pytest.approx(other["time"][first], abs=1e-12)
    assert one["x"][first] == pytest.approx(-other["x"][first], abs=1e-12)


# --- burst tail

BURST = (0.5, 0.2, 0.3, 0.5, 0.6, 0.6, 0.05, 0.1)


def tail(values, x, v, rebound, side):
    """Return time to sticking, the estimate of its error, and the state at sticking."""
    model = model_of(parameters(values), 1e-12)
    sin, cos = math.sin(values[5]), math.cos(values[5])
    a, j = acceleration(model.free, x, v, sin, cos)
    state = (model, 0.0, 0.0, side, x, v, rebound)
    duration, error = time_to_sticking(*state, a, j, sin, cos)
    dx, end_v = settle(*state, sin, cos, duration)
    return duration, error, x + dx, end_v


def burst(values, x, v, rebound, side, until, dps=25):
    """Return the sticking event of the same burst, bounce by bounce."""
    floor = 1e-22 if dps > 30 else 1e-14
    with reference.mp.workdps(dps + 15):
        y = reference.mpf(x) + side * reference.mpf(values[3])
        u = reference.mpf(v) - side * reference.mpf(rebound)
    state = (x, v, y, u)
    found = reference.events(values, state, until=until, dps=dps, burst_floor=floor)
    return next(event for event in found if event.kind == "stick")


@pytest.mark.parametrize(
    "values", [BURST, (0.1, 0.0, *BURST[2:6], 0.0, 0.03), (*BURST[:6], 0.05, 0.0)]
)
def test_tail_is_of_second_order(values):
    """Time, place and velocity: halving the rebound speed divides the errors by eight."""
    errors = []
    for rebound in (0.0004, 0.0002):
        duration, _, x, v = tail(values, 2.0, 0.1, rebound, 1.0)
        exact = burst(values, 2.0, 0.1, rebound, 1.0, 1.1 * duration, 40)
        pairs = ((duration, exact.time), (x, exact.x), (v, exact.v))
        errors.append([float(abs(value - ev)) for value, ev in pairs])
    for larger, smaller in zip(*errors, strict=True):
        assert larger / smaller == pytest.approx(8.0, rel=0.03)


@pytest.mark.parametrize("part", range(2))
def test_tail_error_estimate_bounds_the_true_error(part):
    rng = random.Random(part)
    ratios = []
    while len(ratios) < 12:
        scene = (
            10 ** rng.uniform(-4, 2),
            rng.choice([0.0, 0.02, 0.2, 1.0, 3.0, 20.0]),
            10 ** rng.uniform(-1, 1),
            10 ** rng.uniform(-2, 1),
            rng.choice([0.05, 0.3, 0.6, 0.8, 0.9]),
            rng.uniform(-3, 3),
            rng.choice([0.0, 10 ** rng.uniform(-3, 3)]),
            10 ** rng.uniform(-3, 2),
        )
        x, v, side = rng.uniform(-2, 2), rng.uniform(-2, 2), rng.choice([1.0, -1.0])
        target, low, high = 10 ** rng.uniform(-11, -5), 1e-14, 1e3
        for _ in range(60):
            middle = math.sqrt(low * high)
            error = tail(scene, x, v, middle, side)[1]
            low, high = (low, middle) if error > target else (middle, high)
        duration, error, _, _ = tail(scene, x, v, low, side)
        if not 0.5 * target < error <= target:
            continue  # the wall does not push, or the bound on the lag comes first
        exact = burst(scene, x, v, low, side, 1.2 * duration + 1.5 * error)
        ratios.append(float(abs(exact.time - duration)) / error)
    assert max(ratios) <= 1.0
    assert max(ratios) > 1e-3


# --- observers, units, studies

POINT = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.2,
    "clearance": 0.25,
    "restitution": 0.6,
    "support_stiffness_ratio": 0.05,
    "support_damping_ratio": 0.02,
}


def test_energy_balance_closes():
    """Over windows that cut flights, sticking and closed bursts anywhere."""
    rng = random.Random(8)
    points = []
    for _ in range(60):
        scene, _ = random_scene(rng, False)
        names = (*POINT, "phase")
        points.append({name: getattr(scene, name) for name in names})
    arrays, _ = run_lanes(points, ["response"], transient=2, periods=5, max_events=100_000)
    scale = abs(arrays["energy_input"]) + arrays["dashpot_loss"] + arrays["impact_loss"]
    scale += arrays["peak_displacement"] ** 2
    scale += [p["support_stiffness_ratio"] * p["clearance"] ** 2 for p in points]
    finished = arrays["status"] == 0
    assert finished.sum() > 50
    assert (abs(arrays["energy_residual"]) / scale)[finished].max() < 2e-14


def test_dashpot_loss_and_rms_are_those_of_a_quadrature():
    """The loss is that of both dashpots: dense samples of the motion, summed by Simpson's rule."""
    scene = Parameters(**POINT)
    arrays, _ = run_lanes([POINT], ["response"], transient=1, periods=3)
    trajectory = Trajectory(scene)
    trajectory.skip(1.0)
    loss = square = peak = 0.0
    period = trajectory.period
    for log in trajectory.segments(4.0):
        for row in log:
            start = row[PERIOD] * period + row[TIME]
            low, high = max(period - start, 0.0), min(row[DURATION], 4 * period - start)
            if high < low:
                continue
            taus = np.linspace(low, high, 201)
            states = np.array([motion(trajectory.model, row, tau) for tau in taus])
            x, v, u = states[:, 0], states[:, 1], states[:, 1] - row[SIDE] * states[:, 3]
            weights = np.ones(201)
            weights[1:-1:2], weights[2:-1:2] = 4.0, 2.0
            weights *= (high - low) / 600
            dashpots = 2 * 0.05 * v * v + 2 * 0.02 * u * u
            loss += float(weights @ dashpots)
            square += float(weights @ (x * x))
            peak = max(peak, float(abs(x).max()))
    assert arrays["dashpot_loss"][0] * 3 == pytest.approx(loss, rel=1e-6)
    assert arrays["rms_displacement"][0] ** 2 * 3 * period == pytest.approx(square, rel=1e-6)
    assert arrays["peak_displacement"][0] == pytest.approx(peak, rel=1e-4)
    assert arrays["peak_displacement"][0] >= peak


def test_stuck_between_both_walls():
    """No clearance: one mass on both springs and dashpots, and no event."""
    scene = Parameters(
        0.5, 0.1, 0.7, 0.0, 0.5, support_stiffness_ratio=2.0, support_damping_factor=3
    )
    assert len(events(scene, State(0.3, 0.1, 0.3, 0.4), until=100.0)) == 0
    trajectory = Trajectory(scene, State(0.3, 0.1, 0.3, 0.4))
    trajectory.skip(11.0)
    end = trajectory.state_at(11.0)
    start = [0.3, (0.1 + 0.5 * 0.4) / 1.5]
    run = solve_ivp(
        lambda t, z: [z[1], (math.sin(0.7 * t) - 0.8 * z[1] - 3 * z[0]) / 1.5],
        (0, 11 * trajectory.period),
        start,
        "DOP853",
        rtol=1e-12,
        atol=1e-13,
    )
    assert (end.x, end.v) == pytest.approx(tuple(run.y[:, -1]), abs=1e-10)
    assert (end.y, end.u) == (end.x, end.v)


def test_sticking_moves_about_its_place_of_rest():
    """A segment's motion inside sticking, against the equation with both springs in many digits."""
    trajectory = Trajectory(Parameters(**POINT))
    for log in trajectory.segments(3.0):
        rows = [row.copy() for row in log if row[MODE] == STICKING and row[DURATION] > 0.1]
    row = rows[0]
    side, half = float(row[SIDE]), 0.5 * float(row[DURATION])
    run = solve_ivp(
        lambda t, z: [
            z[1],
            (math.sin(0.2 * (row[TIME] + t)) - 2 * 0.07 * z[1] - z[0] - 0.05 * (z[0] + side * 0.25))
            / 1.1,
        ],
        (0, half),
        [row[X], row[V]],
        "DOP853",
        rtol=1e-13,
        atol=1e-14,
    )
    x, v, gap, rate = motion(trajectory.model, row, half)
    assert (x, v) == pytest.approx(tuple(run.y[:, -1]), abs=1e-12)
    assert (gap, rate) == (0.0, 0.0)


def test_runs_split_anywhere_are_the_same():
    whole = Trajectory(Parameters(**POINT))
    whole.skip(9.0)
    split = Trajectory(Parameters(**POINT))
    for part in range(1, 10):
        split.skip(part - 1.0, 0.4 * split.period)
        split.skip(float(part))
    assert whole.state_at(9.0) == split.state_at(9.0)


def test_si_units_and_the_factor_are_the_same_damper():
    si = SIParameters(
        primary_mass=2.0,
        damping=4.0,
        stiffness=200.0,
        force_amplitude=10.0,
        forcing_frequency=8.0,
        free_mass=0.2,
        gap=0.02,
        restitution=0.6,
        support_stiffness=10.0,
        support_damping=2.0,
    )
    p = si.dimensionless
    assert (p.support_stiffness_ratio, p.support_damping) == pytest.approx((0.05, 0.05))
    assert p.model == "grounded"
    factor = Parameters(
        **{
            name: getattr(p, name)
            for name in ("mass_ratio", "damping_ratio", "frequency_ratio", "clearance")
        },
        restitution=0.6,
        support_stiffness_ratio=p.support_stiffness_ratio,
        support_damping_factor=0.5,
    )
    one = events(si, until=3.0)
    other = events(factor, until=30.0)
    assert len(one) == len(other) > 5
    assert one["time"] * 10 == pytest.approx(other["time"], abs=1e-10)
    assert one["x"] / 0.05 == pytest.approx(other["x"], abs=1e-10)


def test_an_axis_from_no_support_on_is_classical_there():
    axis = [0.0, 0.1]
    rest = {name: POINT[name] for name in list(POINT)[:5]}
    cube = simulate(
        **rest,
        support_stiffness_ratio=axis,
        observers=["response", "bursts"],
        transient=5,
        periods=5,
    )
    classical = simulate(**rest, observers=["response", "bursts"], transient=5, periods=5)
    for name in ("rms_displacement", "energy_residual", "visible_impacts"):
        first = cube[name].isel(support_stiffness_ratio=0).values
        assert first == classical[name].values
        assert cube[name].isel(support_stiffness_ratio=1).values != first


def test_impact_law_is_the_same():
    """Momentum is kept and the relative velocity reversed, whatever the support does."""
    v, rate = impact(0.3, 0.6, 1.0, 0.2, 0.5)
    assert v + 0.3 * (v - rate) == pytest.approx(0.2 + 0.3 * 0.7)
    assert rate == pytest.approx(0.3)


@pytest.mark.parametrize("seed", range(4))
def test_no_swing_into_a_wall_is_missed(seed):
    """Undamped swings against motions in closed form, sampled thirty times a radian."""
    rng = random.Random(seed)
    hits = 0
    for _ in range(25):
        rate, mass_ratio = 10 ** rng.uniform(0.5, 2.5), 0.1
        omega, clearance = rng.choice([0.3, 0.7, 2.5]), 10 ** rng.uniform(-0.5, 0.5)
        scene = parameters(
            (mass_ratio, 0.0, omega, clearance, 0.5, 0.0, rate * rate * mass_ratio, 0.0)
        )
        x0, v0 = rng.uniform(-1, 1) * clearance, rng.uniform(-0.3, 0.3)
        swing = rng.uniform(0, 1.2) * clearance
        turn = rng.uniform(0, 2 * math.pi)
        y0, u0 = swing * math.cos(turn), -rate * swing * math.sin(turn)
        if abs(y0 - x0) >= clearance:
            continue
        trajectory = Trajectory(scene, State(x0, v0, y0, u0), max_events=1)
        log = np.concatenate([piece.copy() for piece in trajectory.segments(1.0)])
        if trajectory.events:
            end = log[log[:, SPEED] > 0][0]
            until = end[PERIOD] * trajectory.period + end[TIME]
            hits += 1
        else:
            until = trajectory.period
        t = np.append(np.arange(0.0, until, 1 / (30 * rate)), until)
        gain = 1 / (1 - omega * omega)
        x = x0 * np.cos(t) + (v0 - gain * omega) * np.sin(t) + gain * np.sin(omega * t)
        y = y0 * np.cos(rate * t) + u0 / rate * np.sin(rate * t)
        outside = abs(y - x) - clearance
        assert outside[:-1].max() < 1e-11 * (1 + swing), scene
        if trajectory.events:
            assert abs(outside[-1]) < 1e-10 * (1 + rate), scene
    assert hits > 8


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_energy_balance_closes_where_a_window_cuts_the_bounces_of_a_closed_burst(side):
    """What such a bounce holds is of second order in the rebound speed, its neglect of third."""
    sizes = []
    for rebound in (0.004, 0.002):
        phase = 0.6 if side > 0 else 0.6 - math.pi
        scene = parameters((0.5, 0.2, 0.3, 0.5, 0.6, phase, 0.05, 0.3))
        x, v = 2.0 * side, 0.1 * side
        trajectory = Trajectory(
            scene, State(x, v, x + side * 0.5, v + side * rebound / 0.6), accuracy=1e-3
        )
        row = next(
            row.copy() for log in trajectory.segments(0.1) for row in log if row[MODE] == TAIL
        )
        worst = 0.0
        for part in np.linspace(0.02, 0.35, 12):
            # From inside the first bounces on, over one whole period.
            observer = Response()
            observer.allocate(1, 1)
            trajectory = Trajectory(
                scene, State(x, v, x + side * 0.5, v + side * rebound / 0.6), accuracy=1e-3
            )
            window = Window(0.0, float(row[TIME] + part * row[DURATION]), 1)
            observer.begin(0, trajectory, window)
            for log in trajectory.segments(1.0, window.time):
                observer.observe(log)
            observer.finish(True)
            worst = max(worst, abs(float(observer.arrays["energy_residual"][0])))
        sizes.append(worst)
    assert sizes[0] / sizes[1] > 6.0


BOLD = """
import json, math, random
from damper import Parameters, State
from damper.engine.trajectory import Trajectory
from damper.engine.segment import SPEED
from damper.models.grounded import search

def bold(one, two, longest, width, gap, rate, side, p, q):
    return longest, 1.0 if gap <= width - gap else -1.0, True

careful = search._aim
worst = hits = 0
rng = random.Random(4)
for _ in range(150):
    rate, d = 10 ** rng.uniform(0.3, 1.5), 10 ** rng.uniform(-0.5, 0.5)
    p = Parameters(0.1, 0.02, 0.7, d, 0.5, support_stiffness_ratio=0.1 * rate * rate)
    state = State(0.2 * d, 0.1, rng.uniform(-0.7, 0.7) * d, rng.uniform(-0.7, 0.7) * d * rate)
    found = []
    for steer in (careful, bold):
        search._aim = steer
        trajectory = Trajectory(p, state, max_events=1)
        (log,) = trajectory.segments(1.0)
        found.append([float(row[0] * trajectory.period + row[1]) for row in log if row[SPEED] > 0])
    assert len(found[0]) == len(found[1])
    if found[0]:
        hits += 1
        worst = max(worst, abs(found[0][0] - found[1][0]))
print(json.dumps([hits, worst]))
"""


def test_steering_decides_nothing():
    """However boldly steps are aimed, the certificate finds the same first contact."""
    hits, worst = in_new_process(BOLD, "-W", "error", DAMPER_COMPILE="0")
    assert hits > 60
    assert worst < 1e-11


@pytest.mark.parametrize("mass_ratio", [1e-6, 1e-9])
def test_a_release_is_where_the_thrust_vanishes_however_heavy_the_support_damping(mass_ratio):
    """Damping over the free mass, squared, once cancelled in the thrust's slope: 6e-8 of thrust."""
    p = Parameters(
        mass_ratio,
        0.000327676,
        1.19794,
        0.000574656,
        1e-6,
        support_stiffness_ratio=0.0466184,
        support_damping_ratio=19.2874,
    )
    found = events(p, State(-2.97, 0.0, -2.97, 2.27), until=60.0)
    releases = found[found["kind"] == KINDS.index("release")]
    assert len(releases) >= 5
    for row in releases:
        x, v, side = float(row["x"]), float(row["v"]), int(row["side"])
        y = x + side * p.clearance
        spring = p.support_stiffness_ratio * y
        dashpots = 2.0 * (p.damping_ratio + p.support_damping_ratio) * v
        push = math.sin(p.frequency_ratio * row["time_in_period"]) - dashpots - x - spring
        common = push / (1.0 + mass_ratio)
        thrust = mass_ratio * common + 2.0 * p.support_damping_ratio * v + spring
        assert abs(thrust) < 1e-12


def test_a_long_flight_after_a_release_keeps_its_digits_under_heavy_damping():
    """Both masses' accelerations are equal there; the primary's rounding once took over: 4e-11."""
    p = Parameters(
        66.9337,
        1000.0,
        0.00277888,
        0.0249912,
        0.409734,
        support_stiffness_ratio=0.000303807,
        support_damping_ratio=1.39865e-05,
    )
    run = Trajectory(p, State(0.0, -0.1, 0.0, -0.1))
    log = np.concatenate([piece.copy() for piece in run.segments(3.0, 0.0)])
    released = np.flatnonzero((log[:-1, CAUSE] == RELEASE) & (log[:-1, DURATION] > 25.0))
    assert released.size
    for row in released:
        _, _, gap, rate = motion(run.model, log[row], log[row, DURATION])
        assert gap == pytest.approx(log[row + 1, GAP], abs=1e-14)
        assert rate == pytest.approx(log[row + 1, RATE], abs=1e-14)


#: Heavily damped primary that hardly moves; the free mass swings 290 times per unit of time.
SWINGING = (0.3, 1000.0, 0.01, 1.0, 0.5, 0.0, 1e6, 0.0)


def flights_of(scene, state, periods, max_events=100_000):
    """Model and log of a run."""
    run = Trajectory(parameters(scene), state, max_events=max_events)
    return run, np.concatenate([piece.copy() for piece in run.segments(periods, 0.0)])


def test_rounding_of_many_swings_takes_no_energy():
    """Undamped, the free mass keeps its energy from a flight's start to just before its end.

    Gap and velocity once rounded apart, the one in units of speed times time: 2e-11 of it at a hit.
    """
    run, log = flights_of(SWINGING, State(0.0, 0.0, 1.0, 1.0), 3.0)
    model = run.model
    r, mu, stiffness = model.restitution, model.mass_ratio, model.support[1]

    def energy(y, u):
        return stiffness * y * y + u * u

    hits = cuts = 0
    for row, end in pairwise(log):
        if row[MODE] != FLIGHT or math.sqrt(stiffness) * row[DURATION] < 1e4:
            continue
        side = row[SIDE]
        before = energy(row[X] + side * (1.0 - row[GAP]), row[V] - side * row[RATE])
        x, v, gap, rate = motion(model, row, row[DURATION])
        found = energy(x + side * (1.0 - gap), v - side * rate)
        assert found == pytest.approx(before, rel=1e-14)
        side = end[SIDE]
        speed = 0.0
        if end[CAUSE] == IMPACT:
            hits += 1
            v = end[V] - side * mu * (1.0 + r) / (1.0 + mu) * end[SPEED]
            speed = end[SPEED]
        else:
            cuts += 1
            v, speed = end[V], -end[RATE]
        after = energy(end[X] + side * (1.0 - end[GAP]), v + side * speed)
        assert after == pytest.approx(before, rel=1e-14)
    assert hits > 2
    assert cuts > 20


def test_a_contact_after_many_swings_is_that_of_fifty_digits():
    """Time to its own rounding, and the speed of approach, which was off by 1e-8 of the swing's."""
    run, log = flights_of((*SWINGING[:4], 0.0, *SWINGING[5:]), State(0.0, 0.0, 1.0, 1.0), 3.0)
    free, support = run.model.free, run.model.support
    ends = [
        row
        for row in range(len(log) - 1)
        if log[row, MODE] == FLIGHT and log[row + 1, CAUSE] == IMPACT
    ]
    ends.sort(key=lambda row: -log[row, DURATION])
    with mp.workdps(50):
        for row in ends[:8]:
            start, end = log[row], log[row + 1]
            assert math.sqrt(support[1]) * start[DURATION] > 1e3
            x, v, gap, rate, side = (mpf(float(start[k])) for k in (X, V, GAP, RATE, SIDE))
            angle = mpf(free[3]) * mpf(float(start[TIME])) + mpf(run.model.phase)
            primary = exact_motion(free, angle, x, v)
            mass = exact_motion(support, angle, x + side * (1 - gap), v - side * rate)
            wall = mpf(float(end[SIDE]))
            moment = duration = mpf(float(start[DURATION]))
            for _ in range(8):
                (x1, v1), (y1, u1) = primary(moment), mass(moment)
                moment += (1 - wall * (y1 - x1)) / (wall * (u1 - v1))
            (x1, v1), (y1, u1) = primary(moment), mass(moment)
            assert abs(moment / duration - 1) < 1e-14
            assert abs(wall * (u1 - v1) - mpf(float(end[SPEED]))) < 1e-11 * math.sqrt(support[1])
            assert abs(x1 - mpf(float(end[X]))) < 1e-15


def exact_motion(osc, angle, x, v):
    """Motion of a linear oscillator in many digits, as a function of time."""
    beta, kappa, force, omega = (mpf(value) for value in osc[:4])
    steady = force / mp.mpc(kappa - omega * omega, 2 * beta * omega) * mp.expj(angle)
    root = mp.sqrt(mp.mpc(beta * beta - kappa))
    one, two = -beta + root, -beta - root
    x, v = x - steady.imag, v - (1j * omega * steady).imag
    a = (v - two * x) / (one - two)
    b = (v - one * x) / (two - one)

    def state(tau):
        p, q, s = a * mp.exp(one * tau), b * mp.exp(two * tau), steady * mp.expj(omega * tau)
        return (p + q).real + s.imag, (one * p + two * q).real + (1j * omega * s).imag

    return state


@pytest.mark.parametrize("damping_ratio", [0.0, 1000.0])
@pytest.mark.parametrize(
    ("frequency_ratio", "restitution"), [(0.01, 0.5), (1.0, 1.0), (100.0, 0.0)]
)
def test_a_swing_back_to_the_wall_is_seen_to_less_than_its_own_rounding(
    damping_ratio, frequency_ratio, restitution
):
    """Hits by 0.3 at the turning point of a swing of 3e7: its depth is 1e-17; once status 2."""
    scene = (1e-9, damping_ratio, frequency_ratio, 1.0, restitution, 0.0, 1e6, 0.0)
    run, log = flights_of(scene, State(0.0, 0.0, 1.0, 1.0), 1.0, max_events=200)
    assert (run.status, run.events) == (1, 200)
    assert (np.diff(log[:, TIME]) >= 0.0).all()
    assert log[:, SPEED].max() < 1e4


@pytest.mark.parametrize("stiffness", [1.0, 1e6])
@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_support_whose_forces_cancel_to_rounding_does_not_stop_a_run(stiffness, restitution):
    """Bounces of 1e-22 and less on a mass of 1e-9 that creeps as the wall does; once status 2."""
    frequency_ratio = 0.01 if stiffness == 1.0 else 1.0
    scene = (1e-9, 0.0, frequency_ratio, 1.0, restitution, 0.0, stiffness, 1e6)
    run, log = flights_of(scene, State(0.0, 0.0, 1.0, 1.0), 15.0)
    assert run.status == 0
    for row, end in pairwise(log):
        if row[MODE] == FLIGHT and end[CAUSE] != IMPACT:
            _, _, gap, rate = motion(run.model, row, row[DURATION])
            assert gap == pytest.approx(end[GAP], abs=1e-14)
            assert rate == pytest.approx(end[RATE], abs=1e-14)
