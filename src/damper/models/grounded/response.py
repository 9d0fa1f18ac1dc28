"""The response where the free mass is tied to ground: what a segment of it adds up to.

The primary in flight is that of the rigid damper. Together the masses swing about a place of rest
of their own, and the support's dashpot takes energy in every segment.
"""

import math

from damper.engine.compiled import compiled
from damper.engine.oscillator import acceleration
from damper.engine.segment import FLIGHT, MODE, PERIOD, RATE, SIDE, TAIL, TIME, V, X
from damper.models import motion, time_to_sticking
from damper.models.grounded import Grounded, rest_shift
from damper.observers.response import (
    SPEED_SQUARE,
    SUPPORT,
    add_bounces,
    add_oscillation,
    add_part,
    primary_and_masses,
    stored_energy,
)


@add_part.of(Grounded)
def _add_part(model, more, row, low, high, totals):
    free = model.free
    mass_ratio = model.mass_ratio
    flies = row[MODE] == FLIGHT
    side = float(row[SIDE])
    rate = float(row[RATE])
    x = float(row[X])
    v = float(row[V])
    if not flies:
        # The common velocity of both masses; in sticking the rate is zero.
        v -= side * (mass_ratio / (1.0 + mass_ratio)) * rate
    osc = free if flies else model.stuck
    shift = 0.0 if flies else rest_shift(model, side)
    angle = free[3] * float(row[TIME]) + model.phase
    sin = math.sin(angle)
    cos = math.cos(angle)
    a, j = acceleration(osc, x + shift, v, sin, cos)
    start = (x + shift, v, a, j, sin, cos)
    if row[MODE] == TAIL and rate > 0.0:
        own = float(row[V])
        a, j = acceleration(free, x, own, sin, cos)
        duration, _ = time_to_sticking(
            model, float(row[PERIOD]), float(row[TIME]), side, x, own, rate, a, j, sin, cos
        )
        add_bounces(
            model.restitution, mass_ratio, osc, row, start, shift, duration, low, high, totals
        )
    # The support's loss is told of the centre alone; the bounces are its own affair.
    # Summed apart: a heavily damped support makes much of a small part of the whole integral.
    before = float(totals[SPEED_SQUARE])
    totals[SPEED_SQUARE] = 0.0
    add_oscillation(osc, start, shift, low, high, row[MODE] != TAIL, totals)
    centre = float(totals[SPEED_SQUARE])
    totals[SPEED_SQUARE] = before + centre
    totals[SUPPORT] += _support_loss(model, row, low, high, centre)


@stored_energy.of(Grounded)
def _stored_energy(model, row, tau):
    return primary_and_masses(model, row, tau) + _support_energy(model, row, tau)


@compiled
def _support_energy(model, row, tau):
    """Energy of the support's spring, a time `tau` after a segment's start.

    Inside a closed tail less what its dashpot has taken from the centre in the bounce under way.
    """
    side = float(row[SIDE])
    x, v, gap, _ = motion(model, row, tau)
    y = x + side * (model.clearance - gap)
    energy = 0.5 * model.stiffness * y * y
    if row[MODE] == TAIL:
        # As for the primary's dashpot: what this one has given the centre in the bounce under way.
        energy += 2.0 * model.damping * v * side / (1.0 + model.mass_ratio) * gap
    return energy


@compiled
def _support_loss(model, row, low, high, speed_square):
    """Energy that the support's dashpot takes from `low` to `high` of a segment.

    `speed_square` is the integral of the square of the velocity of both masses' centre over that
    part; it matters where they are in contact.
    """
    if model.damping == 0.0:
        return 0.0
    side = float(row[SIDE])
    if row[MODE] == FLIGHT:
        # What spring and free mass have lost: nothing else acts on them.
        return _free_energy(model, row, low) - _free_energy(model, row, high)
    if row[MODE] == TAIL:
        share = model.mass_ratio / (1.0 + model.mass_ratio)
        for k in range(2):
            tau = high if k == 1 else low
            sign = 1.0 if k == 1 else -1.0
            _, v, gap, bounce = motion(model, row, tau)
            # The bounce under way has carried the free mass back from the centre.
            centre = v - side * share * bounce
            speed_square -= sign * 2.0 * centre * side / (1.0 + model.mass_ratio) * gap
    return 2.0 * model.damping * speed_square


@compiled
def _free_energy(model, row, tau):
    """Energy of the free mass and its spring, a time `tau` after a segment's start."""
    side = float(row[SIDE])
    x, v, gap, rate = motion(model, row, tau)
    y = x + side * (model.clearance - gap)
    u = v - side * rate
    return 0.5 * (model.stiffness * y * y + model.mass_ratio * u * u)
