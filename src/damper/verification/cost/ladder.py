"""A ladder of scenes: time per event and peak memory against the bare engine of the same scene.

A rung is a scene and what is observed in it. Observed runs are those of `damper.sweep.runs`, as in
every simulation job; the bare engine reads the same points and runs them without observers. The
first rung is the base: the bare engine of every other scene is compared with that of the first, and
the bare engine of another model also with a rigid damper of the same numbers.
"""

import gc
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from damper.engine.compiled import compile_at_once
from damper.engine.loop import FINISHED
from damper.engine.segment import COLUMNS
from damper.engine.trajectory import LOG_ROWS
from damper.models import start_run
from damper.parameters.quantities import MODEL_NAMES
from damper.sweep.points import read_point
from damper.sweep.runs import run_points
from damper.verification.cost.paired import spread, take_turns
from damper.verification.cost.process import fresh, peak_memory

Observers = Mapping[str, Mapping[str, Any] | None]

#: Events that no run makes: one that stops early would cost less than it should.
NO_BUDGET = 10**12
#: Lanes differ in clearance by up to this part, so that none is a copy of another.
SPREAD = 0.02


@dataclass(frozen=True)
class Rung:
    """A scene, dimensionless or in SI units, and what is observed in it."""

    name: str
    parameters: Mapping[str, float]
    observers: Observers = field(default_factory=dict)

    def points(self, lanes: int) -> list[dict[str, float]]:
        """Return points of so many lanes."""
        travel = "gap" if "gap" in self.parameters else "clearance"
        values = dict(self.parameters)
        return [
            values | {travel: values[travel] * float(factor)}
            for factor in (np.linspace(1.0 - SPREAD, 1.0 + SPREAD, lanes) if lanes > 1 else (1.0,))
        ]

    @property
    def model(self) -> str:
        """Model of the damper that the parameters ask for."""
        return read_point(self.parameters).parameters.model

    @property
    def rigid(self) -> "Rung":
        """The same numbers without what makes it another model."""
        return Rung(self.name, rigid_part(self.parameters))


def read_rungs(rungs: Mapping[str, Mapping[str, Any]]) -> list[Rung]:
    """Read a ladder.

    Parameters
    ----------
    rungs : mapping of str to mapping
        Name -> ``parameters``, and ``observers`` as for `damper.observers.make_observers`.

    Raises
    ------
    ValueError, TypeError
        For an unknown key, parameter or value out of range.

    Examples
    --------
    >>> scene = {"mass_ratio": 0.1, "damping_ratio": 0.05, "frequency_ratio": 0.8,
    ...          "clearance": 1.0, "restitution": 0.6}
    >>> [rung] = read_rungs({"impacts alone": {"parameters": scene, "observers": ["impacts"]}})
    >>> rung.model, rung.observers
    ('rigid', {'impacts': None})
    """
    made = []
    for name, given in rungs.items():
        unknown = set(given) - {"parameters", "observers"}
        if unknown:
            raise ValueError(f"rung {name!r}: unknown key {unknown.pop()!r}: parameters, observers")
        observers = given.get("observers") or {}
        if not isinstance(observers, Mapping):
            observers = dict.fromkeys(observers)
        rung = Rung(name, given["parameters"], observers)
        read_point(rung.parameters)
        made.append(rung)
    return made


def rigid_part(parameters: Mapping[str, float]) -> dict[str, float]:
    """Parameters without those of other models."""
    others = {name for names in MODEL_NAMES.values() for name in names}
    return {name: value for name, value in parameters.items() if name not in others}


def bare(points: Iterable[Mapping[str, float]], periods: int) -> int:
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


def observed(points: Sequence[Mapping[str, float]], periods: int, observers: Observers) -> int:
    """Run points as a simulation job does; return the bytes of what the observers keep."""
    compile_at_once()
    arrays, _ = run_points(points, observers, transient=0, periods=periods, max_events=NO_BUDGET)
    log = LOG_ROWS * COLUMNS * 8 if observers else 0
    return log + sum(array.nbytes for array in arrays.values())


