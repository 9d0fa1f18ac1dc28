"""Masses that pinch the primary: inelastic collapse, of infinitely many impacts in no time.

Each impact of one sends its wall against the other, at the opposite wall. With a and b the masses
that hit in turns, x their approach speeds one after the other and C = mu (1 + r)/(1 + mu),

    x2 = C_a x1 - r_b x0,    x3 = C_b x2 - r_a x1,    ...

so the ratios y1 = x2/x1, ... go by a Möbius map. Where C_a C_b >= (sqrt(r_a) + sqrt(r_b))^2 it has
two fixed points, and from beyond the lower one all ratios stay positive: the impacts never end. A
turn of both then takes (C_a - y) r_b / (y L) of the time of the one before, L = C_b y - r_a the
ratio of speeds, and y = y1 or the upper one, whichever is less. What is left is a tail: all speeds
vanish where all time is over. Masses in step are one of their whole mass. docs/models.md.
"""

import math
from typing import NamedTuple

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.search import ROUNDOFF
from damper.engine.segment import FLIGHT, IMPACT, TAIL
from damper.models.many import ACCUMULATION, GAP, MODE, RATE, SIDE, negligible
from damper.models.several.bodies import CLEARANCE, RATIO, YIELDS, Several, Start, body_in, mass_at
from damper.models.wall_laws import have_one_law, restitution_of

#: Turns of a pinch after which all but the same part of what is lost is lost by one of the two.
_MOST_TURNS = 1000
#: Shortest time that is left of one: it has a length, and times far below have few digits.
SHORTEST = 1e-200


@compiled
def close_pinch(model: Several, bodies: np.ndarray) -> bool:
    """Close the impacts of two masses that pinch the primary, which all but takes no time.

    Returned is whether there are such masses.
    """
    longest = negligible(model.tolerance)
    for k in range(len(bodies)):
        b = body_in(bodies, k)
        if not (b.mode == FLIGHT and b.cause == IMPACT and b.rate >= 0.0):
            continue
        for j in range(len(bodies)):
            c = body_in(bodies, j)
            comes = c.rate < 0.0 and c.gap <= -c.rate * longest and c.mode == FLIGHT
            if not comes or c.side == b.side:
                continue
            left = c.gap * times_over_gaps(bodies, k, j, turns_of(model, bodies, k, j))[0]
            if left <= longest and _are_alone(model, bodies, k, j, left):
                before = bodies.copy()
                for i in range(len(bodies)):
                    if _in_step(model, before, i, k) or _in_step(model, before, i, j):
                        bodies[i, MODE], bodies[i, ACCUMULATION] = TAIL, -max(left, SHORTEST)
                return True
    return False


class Turns(NamedTuple):
    """Speeds and times of a pinch, turn by turn."""

    next: float
    """Approach speed of the mass that leaves its wall, over that of the impact before."""
    speeds: float
    """Ratio by which speeds fall, the least of all turns."""
    back: float
    """Time in which the first comes back, over its way out in units of the other's speed."""
    times: float
    """Ratio by which times fall, the largest; infinite where the impacts end."""


@compiled
def turns_of(model: Several, bodies: np.ndarray, k: int, j: int) -> Turns:
    """Turns of body `k`, which leaves its wall, and `j`, which comes next at the opposite one."""
    b, c = bodies[k], bodies[j]
    own = restitution_of(mass_at(model, k), float(b[SIDE]))
    other = restitution_of(mass_at(model, j), float(c[SIDE]))
    mu, nu = _together(model, bodies, k), _together(model, bodies, j)
    first, second = nu * (1.0 + other) / (1.0 + nu), mu * (1.0 + own) / (1.0 + mu)
    y = first + float(b[RATE] / c[RATE])
    # Fixed points solve second y^2 - (first second + other - own) y + first other = 0.
    middle = 0.5 * (first * second + other - own)
    square = middle * middle - first * second * other
    # A wall that yields has another restitution turn by turn.
    speed = -float(c[RATE])
    yields = min(float(model.masses[j, YIELDS]), float(model.masses[k, YIELDS]) / max(y, 1.0))
    endless = first * second >= own + other and square >= 0.0 and y > 0.0 and speed <= yields
    if not (endless and second * y > middle - math.sqrt(square)):
        return Turns(y, 0.0, 0.0, math.inf)
    least = min(y, (middle + math.sqrt(square)) / second)
    speeds = second * least - other
    back = other / (least * speeds)
    return Turns(y, speeds, back, (first - least) * back)


