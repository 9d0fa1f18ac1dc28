"""The symmetric motion with two impacts per forcing period, in closed form.

The free mass hits each wall once per period; the second half of the period mirrors the first half
(Masri, J. Acoust. Soc. Am. 47, 1970, 229-237; Bapat and Sankar, J. Sound Vib. 99, 1985, 85-94).
The free mass leaves the right wall at the speed V > 0 and arrives at the left wall half a period h
= pi/omega later. So

    x0  = V h / 2 - d                          half of the path V h is x0 + d
    u-  = -V (1 - r + 2 mu) / (1 + r)          velocity of the primary before the impact
    u+  = u- + 2 mu V                          and after it: momentum is kept

With E the free flow over h and F that of the force from rest, F (sin phase, cos phase) =
-E (x0, u+) - (x0, u-) = F (V alpha + d beta), and |V alpha + d beta| = 1 is a quadratic for V. E
and F come from `damper.engine.oscillator`, which keeps their digits in every regime. Derivation:
docs/theory.md.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from damper.engine.compiled import compiled, plain
from damper.engine.forcing import phase_at
from damper.engine.forcing.harmonic import Phase, harmonic
from damper.engine.oscillator import advance, motion_from, oscillator
from damper.engine.peak import highest, moment_at
from damper.engine.segment import CAUSE, IMPACT, NOTHING, SIDE, TIME
from damper.engine.trajectory import Trajectory
from damper.models import start_run
from damper.models.response import ShiftedOscillator
from damper.parameters import Parameters, State
from damper.theory import require_basic
from damper.theory.steady import steady_amplitude

#: The free mass must reach the far wall after half a period, to this part of it.
_ON_TIME = 1e-6
#: A force that moves the primary over half a period by less than this part of its steady response
#: (or of the half period squared) does not move it at all.
_NOTHING = 1e-12


@dataclass(frozen=True)
class Orbit:
    """One motion with two impacts per period; values hold at the impact on the right wall.

    In the units of `damper.Parameters`.
    """

    parameters: Parameters
    speed: float
    """V, the speed of the free mass between the walls."""
    displacement: float
    """x0, of the primary at the impact."""
    velocity_before: float
    """u-, of the primary just before it."""
    velocity_after: float
    """u+, just after it."""
    forcing_phase: float
    """Argument of the force's sine at the impact, in [0, 2 pi)."""

    @property
    def approach_speed(self) -> float:
        """Relative speed just before each impact."""
        return self.speed - self.velocity_before

    @property
    def start(self) -> State:
        """State just after the first impact on the right wall at a time >= 0.

        A run of `parameters` from here is on the orbit.
        """
        turn = math.fmod(self.forcing_phase - self.parameters.phase, math.tau)
        time = (turn if turn >= 0.0 else turn + math.tau) / self.parameters.frequency_ratio
        return self._state(time)

    @cached_property
    def admissible(self) -> bool:
        """Whether the free mass stays between the walls from one impact to the next.

        Decided by the engine's certified search: the first contact after the right wall's impact
        must be the one with the left wall half a period later.
        """
        half = math.pi / self.parameters.frequency_ratio
        trajectory = self._trajectory(max_events=1)
        for log in trajectory.segments(0.0, half * (1.0 + _ON_TIME)):
            for row in log[log[:, CAUSE] != NOTHING]:
                on_left = row[CAUSE] == IMPACT and row[SIDE] == -1.0
                return bool(on_left and row[TIME] >= half * (1.0 - _ON_TIME))
        return False

    @cached_property
    def peak(self) -> float:
        """Largest displacement of the primary, either way; NaN where not admissible."""
        if not self.admissible:
            return math.nan
        return _peak(self)

    @cached_property
    def multipliers(self) -> np.ndarray:
        """Floquet multipliers of the half period, complex, the largest first; shape (4,).

        Eigenvalues of the derivative of the half-period map, from the state just after an impact to
        the mirrored state just after the next impact: flow, reflection, saltation (Leine and
        Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, 2004). The
        multipliers of the whole period are their squares.
        """
        values = np.linalg.eigvals(_half_period_map(self))
        return values[np.lexsort((-values.imag, -abs(values)))]

    @property
    def stable(self) -> bool:
        """Whether small deviations die out: all multipliers inside the unit circle."""
        return bool(abs(self.multipliers[0]) < 1.0)

    def stroboscopic(self, at: float = 0.0) -> tuple[float, float]:
        """Displacement and velocity of the primary at a fraction `at` of the forcing period.

        Time zero is that of `parameters`. The orbit is its own mirror image half a period later, so
        one point describes it.
        """
        p = self.parameters
        turn = math.fmod(math.tau * at + p.phase - self.forcing_phase, math.tau)
        since = (turn if turn >= 0.0 else turn + math.tau) / p.frequency_ratio
        half = math.pi / p.frequency_ratio
        sign = -1.0 if since >= half else 1.0
        start = (
            self.displacement,
            self.velocity_after,
            math.sin(self.forcing_phase),
            math.cos(self.forcing_phase),
        )
        flow = _flow(p.damping_ratio, p.frequency_ratio, since - half if since >= half else since)
        x, v = sign * (flow @ start)
        return float(x), float(v)

    def after_impact(self, wall: str = "right") -> tuple[float, float]:
        """Displacement and velocity of the primary just after the impact on one wall."""
        sign = {"right": 1.0, "left": -1.0}[wall]
        return sign * self.displacement, sign * self.velocity_after

    def _state(self, time: float) -> State:
        right = self.displacement + self.parameters.clearance
        return State(self.displacement, self.velocity_after, right, -self.speed, time)

    def _trajectory(self, max_events: int = 1_000_000) -> Trajectory:
        """Run of the orbit whose time starts at an impact on the right wall."""
        p = self.parameters
        there = Parameters(
            p.mass_ratio,
            p.damping_ratio,
            p.frequency_ratio,
            p.clearance,
            p.restitution,
            self.forcing_phase,
        )
        return start_run(there, self._state(0.0), max_events=max_events)


