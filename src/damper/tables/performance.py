"""How well a damper damps: best clearance, damped band, and what good damping goes with.

The reference is the primary's exact linear response without the damper. The best clearance (or
gap) is the one whose largest amplitude over the whole frequency range is smallest.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar

from pydantic import Field

from damper.analysis.labels import label_of
from damper.analysis.optimum import DAMPED, GOOD, NEAR, best_clearance, damping_shares
from damper.analysis.places import in_handy_units
from damper.analysis.reduction import runs_over
from damper.parameters.lazy import pd, xr
from damper.parameters.units import units_of
from damper.study.fields import Text
from damper.study.messages import Mistakes
from damper.study.products import REDUCTIONS, Product, Role, StudyContents, Worst, need
from damper.study.yaml_file import join_names
from damper.tables import Table, number, place_cells, with_units

_FREQUENCIES = ("frequency_ratio", "forcing_frequency")


class Performance(Product):
    """How well the damper damps: the best clearance, its band, statements on good damping."""

    needs = ("response", "impacts", "bursts")
    roles: ClassVar[Mapping[str, Role]] = {
        "along": Role(least=2),
        "over": Role(least=2),
        "worst": REDUCTIONS["worst"],
    }

    along: Annotated[Text, Field(description="Axis of the forcing frequency.")]
    over: Annotated[
        Text,
        Field(description="Axis, such as the clearance, of which the best value is looked for."),
    ]
    worst: Worst = None
    good: Annotated[
        float, Field(gt=0, lt=1, description="Rms ratio below which damping is good.")
    ] = GOOD
    damped: Annotated[
        float, Field(gt=0, le=1, description="Amplitude ratio below which the band lies.")
    ] = DAMPED

    def check_against(self, study: StudyContents, mistakes: Mistakes) -> None:
        need(study, mistakes, *self.needs)
        used = self.take_roles(study, mistakes)
        if self.along in used and self.along not in _FREQUENCIES:
            message = f"'{self.along}' is no frequency of the force"
            mistakes.add(("along",), message, join_names(_FREQUENCIES))
        for name in study.branches:
            if name not in used:
                message = f"the study has several runs at each point ({name})"
                mistakes.add((), message, f"worst: [{name}]")


def make(results: Mapping[str, Any], settings: Performance) -> Table:
    """Show the best clearances and what good damping goes with."""
    cube = results["cube"]
    along, over = settings.along, settings.over
    worst = settings.worst or ()
    data = best_clearance(cube, along, over, settings.damped, worst)
    shares = damping_shares(cube, along, settings.good)
    frequency, clearance = label_of(along), label_of(over)
    body = [
        f"The best {clearance} is the one whose largest amplitude over the whole range of the "
        f"{frequency}{_of_all(cube, worst)} is smallest. The band is the part of that range, by "
        f"its width, in which the amplitude at the best {clearance} is below "
        f"{settings.damped:g} times the one without a damper. Amplified is the part in which it "
        "is larger than that one, and up to how many times. The last three columns belong to the "
        "point of the lowest amplitude ratio.",
        f"Beside it: the largest amplitudes at the neighbouring values of the {clearance}. Where "
        "motion is chaotic, amplitudes depend on the length of the window and on rounding, and "
        "what looks best may be chance: then these differ widely.",
        _best(in_handy_units(cube), along, over, settings.damped, worst),
        "## What good damping goes with",
        f"Good damping: an rms ratio below {settings.good:g}. Only runs with impacts count.",
        _shares(shares, with_units(f"{frequency} of these", cube[along])),
    ]
    return Table.of(cube, "damper performance", data, body)


def _of_all(cube: xr.Dataset, worst: Sequence[str]) -> str:
    return f" and over {runs_over(cube, worst)}" if worst else ""


def _best(
    cube: xr.Dataset, along: str, over: str, damped: float, worst: Sequence[str]
) -> pd.DataFrame:
    data = best_clearance(cube, along, over, damped, worst)
    length = cube.peak_displacement
    others = list(data.columns[: data.columns.get_loc(f"best_{over}")])
    rows = [
        {
            **place_cells({name: row[name] for name in others}, cube),
            with_units(f"best {label_of(over)}", cube[over]): f"{row[f'best_{over}']:.4g}"
            + ("" if row["interior"] else " (end of the axis)")
            + (f" ({row['equally_good']} more as good)" if row["equally_good"] else ""),
            with_units("largest amplitude", length): f"{row['worst_amplitude']:.3g} of "
            f"{row['undamped_amplitude']:.3g}",
            with_units("beside it", length): ", ".join(
                f"{worst:.3g}"
                for worst in (row["worst_amplitude_below"], row["worst_amplitude_above"])
                if not math.isnan(worst)
            ),
            with_units("band", cube[along]): f"{row['band']:.3g}",
            with_units("amplified", cube[along]): f"{row['amplified']:.3g}, up to "
            f"{row['highest_amplitude_ratio']:.2f} times"
            if row["amplified"]
            else "0",
            "lowest amplitude ratio": f"{row['lowest_amplitude_ratio']:.3f} at "
            f"{row[f'lowest_at_{along}']:g} {units_of(cube[along].attrs)}".removesuffix(" 1"),
            "impacts per period": f"{row['impacts_per_period']:.2f}",
            "time sticking": f"{row['sticking_fraction']:.0%}",
            "chatter": ("none", "incomplete", "complete")[row["chatter"]],
        }
        for row in data.to_dict("records")
    ]
    return pd.DataFrame(rows)


def _shares(shares: Mapping[str, float], range_of: str) -> pd.DataFrame:
    def percent(name: str) -> str:
        return number(shares[name], ".0%")

    def median(name: str) -> str:
        return number(shares[name], ".2f")

    ends = f"{shares['lowest']:g} to {shares['highest']:g}"
    rows = [
        ("runs with impacts", f"{shares['with_impacts']}"),
        ("share of them that chatters or sticks", percent("lasting")),
        ("median rms ratio of these", median("median_rms_lasting")),
        (
            "median rms ratio with two impacts per period, neither chatter nor sticking",
            median("median_rms_two_impacts"),
        ),
        ("well damped runs", f"{shares['well_damped']}"),
        ("share of them that chatters or sticks", percent("lasting_well_damped")),
        (
            "well damped runs with two impacts per period, neither chatter nor sticking",
            f"{shares['well_damped_two_impacts']}",
        ),
        (f"share of these within {NEAR:.0%} of the resonance", percent("near_resonance")),
        (range_of, "none" if math.isnan(shares["lowest"]) else ends),
        (
            f"share of the runs with impacts more than {NEAR:.0%} below the resonance whose rms "
            "is larger than without damper",
            percent("amplified_below"),
        ),
        ("the same above the resonance", percent("amplified_above")),
    ]
    return pd.DataFrame(rows, columns=["", "found here"])
