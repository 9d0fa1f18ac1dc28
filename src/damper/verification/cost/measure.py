"""Measures a benchmark suite against the bare engine, and growth with runs and periods.

A benchmark case is a scene and what is observed in it. Observed runs are those of
`damper.sweep.runs`, as in every simulation job; the bare engine reads the same points and runs them
without observers.
"""

import statistics
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from damper.engine.compiled import compile_at_once
from damper.engine.loop import FINISHED
from damper.models import start_run
from damper.parameters.quantities import MODEL_NAMES
from damper.sweep.points import read_point
from damper.sweep.runs import run_points
from damper.verification.cost.process import fresh, peak_memory
from damper.verification.timing import machine, spread, take_turns

Numbers = Mapping[str, float]
Observers = Mapping[str, Mapping[str, Any] | None]

#: No run makes so many events: one that stops early would cost less than it should.
NO_BUDGET = 10**12
#: Runs differ in clearance by up to this part, so that none is a copy of another.
WIDTH = 0.04
#: Periods of each run where the number of runs grows.
RUN_PERIODS = 10
#: Seconds that one size of a growing run may take: it is repeated within them.
LONGEST_SAMPLE = 0.5
#: Sizes below are too small for a slope: what a run costs before it starts weighs in them.
LEAST = 100


def measure(suite: Mapping[str, Any], growth: Mapping[str, Any]) -> dict[str, Any]:
    """Measure all of a cost study, one thing after the other; to be alone on the machine.

    Parameters
    ----------
    suite, growth : mapping
        Keywords of `measure_suite` and `measure_growth`.

    Returns
    -------
    dict
        Of what JSON can hold: ``machine``, ``suite`` and ``growth``.
    """
    return {
        "machine": machine(),
        "suite": measure_suite(**suite),
        "growth": measure_growth(**growth),
    }


def measure_suite(
    cases: Mapping[str, Mapping[str, Any]],
    *,
    runs: int,
    periods: int,
    repeats: int,
    memory: bool = True,
) -> dict[str, Any]:
    """Measure benchmark cases in turns.

    Parameters
    ----------
    cases : mapping of str to mapping
        Name -> ``parameters`` and ``observers``; the first one is the base.
    runs, periods : int
        What each case consists of.
    repeats : int
    memory : bool
        Whether to measure the memory of observers, in processes of their own.

    Returns
    -------
    dict
        The settings; ``noise``, ratio of two timings of the base; and ``cases``: name -> ``model``,
        ``observers``, ``events``, times in us per event, ``bare`` and ``observed``, and ratios:
        ``over_bare``, observed over bare; ``over_base``, bare over that of the base, and
        ``over_rigid``, over that of the rigid damper with the same numbers. Times and ratios are
        [lower quartile, median, upper quartile]. ``memory`` and ``arrays``: bytes of the peak
        beyond that of the bare engine, and of the observers' arrays among them. Cases without
        observers have no ``observed``, ``over_bare`` and memory, those with observers no
        ``over_base``.

    Raises
    ------
    ValueError, TypeError
        For parameters or observers that are not valid.
    """
    names = list(cases)
    models = {name: read_point(case["parameters"]).parameters.model for name, case in cases.items()}
    calls: dict[tuple[str, str], Callable[[], int]] = {}
    for name, case in cases.items():
        points = list(points_near(case["parameters"], runs))
        calls[name, "bare"] = partial(bare, points, periods)
        if name == names[0]:
            calls["", "base again"] = calls[name, "bare"]
        if case["observers"]:
            calls[name, "observed"] = partial(observed, points, periods, case["observers"])
        elif models[name] != "rigid":
            rigid = list(points_near(rigid_part(case["parameters"]), runs))
            calls[name, "rigid"] = partial(bare, rigid, periods)
    counts = {key: call() for key, call in calls.items()}  # the first run compiles
    seconds = dict(zip(calls, take_turns(list(calls.values()), repeats).T, strict=True))

    def each(name: str, what: str) -> np.ndarray:
        # An observed run has the events of the bare one.
        return seconds[name, what] / counts[name, "bare" if what == "observed" else what]

    found: dict[str, Any] = {}
    for name, case in cases.items():
        alone = each(name, "bare")
        entry = {
            "model": models[name],
            "observers": list(case["observers"]),
            "events": counts[name, "bare"],
            "bare": spread(1e6 * alone),
        }
        if case["observers"]:
            whole = each(name, "observed")
            entry |= {"observed": spread(1e6 * whole), "over_bare": spread(whole / alone)}
            if memory:
                size = {"parameters": dict(case["parameters"]), "runs": runs, "periods": periods}
                one = fresh(f"{__name__}:measure_size", observers=None, **size)
                other = fresh(f"{__name__}:measure_size", observers=case["observers"], **size)
                entry |= {"memory": other["peak"] - one["peak"], "arrays": other["arrays"]}
        else:
            entry["over_base"] = spread(alone / each(names[0], "bare"))
            if (name, "rigid") in calls:
                entry["over_rigid"] = spread(alone / each(name, "rigid"))
        found[name] = entry
    return {
        "runs": runs,
        "periods": periods,
        "repeats": repeats,
        "noise": spread(seconds["", "base again"] / seconds[names[0], "bare"]),
        "cases": found,
    }


