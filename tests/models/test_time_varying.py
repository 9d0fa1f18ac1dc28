"""The time-variant free mass against arbitrary precision, other solvers, limits and symmetries."""

import itertools
import math
import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf
from new_process import in_new_process
from reference import varying_mass as reference
from scipy.integrate import quad, solve_ivp

from damper import Parameters, SIParameters, State, events
from damper.comparison.reference_rigid import Hit
from damper.engine.oscillator import acceleration
from damper.engine.segment import (
    CAUSE,
    DURATION,
    FLIGHT,
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
from damper.models import model_of, motion, rests, settle, time_to_sticking
from damper.models.time_varying.motion import (
    DEGREE,
    STIFF,
    _first_loss,
    evaluate,
    expand,
    mass_law,
    modulation,
)
from damper.sweep.runs import run_lanes

EPS = np.finfo(float).eps
BASE = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.2,
    "clearance": 0.25,
    "restitution": 0.3,
}

#: name -> values beside BASE, and until when.
SCENES = {
    "chattering": ({"modulation_depth": 0.4}, 60.0),
    "subharmonic": (
        {"modulation_depth": 0.4, "modulation_order": 3, "modulation_phase": 1.0},
        60.0,
    ),
    "deep": ({"mass_ratio": 2.0, "modulation_depth": 0.99, "modulation_phase": -2.0}, 60.0),
    "undamped": (
        {
            "mass_ratio": 0.5,
            "damping_ratio": 0.0,
            "frequency_ratio": 1.0,
            "clearance": 0.2,
            "restitution": 0.5,
            "modulation_depth": 0.5,
        },
        25.0,
    ),
    "critical": (
        {
            "mass_ratio": 0.5,
            "damping_ratio": 1.0,
            "frequency_ratio": 0.6,
            "clearance": 0.05,
            "modulation_depth": 0.5,
        },
        25.0,
    ),
    "overdamped": (
        {
            "mass_ratio": 0.5,
            "damping_ratio": 20.0,
            "frequency_ratio": 0.6,
            "clearance": 0.005,
            "restitution": 0.3,
            "modulation_depth": 0.5,
        },
        12.0,
    ),
    "plastic": (
        {
            "mass_ratio": 0.5,
            "damping_ratio": 0.1,
            "frequency_ratio": 0.3,
            "clearance": 0.05,
            "restitution": 0.0,
            "modulation_depth": 0.9,
            "modulation_order": 2,
        },
        60.0,
    ),
}
KINDS = ("impact", "stick", "release")


def scene(name: str) -> tuple[dict[str, float], float]:
    values, until = SCENES[name]
    return {**BASE, **values}, until


def logged(trajectory: Trajectory, periods: float, time: float = 0.0) -> np.ndarray:
    return np.concatenate([log.copy() for log in trajectory.segments(periods, time)])


# --- events


@pytest.mark.parametrize("name", SCENES)
def test_events_agree_with_arbitrary_precision(name: str) -> None:
    """Every event, one by one; what a closed tail leaves out is left out of the reference."""
    values, until = scene(name)
    rows = events(Parameters(**values), until=until)[:-1][:40]
    found = iter(reference.events(values, until=until, dps=30))
    assert {0, 1, 2} <= set(rows["kind"])
    for row in rows:
        exact = next(event for event in found if event.kind == KINDS[row["kind"]])
        assert row["side"] == exact.side
        assert abs(row["time"] - exact.time) < 1e-12
        assert abs(row["x"] - exact.x) < 2e-13
        assert abs(row["v"] - exact.v) < 2e-13
        assert abs(row["approach_speed"] - exact.approach_speed) < 2e-13


@given(
    side=st.sampled_from([-1.0, 1.0]),
    seed=st.integers(0, 10**6),
)
@settings(max_examples=60)
def test_what_decides_on_staying_is_the_same_in_flight_and_in_contact(
    side: float, seed: int
) -> None:
    """The first derivative of x that is not zero has the same sign with any mass."""
    draw = random.Random(seed)
    model = model_of(Parameters(**BASE, modulation_depth=0.5), 1e-12)
    x, v, angle = draw.uniform(-1, 1), draw.uniform(-1, 1), draw.uniform(-3, 3)
    if draw.random() < 0.5:  # no push, so that the third derivative decides
        x = math.sin(angle) - 2 * BASE["damping_ratio"] * v
    sin, cos = math.sin(angle), math.cos(angle)
    a = 0.0 if draw.random() < 0.5 else math.sin(angle) - 2 * model.free[0] * v - x
    j = model.free[3] * cos - 2 * model.free[0] * a - v
    terms = np.empty(DEGREE + 1)
    expand(model.free, model.law, 0.0, 1.0, x, v, sin, cos, terms)
    together = terms[0] if abs(terms[0]) > 1e-12 else terms[1]
    if a == 0.0 and abs(terms[0]) > 1e-12:
        return
    assert rests(model, 0.0, 1.0, side, x, v, a, j, sin, cos) == (side * together <= 0.0)


