"""Verdicts on the papers' statements, computed from cubes, as CSV and Markdown.

A verdict belongs to the values of the studies it was computed from, most of which are assumed
because the papers' own are lost.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from damper.analysis.labels import label_of
from damper.papers.base import UNTESTED, Statement, Verdict
from damper.papers.statements import STATEMENTS
from damper.parameters.lazy import pd, xr
from damper.tables import Table


@dataclass(frozen=True)
class Judged:
    """A statement with its verdict and the values that it rests on."""

    statement: Statement
    verdict: Verdict
    assumptions: str


def judge(cubes: Mapping[str, xr.Dataset]) -> list[Judged]:
    """Judge every statement by cubes of studies; without one of its studies it is not tested."""
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
                label = label_of(str(name))
                parts.setdefault(f"{label} {_values(coordinate)}", "")
        for name in cube.attrs:
            if name.startswith("assumed_"):
                parts.setdefault(_attribute(cube, name), "")
    return ", ".join(parts)


def table(found: Sequence[Judged], made: Collection[str] = ()) -> Table:
    """Make the table of verdicts: a summary, then every statement in full.

    `made` are the figures that there are, below the folder of results and without suffix; others
    are not linked.
    """
    summary = [(i.statement.name, i.statement.text, sentence(i)) for i in found]
    body: list[str | pd.DataFrame] = [
        "The statements are in our words; what follows *stated* stands in the papers' texts, at "
        "the place in brackets. "
        "Both texts lost their formulas and parameter values, so a verdict is for the assumed "
        "values below it, and changes with them. It is computed from the cubes of the studies.",
        pd.DataFrame(summary, columns=["", "statement", "verdict"]),
    ]
    for item in found:
        body += _in_full(item, made)
    return Table(
        "What the two papers state, and whether it holds", pd.DataFrame(map(_row, found)), body
    )


def _row(item: Judged) -> dict[str, str]:
    """One row of the CSV; figures are below the folder of results, without suffix."""
    statement, verdict = item.statement, item.verdict
    return {
        "claim": statement.name,
        "statement": statement.text,
        "where": statement.where,
        "stated": statement.stated,
        "found": verdict.found,
        "numbers": "\n".join(" | ".join(row) for row in verdict.numbers),
        "verdict": verdict.verdict,
        "why": verdict.why,
        "assumptions": item.assumptions,
        "figures": " ".join(statement.figures),
    }


def _in_full(item: Judged, made: Collection[str]) -> Iterator[str | pd.DataFrame]:
    statement, verdict = item.statement, item.verdict
    yield f"## {statement.name}: {statement.text}"
    links = [
        f"[{path.rpartition('/')[2]}]({path}.png)" for path in statement.figures if path in made
    ]
    lines = {
        "Stated": f"{statement.stated} ({statement.where})",
        "Found": verdict.found,
        "Verdict": f"**{verdict.verdict}**: {verdict.why}",
        "Assumed": item.assumptions,
        "Shown by": ", ".join(links),
    }
    yield "\n".join(f"- {name}: {text}" for name, text in lines.items() if text)
    if verdict.numbers:
        yield pd.DataFrame(verdict.numbers[1:], columns=list(verdict.numbers[0]))


def sentence(item: Judged) -> str:
    """Verdict, and why."""
    return f"{item.verdict.verdict}: {item.verdict.why}"


def _values(coordinate: xr.DataArray) -> str:
    values = coordinate.values.reshape(-1)
    if values.size > 5:
        return f"{values.min():g} to {values.max():g}"
    return ", ".join(f"{value:g}" for value in values)


def _attribute(cube: xr.Dataset, name: str) -> str:
    quantity = label_of(name.removeprefix("assumed_"))
    comment = cube.chatter.attrs.get("comment", "") if "chatter" in cube else ""
    visible = comment.rpartition("visible: ")[2]
    return f"{quantity}: {visible}" if visible and "threshold" in name else quantity
