"""The closed-form motion with two impacts per period: its ranges, and simulation beside it."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from damper.analysis.closed_forms import admissible_orbits, section_point
from damper.analysis.intervals import intervals
from damper.parameters.quantities import INITIAL_NAMES
from damper.study.fields import Faults, Number, Text
from damper.study.products import (
    Offer,
    Product,
    Role,
    fit_axis,
    need,
    need_section,
)
from damper.sweep.grid import product
from damper.tables import About, fixed_values, markdown_table, remarks
from damper.theory.two_impacts import Orbit

if TYPE_CHECKING:
    import xarray as xr

#: Impacts per period are a quotient of whole numbers.
_TWO = 1e-9
#: Largest difference between the samples of a motion that has settled, in dimensionless units.
_SETTLED = 1e-9
#: Kind of range -> least state (0 no such motion, 1 unstable ones only, 2 a stable one).
RANGES = {"exists": 1, "stable": 2}


@dataclass(frozen=True)
class Range:
    """A range of the axis in which the motion exists, or is stable.

    `cut`: it reaches the end of the axis.
    """

    where: dict[str, float]
    kind: str
    lower: float
    upper: float
    cut: bool


@dataclass(frozen=True)
class Comparison:
    """Simulated sections against the closed form at one place along the other axes.

    Of the `simulated` points at which a stable motion exists, `compared` have two impacts per
    period and `settled` of these repeat; `median` and `largest` are differences of displacement or
    velocity, in dimensionless units, over all compared and over the settled ones.
    """

    where: dict[str, float]
    simulated: int
    compared: int
    settled: int
    median: float
    largest: float
    largest_settled: float


class TwoImpacts(Product):
    """Where the closed-form motion with two impacts per period exists and is stable."""

    of_theory: ClassVar[bool] = True

    along: Annotated[str, Text(), Field(description="Axis on which the ranges lie.")]
    resolution: Annotated[
        float,
        Number(gt=0),
        Field(description="How closely the ends of the ranges are found, in units of the axis."),
    ] = 1e-3

    @classmethod
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        need_section(offer, faults)
        need(offer, faults, "impacts")
        name = settings.get("along")
        if isinstance(name, str) and name in offer.axes and name in INITIAL_NAMES:
            message = f"'{name}' sets where a run starts, which the closed form does not depend on"
            faults.add(("along",), message, "an axis of a parameter")
        fit_axis("along", Role(least=2), settings, offer, faults)


def make(cube: xr.Dataset, settings: Mapping[str, Any], about: About) -> tuple[str, str]:
    """Find the ranges and compare; see `damper.tables.make`."""
    along = settings["along"]
    section = {name: about.observers[name] for name in about.observers if name != "bursts"}
    found = list(ranges(cube, along, settings["resolution"]))
    compared = list(compare(cube, along, section))
    return to_csv(found, compared, along), to_markdown(
        found, compared, along, settings["resolution"], about
    )


def ranges(cube: xr.Dataset, along: str, resolution: float) -> Iterator[Range]:
    """Ranges of one axis in which a motion with two impacts per period exists, and is stable.

    Parameters
    ----------
    cube : xarray.Dataset
    along : str
        Axis of a parameter.
    resolution : float
        Ends are bisected to this distance, between differing neighbours on the grid.

    Yields
    ------
    Range
    """
    grid = np.sort(cube[along].values).tolist()
    for where in _places(cube, along):
        place = cube.sel(where)

        def state_at(value: float, place: xr.Dataset = place) -> int:
            return _state(admissible_orbits(place, along, [value])[0][0])

        states = [state_at(value) for value in grid]
        for kind, least in RANGES.items():

            def holds(state: int, least: int = least) -> bool:
                return state >= least

            for lower, upper, _, cut in intervals(grid, states, holds, state_at, resolution):
                yield Range(where, kind, lower, upper, cut)


def compare(
    cube: xr.Dataset, along: str, section: Mapping[str, Mapping[str, Any]]
) -> Iterator[Comparison]:
    """Compare simulated sections with the closed form, where it is stable.

    Parameters
    ----------
    cube : xarray.Dataset
        With a section and `impacts_per_period`.
    along : str
        Axis of a parameter.
    section : mapping
        The section's observer with its settings.

    Yields
    ------
    Comparison
        For every place along the other axes, all directions and draws together.
    """
    for where in _places(cube, along):
        place = cube.sel(where)
        found = admissible_orbits(place, along, place[along].values)
        simulated, differences, spreads = 0, [], []
        for k, (both, units) in enumerate(found):
            stable = [orbit for orbit in both if orbit and orbit.stable]
            if not stable:
                continue
            point = place.isel({along: k})
            impacts = np.atleast_1d(point.impacts_per_period.values).ravel()
            simulated += impacts.size
            samples = np.stack(
                [
                    point.displacement.transpose(..., "sample").values / units.length,
                    point.velocity.transpose(..., "sample").values / units.speed,
                ],
                axis=-1,
            ).reshape(impacts.size, -1, 2)
            expected = np.array([section_point(orbit, section) for orbit in stable])
            for run in samples[abs(impacts - 2.0) < _TWO]:
                known = run[np.isfinite(run).all(axis=1)]
                if known.size:
                    differences.append(abs(known[-1] - expected).max(axis=1).min())
                    spreads.append(np.ptp(known, axis=0).max())
        apart, spread = np.array(differences), np.array(spreads)
        calm = apart[spread < _SETTLED] if apart.size else apart
        yield Comparison(
            where,
            simulated,
            apart.size,
            calm.size,
            float(np.median(apart)) if apart.size else math.nan,
            float(apart.max()) if apart.size else math.nan,
            float(calm.max()) if calm.size else math.nan,
        )


def _state(both: Sequence[Orbit | None]) -> int:
    known = [orbit for orbit in both if orbit is not None]
    return 2 if any(orbit.stable for orbit in known) else int(bool(known))


def _places(cube: xr.Dataset, along: str) -> list[dict[str, float]]:
    branches = ("direction", "draw", "sample")
    others = {
        name: cube[name].values.tolist()
        for name in cube.displacement.dims
        if name != along and name not in branches
    }
    return product(others, {})


def to_csv(found: Sequence[Range], compared: Sequence[Comparison], along: str) -> str:
    """Write one line per range, then one per comparison."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    others = list(compared[0].where)
    numbers = ("simulated", "compared", "settled", "median", "largest", "largest_settled")
    writer.writerow([*others, "row", f"{along}_lower", f"{along}_upper", "cut", *numbers])
    for span in found:
        place = [f"{value:g}" for value in span.where.values()]
        ends = [f"{span.lower:.6g}", f"{span.upper:.6g}", str(span.cut).lower()]
        writer.writerow([*place, span.kind, *ends, *([""] * len(numbers))])
    for item in compared:
        place = [f"{value:g}" for value in item.where.values()]
        counts = [str(getattr(item, name)) for name in numbers[:3]]
        sizes = [f"{getattr(item, name):.3g}" for name in numbers[3:]]
        writer.writerow([*place, "comparison", "", "", "", *counts, *sizes])
    return text.getvalue()