# --- the mass


@pytest.mark.parametrize("order", [1, 2, 3, 7, 1000])
def test_mass_ratio_after_many_periods(order: int) -> None:
    """Sharp after 1e6 periods, and near its smallest value."""
    depth, phase, omega = 0.999999, 0.7, 0.3
    law = mass_law(1e6, depth, order, phase, omega)
    period = 2 * math.pi / omega
    for periods, part in itertools.product((0, 5, 10**6 + 1, 10**6 + 499), (0.0, 0.3, 0.9)):
        time = part * period
        mass_ratio, sin, cos = modulation(law, float(periods), time)
        with mp.workdps(40):
            angle = 2 * mp.pi * (mpf(periods) / order) + mpf(omega) / order * mpf(time) + mpf(phase)
            assert abs(sin - mp.sin(angle)) < 1e-14
            assert abs(cos - mp.cos(angle)) < 1e-14
            exact = mpf(1e6) * (1 + mpf(depth) * mp.cos(angle))
            assert abs(mass_ratio - exact) <= 1e-14 * 1e6 * (abs(sin) + EPS) + 4 * EPS * exact


@pytest.mark.parametrize("scene_of", ["chattering", "plastic"])
def test_a_shift_by_whole_periods_of_the_modulation_changes_no_bit(scene_of: str) -> None:
    values, until = scene(scene_of)
    values |= {"modulation_order": 4}
    p = Parameters(**values)

    def run(periods: float) -> np.ndarray:
        start = periods * p.period  # exact for a power of two
        rows = events(p, State(0.01, 0.0, 0.0, 0.0, start), until=start + until, max_events=30)
        assert rows["period"][0] >= periods
        return rows[["kind", "time_in_period", "x", "v", "approach_speed"]][:-1]

    assert np.array_equal(run(0.0), run(4.0))
    assert np.array_equal(run(0.0), run(2.0**20))
    assert not np.array_equal(run(0.0), run(2.0))


# --- the integrator


def corner(seed: int) -> dict[str, float]:
    draw = random.Random(seed)
    return {
        "mass_ratio": 10 ** draw.uniform(-9, 6),
        "damping_ratio": draw.choice([0.0, 0.1, 1.0, 10.0, 100.0, 1e3]),
        "frequency_ratio": 10 ** draw.uniform(-4, 4) if seed % 3 else 1.0,
        "clearance": 0.0,
        "restitution": 0.5,
        "modulation_depth": draw.choice([1e-3, 0.5, 0.95, 0.999, 0.999999]),
        "modulation_phase": draw.uniform(-3, 3),
        "modulation_order": draw.choice([1, 2, 5, 1000]),
    }


@pytest.mark.parametrize("seed", range(40))
def test_sticking_in_the_corners_of_the_parameters(seed: int) -> None:
    """Both masses together over many steps, against short panels in 45 digits."""
    values = corner(seed)
    p, mass = reference.model(values)
    time = min(8.0, 30.0 * random.Random(seed).random() * float(reference.panel(p, mass)))
    run = Trajectory(Parameters(**values), State(0.7, -0.3, 0.7, -0.3))
    periods, rest = run.whole_periods(time)
    run.skip(periods, rest)
    end = run.state_at(periods, rest)
    with mp.workdps(45):
        until = periods * 2 * mp.pi / p.omega + mpf(rest)
        _, x, v, _ = reference.stick(p, mass, mpf(0), mpf(0.7), mpf(-0.3), 0, until)
        assert abs(end.x - x) < 1e-14
        assert abs(end.v - v) < 1e-14


@pytest.mark.parametrize("seed", range(12))
def test_sticking_agrees_with_dop853_and_radau(seed: int) -> None:
    draw = random.Random(seed)
    zeta = [0.0, 0.3, 5.0, 1e4][seed % 4]
    values = {
        "mass_ratio": 10 ** draw.uniform(-1, 1),
        "damping_ratio": zeta,
        "frequency_ratio": 10 ** draw.uniform(-1, 0.5),
        "clearance": 0.0,
        "restitution": 0.5,
        "modulation_depth": draw.choice([0.3, 0.9]),
        "modulation_order": draw.choice([1, 3]),
        "modulation_phase": draw.uniform(-3, 3),
    }
    mean, omega = values["mass_ratio"], values["frequency_ratio"]

    def slope(t: float, state: np.ndarray) -> list[float]:
        angle = omega * t / values["modulation_order"] + values["modulation_phase"]
        inertia = 1 + mean * (1 + values["modulation_depth"] * math.cos(angle))
        return [state[1], (math.sin(omega * t) - 2 * zeta * state[1] - state[0]) / inertia]

    time = 20.0
    method = "Radau" if zeta > 100 else "DOP853"
    tight = {"rtol": 1e-9 if zeta > 100 else 3e-14, "atol": 1e-13}
    exact = solve_ivp(slope, (0.0, time), [0.2, 0.1], method=method, **tight).y[:, -1]
    run = Trajectory(Parameters(**values), State(0.2, 0.1, 0.2, 0.1))
    at = run.whole_periods(time)
    run.skip(*at)
    end = run.state_at(*at)
    tolerance = 3e-8 if zeta > 100 else 3e-12
    assert abs(end.x - exact[0]) < tolerance
    assert abs(end.v - exact[1]) < tolerance


