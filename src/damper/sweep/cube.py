"""Cubes: arrays over runs -> an xarray Dataset over named axes, and its netCDF file."""

import json
import re
import shutil
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import xarray as xr

from damper.parameters.quantities import ALL, is_si, quantities_in
from damper.parameters.units import AMPLITUDES, FORCE, FREE, HERTZ, attributes_of, name_of
from damper.parameters.variables import NO_VALUE, OWN_DIMENSIONS, SI_UNITS, STATUS, Variable
from damper.sweep.idle import idle_from_rest
from damper.sweep.parts import PartData

#: Of a file's metadata: a long name and units for each variable, flags with their meanings.
CONVENTIONS = "CF-1.11"
REFERENCES = (
    "Paper A: Adv. Mech. Eng. 2017, doi:10.1177/1687814017743110. "
    "Paper B: J. Low Freq. Noise Vib. Act. Control 2021, doi:10.1177/14613484211051849."
)
_NOISE_SEED = Variable("noise_seed", "seed of the noise", "1", ("draw",))


def dataset(
    axes: Mapping[str, Iterable[float]],
    fixed: Mapping[str, float],
    arrays: Mapping[str, np.ndarray],
    variables: Iterable[Variable],
    coordinates: Mapping[str, np.ndarray],
    attributes: Mapping[str, Any],
    branches: Mapping[str, Sequence[Any]] | None = None,
    labels: Mapping[str, Sequence[float]] | None = None,
    places: Mapping[str, Mapping[str, float]] = MappingProxyType({}),
) -> xr.Dataset:
    """Build a cube.

    Parameters
    ----------
    axes : mapping of str to values
        Axes of parameters and initial quantities in the order of the cube's dimensions.
    fixed : mapping of str to float
        The other ones; they become scalar coordinates.
    arrays : mapping of str to ndarray
        Each variable with the runs (product of the axes and branches, last one fastest) as first
        axis.
    variables : iterable of Variable
        Descriptions; `status` is added.
    coordinates : mapping
        Values along the observers' own dimensions.
    attributes : mapping
        Global attributes.
    branches : mapping, optional
        Coordinates of the dimensions after the axes: ``direction``, ``draw``.
    labels : mapping, optional
        Drawn quantities along ``draw``.
    places : mapping, optional
        Variable -> values of axes, where only the runs there were observed: it has no such
        dimension, and its attribute ``observed_at`` says where.

    Returns
    -------
    xarray.Dataset
    """
    values = {name: np.asarray(along, dtype=float) for name, along in axes.items()}
    branches = dict(branches or {})
    sizes = {name: len(along) for name, along in values.items()}
    sizes |= {name: len(along) for name, along in branches.items()}
    data: dict[str, Any] = {}
    for variable in (*variables, STATUS):
        array, at = arrays[variable.name], places.get(variable.name, {})
        dims = [name for name in sizes if name not in at]
        array = array.reshape([sizes[name] for name in dims] + [*array.shape[1:]])
        made = described(variable, array, dims, missing=variable is not STATUS)
        if at:
            made.attrs["observed_at"] = json.dumps(dict(at))
        data[variable.name] = made
    names = [*axes, *fixed, *(labels or ())]
    si = is_si(names)
    coords: dict[str, Any] = {}
    for name in quantities_in(names):
        quantity = ALL[name]
        units = SI_UNITS.get(quantity.units, quantity.units) if si else quantity.units
        about = Variable(name, quantity.long_name, units)
        if name in axes:
            coords[name] = described(about, values[name], [name])
        elif name in fixed:
            coords[name] = described(about, float(fixed[name]))
        elif labels and name in labels:
            coords[name] = described(about, labels[name], ["draw"])
    for name, along in (branches | dict(coordinates)).items():
        long_name, units = OWN_DIMENSIONS.get(name, (name, ""))
        coords[name] = described(Variable(name, long_name, units, (name,)), along)
    return xr.Dataset(data, coords, dict(attributes))


