"""Dry friction of many free masses and their boxes: how a mass begins and ends a rest or a slide.

A mass that slides has in `SLIP_DIRECTION` the sign of its velocity less that of its box. It is held
off the walls as `RESTING`. Each model solves for the forces that would hold all masses with no
relative velocity; what follows for each mass is here.
"""

from typing import Any, NamedTuple

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class
from damper.engine.segment import (
    FLIGHT,
    NOTHING,
    RELEASE,
    REST,
    RESTING,
    REVERSAL,
    SLIP,
    STICK,
    STICKING,
)
from damper.models.many import (
    ACCUMULATION,
    CAUSE,
    FIRST,
    GAP,
    MODE,
    RATE,
    SIDE,
    is_on_wall,
)
from damper.models.masses import NoFriction as NoFriction

#: Column of `MassesSegment.bodies` behind the first ones: sign of the mass's velocity less that of
#: its box where the mass rubs, else 0.
SLIP_DIRECTION = 8
#: Friction that does nothing.
LEAST_FRICTION = 1e-300


class Frictions(NamedTuple):
    """Dry friction of free masses and their boxes."""


@by_class
def known_friction(friction: Any, acceleration: float) -> float:
    """Acceleration by friction, which compiled code knows to be 0 where no mass rubs."""


@known_friction.of(NoFriction)
def _no_friction(friction, acceleration):
    return 0.0


@known_friction.of(Frictions)
def _own_friction(friction, acceleration):
    return acceleration


@compiled
def is_joined(mode: float) -> bool:
    """Whether a free mass moves with its box, or about the centre that the tail has."""
    return is_on_wall(mode) or mode == RESTING


@compiled
def turn(b: np.ndarray) -> None:
    """Let a mass that moves relative to its box slide that way; in place."""
    way = -b[SIDE] if b[RATE] > 0.0 else b[SIDE]
    if b[MODE] == RESTING:  # another one's impact moves its box
        b[MODE], b[CAUSE] = FLIGHT, SLIP
    elif b[SLIP_DIRECTION] == -way and b[CAUSE] == NOTHING:
        b[CAUSE] = REVERSAL
    b[SLIP_DIRECTION] = way


@compiled
def rest_or_part(b: np.ndarray, beyond: float, slack: float, way: float, mode: float) -> None:
    """Let a mass without relative velocity rest, or part from its box, in place.

    It parts where it is asked for more than what holds it, `beyond` which a mass that has been at
    rest has `slack`, and slides a `way` then, 0 without friction. Newly at rest on a wall it gets
    `mode`.
    """
    on_wall = b[GAP] == 0.0
    if is_joined(b[MODE]):
        if b[CAUSE] == NOTHING and beyond > slack:
            b[MODE], b[SLIP_DIRECTION] = FLIGHT, way
            b[CAUSE] = RELEASE if on_wall else SLIP
            b[FIRST] = 0.0 if on_wall else b[FIRST]
    elif beyond > 0.0:
        if b[CAUSE] == NOTHING and way != 0.0 and b[SLIP_DIRECTION] == -way:
            b[CAUSE] = REVERSAL
        b[SLIP_DIRECTION] = way
    else:
        b[MODE] = mode if on_wall else RESTING
        b[SLIP_DIRECTION], b[ACCUMULATION] = 0.0, 0.0
        if not on_wall:
            b[CAUSE] = REST
        elif mode == STICKING:
            b[CAUSE] = STICK


@compiled
def clamp_slides(bodies: np.ndarray) -> None:
    """Let slides go one way up to their end, whatever roundoff makes of their speed; in place."""
    for k in range(len(bodies)):
        b = bodies[k]
        if b[MODE] == FLIGHT and b[SLIP_DIRECTION] * b[SIDE] * b[RATE] > 0.0:
            b[RATE] = 0.0
