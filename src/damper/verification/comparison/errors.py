"""Errors of a solution: its events, in order, beside those of the reference, and its end.

A complete burst has infinitely many impacts, ever closer together: no solver finds all of them. So
events are compared from one beginning of sticking to the next, and of a burst that is complete only
impacts down to `SLOWEST_COUNTED` times the approach speed of its first one: four for a restitution
of 0.3, ten for 0.6. A solver may close a burst earlier. All other impacts count, however slow: a
grazing impact must not be lost.
"""

from __future__ import annotations

from itertools import pairwise
from math import nan
from typing import NamedTuple

import numpy as np

from damper.parameters.variables import LENGTH, TIME, Variable
from damper.verification.comparison.solvers import FAILED, FINISHED, Scene, Solution

#: Part of a complete burst's first approach speed below which its impacts do not count.
SLOWEST_COUNTED = 1e-2
#: Part of the clearance by which a free mass may be beyond a wall and still count as inside.
BOX = 1e-2
#: Numbers that `measure_errors` returns.
MEASURES = (
    Variable("impact_time_error", "largest error of an impact time", TIME),
    Variable("accumulation_error", "largest error of the time at which sticking begins", TIME),
    Variable("release_error", "largest error of a release time", TIME),
    Variable(
        "state_error",
        "largest error of displacements, and of velocities times sqrt(M/K), at the end",
        LENGTH,
    ),
    Variable("penetration", "largest distance beyond a wall", LENGTH),
    Variable(
        "evaluations",
        "evaluations of the acceleration, or of the closed-form flow",
        "1",
        comment="the time of one differs from solver to solver",
    ),
)


class Reference(NamedTuple):
    """Events and final state of a scene, rounded once, as solutions are compared with it."""

    impact_times: np.ndarray
    """Times of impacts with an approach speed of at least 1e-9."""
    impact_sides: np.ndarray
    """-1 left wall, +1 right wall."""
    approach_speeds: np.ndarray
    stick_times: np.ndarray
    release_times: np.ndarray
    final_state: np.ndarray
    """x, v, y, u at the end of the scene."""


def measure_errors(
    scene: Scene, reference: Reference, solution: Solution
) -> tuple[str, dict[str, float]]:
    """Compare a solution with the reference: its outcome, one of `OUTCOMES`, and the `MEASURES`.

    Errors are NaN for events that the scene does not have, and for runs without all events.
    """
    impacts = _paired_impacts(reference, solution)
    names = ("stick_times", "release_times")
    wanted, found = ([getattr(run, name) for name in names] for run in (reference, solution))
    pairs: list[tuple[np.ndarray, np.ndarray]] = []
    same = impacts is not None and list(map(len, wanted)) == list(map(len, found))
    if impacts is not None and same:
        pairs = [(reference.impact_times[impacts[0]], solution.impact_times[impacts[1]])]
        pairs += zip(wanted, found, strict=True)
    errors = [float(np.abs(a - b).max(initial=-1.0)) for a, b in pairs] or [-1.0] * 3
    state = float(np.abs(solution.end_state - reference.final_state).max())
    numbers = [*(nan if error < 0.0 else error for error in errors), state]
    measured = [*numbers, float(solution.penetration), float(solution.evaluations)]
    outcome = solution.outcome
    if outcome == FINISHED:
        outcome = "good" if same else "missed"
        if solution.penetration > BOX * scene.parameters.clearance:
            outcome = "left_box"
        if not np.isfinite(state):  # whatever the solver reports
            outcome = FAILED
    return outcome, dict(zip((v.name for v in MEASURES), measured, strict=True))


def counted_impacts(reference: Reference) -> int:
    """Return how many impacts of the reference count; see `SLOWEST_COUNTED`."""
    return sum(counted for _, counted, _ in _stretches(reference))


def _stretches(run: Reference | Solution) -> list[tuple[slice, int, int]]:
    """Return the impacts from one beginning of sticking to the next.

    With each: the number of its impacts that count, and of those before the complete burst.
    """
    ends = [*np.searchsorted(run.impact_times, run.stick_times, side="right").tolist()]
    found: list[tuple[slice, int, int]] = []
    for begin, end in pairwise([0, *ends, len(run.impact_times)]):
        counted = before = end - begin
        if begin < end and len(found) < len(run.stick_times):
            other = np.flatnonzero(run.impact_sides[begin:end] != run.impact_sides[end - 1])
            before = int(other.max(initial=-1)) + 1
            speeds = run.approach_speeds[begin + before : end]
            counted = before + int((speeds >= SLOWEST_COUNTED * speeds[0]).sum())
        found.append((slice(begin, end), counted, before))
    return found


def _paired_impacts(
    reference: Reference, solution: Solution
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the numbers of impacts that are compared; None if the runs have other events."""
    wanted, found = _stretches(reference), _stretches(solution)
    if len(wanted) != len(found):
        return None
    pairs: list[tuple[int, int]] = []
    for number, ((theirs, counted, before), (mine, *_)) in enumerate(
        zip(wanted, found, strict=True)
    ):
        closed = number < len(reference.stick_times)
        sides, others = reference.impact_sides[theirs], solution.impact_sides[mine]
        count = min(counted, len(others))
        complete = count > before or not len(sides) if closed else len(sides) == len(others)
        beyond = others[count:] == sides[-1] if len(sides) else others[count:] == 0
        if not (complete and np.array_equal(sides[:count], others[:count]) and beyond.all()):
            return None
        pairs += [(theirs.start + k, mine.start + k) for k in range(count)]
    one, other = np.array(pairs, dtype=int).reshape(-1, 2).T
    return one, other
