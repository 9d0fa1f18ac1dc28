"""Tangent dynamics: small deviations along the segment log.

A deviation is one of (x, v, y, u), both masses' displacements and velocities at one time; of
several free masses one of (x, v, y0, u0, y1, u1, ...): `damper.models.several.tangent`. Between
events it follows the linear flow. At an impact the deviated motion hits earlier or later, so

    S = G + (f+ - G f- - dg/dt) n^T / (n^T f-)

takes it from the flow before to the flow after (Leine and Nijmeijer, Dynamics and Bifurcations of
Non-Smooth Mechanical Systems, Springer 2004): g is the jump and G its derivative, f the
time derivative of the state before and after, n the gradient of the gap. Where the engine closes a
complete chatter sequence, g also lets the masses join: their centre follows the flow of sticking
from there on, so two directions vanish at once, and the accumulation time does not matter. A
release changes no time derivative: nothing happens to a deviation. Nor does it where the force
jumps, even if that throws the masses apart: no deviation moves the time of a jump. Derivations:
docs/orbits.md. Compliant walls have functions of their own (`damper.models.compliant.tangent`).
"""

import math
from functools import singledispatch
from typing import Any, NamedTuple

import numpy as np

from damper.engine.bodies import FixedStop, Flow, acceleration_of, flow_of
from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class, by_class_or_default
from damper.engine.forcing import force_rates, phase_at
from damper.engine.impact import (
    impact,
    inertia_of,
    law_at,
    mean_of,
    rebound_slope,
    restitution_at,
)
from damper.engine.model import count_masses, mass_ratio_at, read_segment
from damper.engine.segment import (
    FLIGHT,
    IMPACT,
    REST,
    RESTING,
    REVERSAL,
    STICK,
    TAIL,
    Segment,
)
from damper.models.flights import rest_shift

#: Part of a deviation, and of what it moves an event by, that is roundoff.
TOGETHER = 1e-9


@by_class
def contact_flow(model: Any, periods: float, time: float, tau: float) -> Flow:
    """Linear flow of both masses' centre in contact, from a moment over a time `tau`."""


@by_class
def mass_ratio_rate(model: Any, periods: float, time: float) -> float:
    """Time derivative of the mass ratio."""


@by_class
def damping_in(model: Any, s: Segment) -> float:
    """Rate at which volumes of (x, v, y, u) shrink in a segment in which masses are apart."""


@by_class
def shrunk_by(model: Any, s: Segment) -> float:
    """Factor of volumes of (x, v, y, u) by the impact or reversal that begins a segment."""


@by_class
def friction_in(model: Any) -> float:
    """Acceleration that dry friction gives the free mass while it slides; of several the most."""


@compiled
def no_friction(model: Any) -> float:
    """As `friction_in`, of a box without friction."""
    return 0.0


@by_class_or_default
def turned(model: Any, s: Segment) -> float:
    """Relative acceleration after a slide's end, over that before it."""
    return 1.0


@by_class
def velocities_after(model: Any, s: Segment, time: float) -> tuple[float, float]:
    """Velocities of both masses after the impact that begins a segment, at this local time."""


@by_class
def joins(model: Any, s: Segment) -> bool:
    """Whether the masses move as one in a segment, so that two directions vanish."""


@by_class
def over_event(model: Any, s: Segment, deviations: np.ndarray) -> None:
    """Take deviations, the columns of a (4, n) array, over what begins a segment."""


@by_class
def stay_on(model: Any, s: Segment, low: float, tau: float, deviations: np.ndarray) -> None:
    """Take deviations over a time of contact, from a time after the segment's start."""


def have_rigid_walls(kind: type) -> None:
    """Let deviations of a model follow its impacts and contacts as those of rigid walls."""
    shrunk_by.of(kind)(shrunk_by_impact)
    velocities_after.of(kind)(_velocities_after)
    joins.of(kind)(_joins)
    damping_in.of(kind)(_damping_in)
    over_event.of(kind)(_over_event)
    stay_on.of(kind)(stay_joined)
    friction_in.of(kind)(no_friction)


@compiled
def _damping_in(model, s):
    return 2.0 * (model.free.damping + model.mass.damping)


