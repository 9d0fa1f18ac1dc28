"""Dampers that many tests share, dimensionless but for `SI`; random ones of all kinds."""

import random
from collections.abc import Callable
from typing import Any

import numpy as np

from damper import Structure
from damper.parameters.dampers import BASIC
from damper.parameters.forcing import Base, Harmonic, Harmonics, NoForce, Noise, Record, Unbalance

#: Two impacts a period and more, nothing sticks.
GENERIC = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.8,
    "clearance": 1.0,
    "restitution": 0.6,
}
#: Model section 7: complete chatter, many impacts each.
SLOW = GENERIC | {"frequency_ratio": 0.2, "clearance": 0.25}
#: The same with few: two complete sequences in each forcing period.
QUIET = SLOW | {"restitution": 0.3}
#: The restitution study.
STUDY = GENERIC | {"damping_ratio": 0.02, "frequency_ratio": 1.3, "clearance": 0.05}
#: Model section 8, A3: complete chatter of some sixty impacts in every half period.
PAPER_A = {
    "mass_ratio": 0.2,
    "damping_ratio": 0.01,
    "frequency_ratio": 0.2,
    "clearance": 0.03,
    "restitution": 0.8,
}
#: In SI units: F0/K = 0.05 m, sqrt(M/K) = 0.1 s, F0/sqrt(K M) = 0.5 m/s, F0^2/K = 0.5 J; damping
#: ratio and mass ratio 0.1, frequency ratio 1.1, clearance 1.
SI = {
    "primary_mass": 2.0,
    "damping": 4.0,
    "stiffness": 200.0,
    "force_amplitude": 10.0,
    "forcing_frequency": 11.0,
    "free_mass": 0.2,
    "gap": 0.1,
    "restitution": 0.5,
}

#: What the tests of observers run.
SCENES = {
    name: dict(zip(BASIC, values, strict=True))
    for name, values in {
        "generic": (0.1, 0.05, 0.8, 1.0, 0.6, 0.0),
        "chattering": (0.1, 0.05, 0.2, 0.25, 0.3, 0.0),
        "slow": (0.1, 0.05, 0.2, 0.25, 0.6, 0.4),
        "study": (0.1, 0.02, 1.3, 0.05, 0.6, 0.4),
        "incomplete": (0.1, 0.02, 1.3, 0.05, 0.9, 0.4),
        "elastic": (0.3, 0.05, 0.9, 0.4, 1.0, 0.4),
        "plastic": (0.2, 0.1, 0.4, 0.3, 0.0, 0.4),
        "overdamped": (0.5, 1.5, 0.6, 0.05, 0.5, 0.4),
        "very overdamped": (0.5, 10.0, 0.6, 5e-3, 0.5, 0.4),
        "undamped": (2.0, 0.0, 0.7, 0.6, 0.7, 0.4),
        "stuck": (0.5, 0.1, 0.6, 0.0, 0.5, 0.4),
        "free": (0.1, 0.1, 0.6, 40.0, 0.5, 0.4),
        "fast": (0.1, 0.1, 1e3, 1e-6, 0.5, 0.4),
    }.items()
}

# --- random ones

#: Model or law -> what makes it; of one free mass.
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
#: Several free masses, with what else is drawn.
SEVERAL = ("several", "several, sliding", "several, grounded", "several, grounded, sliding")


def harmonics(draw: random.Random, *orders: int) -> Harmonics:
    amplitudes = [draw.uniform(-1, 1) for _ in orders]
    return Harmonics(orders, amplitudes, [draw.uniform(-3, 3) for _ in orders])


def record(draw: random.Random, **more: str) -> Record:
    """Samples at uneven times, after a while without a force; its value jumps at both ends."""
    steps = [draw.uniform(0, 2), *(10 ** draw.uniform(-1, 0.3) for _ in range(draw.randint(1, 40)))]
    return Record(np.cumsum(steps), [draw.gauss(0, 1) for _ in steps], **more)


