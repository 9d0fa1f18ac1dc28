"""Condition of a run: how far roundoff alone may move its events, apart from the method's errors.

The same point is run again with noise (`damper.verification.metamorphic.runs.noisy_run`):
parameters and start, and after each event state and phase, are changed by some 4000 units of
roundoff. How much further off than that the events come is their condition. Past a grazing, at the
border between two outcomes, or some dozen impacts into a chaotic run, other events follow
altogether; from there on a comparison is meaningless for the method, and each step has to be judged
by itself (`damper.verification.metamorphic.backward`).
"""

from typing import NamedTuple

import numpy as np

from damper.engine.roundoff import EPSILON
from damper.engine.segment import GAP_RATE, SPEED, V, X
from damper.parameters import Parameters, State
from damper.verification.metamorphic.runs import Events, ShortRun, events_of, noisy_run

#: Noise, as a part of each number.
NOISE = 2.0**-40
#: Noisy runs of each run. One alone may come out close to the original by accident.
NOISY_RUNS = 2
#: Differences that roundoff alone may grow to before a comparison is meaningless.
POINTLESS = 1e-6


class Condition(NamedTuple):
    """How sharply the events of one run are determined."""

    growth: np.ndarray
    """(events,): largest difference of the noisy runs so far over the noise, at least 1."""
    comparable: int
    """Events up to which comparisons make sense: roundoff stays below `POINTLESS`, and the
    noisy runs have the same events."""


class Scale(NamedTuple):
    """Sizes by which differences of two runs are measured."""

    period: float
    omega: float
    values: np.ndarray
    """(3, 1): of displacement, velocity and approach speed."""


def condition_of(
    run: ShortRun, state: State | None, *, periods: float, events: int, random: np.random.Generator
) -> Condition:
    """Measure the condition of a short run by noisy runs from the same start."""
    original = events_of(run)
    scale = scale_of(run, original)
    count = len(original.kind)
    growth = np.ones(count)
    comparable = count
    for _ in range(NOISY_RUNS):
        noisy = noisy_run(
            run.parameters, state, periods=periods, events=events, size=NOISE, random=random
        )
        other = events_of(noisy)
        same = matching(original, other)
        comparable = min(comparable, same)
        found = differences(original, other, slice(0, same), slice(0, same), scale) / NOISE
        growth[:same] = np.maximum(growth[:same], found)
    growth = np.maximum.accumulate(growth)
    limit = int(np.searchsorted(growth[:comparable], POINTLESS / EPSILON))
    return Condition(growth, min(comparable, limit))


def scale_of(run: ShortRun, events: Events) -> Scale:
    """Sizes of a run: its largest displacement and speed at events and at the start."""
    p: Parameters = run.parameters
    length = float(np.abs(run.log[:, X]).max())
    speed = float(np.abs(run.log[:, [V, GAP_RATE, SPEED]]).max())
    if run.end is not None:
        length = max(length, abs(float(events.values[0, -1])))
        speed = max(speed, abs(float(events.values[1, -1])))
    # At a turn, or in passing zero, the one says how large the other is.
    speed = max(speed, p.frequency_ratio * length)
    length = max(length, speed / max(1.0, p.frequency_ratio))
    tiny = np.finfo(float).tiny
    values = np.array([[length], [speed], [speed]])
    return Scale(p.cycle, p.frequency_ratio, np.maximum(values, tiny))


def matching(a: Events, b: Events) -> int:
    """Count events that are the same in kind and side, from the first one on."""
    count = min(len(a.kind), len(b.kind))
    same = (a.kind[:count] == b.kind[:count]) & (a.side[:count] == b.side[:count])
    return count if same.all() else int(np.argmin(same))


def differences(
    a: Events, b: Events, of_a: slice | np.ndarray, of_b: slice | np.ndarray, scale: Scale
) -> np.ndarray:
    """Difference of pairs of events: the largest of forcing phase, displacement and speeds.

    In radians and relative to the run's sizes.
    """
    shift = (a.periods[of_a] - b.periods[of_b]) * scale.period + (a.time[of_a] - b.time[of_b])
    values = np.abs(a.values[:, of_a] - b.values[:, of_b]) / scale.values
    return np.maximum(np.abs(shift) * scale.omega, values.max(axis=0, initial=0.0))
