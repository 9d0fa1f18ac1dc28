"""Regimes of the stress study: parts of the parameter box, and why accuracy degrades there.

Regimes of the first six parameters are those of the rigid model, so that what another model adds
is seen in its own rows.

Reasons are those of docs/method.md, section Limits, and what the study itself has shown.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import pandas as pd


class Regime(NamedTuple):
    """A part of the box: a name, a condition on a run's quantities, and a reason."""

    name: str
    condition: str
    """As `pandas.DataFrame.eval` reads it; none for all runs of the model."""
    reason: str
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
        "what the engine is made for",
    ),
    Regime(
        "slow forcing",
        "frequency_ratio <= 1e-3",
        "before a release the contact force changes as the cube of the frequency, so roundoff of x "
        "moves it; undamped, a forcing period holds a thousand natural ones and their events",
    ),
    Regime(
        "fast forcing",
        "frequency_ratio >= 1e3",
        "accuracy is in units of the forcing period; phases keep their digits",
    ),
    Regime(
        "undamped",
        "damping_ratio <= 1e-12",
        "old roundoff does not die; it adds up like a random walk",
    ),
    Regime(
        "undamped resonance",
        "damping_ratio <= 1e-12 and abs(frequency_ratio - 1) <= 1.1e-9",
        "amplitudes grow with time; divided differences keep their digits",
    ),
    Regime(
        "critical damping",
        "abs(damping_ratio - 1) <= 1.1e-12",
        "both roots nearly agree; a form of its own keeps the digits",
    ),
    Regime(
        "heavy damping",
        "damping_ratio >= 10",
        "each derivative multiplies roundoff by the damping",
    ),
    Regime("tiny mass", "mass_ratio <= 1e-6", "the free mass hardly moves the primary"),
    Regime(
        "heavy free mass",
        "mass_ratio >= 1e3",
        "the primary is thrown about: its speed after an impact is the difference of larger ones",
    ),
    Regime(
        "nearly elastic",
        "restitution >= 0.999",
        "energy stays in the free mass: impacts are many, a burst may outlast any budget, and each "
        "flight rounds velocities, the same way while the motion repeats itself",
    ),
    Regime(
        "plastic",
        "restitution <= 1e-6",
        "bursts are over at once; the sign of the next derivative that is not zero decides",
    ),
    Regime(
        "tiny clearance",
        "0 < clearance <= 1e-6",
        "impacts come as often as the walls are near: the event budget ends what does not stick",
    ),
    Regime(
        "large clearance",
        "clearance >= 1e3",
        "few impacts; the gap rounds in units of the clearance",
    ),
    Regime(
        "grazing start",
        "corner and initial_displacement == -1 and initial_relative_velocity > 0",
        "whether it touches depends on roundoff, by the root of the depth",
    ),
    Regime(
        "long runs",
        "long_run",
        "time is held as whole periods and a part; roundoff of many events adds up",
    ),
    Regime(
        "grounded",
        "",
        "the support has rates of its own, which the two regimes below make fast",
        "grounded",
    ),
    Regime(
        "fast support",
        "support_damping == 0 and support_stiffness_ratio >= 1e6 * mass_ratio",
        "the swing's phase rounds in units of eps rate tau; swings that all but touch take many "
        "evaluations",
        "grounded",
    ),
    Regime(
        "heavily damped support",
        "support_damping >= 100 * mass_ratio",
        "what is left of a decayed fast motion, such as the contact force before a release, rounds "
        "in units of eps times its first rate and the time since",
        "grounded",
    ),
    Regime("time-varying", "", "both masses together move on Taylor polynomials", "time_varying"),
    Regime("compliant", "", "a contact has its own, faster rates", "compliant"),
    Regime(
        "stiff contact",
        "contact_stiffness_ratio >= 1e8",
        "depths are smaller than roundoff of displacements, so forces are kept relative to the "
        "others at work",
        "compliant",
    ),
)


def with_models(runs: pd.DataFrame) -> pd.DataFrame:
    """Add to each run its model, as `damper.parameters.Parameters.model` says it, and more.

    Parameters
    ----------
    runs : pandas.DataFrame
        The variables of `damper.verification.stress.cube.gather_checks`.
    """
    import numpy as np

    damping = runs.support_damping_ratio + runs.damping_ratio * runs.support_damping_factor
    models = {
        "compliant": np.isfinite(runs.contact_stiffness_ratio),
        "time_varying": runs.modulation_depth > 0.0,
        "grounded": (runs.support_stiffness_ratio > 0.0) | (damping > 0.0),
    }
    return runs.assign(
        model=np.select(list(models.values()), list(models), "rigid"),
        support_damping=damping,
        corner=runs.origin.str.startswith("corner"),
        long_run=runs.origin.str.startswith("long"),
    )
