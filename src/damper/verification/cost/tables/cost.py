"""What the parts of a run cost, as CSV and Markdown; see `damper.verification.cost.measure`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Field

from damper.tables import Table
from damper.verification.base import Made
from damper.verification.labels import label_of
from damper.verification.timing import Spread, machine_text

if TYPE_CHECKING:
    import pandas as pd

_MB = 1e6
_RATIOS = {
    "over_bare": "observed / bare",
    "over_base": "bare / base",
    "over_rigid": "bare / rigid",
}
_BYTES = {"memory": "memory, MB", "arrays": "arrays, MB"}


class CostTable(Made):
    """One part of what was measured."""

    reads: ClassVar[tuple[str, ...]] = ("timed/cost.json",)

    show: Annotated[
        Literal["suite", "growth"],
        Field(description="Every case, or run time and memory over runs and periods."),
    ]

    def files(self, stem: str, study: Any) -> dict[str, dict[str, Any]]:
        title = f"{study.title}: {self.show}"
        return {stem: self.model_dump(exclude_none=True) | {"title": title}}


def make(timings: Mapping[str, Any], show: str, title: str) -> Table:
    """Make the table of one part of the timings.

    Parameters
    ----------
    timings : mapping
        From `damper.verification.cost.measure.measure`, or its file.
    show : {"suite", "growth"}
    title : str

    Returns
    -------
    Table
    """
    data, cells, remark = (_suite if show == "suite" else _growth)(timings[show])
    return Table(title, data, [f"Machine: {machine_text(timings['machine'])}. {remark}", cells])


def slopes(rows: Mapping[str, Mapping[str, Any]]) -> str:
    """List the exponents of the time over one kind of size."""
    known = {how: one["slope"] for how, one in rows.items() if one["slope"] is not None}
    return ", ".join(f"slope {slope:.2f} {how}" for how, slope in known.items())


def _suite(suite: Mapping[str, Any]) -> tuple[pd.DataFrame, pd.DataFrame, str]:
    import pandas as pd

    spreads = ("bare", "observed", *_RATIOS)
    quartiles = ("lower", "median", "upper")
    data, cells = [], []
    for name, case in suite["cases"].items():
        numbers = {
            f"{key}_{quartile}": value
            for key in spreads
            for quartile, value in zip(quartiles, case.get(key, [None] * 3), strict=True)
        }
        data.append(
            {"case": name, "model": case["model"], "events": case["events"]}
            | numbers
            | {key: case.get(key) for key in _BYTES}
        )
        ratios = {
            head: str(Spread(*case[key])) if key in case else "" for key, head in _RATIOS.items()
        }
        sizes = {
            head: f"{case[key] / _MB:.2f}" if key in case else "" for key, head in _BYTES.items()
        }
        times = {f"{key}, us/event": _median(case.get(key)) for key in spreads[:2]}
        cells.append({"case": label_of(name)} | times | ratios | sizes)
    remark = (
        f"Medians of {suite['repeats']} interleaved repeats of {suite['runs']} runs of "
        f"{suite['periods']} periods, with [quartiles] of the ratios within a repeat; two timings "
        f"of the same differ by {Spread(*suite['noise'])}. The base is the bare engine of the "
        "first case; rigid is the rigid damper with the same numbers. Memory is the peak of a new "
        "process beyond that of one with the bare engine, the observers' code included; arrays "
        "are what the observers keep."
    )
    frame = pd.DataFrame(data)
    whole = ["events", *_BYTES]
    return frame.astype(dict.fromkeys(whole, "Int64")), pd.DataFrame(cells), remark


def _growth(growth: Mapping[str, Any]) -> tuple[pd.DataFrame, pd.DataFrame, str]:
    import pandas as pd

    columns = ["size", "seconds", "memory", "arrays"]
    frames = [
        pd.DataFrame({"along": along, "how": how} | {key: rows[key] for key in columns})
        for along in ("runs", "periods")
        for how, rows in growth[along].items()
    ]
    data = pd.concat(frames)
    cells = pd.DataFrame(
        {
            "along": data["along"],
            "engine": data["how"],
            "number": data["size"].map(str),
            "s": data["seconds"].map("{:.3g}".format),
            "us each": (1e6 * data["seconds"] / data["size"]).map("{:.3g}".format),
        }
        | {head: (data[key] / _MB).map("{:.2f}".format) for key, head in _BYTES.items()}
    )
    remark = (
        f"Runs have ten periods each; periods are those of one run; observed by "
        f"{', '.join(map(label_of, growth['observers']))}. Memory is the peak of a new process "
        "beyond that after one run of one period; arrays are what the observers keep. Exponents of "
        f"the time from 100 on: runs, {slopes(growth['runs'])}; "
        f"periods, {slopes(growth['periods'])}."
    )
    return data, cells, remark


def _median(spread: Sequence[float] | None) -> str:
    return f"{spread[1]:.3f}" if spread else ""
