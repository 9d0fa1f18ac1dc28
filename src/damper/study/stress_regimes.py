"""Regimes of the stress study: parts of the parameter box, and why accuracy degrades there.

Regimes of the first six parameters are those of rigid walls and an untied free mass, so that what
another model adds is seen in its own rows.

Reasons are those of docs/method.md, section Limits, and what the study itself has shown.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr


@dataclass(frozen=True)
class Regime:
    """A part of the box: a name, a condition in words and as a predicate of lanes, a reason."""

    name: str
    condition: str
    holds: Callable[[xr.Dataset], xr.DataArray]
    reason: str


def model_is(name: str) -> Callable[[xr.Dataset], xr.DataArray]:
    """Return the predicate of lanes of one model of the damper."""
    return lambda cube: models(cube) == name


def models(cube: xr.Dataset) -> xr.DataArray:
    """Return each lane's model, as `damper.parameters.Parameters.model` says it."""
    grounded = (cube.support_stiffness_ratio > 0.0) | (_support_damping(cube) > 0.0)
    names = np.where(grounded, "grounded", "rigid")
    names = np.where(cube.modulation_depth > 0.0, "time_varying", names)
    names = np.where(np.isfinite(cube.contact_stiffness_ratio), "compliant", names)
    return xr.DataArray(names, dims="lane")


def _untied(holds: Callable[[xr.Dataset], xr.DataArray]) -> Callable[[xr.Dataset], xr.DataArray]:
    return lambda cube: holds(cube) & (models(cube) == "rigid")


_UNTIED = (
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
        "the push that ends sticking changes as the cube of the frequency, so rounding of x moves "
        "a release; undamped, a forcing period holds thousands of natural ones and their events",
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
        "old roundings do not die; they add up like a random walk",
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
        "damping ratio >= 1000",
        lambda cube: cube.damping_ratio >= 1e3,
        "displacements round in units of eps v tau although they hardly move, and each "
        "derivative multiplies rounding by the damping",
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
        "whether it touches depends on rounding, by the root of the depth",
    ),
    Regime(
        "long runs",
        "a million forcing periods",
        lambda cube: cube.origin == "long",
        "time is held as whole periods and a part, so nothing blurs; roundings of many events add",
    ),
)

REGIMES = (
    *(replace(regime, holds=_untied(regime.holds)) for regime in _UNTIED),
    Regime(
        "grounded",
        "a support of the free mass",
        model_is("grounded"),
        "the support has rates of its own, which the two regimes below make fast",
    ),
    Regime(
        "fast support",
        "undamped support with a rate >= 1e4",
        lambda cube: (
            (models(cube) == "grounded")
            & (_support_damping(cube) == 0.0)
            & (cube.support_stiffness_ratio >= 1e8 * cube.mass_ratio)
        ),
        "the swing's phase rounds in units of eps rate tau; swings that all but touch use up the "
        "budget by their evaluations",
    ),
    Regime(
        "heavily damped support",
        "support damping over mass ratio >= 1e4",
        lambda cube: (
            (models(cube) == "grounded") & (_support_damping(cube) >= 1e4 * cube.mass_ratio)
        ),
        "what is left of a decayed fast motion rounds in units of eps times its first rate and "
        "the time since: the thrust that a release waits for",
    ),
    Regime(
        "time-variant",
        "a free mass that varies",
        model_is("time_varying"),
        "both masses together move on Taylor polynomials",
    ),
    Regime(
        "compliant",
        "walls that give",
        model_is("compliant"),
        "a contact has its own, faster rates; restitution 0 without tension asks for an infinite "
        "damping and is refused; with damping ratio 1e6 the energy balance loses digits, and "
        "with slow forcing bounces of the size of rounding may use up the budget",
    ),
    Regime(
        "stiff contact",
        "contact stiffness ratio >= 1e8",
        lambda cube: (models(cube) == "compliant") & (cube.contact_stiffness_ratio >= 1e8),
        "depths are smaller than rounding of displacements, so forces are kept relative to the "
        "others at work",
    ),
)


def _between(values: xr.DataArray, low: float, high: float) -> xr.DataArray:
    return (values >= low) & (values <= high)


def _support_damping(cube: xr.Dataset) -> xr.DataArray:
    return cube.support_damping_ratio + cube.damping_ratio * cube.support_damping_factor
