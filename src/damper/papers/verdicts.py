"""Verdicts on the papers' statements, computed from cubes, as CSV and Markdown.

A verdict belongs to the values of the studies it was computed from, most of which are assumed
because the papers' own are lost.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import xarray as xr

from damper.papers.base import UNTESTED, Statement, Verdict
from damper.papers.statements import STATEMENTS
from damper.tables import markdown_table

_HEADS = (
    "claim",
    "statement",
    "where",
    "stated",
    "found",
    "verdict",
    "why",
    "assumptions",
    "figures",
)


@dataclass(frozen=True)
class Judged:
    """A statement with its verdict and the values that it rests on."""

    statement: Statement
    verdict: Verdict
    assumptions: str


def judge(cubes: Mapping[str, xr.Dataset]) -> list[Judged]:
    """Judge every statement.

    Parameters
    ----------
    cubes : mapping of str to xarray.Dataset
        Study -> cube. A statement whose studies are not all there is not tested.
    """
    found = []
    for statement in STATEMENTS:
        missing = [name for name in statement.studies if name not in cubes]
        if missing:
            words = "the configuration has no study " + ", ".join(missing)
            found.append(Judged(statement, Verdict("", UNTESTED, words), ""))
            continue
        used = {name: cubes[name] for name in statement.studies}
        found.append(Judged(statement, statement.judge(used), assumptions(used.values())))
    return found


def assumptions(cubes: Iterable[xr.Dataset]) -> str:
    """Values that the papers' texts do not state, as the cubes note them."""
    parts: dict[str, str] = {}
    for cube in cubes:
        for name, coordinate in cube.coords.items():
            if "assumed" in coordinate.attrs:
                parts.setdefault(f"{name} {_values(coordinate)}", "")
        for name in cube.attrs:
            if name.startswith("assumed_"):
                parts.setdefault(_attribute(cube, name), "")
    return ", ".join(parts)


def to_csv(found: Sequence[Judged]) -> str:
    """Write one line per statement; `figures` are below the folder of results, without suffix."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_HEADS)
    for item in found:
        statement, verdict = item.statement, item.verdict
        writer.writerow(
            [
                statement.name,
                statement.text,
                statement.where,
                statement.stated,
                "; ".join([verdict.found, *(", ".join(row) for row in verdict.numbers)]),
                verdict.verdict,
                verdict.why,
                item.assumptions,
                " ".join(statement.figures),
            ]
        )
    return text.getvalue()


def to_markdown(found: Sequence[Judged], made: Collection[str]) -> str:
    """Write a summary, then every statement in full.

    Parameters
    ----------
    found : sequence of Judged
    made : collection of str
        Figures that there are, below the folder of results and without suffix; others are not
        linked.
    """
    lines = [
        "# What the two papers state, and whether it holds",
        "",
        "The statements are in our words; what follows *stated* stands in the papers' texts, at "
        "the place in brackets. "
        "Both texts lost their formulas and parameter values, so a verdict is for the assumed "
        "values below it, and changes with them. It is computed from the cubes of the studies.",
        "",
        *markdown_table(
            ["", "statement", "verdict"],
            [[i.statement.name, i.statement.text, sentence(i)] for i in found],
        ),
    ]
    for item in found:
        statement, verdict = item.statement, item.verdict
        lines += [
            "",
            f"## {statement.name}: {statement.text}",
            "",
            f"- Stated: {statement.stated} ({statement.where})",
        ]
        if verdict.found:
            lines.append(f"- Found: {verdict.found}")
        lines.append(f"- Verdict: **{verdict.verdict}**: {verdict.why}")
        if item.assumptions:
            lines.append(f"- Assumed: {item.assumptions}")
        links = [
            f"[{path.rpartition('/')[2]}]({path}.png)" for path in statement.figures if path in made
        ]
        if links:
            lines.append(f"- Shown by: {', '.join(links)}")
        if verdict.numbers:
            lines += ["", *markdown_table(verdict.numbers[0], verdict.numbers[1:])]
    return "\n".join(lines) + "\n"


def sentence(item: Judged) -> str:
    """Verdict, and why."""
    return f"{item.verdict.verdict}: {item.verdict.why}"


def _values(coordinate: xr.DataArray) -> str:
    values = coordinate.values.reshape(-1)
    if values.size > 5:
        return f"{values.min():g} to {values.max():g}"
    return ", ".join(f"{value:g}" for value in values)


def _attribute(cube: xr.Dataset, name: str) -> str:
    quantity = name.removeprefix("assumed_").replace("_", " ")
    comment = cube.chatter.attrs.get("comment", "") if "chatter" in cube else ""
    visible = comment.rpartition("visible: ")[2]
    return f"{quantity}: {visible}" if visible and "threshold" in name else quantity
