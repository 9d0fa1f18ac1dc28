"""Special points: where periodic motions are born and die, or change their kind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from damper.study.messages import Mistakes
from damper.study.products import Product, StudyContents, need_orbits
from damper.tables import Table

if TYPE_CHECKING:
    pass


class SpecialPoints(Product):
    """Folds, bifurcations and grazing of the study's orbits, and why their branches end."""

    reads: ClassVar[tuple[str, ...]] = ("orbits.nc",)

    def check_against(self, study: StudyContents, mistakes: Mistakes) -> None:
        need_orbits((), study, mistakes)


def make(results: Mapping[str, Any], settings: SpecialPoints) -> Table:
    """Show the points of all branches."""
    import pandas as pd

    branches = results["orbits"]
    others = [str(name) for name in branches.data_vars if branches[name].attrs.get("axis")]
    over = [str(name) for name in dict.fromkeys(branches.curve_other.values)]
    fixed = {name: float(branches[name]) for name in over if name in branches.coords}
    rows, ends = [], []
    for k in range(branches.sizes["branch"]):
        branch = branches.isel(branch=k)
        along = str(branch.along.item())
        where = {name: float(branch[name]) for name in others if name != along}
        place = {"motion": branch.motion.item(), **fixed, **where}
        points = branches.isel(point=branches.point_branch.values == k)
        rows += [
            {**place, "point": kind, "along": along, "value": value, "word": word}
            for kind, value, word in zip(
                points.kind.values.tolist(),
                points.point_value.values.tolist(),
                points.point_word.values.tolist(),
                strict=True,
            )
        ]
        for number in np.flatnonzero(branches.curve_branch.values == k):
            other = str(branches.curve_other[number].item())
            curve = branches.isel(curve_point=branches.curve.values == number)
            rows += [
                {**place, other: at, "point": kind, "along": along, "value": value, "word": word}
                for kind, at, value, word in zip(
                    [branches.curve_kind[number].item()] * curve.sizes["curve_point"],
                    curve.curve_other_value.values.tolist(),
                    curve.curve_value.values.tolist(),
                    curve.curve_word.values.tolist(),
                    strict=True,
                )
            ]
            first, last = branches.curve_first_end[number], branches.curve_last_end[number]
            ends.append(
                f"The {branches.curve_kind[number].item()} along {along} and {other} ends where "
                f"{first.item()}, and where {last.item()}."
            )
        shown = ", ".join(f"{name.replace('_', ' ')} {value:g}" for name, value in where.items())
        ends.append(
            f"{branch.motion.item()}{f' ({shown})' if shown else ''} ends where "
            f"{branch.first_end.item()}, and where {branch.last_end.item()}."
        )
    places = dict.fromkeys([*others, *over])
    data = pd.DataFrame(rows, columns=["motion", *places, "point", "along", "value", "word"])
    data = data.dropna(axis="columns", how="all") if len(data) else data
    cells = data.map(lambda cell: f"{cell:.10g}" if isinstance(cell, float) else cell)
    body = [
        "In the order of each branch. The word lists the impacts of the motion: R3 L2 RS are three "
        "on the right wall, two on the left one, then chatter on the right that completes.",
        cells,
        *ends,
    ]
    return Table.of(branches, "special points of periodic motions", data, body)
