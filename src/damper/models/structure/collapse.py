"""Inelastic collapse: infinitely many impacts in no time, as of masses that pinch their box."""

import numpy as np

from damper.engine.compiled import compiled, compiled_apart
from damper.engine.segment import FLIGHT
from damper.models.many import GAP, MODE, RATE, SIDE
from damper.models.several.contacts import negligible
from damper.models.structure.constants import ARRIVES, OnStructure
from damper.models.structure.contacts import rebound

#: Part of the first speed that counts as rest, and impacts after which half of it will do.
_AT_REST, _MOST_IMPACTS = 1e-12, 2000
#: Least gap of a mass in flight: its acceleration takes it off its wall between two impacts.
_OFF = 1e-300


@compiled
def may_collapse(bodies: np.ndarray, longest: float) -> bool:
    """Whether any mass comes to its wall in no time."""
    found = False
    for k in range(len(bodies)):
        b = bodies[k]
        found = found or bool(b[MODE] == FLIGHT and b[RATE] < 0.0 and b[GAP] <= -b[RATE] * longest)
    return found


@compiled_apart
def collapsing(model: OnStructure, bodies: np.ndarray) -> np.ndarray:
    """Masses whose impacts of the coming instant never end: all of them come to rest in no time.

    The impacts are followed one by one; no acceleration does anything in so short a time.
    """
    count, left = len(bodies), negligible(model.tolerance)
    now, hits, none = (
        bodies.copy(),
        np.zeros(count, dtype=np.bool_),
        np.zeros(count, dtype=np.bool_),
    )
    first = 0.0
    for number in range(_MOST_IMPACTS):
        k, soonest = -1, left
        for j in range(count):
            b = now[j]
            if b[MODE] == FLIGHT and b[RATE] < 0.0 and b[GAP] <= -b[RATE] * soonest:
                k, soonest = j, -b[GAP] / b[RATE]
        if k < 0:
            return none
        left -= soonest
        for j in range(count):
            if now[j, MODE] == FLIGHT:
                now[j, GAP] = max(now[j, GAP] + now[j, RATE] * soonest, _OFF)
            now[j, ARRIVES] = now[j, SIDE] if j == k else 0.0
        hits[k] = True
        first = -now[k, RATE] if number == 0 else first
        rebound(model, now)
        fastest = 0.0
        for j in range(count):
            if hits[j]:
                fastest = max(fastest, abs(now[j, RATE]))
        ends = number == _MOST_IMPACTS - 1 and fastest < 0.5 * first
        if number > 0 and (fastest <= _AT_REST * first or ends):
            return hits
    return none
