"""The small-mass limit beside the computed border between complete and incomplete bursts."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from damper.analysis.closed_forms import damper_at, reduced_gap
from damper.parameters.quantities import ALL
from damper.study.fields import Faults, Number
from damper.study.products import (
    FREE_TRAVEL,
    Offer,
    Product,
    Role,
    count_values,
    need,
    need_one_run,
)
from damper.study.yaml_file import words
from damper.sweep.grid import product
from damper.sweep.runs import run_points
from damper.tables import About, fixed_values, markdown_table, remarks
from damper.theory.small_mass import critical_restitution

if TYPE_CHECKING:
    import xarray as xr

#: All bursts are complete from this fraction on: it is a quotient of whole numbers.
_ALL = 1.0 - 1e-12


@dataclass(frozen=True)
class Border:
    """Theory and simulation at one clearance.

    `gap` is the clearance (or gap) in the units of the study, `reduced_gap` G, `critical` the
    limit r_crit(G) (NaN beyond G = pi), `border` the largest restitution up to which all bursts
    are complete (NaN if it is not on the axis), and `single` is False where they are complete at
    some larger restitution again.
    """

    where: dict[str, float]
    gap: float
    reduced_gap: float
    critical: float
    border: float
    single: bool

    @property
    def difference(self) -> float:
        """Border less limit."""
        return self.border - self.critical


class SmallMassLimit(Product):
    """The border between complete and incomplete bursts beside its small-mass limit."""

    of_theory: ClassVar[bool] = True

    resolution: Annotated[
        float, Number(gt=0), Field(description="Restitution to which borders are bisected.")
    ] = 1e-4

    @classmethod
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        need(offer, faults, "bursts")
        need_one_run(offer, faults, bisected="borders")
        for names in (("restitution",), FREE_TRAVEL):
            found = next((name for name in names if name in offer.axes), None)
            if found is None:
                faults.add((), f"needs an axis of the {' or '.join(names)}", words(names))
            else:
                count_values((), found, offer.axes[found], Role(least=2), faults)


def make(cube: xr.Dataset, settings: Mapping[str, Any], about: About) -> tuple[str, str]:
    """Bisect the borders and compare; see `damper.tables.make`."""
    found = borders(cube, settings["resolution"], about.run)
    over = gap_axis(cube)
    return to_csv(found, over), to_markdown(found, over, settings["resolution"], about)


def gap_axis(cube: xr.Dataset) -> str:
    """Name of the axis that gives the free travel."""
    return "gap" if "gap" in cube.dims else "clearance"


def borders(cube: xr.Dataset, resolution: float, run: Mapping[str, Any]) -> list[Border]:
    """Border between complete and incomplete bursts at every clearance of a cube.

    Parameters
    ----------
    cube : xarray.Dataset
        With `complete_fraction` over restitution and clearance (or gap), and perhaps more axes.
    resolution : float
        Restitution to which borders are bisected, between the last grid value up to which all
        bursts are complete and the next one.
    run : mapping
        Settings of `damper.sweep.runs.run_points`, as for the cube.

    Returns
    -------
    list of Border
        In the order of the cube's other axes, then of the clearance.
    """
    over = gap_axis(cube)
    cube = cube.sortby(["restitution", over])
    values = cube.restitution.values
    others = {
        name: cube[name].values.tolist()
        for name in cube.complete_fraction.dims
        if name not in (over, "restitution")
    }
    scalars = {n: float(cube[n]) for n in ALL if n in cube.coords and cube[n].ndim == 0}
    found = []
    for where in product(others, {}):
        place = cube.sel(where)
        gaps = place[over].values.tolist()
        fractions = place.complete_fraction.transpose(over, "restitution").values
        reduced = [reduced_gap(damper_at(place, restitution=0.0, **{over: g})[0]) for g in gaps]
        critical = critical_restitution(reduced).tolist()
        for k, gap in enumerate(gaps):
            complete = fractions[k] >= _ALL
            failing = np.flatnonzero(~complete)
            border = math.nan
            if failing.size and failing[0] > 0 and np.isfinite(fractions[k][failing[0]]):
                first = failing[0]
                fixed = scalars | where | {over: gap}
                border = _bisect(values[first - 1], values[first], fixed, resolution, run)
            single = not complete[failing[0] :].any() if failing.size else True
            found.append(Border(where, gap, reduced[k], critical[k], border, bool(single)))
    return found


def _bisect(
    low: float, high: float, fixed: Mapping[str, float], resolution: float, run: Mapping[str, Any]
) -> float:
    while high - low > resolution * (1.0 + 1e-9):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        arrays, _ = run_points([{**fixed, "restitution": middle}], ["bursts"], **run)
        if arrays["complete_fraction"][0] >= _ALL:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def to_csv(found: Sequence[Border], over: str) -> str:
    """Write one line per clearance."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    heads = ("reduced_gap", "critical_restitution", "border", "difference", "single")
    writer.writerow([*(found[0].where if found else ()), over, *heads])
    for item in found:
        numbers = (item.reduced_gap, item.critical, item.border, item.difference)
        writer.writerow(
            [
                *(f"{value:g}" for value in (*item.where.values(), item.gap)),
                *(f"{number:.6g}" for number in numbers),
                str(item.single).lower(),
            ]
        )
    return text.getvalue()


def to_markdown(found: Sequence[Border], over: str, resolution: float, about: About) -> str:
    """Write the table a person reads: how far border and limit lie apart."""
    names = [name.replace("_", " ") for name in (found[0].where if found else ())]
    wheres = list({tuple(item.where.items()): None for item in found})
    rows = []
    for where in wheres:
        here = [item for item in found if tuple(item.where.items()) == where]
        known = [item for item in here if math.isfinite(item.difference)]
        row = [*(f"{value:g}" for _, value in where), f"{len(known)} of {len(here)}"]
        if known:
            worst = max(known, key=lambda item: abs(item.difference))
            gaps = [item.reduced_gap for item in known]
            row += [
                f"{min(gaps):.3g} to {max(gaps):.3g}",
                f"{np.mean([abs(item.difference) for item in known]):.1e}",
                f"{worst.difference:+.1e} at G = {worst.reduced_gap:.3g}",
                str(sum(not item.single for item in known)),
            ]
        else:
            row += ["none", "none", "none", "none"]
        rows.append(row)
    distances = [abs(item.difference) for item in found if math.isfinite(item.difference)]
    largest = f"{max(distances):.1e}" if distances else "none"
    what = over.replace("_", " ")
    lines = [
        f"# {about.title}: the small-mass limit",
        "",
        "Border: the largest restitution up to which all bursts of the record end in sticking, "
        f"bisected to {resolution:g} at each {what}. Limit: r_crit(G), G = 2 d / A with the steady "
        "amplitude A of the primary alone. Where G is beyond pi or the border lies beyond the "
        "axis of the restitution, there is nothing to compare. Several borders: bursts are all "
        "complete again at some larger restitution.",
        "",
        f"Largest distance between border and limit: {largest}.",
        "",
        fixed_values(about),
        "",
        *markdown_table(
            [
                *names,
                f"{what}s compared",
                "G",
                "mean distance",
                "largest (border less limit)",
                "with several borders",
            ],
            rows,
        ),
        *remarks(about),
    ]
    return "\n".join(lines) + "\n"
