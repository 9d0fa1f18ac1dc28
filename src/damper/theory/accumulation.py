"""When and where a complete burst ends, from its state just after one impact.

With w the rebound speed, a = -g'' > 0 the push of the wall and j = g''' just after the impact
(g the gap), the infinitely many bounces that follow take

    T1 = 2 w / (a (1 - r))
    T2 = T1 + (4/3) j w^2 / (a^3 (1 - r)^2) - 4 zeta mu r w^2 / ((1 + mu) a^2 (1 - r)^2)

with errors O(w^2) and O(w^3). The pair's centre of mass moves as if the masses stuck already, up to
O(w^3): from x with the common velocity V = (x' + mu y') / (1 + mu). T1 is what Nordmark and
Piiroinen (2009) take: their 2 r v / (a (1 - r)), v = w / r. Derivation: docs/theory.md.
"""

import math
from typing import NamedTuple

from damper.engine.compiled import compiled
from damper.engine.oscillator import Oscillator, acceleration, advance, oscillator, sine_cosine
from damper.engine.search import accumulation_times, tail_duration
from damper.parameters import Parameters
from damper.parameters.quantities import check_quantity, real

#: Longest time, in units of sqrt(M/K), over which a prediction follows the sticking flow.
LONGEST = 1e6


class Prediction(NamedTuple):
    """What is left of a burst after one of its impacts; NaN where there is no prediction.

    Times in units of sqrt(M/K); the primary's displacements from that impact to completion, in
    units of F0/K. `error` estimates that of the second-order time, relative to the first-order
    one: the formulas hold where it is small, and it is infinite where they claim nothing.
    """

    first_order_time: float
    second_order_time: float
    first_order_displacement: float
    second_order_displacement: float
    error: float


def completion_times(
    rebound_speed: float,
    push: float,
    jerk: float,
    *,
    restitution: float,
    mass_ratio: float = 0.0,
    damping_ratio: float = 0.0,
) -> tuple[float, float]:
    """Time from an impact to the end of its burst, to first and to second order.

    Parameters
    ----------
    rebound_speed : float
        Rate w >= 0 of the gap just after the impact, in units of F0/sqrt(K M).
    push, jerk : float
        a = -g'' > 0 and j = g''' of the gap then, in units of F0/M and F0 sqrt(K)/M^(3/2).
    restitution : float
        r, 0 <= r < 1.
    mass_ratio, damping_ratio : float
        mu and zeta, >= 0. With either zero the impacts leave the wall's motion alone.

    Returns
    -------
    first, second : float
        T1 and T2 of the module's head, in units of sqrt(M/K). They hold for
        |j| w << a^2 (1 - r): T2 is wrong by more than it corrects elsewhere, and may be negative.

    Raises
    ------
    ValueError
        For push <= 0 or restitution = 1, where a burst need not complete, a negative rebound
        speed, and what is not finite or out of range; names value and range.
    TypeError
        When a value is not a real number.

    Examples
    --------
    >>> completion_times(0.05, 1.0, 0.5, restitution=0.6)  # 0.26156342 bounce by bounce
    (0.25, 0.2604166666666667)
    """
    w = _finite("rebound_speed", rebound_speed)
    a = _finite("push", push)
    j = _finite("jerk", jerk)
    if w < 0.0:
        raise ValueError(f"rebound_speed = {rebound_speed!r}: must be a finite number >= 0")
    if a <= 0.0:
        raise ValueError(
            f"push = {push!r}: must be a finite number > 0; a wall that draws away ends no burst"
        )
    r = _inelastic(restitution)
    mu, zeta = _finite("mass_ratio", mass_ratio), _finite("damping_ratio", damping_ratio)
    for name, value in (("mass_ratio", mu), ("damping_ratio", zeta)):
        if value < 0.0:
            raise ValueError(f"{name} = {value!r}: must be a finite number >= 0")
    if not a * (1.0 - r) > 0.0:
        return math.inf, math.nan
    first, second = accumulation_times(zeta, mu, r, a, j, w)
    return first, second


