"""Measures a benchmark suite against the bare engine.

A benchmark case is a scene and what is observed in it. Observed runs are those of
`damper.sweep.runs`, as in every simulation job; the bare engine reads the same points and runs them
without observers.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from damper.engine.compiled import compile_at_once
from damper.engine.loop import FINISHED
from damper.models import start_run
from damper.parameters.forcing import forcing_of
from damper.parameters.quantities import MODEL_NAMES
from damper.sweep.points import read_point
from damper.sweep.runs import run_points
from damper.verification.timing import machine, spread, take_turns

Scene = Mapping[str, Any]
Observers = Mapping[str, Mapping[str, Any] | None]

#: No run makes so many events: one that stops early would cost less than it should.
NO_BUDGET = 10**12
#: Runs differ in clearance by up to this part, so that none is a copy of another.
WIDTH = 0.04


def measure(
    cases: Mapping[str, Mapping[str, Any]], *, runs: int, periods: int, repeats: int
) -> dict[str, Any]:
    """Measure benchmark cases, name -> ``parameters``, ``forcing`` and ``observers``.

    The first is the base. In turns; to be alone on the machine. Returns what JSON can hold: the
    settings; ``machine``; ``noise``, ratio of two timings of the base; and ``cases``: name ->
    ``model``, ``events``, times in us per event, ``bare`` and ``observed``, and ratios:
    ``over_bare``, observed over bare;
    ``over_base``, bare over that of the base, and ``over_rigid``, over that of the rigid damper
    with the same numbers. Times and ratios are [lower quartile, median, upper quartile].
    ``arrays``: bytes of what the observers keep. Cases without observers have no ``observed``,
    ``over_bare`` and ``arrays``, those with observers no ``over_base``.
    """
    compile_at_once()
    names = list(cases)
    scenes = {
        name: case["parameters"] | {"forcing": forcing_of(case["forcing"])}
        for name, case in cases.items()
    }
    models = {name: read_point(scene).parameters.model for name, scene in scenes.items()}
    calls: dict[tuple[str, str], Callable[[], int]] = {}
    for name, case in cases.items():
        points = list(points_near(scenes[name], runs))
        calls[name, "bare"] = partial(bare, points, periods)
        if name == names[0]:
            calls["", "base again"] = calls[name, "bare"]
        if case["observers"]:
            calls[name, "observed"] = partial(observed, points, periods, case["observers"])
        elif models[name] != "rigid":
            rigid = list(points_near(rigid_part(scenes[name]), runs))
            calls[name, "rigid"] = partial(bare, rigid, periods)
    counts = {key: call() for key, call in calls.items()}  # the first run compiles
    seconds = dict(zip(calls, take_turns(list(calls.values()), repeats).T, strict=True))

    found: dict[str, Any] = {}
    for name, case in cases.items():
        events = counts[name, "bare"]
        alone = seconds[name, "bare"] / events
        entry = {"model": models[name], "events": events, "bare": spread(1e6 * alone)}
        if case["observers"]:
            whole = seconds[name, "observed"] / events
            entry |= {"observed": spread(1e6 * whole), "over_bare": spread(whole / alone)}
            entry["arrays"] = counts[name, "observed"]
        else:
            base = seconds[names[0], "bare"] / counts[names[0], "bare"]
            entry["over_base"] = spread(alone / base)
            if (name, "rigid") in calls:
                rigid_alone = seconds[name, "rigid"] / counts[name, "rigid"]
                entry["over_rigid"] = spread(alone / rigid_alone)
        found[name] = entry
    return {
        "machine": machine(),
        "runs": runs,
        "periods": periods,
        "repeats": repeats,
        "noise": spread(seconds["", "base again"] / seconds[names[0], "bare"]),
        "cases": found,
    }


def bare(points: Iterable[Scene], periods: int) -> int:
    """Run the bare engine over points; return the number of events."""
    events = 0
    for values in points:
        point = read_point(values)
        trajectory = start_run(point.parameters, point.start(), max_events=NO_BUDGET)
        trajectory.skip(periods)
        if trajectory.status != FINISHED:
            raise RuntimeError(f"{values} did not finish: nothing to measure")
        events += trajectory.events
    if not events:
        raise RuntimeError(f"{values} has no event, whose time could be measured")
    return events


def observed(points: Iterable[Scene], periods: int, observers: Observers) -> int:
    """Run points as a simulation job does; return the bytes of what the observers keep."""
    arrays, _ = run_points(points, observers, transient=0, periods=periods, max_events=NO_BUDGET)
    if arrays["status"].any():
        raise RuntimeError("a run did not finish: nothing to measure")
    return sum(array.nbytes for array in arrays.values())


def points_near(scene: Scene, runs: int) -> Iterator[dict[str, Any]]:
    """Points of runs that differ in clearance."""
    travel = "gap" if "gap" in scene else "clearance"
    for factor in 1.0 + WIDTH * (np.arange(runs) - 0.5 * (runs - 1)) / runs:
        yield {**scene, travel: scene[travel] * float(factor)}


def rigid_part(scene: Scene) -> dict[str, Any]:
    """The scene without those of other models."""
    others = {name for names in MODEL_NAMES.values() for name in names}
    return {name: value for name, value in scene.items() if name not in others}
