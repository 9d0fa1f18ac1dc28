"""Branches of periodic motions for a study: followed at each place of its other axes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import product as combinations
from typing import Any

import numpy as np
import xarray as xr

from damper.parameters.forcing import forcing_of
from damper.parameters.named import damper_of, value_of
from damper.parameters.quantities import ALL, INITIAL_NAMES, quantities_in
from damper.parameters.tables import beside_numbers
from damper.parameters.variables import LENGTH, SPEED, Variable
from damper.sweep.cube import described, described_all
from damper.sweep.orbits.arcs import run_arc
from damper.sweep.orbits.branch import Branch, continue_orbit
from damper.sweep.orbits.periodic import PeriodicOrbit, periodic_orbit
from damper.sweep.orbits.point_curve import continue_point

_VALUE = "value of the axis that the branch is followed along, in its units"
_BRANCH, _CURVE, _CURVE_POINT = ("branch",), ("curve",), ("curve_point",)
#: Of branches, and of curves of special points.
_VARIABLES = (
    Variable("motion", "name of the motion that the branch is of", "", _BRANCH),
    Variable("along", "axis that the branch is followed along", "", _BRANCH),
    Variable("first_end", "why the branch ends where it begins", "", _BRANCH),
    Variable("last_end", "why the branch ends", "", _BRANCH),
    Variable("stable", "whether the motion is stable", "1", ("orbit",)),
    Variable("slowest_impact", "approach speed of the slowest impact", SPEED, ("orbit",)),
    Variable("kind", "what happens at the special point", "", ("point",)),
    Variable("curve_branch", "number of the branch on which the curve begins", "1", _CURVE),
    Variable("curve_other", "the other parameter of the curve", "", _CURVE),
    Variable("curve_kind", "what happens at the points of the curve", "", _CURVE),
    Variable("curve_first_end", "why the curve ends where it begins", "", _CURVE),
    Variable("curve_last_end", "why the curve ends", "", _CURVE),
    Variable("curve", "number of the curve of special points", "1", _CURVE_POINT),
    Variable("curve_word", "order of the events in a period", "", _CURVE_POINT),
    Variable("curve_value", _VALUE, "1", _CURVE_POINT),
    Variable("curve_other_value", "value of the other parameter, in its units", "1", _CURVE_POINT),
)
#: Of an orbit, and of that at a special point.
_OF_ORBIT = (
    Variable("branch", "number of the branch", "1"),
    Variable("value", _VALUE, "1"),
    Variable("word", "order of the events in a period", ""),
    Variable("multiplier", "size of the Floquet multipliers, the largest first", "1", ("number",)),
    Variable("displacement", "primary displacement once per forcing period", LENGTH, ("turn",)),
    Variable("velocity", "primary velocity once per forcing period", SPEED, ("turn",)),
)
#: Largest step along a curve of special points.
_STEP = 0.1


def follow_orbits(
    entries: Mapping[str, Mapping[str, Any]],
    fixed: Mapping[str, float],
    axes: Mapping[str, Sequence[float]],
    at: float = 0.0,
    forcing: Mapping[str, Any] | None = None,
    masses: int = 0,
    tables: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """Follow periodic motions along an axis, at each place of the other axes.

    Parameters
    ----------
    entries : mapping
        Name of the motion -> `along`, the axis; `start`, the value at which a run from rest settles
        on the motion; `period`; `expect`, the word it must have, if any; `settle`, periods of that
        run; `max_orbits`; `at`, values of other axes; `curves`, kind of a special point ->
        parameter -> range.
    fixed, axes : mapping
        Values of the study's quantities.
    at : float, default 0
        Part of the forcing period at which `displacement` and `velocity` are taken.
    forcing : mapping, optional
        What drives the damper, as `Forcing.settings`; a harmonic force by default.
    masses : int, default 0
        Number of listed free masses; a constant of a single mass is a quantity such as
        `clearance_1`.
    tables : mapping, optional
        Tables of the restitution, as for `damper.parameters.tables.beside_numbers`.

    Returns
    -------
    xarray.Dataset
        Along `orbit` and `point`, all orbits and special points, with the number of their branch,
        and along `number` their multipliers;
        along `branch`, its name, the values of the other axes, and why it ends. Along `turn`, the
        forcing periods of an orbit. Along `curve_point`, special points over the axis and another
        parameter, with the number of their `curve`.
    """
    found = []
    # Where a study's runs start is none of a motion's parameters.
    own = {name: value for name, value in fixed.items() if name not in INITIAL_NAMES}
    every: dict[str, Any] = {} if forcing is None else {"forcing": forcing_of(forcing)}
    every |= beside_numbers(masses, tables)
    for name, entry in entries.items():
        along = entry["along"]
        at_only = {axis: (value,) for axis, value in entry.get("at", {}).items()}
        others = {k: at_only.get(k, values) for k, values in axes.items() if k != along}
        for place in combinations(*others.values()):
            where = dict(zip(others, place, strict=True))
            branch = _branch(entry, {**own, **where, **every}, axes[along])
            found.append((name, along, where, branch))
    curves = [
        (k, along, other, continue_point(point, ranges, step=_STEP))
        for k, (name, along, _, branch) in enumerate(found)
        for point in branch.special_points
        for other, ends in entries[name].get("curves", {}).get(point.kind, {}).items()
        for ranges in ({along: (min(axes[along]), max(axes[along])), other: ends},)
    ]
    on_curves = [(k, orbit) for k, (*_, curve) in enumerate(curves) for orbit in curve.orbits]
    turns = max((entry["period"] for entry in entries.values()), default=1)
    orbits = [(k, o) for k, (*_, branch) in enumerate(found) for o in branch.orbits]
    points = [(k, p) for k, (*_, branch) in enumerate(found) for p in branch.special_points]
    arrays: dict[str, Any] = {
        "motion": _texts(name for name, *_ in found),
        "along": _texts(along for _, along, *_ in found),
        "first_end": _texts(branch.ends[0] for *_, branch in found),
        "last_end": _texts(branch.ends[1] for *_, branch in found),
        "stable": np.array([o.stable for _, o in orbits], "i1"),
        "slowest_impact": np.array([o.slowest_impact for _, o in orbits], float),
        "kind": _texts(p.kind for _, p in points),
        "curve_branch": np.array([k for k, *_ in curves], "i4"),
        "curve_other": _texts(other for _, _, other, _ in curves),
        "curve_kind": _texts(curve.kind for *_, curve in curves),
        "curve_first_end": _texts(curve.ends[0] for *_, curve in curves),
        "curve_last_end": _texts(curve.ends[1] for *_, curve in curves),
        "curve": np.array([k for k, _ in on_curves], "i4"),
        "curve_word": _texts(orbit.word for _, orbit in on_curves),
        "curve_value": _joined(curve.values(along) for _, along, _, curve in curves),
        "curve_other_value": _joined(curve.values(other) for *_, other, curve in curves),
    }
    data = described_all(arrays, _VARIABLES)
    for axis in axes:
        values = np.array([where.get(axis, np.nan) for _, _, where, _ in found], float)
        data[axis] = described(_quantity(axis), values, _BRANCH)
    count = max(4, *(len(orbit.multipliers) for _, orbit in orbits)) if orbits else 4
    along_orbits = [value_of(o.parameters, found[k][1]) for k, o in orbits]
    data |= _of_orbits("orbit", "", orbits, along_orbits, turns, count, at)
    at_points = [(k, point.orbit) for k, point in points]
    data |= _of_orbits("point", "point_", at_points, [p.value for _, p in points], turns, count, at)
    given = {name: described(_quantity(name), own[name]) for name in quantities_in(own)}
    return xr.Dataset(data, given, {"masses": masses} if masses else {})


def _of_orbits(
    dim: str,
    prefix: str,
    orbits: Sequence[tuple[int, PeriodicOrbit]],
    values: Sequence[float],
    turns: int,
    count: int,
    at: float,
) -> dict[str, xr.Variable]:
    """Return the variables of orbits, each orbit with its branch's number and its value there."""
    section = np.full((len(orbits), turns, 2), np.nan)
    multipliers = np.full((len(orbits), count), np.nan)
    for row, (_, orbit) in enumerate(orbits):
        section[row, : orbit.period] = _on_section(orbit, at)
        multipliers[row, : len(orbit.multipliers)] = abs(orbit.multipliers)
    arrays = {
        "branch": np.array([k for k, _ in orbits], "i4"),
        "value": np.array(values, float),
        "word": _texts(orbit.word for _, orbit in orbits),
        "multiplier": multipliers,
        "displacement": section[:, :, 0],
        "velocity": section[:, :, 1],
    }
    return {prefix + name: v for name, v in described_all(arrays, _OF_ORBIT, [dim]).items()}