def polynomial(values: dict[str, float], x: float, v: float, time: float = 0.3):
    """Step, velocity and terms, from `expand`."""
    model = model_of(Parameters(**values), 1e-12)
    angle = values["frequency_ratio"] * time
    terms = np.empty(DEGREE + 1)
    step, v, _ = expand(
        model.free, model.law, 0.0, time, x, v, math.sin(angle), math.cos(angle), terms
    )
    return step, v, terms


@pytest.mark.parametrize("name", ["chattering", "deep", "undamped", "overdamped"])
@pytest.mark.parametrize("degree", [3, 6])
def test_order_of_the_series(name: str, degree: int) -> None:
    """Cut off after `degree`, x'' errs by the next power of the step; whole, by rounding."""
    values, _ = scene(name)
    step, v, terms = polynomial(values, 0.4, 0.02)
    p, mass = reference.model(values)
    cut = terms.copy()
    cut[degree + 1 :] = 0.0
    errors = []
    with mp.workdps(40):
        t = mpf(0.3)
        # The phase that the series was given is that of a product in double precision.
        for part in (0.25, 0.125, 1.0):
            _, x, speed, _ = reference.stick(
                p, mass, t, mpf(0.4), mpf(0.02), 0, t + mpf(part) * mpf(step)
            )
            whole = evaluate(terms, step, v, part)
            assert abs(whole[0] - (x - mpf(0.4))) < 1e-15 * max(1.0, step)
            assert abs(whole[1] - speed) < 1e-15 * max(1.0, step)
            errors.append(abs(float(evaluate(cut, step, v, part)[1] - speed)))
    assert 2 ** (degree + 1.5) < errors[0] / errors[1] < 2 ** (degree + 2.5)


@pytest.mark.parametrize("zeta", [3e2, 1e4, 1e6])
def test_slow_series_solves_the_equation_with_heavy_damping(zeta: float) -> None:
    """Its residual bounds its error, since damping only shrinks what separates two motions."""
    values = {**BASE, "damping_ratio": zeta, "mass_ratio": 0.5, "modulation_depth": 0.7}
    values["clearance"] = 0.0
    p, mass = reference.model(values)
    run = Trajectory(Parameters(**values), State(0.4, 0.0, 0.4, 0.0))
    rows = [row for row in logged(run, 1.0) if row[DURATION] * 2 * zeta / 1.9 > STIFF]
    assert len(rows) > 3
    row = rows[1]
    time, x, v = float(row[TIME]), float(row[X]), float(row[V])
    step, slow, terms = polynomial(values, x, v, time)
    assert step == row[DURATION]
    assert abs(slow - v) <= 1e-13 * abs(v) + 1e-15 / zeta
    with mp.workdps(40):
        for part in (0.0, 0.3, 1.0):
            s, h = mpf(part), mpf(step)
            second = sum(mpf(c) * s**k for k, c in enumerate(terms))
            speed = mpf(slow) + h * sum(
                mpf(c) * s ** (k + 1) / (k + 1) for k, c in enumerate(terms)
            )
            way = h * s * mpf(slow) + h * h * sum(
                mpf(c) * s ** (k + 2) / ((k + 1) * (k + 2)) for k, c in enumerate(terms)
            )
            t = mpf(time) + h * s
            force = mp.sin(p.omega * t)
            residual = (1 + mass.at(t)) * second + 2 * p.zeta * speed + mpf(x) + way - force
            assert abs(residual) < 1e-15


def test_step_count_does_not_grow_with_the_damping() -> None:
    """Ten periods with the masses stuck together: a fast mode costs steps only while it lives."""
    counts = {}
    for zeta in (0.1, 1e2, 1e4, 1e6):
        values = {**BASE, "damping_ratio": zeta, "clearance": 0.0, "modulation_depth": 0.8}
        run = Trajectory(Parameters(**values), State(0.5, 0.3, 0.5, 0.3))
        run.skip(10.0)
        counts[zeta] = run.evaluations
    assert max(counts.values()) < 400


def test_steps_stay_long_where_the_force_vanishes() -> None:
    """Its rounding is that of its phase: 1e-15 where the force is 1e-2, once taken for a fast mode.

    Sticking then went on by steps of 1e-6 for a forcing period of 6e4, without an event to stop it.
    """
    values = {
        "mass_ratio": 5.88103e-06,
        "damping_ratio": 1e6,
        "frequency_ratio": 1e-4,
        "clearance": 2.28855e-05,
        "restitution": 0.0757902,
        "phase": -2.68128,
        "modulation_depth": 0.000134177,
        "modulation_order": 3.0,
        "modulation_phase": -1.37166,
    }
    run = Trajectory(Parameters(**values), State(0.0, -2.9001, 2.28855e-05, -5.54904))
    rows = 0
    for piece in run.segments(1.0):
        rows += len(piece)
        assert rows < 5000
    assert run.status == 0


