"""The score of every set of parameters for each statement: 1 as stated, 0 not at all.

Every score is documented in docs/calibration.md. A deviation by its tolerance halves a score, and
deviations add up like the legs of a right angle: the score falls as 2^-(sum of squares). A run that
stopped early counts as one without chatter.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import xarray as xr

from damper.papers.calibration.statements import (
    CHATTER_UP_TO,
    DURATION,
    HIGH,
    LOW,
    MIDDLE,
    ONSET,
    RESTITUTION_RANGE,
)


@dataclass(frozen=True)
class Tolerances:
    """Deviations that halve a score: in time, in the same unit, and as a part of a duration."""

    onset: float = 1.0
    duration: float = 1.0
    ratio: float = 0.1


@dataclass(frozen=True)
class Scored:
    """Scores of all sets, and what was measured to get them, over the sets' dimensions."""

    score: xr.DataArray
    measured: dict[str, xr.DataArray]


def score(name: str, cube: xr.Dataset, tolerances: Tolerances) -> Scored:
    """Score one statement.

    Parameters
    ----------
    name : str
        A key of `damper.papers.calibration.statements.STATEMENTS`.
    cube : xarray.Dataset
        With the observers' variables and the values of axes that the statement needs.
    tolerances : Tolerances

    Returns
    -------
    Scored
        Over the axes that the statement is not about. For B1 to B3 there are two more dimensions:
        `resonance` (frequencies below or above) and `counted` (complete chatter, or any).
    """
    return _SCORES[name](cube, tolerances)


def _clearance_range(cube: xr.Dataset, contact: bool) -> Scored:
    chatters = cube.chatter >= 1
    # Without clearance the masses are one.
    below = chatters.sel(clearance=(cube.clearance > 0.0) & (cube.clearance <= CHATTER_UP_TO))
    quiet = ~chatters
    if contact:
        quiet &= cube.impacts_per_period > 0.0
    share = below.mean("clearance")
    rest = quiet.sel(clearance=cube.clearance > CHATTER_UP_TO).mean("clearance")
    kind = "with impacts only" if contact else "without chatter"
    return Scored(share * rest, {"part that chatters below": share, f"part {kind} above": rest})


def _a1(cube: xr.Dataset, tolerances: Tolerances) -> Scored:
    return _clearance_range(cube, contact=False)


def _a1_contact(cube: xr.Dataset, tolerances: Tolerances) -> Scored:
    return _clearance_range(cube, contact=True)


def _a3(cube: xr.Dataset, tolerances: Tolerances) -> Scored:
    low = cube.sel(frequency_ratio=LOW)
    onset, duration = low.burst_at_onset, low.burst_at_duration
    far = ((onset - ONSET) / tolerances.onset) ** 2
    far = far + ((duration - DURATION) / tolerances.duration) ** 2
    value = _half_to_the(far).where(low.burst_at_complete == 1, 0.0)
    return Scored(value, {"onset": onset, "duration": duration})


def _a4(cube: xr.Dataset, tolerances: Tolerances) -> Scored:
    late = cube.isel(since=-1)
    low, middle = (late.sel(frequency_ratio=omega) for omega in (LOW, MIDDLE))
    complete = _part(low.chatter_complete, low.chatter_bursts) * _part(
        middle.chatter_complete, middle.chatter_bursts
    )
    ratio = middle.chatter_duration / low.chatter_duration
    value = complete * _half_to_the(((ratio - 1.0) / tolerances.ratio) ** 2)
    return Scored(value.fillna(0.0), {"duration at 0.25 over that at 0.20": ratio})


def _incomplete(cube: xr.Dataset, part: int) -> Scored:
    here = cube.isel(since=part).sel(frequency_ratio=HIGH)
    incomplete = here.chatter_bursts - here.chatter_complete
    value = _part(incomplete, incomplete + here.sticking_bursts)
    when = "since the start" if part == 0 else "late"
    return Scored(value, {f"stickings {when} at 0.30": here.sticking_bursts})


