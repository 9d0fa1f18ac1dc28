"""The interval table as CSV and Markdown."""

from __future__ import annotations

import csv
import io
from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import Field

from damper.analysis.intervals import PREDICATES, ChatterAt, Interval, intervals
from damper.parameters.quantities import ALL
from damper.study.fields import Faults, Number, Text
from damper.study.products import (
    Offer,
    Product,
    Role,
    fit_axis,
    need,
    need_one_run,
)
from damper.sweep.grid import product
from damper.tables import About, fixed_values, markdown_table, remarks

if TYPE_CHECKING:
    import xarray as xr


class Intervals(Product):
    """The intervals of one axis in which bursts are chatter."""

    along: Annotated[str, Text(), Field(description="Axis on which the intervals lie.")]
    resolution: Annotated[
        float,
        Number(gt=0),
        Field(description="How closely the ends of the intervals are found, in units of the axis."),
    ] = 1e-3

    @classmethod
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        need(offer, faults, "bursts")
        need_one_run(offer, faults, bisected="edges")
        fit_axis("along", Role(least=3), settings, offer, faults)


def make(cube: xr.Dataset, settings: Mapping[str, Any], about: About) -> tuple[str, str]:
    """Bisect the edges of all intervals and write them; see `damper.tables.make`."""
    along = settings["along"]
    observer = about.observers["bursts"]
    found = chatter_intervals(
        cube,
        along=along,
        resolution=settings["resolution"],
        observer=observer,
        settings=about.run,
    )
    where = places(cube, along)
    text = to_markdown(
        found,
        about,
        along=along,
        where=where,
        resolution=settings["resolution"],
        observer=observer,
        stopped=int((cube.status != 0).sum()),
    )
    return to_csv(found, along, where), text


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
    scalars = {
        name: float(cube[name])
        for name in ALL
        if name in cube.coords and name not in cube.chatter.dims
    }
    order = np.argsort(cube[along].values)
    values = cube[along].values[order].tolist()
    found: list[Interval] = []
    for where in places(cube, along):
        place = cube.sel(where).isel({along: order})
        grid = [place.chatter.values]
        if len(names) > 1:
            grid += list(place.chatter_by_threshold.transpose("threshold", along).values)
        chatter_at = ChatterAt(along, scalars | where, thresholds, settings)
        for k, name in _without_repeats(names):

            def one_at(value: float, at: ChatterAt = chatter_at, k: int = k) -> int:
                return at(value)[k]

            for predicate, holds in PREDICATES.items():
                found += [
                    Interval(where, name, predicate, *interval)
                    for interval in intervals(values, grid[k], holds, one_at, resolution)
                ]
    return found


def places(cube: xr.Dataset, along: str) -> list[dict[str, float]]:
    """Coordinates along all axes but one, in the order of a table's rows."""
    others = {name: cube[name].values.tolist() for name in cube.chatter.dims if name != along}
    return product(others, {})


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


def to_csv(found: Sequence[Interval], along: str, where: Sequence[Mapping[str, float]]) -> str:
    """Write one line per interval; `where` are the table's `places`."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    others = list(where[0])
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
    about: About,
    *,
    along: str,
    where: Sequence[Mapping[str, float]],
    resolution: float,
    observer: Mapping[str, Any],
    stopped: int = 0,
) -> str:
    """Write the table a person reads: main threshold, then how intervals move with it.

    `where` are the table's `places`; `stopped` is the number of grid points whose run ended
    early.
    """
    main = threshold_name(observer["threshold"])
    rows_at = [tuple(place.items()) for place in where]
    heads = [name.replace("_", " ") for name in where[0]]
    labels = {at: [f"{value:g}" for _, value in at] for at in rows_at}
    groups: dict[Any, list[Interval]] = defaultdict(list)
    for item in found:
        groups[tuple(item.where.items()), item.chatter, item.threshold].append(item)

    lines = [
        f"# {about.title}: chatter intervals in {along.replace('_', ' ')}",
        "",
        f"Chatter: at least five visible impacts in one burst (threshold {main}). "
        "Complete: such a burst ends in sticking. Any: complete or not.",
        f"Edges are the outermost values with chatter, bisected to {resolution:g}. "
        "`+`: the interval reaches the end of the axis. Intervals narrower than two grid steps "
        "(chaotic edges are not unique) are counted here and listed in the CSV file.",
    ]
    if stopped:
        lines.append(
            f"{stopped} points stopped early (`status` in the cube): without chatter here."
        )
    lines += [
        "",
        fixed_values(about),
        "",
        *markdown_table(
            [*heads, *PREDICATES],
            [[*labels[at], *(_cell(groups[at, p, main]) for p in PREDICATES)] for at in rows_at],
        ),
    ]

    # Fractions only: an absolute speed is not on their scale.
    fractions = [observer["threshold"], *observer.get("compare_thresholds", ())]
    sizes = {size for value in fractions if (size := _fraction(value)) is not None}
    compared = [threshold_name(size) for size in sorted(sizes)]
    if len(compared) > 1:
        columns = [(predicate, name) for predicate in PREDICATES for name in compared]
        hulls = {(at, *column): _hull(groups[at, *column]) for at in rows_at for column in columns}
        lines += [
            "",
            "## How the intervals move with the visibility threshold",
            "",
            "Lowest to highest value with chatter, narrow intervals left out. "
            "Gaps between several intervals do not show.",
            "",
            *markdown_table(
                [*heads, *(f"{predicate}, {name}" for predicate, name in columns)],
                [
                    [*labels[at], *(_span(hulls[at, *column]) for column in columns)]
                    for at in rows_at
                ],
            ),
            "",
            *_moves(rows_at, compared, hulls),
        ]
    lines += remarks(about)
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


def _fraction(threshold: Any) -> float | None:
    return threshold.get("fraction") if isinstance(threshold, Mapping) else threshold


def _moves(
    rows_at: Sequence[Any],
    thresholds: Sequence[str],
    hulls: Mapping[Any, tuple[float, float] | None],
) -> list[str]:
    """Say how far the edges move from the smallest to the largest threshold."""
    lines = []
    low, high = thresholds[0], thresholds[-1]
    for predicate in PREDICATES:
        both = [
            (a, b)
            for place in rows_at
            if (a := hulls[place, predicate, low]) and (b := hulls[place, predicate, high])
        ]
        gone = sum(
            hulls[place, predicate, low] is not None and hulls[place, predicate, high] is None
            for place in rows_at
        )
        text = f"- {predicate}, from {low} to {high}: "
        if both:
            lower = sorted(b[0] - a[0] for a, b in both)
            upper = sorted(b[1] - a[1] for a, b in both)
            text += (
                f"the lower edge moves by {lower[0]:+.3f} to {lower[-1]:+.3f}, "
                f"the upper edge by {upper[0]:+.3f} to {upper[-1]:+.3f} "
                f"({len(both)} of {len(rows_at)} rows have intervals at both)"
            )
        else:
            text += "no row has intervals at both"
        lines.append(text + (f"; in {gone} rows they vanish." if gone else "."))
    return lines
