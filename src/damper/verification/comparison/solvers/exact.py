"""This project's own engine: events in closed form, or found to roundoff.

Its setting is the accuracy of accumulation times: where the closed rest of a complete chatter
sequence begins. It is the bare engine; events and end are read off its log.
"""

import numpy as np

from damper.engine import segment
from damper.engine.loop import SEARCH_FAILED
from damper.engine.trajectory import LOG_ROWS
from damper.models import start_run
from damper.verification.comparison.solvers import CAPPED, FAILED, FINISHED, Scene, Solution, Solver


def solve(scene: Scene, setting: float, max_evaluations: int) -> Solution:
    """Run a scene to the accuracy `setting`.

    The evaluations are held against their limit after each piece of the log, which is shorter where
    the limit is low.
    """
    run = start_run(scene.parameters, scene.state, setting, max_evaluations)
    found = Solution(penetration=0.0)
    kept = [np.empty((0, 4))]
    buffer = np.empty((min(max(max_evaluations // 16, 1), LOG_ROWS), segment.COLUMNS))
    for log in run.segments(*run.whole_periods(scene.until), buffer):
        if len(log):
            starts = log[:, segment.PERIODS] * run.cycle + log[:, segment.TIME]
            events = log[:, segment.CAUSE] >= segment.IMPACT
            about = log[events][:, (segment.CAUSE, segment.SIDE, segment.SPEED)]
            kept.append(np.column_stack((starts[events], about)))
            found.penetration = max(found.penetration, -float(log[:, segment.GAP].min()))
            found.reached = float(starts[-1] + log[-1, segment.DURATION])
        if run.evaluations > max_evaluations:
            found.outcome = CAPPED
            break
    if run.status == SEARCH_FAILED:
        found.outcome = FAILED
    found.evaluations = run.evaluations
    if found.outcome == FINISHED:
        found.reached = scene.until
        end = run.state_at(*run.whole_periods(scene.until))
        found.end_state = np.array((end.x, end.v, end.y, end.u))
    return found.list_events(np.concatenate(kept))


SOLVER = Solver(5e6, solve)