@compiled
def shrunk_by_impact(model: Any, s: Segment) -> float:
    """As `shrunk_by`, of rigid walls."""
    if s.cause == REVERSAL:
        return turned(model, s)
    return rebound_slope(law_at(model.law, s.side), s.speed) * s.gap_rate / s.speed


@compiled
def _velocities_after(model, s, time):
    mu = mass_ratio_at(model, s.periods, time)
    r = restitution_at(law_at(model.law, s.side), s.speed)
    v, rate = impact(mu, r, s.side, s.v_before, s.speed)
    u = v - s.side * rate
    if s.mode == TAIL:
        v = u = mean_of(mu, v, u)
    return v, u


@compiled
def _joins(model, s):
    return s.mode not in (FLIGHT, RESTING)


@compiled
def _over_event(model, s, deviations):
    if s.cause == IMPACT:
        strike(model, s, deviations)
    elif s.cause in (REST, REVERSAL):
        slow_down(model, turned(model, s), deviations)
    elif s.cause == STICK and (deviations[1] != deviations[3]).any():
        # A slide that stops at the very wall: a mass beside it hits, or stops ahead of it; unless
        # the slide is the last of a sequence, for that ends there in any case.
        for k in range(deviations.shape[1]):
            x, y = deviations[0, k], deviations[2, k]
            if abs(x - y) > TOGETHER * (abs(x) + abs(y)):
                deviations[:] = math.nan
        join(model.mass_ratio, deviations)


@compiled
def slow_down(model: Any, part: float, deviations: np.ndarray) -> None:
    """Leave a part of the relative velocities."""
    mu = model.mass_ratio
    for k in range(deviations.shape[1]):
        v, u = deviations[1, k], deviations[3, k]
        lost = (1.0 - part) * (u - v) / (1.0 + mu)
        deviations[1, k] = v + mu * lost
        deviations[3, k] = deviations[1, k] if part == 0.0 else u - lost


@compiled
def stay_joined(model: Any, s: Segment, low: float, tau: float, deviations: np.ndarray) -> None:
    """As `stay_on`, of masses that move as one."""
    flow = contact_flow(model, s.periods, s.time + low, tau)
    for k in range(deviations.shape[1]):
        x, v = deviations[0, k], deviations[1, k]
        apart, shift = 0.0, 0.0
        if s.mode == RESTING:
            apart = deviations[2, k] - x
            shift = rest_shift(model.mass, model.mass_ratio, apart)
        deviations[0, k] = flow.xx * (x + shift) + flow.xv * v - shift
        deviations[1, k] = deviations[3, k] = flow.vx * (x + shift) + flow.vv * v
        deviations[2, k] = deviations[0, k] + apart


@compiled
def fly_on(model: Any, tau: float, deviations: np.ndarray) -> None:
    """Take deviations, the columns of a (4, n) array, over a time of flight."""
    primary = flow_of(model.free, tau)
    free_mass = flow_of(model.mass, tau)
    for k in range(deviations.shape[1]):
        x, v, y, u = deviations[0, k], deviations[1, k], deviations[2, k], deviations[3, k]
        deviations[0, k] = primary.xx * x + primary.xv * v
        deviations[1, k] = primary.vx * x + primary.vv * v
        deviations[2, k] = free_mass.xx * y + free_mass.xv * u
        deviations[3, k] = free_mass.vx * y + free_mass.vv * u


@by_class_or_default
def over_time(model: Any, s: Any, low: float, high: float, deviations: np.ndarray) -> None:
    """Take deviations through a part of a segment, between two times after its start."""
    if s.mode == FLIGHT:
        fly_on(model, high - low, deviations)
    else:
        stay_on(model, s, low, high - low, deviations)


@compiled
def join(mass_ratio: float, deviations: np.ndarray) -> None:
    """Let the masses of deviated motions join: their centre goes on."""
    for k in range(deviations.shape[1]):
        x, v, y, u = deviations[0, k], deviations[1, k], deviations[2, k], deviations[3, k]
        deviations[0, k] = deviations[2, k] = mean_of(mass_ratio, x, y)
        deviations[1, k] = deviations[3, k] = mean_of(mass_ratio, v, u)


