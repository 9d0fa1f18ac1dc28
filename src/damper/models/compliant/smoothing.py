"""How fast a contact's motion can still change once its fast parts have had time to die.

A motion z' = A z with widely different rates is smooth on the scale of its age: what is fast has
died. Derivatives taken from a state do not show it, for each one multiplies rounding by the fastest
rate R. With the watched quantity q = r z, and a state a time h before,

    q''''(t) = (r A^3 exp(A h)) z'(t - h) = (r A^2 exp(A h)) z''(t - h),

and the rows in brackets are of the sizes r / h^3 and r / h^2 where all rates are high but damped.
The energy norm E of a derivative is only lessened by the dashpots; the same derivative of the
force, at most F, raises it by F t at most, and E^2 by F^2 t / (4 zeta). So both give a bound on
q'''' for all times after h. The rows are made with a part of exp(A h) between any two factors A, so
that rounding is never multiplied twice by R.
"""

import math

import numpy as np

from damper.engine.compiled import compiled
from damper.models.compliant.flow import Touch


@compiled
def fill_later(touch: Touch, table: np.ndarray, row: np.ndarray, later: np.ndarray) -> None:
    """Fill the bounds on the fourth derivative of a watched quantity, by the motion's age.

    Parameters
    ----------
    touch : Touch
        Of a contact, not of a flight.
    table : ndarray
        Its propagators.
    row : ndarray (6,)
        The quantity's coefficients on a state.
    later : ndarray (levels + 1, 4)
        Written: for the age `touch.shortest * 2**level`, the factors of the energy norm of z' and
        of its force, and the same of z''.
    """
    for level in range(touch.levels + 1):
        for order in (1, 2):
            factors = 4 - order
            # As many equal parts of the age as a power of 2 has room for; the youngest have one.
            r = (float(row[0]), float(row[1]), float(row[2]), float(row[3]), 0.0, 0.0)
            for part in range(4):
                if level >= 2:
                    r = _row_leap(touch, table[level - 2], r)
                if part < factors:
                    r = _row_times_rates(touch, r)
            if level < 2:
                r = _row_leap(touch, table[level], r)
            u, w, g, h, s, c = r
            g -= touch.reduced * u
            later[level, 2 * order - 2] = math.sqrt(
                u * u + touch.share * w * w + g * g / touch.stiffness + h * h / touch.reduced
            )
            later[level, 2 * order - 1] = math.hypot(s, c)


@compiled
def _row_times_rates(touch, r):
    """Row r A: its product with a state is that of r with the state's derivative."""
    u, w, g, h, s, c = r
    push = touch.share * w + h
    return (
        -push,
        u - touch.drag * push,
        -touch.reduced * push - touch.relative_stiffness * h,
        g - touch.drag * touch.reduced * push - touch.relative_damping * h,
        push - touch.omega * c,
        touch.omega * s,
    )


@compiled
def _row_leap(touch, e, r):
    """Row r exp(A h), by one row of the propagators, which have U + shift g in the place of U."""
    u, w, g, h, s, c = r
    g -= touch.shift * u
    h -= touch.shift * w
    less_1 = e[24]
    sine = e[25]
    new_u = u + float(u * e[0] + w * e[6] + g * e[12] + h * e[18])
    new_w = w + float(u * e[1] + w * e[7] + g * e[13] + h * e[19])
    new_g = g + float(u * e[2] + w * e[8] + g * e[14] + h * e[20])
    new_h = h + float(u * e[3] + w * e[9] + g * e[15] + h * e[21])
    new_s = s + float(u * e[4] + w * e[10] + g * e[16] + h * e[22] + s * less_1 - c * sine)
    new_c = c + float(u * e[5] + w * e[11] + g * e[17] + h * e[23] + s * sine + c * less_1)
    return (
        new_u,
        new_w,
        new_g + touch.shift * new_u,
        new_h + touch.shift * new_w,
        new_s,
        new_c,
    )


@compiled
def later_bound4(
    touch: Touch,
    later: np.ndarray,
    since: float,
    sizes: tuple[float, float],
    tau: float,
    span: float,
) -> float:
    """Bound on the watched quantity's fourth derivative from `tau` on, over a span.

    Parameters
    ----------
    since : float
        An earlier time.
    sizes : tuple of float
        Energy norms of the state's first and second derivative then.
    tau, span : float

    Returns
    -------
    float
        inf where the motion is too young.
    """
    age = tau - since
    if not age >= touch.shortest:
        return math.inf
    length = touch.shortest
    level = 0
    while level < touch.levels and 2.0 * length <= age:
        length *= 2.0
        level += 1
    row = later[level]
    time = age - length + span
    omega = touch.omega
    first = float(row[0]) * _grown(touch, sizes[0], omega, time) + float(row[1]) * omega
    square = omega * omega
    return min(
        first, float(row[2]) * _grown(touch, sizes[1], square, time) + float(row[3]) * square
    )


@compiled
def _grown(touch, size, force, time):
    """Bound on an energy norm after a time in which a force works."""
    grown = size + force * time
    if touch.drag > 0.0:
        # The work F x' less what the dashpot takes, 2 zeta x'^2, is F^2 / (8 zeta) at most.
        grown = min(grown, math.sqrt(size * size + 0.5 * force * force * time / touch.drag))
    return grown
