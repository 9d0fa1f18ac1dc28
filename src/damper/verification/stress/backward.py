"""Backward error of a run: does each segment obey the equations, from where it starts?

A chaotic run cannot be compared with another one for long. But its log holds the start of each
segment as exact doubles, so each can be computed again by itself, in more digits and by formulas of
its own: flight and sticking as divided differences of the exponential, impacts by Newton's and the
momentum law. What is left over, relative to the sizes of the terms that were added, is a change of
the problem that would make the run exact; some units of roundoff mean that the method is sound.

Rigid model only.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import mpmath
import numpy as np

from damper.engine.segment import (
    CAUSE,
    COMPLETION,
    DURATION,
    FLIGHT,
    GAP,
    IMPACT,
    MODE,
    PERIODS,
    RATE,
    RELEASE,
    SIDE,
    SPEED,
    TAIL,
    TIME,
    V,
    X,
)
from damper.parameters import Parameters
from damper.verification.stress.verdicts import CHECKS

#: Whether `numpy.longdouble` has digits to spare. Where it has not, mpmath steps in (and is slow).
LONG = bool(np.finfo(np.longdouble).eps < 1e-18)
#: Digits of mpmath.
DIGITS = 40
#: Instants of each segment at which gap or contact force is looked at, besides its smallest value.
SAMPLES = 8
#: Terms of the series where they go furthest, and what they leave over then.
_TERMS = 26
_REMAINDER = 1.0 / math.factorial(_TERMS - 1)
_NEWTON = 8
_SMALL_STEP = 1e-15
_EPS = 2.0**-52


class Oscillators(NamedTuple):
    """x'' + 2 beta x' + kappa x = force sin(theta + omega tau), one entry for each segment."""

    beta: Any
    kappa: Any
    force: Any
    omega: Any

    def of(self, segments: np.ndarray) -> "Oscillators":
        """Those of some segments."""
        beta, kappa, force = (value[segments] for value in self[:3])
        return Oscillators(beta, kappa, force, self.omega)


class Motions(NamedTuple):
    """Motions of the primary a time tau after a segment's start."""

    bend: Any
    """x - x0 - v0 tau."""
    dv: Any
    """v - v0."""
    a: Any
    """x'' then."""


def backward_error(parameters: Parameters, log: np.ndarray, digits: int | None = None) -> dict:
    """Largest residuals of a run, by kind.

    Parameters
    ----------
    parameters : Parameters
        Of a rigid damper.
    log : ndarray (segments, COLUMNS)
        Successive segments, as `damper.engine.trajectory.Trajectory.segments` yields them at
        its default accuracy.
    digits : int, optional
        Use mpmath with as many digits instead of `numpy.longdouble`.

    Returns
    -------
    dict of str to float
        Each of `CHECKS` in units of roundoff (2^-52), ``displacement`` too, and ``closing``: error
        of the accumulation time in units of time, by resolving one more bounce. nan if anything is
        not a number.
    """
    found = residuals(parameters, log, digits)
    return {name: float(np.max(values, initial=0.0)) for name, values in found.items()}


def residuals(parameters: Parameters, log: np.ndarray, digits: int | None = None) -> dict:
    """Residuals of each segment of a run, and of the event that ends it; see `backward_error`.

    Returns
    -------
    dict of str to ndarray (segments,)
        - ``clock``: duration against the next start, relative to a forcing period;
        - ``motion``: displacement and velocity (and gap and its rate in a flight that is cut)
          against the next start, over the terms that are added;
        - ``displacement``: the same of the displacement alone, over where and how far it goes;
        - ``contact``: gap at an impact, and approach speed;
        - ``law``: momentum and restitution;
        - ``release``: contact force at a release, over the forces;
        - ``inside``: how far the segment enters a wall, or needs a tensile contact force;
        - ``tail``: duration of a closed tail against the second-order formula;
        - ``closing``: error of that formula, in units of time.

        Zero where a check does not apply.

    Raises
    ------
    ValueError
        For another model than the rigid one.
    """
    if parameters.model != "rigid":
        raise ValueError(f"backward error of the {parameters.model} model is not implemented")
    if digits is None and LONG:
        return _residuals(parameters, log, _LongDouble)
    with mpmath.workdps(digits or DIGITS):
        return _residuals(parameters, log, _Multiprecision)


