"""Response of the primary: its rms and peak displacement, and where the energy goes.

Everything is exact to rounding over the recorded window; nothing is sampled. Segments that the
window's ends cut count with the part inside.

**Integrals** of x^2, v^2 and force times v are Gauss-Legendre sums over steps h of a segment. The
motion from a known state is an entire function: at complex time z it is at most (its present size
+ force |z|) exp(rate |z|), rate = max(omega, 2 beta + sqrt(kappa)), so that the integrands are of
exponential type K = 2 rate. The classical bound on the Bernstein ellipse of parameter
rho = 8 n / (K h) then gives an error of n nodes of

    (e K h / (8 n))^(2 n)

relative to the integrand's scale, up to a factor below ten. `_REACH` holds the K h at which that
is `_TOLERANCE`. With heavy damping the fast mode exp(-R tau) ends within 40 / R of the segment's
start, long before a segment ends. Steps h <= tau are enough while it lives,
max over tau of exp(-R tau) (e R tau / (8 n))^(2 n) = 4^(-2 n), and once it is dead only omega and
the slow mode count. A segment so costs a number of steps that does not grow with the damping.

**The peak** comes from the same nodes: between two of them, a time h apart, |x| is at most
max(|x0|, |x1|) + B h^2 / 8 with |x''| <= B. Nearly always that is no more than the peak so far.
Where it is more, `_climb` looks closer until it is certain.

**In the tail of a burst** the pair's centre follows the sticking flow and the bounces go on about
it (`damper.models.motion`). The integrals are taken along the centre: complete bounces add
O(w^3), w the rebound speed at the tail's start, which is what the tail itself neglects. A bounce
that an end of the window cuts adds O(w^2) to work, losses and stored energy and is accounted for;
so is the O(w^2) by which bounces carry the primary out, in the peak.

**A free mass that varies** gains and loses kinetic energy although nothing pushes it:
(1/2) mu'(t) u^2 per unit time, u its velocity, in every segment alike. That is the work of the
modulation, a term of the balance in its own right.
"""

import math
from importlib import import_module

import numpy as np

from damper.engine.compiled import by_model, compiled
from damper.engine.oscillator import (
    OVERDAMPED,
    Oscillator,
    acceleration,
    derivative_bounds,
    increments,
)
from damper.engine.search import tail_bounce, tail_duration
from damper.engine.segment import (
    CAUSE,
    COLUMNS,
    DURATION,
    FLIGHT,
    IMPACT,
    MODE,
    PERIOD,
    RATE,
    SIDE,
    SPEED,
    TAIL,
    TIME,
    V,
    X,
)
from damper.engine.steady import steady_amplitude
from damper.engine.trajectory import Trajectory
from damper.models import mass_ratio_at, motion
from damper.models.rigid import Rigid
from damper.observers.base import Observer, Window, since
from damper.parameters.variables import ENERGY, LENGTH, Variable

#: Totals of a lane: three integrals, the energy lost in impacts, the largest |x| so far, the
#: stored energy at the window's start, whether the window has begun, the modulation's work, the
#: loss in a support of the free mass.
SQUARE, SPEED_SQUARE, WORK, LOSS, PEAK, STORED, BEGUN, MODULATION, SUPPORT = range(9)

#: Error of one Gauss sum relative to the scale of its integrand.
_TOLERANCE = 1e-17
_FEWEST, _MOST = 3, 20
#: K h up to which a rule of n nodes holds, n = _FEWEST to _MOST.
_REACH = np.array([8.0 * n / math.e * _TOLERANCE ** (0.5 / n) for n in range(_FEWEST, _MOST + 1)])
_LONGEST = float(_REACH[-1])


