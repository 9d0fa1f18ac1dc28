"""Descriptions of what a cube holds. Kept light: gathering and drawing need no engine."""

from dataclasses import dataclass
from enum import IntEnum

from damper.parameters.units import ACCELERATION as ACCELERATION
from damper.parameters.units import ENERGY as ENERGY
from damper.parameters.units import IMPULSE as IMPULSE
from damper.parameters.units import LENGTH as LENGTH
from damper.parameters.units import SI_UNITS as SI_UNITS
from damper.parameters.units import SPEED as SPEED
from damper.parameters.units import SPRING_FORCE as SPRING_FORCE
from damper.parameters.units import TIME as TIME

#: Stands for no value in the integers that observers write; a cube has NaN there.
NO_VALUE = -1

#: Visible impacts that make a burst chatter (both papers).
CHATTER_IMPACTS = 5


class Chatter(IntEnum):
    """Codes of the variable `chatter`."""

    NONE = 0
    INCOMPLETE = 1
    COMPLETE = 2


@dataclass(frozen=True)
class Variable:
    """One variable of a cube: its name, description and dimensions after the axes'.

    `units` are empty for a text. `flags` are the meanings of its values 0, 1, 2, ...
    """

    name: str
    long_name: str
    units: str
    dims: tuple[str, ...] = ()
    dtype: str = "f8"
    comment: str = ""
    flags: tuple[str, ...] = ()


#: Variables of which some values are worse than others -> which of several runs' values is worst.
WORST = {
    "peak_displacement": "greatest",
    "rms_displacement": "greatest",
    "amplitude_ratio": "greatest",
    "rms_ratio": "greatest",
    "chatter": "greatest",
    "peak_force": "greatest",
    "peak_acceleration": "greatest",
    # Wear.
    "impacts_per_period": "greatest",
    "mean_approach_speed": "greatest",
    "max_approach_speed": "greatest",
    # A free vibration is to die out.
    "fall_time": "greatest",
    "energy_left": "greatest",
    "energy_to_impacts": "least",
    "equivalent_damping_ratio": "least",
}

#: Why `damper.engine.trajectory.run` returned, in the order of its codes.
STATUS_MEANINGS = ("finished", "max_events_reached", "search_gave_up")

STATUS = Variable(
    "status",
    "why the run ended",
    "1",
    dtype="i1",
    comment="0 finished; 1 budget of max_events used up; 2 a search for an event gave up",
    flags=STATUS_MEANINGS,
)

#: Dimensions beside the axes: long name and units.
OWN_DIMENSIONS = {
    "sample": ("sample on the section", "1"),
    "body": ("free mass, from 0", "1"),
    "threshold": ("visibility threshold, part of the burst's first approach speed", "1"),
    "burst": ("burst in the window", "1"),
    "since": ("start of the part of the window, in cycles", "1"),
    "direction": ("direction in which the followed axis is run through", ""),
    "draw": ("random draw", "1"),
    "complete_burst": ("complete burst in the window, from 1", "1"),
    "burst_impact": ("impact of the burst, from 1", "1"),
    "half_cycle": ("half cycle of the primary in the window, from 1", "1"),
    "part": ("part of the first peak", "1"),
    "exponent": ("Lyapunov exponent, the largest first", "1"),
    "segment": ("segment of the run, in the order of time", "1"),
    "instant": ("sample or event of the trajectory", "1"),
}
