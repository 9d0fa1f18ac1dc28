"""How well a damper damps: best clearance, damped band, and what good damping goes with.

The reference is the primary's exact linear response without the damper. The best clearance (or
gap) is the one whose largest amplitude over the whole frequency range is smallest. Statements are
those of paper A that ``shared/design/model.md`` numbers A8 to A10, in our words.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import Field

from damper.analysis.best import least
from damper.study.fields import Faults, Number, Text
from damper.study.products import (
    Offer,
    Product,
    Role,
    fit_axis,
    need,
    need_one_run,
)
from damper.sweep.grid import product
from damper.tables import About, fixed_values, markdown_table, remarks

if TYPE_CHECKING:
    import xarray as xr

#: Rms ratio below which damping is good, and amplitude ratio below which the damped band lies.
GOOD, DAMPED = 0.5, 0.9
#: Two impacts per forcing period, to this tolerance, is the classical damper motion.
_TWO = 0.05
#: Relative distance from the resonance that still counts as near it.
NEAR = 0.1


@dataclass(frozen=True)
class Best:
    """The best clearance at one place along the other axes.

    `worst` is the largest amplitude over the range there, `beside` those at the neighbouring
    clearances (NaN beyond the axis), and `undamped` the one without a damper; `band` is the width
    of the frequencies whose amplitude ratio lies below the limit, `lowest` the smallest amplitude
    ratio and `at` its frequency; `interior` is False where the best clearance is the first or last
    one of the axis.
    """

    where: dict[str, float]
    clearance: float
    worst: float
    beside: tuple[float, float]
    undamped: float
    band: float
    lowest: float
    at: float
    impacts: float
    sticking: float
    chatter: int
    interior: bool


@dataclass(frozen=True)
class Statement:
    """A statement, what was measured, and whether it holds here; if in part, under what."""

    name: str
    text: str
    measured: str
    verdict: str
    condition: str = ""


class Performance(Product):
    """How well the damper damps: the best clearance, its band, statements on good damping."""

    along: Annotated[str, Text(), Field(description="Axis of the forcing frequency.")]
    over: Annotated[
        str,
        Text(),
        Field(description="Axis, such as the clearance, of which the best value is looked for."),
    ]
    good: Annotated[
        float, Number(gt=0, lt=1), Field(description="Rms ratio below which damping is good.")
    ] = GOOD
    damped: Annotated[
        float, Number(gt=0, le=1), Field(description="Amplitude ratio below which the band lies.")
    ] = DAMPED

    @classmethod
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        need(offer, faults, "response", "impacts", "bursts")
        need_one_run(offer, faults)
        name = settings.get("over")
        if isinstance(name, str) and name in offer.axes and name == settings.get("along"):
            faults.add(("over",), f"'{name}' is along already", "two distinct axes")
        for key in ("along", "over"):
            fit_axis(key, Role(least=2), settings, offer, faults)


def make(cube: xr.Dataset, settings: Mapping[str, Any], about: About) -> tuple[str, str]:
    """Find the best clearances and test the statements; see `damper.tables.make`."""
    along, over = settings["along"], settings["over"]
    found = best_clearances(cube, along, over, settings["damped"])
    tested = statements(cube, found, along, settings["good"])
    units = {name: _units(cube[name]) for name in (along, over, "peak_displacement")}
    return to_csv(found, along, over), to_markdown(found, tested, settings, about, units)


def best_clearances(cube: xr.Dataset, along: str, over: str, damped: float) -> list[Best]:
    """Best value of `over` at every place along the other axes.

    Parameters
    ----------
    cube : xarray.Dataset
        With the variables of the response, impacts and bursts observers.
    along, over : str
        Axis of the frequency, and axis that is chosen best.
    damped : float
        Amplitude ratio below which a frequency belongs to the band.

    Returns
    -------
    list of Best
    """
    others = {
        name: cube[name].values.tolist()
        for name in cube.amplitude_ratio.dims
        if name not in (along, over)
    }
    found = []
    for where in product(others, {}):
        here = cube.sel(where).transpose(over, along, ...)
        # Where a run stopped early nothing is known, so that clearance cannot be the best.
        worst = here.peak_displacement.max(along, skipna=False)
        if not np.isfinite(worst).any():
            continue
        place = least(worst.values)
        line = here.isel({over: place})
        ratio = line.amplitude_ratio.values
        low = int(np.argmin(ratio))
        point = line.isel({along: low})
        before, after = (
            float(worst[k]) if 0 <= k < worst.size else math.nan for k in (place - 1, place + 1)
        )
        found.append(
            Best(
                where,
                float(here[over][place]),
                float(worst[place]),
                (before, after),
                float((line.peak_displacement / line.amplitude_ratio).max()),
                float(_cells(line[along].values)[ratio < damped].sum()),
                float(ratio[low]),
                float(line[along][low]),
                float(point.impacts_per_period),
                float(point.sticking_fraction),
                int(point.chatter),
                0 < place < here.sizes[over] - 1,
            )
        )
    return found


def _cells(values: np.ndarray) -> np.ndarray:
    """Width of the cell around each value of an axis; the end cells are half ones."""
    order = np.argsort(values)
    edges = np.concatenate([values[order][:1], values[order], values[order][-1:]])
    widths = np.empty(len(values))
    widths[order] = 0.5 * (edges[2:] - edges[:-2])
    return widths


def statements(cube: xr.Dataset, found: list[Best], along: str, good: float) -> list[Statement]:
    """Test A8, A9 and A10 on a cube.

    Parameters
    ----------
    cube : xarray.Dataset
        With the variables of the response, impacts and bursts observers.
    found : list of Best
        From `best_clearances`.
    along : str
        Axis of the frequency.
    good : float
        Rms ratio below which damping is good.

    Returns
    -------
    list of Statement
    """
    contact = cube.impacts_per_period > 0.0
    lasting = (cube.chatter > 0) | (cube.sticking_fraction > 0.0)
    two = contact & ~lasting & (abs(cube.impacts_per_period - 2.0) < _TWO)
    well = contact & (cube.rms_ratio < good)
    return [
        _chatter_and_damping(cube, contact, contact & lasting, two, well, good),
        _plastic(cube, contact),
        _band(cube, found, two & well, along, good),
    ]


def _chatter_and_damping(
    cube: xr.Dataset,
    contact: xr.DataArray,
    lasting: xr.DataArray,
    two: xr.DataArray,
    well: xr.DataArray,
    good: float,
) -> Statement:
    text = "good damping goes together with chatter and sticking"
    if not (well.any() and lasting.any()):
        return Statement("A8", text, "no such points in this study", "not tested")
    among_good = float((well & lasting).sum() / well.sum())
    among_all = float(lasting.sum() / contact.sum())
    measured = (
        f"of the points with impacts {among_all:.0%} chatter or stick, of the well damped ones "
        f"(rms ratio < {good:g}) {among_good:.0%}; median rms ratio {_median(cube, lasting)} with "
        f"chatter or sticking, {_median(cube, two)} with two impacts per period and neither"
    )
    return Statement("A8", text, measured, _holds(among_good > among_all))


def _plastic(cube: xr.Dataset, contact: xr.DataArray) -> Statement:
    text = "restitution 0 sticks at once, without chatter"
    if "restitution" not in cube.coords or not (cube.restitution == 0.0).any():
        return Statement("A9", text, "restitution 0 is not in this study", "not tested")
    plastic = cube.restitution == 0.0
    chatter = int(((cube.chatter > 0) & plastic).sum())
    bursts = cube.bursts_per_period.where(contact & plastic, 0.0)
    sticks = float((bursts * cube.complete_fraction.fillna(0.0)).sum() / bursts.sum())
    measured = (
        f"{int((contact & plastic).sum())} points with impacts, {chatter} of them chatter; "
        f"{sticks:.0%} of the bursts end in sticking, after the others the wall draws away at once"
    )
    if chatter:
        return Statement("A9", text, measured, "does not hold")
    if sticks == 1.0:
        return Statement("A9", text, measured, "holds")
    condition = "the wall does not draw away at once"
    return Statement("A9", text, measured, "holds only in part", condition)


def _band(
    cube: xr.Dataset, found: list[Best], two: xr.DataArray, along: str, good: float
) -> Statement:
    text = (
        "low restitution damps over a wide frequency band; two impacts per period damp well only "
        "near resonance"
    )
    values = sorted({best.where["restitution"] for best in found if "restitution" in best.where})
    if len(values) < 2 or not two.any():
        return Statement("A10", text, "needs an axis of restitution and such points", "not tested")
    middle = 0.5 * (values[0] + values[-1])
    low = np.mean([best.band for best in found if best.where["restitution"] <= middle])
    high = np.mean([best.band for best in found if best.where["restitution"] > middle])
    reference = (cube.peak_displacement / cube.amplitude_ratio).max(
        [dim for dim in cube.amplitude_ratio.dims if dim != along]
    )
    resonance = float(reference.idxmax(along))
    near = abs(cube[along] - resonance) <= NEAR * resonance
    share = float((two & near).sum() / two.sum())
    places = cube[along].where(two)
    measured = (
        f"mean band at the best clearance {low:.3g} for restitution up to {middle:g}, {high:.3g} "
        f"above; {share:.0%} of the well damped points (rms ratio < {good:g}) with two impacts "
        f"per period lie within {NEAR:.0%} of the resonance, all from "
        f"{float(places.min()):g} to {float(places.max()):g}"
    )
    wider, narrow = low > high, share >= 0.9
    if wider == narrow:
        return Statement("A10", text, measured, _holds(wider))
    condition = "its first half is meant, the band" if wider else "its second half is meant"
    return Statement("A10", text, measured, "holds only in part", condition)


def _units(array: xr.DataArray) -> str:
    units = array.attrs.get("units", "1")
    return "" if units == "1" else f", {units}"


def _median(cube: xr.Dataset, points: xr.DataArray) -> str:
    return f"{float(cube.rms_ratio.where(points).median()):.2f}" if points.any() else "none"


def _holds(true: bool) -> str:
    return "holds" if true else "does not hold"


def to_csv(found: list[Best], along: str, over: str) -> str:
    """Write one line per place along the other axes."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    heads = (
        f"best_{over}",
        "worst_amplitude",
        "worst_amplitude_below",
        "worst_amplitude_above",
        "undamped_amplitude",
        "band",
        "lowest_amplitude_ratio",
        f"lowest_at_{along}",
        "impacts_per_period",
        "sticking_fraction",
        "chatter",
        "interior",
    )
    writer.writerow([*(found[0].where if found else ()), *heads])
    for best in found:
        writer.writerow([*(f"{value:g}" for value in best.where.values()), *_numbers(best)])
    return text.getvalue()