def test_steps_that_get_nowhere_use_up_the_budget() -> None:
    """With a fast mode that never dies, sticking has no event to count."""
    code = """
import damper.engine.trajectory
import damper.models.time_varying.motion
from damper import Parameters, State
damper.models.time_varying.motion.DEAD = -1.0
damper.engine.trajectory.search_budget = lambda events: 300.0
p = Parameters(0.1, 1e6, 0.5, 0.0, 0.5, modulation_depth=0.5)
run = damper.engine.trajectory.Trajectory(p, State(0.5, 0.0, 0.5, 0.0))
run.skip(1.0)
print(run.status * 1000 + run.evaluations)
"""
    assert 1300 <= in_new_process(code, DAMPER_COMPILE="0") <= 1310


# --- the release


@given(
    roots=st.lists(st.floats(0.02, 1.5), min_size=1, max_size=7),
    close=st.floats(1e-7, 1e-2),
    side=st.sampled_from([-1.0, 1.0]),
)
@settings(max_examples=300)
def test_no_loss_of_contact_is_skipped(roots: list[float], close: float, side: float) -> None:
    """Thrusts with chosen roots, two of them close together: the first sign change is found."""
    roots = sorted([*roots, roots[0] + close])
    p = np.polynomial.Polynomial.fromroots(roots)
    p = p if p(0.0) > 0.0 else -p
    terms = np.zeros(DEGREE + 1)
    terms[: len(p.coef)] = -side * p.coef
    rounding = 8 * EPS * float(np.abs(p.coef).sum())
    found = _first_loss(terms, side, side, rounding)

    with mp.workdps(40):
        exact = [mpf(float(c)) for c in p.coef]

        def thrust(t: float) -> mpf:
            return sum(c * mpf(t) ** k for k, c in enumerate(exact))

        low = min(found, 1.0)
        # Nowhere before it does the thrust lie below zero by more than rounding.
        for t in np.linspace(0.0, low, 400)[:-1]:
            assert thrust(t) >= -4 * rounding
        for one, other in itertools.pairwise([r for r in roots if r < low]):
            assert thrust((one + other) / 2) >= -4 * rounding
        if found <= 1.0:
            assert abs(thrust(found)) <= 4 * rounding
            slope = p.deriv()(found)
            assert slope < 1e-6 * float(np.abs(p.coef).sum())


def test_a_dip_in_one_step_ends_sticking() -> None:
    """A sign change that both ends of the step and its middle do not show."""
    p = np.polynomial.Polynomial.fromroots([0.31, 0.3100002])
    terms = np.zeros(DEGREE + 1)
    terms[:3] = -p.coef
    assert abs(_first_loss(terms, 1.0, 1.0, 1e-16) - 0.31) < 1e-9
    p = np.polynomial.Polynomial.fromroots([0.31 + 0.01j, 0.31 - 0.01j])
    terms[:3] = -p.coef.real
    assert _first_loss(terms, 1.0, 1.0, 1e-16) == 2.0


def test_release_is_the_first_zero_of_the_acceleration() -> None:
    """Along whole runs: the thrust pushes at samples in every stretch of sticking."""
    for name in SCENES:
        values, until = scene(name)
        p = Parameters(**values)
        run = Trajectory(p)
        mu = reference.model(values)[1]
        for row in logged(run, *run.whole_periods(until)):
            if row[MODE] != STICKING:
                continue
            for part in np.linspace(0.0, 1.0, 23)[1:-1]:
                tau = part * row[DURATION]
                x, v, gap, rate = motion(run.model, row, tau)
                t = row[PERIOD] * p.period + row[TIME] + tau
                a = math.sin(p.frequency_ratio * t) - 2 * p.damping_ratio * v - x
                assert -row[SIDE] * a / (1 + float(mu.at(mpf(t)))) > -1e-14
                assert gap == rate == 0.0


# --- the tail of a burst


def tail(values: dict[str, float], side: float, time: float, x: float, v: float, rebound: float):
    """Duration, estimate of its error, x and v at sticking."""
    model = model_of(Parameters(**values), 1e-12)
    angle = values["frequency_ratio"] * time
    sin, cos = math.sin(angle), math.cos(angle)
    a, j = acceleration(model.free, x, v, sin, cos)
    duration, error = time_to_sticking(model, 0.0, time, side, x, v, rebound, a, j, sin, cos)
    if error == math.inf:
        return duration, error, x, v
    dx, v = settle(model, 0.0, time, side, x, v, rebound, sin, cos, duration)
    return duration, error, x + dx, v