class Jump(NamedTuple):
    """What an impact does to deviations: G, and f+ - G f- - dg/dt of the four components."""

    to_primary: float
    to_free: float
    x: float
    v: float
    y: float
    u: float


@compiled
def strike(model: Any, s: Segment, deviations: np.ndarray) -> None:
    """Take deviations over the impact that begins a segment, and into contact if it closes one."""
    mu = mass_ratio_at(model, s.periods, s.time)
    jump = _jump(model, mu, s)
    closing = _closing(model, mu, s) if s.mode == TAIL else 0.0
    for k in range(deviations.shape[1]):
        x, v, y, u = deviations[0, k], deviations[1, k], deviations[2, k], deviations[3, k]
        # By how much later the deviated motion hits.
        late = s.side * (x - y) / s.speed
        deviations[0, k] = x - jump.x * late
        deviations[1, k] = v + jump.to_primary * (u - v) - (jump.v + closing) * late
        deviations[2, k] = y - jump.y * late
        deviations[3, k] = u + jump.to_free * (u - v) - (jump.u + closing) * late
    if s.mode == TAIL:
        join(mu, deviations)


@compiled
def _jump(model, mu, s):
    whole = 1.0 + rebound_slope(law_at(model.law, s.side), s.speed)
    slope = whole / (1.0 + mu)
    to_primary, to_free = slope * mu if mu < math.inf else whole, -slope
    before = s.v_before + s.side * s.speed
    after = s.v - s.side * s.gap_rate
    a, b = _accelerations(model, s, s.v_before, before, s.side)
    a_after, b_after = _accelerations(model, s, s.v, after, -s.side)
    # The mass ratio's own change gives both velocities the same.
    turned = 1.0 + restitution_at(law_at(model.law, s.side), s.speed)
    change = mass_ratio_rate(model, s.periods, s.time) * turned * s.side * s.speed
    change /= (1.0 + mu) * (1.0 + mu)
    return Jump(
        to_primary,
        to_free,
        s.v - s.v_before,
        a_after - a - to_primary * (b - a) - change,
        after - before,
        b_after - b - to_free * (b - a) - change,
    )


@compiled
def _closing(model, mu, s):
    """Acceleration of the joined masses, less that of their centre in the flight after."""
    after = s.v - s.side * s.gap_rate
    common = mean_of(mu, s.v, after)
    a, b = _accelerations(model, s, s.v, after, -s.side)
    a_joined, b_joined = _accelerations(model, s, common, common, 0.0)
    change = mass_ratio_rate(model, s.periods, s.time) * (after - s.v) / (1.0 + mu)
    return mean_of(mu, a_joined - a - change, b_joined - b)


@compiled
def _accelerations(model, s, v, u, way):
    """Of both masses in flight, at a segment's wall; where they rub, the free mass slides a way."""
    phase = phase_at(model.free.forcing, s.periods, s.time)
    force, _, _, _, _ = force_rates(model.free.forcing, phase)
    a = model.free.strength * force - 2.0 * model.free.damping * v - model.free.stiffness * s.x
    b = acceleration_of(model.mass, s.x + s.side * model.clearance, u, phase)
    rubs = way * friction_in(model)
    return a + inertia_of(model.mass_ratio) * rubs, b - rubs


@by_class_or_default
def enter(model: Any, s: Any, deviations: np.ndarray, happened: bool) -> None:
    """Take deviations over what begins a segment, or only into its contact if that was before."""
    if happened:
        over_event(model, s, deviations)
    elif s.mode == RESTING:
        slow_down(model, 0.0, deviations)
    elif joins(model, s):
        join(mass_ratio_at(model, s.periods, s.time), deviations)


@by_class_or_default
def lost_in(model: Any, s: Any, own: np.ndarray) -> float:
    """How many directions vanish in a segment, of masses that have (1) or follow (0) their own."""
    if s.mode == RESTING:
        return 1.0
    return 2.0 if joins(model, s) else 0.0


@singledispatch
def leaders_of(model: Any, row: np.ndarray) -> np.ndarray:
    """For each free mass the number of the first mass in step with it, by a row of the log.

    No deviation parts masses in step. Other masses have their own number. A fixed stop, which no
    deviation moves, has -1. Never compiled.
    """
    return np.full(1, -int(isinstance(model.mass, FixedStop)))


