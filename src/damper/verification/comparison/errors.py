"""What a solution is off by: events matched with those of the reference, states, balances.

Events are matched before they are compared. Each event of the reference has a window about it,
half as wide as the way to its neighbour of the same kind (impacts: on the same wall); windows do
not overlap, and the solver's event nearest to the middle of a window is the one that is meant.
What is left over was missed, or is one too many.

A complete burst has infinitely many impacts, ever closer together: no solver finds all of them,
and near the end times alone do not decide which one is meant. Three rules keep that apart from
impacts that were passed over:

- From the first impact of a burst on, the solver's next one on that wall is the next one of the
  reference if their approach speeds agree: within half of the factor, on a logarithmic scale, by
  which these fall from impact to impact, which is the restitution. Windows in time are for those
  that do not.
- Impacts of a complete burst count only down to `SLOWEST_COUNTED` times the approach speed of its
  first one: four impacts for a restitution of 0.3, ten for 0.6. All others count, however slow: a
  grazing impact must not be lost.
- A solver that closes a burst by sticking leaves the rest of it *unresolved*; that is no impact
  missed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, nan
from typing import TYPE_CHECKING

import numpy as np

from damper.parameters.variables import LENGTH, TIME, Variable
from damper.verification.comparison.solution import FAILED, FINISHED, Solution

if TYPE_CHECKING:  # these bring mpmath and the engine along
    from damper.verification.comparison.reference import Reference
    from damper.verification.comparison.scene import Scene

#: Part of a complete burst's first approach speed below which its impacts do not count.
SLOWEST_COUNTED = 1e-2

#: Part of the clearance by which a free mass may be beyond a wall and still count as inside.
BOX = 1e-2

#: Part of a forcing period that sticking must last to count as one too many. A stiff
#: spring whose force falls slowly seems to hold the mass for a moment.
SHORTEST_STICKING = 1e-2

#: What became of a run: the first of these that holds, in the order of their names from the second
#: on, or else the first. ``missed`` is any event passed over or made up.
OUTCOMES = ("good", "stalled", "capped", "failed", "left_box", "missed")
GOOD = OUTCOMES.index("good")
#: Counts that are 0 unless events were passed over or made up.
MISSES = ("missed_impacts", "extra_impacts", "missed_sticks", "extra_sticks", "missed_releases")

#: All that `measure_errors` returns.
MEASURES = {
    variable.name: variable
    for variable in (
        Variable("impact_time_error", "largest error of an impact time", TIME),
        Variable("accumulation_error", "largest error of the time at which sticking begins", TIME),
        Variable("release_error", "largest error of a release time", TIME),
        Variable(
            "state_error",
            "largest error of displacements, and of velocities times sqrt(M/K), at the end",
            LENGTH,
        ),
        Variable("penetration", "largest distance beyond a wall", LENGTH),
        Variable("missed_impacts", "impacts of the reference that were passed over", "1"),
        Variable("extra_impacts", "impacts that the reference does not have", "1"),
        Variable("missed_sticks", "beginnings of sticking that were passed over", "1"),
        Variable("extra_sticks", "beginnings of sticking that the reference does not have", "1"),
        Variable("missed_releases", "releases that were passed over", "1"),
        Variable(
            "evaluations",
            "evaluations of the acceleration, or of the closed-form flow",
            "1",
            comment="what one costs differs from solver to solver",
        ),
    )
}


def measure_errors(scene: Scene, reference: Reference, solution: Solution) -> dict[str, float]:
    """Compare a solution with the reference: the `MEASURES`.

    An error is NaN where nothing could be compared: the reference has no such event, or none was
    found, and then something was missed. Events count as missed up to where the solution ends; what
    lies beyond was not reached.
    """
    counted, bursts = _bursts(reference)
    ahead = reference.impact_times > solution.reached
    partner = _match_impacts(scene, reference, solution)
    for burst in bursts:
        _follow(scene, reference, solution, partner, burst)
    found = partner >= 0
    extra = np.ones(len(solution.impact_times), dtype=bool)
    extra[partner[found]] = False

    stick, extra_sticks = _match(scene, reference.stick_times, solution.stick_times)
    extra_sticks &= _lasting(scene, solution)
    release, _ = _match(scene, reference.release_times, solution.release_times)

    unresolved = np.zeros(len(counted), dtype=bool)
    noise = np.zeros(len(solution.impact_times), dtype=bool)
    for burst in bursts:
        mine = np.arange(burst.first, burst.last + 1)
        resolved = mine[found[mine]]
        if stick[burst.stick] >= 0 and resolved.size:
            unresolved[resolved[-1] + 1 : burst.last + 1] = True
        noise |= (
            (solution.impact_sides == reference.impact_sides[burst.first])
            & (solution.impact_times >= reference.impact_times[burst.first])
            & (solution.impact_times <= burst.end)
            & (solution.approach_speeds < burst.floor)
        )
    missed = counted & ~found & ~unresolved & ~ahead
    return {
        "impact_time_error": _worst(
            reference.impact_times, solution.impact_times, np.where(counted, partner, -1)
        ),
        "accumulation_error": _worst(reference.stick_times, solution.stick_times, stick),
        "release_error": _worst(reference.release_times, solution.release_times, release),
        # A state that is not finite makes an error that is not.
        "state_error": float(np.abs(solution.end_state - reference.final_state).max()),
        "penetration": float(solution.penetration),
        "missed_impacts": float(missed.sum()),
        "extra_impacts": float((extra & ~noise).sum()),
        "missed_sticks": _missed(reference.stick_times, stick, solution.reached),
        "extra_sticks": float(extra_sticks.sum()),
        "missed_releases": _missed(reference.release_times, release, solution.reached),
        "evaluations": float(solution.evaluations),
    }


def outcome(scene: Scene, solution: Solution, measured: Mapping[str, float]) -> str:
    """Return which of the `OUTCOMES` a run has.

    A solver notices by itself that it stalls, is capped or fails; that it left the box or lost
    events, only the reference knows.
    """
    if solution.outcome != FINISHED:
        return solution.outcome
    if not np.isfinite(measured["state_error"]):  # whatever the solver reports
        return FAILED
    if measured["penetration"] > BOX * scene.parameters.clearance:
        return "left_box"
    return "missed" if any(measured[name] for name in MISSES) else "good"


def counted_impacts(reference: Reference) -> int:
    """How many impacts of the reference count; see `SLOWEST_COUNTED`."""
    return int(_bursts(reference)[0].sum())


@dataclass(frozen=True)
class _Burst:
    """A complete burst of the reference: its impacts, the stick that ends it, the release."""

    first: int
    last: int
    stick: int
    end: float
    floor: float


def _bursts(reference: Reference) -> tuple[np.ndarray, list[_Burst]]:
    """Which impacts count, and the complete bursts."""
    times, sides = reference.impact_times, reference.impact_sides
    counted = np.ones(len(times), dtype=bool)
    bursts: list[_Burst] = []
    begin = 0  # the first impact after the stick before
    for number, stick in enumerate(reference.stick_times):
        last = int(np.searchsorted(times, stick, side="right")) - 1
        if last >= begin:
            first = last
            while first > begin and sides[first - 1] == sides[last]:
                first -= 1
            slow = SLOWEST_COUNTED * reference.approach_speeds[first]
            counted[first : last + 1] = reference.approach_speeds[first : last + 1] >= slow
            later = reference.release_times[reference.release_times >= stick]
            end = float(later[0]) if later.size else inf
            bursts.append(_Burst(first, last, number, end, float(slow)))
            begin = last + 1
    return counted, bursts


def _match_impacts(scene: Scene, reference: Reference, solution: Solution) -> np.ndarray:
    """Match on each wall by windows in time: index of each reference impact's partner, or -1."""
    partner = np.full(len(reference.impact_times), -1)
    for side in (-1, 1):
        theirs = np.flatnonzero(reference.impact_sides == side)
        mine = np.flatnonzero(solution.impact_sides == side)
        found, _ = _match(scene, reference.impact_times[theirs], solution.impact_times[mine])
        partner[theirs[found >= 0]] = mine[found[found >= 0]]
    return partner


