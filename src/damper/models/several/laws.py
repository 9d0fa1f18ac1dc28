"""Functions of several free masses for the observer `laws`: each law at one instant."""

import numpy as np

from damper.engine.bodies import acceleration_of
from damper.engine.compiled import compiled
from damper.engine.forcing import phase_at, rate_of
from damper.engine.impact import restitution_at
from damper.engine.search import ROUNDOFF
from damper.engine.segment import IMPACT, NOTHING, RESTING, STICKING, TAIL
from damper.models.laws import (
    compare_masses,
    have_rigid_walls,
    larger,
    largest_force,
    mass_speed,
    phase_in,
    sample_masses,
    samples_in,
    violation,
)
from damper.models.several.bodies import (
    CAUSE,
    CLEARANCE,
    DAMPING,
    GAP,
    GRAVITY,
    MODE,
    RATE,
    RATIO,
    SIDE,
    SPEED,
    STIFFNESS,
    Several,
    begin,
    body_in,
    flight_of_body,
    flying,
    friction_of,
    gap_after,
    is_joined,
    law_of,
    mass_at,
)
from damper.models.several.motion import bodies_in, primary_after

have_rigid_walls(Several)
#: Columns of what `_unclipped` finds of each mass; the last is the size of the gap's terms.
_GAP, _RATE, _SIZE = range(3)


@compiled
def _unclipped(model, s, start, tau):
    """State of the primary a time after a segment's start, and of each mass the gap as it is."""
    x, v, bodies = bodies_in(model, s, tau)
    p = start.primary
    centre, speed, way, change = primary_after(start, tau)
    found = np.zeros((len(bodies), 3))
    for k in range(len(bodies)):
        b = bodies[k]
        if is_joined(b[MODE]):
            found[k, _GAP], found[k, _RATE] = b[GAP], b[RATE]
            found[k, _SIZE] = abs(b[GAP]) + abs(b[RATE]) * tau
            continue
        seg, view, own = flight_of_body(
            model.single, mass_at(model, k), body_in(s.bodies, k), start
        )
        gap, rate, roundoff = gap_after(own, view, seg, way, change, tau)
        # The bounces of a tail move the primary about the centre that it follows.
        found[k, _GAP] = gap + seg.side * (x - centre)
        found[k, _RATE] = rate + seg.side * (v - speed)
        found[k, _SIZE] = roundoff / ROUNDOFF + (abs(seg.gap_rate) + abs(p.v)) * tau
    return x, v, found


@compiled
def _is_hit(s, k):
    """Whether an impact of a mass begins a segment, or is still to be told."""
    return s.bodies[k, CAUSE] == IMPACT or (s.cause == IMPACT and k == int(s.body))


@compiled
def _is_over(model, s, k, rebound):
    """Whether a chatter sequence that is closed at its last impact has no more time left."""
    phase = phase_at(model.free.forcing, s.periods, s.time)
    y = s.x + float(s.bodies[k, SIDE] * model.masses[k, CLEARANCE])
    a = acceleration_of(model.free, s.x, s.v, phase)
    pressed = abs(a - acceleration_of(flying(model.single, mass_at(model, k), 0.0), y, s.v, phase))
    # Masses at rest pull the primary at most as their weight and their supports would.
    pressed += friction_of(model, k) + float(np.max(np.abs(model.masses[:, GRAVITY])))
    for j in range(len(s.bodies)):
        pull = support_size(model, j, s.x, s.v)
        pressed += pull if j == k else float(model.masses[j, RATIO]) * pull
    for j in range(len(s.bodies)):
        pressed += float(model.masses[j, RATIO]) * friction_of(model, j)
    return rebound <= model.tolerance * pressed


@compiled
def support_size(model: Several, k: int, x: float, v: float) -> float:
    """Size of the acceleration by the support of a mass that moves with the primary."""
    m = model.masses[k]
    place = abs(x) + float(m[CLEARANCE])
    return float(m[STIFFNESS]) * place + 2.0 * float(m[DAMPING]) * abs(v)


@compiled
def _brakes(model, s, rates):
    """Change of the primary's velocity by masses that come to rest at once after impacts.

    `rates` are those before the impacts, at the walls that are hit.
    """
    heavier, pushed = 1.0, 0.0
    for k in range(len(s.bodies)):
        b = s.bodies[k]
        side, ratio, rate = float(b[SIDE]), float(model.masses[k, RATIO]), 0.0
        if is_joined(b[MODE]):
            heavier += ratio
            if _is_hit(s, k) and b[RATE] == 0.0:
                rate = -restitution_at(
                    law_of(model.single, mass_at(model, k), side), -float(rates[k])
                ) * float(rates[k])
            elif b[SPEED] < 0.0:
                rate = -float(b[SPEED])
        pushed += side * ratio * rate
    return -pushed / heavier


@compiled
def _speeds(model, last, v, ends, x):
    """Size of the terms of a velocity: velocities at the ends, changes by forces and dashpot."""
    force = largest_force(model)
    size = abs(last.v) + abs(v) + (force + abs(last.x)) * min(last.duration, 1.0)
    size += abs(last.v) * min(2.0 * model.free.damping * last.duration, 1.0)
    for k in range(len(ends)):
        clearance, gravity = model.masses[k, CLEARANCE], model.masses[k, GRAVITY]
        size += abs(ends[k, _RATE]) + abs(last.bodies[k, RATE])
        size += float(abs(gravity)) * last.duration
        mass = flying(model.single, mass_at(model, k), 0.0)
        size += mass_speed(mass, float(clearance), abs(x), abs(last.v), last.duration)
    return size


