"""The ranking as a table: the best sets, what the statements pin down, where the preset stands."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from damper.analysis.labels import label_of
from damper.papers.base import Tolerances
from damper.papers.calibration.ranking import HOLDS, JOINED, Ranking, holding, rank
from damper.papers.calibration.settings import Scores
from damper.papers.statements import SCORES
from damper.parameters.lazy import pd, xr
from damper.tables import Table

#: Sets in the Markdown; the CSV has as many as the settings say.
_SHOWN = 15


class RankingTable(Scores):
    """The sets of parameters in the order of their scores, and what the statements pin down."""

    rows: Annotated[
        int, Field(ge=1, le=100_000, description="How many of the best sets the CSV lists.")
    ] = 200


def make(results: Mapping[str, Any], settings: RankingTable) -> Table:
    """Rank the sets of parameters."""
    cube = results["cube"]
    statements, also, preset = settings.statements, settings.others(results), settings.preset
    found = rank(cube, statements, also)
    scored = (
        "Score 1: as stated; from 1/2 on a statement holds; joined: the geometric mean. The "
        "statements are those of the papers in our words; how each is scored is ours "
        "(docs/calibration.md)."
    )
    together = f"Together: all hold in {_of(int(holding(found).sum()), found.sets)}"
    doubled = None
    if any(SCORES[name].tolerant for name in found.own):
        usual = Tolerances()
        doubled = rank(cube, statements, also, usual.doubled)
        scored += (
            f" Tolerances: onset {usual.onset:g} sqrt(M/K), duration {usual.duration:g} sqrt(M/K), "
            f"ratio of durations {usual.ratio:g}."
        )
        count = int(holding(doubled).sum())
        together += f"; with all tolerances doubled in {_of(count, doubled.sets)}"
    data = pd.DataFrame(_rows(found, settings.rows))
    best = data.head(_SHOWN).map(_short)
    body = [
        scored,
        _each_statement(found, preset),
        f"{together}.",
        *([_preset(found, preset)] if preset else []),
        "## What is pinned down",
        "Values at which, with the best of everything else, the score is 1/2 or more.",
        _pinned(found, doubled),
        "## The best sets",
        best.rename(columns=label_of),
    ]
    return Table.of(cube, "ranking", data, body)


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


def _each_statement(found: Ranking, preset: Mapping[str, Any] | None) -> pd.DataFrame:
    rows = []
    for name, array in found.own.items():
        row = {
            "statement": name,
            "in our words": SCORES[name].text,
            "holds in (sets)": f"{int((array >= HOLDS).sum())} of {array.size}",
            "best score": _short(float(array.max())),
        }
        if preset:
            here = {axis: value for axis, value in preset.items() if axis in array.dims}
            row["preset"] = _short(float(array.sel(here).max()))
        rows.append(row)
    return pd.DataFrame(rows)


def _preset(found: Ranking, preset: Mapping[str, Any]) -> str:
    here = {axis: value for axis, value in preset.items() if axis in found.scores.dims}
    number, best = found.rank(here)
    text = ", ".join(f"{axis} = {value:g}" for axis, value in preset.items())
    return (
        f"The preset ({text}) has the joined score {_short(best)} and is number "
        f"{_of(number, found.sets)}."
    )


def _pinned(found: Ranking, doubled: Ranking | None) -> pd.DataFrame:
    columns = {**found.own, "all hold": holding(found).astype(float)}
    if doubled:
        columns["all hold, tolerances doubled"] = holding(doubled).astype(float)
    rows = []
    for axis in found.scores[JOINED].dims:
        row = {"parameter": label_of(str(axis))}
        for head, array in columns.items():
            row[head] = ""
            if axis in array.dims:
                profile = array.max([dim for dim in array.dims if dim != axis])
                left = profile[axis].values[profile.values >= HOLDS]
                row[head] = _values(left, profile.size)
        rows.append(row)
    return pd.DataFrame(rows)


def _values(values: np.ndarray, count: int) -> str:
    """Write which values of an axis are left."""
    if not len(values):
        return "none"
    if len(values) == count:
        return "any"
    if values.dtype.kind == "U" or len(values) <= 2:
        return ", ".join(_short(value) for value in values.tolist())
    return f"{_short(min(values))} to {_short(max(values))} ({len(values)} of {count})"


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
