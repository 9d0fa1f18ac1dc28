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
from collections.abc import Sequence

from damper.engine.compiled import compiled
from damper.engine.segment import IMPACT, RELEASE, STICK
from damper.models.compliant.restitution import contact_damping
from damper.models.walls import slack
from damper.verification.comparison.fixed_step import (
    CAP,
    DONE,
    FAILURE,
    contact_force,
    count_of,
    fill,
    impact_loss,
    note,
    records,
    rk4,
    solve_by,
)
from damper.verification.comparison.scene import Scene
from damper.verification.comparison.solution import Solution
from damper.verification.comparison.solvers import Solver


def solve(
    scene: Scene,
    setting: float,
    times: Sequence[float],
    balance: bool,
    max_evaluations: int,
) -> Solution:
    """Run a scene with `setting` steps per forcing period; see `Solver`.

    Raises
    ------
    ValueError
        For a setting that is not a positive number.
    """
    loop, wall = _rigid, ()
    if scene.model == "compliant":
        p = scene.parameters
        k = p.contact_stiffness_ratio
        reduced = p.mass_ratio / (1.0 + p.mass_ratio)
        c = 2.0 * contact_damping(p.restitution, bool(p.contact_tension)) * math.sqrt(k * reduced)
        lasting = 2.0 * math.pi * math.sqrt(reduced / k)
        loop, wall = _compliant, (k, c, bool(p.contact_tension), lasting)
    return solve_by(loop, scene, setting, times, balance, max_evaluations, wall)


@compiled
def _rigid(
    mu,
    zeta,
    omega,
    d,
    r,
    phase,
    x,
    v,
    y,
    u,
    start,
    until,
    step,
    limit,
    times,
    balance,
    max_evaluations,
):
    notes, states = records(len(times))
    events = taken = evaluations = 0
    work = dissipated = lost = penetration = 0.0
    code = DONE
    side = 0.0
    stuck = False
    offset = 0.0
    if d == 0.0:
        # Together for good, with no wall to leave.
        stuck = True
        offset = y - x
        lost += impact_loss(mu, u - v, 0.0)
        v = (v + mu * u) / (1.0 + mu)
        u = v
    steps = count_of(start, until, step)
    index = 0
    time = start
    while True:
        # At a step's end: what the wall has to say.
        if stuck:
            if side != 0.0:
                evaluations += 1
                a, _ = contact_force(1.0 + mu, zeta, omega, phase, x, v, time, side)
                if a < 0.0:
                    stuck = False
                    notes, events = note(notes, events, time, RELEASE, side, 0.0)
        else:
            side = 1.0 if y >= x else -1.0
            depth = side * (y - x) - d
            penetration = max(penetration, depth)
            speed = side * (u - v)
            touches = depth >= 0.0 and speed > 0.0
            if index == 0:
                touches = depth >= -slack(d, x, y) and speed >= 0.0
            if touches:
                rebound = r * speed
                if speed > 0.0:
                    notes, events = note(notes, events, time, IMPACT, side, speed)
                    lost += impact_loss(mu, speed, rebound)
                    v += side * mu * (1.0 + r) / (1.0 + mu) * speed
                    u = v - side * rebound
                common = (v + mu * u) / (1.0 + mu)
                evaluations += 1
                a, j = contact_force(1.0, zeta, omega, phase, x, common, time, side)
                rests = a > 0.0 and 2.0 * rebound <= a * step
                if rests or (rebound == 0.0 and a == 0.0 and j > 0.0):
                    stuck = True
                    offset = y - x
                    lost += impact_loss(mu, rebound, 0.0)
                    v = common
                    u = common
                    notes, events = note(notes, events, time, STICK, side, 0.0)
        if index >= steps:
            break
        if evaluations >= max_evaluations:
            code = CAP
            break

        index += 1
        end = until if index == steps else start + index * step
        h = end - time
        mass = 1.0 + mu if stuck else 1.0
        while taken < len(times) and times[taken] < end:
            part = float(times[taken]) - time
            curve, dv, _, _ = rk4(mass, zeta, omega, phase, x, v, time, part)
            evaluations += 4
            states[taken, 0] = x + (v * part + curve)
            states[taken, 1] = v + dv
            states[taken, 2] = states[taken, 0] + offset if stuck else y + u * part
            states[taken, 3] = v + dv if stuck else u
            taken += 1
        curve, dv, in_work, in_dashpot = rk4(mass, zeta, omega, phase, x, v, time, h)
        evaluations += 4
        x += v * h + curve
        v += dv
        if stuck:
            y = x + offset
            u = v
        else:
            y += u * h
        if balance:
            work += in_work
            dissipated += in_dashpot
        time = end
        if not (abs(x) <= limit and abs(v) <= limit):
            code = FAILURE
            break
    if code == DONE:
        fill(states, taken, times, time, x, v, y, u)
    totals = (work, dissipated, lost)
    return notes[:events], states, (x, v, y, u), totals, penetration, evaluations, code, time


