"""Files of structures: a modal table as CSV, matrices of NumPy, MATLAB and Matrix Market."""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from damper.parameters.files import contents, matlab_variables, path_of, scipy_io
from damper.parameters.names import unknown_name
from damper.parameters.structure import FORCE, Structure

#: Names of a matrix in a file.
MATRICES = {
    "mass": ("mass", "M", "m"),
    "damping": ("damping", "C", "c", "D"),
    "stiffness": ("stiffness", "K", "k"),
}
#: Columns of a modal table that are no places.
FREQUENCY, DAMPING, MODAL_MASS = "frequency", "damping_ratio", "modal_mass"
#: Unit of a frequency -> its size in Hz.
_UNITS = {"": 1.0, "Hz": 1.0, "hz": 1.0, "rad/s": 0.5 / math.pi, "1/s": 0.5 / math.pi}
_SUFFIXES = ".npz, .npy, .mat or .mtx"


def read_modes(
    path: str | os.PathLike[str],
    *,
    force: str | None = None,
    base_shares: Mapping[str, float] | None = None,
) -> Structure:
    """Read a modal table from a CSV file with one row a mode.

    Parameters
    ----------
    path : path
        Its first line names the columns: `frequency` in Hz, or ``frequency (rad/s)``;
        `damping_ratio`; `modal_mass` in kg, if shapes are not normalised by mass; each other
        column is the shape of a place, such as `tip`, `force` or `base`. Lines that begin with #
        are skipped. Columns are separated by commas, semicolons or tabs.
    force, base_shares : optional
        Name of the place of the force, where there is no column `force`; as for
        `damper.Structure.from_modes`.

    Raises
    ------
    ValueError, OSError
        With the file, the line and what is wrong in it.
    """
    name = path_of(path)
    rows = list(_rows(name))
    if len(rows) < 2:
        raise ValueError(f"{name}: there are no modes: must have a head and a line for each mode")
    heads, size = _heads(name, *rows[0])
    columns: dict[str, list[float]] = {head: [] for head in heads}
    for line, cells in rows[1:]:
        if len(cells) != len(heads):
            raise ValueError(f"{name}, line {line}: {len(cells)} cells: must be {len(heads)}")
        for head, cell in zip(heads, cells, strict=True):
            columns[head].append(_number(f"{name}, line {line}: {head}", cell))
    frequencies = [size * value for value in columns.pop(FREQUENCY)]
    ratios, masses = columns.pop(DAMPING), columns.pop(MODAL_MASS, None)
    shapes: dict[str, Any] = dict(columns)
    if force is not None:
        if FORCE in shapes:
            raise ValueError(f"force = {force!r}, and {name} has a column force: one of the two")
        shapes[FORCE] = force
    try:
        return Structure.from_modes(
            frequencies, ratios, shapes, modal_masses=masses, base_shares=base_shares
        )
    except (ValueError, TypeError) as error:
        raise ValueError(f"{name}: {error}") from None


