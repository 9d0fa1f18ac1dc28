"""An interactive figure of the page: its values, and what the page needs to run any point of it.

The page computes the motion itself (``workflow/report/engine.js``).
"""

from __future__ import annotations

import json
import math
from base64 import b64encode
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from damper.analysis.places import in_handy_units, own_values
from damper.figures.bifurcation import LOGARITHMIC, with_relative
from damper.figures.common.layout import numbers, select
from damper.figures.common.style import RATIOS, long_name
from damper.figures.map import ABOUT_ONE, best_places, classified
from damper.observers.bursts import Bursts
from damper.parameters.dampers import BASIC, SI_NAME
from damper.parameters.forcing import HARMONIC
from damper.parameters.quantities import ALL, INITIAL_NAMES, SI_QUANTITIES, is_si, ordered
from damper.parameters.units import own_number, shown_unit, units_of
from damper.sweep.branches import branches
from damper.sweep.grid import geometric
from damper.sweep.record import force_settings, masses_of

#: Samples of one column that are nearer than this part of the panel's height are one dot; and most
#: dots of a column.
_NEAR, _DOTS = 5e-4, 40
_BRANCHES = ("direction", "draw")
#: Quantities that the page's script knows, in both systems of units, and its forces.
_KNOWN = (*BASIC, "force_amplitude", "restitution_left", "gravity")
KNOWN = {*_KNOWN, *(SI_NAME[name] for name in _KNOWN), "primary_mass", "damping", "stiffness"}
FORCES = ("harmonic", "none")


