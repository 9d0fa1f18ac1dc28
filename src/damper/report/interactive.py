"""An interactive figure of the page: its values, and the motion at some hundred of its points.

A motion is kept as the segments of its last periods, which the page evaluates in closed form
(``workflow/report/page.js``): exact at any zoom, and smaller than samples of four quantities.
"""

from __future__ import annotations

import json
import math
from base64 import b64encode
from collections.abc import Mapping, Sequence
from itertools import product as combinations
from typing import Any

import numpy as np

from damper.analysis.places import in_millimetres
from damper.engine.impact import restitution_at
from damper.engine.segment import STICKING
from damper.figures.bifurcation import LOGARITHMIC, with_relative
from damper.figures.common.layout import geometric, numbers, select
from damper.figures.common.style import LONG_NAMES, RATIOS
from damper.figures.map import ABOUT_ONE, classified
from damper.models import law_of
from damper.observers.motion import ObservedMotion, in_words
from damper.parameters.dampers import BASIC, need_known
from damper.parameters.quantities import is_si
from damper.parameters.units import LENGTH, SPEED, TIME, units_of
from damper.sweep.branches import branches
from damper.sweep.grid import product
from damper.sweep.points import Point, read_point
from damper.sweep.record import force_of
from damper.sweep.runs import run_points

#: What of each motion is kept, and of how many points of a figure, at least two along an axis.
STRETCH = {"periods": 3, "rows": 150}
MOST_RUNS = 240
#: Samples of one column that are nearer than this part of the panel's height are one dot; and most
#: dots of a column.
_NEAR, _DOTS = 5e-4, 40
_FIELDS = (
    "time",
    "displacement",
    "velocity",
    "gap",
    "gap_rate",
    "completion",
    "side",
    "mode",
)
#: Of a burst with fewer than five visible impacts the motion may name a complete sequence.
_CHATTER = ("no visible chatter", "incomplete chatter", "complete chatter")
#: Variables with a place of their own, or of no interest to a reader of one run.
_ELSEWHERE = ("status", "chatter", "energy_residual")
_BRANCHES = ("direction", "draw")


