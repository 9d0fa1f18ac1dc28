"""What solvers with a fixed step share: a Runge-Kutta step, the law of impact, notes of events.

Their loops are compiled like the engine's, so that methods are compared and not languages.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np

from damper.engine.compiled import compiled
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

#: Outcomes as numbers, for compiled loops: places in `OUTCOMES`.
DONE = OUTCOMES.index(FINISHED)
STALL = OUTCOMES.index(STALLED)
CAP = OUTCOMES.index(CAPPED)
FAILURE = OUTCOMES.index(FAILED)

#: Columns of the notes that a loop takes: one row for each event.
WHEN, KIND, WALL, APPROACH = range(4)
#: A displacement this many times what the force could have made of the start has blown up.
_BLOWN_UP = 1e6
#: A last step shorter than this part of a step belongs to the one before.
_SLIVER = 1e-9


def solve_by(
    loop: Callable,
    scene: Scene,
    setting: float,
    times: Sequence[float],
    balance: bool,
    max_evaluations: int,
    wall: tuple = (),
) -> Solution:
    """Run a method's compiled loop with `setting` steps per forcing period.

    Parameters
    ----------
    loop : callable
        Takes the constants of the scene and of compliant contact, the start, the step, the limit of
        `limit_of`, times, whether to add up energies, and a number of evaluations; returns what
        `solution_of` takes.
    scene : Scene
    setting : float
    times : sequence of float
    balance : bool
    max_evaluations : int
        As given to the solver.
    wall : tuple, optional
        Constants of compliant contact.

    Raises
    ------
    ValueError
        For a setting that is not a positive number.
    """
    step = step_of(scene, setting)
    wanted = np.asarray(times, dtype=float)
    rest = (step, limit_of(scene), wanted, bool(balance), int(max_evaluations))
    result = loop(*constants(scene), *wall, *start_of(scene), *rest)
    return solution_of(scene, times, balance, *result)


def step_of(scene: Scene, steps_per_period: float) -> float:
    """Length of a step, at most the whole run.

    Raises
    ------
    ValueError
        Unless the number of steps is finite and positive.
    """
    if not 0.0 < steps_per_period < math.inf:
        raise ValueError(f"steps_per_period = {steps_per_period!r}: must be a finite number > 0")
    return scene.parameters.period / float(steps_per_period)


def constants(scene: Scene) -> tuple[float, ...]:
    """Constants of the rigid damper: mu, zeta, omega, d, r and the phase."""
    p = scene.parameters
    return (
        p.mass_ratio,
        p.damping_ratio,
        p.frequency_ratio,
        p.clearance,
        p.restitution,
        p.phase,
    )


def start_of(scene: Scene) -> tuple[float, ...]:
    """State at the start, x, v, y, u, its time, and the end."""
    state = scene.state
    return state.x, state.v, state.y, state.u, state.time, scene.until


def limit_of(scene: Scene) -> float:
    """Size of x and v beyond which a run has blown up.

    Neither the force, at most 1, nor the energy at the start can take them there: x and v grow by
    no more than 1 per unit of time.
    """
    p, state = scene.parameters, scene.state
    size = abs(state.x) + abs(state.v) + abs(state.y) + abs(state.u) + p.clearance
    return _BLOWN_UP * (1.0 + p.mass_ratio) * (1.0 + size + (scene.until - state.time))


def solution_of(
    scene: Scene,
    times: Sequence[float],
    balance: bool,
    notes: np.ndarray,
    states: np.ndarray,
    end: tuple[float, ...],
    totals: tuple[float, ...],
    penetration: float,
    evaluations: int,
    code: int,
    reached: float,
) -> Solution:
    """Put what a loop returns into a solution.

    Parameters
    ----------
    scene : Scene
    times : sequence of float
    balance : bool
        As given to the solver.
    notes : ndarray (events, 4)
        Time, kind (as in `damper.engine.segment`), side and approach speed.
    states : ndarray (times, 4)
    end, totals : tuple of float
        State at the end; work, what the dashpot took, and what impacts took.
    penetration : float
    evaluations, code : int
        Evaluations, and the outcome's place in `OUTCOMES`.
    reached : float
    """
    impacts = notes[notes[:, KIND] == IMPACT]
    state = scene.state
    start = (state.x, state.v, state.y, state.u)
    return Solution(
        impact_times=impacts[:, WHEN].copy(),
        impact_sides=impacts[:, WALL].copy(),
        approach_speeds=impacts[:, APPROACH].copy(),
        stick_times=notes[notes[:, KIND] == STICK, WHEN],
        release_times=notes[notes[:, KIND] == RELEASE, WHEN],
        states=states,
        penetration=float(penetration),
        energy_residual=energy_residual(scene.parameters, start, end, *totals)
        if balance and code == DONE
        else math.nan,
        evaluations=int(evaluations),
        outcome=OUTCOMES[code],
        reached=float(reached),
    )


@compiled
def records(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Room for notes of events, and for the states at `count` times."""
    return np.empty((64, 4)), np.full((count, 4), math.nan)


