"""scipy's DOP853 with events, restarted at every event: how a careful user does it.

Newton's law at each impact, and sticking made by hand, because a complete burst has infinitely many
impacts.

A state is z = (x, v, g, h), with g = d - s (y - x) the gap to the wall s in question and h its
rate: at a restart on that wall g is 0 exactly. Each motion has a time of its own that starts at 0,
so that short flights late in a run are as exact as early ones.
"""

import math
import warnings
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from damper.models.walls import slack
from damper.verification.comparison.scene import Scene
from damper.verification.comparison.solution import CAPPED, FAILED, FINISHED, Solution
from damper.verification.comparison.solvers import Solver

#: Value of time and state whose fall through zero ends a motion.
EventCallable = Callable[[float, Sequence[float]], float]

#: An eighth of the natural period. Events are looked for at the ends of steps: a longer step can
#: hold two; nor are interpolants good over longer ones (DOP853).
LONGEST_STEP = math.pi / 4.0


class Mode(NamedTuple):
    """What holds between two events."""

    side: float
    """Wall that the gap is measured from: -1, +1; 0 for both at once."""
    events: tuple[EventCallable, ...]
    """Each ends the motion when it falls through zero."""
    together: bool = False
    """Whether the masses move as one."""
    gap_size: float = math.inf
    rate_size: float = math.inf
    """Sizes that gap and rate are expected to have, where they are small."""


class Stopped(Exception):  # noqa: N818 - it is an outcome, no error
    """A run has come to no good end; its argument is the outcome."""


class SolverRun:
    """A run of a scene: its events so far, and its evaluations.

    Parameters
    ----------
    scene : Scene
    tolerance : float
        Relative tolerance. The absolute one is this times min(1, clearance), and for gap and rate
        times their size in the motion if that is smaller: bounces below a fixed tolerance would be
        noise, and a burst would end too soon or never.
    max_evaluations : int
        Of the right-hand side.
    """

    def __init__(self, scene: Scene, tolerance: float, max_evaluations: int) -> None:
        self.scene, self.tolerance = scene, tolerance
        self.most = max_evaluations
        self.evaluations = 0
        self.reached = scene.state.time
        self.penetration = 0.0
        self.impacts: list[tuple[float, float, float]] = []
        self.stick_times: list[float] = []
        self.release_times: list[float] = []

    def advance(self, motion: Mode, start: Sequence[float]) -> tuple[list[float], int]:
        """Follow a motion from `reached` until it ends, or until the scene does.

        Returns
        -------
        z, event : list of float, int
            The state then, and which event it was; -1 if the scene ended.

        Raises
        ------
        Stopped
        """
        d = self.scene.parameters.clearance
        length = min(1.0, d) or 1.0
        sizes = np.minimum([length, length, motion.gap_size, motion.rate_size], length)
        for event in motion.events:
            event.terminal = True  # type: ignore[attr-defined]
            event.direction = -1.0  # type: ignore[attr-defined]
        try:
            found = solve_ivp(
                self._equations(motion),
                (0.0, self.scene.until - self.reached),
                start,
                method="DOP853",
                events=motion.events or None,
                max_step=LONGEST_STEP,
                rtol=self.tolerance,
                atol=self.tolerance * sizes,
            )
        except Stopped:
            raise
        except Exception as error:  # whatever a solver stumbles over is its outcome
            raise Stopped(FAILED) from error
        if found.status < 0 or not np.isfinite(found.y).all():
            raise Stopped(FAILED)
        hit = next((n for n, at in enumerate(found.t_events or ()) if len(at)), -1)
        if motion.side != 0.0:
            gaps = found.y[2]
            self.penetration = max(self.penetration, float(np.maximum(-gaps, gaps - 2.0 * d).max()))
        self.reached = self.scene.until if hit < 0 else self.reached + float(found.t[-1])
        return found.y[:, -1].tolist(), hit

    def _equations(self, motion: Mode) -> Callable[[float, np.ndarray], tuple[float, ...]]:
        """Right-hand side."""
        p = self.scene.parameters
        omega, drag = p.frequency_ratio, 2.0 * p.damping_ratio
        angle = omega * self.reached + p.phase
        heavier = 1.0 + p.mass_ratio if motion.together else 1.0
        side = 0.0 if motion.together else motion.side

        def rates(tau: float, z: np.ndarray) -> tuple[float, ...]:
            self.evaluations += 1
            if self.evaluations > self.most:
                raise Stopped(CAPPED)
            x, v, _, rate = z.tolist()
            a = (math.sin(omega * tau + angle) - drag * v - x) / heavier
            return v, a, 0.0 if motion.together else rate, side * a

        return rates

    def contact_force(self, side: float, z: Sequence[float], tau: float = 0.0) -> float:
        """Acceleration -g'' of flight towards the wall, a time after `reached`."""
        p = self.scene.parameters
        angle = p.frequency_ratio * tau + (p.frequency_ratio * self.reached + p.phase)
        return -side * (math.sin(angle) - 2.0 * p.damping_ratio * z[1] - z[0])

    def solution(self, outcome: str, end: Sequence[float] = (math.nan,) * 4) -> Solution:
        """Make what a solver gives back."""
        impacts = np.array(self.impacts).reshape(-1, 3)
        return Solution(
            impact_times=impacts[:, 0],
            impact_sides=impacts[:, 1],
            approach_speeds=impacts[:, 2],
            stick_times=np.array(self.stick_times),
            release_times=np.array(self.release_times),
            end_state=np.array(end),
            penetration=self.penetration,
            evaluations=self.evaluations,
            outcome=outcome,
            reached=self.reached,
        )


