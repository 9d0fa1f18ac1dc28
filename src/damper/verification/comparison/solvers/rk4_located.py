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
motion after a burst keeps the fourth order. Sticking itself begins too early
by 2 w / (a (1 - r)), O(h^2) / (1 - r): second order.

With a step so short that a bounce no longer moves the time, before sticking sets in, the run has
stalled.
"""

from damper.engine.compiled import compiled
from damper.engine.roundoff import EPSILON
from damper.engine.segment import IMPACT, NOTHING, RELEASE, STICK
from damper.verification.comparison import fixed_step as steps

_ITERATIONS = 100
#: Events in a row without progress that make a stall.
_IDLE = 100


@compiled
def _run(p):
    x, v, side = p.x, p.v, steps.nearer_wall(p.x, p.y)
    gap, rate = p.d - side * (p.y - p.x), -side * (p.u - p.v)
    stuck, due = False, NOTHING
    shortest = p.step * p.step * max(1.0, p.omega)
    evaluations, deepest, outcome = 0, 0.0, steps.DONE
    events = [steps.NO_EVENT]
    index = idle = 0
    # Start and end of the step, how much of it is done, and the time of the last event.
    done = 0.0
    time = opened = end = last = p.start
    while True:
        if due != NOTHING:
            idle = 0 if time > last else idle + 1
            last = time
            if due == RELEASE:
                stuck = False
                events.append((time, RELEASE, side, 0.0))
            else:
                arrived = max(-rate, 0.0)
                rate = p.r * arrived
                v += steps.kick(p, side, arrived)
                events.append((time, IMPACT, side, arrived))
                common = v - side * p.mu / (1.0 + p.mu) * rate
                evaluations += 1
                stuck = steps.sticks(p, x, common, time, side, rate, shortest)
                if stuck:
                    v, rate = common, 0.0
                    events.append((time, STICK, side, 0.0))
            if idle >= _IDLE:
                outcome = steps.STALL
                break
        left = (end - opened) - done
        if left <= 0.0:
            if index >= p.steps:
                break
            index += 1
            opened = time = end
            done, end = 0.0, steps.end_of(p, index)
            left = end - opened
        if evaluations >= p.most:
            outcome = steps.CAP
            break
        (x, v, gap, rate, side, due), tau, more = _advance(
            p, (x, v, gap, rate, side), stuck, time, left
        )
        evaluations += more
        if not stuck:
            deepest = max(deepest, -gap)
        if due != NOTHING:
            gap = 0.0
        done = done + tau if due != NOTHING else end - opened
        time = opened + done if due != NOTHING else end
        if steps.has_blown_up(p, x, v):
            outcome = steps.FAILURE
            break
    y = x + side * (p.d - gap)
    return steps.SteppedRun(outcome, time, evaluations, deepest, (x, v, y, v - side * rate), events)


@compiled
def _advance(p, state, stuck, time, left):
    """Go to the end of the step, or up to an event before that.

    Returns the state then with what is due, the duration, and evaluations.
    """
    x, v, gap, rate, side = state
    tau, evaluations, due = left, 4, NOTHING
    mass = 1.0 + p.mu if stuck else 1.0
    curve, dv = steps.rk4(p, mass, x, v, time, tau)
    if stuck:
        evaluations += 1
        x1 = x + (v * tau + curve)
        if steps.wall_acceleration(p, mass, x1, v + dv, time + tau, side)[0] < 0.0:
            due = RELEASE
    else:
        near = gap + (rate * tau + side * curve)
        if near < 0.0 or near > 2.0 * p.d:
            due = IMPACT
            if near > 2.0 * p.d:
                side, gap, rate = -side, 2.0 * p.d - gap, -rate
    if due != NOTHING:
        tau, more = _find_end(p, (x, v, gap, rate, side), stuck, time, left)
        curve, dv = steps.rk4(p, mass, x, v, time, tau)
        evaluations += more + 4
    if not stuck:
        gap += rate * tau + side * curve
        rate += side * dv
    if due == RELEASE:
        rate = 0.0
    return (x + (v * tau + curve), v + dv, gap, rate, side, due), tau, evaluations


@compiled
def _find_end(p, state, stuck, time, left):
    """Length of the step that ends on the wall, or where the contact force of stuck masses is zero.

    For a step that would end beyond that. A start on the wall counts as before it: the root sought
    is the later one.
    """
    x, v, gap, rate, side = state
    mass = 1.0 + p.mu if stuck else 1.0
    low = 0.0
    high = left
    evaluations = 0
    tau = high
    for iteration in range(_ITERATIONS):
        curve, dv = steps.rk4(p, mass, x, v, time, tau)
        if stuck:
            x1 = x + (v * tau + curve)
            value, slope = steps.wall_acceleration(p, mass, x1, v + dv, time + tau, side)
        else:
            value = gap + (rate * tau + side * curve)
            slope = rate + side * dv
        evaluations += 5 if stuck else 4
        if value < 0.0:
            high = tau
        else:
            low = tau
        following = tau - value / slope if slope < 0.0 else low
        if not low < following < high or iteration > _ITERATIONS // 2:
            if value == 0.0 or (slope < 0.0 and abs(value / slope) <= 2.0 * EPSILON * tau):
                break
            following = 0.5 * (low + high)
        if abs(following - tau) <= 2.0 * EPSILON * tau:
            break
        tau = following
    return tau, evaluations


SOLVER = steps.fixed_step(3e7, _run)
