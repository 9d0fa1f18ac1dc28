"""The impact damper whose walls give: each is a spring and a dashpot, and an impact takes time.

While the gap g to a wall is negative, the wall pushes with N = -(k g + c g'). Either it cannot
pull, N = max(0, N), and lets go where N vanishes, or it holds until the gap reopens
(`contact_tension`). Every regime is linear, so the motion is exact: free flight as in the rigid
model, contact by `damper.models.compliant.flow`. `damper.models.compliant.search` finds the ends of
contacts.

The log has more kinds of row than the rigid one: CONTACT from the moment of touch, with the
approach speed and no jump; STICKING once a contact has lasted one period 2 pi / sqrt(k (1 + mu) /
mu) of its own oscillation; FLIGHT with the cause SEPARATION after a contact that ends sooner. A
wall that cannot pull lets go while the gap is negative still: that flight has a row of its own, up
to where the gap reopens, or to where the wall, springing back, has caught up. With no clearance
both walls touch at once, and the free mass goes from one to the other.
"""

import math
from typing import NamedTuple

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.oscillator import (
    Oscillator,
    acceleration,
    arrive,
    coasting_jerk,
    higher_derivatives,
    increments,
    sine_cosine,
)
from damper.engine.search import (
    BRIEF,
    GAVE_UP,
    HORIZON,
    LONG_SEARCH,
    ROUNDING,
    find_impact,
    search_budget,
    stays,
)
from damper.engine.segment import (
    CAUSE,
    CONTACT,
    DURATION,
    FINISHED,
    FIRST,
    FLIGHT,
    GAP,
    IMPACT,
    LOG_FULL,
    MODE,
    NOTHING,
    PERIOD,
    RATE,
    RELEASE,
    SEARCH_FAILED,
    SEPARATION,
    SIDE,
    SPEED,
    STICK,
    STICKING,
    TIME,
    TOO_MANY_EVENTS,
    V,
    X,
)
from damper.models import motion, rigid
from damper.models.compliant.flow import Touch, advance, propagators, touch_of
from damper.models.compliant.restitution import contact_damping
from damper.models.compliant.search import (
    FOUND,
    LOST,
    Split,
    Watch,
    find_switch,
    fly,
    loose_watch,
    pushes,
    split_of,
    watch_of,
)
from damper.parameters import Parameters

#: Largest rate, in units of sqrt(K/M), at which numbers still have room.
_FASTEST = 1e60


class Compliant(NamedTuple):
    """Constants of one run; the first eight are those of `damper.models.rigid.Rigid`."""

    mass_ratio: float
    clearance: float
    restitution: float
    phase: float
    period: float
    tolerance: float
    free: Oscillator
    stuck: Oscillator
    tension: float
    """Whether the contact may pull."""
    lasting: float
    """Time after which a contact counts as sticking."""
    touch: Touch
    loose: Touch
    """The same masses with no force between them."""
    table: np.ndarray
    """Propagators of the contact."""
    split: Split
    ending: Watch
    """What is positive in contact: the depth, or the force."""
    reopening: Watch
    """The depth in a flight that begins below the wall's surface."""
    catching_up: Watch
    """What is positive in such a flight until the wall has caught up."""


def prepare(parameters: Parameters, accuracy: float) -> Compliant:
    """Constants of one run.

    Raises
    ------
    ValueError
        For a contact so fast that its motion leaves the range of numbers.
    """
    p = parameters
    damping = contact_damping(p.restitution, bool(p.contact_tension))
    frequency = math.sqrt(p.contact_stiffness_ratio) * math.sqrt(
        (1.0 + p.mass_ratio) / p.mass_ratio
    )
    if not (1.0 + damping) * frequency < _FASTEST:
        raise ValueError(
            f"contact_stiffness_ratio = {p.contact_stiffness_ratio!r}, restitution = "
            f"{p.restitution!r}: the contact is too fast to be computed "
            f"(rate {(1.0 + damping) * frequency:.1e}, must be below {_FASTEST:g}); "
            "leave the stiffness out for a rigid wall"
        )
    numbers = (p.mass_ratio, p.damping_ratio, p.frequency_ratio)
    touch = _touch(*numbers, p.contact_stiffness_ratio, damping)
    loose = _touch(*numbers, 0.0, 0.0)
    split = split_of(touch)
    k, c = touch.stiffness, touch.damping
    ending = np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0])
    if not p.contact_tension:
        ending[2:4] = -k, -c
    return Compliant(
        *rigid.prepare(p, accuracy),
        float(p.contact_tension),
        min(2.0 * math.pi / frequency, HORIZON),
        touch,
        loose,
        propagators(touch),
        split,
        watch_of(touch, split, ending),
        loose_watch(-1.0, 0.0),
        loose_watch(k, c),
    )


def _touch(*numbers: float) -> Touch:
    *values, levels, shift = touch_of(*numbers)
    return Touch(*values, int(levels), shift)


