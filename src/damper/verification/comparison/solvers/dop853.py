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
from math import inf

import numpy as np
from scipy.integrate import solve_ivp

from damper.engine.segment import IMPACT, RELEASE, STICK
from damper.verification.comparison.solvers import CAPPED, FAILED, FINISHED, Scene, Solution, Solver

#: Value of time and state whose fall through zero ends a motion.
EventCallable = Callable[[float, Sequence[float]], float]

#: An eighth of the natural period. Events are looked for at the ends of steps: a longer step can
#: hold two; nor are interpolants good over longer ones (DOP853).
LONGEST_STEP = math.pi / 4.0


class Stopped(Exception):  # noqa: N818 - it is an outcome, no error
    """A run has come to no good end; its argument is the outcome."""


class SolverRun:
    """A run of a scene: where it is, its events so far, and its evaluations.

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
        self.found = Solution(penetration=0.0, reached=scene.state.time)
        self.events: list[tuple[float, float, float, float]] = []
        # From the centre the wall is the one that the free mass will near, so that a mirrored scene
        # is mirrored in every step.
        s, d = scene.state, scene.parameters.clearance
        a, j = self.derivatives(s.x, s.v)
        self.side = 1.0 if (s.y - s.x or s.u - s.v or -(a + j)) >= 0.0 else -1.0
        self.z = [s.x, s.v, d - self.side * (s.y - s.x), -self.side * (s.u - s.v)]

    def advance(self, *events: EventCallable, joined: bool = False, sizes=(inf, inf)) -> int:
        """Move on until an event or the end of the scene; return which event, -1 for none.

        `joined` masses move as one; `sizes` are those that gap and rate are expected to have.
        """
        d, found = self.scene.parameters.clearance, self.found
        length = min(1.0, d)
        for event in events:
            event.terminal = True  # type: ignore[attr-defined]
            event.direction = -1.0  # type: ignore[attr-defined]
        try:
            motion = solve_ivp(
                self._equations(joined),
                (0.0, self.scene.until - found.reached),
                self.z,
                method="DOP853",
                events=events or None,
                max_step=LONGEST_STEP,
                rtol=self.tolerance,
                atol=self.tolerance * np.minimum([length, length, *sizes], length),
            )
        except Stopped:
            raise
        except Exception as error:  # whatever a solver stumbles over is its outcome
            raise Stopped(FAILED) from error
        if motion.status < 0 or not np.isfinite(motion.y).all():
            raise Stopped(FAILED)
        hit = next((n for n, at in enumerate(motion.t_events or ()) if len(at)), -1)
        gaps = motion.y[2]
        depth = float(np.maximum(-gaps, gaps - 2.0 * d).max())
        found.penetration = max(found.penetration, depth)
        found.reached = self.scene.until if hit < 0 else found.reached + float(motion.t[-1])
        self.z = motion.y[:, -1].tolist()
        return hit

    def _equations(self, joined: bool) -> Callable[[float, np.ndarray], tuple[float, ...]]:
        """Right-hand side."""
        p = self.scene.parameters
        omega, drag = p.frequency_ratio, 2.0 * p.damping_ratio
        angle = omega * self.found.reached + p.phase
        heavier = 1.0 + p.mass_ratio if joined else 1.0
        side = 0.0 if joined else self.side

        def rates(tau: float, z: np.ndarray) -> tuple[float, ...]:
            self.found.evaluations += 1
            if self.found.evaluations > self.most:
                raise Stopped(CAPPED)
            x, v, _, rate = z.tolist()
            a = (math.sin(omega * tau + angle) - drag * v - x) / heavier
            return v, a, 0.0 if joined else rate, side * a

        return rates

    def contact_force(self, tau: float, z: Sequence[float]) -> float:
        """Acceleration -g'' of flight towards the wall, a time after `reached`."""
        p = self.scene.parameters
        angle = p.frequency_ratio * tau + (p.frequency_ratio * self.found.reached + p.phase)
        return -self.side * (math.sin(angle) - 2.0 * p.damping_ratio * z[1] - z[0])

    def derivatives(self, x: float, v: float) -> tuple[float, float]:
        """Second derivative of the primary in flight, and where it vanishes: the third."""
        p = self.scene.parameters
        angle = p.frequency_ratio * self.found.reached + p.phase
        a = math.sin(angle) - 2.0 * p.damping_ratio * v - x
        return a, p.frequency_ratio * math.cos(angle) - 2.0 * p.damping_ratio * a - v

    def follow(self) -> None:
        """Go from event to event to the end of the scene."""
        touches = stuck = False
        while True:
            if touches:
                stuck = self.collide()
            if stuck:
                self.note(STICK)
                self.merge()
            if self.found.reached >= self.scene.until:
                return
            if not stuck:
                touches = self.fly()
                continue
            if self.advance(lambda tau, z: self.contact_force(tau, z), joined=True) >= 0:
                self.note(RELEASE)
            stuck = touches = False

    def collide(self) -> bool:
        """Apply the law of impact; return whether the masses stick."""
        p, (x, v, _, rate) = self.scene.parameters, self.z
        approach = max(-rate, 0.0)
        self.note(IMPACT, approach)
        share = p.mass_ratio / (1.0 + p.mass_ratio)
        v += self.side * share * (1.0 + p.restitution) * approach
        self.z = [x, v, 0.0, p.restitution * approach]
        force = self.contact_force(0.0, self.z)
        # The rest of the burst, to first order 2 w / (a (1 - r)), is within tolerance.
        return force > 0.0 and 2.0 * self.z[3] <= self.tolerance * force * (1.0 - p.restitution)

    def fly(self) -> bool:
        """Fly to the next impact, measured from the wall that it is on; return whether it comes."""
        across = 2.0 * self.scene.parameters.clearance
        sizes, rate = (inf, inf), self.z[3]
        if self.z[2] == 0.0 and rate > 0.0:
            force = self.contact_force(0.0, self.z)
            sizes = (0.5 * rate * rate / force if force > 0.0 else inf, rate)
        hit = self.advance(falling_gap(self.z), lambda tau, z: across - float(z[2]), sizes=sizes)
        if hit == 1:
            self.side, self.z = -self.side, [*self.z[:2], 0.0, -self.z[3]]
        return hit >= 0

    def merge(self) -> None:
        """Give both masses their common velocity, on the wall."""
        mu, (x, v, _, rate) = self.scene.parameters.mass_ratio, self.z
        self.z = [x, v - self.side * (mu / (1.0 + mu)) * rate, 0.0, 0.0]

    def note(self, kind: float, speed: float = 0.0) -> None:
        """Write an event down."""
        self.events.append((self.found.reached, kind, self.side, speed))


def solve(scene: Scene, tolerance: float, max_evaluations: int) -> Solution:
    """Run a scene; the arguments are those of `SolverRun`."""
    run = SolverRun(scene, tolerance, max_evaluations)
    run.found.outcome = FINISHED
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # solve_ivp warns where it raises rtol
        try:
            run.follow()
        except Stopped as stopped:
            run.found.outcome = stopped.args[0]
    if run.found.outcome == FINISHED:
        x, v, gap, rate = run.z
        away = run.side * (scene.parameters.clearance - gap)
        run.found.end_state = np.array((x, v, x + away, v - run.side * rate))
    return run.found.list_events(np.array(run.events).reshape(-1, 4))


def falling_gap(start: Sequence[float]) -> EventCallable:
    """Gap of a flight, without the root that the flight may start on.

    A flight from the wall has g = 0 at its start, which the integrator would take for an impact,
    or for the side from which the next one comes. g over the time since then has the same roots
    but for that one, and is the rate of the gap there.
    """
    if start[2] > 0.0:
        return lambda tau, z: float(z[2])
    return lambda tau, z: float(z[2] / tau if tau > 0.0 else z[3])


SOLVER = Solver(120_000, solve)
