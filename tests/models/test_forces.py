"""Every force in every model: against many digits, another solver, closed forms, identities."""

import math
import random
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from cases import thinned
from event_pairs import KINDS, changes, paired
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import GENERIC, QUIET
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from damper import Parameters, State, events, simulate
from damper.engine.compiled import plain
from damper.engine.segment import DURATION, SIDE
from damper.models import start_run
from damper.parameters.forcing import (
    Base,
    Harmonic,
    Harmonics,
    NoForce,
    Noise,
    Record,
    Unbalance,
)
from damper.verification.reference import run

#: Largest error of an event: its time, x, v and approach speed.
ERROR = 5e-11
#: Model or law -> what makes it.
MODELS: dict[str, dict[str, float]] = {
    "rigid": {},
    "yielding": {"yield_speed": 0.05},
    "grounded": {"support_stiffness_ratio": 0.05, "support_damping_ratio": 0.02},
    "compliant": {"contact_stiffness_ratio": 3e3},
    "tension": {"contact_stiffness_ratio": 3e3, "contact_tension": 1},
    "time_varying": {"modulation_depth": 0.4, "modulation_order": 3, "modulation_phase": 1.0},
}


def harmonics(draw: random.Random, *orders: int) -> Harmonics:
    amplitudes = [draw.uniform(-1, 1) for _ in orders]
    return Harmonics(orders, amplitudes, [draw.uniform(-3, 3) for _ in orders])


def record(draw: random.Random, **more: str) -> Record:
    """Samples at uneven times, after a while without a force; its value jumps at both ends."""
    steps = [draw.uniform(0, 2), *(10 ** draw.uniform(-1, 0.3) for _ in range(draw.randint(1, 40)))]
    return Record(np.cumsum(steps), [draw.gauss(0, 1) for _ in steps], **more)


#: Name -> a random one.
FORCES = {
    "none": lambda draw: NoForce(),
    "harmonic": lambda draw: Harmonic(),
    "two harmonics": lambda draw: harmonics(draw, 1, 2),
    "five harmonics": lambda draw: harmonics(draw, 1, 2, 3, 5, 8),
    "unbalance": lambda draw: Unbalance(),
    "base in the ground's frame": lambda draw: Base("ground"),
    "base in its own frame": lambda draw: Base("base"),
    "record of a force": lambda draw: record(draw),
    "held record of a force": lambda draw: record(draw, after="hold"),
    "record of the base": lambda draw: record(draw, of="base_acceleration"),
    "held record of the base": lambda draw: record(draw, of="base_acceleration", after="hold"),
    "noise": lambda draw: Noise(draw.randint(0, 99), 0.1, 30.0, (0.5, 4.0)),
}
PAIRS = [(model, force) for model in MODELS for force in FORCES]


def random_scene(model: str, force: str, seed: int) -> tuple[dict[str, Any], tuple[float, ...]]:
    """Parameters and a start; most chatter, and stick."""
    draw = random.Random(f"{model}, {force}, {seed}")
    values: dict[str, Any] = {
        "mass_ratio": 10 ** draw.uniform(-3, 0.3),
        "damping_ratio": draw.choice([0.0, 0.02, draw.uniform(0, 0.3), 1.5]),
        "frequency_ratio": 10 ** draw.uniform(-0.9, 0.3),
        "clearance": 10 ** draw.uniform(-1.5, 0),
        "restitution": draw.choice([0.0, draw.uniform(0.05, 0.6), draw.uniform(0.05, 0.3)]),
        "phase": draw.uniform(-3, 3),
        "force_amplitude": 10 ** draw.uniform(-0.5, 0.5),
        "forcing": FORCES[force](draw),
        **MODELS[model],
    }
    if not values["forcing"].has_phase:
        del values["phase"]
    if force == "none":
        del values["force_amplitude"]
    if values.get("contact_stiffness_ratio"):
        values["restitution"] = draw.uniform(0.05, 0.7)
        # What bounces on it has this rate.
        rate, mu = 10 ** draw.uniform(0.7, 1.7), values["mass_ratio"]
        values["contact_stiffness_ratio"] = rate**2 * mu / (1 + mu)
    if model == "time_varying":
        values["modulation_depth"] = draw.uniform(0.05, 0.95)
        values["modulation_order"] = draw.randint(1, 4)
        values["modulation_phase"] = draw.uniform(-3, 3)
    if model == "grounded":
        mu = values["mass_ratio"]
        values["support_stiffness_ratio"] = draw.choice([0.0, mu * 10 ** draw.uniform(-2, 1)])
        values["support_damping_ratio"] = mu * 10 ** draw.uniform(-2, 1.3)
    x = draw.uniform(-2, 2)
    y = x + values["clearance"] * draw.uniform(-1, 1)
    return values, (x, draw.uniform(-1, 1), y, draw.uniform(-1, 1))


