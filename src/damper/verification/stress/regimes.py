"""Regimes of the stress study: parts of the parameter box where accuracy may degrade.

Regimes of the first six parameters are those of the rigid model, so that what another model adds
is seen in its own rows. Why accuracy ends in some of them stands in docs/limits.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from damper.parameters import Parameters
from damper.parameters.quantities import PARAMETER_NAMES

if TYPE_CHECKING:
    import pandas as pd


class Regime(NamedTuple):
    """A part of the box: a name, and a condition on a run's quantities."""

    name: str
    condition: str
    """As `pandas.DataFrame.eval` reads it; none for all runs of the model."""
    model: str = "rigid"

    def holds(self, runs: pd.DataFrame) -> pd.Series:
        """Whether each run, a row of `with_models`, is in the regime."""
        chosen: pd.Series = runs.model == self.model
        return chosen & runs.eval(self.condition) if self.condition else chosen


REGIMES = (
    Regime(
        "ordinary",
        "1e-3 <= damping_ratio <= 1 and 0.1 <= frequency_ratio <= 10"
        " and 1e-3 <= mass_ratio <= 10 and 1e-3 <= clearance <= 10",
    ),
    Regime("slow forcing", "frequency_ratio <= 1e-3"),
    Regime("fast forcing", "frequency_ratio >= 1e3"),
    Regime("undamped", "damping_ratio <= 1e-12"),
    Regime("undamped resonance", "damping_ratio <= 1e-12 and abs(frequency_ratio - 1) <= 1.1e-9"),
    Regime("critical damping", "abs(damping_ratio - 1) <= 1.1e-12"),
    Regime("heavy damping", "damping_ratio >= 10"),
    Regime("tiny mass", "mass_ratio <= 1e-6"),
    Regime("heavy free mass", "mass_ratio >= 1e3"),
    Regime("nearly elastic", "restitution >= 0.999"),
    Regime("plastic", "restitution <= 1e-6"),
    Regime("tiny clearance", "0 < clearance <= 1e-6"),
    Regime("large clearance", "clearance >= 1e3"),
    Regime(
        "grazing start", "corner and initial_displacement == -1 and initial_relative_velocity > 0"
    ),
    Regime("long runs", "long_run"),
    Regime("grounded", "", "grounded"),
    Regime(
        "fast support",
        "support_damping == 0 and support_stiffness_ratio >= 1e6 * mass_ratio",
        "grounded",
    ),
    Regime("heavily damped support", "support_damping >= 100 * mass_ratio", "grounded"),
    Regime("time-varying", "", "time_varying"),
    Regime("compliant", "", "compliant"),
    Regime("stiff contact", "contact_stiffness_ratio >= 1e8", "compliant"),
)


def with_models(runs: pd.DataFrame) -> pd.DataFrame:
    """Add to each run its model, as `damper.parameters.Parameters.model` says it, and more."""
    dampers = [Parameters(**values) for values in runs[list(PARAMETER_NAMES)].to_dict("records")]
    return runs.assign(
        model=[damper.model for damper in dampers],
        support_damping=[damper.support_damping for damper in dampers],
        corner=runs.origin.str.startswith("corner"),
        long_run=runs.origin.str.startswith("long"),
    )
