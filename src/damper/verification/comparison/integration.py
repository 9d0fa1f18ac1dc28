"""One motion after the other by `scipy.integrate.solve_ivp`, each up to the event that ends it.

What all solvers that restart have in common: the equations between events, events that do not see
the root they start on, counting, sampling, and the energy that goes in and out on the way.

A state is z = (x, v, g, h), with g = d - s (y - x) the gap to the wall s in question and h its
rate: at a restart on that wall g is 0 exactly. Each motion has a time of its own that starts at 0,
so that short flights late in a run are as exact as early ones.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from damper.verification.comparison.energy import energy_residual
from damper.verification.comparison.scene import Scene
from damper.verification.comparison.solution import CAPPED, FAILED, FINISHED, STALLED, Solution

#: Value of time and state whose fall (or rise) through zero ends a motion.
EventCallable = Callable[[float, Sequence[float]], float]

#: scipy's methods that solve equations, and need their derivatives.
_IMPLICIT = ("Radau", "BDF", "LSODA")
#: Gauss's nodes and weights on (0, 1): work and losses within one step of the integrator.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_NODES, _WEIGHTS = 0.5 + 0.5 * _NODES, 0.5 * _WEIGHTS
#: Impacts in which time stands still before a run counts as stalled.
_IDLE_IMPACTS = 100


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
    stiffness: float = 0.0
    damping: float = 0.0
    """k and c of a compliant contact with the force N = -(k g + c h)."""
    springs: float = 0.0
    """Stiffness of its spring, in contact or springing back: k where g < 0."""
    gap_size: float = math.inf
    rate_size: float = math.inf
    """Sizes that gap and rate are expected to have, where they are small."""
    max_step: float = LONGEST_STEP


class CappedError(Exception):
    """The evaluations have run out."""


class FailedError(Exception):
    """The integrator failed, or a value is not finite."""


class StalledError(Exception):
    """Impacts go on and time does not."""


def falling_gap(start: Sequence[float]) -> EventCallable:
    """Gap of a flight, without the root that the flight may start on.

    A flight from the wall has g = 0 at its start, which the integrator would take for an impact,
    or for the side from which the next one comes. g over the time since then has the same roots
    but for that one, and is the rate of the gap there.
    """
    if start[2] > 0.0:
        return lambda tau, z: float(z[2])
    return lambda tau, z: float(z[2] / tau if tau > 0.0 else z[3])


def falling_depth(start: Sequence[float]) -> EventCallable:
    """Depth below the surface of a compliant wall, treated in the same way."""
    if start[2] < 0.0:
        return lambda tau, z: -float(z[2])
    return lambda tau, z: -float(z[2] / tau if tau > 0.0 else z[3])


class Integration:
    """One run of a scene: what has come of it so far, and what it has cost.

    Parameters
    ----------
    scene : Scene
    method : str
        Of `solve_ivp`.
    tolerance : float
        Relative tolerance. The absolute one is this times min(1, clearance), and for gap and rate
        times their size in the motion if that is smaller: bounces below a fixed tolerance would be
        noise, and a burst would end too soon or never (LSODA, Radau; both measured).
    times : sequence of float
        Where states are wanted, ascending.
    balance : bool
        Whether to add up energies.
    max_evaluations : int
        Of the right-hand side.
    """

    def __init__(
        self,
        scene: Scene,
        method: str,
        tolerance: float,
        times: Sequence[float],
        balance: bool,
        max_evaluations: int,
    ) -> None:
        p = scene.parameters
        self.scene = scene
        self.parameters = p
        self.evaluations = 0
        self.reached = scene.state.time
        self.penetration = 0.0
        self.impacts: list[tuple[float, float, float]] = []
        self.stick_times: list[float] = []
        self.release_times: list[float] = []
        self.lost = 0.0
        self._method = method
        self._tolerance = tolerance
        self._times = np.asarray(times, dtype=float)
        self._states = np.full((len(self._times), 4), np.nan)
        self._balance = balance
        self._work = 0.0
        self._dissipated = 0.0
        self._limit = max_evaluations
        self._idle = 0
        self._end: np.ndarray | None = None

    def advance(self, motion: Mode, start: Sequence[float]) -> tuple[list[float], int]:
        """Follow a motion from `reached` until it ends, or until the scene does.

        Returns
        -------
        z, event : list of float, int
            The state then, and which event it was; -1 if the scene ended.

        Raises
        ------
        CappedError, FailedError
        """
        rates, matrix = self._equations(motion)
        options: dict = {"rtol": self._tolerance, "atol": self._absolute_tolerance(motion)}
        if self._method in _IMPLICIT:
            constant = self._method != "LSODA"
            options["jac"] = matrix if constant else lambda tau, z: matrix
        for event in motion.events:
            event.terminal = True  # type: ignore[attr-defined]
            event.direction = -1.0  # type: ignore[attr-defined]
        begin = self.reached
        duration = self.scene.until - begin
        sampled = len(self._times) > 0 and bool(self._times[-1] >= begin)
        try:
            found = solve_ivp(
                rates,
                (0.0, duration),
                start,
                method=self._method,
                events=motion.events or None,
                dense_output=sampled or self._balance,
                max_step=motion.max_step,
                **options,
            )
        except CappedError:
            raise
        except Exception as error:  # whatever a solver stumbles over is its outcome
            raise FailedError(str(error)) from error
        z = found.y[:, -1]
        if found.status < 0 or not np.isfinite(found.y).all():
            raise FailedError(found.message)
        hit = next((n for n, at in enumerate(found.t_events or ()) if len(at)), -1)
        if motion.side != 0.0:
            gaps = found.y[2]
            beyond = np.maximum(-gaps, gaps - 2.0 * self.parameters.clearance)
            self.penetration = max(self.penetration, float(beyond.max()))
        end = self.scene.until if hit < 0 else begin + float(found.t[-1])
        if sampled:
            self._sample(motion, found.sol, begin, end, hit < 0)
        if self._balance:
            self._add_energies(motion, found.sol, found.t, begin)
        self.reached = end
        return z.tolist(), hit

    def impact(self, before: float, side: float, approach: float) -> None:
        """Note an impact after a flight that began at `before`.

        Raises
        ------
        StalledError
            When time has stood still to roundoff for many impacts.
        """
        self.impacts.append((self.reached, side, approach))
        resolution = 4.0 * np.finfo(float).eps * max(1.0, abs(before))
        self._idle = self._idle + 1 if self.reached - before <= resolution else 0
        if self._idle >= _IDLE_IMPACTS:
            raise StalledError

    def absolute(self, side: float, z: np.ndarray) -> np.ndarray:
        """Turn states (4, n) into rows x, v, y, u (n, 4)."""
        x, v, gap, rate = z
        away = side * (self.parameters.clearance - gap)
        return np.stack([x, v, x + away, v - side * rate], axis=1)

    def contact_force(self, side: float, z: Sequence[float], tau: float = 0.0) -> float:
        """Acceleration -g'' of flight towards the wall, a time after `reached`."""
        p = self.parameters
        angle = p.frequency_ratio * tau + (p.frequency_ratio * self.reached + p.phase)
        return -side * (math.sin(angle) - 2.0 * p.damping_ratio * z[1] - z[0])

    def solution(self, outcome: str) -> Solution:
        """Make what a solver gives back."""
        impacts = np.array(self.impacts).reshape(-1, 3)
        residual = math.nan
        if self._balance and outcome == FINISHED:
            s = self.scene.state
            start = (s.x, s.v, s.y, s.u)
            end = start if self._end is None else tuple(self._end.tolist())
            residual = energy_residual(
                self.parameters, start, end, self._work, self._dissipated, self.lost
            )
        return Solution(
            impact_times=impacts[:, 0],
            impact_sides=impacts[:, 1],
            approach_speeds=impacts[:, 2],
            stick_times=np.array(self.stick_times),
            release_times=np.array(self.release_times),
            states=self._states,
            penetration=self.penetration,
            energy_residual=residual,
            evaluations=self.evaluations,
            outcome=outcome,
            reached=self.reached,
        )

    def outcome(self, follow: Callable[["Integration"], tuple[float, list[float]]]) -> Solution:
        """Run to the end, or to what stops it; `follow` returns wall and state there."""
        try:
            side, z = follow(self)
            self._end = self.absolute(side, np.array(z)[:, None])[0]
        except CappedError:
            return self.solution(CAPPED)
        except StalledError:
            return self.solution(STALLED)
        except FailedError:
            return self.solution(FAILED)
        return self.solution(FINISHED)

    def _absolute_tolerance(self, motion: Mode) -> np.ndarray:
        length = min(1.0, self.parameters.clearance) or 1.0
        sizes = np.array([length, length, motion.gap_size, motion.rate_size])
        return self._tolerance * np.minimum(sizes, length)

    def _equations(self, motion: Mode) -> tuple[Callable, np.ndarray]:
        p = self.parameters
        omega = p.frequency_ratio
        angle = omega * self.reached + p.phase
        drag = 2.0 * p.damping_ratio
        heavier = 1.0 + p.mass_ratio
        gamma = heavier / p.mass_ratio
        side, k, c = motion.side, motion.stiffness, motion.damping
        limit = self._limit

        def count() -> None:
            self.evaluations += 1
            if self.evaluations > limit:
                raise CappedError

        if motion.together:

            def common_rates(tau: float, z: np.ndarray) -> tuple[float, ...]:
                count()
                x, v, _, _ = z.tolist()
                return v, (math.sin(omega * tau + angle) - drag * v - x) / heavier, 0.0, 0.0

            row = np.array([-1.0, -drag, 0.0, 0.0]) / heavier
            return common_rates, np.array([[0.0, 1.0, 0.0, 0.0], row, np.zeros(4), np.zeros(4)])

        def rates(tau: float, z: np.ndarray) -> tuple[float, ...]:
            count()
            x, v, gap, rate = z.tolist()
            force = math.sin(omega * tau + angle) - drag * v - x
            wall = -(k * gap + c * rate)
            return v, force + side * wall, rate, side * force + gamma * wall

        return rates, np.array(
            [
                [0.0, 1.0, 0.0, 0.0],
                [-1.0, -drag, -side * k, -side * c],
                [0.0, 0.0, 0.0, 1.0],
                [-side, -side * drag, -gamma * k, -gamma * c],
            ]
        )

    def _sample(self, motion: Mode, sol: Callable, begin: float, end: float, last: bool) -> None:
        low = np.searchsorted(self._times, begin)
        high = np.searchsorted(self._times, end, side="right" if last else "left")
        if high > low:
            z = sol(self._times[low:high] - begin)
            self._states[low:high] = self.absolute(motion.side, z)
            gaps = z[2]
            if motion.side != 0.0:
                beyond = np.maximum(-gaps, gaps - 2.0 * self.parameters.clearance)
                self.penetration = max(self.penetration, float(beyond.max()))

    def _add_energies(self, motion: Mode, sol: Callable, ends: np.ndarray, begin: float) -> None:
        """Integrate power over the interpolant of each step.

        Not by two more equations: their errors would enter the norm that chooses the step, and a
        run would be another one when its balance is asked for.
        """
        p = self.parameters
        spans = np.diff(ends)
        tau = (ends[:-1, None] + spans[:, None] * _NODES).ravel()
        weight = (spans[:, None] * _WEIGHTS).ravel()
        _, v, gap, rate = sol(tau)
        force = np.sin(p.frequency_ratio * tau + (p.frequency_ratio * begin + p.phase))
        self._work += float(weight @ (force * v))
        self._dissipated += float(weight @ (2.0 * p.damping_ratio * v * v))
        if motion.springs:
            wall = -(motion.stiffness * gap + motion.damping * rate)
            self.lost -= float(weight @ ((wall + motion.springs * gap) * rate))
