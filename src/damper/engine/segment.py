"""Rows of the segment log: one row per segment, described at its start.

The log *is* the solution: between events every model's motion is known in closed form or to
rounding, so a run is the list of its segments. Models write rows, observers read them.
"""

# FIRST is the approach speed of the first impact of the burst under way, zero if there is none.
PERIOD, TIME, X, V, GAP, RATE, SIDE, MODE, CAUSE, SPEED, FIRST, DURATION = range(12)
COLUMNS = 12

#: How the masses move in a segment. A tail is the closed rest of a complete burst.
FLIGHT, TAIL, STICKING = 0.0, 1.0, 2.0
#: A contact that has not lasted yet, where walls give; a row that an impact begins has the state
#: before it, with no jump.
CONTACT = 3.0
#: What began a segment; the codes of `damper.events`. NOTHING: a start, or a long flight cut.
NOTHING, IMPACT, STICK, RELEASE, STOPPED = -1.0, 0.0, 1.0, 2.0, 3.0
#: The end of a contact that has not lasted, where walls give; `damper.events` does not list it.
SEPARATION = -2.0

#: Why a run returned: FINISHED, or the reason that `damper.parameters.variables.STATUS` explains.
FINISHED, TOO_MANY_EVENTS, SEARCH_FAILED, LOG_FULL = 0, 1, 2, 3
