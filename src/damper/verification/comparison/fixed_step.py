"""The driver of all solvers with a fixed step, and the functions that their steps share.

A method is a NamedTuple of constants with three functions, `begin`, `take_events` and `advance`,
each implemented for its class; `masses` returns absolute displacements and velocities. The driver
cuts the run into steps, notes events, and ends a run at its cap. All of it is compiled, as the
engine is: methods are compared, not languages.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class, by_class_or_default
from damper.engine.segment import IMPACT, RELEASE, STICK
from damper.verification.comparison import solution
from damper.verification.comparison.scene import Scene
from damper.verification.comparison.solvers import Solver

#: Outcomes as numbers, for compiled code: places in `OUTCOMES`.
DONE, STALL, CAP, FAILURE = (
    solution.OUTCOMES.index(k)
    for k in (solution.FINISHED, solution.STALLED, solution.CAPPED, solution.FAILED)
)
#: There are more events than rows for them.
FULL = len(solution.OUTCOMES)

#: A displacement this many times what the force could have made of the start has blown up.
_BLOWN_UP = 1e6
#: A last step shorter than this part of a step belongs to the one before.
_SLIVER = 1e-9
#: Steps' ends and impacts in a row with events and without progress that make a stall.
_IDLE = 100
#: Rows for events at first, and events that one piece of a run can have at most.
_ROWS, _ROOM = 1024, 4


class Damper(NamedTuple):
    """Constants of the rigid damper."""

    mu: float
    zeta: float
    omega: float
    d: float
    r: float
    phase: float


class Masses(NamedTuple):
    """Displacement and velocity of the primary and of the free mass."""

    x: float
    v: float
    y: float
    u: float


class Span(NamedTuple):
    """Start and end of a run, and the length of its steps."""

    start: float
    until: float
    step: float


class Piece(NamedTuple):
    """A step, or what events have left of one."""

    index: int  # type: ignore[assignment]  # in place of the tuple's method
    """Number of the step, from 1."""
    time: float
    left: float
    end: float
    """Where it begins, how long it is, and where the step ends."""


class Counts(NamedTuple):
    """Numbers of a run so far; a NamedTuple, for an array would slow each step."""

    events: int
    evaluations: int
    penetration: float
    """Largest distance beyond a wall."""


_WHEN, _KIND, _WALL, _SPEED = range(4)


@by_class
def begin(method: Any, start: Masses, time: float) -> Any:
    """State of a method at the start of a run: what it keeps from piece to piece."""


@by_class
def take_events(
    method: Any, state: Any, time: float, index: int, notes: np.ndarray, counts: Counts
) -> Any:
    """State and counts after the events at the end of a piece, in step `index` (0: the start)."""


@by_class
def advance(method: Any, state: Any, piece: Piece, counts: Counts) -> Any:
    """Go to the end of a piece, or up to an event before that.

    Returns state and counts then, how long that took, and whether an event has cut it short.
    """


@by_class_or_default
def masses(method: Any, state: Any) -> Masses:
    """Absolute displacements and velocities of a state."""
    return Masses(state.x, state.v, state.y, state.u)


@compiled
def march(
    method: Any, start: Masses, span: Span, limit: float, most: int, notes: np.ndarray
) -> tuple[int, float, Counts, Masses]:
    """Run a method until x or v exceeds `limit`, or after `most` evaluations.

    Rows of `notes` (rows, 4) are events: time, kind (as in `damper.engine.segment`), side, approach
    speed. Returns the place of the outcome in `OUTCOMES`, or `FULL`; how far it came; the counts;
    and where the masses are then.
    """
    state, counts = begin(method, start, span.start), Counts(0, 0, 0.0)
    steps = max(math.ceil((span.until - span.start) / span.step - _SLIVER), 0)
    time = opened = end = last = span.start
    done = 0.0
    index = idle = 0
    code = DONE
    while True:
        before = counts.events
        if before + _ROOM > len(notes):
            code = FULL
            break
        state, counts = take_events(method, state, time, index, notes, counts)
        if counts.events > before:
            idle = 0 if time > last else idle + 1
            last = time
            if idle >= _IDLE:
                code = STALL
                break
        left = (end - opened) - done
        if left <= 0.0:
            if index >= steps:
                break
            index += 1
            opened = time = end
            done = 0.0
            end = span.until if index == steps else span.start + index * span.step
            left = end - opened
        if counts.evaluations >= most:
            code = CAP
            break
        piece = Piece(index, time, left, end)
        state, counts, duration, cut = advance(method, state, piece, counts)
        done = done + duration if cut else end - opened
        time = opened + done if cut else end
        if not (abs(state.x) <= limit and abs(state.v) <= limit):
            code = FAILURE
            break
    return code, time, counts, masses(method, state)


@compiled
def note(
    notes: np.ndarray, counts: Counts, time: float, kind: float, side: float, speed: float
) -> Counts:
    """Write down an event and count it."""
    row = notes[counts.events]
    row[_WHEN] = time
    row[_KIND] = kind
    row[_WALL] = side
    row[_SPEED] = speed
    return Counts(counts.events + 1, counts.evaluations, counts.penetration)


@compiled
def count_evaluations(counts: Counts, evaluations: int) -> Counts:
    """Count evaluations of the acceleration."""
    return Counts(counts.events, counts.evaluations + evaluations, counts.penetration)


@compiled
def record_penetration(counts: Counts, depth: float) -> Counts:
    """Take note of a distance beyond a wall."""
    return Counts(counts.events, counts.evaluations, max(counts.penetration, depth))


def fixed_step(
    evaluations_per_second: float, method_of: Callable[[Damper, float, float], Any]
) -> Solver:
    """Make the solver of a method with a number of steps per forcing period.

    `method_of` takes the damper, the length of a step and the end of the run.
    """

    def solve(scene: Scene, setting: float, max_evaluations: int) -> solution.Solution:
        p, s = scene.parameters, scene.state
        damper = Damper(
            p.mass_ratio, p.damping_ratio, p.frequency_ratio, p.clearance, p.restitution, p.phase
        )
        step = p.cycle / float(setting)
        span = Span(s.time, scene.until, step)
        # Neither the force, at most 1, nor the energy at the start can take x and v farther: they
        # grow by no more than 1 per unit of time.
        size = abs(s.x) + abs(s.v) + abs(s.y) + abs(s.u) + p.clearance
        limit = _BLOWN_UP * (1.0 + p.mass_ratio) * (1.0 + size + (scene.until - s.time))
        method, start = method_of(damper, step, scene.until), Masses(s.x, s.v, s.y, s.u)
        code, rows = FULL, _ROWS
        while code == FULL:
            notes = np.empty((rows, 4))
            most = int(max_evaluations)
            code, reached, counts, end = march(method, start, span, limit, most, notes)
            rows *= 16
        notes = notes[: counts.events]
        impacts = notes[notes[:, _KIND] == IMPACT]
        return solution.Solution(
            impact_times=impacts[:, _WHEN].copy(),
            impact_sides=impacts[:, _WALL].copy(),
            approach_speeds=impacts[:, _SPEED].copy(),
            stick_times=notes[notes[:, _KIND] == STICK, _WHEN],
            release_times=notes[notes[:, _KIND] == RELEASE, _WHEN],
            end_state=np.array(end) if code == DONE else np.full(4, math.nan),
            penetration=float(counts.penetration),
            evaluations=int(counts.evaluations),
            outcome=solution.OUTCOMES[code],
            reached=float(reached),
        )

    return Solver("steps_per_period", evaluations_per_second, solve)


@compiled
def force_at(damper: Damper, time: float) -> float:
    """Return the forcing, of amplitude 1."""
    return math.sin(damper.omega * time + damper.phase)


@compiled
def rk4(
    damper: Damper, mass: float, x: float, v: float, time: float, step: float
) -> tuple[float, float]:
    """Return a classical Runge-Kutta step of mass x'' + 2 zeta x' + x = sin(omega t + phase).

    The mass is 1 in flight, 1 + mu in sticking. Returns x(time + step) - x - v step, without
    cancellation, and v(time + step) - v.
    """
    half = 0.5 * step
    force1 = force_at(damper, time)
    force2 = force_at(damper, time + half)
    force3 = force_at(damper, time + step)
    twice = 2.0 * damper.zeta
    a1 = (force1 - twice * v - x) / mass
    v2 = v + half * a1
    a2 = (force2 - twice * v2 - (x + half * v)) / mass
    v3 = v + half * a2
    a3 = (force2 - twice * v3 - (x + half * v2)) / mass
    v4 = v + step * a3
    a4 = (force3 - twice * v4 - (x + step * v3)) / mass
    sixth = step / 6.0
    return sixth * step * (a1 + a2 + a3), sixth * (a1 + 2.0 * (a2 + a3) + a4)


@compiled
def wall_acceleration(
    damper: Damper, mass: float, x: float, v: float, time: float, side: float
) -> tuple[float, ...]:
    """How a wall accelerates towards the free mass, and how that changes: -side x'', -side x'''.

    Positive where masses that move as one stick.
    """
    angle = damper.omega * time + damper.phase
    a = (math.sin(angle) - 2.0 * damper.zeta * v - x) / mass
    j = (damper.omega * math.cos(angle) - 2.0 * damper.zeta * a - v) / mass
    return -side * a, -side * j


@compiled
def sticks(a: float, j: float, rebound: float, longest: float) -> bool:
    """Whether masses stick after an impact, from `wall_acceleration` and the rebound speed.

    They do where the flight back takes no more than the time `longest`.
    """
    return (a > 0.0 and 2.0 * rebound <= a * longest) or (rebound == 0.0 and a == 0.0 and j > 0.0)


@compiled
def common_velocity(mu: float, v: float, u: float) -> float:
    """Velocity of both masses once they move as one."""
    return (v + mu * u) / (1.0 + mu)


@compiled
def nearer_wall(x: float, y: float) -> float:
    """Side of the wall that the free mass is nearer to."""
    return 1.0 if y >= x else -1.0