def _a5(cube: xr.Dataset, tolerances: Tolerances) -> Scored:
    return _incomplete(cube, -1)


def _a5_record(cube: xr.Dataset, tolerances: Tolerances) -> Scored:
    return _incomplete(cube, 0)


def _a7(cube: xr.Dataset, tolerances: Tolerances) -> Scored:
    first = cube.isel(since=0).sel(frequency_ratio=LOW).chatter_onset
    return Scored((first / ONSET).clip(max=1.0).fillna(0.0), {"first complete chatter": first})


def _chatter_in_r(cube: xr.Dataset) -> xr.DataArray:
    """Return whether each point chatters, with `counted` and `resonance` for the choices left.

    Frequencies on the other side of the resonance are missing: NaN.
    """
    both = xr.concat([cube.chatter == 2, cube.chatter >= 1], "counted")
    both = both.assign_coords(counted=["complete", "any"]).astype(float)
    sides = {"below": cube.frequency_ratio < 1.0, "above": cube.frequency_ratio > 1.0}
    kept = [both.where(side) for side in sides.values() if side.sum() > 1]
    names = [name for name, side in sides.items() if side.sum() > 1]
    if not kept:
        raise ValueError("frequency_ratio: needs two values or more on one side of 1")
    return xr.concat(kept, "resonance").assign_coords(resonance=names)


def _b1(cube: xr.Dataset, tolerances: Tolerances) -> Scored:
    somewhere = _chatter_in_r(cube).max(("mass_ratio", "frequency_ratio")) > 0.0
    r = cube.restitution
    stated = (r >= RESTITUTION_RANGE[0]) & (r <= RESTITUTION_RANGE[1])
    common = (somewhere & stated).sum("restitution")
    value = common / (somewhere | stated).sum("restitution")
    ends = {
        "least restitution": r.where(somewhere).min("restitution"),
        "greatest restitution": r.where(somewhere).max("restitution"),
    }
    return Scored(value, ends)


def _trend(cube: xr.Dataset, axis: str) -> Scored:
    """Score that the part of all restitutions that chatters falls along an axis.

    Of the steps between neighbouring values, at each value of the other axis, those that fall less
    those that rise, over all of them: 0 where there is no trend.
    """
    chatters = _chatter_in_r(cube).sortby(axis)
    width = chatters.sum("restitution", skipna=False)
    before, after = (width.isel({axis: part}) for part in (slice(None, -1), slice(1, None)))
    after = after.assign_coords({axis: before[axis]})
    # Steps that say nothing: nothing chatters on either side, or the frequency is elsewhere.
    known = (before + after) > 0.0
    votes = np.sign(before - after).where(known)
    value = votes.mean(("mass_ratio", "frequency_ratio")).fillna(0.0)
    return Scored(value.clip(min=0.0), {})


def _b2(cube: xr.Dataset, tolerances: Tolerances) -> Scored:
    return _trend(cube, "mass_ratio")


def _b3(cube: xr.Dataset, tolerances: Tolerances) -> Scored:
    return _trend(cube, "frequency_ratio")


_SCORES: dict[str, Callable[[xr.Dataset, Tolerances], Scored]] = {
    "A1": _a1,
    "A1_contact": _a1_contact,
    "A3": _a3,
    "A4": _a4,
    "A5": _a5,
    "A5_record": _a5_record,
    "A7": _a7,
    "B1": _b1,
    "B2": _b2,
    "B3": _b3,
}


def _half_to_the(exponent: xr.DataArray) -> xr.DataArray:
    return np.exp2(-exponent)


def _part(some: xr.DataArray, of_all: xr.DataArray) -> xr.DataArray:
    """Return a part of a whole; 0 where there is none of the whole."""
    return xr.where(of_all > 0, some / of_all.where(of_all > 0, 1), 0.0)
