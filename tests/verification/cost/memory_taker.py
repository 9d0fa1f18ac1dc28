"""What workers are asked to do in the tests of `damper.verification.cost.process`."""

from damper.verification.cost.process import peak_memory


def take(megabytes: int) -> int:
    """Take memory, let it go, and return the peak."""
    block = bytearray(megabytes * 1_000_000)
    block[::1024] = b"x" * len(block[::1024])
    del block
    return peak_memory()


def loaded(name: str) -> bool:
    """Whether a module is loaded."""
    import sys

    return name in sys.modules


def talk(text: str) -> str:
    """Print something that is no answer, then answer."""
    print("not an answer")
    return text


def fail() -> None:
    """Raise."""
    raise ArithmeticError("as asked")
