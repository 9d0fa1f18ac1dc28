"""Paper B's statements: restitution and chatter."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import xarray as xr

from damper.papers.claims import FAILS, HOLDS, ONLY_IF, Claim, Verdict
from damper.papers.claims.ranges import Range, chatter_ranges, section_points

ABOVE, BELOW = "restitution", "restitution_below_resonance"
#: Restitutions between which paper B has its chatter.
STATED_LOW, STATED_HIGH = 0.5, 0.9
#: From this restitution on it counts as large.
LARGE = 0.7
#: Relative change from the first to the last value below which nothing widens or narrows.
_LEAST_CHANGE = 0.05

Ranges = Mapping[tuple[float, float], Range]


class Reading(NamedTuple):
    """One way to read a statement on the interval of chatter."""

    words: str
    ranges: Ranges
    cube: xr.Dataset
    least: int


def readings(cubes: Mapping[str, xr.Dataset]) -> Iterator[Reading]:
    """Complete chatter or any, above the resonance or below it."""
    for least, bursts in ((2, "complete bursts alone"), (1, "incomplete bursts as well")):
        for name, side in ((ABOVE, "above"), (BELOW, "below")):
            words = f"{bursts} are counted, {side} resonance"
            yield Reading(words, chatter_ranges(cubes[name], least), cubes[name], least)


def falls(values: Sequence[float], step: float) -> bool:
    """Whether values fall clearly from the first to the last, and nowhere rise by over a step."""
    whole = values[0] - values[-1]
    return bool((np.diff(values) <= 1.5 * step).all() and whole > _LEAST_CHANGE * values[0])


def chatter_needs(cubes: Mapping[str, xr.Dataset]) -> Verdict:
    """B1: the range itself, and how it moves with the visibility threshold."""
    cube = cubes[ABOVE]
    fitting = []
    told = []
    for threshold in sorted(cube.threshold.values.tolist()):
        low, high = _hull(chatter_ranges(cube, 2, threshold))
        told.append(f"{low:.3g} to {high:.3g} at a threshold of {threshold:.0%}")
        if low >= STATED_LOW and high <= STATED_HIGH:
            fitting.append(f"{threshold:.0%}")
    low, high = _hull(chatter_ranges(cube, 2))
    _, reach = _hull(chatter_ranges(cube, 1))
    ours = (
        f"complete chatter above resonance for restitution {', '.join(told)}; "
        f"with incomplete bursts counted up to {reach:.3g}"
    )
    if low >= STATED_LOW and max(high, reach) <= STATED_HIGH:
        return Verdict(ours, HOLDS)
    if fitting:
        return Verdict(
            ours,
            ONLY_IF,
            "complete bursts alone are counted and an impact is visible from "
            f"{' or '.join(fitting)} of the burst's first approach speed",
        )
    return Verdict(ours, FAILS)


def _hull(ranges: Ranges) -> Range:
    found = [one for one in ranges.values() if not np.isnan(one.low)]
    if not found:
        return Range(np.nan, np.nan)
    return Range(min(one.low for one in found), max(one.high for one in found))


def widens_with_less_mass(cubes: Mapping[str, xr.Dataset]) -> Verdict:
    """B2: width of the range over the mass ratio, at each frequency."""

    def groups(cube: xr.Dataset) -> Iterator[tuple[str, list[tuple[float, float]]]]:
        masses = sorted(cube.mass_ratio.values.tolist())
        for frequency in cube.frequency_ratio.values.tolist():
            yield f"{frequency:g}", [(mass, frequency) for mass in masses]

    return _judge(cubes, groups, lambda one: one.width, "frequency ratio")


def narrows_with_frequency(cubes: Mapping[str, xr.Dataset]) -> Verdict:
    """B3: width of the range over the frequency ratio, at each mass ratio."""

    def groups(cube: xr.Dataset) -> Iterator[tuple[str, list[tuple[float, float]]]]:
        frequencies = sorted(cube.frequency_ratio.values.tolist())
        for mass in cube.mass_ratio.values.tolist():
            yield f"{mass:g}", [(mass, frequency) for frequency in frequencies]

    return _judge(cubes, groups, lambda one: one.width, "mass ratio")


def large_restitution(cubes: Mapping[str, xr.Dataset]) -> Verdict:
    """B4: how much of the large restitutions chatters, over the mass ratio."""
    told = []
    held = []
    for reading in readings(cubes):
        chatter = reading.cube.chatter >= reading.least
        large = chatter.sel(restitution=chatter.restitution >= LARGE)
        share = large.mean(("frequency_ratio", "restitution")).sortby("mass_ratio")
        shares = share.values.tolist()
        told.append(f"{', '.join(f'{value:.0%}' for value in shares)} if {reading.words}")
        if falls(shares, 1.0 / large.restitution.size):
            held.append(reading.words)
    masses = ", ".join(f"{mass:g}" for mass in sorted(cubes[ABOVE].mass_ratio.values))
    ours = (
        f"part of the restitutions from {LARGE:g} on that chatter, at mass ratios {masses}: "
        + "; ".join(told)
    )
    return _summed(ours, held, len(told))


def _judge(
    cubes: Mapping[str, xr.Dataset],
    groups: Callable[[xr.Dataset], Iterator[tuple[str, list[tuple[float, float]]]]],
    size: Callable[[Range], float],
    name: str,
) -> Verdict:
    """Judge whether sizes fall along each group of (mass ratio, frequency ratio), both rising."""
    told = []
    held = []
    for reading in readings(cubes):
        step = float(np.abs(np.diff(reading.cube.restitution.values)).min())
        lines = []
        good = 0
        for label, places in groups(reading.cube):
            sizes = [size(reading.ranges[place]) for place in places]
            lines.append(f"{label}: {' '.join(f'{value:.3f}' for value in sizes)}")
            good += falls(sizes, step)
        told.append(f"if {reading.words}, at {good} of {len(lines)} {name}s ({', '.join(lines)})")
        if good == len(lines):
            held.append(reading.words)
    other = "mass" if name == "frequency ratio" else "frequency"
    ours = f"width of the interval, from the smallest {other} ratio to the largest: "
    ours += "; ".join(told)
    return _summed(ours, held, len(told))


def _summed(ours: str, held: Sequence[str], count: int) -> Verdict:
    if len(held) == count:
        return Verdict(ours, HOLDS)
    return Verdict(ours, ONLY_IF, " or ".join(held)) if held else Verdict(ours, FAILS)


def figures_exist(cubes: Mapping[str, xr.Dataset]) -> Verdict:
    """B5: what the figures show, not whether they are the paper's."""
    portraits, histories = cubes["paper_b_portraits"], cubes["paper_b_histories"]
    points = section_points(portraits)
    restitutions = points.restitution.values
    told = []
    held = []
    for place in points.transpose(..., "restitution").values.reshape(-1, restitutions.size):
        told.append(
            ", ".join(
                f"{r:g} ({n} point{'s' if n > 1 else ''} on the section)"
                for r, n in zip(restitutions, place, strict=True)
            )
        )
        # Before and after a bifurcation the section differs in kind.
        held.append(place[-1] > place[0] > 0)
    ours = (
        f"diagrams for {cubes[ABOVE].sizes['mass_ratio']} mass ratios; portraits at restitution "
        f"{'; '.join(told)}; time histories for {histories.sizes['mass_ratio']} mass ratios, "
        f"{histories.sizes['frequency_ratio']} frequency ratios and "
        f"{histories.sizes['restitution']} restitutions"
    )
    return Verdict(ours, HOLDS if all(held) else FAILS)