def length_of(values: dict[str, Any], state: tuple[float, ...]) -> float:
    """Until when there are some twenty events."""
    table = events(Parameters(**values), State(*state), until=25.0, max_events=20)
    return 25.0 if len(table) < 20 else float(table["time"][-2]) + 1e-3


#: Kind, side, and numbers.
Rows = list[tuple[str, int, tuple[Any, ...]]]


def rows_of_both(
    values: dict[str, Any], state: tuple[float, ...], until: float, digits: int = 16
) -> tuple[Rows, Rows]:
    """Events of the engine, and in many digits; those that a closed tail stands for in none."""
    exact = run(values, state, until=until, digits=digits).events
    p, start = Parameters(**values), State(*state)
    if p.model == "compliant":
        found = [(kind, side, tuple(row)) for kind, side, *row in changes(p, until, start)]
    else:
        table = events(p, start, until=until)
        names = {code: kind for kind, code in KINDS.items()}
        numbers = table[["time", "x", "v", "approach_speed"]].tolist()
        kinds = [names[kind] for kind in table["kind"]]
        found = list(zip(kinds, table["side"].tolist(), numbers, strict=True))
        rest = [event.kind for event in exact if event.kind != "impact"]
        assert [kind for kind in kinds if kind != "impact"] == rest
        exact = [event for _, event in paired(table, exact)]
    return found, [(e.kind, e.side, (e.time, e.x, e.v, e.approach_speed)) for e in exact]


def largest_error(found: Rows, exact: Rows) -> float:
    """Of any number of any event."""
    assert [row[:2] for row in found] == [row[:2] for row in exact]
    errors = [0.0]
    for (*_, numbers), (*_, right) in zip(found, exact, strict=True):
        errors += [float(abs(a - b)) for a, b in zip(numbers, right, strict=True)]
    return max(errors)


def growth(values: dict[str, Any], state: tuple[float, ...], until: float) -> float:
    """How far events move with the start, over that, as long as the same ones happen."""
    x, v, y, u = state
    starts = [(x, v, y, u), (x, v + 1e-13, y, u)]
    runs = [run(values, start, until=until, digits=16).events for start in starts]
    errors = [0.0]
    for one, other in zip(*runs, strict=False):
        if one[1:3] != other[1:3]:
            break
        pairs = zip((one.time, one.x, one.v), (other.time, other.x, other.v), strict=True)
        errors += [float(abs(a - b)) for a, b in pairs]
    return max(errors) / 1e-13


@pytest.mark.parametrize(
    ("model", "force"), thinned(PAIRS, lambda pair: PAIRS.index(pair) % 3 == 0)
)
@plain
def test_events_against_many_digits(model: str, force: str) -> None:
    values, state = random_scene(model, force, 0)
    found, exact = rows_of_both(values, state, 0.5 * length_of(values, state))
    assert len(found) >= 2
    assert largest_error(found, exact) < ERROR


@pytest.mark.exhaustive
@pytest.mark.parametrize(("model", "force"), PAIRS)
@plain
def test_many_random_scenes(model: str, force: str) -> None:
    """Most with chatter, sticking and releases; rounding may only grow as motions part anyway."""
    kinds: set[str] = set()
    for seed in range(200):
        values, state = random_scene(model, force, seed)
        until = length_of(values, state)
        found, exact = rows_of_both(values, state, until)
        kinds |= {kind for kind, *_ in found}
        error = largest_error(found, exact)
        assert error < ERROR or error < 1e-14 * growth(values, state, until), seed
    soft = "contact_stiffness_ratio" in MODELS[model]
    assert kinds >= ({"impact", "separation"} if soft else {"impact", "stick", "release"})


# --- another solver, closed forms, identities