def interactive(cube: Any, settings: Mapping[str, Any], study: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the page needs of a figure, as JSON can hold it.

    Parameters
    ----------
    cube : xarray.Dataset
    settings : mapping
        Of the figure, a bifurcation diagram or a map.
    study : mapping
        ``fixed`` and ``axes`` with their values, ``primary``, ``draws``, ``follow``, ``run``, the
        settings of every run, and ``observers`` with theirs.
    """
    at = settings.get("at") or {}
    choices = [settings[role] for role in ("each", "rows", "panels") if role in settings]
    if settings["kind"] == "map":
        x, y = settings["x"], settings["y"]
        place, variable, touched, classes = classified(cube, settings, x, y, *choices)
        place = in_handy_units(place)
        # Colours are of all these runs, a click shows one.
        overlaid = [*settings.get("worst", ()), *settings.get("share", ())]
        shown = _map(place, variable, classes, [*choices, y, x])
        if touched is not None:
            shown |= _touched(place, variable, touched, settings, [*choices, y, x])
    else:
        x, y = settings["along"], None
        cube = with_relative(cube, settings["variables"])
        variables = [name for name in settings["variables"] if name in cube]  # not of orbits
        names = [name for name in (*variables, "chatter") if name in cube]
        own = [dim for dim in (*_BRANCHES, "sample", "impact") if dim in cube[names].dims]
        keep = [dim for dim in own if dim not in at]
        place = in_handy_units(select(cube, names, at, (x, *choices, *keep)).sortby(x))
        overlaid = [dim for dim in _BRANCHES if dim in keep]
        shown = _diagram(place, variables, [*choices, *overlaid, x])
    order = [*choices, *overlaid, *([y] if y else []), x]
    return shown | {
        "axes": [_axis(place, cube, name, name in (x, y)) for name in order],
        "overlaid": overlaid,
        **_runs(cube, at, study),
    }


def _axis(place: Any, cube: Any, name: str, along: bool) -> dict[str, Any]:
    array = (place if name in place.dims else cube)[name]
    own = own_values(cube, name, cube[name].values).tolist()
    return {
        "name": name,
        "label": array.attrs.get("long_name", name) if name in ALL else name,
        "units": _units(array.attrs),
        "values": array.values.tolist(),
        # As a run takes them: the place may be in mm.
        "own": sorted(own) if along else own,
        "log": along and geometric(array.values),
    }


def _runs(cube: Any, at: Mapping[str, Any], study: Mapping[str, Any]) -> dict[str, Any]:
    """What a run at any point takes: all quantities, how it starts, how long it is."""
    axes = study["axes"]
    plan = branches([{}], {}, study["draws"], {})
    fixed = {
        **study["fixed"],
        **{n: own_values(cube, n, value) for n, value in at.items() if n in axes},
    }
    starts = INITIAL_NAMES[:4]  # of one mass
    names = ordered({*fixed, *axes, *plan.labels, *starts})
    si = is_si(name for name in names if name not in INITIAL_NAMES)
    own = {quantity.name: quantity for quantity in SI_QUANTITIES} if si else {}
    steady = study["primary"] == "steady"
    force = force_settings(cube).get("kind", HARMONIC.kind)
    units = {str(name): _units(coordinate.attrs) for name, coordinate in cube.coords.items()}
    hidden = ("initial_displacement", "initial_velocity") if steady else ()
    return {
        "parameters": [
            {
                "name": name,
                "label": long_name(name, unit),
                **_shown_in(unit),
                "value": _finite(fixed.get(name, axes.get(name, [quantity.default])[0])),
                # None of what must be given; of others, infinite by null.
                **({} if quantity.default is None else {"default": _finite(quantity.default)}),
                "least": _finite(quantity.minimum),
                "most": _finite(quantity.maximum),
                "allowed": quantity.allowed,
                "known": name in KNOWN or name in starts,
            }
            for name in names
            if name not in hidden
            for quantity in [own.get(name, ALL[name])]
            for unit in [units.get(name, shown_unit(quantity.units, si))]
        ],
        "draws": plan.labels,
        "draw": at.get("draw", 0),
        "follow": {name: sorted(axes[name]) for name in study["follow"]},
        "direction": at.get("direction", "up"),
        "steady": steady,
        "si": si,
        "forcing": force,
        "forces": FORCES,
        "masses": masses_of(cube).get("masses", 1),
        "tables": len(masses_of(cube).get("tables", {})),
        "run": study["run"],
        "visible": Bursts(**study["observers"].get("bursts", {})).threshold,
    }


def _shown_in(units: str) -> dict[str, Any]:
    """Units in which the page shows a quantity, and what it multiplies it by: lengths in mm."""
    milli = units in ("m", "m/s")
    scale = 1e3 if milli else 1.0 / own_number(1.0, units)
    return {"units": f"m{units}" if milli else units, "scale": scale}


def _finite(value: float | None) -> float | None:
    return None if value is None or math.isinf(value) else value


def _units(attributes: Mapping[str, Any]) -> str:
    units = units_of(attributes)
    return "" if units == "1" else units


def _map(
    place: Any, variable: str, classes: Sequence[tuple[str, str]], dims: Sequence[str]
) -> dict[str, Any]:
    array = place[variable]
    return {
        "kind": "map",
        "classes": classes,
        "colours": ABOUT_ONE if variable in RATIOS else [],
        "label": array.attrs.get("long_name", variable),
        "units": _units(array.attrs),
        "values": packed(numbers(array, *dims), "f4"),
    }


def _touched(
    place: Any, variable: str, touched: Any, settings: Mapping[str, Any], dims: Sequence[str]
) -> dict[str, Any]:
    """Where no wall is touched, and the best row of each column, 0 for none, from 1."""
    contacts = numbers(touched, *dims)
    shown = {"idle": packed(np.where(contacts == 0.0, 1, 0), "u1")}
    if not settings.get("best"):
        return shown
    known = np.where(contacts > 0.0, numbers(place[variable], *dims), np.nan)
    own = variable if variable in RATIOS else "amplitude_ratio"
    ratios = numbers(place[own], *dims) if own in place else np.zeros(known.shape)
    panels = [values.reshape(-1, *known.shape[-2:]) for values in (known, ratios)]
    best = [
        best_places(values, ratio, settings["best"]) + 1
        for values, ratio in zip(*panels, strict=True)
    ]
    return shown | {"best": packed(np.concatenate(best), "u2")}


def _diagram(place: Any, names: Sequence[str], dims: Sequence[str]) -> dict[str, Any]:
    chatter = numbers(place.chatter, *dims) if "chatter" in place else None
    return {
        "kind": "bifurcation",
        "variables": [_columns(place[name], dims) for name in names],
        "chatter": None if chatter is None else packed(np.nan_to_num(chatter), "u1"),
    }


def _columns(array: Any, dims: Sequence[str]) -> dict[str, Any]:
    """Return the dots over each place of the abscissa: their number and their values."""
    log = array.name in LOGARITHMIC
    columns = array.transpose(*dims, ...).values
    columns = columns.reshape(math.prod(array.sizes[dim] for dim in dims), -1)
    known = np.isfinite(columns) & ((columns > 0.0) | (not log))
    heights = np.log(np.where(known, columns, 1.0)) if log else np.where(known, columns, 0.0)
    near = _NEAR * (np.ptp(heights[known]) if known.any() else 1.0) or 1.0
    dots = []
    for column, height, found in zip(columns, heights, known, strict=True):
        _, first = np.unique(np.round(height[found] / near), return_index=True)
        dots.append(column[found][np.sort(first)[:_DOTS]])
    return {
        "name": str(array.name).replace("_", " "),
        # Over the clearance; no symbol beside it says so, as in the printed figure.
        "units": "d" if array.name == "relative_displacement" else _units(array.attrs),
        "log": log,
        "line": array.ndim == len(dims),
        "counts": packed([len(column) for column in dots], "u2"),
        "values": packed(np.concatenate(dots), "f4"),
    }


def packed(values: Any, kind: str) -> str:
    """Return numbers as little-endian bytes in base 64."""
    return b64encode(np.ascontiguousarray(values, f"<{kind}").tobytes()).decode()


def script_of(path: str, data: Mapping[str, Any]) -> str:
    """Return a script that gives the data to the page: a page of a file may read no other file."""
    return f"damper.figures[{json.dumps(path)}] = {json.dumps(data, separators=(',', ':'))};\n"
