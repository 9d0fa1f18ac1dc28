"""The word of a motion: its bursts of impacts, wall by wall."""

from itertools import groupby
from typing import NamedTuple

import numpy as np

from damper.engine.segment import IMPACT, RELEASE, REST, REVERSAL, STICK


class WallImpacts(NamedTuple):
    """Impacts on one wall, one after the other."""

    wall: str
    """R or L."""
    impacts: int
    """How many; where they complete, so that masses join: how often the approach speed rises."""
    completes: bool
    slowest: float
    """Smallest approach speed; where they complete, of those before a faster one (else inf)."""
    body: int = 0
    """Number of the free mass."""


def bursts_of(
    kinds: np.ndarray, sides: np.ndarray, speeds: np.ndarray, bodies: np.ndarray | None = None
) -> tuple[WallImpacts, ...]:
    """Bursts of the events of a period, whichever event is its first; of several mass by mass.

    Where dry friction stops a free mass off the walls, no burst ends.
    """
    on_walls = kinds <= RELEASE
    kinds, sides, speeds = kinds[on_walls], sides[on_walls], speeds[on_walls]
    bodies = None if bodies is None else bodies[on_walls]
    if bodies is None:
        return _bursts_of(kinds, sides, speeds)
    found: list[WallImpacts] = []
    for body in np.unique(bodies).astype(int).tolist():
        own = np.flatnonzero(bodies == body)
        for burst in _bursts_of(kinds[own], sides[own], speeds[own]):
            found.append(burst._replace(body=body))
    return tuple(found)


def stops_in(kinds: np.ndarray, sides: np.ndarray) -> int:
    """How often dry friction stops the free mass, but for stops between impacts of one burst."""
    walls, count = np.flatnonzero(kinds <= RELEASE), 0
    for k in np.flatnonzero((kinds == REST) | (kinds == REVERSAL)) if len(walls) else ():
        next = int(np.searchsorted(walls, k)) % len(walls)
        last, next = walls[next - 1], walls[next]
        in_burst = kinds[last] == IMPACT and kinds[next] != RELEASE and sides[last] == sides[next]
        count += not in_burst
    return count


def word_of(bursts: tuple[WallImpacts, ...]) -> str:
    """The word: of several free masses those of each, which a bar parts."""
    words = [
        " ".join(f"{b.wall}{'S' if b.completes else b.impacts}" for b in each)
        for _, each in groupby(bursts, lambda burst: burst.body)
    ]
    return " | ".join(words)


def _bursts_of(kinds: np.ndarray, sides: np.ndarray, speeds: np.ndarray) -> tuple[WallImpacts, ...]:
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