def read_matrices(
    files: str | os.PathLike[str] | Mapping[str, Any],
    *,
    boxes: Mapping[str, Any] | None = None,
    force: Any = None,
    base: Any = None,
    points: Mapping[str, Any] | None = None,
) -> Structure:
    """Read the matrices of a structure.

    Parameters
    ----------
    files : path, or mapping of str to path or rows of numbers
        One file of NumPy (``.npz``) or of MATLAB up to version 7 (``.mat``), with matrices
        `mass` or `M`, `damping` or `C` (none is no damping), `stiffness` or `K`. Or for each of
        `mass`, `damping` and `stiffness` a file of Matrix Market (``.mtx``) or NumPy (``.npy``), or
        the matrix itself.
    boxes, force, base, points : optional
        As for `damper.Structure`; the name of another array in the file stands for a vector.

    Raises
    ------
    ValueError, TypeError, OSError
        With the file, the matrix, the entry and what is allowed.
    """
    if isinstance(files, Mapping):
        for key in files:
            if key not in MATRICES:
                raise unknown_name("matrix", key, MATRICES)
        paths = {k: path_of(v, k) for k, v in files.items() if isinstance(v, str | os.PathLike)}
        arrays = {**files, **{key: _one(path) for key, path in paths.items()}}
        where = ", ".join(paths.values()) or "matrices"
    else:
        where = path_of(files, "matrices")
        arrays = _arrays(where)
    matrices = {}
    for key, names in MATRICES.items():
        found = [name for name in names if name in arrays]
        if not found and key != "damping":
            there = ", ".join(arrays) or "nothing"
            raise ValueError(
                f"{where}: {key} is missing: must be named {names[0]} or {names[1]}, "
                f"and it has {there}"
            )
        matrices[key] = arrays[found[0]] if found else None

    def vector(given: Any) -> Any:
        return arrays[given] if isinstance(given, str) and given in arrays else given

    def each(given: Mapping[str, Any] | None) -> Any:
        return {k: vector(v) for k, v in given.items()} if isinstance(given, Mapping) else given

    try:
        return Structure(
            **matrices,
            boxes=each(boxes),
            points=each(points),
            force=force if isinstance(force, str) and force in (boxes or {}) else vector(force),
            base=vector(base),
        )
    except (ValueError, TypeError) as error:
        raise type(error)(f"{where}: {error}") from None


def _rows(name: str) -> Iterator[tuple[int, list[str]]]:
    """Yield number and cells of each line that is not empty."""
    try:
        text = contents(name).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{name}: not a CSV file in UTF-8: {error}") from None
    lines = [
        (number, line)
        for number, line in enumerate(io.StringIO(text), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    separator = next((s for s in "\t;" if lines and s in lines[0][1]), ",")
    for number, line in lines:
        yield number, [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]


def _heads(name: str, line: int, cells: list[str]) -> tuple[list[str], float]:
    """Names of the columns, and the size of the unit of frequencies in Hz."""
    heads, size = [], 1.0
    for cell in cells:
        head, _, unit = cell.partition("(")
        head, unit = head.strip(), unit.rstrip(") ")
        if head == FREQUENCY:
            if unit not in _UNITS:
                raise ValueError(
                    f"{name}, line {line}: frequency is in {unit}: must be in Hz or rad/s"
                )
            size = _UNITS[unit]
        if not head or head in heads:
            problem = f"column {head!r} is there twice" if head else "a column has no name"
            raise ValueError(f"{name}, line {line}: {problem}: must have one name each")
        heads.append(head)
    for wanted in (FREQUENCY, DAMPING):
        if wanted not in heads:
            raise ValueError(
                f"{name}, line {line}: there is no column {wanted}: {', '.join(heads)}"
            )
    return heads, size


def _number(where: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"{where} = {cell!r}: must be a finite number")
    return value


def _arrays(name: str) -> dict[str, Any]:
    """Arrays of a file that has several."""
    suffix = Path(name).suffix.lower()
    if suffix == ".npz":
        try:
            with np.load(io.BytesIO(contents(name)), allow_pickle=False) as file:
                return {key: file[key] for key in file.files}
        except (ValueError, EOFError) as error:
            raise ValueError(f"{name}: not a file of NumPy's savez: {error}") from None
    if suffix == ".mat":
        return matlab_variables(name)
    if suffix in (".mtx", ".npy"):
        raise ValueError(f"{name}: has one matrix: give a file for each of {', '.join(MATRICES)}")
    raise ValueError(f"{name}: must be a file {_SUFFIXES}")


def _one(name: str) -> Any:
    """The matrix of a file that has one."""
    suffix = Path(name).suffix.lower()
    try:
        if suffix == ".npy":
            return np.load(io.BytesIO(contents(name)), allow_pickle=False)
        if suffix == ".mtx":
            return scipy_io(name).mmread(io.BytesIO(contents(name)))
    except (ValueError, EOFError) as error:
        raise ValueError(f"{name}: not a matrix: {error}") from None
    raise ValueError(f"{name}: must be a file .mtx or .npy; one .npz or .mat has all matrices")
