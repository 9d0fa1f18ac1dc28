"""What the observer `laws` has to know of each model, in the module `laws` of its folder."""

from typing import Any, NamedTuple

from damper.engine.dispatch import by_class
from damper.engine.segment import Segment


class Sample(NamedTuple):
    """Where the masses are at one time of a segment; the gap unclipped, which `motion` clips."""

    x: float
    v: float
    """Of the primary."""
    gap: float
    rate: float
    """At the segment's wall."""
    terms: float
    """Size of the gap's terms."""


@by_class
def flight_start(model: Any, segment: Segment) -> Any:
    """What a flight follows from."""


@by_class
def flight_at(model: Any, segment: Segment, start: Any, tau: float) -> Sample:
    """Motion in flight a time `tau` after the segment's start."""


@by_class
def contact_force(model: Any, segment: Segment, tau: float, at: Sample) -> tuple[float, float]:
    """Contact force in sticking over the free mass, and the size of its terms."""


@by_class
def support_stiffness(model: Any) -> float:
    """Stiffness that ties the free mass to the frame, over that of the primary."""


@by_class
def support_speed(model: Any, x: float, v: float, duration: float) -> float:
    """Speed that the support gives or takes in a time; `x` and `v` are sizes of the primary's."""


@by_class
def contact_speed(model: Any, segment: Segment) -> float:
    """Speed at which a lasting contact would swing: what slow velocities in it round by."""