def orbits(parameters: Parameters) -> list[Orbit]:
    """All motions that satisfy the conditions of two symmetric impacts per period.

    Parameters
    ----------
    parameters : Parameters

    Returns
    -------
    list of Orbit
        None, one or two, the faster free mass first. Ask `admissible` whether the free mass really
        stays off the walls in between. With clearance 0 there are none (the masses stick for good),
        and none for an undamped primary with 1/frequency_ratio = 3, 5, ...: half a period brings
        it back mirrored whatever the force does, so that no impact could change its momentum.

    Raises
    ------
    ValueError
        For another model than the rigid one, and for a restitution that is not constant.

    Examples
    --------
    >>> fast, slow = orbits(Parameters(0.1, 0.1, 1.0, 5.5, 0.5))
    >>> round(fast.speed, 12), round(fast.displacement, 12), fast.stable
    (4.594001326355, 1.716240408729, True)
    >>> slow.admissible, slow.stable
    (True, False)
    """
    d = parameters.clearance
    linear = _linear_form(parameters)
    if linear is None or d == 0.0:
        return []
    alpha, beta = linear
    square = alpha @ alpha
    # The discriminant over |alpha|^2 in its closed form, which does not cancel.
    rest = square - (d * _cross(alpha, beta)) ** 2
    if rest < 0.0:
        return []
    middle, spread = -d * (alpha @ beta), math.sqrt(rest)
    size = d * math.hypot(*beta)
    larger = middle + math.copysign(spread, middle)
    roots = {larger / square, (size - 1.0) * (size + 1.0) / larger} if larger else set()
    return [_orbit(parameters, v, v * alpha + d * beta) for v in sorted(roots)[::-1] if v > 0.0]


def largest_clearance(parameters: Parameters) -> float:
    """Clearance up to which the conditions of `orbits` have a real solution; there both meet.

    The damper's own clearance does not matter. Infinite where there is a solution for any
    clearance; 0 where there is none at all.
    """
    linear = _linear_form(parameters)
    if linear is None:
        return 0.0
    alpha, beta = linear
    cross = abs(_cross(alpha, beta))
    return math.hypot(*alpha) / cross if cross > 0.0 else math.inf


class _Speeds(NamedTuple):
    """Velocities of the primary at the right wall's impact, per speed of the free mass."""

    before: float
    after: float


def _speeds(parameters: Parameters) -> _Speeds:
    mu, r = parameters.mass_ratio, parameters.restitution
    before = -(1.0 - r + 2.0 * mu) / (1.0 + r)
    return _Speeds(before, (2.0 * mu * r - 1.0 + r) / (1.0 + r))