@compiled
def pair_at(model: Compliant, row: np.ndarray) -> tuple[float, ...]:
    """State of the pair at the start of a segment, as `damper.models.compliant.flow` has it."""
    side = float(row[SIDE])
    sin, cos, _ = sine_cosine(model.free[3] * float(row[TIME]) + model.phase)
    return _pair(
        model, side, float(row[X]), float(row[V]), float(row[GAP]), float(row[RATE]), sin, cos
    )


@compiled
def _pair(model, side, x, v, gap, rate, sin, cos):
    beta = model.touch.reduced
    return side * x - beta * gap, side * v - beta * rate, gap, rate, side * sin, side * cos


@motion.of(Compliant)
def _motion(model, row, tau):
    side = float(row[SIDE])
    gap = float(row[GAP])
    if float(row[MODE]) == FLIGHT and gap >= 0.0:
        free = model.free
        x = float(row[X])
        v = float(row[V])
        rate = float(row[RATE])
        sin, cos, _ = sine_cosine(free[3] * float(row[TIME]) + model.phase)
        a, j = acceleration(free, x, v, sin, cos)
        dx, dv, _, _ = increments(free, x, v, a, j, sin, cos, tau)
        gap = min(max(gap + rate * tau + side * dx, 0.0), 2.0 * model.clearance)
        return x + (v * tau + dx), v + dv, gap, rate + side * dv
    z = pair_at(model, row)
    if float(row[MODE]) == FLIGHT:
        z = fly(model.loose, model.free, z, tau)
    else:
        z = advance(model.touch, model.table, z, tau)
    u, w, gap, rate, _, _ = z
    beta = model.touch.reduced
    return side * (u + beta * gap), side * (w + beta * rate), gap, rate


@compiled
def place(
    model: Compliant,
    state: np.ndarray,
    periods: float,
    time: float,
    x: float,
    v: float,
    y: float,
    u: float,
) -> None:
    """Write the first segment's start into `state`; the free mass may be in touch already."""
    relative = y - x
    side = 1.0 if relative >= 0.0 else -1.0
    gap = model.clearance - side * relative
    rate = -side * (u - v)
    if abs(gap) <= ROUNDING * (model.clearance + abs(x) + abs(y)):
        gap = 0.0
    state[PERIOD] = periods
    state[TIME] = time
    state[X] = x
    state[V] = v
    state[GAP] = gap
    state[RATE] = rate
    touches = _touches(model, time, side, x, v, gap, rate)
    if not touches and model.clearance == 0.0 and gap == 0.0 and rate == 0.0:
        # At rest between walls without a clearance: where one draws away the other one pushes.
        side = -side
        touches = True
    state[SIDE] = side
    state[MODE] = CONTACT if touches else FLIGHT
    state[CAUSE] = NOTHING
    state[SPEED] = 0.0
    state[FIRST] = 0.0
    state[DURATION] = 0.0


@compiled
def _touches(model, time, side, x, v, gap, rate):
    """Whether the wall pushes (or pulls) from now on; an approach from g = 0 is still a flight."""
    if gap < 0.0:
        touch = model.touch
        return model.tension != 0.0 or touch.stiffness * gap + touch.damping * rate < 0.0
    if gap > 0.0 or rate != 0.0:
        return False
    sin, cos, _ = sine_cosine(model.free[3] * time + model.phase)
    a, j = _acceleration_at_wall(model.free, x, v, sin, cos)
    snap, crackle = higher_derivatives(model.free, a, j, sin, cos)
    return stays(side, a, j, snap, crackle)


@compiled
def _acceleration_at_wall(free, x, v, sin, cos):
    """x'' and x''', where an x'' of no more than its rounding counts as zero.

    A push that vanishes ends a contact; what rounding leaves of it must not begin the next one.
    """
    a, j = acceleration(free, x, v, sin, cos)
    if abs(a) <= ROUNDING * pushes(2.0 * free[0], x, v, sin, cos):
        a = 0.0
        j = coasting_jerk(free, v, cos)
    return a, j


