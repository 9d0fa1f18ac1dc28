"""A status line on a terminal, for people who wait; nothing where stderr is no terminal."""

import shutil
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic

#: Seconds after which a person wants to know what is going on, and between two lines about it.
_PATIENCE, _AGAIN = 2.0, 1.0

_lock = threading.Lock()
_width = 0
_open: list[str] = []


def is_watched() -> bool:
    """Whether a person sees stderr, at a terminal or in a notebook."""
    stream = sys.stderr
    return stream is not None and (stream.isatty() or "ipykernel" in sys.modules)


def show(text: str) -> None:
    """Write text over the line; an empty one removes the line."""
    global _width
    with _lock:
        text = text[: shutil.get_terminal_size().columns - 1]
        if text or _width:
            over = "\r" + text.ljust(_width) + ("" if text else "\r")
            print(over, end="", file=sys.stderr, flush=True)
        _width = max(_width, len(text)) if text else 0


@contextmanager
def saying(text: str) -> Iterator[None]:
    """Say what goes on, and for how long, once the body takes more than two seconds."""
    if not is_watched():
        yield
        return
    ended, began = threading.Event(), monotonic()

    def speak() -> None:
        wait = _PATIENCE
        while not ended.wait(wait):
            wait = _AGAIN
            if _open[-1] is text:  # a part of the body says more
                show(f"{text}, {monotonic() - began:.0f} s")

    _open.append(text)
    speaker = threading.Thread(target=speak, daemon=True)
    speaker.start()
    try:
        yield
    finally:
        ended.set()
        speaker.join()
        _open.remove(text)
        if monotonic() - began > _PATIENCE:
            show("")