def measure_growth(
    parameters: Numbers,
    observers: Observers,
    *,
    runs: Sequence[int],
    periods: Sequence[int],
    repeats: int,
) -> dict[str, Any]:
    """Measure growing numbers of runs and of periods, each size in a process of its own.

    Parameters
    ----------
    parameters : mapping of str to float
    observers : mapping of str to settings
    runs : sequence of int
        Numbers of runs of `RUN_PERIODS` each.
    periods : sequence of int
        Numbers of periods of a single run.
    repeats : int
        Repeats of each size at most; fewer where they take longer than `LONGEST_SAMPLE`.

    Returns
    -------
    dict
        ``observers``, and ``runs`` and ``periods``, each with ``bare`` and ``observed``: lists with
        an entry for each size: ``size``, and what `measure_size` returns; and ``exponent``, the
        exponent of the time, see `exponent`.
    """
    found: dict[str, Any] = {"observers": list(observers)}
    for along, sizes in (("runs", runs), ("periods", periods)):
        found[along] = {}
        for how, asked in (("bare", None), ("observed", dict(observers))):
            rows = [
                fresh(
                    f"{__name__}:measure_size",
                    parameters=dict(parameters),
                    observers=asked,
                    runs=size if along == "runs" else 1,
                    periods=RUN_PERIODS if along == "runs" else size,
                    repeats=repeats,
                )
                for size in sizes
            ]
            columns = {name: [row[name] for row in rows] for name in rows[0]}
            slope = exponent(sizes, columns["seconds"])
            found[along][how] = {"size": list(sizes), **columns, "slope": slope}
    return found


def measure_size(
    parameters: Numbers, observers: Observers | None, runs: int, periods: int, repeats: int = 1
) -> dict[str, float]:
    """Measure time and memory of runs in this process; None for observers is the bare engine.

    Returns
    -------
    dict
        ``seconds`` (median); in bytes ``peak`` of the process, ``memory``, how much higher it is
        than after one run of one period, and ``arrays``, what the observers keep.
    """

    def run(runs: int, periods: int) -> int:
        points = points_near(parameters, runs)
        if observers is None:
            bare(points, periods)
            return 0
        return observed(points, periods, observers)

    run(1, 1)
    before = peak_memory()
    seconds: list[float] = []
    while not seconds or (len(seconds) < repeats and sum(seconds) < LONGEST_SAMPLE):
        started = time.perf_counter()
        arrays = run(runs, periods)
        seconds.append(time.perf_counter() - started)
    peak = peak_memory()
    return {
        "seconds": statistics.median(seconds),
        "peak": peak,
        "memory": peak - before,
        "arrays": arrays,
    }


def bare(points: Iterable[Numbers], periods: int) -> int:
    """Run the bare engine over points; return the number of events."""
    compile_at_once()
    events = 0
    for values in points:
        point = read_point(values)
        trajectory = start_run(point.parameters, point.start(), max_events=NO_BUDGET)
        trajectory.skip(periods)
        if trajectory.status != FINISHED:
            raise RuntimeError(f"{values} did not finish: nothing to measure")
        events += trajectory.events
    return events


def observed(points: Iterable[Numbers], periods: int, observers: Observers) -> int:
    """Run points as a simulation job does; return the bytes of what the observers keep."""
    compile_at_once()
    arrays, _ = run_points(points, observers, transient=0, periods=periods, max_events=NO_BUDGET)
    if arrays["status"].any():
        raise RuntimeError("a run did not finish: nothing to measure")
    return sum(array.nbytes for array in arrays.values())


def points_near(parameters: Numbers, runs: int) -> Iterator[dict[str, float]]:
    """Points of runs that differ in clearance, one after the other: they take no memory."""
    travel = "gap" if "gap" in parameters else "clearance"
    for run in range(runs):
        factor = 1.0 + WIDTH * (run - 0.5 * (runs - 1)) / runs
        yield {**parameters, travel: parameters[travel] * factor}


def rigid_part(parameters: Numbers) -> dict[str, float]:
    """Parameters without those of other models."""
    others = {name for names in MODEL_NAMES.values() for name in names}
    return {name: value for name, value in parameters.items() if name not in others}


def exponent(sizes: Sequence[float], values: Sequence[float]) -> float | None:
    """Exponent of the power law that fits sizes of `LEAST` and more; None without two of them.

    Examples
    --------
    >>> round(exponent([1, 100, 1000, 10_000], [5.0, 6.0, 60.0, 600.0]), 6)
    1.0
    """
    size, value = np.asarray(sizes, dtype=float), np.asarray(values, dtype=float)
    fitted = size >= LEAST
    if fitted.sum() < 2:
        return None
    return float(np.polyfit(np.log(size[fitted]), np.log(value[fitted]), 1)[0])
