"""Simultaneous contacts of several free masses: impacts, and who stays on a wall and who leaves."""

import math
from typing import Any

import numpy as np

from damper.engine.bodies import acceleration_of
from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class, by_class_or_default
from damper.engine.forcing import phase_at
from damper.engine.oscillator import motion_from
from damper.engine.search import ROUNDOFF
from damper.engine.segment import FLIGHT, IMPACT, RELEASE, STICK, STICKING
from damper.models.flights import VANISHES
from damper.models.several.bodies import (
    CAUSE,
    CLEARANCE,
    COMPLETION,
    FIRST,
    GAP,
    GRAVITY,
    LIFTS,
    MODE,
    RATE,
    RATIO,
    SIDE,
    SPEED,
    NoFriction,
    Several,
    SeveralSegment,
    mass_of,
    restitution_of,
)


@compiled
def balance(free: float, sides: np.ndarray, ratios: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Contacts that push, of those at the walls `sides`; a wall of 0 is none.

    Body i pushes with ratio_i (rests_i - side_i z) where that is positive, and all together make
    z = free + sum of side_i times that. For impulses z is the change of the primary's velocity
    and levels (1 + r) times the approach speed; for contact forces they are accelerations. What z
    must be less than this grows with z, in straight pieces from bend to bend, so there is one z.
    """
    lower, upper = -math.inf, math.inf
    count = len(sides)
    for k in range(count):
        if sides[k] != 0.0:
            z = float(sides[k] * levels[k])
            excess = z - free
            for i in range(count):
                if sides[i] != 0.0:
                    excess -= float(sides[i] * ratios[i] * max(0.0, levels[i] - sides[i] * z))
            if excess <= 0.0:
                lower = max(lower, z)
            if excess >= 0.0:
                upper = min(upper, z)
    pushes = np.zeros(count)
    for k in range(count):
        z = float(sides[k] * levels[k])
        if (sides[k] > 0.0 and z >= upper) or (sides[k] < 0.0 and z <= lower):
            pushes[k] = 1.0
    return pushes


@compiled
def balanced(
    free: float, sides: np.ndarray, ratios: np.ndarray, levels: np.ndarray, pushes: np.ndarray
) -> float:
    """The z of `balance`, where it is known who pushes."""
    z, heavier = free, 1.0
    for k in range(len(sides)):
        if pushes[k] == 1.0:
            z += float(sides[k] * ratios[k] * levels[k])
            heavier += float(ratios[k])
    return z / heavier


@compiled
def hit(model: Several, v: float, bodies: np.ndarray, arriving: np.ndarray) -> tuple[float, float]:
    """Impacts of one instant, in place; the primary's velocity after them, the energy lost.

    `arriving` has the wall at which each body arrives, or 0; its rate is that at its own wall.
    Bodies that touch a wall with no relative velocity take part, whether or not they stick to it.
    """
    count = len(bodies)
    ratios, sides, levels = model.masses[:, RATIO], np.zeros(count), np.zeros(count)
    for k in range(count):
        b = bodies[k]
        if arriving[k] != 0.0:
            speed = abs(float(b[RATE]))
            if b[SIDE] != arriving[k]:
                b[FIRST] = 0.0
            b[GAP], b[SIDE], b[SPEED] = 0.0, arriving[k], speed
            sides[k] = b[SIDE]
            levels[k] = (1.0 + restitution_of(model, k, float(b[SIDE]))) * speed
        elif b[MODE] == STICKING or (b[GAP] == 0.0 and b[RATE] == 0.0):
            sides[k] = b[SIDE]
    pushes = balance(0.0, sides, ratios, levels)
    change, loss = balanced(0.0, sides, ratios, levels, pushes), 0.0
    for k in range(count):
        b = bodies[k]
        if arriving[k] != 0.0:
            r, speed = restitution_of(model, k, float(b[SIDE])), float(b[SPEED])
            if pushes[k] == 1.0:
                impulse = float(ratios[k] * (levels[k] - sides[k] * change))
                loss += 0.5 * impulse * (1.0 - r) * speed
                b[RATE], b[CAUSE] = r * speed, IMPACT
                b[FIRST] = b[FIRST] if b[FIRST] > 0.0 else speed
            else:  # another one's impact takes the wall away
                b[RATE], b[SPEED] = sides[k] * change - speed, 0.0
        elif b[MODE] == STICKING:
            if pushes[k] == 0.0 and b[SIDE] * change > 0.0:
                b[MODE], b[RATE], b[CAUSE], b[FIRST] = FLIGHT, b[SIDE] * change, RELEASE, 0.0
        elif pushes[k] == 0.0:
            b[RATE] += b[SIDE] * change
    return v + change, loss


@compiled
def contact_forces(
    model: Several, s: SeveralSegment, sides: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Contact forces over the masses of bodies that rest on these walls, and sizes of their terms.

    A force below zero is that on a body which the others part from its wall; a wall of 0 is none.
    """
    count = len(sides)
    levels = np.zeros(count)
    phase = phase_at(model.free.forcing, s.periods, s.time)
    for k in range(count):
        if sides[k] != 0.0:
            y = s.x + sides[k] * model.masses[k, CLEARANCE]
            levels[k] = sides[k] * acceleration_of(mass_of(model, k, 0.0), y, s.v, phase)
    alone = motion_from(model.free, s.x, s.v, phase)
    ratios = model.masses[:, RATIO]
    pushes = balance(alone.a, sides, ratios, levels)
    a = balanced(alone.a, sides, ratios, levels, pushes)
    size = abs(alone.a) + abs(s.x) + 2.0 * model.free.damping * abs(s.v)
    return levels - sides * a, size + np.abs(levels)


@by_class
def settle(friction: Any, model: Several, s: SeveralSegment, mode: float) -> None:
    """Who stays at rest and who does not, of those with no relative velocity; in place.

    Who stays on a wall that has not stuck before gets this mode. Only what is more than roundoff
    throws one off that has.
    """


@settle.of(NoFriction)
def _settle(friction, model, s, mode):
    bodies = s.bodies
    count = len(bodies)
    sides = np.zeros(count)
    any_rests = False
    for k in range(count):
        b = bodies[k]
        if b[MODE] == STICKING or (b[GAP] == 0.0 and b[RATE] == 0.0 and b[CAUSE] != RELEASE):
            any_rests = True
            sides[k] = b[SIDE]
    if not any_rests:
        return
    forces, sizes = contact_forces(model, s, sides)
    for k in range(count):
        b = bodies[k]
        if sides[k] == 0.0:
            continue
        force = forces[k]
        if b[MODE] == STICKING:
            if b[CAUSE] != STICK and force < -VANISHES * ROUNDOFF * sizes[k]:
                b[MODE], b[CAUSE], b[FIRST] = FLIGHT, RELEASE, 0.0
        elif force >= 0.0:
            b[MODE] = mode
            b[COMPLETION] = 0.0
            if mode == STICKING:
                b[CAUSE] = STICK


@by_class_or_default
def slide_on(friction: Any, bodies: np.ndarray) -> None:
    """Let slides go one way up to their end, whatever roundoff makes of their speed; in place."""


@by_class
def let_go(friction: Any, model: Several, bodies: np.ndarray, k: int, side: float) -> None:
    """Let a mass that nothing holds any longer part from the primary; in place.

    With all to which that happens at this instant. `side` is that of the search.
    """


@let_go.of(NoFriction)
def _let_go(friction, model, bodies, k, side):
    for j in range(len(bodies)):
        alike = bodies[j, SIDE] == bodies[k, SIDE]
        alike = alike and model.masses[j, GRAVITY] == model.masses[k, GRAVITY]
        if bodies[j, MODE] == STICKING and alike:
            bodies[j, CAUSE] = RELEASE
    for j in range(len(bodies)):
        if bodies[j, CAUSE] == RELEASE:
            bodies[j, MODE], bodies[j, COMPLETION] = FLIGHT, LIFTS
