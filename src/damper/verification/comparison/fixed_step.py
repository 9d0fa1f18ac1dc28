"""What solvers with a fixed step share: the problem, the step's ends, forces, and the result.

A method is a compiled function of a `SteppedScene` that returns a `SteppedRun`. All of it is
compiled, as the engine is: methods are compared, not languages.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from damper.engine.compiled import compiled
from damper.verification.comparison import solvers
from damper.verification.comparison.solvers import Scene, Solution, Solver

OUTCOMES = (solvers.FINISHED, solvers.STALLED, solvers.CAPPED, solvers.FAILED)
#: Outcomes as numbers, for compiled code: places in `OUTCOMES`.
DONE, STALL, CAP, FAILURE = range(4)

#: A displacement this many times what the force could have made of the start has blown up.
_BLOWN_UP = 1e6
#: A last step shorter than this part of a step belongs to the one before.
_SLIVER = 1e-9


class SteppedScene(NamedTuple):
    """A scene with a step, and what ends a run early."""

    mu: float
    zeta: float
    omega: float
    d: float
    r: float
    phase: float
    x: float
    v: float
    y: float
    u: float
    start: float
    until: float
    step: float
    steps: int
    limit: float
    """Of the primary's displacement and velocity."""
    most: int
    """Evaluations of the acceleration."""


class SteppedRun(NamedTuple):
    """What a method returns."""

    outcome: int
    """Place in `OUTCOMES`."""
    reached: float
    evaluations: int
    penetration: float
    """Largest distance beyond a wall."""
    end: tuple[float, float, float, float]
    events: list[tuple[float, float, float, float]]
    """Time, kind (as in `damper.engine.segment`), side, approach speed; the first is none."""


#: First entry of each list of events, from which numba knows what the list holds.
NO_EVENT = (0.0, -1.0, 0.0, 0.0)


def fixed_step(
    evaluations_per_second: float, method: Callable[[SteppedScene], SteppedRun]
) -> Solver:
    """Make the solver of a method with a number of steps per forcing period."""

    def solve(scene: Scene, setting: float, max_evaluations: int) -> Solution:
        p, s = scene.parameters, scene.state
        step = p.cycle / float(setting)
        # Neither the force, at most 1, nor the energy at the start can take x and v farther: they
        # grow by no more than 1 per unit of time.
        size = abs(s.x) + abs(s.v) + abs(s.y) + abs(s.u) + p.clearance
        run = method(
            SteppedScene(
                *(p.mass_ratio, p.damping_ratio, p.frequency_ratio),
                *(p.clearance, p.restitution, p.phase),
                *(s.x, s.v, s.y, s.u, s.time, scene.until),
                step=step,
                steps=max(math.ceil((scene.until - s.time) / step - _SLIVER), 0),
                limit=_BLOWN_UP * (1.0 + p.mass_ratio) * (1.0 + size + (scene.until - s.time)),
                most=int(max_evaluations),
            )
        )
        return Solution(
            end_state=np.array(run.end) if run.outcome == DONE else np.full(4, math.nan),
            penetration=float(run.penetration),
            evaluations=int(run.evaluations),
            outcome=OUTCOMES[run.outcome],
            reached=float(run.reached),
        ).list_events(np.array(run.events)[1:])

    return Solver(evaluations_per_second, solve)


@compiled
def end_of(p: SteppedScene, index: int) -> float:
    """End of a step, which are counted from 1; of step 0 the start."""
    return p.until if index == p.steps and index > 0 else p.start + index * p.step


@compiled
def has_blown_up(p: SteppedScene, x: float, v: float) -> bool:
    """Whether the primary is beyond the limit, or nowhere."""
    return not (abs(x) <= p.limit and abs(v) <= p.limit)


@compiled
def force_at(p: SteppedScene, time: float) -> float:
    """Return the forcing, of amplitude 1."""
    return math.sin(p.omega * time + p.phase)


@compiled
def rk4(
    p: SteppedScene, mass: float, x: float, v: float, time: float, step: float
) -> tuple[float, float]:
    """Return a classical Runge-Kutta step of mass x'' + 2 zeta x' + x = sin(omega t + phase).

    The mass is 1 in flight, 1 + mu in sticking. Returns x(time + step) - x - v step, without
    cancellation, and v(time + step) - v.
    """
    half = 0.5 * step
    force1 = force_at(p, time)
    force2 = force_at(p, time + half)
    force3 = force_at(p, time + step)
    twice = 2.0 * p.zeta
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
    p: SteppedScene, mass: float, x: float, v: float, time: float, side: float
) -> tuple[float, float]:
    """How a wall accelerates towards the free mass, and how that changes: -side x'', -side x'''.

    Positive where masses that move as one stick.
    """
    angle = p.omega * time + p.phase
    a = (math.sin(angle) - 2.0 * p.zeta * v - x) / mass
    j = (p.omega * math.cos(angle) - 2.0 * p.zeta * a - v) / mass
    return -side * a, -side * j


@compiled
def kick(p: SteppedScene, side: float, speed: float) -> float:
    """Change of the primary's velocity by an impact."""
    return side * p.mu * (1.0 + p.r) / (1.0 + p.mu) * speed


@compiled
def sticks(
    p: SteppedScene,
    x: float,
    common: float,
    time: float,
    side: float,
    rebound: float,
    longest: float,
) -> bool:
    """Whether masses stick after an impact: the wall pushes, and the flight back is short.

    It takes no more than the time `longest`. `common` is the velocity of both once they stick.
    """
    a, j = wall_acceleration(p, 1.0, x, common, time, side)
    return (a > 0.0 and 2.0 * rebound <= a * longest) or (rebound == 0.0 and a == 0.0 and j > 0.0)


@compiled
def common_velocity(mu: float, v: float, u: float) -> float:
    """Velocity of both masses once they move as one."""
    return (v + mu * u) / (1.0 + mu)


@compiled
def nearer_wall(x: float, y: float) -> float:
    """Side of the wall that the free mass is nearer to."""
    return 1.0 if y >= x else -1.0
