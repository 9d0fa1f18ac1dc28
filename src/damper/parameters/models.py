"""The models of the damper: facts about each that need no loading of its code."""

from collections.abc import Collection
from typing import Any, NamedTuple


class Model(NamedTuple):
    """One model of `damper.models`."""

    example: dict[str, Any]
    """Quantities that turn a rigid damper into this model."""
    impact_seconds: float
    """Time that an impact takes, with compiled code, on a core of the project's measurements."""
    has: str
    """The feature that only this model has."""


#: Name of each model, which is that of its folder in `damper.models`.
MODELS = {
    "rigid": Model({}, 4e-7, "rigid walls alone"),
    "grounded": Model({"support_stiffness_ratio": 0.01}, 6.5e-7, "a support of the free mass"),
    "compliant": Model({"contact_stiffness_ratio": 1e4}, 2.5e-6, "compliant contact"),
    "time_varying": Model({"modulation_depth": 0.1}, 5e-7, "a free mass that varies"),
    "sliding": Model({"friction": 0.01}, 1.5e-6, "dry friction"),
    "prescribed": Model(
        {"mass_ratio": 0.0, "damping_ratio": 0.0, "carrier": 1.0}, 5e-7, "a prescribed box"
    ),
    "several": Model(
        {"masses": {"count": 3, "clearance_spread": 0.2}}, 1.5e-6, "several free masses"
    ),
}
#: Those with a primary.
ON_PRIMARY = tuple(name for name in MODELS if name != "prescribed")
#: Those of one free mass.
ONE_MASS = tuple(name for name in MODELS if name != "several")
#: Those of one free mass, and a structure, whose free masses are observed one by one.
ONE_BY_ONE = (*ONE_MASS, "structure")


#: Models with one constant free mass between rigid walls: `damper.models.masses` has them all.
_ONE_ROOM = ("rigid", "grounded", "sliding", "prescribed")


def room_of(model: str) -> str:
    """Folder of `damper.models` that has the code of a model."""
    return "masses" if model in _ONE_ROOM else model


def models_of(damper: Any) -> tuple[str, ...]:
    """Names of all models that a damper is one of: support, friction and several masses combine.

    The damper is given by dimensionless parameters, or is a model of the engine.
    """
    room = type(damper).__module__.removeprefix("damper.models.").partition(".")[0]
    return getattr(damper, "features", (room,))


def own_feature(model: str) -> str:
    """Return what only this model has, in words, and the model's name."""
    has = MODELS[model].has if model in MODELS else "boxes on a structure"
    return f"{has} (model {model})"


def unknown_model(what: str, model: str, known: Collection[str]) -> str:
    """Message: `what`, such as an observer, does not know this model."""
    return f"{what} does not know {own_feature(model)}, only {', '.join(known)}"


def require_model(damper: Any, known: Collection[str], what: str) -> None:
    """Raise ValueError where `what` does not know the model of a damper, as for `models_of`."""
    for model in models_of(damper):
        if model not in known:
            raise ValueError(unknown_model(what, model, known))