def interactive(cube: Any, settings: Mapping[str, Any], study: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the page needs of a figure, as JSON can hold it.

    Parameters
    ----------
    cube : xarray.Dataset
    settings : mapping
        Of the figure, a bifurcation diagram or a map.
    study : mapping
        ``fixed`` and ``axes`` with their values, ``primary``, ``draws``, ``follow``, and ``run``,
        the settings of every run.
    """
    at = settings.get("at") or {}
    choices = [settings[role] for role in ("each", "rows", "panels") if role in settings]
    if settings["kind"] == "map":
        x, y = settings["x"], settings["y"]
        place, variable, _, classes = classified(cube, settings, x, y, *choices)
        place = in_millimetres(place)
        # Colours are of all these runs, a click shows one.
        overlaid = [*settings.get("worst", ()), *settings.get("share", ())]
        shown = _map(place[variable], classes, [*choices, y, x])
    else:
        x, y = settings["along"], None
        cube = with_relative(cube, settings["variables"])
        variables = [name for name in settings["variables"] if name in cube]  # not of orbits
        names = [name for name in (*variables, "chatter") if name in cube]
        own = [dim for dim in (*_BRANCHES, "sample", "impact") if dim in cube[names].dims]
        keep = [dim for dim in own if dim not in at]
        place = in_millimetres(select(cube, names, at, (x, *choices, *keep)).sortby(x))
        overlaid = [dim for dim in _BRANCHES if dim in keep]
        shown = _diagram(place, variables, [*choices, *overlaid, x])
    order = [*choices, *overlaid, *([y] if y else []), x]
    few = MOST_RUNS / math.prod(cube.sizes[name] for name in (*choices, *overlaid))
    most = max(2, round(few ** (0.5 if y else 1.0)))
    kept = {name: _spread(place.sizes[name], most) for name in (y, x) if name}
    # As the cube has them: the place may be in millimetres.
    values = {name: cube[name].values.tolist() for name in order}
    values |= {name: [sorted(values[name])[k] for k in kept[name]] for name in kept}
    return shown | {
        "axes": [
            _axis(place if name in place.dims else cube, name, kept.get(name)) for name in order
        ],
        "overlaid": overlaid,
        "measured": _measured(cube, values, at),
        **_runs(cube, values, at, study),
    }


def _axis(place: Any, name: str, kept: Sequence[int] | None) -> dict[str, Any]:
    array = place[name]
    values = array.values.tolist()
    label = LONG_NAMES.get(name, name)
    described = {"name": name, "label": label, "units": _units(array.attrs), "values": values}
    log = geometric(array.values) if kept else False
    return described | {"kept": kept, "log": log}


def _units(attributes: Mapping[str, Any]) -> str:
    units = units_of(attributes)
    return "" if units == "1" else units


def _spread(size: int, most: int) -> list[int]:
    """At most so many places from the first to the last, as evenly as they lie."""
    return sorted({round(place) for place in np.linspace(0, size - 1, min(size, most))})


def _map(array: Any, classes: Sequence[tuple[str, str]], dims: Sequence[str]) -> dict[str, Any]:
    return {
        "kind": "map",
        "classes": classes,
        "colours": ABOUT_ONE if array.name in RATIOS else [],
        "label": array.attrs.get("long_name", str(array.name)),
        "units": _units(array.attrs),
        "values": packed(numbers(array, *dims), "f4"),
    }


def _diagram(place: Any, names: Sequence[str], dims: Sequence[str]) -> dict[str, Any]:
    chatter = numbers(place.chatter, *dims) if "chatter" in place else None
    return {
        "kind": "bifurcation",
        "variables": [_columns(place[name], dims) for name in names],
        "chatter": None if chatter is None else packed(np.nan_to_num(chatter), "u1"),
    }


def _columns(array: Any, dims: Sequence[str]) -> dict[str, Any]:
    """All that lies over each place of the abscissa: how many dots, and where."""
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


def _at(data: Any, values: Mapping[str, list[Any]], at: Mapping[str, Any]) -> Any:
    """Part of a cube, or of a variable, at the product of these values."""
    place = data.sel({n: v for n, v in {**at, **values}.items() if n in data.dims})
    return place.squeeze([dim for dim in place.dims if dim not in values])


def _measured(
    cube: Any, values: Mapping[str, list[Any]], at: Mapping[str, Any]
) -> list[dict[str, Any]]:
    """What the cube has with one value at each of the points."""
    names = [name for name, array in cube.data_vars.items() if array.dims == cube.status.dims]
    place = _at(cube[[name for name in names if name not in _ELSEWHERE]], values, at)
    return [
        {
            "label": array.attrs.get("long_name", name),
            "units": _units(array.attrs),
            "values": packed(numbers(array, *values), "f4"),
        }
        for name, array in in_millimetres(place).data_vars.items()
    ]


def _runs(
    cube: Any, values: Mapping[str, list[Any]], at: Mapping[str, Any], study: Mapping[str, Any]
) -> dict[str, Any]:
    """Motions at the product of these values, the last one fastest."""
    axes = dict(study["axes"])
    for name in axes.keys() - study["follow"].keys():  # one that is followed needs the neighbours
        axes[name] = [at[name]] if name in at else values.get(name, axes[name])
    fixed = {**study["fixed"], **force_of(cube)}
    plan = branches(product(axes, fixed), axes, study["draws"], study["follow"])
    runs, _ = run_points(
        plan.points,
        {"segments": STRETCH, "motion": {}},
        primary=study["primary"],
        predecessor=plan.predecessor,
        **study["run"],
    )
    sides = list(combinations(*plan.dimensions.values()))
    numbers_of = {}
    for number, point in enumerate(plan.points):
        side = dict(zip(plan.dimensions, sides[number % len(sides)], strict=True))
        place = {**point, **side}
        if all(place.get(name) == value for name, value in at.items()):
            numbers_of[tuple(place[name] for name in values)] = number
    wanted = [numbers_of[place] for place in combinations(*values.values())]
    si = is_si(plan.points[0])
    chatter = [None] * len(wanted)
    if "chatter" in cube:
        chatter = numbers(_at(cube.chatter, values, at), *values).ravel().tolist()
    return {
        "run_units": ["mm", "s", "mm/s"] if si else [LENGTH, TIME, SPEED],
        "runs": [
            _run(read_point(plan.points[number]), runs, number, kind, 1e3 if si else 1.0)
            for number, kind in zip(wanted, chatter, strict=True)
        ],
    }


def _run(
    point: Point, runs: Mapping[str, np.ndarray], number: int, chatter: float | None, scale: float
) -> dict[str, Any]:
    p, law = point.parameters, law_of(point.parameters)
    need_known(p, (*BASIC, "yield_speed"), "the page")
    used = np.isfinite(runs["segment_time"][number])
    row = {name: runs[f"segment_{name}"][number][used] for name in _FIELDS}
    rows = [row["time"], row["displacement"], row["velocity"], row["gap_rate"]]
    # The rest of a burst has a completion time and no gap; side and mode are whole numbers.
    rows += [row["gap"] + row["completion"], 3.0 * row["mode"] + row["side"] + 1.0]
    return {
        "mass_ratio": p.mass_ratio,
        "damping_ratio": p.damping_ratio,
        "frequency_ratio": p.frequency_ratio,
        "phase": p.phase,
        "clearance": p.clearance,
        "restitution": restitution_at(law, 0.0),
        "length": scale * point.units.length,
        "time": point.units.time,
        "end": STRETCH["periods"] * p.cycle,
        "class": _class(runs, number, bool((row["mode"] == STICKING).all()), chatter),
        "rows": packed(rows, "f8"),
    }


def _class(runs: Mapping[str, np.ndarray], number: int, stuck: bool, chatter: float | None) -> str:
    """Say in words what motion it is."""
    if runs["status"][number]:
        return "the run stopped early"
    words = [] if chatter is None else [_CHATTER[int(chatter)]]
    words.append(in_words({v.name: runs[v.name][number] for v in ObservedMotion.variables}))
    return "; ".join([*words, "sticking throughout"] if stuck else words)


def packed(values: Any, kind: str) -> str:
    """Return numbers as little-endian bytes in base 64."""
    return b64encode(np.ascontiguousarray(values, f"<{kind}").tobytes()).decode()


def script_of(path: str, data: Mapping[str, Any]) -> str:
    """Return a script that gives the data to the page: a page of a file may read no other file."""
    return f"damper.figures[{json.dumps(path)}] = {json.dumps(data, separators=(',', ':'))};\n"