def solve(scene: Scene, tolerance: float, max_evaluations: int) -> Solution:
    """Run a scene; the arguments are those of `SolverRun`."""
    run = SolverRun(scene, tolerance, max_evaluations)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # solve_ivp warns where it raises rtol
        try:
            side, (x, v, gap, rate) = _follow(run)
        except Stopped as stopped:
            return run.solution(stopped.args[0])
    away = side * (scene.parameters.clearance - gap)
    return run.solution(FINISHED, (x, v, x + away, v - side * rate))


def _follow(run: SolverRun) -> tuple[float, list[float]]:
    """Go from event to event; return the wall and the state relative to it at the end."""
    p = run.scene.parameters
    r = p.restitution
    share = p.mass_ratio / (1.0 + p.mass_ratio)

    def merged(side: float, z: list[float]) -> list[float]:
        return [z[0], z[1] - side * share * z[3], 0.0, 0.0]

    side, z = _start(run)
    if p.clearance == 0.0:
        z, _ = run.advance(Mode(0.0, (), together=True), merged(side, z))
        return 0.0, z
    touches = z[2] == 0.0 and z[3] < 0.0
    stuck = z[2] == 0.0 and z[3] == 0.0 and _pushed(run, side, z)
    while True:
        if touches:
            approach = max(-z[3], 0.0)
            run.impacts.append((run.reached, side, approach))
            z = [z[0], z[1] + side * share * (1.0 + r) * approach, 0.0, r * approach]
            force = run.contact_force(side, z)
            # The rest of the burst, to first order 2 w / (a (1 - r)), is within tolerance.
            stuck = force > 0.0 and 2.0 * z[3] <= run.tolerance * force * (1.0 - r)
        if stuck:
            run.stick_times.append(run.reached)
            z = merged(side, z)
        if run.reached >= run.scene.until:
            return side, z
        if not stuck:
            side, z, touches = _fly(run, side, z)
            continue
        released = _force_on(run, side)
        z, ended = run.advance(Mode(side, (released,), together=True), z)
        if ended >= 0:
            run.release_times.append(run.reached)
        stuck = touches = False


def _start(run: SolverRun) -> tuple[float, list[float]]:
    """Wall that is nearer, and the state relative to it; a gap of roundoff is none.

    From the centre it is the one that the free mass will near, so that a mirrored scene is
    mirrored in every step.
    """
    s, d = run.scene.state, run.scene.parameters.clearance
    a, j = _derivatives(run, s.x, s.v)
    side = 1.0 if (s.y - s.x or s.u - s.v or -(a + j)) >= 0.0 else -1.0
    gap = d - side * (s.y - s.x)
    if abs(gap) <= slack(d, s.x, s.y):
        gap = 0.0
    return side, [s.x, s.v, gap, -side * (s.u - s.v)]


def _fly(run: SolverRun, side: float, z: list[float]) -> tuple[float, list[float], bool]:
    """Fly to the next impact, and measure from the wall that it is on."""
    across = 2.0 * run.scene.parameters.clearance
    events = (falling_gap(z), lambda tau, z: across - float(z[2]))
    gap_size = rate_size = math.inf
    force = run.contact_force(side, z)
    if z[2] == 0.0 and z[3] > 0.0:
        rate_size = z[3]
        if force > 0.0:
            gap_size = 0.5 * z[3] * z[3] / force
    z, hit = run.advance(Mode(side, events, gap_size=gap_size, rate_size=rate_size), z)
    if hit == 1:
        side, z = -side, [z[0], z[1], 0.0, -z[3]]
    return side, z, hit >= 0


def falling_gap(start: Sequence[float]) -> EventCallable:
    """Gap of a flight, without the root that the flight may start on.

    A flight from the wall has g = 0 at its start, which the integrator would take for an impact,
    or for the side from which the next one comes. g over the time since then has the same roots
    but for that one, and is the rate of the gap there.
    """
    if start[2] > 0.0:
        return lambda tau, z: float(z[2])
    return lambda tau, z: float(z[2] / tau if tau > 0.0 else z[3])


def _force_on(run: SolverRun, side: float) -> EventCallable:
    return lambda tau, z: run.contact_force(side, z, tau)


def _pushed(run: SolverRun, side: float, z: Sequence[float]) -> bool:
    """Whether masses in contact without relative velocity stick."""
    a, j = _derivatives(run, z[0], z[1])
    return -side * (a or j) > 0.0


def _derivatives(run: SolverRun, x: float, v: float) -> tuple[float, float]:
    """Second derivative of the primary in flight, and what decides where it vanishes: the third."""
    p = run.scene.parameters
    a = -run.contact_force(1.0, (x, v))
    angle = p.frequency_ratio * run.reached + p.phase
    return a, p.frequency_ratio * math.cos(angle) - 2.0 * p.damping_ratio * a - v


SOLVER = Solver("tolerance", 120_000, solve)
