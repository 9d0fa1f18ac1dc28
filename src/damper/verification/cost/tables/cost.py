"""What the parts of the software cost, as CSV and Markdown; see `verification.cost.measure`."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, ClassVar

from pydantic import Field

from damper.study.fields import Choice
from damper.tables import markdown_table
from damper.verification.base import Made

Rows = list[list[str]]
_MB = 1e6


class CostTable(Made):
    """One part of what was measured."""

    reads: ClassVar[tuple[str, ...]] = ("timed/cost.json",)

    part: Annotated[
        str,
        Choice("ladder", "unused", "scaling", "startup", "jobs"),
        Field(
            description="Every rung; what features cost that are not used; growth; imports of each "
            "kind of job; jobs that a target needs."
        ),
    ]

    def files(self, stem: str, study: Any) -> dict[str, dict[str, Any]]:
        title = f"{study.title}: {self.part}"
        return {stem: self.model_dump(exclude_none=True) | {"title": title}}


def make(timings: Mapping[str, Any], part: str, title: str) -> tuple[str, str]:
    """Write one part of the timings.

    Parameters
    ----------
    timings : mapping
        From `damper.verification.cost.measure.measure`, or its file.
    part : str
        A key of `PARTS`.
    title : str

    Returns
    -------
    csv, markdown : str
        All digits, and rounded ones.

    Raises
    ------
    ValueError
        For an unknown part, or one that the timings do not have.
    """
    if part not in PARTS:
        raise ValueError(f"unknown part {part!r}: must be one of {', '.join(PARTS)}")
    if part not in timings:
        raise ValueError(f"the timings have no {part}: {', '.join(timings)}")
    heads, exact, shown, remark = PARTS[part](timings)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([head.replace(" ", "_") for head in heads[0]])
    writer.writerows(exact)
    markdown = [
        f"# {title}",
        "",
        f"Measured on: {timings['machine']}, {timings['core']}. {remark}",
        "",
        *markdown_table(heads[1], shown),
    ]
    return text.getvalue(), "\n".join(markdown) + "\n"


def _ladder(timings: Mapping[str, Any]) -> tuple[tuple[list[str], list[str]], Rows, Rows, str]:
    ladder = timings["ladder"]
    ratios = ("over_bare", "over_base", "over_rigid")
    heads = [
        "rung",
        "model",
        "events",
        *(
            f"{name}_{quartile}"
            for name in ("bare", "time", *ratios)
            for quartile in ("lower", "median", "upper")
        ),
        "memory_more",
        "memory_asked",
    ]
    exact, shown = [], []
    for name, rung in ladder["rungs"].items():
        memory = rung.get("memory", {})
        spreads = [rung.get(key, [math.nan] * 3) for key in ("bare", "time", *ratios)]
        exact.append(
            [name, rung["model"], str(rung["events"])]
            + [_digits(value) for spread in spreads for value in spread]
            + [str(memory.get(key, "")) for key in ("more", "asked")]
        )
        shown.append(
            [
                name,
                f"{rung['bare'][1]:.3f}",
                f"{rung['time'][1]:.3f}",
                *(_spread(rung.get(key)) for key in ratios),
                *(f"{memory[key] / _MB:.2f}" if memory else "" for key in ("more", "asked")),
            ]
        )
    columns = [
        "rung",
        "bare, us/event",
        "observed, us/event",
        "observed / bare",
        "bare / base",
        "bare / rigid",
        "more memory, MB",
        "asked for, MB",
    ]
    remark = (
        f"Medians of {ladder['repeats']} interleaved repeats of {ladder['lanes']} lanes of "
        f"{ladder['periods']} periods, [quartiles] of the ratios within a repeat; two runs of the "
        f"same differ by {_spread(ladder['noise'])}. The base is the first rung's scene; rigid is "
        "the rigid damper with the same numbers. Memory: peak of a fresh process beyond that of "
        "one with the bare engine, the observers' code included; asked for is the log buffer and "
        "the arrays alone."
    )
    return (heads, columns), exact, shown, remark


def _unused(timings: Mapping[str, Any]) -> tuple[tuple[list[str], list[str]], Rows, Rows, str]:
    unused = timings["unused"]
    ratios = unused["ratios"]
    remark = (
        f"A rigid damper without bursts, {unused['lanes']} lanes of {unused['periods']} periods, "
        f"{unused['repeats']} interleaved repeats: run time with what it does not use over that "
        "without it, median [quartiles]; the first line compares two runs that are the same."
    )
    exact = [[name, *map(_digits, ratio)] for name, ratio in ratios.items()]
    shown = [[name, _spread(ratio)] for name, ratio in ratios.items()]
    return (["feature", "lower", "median", "upper"], ["feature", "ratio"]), exact, shown, remark


def _scaling(timings: Mapping[str, Any]) -> tuple[tuple[list[str], list[str]], Rows, Rows, str]:
    scaling = timings["scaling"]
    exact: Rows = []
    shown: Rows = []
    slopes = []
    for along in ("lanes", "periods"):
        for how, rows in scaling[along].items():
            grown = (rows["size"], rows["seconds"], rows["memory"], rows["asked"])
            for size, seconds, memory, asked in zip(*grown, strict=True):
                exact.append([along, how, str(size), _digits(seconds), str(memory), str(asked)])
                shown.append(
                    [
                        along,
                        how,
                        f"{size}",
                        f"{seconds:.3g}",
                        f"{1e6 * seconds / size:.3g}",
                        f"{memory / _MB:.2f}",
                        f"{asked / _MB:.2f}",
                    ]
                )
            slopes.append(f"{along}, {how}: {rows['time_slope']:.2f}")
    heads = ["along", "run", "size", "seconds", "memory", "asked"]
    columns = ["along", "run", "number", "s", "us each", "memory, MB", "asked for, MB"]
    remark = (
        f"Lanes have {scaling['lane_periods']} periods each; periods are those of one lane; "
        f"observed by {', '.join(scaling['observers'])}. Memory: what a fresh process takes beyond "
        "a run of one lane and period; asked for is what the observers keep of it. Exponents of "
        f"the time from 100 on: {'; '.join(slopes)}."
    )
    return (heads, columns), exact, shown, remark


def _startup(timings: Mapping[str, Any]) -> tuple[tuple[list[str], list[str]], Rows, Rows, str]:
    # Kinds of job that share a rule share its time, which stands beside the first of them.
    times = dict(timings.get("times", {}))
    exact, shown = [], []
    for name, job in timings["startup"].items():
        wall = times.pop(name.split(":")[0], {})
        loaded = ", ".join(job["loaded"])
        numbers = (job["interpreter"], job["seconds"])
        jobs, median, total = (wall.get(key) for key in ("jobs", "median", "total"))
        exact.append(
            [name, *map(_digits, numbers), str(job["modules"]), loaded]
            + ["" if value is None else repr(value) for value in (jobs, median, total)]
        )
        ran = [f"{jobs}", f"{median:.2f}", f"{total:.1f}"] if wall else [""] * 3
        shown.append(
            [name, *(f"{value:.2f}" for value in numbers), str(job["modules"]), loaded, *ran]
        )
    heads = ["job", "interpreter", "imports", "modules", "loaded", "jobs", "median", "total"]
    columns = [
        "job",
        "Python, s",
        "imports, s",
        "modules",
        "of these heavy",
        "jobs run",
        "median, s",
        "total, s",
    ]
    remark = (
        "Imports of each kind of job in fresh interpreters, medians; on the right the wall time of "
        "the jobs that have run, beside the first of those that share a rule."
    )
    return (heads, columns), exact, shown, remark


def _jobs(timings: Mapping[str, Any]) -> tuple[tuple[list[str], list[str]], Rows, Rows, str]:
    jobs = timings["jobs"]
    rules = list(dict.fromkeys(rule for counts in jobs.values() for rule in counts))
    exact = [
        *([rule, *(str(counts.get(rule, 0)) for counts in jobs.values())] for rule in rules),
        ["total", *(str(sum(counts.values())) for counts in jobs.values())],
    ]
    heads = ["rule", *jobs]
    remark = "Jobs that Snakemake runs for a target when nothing is there yet."
    return (heads, heads), exact, exact, remark


#: Part of the timings -> how it is written.
PARTS: dict[str, Callable[..., Any]] = {
    "ladder": _ladder,
    "unused": _unused,
    "scaling": _scaling,
    "startup": _startup,
    "jobs": _jobs,
}


def _digits(value: float) -> str:
    return repr(float(value)) if math.isfinite(value) else ""


def _spread(values: Sequence[float] | None) -> str:
    if values is None:
        return ""
    low, median, high = values
    return f"{median:.3f} [{low:.3f}, {high:.3f}]"
