"""Closed forms of `damper.theory` at the places of a cube, for figures and tables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from damper.analysis.places import own_values
from damper.parameters import Parameters, Units
from damper.parameters.lazy import xr
from damper.parameters.quantities import INITIAL_NAMES, PARAMETER_NAMES, SI_NAMES, quantities_in
from damper.parameters.tables import beside_numbers
from damper.sweep.points import read_point
from damper.sweep.record import force_of, masses_of
from damper.theory import require_basic
from damper.theory.steady import steady_amplitude
from damper.theory.two_impacts import Orbit, orbits


def damper_at(place: xr.Dataset, **values: float) -> tuple[Parameters, Units]:
    """Dimensionless parameters, and sizes of the units, of one place of a cube.

    Scalar coordinates give the parameters, in either system of units; `values` those along
    dimensions that the place still has. TypeError when one is missing.
    """
    own = {name: own_values(place, name, value) for name, value in values.items()}
    point = read_point(_scalars(place) | own)
    return point.parameters, point.units


def reduced_gap(parameters: Parameters) -> float:
    """G = 2 d / A of the small-mass limit, A the steady amplitude of the primary alone.

    ValueError unless it is a rigid damper with a constant restitution.

    Examples
    --------
    >>> reduced_gap(Parameters(1e-4, 0.0, 0.5, clearance=1.0, restitution=0.5))
    1.5
    """
    require_basic(parameters)
    amplitude = steady_amplitude(parameters.damping_ratio, parameters.frequency_ratio)
    return 2.0 * parameters.clearance / amplitude


def admissible_orbits(
    place: xr.Dataset, along: str, values: Iterable[float]
) -> list[tuple[list[Orbit | None], Units]]:
    """Motions with two impacts per period at every value of one axis, which `place` is without.

    At every value the fast and the slow motion, None where there is none whose free mass stays
    between the walls, and the sizes of the units. An axis that is no parameter changes nothing.
    """
    scalars = _scalars(place)
    varies = along in PARAMETER_NAMES or along in SI_NAMES
    found = []
    for value in values:
        point = read_point(
            scalars | ({along: own_values(place, along, float(value))} if varies else {})
        )
        both: list[Orbit | None] = [None, None]
        for k, orbit in enumerate(orbits(point.parameters)):
            both[k] = orbit if orbit.admissible else None
        found.append((both, point.units))
    return found


def section_point(orbit: Orbit, section: Mapping[str, Mapping[str, Any]]) -> tuple[float, float]:
    """Displacement and velocity of a motion on a section, as its observer would record them."""
    if set(section) == {"stroboscopic_section"}:
        return orbit.stroboscopic(section["stroboscopic_section"].get("when", 0.0))
    if set(section) == {"impact_section"}:
        return orbit.after_impact(section["impact_section"].get("wall", "right"))
    raise ValueError(
        f"section = {section!r}: must be one of stroboscopic_section, impact_section, with settings"
    )


def dense(values: np.ndarray, between: int, most: int) -> np.ndarray:
    """Ascending values with some in between each two, for curves; `most` of them or the values."""
    values = np.sort(values)
    steps = min(between, max(most // max(len(values), 1), 1))
    parts = np.arange(steps) / steps
    inner = values[:-1, None] + np.diff(values)[:, None] * parts
    return np.concatenate([inner.ravel(), values[-1:]])


def _scalars(place: xr.Dataset) -> dict[str, Any]:
    """Parameters that are scalar coordinates, the force, and the masses that are listed."""
    names = (n for n in quantities_in(place.coords) if n not in INITIAL_NAMES)
    scalar = (n for n in names if place[n].ndim == 0)
    values: dict[str, Any] = {n: float(own_values(place, n, place[n].values)) for n in scalar}
    values |= beside_numbers(**masses_of(place))
    return values | force_of(place)
