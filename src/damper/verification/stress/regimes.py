"""Regimes of the stress study: parts of the parameter box, and why accuracy degrades there.

Regimes of the first six parameters are those of the rigid model, so that what another model adds
is seen in its own rows.

Reasons are those of docs/method.md, section Limits, and what the study itself has shown.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Regime:
    """A part of the box: a name, a condition in words and as a predicate of runs, a reason."""

    name: str
    condition: str
    holds: Callable[[xr.Dataset], xr.DataArray]
    reason: str


def model_is(name: str) -> Callable[[xr.Dataset], xr.DataArray]:
    """Return the predicate of runs of one model of the damper."""
    return lambda cube: models(cube) == name


def models(cube: xr.Dataset) -> xr.DataArray:
    """Return each run's model, as `damper.parameters.Parameters.model` says it."""
    import xarray as xr

    grounded = (cube.support_stiffness_ratio > 0.0) | (_support_damping(cube) > 0.0)
    names = np.where(grounded, "grounded", "rigid")
    names = np.where(cube.modulation_depth > 0.0, "time_varying", names)
    names = np.where(np.isfinite(cube.contact_stiffness_ratio), "compliant", names)
    return xr.DataArray(names, dims="run")


def _in_rigid(holds: Callable[[xr.Dataset], xr.DataArray]) -> Callable[[xr.Dataset], xr.DataArray]:
    return lambda cube: holds(cube) & (models(cube) == "rigid")


_RIGID = (
    Regime(
        "ordinary",
        "damping 0.001 to 1, frequency 0.1 to 10, mass 0.001 to 10, clearance 0.001 to 10",
        lambda cube: (
            _between(cube.damping_ratio, 1e-3, 1.0)
            & _between(cube.frequency_ratio, 0.1, 10.0)
            & _between(cube.mass_ratio, 1e-3, 10.0)
            & _between(cube.clearance, 1e-3, 10.0)
        ),
        "what the engine is made for",
    ),
    Regime(
        "slow forcing",
        "frequency ratio <= 0.001",
        lambda cube: cube.frequency_ratio <= 1e-3,
        "before a release the contact force changes as the cube of the frequency, so roundoff of x "
        "moves it; undamped, a forcing period holds a thousand natural ones and their events",
    ),
    Regime(
        "fast forcing",
        "frequency ratio >= 1000",
        lambda cube: cube.frequency_ratio >= 1e3,
        "accuracy is in units of the forcing period; phases keep their digits",
    ),
    Regime(
        "undamped",
        "damping ratio <= 1e-12",
        lambda cube: cube.damping_ratio <= 1e-12,
        "old roundoff does not die; it adds up like a random walk",
    ),
    Regime(
        "undamped resonance",
        "damping ratio <= 1e-12, frequency ratio 1 to 1e-9",
        lambda cube: (cube.damping_ratio <= 1e-12) & (abs(cube.frequency_ratio - 1.0) <= 1.1e-9),
        "amplitudes grow with time; divided differences keep their digits",
    ),
    Regime(
        "critical damping",
        "damping ratio 1 to 1e-12",
        lambda cube: abs(cube.damping_ratio - 1.0) <= 1.1e-12,
        "both roots nearly agree; a form of its own keeps the digits",
    ),
    Regime(
        "heavy damping",
        "damping ratio >= 10",
        lambda cube: cube.damping_ratio >= 10.0,
        "each derivative multiplies roundoff by the damping",
    ),
    Regime(
        "tiny mass",
        "mass ratio <= 1e-6",
        lambda cube: cube.mass_ratio <= 1e-6,
        "the free mass hardly moves the primary",
    ),
    Regime(
        "heavy free mass",
        "mass ratio >= 1000",
        lambda cube: cube.mass_ratio >= 1e3,
        "the primary is thrown about: its speed after an impact is the difference of larger ones",
    ),
    Regime(
        "nearly elastic",
        "restitution >= 0.999",
        lambda cube: cube.restitution >= 0.999,
        "energy stays in the free mass: impacts are many, a burst may outlast any budget, and each "
        "flight rounds velocities, the same way while the motion repeats itself",
    ),
    Regime(
        "plastic",
        "restitution <= 1e-6",
        lambda cube: cube.restitution <= 1e-6,
        "bursts are over at once; the sign of the next derivative that is not zero decides",
    ),
    Regime(
        "tiny clearance",
        "clearance <= 1e-6, not zero",
        lambda cube: (cube.clearance > 0.0) & (cube.clearance <= 1e-6),
        "impacts come as often as the walls are near: the event budget ends what does not stick",
    ),
    Regime(
        "large clearance",
        "clearance >= 1000",
        lambda cube: cube.clearance >= 1e3,
        "few impacts; the gap rounds in units of the clearance",
    ),
    Regime(
        "grazing start",
        "near a wall that draws away, as fast as to just reach it",
        lambda cube: (
            (cube.origin == "corner")
            & (cube.initial_displacement == -1.0)
            & (cube.initial_relative_velocity > 0.0)
        ),
        "whether it touches depends on roundoff, by the root of the depth",
    ),
    Regime(
        "long runs",
        "a million forcing periods",
        lambda cube: cube.origin == "long",
        "time is held as whole periods and a part; roundoff of many events adds up",
    ),
)

REGIMES = (
    *(replace(regime, holds=_in_rigid(regime.holds)) for regime in _RIGID),
    Regime(
        "grounded",
        "a grounded free mass",
        model_is("grounded"),
        "the support has rates of its own, which the two regimes below make fast",
    ),
    Regime(
        "fast support",
        "undamped support with a rate >= 1000",
        lambda cube: (
            (models(cube) == "grounded")
            & (_support_damping(cube) == 0.0)
            & (cube.support_stiffness_ratio >= 1e6 * cube.mass_ratio)
        ),
        "the swing's phase rounds in units of eps rate tau; swings that all but touch take many "
        "evaluations",
    ),
    Regime(
        "heavily damped support",
        "support damping over mass ratio >= 100",
        lambda cube: (
            (models(cube) == "grounded") & (_support_damping(cube) >= 100.0 * cube.mass_ratio)
        ),
        "what is left of a decayed fast motion, such as the contact force before a release, rounds "
        "in units of eps times its first rate and the time since",
    ),
    Regime(
        "time-varying",
        "a time-varying free mass",
        model_is("time_varying"),
        "both masses together move on Taylor polynomials",
    ),
    Regime(
        "compliant",
        "compliant contact",
        model_is("compliant"),
        "a contact has its own, faster rates",
    ),
    Regime(
        "stiff contact",
        "contact stiffness ratio >= 1e8",
        lambda cube: (models(cube) == "compliant") & (cube.contact_stiffness_ratio >= 1e8),
        "depths are smaller than roundoff of displacements, so forces are kept relative to the "
        "others at work",
    ),
)


def _between(values: xr.DataArray, low: float, high: float) -> xr.DataArray:
    return (values >= low) & (values <= high)


def _support_damping(cube: xr.Dataset) -> xr.DataArray:
    return cube.support_damping_ratio + cube.damping_ratio * cube.support_damping_factor
