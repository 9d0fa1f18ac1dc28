"""The interval table as CSV and Markdown."""

import csv
import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from damper.lanes import product
from damper.parameters import QUANTITIES
from damper.study.intervals import PREDICATES, ChatterAt, Interval, intervals


def chatter_intervals(
    cube: xr.Dataset,
    *,
    along: str,
    resolution: float,
    observer: Mapping[str, Any],
    settings: Mapping[str, Any],
) -> list[Interval]:
    """All intervals of complete and of any chatter along one axis of a cube.

    Parameters
    ----------
    cube : xarray.Dataset
        With `chatter`, and `chatter_by_threshold` if thresholds are compared.
    along : str
        Axis along which to look.
    resolution : float
        Edges are bisected to this distance.
    observer : mapping
        Settings of the bursts observer that made the cube.
    settings : mapping
        transient, periods, accuracy, max_events: as for the cube.

    Returns
    -------
    list of Interval
        Ordered by the other axes, threshold, predicate, place.
    """
    thresholds = [observer["threshold"], *observer.get("compare_thresholds", ())]
    names = [threshold_name(value) for value in thresholds]
    others = {name: cube[name].values.tolist() for name in cube.chatter.dims if name != along}
    scalars = {
        quantity.name: float(cube[quantity.name])
        for quantity in QUANTITIES
        if quantity.name not in cube.chatter.dims
    }
    order = np.argsort(cube[along].values)
    values = cube[along].values[order].tolist()
    found: list[Interval] = []
    for where in product(others, {}):
        place = cube.sel(where).isel({along: order})
        grid = [place.chatter.values]
        if len(names) > 1:
            grid += list(place.chatter_by_threshold.transpose("threshold", along).values)
        chatter_at = ChatterAt(along, scalars | where, thresholds, settings)
        for k, name in _without_repeats(names):
            for predicate, holds in PREDICATES.items():
                found += [
                    Interval(where, name, predicate, *interval)
                    for interval in intervals(
                        values,
                        grid[k],
                        holds,
                        lambda value, at=chatter_at, k=k: at(value)[k],
                        resolution,
                    )
                ]
    return found


def threshold_name(threshold: Any) -> str:
    """Threshold in words: `3 %` of the first approach speed, or `speed 0.01`."""
    if isinstance(threshold, Mapping):
        if "speed" in threshold:
            return f"speed {threshold['speed']:g}"
        threshold = threshold["fraction"]
    return f"{100.0 * threshold:g} %"


def _without_repeats(names: Sequence[str]) -> list[tuple[int, str]]:
    """Index and name of each different threshold: the main one is usually compared as well."""
    return [(k, name) for k, name in enumerate(names) if name not in names[:k]]


