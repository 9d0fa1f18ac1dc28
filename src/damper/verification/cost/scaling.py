"""Run time and peak memory against the number of lanes and of periods.

Every size runs in a process of its own, which has run a single lane before the clock starts. Memory
is what the process took at its peak beyond that; what observers keep was asked for, and is given
apart.
"""

import math
import statistics
import time
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from damper.engine.compiled import compile_at_once
from damper.sweep.runs import run_points
from damper.verification.cost.ladder import NO_BUDGET, SPREAD, Observers, bare
from damper.verification.cost.process import fresh, peak_memory

#: Seconds that one size may take: it is repeated within them.
PATIENCE = 0.5
#: Sizes below are too small for a slope: what a run costs before it starts weighs in them.
LEAST = 100


def scale(
    parameters: Mapping[str, float],
    observers: Observers,
    *,
    lanes: Sequence[int],
    lane_periods: int,
    periods: Sequence[int],
    repeats: int,
) -> dict[str, Any]:
    """Measure sizes, with the bare engine and observed.

    Parameters
    ----------
    parameters : mapping of str to float
        A dimensionless scene; lanes differ a little in clearance.
    observers : mapping of str to settings
    lanes : sequence of int
        Numbers of lanes of `lane_periods` each.
    lane_periods : int
    periods : sequence of int
        Numbers of periods of a single lane.
    repeats : int
        Runs of each size at most; fewer where they take longer than `PATIENCE`.

    Returns
    -------
    dict
        ``lanes`` and ``periods``, each with ``bare`` and ``observed``: lists, one entry a size,
        ``size``, ``seconds`` (median), ``repeats``, ``memory`` and ``asked`` (bytes), and the
        exponents ``time_slope`` and ``memory_slope``, see `slope`.
    """
    given = {"parameters": dict(parameters), "repeats": repeats}
    found: dict[str, Any] = {"lane_periods": lane_periods, "observers": list(observers)}
    for along, sizes in (("lanes", lanes), ("periods", periods)):
        found[along] = {}
        for how, asked in (("bare", None), ("observed", dict(observers))):
            rows = [
                fresh(
                    f"{__name__}:run_size",
                    lanes=size if along == "lanes" else 1,
                    periods=lane_periods if along == "lanes" else size,
                    observers=asked,
                    **given,
                )
                for size in sizes
            ]
            columns = {name: [row[name] for row in rows] for name in rows[0]}
            found[along][how] = {"size": list(sizes), **columns} | {
                "time_slope": slope(sizes, columns["seconds"]),
                "memory_slope": slope(sizes, columns["memory"]),
            }
    return found


def run_size(
    parameters: Mapping[str, float],
    lanes: int,
    periods: int,
    observers: Observers | None,
    repeats: int,
) -> dict[str, float]:
    """Measure one size in this process; None for observers is the bare engine."""

    def run(lanes: int, periods: int) -> int:
        points = _points(parameters, lanes)
        if observers is None:
            bare(points, periods)
            return 0
        arrays, _ = run_points(
            points, observers, transient=0, periods=periods, max_events=NO_BUDGET
        )
        if arrays["status"].any():
            raise RuntimeError(f"{parameters} did not finish: nothing to measure")
        return sum(array.nbytes for array in arrays.values())

    compile_at_once()
    run(1, 1)
    before = peak_memory()
    seconds: list[float] = []
    while not seconds or (len(seconds) < repeats and sum(seconds) < PATIENCE):
        started = time.perf_counter()
        asked = run(lanes, periods)
        seconds.append(time.perf_counter() - started)
    return {
        "seconds": statistics.median(seconds),
        "repeats": len(seconds),
        "memory": peak_memory() - before,
        "asked": asked,
    }


def slope(sizes: Sequence[float], values: Sequence[float]) -> float:
    """Exponent of the power law that fits sizes of `LEAST` and more; NaN without two of them.

    Examples
    --------
    >>> round(slope([1, 100, 1000, 10_000], [5.0, 6.0, 60.0, 600.0]), 6)
    1.0
    """
    size, value = np.asarray(sizes, dtype=float), np.asarray(values, dtype=float)
    good = (size >= LEAST) & (value > 0.0)
    if good.sum() < 2:
        return math.nan
    return float(np.polyfit(np.log(size[good]), np.log(value[good]), 1)[0])


def _points(parameters: Mapping[str, float], lanes: int) -> Iterator[dict[str, float]]:
    """Points of lanes, one after the other, so that they take no memory themselves."""
    for lane in range(lanes):
        factor = 1.0 + SPREAD * (lane / lanes - 0.5)
        yield {**parameters, "clearance": parameters["clearance"] * factor}
