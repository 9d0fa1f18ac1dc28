"""The response where the free mass is tied to ground: what a segment of it adds up to.

The primary in flight is that of the rigid damper. Together the masses swing about a place of rest
of their own, and the support's dashpot takes energy in every segment.
"""

import math

from damper.flow import acceleration
from damper.models import rest_shift, support_loss, time_to_sticking
from damper.models.grounded import Grounded
from damper.observers.response import (
    SPEED_SQUARE,
    SUPPORT,
    add_bounces,
    add_oscillation,
    add_part,
)
from damper.segment import FLIGHT, MODE, PERIOD, RATE, SIDE, TAIL, TIME, V, X


@add_part.of(Grounded)
def _add_part(model, row, low, high, totals):
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
    before = float(totals[SPEED_SQUARE])
    add_oscillation(osc, start, shift, low, high, row[MODE] != TAIL, totals)
    centre = float(totals[SPEED_SQUARE]) - before
    totals[SUPPORT] += support_loss(model, row, low, high, centre)
