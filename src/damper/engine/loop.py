"""The event loop of a run. Its only product is the segment log.

Between events the motion is known in closed form or to roundoff, so a run *is* the list of its
segments. A model says which segment follows which (`damper.engine.model`); the loop keeps log,
budget and clock. Time is held as whole cycles plus a local time in [0, cycle), so
nothing is lost to roundoff in long runs.
"""

from typing import Any

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.forcing import rate_of
from damper.engine.lending import lent
from damper.engine.model import begin, following, read_segment, write_row
from damper.engine.search import MAX_STEPS

#: Why the loop returned: FINISHED, or what `damper.parameters.variables.STATUS` explains.
FINISHED, TOO_MANY_EVENTS, SEARCH_FAILED, LOG_FULL = 0, 1, 2, 3

#: Segments without a log after which the loop returns, some 10 ms: compiled code notices no
#: interrupt.
UNKEPT = 1 << 15

#: Evaluations from which on a search is long; so many of them count as an event of the budget.
LONG_SEARCH = 100
#: Length of a segment without an event below which it gets nowhere, in units of the faster of 1
#: and 1/omega. Its evaluations count as those of long searches do.
BRIEF = 1e-3


@compiled
def run(
    model: Any,
    state: np.ndarray,
    until_periods: float,
    until_time: float,
    max_events: int,
    log: np.ndarray,
    counts: np.ndarray,
) -> tuple[int, int]:
    """Advance from event to event until a time, or until the log is full.

    Without a log it returns after `UNKEPT` segments, as if they filled one.

    Parameters
    ----------
    model : NamedTuple
    state : float64 array (COLUMNS,)
        The present segment; updated in place. A segment that the end cuts stays the present
        segment.
    until_periods, until_time : float
        Where to stop, whole cycles plus local time; an event at exactly that time still counts.
    max_events : int
        Events after which to stop. Evaluations in long searches and brief segments count too, a
        hundred for an event, and one whole search more.
    log : float64 array (rows, COLUMNS)
        One row per segment; with no rows nothing is kept.
    counts : int64 array (3,)
        Events, evaluations, and those in long searches and brief segments, added to.

    Returns
    -------
    code, rows : int
        FINISHED, TOO_MANY_EVENTS, SEARCH_FAILED or LOG_FULL, and the number of segments.
    """
    model = lent(model)
    keep = len(log) > 0
    most = len(log) if keep else UNKEPT
    segment = read_segment(model, state)
    start = begin(model, segment)
    events = int(counts[0])
    evaluations = int(counts[1])
    searched = int(counts[2])
    most_searched = float(LONG_SEARCH) * max_events + MAX_STEPS
    brief = BRIEF / max(1.0, rate_of(model.free.forcing))
    rows = 0
    code = FINISHED
    while True:
        if rows == most:
            code = LOG_FULL
            break
        remaining = (until_periods - segment.periods) * model.cycle + (until_time - segment.time)
        if remaining < 0.0:
            break
        step = following(model, segment, start)
        evaluations += step.steps
        over = step.duration > remaining
        if keep:
            write_row(model, log[rows], segment, remaining if over else step.duration)
        rows += 1
        if over:
            break
        if step.gave_up:
            code = SEARCH_FAILED
            break
        if step.steps >= LONG_SEARCH or (not step.is_event and step.duration < brief):
            searched += step.steps
        if (step.is_event and events >= max_events) or searched > most_searched:
            code = TOO_MANY_EVENTS
            break
        if step.is_event:
            events += 1
        segment = step.next
        start = step.start
    write_row(model, state, segment, 0.0)
    counts[0] = events
    counts[1] = evaluations
    counts[2] = searched
    return code, rows