def described(
    variable: Variable, array: Any, dims: Sequence[str] = (), missing: bool = False
) -> xr.Variable:
    """Return an array with what is declared of it.

    Parameters
    ----------
    variable : Variable
    array : array_like
    dims : sequence of str
        Dimensions before those of the variable.
    missing : bool
        Whether `NO_VALUE` stands for no value, where it holds integers.
    """
    array = np.asarray(array)
    attrs: dict[str, Any] = {"long_name": variable.long_name, **attributes_of(variable.units)}
    if variable.comment:
        attrs["comment"] = variable.comment
    if variable.flags:
        attrs["flag_values"] = np.arange(len(variable.flags), dtype="i1")
        attrs["flag_meanings"] = " ".join(re.sub("[ -]", "_", flag) for flag in variable.flags)
    encoding = {}
    if missing and array.dtype.kind == "i":
        encoding = {"dtype": array.dtype, "_FillValue": NO_VALUE}
        array = without_missing(array)
    return xr.Variable((*dims, *variable.dims), array, attrs, encoding)


def described_all(
    arrays: Mapping[str, Any], variables: Iterable[Variable], dims: Sequence[str] = ()
) -> dict[str, xr.Variable]:
    """Return arrays by the names of their variables, with what is declared of them."""
    return {v.name: described(v, arrays[v.name], dims) for v in variables}


def without_missing(array: np.ndarray) -> np.ndarray:
    """Return an observer's integers as xarray reads them from a file: floats, NaN for no value."""
    if array.dtype.kind != "i":
        return array
    floats = array.astype("f4" if array.itemsize <= 2 else "f8")
    floats[array == NO_VALUE] = np.nan
    return floats


def gather(
    parts: Sequence[PartData],
    axes: Mapping[str, Sequence[float]],
    fan_axes: Sequence[str],
    fixed: Mapping[str, float],
    attributes: Mapping[str, Any],
    notes: Mapping[str, Mapping[str, str]] | None = None,
    amplitude: str = FORCE,
    in_hertz: Mapping[str, Sequence[float]] = MappingProxyType({}),
) -> xr.Dataset:
    """Put the slices of a study together.

    Parameters
    ----------
    parts : sequence of PartData
        Each a slice, or a part of its draws, in the order of the product of the fanned axes, the
        last one fastest.
    axes : mapping of str to values
        All axes in the order of the cube's dimensions.
    fan_axes : sequence of str
        Those along which `parts` lie.
    fixed, attributes : mapping
        As for `dataset`.
    notes : mapping, optional
        Remarks, such as why a value is assumed: note -> name -> text. Each becomes an attribute
        of the coordinate of that name, or of the cube.
    in_hertz : mapping, optional
        Frequencies that the cube has in Hz -> their values, nothing for drawn ones.
    amplitude : str, default "F0"
        What that of the force is called; see `Forcing.amplitude`.

    Returns
    -------
    xarray.Dataset
        Its attributes name the ``quantities`` of a run, and count the ``runs``, and of these
        ``runs_stopped_early``, and ``runs_idle_from_rest`` if there are any.
    """
    parts = _whole(parts)
    inner = [name for name in axes if name not in fan_axes]
    arrays = {
        name: np.concatenate([part.arrays[name] for part in parts]) for name in parts[0].arrays
    }
    first = parts[0].about
    coordinates = {name: np.array(values) for name, values in first["coordinates"].items()}
    places = {
        variable: {
            n: dict(zip(axes[n], in_hertz.get(n, axes[n]), strict=True))[v] for n, v in at.items()
        }
        for variable, at in first.get("places", {}).items()
    }
    # Runs lie in the order of fanned, then inner axes; the cube's dimensions in the study's.
    order = {name: axes[name] for name in (*fan_axes, *inner)}
    cube = dataset(
        order,
        fixed,
        arrays,
        parts[0].variables,
        coordinates,
        attributes,
        first["branches"],
        first["labels"],
        places,
    )
    cube.attrs |= {
        "quantities": " ".join([*axes, *fixed, *first["labels"]]),
        "runs": cube.status.size,
        "runs_stopped_early": int((cube.status != 0).sum()),
        **idle_from_rest(cube),
    }
    if seeds := first.get("noise_seeds"):
        cube.coords["noise_seed"] = described(_NOISE_SEED, np.array(seeds))
    about = cube.coords["force_amplitude"].attrs if "force_amplitude" in cube.coords else {}
    if about.get("units") == "N":
        about["units"] = AMPLITUDES[amplitude][1]
    if fixed.get("force_amplitude") == 0.0:
        amplitude = FREE
    for array in cube.variables.values():
        if "scaled_by" in array.attrs:
            unit = array.attrs["scaled_by"]
            array.attrs["scaled_by"] = name_of(unit, amplitude)
    for note, texts in (notes or {}).items():
        for name, text in texts.items():
            if name in cube.coords:
                cube[name].attrs[note] = text
            else:
                cube.attrs[f"{note}_{name}"] = text
    for name, values in in_hertz.items():
        one = cube[name]
        numbers = np.reshape(values, one.shape) if len(values) else one.values / (2.0 * np.pi)
        about = {"long_name": one.attrs["long_name"].removeprefix("angular "), "units": HERTZ}
        cube = cube.assign_coords({name: (one.dims, numbers, one.attrs | about)})
    return cube.transpose(*axes, ...)


