"""Classical Runge-Kutta with a fixed step, impacts looked for at the ends of steps.

This is how impact dampers are usually simulated, the papers included. A step goes through the wall
as if there were none. At its end, if |y - x| >= d and the masses approach, the law of impact is
applied there and then: positions stay, beyond the wall as they may be. So an impact is late by up
to a step, the method is of first order, and two crossings within one step are not seen at all.

**Sticking** has to be added by hand. Left alone, the free mass sinks through a wall that pushes it
with the acceleration a: with impacts at every step end, the rebound speed settles at
r a h / (1 + r), and the mass goes deeper by a h^2 (1 - r) / (2 (1 + r)) per step h - slowly, but
without end. So after an impact with the rebound speed w, the masses stay together if the wall
pushes, a > 0, and the flight back to it, 2 w / a long, takes no more than a step: the steps cannot
show that flight. Both masses are then one oscillator, at the distance they have, until at a step's
end the wall no longer pushes.

**Compliant contact** is a spring and a dashpot (`damper.models.compliant`), so all four components
are integrated, through the corners of the force as well. An impact is a gap that has closed at a
step's end, its approach speed the larger one of the step's two ends; a contact counts as sticking
once it has lasted a period of its own oscillation, as in the engine. Where the step is too long for
the wall's stiffness the method is unstable and blows up.

States inside a step come from a shorter Runge-Kutta step, of local order five. Work and losses are
further components of the state, and what an impact takes is that of its own speeds.
"""

import math
from typing import NamedTuple

from damper.engine.compiled import compiled
from damper.engine.segment import IMPACT, RELEASE, STICK
from damper.models.compliant.restitution import contact_damping
from damper.models.walls import slack
from damper.verification.comparison.fixed_step import (
    Damper,
    Masses,
    advance,
    begin,
    common_velocity,
    damper_of,
    deepen,
    fixed_step,
    force_at,
    impact_loss,
    inside,
    lose,
    nearer_wall,
    note,
    rk4,
    settle,
    spend,
    sticks,
    transfer,
    wall_acceleration,
)
from damper.verification.comparison.scene import Scene
from damper.verification.comparison.solvers import Solver


class RigidMethod(NamedTuple):
    """The method for rigid walls."""

    damper: Damper
    step: float


class RigidState(NamedTuple):
    """State at the end of a step."""

    x: float
    v: float
    y: float
    u: float
    side: float
    stuck: bool
    offset: float
    """y - x of masses that move as one."""


@begin.of(RigidMethod)
def _begin_rigid(method, start, time, tally):
    p = method.damper
    x, v, y, u = start
    if p.d > 0.0:
        return RigidState(x, v, y, u, 0.0, False, 0.0), tally
    # Together for good, with no wall to leave.
    tally = lose(tally, impact_loss(p.mu, u - v, 0.0))
    v = common_velocity(p.mu, v, u)
    return RigidState(x, v, y, v, 0.0, True, y - x), tally


@settle.of(RigidMethod)
def _settle_rigid(method, state, time, index, notes, tally):
    p = method.damper
    x, v, y, u, side, stuck, offset = state
    if stuck:
        if side != 0.0:
            tally = spend(tally, 1)
            a, _ = wall_acceleration(p, 1.0 + p.mu, x, v, time, side)
            if a < 0.0:
                stuck = False
                tally = note(notes, tally, time, RELEASE, side, 0.0)
        return RigidState(x, v, y, u, side, stuck, offset), tally
    side = nearer_wall(x, y)
    depth = side * (y - x) - p.d
    tally = deepen(tally, depth)
    speed = side * (u - v)
    touches = depth >= 0.0 and speed > 0.0
    if index == 0:
        touches = depth >= -slack(p.d, x, y) and speed >= 0.0
    if touches:
        rebound = p.r * speed
        if speed > 0.0:
            tally = note(notes, tally, time, IMPACT, side, speed)
            tally = lose(tally, impact_loss(p.mu, speed, rebound))
            v += side * p.mu * (1.0 + p.r) / (1.0 + p.mu) * speed
            u = v - side * rebound
        common = common_velocity(p.mu, v, u)
        tally = spend(tally, 1)
        a, j = wall_acceleration(p, 1.0, x, common, time, side)
        if sticks(a, j, rebound, method.step):
            stuck = True
            offset = y - x
            tally = lose(tally, impact_loss(p.mu, rebound, 0.0))
            v = u = common
            tally = note(notes, tally, time, STICK, side, 0.0)
    return RigidState(x, v, y, u, side, stuck, offset), tally


@compiled
def _fly(method, state, time, h):
    """State and energies a time h later, without walls."""
    p = method.damper
    mass = 1.0 + p.mu if state.stuck else 1.0
    curve, dv, work, loss = rk4(p, mass, state.x, state.v, time, h)
    x = state.x + (state.v * h + curve)
    v = state.v + dv
    if state.stuck:
        return Masses(x, v, x + state.offset, v), work, loss
    return Masses(x, v, state.y + state.u * h, state.u), work, loss


@advance.of(RigidMethod)
def _advance_rigid(method, state, piece, tally):
    end, work, loss = _fly(method, state, piece.time, piece.left)
    tally = spend(transfer(tally, work, loss), 4)
    after = RigidState(end.x, end.v, end.y, end.u, state.side, state.stuck, state.offset)
    return after, tally, piece.left, False


@inside.of(RigidMethod)
def _inside_rigid(method, state, after, piece, part):
    here, _, _ = _fly(method, state, piece.time, part)
    return here


