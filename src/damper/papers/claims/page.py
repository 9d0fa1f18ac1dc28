"""The verdicts as CSV and Markdown."""

from __future__ import annotations

import csv
import io
from collections.abc import Collection, Sequence

from damper.papers.claims import ONLY_IF, UNTESTED, Judged
from damper.tables import markdown_table

_HEADS = ("claim", "statement", "stated", "found", "verdict", "condition", "assumptions", "figures")


def to_csv(found: Sequence[Judged]) -> str:
    """Write one line per claim; `figures` are below the folder of results, without suffix."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_HEADS)
    for item in found:
        claim, verdict = item.claim, item.verdict
        writer.writerow(
            [
                claim.name,
                claim.statement,
                claim.stated,
                verdict.ours,
                verdict.verdict,
                verdict.condition,
                item.assumptions,
                " ".join(claim.figures),
            ]
        )
    return text.getvalue()


def to_markdown(found: Sequence[Judged], made: Collection[str]) -> str:
    """Write a summary, then every claim in full.

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
        "The statements are in our words; numbers under *stated* stand in the papers' texts. "
        "Both texts lost their formulas and parameter values, so a verdict is for the assumed "
        "values below it, and changes with them. It is computed from the cubes of the studies.",
        "",
        *markdown_table(
            ["", "statement", "verdict"],
            [[i.claim.name, i.claim.statement, sentence(i)] for i in found],
        ),
    ]
    for item in found:
        claim, verdict = item.claim, item.verdict
        lines += ["", f"## {claim.name}: {claim.statement}", "", f"- Stated: {claim.stated}"]
        if verdict.ours:
            lines.append(f"- Found: {verdict.ours}")
        lines.append(f"- Verdict: **{sentence(item)}**")
        if item.assumptions:
            lines.append(f"- Assumed: {item.assumptions}")
        links = [
            f"[{path.rpartition('/')[2]}]({path}.png)" for path in claim.figures if path in made
        ]
        if links:
            lines.append(f"- Shown by: {', '.join(links)}")
    return "\n".join(lines) + "\n"


def sentence(item: Judged) -> str:
    """Verdict with its condition."""
    verdict = item.verdict
    if verdict.verdict == ONLY_IF:
        return f"{ONLY_IF} {verdict.condition}"
    if verdict.verdict == UNTESTED:
        return f"{UNTESTED}: {verdict.condition}"
    return verdict.verdict
