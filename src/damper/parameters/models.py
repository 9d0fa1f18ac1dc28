"""The models of the damper: what is known of each without loading its code."""

from typing import NamedTuple


class Model(NamedTuple):
    """One model of `damper.models`."""

    example: dict[str, float]
    """What makes a rigid damper one of it."""
    impact_seconds: float
    """Time that an impact takes, with compiled code, on a core of the project's measurements."""


#: Name of each model, which is that of its folder in `damper.models`.
MODELS = {
    "rigid": Model({}, 4e-7),
    "grounded": Model({"support_stiffness_ratio": 0.01}, 6.5e-7),
    "compliant": Model({"contact_stiffness_ratio": 1e4}, 2.5e-6),
    "time_varying": Model({"modulation_depth": 0.1}, 5e-7),
    "sliding": Model({"friction": 0.01}, 1.5e-6),
    "several": Model({"unit_count": 3.0, "clearance_spread": 0.2}, 1.5e-6),
}
