"""What the parts of a run cost, as CSV and Markdown; see `damper.verification.cost.measure`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from damper.analysis.labels import label_of
from damper.parameters.lazy import pd
from damper.tables import Table
from damper.verification.base import Made, OptionalCaption
from damper.verification.timing import Spread, machine_text

_TIMES = {"bare": "bare, us/event", "observed": "observed, us/event"}
_QUARTILES = ("lower", "median", "upper")
_RATIOS = {"over_bare": "observed / bare", "over_base": "bare / base", "over_rigid": "bare / rigid"}


class CostTable(Made):
    """What every case costs beside the bare engine."""

    reads: ClassVar[tuple[str, ...]] = ("timed/cost.json",)

    caption: OptionalCaption = None

    def files(self, stem: str, study: Any) -> dict[str, dict[str, Any]]:
        return {stem: {"kind": self.kind, "caption": self.caption or study.title}}


def make(results: Mapping[str, Any], settings: CostTable) -> Table:
    """Make the table of what `measure` found."""
    timings = results["cost"]
    data, cells = [], []
    for name, case in timings["cases"].items():
        numbers = {
            f"{key}_{quartile}": value
            for key in (*_TIMES, *_RATIOS)
            for quartile, value in zip(_QUARTILES, case.get(key, [None] * 3), strict=True)
        }
        known = {"case": name, "model": case["model"], "events": case["events"]}
        data.append(known | numbers | {"arrays": case.get("arrays")})
        cell = {"case": label_of(name)}
        cell |= {h: f"{case[key][1]:.3f}" if key in case else "" for key, h in _TIMES.items()}
        cell |= {h: str(Spread(*case[key])) if key in case else "" for key, h in _RATIOS.items()}
        cell["arrays, MB"] = f"{case['arrays'] / 1e6:.2f}" if "arrays" in case else ""
        cells.append(cell)
    frame = pd.DataFrame(data).astype({"events": "Int64", "arrays": "Int64"})
    remark = (
        f"Machine: {machine_text(timings['machine'])}. Medians of {timings['repeats']} interleaved "
        f"repeats of {timings['runs']} runs of {timings['periods']} periods, with [quartiles] of "
        "the ratios within a repeat; two timings of the same differ by "
        f"{Spread(*timings['noise'])}. The base is the bare engine of the first case; rigid is the "
        "rigid damper with the same numbers. Arrays are what the observers keep."
    )
    return Table(settings.caption or "Cost", frame, [remark, pd.DataFrame(cells)])