def predict(
    parameters: Parameters, side: int, time: float, x: float, v: float, rebound_speed: float
) -> Prediction:
    """Predict the rest of a burst from the state just after one of its impacts.

    Parameters
    ----------
    parameters : Parameters
        Of the damper; restitution < 1.
    side : {-1, 1}
        Wall of the burst: -1 left, 1 right.
    time, x, v : float
        Time of the impact (units of sqrt(M/K)), displacement and velocity of the primary just
        after it.
    rebound_speed : float
        Rate of the gap then, >= 0.

    Returns
    -------
    Prediction

    Raises
    ------
    ValueError
        For a damper that is not rigid, another side, restitution = 1, a negative rebound speed,
        what is not finite, and a wall that does not push just after the impact: such a burst need
        not complete.
    TypeError
        When a value is not a real number.

    Examples
    --------
    >>> p = Parameters(mass_ratio=0.5, damping_ratio=0.2, frequency_ratio=0.3, clearance=0.5,
    ...                restitution=0.6)
    >>> found = predict(p, 1, 2.0, 2.0, 0.1, 0.01)  # 0.0340400694 bounce by bounce
    >>> round(found.first_order_time, 7), round(found.second_order_time, 7)
    (0.0338901, 0.0340356)
    """
    if side not in (-1, 1):
        raise ValueError(f"side = {side!r}: must be -1 (left wall) or 1 (right wall)")
    t, x, v = _finite("time", time), _finite("x", x), _finite("v", v)
    w = _finite("rebound_speed", rebound_speed)
    if w < 0.0:
        raise ValueError(f"rebound_speed = {rebound_speed!r}: must be a finite number >= 0")
    p = parameters
    if p.model != "rigid":
        raise ValueError(f"{p!r}: must be a rigid damper, the {p.model} one has other formulas")
    _inelastic(p.restitution)
    heavier = 1.0 + p.mass_ratio
    free = oscillator(p.damping_ratio, 1.0, 1.0, p.frequency_ratio)
    stuck = oscillator(p.damping_ratio / heavier, 1.0 / heavier, 1.0 / heavier, p.frequency_ratio)
    angle = p.frequency_ratio * math.fmod(t, p.period) + p.phase
    found = Prediction(
        *predict_tail(free, stuck, p.mass_ratio, p.restitution, float(side), angle, x, v, w)
    )
    if math.isnan(found.first_order_time):
        raise ValueError(
            f"the wall does not push just after this impact (side = {side}, x = {x!r}, v = {v!r}, "
            f"time = {time!r}): must be a state with side x'' < 0"
        )
    return found


@compiled
def predict_tail(
    free: Oscillator,
    stuck: Oscillator,
    mass_ratio: float,
    restitution: float,
    side: float,
    angle: float,
    x: float,
    v: float,
    rebound_speed: float,
) -> tuple[float, ...]:
    """Compute what `predict` returns, without its checks.

    Parameters
    ----------
    free, stuck : tuple
        `damper.engine.oscillator.oscillator` of flight and of sticking.
    angle : float
        Phase of the force at the impact.

    Returns
    -------
    first_order_time, second_order_time, first_order_displacement, second_order_displacement,
    error : float
        As `Prediction`: NaN where the wall does not push, and of second order where that time
        is not positive, which it cannot be.
    """
    sin, cos, _ = sine_cosine(angle)
    a, j = acceleration(free, x, v, sin, cos)
    push = -side * a
    if not push * (1.0 - restitution) > 0.0:
        return math.nan, math.nan, math.nan, math.nan, math.inf
    if rebound_speed == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    first, second = accumulation_times(
        free[0], mass_ratio, restitution, push, side * j, rebound_speed
    )
    _, error = tail_duration(free, mass_ratio, restitution, side, a, j, sin, rebound_speed)
    common = v - side * mass_ratio / (1.0 + mass_ratio) * rebound_speed
    dx = math.nan
    if 0.0 < second <= LONGEST:
        dx, _ = advance(stuck, x, common, sin, cos, second)
    else:
        second = math.nan
    return first, second, common * first, dx, error / first


def _finite(name: str, value: float) -> float:
    number = real(name, value)
    if not math.isfinite(number):
        raise ValueError(f"{name} = {value!r}: must be a finite number")
    return number


def _inelastic(restitution: float) -> float:
    """Return the restitution unless a burst with it never completes."""
    r = check_quantity("restitution", restitution)
    if r == 1.0:
        raise ValueError(
            f"restitution = {restitution!r}: must be a finite number with 0 <= restitution < 1, "
            "for with 1 a burst never completes"
        )
    return r