def _numbers(best: Best) -> Iterator[str]:
    for value in (
        best.clearance,
        best.worst,
        *best.beside,
        best.undamped,
        best.band,
        best.lowest,
        best.at,
        best.impacts,
        best.sticking,
    ):
        yield f"{value:.6g}"
    yield str(best.chatter)
    yield str(best.interior).lower()


def to_markdown(
    found: list[Best],
    tested: list[Statement],
    settings: Mapping[str, Any],
    about: About,
    units: Mapping[str, str],
) -> str:
    """Write the tables a person reads; `units` are those of both axes and of displacements."""
    along, over = (settings[role].replace("_", " ") for role in ("along", "over"))
    names = [name.replace("_", " ") for name in (found[0].where if found else ())]
    rows = [
        [
            *(f"{value:g}" for value in best.where.values()),
            f"{best.clearance:g}{'' if best.interior else ' (end of the axis)'}",
            f"{best.worst:.3g} of {best.undamped:.3g}",
            ", ".join(f"{worst:.3g}" for worst in best.beside if not math.isnan(worst)),
            f"{best.band:.3g}",
            f"{best.lowest:.3f} at {best.at:g}",
            f"{best.impacts:.2f}",
            f"{best.sticking:.0%}",
            ("none", "incomplete", "complete")[best.chatter],
        ]
        for best in found
    ]
    lines = [
        f"# {about.title}: damper performance",
        "",
        f"The best {over} is the one whose largest amplitude over the whole range of the {along} "
        "is smallest. The band is the part of that range, by its width, in which the amplitude at "
        f"the best {over} is below {settings['damped']:g} times the one without a damper. The last "
        "three columns belong to the point of the lowest amplitude ratio.",
        "",
        f"Beside it: the largest amplitudes at the neighbouring values of the {over}. Where motion "
        "is chaotic, amplitudes depend on the length of the record and on rounding, and what "
        "looks best may be chance: then these differ widely.",
        "",
        fixed_values(about),
        "",
        *markdown_table(
            [
                *names,
                f"best {over}{units[settings['over']]}",
                f"largest amplitude{units['peak_displacement']}",
                f"beside it{units['peak_displacement']}",
                f"band{units[settings['along']]}",
                "lowest amplitude ratio",
                "impacts per period",
                "time sticking",
                "chatter",
            ],
            rows,
        ),
        "",
        "## Statements of paper A, in our words",
        "",
        *markdown_table(
            ["", "statement", "found here", "verdict"],
            [[s.name, s.text, s.measured, s.verdict] for s in tested],
        ),
        "",
        "These verdicts are for the values of this study, which are assumed: the paper's are lost.",
        *remarks(about),
    ]
    return "\n".join(lines) + "\n"
