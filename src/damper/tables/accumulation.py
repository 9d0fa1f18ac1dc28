"""Table of theory beside simulation: how well the end of complete bursts is predicted."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from damper.analysis.accumulation_errors import QUANTITIES, SHARP, SMALL, Agreement, agreements
from damper.study.fields import Faults, Number
from damper.study.products import (
    Offer,
    Product,
    need,
)
from damper.tables import About, fixed_values, markdown_table, remarks

if TYPE_CHECKING:
    import xarray as xr

_COLUMNS = (
    "quantity",
    "order",
    "complete_bursts",
    "bursts",
    "impacts",
    "predicted_impacts",
    "slope",
    "slope_points",
    "first_impact_predicted",
    "first_impact_median_error",
    "first_impact_worst_error",
    "first_impact_median_percent",
    "first_impact_worst_percent",
    "within_percent",
    "within_from_median",
    "within_from_worst",
    "within_left_percent",
)
_ORDINAL = {"first": 1, "second": 2}


class AccumulationTable(Product):
    """How well theory predicts when and where complete bursts end, at each point of the study."""

    within: Annotated[
        float,
        Number(gt=0, lt=1),
        Field(
            description="Part of what is left of the burst to which a prediction must be right to "
            "agree: the table says from which impact on it does."
        ),
    ] = 0.01

    @classmethod
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        need(offer, faults, "accumulation")


def make(cube: xr.Dataset, settings: Mapping[str, Any], about: About) -> tuple[str, str]:
    """Compare theory with every point of a cube; see `damper.tables.make`."""
    within = settings["within"]
    found = list(agreements(cube, within))
    units = {name: _units(cube[f"remaining_{name}"]) for name in QUANTITIES}
    return to_csv(found, within), to_markdown(found, within, about, units)


def to_csv(found: list[Agreement], within: float) -> str:
    """Write four lines per point: time and displacement, each to first and second order.

    Missing numbers are empty, and ``inf`` says that the impacts listed do not reach that far.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*(found[0].where if found else ()), *_COLUMNS])
    for one in found:
        first, begun = one.first, one.within
        numbers = (
            one.slope,
            one.slope_points,
            first.predicted,
            first.median,
            first.worst,
            100.0 * first.median_part,
            100.0 * first.worst_part,
            100.0 * within,
            begun.median,
            begun.worst,
            100.0 * begun.left,
        )
        writer.writerow(
            [
                *(
                    f"{value:g}" if isinstance(value, float) else value
                    for value in one.where.values()
                ),
                one.quantity,
                _ORDINAL[one.order],
                one.complete_bursts,
                one.bursts,
                one.impacts,
                one.predicted,
                *("" if math.isnan(value) else f"{value:.6g}" for value in numbers),
            ]
        )
    return text.getvalue()


def to_markdown(
    found: list[Agreement], within: float, about: About, units: Mapping[str, str]
) -> str:
    """Write the tables a person reads; `units` are those of times and displacements."""
    lines = [
        f"# {about.title}: predicted and simulated completion of bursts",
        "",
        "After each impact of a complete burst, theory tells when and where it ends: to first "
        "order in the rebound speed w with an error that falls as w², to second order as w³. "
        "Completion is resolved bounce by bounce, up to a tail that is itself closed by the "
        f"second-order formula; slopes are those of errors above {SHARP:.0f} times the uncertainty "
        "of the end so found, where the estimated relative error of theory is below "
        f"{SMALL:g} (median over pairs of impacts of one burst).",
        "",
        "Errors at the first impact are those of predictions made there, for the whole burst: "
        "median and worst over the bursts, in per cent of its size, which is its duration, or the "
        "largest distance of the primary at an impact of the burst from where it completes. A wall "
        "that draws away at an impact allows no prediction; nor does a second-order time that is "
        "not positive. The last columns say from which impact on all errors are within "
        f"{within:.2g} of what is left of the burst (median, worst), and how much of its size is "
        "left then.",
        "",
        fixed_values(about),
    ]
    for quantity, title in zip(QUANTITIES, ("time", "point"), strict=True):
        rows = [_row(one, units[quantity]) for one in found if one.quantity == quantity]
        names = [name.replace("_", " ") for name in (found[0].where if found else ())]
        heads = [
            *names,
            "order",
            "complete bursts",
            "bursts compared",
            "impacts with prediction",
            "slope (from)",
            "first impacts with prediction",
            f"error there{units[quantity]}",
            "error there, %",
            f"within {within:.2%} from impact".replace(".00%", " %"),
            "left then",
        ]
        lines += ["", f"## Completion {title}", "", *markdown_table(heads, rows)]
    return "\n".join([*lines, *remarks(about)]) + "\n"


def _row(one: Agreement, units: str) -> list[str]:
    first, begun = one.first, one.within
    stopped = one.complete_bursts < 0
    return [
        *(f"{value:g}" if isinstance(value, float) else str(value) for value in one.where.values()),
        str(_ORDINAL[one.order]),
        "run stopped" if stopped else str(one.complete_bursts),
        str(one.bursts),
        f"{one.predicted} of {one.impacts}",
        "–" if math.isnan(one.slope) else f"{one.slope:.3f} ({one.slope_points})",
        f"{first.predicted} of {one.bursts}",
        _pair(first.median, first.worst, "{:.3g}"),
        _pair(100.0 * first.median_part, 100.0 * first.worst_part, "{:.3g}"),
        _pair(begun.median, begun.worst, "{:g}"),
        "–" if math.isnan(begun.left) else f"{begun.left:.2%}",
    ]


def _pair(median: float, worst: float, form: str) -> str:
    """Median and worst of something."""
    if math.isnan(median):
        return "–"
    return ", ".join(
        "beyond the list" if math.isinf(value) else form.format(value) for value in (median, worst)
    )


def _units(array: xr.DataArray) -> str:
    return f", {array.attrs['units']}"
