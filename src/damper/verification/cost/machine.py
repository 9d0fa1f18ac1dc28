"""The machine that timings are of."""

import os
import platform
from pathlib import Path

from damper.engine.compiled import COMPILED


def machine() -> str:
    """Name of the processor, and how many cores this process sees."""
    return f"{processor()}, {os.cpu_count()} cores, Python {platform.python_version()}"


def processor() -> str:
    """Name of the processor."""
    model = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        names = [line for line in info.read_text().splitlines() if line.startswith("model name")]
        model = names[0].split(":")[1].strip() if names else model
    return model


def core() -> str:
    """How the engine runs: compiled, or as plain Python."""
    return "numba" if COMPILED else "plain Python"
