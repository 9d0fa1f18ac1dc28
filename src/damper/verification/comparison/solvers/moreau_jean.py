"""Moreau-Jean time stepping: no events at all, impulses instead of forces at the walls.

(Moreau, in Nonsmooth Mechanics and Applications, 1988, 1-82; Jean, Comput. Methods Appl. Mech.
Eng. 177, 1999, 235-257.) The equations of motion are integrated over a step h by the theta rule,
here theta = 1/2, the midpoint rule:

    v1 - v0 = h (f - 2 zeta v - x) + s P,    mu (u1 - u0) = -s P,    x1 - x0 = h v

with f, v, x weighted, theta times the end plus 1 - theta times the start. The wall s takes part if
the gap it would have half a step later, g + g' h / 2, is not positive. Newton's law then holds for
the velocities at the two ends of the step: g1' + r g0' >= 0, P >= 0, one of them zero. Positions
are not corrected, so the free mass enters a wall by up to half a step's way. Bursts accumulate and
end by themselves. The method is of first order wherever there is an impulse.

**Events** are read off from the impulses.

- The first impulse after a step without is an impact, if the masses approach. Its time is where
  the gap of the step's start, drawn on with its rate, vanishes; its speed is that rate.
- A second impulse in the very next step makes it sticking, since the first of the two: the bounce
  is shorter than the steps can show.
- Sticking ends with the last impulse before `_APART` steps without one. A single free step is a
  wall taken up again by drift, not a release.
"""

from damper.engine.compiled import compiled
from damper.engine.segment import IMPACT, RELEASE, STICK
from damper.verification.comparison import fixed_step as steps

#: Steps without an impulse after which sticking has ended.
_APART = 3


@compiled
def _run(p):
    x, v, y, u = p.x, p.v, p.y, p.u
    evaluations, deepest, outcome = 0, 0.0, steps.DONE
    events = [steps.NO_EVENT]
    time, force1 = p.start, steps.force_at(p, p.start)
    # The contact under way: whether the step before had an impulse, the wall, when it began, steps
    # since the last impulse and when that was; and before which no event is read off.
    acted, stuck, wall, since, free = False, False, 0.0, time, 0
    parted = last = time
    for index in range(1, p.steps + 1):
        if evaluations >= p.most:
            outcome = steps.CAP
            break
        start, force0 = time, force1
        time = steps.end_of(p, index)
        h, force1 = time - start, steps.force_at(p, time)
        evaluations += 1
        side = steps.nearer_wall(x, y)
        gap, rate = p.d - side * (y - x), -side * (u - v)
        v1, u1, impulse = _velocities(p, h, 0.5 * (force0 + force1), (x, v, u), (side, gap, rate))
        x, y = x + h * (0.5 * (v + v1)), y + h * (0.5 * (u + u1))
        v, u = v1, u1
        if steps.has_blown_up(p, x, v):
            outcome = steps.FAILURE
            break
        deepest = max(deepest, abs(y - x) - p.d)
        if impulse > 0.0:
            if not acted and not stuck:
                wall, since = side, start
                if rate < 0.0:
                    since = min(max(since - gap / rate, last), p.until)
                    events.append((since, IMPACT, side, -rate))
                last = since
            elif acted and not stuck and side == wall:
                stuck = True
                events.append((since, STICK, side, 0.0))
            free, parted = 0, time
        elif stuck:
            free += 1
            if free >= _APART:
                stuck, last = False, parted
                events.append((parted, RELEASE, wall, 0.0))
        acted = impulse > 0.0
    return steps.SteppedRun(outcome, time, evaluations, deepest, (x, v, y, u), events)


@compiled
def _velocities(p, h, force, at, contact):
    """Velocities at the end of a step under a mean force, and the impulse at the wall."""
    x, v, u = at
    side, gap, rate = contact
    heavy = 1.0 + 0.5 * h * (2.0 * p.zeta + 0.5 * h)
    v1 = v + h * (force - x - v * (2.0 * p.zeta + 0.5 * h)) / heavy
    u1 = u
    impulse = 0.0
    if gap + 0.5 * h * rate <= 0.0:
        ease = 1.0 / p.mu + 1.0 / heavy
        impulse = max(-(-side * (u1 - v1) + p.r * rate) / ease, 0.0)
        v1 += side * impulse / heavy
        u1 -= side * impulse / p.mu
    return v1, u1, impulse


SOLVER = steps.fixed_step(2e7, _run)