def _residuals(p: Parameters, log: np.ndarray, numbers: "type[_Numbers]") -> dict:
    segments = _Segments(p, log, numbers)
    found = {name: np.zeros(len(log)) for name in (*CHECKS, "displacement", "closing")}
    found["inside"] = segments.inside()
    tails = np.flatnonzero((log[:, MODE] == TAIL) & (log[:, RATE] > 0.0))
    if len(tails):
        found["tail"][tails], found["closing"][tails] = segments.tails(tails)
    if len(log) > 1:
        found.update({name: np.append(v, 0.0) for name, v in segments.ends().items()})
    return {name: values if name == "closing" else values / _EPS for name, values in found.items()}


class _Segments:
    """All segments of one run in more digits."""

    def __init__(self, p: Parameters, log: np.ndarray, numbers: "type[_Numbers]") -> None:
        self.p, self.log, self.numbers = p, log, numbers
        exact = numbers.exact
        self.flies = log[:, MODE] == FLIGHT
        heavier = np.where(self.flies, exact(1.0), exact(1.0) + exact(p.mass_ratio))
        one = exact(1.0)
        self.osc = Oscillators(
            exact(p.damping_ratio) / heavier, one / heavier, one / heavier, exact(p.frequency_ratio)
        )
        self.x, self.v, self.gap, self.rate = (exact(log[:, c]) for c in (X, V, GAP, RATE))
        self.side = log[:, SIDE]
        self.share = exact(p.mass_ratio) / (one + exact(p.mass_ratio))
        # In a tail the pair moves with its common velocity.
        self.start = np.where(
            log[:, MODE] == TAIL, self.v - self.side * self.share * self.rate, self.v
        )
        self.theta = numbers.phase(p.phase) + exact(p.frequency_ratio) * exact(log[:, TIME])
        self.width = 2.0 * p.clearance
        self.from_x, self.from_v = self.x.copy(), self.start.copy()
        self._release_exactly()

    def _release_exactly(self) -> None:
        """Put each start after a release where x'' is zero, by the least change of x and v.

        That is what a release means; the roundoff of the stored state, multiplied by the damping,
        is the residual of the release itself.
        """
        of = np.flatnonzero(self.log[:, CAUSE] == RELEASE)
        if not len(of):
            return
        twice = 2 * self.numbers.exact(self.p.damping_ratio)
        sin, _ = self.numbers.sin_cos(self.theta[of])
        left = (sin - twice * self.start[of] - self.x[of]) / (1 + twice * twice)
        self.from_x[of] = self.x[of] + left
        self.from_v[of] = self.start[of] + twice * left

    def motion(self, tau: Any, of: np.ndarray) -> Motions:
        """Motions of some segments, each at its own time."""
        osc = self.osc.of(of)
        return self.numbers.motion(osc, self.from_x[of], self.from_v[of], self.theta[of], tau)

    def sizes(self, of: np.ndarray, tau: Any, move: Motions) -> tuple[np.ndarray, ...]:
        """Sizes of the terms of displacement, velocity, relative displacement and velocity."""
        x, v = _double(self.x[of]), _double(self.start[of])
        tau = _double(tau)
        x1 = x + _double(move.bend + self.start[of] * tau)
        v1 = v + _double(move.dv)
        slow = np.maximum(np.abs(v), np.abs(v1))
        far = np.maximum(np.abs(x), np.abs(x1))
        damped = 2.0 * self.p.damping_ratio + 1.0
        # What forcing and spring add until they change or the damping holds them, and the damping.
        driven = np.minimum(tau, 1.0 / (damped + self.p.frequency_ratio))
        driven = driven + far * np.minimum(tau, 1.0 / damped)
        moved = np.minimum(0.5 * driven * tau, 1.0 + far)
        position = np.abs(x) + np.abs(x1) + slow * np.minimum(tau, 1.0 / damped) + moved
        velocity = np.abs(v) + np.abs(v1) + driven
        near = _double(self.gap[of]) + np.abs(_double(self.rate[of])) * tau
        near = near + moved + slow * tau * np.minimum(self.p.damping_ratio * tau, 1.0)
        force = 1.0 + 2.0 * self.p.damping_ratio * slow + far
        rate = np.abs(_double(self.rate[of])) + np.minimum(force * tau, velocity)
        return position, velocity, near, rate, force

    def ends(self) -> dict:
        """Residuals of the ends of all segments but the last one."""
        p, log = self.p, self.log
        exact = self.numbers.exact
        of = np.arange(len(log) - 1)
        rows, after = log[:-1], log[1:]
        tau = exact(rows[:, DURATION])
        move = self.motion(tau, of)
        position, velocity, near, speed, force = self.sizes(of, tau, move)
        x1 = self.x[of] + (self.start[of] * tau + move.bend)
        v1 = self.start[of] + move.dv
        side = self.side[of]
        gap1 = self.gap[of] + (self.rate[of] * tau + side * move.bend)
        rate1 = self.rate[of] + side * move.dv
        hits = self.flies[of] & (after[:, CAUSE] == IMPACT)
        cut = self.flies[of] & ~hits
        wall = after[:, SIDE]
        approach = exact(after[:, SPEED])
        restitution = self._restitution(approach)
        kick = np.where(hits, wall * self.share * (exact(1.0) + restitution) * approach, exact(0.0))

        elapsed = (exact(after[:, PERIODS]) - exact(rows[:, PERIODS])) * exact(p.period)
        elapsed = elapsed + (exact(after[:, TIME]) - exact(rows[:, TIME]))
        clock = _double(abs(elapsed - tau)) / p.period
        moved = _double(abs(self.x[of + 1] - x1))
        # The engine adds v0 tau and the rest; where damping is heavy the two all but cancel.
        off = moved / _sure(position + _double(abs(self.start[of] * tau)))
        # The impact's change of velocity is a term of its own, and may cancel the rest.
        lost = _double(abs(self.v[of + 1] - (v1 + kick))) / _sure(velocity + np.abs(_double(kick)))
        off = np.maximum(off, np.where(hits, 0.0, lost))
        free = np.maximum(
            _double(abs(self.gap[of + 1] - gap1)) / _sure(near),
            _double(abs(self.rate[of + 1] - rate1)) / _sure(speed),
        )
        off = np.maximum(off, np.where(cut, free, 0.0))
        # At the wall from which it came the gap itself vanishes, at the other one what is left.
        across = hits & (wall != side)
        left = np.where(across, exact(self.width) - gap1, gap1)
        contact = _double(abs(left)) / _sure(near + np.where(across, self.width, 0.0))
        falls = np.where(across, rate1, -rate1)
        contact = np.maximum(contact, _double(abs(approach - falls)) / _sure(speed))
        bounce = _double(abs(self.rate[of + 1] - restitution * approach))
        law = bounce / _sure(_double(approach))
        freed = after[:, CAUSE] == RELEASE
        left_over = _double(abs(move.a)) / (force / (1.0 + p.mass_ratio))
        return {
            "clock": clock,
            "motion": off,
            "displacement": moved / _sure(position),
            "contact": np.where(hits, contact, 0.0),
            "law": np.where(hits, np.maximum(law, lost), 0.0),
            "release": np.where(freed, left_over, 0.0),
        }

    def _restitution(self, approach: Any) -> Any:
        """Coefficient of restitution at some approach speeds."""
        exact = self.numbers.exact
        r = exact(self.p.restitution)
        if self.p.yield_speed == math.inf:
            return r
        yields = exact(self.p.yield_speed)
        return r * (yields / np.maximum(approach, yields)) ** exact(0.25)

    def inside(self) -> np.ndarray:
        """How far each segment enters a wall, over its gap's terms, or needs a tensile force."""
        part = np.sin(np.pi * (np.arange(SAMPLES) + 0.5) / (2.0 * SAMPLES)) ** 2
        of = np.flatnonzero(self.log[:, DURATION] > 0.0)
        of = of[self.log[of, MODE] != TAIL]
        worst = np.zeros(len(self.log))
        if not len(of):
            return worst
        tau = self.log[of, DURATION][:, None] * part
        many = np.repeat(of, SAMPLES)
        value, slope = (a.reshape(tau.shape) for a in self._room(many, tau.ravel()))
        worst[of] = np.max(-value, axis=1)
        # The smallest value lies where the slope turns; once more there.
        turns = (slope[:, :-1] < 0.0) & (slope[:, 1:] > 0.0)
        rows, columns = np.nonzero(turns)
        if len(rows):
            fall, rise = -slope[rows, columns], slope[rows, columns + 1]
            left, right = tau[rows, columns], tau[rows, columns + 1]
            low, _ = self._room(of[rows], left + (right - left) * fall / (fall + rise))
            np.maximum.at(worst, of[rows], -low)
        return np.maximum(worst, 0.0)

    def _room(self, of: np.ndarray, tau: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance from the nearer wall over the gap's terms, or contact force over the forces."""
        time = self.numbers.exact(tau)
        move = self.motion(time, of)
        _, _, near, _, force = self.sizes(of, time, move)
        side = self.side[of]
        gap = self.gap[of] + (self.rate[of] * time + side * move.bend)
        rate = _double(self.rate[of] + side * move.dv)
        rest = _double(self.numbers.exact(self.width) - gap)
        gap = _double(gap)
        far = rest < gap
        room = np.where(far, rest / _sure(near + self.width), gap / _sure(near))
        wall_force = -side * _double(move.a) / (force / (1.0 + self.p.mass_ratio))
        flies = self.flies[of]
        slope = np.where(flies, np.where(far, -rate, rate), 0.0)
        return np.where(flies, room, wall_force), slope

    def tails(self, of: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Durations of tails against the formula, and its error by resolving a bounce."""
        p, exact = self.p, self.numbers.exact
        r = exact(p.restitution)
        one = exact(1.0)
        side = self.side[of]
        flight = Oscillators(
            exact(p.damping_ratio) + 0 * self.x[of],
            one + 0 * self.x[of],
            one + 0 * self.x[of],
            self.osc.omega,
        )
        x, v, w, theta = self.x[of], self.v[of], self.rate[of], self.theta[of]
        whole = self._remaining(side, x, v, w, theta)
        force = 1.0 + 2.0 * p.damping_ratio * np.abs(_double(v)) + np.abs(_double(x))
        start_force, _ = self._force_and_jerk(side, x, v, theta)
        duration = self.log[of, COMPLETION]
        tail = _double(abs(whole - exact(duration))) / (duration * force / _double(start_force))
        tau = exact(2.0) * w / start_force
        for _ in range(_NEWTON):
            move = self.numbers.motion(flight, x, v, theta, tau)
            # Over tau, so that the start itself is no root.
            height = w + side * move.bend / tau
            step = height / ((side * move.dv - side * move.bend / tau) / tau)
            tau = tau - step
            # The next step would be the square of this one.
            if (abs(step) <= _SMALL_STEP * abs(tau)).all():
                break
        move = self.numbers.motion(flight, x, v, theta, tau)
        approach = -(w + side * move.dv)
        v1 = v + move.dv + side * self.share * (one + r) * approach
        x1 = x + (v * tau + move.bend)
        rest = self._remaining(side, x1, v1, r * approach, theta + self.osc.omega * tau)
        closing = _double(abs(tau + rest - whole) / (one - r * r * r))
        return tail, closing

    def _force_and_jerk(self, side: np.ndarray, x: Any, v: Any, theta: Any) -> tuple[Any, Any]:
        """Return -g'' and g''' of the gap just after an impact."""
        sin, cos = self.numbers.sin_cos(theta)
        zeta = self.numbers.exact(self.p.damping_ratio)
        a = sin - 2 * zeta * v - x
        return -side * a, side * (self.osc.omega * cos - 2 * zeta * a - v)

    def _remaining(self, side: np.ndarray, x: Any, v: Any, w: Any, theta: Any) -> Any:
        """Time that is left of a complete sequence, to second order in the rebound speed w."""
        exact = self.numbers.exact
        zeta, r = exact(self.p.damping_ratio), exact(self.p.restitution)
        one = exact(1.0)
        force, jerk = self._force_and_jerk(side, x, v, theta)
        slow = force * (one - r)
        second = exact(4.0) / 3 * jerk / force - 4 * zeta * self.share * r
        return 2 * w / slow + second * w * w / (slow * slow)


def _double(values: Any) -> np.ndarray:
    return np.asarray(values, dtype=float)


def _sure(size: np.ndarray) -> np.ndarray:
    """Sizes to divide by; where all is zero nothing is left over either."""
    return np.where(size > 0.0, size, 1.0)


class _Numbers:
    """What numbers with more digits than a double must offer, elementwise over arrays."""

    exact: Callable[[Any], Any]
    """Convert doubles, exactly."""
    phase: Callable[[float], Any]
    """Reduce a forcing phase to one turn."""
    sin_cos: Callable[[Any], tuple[Any, Any]]
    motion: Callable[..., Motions]
    """Motions of oscillators from displacement, velocity and phase over a time."""


class _LongDouble(_Numbers):
    @staticmethod
    def exact(values: Any) -> Any:
        return np.asarray(values, dtype=np.longdouble)[()]

    @staticmethod
    def phase(value: float) -> Any:
        return np.longdouble(value)

    @staticmethod
    def sin_cos(theta: Any) -> tuple[Any, Any]:
        return np.sin(theta), np.cos(theta)

    @staticmethod
    def motion(osc: Oscillators, x0: Any, v0: Any, theta: Any, tau: Any) -> Motions:
        sin, cos = np.sin(theta), np.cos(theta)
        a0 = osc.force * sin - 2 * osc.beta * v0 - osc.kappa * x0
        j0 = osc.force * osc.omega * cos - 2 * osc.beta * a0 - osc.kappa * v0
        reach = np.maximum(osc.omega, 2 * osc.beta + np.sqrt(osc.kappa)) * tau
        soon = reach <= 1.0
        bend, dv = np.empty_like(tau), np.empty_like(tau)
        forms: tuple[tuple[np.ndarray, Callable], ...] = ((soon, _series), (~soon, _divided))
        for mask, form in forms:
            if mask.any():
                part = osc.of(mask)
                given = (value[mask] for value in (x0, v0, a0, j0, sin, cos, tau))
                bend[mask], dv[mask] = form(part, *given, float(reach[mask].max()))
        turned = theta + osc.omega * tau
        x1 = x0 + (v0 * tau + bend)
        a = osc.force * np.sin(turned) - 2 * osc.beta * (v0 + dv) - osc.kappa * x1
        return Motions(bend, dv, a)


def _terms(reach):
    """Terms of a series in powers of at most `reach` <= 1, as good as `_TERMS` are at 1."""
    left, terms = 1.0, 1
    while terms < _TERMS and left > _REMAINDER:
        left *= reach / terms
        terms += 1
    # Third derivatives may be all that there is.
    return max(terms, 4)


def _series(osc, x0, v0, a0, j0, sin, cos, tau, reach):
    """Taylor series of x - x0 - v0 tau and v - v0, for times short against all rates."""
    lower, upper = a0, j0
    drive = (-osc.force * osc.omega**2 * sin, -osc.force * osc.omega**3 * cos)
    power = tau
    dv = a0 * tau
    bend = a0 * tau * tau / 2
    for n in range(2, _terms(reach)):
        power = power * tau / n
        dv = dv + upper * power
        bend = bend + upper * power * tau / (n + 1)
        lower, upper = upper, drive[0] - 2 * osc.beta * upper - osc.kappa * lower
        drive = drive[1], -drive[0] * osc.omega**2
    return bend, dv


def _divided(osc, x0, v0, a0, j0, sin, cos, tau, reach):
    """Closed form by divided differences of exp at the two roots and i omega, all times tau.

    S = tau exp[z1, z2] and Q = tau^2 exp[z1, z2, z3] solve the equation from (0, 1), and forced by
    exp(i omega tau) from rest. No case is special: equal roots and resonance are close points.
    """
    root = np.sqrt(osc.kappa)
    square = (osc.beta - root) * (osc.beta + root)
    split = np.sqrt(np.abs(square))
    fast = np.where(square >= 0.0, -(osc.beta + split) + 0j, -osc.beta - 1j * split)
    slow = np.where(square >= 0.0, osc.kappa / fast, -osc.beta + 1j * split)
    z1, z2, z3 = slow * tau, fast * tau, 1j * osc.omega * tau
    s = tau * _exp2(z1, z2)
    q = tau * tau * _exp3(z1, z2, z3)
    q_dot = slow * q + tau * _exp2(z2, z3)
    turn = cos + 1j * sin
    c_less_1 = (np.expm1(z1) - slow * s).real
    s_dot_less_1 = (np.expm1(z2) + slow * s).real
    s = s.real
    bend = x0 * c_less_1 + v0 * (s - tau) + osc.force * (turn * q).imag
    dv = v0 * s_dot_less_1 - osc.kappa * s * x0 + osc.force * (turn * q_dot).imag
    return bend, dv


def _exp2(a, b):
    """First divided difference of the exponential."""
    swap = b.real > a.real
    a, b = np.where(swap, b, a), np.where(swap, a, b)
    width = b - a
    same = width == 0.0
    width = np.where(same, 1.0, width)
    return np.exp(a) * np.where(same, 1.0, np.expm1(width) / width)


def _exp3(a, b, c):
    """Second divided difference of the exponential."""
    a, b, c = np.broadcast_arrays(a, b, c)
    widths = np.abs(np.stack((a - b, b - c, c - a)))
    close = widths.max(axis=0) <= 1.0
    found = np.empty_like(a)
    # The widest pair goes outside, so the division multiplies no error.
    widest = widths.argmax(axis=0)
    for mask, form in ((close, _exp3_close), (~close, _exp3_wide)):
        if mask.any():
            found[mask] = form(a[mask], b[mask], c[mask], widest[mask])
    return found


def _exp3_close(a, b, c, widest):
    """Series: complete homogeneous symmetric polynomials of the distances from the mean."""
    mean = (a + b + c) / 3
    u, v, w = a - mean, b - mean, c - mean
    one = np.ones_like(mean)
    h1, h2, h3 = one, one, one
    total = one / 2
    factor = np.longdouble(2.0)
    for n in range(3, _TERMS):
        h1 = h1 * u
        h2 = h1 + v * h2
        h3 = h2 + w * h3
        factor = factor * n
        total = total + h3 / factor
    return np.exp(mean) * total


def _exp3_wide(a, b, c, widest):
    first = np.choose(widest, (a, b, c))
    last = np.choose(widest, (b, c, a))
    between = np.choose(widest, (c, a, b))
    return (_exp2(between, last) - _exp2(first, between)) / (last - first)


class _Multiprecision(_Numbers):
    exact = staticmethod(np.frompyfunc(mpmath.mpf, 1, 1))

    @staticmethod
    def phase(value: float) -> Any:
        return mpmath.mpf(value)

    @staticmethod
    def sin_cos(theta: Any) -> tuple[Any, Any]:
        return np.frompyfunc(mpmath.sin, 1, 1)(theta), np.frompyfunc(mpmath.cos, 1, 1)(theta)

    @staticmethod
    def motion(osc: Oscillators, x0: Any, v0: Any, theta: Any, tau: Any) -> Motions:
        found = np.frompyfunc(_by_exponential, 8, 3)(*osc, x0, v0, theta, tau)
        return Motions(*(np.atleast_1d(value) for value in found))


def _by_exponential(beta, kappa, force, omega, x0, v0, theta, tau):
    """One motion by the matrix exponential of the primary and its force together."""
    system = mpmath.matrix(
        [[0, 1, 0, 0], [-kappa, -2 * beta, force, 0], [0, 0, 0, omega], [0, 0, -omega, 0]]
    )
    start = mpmath.matrix([x0, v0, mpmath.sin(theta), mpmath.cos(theta)])
    # Its squarings lose as many digits as the fastest rate times tau has.
    with mpmath.extradps(20):
        x, v, sin, _ = mpmath.expm(system * tau) * start
        return x - x0 - v0 * tau, v - v0, force * sin - 2 * beta * v - kappa * x