@compiled
def times_over_gaps(bodies: np.ndarray, k: int, j: int, turns: Turns) -> tuple[float, float]:
    """Time that infinitely many impacts take, over the gaps of body `j` and of `k`; or infinity.

    Accelerations do nothing in so short a time.
    """
    if not turns.times < 1.0:
        return math.inf, math.inf
    speed = -float(bodies[j, RATE])
    scale = 1.0 / (speed * (1.0 - turns.times))
    other = 1.0 / turns.next
    return scale * (1.0 + other * float(bodies[k, RATE]) / speed), scale * (other + turns.back)


@compiled
def _in_step(model, bodies, i, k):
    """Whether body `i` moves as `k` does, at the same wall; it does so as itself."""
    b, c = bodies[i], bodies[k]
    side = float(c[SIDE])
    moves = b[GAP] == c[GAP] and b[RATE] == c[RATE] and b[MODE] == c[MODE]
    alike = have_one_law(mass_at(model, i), mass_at(model, k), side)
    return bool(moves and alike and b[SIDE] == side)


@compiled
def _are_alone(model, bodies, k, j, left):
    """Whether no other mass is near a wall while two pinch the primary."""
    for i in range(len(bodies)):
        c, width = bodies[i], 2.0 * float(model.masses[i, CLEARANCE])
        reach = (abs(c[RATE]) - 2.0 * bodies[j, RATE]) * left
        pinches = _in_step(model, bodies, i, k) or _in_step(model, bodies, i, j)
        if not pinches and not (c[MODE] == FLIGHT and reach < c[GAP] < width - reach):
            return False
    return True


@compiled
def is_pinched(bodies: np.ndarray) -> bool:
    """Whether a tail is that of a pinch, or of others that end in no time: all speeds fade away."""
    found = False
    for k in range(len(bodies)):
        found = found or bool(bodies[k, MODE] == TAIL and bodies[k, ACCUMULATION] < 0.0)
    return found


@compiled
def lost_in_pinch(model: Several, start: Start, bodies: np.ndarray) -> float:
    """Energy of the motion about the centre of all that joins, of which nothing is left."""
    energy, carried = 0.0, 0.0
    for k in range(len(bodies)):
        b = bodies[k]
        if b[MODE] == TAIL:
            momentum = float(model.masses[k, RATIO] * b[RATE])
            energy += 0.5 * momentum * float(b[RATE])
            carried += momentum * float(b[SIDE])
    return energy - 0.5 * carried * carried / (1.0 + start.joined)


@compiled
def share_of_pinch(model: Several, bodies: np.ndarray, body: int) -> float:
    """Part of what is lost in a pinch that is of one mass, impact by impact.

    Masses in step share as their masses. Other masses that end in no time lose nothing.
    """
    left, comes = -1, -1
    for k in range(len(bodies)):
        if bodies[k, MODE] == TAIL and bodies[k, RATE] < 0.0:
            comes = k
        elif bodies[k, MODE] == TAIL:
            left = k
    if left < 0 or comes < 0:
        return 0.0
    with_left, with_comes = (
        _in_step(model, bodies, body, left),
        _in_step(model, bodies, body, comes),
    )
    if not (with_left or with_comes):
        return 0.0
    own = comes if with_comes else left
    rate, speed = float(bodies[left, RATE]), -float(bodies[comes, RATE])
    first, second = _turn_of(model, bodies, comes), _turn_of(model, bodies, left)
    of_own, total, before, ratio = 0.0, 0.0, 0.0, -1.0
    turn, own_turn = 0.0, 0.0
    for _ in range(_MOST_TURNS):
        turn, own_turn = 0.0, 0.0
        for hits, (mu, r) in ((comes, first), (left, second)):
            lost = mu / (1.0 + mu) * (1.0 - r * r) * speed * speed
            turn += lost
            own_turn += lost if hits == own else 0.0
            rate, speed = r * speed, max(mu * (1.0 + r) / (1.0 + mu) * speed - rate, 0.0)
        of_own += own_turn
        total += turn
        last, ratio = ratio, turn / before if before > 0.0 else 0.0
        before = turn
        if turn <= ROUNDOFF * total or abs(ratio - last) <= ROUNDOFF:
            break
    # Each turn that is left loses the same part of the loss of the turn before.
    rest = ratio / (1.0 - ratio) if ratio < 1.0 else 0.0
    whole = total + rest * turn
    part = float(model.masses[body, RATIO]) / _together(model, bodies, own)
    return part * (of_own + rest * own_turn) / whole if whole > 0.0 else 0.0


@compiled
def _turn_of(model, bodies, k):
    """Mass ratio and restitution of what hits together."""
    return _together(model, bodies, k), restitution_of(mass_at(model, k), float(bodies[k, SIDE]))


@compiled
def _together(model, bodies, k):
    """Mass ratio of all that move as body `k` does."""
    ratio = 0.0
    for i in range(len(bodies)):
        ratio += float(model.masses[i, RATIO]) if _in_step(model, bodies, i, k) else 0.0
    return ratio