#: Name -> a random one.
FORCES: dict[str, Callable[[random.Random], Any]] = {
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
#: What a scene may have beside its model and its force.
FEATURES = ("gravity", "unlike walls")
#: Each model, or law, with each force, without a feature, with one of them and with both; each
#: model of several masses with each force.
CASES = [
    (m, f, more)
    for m in MODELS
    for f in FORCES
    for more in ("", *FEATURES, "gravity and unlike walls")
]
CASES += [(m, f, "") for m in SEVERAL for f in FORCES]

Scene = tuple[dict[str, Any], tuple[Any, ...]]


def scene_of(model: str, force: str, seed: int, features: str = "") -> Scene:
    """Parameters and a start of a random damper; most chatter, and stick.

    Gravity is from a tenth of the force to ten times as much. Several masses have values of their
    own, and some have gravity and unlike walls in any case.
    """
    draw = random.Random(f"{model}, {force}, {seed}")
    several = model in SEVERAL
    values = _driven(draw, force, (-2, 0) if several else (-3, 0.3))
    values |= MODELS.get(model, {})
    _model(draw, model, values)
    clearances = [values["clearance"]]
    if several:
        values["masses"] = _masses(draw, model, values)
        clearances = [own.get("clearance", values["clearance"]) for own in values["masses"]]
    if "gravity" in features:
        values["gravity"] = draw.choice([-1, 1]) * 10 ** draw.uniform(-1, 1)
    if "walls" in features:
        values["restitution_left"] = draw.uniform(0.05, 0.6)
    x = draw.uniform(-2, 2)
    y = [x + clearance * draw.uniform(-1, 1) for clearance in clearances]
    v, u = draw.uniform(-1, 1), [draw.uniform(-1, 1) for _ in clearances]
    return values, (x, v, y, u) if several else (x, v, y[0], u[0])


def _driven(draw: random.Random, force: str, decades: tuple[float, float]) -> dict[str, Any]:
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


def _model(draw: random.Random, model: str, values: dict[str, Any]) -> None:
    """Draw what makes the model."""
    mu = values["mass_ratio"]
    if values.get("contact_stiffness_ratio"):
        values["restitution"] = draw.uniform(0.05, 0.7)
        # What bounces on it has this rate.
        rate = 10 ** draw.uniform(0.7, 1.7)
        values["contact_stiffness_ratio"] = rate**2 * mu / (1 + mu)
    if model == "time_varying":
        values["modulation_depth"] = draw.uniform(0.05, 0.95)
        values["modulation_order"] = draw.randint(1, 4)
        values["modulation_phase"] = draw.uniform(-3, 3)
    if "sliding" in model:
        values["friction"] = 10 ** draw.uniform(-2.5, 0)
    if "grounded" in model:
        values["support_stiffness_ratio"] = draw.choice([0.0, mu * 10 ** draw.uniform(-2, 1)])
        values["support_damping_ratio"] = mu * 10 ** draw.uniform(
            -2, 0.5 if "several" in model else 1.3
        )
    if "several" in model and draw.random() < 0.3:
        values["gravity"] = draw.choice([-1, 1]) * 10 ** draw.uniform(-1, 0.5)
    if model == "several, grounded" and draw.random() < 0.3:
        values["yield_speed"] = 10 ** draw.uniform(-2.5, 0)


def _masses(draw: random.Random, model: str, values: dict[str, Any]) -> list[dict[str, float]]:
    """Own values of two or three masses."""
    own: dict[str, tuple[float, Callable[[], float]]] = {
        "mass_ratio": (0.7, lambda: 10 ** draw.uniform(-2, 0)),
        "clearance": (0.7, lambda: values["clearance"] * draw.uniform(0.5, 2)),
        "restitution": (0.5, lambda: draw.uniform(0, 0.5)),
        "restitution_left": (0.2, lambda: draw.uniform(0, 0.5)),
        "gravity": (0.2, lambda: draw.uniform(-1, 1)),
    }
    if "sliding" in model:
        own["friction"] = 0.5, lambda: draw.choice([0.0, 10 ** draw.uniform(-2.5, 0)])
    if "grounded" in model:
        own["support_stiffness_ratio"] = 0.5, lambda: draw.choice([0.0, 10 ** draw.uniform(-3, 0)])
        own["support_damping_ratio"] = 0.3, lambda: draw.choice([0.0, 10 ** draw.uniform(-3, -1)])
    if "yield_speed" in values:
        own["yield_speed"] = 0.5, lambda: 10 ** draw.uniform(-2.5, 0)
    count = draw.choice([1, 1, 2])
    return [{}] + [
        {name: value() for name, (share, value) in own.items() if draw.random() < share}
        for _ in range(count)
    ]


def coupled_structure(seed: int) -> Structure:
    """A structure whose damping couples its modes, and whose mass matrix is full."""
    rng = np.random.default_rng(seed)
    a, b, c = rng.normal(size=(3, 3)), rng.normal(size=(3, 3)), rng.normal(size=(3, 2))
    return Structure(
        mass=a @ a.T + 2.0 * np.eye(3),
        damping=0.05 * c @ c.T,
        stiffness=b @ b.T + np.eye(3),
        boxes={"a": [1, 0, 0], "b": [0, 0, 1]},
        force=[0, 1, 0],
    )