def _linear_form(parameters: Parameters) -> tuple[np.ndarray, np.ndarray] | None:
    """Return alpha, beta of the sine and cosine V alpha + d beta; None where there is no orbit."""
    p = parameters
    require_basic(p)
    half = math.pi / p.frequency_ratio
    flow = _flow(p.damping_ratio, p.frequency_ratio, half)
    free, forced = flow[:, :2], flow[:, 2:]
    steady = steady_amplitude(p.damping_ratio, p.frequency_ratio)
    if abs(forced).max() < _NOTHING * min(steady, half * half):
        return None
    before, after = _speeds(p)
    right = -free @ [0.5 * half, after] - [0.5 * half, before]
    alpha, beta = np.linalg.solve(forced, np.array([right, free[:, 0] + [1.0, 0.0]]).T).T
    return alpha, beta


@compiled
def _flow(damping_ratio, frequency_ratio, tau):
    """Flow of the primary over a time, a (2, 4) matrix.

    It takes displacement and velocity, and sine and cosine of the forcing phase, at the start to
    displacement and velocity at the end.
    """
    forcing = harmonic(frequency_ratio, 0.0)
    flow = np.empty((2, 4))
    for column in range(4):
        osc = oscillator(damping_ratio, 1.0, 0.0 if column < 2 else 1.0, forcing)
        x = 1.0 if column == 0 else 0.0
        v = 1.0 if column == 1 else 0.0
        phase = Phase(1.0 if column == 2 else 0.0, 1.0 if column == 3 else 0.0)
        dx, end = advance(osc, motion_from(osc, x, v, phase), tau)
        flow[0, column] = x + dx
        flow[1, column] = end
    return flow


@plain
def _peak(orbit: Orbit) -> float:
    """Largest |x| in the half period after the impact; the other half is its mirror image."""
    p = orbit.parameters
    forcing = harmonic(p.frequency_ratio, orbit.forcing_phase)
    osc = oscillator(p.damping_ratio, 1.0, 1.0, forcing)
    phase = phase_at(forcing, 0.0, 0.0)
    moving = ShiftedOscillator(
        osc, motion_from(osc, orbit.displacement, orbit.velocity_after, phase), 0.0
    )
    half = math.pi / p.frequency_ratio
    return float(highest(moving, moment_at(moving, 0.0), moment_at(moving, half), 0.0))


def _orbit(p: Parameters, speed: float, sine_cosine: np.ndarray) -> Orbit:
    before, after = _speeds(p)
    return Orbit(
        p,
        float(speed),
        float(0.5 * math.pi * speed / p.frequency_ratio - p.clearance),
        float(before * speed),
        float(after * speed),
        float(math.atan2(*sine_cosine) % math.tau),
    )


def _half_period_map(orbit: Orbit) -> np.ndarray:
    """Derivative of the half-period map in (x, x', g, g'), g the gap to the wall last touched."""
    p = orbit.parameters
    mu, r = p.mass_ratio, p.restitution
    half = math.pi / p.frequency_ratio
    flow = np.eye(4)
    flow[:2, :2] = _flow(p.damping_ratio, p.frequency_ratio, half)[:, :2]
    # g'' = x'': the gain of the primary's displacement beyond the straight line.
    flow[2] = [flow[0, 0] - 1.0, flow[0, 1] - half, 1.0, half]
    flow[3] = [flow[1, 0], flow[1, 1] - 1.0, 0.0, 1.0]
    # Seen from the other wall all four change their sign: x -> -x, g -> 2 d - g. So the impact is
    # the one on the right wall again.
    impact = np.eye(4)
    impact[1, 3] = -mu * (1.0 + r) / (1.0 + mu)
    impact[3, 3] = -r
    before, after = orbit.velocity_before, orbit.velocity_after
    rest = math.sin(orbit.forcing_phase) - orbit.displacement
    a_before = rest - 2.0 * p.damping_ratio * before
    a_after = rest - 2.0 * p.damping_ratio * after
    approach = orbit.approach_speed
    incoming = np.array([before, a_before, -approach, a_before])
    outgoing = np.array([after, a_after, r * approach, a_after])
    # A gap that is larger by dg closes dg / approach later.
    impact[:, 2] -= (outgoing - impact @ incoming) / approach
    return -impact @ flow


def _cross(a: np.ndarray, b: np.ndarray) -> float:
    return float(a[0] * b[1] - a[1] * b[0])
