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
    kinds: np.ndarray, sides: np.ndarray, speeds: np.ndarray, bodies: np.ndarray
) -> tuple[WallImpacts, ...]:
    """Bursts of the events of a period, whichever event is its first; of several mass by mass.

    Where dry friction stops a free mass off the walls, no burst ends.
    """
    on_walls = kinds <= RELEASE
    kinds, sides, speeds, bodies = (column[on_walls] for column in (kinds, sides, speeds, bodies))
    found: list[WallImpacts] = []
    for body in np.unique(bodies).astype(int).tolist():
        own = np.flatnonzero(bodies == body)
        for burst in _bursts_of(kinds[own], sides[own], speeds[own]):
            found.append(burst._replace(body=body))
    return tuple(found)


def stops_in(kinds: np.ndarray, sides: np.ndarray, bodies: np.ndarray) -> tuple[int, ...]:
    """How often dry friction stops each free mass, but for stops between impacts of one burst.

    Of another one's bursts those count that complete: each of their impacts moves what rests.
    """
    stops, counts = (kinds == REST) | (kinds == REVERSAL), []
    for body in np.unique(bodies):
        left: list[int] = np.flatnonzero(stops & (bodies == body)).tolist()
        for other in np.unique(bodies):
            walls = np.flatnonzero((kinds <= RELEASE) & (bodies == other))
            left = [k for k in left if not _is_in_burst(kinds, sides, walls, k, other != body)]
        counts.append(len(left))
    return tuple(counts)


def _is_in_burst(
    kinds: np.ndarray, sides: np.ndarray, walls: np.ndarray, k: int, completes: bool
) -> bool:
    """Whether an event is between those of one burst at a wall, or of one that completes."""
    walls = np.roll(walls, -int(np.searchsorted(walls, k)))
    if not len(walls) or kinds[walls[-1]] != IMPACT:
        return False
    goes_on = (kinds[walls] == IMPACT) & (sides[walls] == sides[walls[-1]])
    end, ends = (walls[np.argmin(goes_on)], (STICK,)) if completes else (walls[0], (IMPACT, STICK))
    return bool(sides[end] == sides[walls[-1]] and kinds[end] in ends)


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
