"""Branches of periodic motions for a study: followed at each place of its other axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product as combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from damper.parameters import Parameters
from damper.parameters.quantities import ALL, PARAMETER_NAMES
from damper.parameters.units import LENGTH, SPEED, attributes_of
from damper.sweep.orbits.arcs import run_arc
from damper.sweep.orbits.branch import Branch, continue_orbit
from damper.sweep.orbits.periodic import PeriodicOrbit, periodic_orbit
from damper.sweep.orbits.point_curve import continue_point

if TYPE_CHECKING:
    import xarray as xr

#: Variable, also of a special point -> long name and units; a text has none.
_ABOUT = {
    "motion": ("name of the motion that the branch is of", ""),
    "along": ("axis that the branch is followed along", ""),
    "first_end": ("why the branch ends where it begins", ""),
    "last_end": ("why the branch ends", ""),
    "value": ("value of the axis that the branch is followed along, in its units", "1"),
    "stable": ("whether the motion is stable", "1"),
    "multiplier": ("size of the Floquet multipliers, the largest first", "1"),
    "slowest_impact": ("approach speed of the slowest impact", SPEED),
    "kind": ("what happens at the special point", ""),
    "branch": ("number of the branch", "1"),
    "word": ("order of the events in a period", ""),
    "displacement": ("primary displacement once per forcing period", LENGTH),
    "velocity": ("primary velocity once per forcing period", SPEED),
    "curve": ("number of the curve of special points", "1"),
    "curve_branch": ("number of the branch on which the curve begins", "1"),
    "curve_other": ("the other parameter of the curve", ""),
    "curve_kind": ("what happens at the points of the curve", ""),
    "curve_first_end": ("why the curve ends where it begins", ""),
    "curve_last_end": ("why the curve ends", ""),
    "curve_word": ("order of the events in a period", ""),
    "curve_value": ("value of the axis that the branch is followed along, in its units", "1"),
    "curve_other_value": ("value of the other parameter, in its units", "1"),
}
#: Largest step along a curve of special points.
_STEP = 0.1


def follow_orbits(
    entries: Mapping[str, Mapping[str, Any]],
    fixed: Mapping[str, float],
    axes: Mapping[str, Sequence[float]],
    at: float = 0.0,
) -> xr.Dataset:
    """Follow periodic motions along an axis, at each place of the other axes.

    Parameters
    ----------
    entries : mapping
        Name of the motion -> `along`, the axis; `start`, the value at which a run from rest that
        has settled shows it; `period`; `settle`, periods of that run; `max_orbits`; `at`, values of
        other axes; `curves`, kind of a special point -> parameter -> its range.
    fixed, axes : mapping
        Values of the study's quantities.
    at : float, default 0
        Part of the forcing period at which `displacement` and `velocity` are those of the orbit.

    Returns
    -------
    xarray.Dataset
        Along `orbit` and `point`, all orbits and special points, with the number of their branch,
        and along `number` their multipliers;
        along `branch`, its name, the values of the other axes, and why it ends. Along `turn`, the
        forcing periods of an orbit. Along `curve_point`, special points over the axis and another
        parameter, with the number of their `curve`.
    """
    import xarray as xr

    found = []
    for name, entry in entries.items():
        along = entry["along"]
        at_only = {axis: (value,) for axis, value in entry.get("at", {}).items()}
        others = {k: at_only.get(k, values) for k, values in axes.items() if k != along}
        for place in combinations(*others.values()):
            where = dict(zip(others, place, strict=True))
            found.append((name, along, where, _branch(entry, {**fixed, **where}, axes[along])))
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
    variables: dict[str, Any] = {
        "motion": ("branch", _texts(name for name, *_ in found)),
        "along": ("branch", _texts(along for _, along, *_ in found)),
        "first_end": ("branch", _texts(branch.ends[0] for *_, branch in found)),
        "last_end": ("branch", _texts(branch.ends[1] for *_, branch in found)),
        **{
            axis: ("branch", np.array([where.get(axis, np.nan) for _, _, where, _ in found], float))
            for axis in axes
        },
        "value": (
            "orbit",
            np.array([getattr(o.parameters, found[k][1]) for k, o in orbits], float),
        ),
        "stable": ("orbit", np.array([o.stable for _, o in orbits], "i1")),
        "slowest_impact": ("orbit", np.array([o.slowest_impact for _, o in orbits], float)),
        "curve_branch": ("curve", np.array([k for k, *_ in curves], "i4")),
        "curve_other": ("curve", _texts(other for _, _, other, _ in curves)),
        "curve_kind": ("curve", _texts(curve.kind for *_, curve in curves)),
        "curve_first_end": ("curve", _texts(curve.ends[0] for *_, curve in curves)),
        "curve_last_end": ("curve", _texts(curve.ends[1] for *_, curve in curves)),
        "curve": ("curve_point", np.array([k for k, _ in on_curves], "i4")),
        "curve_word": ("curve_point", _texts(orbit.word for _, orbit in on_curves)),
        **{
            name: ("curve_point", np.concatenate([np.empty(0), *values]))
            for name, values in (
                ("curve_value", [curve.values(along) for _, along, _, curve in curves]),
                ("curve_other_value", [curve.values(other) for *_, other, curve in curves]),
            )
        },
        "kind": ("point", _texts(p.kind for _, p in points)),
        "point_value": ("point", np.array([p.value for _, p in points], float)),
    }
    for dim, prefix, each in (
        ("orbit", "", orbits),
        ("point", "point_", [(k, point.orbit) for k, point in points]),
    ):
        section = np.full((len(each), turns, 2), np.nan)
        for row, (_, orbit) in zip(section, each, strict=True):
            row[: orbit.period] = _on_section(orbit, at)
        multipliers = np.full((len(each), 4), np.nan)
        for row, (_, orbit) in zip(multipliers, each, strict=True):
            row[: len(orbit.multipliers)] = abs(orbit.multipliers)
        variables |= {
            f"{prefix}branch": (dim, np.array([k for k, _ in each], "i4")),
            f"{prefix}word": (dim, _texts(orbit.word for _, orbit in each)),
            f"{prefix}multiplier": ((dim, "number"), multipliers),
            f"{prefix}displacement": ((dim, "turn"), section[:, :, 0]),
            f"{prefix}velocity": ((dim, "turn"), section[:, :, 1]),
        }
    coords = {name: fixed[name] for name in PARAMETER_NAMES if name in fixed}
    dataset = xr.Dataset(variables, coords=coords)
    for name in map(str, dataset.variables):
        dataset[name].attrs = _described(name)
    return dataset


def _described(name: str) -> dict[str, str]:
    """Attributes of a variable."""
    if name in ALL:
        return {"long_name": ALL[name].long_name, **attributes_of(ALL[name].units)}
    long_name, units = _ABOUT[name.removeprefix("point_")]
    return {"long_name": long_name} | (attributes_of(units) if units else {})


def _branch(
    entry: Mapping[str, Any], values: Mapping[str, float], along: Sequence[float]
) -> Branch:
    """One branch; without orbits, and with the reason, where no motion is found."""
    name, ends = entry["along"], (min(along), max(along))
    # Where a study's runs start is none of a motion's parameters.
    own = {key: value for key, value in values.items() if key in PARAMETER_NAMES}
    p = Parameters(**{**own, name: entry["start"]})
    try:
        orbit = periodic_orbit(p, entry["period"], settle=entry["settle"])
    except ValueError as error:
        return Branch(name, (), (), (str(error), str(error)))
    return continue_orbit(orbit, name, *ends, max_orbits=entry["max_orbits"])


def _on_section(orbit: PeriodicOrbit, at: float) -> np.ndarray:
    """Displacement and velocity of the primary at a part of each forcing period; (period, 2)."""
    p = orbit.parameters.dimensionless
    passed = run_arc(p, orbit.start, 0.0, float(orbit.period))
    times = (np.arange(orbit.period) + at) * p.period
    return np.array([passed.state_after(time)[:2] for time in times])


def _texts(words: Any) -> np.ndarray:
    return np.array(list(words), dtype=object)
