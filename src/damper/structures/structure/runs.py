"""Jobs of a study of a structure: runs over a grid, and the cube of what they found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np

from damper.parameters.forcing import forcing_of
from damper.parameters.lazy import xr
from damper.parameters.structural import StructureParameters
from damper.parameters.structure import Structure
from damper.parameters.variables import Variable
from damper.sweep.parts import PartData

#: Dimensions of the cube beside the axes.
DIMENSIONS = ("point", "body", "mode", "instant")
VARIABLES = (
    Variable("peak_displacement", "largest displacement of the point", "m", ("point",)),
    Variable("rms_displacement", "rms displacement of the point", "m", ("point",)),
    Variable("impacts_per_cycle", "impacts in a cycle", "1", ("body",)),
    Variable("mean_energy", "mean energy of the mode", "J", ("mode",)),
    Variable("time", "time since the window begins", "s", ("instant",)),
    Variable("displacement", "displacement of the point", "m", ("instant", "point")),
    Variable("mode_energy", "energy of the mode", "J", ("instant", "mode")),
)


def run_part(
    needed: Sequence[PartData],
    structure: Mapping[str, Any],
    forcing: Mapping[str, Any],
    parameters: Mapping[str, Any],
    at: Mapping[str, float],
    axes: Mapping[str, Sequence[float]],
    cycles: tuple[int, int],
    samples: int,
    history: int,
    engine: Mapping[str, Any],
) -> PartData:
    """Run the points at one place along the first axis as a job of the workflow."""
    made = StructureParameters(
        structure=Structure.of_settings(structure), forcing=forcing_of(forcing), **parameters
    )
    found = []
    for point in product(*axes.values()):
        values = {**at, **dict(zip(axes, point, strict=True))}
        p = made.having(values) if values else made
        found.append(observed(p, cycles, samples, history, engine))
    shape = tuple(map(len, axes.values()))
    arrays = {
        name: np.stack([one[name] for one in found]).reshape(*shape, *found[0][name].shape)
        for name in found[0]
    }
    return PartData(arrays)


def observed(
    p: StructureParameters,
    cycles: tuple[int, int],
    samples: int,
    history: int,
    engine: Mapping[str, Any],
) -> dict[str, np.ndarray]:
    """Run one point and return arrays of `VARIABLES`; those over instants of `history` cycles."""
    from damper.sweep.started import start

    begin, length = (number * p.cycle for number in cycles)
    run = start(p, **engine)
    run.advance(begin)
    run = start(p, run.state, **engine)  # without the log of the transient
    events = run.advance(begin + length)
    times = np.linspace(begin, begin + length, cycles[1] * samples + 1)
    motion = run.motion(times)
    displacement, energy = motion.displacement.values, motion.mode_energy.values
    hits = events["body"][events["kind"] == 0]
    found = {
        "peak_displacement": np.abs(displacement).max(axis=0),
        "rms_displacement": np.sqrt((displacement[1:] ** 2).mean(axis=0)),
        "impacts_per_cycle": np.bincount(hits, minlength=len(p.each)) / cycles[1],
        "mean_energy": energy[1:].mean(axis=0),
    }
    kept = {"time": times - begin, "displacement": displacement, "mode_energy": energy}
    first = {name: values[: history * samples + 1] for name, values in kept.items()}
    return found | (first if history else {})


def gather(
    parts: Sequence[PartData],
    axes: Mapping[str, tuple[Sequence[float], str]],
    points: Sequence[str],
    attributes: Mapping[str, Any],
) -> xr.Dataset:
    """Put the parts together along the first axis."""
    from damper.sweep.cube import described

    there = {v.name: v for v in VARIABLES if v.name in parts[0].arrays}
    data = {}
    for name, variable in there.items():
        whole = np.stack([part.arrays[name] for part in parts])
        data[name] = described(variable, whole if axes else whole[0], tuple(axes))
    sizes = {
        dim: size for one in data.values() for dim, size in zip(one.dims, one.shape, strict=True)
    }
    coords: dict[str, Any] = {
        name: (name, list(values), {"long_name": name.replace("_", " "), "units": unit})
        for name, (values, unit) in axes.items()
    }
    coords |= {"point": list(points), "mode": np.arange(1, sizes["mode"] + 1)}
    coords["body"] = np.arange(sizes["body"])
    return xr.Dataset(data, coords, dict(attributes))
