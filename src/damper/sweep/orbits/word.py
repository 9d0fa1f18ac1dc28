"""The word of a motion: its bursts of impacts, wall by wall."""

from itertools import groupby
from typing import NamedTuple

import numpy as np

from damper.engine.segment import IMPACT, STICK


class WallImpacts(NamedTuple):
    """Impacts on one wall, one after the other."""

    wall: str
    """R or L."""
    impacts: int
    """How many; where they complete, so that masses join: how often the approach speed rises."""
    completes: bool
    slowest: float
    """Smallest approach speed; where they complete, of those before a faster one (else inf)."""


def bursts_of(kinds: np.ndarray, sides: np.ndarray, speeds: np.ndarray) -> tuple[WallImpacts, ...]:
    """Bursts of the events of a period, whichever event is its first."""
    found: list[WallImpacts] = []
    # A period may begin within a burst.
    first = next((k for k in range(len(kinds)) if kinds[k - 1] or sides[k - 1] != sides[k]), 0)
    kinds, sides, speeds = (np.roll(each, -first) for each in (kinds, sides, speeds))
    for (kind, side), group in groupby(range(len(kinds)), lambda k: (kinds[k], sides[k])):
        if kind == IMPACT:
            struck = speeds[list(group)]
            found.append(WallImpacts("R" if side > 0 else "L", len(struck), False, struck.min()))
        elif kind == STICK and found:
            before_rise = struck[:-1][np.diff(struck) > 0.0]
            slowest = before_rise.min(initial=np.inf)
            found[-1] = found[-1]._replace(
                impacts=len(before_rise), completes=True, slowest=slowest
            )
    turns = [tuple(found[k:] + found[:k]) for k in range(len(found))]
    return max(turns, key=lambda turn: [burst[:3] for burst in turn], default=())