def to_markdown(
    found: Sequence[Range],
    compared: Sequence[Comparison],
    along: str,
    resolution: float,
    about: About,
) -> str:
    """Write the table a person reads."""
    names, what = [name.replace("_", " ") for name in compared[0].where], along.replace("_", " ")
    rows = []
    for item in compared:
        spans = [
            ", ".join(
                f"{one.lower:.4g}–{one.upper:.4g}{'+' if one.cut else ''}"
                for one in found
                if one.where == item.where and one.kind == kind
            )
            or "none"
            for kind in RANGES
        ]
        rows.append(
            [
                *(f"{value:g}" for value in item.where.values()),
                *spans,
                f"{item.compared} of {item.simulated}",
                _size(item.median),
                _size(item.largest),
                f"{_size(item.largest_settled)} ({item.settled})",
            ]
        )
    lines = [
        f"# {about.title}: two impacts per period",
        "",
        "The closed-form motion with one impact on each wall per forcing period: where its free "
        f"mass stays between the walls (exists) and where it is stable, in {what}, ends bisected "
        f"to {resolution:g}. `+`: the range reaches the end of the axis.",
        "",
        "Compared: of the runs where a stable motion exists, those with two visible impacts per "
        "period (others are on another attractor, or still on their way). Difference: the last "
        "sample's displacement or velocity less the closed form's, dimensionless. Near the ends "
        "of the stable range deviations die out slowly, and what is left of them is seen; settled "
        f"runs, whose samples agree to {_SETTLED:g}, show how well both agree.",
        "",
        fixed_values(about),
        "",
        *markdown_table(
            [
                *names,
                "exists",
                "stable",
                "compared",
                "median difference",
                "largest",
                "largest, settled (runs)",
            ],
            rows,
        ),
        *remarks(about),
    ]
    return "\n".join(lines) + "\n"


def _size(value: float) -> str:
    return "none" if math.isnan(value) else f"{value:.1e}"
