"""Free decay: equivalent damping ratio of a light free mass with two impacts per cycle.

On the slow invariant manifold (`damper.theory.slow_manifold`) each impact has the approach speed
4 theta d / (pi (1 + r)) and takes mu (1 - r^2)/2 times its square; two of them per cycle let the
amplitude A = xi d of the primary fall at the rate zeta_eq A,

    zeta_eq = zeta + (4 mu rho / pi^2) (theta / xi)^2
    theta = (1 + sqrt(1 - (1 + rho^2)(1 - xi^2))) / (1 + rho^2)

It is largest at xi = rho, where theta = 1, and ends just below, at the fold. A force at resonance
is held in balance there by the least amplitude that a damper allows. The error is of the order of
the mass ratio. Derivation: docs/theory.md.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from damper.parameters import Parameters
from damper.theory import require_basic
from damper.theory.slow_manifold import SYMMETRIC_LIMIT, amplitude, branches, fold, slope

_ROUNDING = 1e-12


class Damping(NamedTuple):
    """An amplitude of the primary, in units of length, and the equivalent damping ratio there."""

    amplitude: float
    damping_ratio: float


def equivalent_damping(parameters: Parameters, amplitudes: ArrayLike) -> np.ndarray:
    """Equivalent damping ratio at amplitudes of the primary, in their shape.

    Parameters
    ----------
    parameters : Parameters
        In free motion.
    amplitudes : array_like
        In units of length, > 0.

    Returns
    -------
    ndarray
        The dashpot's share included; NaN below the fold, where there is no such motion. Above
        `amplitude_range` that motion is not stable.

    Raises
    ------
    ValueError
        For an amplitude out of range, and for all but a rigid damper with a constant restitution,
        a clearance, an oscillating primary, and nothing that drives, holds or pulls.

    Examples
    --------
    >>> p = Parameters(1e-3, 0.0, 1.0, clearance=1.0, restitution=0.5, force_amplitude=0.0)
    >>> round(float(equivalent_damping(p, largest_damping(p).amplitude)), 12)
    0.001909859317
    """
    _require_free(parameters)
    p = parameters
    xi = np.asarray(amplitudes, dtype=float) / p.clearance
    if not (xi > 0.0).all():
        raise ValueError(f"amplitudes = {amplitudes!r}: must be numbers > 0")
    theta, _ = branches(xi, p.restitution)
    return p.damping_ratio + _strength(p) * (theta / xi) ** 2


def largest_damping(parameters: Parameters) -> Damping:
    """The largest equivalent damping ratio, zeta + (2 mu/pi)(1 + r)/(1 - r), and its amplitude.

    That amplitude A is where the whole gap is pi A (1 + r)/(1 - r). With r = 1 nothing is lost at
    any amplitude: ValueError, as `equivalent_damping`.
    """
    _require_free(parameters)
    p = parameters
    rho = slope(p.restitution)
    if rho == 0.0:
        raise ValueError("restitution = 1.0: impacts lose nothing, so no amplitude damps most")
    return Damping(rho * p.clearance, p.damping_ratio + _strength(p) / rho**2)


class Resonance(NamedTuple):
    """What a damper can do at resonance: the least amplitude, and the clearance for it."""

    amplitude: float
    clearance: float


def least_at_resonance(parameters: Parameters) -> Resonance:
    """Least amplitude under the force sin(t), over all clearances, and that clearance.

    A = 1 / (2 zeta_eq) with the largest damping ratio, at d = A / rho; in units of length.

    Raises
    ------
    ValueError
        For all but a rigid damper with a constant restitution below 1 under a harmonic force with
        frequency_ratio = 1.

    Examples
    --------
    >>> found = least_at_resonance(Parameters(0.01, 0.02, 1.0, clearance=1.0, restitution=0.5))
    >>> round(found.amplitude, 4), round(found.clearance, 4)
    (12.7882, 60.2629)
    """
    p = parameters
    require_basic(p, "force_amplitude")
    if p.frequency_ratio != 1.0:
        raise ValueError(
            f"frequency_ratio = {p.frequency_ratio!r}: the closed form is for resonance, 1"
        )
    rho = slope(p.restitution)
    if rho == 0.0:
        raise ValueError("restitution = 1.0: impacts lose nothing, so no clearance is best")
    amplitude = 0.5 * p.force_amplitude / (p.damping_ratio + _strength(p) / rho**2)
    return Resonance(amplitude, amplitude / rho)


def largest_at_resonance(parameters: Parameters) -> float:
    """Largest amplitude that is in balance under the force sin(t), at a clearance up to the best.

    Beside the least one there may be a large one, with little damping and a restitution above 0.3.
    In units of length. Errors are those of `least_at_resonance`, and ValueError for
    a clearance of 0 or above the best one.

    Examples
    --------
    >>> best = least_at_resonance(Parameters(0.1, 0.02, 1.0, 1.0, restitution=0.6)).clearance
    >>> p = Parameters(0.1, 0.02, 1.0, 0.999 * best, restitution=0.6)
    >>> round(largest_at_resonance(p), 1)
    11.0
    """
    p, best = parameters, least_at_resonance(parameters).clearance
    if not 0.0 < p.clearance <= best * (1.0 + _ROUNDING):
        raise ValueError(f"clearance = {p.clearance!r}: must be > 0 and <= {best!r}, the best one")
    # The balance of energy, squared, is a polynomial of degree 4 in theta.
    squared = np.array([1.0 + slope(p.restitution) ** 2, -2.0, 1.0])
    loss = 2.0 * p.clearance * (p.damping_ratio * squared + [_strength(p), 0.0, 0.0])
    roots = np.roots(np.polysub(np.polymul(loss, loss), p.force_amplitude**2 * squared))
    theta = max([1.0, *roots[roots.imag == 0.0].real.tolist()])
    return p.clearance * float(amplitude(theta, p.restitution))


def amplitude_range(parameters: Parameters) -> tuple[float, float]:
    """Amplitudes of the primary, least and largest, between which the motion is stable.

    In units of length. Errors are those of `equivalent_damping`.
    """
    _require_free(parameters)
    p = parameters
    low = fold(p.restitution).xi
    return low * p.clearance, float(amplitude(SYMMETRIC_LIMIT, p.restitution)) * p.clearance


def time_of_decay(parameters: Parameters, start: float, end: float) -> float:
    """Time in which the primary's amplitude falls from `start` to `end`, both in `amplitude_range`.

    In units of time: the integral of ((1 + rho^2) theta - 1) / (4 mu rho theta^2/pi^2 + zeta xi^2)
    over theta, in closed form. Infinite where nothing is lost.

    Raises
    ------
    ValueError
        As `equivalent_damping`, and for an amplitude out of range or an `end` above `start`.
    """
    low, high = amplitude_range(parameters)
    for name, value, most in (("start", start, high), ("end", end, start)):
        if not low <= value <= most:
            raise ValueError(f"{name} = {value!r}: must be a number from {low!r} to {most!r}")
    return decay_time(parameters, start, end)


def decay_time(parameters: Parameters, start: float, end: float) -> float:
    """As `time_of_decay`, unchecked: above the range, too, where the motion is not stable."""
    p = parameters
    # Rounding may put the fold itself below the fold.
    xi = np.maximum(np.array([start, end]) / p.clearance, fold(p.restitution).xi)
    first, last = branches(xi, p.restitution)[0].tolist()
    square, zeta, impacts = 1.0 + slope(p.restitution) ** 2, p.damping_ratio, _strength(p)
    # The loss is a theta^2 - 2 zeta theta + zeta, with the discriminant -4 rest.
    a = impacts + zeta * square
    if a == 0.0:
        return math.inf if first > last else 0.0
    rest = zeta * (a - zeta)
    at_start, at_end = impacts * np.array([first, last]) ** 2 + zeta * xi**2
    if at_end == 0.0:  # only with restitution 1, where the fold is at amplitude 0
        return math.inf
    inner = (a * first - zeta) * (a * last - zeta)
    # The difference of two arcus tangents as one, over the square root of `rest`.
    z = a * (first - last) / (rest + inner)
    root = math.sqrt(rest)
    turn = math.atan(root * z) / root if root > 0.0 else z
    return square / (2.0 * a) * math.log(at_start / at_end) - impacts / a * turn


def _strength(p: Parameters) -> float:
    return 4.0 * p.mass_ratio * slope(p.restitution) / math.pi**2


def _require_free(parameters: Parameters) -> None:
    """Raise ValueError unless the closed form holds for these parameters."""
    p = parameters
    require_basic(p, "force_amplitude", "forcing")
    if p.force_amplitude != 0.0 and p.forcing.kind != "none":
        raise ValueError(
            f"force_amplitude = {p.force_amplitude!r}: the closed form is of free motion; must be 0"
        )
    if p.clearance == 0.0:
        raise ValueError("clearance = 0.0: the closed form is over the clearance; must be > 0")
    if p.damping_ratio >= 1.0:
        raise ValueError(
            f"damping_ratio = {p.damping_ratio!r}: the closed form is for a vibration; must be < 1"
        )