def _whole(parts: Sequence[PartData]) -> list[PartData]:
    """Join the parts that share the draws of a slice: draws lie last in the runs of a part."""
    if not parts[0].about["branches"].get("draw"):
        return list(parts)
    draws = [part.about["branches"]["draw"] for part in parts]
    starts = [k for k, own in enumerate(draws) if own[0] == 0]
    return [_joined(parts[i:j]) for i, j in pairwise([*starts, len(parts)])]


def _joined(parts: Sequence[PartData]) -> PartData:
    if len(parts) == 1:
        return parts[0]
    abouts = [part.about for part in parts]
    counts = [len(about["branches"]["draw"]) for about in abouts]
    arrays = {}
    for name, first in parts[0].arrays.items():
        own = first.shape[1:]
        each = zip(parts, counts, strict=True)
        runs = [part.arrays[name].reshape(-1, count, *own) for part, count in each]
        arrays[name] = np.concatenate(runs, axis=1).reshape(-1, *own)
    labels = {n: _all([about["labels"][n] for about in abouts]) for n in abouts[0]["labels"]}
    ways = abouts[0]["branches"] | {"draw": list(range(sum(counts)))}
    about = abouts[0] | {"labels": labels, "branches": ways}
    if "noise_seeds" in about:
        about["noise_seeds"] = _all([about["noise_seeds"] for about in abouts])
    return PartData(arrays, about)


def _all(lists: Iterable[list[Any]]) -> list[Any]:
    return [value for one in lists for value in one]


def write_cube(cube: xr.Dataset, path: Path) -> None:
    """Write a compressed netCDF4 file; the same cube gives the same bytes.

    Raises
    ------
    OSError
        With the path and the room on its disk, where it cannot be written.
    """
    # With a check sum, so that a flipped byte is an error and no number.
    packed = {"zlib": True, "complevel": 4, "shuffle": True, "fletcher32": True}
    encoding = {
        # Beside NaN, only integers that may be missing have a fill value.
        name: {"_FillValue": None}
        | variable.encoding
        | (packed if variable.ndim and variable.dtype.kind in "fiub" else {})
        for name, variable in cube.variables.items()
    }
    try:
        cube = cube.assign_attrs(Conventions=CONVENTIONS)
        cube.to_netcdf(path, format="NETCDF4", engine="netcdf4", encoding=encoding)
    except (OSError, RuntimeError) as error:
        # netCDF calls a full disk an HDF error.
        room = shutil.disk_usage(path.parent).free / 1e6
        raise OSError(f"{path}: {error}; {room:.1f} MB are free on its disk") from error
