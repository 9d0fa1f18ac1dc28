"""Paper A's statements: chatter over clearance and frequency, single bursts, damping."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import xarray as xr

from damper.analysis.accumulation_errors import ORDERS, QUANTITIES, agreements
from damper.papers.claims import FAILS, HOLDS, ONLY_IF, UNTESTED, Claim, Verdict
from damper.papers.claims.ranges import range_of, section_points
from damper.tables import DAMPED, GOOD
from damper.tables.performance import best_clearances, statements

Cubes = Mapping[str, xr.Dataset]

#: Paper A's numbers, as they stand in its text.
CHATTER_UP_TO = 1.35
ONSET, DURATION = 332.0, 11.0
SLOW, MIDDLE, FAST = 0.20, 0.25, 0.30
#: What "about" and "nearly" may mean, relative.
ABOUT = 0.1
#: Part of the steady bursts that must complete for chatter to be complete.
_MOSTLY = 0.9
#: How far the onset may be from the stated one: within one half period every burst has a chance.
NEAR_ONSET = 5.0
#: Fewer visible impacts are no chatter.
CHATTER_IMPACTS = 5
#: More points on the section than this part of its samples are neither a short period nor a gap.
_MANY = 0.2


def chatter_over_clearance(cubes: Cubes) -> Verdict:
    """A1: the range of chatter, and how regular motions are above it."""
    cube = cubes["paper_a_clearance"].sortby("clearance")
    others = [dim for dim in cube.chatter.dims if dim != "clearance"]
    stacked = cube.stack(place=others) if others else cube.expand_dims("place", -1)
    told = []
    held = []
    for k in range(stacked.sizes["place"]):
        line = stacked.isel(place=k)
        label = ", ".join(f"{name.replace('_', ' ')} is {float(line[name]):g}" for name in others)
        chatter = line.chatter.values > 0
        d = line.clearance.values
        found = range_of(d, chatter)
        share = float(chatter[d <= CHATTER_UP_TO].mean())
        several = section_points(line).values[d > CHATTER_UP_TO]
        regular = float((several <= max(1.0, _MANY * line.sizes["sample"])).mean())
        contact = line.impacts_per_period.values[d > CHATTER_UP_TO] > 0.0
        told.append(
            (f"where {label}: " if label else "")
            + f"chatter at clearances {found.low:.3g} to {found.high:.3g}, at {share:.0%} of those "
            f"up to {CHATTER_UP_TO:g}; above that {contact.mean():.0%} have impacts and "
            f"{regular:.0%} a short period"
        )
        if abs(found.high - CHATTER_UP_TO) <= ABOUT * CHATTER_UP_TO and share >= 0.9:
            held.append(label or "all")
    ours = "; ".join(told)
    if not held:
        return Verdict(ours, FAILS)
    return Verdict(ours, HOLDS) if len(held) == len(told) else Verdict(ours, ONLY_IF, held[0])


def diagram_over_frequency(cubes: Cubes) -> Verdict:
    """A2: whether the diagram shows bifurcations at all."""
    cube = cubes["paper_a_frequency"].sortby("frequency_ratio")
    points = section_points(cube).values.reshape(-1, cube.sizes["frequency_ratio"])[0]
    changes = int((np.diff((points > 1).astype(int)) != 0).sum())
    chatter = float((cube.chatter > 0).mean())
    omega = cube.frequency_ratio.values
    ours = (
        f"{omega.size} frequency ratios from {omega.min():g} to {omega.max():g}: motions change "
        f"{changes} times between one point on the section and several; {chatter:.0%} chatter"
    )
    return Verdict(ours, HOLDS if changes else FAILS)


def _bursts(cube: xr.Dataset, frequency: float) -> xr.Dataset:
    """Chatter bursts at one frequency ratio, in order."""
    names = ("onset", "duration", "complete", "visible_impacts", "sticking_time")
    line = cube.sel(frequency_ratio=frequency, method="nearest", tolerance=1e-9)
    bursts = line[[f"burst_{name}" for name in names]]
    return bursts.isel(burst=(line.burst_visible_impacts >= CHATTER_IMPACTS).values)


def burst_at_low_frequency(cubes: Cubes) -> Verdict:
    """A3: the chatter burst whose onset is nearest to the stated one, and the first one."""
    bursts = _bursts(cubes["paper_a_histories"], SLOW)
    if not bursts.sizes["burst"]:
        return Verdict("no chatter", FAILS)
    near = bursts.isel(burst=int(np.argmin(np.abs(bursts.burst_onset.values - ONSET))))
    onset, duration = float(near.burst_onset), float(near.burst_duration)
    complete = bool(near.burst_complete == 1)
    first = float(bursts.burst_onset[0])
    ours = (
        f"the chatter burst nearest to {ONSET:g} begins at {onset:.4g} and lasts {duration:.4g}, "
        + ("complete" if complete else "incomplete")
        + f", followed by {float(near.burst_sticking_time):.3g} of sticking; "
        f"the first chatter burst begins at {first:.4g}"
    )
    if not (
        complete
        and abs(onset - ONSET) <= NEAR_ONSET
        and abs(duration - DURATION) <= ABOUT * DURATION
    ):
        return Verdict(ours, FAILS)
    if first >= onset:
        return Verdict(ours, HOLDS)
    return Verdict(ours, ONLY_IF, "the burst is one of many, not the first")


def same_duration(cubes: Cubes) -> Verdict:
    """A4: steady durations of complete chatter at the two lower frequencies."""
    cube = cubes["paper_a_histories"]
    slow, middle = (_steady(_bursts(cube, frequency)) for frequency in (SLOW, MIDDLE))
    durations = [
        float(b.burst_duration.where(b.burst_complete == 1).median()) for b in (slow, middle)
    ]
    ratio = durations[1] / durations[0]
    shares = [
        float((b.burst_complete == 1).mean()) if b.sizes["burst"] else 0.0 for b in (slow, middle)
    ]
    ours = (
        f"in the last half of the record {shares[0]:.0%} and {shares[1]:.0%} of the chatter bursts "
        f"are complete and last {durations[0]:.4g} and {durations[1]:.4g}, a ratio of {ratio:.3g} "
        f"(in forcing periods {ratio * MIDDLE / SLOW:.3g})"
    )
    if min(shares) < _MOSTLY:
        return Verdict(ours, FAILS)
    if abs(ratio - 1.0) <= ABOUT:
        return Verdict(ours, HOLDS)
    if abs(ratio * MIDDLE / SLOW - 1.0) <= ABOUT:
        return Verdict(ours, ONLY_IF, "durations are compared in forcing periods")
    return Verdict(ours, FAILS)


def _steady(bursts: xr.Dataset) -> xr.Dataset:
    """Bursts that begin in the second half of the record."""
    if not bursts.sizes["burst"]:
        return bursts
    last = float(bursts.burst_onset.max())
    return bursts.isel(burst=(bursts.burst_onset > 0.5 * last).values)


def incomplete_at_high_frequency(cubes: Cubes) -> Verdict:
    """A5: complete bursts at the highest frequency, early and late."""
    bursts = _bursts(cubes["paper_a_histories"], FAST)
    if not bursts.sizes["burst"]:
        return Verdict("no chatter", FAILS)
    late = _steady(bursts)
    complete = bursts.burst_onset.values[bursts.burst_complete.values == 1]
    in_late = int((late.burst_complete == 1).sum())
    ours = (
        f"{bursts.sizes['burst']} chatter bursts, {complete.size} of them complete"
        + (f" (the last one begins at {complete.max():.4g})" if complete.size else "")
        + f"; of the {late.sizes['burst']} in the last half {in_late} are"
    )
    if not complete.size:
        return Verdict(ours, HOLDS)
    if in_late or not late.sizes["burst"]:
        return Verdict(ours, FAILS)
    return Verdict(ours, ONLY_IF, "the transient is left out")


def prediction(cubes: Cubes) -> Verdict:
    """A6: completion time and point predicted from the first impact of each burst."""
    told = []
    good = {}
    for order in ORDERS:
        found = [one for one in agreements(cubes["accumulation"], ABOUT) if one.order == order]
        parts = {
            quantity: [
                one.first.worst_part
                for one in found
                if one.quantity == quantity and one.first.predicted
            ]
            for quantity in QUANTITIES
        }
        if not all(parts.values()):
            return Verdict("no complete burst with a prediction at its first impact", FAILS)
        shares = {
            quantity: float(np.mean([part <= ABOUT for part in values]))
            for quantity, values in parts.items()
        }
        later = max(one.within.worst for one in found)
        told.append(
            f"{order} order: at {shares['time']:.0%} of {len(parts['time'])} places every "
            f"completion time, at {shares['displacement']:.0%} every completion point is predicted "
            f"within {ABOUT:.0%} from the burst's first impact (worst {max(parts['time']):.0%} "
            f"and {max(parts['displacement']):.0%}); "
            + (
                f"from impact {later:.0f} on all are"
                if later < np.inf
                else "no impact is listed from which all are"
            )
        )
        good[order] = min(shares.values()) == 1.0, later
    ours = "; ".join(told)
    if all(first for first, _ in good.values()):
        return Verdict(ours, HOLDS)
    if good["second"][0]:
        return Verdict(ours, ONLY_IF, "the second-order formula is used")
    later = good["second"][1]
    if later < np.inf:
        condition = f"the prediction is made from impact {later:.0f} of the burst or a later one"
        return Verdict(ours, ONLY_IF, condition)
    return Verdict(ours, FAILS)


def after_a_transient(cubes: Cubes) -> Verdict:
    """A7: how long it takes from rest to the first chatter, and to the first that completes."""
    cube = cubes["paper_a_histories"]
    told = []
    first, complete = [], []
    for frequency in (SLOW, MIDDLE, FAST):
        bursts = _bursts(cube, frequency)
        period = 2.0 * np.pi / frequency
        if not bursts.sizes["burst"]:
            told.append(f"none at {frequency:g}")
            continue
        onsets = bursts.burst_onset.values / period
        first.append(float(onsets[0]))
        told.append(f"at frequency ratio {frequency:g} after {first[-1]:.3g} forcing periods")
        completing = onsets[bursts.burst_complete.values == 1]
        if completing.size:
            complete.append(float(completing[0]))
            told[-1] += f", the first that completes after {complete[-1]:.3g}"
    ours = "first chatter burst from rest " + "; ".join(told)
    # Less than a period from rest is no transient worth the name.
    if first and min(first) > 1.0:
        return Verdict(ours, HOLDS)
    if complete and min(complete) > 1.0:
        return Verdict(ours, ONLY_IF, "chatter that completes is meant")
    return Verdict(ours, FAILS)


def _performance(number: int) -> Callable[[Cubes], Verdict]:
    """A8 to A10, as the performance table judges them."""

    def judge(cubes: Cubes) -> Verdict:
        cube = cubes["performance"]
        found = best_clearances(cube, "frequency_ratio", "clearance", DAMPED)
        statement = statements(cube, found, "frequency_ratio", GOOD)[number]
        if statement.verdict == "not tested":
            return Verdict("", UNTESTED, statement.measured)
        if statement.verdict == "holds only in part":
            return Verdict(statement.measured, ONLY_IF, statement.condition)
        return Verdict(statement.measured, statement.verdict)

    return judge


def duration_and_amplitude(cubes: Cubes) -> Verdict:
    """A11: elasticities of the duration of complete bursts, by least squares in logarithms."""
    cube = cubes["burst_duration"]
    names = ("clearance", "frequency_ratio", "damping_ratio")
    complete = cube.burst_at_duration.where(cube.burst_at_complete == 1)
    points = complete.stack(point=complete.dims).dropna("point")
    columns = [np.log(points[name].values) for name in names]
    columns.append(np.ones(points.size))
    logs = np.log(points.values)
    powers = np.linalg.lstsq(np.stack(columns, axis=1), logs, rcond=None)[0]
    # A larger force is a smaller clearance, since lengths are scaled by F0/K.
    amplitude, frequency, damping = -powers[0], powers[1], powers[2]
    ours = (
        f"over {points.size} points with complete bursts their duration goes as the power "
        f"{amplitude:.2f} of the force amplitude, {frequency:.2f} of the frequency and "
        f"{damping:.2f} of the damping ratio; in forcing periods the power of the frequency is "
        f"{frequency + 1.0:.2f}"
    )
    if abs(amplitude) > max(abs(frequency), abs(damping)):
        return Verdict(ours, HOLDS)
    if abs(amplitude) > max(abs(frequency + 1.0), abs(damping)):
        return Verdict(ours, ONLY_IF, "duration is measured in forcing periods")
    return Verdict(ours, FAILS)


CLAIMS = (
    Claim(
        "A1",
        "over the clearance there is chatter up to a limit, else periodic or quasi-periodic",
        "chatter at d = 0 to 1.35 of 0 to 2",
        ("paper_a_clearance/figures/paper_a_fig_3",),
        chatter_over_clearance,
    ),
    Claim(
        "A2",
        "a bifurcation diagram over the frequency ratio",
        "no number",
        ("paper_a_frequency/figures/paper_a_fig_4",),
        diagram_over_frequency,
    ),
    Claim(
        "A3",
        "at frequency ratio 0.20 a complete burst of chatter",
        "starts at about t = 332, lasts about 11",
        ("paper_a_histories/figures/paper_a_fig_5",),
        burst_at_low_frequency,
    ),
    Claim(
        "A4",
        "at 0.25 chatter is complete as well and lasts nearly as long",
        "nearly the same duration",
        ("paper_a_histories/figures/paper_a_fig_6",),
        same_duration,
    ),
    Claim(
        "A5",
        "at 0.30 chatter is incomplete, without sticking",
        "no number",
        ("paper_a_histories/figures/paper_a_fig_7",),
        incomplete_at_high_frequency,
    ),
    Claim(
        "A6",
        "predicted completion point and duration agree with the simulation",
        "no number",
        ("accumulation/figures/error_frequency_ratio~0.2",),
        prediction,
    ),
    Claim(
        "A7",
        "chatter appears only after a complicated transient",
        "no number",
        ("paper_a_histories/figures/paper_a_fig_5",),
        after_a_transient,
    ),
    Claim(
        "A8",
        "good damping goes together with chatter and sticking",
        "no number",
        ("performance/figures/rms_ratio",),
        _performance(0),
    ),
    Claim(
        "A9",
        "restitution 0 sticks at once, without chatter",
        "r = 0",
        ("performance/figures/rms_ratio",),
        _performance(1),
    ),
    Claim(
        "A10",
        "low restitution damps over a wide band; two impacts per cycle only near resonance",
        "no number",
        ("performance/figures/best_clearance",),
        _performance(2),
    ),
    Claim(
        "A11",
        "the duration of chatter follows the amplitude more than frequency or damping ratio",
        "cited from work on a pendulum",
        ("burst_duration/figures/burst_duration",),
        duration_and_amplitude,
    ),
)
