"""The stretch that a sampled trajectory covers. Kept light: studies are checked without engine."""

import math

#: Part of a sample step by which a stretch may miss a whole number of them by rounding.
SLACK = 1e-9


def sample_steps(rate: float, start: float, length: float | None, periods: float) -> int:
    """Whole sample steps of a stretch, once it is known to lie in the window; ValueError if not.

    `start`, `length` and the window's `periods` are in cycles, without a length to the
    window's last whole step; `rate` is in samples per cycle.
    """
    last = math.floor((periods - start) * rate + SLACK)
    steps = last if length is None else round(length * rate)
    if steps < 1:
        raise ValueError(
            f"start = {start!r}, length = {length!r}: holds no whole sample step of "
            f"1/{rate} cycle within the window of {periods} cycles"
        )
    if start + steps / rate > periods + SLACK / rate:
        raise ValueError(
            f"start = {start!r}, length = {length!r}: the stretch ends "
            f"{start + steps / rate:.9g} cycles after the start of the window, which is "
            f"{periods} cycles long"
        )
    return steps
