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

**States** inside a step lie on the chord. **The balance** takes the impulse's own work,
P times the mean of g0' and g1', as what impacts take; with theta = 1/2 it then closes to roundoff,
a property of the midpoint rule that says nothing about the errors of the motion.
"""

import math
from collections.abc import Sequence

from damper.engine.compiled import compiled
from damper.engine.segment import IMPACT, RELEASE, STICK
from damper.models.walls import slack
from damper.verification.comparison.fixed_step import (
    CAP,
    DONE,
    FAILURE,
    count_of,
    fill,
    impact_loss,
    note,
    records,
    solve_by,
)
from damper.verification.comparison.scene import Scene
from damper.verification.comparison.solution import Solution
from damper.verification.comparison.solvers import Solver

THETA = 0.5
#: Steps without an impulse after which sticking has ended.
_APART = 3


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
    return solve_by(_run, scene, setting, times, balance, max_evaluations)


@compiled
def _run(
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
    together = d == 0.0
    if together:
        # Between two walls at once, for good.
        lost += impact_loss(mu, u - v, 0.0)
        v = (v + mu * u) / (1.0 + mu)
        u = v
    wall = 0.0  # of the contact under way
    since = start  # when it began
    acted = False  # whether the step before had an impulse
    stuck = False
    free = 0  # steps since the last impulse
    parted = start  # end of the last step with one
    last = start  # no event is read off before another
    force0 = math.sin(omega * start + phase)
    steps = count_of(start, until, step)
    index = 0
    time = start
    while index < steps:
        if evaluations >= max_evaluations:
            code = CAP
            break
        index += 1
        end = until if index == steps else start + index * step
        h = end - time
        force1 = math.sin(omega * end + phase)
        evaluations += 1
        force = THETA * force1 + (1.0 - THETA) * force0
        force0 = force1

        # The step without walls.
        heavy = 1.0 + THETA * h * (2.0 * zeta + THETA * h)
        weight = 1.0 - THETA
        inert = mu if together else 0.0
        v1 = v + h * (force - x - v * (2.0 * zeta + THETA * h)) / (heavy + inert)
        u1 = v1 if together else u
        side = 1.0 if y >= x else -1.0
        gap = d - side * (y - x)
        if index == 1 and abs(gap) <= slack(d, x, y):
            gap = 0.0
        rate0 = -side * (u - v)
        impulse = 0.0
        if not together and gap + 0.5 * h * rate0 <= 0.0:
            rate1 = -side * (u1 - v1)
            ease = 1.0 / mu + 1.0 / heavy
            impulse = max(-(rate1 + r * rate0) / ease, 0.0)
            v1 += side * impulse / heavy
            u1 -= side * impulse / mu
            if balance:
                lost -= impulse * (THETA * -side * (u1 - v1) + weight * rate0)

        # What the impulses mean.
        if impulse > 0.0:
            if not acted and not stuck:
                wall = side
                since = time
                if rate0 < 0.0:
                    since = min(max(time - gap / rate0, last), until)
                    notes, events = note(notes, events, since, IMPACT, side, -rate0)
                last = since
            elif acted and not stuck and side == wall:
                stuck = True
                notes, events = note(notes, events, since, STICK, side, 0.0)
            free = 0
            parted = end
        elif stuck:
            free += 1
            if free >= _APART:
                stuck = False
                last = parted
                notes, events = note(notes, events, parted, RELEASE, wall, 0.0)
        acted = impulse > 0.0

        v_mean = THETA * v1 + weight * v
        u_mean = THETA * u1 + weight * u
        if balance:
            work += h * force * v_mean
            dissipated += h * 2.0 * zeta * v_mean * v_mean
        while taken < len(times) and times[taken] < end:
            part = (float(times[taken]) - time) / h
            states[taken, 0] = x + part * h * v_mean
            states[taken, 1] = v + part * (v1 - v)
            states[taken, 2] = y + part * h * u_mean
            states[taken, 3] = u + part * (u1 - u)
            taken += 1
        x += h * v_mean
        y += h * u_mean
        v = v1
        u = u1
        time = end
        if not (abs(x) <= limit and abs(v) <= limit):
            code = FAILURE
            break
        penetration = max(penetration, abs(y - x) - d)
    if code == DONE:
        fill(states, taken, times, time, x, v, y, u)
    totals = (work, dissipated, lost)
    return notes[:events], states, (x, v, y, u), totals, penetration, evaluations, code, time


SOLVERS = {"moreau_jean": Solver("Moreau-Jean", "steps_per_period", +1, ("rigid",), 2e7, solve)}
