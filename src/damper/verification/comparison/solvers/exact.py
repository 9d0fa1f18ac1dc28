"""This project's own engine: events in closed form, or found to roundoff.

What its setting changes is the accuracy of completion times alone: where the closed rest of a
complete chatter sequence begins. Asked for no states and no balance, it is the bare engine, and the
events are read off its log. States come from the log as well. Work and losses are those of
`damper.observers.response`, whose Gauss sums are good to roundoff over any stretch.
"""

from collections.abc import Sequence

import numpy as np

from damper.engine.loop import SEARCH_FAILED
from damper.engine.segment import (
    CAUSE,
    COLUMNS,
    DURATION,
    GAP,
    IMPACT,
    PERIODS,
    RELEASE,
    SIDE,
    SPEED,
    STICK,
    TIME,
)
from damper.engine.trajectory import LOG_ROWS, Trajectory
from damper.models import start_run
from damper.verification.comparison.energy import energy_residual
from damper.verification.comparison.scene import Scene
from damper.verification.comparison.solution import CAPPED, FAILED, FINISHED, Solution
from damper.verification.comparison.solvers import Solver
from damper.verification.comparison.springs import deepest


def solve(
    scene: Scene,
    setting: float,
    times: Sequence[float] = (),
    balance: bool = False,
    max_evaluations: int = 10**9,
) -> Solution:
    """Run a scene to the accuracy `setting`; see `damper.verification.comparison.solvers.Solver`.

    The evaluations are held against their limit after each piece of the log, which is shorter
    where the limit is low.

    Raises
    ------
    ValueError
        For an accuracy out of the engine's range, and for a start outside the box.
    """
    p, state = scene.parameters, scene.state
    run = start_run(p, state, setting, max_evaluations)
    wanted = np.asarray(times, dtype=float)
    found = Solution(states=np.full((len(wanted), 4), np.nan), penetration=0.0, outcome=FINISHED)
    observer = _observer(run, scene) if balance else None
    kept = [np.empty((0, 4))]
    buffer = np.empty((min(max(max_evaluations // 16, 1), LOG_ROWS), COLUMNS))
    capped = False
    for log in run.segments(*run.whole_periods(scene.until), buffer):
        if len(log):
            starts = log[:, PERIODS] * run.period + log[:, TIME]
            events = log[:, CAUSE] >= IMPACT
            kept.append(np.column_stack((starts[events], log[events][:, (CAUSE, SIDE, SPEED)])))
            found.penetration = max(found.penetration, -float(log[:, GAP].min()))
            if p.model == "compliant":
                found.penetration = max(found.penetration, deepest(run, log))
            found.reached = float(starts[-1] + log[-1, DURATION])
            last = log, starts
            _sample(run, *last, wanted, found)
            if observer is not None:
                observer.observe(log)
        if run.evaluations > max_evaluations:
            capped = True
            break

    rows = np.concatenate(kept)
    impacts = rows[rows[:, 1] == IMPACT]
    found.impact_times, found.impact_sides, found.approach_speeds = impacts[:, (0, 2, 3)].T.copy()
    found.stick_times = rows[rows[:, 1] == STICK, 0]
    found.release_times = rows[rows[:, 1] == RELEASE, 0]
    found.evaluations = run.evaluations
    if run.status != 0 or capped:
        found.outcome = FAILED if run.status == SEARCH_FAILED else CAPPED
    else:
        found.reached = scene.until
        # Again, for what roundoff has left between the last segment's end and that time.
        _sample(run, *last, wanted, found)
        if observer is not None:
            found.energy_residual = _residual(run, scene, observer)
    return found


def _sample(
    run: Trajectory, log: np.ndarray, starts: np.ndarray, times: np.ndarray, found: Solution
) -> None:
    """Write the states at those times that lie in this piece of the log."""
    if len(times) == 0:
        return
    first = int(np.searchsorted(times, starts[0]))
    last = int(np.searchsorted(times, found.reached, "right"))
    rows = np.searchsorted(starts, times[first:last], "right") - 1
    clearance = run.model.clearance
    for index, row in zip(range(first, last), log[rows], strict=True):
        periods, rest = run.whole_periods(float(times[index]))
        tau = (periods - row[PERIODS]) * run.period + (rest - row[TIME])
        x, v, gap, rate = run.motion_in(row, max(float(tau), 0.0))
        side = float(row[SIDE])
        found.states[index] = x, v, x + side * (clearance - gap), v - side * rate
        found.penetration = max(found.penetration, -gap)


def _observer(run, scene):
    # Loaded for a balance alone. Its window may be any number of periods long: only arrays of
    # samples need whole ones.
    from damper.observers.common.base import Window
    from damper.observers.response import Response

    observer = Response()
    observer.allocate(1, 1)
    observer.begin(0, run, Window(*run.start, scene.periods))
    return observer


def _residual(run, scene, observer):
    observer.finish(True)
    totals = (
        float(observer.arrays[name][0]) * scene.periods
        for name in ("energy_input", "dashpot_loss", "impact_loss")
    )
    start, end = scene.state, run.state_at(*run.whole_periods(scene.until))
    return energy_residual(
        scene.parameters,
        (start.x, start.v, start.y, start.u),
        (end.x, end.v, end.y, end.u),
        *totals,
    )


SOLVERS = {"exact": Solver("accuracy", -1, ("rigid", "compliant"), 5e6, solve)}
