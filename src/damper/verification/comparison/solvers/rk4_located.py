"""Classical Runge-Kutta with a fixed step that impacts cut: they are located inside the step.

A step that ends beyond a wall is cut short there: the length of a Runge-Kutta step whose end lies
on the wall is found by Newton's iteration in a bracket, to roundoff. The law of impact is applied,
and what is left of the step is done from there, as often as need be. A release is located alike, by
the force between the masses. A step that goes out and comes back is not noticed.

The gap is held as such and is exactly zero after an impact. So bounces far below the roundoff of
y - x are resolved as well.

**Sticking** begins after an impact with the rebound speed w if the contact force is positive,
a > 0, and the flight back, 2 w / a, takes no more than h^2 max(1, omega), h the step. Up to O(w^3)
the masses after that follow the motion of the stuck pair (docs/method.md), that is up to O(h^6):
all that comes after a burst keeps the fourth order of the rest. Sticking itself begins too early
by 2 w / (a (1 - r)), O(h^2) / (1 - r): second order.

With a step so short that a bounce no longer moves the time, before sticking sets in, the run has
stalled; `_IDLE` events in a row without progress say so.

States inside a step come from a shorter Runge-Kutta step, of local order five.
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
    STALL,
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

#: Events in a row at one and the same time that make a stall.
_IDLE = 100
_ITERATIONS = 100
_ROUNDOFF = 2.220446049250313e-16


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
    shortest = step * step * max(1.0, omega)

    # Relative to the wall, as far as the masses are not stuck.
    side = 1.0 if y >= x else -1.0
    gap = d - side * (y - x)
    rate = -side * (u - v)
    if gap <= slack(d, x, y):
        gap = 0.0
    stuck = False
    arrived = -1.0  # approach speed of masses that have just met
    if d == 0.0:
        # Together for good, with no wall to leave.
        stuck = True
        lost += impact_loss(mu, rate, 0.0)
        v = (v + mu * u) / (1.0 + mu)
        rate = 0.0
    elif gap == 0.0 and rate <= 0.0:
        arrived = -rate
    met = arrived > 0.0  # whether it counts as an impact

    steps = count_of(start, until, step)
    index = 0
    done = 0.0
    begin = start
    end = until if steps <= 1 else start + step
    time = start
    last = -math.inf
    idle = 0
    while True:
        if arrived >= 0.0:
            # On the wall, and no longer or not yet apart.
            rate = r * arrived
            if met:
                notes, events = note(notes, events, time, IMPACT, side, arrived)
                lost += impact_loss(mu, arrived, rate)
                v += side * mu * (1.0 + r) / (1.0 + mu) * arrived
            common = v - side * mu / (1.0 + mu) * rate
            evaluations += 1
            a, j = contact_force(1.0, zeta, omega, phase, x, common, time, side)
            rests = a > 0.0 and 2.0 * rate <= a * shortest
            if rests or (rate == 0.0 and a == 0.0 and j > 0.0):
                stuck = True
                lost += impact_loss(mu, rate, 0.0)
                v = common
                rate = 0.0
                notes, events = note(notes, events, time, STICK, side, 0.0)
            arrived = -1.0
            idle = 0 if time > last else idle + 1
            last = time
            if idle >= _IDLE:
                code = STALL
                break
        left = (end - begin) - done
        if left <= 0.0:
            if index + 1 >= steps:
                break
            index += 1
            begin = end
            time = begin
            done = 0.0
            end = until if index + 1 == steps else start + (index + 1) * step
            left = end - begin
        if evaluations >= max_evaluations:
            code = CAP
            break

        mass = 1.0 + mu if stuck else 1.0
        curve, dv, in_work, in_dashpot = rk4(mass, zeta, omega, phase, x, v, time, left)
        evaluations += 4
        tau = left
        ends = False
        if stuck:
            if side != 0.0 and d > 0.0:
                evaluations += 1
                a, j = contact_force(
                    mass, zeta, omega, phase, x + (v * left + curve), v + dv, time + left, side
                )
                if a < 0.0:
                    ends = True
                    tau, more = _find_release(mass, zeta, omega, phase, side, x, v, time, left)
                    evaluations += more
        else:
            near = gap + (rate * left + side * curve)
            if near < 0.0 or near > 2.0 * d:
                ends = True
                if near > 2.0 * d:
                    side = -side
                    gap = 2.0 * d - gap
                    rate = -rate
                tau, more = _find_impact(zeta, omega, phase, side, x, v, gap, rate, time, left)
                evaluations += more
        if ends:
            curve, dv, in_work, in_dashpot = rk4(mass, zeta, omega, phase, x, v, time, tau)
            evaluations += 4
        while taken < len(times) and times[taken] < time + tau:
            part = max(float(times[taken]) - time, 0.0)
            bend, turn, _, _ = rk4(mass, zeta, omega, phase, x, v, time, part)
            evaluations += 4
            states[taken, 0] = x + (v * part + bend)
            states[taken, 1] = v + turn
            distance = gap
            opened = rate
            if not stuck:
                distance += rate * part + side * bend
                opened += side * turn
            states[taken, 2] = states[taken, 0] + side * (d - distance)
            states[taken, 3] = v + turn - side * opened
            taken += 1
        if balance:
            work += in_work
            dissipated += in_dashpot
        if not stuck:
            gap += rate * tau + side * curve
            rate += side * dv
            penetration = max(penetration, -gap)
        x += v * tau + curve
        v += dv
        done += tau
        time = begin + done
        if not ends:
            done = end - begin
            time = end
        elif stuck:
            stuck = False
            gap = 0.0
            rate = 0.0
            notes, events = note(notes, events, time, RELEASE, side, 0.0)
        else:
            gap = 0.0
            arrived = max(-rate, 0.0)
            met = True
        if not (abs(x) <= limit and abs(v) <= limit):
            code = FAILURE
            break
    y = x + side * (d - gap)
    u = v - side * rate
    if code == DONE:
        fill(states, taken, times, time, x, v, y, u)
    totals = (work, dissipated, lost)
    return notes[:events], states, (x, v, y, u), totals, penetration, evaluations, code, time


@compiled
def _find_impact(zeta, omega, phase, side, x, v, gap, rate, time, left):
    """Length of the step that ends on the wall, for one that would end beyond it.

    A start on the wall counts as before it: the root sought is the later one.
    """
    low = 0.0
    high = left
    evaluations = 0
    tau = high
    for iteration in range(_ITERATIONS):
        curve, dv, _, _ = rk4(1.0, zeta, omega, phase, x, v, time, tau)
        evaluations += 4
        value = gap + (rate * tau + side * curve)
        slope = rate + side * dv
        if value < 0.0:
            high = tau
        else:
            low = tau
        following = tau - value / slope if slope < 0.0 else low
        if not low < following < high or iteration > _ITERATIONS // 2:
            if value == 0.0 or (slope < 0.0 and abs(value / slope) <= 2.0 * _ROUNDOFF * tau):
                break
            following = 0.5 * (low + high)
        if abs(following - tau) <= 2.0 * _ROUNDOFF * tau:
            break
        tau = following
    return tau, evaluations


@compiled
def _find_release(mass, zeta, omega, phase, side, x, v, time, left):
    """Length of the step at whose end the contact force vanishes, for one that goes beyond that."""
    low = 0.0
    high = left
    evaluations = 0
    tau = high
    for _ in range(_ITERATIONS):
        curve, dv, _, _ = rk4(mass, zeta, omega, phase, x, v, time, tau)
        value, slope = contact_force(
            mass, zeta, omega, phase, x + (v * tau + curve), v + dv, time + tau, side
        )
        evaluations += 5
        if value < 0.0:
            high = tau
        else:
            low = tau
        following = tau - value / slope if slope < 0.0 else low
        if not low < following < high:
            following = 0.5 * (low + high)
        if abs(following - tau) <= 2.0 * _ROUNDOFF * tau or value == 0.0:
            break
        tau = following
    return tau, evaluations


SOLVERS = {
    "rk4_located": Solver("RK4, impacts located", "steps_per_period", +1, ("rigid",), 3e7, solve)
}