@compare_masses.of(Several)
def _compare(model, last, s, found):
    x, v, ends = _unclipped(model, last, begin(model, last), last.duration)
    speeds = _speeds(model, last, v, ends, x)
    lengths = largest_force(model) + abs(x) + abs(last.x)
    # Events of one instant have a segment each; the first segment has the whole change.
    first = not np.any(last.bodies[:, CAUSE] != NOTHING)
    jump = violation(s.x - x, lengths + abs(last.v) * last.duration)
    jump = larger(jump, violation((s.v_before if first else s.v) - v, speeds))
    change, any_hit = s.v - v, False
    rates = ends[:, _RATE] * s.bodies[:, SIDE] * last.bodies[:, SIDE]
    brakes = _brakes(model, s, rates) if first else 0.0
    for k in range(len(ends)):
        b = s.bodies[k]
        side, old = float(b[SIDE]), float(last.bodies[k, SIDE])
        gap, rate, size = ends[k, _GAP], ends[k, _RATE], lengths + ends[k, _SIZE]
        u = v - old * rate
        if side != old:
            width = 2.0 * float(model.masses[k, CLEARANCE])
            gap, rate, size = width - gap, -rate, size + width
        own = s.v - side * float(b[RATE])
        change += float(model.masses[k, RATIO]) * (own - u)
        if first and _is_hit(s, k):
            any_hit = True
            found.touch = larger(found.touch, violation(gap, size))
            rebound = (
                -restitution_at(law_of(model.single, mass_at(model, k), side), -float(rate)) * rate
            )
            if not (b[MODE] == TAIL and b[RATE] == 0.0 and _is_over(model, s, k, rebound)):
                law = violation(float(b[RATE]) - (rebound + side * brakes), speeds)
                found.restitution_law = larger(found.restitution_law, law)
            continue
        if first and b[SPEED] < 0.0:
            # It has been kicked off its wall by what the impacts alone do, and not for long.
            kick = side * (s.v - brakes - v)
            if not _is_over(model, s, k, kick):
                found.restitution_law = larger(found.restitution_law, violation(kick, speeds))
            law = violation(float(b[SPEED]) + kick, speeds)
            found.restitution_law = larger(found.restitution_law, law)
        jump = larger(jump, violation(float(b[GAP]) - gap, size))
        # A mass that sticks is pressed on, also where it is released at once.
        if not (last.bodies[k, MODE] == STICKING and b[RATE] == 0.0):
            jump = larger(jump, violation(own - u, speeds))
    if any_hit:
        momentum = violation(change, speeds * (1.0 + model.mass_ratio))
        found.momentum = larger(found.momentum, momentum)
    else:
        jump = larger(jump, violation(s.v - v, speeds))
    found.continuity = larger(found.continuity, jump)


@sample_masses.of(Several)
def _sample(model, s, found):
    start = begin(model, s)
    forcing_rate = rate_of(model.free.forcing)
    samples = samples_in(model.free.rate, forcing_rate, s.duration)
    bounces = np.any(s.bodies[:, MODE] == TAIL)
    force = largest_force(model)
    for k in range(samples + 1):
        # Denser towards both ends, where the walls are.
        at = (k + 0.5) / samples
        tau = s.duration * (at * at * (3.0 - 2.0 * at)) if k < samples else s.duration
        x, v, all_gaps = _unclipped(model, s, start, tau)
        energy = 0.5 * (x * x + v * v)
        phase = phase_in(start.osc.forcing, s, tau)
        a = acceleration_of(start.osc, x, v, phase)
        for j in range(len(all_gaps)):
            ratio, clearance, gravity = model.masses[j, RATIO], model.masses[j, CLEARANCE], 0.0
            gravity = float(abs(model.masses[j, GRAVITY]))
            gap, rate, size = all_gaps[j, _GAP], all_gaps[j, _RATE], all_gaps[j, _SIZE]
            side = float(s.bodies[j, SIDE])
            depth = max(-gap, gap - 2.0 * clearance, 0.0)
            found.penetration = larger(found.penetration, violation(depth, force + abs(x) + size))
            # The free mass's velocity is a difference, with the roundoff of its terms.
            energy += ratio * abs(v - side * rate) * (abs(v) + abs(rate))
            energy += ratio * gravity * (abs(x) + clearance)
            energy += 0.5 * ratio * model.masses[j, STIFFNESS] * (abs(x) + clearance) ** 2
            held = s.bodies[j, MODE] in (STICKING, RESTING)
            if held and not bounces:
                y = x + side * (clearance - s.bodies[j, GAP])
                pressed = side * (
                    acceleration_of(flying(model.single, mass_at(model, j), 0.0), y, v, phase) - a
                )
                if s.bodies[j, MODE] == RESTING:
                    pressed = -abs(pressed)
                most = friction_of(model, j)
                pressed, gravity = pressed + most, gravity + most
                speed = abs(v) + abs(s.v) + (force + abs(s.x)) * min(s.duration, 1.0)
                size = force + gravity + 2.0 * model.free.damping * speed + abs(x) + abs(s.x)
                size += support_size(model, j, max(abs(x), abs(s.x)), speed)
                tensile = violation(min(pressed, 0.0), size)
                found.tensile_force = larger(found.tensile_force, tensile)
        found.largest = max(found.largest, energy)
