"""What becomes of a run of a stress study, beside the laws. No engine is loaded."""

from damper.observers.common.laws import SEGMENTS
from damper.parameters.variables import STATUS_MEANINGS, Variable

#: Status beside those of the engine: the run was refused with an error.
REFUSED = 3
RUN_OUTCOMES = (*STATUS_MEANINGS, "refused")

#: What a run was, beside the laws.
RUN_VARIABLES = (
    Variable(
        "status",
        "why the run ended",
        "1",
        dtype="i1",
        comment="0 finished; 1 budget of max_events used up; 2 a search for an event failed; "
        "3 refused",
    ),
    Variable("events", "events of the run", "1", dtype="i8"),
    Variable("evaluations", "evaluations of the flow that finding them took", "1", dtype="i8"),
    SEGMENTS,
    Variable("periods", "forcing periods that were asked for", "1", dtype="i8"),
)