def _quantity(name: str) -> Variable:
    return Variable(name, ALL[name].long_name, ALL[name].units)


def _branch(entry: Mapping[str, Any], values: Mapping[str, Any], along: Sequence[float]) -> Branch:
    """One branch; without orbits, and with the reason, where no motion is found."""
    name, ends = entry["along"], (min(along), max(along))
    p = damper_of({**values, name: entry["start"]})
    try:
        orbit = periodic_orbit(p, entry["period"], settle=entry["settle"])
        if entry.get("expect") not in (None, orbit.word):
            found = f"is {orbit.word}" if orbit.word else "has no impacts"
            raise ValueError(f"the run at {entry['start']:g} {found}, not {entry['expect']}")
    except ValueError as error:
        return Branch(name, (), (), (str(error), str(error)))
    return continue_orbit(orbit, name, *ends, max_orbits=entry["max_orbits"])


def _on_section(orbit: PeriodicOrbit, at: float) -> np.ndarray:
    """Displacement and velocity of the primary at a part of each forcing period; (period, 2)."""
    p = orbit.parameters.dimensionless
    passed = run_arc(p, orbit.start, 0.0, float(orbit.period))
    times = (np.arange(orbit.period) + at) * p.cycle
    return np.array([passed.state_after(time)[:2] for time in times])


def _texts(words: Any) -> np.ndarray:
    return np.array(list(words), dtype=object)


def _joined(parts: Iterable[np.ndarray]) -> np.ndarray:
    return np.concatenate([np.empty(0), *parts])