def gauss_rule(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre nodes and weights on [0, 1], both to full relative precision.

    NumPy's are good to rounding of the interval. A mode that decays within the step meets only
    the first nodes, where that leaves 1e-14. Here Newton's iteration is done in the distance t
    from the end, on P_n(1 - 2 t), whose recurrence is taken in differences of P_k.

    Parameters
    ----------
    n : int
        Number of nodes, >= 2.

    Returns
    -------
    nodes, weights : ndarray (n,)
    """
    t = 0.5 + 0.5 * np.polynomial.legendre.leggauss(n)[0][: (n + 1) // 2]
    for _ in range(2):
        value = 1.0 - 2.0 * t
        difference = -2.0 * t
        for k in range(1, n):
            difference = (k * difference - 2.0 * (2 * k + 1) * t * value) / (k + 1)
            value = value + difference
        slope = n * (2.0 * t * value - difference)  # (1 - z^2) P_n'(z) at z = 1 - 2 t
        weights = 4.0 * t * (1.0 - t) / (slope * slope)
        t = t + 2.0 * t * (1.0 - t) * value / slope
    half = n // 2
    return np.append(t, 1.0 - t[:half][::-1]), np.append(weights, weights[:half][::-1])


#: Nodes and weights on [0, 1], one row per rule.
NODES = np.zeros((len(_REACH), _MOST))
WEIGHTS = np.zeros((len(_REACH), _MOST))
for _row, _n in enumerate(range(_FEWEST, _MOST + 1)):
    NODES[_row, :_n], WEIGHTS[_row, :_n] = gauss_rule(_n)
#: A mode that has decayed by exp(-_DEAD) is below rounding.
_DEAD = 40.0
#: Relative rounding of a displacement.
ROUNDING = 2.220446049250313e-16
#: Newton steps for an extremum; even bisection alone gets to rounding in fewer.
MAX_ITERATIONS = 60


#: Model -> module that implements the declarations below for it, loaded with the first such lane.
#: Where it has a function `prepare`, that makes of the model what its `add_part` needs beside it.
_MODULES = {
    "Compliant": "damper.models.compliant.response",
    "Grounded": "damper.models.grounded.response",
    "TimeVarying": "damper.models.time_varying.response",
}

_MODULATION_WORK = Variable(
    "modulation_work",
    "energy that the free mass gains by its variation per forcing period",
    ENERGY,
    comment="mean of half the mass ratio's rate of change times the free velocity squared",
)


class Response(Observer):
    """Exact rms and peak displacement of the primary, and its energy balance.

    The steady linear response without the damper has the amplitude
    A = 1 / sqrt((1 - omega^2)^2 + (2 zeta omega)^2); the two ratios compare with it and are zero
    where it is infinite. Energies are means per forcing period, in units of F0^2/K. An impact of
    approach speed s loses (1/2) mu / (1 + mu) (1 - r^2) s^2; one at exactly the start of the
    record counts. The stored energy, of which the residual takes the change, is
    (1/2) (v^2 + x^2 + mu u^2). A free mass that varies takes mu at the moment, and the residual
    counts the work of its modulation as input.

    Parameters
    ----------
    modulation_work : bool, default False
        Write that work as well; it is zero in every other model.

    Where walls give, an impact's loss is that of the contact's dashpot, lasting contacts included,
    and the energy in the contact's spring is stored energy.

    Everything stays missing where the run stopped early.
    """

    variables = (
        Variable("rms_displacement", "root mean square of the primary displacement", LENGTH),
        Variable("peak_displacement", "largest primary displacement, either way", LENGTH),
        Variable(
            "amplitude_ratio",
            "peak displacement over the steady amplitude without damper",
            "1",
            comment="0 where that amplitude is infinite",
        ),
        Variable(
            "rms_ratio",
            "rms displacement over that of the steady response without damper",
            "1",
            comment="0 where that response is infinite",
        ),
        Variable("energy_input", "work of the force per forcing period", ENERGY),
        Variable("dashpot_loss", "energy lost in the dashpot per forcing period", ENERGY),
        Variable(
            "impact_loss",
            "energy lost in impacts per forcing period",
            ENERGY,
            comment="all impacts, those of closed bursts included",
        ),
        Variable(
            "energy_residual",
            "input less losses and change of the stored energy, per forcing period",
            ENERGY,
            comment="zero in exact arithmetic: shows how well the balance closes",
        ),
    )

    def __init__(self, modulation_work: bool = False) -> None:
        self.modulation_work = modulation_work
        if modulation_work:
            self.variables = (*type(self).variables, _MODULATION_WORK)

    def begin(self, lane: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a lane."""
        super().begin(lane, trajectory, window)
        self._more: tuple = ()
        if (name := _MODULES.get(type(self._model).__name__)) is not None:
            module = import_module(name)
            if hasattr(module, "prepare"):
                self._more = module.prepare(self._model)
        self._totals = np.zeros(9)
        self._last = np.zeros(COLUMNS)

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        _follow(self._model, self._more, log, *self._window, self._totals, self._last)

    def finish(self, finished: bool) -> None:
        """Write the lane's results."""
        if not finished:
            return
        free = self._model.free
        length = self._window.length
        record = length * self._model.period
        square, speed_square, work, loss, peak, stored, _, modulation, support = self._totals
        dashpot = 2.0 * free[0] * speed_square + support
        left = -since(
            self._last, self._model.period, self._window.period + length, self._window.time
        )
        end = stored_energy(self._model, self._last, min(self._last[DURATION], left))
        rms = math.sqrt(square / record)
        amplitude = steady_amplitude(free[0], free[3])
        self._put(
            {
                "rms_displacement": rms,
                "peak_displacement": peak,
                "amplitude_ratio": peak / amplitude,
                "rms_ratio": math.sqrt(2.0) * rms / amplitude,
                "energy_input": work / length,
                "dashpot_loss": dashpot / length,
                "impact_loss": loss / length,
                "energy_residual": (work - dashpot - loss - (end - stored - modulation)) / length,
            }
        )
        if self.modulation_work:
            self._put({"modulation_work": modulation / length})


@compiled
def _follow(model, more, log, periods, time, length, totals, last):
    period = model.period
    inside = -1
    for index in range(len(log)):
        row = log[index]
        since_start = since(row, period, periods, time)
        # The part of the segment in the window, from the segment's start.
        low = max(-since_start, 0.0)
        high = min(float(row[DURATION]), -since(row, period, periods + length, time))
        if high < low:
            continue
        inside = index
        lost = 0.0
        if row[CAUSE] == IMPACT and since_start >= 0.0:
            lost = impact_loss(model, row)
        if since_start < 0.0 or totals[BEGUN] == 0.0:
            # With an impact at exactly the window's start, the energy just before it.
            totals[BEGUN] = 1.0
            totals[STORED] = stored_energy(model, row, low) + lost
        totals[LOSS] += lost

        add_part(model, more, row, low, high, totals)
    if inside >= 0:
        last[:] = log[inside]


@by_model
def add_part(
    model: tuple, more: tuple, row: np.ndarray, low: float, high: float, totals: np.ndarray
) -> None:
    """Add what a segment has on [low, high] after its start to the totals of a lane."""


@by_model
def impact_loss(model: tuple, row: np.ndarray) -> float:
    """Energy lost in the impact with which a segment starts."""
    restitution = model.restitution
    mass_ratio = mass_ratio_at(model, float(row[PERIOD]), float(row[TIME]))
    reduced = mass_ratio / (1.0 + mass_ratio)
    approach = float(row[SPEED])
    return 0.5 * reduced * (1.0 - restitution) * (1.0 + restitution) * approach * approach


@by_model
def stored_energy(model: tuple, row: np.ndarray, tau: float) -> float:
    """Energy stored a time `tau` after a segment's start, in masses and springs."""
    return primary_and_masses(model, row, tau)


@add_part.of(Rigid)
def _add_part(model, more, row, low, high, totals):
    free = model.free
    stuck = model.stuck
    mass_ratio = model.mass_ratio
    flies = row[MODE] == FLIGHT
    x = float(row[X])
    v = float(row[V])
    if not flies:
        # The common velocity of both masses; in sticking the rate is zero.
        v -= float(row[SIDE]) * (mass_ratio / (1.0 + mass_ratio)) * float(row[RATE])
    osc = free if flies else stuck
    angle = free[3] * float(row[TIME]) + model.phase
    sin = math.sin(angle)
    cos = math.cos(angle)
    a, j = acceleration(osc, x, v, sin, cos)
    start = (x, v, a, j, sin, cos)
    if row[MODE] == TAIL and row[RATE] > 0.0:
        a, j = acceleration(free, x, float(row[V]), sin, cos)
        duration, _ = tail_duration(
            free, mass_ratio, model.restitution, float(row[SIDE]), a, j, sin, float(row[RATE])
        )
        add_bounces(
            model.restitution, mass_ratio, stuck, row, start, 0.0, duration, low, high, totals
        )
    add_oscillation(osc, start, 0.0, low, high, row[MODE] != TAIL, totals)


@compiled
def primary_and_masses(model: tuple, row: np.ndarray, tau: float) -> float:
    """Energy of the primary's spring and of both masses a time `tau` after a segment's start."""
    free = model.free
    mass_ratio = mass_ratio_at(model, float(row[PERIOD]), float(row[TIME]) + tau)
    side = float(row[SIDE])
    x, v, gap, rate = motion(model, row, tau)
    u = v - side * rate
    energy = 0.5 * (v * v + x * x + mass_ratio * u * u)
    if row[MODE] == TAIL:
        # What the dashpot has taken from the centre in the bounce under way; motion leaves it out.
        energy -= 2.0 * free[0] * v * side * mass_ratio / (1.0 + mass_ratio) * gap
    return energy


@compiled
def _at(osc, start, tau):
    """x, v and the phase's sine and cosine a time `tau` after a segment's start.

    `start` holds x, its first three derivatives, and the phase's sine and cosine there.
    """
    x, v, a, j, sin, cos = start
    dx, dv, sin, cos = increments(osc, x, v, a, j, sin, cos, tau)
    return x + (v * tau + dx), v + dv, sin, cos


@compiled
def add_oscillation(
    osc: Oscillator,
    start: tuple,
    shift: float,
    low: float,
    high: float,
    watch: bool,
    totals: np.ndarray,
) -> None:
    """Add the integrals over [low, high] of an oscillator's motion; watch for the peak.

    `start` holds the oscillator's displacement, its first three derivatives, and the phase's sine
    and cosine. The displacement exceeds the primary's by `shift`.
    """
    _, _, force, omega, regime, _, slow, fast, _, _, rate, _ = osc
    brief = 0.5 * _LONGEST / rate
    calm = 0.5 * _LONGEST / max(omega, -slow)
    square = 0.0
    speed_square = 0.0
    work = 0.0
    peak = float(totals[PEAK])
    # Nothing is above an infinite peak.
    watch = watch and peak < math.inf
    x, v, _, _, sin, cos = start
    if low > 0.0:
        x, v, sin, cos = _at(osc, start, low)
    if watch:
        peak = max(peak, abs(x - shift))
    tau = low
    while tau < high:
        whole = brief
        if regime == OVERDAMPED:
            whole = calm if -fast * tau > _DEAD else min(max(brief, tau), calm)
        step = min(whole, high - tau)
        end = high if step < whole else min(tau + step, high)
        rule = 0
        while _REACH[rule] < _LONGEST * (step / whole):
            rule += 1
        bound2 = 0.0
        if watch:
            a, j = acceleration(osc, x, v, sin, cos)
            bound2, _ = derivative_bounds(osc, force, x, v, a, j, step)
        square_sum = 0.0
        speed_sum = 0.0
        work_sum = 0.0
        before = tau
        nodes = rule + _FEWEST
        # After the last node the end of the step, for the peak and as the next start.
        last = nodes if watch or end < high else nodes - 1
        for k in range(last + 1):
            t = tau + step * float(NODES[rule, k]) if k < nodes else end
            x2, v2, sin2, cos2 = _at(osc, start, t)
            if k < nodes:
                weight = float(WEIGHTS[rule, k])
                square_sum += weight * (x2 - shift) * (x2 - shift)
                speed_sum += weight * v2 * v2
                work_sum += weight * sin2 * v2
            if watch:
                h = t - before
                peak = max(peak, abs(x2 - shift))
                if max(abs(x - shift), abs(x2 - shift)) + 0.125 * bound2 * h * h > peak:
                    peak = _climb(osc, start, shift, before, x, v, sin, cos, t, x2, v2, peak)
            before = t
            x = x2
            v = v2
            sin = sin2
            cos = cos2
        square += step * square_sum
        speed_square += step * speed_sum
        work += step * work_sum
        tau = end
    totals[SQUARE] += square
    totals[SPEED_SQUARE] += speed_square
    totals[WORK] += work
    totals[PEAK] = peak


@compiled
def _climb(osc, start, shift, tau, x, v, sin, cos, end, x_end, v_end, peak):
    """Largest of `peak` and |x| on [tau, end] of a segment, for sure and to rounding.

    The state is known at both ends, and `peak` is at least |x| there. With B a bound on the
    second derivative and J on the third over a step h, the step is settled if

    - |x| <= max(|x0|, |x1|) + B h^2 / 8 is no more than the peak (or more by rounding only);
    - v, which is within J h^2 / 8 of its chord, cannot vanish: |x| is largest at an end;
    - v changes sign and v' does not, |a0| > J h: it has one zero, which is found.

    Otherwise it is halved.
    """
    step = end - tau
    while tau < end and tau + step > tau:
        reached = tau + step >= end
        if reached:
            step = end - tau
            x2 = x_end
            v2 = v_end
            sin2 = sin
            cos2 = cos
        else:
            x2, v2, sin2, cos2 = _at(osc, start, tau + step)
            peak = max(peak, abs(x2 - shift))
        a, j = acceleration(osc, x, v, sin, cos)
        bound2, bound3 = derivative_bounds(osc, osc[2], x, v, a, j, step)
        eighth = 0.125 * step * step
        if max(abs(x - shift), abs(x2 - shift)) + bound2 * eighth > peak * (1.0 + ROUNDING):
            same_sign = (v > 0.0 and v2 > 0.0) or (v < 0.0 and v2 < 0.0)
            if not same_sign and abs(a) > bound3 * step:
                peak = max(peak, _turn(osc, start, shift, tau, tau + step, v, a))
            elif not (same_sign and min(abs(v), abs(v2)) > bound3 * eighth):
                step *= 0.5
                continue
        if reached:
            break
        tau += step
        x = x2
        v = v2
        sin = sin2
        cos = cos2
        step *= 2.0
    return peak


@compiled
def _turn(osc, start, shift, low, high, v, a):
    """|x| where the velocity vanishes on [low, high], once and with v' of one sign.

    Newton's iteration from the state (v, a) at `low`, kept in the bracket. It ends where
    v^2 / |2 a|, the distance in x to the extremum, is below rounding.
    """
    rising = v > 0.0
    t = low - v / a
    x = 0.0
    for _ in range(MAX_ITERATIONS):
        if not low < t < high:
            t = 0.5 * (low + high)
        x, v, sin, cos = _at(osc, start, t)
        a, _ = acceleration(osc, x, v, sin, cos)
        if v * v <= ROUNDING * abs((x - shift) * a) or a == 0.0:
            break
        if (v > 0.0) == rising:
            low = t
        else:
            high = t
        t -= v / a
    return abs(x - shift)


@compiled
def add_bounces(
    restitution: float,
    mass_ratio: float,
    stuck: Oscillator,
    row: np.ndarray,
    start: tuple,
    shift: float,
    duration: float,
    low: float,
    high: float,
    totals: np.ndarray,
) -> None:
    """Add what the bounces of a closed tail lose on [low, high], and how far they carry x.

    `start` is that of the pair's centre, which follows `stuck`, and `shift` as for
    `add_oscillation`.
    """
    side = float(row[SIDE])
    rate = float(row[RATE])
    share = mass_ratio / (1.0 + mass_ratio)
    # Bounce speed over bounce time, the same for all of them.
    slope = rate / (duration * (1.0 - restitution))
    for k in range(2):
        tau = high if k == 1 else low
        sign = 1.0 if k == 1 else -1.0
        gap, bounce = tail_bounce(restitution, duration, rate, tau)
        # Until it ends, a bounce holds the square of its speed: bounce^2 + 4 slope gap.
        totals[LOSS] -= sign * 0.5 * share * (bounce * bounce + 4.0 * slope * gap)
        # The bounce under way has carried the primary this far from the centre.
        carried = side * share * gap
        _, v, sin, _ = _at(stuck, start, tau)
        totals[WORK] += sign * sin * carried
        totals[SPEED_SQUARE] += sign * 2.0 * v * carried
    totals[PEAK] = _tail_peak(
        stuck,
        start,
        shift,
        side * share,
        restitution,
        rate,
        duration,
        low,
        high,
        float(totals[PEAK]),
    )


@compiled
def _tail_peak(osc, start, shift, share, restitution, rate, duration, low, high, peak):
    """Largest of `peak` and |x| on [low, high] of a closed tail, to the tail's own accuracy.

    x is the centre, which follows `osc`, plus `share` times the gap. On one bounce both are
    parabolas up to O(w^3), so each bounce gives its ends and its vertex. Bounces too low to be
    seen are left out: the rest is the centre alone.
    """
    x, v, a, j, sin, cos = start
    bound2, _ = derivative_bounds(osc, osc[2], x, v, a, j, high)
    height = 0.25 * abs(share) * rate * duration * (1.0 - restitution)
    if abs(x - shift) + high * (abs(v) + 0.5 * bound2 * high) + height <= peak:
        return peak
    begin = 0.0
    speed = rate
    length = duration * (1.0 - restitution)
    while begin < high and height > ROUNDING * max(peak, abs(x - shift)):
        first = max((low - begin) / length, 0.0)
        last = min((high - begin) / length, 1.0)
        if first <= last:
            x, v, sin, cos = _at(osc, start, begin)
            a, _ = acceleration(osc, x, v, sin, cos)
            # x + length * p * (v_first + p * change / 2), p from 0 to 1 along the bounce.
            v_first = v + share * speed
            change = a * length - 2.0 * share * speed
            vertex = -v_first / change if change != 0.0 else first
            for p in (first, min(max(vertex, first), last), last):
                carried = length * p * (v_first + 0.5 * p * change)
                peak = max(peak, abs((x - shift) + carried))
        begin += length
        speed *= restitution
        length *= restitution
        height *= restitution * restitution
    begin = max(begin, low)
    if begin < high:
        x, v, sin, cos = _at(osc, start, begin)
        x_end, v_end, _, _ = _at(osc, start, high)
        peak = max(peak, abs(x - shift), abs(x_end - shift))
        peak = _climb(osc, start, shift, begin, x, v, sin, cos, high, x_end, v_end, peak)
    return peak