def to_csv(found: Sequence[Interval], along: str) -> str:
    """Write one line per interval."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    others = list(found[0].where) if found else []
    writer.writerow(
        [*others, "threshold", "chatter", f"{along}_lower", f"{along}_upper", "narrow", "cut"]
    )
    for item in found:
        edges = [f"{item.lower:.6g}", f"{item.upper:.6g}"]
        flags = [str(item.narrow).lower(), str(item.cut).lower()]
        place = [f"{value:g}" for value in item.where.values()]
        writer.writerow([*place, item.threshold, item.chatter, *edges, *flags])
    return text.getvalue()


def to_markdown(
    found: Sequence[Interval],
    *,
    title: str,
    along: str,
    resolution: float,
    observer: Mapping[str, Any],
    fixed: Mapping[str, float],
    assumed: Mapping[str, str],
    stopped: int = 0,
) -> str:
    """Write the table a person reads: main threshold, then how intervals move with it.

    `stopped` is the number of grid points whose run ended early; they count as without chatter.
    """
    main = threshold_name(observer["threshold"])
    thresholds = list(dict.fromkeys(item.threshold for item in found))
    places = list(dict.fromkeys(tuple(item.where.items()) for item in found))
    heads = [name.replace("_", " ") for name, _ in places[0]] if places else []
    lines = [f"# {title}: chatter intervals in {along.replace('_', ' ')}", ""]
    lines += [
        f"Chatter: at least five visible impacts in one burst (threshold {main}). "
        "Complete: such a burst ends in sticking. Any: complete or not.",
        f"Edges are the outermost values with chatter, bisected to {resolution:g}. "
        "`+`: the interval reaches the end of the axis. "
        "Intervals narrower than two grid steps (chaotic edges are not unique) are counted here "
        "and listed in the CSV file.",
        *(
            [
                f"{stopped} points stopped early (see `status` in the cube); they count as without "
                "chatter."
            ]
            if stopped
            else []
        ),
        "",
        "Fixed: " + ", ".join(f"{name} = {value:g}" for name, value in fixed.items()) + ".",
        "",
    ]
    rows = [
        [
            *(f"{value:g}" for _, value in place),
            *(
                _cell(
                    [
                        i
                        for i in found
                        if (*i.where.items(),) == place
                        and i.threshold == main
                        and i.chatter == predicate
                    ]
                )
                for predicate in PREDICATES
            ),
        ]
        for place in places
    ]
    lines += _table([*heads, *PREDICATES], rows)
    if len(thresholds) > 1:
        lines += ["", "## How the intervals move with the visibility threshold", ""]
        lines += [
            "Hull of the intervals that are not narrow: lowest to highest value with chatter.",
            "",
        ]
        ordered = sorted(thresholds, key=_size)
        columns = [(p, t) for p in PREDICATES for t in ordered]
        hulls = {
            (place, p, t): _hull(
                [
                    i
                    for i in found
                    if (*i.where.items(),) == place and i.threshold == t and i.chatter == p
                ]
            )
            for place in places
            for p, t in columns
        }
        rows = [
            [
                *(f"{value:g}" for _, value in place),
                *(_span(hulls[place, p, t]) for p, t in columns),
            ]
            for place in places
        ]
        lines += _table([*heads, *(f"{p}, {t}" for p, t in columns)], rows)
        lines += ["", *_moves(places, ordered, hulls)]
    if assumed:
        lines += ["", "## Assumed", ""]
        lines += ["These values are not stated in the source's text:", ""]
        lines += [f"- {name.replace('_', ' ')}: {reason}" for name, reason in assumed.items()]
    return "\n".join(lines) + "\n"


def _cell(found: Sequence[Interval]) -> str:
    wide = [f"{i.lower:.3f}–{i.upper:.3f}{'+' if i.cut else ''}" for i in found if not i.narrow]
    narrow = sum(i.narrow for i in found)
    parts = wide + ([f"{narrow} narrow"] if narrow else [])
    return ", ".join(parts) or "none"


def _hull(found: Sequence[Interval]) -> tuple[float, float] | None:
    wide = [i for i in found if not i.narrow]
    return (min(i.lower for i in wide), max(i.upper for i in wide)) if wide else None


def _span(hull: tuple[float, float] | None) -> str:
    return f"{hull[0]:.3f}–{hull[1]:.3f}" if hull else "none"


def _size(name: str) -> float:
    return float(name.removeprefix("speed ").removesuffix(" %"))


def _moves(
    places: Sequence[Any],
    thresholds: Sequence[str],
    hulls: Mapping[Any, tuple[float, float] | None],
) -> list[str]:
    """Say how far the edges move from the smallest to the largest threshold."""
    lines = []
    low, high = thresholds[0], thresholds[-1]
    for predicate in PREDICATES:
        both = [
            (a, b)
            for place in places
            if (a := hulls[place, predicate, low]) and (b := hulls[place, predicate, high])
        ]
        gone = sum(
            hulls[place, predicate, low] is not None and hulls[place, predicate, high] is None
            for place in places
        )
        text = f"- {predicate}, from {low} to {high}: "
        if both:
            lower = sorted(b[0] - a[0] for a, b in both)
            upper = sorted(b[1] - a[1] for a, b in both)
            text += (
                f"the lower edge moves by {lower[0]:+.3f} to {lower[-1]:+.3f}, "
                f"the upper edge by {upper[0]:+.3f} to {upper[-1]:+.3f} "
                f"({len(both)} of {len(places)} rows have intervals at both)"
            )
        else:
            text += "no row has intervals at both"
        lines.append(text + (f"; in {gone} rows they vanish." if gone else "."))
    return lines


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    return [
        "| " + " | ".join(heads) + " |",
        "|" + "---|" * len(heads),
        *("| " + " | ".join(row) + " |" for row in rows),
    ]
