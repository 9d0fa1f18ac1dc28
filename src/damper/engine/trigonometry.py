"""Sine and cosine for the event loop: one branch-free evaluation gives both."""

import math

from damper.engine.compiled import compiled

_QUARTERS_PER_RADIAN = 2.0 / math.pi
# pi / 2 in two parts: the first one has 33 bits, so that its product with a count is exact.
_HALF_PI_HIGH, _HALF_PI_LOW = 1.5707963267341256, 6.077100506303966e-11
# Adding and taking away 1.5 * 2**52 rounds to a whole number.
_ROUNDER = 6755399441055744.0


@compiled
def sine_cosine(angle: float) -> tuple[float, float, float]:
    """Sine and cosine of an angle up to some 1e6, and the cosine less one without cancellation.

    Taylor polynomials after taking away quarter turns (Cody and Waite, Software Manual for the
    Elementary Functions, 1980, ch. 8), to 2e-16 and 1.5e-21 of the angle. The C library branches
    on the angle, and each wrong guess of the processor costs as much as this whole function.

    Returns
    -------
    sine, cosine, cosine_less_1 : float
    """
    quarters = (angle * _QUARTERS_PER_RADIAN + _ROUNDER) - _ROUNDER
    r = (angle - quarters * _HALF_PI_HIGH) - quarters * _HALF_PI_LOW
    z = r * r
    w = z * z
    sine = r + r * z * (
        ((-1.0 / 6.0 + z * (1.0 / 120.0)) + w * (-1.0 / 5040.0 + z * (1.0 / 362880.0)))
        + (w * w) * ((-1.0 / 39916800.0 + z * (1.0 / 6227020800.0)) - w * (1.0 / 1307674368000.0))
    )
    less_1 = (
        w
        * (
            ((1.0 / 24.0 - z * (1.0 / 720.0)) + w * (1.0 / 40320.0 - z * (1.0 / 3628800.0)))
            + (w * w)
            * ((1.0 / 479001600.0 - z * (1.0 / 87178291200.0)) + w * (1.0 / 20922789888000.0))
        )
        - 0.5 * z
    )
    cosine = 1.0 + less_1
    quarter = int(quarters) & 3
    if quarter & 1:
        sine, cosine = cosine, -sine
    if quarter & 2:
        sine = -sine
        cosine = -cosine
    if quarter:
        less_1 = cosine - 1.0
    return sine, cosine, less_1