@compiled
def fill(
    states: np.ndarray,
    taken: int,
    times: np.ndarray,
    time: float,
    x: float,
    v: float,
    y: float,
    u: float,
) -> None:
    """Write the state at the end to the times that are left up to it; `taken` are done."""
    while taken < len(times) and times[taken] <= time:
        states[taken, 0] = x
        states[taken, 1] = v
        states[taken, 2] = y
        states[taken, 3] = u
        taken += 1


@compiled
def count_of(start: float, until: float, step: float) -> int:
    """Steps of a run; the last one may be shorter."""
    return max(math.ceil((until - start) / step - _SLIVER), 0)


@compiled
def note(
    notes: np.ndarray, count: int, time: float, kind: float, side: float, speed: float
) -> tuple[np.ndarray, int]:
    """Add an event; returns the notes, in a longer array where they were full, and their count."""
    if count == len(notes):
        longer = np.empty((2 * count + 64, 4))
        for row in range(count):
            for column in range(4):
                longer[row, column] = notes[row, column]
        notes = longer
    notes[count, WHEN] = time
    notes[count, KIND] = kind
    notes[count, WALL] = side
    notes[count, APPROACH] = speed
    return notes, count + 1


@compiled
def rk4(
    mass: float,
    zeta: float,
    omega: float,
    phase: float,
    x: float,
    v: float,
    time: float,
    step: float,
) -> tuple[float, ...]:
    """One classical Runge-Kutta step of mass x'' + 2 zeta x' + x = sin(omega t + phase).

    Parameters
    ----------
    mass, zeta, omega, phase : float
        1 in flight, 1 + mu in sticking; damping ratio, forcing frequency and phase.
    x, v, time, step : float

    Returns
    -------
    curve, dv, work, loss : float
        x(time + step) - x - v step, without cancellation; v(time + step) - v; work of the force
        and loss in the dashpot, as if they were further components of the state.
    """
    half = 0.5 * step
    force1 = math.sin(omega * time + phase)
    force2 = math.sin(omega * (time + half) + phase)
    force3 = math.sin(omega * (time + step) + phase)
    twice = 2.0 * zeta
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
def contact_force(
    mass: float,
    zeta: float,
    omega: float,
    phase: float,
    x: float,
    v: float,
    time: float,
    side: float,
) -> tuple[float, ...]:
    """How a wall accelerates towards the free mass, and how that changes: -side x'', -side x'''.

    Positive where the masses, once together, stay so.
    """
    angle = omega * time + phase
    a = (math.sin(angle) - 2.0 * zeta * v - x) / mass
    j = (omega * math.cos(angle) - 2.0 * zeta * a - v) / mass
    return -side * a, -side * j


@compiled
def impact_loss(mu: float, before: float, after: float) -> float:
    """Energy lost as a relative speed changes; 1/2 mu / (1 + mu) times the squares' difference."""
    return 0.5 * mu / (1.0 + mu) * (before - after) * (before + after)
