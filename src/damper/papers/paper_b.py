"""Paper B's statements: restitution and chatter.

J. Low Freq. Noise Vib. Act. Control 2021, doi:10.1177/14613484211051849.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from damper.analysis.labels import label_of
from damper.analysis.places import within
from damper.analysis.sections import section_points
from damper.papers.base import (
    FAILS,
    HOLDS,
    READING,
    UNTESTABLE,
    Score,
    Scored,
    Statement,
    Tolerances,
    Values,
    Verdict,
)
from damper.papers.ranges import Range, chatter_ranges, ends
from damper.parameters.lazy import xr
from damper.parameters.names import counted
from damper.parameters.variables import CHATTER_IMPACTS, Chatter

Cubes = Mapping[str, "xr.Dataset"]
Ranges = Mapping[tuple[float, float], Range]

#: The text's numbers: restitutions between which all chatter lies, and the mass ratios.
CHATTER_FROM, CHATTER_UP_TO = 0.5, 0.9
MASS_RATIOS = (0.25, 0.1, 0.05, 0.001)
ABOVE, BELOW = "restitution", "restitution_below_resonance"
#: From this restitution on it counts as large.
_LARGE = 0.7
#: Relative change from the first to the last value below which nothing widens or narrows.
_LEAST_CHANGE = 0.05


class _Reading(NamedTuple):
    """A reading of a statement on the interval of chatter."""

    words: str
    ranges: Ranges
    cube: xr.Dataset
    least: int


def _readings(cubes: Cubes) -> Iterator[_Reading]:
    """Complete chatter or any, above the resonance or below it."""
    for least, kind in ((2, "complete"), (1, "any")):
        for name, side in ((ABOVE, "above"), (BELOW, "below")):
            words = f"{kind} chatter {side} resonance"
            yield _Reading(words, chatter_ranges(cubes[name], least), cubes[name], least)


def _falls(values: Sequence[float], step: float) -> bool:
    """Whether values fall clearly from the first to the last, and nowhere rise by over a step."""
    rises = any(after - before > 1.5 * step for before, after in pairwise(values))
    return not rises and values[0] - values[-1] > _LEAST_CHANGE * values[0]


def _judge_b1(cubes: Cubes) -> Verdict:
    """The range itself, and how it moves with the visibility threshold.

    At a threshold c the fifth impact of a burst is visible from r = c^(1/4) on, as long as the wall
    hardly moves meanwhile: there the lower end is that of the definition of chatter.
    """
    cube = cubes[ABOVE]
    rows = [
        (
            "threshold",
            "lower end",
            "fifth impact visible from",
            "upper end",
            "none at frequency ratio",
        )
    ]
    fitting = []
    for threshold in sorted(cube.threshold.values.tolist()):
        ranges = chatter_ranges(cube, 2, threshold)
        low, high = ends(ranges)
        visible = threshold ** (1.0 / (CHATTER_IMPACTS - 1))
        omegas = sorted({omega for _, omega in ranges})
        chatters = {omega for (_, omega), one in ranges.items() if not math.isnan(one.low)}
        none = ", ".join(f"{omega:g}" for omega in omegas if omega not in chatters)
        rows.append((f"{threshold:.0%}", f"{low:.3g}", f"{visible:.3f}", f"{high:.3g}", none))
        if within(low, low=CHATTER_FROM) and within(high, high=CHATTER_UP_TO):
            but = f" (none at frequency ratio {none} then)" if none else ""
            fitting.append(f"{threshold:.0%}{but}")
    low, high = ends(chatter_ranges(cube, 2))
    _, reach = ends(chatter_ranges(cube, 1))
    found = f"complete chatter above resonance in the table; any chatter up to {reach:.3g}"
    if within(low, low=CHATTER_FROM) and within(max(high, reach), high=CHATTER_UP_TO):
        return Verdict(found, HOLDS, "all chatter lies there", rows)
    if not fitting:
        why = "chatter extends beyond that range at every visibility threshold"
        return Verdict(found, FAILS, why, rows)
    why = (
        f"for complete chatter, at a visibility threshold c of {' or '.join(fitting)}; the lower "
        "end is about c^(1/4), it follows from the five-impact rule"
    )
    return Verdict(found, READING, why, rows)


def _judge_b4(cubes: Cubes) -> Verdict:
    """How much of the large restitutions chatters, over the mass ratio."""
    masses = sorted(cubes[ABOVE].mass_ratio.values)
    rows = [("reading", *(f"mass ratio {mass:g}" for mass in masses))]
    held = []
    for reading in _readings(cubes):
        chatter = reading.cube.chatter >= reading.least
        large = chatter.sel(restitution=within(chatter.restitution, low=_LARGE))
        share = large.mean(("frequency_ratio", "restitution")).sortby("mass_ratio")
        shares = share.values.tolist()
        rows.append((reading.words, *(f"{value:.0%}" for value in shares)))
        if _falls(shares, 1.0 / large.restitution.size):
            held.append(reading.words)
    return _summed(f"share of the restitutions from {_LARGE:g} on with chatter", held, rows)


def _judge_trend(cubes: Cubes, axis: str) -> Verdict:
    """Whether the interval gets shorter along an axis, at each value of the other one."""
    other = "frequency_ratio" if axis == "mass_ratio" else "mass_ratio"
    head = f"length (span) from the smallest {label_of(axis)} to the largest"
    rows = [("reading", label_of(other), head, "falls")]
    held = []
    for reading in _readings(cubes):
        step = float(abs(reading.cube.restitution.diff("restitution")).min())
        fall = []
        for value in reading.cube[other].values.tolist():
            # Ranges are those of (mass ratio, frequency ratio).
            pairs = ((one, value) for one in sorted(reading.cube[axis].values.tolist()))
            found = [reading.ranges[pair if axis == "mass_ratio" else pair[::-1]] for pair in pairs]
            fall.append(_falls([one.length for one in found], step))
            sizes = " ".join(f"{one.length:.3f} ({one.span:.3f})" for one in found)
            rows.append((reading.words, f"{value:g}", sizes, "yes" if fall[-1] else "no"))
        if all(fall):
            held.append(reading.words)
    return _summed(
        "lengths without gaps; in brackets from end to end (isolated points left out)", held, rows
    )


def _summed(measured: str, held: Sequence[str], rows: Sequence[Sequence[str]]) -> Verdict:
    """Judge by how many of the readings, the first cells of the rows, hold."""
    if not held:
        return Verdict(measured, FAILS, "under none of the readings in the table", rows)
    if set(held) == {reading for reading, *_ in rows[1:]}:
        return Verdict(measured, HOLDS, "under each reading", rows)
    return Verdict(measured, READING, " or ".join(held), rows)


def _judge_b5(cubes: Cubes) -> Verdict:
    """What our figures show: the text has lost what its own show."""
    portraits, histories = cubes["paper_b_portraits"], cubes["paper_b_histories"]
    points = section_points(portraits)
    restitutions = points.restitution.values
    listed = []
    for place in points.transpose(..., "restitution").values.reshape(-1, restitutions.size):
        listed.append(
            ", ".join(
                f"{r:g} ({counted(n, 'point')} on the section)"
                for r, n in zip(restitutions, place, strict=True)
            )
        )
    measured = (
        f"diagrams for {cubes[ABOVE].sizes['mass_ratio']} mass ratios; portraits at restitution "
        f"{'; '.join(listed)}; time histories for {histories.sizes['mass_ratio']} mass ratios, "
        f"{histories.sizes['frequency_ratio']} frequency ratios and "
        f"{histories.sizes['restitution']} restitutions"
    )
    return Verdict(measured, UNTESTABLE, "the text has lost what its figures show")


def _judge_b6(cubes: Cubes) -> Verdict:
    """Where motions have more than one point on the section, over the restitution."""
    edges = [CHATTER_FROM + k / 10.0 for k in range(6)]
    tenths = (f"{low:g} to {high:g}" for low, high in pairwise(edges))
    rows = [("reading", "first at restitution", f"up to {CHATTER_FROM:g}", *tenths)]
    held = []
    for name, side in ((ABOVE, "above"), (BELOW, "below")):
        several = section_points(cubes[name]) > 1
        r = several.restitution
        beneath = float(several.sel(restitution=within(r, high=CHATTER_FROM)).mean())
        shares = [
            float(several.sel(restitution=within(r, high=high) & ~within(r, high=low)).mean())
            for low, high in pairwise(edges)
        ]
        first = several.any([dim for dim in several.dims if dim != "restitution"])
        lowest = float(r.where(first).min())
        parts = (f"{share:.0%}" for share in (beneath, *shares))
        rows.append((f"{side} resonance", f"{lowest:.3g}", *parts))
        if beneath < shares[0] and shares == sorted(shares):
            held.append(f"{side} resonance")
    return _summed("share of the motions with more than one point on the section", held, rows)


def _chatter_in_r(cube: xr.Dataset) -> xr.DataArray:
    """Return whether each point chatters, with `counted` and `resonance` for the choices left.

    Frequencies on the other side of the resonance are missing: NaN.
    """
    both = xr.concat(
        [cube.chatter == Chatter.COMPLETE, cube.chatter >= Chatter.INCOMPLETE], "counted"
    )
    both = both.assign_coords(counted=["complete", "any"]).astype(float)
    omega = cube.frequency_ratio
    sides = {"below": ~within(omega, low=1.0), "above": ~within(omega, high=1.0)}
    kept = [both.where(side) for side in sides.values() if side.sum() > 1]
    names = [name for name, side in sides.items() if side.sum() > 1]
    if not kept:
        raise ValueError("frequency_ratio: needs two values or more on one side of 1")
    return xr.concat(kept, "resonance").assign_coords(resonance=names)


def _score_b1(cube: xr.Dataset, tolerances: Tolerances) -> Scored:
    somewhere = _chatter_in_r(cube).max(("mass_ratio", "frequency_ratio")) > 0.0
    r = cube.restitution
    stated = within(r, CHATTER_FROM, CHATTER_UP_TO)
    common = (somewhere & stated).sum("restitution")
    value = common / (somewhere | stated).sum("restitution")
    ends = {
        "least restitution": r.where(somewhere).min("restitution"),
        "greatest restitution": r.where(somewhere).max("restitution"),
    }
    return Scored(value, ends)


def _score_trend(cube: xr.Dataset, tolerances: Tolerances, axis: str) -> Scored:
    """Score that the part of all restitutions that chatters falls along an axis.

    Falling steps less rising steps, over all steps between neighbouring values at each value of the
    other axis: 0 without a trend.
    """
    chatters = _chatter_in_r(cube).sortby(axis)
    width = chatters.sum("restitution", skipna=False)
    before, after = (width.isel({axis: part}) for part in (slice(None, -1), slice(1, None)))
    after = after.assign_coords({axis: before[axis]})
    # Steps that say nothing: nothing chatters on either side, or the frequency is elsewhere.
    known = (before + after) > 0.0
    votes = np.sign(before - after).where(known)  # type: ignore[attr-defined]
    value = votes.mean(("mass_ratio", "frequency_ratio")).fillna(0.0)
    return Scored(value.clip(min=0.0), {})


_AXES = {
    "mass_ratio": Values(least=2),
    "frequency_ratio": Values(least=2),
    "restitution": Values(least=3),
}
_DIAGRAMS = ("restitution/figures/paper_b_fig_3",)

PAPER_B = (
    Statement(
        "B1",
        text="chatter only at restitutions above a half, up to nine tenths",
        where="abstract, and conclusion 2",
        stated=f"r > {CHATTER_FROM:g}; {CHATTER_FROM:g} to {CHATTER_UP_TO:g}",
        studies=(ABOVE, BELOW),
        figures=_DIAGRAMS,
        judge=_judge_b1,
        scores={
            "B1": Score(
                f"chatter lies in restitutions {CHATTER_FROM:g} to {CHATTER_UP_TO:g}",
                ("bursts",),
                _AXES,
                _score_b1,
            )
        },
    ),
    Statement(
        "B2",
        text="the smaller the mass ratio, the wider the interval of chatter",
        where="abstract, and conclusion 2",
        stated=f"mass ratios {', '.join(map(str, MASS_RATIOS))}",
        studies=(ABOVE, BELOW),
        figures=_DIAGRAMS,
        judge=partial(_judge_trend, axis="mass_ratio"),
        scores={
            "B2": Score(
                "the interval of restitution that chatters widens as the mass ratio falls",
                ("bursts",),
                _AXES,
                partial(_score_trend, axis="mass_ratio"),
            )
        },
    ),
    Statement(
        "B3",
        text="the higher the frequency ratio, the narrower the interval of chatter",
        where="abstract, and conclusion 2",
        stated="no number",
        studies=(ABOVE, BELOW),
        figures=_DIAGRAMS,
        judge=partial(_judge_trend, axis="frequency_ratio"),
        scores={
            "B3": Score(
                "it narrows as the frequency ratio rises",
                ("bursts",),
                _AXES,
                partial(_score_trend, axis="frequency_ratio"),
            )
        },
    ),
    Statement(
        "B4",
        text="at small mass ratio there is easily chatter even at large restitution",
        where="conclusion 3",
        stated="no number",
        studies=(ABOVE, BELOW),
        figures=_DIAGRAMS,
        judge=_judge_b4,
    ),
    Statement(
        "B5",
        text="the figures: bifurcation over the restitution, portraits before and after one, "
        "histories",
        where="Figs 2 to 17",
        stated=f"two mass ratios; {len(MASS_RATIOS)} mass ratios x 3 frequency ratios",
        studies=(ABOVE, "paper_b_portraits", "paper_b_histories"),
        figures=(
            "paper_b_portraits/figures/paper_b_fig_4",
            "paper_b_histories/figures/paper_b_fig_6",
        ),
        judge=_judge_b5,
    ),
    Statement(
        "B6",
        text="above a restitution of a half motions bifurcate, more and more of them",
        where="conclusion 1, on Figs 2 and 3",
        stated=f"r > {CHATTER_FROM:g}",
        studies=(ABOVE, BELOW),
        figures=("restitution/figures/paper_b_fig_2", *_DIAGRAMS),
        judge=_judge_b6,
    ),
)
