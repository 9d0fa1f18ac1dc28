"""One driver for the solvers with a fixed step, and what their steps are made of.

A method is a NamedTuple of constants with four functions, `begin`, `settle`, `advance` and
`inside`, each implemented for its class; `masses` reads off what is absolute. The driver cuts the
run into steps, keeps notes of events and states, and sees to caps. All of it is compiled as the
engine is, so that methods are compared and not languages.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.dispatch import by_model
from damper.engine.segment import IMPACT, RELEASE, STICK
from damper.verification.comparison.energy import energy_residual
from damper.verification.comparison.scene import Scene
from damper.verification.comparison.solution import (
    CAPPED,
    FAILED,
    FINISHED,
    OUTCOMES,
    STALLED,
    Solution,
)

#: Outcomes as numbers, for compiled code: places in `OUTCOMES`.
DONE, STALL, CAP, FAILURE = (OUTCOMES.index(k) for k in (FINISHED, STALLED, CAPPED, FAILED))
#: There are more events than rows for them.
FULL = len(OUTCOMES)

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


class Tally(NamedTuple):
    """What a run has come to so far. It is no array, which a step would pay for."""

    events: int
    evaluations: int
    work: float
    dissipated: float
    lost: float
    """Work of the force, what the dashpot took, and what impacts took."""
    penetration: float
    """Largest distance beyond a wall."""


_WHEN, _KIND, _WALL, _SPEED = range(4)


@by_model
def begin(method: Any, start: Masses, time: float, tally: Tally) -> Any:
    """State of a method at the start of a run, what it keeps from piece to piece; and the tally."""


@by_model
def settle(
    method: Any, state: Any, time: float, index: int, notes: np.ndarray, tally: Tally
) -> Any:
    """State and tally after the events at the end of a piece, in step `index` (0: the start)."""


@by_model
def advance(method: Any, state: Any, piece: Piece, tally: Tally) -> Any:
    """Go to the end of a piece, or up to an event before that.

    Returns
    -------
    state, tally, duration, cut : NamedTuple, Tally, float, bool
        The state then, how long that took, and whether an event has cut it short.
    """


@by_model
def inside(method: Any, state: Any, after: Any, piece: Piece, part: float) -> Masses:
    """State a time `part` after the start of a piece that leads from `state` to `after`."""


@by_model
def masses(method: Any, state: Any) -> Masses:
    """Absolute displacements and velocities of a state."""
    return Masses(state.x, state.v, state.y, state.u)


@compiled
def run(
    method: Any,
    start: Masses,
    span: Span,
    limit: float,
    most: int,
    times: np.ndarray,
    states: np.ndarray,
    notes: np.ndarray,
) -> tuple:
    """Run a method.

    Parameters
    ----------
    method : NamedTuple
    start : Masses
    span : Span
    limit : float
        Size of x and v beyond which a run has blown up.
    most : int
        Evaluations after which to give up.
    times : ndarray
        Where states are wanted, ascending.
    states : ndarray (times + 1, 4)
        For those states, and for the one at the end.
    notes : ndarray (rows, 4)
        For events: time, kind (as in `damper.engine.segment`), side, approach speed.

    Returns
    -------
    code, time : int, float
        Place of the outcome in `OUTCOMES`, or `FULL`, and how far it came.
    rest : int or float
        The fields of `Tally`.
    """
    state, tally = begin(method, start, span.start, Tally(0, 0, 0.0, 0.0, 0.0, 0.0))
    steps = max(math.ceil((span.until - span.start) / span.step - _SLIVER), 0)
    time = opened = end = last = span.start
    done = 0.0
    index = taken = idle = 0
    code = DONE
    while True:
        before = tally.events
        if before + _ROOM > len(notes):
            code = FULL
            break
        state, tally = settle(method, state, time, index, notes, tally)
        if tally.events > before:
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
        if tally.evaluations >= most:
            code = CAP
            break
        piece = Piece(index, time, left, end)
        after, tally, duration, cut = advance(method, state, piece, tally)
        reached = time + duration if cut else end
        while taken < len(times) and times[taken] < reached:
            part = max(float(times[taken]) - time, 0.0)
            _write(states[taken], inside(method, state, after, piece, part))
            taken += 1
        state = after
        done = done + duration if cut else end - opened
        time = opened + done if cut else end
        if not (abs(state.x) <= limit and abs(state.v) <= limit):
            code = FAILURE
            break
    here = masses(method, state)
    _write(states[len(times)], here)
    while code == DONE and taken < len(times) and times[taken] <= time:
        _write(states[taken], here)
        taken += 1
    events, evaluations, work, dissipated, lost, penetration = tally
    return code, time, events, evaluations, work, dissipated, lost, penetration


@compiled
def _write(row, state):
    row[0] = state.x
    row[1] = state.v
    row[2] = state.y
    row[3] = state.u


@compiled
def note(
    notes: np.ndarray, tally: Tally, time: float, kind: float, side: float, speed: float
) -> Tally:
    """Write down an event and count it."""
    row = notes[tally.events]
    row[_WHEN] = time
    row[_KIND] = kind
    row[_WALL] = side
    row[_SPEED] = speed
    events, evaluations, work, dissipated, lost, penetration = tally
    return Tally(events + 1, evaluations, work, dissipated, lost, penetration)


@compiled
def spend(tally: Tally, evaluations: int) -> Tally:
    """Count evaluations."""
    events, before, work, dissipated, lost, penetration = tally
    return Tally(events, before + evaluations, work, dissipated, lost, penetration)


@compiled
def lose(tally: Tally, energy: float) -> Tally:
    """Add what an impact takes."""
    events, evaluations, work, dissipated, lost, penetration = tally
    return Tally(events, evaluations, work, dissipated, lost + energy, penetration)


@compiled
def transfer(tally: Tally, work: float, dissipated: float) -> Tally:
    """Add the work of the force, and what the dashpot takes."""
    events, evaluations, before, taken, lost, penetration = tally
    return Tally(events, evaluations, before + work, taken + dissipated, lost, penetration)


@compiled
def deepen(tally: Tally, depth: float) -> Tally:
    """Take note of a distance beyond a wall."""
    events, evaluations, work, dissipated, lost, penetration = tally
    return Tally(events, evaluations, work, dissipated, lost, max(penetration, depth))


def fixed_step(
    method_of: Callable[[Scene, float], Any],
) -> Callable[[Scene, float, Sequence[float], bool, int], Solution]:
    """Make what runs a scene with a number of steps per forcing period.

    Parameters
    ----------
    method_of : callable
        Takes the scene and the length of a step and returns the method.

    Returns
    -------
    callable
        As `damper.verification.comparison.solvers.Solver.method`. It raises ValueError for a number
        of steps that is not finite and positive.
    """

    def solve(
        scene: Scene, setting: float, times: Sequence[float], balance: bool, most: int
    ) -> Solution:
        if not 0.0 < setting < math.inf:
            raise ValueError(f"steps_per_period = {setting!r}: must be a finite number > 0")
        p, state = scene.parameters, scene.state
        step = p.period / float(setting)
        start = Masses(state.x, state.v, state.y, state.u)
        span = Span(state.time, scene.until, step)
        rest = method_of(scene, step), start, span, _limit(scene), int(most), np.array(times, float)
        code, rows = FULL, _ROWS
        while code == FULL:
            states = np.full((len(times) + 1, 4), np.nan)
            notes = np.empty((rows, 4))
            code, reached, *tally = run(*rest, states, notes)
            rows *= 16
        events, evaluations, *totals, penetration = tally
        notes = notes[:events]
        impacts = notes[notes[:, _KIND] == IMPACT]
        residual = math.nan
        if balance and code == DONE:
            residual = energy_residual(p, start, states[-1].tolist(), *totals)
        return Solution(
            impact_times=impacts[:, _WHEN].copy(),
            impact_sides=impacts[:, _WALL].copy(),
            approach_speeds=impacts[:, _SPEED].copy(),
            stick_times=notes[notes[:, _KIND] == STICK, _WHEN],
            release_times=notes[notes[:, _KIND] == RELEASE, _WHEN],
            states=states[:-1],
            penetration=float(penetration),
            energy_residual=residual,
            evaluations=int(evaluations),
            outcome=OUTCOMES[code],
            reached=float(reached),
        )

    return solve


def damper_of(scene: Scene) -> Damper:
    """Constants of the rigid damper of a scene."""
    p = scene.parameters
    return Damper(
        p.mass_ratio, p.damping_ratio, p.frequency_ratio, p.clearance, p.restitution, p.phase
    )


def _limit(scene: Scene) -> float:
    """Size of x and v beyond which a run has blown up.

    Neither the force, at most 1, nor the energy at the start can take them there: x and v grow by
    no more than 1 per unit of time.
    """
    p, state = scene.parameters, scene.state
    size = abs(state.x) + abs(state.v) + abs(state.y) + abs(state.u) + p.clearance
    return _BLOWN_UP * (1.0 + p.mass_ratio) * (1.0 + size + (scene.until - state.time))


@compiled
def force_at(damper: Damper, time: float) -> float:
    """Return the forcing, of amplitude 1."""
    return math.sin(damper.omega * time + damper.phase)


@compiled
def rk4(
    damper: Damper, mass: float, x: float, v: float, time: float, step: float
) -> tuple[float, ...]:
    """One classical Runge-Kutta step of mass x'' + 2 zeta x' + x = sin(omega t + phase).

    Parameters
    ----------
    damper : Damper
    mass : float
        1 in flight, 1 + mu in sticking.
    x, v, time, step : float

    Returns
    -------
    curve, dv, work, loss : float
        x(time + step) - x - v step, without cancellation; v(time + step) - v; work of the force
        and loss in the dashpot, as if they were further components of the state.
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
    return (
        sixth * step * (a1 + a2 + a3),
        sixth * (a1 + 2.0 * (a2 + a3) + a4),
        sixth * (force1 * v + 2.0 * force2 * (v2 + v3) + force3 * v4),
        sixth * twice * (v * v + 2.0 * (v2 * v2 + v3 * v3) + v4 * v4),
    )


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
def impact_loss(mu: float, before: float, after: float) -> float:
    """Energy lost as a relative speed changes; 1/2 mu / (1 + mu) times the squares' difference."""
    return 0.5 * mu / (1.0 + mu) * (before - after) * (before + after)


@compiled
def common_velocity(mu: float, v: float, u: float) -> float:
    """Velocity of both masses once they move as one."""
    return (v + mu * u) / (1.0 + mu)


@compiled
def nearer_wall(x: float, y: float) -> float:
    """Side of the wall that the free mass is nearer to."""
    return 1.0 if y >= x else -1.0
