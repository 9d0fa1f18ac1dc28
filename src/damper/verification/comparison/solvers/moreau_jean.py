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

from typing import NamedTuple

from damper.engine.compiled import compiled
from damper.engine.segment import IMPACT, RELEASE, STICK
from damper.models.walls import slack
from damper.verification.comparison import fixed_step as steps

THETA = 0.5
#: Steps without an impulse after which sticking has ended.
_APART = 3


class MoreauJean(NamedTuple):
    """The method."""

    damper: steps.Damper
    until: float


class ContactMemory(NamedTuple):
    """The impulses so far, as far as events are read off them."""

    side: float
    since: float
    """Wall and beginning of the contact under way."""
    acted: bool
    """Whether the step before had an impulse."""
    stuck: bool
    free: int
    """Steps since the last impulse."""
    parted: float
    """End of the last step with one."""
    last: float
    """No event is read off before another."""


class Impulse(NamedTuple):
    """Whether a step had an impulse; its wall, gap and gap rate at the step's start; that time."""

    acts: bool
    side: float
    gap: float
    rate: float
    time: float


class StepState(NamedTuple):
    """State at the end of a step, with the force there."""

    x: float
    v: float
    y: float
    u: float
    force: float
    impulse: Impulse
    contact: ContactMemory


@steps.begin.of(MoreauJean)
def _begin(method, start, time):
    p = method.damper
    x, v, y, u = start
    if p.d == 0.0:
        # Between two walls at once, for good.
        v = steps.common_velocity(p.mu, v, u)
        u = v
    contact = ContactMemory(0.0, time, False, False, 0, time, time)
    return StepState(
        x, v, y, u, steps.force_at(p, time), Impulse(False, 0.0, 0.0, 0.0, time), contact
    )


@steps.take_events.of(MoreauJean)
def _take_events(method, state, time, index, notes, counts):
    if index > 0:
        counts = steps.record_penetration(counts, abs(state.y - state.x) - method.damper.d)
    contact, counts = _read(method, state, time, notes, counts)
    x, v, y, u, force, impulse, _ = state
    return StepState(x, v, y, u, force, impulse, contact), counts


@steps.advance.of(MoreauJean)
def _advance(method, state, piece, counts):
    p = method.damper
    x, v, y, u, force0, _, contact = state
    h = piece.left
    force1 = steps.force_at(p, piece.end)
    counts = steps.count_evaluations(counts, 1)
    force = _mean(force0, force1)

    # The step without walls.
    together = p.d == 0.0
    heavy = 1.0 + THETA * h * (2.0 * p.zeta + THETA * h)
    inert = p.mu if together else 0.0
    v1 = v + h * (force - x - v * (2.0 * p.zeta + THETA * h)) / (heavy + inert)
    u1 = v1 if together else u
    side = steps.nearer_wall(x, y)
    gap = p.d - side * (y - x)
    if piece.index == 1 and abs(gap) <= slack(p.d, x, y):
        gap = 0.0
    rate0 = -side * (u - v)
    impulse = 0.0
    if not together and gap + 0.5 * h * rate0 <= 0.0:
        rate1 = -side * (u1 - v1)
        ease = 1.0 / p.mu + 1.0 / heavy
        impulse = max(-(rate1 + p.r * rate0) / ease, 0.0)
        v1 += side * impulse / heavy
        u1 -= side * impulse / p.mu
    found = Impulse(impulse > 0.0, side, gap, rate0, piece.time)
    v_mean, u_mean = _mean(v, v1), _mean(u, u1)
    after = StepState(x + h * v_mean, v1, y + h * u_mean, u1, force1, found, contact)
    return after, counts, h, False


@compiled
def _read(method, state, time, notes, counts):
    """Read events off the impulse of a step."""
    acts, side, gap, rate, start = state.impulse
    wall, since, acted, stuck, free, parted, last = state.contact
    if acts:
        if not acted and not stuck:
            wall = side
            since = start
            if rate < 0.0:
                since = min(max(since - gap / rate, last), method.until)
                counts = steps.note(notes, counts, since, IMPACT, side, -rate)
            last = since
        elif acted and not stuck and side == wall:
            stuck = True
            counts = steps.note(notes, counts, since, STICK, side, 0.0)
        free = 0
        parted = time
    elif stuck:
        free += 1
        if free >= _APART:
            stuck = False
            last = parted
            counts = steps.note(notes, counts, parted, RELEASE, wall, 0.0)
    return ContactMemory(wall, since, acts, stuck, free, parted, last), counts


@compiled
def _mean(before, after):
    return THETA * after + (1.0 - THETA) * before


SOLVER = steps.fixed_step(2e7, lambda damper, step, until: MoreauJean(damper, until))
