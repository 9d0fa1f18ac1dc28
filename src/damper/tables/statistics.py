"""Means under noise with their confidence limits, and the closed forms of white noise."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from damper.analysis.places import places
from damper.analysis.statistics import means_under_noise
from damper.parameters.lazy import pd
from damper.parameters.names import counted
from damper.study.products import OfNoise
from damper.tables import Table, number, place_cells, with_units


class StatisticsTable(OfNoise):
    """Means under noise with their confidence limits, beside the closed forms of white noise."""


def make(results: Mapping[str, Any], settings: StatisticsTable) -> Table:
    """Show the means that have a closed form."""
    cube = results["cube"]
    data = means_under_noise(cube)
    axes = {name for where in places(cube.mean_input, "draw") for name in where}
    rows = []
    for row in data.dropna(subset="white").to_dict("records"):
        name = row["mean"]
        where = place_cells({axis: value for axis, value in row.items() if axis in axes}, cube)
        rows.append(
            where
            | {"mean": with_units(cube[name].attrs["long_name"], cube[name])}
            | {"value": f"{row['value']:.4g}"}
            | {"limits": f"{number(row['lower'], '.4g')} to {number(row['upper'], '.4g')}"}
            | {"white noise": f"{row['white']:.4g}", "in band": f"{row['in_band']:.4g}"}
            | {"holds": "yes" if row["holds"] else "no"}
        )
    draws = cube.sizes.get("draw", 1)
    text = (
        f"Means over {counted(draws, 'draw')}, and their confidence limits. White noise: "
        "the closed form for white noise as dense as the noise is at the primary's frequency. In "
        "band: less the part of the power that is missing above the band, to first order. It holds "
        "where the limits reach what lies between both. The CSV has the other means, too."
    )
    return Table.of(
        cube, "means and the closed forms of white noise", data, [text, pd.DataFrame(rows)]
    )