def with_scipy(
    values: dict[str, Any], force: Callable[[float], float], share: float, pieces: Sequence[float]
) -> list[tuple[float, float, float]]:
    """Time, x and v of each impact; `pieces` are times between which the force is smooth."""
    mu, zeta, d, r = (
        values[name] for name in ("mass_ratio", "damping_ratio", "clearance", "restitution")
    )

    def rates(t: float, z: np.ndarray) -> list[float]:
        x, v, _, u = z
        f = force(min(max(t, piece[0] + 1e-13), piece[1] - 1e-13))  # at a jump, that of this side
        return [v, f - 2 * zeta * v - x, u, share * f]

    def wall(side: int) -> Callable[[float, np.ndarray], float]:
        def gap(t: float, z: np.ndarray) -> float:
            return d - side * (z[2] - z[0])

        gap.terminal, gap.direction = True, -1
        return gap

    found, z, t = [], np.array([0.2, 0.1, 0.0, 0.9]), 0.0
    for piece in pairwise(pieces):
        while t < piece[1]:
            part = solve_ivp(
                rates,
                (t, piece[1]),
                z,
                "DOP853",
                events=(wall(1), wall(-1)),
                rtol=1e-13,
                atol=1e-14,
            )
            t, z = part.t[-1], part.y[:, -1]
            if part.status == 1:
                change = (1 + r) / (1 + mu) * (z[3] - z[1])
                z[1] += mu * change
                z[3] -= change
                found.append((t, z[0], z[1]))
    return found


TWO = Harmonics((1, 2), (1.0, 0.5), (0.0, 0.3))
SAMPLES = Record([0.3, 2.0, 3.5, 4.0, 7.0], [1.0, 0.0, 2.0, -1.5, 1.0])


@pytest.mark.parametrize(
    ("forcing", "force", "share"),
    [
        (NoForce(), lambda t: 0.0, 0),
        (TWO, lambda t: math.sin(0.8 * t) + 0.5 * math.sin(1.6 * t + 0.3), 0),
        (Base("base"), lambda t: 0.64 * math.sin(0.8 * t), 1),
        (SAMPLES, lambda t: np.interp(t, SAMPLES.time, SAMPLES.value, left=0, right=0), 0),
    ],
    ids=["none", "two harmonics", "base", "record"],
)
@plain
def test_impacts_against_scipy(forcing: Any, force: Callable[[float], float], share: float) -> None:
    values = GENERIC | {"clearance": 0.5}
    exact = with_scipy(values, force, share, [0.0, *SAMPLES.time.tolist(), 9.0])
    found = events(Parameters(**values, forcing=forcing), State(0.2, 0.1, 0.0, 0.9), until=9.0)
    assert set(found["kind"]) == {0}
    assert len(found) >= 3
    numbers = np.array(found[["time", "x", "v"]].tolist())
    assert numbers == pytest.approx(np.array(exact), rel=0, abs=2e-10)


@pytest.mark.parametrize("damping", [0.0, 0.3, 1.0, 4.0])
@pytest.mark.parametrize("after", ["zero", "hold"])
@plain
def test_record_of_a_straight_line_gives_the_closed_form(damping: float, after: str) -> None:
    """x = f - 2 zeta f' and free motion; after its end the same with f' = 0."""
    times = np.cumsum([0.0, *np.random.default_rng(1).uniform(0.01, 0.5, 40)])
    line = Record(times, 0.7 - 0.2 * times, after=after)
    p = Parameters(1e-6, damping, 0.8, 50.0, 0.5, forcing=line)
    run, end = start_run(p, State(0.4, -0.3, 0.0, 0.0)), times[-1]
    matrix = np.array([[0.0, 1.0], [-1.0, -2.0 * damping]])
    steady = np.array([0.7 + 0.4 * damping, -0.2])
    start = np.array([0.4, -0.3]) - steady
    for t in (0.5 * end, end, end + 3.0):
        x, v = expm(matrix * min(t, end)) @ start + steady + [-0.2 * min(t, end), 0.0]
        if t > end:
            held = np.array([0.7 - 0.2 * end if after == "hold" else 0.0, 0.0])
            x, v = expm(matrix * (t - end)) @ ([x, v] - held) + held
        at = run.whole_periods(t)
        run.skip(*at)
        found = run.state_at(*at)
        assert (found.x, found.v) == pytest.approx((x, v), rel=0, abs=1e-13)


@pytest.mark.parametrize("model", MODELS)
@plain
def test_one_term_of_a_sum_is_the_harmonic(model: str) -> None:
    """Byte for byte; and to rounding where a term that is next to nothing follows it."""
    scene = QUIET | MODELS[model] | {"phase": 0.3}
    single = events(Parameters(**scene), until=60.0)
    one = Harmonics((1,), (1.0,))
    assert events(Parameters(**scene, forcing=one), until=60.0).tobytes() == single.tobytes()
    nearly = Harmonics((1, 2), (1.0, 1e-300))
    found = events(Parameters(**scene, forcing=nearly), until=60.0)
    assert len(found) == len(single) > 20
    for name in ("kind", "side", "time", "x", "v", "approach_speed"):
        assert found[name] == pytest.approx(single[name], rel=0, abs=1e-11)