@compiled
def _forces(mu, zeta, omega, d, phase, k, c, tension, x, v, y, u, time):
    """Both accelerations, the force's power, and what dashpot and walls take per unit of time."""
    force = math.sin(omega * time + phase)
    side = 1.0 if y >= x else -1.0
    gap = d - side * (y - x)
    normal = 0.0
    taken = 0.0
    if gap < 0.0:
        rate = -side * (u - v)
        normal = -(k * gap + c * rate)
        if not tension and normal < 0.0:
            normal = 0.0
        taken = -(normal + k * gap) * rate
    return (
        force - 2.0 * zeta * v - x + side * normal,
        -side * normal / mu,
        force * v,
        2.0 * zeta * v * v,
        taken,
    )


@compiled
def _step(mu, zeta, omega, d, phase, k, c, tension, x, v, y, u, time, h):
    """One Runge-Kutta step of all four components, work and losses."""
    half = 0.5 * h
    a1, b1, p1, q1, l1 = _forces(mu, zeta, omega, d, phase, k, c, tension, x, v, y, u, time)
    v2 = v + half * a1
    u2 = u + half * b1
    a2, b2, p2, q2, l2 = _forces(
        mu, zeta, omega, d, phase, k, c, tension, x + half * v, v2, y + half * u, u2, time + half
    )
    v3 = v + half * a2
    u3 = u + half * b2
    a3, b3, p3, q3, l3 = _forces(
        mu, zeta, omega, d, phase, k, c, tension, x + half * v2, v3, y + half * u2, u3, time + half
    )
    v4 = v + h * a3
    u4 = u + h * b3
    a4, b4, p4, q4, l4 = _forces(
        mu, zeta, omega, d, phase, k, c, tension, x + h * v3, v4, y + h * u3, u4, time + h
    )
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


@compiled
def _compliant(
    mu,
    zeta,
    omega,
    d,
    r,
    phase,
    k,
    c,
    tension,
    lasting,
    x,
    v,
    y,
    u,
    start,
    until,
    step,
    limit,
    times,
    balance,
    max_evaluations,
):
    notes, states = records(len(times))
    events = taken = evaluations = 0
    work = dissipated = lost = penetration = 0.0
    code = DONE
    speed = 0.0
    wall = 0.0  # below whose surface the free mass is
    pressed = False  # whether there is contact with that wall
    stuck = False
    began = start
    steps = count_of(start, until, step)
    index = 0
    time = start
    while True:
        # At a step's end: which contact there is.
        side = 1.0 if y >= x else -1.0
        gap = d - side * (y - x)
        if index == 0 and gap >= -slack(d, x, y):
            gap = max(gap, 0.0)
        penetration = max(penetration, -gap)
        now = gap < 0.0 and (tension or k * gap - c * side * (u - v) < 0.0)
        if pressed and not (now and side == wall):
            pressed = False
            if stuck:
                stuck = False
                notes, events = note(notes, events, time, RELEASE, wall, 0.0)
        if gap < 0.0 and side != wall and index > 0:
            speed = max(side * speed, side * (u - v), 0.0)
            notes, events = note(notes, events, time, IMPACT, side, speed)
        wall = side if gap < 0.0 else 0.0
        if now and not pressed:
            pressed = True
            began = time
        if pressed and not stuck and time - began >= lasting:
            stuck = True
            notes, events = note(notes, events, time, STICK, side, 0.0)
        if index >= steps:
            break
        if evaluations >= max_evaluations:
            code = CAP
            break

        index += 1
        end = until if index == steps else start + index * step
        while taken < len(times) and times[taken] < end:
            part = float(times[taken]) - time
            x1, v1, y1, u1, _, _, _ = _step(
                mu, zeta, omega, d, phase, k, c, tension, x, v, y, u, time, part
            )
            evaluations += 4
            states[taken, 0] = x1
            states[taken, 1] = v1
            states[taken, 2] = y1
            states[taken, 3] = u1
            taken += 1
        speed = u - v
        x, v, y, u, in_work, in_dashpot, in_walls = _step(
            mu, zeta, omega, d, phase, k, c, tension, x, v, y, u, time, end - time
        )
        evaluations += 4
        if balance:
            work += in_work
            dissipated += in_dashpot
            lost += in_walls
        time = end
        if not (abs(x) <= limit and abs(v) <= limit and abs(y) <= limit):
            code = FAILURE
            break
    if code == DONE:
        fill(states, taken, times, time, x, v, y, u)
    totals = (work, dissipated, lost)
    return notes[:events], states, (x, v, y, u), totals, penetration, evaluations, code, time


SOLVERS = {
    "rk4_step_end": Solver(
        "RK4, impacts at step ends", "steps_per_period", +1, ("rigid", "compliant"), 3e7, solve
    )
}
