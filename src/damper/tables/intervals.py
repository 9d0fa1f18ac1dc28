"""The intervals of one axis in which a study chatters, and how they move with the threshold."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Annotated, Any, ClassVar

from pydantic import Field

from damper.analysis import intervals
from damper.analysis.labels import label_of
from damper.analysis.places import places, rows_at
from damper.parameters.lazy import pd, xr
from damper.parameters.variables import CHATTER_IMPACTS
from damper.study.fields import Pair, Text
from damper.study.messages import Mistakes
from damper.study.products import Product, Role, StudyContents, require_one_run
from damper.tables import Table, place_cells, with_units

_HEADING = "## Chatter beside the stated range, {:g} to {:g}"


class Intervals(Product):
    """The intervals of one axis in which bursts are chatter."""

    needs = ("bursts",)
    runs_more = True
    roles: ClassVar[Mapping[str, Role]] = {"along": Role(least=3)}

    along: Annotated[Text, Field(description="Axis on which the intervals lie.")]
    resolution: Annotated[
        float,
        Field(
            gt=0,
            description="How closely the ends of the intervals are found, in units of the axis.",
        ),
    ] = 1e-3
    stated: Annotated[
        Pair[float] | None,
        Field(description="Range that the source states, to compare with where chatter is found."),
    ] = None

    def check_against(self, study: StudyContents, mistakes: Mistakes) -> None:
        super().check_against(study, mistakes)
        require_one_run(study, mistakes, bisected="edges")


def make(results: Mapping[str, Any], settings: Intervals) -> Table:
    """Show the intervals of chatter along an axis."""
    cube = results["cube"]
    along = settings.along
    data = intervals.chatter_intervals(cube, along, settings.resolution)
    visible = intervals.thresholds(cube)
    main = next(iter(visible))
    where = places(cube.chatter, along)
    sure = data[["lower_survives", "upper_survives"]].all(axis=None)
    chance = (
        " `~`: an edge that is chance, because motion there is chaotic: the runs on its sides "
        f"change when the {label_of(along)} is shifted by parts of {intervals.SHIFTS[0]:.0e} to "
        f"{intervals.SHIFTS[-1]:.0e}."
    )
    body: list[str | pd.DataFrame] = [
        f"Chatter: at least {CHATTER_IMPACTS} visible impacts in one burst (threshold {main}). "
        "Complete: such a burst ends in sticking. Any: complete or not. Edges are the outermost "
        f"values with chatter, bisected to {settings.resolution:g}. `+`: the interval reaches "
        "the end of the axis. Intervals narrower than two grid steps are counted here and listed "
        "in the CSV file." + ("" if sure else chance)
    ]
    if stopped := int((cube.status != 0).sum()):
        body.append(f"{stopped} points stopped early (`status` in the cube): without chatter here.")
    ends: dict[str, Any] = {
        "along": along,
        "digits": max(3, math.ceil(-math.log10(settings.resolution))),
    }
    columns = [(p, p, main) for p in intervals.PREDICATES]
    body.append(_table(cube, data, where, columns, partial(_intervals, **ends)))
    if settings.stated:
        body += [_HEADING.format(*settings.stated), _agreement(cube, where, along, settings.stated)]
    # Fractions only: an absolute speed is not on their scale.
    fractions = sorted((value, name) for name, value in visible.items() if isinstance(value, float))
    compared = [name for _, name in fractions]
    if len(compared) > 1:
        spans = intervals.hulls(data, along)
        columns = [(f"{p}, {name}", p, name) for p in intervals.PREDICATES for name in compared]
        body += [
            "## How the intervals move with the visibility threshold",
            "Lowest to highest value with chatter, narrow intervals left out. "
            "Gaps between several intervals do not show.",
            _table(cube, spans, where, columns, partial(_hull, **ends)),
            "\n".join(_moves(data, compared[0], compared[-1], len(where), **ends)),
        ]
    words = with_units(label_of(along), cube[along])
    return Table.of(cube, f"chatter intervals in {words}", data, body)


def _table(
    cube: xr.Dataset,
    found: pd.DataFrame,
    where: Sequence[Mapping[str, float]],
    columns: Sequence[tuple[str, str, str]],
    cell: Callable[[pd.DataFrame], str],
) -> pd.DataFrame:
    """A row for each place, a column for each heading, predicate and threshold."""
    rows = []
    for place in where:
        here = rows_at(found, place)
        row = place_cells(place, cube)
        for head, predicate, name in columns:
            row[head] = cell(rows_at(here, {"chatter": predicate, "threshold": name}))
        rows.append(row)
    return pd.DataFrame(rows)


def _agreement(
    cube: xr.Dataset, where: Sequence[Mapping[str, float]], along: str, stated: tuple[float, float]
) -> pd.DataFrame:
    """Say at how many values chatter is found within a range and outside it."""
    rows = []
    for place in where:
        found = intervals.chatter_in_range(cube.sel(place), along, *stated)
        row = place_cells(place, cube)
        for head, key in (("in the range", "in_range"), ("outside", "outside")):
            row[f"values with chatter {head}"] = f"{found['chatter_' + key]} of {found[key]}"
        ends = f"{found['lowest']:g}, {found['highest']:g}"
        row["outermost ones"] = "none" if math.isnan(found["lowest"]) else ends
        rows.append(row)
    return pd.DataFrame(rows)


def _intervals(found: pd.DataFrame, along: str, digits: int) -> str:
    wide = found[~found["narrow"]]
    parts = [
        span + "+" * cut for span, cut in zip(_spans(wide, along, digits), wide["cut"], strict=True)
    ]
    parts += [f"{len(found) - len(wide)} narrow"] if len(found) > len(wide) else []
    return ", ".join(parts) or "none"


def _hull(found: pd.DataFrame, along: str, digits: int) -> str:
    return ", ".join(_spans(found, along, digits)) or "none"


def _spans(found: pd.DataFrame, along: str, digits: int) -> list[str]:
    """Return each interval with its edges, those marked that are chance."""
    ends = (
        found[f"{end}_survives"].map({True: "", False: "~"})
        + found[f"{along}_{end}"].map(f"{{:.{digits}f}}".format)
        for end in ("lower", "upper")
    )
    return [f"{lower}–{upper}" for lower, upper in zip(*ends, strict=True)]


def _moves(
    found: pd.DataFrame, low: str, high: str, places: int, along: str, digits: int
) -> Iterator[str]:
    """Say how far the edges move from the smallest to the largest threshold."""
    moves = intervals.edge_moves(found, along, low, high)
    for predicate in intervals.PREDICATES:
        here = rows_at(moves, {"chatter": predicate})
        both = here.dropna()
        gone = len(here) - len(both)
        text = f"- {predicate}, from {low} to {high}: "
        if len(both):
            lower, upper = (
                f"{both[end].min():+.{digits}f} to {both[end].max():+.{digits}f}"
                for end in ("lower", "upper")
            )
            text += (
                f"the lower edge moves by {lower}, the upper edge by {upper} "
                f"({len(both)} of {places} rows have intervals at both)"
            )
        else:
            text += "no row has intervals at both"
        yield text + (f"; in {gone} rows they vanish." if gone else ".")
