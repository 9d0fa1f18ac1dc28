"""What new interpreters are asked to do in the tests of `damper.verification.cost.process`."""

import sys

from damper.verification.cost.process import peak_memory


def take(megabytes: int) -> int:
    """Take memory, free it, and return the peak."""
    block = bytearray(megabytes * 1_000_000)
    block[::1024] = b"x" * len(block[::1024])
    del block
    return peak_memory()


def talk(text: str) -> list[object]:
    """Print something that is no answer, then answer, and state whether numpy is loaded."""
    print("not an answer")
    return [text, "numpy" in sys.modules]


def fail() -> None:
    """Raise."""
    raise ArithmeticError("as asked")
