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
show that flight. The masses then move as a single oscillator, at a constant distance. They part at
the end of a step at which the wall no longer pushes.
"""

from damper.engine.compiled import compiled
from damper.engine.segment import IMPACT, RELEASE, STICK
from damper.verification.comparison import fixed_step as steps


@compiled
def _run(p):
    x, v, y, u = p.x, p.v, p.y, p.u
    stuck, side, offset = False, 0.0, 0.0
    evaluations, deepest, index, outcome = 0, 0.0, 0, steps.DONE
    events = [steps.NO_EVENT]
    time = p.start
    while True:
        if stuck:
            evaluations += 1
            stuck = steps.wall_acceleration(p, 1.0 + p.mu, x, v, time, side)[0] >= 0.0
            if not stuck:
                events.append((time, RELEASE, side, 0.0))
        else:
            side = steps.nearer_wall(x, y)
            depth, speed = side * (y - x) - p.d, side * (u - v)
            deepest = max(deepest, depth)
            if depth >= 0.0 and speed > 0.0:
                rebound = p.r * speed
                events.append((time, IMPACT, side, speed))
                v += steps.kick(p, side, speed)
                u = v - side * rebound
                common = steps.common_velocity(p.mu, v, u)
                evaluations += 1
                if steps.sticks(p, x, common, time, side, rebound, p.step):
                    stuck, offset = True, y - x
                    v = u = common
                    events.append((time, STICK, side, 0.0))
        if index == p.steps:
            break
        if evaluations >= p.most:
            outcome = steps.CAP
            break
        index += 1
        h = steps.end_of(p, index) - time
        curve, dv = steps.rk4(p, 1.0 + p.mu if stuck else 1.0, x, v, time, h)
        evaluations += 4
        x = x + (v * h + curve)
        v = v + dv
        y = x + offset if stuck else y + u * h
        if stuck:
            u = v
        time = steps.end_of(p, index)
        if steps.has_blown_up(p, x, v):
            outcome = steps.FAILURE
            break
    return steps.SteppedRun(outcome, time, evaluations, deepest, (x, v, y, u), events)


SOLVER = steps.fixed_step(3e7, _run)