@pytest.mark.parametrize("model", [name for name in MODELS if name != "grounded"])
@plain
def test_base_motion_is_the_same_in_both_frames(model: str) -> None:
    """x of the ground less z is x of the base; a support would be tied to different places."""
    amplitude, phase = 1.3, 0.4
    scene = QUIET | MODELS[model] | {"phase": phase, "force_amplitude": amplitude}
    omega = scene["frequency_ratio"]

    def base(t: Any) -> tuple[Any, Any]:
        angle = omega * t + phase
        return amplitude * np.sin(angle), amplitude * omega * np.cos(angle)

    z, z_rate = base(0.0)
    starts = State(0.3, 0.1, 0.2, 0.0), State(0.3 - z, 0.1 - z_rate, 0.2 - z, -z_rate)
    ground, own = (
        events(Parameters(**scene, forcing=Base(frame)), start, until=60.0)
        for frame, start in zip(("ground", "base"), starts, strict=True)
    )
    assert len(ground) == len(own) > 20
    z, z_rate = base(ground["time"])
    for name, shift in {
        "kind": 0,
        "side": 0,
        "time": 0,
        "approach_speed": 0,
        "x": z,
        "v": z_rate,
    }.items():
        assert own[name] == pytest.approx(ground[name] - shift, rel=0, abs=1e-10)


@pytest.mark.parametrize("model", ["rigid", "grounded"])
@pytest.mark.parametrize(("start", "end"), [(1.0, 1.0), (-1.0, -1.0), (0.0, 1.0), (0.0, -1.0)])
@pytest.mark.parametrize("of", ["force", "base_acceleration"])
@plain
def test_at_rest_on_a_wall_until_a_record_begins(
    model: str, start: float, end: float, of: str
) -> None:
    """It jumps or rises, and throws the free mass off or presses it."""
    forcing = Record([1.0, 3.0], [start, end], of=of)
    values = GENERIC | MODELS[model] | {"clearance": 0.5, "forcing": forcing}
    found, exact = rows_of_both(values, (0.0, 0.0, 0.5, 0.0), 6.0)
    assert largest_error(found, exact) < ERROR


# --- energy


@pytest.mark.parametrize(
    ("model", "force"), thinned(PAIRS, lambda pair: PAIRS.index(pair) % 4 == 0)
)
@plain
def test_energy_balance_closes(model: str, force: str) -> None:
    """To 1e-12 of what is turned over: what the force gives, dashpots and impacts take, is kept."""
    forcing = FORCES[force](random.Random(3))
    given = {"forcing": forcing, "initial_displacement": 1.0, "initial_velocity": 0.3}
    if force != "none":
        given["force_amplitude"] = 1.3
    if forcing.has_phase:
        given["phase"] = 0.4
    observers = {"response": {"modulation_work": True}}
    scene = QUIET | MODELS[model] | given | {"observers": observers}
    found = simulate(**scene, transient=0, periods=4)
    parts = ("energy_input", "dashpot_loss", "impact_loss")
    scale = max(abs(float(found[part])) for part in parts) + float(found.peak_displacement) ** 2
    assert found.status == 0
    assert found.impact_loss > 0.0
    assert abs(float(found.energy_residual)) < 1e-12 * scale


def energy_of(p: Parameters, x: float, v: float, gap: float, rate: float, side: float) -> float:
    """Of both masses, their springs, and a wall that is compressed."""
    y, u = x + side * (p.clearance - gap), v - side * rate
    energy = 0.5 * (x * x + v * v + p.mass_ratio * u * u + p.support_stiffness_ratio * y * y)
    if gap < 0.0:
        energy += 0.5 * p.contact_stiffness_ratio * gap * gap
    return energy


@pytest.mark.parametrize("model", [name for name in MODELS if name != "time_varying"])
@settings(deadline=None, max_examples=15)
@given(seed=st.integers(0, 10**6))
@plain
def test_energy_of_free_motion_only_falls(model: str, seed: int) -> None:
    values, state = random_scene(model, "none", seed)
    p = Parameters(**values)
    run = start_run(p, State(*state))
    last = math.inf
    for log in run.segments(*run.whole_periods(15.0)):
        for row in log:
            for part in np.linspace(0.0, 1.0, 9).tolist():
                now = energy_of(p, *run.motion_in(row, part * row[DURATION]), row[SIDE])
                assert now < last + 1e-14 * (1.0 + now)
                last = min(last, now)
