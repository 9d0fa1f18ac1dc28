"""Amplitudes of both masses cycle by cycle, from the events of a trajectory."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damper.analysis.closed_forms import damper_at
from damper.parameters.lazy import xr

_IMPACT = 0


class Amplitudes(NamedTuple):
    """Columns over cycles; a cycle begins at the first impact on the right wall after a left
    one."""

    theta: np.ndarray
    """Free mass's displacement at the impact that begins it, over the clearance."""
    xi: np.ndarray
    """Amplitude of the primary there, over the clearance."""
    two_impacts: np.ndarray
    """Whether the cycle has one impact on each wall and nothing else."""


def amplitudes(place: xr.Dataset) -> Amplitudes:
    """Amplitudes of both masses in every complete cycle of one point's sampled trajectory.

    The primary's amplitude is that of its energy, sqrt(x^2 + x'^2) in units of the dimensionless
    model, with the mean of its kinetic energies just before and just after the impact. It is the
    peak displacement of a free vibration, and that of a forced one near resonance.
    """
    parameters, units = damper_at(place)
    event = place.trajectory_event.values
    # Two rows each: just before and just after.
    rows = np.flatnonzero(event == _IMPACT)[1::2]
    x, v, y = (
        place[f"trajectory_{name}"].values
        for name in ("displacement", "velocity", "free_displacement")
    )
    walls = np.sign(y[rows] - x[rows])
    # Sticking and release are no impacts, and end a cycle's claim to two.
    other = np.flatnonzero(event > _IMPACT)
    starts = np.flatnonzero((walls > 0.0) & (np.r_[-1.0, walls[:-1]] < 0.0))
    first, last = starts[:-1], starts[1:]
    begin, end = rows[first], rows[last]
    undisturbed = np.searchsorted(other, begin) == np.searchsorted(other, end)
    energy = x[begin] ** 2 / units.length**2
    energy += 0.5 * (v[begin] ** 2 + v[begin - 1] ** 2) / units.speed**2
    clearance = parameters.clearance
    return Amplitudes(
        y[begin] / units.length / clearance,
        np.sqrt(energy) / clearance,
        undisturbed & (last - first == 2),
    )
