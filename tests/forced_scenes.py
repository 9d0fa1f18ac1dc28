"""Random dampers under each kind of force, and their events beside those in many digits."""

import random
from collections.abc import Iterable
from typing import Any

import numpy as np
from event_pairs import BOUNCE, KINDS, changes, paired

from damper import Parameters, State, events
from damper.parameters.forcing import (
    Base,
    Harmonic,
    Harmonics,
    NoForce,
    Noise,
    Record,
    Unbalance,
)
from damper.verification.reference import exact_run

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
    "sliding": {"friction": 0.02},
    "grounded, sliding": {
        "support_stiffness_ratio": 0.01,
        "support_damping_ratio": 0.002,
        "friction": 0.005,
    },
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
#: Each model, or law, with each force.
PAIRS = [(m, f) for m in MODELS for f in FORCES]


def driven(draw: random.Random, force: str, decades: tuple[float, float]) -> dict[str, Any]:
    """Parameters of a damper under a force, with a mass ratio of these decades."""
    values: dict[str, Any] = {
        "mass_ratio": 10 ** draw.uniform(*decades),
        "damping_ratio": draw.choice([0.0, 0.02, draw.uniform(0, 0.3), 1.5]),
        "frequency_ratio": 10 ** draw.uniform(-0.9, 0.3),
        "clearance": 10 ** draw.uniform(-1.5, 0),
        "restitution": draw.choice([0.0, draw.uniform(0.05, 0.6), draw.uniform(0.05, 0.3)]),
        "phase": draw.uniform(-3, 3),
        "force_amplitude": 10 ** draw.uniform(-0.5, 0.5),
        "forcing": FORCES[force](draw),
    }
    if not values["forcing"].has_phase:
        del values["phase"]
    if force == "none":
        del values["force_amplitude"]
    return values


def random_scene(model: str, force: str, seed: int) -> tuple[dict[str, Any], tuple[float, ...]]:
    """Parameters and a start; most chatter, and stick."""
    draw = random.Random(f"{model}, {force}, {seed}")
    values = driven(draw, force, (-3, 0.3)) | MODELS[model]
    if values.get("contact_stiffness_ratio"):
        values["restitution"] = draw.uniform(0.05, 0.7)
        # What bounces on it has this rate.
        rate, mu = 10 ** draw.uniform(0.7, 1.7), values["mass_ratio"]
        values["contact_stiffness_ratio"] = rate**2 * mu / (1 + mu)
    if model == "time_varying":
        values["modulation_depth"] = draw.uniform(0.05, 0.95)
        values["modulation_order"] = draw.randint(1, 4)
        values["modulation_phase"] = draw.uniform(-3, 3)
    if "sliding" in model:
        values["friction"] = 10 ** draw.uniform(-2.5, 0)
    if "grounded" in model:
        mu = values["mass_ratio"]
        values["support_stiffness_ratio"] = draw.choice([0.0, mu * 10 ** draw.uniform(-2, 1)])
        values["support_damping_ratio"] = mu * 10 ** draw.uniform(-2, 1.3)
    x = draw.uniform(-2, 2)
    y = x + values["clearance"] * draw.uniform(-1, 1)
    return values, (x, draw.uniform(-1, 1), y, draw.uniform(-1, 1))


#: What a scene may have beside its model and its force.
FEATURES = ("gravity", "unlike walls")
#: Each model, or law, with each force, without a feature, with one of them and with both.
CASES = [(m, f, features) for m, f in PAIRS for features in ("", *FEATURES, " and ".join(FEATURES))]


def featured_scene(
    model: str, force: str, features: str, seed: int
) -> tuple[dict[str, Any], tuple[float, ...]]:
    """A random scene; gravity is from a tenth of the force to ten times as much."""
    values, state = random_scene(model, force, seed)
    draw = random.Random(f"{features}, {model}, {force}, {seed}")
    if "gravity" in features:
        values["gravity"] = draw.choice([-1, 1]) * 10 ** draw.uniform(-1, 1)
    if "walls" in features:
        values["restitution_left"] = draw.uniform(0.05, 0.6)
    return values, state


def length_of(values: dict[str, Any], state: tuple[Any, ...], count: int = 20) -> float:
    """Until when there are some so many events, twenty unless told."""
    table = events(Parameters(**values), State(*state), until=25.0, max_events=count)
    return 25.0 if len(table) < count else float(table["time"][-2]) + 1e-3


#: Kind, side, and numbers.
Rows = list[tuple[str, int, tuple[Any, ...]]]


def rows_of_both(
    values: dict[str, Any], state: tuple[float, ...], until: float, digits: int = 16
) -> tuple[Rows, Rows]:
    """Events of the engine, and in many digits; those that a closed tail stands for in none."""
    exact = exact_run(values, state, until=until, digits=digits).events
    p, start = Parameters(**values), State(*state)
    if p.model == "compliant":
        found = [(kind, side, tuple(row)) for kind, side, *row in changes(p, until, start)]
    else:
        table = events(p, start, until=until)
        names = {code: kind for kind, code in KINDS.items()}
        numbers = table[["time", "x", "v", "approach_speed"]].tolist()
        kinds = [names[kind] for kind in table["kind"]]
        found = list(zip(kinds, table["side"].tolist(), numbers, strict=True))
        rest = [event.kind for event in exact if event.kind not in BOUNCE]
        assert [kind for kind in kinds if kind not in BOUNCE] == rest
        exact = [event for _, event in paired(table, exact)]
    return found, [(e.kind, e.side, (e.time, e.x, e.v, e.approach_speed)) for e in exact]


def largest_error(found: Rows, exact: Rows) -> float:
    """Of any number of any event."""
    assert [row[:2] for row in found] == [row[:2] for row in exact]
    errors = [0.0]
    for (*_, numbers), (*_, right) in zip(found, exact, strict=True):
        errors += [float(abs(a - b)) for a, b in zip(numbers, right, strict=True)]
    return max(errors)


def assert_first_ones_agree(*scenes: tuple[dict[str, Any], tuple[float, ...]]) -> None:
    """The first events of scenes are those in many digits, within `ERROR`.

    Of one scene after another until there are two: weight may hold a soft damper on its wall.
    """
    count = 0
    for values, state in scenes:
        found, exact = rows_of_both(values, state, 0.5 * length_of(values, state))
        assert largest_error(found, exact) < ERROR
        count += len(found)
        if count >= 2:
            return
    assert count >= 2


def judged(scenes: Iterable[tuple[dict[str, Any], tuple[float, ...]]]) -> set[str]:
    """Kinds of events in random scenes, once all of them are those of many digits.

    Rounding may only grow as motions part anyway.
    """
    kinds: set[str] = set()
    for values, state in scenes:
        until = length_of(values, state)
        found, exact = rows_of_both(values, state, until)
        kinds |= {kind for kind, *_ in found}
        error = largest_error(found, exact)
        assert error < ERROR or error < 1e-14 * growth(values, state, until), (values, state)
    return kinds


def growth(values: dict[str, Any], state: tuple[float, ...], until: float) -> float:
    """How far events move with the start, over that, as long as the same ones happen."""
    x, v, y, u = state
    starts = [(x, v, y, u), (x, v + 1e-13, y, u)]
    runs = [exact_run(values, start, until=until, digits=16).events for start in starts]
    errors = [0.0]
    for one, other in zip(*runs, strict=False):
        if one[1:3] != other[1:3]:
            break
        pairs = zip((one.time, one.x, one.v), (other.time, other.x, other.v), strict=True)
        errors += [float(abs(a - b)) for a, b in pairs]
    return max(errors) / 1e-13
