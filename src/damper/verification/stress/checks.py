"""The runs of a stress study, with what the observer `laws` finds of each."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from damper.engine.segment import COLUMNS
from damper.engine.trajectory import DEFAULT_ACCURACY, LOG_ROWS
from damper.models import start_run
from damper.observers.common.base import Window
from damper.observers.laws import Laws
from damper.parameters.quantity import whole
from damper.parameters.run import EngineSettings
from damper.sweep.parts import PartData
from damper.sweep.points import Point, read_point
from damper.verification.stress import box
from damper.verification.stress.box import points_of
from damper.verification.stress.outcomes import REFUSED


def run_part(
    needed: Sequence[PartData],
    *,
    periods: int,
    accuracy: float,
    max_events: int = 1_000_000_000,
    longest: float | None = None,
    run: Mapping[str, float] | None = None,
    corners: Mapping[str, Any] | None = None,
    random: Mapping[str, Any] | None = None,
    part: tuple[int, int] = (0, 1),
) -> PartData:
    """Make one part of a study's runs and check each of them, as a job of the workflow.

    The runs are one `run`, or a `part` of those of `box.corners` or `box.random_points`.
    """
    if run is not None:
        runs: Sequence[Mapping[str, float]] = [run]
    elif corners is not None:
        runs = box.part(box.corners(**corners), *part)
    else:
        runs = box.random_points(**random or {}, which=part)
    arrays = run_checks(
        runs, periods, accuracy, max_events, longest=math.inf if longest is None else longest
    )
    return PartData(points_of(runs) | arrays)


def run_checks(
    points: Iterable[Mapping[str, float]],
    periods: int,
    accuracy: float = DEFAULT_ACCURACY,
    max_events: int = 100_000,
    *,
    longest: float = math.inf,
) -> dict[str, np.ndarray]:
    """Run every point and check it; a run ends with the period in which `longest` has passed.

    Returns the variables of `Laws`; ``status`` as the engine's, `REFUSED` where the parameters were
    refused with an error; ``events``, ``evaluations`` of the flow, and ``periods`` asked for; an
    array (points,) each.
    """
    EngineSettings(accuracy=accuracy, max_events=max_events)  # refused before anything is run
    periods = whole("periods", periods, 1)
    read = [_read(values) for values in points]
    laws = Laws()
    laws.allocate(len(read), periods)
    count = len(read)
    arrays: dict[str, Any] = {
        "status": np.full(count, REFUSED, dtype="i1"),
        "events": np.zeros(count, dtype="i8"),
        "evaluations": np.zeros(count, dtype="i8"),
        "periods": np.zeros(count, dtype="i8"),
    }
    buffer = np.empty((LOG_ROWS, COLUMNS))
    for number, point in enumerate(read):
        try:
            if point is None:
                continue
            trajectory = start_run(point.parameters, point.start(), accuracy, max_events)
        except ValueError:
            continue
        first, time = trajectory.start
        length = int(periods)
        if longest < length * trajectory.period:
            length = max(math.ceil(longest / trajectory.period), 1)
        laws.begin(number, trajectory, Window(first, time, length))
        for log in trajectory.segments(first + length, time, buffer):
            laws.observe(log)
        laws.finish(trajectory.status == 0)
        arrays["status"][number] = trajectory.status
        arrays["events"][number] = trajectory.events
        arrays["evaluations"][number] = trajectory.evaluations
        arrays["periods"][number] = length
    return arrays | laws.arrays


def _read(values: Mapping[str, float]) -> Point | None:
    try:
        return read_point(values)
    except ValueError:
        return None
