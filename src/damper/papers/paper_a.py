"""Paper A's statements: chatter over clearance and frequency, single bursts, damping.

Adv. Mech. Eng. 2017, doi:10.1177/1687814017743110.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial

import numpy as np

from damper.analysis.accumulation import PREDICTED, accumulation_errors
from damper.analysis.bursts import burst_statistics, list_bursts
from damper.analysis.labels import label_of
from damper.analysis.optimum import GOOD, NEAR, best_clearance, damping_shares
from damper.analysis.places import within
from damper.analysis.sections import section_points
from damper.papers.base import (
    FAILS,
    HOLDS,
    READING,
    UNTESTABLE,
    UNTESTED,
    Score,
    Scored,
    Statement,
    Tolerances,
    Values,
    Verdict,
)
from damper.papers.ranges import range_of
from damper.parameters.lazy import pd, xr
from damper.parameters.variables import Chatter

Cubes = Mapping[str, "xr.Dataset"]

#: The text's numbers: the clearances of its first diagram and those up to which it has chatter,
#: the frequency ratios of its time histories, and the chatter at the lowest one.
WIDEST, CHATTER_UP_TO = 2.0, 1.35
LOW, MIDDLE, HIGH = 0.20, 0.25, 0.30
ONSET, DURATION = 332.0, 11.0
#: What "about" and "nearly" may mean, relative.
_ABOUT = 0.1
#: Part of the steady bursts that must complete for chatter to be complete.
_MOSTLY = 0.9
#: How far the onset may be from the stated one: within one half period every burst has a chance.
_NEAR_ONSET = 5.0
#: Part of a burst that must be to come for a prediction of its end to be one.
_TO_COME = 0.5
#: More points on the section than this part of its samples are neither a short period nor a gap.
_MANY = 0.2


def _judge_a1(cubes: Cubes) -> Verdict:
    """The range of chatter, and how regular motions are above it."""
    cube = cubes["paper_a_clearance"].sortby("clearance")
    others = [dim for dim in cube.chatter.dims if dim != "clearance"]
    stacked = cube.stack(place=others) if others else cube.expand_dims("place", -1)
    rows: list[tuple[str, ...]] = [
        (
            "where",
            "range of d with chatter (isolated points left out)",
            f"share with chatter up to {CHATTER_UP_TO:g}",
            *(f"{what} above {CHATTER_UP_TO:g}" for what in ("with impacts", "of short period")),
        )
    ]
    held, missed = [], []
    for k in range(stacked.sizes["place"]):
        line = stacked.isel(place=k)
        label = ", ".join(f"{label_of(name)} {float(line[name]):g}" for name in others)
        chatter = line.chatter.values > 0
        d = line.clearance.values
        found = range_of(d, chatter)
        below = within(d, high=CHATTER_UP_TO)
        share = float(chatter[below].mean())
        several = section_points(line).values[~below]
        regular = float((several <= max(1.0, _MANY * line.sizes["sample"])).mean())
        contact = line.impacts_per_period.values[~below] > 0.0
        span = f"{found.low:.3g} to {found.high:.3g}"
        parts = (f"{part:.0%}" for part in (share, contact.mean(), regular))
        rows.append((label or "everywhere", span, *parts))
        near = abs(found.high - CHATTER_UP_TO) <= _ABOUT * CHATTER_UP_TO
        if near and share >= 0.9:
            held.append(label)
        else:
            missed.append(f"{label} chatter {'has gaps' if near else f'ends at {found.high:.3g}'}")
    measured = "the clearances with chatter, and the motions above them"
    fills = f"the range up to {CHATTER_UP_TO:g}"
    if not held:
        return Verdict(measured, FAILS, f"chatter does not fill {fills} and end there", rows)
    if not missed:
        return Verdict(measured, HOLDS, f"chatter fills {fills} and ends there", rows)
    why = "; for ".join([f"for {' and '.join(held)}", *missed])
    return Verdict(measured, READING, why, rows)


def _score_a1(cube: xr.Dataset, tolerances: Tolerances, contact: bool = False) -> Scored:
    chatters = cube.chatter > Chatter.NONE
    in_range = within(cube.clearance, high=CHATTER_UP_TO)
    # Without clearance the masses are one.
    below = chatters.sel(clearance=in_range & (cube.clearance > 0.0))
    quiet = ~chatters
    if contact:
        quiet &= cube.impacts_per_period > 0.0
    share = below.mean("clearance")
    rest = quiet.sel(clearance=~in_range).mean("clearance")
    kind = "with impacts only" if contact else "without chatter"
    return Scored(share * rest, {"part that chatters below": share, f"part {kind} above": rest})


def _judge_a2(cubes: Cubes) -> Verdict:
    """What our diagram shows: the text names one, and no more."""
    cube = cubes["paper_a_frequency"].sortby("frequency_ratio")
    points = section_points(cube).values.reshape(-1, cube.sizes["frequency_ratio"])[0]
    changes = int((np.diff((points > 1).astype(int)) != 0).sum())
    chatter = float((cube.chatter > Chatter.NONE).mean())
    omega = cube.frequency_ratio.values
    measured = (
        f"{omega.size} frequency ratios from {omega.min():g} to {omega.max():g}: motions change "
        f"{changes} times between one point on the section and several; {chatter:.0%} chatter"
    )
    return Verdict(measured, UNTESTABLE, "the text has lost what its diagram shows")


def _chatter(cubes: Cubes, frequency: float) -> pd.DataFrame:
    """Chatter bursts at one frequency ratio, in order."""
    cube = cubes["paper_a_histories"]
    line = cube.sel(frequency_ratio=frequency, method="nearest", tolerance=1e-9)
    found = list_bursts(line)
    return found[found["chatter"]]


def _judge_a3(cubes: Cubes) -> Verdict:
    """The chatter burst whose onset is nearest to the stated one, and the first one."""
    bursts = _chatter(cubes, LOW)
    if bursts.empty:
        return Verdict("no chatter", FAILS, "there is no chatter")
    near = bursts.loc[(bursts["onset"] - ONSET).abs().idxmin()]
    first = bursts["onset"].iloc[0]
    measured = (
        f"the chatter burst nearest to {ONSET:g} begins at {near['onset']:.4g} and lasts "
        f"{near['duration']:.4g}, "
        + ("complete" if near["complete"] else "incomplete")
        + f", followed by {near['sticking']:.3g} of sticking; "
        f"the first chatter burst begins at {first:.4g}"
    )
    if not (
        near["complete"]
        and abs(near["onset"] - ONSET) <= _NEAR_ONSET
        and abs(near["duration"] - DURATION) <= _ABOUT * DURATION
    ):
        why = f"no complete burst that lasts about {DURATION:g} begins near {ONSET:g}"
        return Verdict(measured, FAILS, why)
    if first >= near["onset"]:
        return Verdict(measured, HOLDS, "the first burst has that onset and duration")
    return Verdict(measured, READING, "as one of many such bursts, not the first")


def _score_a3(cube: xr.Dataset, tolerances: Tolerances) -> Scored:
    low = cube.sel(frequency_ratio=LOW)
    onset, duration = low.burst_at_onset, low.burst_at_duration
    far = ((onset - ONSET) / tolerances.onset) ** 2
    far = far + ((duration - DURATION) / tolerances.duration) ** 2
    value = _half_to_the(far).where(low.burst_at_complete == 1, 0.0)
    return Scored(value, {"onset": onset, "duration": duration})


def _judge_a4(cubes: Cubes) -> Verdict:
    """Steady durations of complete chatter at the two lower frequencies."""
    late = [_steady(_chatter(cubes, frequency)) for frequency in (LOW, MIDDLE)]
    durations = [bursts.loc[bursts["complete"], "duration"].median() for bursts in late]
    ratio = durations[1] / durations[0]
    shares = [bursts["complete"].mean() if len(bursts) else 0.0 for bursts in late]
    measured = (
        f"in the last half of the window {shares[0]:.0%} and {shares[1]:.0%} of the chatter bursts "
        f"are complete and last {durations[0]:.4g} and {durations[1]:.4g}, a ratio of {ratio:.3g} "
        f"(in forcing periods {ratio * MIDDLE / LOW:.3g})"
    )
    if min(shares) < _MOSTLY:
        return Verdict(measured, FAILS, "at one of the frequencies chatter stays incomplete")
    if abs(ratio - 1.0) <= _ABOUT:
        return Verdict(measured, HOLDS, f"durations differ by at most {_ABOUT:.0%}")
    differ = f"durations differ by more than {_ABOUT:.0%}"
    if abs(ratio * MIDDLE / LOW - 1.0) <= _ABOUT:
        return Verdict(measured, READING, f"in forcing periods; in seconds {differ}")
    return Verdict(measured, FAILS, f"{differ}, in seconds and in forcing periods")


def _score_a4(cube: xr.Dataset, tolerances: Tolerances) -> Scored:
    late = cube.isel(since=-1)
    low, middle = (late.sel(frequency_ratio=omega) for omega in (LOW, MIDDLE))
    complete = _part(low.chatter_complete, low.chatter_bursts) * _part(
        middle.chatter_complete, middle.chatter_bursts
    )
    ratio = middle.chatter_duration / low.chatter_duration
    value = complete * _half_to_the(((ratio - 1.0) / tolerances.ratio) ** 2)
    return Scored(value.fillna(0.0), {"duration at 0.25 over that at 0.20": ratio})


def _half_to_the(exponent: xr.DataArray) -> xr.DataArray:

    return np.exp2(-exponent)  # type: ignore[return-value]


def _part(some: xr.DataArray, of_all: xr.DataArray) -> xr.DataArray:
    """Return a part of a whole; 0 where there is none of the whole."""
    return (some / of_all.where(of_all > 0, 1)).where(of_all > 0, 0.0)


def _steady(bursts: pd.DataFrame) -> pd.DataFrame:
    """Bursts that begin in the second half of the window."""
    return bursts[bursts["onset"] > 0.5 * bursts["onset"].max()]


def _judge_a5(cubes: Cubes) -> Verdict:
    """Complete bursts at the highest frequency, early and late."""
    bursts = _chatter(cubes, HIGH)
    if bursts.empty:
        return Verdict("no chatter", FAILS, "there is no chatter")
    late = _steady(bursts)
    complete = bursts.loc[bursts["complete"], "onset"]
    in_late = late["complete"].sum()
    measured = (
        f"{len(bursts)} chatter bursts, {len(complete)} of them complete"
        + (f" (the last one begins at {complete.max():.4g})" if len(complete) else "")
        + f"; of the {len(late)} in the last half {in_late} are"
    )
    if complete.empty:
        return Verdict(measured, HOLDS, "no burst of chatter completes")
    if in_late or late.empty:
        return Verdict(measured, FAILS, "chatter completes after the transient as well")
    return Verdict(measured, READING, "after the transient; during it some bursts complete")


def _score_a5(cube: xr.Dataset, tolerances: Tolerances, late: bool = True) -> Scored:
    here = cube.isel(since=-1 if late else 0).sel(frequency_ratio=HIGH)
    incomplete = here.chatter_bursts - here.chatter_complete
    value = _part(incomplete, incomplete + here.sticking_bursts)
    when = "late" if late else "since the start"
    return Scored(value, {f"stickings {when} at 0.30": here.sticking_bursts})


def _judge_a6(cubes: Cubes) -> Verdict:
    """Accumulation time and point predicted from the first impact of each burst."""
    found = accumulation_errors(cubes["accumulation"], _ABOUT)
    rows: list[tuple[str, ...]] = [
        (
            *(
                "order",
                "points",
                "all times good at the first impact",
                "all accumulation points good",
            ),
            *("worst error of a time / duration", "worst error of a point / largest distance"),
            "all errors good from",
        )
    ]
    good = {}
    for number, order in enumerate(("first", "second"), start=1):
        here = found[found["order"] == number]
        made = here[here["first_impact_predicted"] > 0]
        worst = {
            quantity: made.loc[made["quantity"] == quantity, "first_impact_worst_percent"] / 100.0
            for quantity in PREDICTED
        }
        if not all(len(parts) for parts in worst.values()):
            return Verdict("", FAILS, "no burst has a prediction at its first impact")
        shares = {quantity: (parts <= _ABOUT).mean() for quantity, parts in worst.items()}
        later = here["within_from_worst"].max()
        rows.append(
            (
                *(order, str(len(worst["time"]))),
                *(f"{shares[quantity]:.0%}" for quantity in PREDICTED),
                *(f"{worst[quantity].max():.0%}" for quantity in PREDICTED),
                f"impact {later:.0f}" if later < math.inf else "none listed",
            )
        )
        left = here["within_left_percent"].min() / 100.0
        good[order] = min(shares.values()) == 1.0, later, left
    measured = (
        f"predictions for complete bursts; an error of at most {_ABOUT:.0%} is good: at the first "
        "impact relative to the burst (its duration, or the largest distance of the primary at an "
        "impact from where it completes), later relative to what is left of it"
    )
    if all(first for first, *_ in good.values()):
        why = f"within {_ABOUT:.0%} from the first impact on"
        return Verdict(measured, HOLDS, why, rows)
    if good["second"][0]:
        return Verdict(measured, READING, "with the second-order formula", rows)
    _, later, left = good["second"]
    if later == math.inf:
        why = f"within {_ABOUT:.0%} from none of the listed impacts on"
        return Verdict(measured, FAILS, why, rows)
    if left < _TO_COME:
        why = (
            f"within {_ABOUT:.0%} only for the last {left:.0%} of a burst (median at the worst "
            f"point), from impact {later:.0f} on in the worst burst"
        )
        return Verdict(measured, FAILS, why, rows)
    return Verdict(measured, READING, f"if made from impact {later:.0f} of the burst on", rows)


def _judge_a7(cubes: Cubes) -> Verdict:
    """How long it takes from rest to the first chatter, and to the first that completes."""
    found = burst_statistics(cubes["paper_a_histories"]).set_index("frequency_ratio")
    rows = [["frequency ratio", "first chatter", "first complete chatter"]]
    first: list[float] = []
    complete: list[float] = []
    for frequency in (LOW, MIDDLE, HIGH):
        here = found.iloc[abs(found.index - frequency).argmin()]
        row = [f"{frequency:g}"]
        for times, count, onset in (
            (first, "chatter_bursts", "first_chatter"),
            (complete, "complete_bursts", "first_complete"),
        ):
            if here[count]:
                times.append(here[onset] * frequency / (2.0 * math.pi))
            row.append(f"{times[-1]:.3g}" if here[count] else "none")
        rows.append(row)
    measured = "onsets from rest, in forcing periods, of one run each: their transients are chaotic"
    # Less than a period from rest is no transient worth the name.
    if first and min(first) > 1.0:
        return Verdict(measured, HOLDS, "no chatter in the first forcing period", rows)
    if complete and min(complete) > 1.0:
        why = "of complete chatter; incomplete chatter appears at once"
        return Verdict(measured, READING, why, rows)
    return Verdict(measured, FAILS, "chatter appears within a forcing period from rest", rows)


def _score_a7(cube: xr.Dataset, tolerances: Tolerances) -> Scored:
    first = cube.isel(since=0).sel(frequency_ratio=LOW).chatter_onset
    return Scored((first / ONSET).clip(max=1.0).fillna(0.0), {"first complete chatter": first})


def _judge_a8(cubes: Cubes) -> Verdict:
    """How many of the runs with impacts chatter or stick, and how many of the well damped."""
    shares = damping_shares(cubes["performance"])
    among_all, among_good = shares["lasting"], shares["lasting_well_damped"]
    if not (shares["well_damped"] and among_all > 0.0):
        return Verdict("", UNTESTED, "no such runs in this study")
    medians = [_median(shares[f"median_rms_{name}"]) for name in ("lasting", "two_impacts")]
    measured = (
        f"of the runs with impacts {among_all:.0%} chatter or stick, of the well damped ones "
        f"(rms ratio < {GOOD:g}) {among_good:.0%}; median rms ratio {medians[0]} with "
        f"chatter or sticking, {medians[1]} with two impacts per period and neither"
    )
    among = "among well damped runs than among all"
    if among_good > among_all:
        return Verdict(measured, HOLDS, f"chatter and sticking are more frequent {among}")
    return Verdict(measured, FAILS, f"chatter and sticking are rarer {among}")


def _median(value: float) -> str:
    return "none" if math.isnan(value) else f"{value:.2f}"


def _judge_a9(cubes: Cubes) -> Verdict:
    """What bursts do without restitution."""
    cube = cubes["performance"]
    if not (cube.restitution == 0.0).any():
        return Verdict("", UNTESTED, "restitution 0 is not in this study")
    plastic = (cube.impacts_per_period > 0.0) & (cube.restitution == 0.0)
    chatter = int(((cube.chatter > Chatter.NONE) & (cube.restitution == 0.0)).sum())
    bursts = cube.bursts_per_period.where(plastic, 0.0)
    sticks = float((bursts * cube.complete_fraction.fillna(0.0)).sum() / bursts.sum())
    measured = (
        f"{int(plastic.sum())} runs with impacts, {chatter} of them chatter; "
        f"{sticks:.0%} of the bursts end in sticking, after the others the wall moves away at once"
    )
    if chatter:
        return Verdict(measured, FAILS, "there is chatter at restitution 0")
    if sticks == 1.0:
        return Verdict(measured, HOLDS, "every burst sticks")
    return Verdict(measured, READING, "unless the wall moves away at once")


def _judge_a10(cubes: Cubes) -> Verdict:
    """Damped bands of low and of high restitution, and where two impacts per period damp well."""
    cube = cubes["performance"]
    several = [name for name in ("direction", "draw") if name in cube.dims]
    best = best_clearance(cube, worst=several)
    shares = damping_shares(cube)
    r = best.get("restitution")
    if r is None or r.nunique() < 2 or not shares["well_damped_two_impacts"]:
        return Verdict("", UNTESTED, "needs an axis of restitution and such runs")
    middle = 0.5 * (r.min() + r.max())
    low, high = (best.loc[half, "band"].mean() for half in (r <= middle, r > middle))
    share = shares["near_resonance"]
    measured = (
        f"mean width of the band at the best clearance {low:.3g} for restitution up to "
        f"{middle:g}, {high:.3g} above; {share:.0%} of the well damped runs "
        f"(rms ratio < {GOOD:g}) with two impacts per period lie within {NEAR:.0%} of the "
        f"resonance, all from {shares['lowest']:g} to {shares['highest']:g}"
    )
    wider, narrow = low > high, share >= 0.9
    if wider and narrow:
        why = "low restitution widens the band, and two impacts damp well near resonance only"
        return Verdict(measured, HOLDS, why)
    if not (wider or narrow):
        why = "low restitution does not widen the band, nor do two impacts need the resonance"
        return Verdict(measured, FAILS, why)
    half = "for the band, not for two impacts" if wider else "for two impacts, not for the band"
    return Verdict(measured, READING, half)


def _judge_a11(cubes: Cubes) -> Verdict:
    """Elasticities of the duration of complete bursts, by least squares in logarithms."""
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
    measured = (
        f"over {points.size} points with complete bursts their duration scales with the power "
        f"{amplitude:.2f} of the force amplitude, {frequency:.2f} of the frequency and "
        f"{damping:.2f} of the damping ratio; in forcing periods with the power "
        f"{frequency + 1.0:.2f} of the frequency"
    )
    if abs(amplitude) > max(abs(frequency), abs(damping)):
        return Verdict(measured, HOLDS, "the exponent of the amplitude is the largest")
    if abs(amplitude) > max(abs(frequency + 1.0), abs(damping)):
        return Verdict(
            measured, READING, "in forcing periods; in seconds it scales with the period"
        )
    return Verdict(measured, FAILS, "another exponent is larger, in seconds and in forcing periods")


def _at(*frequencies: float) -> dict[str, Values]:
    return {"frequency_ratio": Values(these=frequencies)}


_CLEARANCES = {"clearance": Values(around=CHATTER_UP_TO)}

PAPER_A = (
    Statement(
        "A1",
        text="chatter up to a limit of the clearance, periodic or quasi-periodic motion above",
        where="text on Fig. 3",
        stated=f"chatter at d = 0 to {CHATTER_UP_TO:g} of 0 to {WIDEST:g}",
        studies=("paper_a_clearance",),
        figures=("paper_a_clearance/figures/paper_a_fig_3",),
        judge=_judge_a1,
        scores={
            "A1": Score(
                f"over the clearance, chatter up to {CHATTER_UP_TO:g} and none from there to "
                f"{WIDEST:g}",
                ("bursts",),
                _CLEARANCES,
                _score_a1,
            ),
            "A1_contact": Score(
                f"as A1, and beyond {CHATTER_UP_TO:g} there are impacts still",
                ("bursts", "impacts"),
                _CLEARANCES,
                partial(_score_a1, contact=True),
            ),
        },
    ),
    Statement(
        "A2",
        text="a bifurcation diagram over the frequency ratio",
        where="caption of Fig. 4",
        stated="no number",
        studies=("paper_a_frequency",),
        figures=("paper_a_frequency/figures/paper_a_fig_4",),
        judge=_judge_a2,
    ),
    Statement(
        "A3",
        text=f"at frequency ratio {LOW:.2f} a burst of chatter completes",
        where="text on Fig. 5(a), and on the accumulation of chatter below Fig. 7",
        stated=f"starts at about t = {ONSET:g}, lasts about {DURATION:g}",
        studies=("paper_a_histories",),
        figures=("paper_a_histories/figures/paper_a_fig_5",),
        judge=_judge_a3,
        scores={
            "A3": Score(
                f"at frequency ratio {LOW:.2f} a complete chatter starts at about {ONSET:g} and "
                f"lasts about {DURATION:g}",
                ("burst_at",),
                _at(LOW),
                _score_a3,
                tolerant=True,
            )
        },
    ),
    Statement(
        "A4",
        text=f"at {MIDDLE:.2f} chatter is complete as well and lasts nearly as long",
        where="text below Fig. 7",
        stated="nearly the same duration",
        studies=("paper_a_histories",),
        figures=("paper_a_histories/figures/paper_a_fig_6",),
        judge=_judge_a4,
        scores={
            "A4": Score(
                f"at {MIDDLE:.2f} chatter is complete too, and lasts nearly as long as at "
                f"{LOW:.2f}",
                ("chatter_bursts",),
                _at(LOW, MIDDLE),
                _score_a4,
                tolerant=True,
            )
        },
    ),
    Statement(
        "A5",
        text=f"at {HIGH:.2f} chatter is incomplete, without sticking",
        where="not in words: the text below Fig. 7 has complete chatter at the other two only",
        stated="no number",
        studies=("paper_a_histories",),
        figures=("paper_a_histories/figures/paper_a_fig_7",),
        judge=_judge_a5,
        scores={
            "A5": Score(
                f"at {HIGH:.2f}, after the transient, chatter is incomplete and nothing sticks",
                ("chatter_bursts",),
                _at(HIGH),
                _score_a5,
            ),
            "A5_record": Score(
                f"at {HIGH:.2f}, from the start on, chatter is incomplete and nothing sticks",
                ("chatter_bursts",),
                _at(HIGH),
                partial(_score_a5, late=False),
            ),
        },
    ),
    Statement(
        "A6",
        text="predicted accumulation point and duration agree with the simulation",
        where="conclusion",
        stated="no number",
        studies=("accumulation",),
        figures=("accumulation/figures/error_frequency_ratio~0.2",),
        judge=_judge_a6,
    ),
    Statement(
        "A7",
        text="chatter appears only after a complicated transient",
        where="conclusion",
        stated="no number",
        studies=("paper_a_histories",),
        figures=("paper_a_histories/figures/paper_a_fig_5",),
        judge=_judge_a7,
        scores={
            "A7": Score(
                f"at {LOW:.2f} a long transient passes before the first complete chatter",
                ("chatter_bursts",),
                _at(LOW),
                _score_a7,
            )
        },
    ),
    Statement(
        "A8",
        text="good damping goes together with chatter and sticking",
        where="introduction",
        stated="no number",
        studies=("performance",),
        figures=("performance/figures/rms_ratio",),
        judge=_judge_a8,
    ),
    Statement(
        "A9",
        text="with restitution 0 the masses stick at once, without chatter",
        where="introduction",
        stated="r = 0",
        studies=("performance",),
        figures=("performance/figures/rms_ratio",),
        judge=_judge_a9,
    ),
    Statement(
        "A10",
        text="low restitution damps over a wide band; two impacts per cycle only near resonance",
        where="introduction",
        stated="no number",
        studies=("performance",),
        figures=("performance/figures/best_clearance",),
        judge=_judge_a10,
    ),
    Statement(
        "A11",
        text="the duration of chatter follows the amplitude more than frequency or damping ratio",
        where="introduction, of work by others",
        stated="cited from work on a pendulum",
        studies=("burst_duration",),
        figures=("burst_duration/figures/burst_duration",),
        judge=_judge_a11,
    ),
)
