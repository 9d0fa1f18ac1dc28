"""Taylor polynomials in arbitrary precision, and their first roots by steps that cannot pass one.

With |q''| <= B on a panel, q(tau + s) >= q + q' s - B s**2 / 2. The step to the zero of that
parabola passes no root, and converges quadratically to a simple one.
"""

from collections.abc import Sequence

from mpmath import mp, mpf

#: Steps of a search for a root after which it need not be a simple one.
QUICK = 60


def term_count(rate_times_step: mpf) -> int:
    """Return how many Taylor terms bring the remainder below the working precision."""
    term, n = mpf(1), 0
    while term > mp.eps:
        n += 1
        term *= rate_times_step / n
    return n + 6


def horner(c: Sequence[mpf], tau: mpf) -> tuple[mpf, mpf]:
    """Return value and first derivative of the polynomial with coefficients ``c``."""
    value, slope = mpf(0), mpf(0)
    for coefficient in reversed(c):
        slope = slope * tau + value
        value = value * tau + coefficient
    return value, slope


def first_root(q: Sequence[mpf], end: mpf, absolute: bool) -> mpf | None:
    """Return the first root of a polynomial in ``(0, end]``, or None.

    ``q`` is positive at 0 (or zero and about to leave the positive side). With ``|q''| <= B`` on
    the panel, ``q(tau + s) >= q + q' s - B s**2 / 2``; the step to the zero of that parabola cannot
    pass a root and converges quadratically to a simple one. Towards a multiple root it would take
    ever smaller parts of what is left; after `QUICK` steps B is that of the next stretch alone. An
    `absolute` error may be small against ``end``, not only against the root.
    """
    everywhere = _bend(q, end)
    tolerance = 1000 * mp.eps
    tau = mpf(0)
    reach = end
    quick = QUICK
    while True:
        quick -= 1
        if quick >= 0:
            value, slope = horner(q, tau)
            bound = everywhere
        else:
            local = expand(q, tau)
            value, slope = local[0], local[1]
            bound = _bend(local, reach)
        if value <= 0 and slope <= 0:
            return tau
        value = max(value, mpf(0))
        root = mp.sqrt(slope**2 + 2 * bound * value)
        if slope > 0:
            if bound == 0:
                return None
            step = (root + slope) / bound
        elif root == slope:  # a positive constant
            return None
        else:
            step = 2 * value / (root - slope)
        if quick < 0:
            step = min(step, reach)
            reach = 2 * step
        if tau + step > end:
            return None
        tau += step
        if step <= tolerance * (end if absolute else tau):
            return tau


def expand(q: Sequence[mpf], tau: mpf) -> list[mpf]:
    """Return the coefficients of a polynomial about another point, by repeated division."""
    local = list(q)
    for lowest in range(len(local) - 1):
        for n in range(len(local) - 2, lowest - 1, -1):
            local[n] += tau * local[n + 1]
    return local


def _bend(q: Sequence[mpf], end: mpf) -> mpf:
    """Return a bound on |q''| on [0, end]."""
    bound = mpf(0)
    for n in range(len(q) - 1, 1, -1):
        bound = bound * end + n * (n - 1) * abs(q[n])
    return bound


def lowest_order(c: Sequence[mpf]) -> int:
    """Return the index of the first coefficient that is not zero."""
    return next((n for n, value in enumerate(c) if value != 0), len(c))