@pytest.mark.parametrize("side", [1, -1])
def test_tail_errs_by_the_third_order(side: int) -> None:
    """Bursts resolved in 30 digits: halving the rebound speed divides every error by eight."""
    values = {
        "mass_ratio": 0.5,
        "damping_ratio": 0.2,
        "frequency_ratio": 0.3,
        "clearance": 0.5,
        "restitution": 0.6,
        "modulation_depth": 0.6,
        "modulation_phase": 1.0,
    }
    start = (2.0, 2.0 * side, 0.1)
    errors = []
    for w in (0.005, 0.0025, 0.00125):
        duration, estimate, x, v = tail(values, side, *start, w)
        exact = reference.burst(values, Hit(mpf(2), side, mpf(0), *start[1:]), w, dps=30)
        errors.append([abs(float(a - b)) for a, b in zip((duration, x, v), exact, strict=True)])
        assert errors[-1][0] < estimate
    for one, other in itertools.pairwise(errors):
        assert all(7.0 < a / b < 9.0 for a, b in zip(one, other, strict=True))


def test_tail_estimate_is_on_the_safe_side() -> None:
    draw = random.Random(4)
    compared = 0
    while compared < 60:
        zeta = draw.choice([0.0, 0.05, 0.5, 3.0, 20.0])
        values = {
            "mass_ratio": 10 ** draw.uniform(-3, 2),
            "damping_ratio": zeta,
            "frequency_ratio": 10 ** draw.uniform(-1, 1),
            "clearance": 0.5,
            "restitution": draw.choice([0.05, 0.3, 0.6, 0.8]),
            "modulation_depth": draw.choice([0.1, 0.6, 0.95, 0.999]),
            "modulation_phase": draw.uniform(-3, 3),
            "modulation_order": draw.choice([1, 2, 5]),
        }
        start = (
            draw.uniform(0, 3),
            draw.uniform(0.5, 3),
            draw.uniform(-1, 1) / max(1, 10 * zeta),
        )
        w = 0.01 * draw.random() ** 2
        duration, estimate, _, v = tail(values, 1.0, *start, w)
        while 1e-3 * duration < estimate < math.inf:
            w /= 3
            duration, estimate, _, v = tail(values, 1.0, *start, w)
        if estimate == math.inf:
            continue
        exact = reference.burst(values, Hit(start[0], 1, mpf(0), *start[1:]), w, dps=25)
        push = abs(math.sin(values["frequency_ratio"] * start[0]) - 2 * zeta * start[2] - start[1])
        assert abs(duration - exact[0]) < estimate
        assert abs(v - exact[2]) < estimate * push
        compared += 1


# --- limits


@pytest.mark.parametrize("name", SCENES)
def test_modulation_that_vanishes_gives_the_rigid_run(name: str) -> None:
    values, until = scene(name)
    rigid = events(
        Parameters(**{**values, "modulation_depth": 0.0, "modulation_order": 1}), until=until
    )
    nearly = events(Parameters(**{**values, "modulation_depth": 1e-15}), until=until)
    assert np.array_equal(rigid["kind"], nearly["kind"])
    for column in ("time", "x", "v"):
        assert np.abs(rigid[column] - nearly[column])[:30].max() < 1e-11


def test_no_modulation_is_the_rigid_model() -> None:
    """The same class of constants, the same bytes, and the module is not even imported."""
    values = {**BASE, "modulation_depth": 0.0, "modulation_order": 3, "modulation_phase": 1.0}
    assert type(model_of(Parameters(**values), 1e-12)) is type(model_of(Parameters(**BASE), 1e-12))
    one = events(Parameters(**values), until=100.0)
    assert one.tobytes() == events(Parameters(**BASE), until=100.0).tobytes()
    loaded = in_new_process(
        "import sys, json; from damper.sweep.runs import run_lanes;"
        f"run_lanes([{values!r}], ['response', 'trajectory', 'bursts'], transient=1, periods=1);"
        "print(json.dumps([m for m in sys.modules if 'modul' in m or 'varying' in m]))",
        # Plain: numba's cache names the classes of all models that were ever compiled.
        DAMPER_COMPILE="0",
    )
    assert [name for name in loaded if name.startswith("damper")] == []


def test_a_slow_modulation_is_a_constant_mass() -> None:
    """Order 1000 over a few impacts: mu stays at its value at time 0 up to the change in time."""
    values = {**BASE, "modulation_depth": 0.5, "modulation_order": 1e9, "modulation_phase": 1.0}
    mass_ratio = 0.1 * (1 + 0.5 * math.cos(1.0))
    slow = events(Parameters(**values), until=20.0)
    fixed = events(Parameters(**{**BASE, "mass_ratio": mass_ratio}), until=20.0)
    assert np.array_equal(slow["kind"], fixed["kind"])
    assert np.abs(slow["time"] - fixed["time"]).max() < 1e-7


# --- the rest of the engine


