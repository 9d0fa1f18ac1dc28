"""Metamorphic tests: points run again in ways that must give the same events.

Mirrored (phase + pi, all signs changed, that of gravity too), started some whole cycles
later, taken to SI units and back, and with a sharper and a looser accuracy, a run must give the
same events. How closely is a matter of its condition
(`damper.verification.metamorphic.condition`); where that leaves nothing to compare, both runs are
judged step by step: by the laws that a log must keep (the observer `laws`), and those of the rigid
damper without gravity by their backward error too (`damper.verification.metamorphic.backward`). No
run is dropped.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from damper.engine.roundoff import EPSILON
from damper.engine.segment import STICK
from damper.engine.trajectory import DEFAULT_ACCURACY
from damper.models import start_run
from damper.observers.common.base import Window
from damper.observers.common.laws import LAW_NAMES, excess
from damper.observers.laws import Laws
from damper.parameters import Parameters, SIParameters, State
from damper.parameters.quantities import ALL, DIMENSIONLESS_NAMES
from damper.sweep.branches import draw
from damper.sweep.parts import PartData
from damper.sweep.points import read_point
from damper.verification.metamorphic import verdicts
from damper.verification.metamorphic.backward import LONG, residuals
from damper.verification.metamorphic.condition import (
    Condition,
    Scale,
    condition_of,
    differences,
    matching,
    scale_of,
)
from damper.verification.metamorphic.runs import END, REST, Events, ShortRun, events_of, short_run

#: Whole periods by which a run is shifted. Of the second one the time is exact.
SHIFT, FAR_SHIFT = 3.0, 2.0**20
#: Error of completion times, where it is not the default.
ACCURACIES = {"sharper": 1e-14, "looser": 1e-10}
#: Random units that are tried.
_DRAWS = 20
#: Short runs.
RUN_PERIODS, RUN_EVENTS = 20, 100

_BACKWARD = tuple(f"backward_{name}" for name in (*verdicts.CHECKS, "error"))
#: What is known of a point that is refused with an error.
_REFUSED_ROW: dict[str, float] = {
    **dict.fromkeys(("growth", *_BACKWARD, "laws_excess"), math.nan),
    **{f"{name}_{of}": math.nan for name in verdicts.RELATIONS for of in ("difference", "ratio")},
    **{f"{name}_verdict": verdicts.NOT_APPLICABLE for name in verdicts.RELATIONS},
    "comparable_events": 0,
    "compared_of_events": 0,
}


class _Source(NamedTuple):
    """A run as it is, with all that it is compared by."""

    parameters: Parameters
    state: State
    events: Events
    scale: Scale
    condition: Condition
    size: dict[str, int]
    """Periods and events of it: keywords of `short_run`."""


class _FollowUp(NamedTuple):
    """The run of a point in another way, its start, and its events taken back."""

    run: ShortRun
    state: State
    events: Events


def run_part(
    needed: Sequence[PartData], draws: Mapping[str, Any], first: int, end: int
) -> PartData:
    """Run the draws from `first` to before `end` again, as a job of the workflow."""
    drawn = {name: values[first:end] for name, values in draw(draws).items()}
    points = [dict(zip(drawn, point, strict=True)) for point in zip(*drawn.values(), strict=True)]
    given = {
        name: np.array(drawn.get(name, [ALL[name].default] * len(points)), dtype=float)
        for name in DIMENSIONLESS_NAMES
    }
    return PartData(given | run_metamorphic(points, seed=draws["seed"], first=first))


def run_metamorphic(
    points: Iterable[Mapping[str, float]],
    *,
    periods: int = RUN_PERIODS,
    events: int = RUN_EVENTS,
    seed: int = 0,
    first: int = 0,
) -> dict[str, np.ndarray]:
    """Run each point again in other ways, and compare: arrays of `METAMORPHIC_VARIABLES`.

    Noise and units are random by the seed and the number of the run, from `first` on: what comes of
    a run does not depend on the part it is in.
    """
    rows = [
        _row(point, {"periods": periods, "events": events}, np.random.default_rng((seed, number)))
        for number, point in enumerate(points, first)
    ]
    return {name: np.array([row[name] for row in rows], _kind_of(name)) for name in _REFUSED_ROW}


def _kind_of(name: str) -> str:
    if name.endswith("_verdict"):
        return "i1"
    return "i4" if name.endswith("_events") else "f8"


def _row(
    values: Mapping[str, float], size: dict[str, int], random: np.random.Generator
) -> dict[str, float]:
    row = dict(_REFUSED_ROW)
    try:
        point = read_point(values)
        parameters, state = point.parameters, point.start() or REST
        start_run(parameters, state)
    except ValueError:
        return row
    run = short_run(parameters, state, **size)
    events = events_of(run)
    condition = condition_of(run, state, **size, random=random)
    source = _Source(parameters, state, events, scale_of(run, events), condition, size)
    own = _judged(run, state, DEFAULT_ACCURACY)
    row |= own | {
        "growth": float(condition.growth[-1]) if len(condition.growth) else 1.0,
        "comparable_events": condition.comparable,
        "compared_of_events": len(events.kind),
    }
    for name in verdicts.RELATIONS:
        other = _FOLLOW_UPS[name](source, random)
        if other is None:
            continue
        error = max(ACCURACIES[name], DEFAULT_ACCURACY) if name in ACCURACIES else 0.0
        difference, ratio, agrees = _compare(source, other.events, error)
        verdict = verdicts.PASSED
        if not agrees:
            # A step of the other run is as right or wrong as one of this one.
            theirs = _judged(other.run, other.state, max(error, DEFAULT_ACCURACY))
            verdict = (
                verdicts.PASSED_BY_STEPS if _sound(own) and _sound(theirs) else verdicts.FAILED
            )
        found = {"difference": difference, "ratio": ratio, "verdict": verdict}
        row |= {f"{name}_{what}": value for what, value in found.items()}
    return row


def _sound(found: Mapping[str, float]) -> bool:
    return found["laws_excess"] <= 1.0 and not found["backward_error"] > verdicts.SOUND


def _judged(run: ShortRun, state: State, accuracy: float) -> dict[str, float]:
    """Largest violation of a law over its limit, and the backward error."""
    laws = Laws()
    laws.allocate(1, 1)
    trajectory = start_run(run.parameters, state, accuracy)
    laws.begin(0, trajectory, Window(*trajectory.start, 1))
    laws.observe(run.log)
    laws.finish(run.end is not None)
    segments = laws.arrays["segments"]
    far = [excess(name, laws.arrays[name], segments)[0] for name in LAW_NAMES]
    found = dict.fromkeys(_BACKWARD, math.nan) | {"laws_excess": float(np.nanmax(far))}
    if run.parameters.model == "rigid" and LONG and not run.parameters.gravity:
        left = residuals(run.parameters, run.log)
        worst = {name: float(np.max(values, initial=0.0)) for name, values in left.items()}
        found |= {f"backward_{name}": value for name, value in worst.items()}
        found["backward_error"] = float(np.max(list(worst.values())))
    return found


def _compare(source: _Source, other: Events, error: float) -> tuple[float, float, bool]:
    """Largest difference, its ratio to what is allowed, and whether that is enough."""
    own = source.events
    if error:
        of_own, of_other, whole = _aligned(own, other)
    else:
        whole = matching(own, other)
        of_own = of_other = np.arange(whole)
    within = of_own < source.condition.comparable
    of_own, of_other = of_own[within], of_other[within]
    agrees = source.condition.comparable == len(own.kind) and whole == len(own.kind)
    if not len(of_own):
        return math.nan, math.nan, agrees
    found = differences(own, other, of_own, of_other, source.scale)
    growth = source.condition.growth[of_own]
    # The error is in units of time; of the cycle's, where that is shorter.
    ratio = float(np.max(found / (verdicts.ALLOWANCE * EPSILON * growth + error * (1.0 + growth))))
    return float(found.max()), ratio, agrees and ratio <= 1.0


def _aligned(a: Events, b: Events) -> tuple[np.ndarray, np.ndarray, int]:
    """Pair events of two accuracies: bursts have more or fewer impacts before they are closed.

    Of the impacts up to the next beginning of sticking the last ones are left out, so that there
    are as many in both runs. Returns the numbers of the events in each pair, and how many events of
    `a` are paired or left out, up to the first pair of different kinds.
    """
    pairs: list[tuple[int, int]] = []
    begin_a = begin_b = 0
    for end_a, end_b in zip(_ends(a), _ends(b), strict=False):
        count = min(end_a - begin_a, end_b - begin_b)
        pairs += [(begin_a + k, begin_b + k) for k in range(count)]
        # More events than fit a list are no disagreement.
        if not (_cut(a, end_a) or _cut(b, end_b)):
            pairs.append((end_a, end_b))
        begin_a, begin_b = end_a + 1, end_b + 1
    of_a, of_b = np.array(pairs, dtype=int).reshape(-1, 2).T
    same = (a.kind[of_a] == b.kind[of_b]) & (a.side[of_a] == b.side[of_b])
    if same.all():
        return of_a, of_b, len(a.kind)
    first = int(np.argmin(same))
    return of_a[:first], of_b[:first], int(of_a[first])


def _ends(events: Events) -> list[int]:
    """Numbers of the events at which sticking begins, and of the last one."""
    last = [len(events.kind) - 1] if len(events.kind) else []
    return np.union1d(np.flatnonzero(events.kind == STICK), last).astype(int).tolist()


def _cut(events: Events, number: int) -> bool:
    """Whether an event is the last one of a list that ends before its run."""
    return number == len(events.kind) - 1 and events.kind[number] != END


def _mirrored(source: _Source, random: np.random.Generator) -> _FollowUp:
    # The sine of the rounded pi is 1.2e-16, not zero: this is exact to roundoff only.
    p = source.parameters
    parameters = replace(p, phase=p.phase + math.pi, gravity=0.0 - p.gravity)
    if p.restitution_left != math.inf:
        left, right = p.restitutions
        parameters = replace(parameters, restitution=left, restitution_left=right)
    s = source.state
    state = State(-s.x, -s.v, -s.y, -s.u, s.time)
    run = short_run(parameters, state, **source.size)
    found = events_of(run)
    values = found.values * np.array([[-1.0], [-1.0], [1.0]])
    return _FollowUp(run, state, found._replace(side=-found.side, values=values))


def _later(periods: float) -> Callable[[_Source, np.random.Generator], _FollowUp | None]:
    def later(source: _Source, random: np.random.Generator) -> _FollowUp | None:
        p = source.parameters
        if p.model == "time_varying" and math.fmod(periods, p.modulation_order):
            return None
        state = replace(source.state, time=source.state.time + periods * p.cycle)
        run = short_run(p, state, **source.size)
        found = events_of(run)
        shifted = np.where(found.kind == END, 0.0, found.periods - periods)
        return _FollowUp(run, state, found._replace(periods=shifted))

    return later


def _units(source: _Source, random: np.random.Generator) -> _FollowUp | None:
    for _ in range(_DRAWS):
        try:
            primary = (10.0 ** random.uniform(-3.0, 3.0, 3)).tolist()
            si = SIParameters.of(source.parameters, *primary)
            break
        except ValueError:
            # At the edge of a range roundoff may lead out of it.
            continue
    else:
        return None
    units, s = si.units, source.state
    sizes = units.length, units.speed, units.length, units.speed, units.time
    state = State(*(a * b for a, b in zip((s.x, s.v, s.y, s.u, s.time), sizes, strict=True)))
    back = state.over(units)
    run = short_run(si.dimensionless, back, **source.size)
    return _FollowUp(run, back, events_of(run))


def _accurate(accuracy: float) -> Callable[[_Source, np.random.Generator], _FollowUp]:
    def accurate(source: _Source, random: np.random.Generator) -> _FollowUp:
        run = short_run(source.parameters, source.state, **source.size, accuracy=accuracy)
        return _FollowUp(run, source.state, events_of(run))

    return accurate


_FOLLOW_UPS: dict[str, Callable[[_Source, np.random.Generator], _FollowUp | None]] = {
    "mirrored": _mirrored,
    "shifted": _later(SHIFT),
    "shifted_far": _later(FAR_SHIFT),
    "units": _units,
    **{name: _accurate(accuracy) for name, accuracy in ACCURACIES.items()},
}