def climb(
    rungs: Sequence[Rung], *, lanes: int, periods: int, repeats: int, memory: bool = True
) -> dict[str, Any]:
    """Measure a ladder.

    Parameters
    ----------
    rungs : sequence of Rung
        The first one is the base.
    lanes, periods : int
        What each run of a rung consists of.
    repeats : int
    memory : bool
        Whether to measure memory as well, in one process for each scene and rung.

    Returns
    -------
    dict
        ``noise``: ratio of two runs that are the same, [lower quartile, median, upper quartile].
        ``rungs``: name -> ``model``, ``observers``, ``parameters``, ``events``; times in us per
        event ``bare``, ``time`` and ``more``, their difference; ratios ``over_bare``,
        ``over_base`` (of the bare engines) and, for other models, ``over_rigid``, all with
        quartiles; ``memory``, see `memories`.
    """
    scenes = [rung.points(lanes) for rung in rungs]
    cases: list[Callable[[], Any]] = [partial(bare, scenes[0], periods)] * 2
    places = []
    for rung, points in zip(rungs, scenes, strict=True):
        place = {"bare": len(cases)}
        cases.append(partial(bare, points, periods))
        place["time"] = len(cases)
        cases.append(partial(observed, points, periods, rung.observers))
        if rung.model != "rigid":
            place["rigid"] = len(cases)
            cases.append(partial(bare, rung.rigid.points(lanes), periods))
        places.append(place)
    # The first run compiles.
    counts = [case() for case in cases]
    gc.collect()
    gc.disable()
    try:
        seconds = take_turns(cases, repeats)
    finally:
        gc.enable()
    base = seconds[:, 0] / counts[0]
    found: dict[str, Any] = {}
    for rung, place in zip(rungs, places, strict=True):
        events = counts[place["bare"]]
        alone = seconds[:, place["bare"]] / events
        whole = seconds[:, place["time"]] / events
        entry = {
            "model": rung.model,
            "observers": list(rung.observers),
            "parameters": dict(rung.parameters),
            "events": events,
            "bare": spread(1e6 * alone),
            "time": spread(1e6 * whole),
            "more": spread(1e6 * (whole - alone)),
            "over_bare": spread(whole / alone),
            "over_base": spread(alone / base),
        }
        if "rigid" in place:
            rigid = seconds[:, place["rigid"]] / counts[place["rigid"]]
            entry["over_rigid"] = spread(alone / rigid)
        found[rung.name] = entry
    if memory:
        for rung, entry in zip(rungs, memories(rungs, lanes, periods), strict=True):
            found[rung.name]["memory"] = entry
    return {
        "lanes": lanes,
        "periods": periods,
        "repeats": repeats,
        "noise": spread(seconds[:, 1] / seconds[:, 0]),
        "rungs": found,
    }


def memories(rungs: Sequence[Rung], lanes: int, periods: int) -> list[dict[str, int]]:
    """Return peak memory of every rung in bytes.

    Returns
    -------
    list of dict
        ``bare``: of a process that runs the bare engine of the scene; ``peak``: of one that also
        observes it; ``more``: their difference, which holds the observers' code as well;
        ``asked``: log buffer and arrays, as large as what is asked for.
    """
    tasks = [
        {"points": rung.points(lanes), "periods": periods, "observers": observers}
        for rung in rungs
        for observers in (None, dict(rung.observers))
    ]
    # Many rungs have the same scene, and memory does not depend on what else the machine does.
    names = [json.dumps(task) for task in tasks]
    once = dict(zip(names, tasks, strict=True))
    with ThreadPoolExecutor(2) as pool:
        peaks = pool.map(lambda task: fresh(f"{__name__}:memory_of", **task), once.values())
        found = dict(zip(once, peaks, strict=True))
    measured = [found[name] for name in names]
    return [
        {
            "bare": alone["peak"],
            "peak": whole["peak"],
            "more": whole["peak"] - alone["peak"],
            "asked": whole["asked"],
        }
        for alone, whole in zip(measured[::2], measured[1::2], strict=True)
    ]


def memory_of(
    points: Sequence[Mapping[str, float]], periods: int, observers: Observers | None
) -> dict[str, int]:
    """Return the peak of this process in bytes after a run; None is the bare engine."""
    if observers is None:
        bare(points, periods)
        return {"peak": peak_memory(), "asked": 0}
    asked = observed(points, periods, observers)
    return {"peak": peak_memory(), "asked": asked}