def _follow(
    scene: Scene, reference: Reference, solution: Solution, partner: np.ndarray, burst: _Burst
) -> None:
    """Match a complete burst anew, from impact to impact and by approach speed; see above."""
    times, sides, speeds = solution.impact_times, solution.impact_sides, solution.approach_speeds
    fall = scene.parameters.restitution**0.5
    for k in range(burst.first + 1, burst.last + 1):
        before, after = partner[k - 1], partner[k - 1] + 1
        if before >= 0 and after < len(times):
            wanted = reference.approach_speeds[k]
            stuck = (solution.stick_times >= times[before]) & (solution.stick_times < times[after])
            if (
                sides[after] == reference.impact_sides[k]
                and wanted * fall < speeds[after] < wanted / fall
                and not stuck.any()
                and after not in partner[burst.last + 1 :]
            ):
                partner[k] = after
        if partner[k] in partner[burst.first : k]:  # it was found to be an earlier one
            partner[k] = -1


def _match(scene: Scene, wanted: np.ndarray, found: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Index in `found` of the partner of each of `wanted`, or -1; which of `found` have none.

    The only event of its kind has a window of half a forcing period to either side.
    """
    partner = np.full(len(wanted), -1)
    extra = np.ones(len(found), dtype=bool)
    if not (len(wanted) and len(found)):
        return partner, extra
    width = np.full(len(wanted), scene.parameters.cycle)
    way = np.diff(wanted)
    if len(way):
        width = np.minimum(np.append(way, inf), np.insert(way, 0, inf))
    for k, (middle, half) in enumerate(zip(wanted, 0.5 * width, strict=True)):
        nearest = int(np.argmin(np.abs(found - middle)))
        if abs(found[nearest] - middle) < half or found[nearest] == middle:
            partner[k] = nearest
            extra[nearest] = False
    return partner, extra


def _lasting(scene: Scene, solution: Solution) -> np.ndarray:
    """Which sticks of the solver are not brief."""
    after = np.searchsorted(solution.release_times, solution.stick_times)
    ends = np.append(solution.release_times, inf)[after]
    return ends - solution.stick_times > SHORTEST_STICKING * scene.parameters.cycle


def _missed(wanted: np.ndarray, partner: np.ndarray, reached: float) -> float:
    return float(((partner < 0) & (wanted <= reached)).sum())


def _worst(wanted: np.ndarray, found: np.ndarray, partner: np.ndarray) -> float:
    good = partner >= 0
    errors = np.abs(found[partner[good]] - wanted[good])
    return float(errors.max()) if errors.size else nan
