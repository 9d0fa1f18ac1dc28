"""Table of theory beside simulation: how well the end of complete bursts is predicted."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from damper.analysis.accumulation import PREDICTED, SHARP, SMALL, accumulation_errors
from damper.parameters.lazy import pd, xr
from damper.parameters.units import units_of
from damper.study.products import Product
from damper.tables import Table, number, place_cells


class AccumulationTable(Product):
    """How well theory predicts when and where complete bursts end, at each point of the study."""

    needs = ("accumulation",)

    within: Annotated[
        float,
        Field(
            gt=0,
            lt=1,
            description="Part of what is left of the burst to which a prediction must be right to "
            "agree: the table says from which impact on it does.",
        ),
    ] = 0.01


def make(results: Mapping[str, Any], settings: AccumulationTable) -> Table:
    """Show how good the predictions are at every point."""
    cube = results["cube"]
    within = settings.within
    data = accumulation_errors(cube, within)
    body: list[str | pd.DataFrame] = [
        "After each impact of a complete burst, theory predicts when and where it ends: to first "
        "order in the rebound speed w with an error that falls as w², to second order as w³. "
        "Accumulation is resolved bounce by bounce, up to a tail that is itself closed by the "
        f"second-order formula; slopes are those of errors above {SHARP:.0f} times the uncertainty "
        "of the end so found, where the estimated relative error of theory is below "
        f"{SMALL:g} (median over pairs of impacts of one burst).",
        "Errors at the first impact are those of predictions made there, for the whole burst: "
        "median and worst over the bursts, in per cent of its size, which is its duration, or the "
        "largest distance of the primary at an impact of the burst from where it completes. A wall "
        "that draws away at an impact allows no prediction; nor does a second-order time that is "
        "not positive. The last columns say from which impact on all errors are within "
        f"{within:.2g} of what is left of the burst (median, worst), and how much of its size is "
        "left then.",
        "## In all",
        _summary(data),
    ]
    for quantity, title in zip(PREDICTED, ("time", "point"), strict=True):
        units = units_of(cube[f"remaining_{quantity}"].attrs)
        some = data[data["quantity"] == quantity]
        body += [f"## Accumulation {title}", _cells(some, cube, units, within)]
    return Table.of(cube, "predicted and simulated accumulation of bursts", data, body)


def _summary(found: pd.DataFrame) -> pd.DataFrame:
    """Slopes over all points, and how many bursts have a prediction at their first impact."""
    orders = sorted(found["order"].unique())
    rows: dict[str, list[str]] = {"": [], "law of the error": []}
    for order in orders:
        here = found[found["order"] == order]
        rows[""].append(f"order {order}")
        rows["law of the error"].append(f"w^{order + 1}")
        for quantity, name in zip(PREDICTED, ("time", "point"), strict=True):
            slopes = here.loc[here["quantity"] == quantity, "slope"]
            text = f"{slopes.min():.3f} to {slopes.max():.3f}" if slopes.notna().any() else "–"
            rows.setdefault(f"slope of the {name}'s error", []).append(text)
        times = here[here["quantity"] == PREDICTED[0]]
        first = f"{times['first_impact_predicted'].sum()} of {times['bursts'].sum()}"
        rows.setdefault("bursts predicted at their first impact", []).append(first)
    return pd.DataFrame(rows, dtype=object)


def _cells(found: pd.DataFrame, cube: xr.Dataset, units: str, within: float) -> pd.DataFrame:
    others = list(found.columns[: found.columns.get_loc("quantity")])
    within_head = f"within {within:.2%} from impact".replace(".00%", " %")
    rows = []
    for row in found.to_dict("records"):
        points = "" if math.isnan(row["slope"]) else f" ({row['slope_points']})"
        left = row["within_left_percent"]
        first = "first_impact"
        rows.append(
            {
                **place_cells({name: row[name] for name in others}, cube),
                "order": row["order"],
                "complete bursts": "run stopped"
                if math.isnan(row["complete_bursts"])
                else int(row["complete_bursts"]),
                "bursts compared": row["bursts"],
                "impacts with prediction": f"{row['predicted_impacts']} of {row['impacts']}",
                "slope (from)": number(row["slope"], ".3f", "–") + points,
                "first impacts with prediction": f"{row[f'{first}_predicted']} of {row['bursts']}",
                f"error there, {units}": _pair(row, f"{first}_{{}}_error", ".3g"),
                "error there, %": _pair(row, f"{first}_{{}}_percent", ".3g"),
                within_head: _pair(row, "within_from_{}", "g"),
                "left then": "–" if math.isnan(left) else f"{left:.2f}%",
            }
        )
    return pd.DataFrame(rows, dtype=object)


def _pair(row: Mapping[str, Any], name: str, form: str) -> str:
    """Median and worst of something."""
    both = [row[name.format(which)] for which in ("median", "worst")]
    if math.isnan(both[0]):
        return "–"
    return ", ".join("beyond the list" if math.isinf(one) else f"{one:{form}}" for one in both)