@pytest.mark.parametrize("seed", range(5))
def test_corners_finish_in_order(seed: int) -> None:
    draw = random.Random(seed)
    for _ in range(60):
        zeta = draw.choice([0.0, 1e-6, 0.05, 1.0, 10 ** draw.uniform(-2, 6), 1e6])
        omega = 10 ** draw.uniform(-4, 4)
        p = Parameters(
            mass_ratio=10 ** draw.uniform(-9, 6),
            damping_ratio=zeta,
            frequency_ratio=omega,
            clearance=draw.choice([0.0, 10 ** draw.uniform(-3, 1)])
            / max(1, zeta)
            / max(1, omega**2),
            restitution=draw.choice([0.0, 0.3, 0.6, 0.9, 1.0]),
            phase=draw.uniform(-3, 3),
            modulation_depth=draw.choice([1e-9, 0.1, 0.9, 0.999, 0.999999]),
            modulation_order=draw.choice([1, 2, 7, 1000]),
            modulation_phase=draw.uniform(-3, 3),
        )
        x, v = draw.uniform(-1, 1), draw.uniform(-1, 1) / max(1, zeta)
        state = State(x, v, x + p.clearance * draw.choice([-1, 0, 1]), v)
        rows = events(p, state, until=min(30 * p.period, 400.0), max_events=2000)
        for column in ("time", "x", "v", "approach_speed"):
            assert np.isfinite(rows[column]).all()
        assert (np.diff(rows["time"]) >= 0.0).all(), p


def test_release_with_heavy_damping_and_slow_forcing() -> None:
    """The third derivative there is far below what rounding of the second makes of it."""
    p = Parameters(
        mass_ratio=6.0368459657381624e-05,
        damping_ratio=1e6,
        frequency_ratio=0.011881703952853219,
        clearance=3.090567466015273e-09,
        restitution=0.3,
        phase=1.4142270009616462,
        modulation_depth=0.1,
        modulation_order=7,
        modulation_phase=-1.4155671653458017,
    )
    draw = random.Random(1)
    for _ in range(8):
        x, v = draw.uniform(-1, 1), draw.uniform(-1e-6, 1e-6)
        rows = events(p, State(x, v, x + p.clearance, v), until=400.0, max_events=5000)
        assert (np.diff(rows["time"]) >= 0.0).all()
        assert 10 < len(rows) < 100


def test_motion_meets_the_next_segment() -> None:
    """Inside the log nothing jumps but the velocity at impacts."""
    checked = dict.fromkeys((FLIGHT, TAIL, STICKING), 0)
    for name in SCENES:
        values, _ = scene(name)
        run = Trajectory(Parameters(**values))
        for row, following in itertools.pairwise(logged(run, 6.0)):
            x, v, gap, rate = motion(run.model, row, row[DURATION])
            scale = 1.0 + abs(x)
            assert abs(x - following[X]) < 4e-15 * scale
            if row[MODE] != FLIGHT:
                assert abs(v - following[V]) < 4e-15 * scale
                assert abs(gap) < 1e-15
                assert abs(rate) < 1e-15
            checked[float(row[MODE])] += 1
            x, v, gap, rate = motion(run.model, row, 0.0)
            assert (x, gap) == (row[X], 0.0 if row[MODE] == STICKING else gap)
            assert abs(v - row[V]) < 2e-16 * (1 + abs(v))
            if row[MODE] == TAIL:
                assert abs(rate - row[RATE]) < 1e-14
    assert min(checked.values()) > 5