class CompliantMethod(NamedTuple):
    """The method for compliant contact."""

    damper: Damper
    k: float
    c: float
    """Stiffness and damping of the contact."""
    tension: bool
    """Whether the contact force may be tensile."""
    lasting: float
    """Duration from which on a contact is sticking."""


class CompliantState(NamedTuple):
    """State at the end of a step."""

    x: float
    v: float
    y: float
    u: float
    speed: float
    """u - v at the step's start."""
    wall: float
    """Below whose surface the free mass is, or 0."""
    pressed: bool
    """Whether there is contact with that wall."""
    stuck: bool
    began: float
    """When the contact began."""


@begin.of(CompliantMethod)
def _begin_compliant(method, start, time, tally):
    x, v, y, u = start
    return CompliantState(x, v, y, u, 0.0, 0.0, False, False, time), tally


@settle.of(CompliantMethod)
def _settle_compliant(method, state, time, index, notes, tally):
    d = method.damper.d
    x, v, y, u, speed, wall, pressed, stuck, began = state
    side = nearer_wall(x, y)
    gap = d - side * (y - x)
    if index == 0 and gap >= -slack(d, x, y):
        gap = max(gap, 0.0)
    tally = deepen(tally, -gap)
    compressive = method.tension or method.k * gap - method.c * side * (u - v) < 0.0
    now = gap < 0.0 and compressive
    if pressed and not (now and side == wall):
        pressed = False
        if stuck:
            stuck = False
            tally = note(notes, tally, time, RELEASE, wall, 0.0)
    if gap < 0.0 and side != wall and index > 0:
        tally = note(notes, tally, time, IMPACT, side, max(side * speed, side * (u - v), 0.0))
    wall = side if gap < 0.0 else 0.0
    if now and not pressed:
        pressed = True
        began = time
    if pressed and not stuck and time - began >= method.lasting:
        stuck = True
        tally = note(notes, tally, time, STICK, side, 0.0)
    return CompliantState(x, v, y, u, speed, wall, pressed, stuck, began), tally


@advance.of(CompliantMethod)
def _advance_compliant(method, state, piece, tally):
    x, v, y, u, _, wall, pressed, stuck, began = state
    speed = u - v
    x, v, y, u, work, loss, taken = _step(method, x, v, y, u, piece.time, piece.left)
    tally = spend(tally, 4)
    tally = transfer(tally, work, loss)
    tally = lose(tally, taken)
    after = CompliantState(x, v, y, u, speed, wall, pressed, stuck, began)
    return after, tally, piece.left, False


@inside.of(CompliantMethod)
def _inside_compliant(method, state, after, piece, part):
    x, v, y, u, _, _, _ = _step(method, state.x, state.v, state.y, state.u, piece.time, part)
    return Masses(x, v, y, u)


@compiled
def _forces(method, x, v, y, u, time):
    """Both accelerations, the force's power, and what dashpot and walls take per unit of time."""
    p = method.damper
    force = force_at(p, time)
    side = nearer_wall(x, y)
    gap = p.d - side * (y - x)
    normal = 0.0
    taken = 0.0
    if gap < 0.0:
        rate = -side * (u - v)
        normal = -(method.k * gap + method.c * rate)
        if not method.tension and normal < 0.0:
            normal = 0.0
        taken = -(normal + method.k * gap) * rate
    return (
        force - 2.0 * p.zeta * v - x + side * normal,
        -side * normal / p.mu,
        force * v,
        2.0 * p.zeta * v * v,
        taken,
    )


@compiled
def _step(method, x, v, y, u, time, h):
    """One Runge-Kutta step of all four components, work and losses."""
    half = 0.5 * h
    a1, b1, p1, q1, l1 = _forces(method, x, v, y, u, time)
    v2 = v + half * a1
    u2 = u + half * b1
    a2, b2, p2, q2, l2 = _forces(method, x + half * v, v2, y + half * u, u2, time + half)
    v3 = v + half * a2
    u3 = u + half * b2
    a3, b3, p3, q3, l3 = _forces(method, x + half * v2, v3, y + half * u2, u3, time + half)
    v4 = v + h * a3
    u4 = u + h * b3
    a4, b4, p4, q4, l4 = _forces(method, x + h * v3, v4, y + h * u3, u4, time + h)
    sixth = h / 6.0
    return (
        x + (h * v + sixth * h * (a1 + a2 + a3)),
        v + sixth * (a1 + 2.0 * (a2 + a3) + a4),
        y + (h * u + sixth * h * (b1 + b2 + b3)),
        u + sixth * (b1 + 2.0 * (b2 + b3) + b4),
        sixth * (p1 + 2.0 * (p2 + p3) + p4),
        sixth * (q1 + 2.0 * (q2 + q3) + q4),
        sixth * (l1 + 2.0 * (l2 + l3) + l4),
    )


def _method(scene: Scene, step: float) -> RigidMethod | CompliantMethod:
    p = scene.parameters
    if scene.model == "rigid":
        return RigidMethod(damper_of(scene), step)
    tension = bool(p.contact_tension)
    k = p.contact_stiffness_ratio
    reduced = p.mass_ratio / (1.0 + p.mass_ratio)
    c = 2.0 * contact_damping(p.restitution, tension) * math.sqrt(k * reduced)
    return CompliantMethod(damper_of(scene), k, c, tension, 2.0 * math.pi * math.sqrt(reduced / k))


SOLVERS = {
    "rk4_step_end": Solver(
        "steps_per_period",
        +1,
        ("rigid", "compliant"),
        3e7,
        fixed_step(_method),
    )
}
