"""Special points: where periodic motions are born and die, or change their kind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from damper.analysis.labels import label_of
from damper.parameters.lazy import pd, xr
from damper.study.messages import Mistakes
from damper.study.products import Product, StudyContents, require_orbits
from damper.tables import Table


class SpecialPoints(Product):
    """Folds, bifurcations and grazing of the study's orbits, and why their branches end."""

    reads: ClassVar[tuple[str, ...]] = ("orbits.nc",)

    def check_against(self, study: StudyContents, mistakes: Mistakes) -> None:
        require_orbits((), study, mistakes)


def make(results: Mapping[str, Any], settings: SpecialPoints) -> Table:
    """Show the points of all branches, and where branches and curves end."""
    branches = results["orbits"]
    others = [str(name) for name in branches.data_vars if branches[name].attrs.get("axis")]
    over = [str(name) for name in dict.fromkeys(branches.curve_other.values)]
    rows: list[dict[str, Any]] = []
    ends: list[str] = []
    for k in range(branches.sizes["branch"]):
        branch = branches.isel(branch=k)
        along, motion = branch.along.item(), branch.motion.item()
        where = {name: float(branch[name]) for name in others if name != along}
        fixed = {name: float(branches[name]) for name in over if name in branches.coords}
        place = {"motion": motion, **fixed, **where, "along": along}
        points = branches.isel(point=branches.point_branch.values == k)
        rows += _rows(place, points, point="kind", value="point_value", word="point_word")
        for number in np.flatnonzero(branches.curve_branch.values == k):
            curve = branches.isel(curve=number, curve_point=branches.curve.values == number)
            kind, other = curve.curve_kind.item(), curve.curve_other.item()
            columns = {other: "curve_other_value", "value": "curve_value", "word": "curve_word"}
            rows += _rows({**place, "point": kind}, curve, **columns)
            ends.append(
                f"Ends of the {kind} along {along} and {other}: "
                f"{curve.curve_first_end.item()}; {curve.curve_last_end.item()}."
            )
        shown = ", ".join(f"{label_of(name)} {value:g}" for name, value in where.items())
        ends.append(
            f"Ends of {motion}{f' ({shown})' if shown else ''}: "
            f"{branch.first_end.item()}; {branch.last_end.item()}."
        )
    places = dict.fromkeys([*others, *over])
    data = pd.DataFrame(rows, columns=["motion", *places, "point", "along", "value", "word"])
    data = data.dropna(axis="columns", how="all") if len(data) else data
    cells = data.map(lambda cell: f"{cell:.10g}" if isinstance(cell, float) else cell)
    words = (
        "In the order of each branch. The word lists the impacts of the motion: R3 L2 RS are three "
        "on the right wall, two on the left one, then chatter on the right that completes."
    )
    return Table.of(branches, "special points of periodic motions", data, [words, cells, *ends])


def _rows(place: Mapping[str, Any], points: xr.Dataset, **columns: str) -> list[dict[str, Any]]:
    """Return a row for each of some points, from their variables."""
    lists = [points[name].values.tolist() for name in columns.values()]
    return [{**place, **dict(zip(columns, row, strict=True))} for row in zip(*lists, strict=True)]