@compiled
def run(
    model: Compliant,
    state: np.ndarray,
    until_periods: float,
    until_time: float,
    max_events: int,
    log: np.ndarray,
    counts: np.ndarray,
) -> tuple[int, int]:
    """Advance from event to event until a time, or until the log is full.

    Parameters and returns are those of `damper.engine.trajectory.run`. What `max_events` counts are
    impacts, starts of sticking, releases, and contacts that a wall which has caught up begins anew.
    """
    free = model.free
    period = model.period
    omega = free[3]
    beta = model.touch.reduced
    keep = len(log) > 0
    periods = float(state[PERIOD])
    time = float(state[TIME])
    x = float(state[X])
    v = float(state[V])
    gap = float(state[GAP])
    rate = float(state[RATE])
    side = float(state[SIDE])
    mode = float(state[MODE])
    cause = float(state[CAUSE])
    speed = float(state[SPEED])
    first = float(state[FIRST])
    events = int(counts[0])
    evaluations = int(counts[1])
    searched = int(counts[2])
    most_searched = search_budget(max_events)
    brief = BRIEF / max(1.0, omega)
    rows = 0
    code = FINISHED
    while True:
        if keep and rows == len(log):
            code = LOG_FULL
            break
        remaining = (until_periods - periods) * period + (until_time - time)
        if remaining < 0.0:
            break
        sin, cos, _ = sine_cosine(omega * time + model.phase)

        # The segment's length, what ends it, and the state at its end.
        next_mode = mode
        next_cause = NOTHING
        next_side = side
        next_speed = 0.0
        lost = False
        is_event = False
        if mode == FLIGHT and gap >= 0.0:
            if gap == 0.0:
                a, j = _acceleration_at_wall(free, x, v, sin, cos)
            else:
                a, j = acceleration(free, x, v, sin, cos)
            duration, hit, dx, end_v, end_rate, steps = find_impact(
                free, model.clearance, side, x, v, gap, rate, a, j, sin, cos
            )
            end_x = x + dx
            end_gap = 0.0
            lost = hit == GAVE_UP
            if hit == 0.0:
                end_x, end_v = arrive(free, x, v, sin, cos, duration)
                end_gap = gap + ((rate * duration) + side * (end_x - x - v * duration))
                end_rate = rate + side * (end_v - v)
            elif not lost:
                is_event = True
                next_side = hit
                next_speed = abs(end_rate)
                end_rate = -next_speed
                if next_speed > 0.0:
                    next_mode = CONTACT
                    next_cause = IMPACT
        else:
            z = _pair(model, side, x, v, gap, rate, sin, cos)
            if mode == FLIGHT:
                duration, found, end, steps = find_switch(
                    model.loose, model.table, free, model.reopening, z, HORIZON
                )
                lost = found == LOST
                opens = found == FOUND
                caught, found, caught_end, more = find_switch(
                    model.loose, model.table, free, model.catching_up, z, duration
                )
                steps += more
                lost = lost or found == LOST
                if found == FOUND and caught < duration:
                    duration = caught
                    end = caught_end
                    opens = False
                    is_event = True
                    next_mode = CONTACT
            else:
                limit = model.lasting if mode == CONTACT else HORIZON
                duration, found, end, steps = find_switch(
                    model.touch, model.table, free, model.ending, z, limit
                )
                lost = found == LOST
                opens = found == FOUND and model.tension != 0.0
                if found == FOUND:
                    next_mode = FLIGHT
                    next_cause = RELEASE if mode == STICKING else SEPARATION
                    is_event = mode == STICKING
                elif mode == CONTACT:
                    next_mode = STICKING
                    next_cause = STICK
                    is_event = True
            end_x = side * (end[0] + beta * end[2])
            end_v = side * (end[1] + beta * end[3])
            end_gap = end[2]
            end_rate = end[3]
            if next_mode == FLIGHT and mode != FLIGHT and not opens:
                # The force has vanished; what is left of it is rounding.
                end_gap = -model.touch.damping / model.touch.stiffness * end_rate
                opens = end_gap >= 0.0
            if opens:
                # What is left of either is rounding.
                end_gap = 0.0
                end_rate = max(end_rate, 0.0)
        evaluations += steps

        over = duration > remaining
        if keep:
            row = log[rows]
            row[PERIOD] = periods
            row[TIME] = time
            row[X] = x
            row[V] = v
            row[GAP] = gap
            row[RATE] = rate
            row[SIDE] = side
            row[MODE] = mode
            row[CAUSE] = cause
            row[SPEED] = speed
            row[FIRST] = first
            row[DURATION] = remaining if over else duration
            rows += 1
        if over:
            break
        if lost:
            code = SEARCH_FAILED
            break
        if steps >= LONG_SEARCH or (not is_event and duration < brief):
            searched += steps
        if (is_event and events >= max_events) or searched > most_searched:
            code = TOO_MANY_EVENTS
            break

        # Step over the event into the next segment.
        left = period - time
        if duration < left:
            time += duration
        else:
            # In an order that loses no digit: a flight cut many times would lose the same one.
            rest = duration - left
            time = rest % period
            periods += 1.0 + math.floor((rest - time) / period + 0.5)
        x = end_x
        v = end_v
        gap = end_gap
        rate = end_rate
        if next_cause == IMPACT and (first == 0.0 or next_side != side):
            first = next_speed
        elif next_cause == STICK:
            first = 0.0
        side = next_side
        mode = next_mode
        cause = next_cause
        speed = next_speed
        if mode == FLIGHT and gap == 0.0 and rate == 0.0:
            if _touches(model, time, side, x, v, gap, rate):
                mode = CONTACT
            elif model.clearance == 0.0:
                side = -side
                mode = CONTACT
            if not is_event and events >= max_events:
                code = TOO_MANY_EVENTS
                break
            is_event = True
        if is_event:
            events += 1
    state[PERIOD] = periods
    state[TIME] = time
    state[X] = x
    state[V] = v
    state[GAP] = gap
    state[RATE] = rate
    state[SIDE] = side
    state[MODE] = mode
    state[CAUSE] = cause
    state[SPEED] = speed
    state[FIRST] = first
    counts[0] = events
    counts[1] = evaluations
    counts[2] = searched
    return code, rows
