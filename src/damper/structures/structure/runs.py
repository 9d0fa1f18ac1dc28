"""Jobs of a study of a structure: runs over a grid, and the cube of what they found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from damper.parameters.forcing import forcing_of
from damper.parameters.lazy import xr
from damper.parameters.structural import StructureParameters
from damper.parameters.structure import Structure
from damper.sweep.parts import PartData
from damper.sweep.structures import measured_grid, structure_cube


def run_part(
    needed: Sequence[PartData],
    structure: Mapping[str, Any],
    forcing: Mapping[str, Any],
    parameters: Mapping[str, Any],
    axes: Mapping[str, Sequence[float]],
    cycles: tuple[int, int],
    samples: int,
    history: int,
    engine: Mapping[str, Any],
    start: Mapping[str, Sequence[float]] | None = None,
    observers: Mapping[str, Mapping[str, Any]] | None = None,
) -> PartData:
    """Run the points of a grid as a job of the workflow."""
    made = StructureParameters(
        structure=Structure.of_settings(structure), forcing=forcing_of(forcing), **parameters
    )
    more: dict[str, Any] = {"start": start, "observers": observers}
    return PartData(measured_grid(made, axes, cycles, samples, history, engine, **more))


def gather(
    parts: Sequence[PartData],
    axes: Mapping[str, tuple[Sequence[float], str, str]],
    points: Sequence[str],
    attributes: Mapping[str, Any],
    fixed: Mapping[str, tuple[float, str, str]],
    observers: Mapping[str, Mapping[str, Any]] | None = None,
) -> xr.Dataset:
    """Put the parts together along the first axis."""
    whole = {
        name: np.concatenate([part.arrays[name] for part in parts]) if axes else array
        for name, array in parts[0].arrays.items()
    }
    return structure_cube(whole, axes, points, attributes, fixed, observers)