def bifurcation_above_half(cubes: Mapping[str, xr.Dataset]) -> Verdict:
    """B6: where motions have more than one point on the section, over the restitution."""
    edges = np.arange(STATED_LOW, 1.0001, 0.1)
    told = []
    held = []
    for name, side in ((ABOVE, "above"), (BELOW, "below")):
        several = section_points(cubes[name]) > 1
        r = several.restitution
        beneath = float(several.sel(restitution=r <= STATED_LOW).mean())
        shares = [
            float(several.sel(restitution=(r > low + 1e-9) & (r <= high + 1e-9)).mean())
            for low, high in pairwise(edges)
        ]
        first = several.any([dim for dim in several.dims if dim != "restitution"])
        lowest = float(r.where(first).min())
        told.append(
            f"{side} resonance the first motion with more than one point on the section is at "
            f"restitution {lowest:.3g}; part of such motions {beneath:.0%} up to "
            f"{STATED_LOW:g}, then by tenths {', '.join(f'{share:.0%}' for share in shares)}"
        )
        if beneath < shares[0] and all(np.diff(shares) >= 0.0):
            held.append(f"one looks {side} resonance")
    return _summed("; ".join(told), held, len(told))


CLAIMS = (
    Claim(
        "B1",
        "there is chatter only above a restitution of a half, up to nine tenths",
        "r > 0.5; 0.5 to 0.9",
        ("restitution/figures/paper_b_fig_3",),
        chatter_needs,
    ),
    Claim(
        "B2",
        "the smaller the mass ratio, the wider the interval of chatter",
        "mass ratios 0.25, 0.1, 0.05, 0.001",
        ("restitution/figures/paper_b_fig_3",),
        widens_with_less_mass,
    ),
    Claim(
        "B3",
        "the higher the frequency ratio, the narrower the interval of chatter",
        "no number",
        ("restitution/figures/paper_b_fig_3",),
        narrows_with_frequency,
    ),
    Claim(
        "B4",
        "at small mass ratio even a large restitution chatters easily",
        "no number",
        ("restitution/figures/paper_b_fig_3",),
        large_restitution,
    ),
    Claim(
        "B5",
        "the figures: bifurcation over the restitution, portraits before and after one, histories",
        "two mass ratios; 4 mass ratios x 3 frequency ratios",
        ("paper_b_portraits/figures/paper_b_fig_4", "paper_b_histories/figures/paper_b_fig_6"),
        figures_exist,
    ),
    Claim(
        "B6",
        "above a restitution of a half motions bifurcate, and ever more of them",
        "r > 0.5",
        ("restitution/figures/paper_b_fig_2", "restitution/figures/paper_b_fig_3"),
        bifurcation_above_half,
    ),
)
