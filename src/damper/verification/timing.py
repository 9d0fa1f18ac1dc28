"""Timing: runs that take turns, and the machine they ran on.

Times are processor times: other processes lengthen them less than clock times.
"""

import gc
import math
import os
import platform
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

#: A run shorter than this, in seconds, is repeated within a sample until the sample is as long.
SHORTEST = 1e-3
#: Packages named with the machine.
PACKAGES = ("numpy", "numba", "scipy")


def take_turns(
    cases: Sequence[Callable[[], Any]], repeats: int, spend: float = math.inf
) -> np.ndarray:
    """Time every case once a repeat, so that a slower pace of the machine affects all of them.

    Cases are warmed up. Every second repeat goes backwards: a steady drift cancels in the ratio of
    two cases. Returns seconds (repeats, cases); NaN where a case was not repeated, since its
    `spend` seconds were spent.
    """
    seconds = np.full((repeats, len(cases)), math.nan)
    spent = np.zeros(len(cases))
    calls = [1] * len(cases)

    def sample(column: int) -> float:
        started = process_time()
        for _ in range(calls[column]):
            cases[column]()
        passed = process_time() - started
        spent[column] += passed
        return passed / calls[column]

    collecting = gc.isenabled()
    gc.disable()  # as timeit does: garbage of one case is not the time of the next
    try:
        for repeat in range(repeats):
            order = range(len(cases))
            for column in order if repeat % 2 == 0 else reversed(order):
                if repeat and spent[column] >= spend:
                    continue
                one = sample(column)
                if not repeat and one < SHORTEST:
                    calls[column] = math.ceil(SHORTEST / max(one, 1e-9))
                    one = sample(column)
                seconds[repeat, column] = one
    finally:
        if collecting:
            gc.enable()
    return seconds


def machine() -> dict[str, str]:
    """Name what times are taken on: processor, cores, system, versions, how the engine runs."""
    from damper.engine.compiled import COMPILED

    found = {
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "system": f"{platform.system()} {platform.release()}",
        "python": platform.python_version(),
    }
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found | {"engine": "compiled" if COMPILED else "plain Python"}


def machine_text(found: Mapping[str, Any]) -> str:
    """Describe in one line what `machine` found, or a file's attributes with it.

    Examples
    --------
    >>> machine_text({"processor": "A processor", "cores": "2", "numpy": "2.3"})
    'A processor, 2 cores, numpy 2.3'
    """
    forms = {"processor": "{}", "cores": "{} cores", "system": "{}", "python": "Python {}"}
    forms |= {name: f"{name} {{}}" for name in PACKAGES} | {"engine": "engine {}"}
    return ", ".join(form.format(found[name]) for name, form in forms.items() if name in found)


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":")[1].strip()
    return platform.processor() or platform.machine()
