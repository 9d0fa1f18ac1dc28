"""How well a solver's run keeps the energy balance.

Each solver adds up work and losses along its own run, in its own way; what they are held against
is the same for all.
"""

import math
from collections.abc import Sequence

from damper.parameters import Parameters


def stored_energy(parameters: Parameters, state: Sequence[float]) -> float:
    """Energy in the masses and the springs at one moment, in units of F0^2/K.

    (1/2) (v^2 + x^2 + mu u^2), and (1/2) k g^2 for each compliant contact whose gap g is
    negative. What is left in a contact that has ended counts until the gap reopens; it is lost to
    the wall's dashpot on the way.

    Parameters
    ----------
    parameters : Parameters
        With rigid walls or compliant contact.
    state : sequence of float (4,)
        x, v, y, u; more entries are left alone.
    """
    x, v, y, u = (float(value) for value in state[:4])
    energy = 0.5 * (v * v + x * x + parameters.mass_ratio * u * u)
    if parameters.model == "compliant":
        for side in (-1.0, 1.0):
            depth = max(side * (y - x) - parameters.clearance, 0.0)
            energy += 0.5 * parameters.contact_stiffness_ratio * depth * depth
    return energy


def energy_residual(
    parameters: Parameters,
    start: Sequence[float],
    end: Sequence[float],
    work: float,
    dissipated: float,
    lost: float,
) -> float:
    """What is missing in the balance of a run, relative to the energies that went through it.

    (E1 - E0 - work + dissipated + lost) / (E1 + E0 + the sizes of the other three), where E is
    `stored_energy`. It vanishes in exact arithmetic.

    Parameters
    ----------
    parameters : Parameters
    start, end : sequence of float (4,)
        x, v, y, u at both ends of the run.
    work : float
        Of the force on the primary: integral of sin(omega t + phase) v.
    dissipated : float
        In the primary's dashpot: integral of 2 zeta v^2.
    lost : float
        In impacts, (1/2) mu / (1 + mu) (s^2 - w^2) each with the relative speeds s before and w
        after; with compliant contact, in its dashpots, (N + k g) (-g') while g < 0.

    Returns
    -------
    float
        0 where all energies vanish; nan where one is not finite.

    Examples
    --------
    >>> p = Parameters(0.5, 0.1, 1.0, clearance=1.0, restitution=0.5)
    >>> energy_residual(p, (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0), 0.0, 0.5, 0.0)
    0.0
    >>> energy_residual(p, (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0), 0.0, 0.25, 0.0)
    -0.3333333333333333
    """
    before = stored_energy(parameters, start)
    after = stored_energy(parameters, end)
    size = before + after + abs(work) + abs(dissipated) + abs(lost)
    if not math.isfinite(size):
        return math.nan
    if size == 0.0:
        return 0.0
    return (after - before - work + dissipated + lost) / size
