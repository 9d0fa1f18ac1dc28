"""How far a sweep is: points done of total, rate and time left, on a terminal or in a log.

Clock times go nowhere else: results are the same each time.
"""

import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic
from typing import TextIO

from damper.sweep.estimate import duration

#: Called with the points done, and all, after each of them.
Progress = Callable[[int, int], None]

_CELLS = 24


def progress_lines(stream: TextIO) -> Progress:
    """Return what writes a line for each tenth of the points, and for each minute."""
    last, first = monotonic(), None

    def show(done: int, total: int) -> None:
        nonlocal last, first
        now = monotonic()
        first = first or (done, now)
        if done * 10 // total > (done - 1) * 10 // total or now - last >= 60.0:
            last = now
            print(_text(done, total, now, *first), file=stream, flush=True)

    return show


@contextmanager
def progress_bar() -> Iterator[Progress | None]:
    """Show a bar to a person at a terminal or a notebook, from the first second on; else None."""
    stream = sys.stderr
    if stream is None or not (stream.isatty() or "ipykernel" in sys.modules):
        yield None
        return
    next_time, width, first = monotonic() + 1.0, 0, None

    def show(done: int, total: int) -> None:
        nonlocal next_time, width, first
        now = monotonic()
        first = first or (done, now)
        if now < next_time:
            return
        next_time = now + 0.1
        full = _CELLS * done // total
        text = f"[{'#' * full}{' ' * (_CELLS - full)}] {_text(done, total, now, *first)}"
        text = text[: shutil.get_terminal_size().columns - 1]
        print("\r" + text.ljust(width), end="", file=stream, flush=True)
        width = max(width, len(text))

    try:
        yield show
    finally:
        if width:
            print("\r" + " " * width + "\r", end="", file=stream, flush=True)


def _text(done: int, total: int, now: float, first_done: int, first_time: float) -> str:
    """Say how far a sweep is; the rate is that since the first point, for code compiles before."""
    text = f"{done} of {total} points"
    if done == first_done or now <= first_time:
        return text
    rate = (done - first_done) / (now - first_time)
    left = f", {duration((total - done) / rate)} left" if done < total else ""
    return f"{text}, {rate:.3g} a second{left}"
