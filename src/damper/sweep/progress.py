"""How far a sweep is: points done of total, rate and time left, on a terminal or in a log.

Clock times go nowhere else: results are the same each time.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic
from typing import TextIO

from damper.engine import terminal
from damper.sweep.estimate import duration

#: Called with the points done, and all, after each of them.
Progress = Callable[[int, int], None]

_CELLS, _FEW_CELLS = 24, 12
#: A point that takes so many times the mean, and so many seconds, waited for code that compiles.
_PAUSE, _LEAST_PAUSE = 10.0, 2.0


def progress_lines(stream: TextIO) -> Progress:
    """Return what writes a line for each tenth of the points, and for each minute."""
    last, pace = monotonic(), _Pace("points")

    def show(done: int, total: int) -> None:
        nonlocal last
        now = monotonic()
        pace.note(done, now)
        if done * 10 // total > (done - 1) * 10 // total or now - last >= 60.0:
            last = now
            print(pace.text(total), file=stream, flush=True)

    return show


@contextmanager
def progress_bar(
    what: Callable[[], str] | str = "", unit: str = "points"
) -> Iterator[Progress | None]:
    """Show a bar to a person at a terminal or a notebook, from the first second on; else None.

    Parameters
    ----------
    what : str or callable, optional
        What is being done, or a function that returns it.
    unit : str, default "points"
        What is counted.
    """
    if not terminal.is_watched():
        yield None
        return
    next_time, pace = monotonic() + 1.0, _Pace(unit)
    step: tuple[str, int] | None = None

    def show(done: int, total: int) -> None:
        nonlocal next_time, pace, step
        now = monotonic()
        words = what() if callable(what) else what
        if (words, total) != step:  # the next one has a rate of its own
            step, pace = (words, total), _Pace(unit)
        pace.note(done, now)
        if now < next_time:
            return
        next_time = now + 0.1
        cells = _FEW_CELLS if words else _CELLS
        full = cells * done // total
        bar = f"[{'#' * full}{' ' * (cells - full)}]"
        terminal.show(f"{bar} {words}{': ' * bool(words)}{pace.text(total)}")

    try:
        yield show
    finally:
        terminal.show("")


class _Pace:
    """How far a sweep is, and its rate: that since code compiled, before or between points."""

    def __init__(self, unit: str) -> None:
        self._unit = unit
        self._first = self._last = (0, math.inf)

    def note(self, done: int, now: float) -> None:
        """Note the points that are done at a time."""
        (first_done, first_time), (last_done, last_time) = self._first, self._last
        passed = now - last_time
        mean = (last_time - first_time) / max(last_done - first_done, 1)
        waited = passed > max(_PAUSE * mean, _LEAST_PAUSE) and last_done > first_done
        if last_time == math.inf or waited or last_done == 0 or done < last_done:
            self._first = done, now
        self._last = done, now

    def text(self, total: int) -> str:
        """Say it in words."""
        (first_done, first_time), (done, now) = self._first, self._last
        text = f"{done} of {total} {self._unit}".rstrip()
        if done == first_done or now <= first_time:
            return text
        rate = (done - first_done) / (now - first_time)
        left = f", {duration((total - done) / rate)} left" if done < total else ""
        return f"{text}, {rate:.3g} a second{left}"