@singledispatch
def parted_in(model: Any, log: np.ndarray) -> np.ndarray:
    """End of the deviations that part a mass from masses in step, for each mass of a log.

    The last of these events: 0, none; 1, its slide turns round; 2, it rests off the walls; 3, it
    hits, with others by one law; 4, it sticks. `OF_PARTED` has their effects. Never compiled.
    """
    return np.zeros(1, int)


@singledispatch
def coordinates_in(model: Any) -> int:
    """How many coordinates the primary has. This and the next three never run compiled."""
    return 1


@singledispatch
def fastest_of(model: Any) -> float:
    """Largest rate of the primary between events, where that is not 1."""
    return 1.0


@singledispatch
def of_state(model: Any, deviations: np.ndarray) -> np.ndarray:
    """Deviations that `follow` takes, from those of a state's components; `to_state` inverts it."""
    return deviations


@singledispatch
def to_state(model: Any, deviations: np.ndarray) -> np.ndarray:
    """Deviations of a state's components, from those that `follow` has taken."""
    return deviations


#: Factor of deviations that part places, and velocities, of masses in step, by `parted_in`. Slides
#: that turn round one after the other have no linear one.
OF_PARTED = np.array([[1.0, 1.0], [1.0, np.nan], [1.0, 0.0], [np.inf, np.inf], [0.0, 0.0]])


def directions_at(model: Any, row: np.ndarray) -> np.ndarray:
    """Deviations at a row of the log, a column each: masses in step are moved as one."""
    leaders, first = leaders_of(model, row), 2 * coordinates_in(model)
    deviations = np.eye(first + 2 * len(leaders))
    for k in np.flatnonzero(leaders != np.arange(len(leaders))):
        for column in (first, first + 1):
            if leaders[k] >= 0:
                deviations[column + 2 * k, column + 2 * leaders[k]] = 1.0
            deviations[column + 2 * k, column + 2 * k] = 0.0
    return deviations


@compiled
def follow(model: Any, log: np.ndarray, deviations: np.ndarray, begun: bool) -> None:
    """Take deviations, the columns of a (4, n) array, along a piece of the log.

    The event at the start of the very first segment happened before: left out unless `begun`.
    """
    for index in range(len(log)):
        s = read_segment(model, log[index])
        enter(model, s, deviations, begun or index > 0)
        over_time(model, s, 0.0, s.duration, deviations)


def derivative(
    trajectory: Any, periods: float, time: float = 0.0, keep: list[np.ndarray] | None = None
) -> np.ndarray:
    """Derivative of the state (x, v, y, u, ...) at a moment by the state at the start of a run.

    The trajectory is run to the moment; its log's pieces are appended to `keep`. Where the run
    starts in contact, deviations are those of all joined masses together. Masses in step are moved
    as one, by the first of them; the columns of the others are zero.

    Raises
    ------
    ValueError
        Where several masses meet walls, or stop, at one instant that a deviation would part; where
        a free mass that slides stops at the very wall.
    """
    deviations, begun = np.empty(0), False
    for log in trajectory.segments(periods, time):
        if not begun:
            deviations = of_state(trajectory.model, directions_at(trajectory.model, log[0]))
        follow(trajectory.model, log, deviations, begun)
        begun = True
        if keep is not None:
            keep.append(log.copy())
    require_bounded(trajectory.model, deviations)
    return to_state(trajectory.model, deviations)


def require_bounded(model: Any, deviations: np.ndarray) -> None:
    """Raise ValueError where what has become of deviations says that there is no derivative."""
    if np.isnan(deviations).any():
        raise ValueError(f"no derivative: {_why_none(model)}")
    if np.isinf(deviations).any():
        raise ValueError("no derivative: deviations grow without bound at an impact that grazes")


def _why_none(model: Any) -> str:
    several, rubs = count_masses(model) > 1, friction_in(model) > 0.0
    meet = "meet walls or stop" if rubs else "meet walls"
    parted = f"several masses {meet} at one instant, which a deviation would part"
    which = "a" if several else "the"
    stops = f"{which} free mass comes to rest at the very wall, which one beside it would hit"
    return ", or ".join([parted] * several + [stops] * rubs)
