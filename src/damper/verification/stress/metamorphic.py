"""Metamorphic tests: points run again in ways that must give the same events.

Mirrored (phase + pi, all signs changed), started some whole forcing periods later, taken to SI
units and back, and with a sharper and a looser accuracy, a run must give the same events. How
closely is a matter of its condition (`damper.verification.stress.condition`); where that leaves
nothing to compare, both runs are judged by their backward error
(`damper.verification.stress.backward`), or, of other models than the rigid one, by the laws that a
log must keep (`damper.verification.stress.checks`). No run is dropped.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from damper.engine.segment import DURATION, IMPACT, PERIODS, RELEASE, STICK, TIME
from damper.engine.trajectory import DEFAULT_ACCURACY
from damper.models import start_run
from damper.observers.common.base import Window
from damper.parameters import Parameters, SIParameters, State, Units
from damper.sweep.events import events as list_events
from damper.sweep.points import read_point
from damper.verification.stress.backward import backward_error
from damper.verification.stress.checks import Laws
from damper.verification.stress.condition import (
    Condition,
    Scale,
    condition_of,
    differences,
    matching,
    scale_of,
)
from damper.verification.stress.laws import LAW_NAMES, excess
from damper.verification.stress.runs import END, REST, Events, ShortRun, events_of, short_run
from damper.verification.stress.verdicts import (
    ALLOWANCE,
    CHECKS,
    EPS,
    FAILED,
    NOT_APPLICABLE,
    PASSED,
    PASSED_BACKWARD,
    PASSED_LAWS,
    REFUSED,
    RELATIONS,
    SOUND,
)

#: Whole periods by which a run is shifted. Of the second one the time is exact.
SHIFT, FAR_SHIFT = 3.0, 2.0**20
SHARPER, LOOSER = 1e-14, 1e-10
#: Random units that are tried.
_DRAWS = 20
#: Short runs.
RUN_PERIODS, RUN_EVENTS = 20, 100


#: What there is of a run that another judge, or none, looked at.
_UNJUDGED = {
    **{f"backward_{name}": math.nan for name in (*CHECKS, "error", "displacement", "closing")},
    "laws_excess": math.nan,
}


def _results(name: str, difference: float, ratio: float, verdict: int) -> dict[str, float]:
    return {
        f"{name}_difference": difference,
        f"{name}_ratio": ratio,
        f"{name}_verdict": verdict,
    }


#: What is known of a point that is refused with an error.
_REFUSED_ROW: dict[str, float] = {
    "growth": math.nan,
    "comparable_events": 0,
    "compared_of_events": 0,
    "condition": REFUSED,
    **_UNJUDGED,
}
for _name in RELATIONS:
    _REFUSED_ROW |= _results(_name, math.nan, math.nan, NOT_APPLICABLE)


class _Source(NamedTuple):
    """A run as it is, with all that it is compared by."""

    parameters: Parameters
    state: State
    run: ShortRun
    events: Events
    scale: Scale
    condition: Condition
    periods: int
    most_events: int


class _FollowUp(NamedTuple):
    """The run of a point in another way, and its events taken back."""

    run: ShortRun
    state: State
    """Its start."""
    events: Events


def run_metamorphic(
    points: Iterable[Mapping[str, float]],
    *,
    periods: int = RUN_PERIODS,
    events: int = RUN_EVENTS,
    seed: int = 0,
    first: int = 0,
) -> dict[str, np.ndarray]:
    """Run each point again in other ways, and compare.

    Parameters
    ----------
    points : iterable of mapping
        Names and values for `damper.sweep.points.read_point`, dimensionless.
    periods, events : int
        Forcing periods of a run, and the events after which it is enough.
    seed : int
        Of noise and units, with the number of the source.
    first : int
        Number of the first run: what comes of a run does not depend on the part it is in.

    Returns
    -------
    dict of str to ndarray (points,)
        ``growth`` of the noise over the run, ``comparable_events`` and ``compared_of_events`` (all
        of them), ``condition`` (0 well-conditioned, 1 growth, 2 grazing, 3 border of two
        outcomes, -1 refused with an error: no run). The backward error, nan where there is none:
        ``backward_<check>`` and the largest, ``backward_error``, and beside them
        ``backward_displacement``, all in units of roundoff (2^-52), and ``backward_closing`` over
        the accuracy asked for. Of other models than the rigid one ``laws_excess``, the largest
        violation of a law over its limit. For each relation ``<relation>_difference``, the largest
        of the comparable events, ``<relation>_ratio`` to what the condition allows (nan: none to
        compare), and ``<relation>_verdict``: -1 not applicable, 0 passed, 1 passed by backward
        error, 2 failed, 3 passed by the laws.
    """
    rows = [
        _row(point, periods, events, np.random.default_rng((seed, first + number)))
        for number, point in enumerate(points)
    ]
    if not rows:
        return {}
    return {name: np.array([row[name] for row in rows], dtype=_kind_of(name)) for name in rows[0]}


def _kind_of(name: str) -> str:
    if name.endswith("_verdict") or name == "condition":
        return "i1"
    return "i4" if name.endswith("_events") else "f8"


def _row(
    values: Mapping[str, float], periods: int, count: int, random: np.random.Generator
) -> dict[str, float]:
    row = dict(_REFUSED_ROW)
    try:
        point = read_point(values)
        parameters, state = point.parameters, point.start() or REST
        start_run(parameters, state)
    except ValueError:
        return row
    run = short_run(parameters, state, periods=periods, events=count)
    events = events_of(run)
    condition = condition_of(run, state, periods=periods, events=count, random=random)
    source = _Source(
        parameters, state, run, events, scale_of(run, events), condition, periods, count
    )
    own = _judged(run, state)
    row |= {
        "growth": float(condition.growth[-1]) if len(condition.growth) else 1.0,
        "comparable_events": condition.comparable,
        "compared_of_events": len(events.kind),
        "condition": condition.kind,
        **own,
    }
    for name in RELATIONS:
        other = _FOLLOW_UPS[name](source, random)
        if other is None:
            continue
        accuracy = {"looser": LOOSER, "sharper": DEFAULT_ACCURACY}.get(name, 0.0)
        difference, ratio, agrees = _compare(source, other.events, accuracy)
        verdict = PASSED
        if not agrees:
            # A step of the other run is as right or wrong as one of this one.
            asked = accuracy if name == "looser" else DEFAULT_ACCURACY
            sound = _sound(own, parameters)
            sound = sound and _sound(_judged(other.run, other.state, asked), parameters)
            passed = PASSED_BACKWARD if parameters.model == "rigid" else PASSED_LAWS
            verdict = passed if sound else FAILED
        row |= {
            f"{name}_difference": difference,
            f"{name}_ratio": ratio,
            f"{name}_verdict": verdict,
        }
    return row


def _sound(found: Mapping[str, float], p: Parameters) -> bool:
    if p.model != "rigid":
        return found["laws_excess"] <= 1.0
    # Slow forcing: accuracy is in units of 1 / omega.
    slow = max(1.0, 1.0 / p.frequency_ratio)
    return found["backward_error"] <= SOUND and found["backward_closing"] <= slow


def _judged(run: ShortRun, state: State, accuracy: float = DEFAULT_ACCURACY) -> dict[str, float]:
    """Backward error of a run, or its violations of the laws."""
    p = run.parameters
    if p.model != "rigid":
        return _UNJUDGED | {"laws_excess": _laws_excess(run, state, accuracy)}
    found = backward_error(p, run.log)
    return _UNJUDGED | {
        **{f"backward_{name}": found[name] for name in CHECKS},
        "backward_error": float(np.max([found[name] for name in CHECKS])),
        "backward_displacement": found["displacement"],
        "backward_closing": found["closing"] / (accuracy / max(1.0, p.frequency_ratio)),
    }


def _laws_excess(run: ShortRun, state: State, accuracy: float) -> float:
    """Largest violation of a law over its limit."""
    laws = Laws()
    laws.allocate(1, 1)
    trajectory = start_run(run.parameters, state, accuracy)
    laws.begin(0, trajectory, Window(*trajectory.start, 1))
    laws.observe(run.log)
    laws.finish(run.end is not None)
    segments = laws.arrays["segments"]
    found = np.array([excess(name, laws.arrays[name], segments)[0] for name in LAW_NAMES])
    return float(np.nanmax(found))


def _compare(source: _Source, other: Events, accuracy: float) -> tuple[float, float, bool]:
    """Largest difference, its ratio to what is allowed, and whether that is enough."""
    own = source.events
    if accuracy:
        of_own, of_other, whole = _aligned(own, other)
    else:
        same = matching(own, other)
        of_own = of_other = np.arange(same)
        whole = same
    within = of_own < source.condition.comparable
    of_own, of_other = of_own[within], of_other[within]
    agrees = source.condition.comparable == len(own.kind) and whole == len(own.kind)
    if not len(of_own):
        return math.nan, math.nan, agrees
    found = differences(own, other, of_own, of_other, source.scale)
    allowed = ALLOWANCE * EPS * source.condition.growth[of_own]
    if accuracy:
        # In units of time; of the forcing period's, where that is shorter.
        allowed = allowed + accuracy * (1.0 + source.condition.growth[of_own])
    ratio = float(np.max(found / allowed))
    return float(found.max()), ratio, agrees and ratio <= 1.0


def _aligned(a: Events, b: Events) -> tuple[np.ndarray, np.ndarray, int]:
    """Pair events of two accuracies: bursts have more or fewer impacts before they are closed.

    Returns
    -------
    of_a, of_b : ndarray (pairs,)
        Numbers of the events in a pair.
    whole : int
        Events of `a` that are paired, or left out at the end of a burst.
    """
    pairs_a, pairs_b = [], []
    i = j = 0
    while i < len(a.kind) and j < len(b.kind):
        run = matching(_from(a, i), _from(b, j))
        pairs_a.append(np.arange(i, i + run))
        pairs_b.append(np.arange(j, j + run))
        i, j = i + run, j + run
        if i == len(a.kind) or j == len(b.kind):
            break
        before = i, j
        if a.kind[i] == STICK and b.kind[j] == IMPACT:
            j = _closed(b, j, a.side[i])
        elif b.kind[j] == STICK and a.kind[i] == IMPACT:
            i = _closed(a, i, b.side[j])
        if (i, j) == before:
            break
    empty = np.zeros(0, dtype=int)
    # More events than fit the list are no disagreement.
    whole = len(a.kind) if i < len(a.kind) and j == len(b.kind) else i
    return np.concatenate((empty, *pairs_a)), np.concatenate((empty, *pairs_b)), whole


def _from(events: Events, start: int) -> Events:
    return events._replace(kind=events.kind[start:], side=events.side[start:])


def _closed(events: Events, start: int, side: float) -> int:
    """Where a burst on a wall ends in sticking, or the list does; start if neither."""
    for number in range(start, len(events.kind)):
        if events.side[number] != side or events.kind[number] == RELEASE:
            return start
        if events.kind[number] == STICK:
            return number
    return len(events.kind)


def _again(source: _Source, parameters: Parameters, state: State, **more: float) -> ShortRun:
    return short_run(parameters, state, periods=source.periods, events=source.most_events, **more)


def _mirrored(source: _Source, random: np.random.Generator) -> _FollowUp:
    # The sine of the rounded pi is 1.2e-16, not zero: this is exact to roundoff only.
    parameters = replace(source.parameters, phase=source.parameters.phase + math.pi)
    s = source.state
    state = State(-s.x, -s.v, -s.y, -s.u, s.time)
    run = _again(source, parameters, state)
    found = events_of(run)
    values = found.values * np.array([[-1.0], [-1.0], [1.0]])
    return _FollowUp(run, state, found._replace(side=-found.side, values=values))


def _later(periods: float) -> Callable[[_Source, np.random.Generator], _FollowUp | None]:
    def later(source: _Source, random: np.random.Generator) -> _FollowUp | None:
        p = source.parameters
        if p.model == "time_varying" and math.fmod(periods, p.modulation_order):
            return None
        state = replace(source.state, time=source.state.time + periods * p.period)
        run = _again(source, p, state)
        found = events_of(run)
        shifted = np.where(found.kind == END, 0.0, found.periods - periods)
        return _FollowUp(run, state, found._replace(periods=shifted))

    return later


def _units(source: _Source, random: np.random.Generator) -> _FollowUp | None:
    for _ in range(_DRAWS):
        try:
            si = _in_units(source.parameters, *(10.0 ** random.uniform(-3.0, 3.0, 3)).tolist())
            break
        except ValueError:
            # At the edge of a range roundoff may lead out of it.
            continue
    else:
        return None
    units, s = si.units, source.state
    state = State(
        s.x * units.length,
        s.v * units.speed,
        s.y * units.length,
        s.u * units.speed,
        s.time * units.time,
    )
    back = state.over(units)
    run = _again(source, si.dimensionless, back)
    last = run.log[-1]
    until = (last[PERIODS] * si.dimensionless.period + last[TIME] + last[DURATION]) * units.time
    listed = list_events(si, state, until=float(until), max_events=source.most_events)
    return _FollowUp(run, back, _back(listed, units, events_of(run)))


def _in_units(p: Parameters, mass: float, stiffness: float, force: float) -> SIParameters:
    """The same damper in SI units, with this primary and force."""
    damping = 2.0 * math.sqrt(stiffness * mass)
    return SIParameters(
        primary_mass=mass,
        damping=p.damping_ratio * damping,
        stiffness=stiffness,
        force_amplitude=force,
        forcing_frequency=p.frequency_ratio * math.sqrt(stiffness / mass),
        free_mass=p.mass_ratio * mass,
        gap=2.0 * p.clearance * force / stiffness,
        restitution=p.restitution,
        phase=p.phase,
        yield_speed=p.yield_speed * force / math.sqrt(stiffness * mass),
        support_stiffness=p.support_stiffness_ratio * stiffness,
        support_damping=p.support_damping_ratio * damping,
        support_damping_factor=p.support_damping_factor,
        contact_stiffness=p.contact_stiffness_ratio * stiffness,
        contact_tension=p.contact_tension,
        modulation_depth=p.modulation_depth,
        modulation_order=p.modulation_order,
        modulation_phase=p.modulation_phase,
    )


def _back(listed: np.ndarray, units: Units, found: Events) -> Events:
    """Events in SI units taken back; the end, which they do not list, from the run itself."""
    listed = listed[listed["kind"] <= RELEASE]
    ends = found.kind == END
    count = min(len(listed), int(np.sum(~ends)))
    listed = listed[:count]
    values = np.array(
        [
            listed["x"] / units.length,
            listed["v"] / units.speed,
            listed["approach_speed"] / units.speed,
        ]
    )
    return Events(
        np.append(listed["kind"], found.kind[ends]).astype(float),
        np.append(listed["side"], found.side[ends]).astype(float),
        np.append(listed["period"], found.periods[ends]).astype(float),
        np.append(listed["time_in_period"] / units.time, found.time[ends]),
        np.column_stack((values, found.values[:, ends])),
    )


def _accurate(accuracy: float) -> Callable[[_Source, np.random.Generator], _FollowUp]:
    def accurate(source: _Source, random: np.random.Generator) -> _FollowUp:
        run = _again(source, source.parameters, source.state, accuracy=accuracy)
        return _FollowUp(run, source.state, events_of(run))

    return accurate


_FOLLOW_UPS: dict[str, Callable[[_Source, np.random.Generator], _FollowUp | None]] = {
    "mirrored": _mirrored,
    "shifted": _later(SHIFT),
    "shifted_far": _later(FAR_SHIFT),
    "units": _units,
    "sharper": _accurate(SHARPER),
    "looser": _accurate(LOOSER),
}