def test_a_run_is_the_same_however_it_is_split() -> None:
    values, _ = scene("deep")
    whole, parts = Trajectory(Parameters(**values)), Trajectory(Parameters(**values))
    whole.skip(7.0)
    for k in range(1, 71):
        parts.skip(k // 10, (k % 10) / 10 * whole.period)
    assert whole.state_at(7.0) == parts.state_at(7.0)
    assert whole.events == parts.events > 100


def test_si_units_give_the_scaled_run() -> None:
    si = SIParameters(
        primary_mass=2.0,
        damping=4.0,
        stiffness=200.0,
        force_amplitude=10.0,
        forcing_frequency=3.0,
        free_mass=0.6,
        gap=0.02,
        restitution=0.4,
        modulation_depth=0.5,
        modulation_order=2,
    )
    rows = events(si, until=6.0)
    scaled = events(si.dimensionless, until=6.0 / si.units.time)
    assert len(rows) == len(scaled) > 20
    assert np.allclose(rows["time"], scaled["time"] * si.units.time, rtol=1e-12)
    assert np.allclose(rows["x"], scaled["x"] * si.units.length, rtol=1e-9, atol=1e-12)


PLAIN = """
import json
from damper import Parameters as P, State as S, events
from damper.sweep.runs import run_lanes
runs = [
    (P(0.1, 0.05, 0.2, 0.25, 0.3, modulation_depth=0.4), None, 60.0),
    (P(0.5, 0.1, 0.3, 0.05, 0.0, modulation_depth=0.999999, modulation_order=1000), None, 60.0),
    (P(2.0, 3.0, 0.5, 0.0, 1.0, modulation_depth=0.9), S(0.1, 0.0, 0.1, 1.0), 60.0),
    (P(1e-9, 1.0, 10.0, 0.005, 0.7, modulation_depth=0.5), None, 20.0),
    (P(1e6, 1e6, 0.7, 5e-8, 0.5, modulation_depth=0.999999), S(0.0, 0.0, 0.0, 1e-7), 5.0),
    (P(0.5, 1e6, 0.6, 5e-7, 0.5, modulation_depth=0.5), None, 20.0),
    (P(0.3, 0.1, 1e4, 1e-8, 0.7, modulation_depth=0.5, modulation_order=3), None, 0.02),
    (P(0.3, 0.1, 1e-4, 1e-8, 0.7, modulation_depth=0.5, modulation_order=3), None, 2e3),
]
found = []
for parameters, state, until in runs:
    rows = events(parameters, state, until=until, max_events=60)
    found += [[float(v).hex() for v in rows[c]] for c in ("time", "kind", "x", "v")]
values = dict(mass_ratio=0.2, damping_ratio=0.01, frequency_ratio=0.25, clearance=0.05,
              restitution=0.6, modulation_depth=0.7, modulation_order=2)
arrays, _ = run_lanes([values], {"response": {"modulation_work": True}}, transient=1, periods=1)
print(json.dumps([found, {name: float(a[0]).hex() for name, a in arrays.items()}]))
"""


def test_compiled_and_plain_give_the_same_bits() -> None:
    """And plain Python, where nothing may become infinite, neither warns nor raises."""
    plain = in_new_process(PLAIN, "-W", "error", DAMPER_COMPILE="0")
    assert plain == in_new_process(PLAIN, DAMPER_COMPILE="1")
    assert "nan" not in str(plain)
    assert "inf" not in str(plain)


# --- observers


@pytest.mark.parametrize("name", ["chattering", "deep", "overdamped"])
def test_sampled_impacts_keep_the_momentum(name: str) -> None:
    """The rows before and after an impact, with the mass ratio of that moment."""
    values, _ = scene(name)
    asked = {"trajectory": {"samples_per_period": 10, "events": 500}}
    arrays, _ = run_lanes([values], asked, transient=2, periods=4)
    a = {key: array[0] for key, array in arrays.items()}
    mass = reference.model(values)[1]
    start = 2 * Parameters(**values).period
    impacts = np.flatnonzero(a["trajectory_event"] == IMPACT)
    assert len(impacts) > 20
    for before, after in zip(impacts[::2], impacts[1::2], strict=True):
        mu = float(mass.at(mpf(start + a["trajectory_time"][before])))
        v = a["trajectory_velocity"]
        u = a["trajectory_free_velocity"]
        assert a["trajectory_time"][before] == a["trajectory_time"][after]
        assert abs(v[before] + mu * u[before] - v[after] - mu * u[after]) < 1e-13
        approach = u[before] - v[before]
        assert abs(u[after] - v[after] + values["restitution"] * approach) < 1e-13


@pytest.mark.parametrize("stuck", [False, True])
@pytest.mark.parametrize("name", SCENES)
def test_energy_balance_closes_with_the_work_of_the_modulation(name: str, stuck: bool) -> None:
    values, _ = scene(name)
    values["clearance"] *= not stuck
    arrays, _ = run_lanes([values], {"response": {"modulation_work": True}}, transient=3, periods=5)
    found = {key: float(array[0]) for key, array in arrays.items()}
    scale = max(abs(found[key]) for key in ("energy_input", "dashpot_loss", "impact_loss"))
    assert abs(found["energy_residual"]) < 2e-14 * scale
    assert abs(found["modulation_work"]) > 1e-9 * scale


@pytest.mark.parametrize("name", ["deep", "overdamped"])
def test_response_agrees_with_quadrature_of_the_motion(name: str) -> None:
    values, _ = scene(name)
    p = Parameters(**values)
    arrays, _ = run_lanes([values], {"response": {"modulation_work": True}}, transient=1, periods=2)
    run = Trajectory(p)
    run.skip(1.0)
    mass = reference.model(values)[1]
    totals = dict.fromkeys(("rms_displacement", "energy_input", "modulation_work"), 0.0)
    peak = 0.0
    for row in logged(run, 3.0):
        t0 = (row[PERIOD] - 1.0) * p.period + row[TIME]
        low, high = max(0.0, -t0), row[DURATION]
        if high <= low:
            continue

        def at(tau: float, what: str, row: np.ndarray = row) -> float:
            x, v, _, rate = motion(run.model, row, tau)
            u = v - row[SIDE] * rate
            if what == "rms_displacement":
                return x * x
            time = row[PERIOD] * p.period + row[TIME] + tau
            if what == "energy_input":
                return math.sin(p.frequency_ratio * time) * v
            swing = -float(mass.mean * mass.depth * mass.rate)
            return 0.5 * swing * math.sin(float(mass.rate) * time + float(mass.phase)) * u * u

        if row[MODE] == TAIL:  # thousands of bounces: their mean is that of the centre
            high = low
        for what in totals:
            totals[what] += quad(at, low, high, (what,), epsabs=1e-13, epsrel=1e-12)[0]
        peak = max(peak, *(abs(motion(run.model, row, t)[0]) for t in np.linspace(low, high, 400)))
    length = 2 * p.period
    # Tails are left out above; each is as short as this.
    left_out = 1e-3
    found = {key: float(array[0]) for key, array in arrays.items()}
    assert abs(found["rms_displacement"] ** 2 * length - totals["rms_displacement"]) < left_out
    assert abs(2 * found["energy_input"] - totals["energy_input"]) < left_out
    assert abs(2 * found["modulation_work"] - totals["modulation_work"]) < left_out
    assert peak <= found["peak_displacement"] * (1 + 4 * EPS)
    assert found["peak_displacement"] < peak * (1 + 1e-4)


@pytest.mark.parametrize("zeta", [0.05, 2.0, 1e4])
def test_response_while_stuck_is_exact(zeta: float) -> None:
    """Integrals as further unknowns of a numerical solution, and the peak by fine sampling."""
    values = {**BASE, "damping_ratio": zeta, "clearance": 0.0, "modulation_depth": 0.8}
    values |= {"mass_ratio": 1.5, "modulation_order": 2}
    p = Parameters(**values)
    arrays, _ = run_lanes([values], {"response": {"modulation_work": True}}, transient=2, periods=4)
    found = {key: float(array[0]) for key, array in arrays.items()}
    run = Trajectory(p)
    run.skip(2.0)
    totals = np.zeros(4)
    peak = 0.0
    mass = reference.model(values)[1]
    swing = -float(mass.mean * mass.depth * mass.rate)
    nodes, weights = np.polynomial.legendre.leggauss(30)
    for row in logged(run, 6.0):
        t0 = (row[PERIOD] - 2.0) * p.period + row[TIME]
        low = max(0.0, -t0)
        for node, weight in zip(nodes, weights, strict=True):
            tau = low + 0.5 * (row[DURATION] - low) * (1 + node)
            x, v, _, _ = motion(run.model, row, tau)
            time = row[PERIOD] * p.period + row[TIME] + tau
            rate = swing * math.sin(float(mass.rate) * time)
            add = [x * x, v * v, math.sin(p.frequency_ratio * time) * v, 0.5 * rate * v * v]
            totals += 0.5 * (row[DURATION] - low) * weight * np.array(add)
        peak = max(
            peak, *(abs(motion(run.model, row, t)[0]) for t in np.linspace(low, row[DURATION], 99))
        )
    record = 4 * p.period
    assert math.isclose(found["rms_displacement"], math.sqrt(totals[0] / record), rel_tol=1e-12)
    assert math.isclose(found["dashpot_loss"], 2 * zeta * totals[1] / 4, rel_tol=1e-12)
    assert math.isclose(found["energy_input"], totals[2] / 4, rel_tol=1e-11)
    assert math.isclose(
        found["modulation_work"], totals[3] / 4, rel_tol=1e-9, abs_tol=1e-14 * totals[1]
    )
    assert peak <= found["peak_displacement"] * (1 + 4 * EPS)
    assert found["peak_displacement"] < peak * (1 + 1e-5)


def test_modulation_work_is_written_where_it_is_asked_for() -> None:
    arrays, _ = run_lanes([BASE], ["response"], transient=1, periods=1)
    assert "modulation_work" not in arrays
    arrays, _ = run_lanes([BASE], {"response": {"modulation_work": True}}, transient=1, periods=1)
    assert arrays["modulation_work"][0] == 0.0


@pytest.mark.parametrize("clearance", [1e-3, 1.0])
def test_a_flight_after_a_release_is_read_as_it_was_flown(clearance: float) -> None:
    """A varying mass drives the primary to 1e14, where its x'' at a release rounds to 1e-2, not 0.

    Newton's law, with the approach speed from the state inside the flight, was kept to 4e-11 then.
    """
    values = {
        "mass_ratio": 1e6,
        "damping_ratio": 0.0,
        "frequency_ratio": 0.01,
        "clearance": clearance,
        "restitution": 0.5,
        "modulation_depth": 0.999,
        "modulation_order": 1.0,
    }
    run = Trajectory(Parameters(**values), State(0.0, 0.0, clearance, 1.0))
    log = logged(run, 19.0)
    fast = 0
    for row, end in itertools.pairwise(log):
        if row[CAUSE] == RELEASE and end[CAUSE] == IMPACT:
            _, _, _, rate = motion(run.model, row, float(row[DURATION]))
            assert abs(rate) == pytest.approx(float(end[SPEED]), rel=1e-14)
            fast += abs(row[V]) > 1e12
    assert fast > 2
