"""The ranking as a table: the best sets, what the statements pin down, where the preset stands."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import Field

from damper.papers.base import Tolerances
from damper.papers.calibration.ranking import JOINED, Ranking, rank
from damper.papers.calibration.settings import Scores
from damper.papers.statements import SCORES
from damper.study.fields import Number
from damper.tables import About, markdown_table, remarks

if TYPE_CHECKING:
    import xarray as xr

#: A statement holds from this score on: a deviation by its tolerance.
HOLDS = 0.5
#: Sets in the Markdown; the CSV has as many as the settings say.
_SHOWN = 15


class RankingTable(Scores):
    """The sets of parameters in the order of their scores, and what the statements pin down."""

    rows: Annotated[
        int,
        Number(ge=1, le=100_000, whole=True),
        Field(description="How many of the best sets the CSV lists."),
    ] = 200


def make(cube: xr.Dataset, settings: Mapping[str, Any], about: About) -> tuple[str, str]:
    """Rank the sets of parameters; see `damper.tables.make`."""
    found = ranked(cube, settings)
    doubled = None
    if any(SCORES[name].tolerant for name in found.own):
        tolerances = {key: 2.0 * settings[key] for key in settings if key.endswith("_tolerance")}
        doubled = ranked(cube, {**settings, **tolerances})
    rows = list(_rows(found, settings["rows"]))
    return _to_csv(rows), _to_markdown(found, doubled, rows, settings, about)


def ranked(cube: xr.Dataset, settings: Mapping[str, Any]) -> Ranking:
    """Rank the sets of a cube as the settings of a ranking or of profiles ask for.

    Parameters
    ----------
    cube : xarray.Dataset
    settings : mapping
        `statements`; `also` with the cubes of the studies it names; the tolerances.

    Returns
    -------
    Ranking
    """
    tolerances = Tolerances(
        settings["onset_tolerance"], settings["duration_tolerance"], settings["ratio_tolerance"]
    )
    return rank(cube, settings["statements"], settings.get("also"), tolerances)


def holding(found: Ranking) -> xr.DataArray:
    """Tell in which sets every statement holds."""
    names = [name for name in found.scores if name != JOINED]
    return (found.scores[names].to_array() >= HOLDS).all("variable")


def _rows(found: Ranking, count: int) -> Iterator[dict[str, Any]]:
    """Yield the best sets: parameters, scores, measured values, the best of free parameters."""
    for number, place in enumerate(found.places(found.order()[:count]), start=1):
        here = found.scores.sel(place)
        scores = {JOINED: float(here[JOINED])}
        scores |= {str(name): float(here[name]) for name in here if name != JOINED}
        free = {
            f"{name}: best {axis}": _number(where, place)
            for name, axes in found.freed.items()
            for axis, where in axes.items()
        }
        measured = {text: _number(array, place) for text, array in found.measured.items()}
        yield {"rank": number, **place, **scores, **measured, **free}


def _number(array: xr.DataArray, place: Mapping[str, Any]) -> float:
    return float(array.sel({name: place[str(name)] for name in array.dims}))


def _to_csv(rows: list[dict[str, Any]]) -> str:
    text = io.StringIO()
    table = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    table.writeheader()
    table.writerows(
        {key: f"{value:.10g}" if isinstance(value, float) else value for key, value in row.items()}
        for row in rows
    )
    return text.getvalue()


def _to_markdown(
    found: Ranking,
    doubled: Ranking | None,
    rows: list[dict[str, Any]],
    settings: Mapping[str, Any],
    about: About,
) -> str:
    scored = (
        "Score 1: as stated; from 1/2 on a statement holds; joined: the geometric mean. The "
        "statements are those of the papers in our words; how each is scored is ours "
        "(docs/calibration.md)."
    )
    together = f"Together: all hold in {_of(int(holding(found).sum()), found.sets)}"
    if doubled:
        scored += (
            f" Tolerances: onset {settings['onset_tolerance']:g} sqrt(M/K), duration "
            f"{settings['duration_tolerance']:g} sqrt(M/K), ratio of durations "
            f"{settings['ratio_tolerance']:g}."
        )
        count = int(holding(doubled).sum())
        together += f"; with all tolerances doubled in {_of(count, doubled.sets)}"
    lines = [
        f"# {about.title}: ranking",
        "",
        scored,
        "",
        *_each_statement(found, settings.get("preset")),
        "",
        f"{together}.",
        *_preset(found, settings.get("preset")),
        "",
        "## What is pinned down",
        "",
        "Values at which, with the best of everything else, the score is 1/2 or more.",
        "",
        *_pinned(found, doubled),
        "",
        "## The best sets",
        "",
        *_best(found, rows[:_SHOWN]),
        *remarks(about),
    ]
    return "\n".join(lines) + "\n"


def _each_statement(found: Ranking, preset: Mapping[str, float] | None) -> list[str]:
    rows = []
    for name, array in found.own.items():
        sets = f"{int((array >= HOLDS).sum())} of {array.size}"
        row = [name, SCORES[name].text, sets, _short(float(array.max()))]
        if preset:
            here = {axis: value for axis, value in preset.items() if axis in array.dims}
            row.append(_short(float(array.sel(here).max())))
        rows.append(row)
    heads = ["statement", "in our words", "holds in (sets)", "best score"]
    return markdown_table([*heads, "preset"] if preset else heads, rows)


def _preset(found: Ranking, preset: Mapping[str, float] | None) -> list[str]:
    if not preset:
        return []
    here = {axis: value for axis, value in preset.items() if axis in found.scores.dims}
    number, best = found.rank(here)
    text = ", ".join(f"{axis} = {value:g}" for axis, value in preset.items())
    return [
        "",
        f"The preset ({text}) has the joined score {_short(best)} and is number "
        f"{_of(number, found.sets)}.",
    ]


def _pinned(found: Ranking, doubled: Ranking | None) -> list[str]:
    scores = found.scores
    names = list(found.own)
    together = [holding(ranking).astype(float) for ranking in (found, doubled) if ranking]
    heads = ["parameter", *names, "all hold", "all hold, tolerances doubled"]
    rows = []
    for axis in scores[JOINED].dims:
        row = [str(axis).replace("_", " ")]
        for array in (*(found.own[name] for name in names), *together):
            if axis not in array.dims:
                row.append("")
                continue
            profile = array.max([dim for dim in array.dims if dim != axis])
            row.append(_values(profile[axis].values[profile.values >= HOLDS], profile.size))
        rows.append(row)
    return markdown_table(heads[: 1 + len(names) + len(together)], rows)


def _values(values: np.ndarray, count: int) -> str:
    """Write which values of an axis are left."""
    if not len(values):
        return "none"
    if len(values) == count:
        return "any"
    if values.dtype.kind == "U" or len(values) <= 2:
        return ", ".join(_short(value) for value in values.tolist())
    return f"{_short(min(values))} to {_short(max(values))} ({len(values)} of {count})"


def _best(found: Ranking, rows: list[dict[str, Any]]) -> list[str]:
    heads = list(rows[0])
    body = [[_short(row[head]) for head in heads] for row in rows]
    return markdown_table([head.replace("_", " ") for head in heads], body)


def _short(value: Any) -> str:
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:.4g}"
    return str(value)


def _of(some: int, of_all: int) -> str:
    part = some / of_all
    return (
        f"{some} of {of_all} sets ({part:.2g} of them)"
        if part < 0.01
        else (f"{some} of {of_all} sets ({part:.1%})")
    )
