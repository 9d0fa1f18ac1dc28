"""The event loop and the run: budget, resuming, the clock. The models' physics: tests/models."""

import math
from typing import Any, NamedTuple

import numpy as np
import pytest

from damper import Parameters, State
from damper.engine.forcing.harmonic import harmonic
from damper.engine.loop import BRIEF, FINISHED, LONG_SEARCH, SEARCH_FAILED, TOO_MANY_EVENTS
from damper.engine.model import Step, begin, following, initial_segment, motion
from damper.engine.oscillator import Oscillator, oscillator
from damper.engine.search import MAX_STEPS
from damper.engine.segment import (
    CAUSE,
    COLUMNS,
    DURATION,
    FLIGHT,
    IMPACT,
    MODE,
    NOTHING,
    PERIODS,
    TIME,
    Segment,
    clock_after,
)
from damper.engine.trajectory import Trajectory
from damper.models import model_of, start_run

EPS = np.finfo(float).eps


def log_of(run: Trajectory, until: float, rows: int = 1024) -> np.ndarray:
    """Return all segments up to a time in one array."""
    buffer = np.empty((rows, run.columns))
    pieces = [piece.copy() for piece in run.segments(*run.whole_periods(until), buffer)]
    return np.concatenate(pieces)


# --- a model that exists for these tests alone: segments of equal length


class Metronome(NamedTuple):
    """Every segment lasts `beat`; every `bar`-th ends in an event."""

    cycle: float
    clearance: float
    free: Oscillator
    beat: float
    bar: float
    steps: float
    lost_after: float


@initial_segment.of(Metronome)
def _initial_segment(model, periods, time, x, v, y, u):
    return Segment(
        periods, time, x, v, 0.0, 0.0, 1.0, FLIGHT, NOTHING, 0.0, v, 0.0, 0.0, 0.0, 0.0, 0.0
    )


@begin.of(Metronome)
def _begin(model, segment):
    return 0.0


@following.of(Metronome)
def _following(model, segment, start):
    s = segment
    periods, time = clock_after(model.cycle, s.periods, s.time, model.beat)
    count = s.x + 1.0
    is_event = count % model.bar == 0.0
    cause = IMPACT if is_event else NOTHING
    new = Segment(
        periods, time, count, s.v, 0.0, 0.0, 1.0, FLIGHT, cause, 0.0, s.v, 0.0, 0.0, 0.0, 0.0, 0.0
    )
    return Step(model.beat, is_event, count > model.lost_after, int(model.steps), new, 0.0)


@motion.of(Metronome)
def _motion(model, segment, tau):
    return segment.x + tau / model.beat, 1.0 / model.beat, 0.0, 0.0


def metronome(
    beat: float = 0.5,
    bar: float = 1.0,
    steps: int = 1,
    lost_after: float = math.inf,
    max_events: int = 10,
) -> Trajectory:
    forcing = harmonic(1.0, 0.0)
    free = oscillator(0.0, 1.0, 1.0, forcing)
    model = Metronome(2.0 * math.pi, 0.0, free, beat, bar, float(steps), lost_after)
    return Trajectory(model, State(0.0, 0.0, 0.0, 0.0), max_events)


def test_a_model_of_its_own_runs() -> None:
    """The engine knows no model: it asks for places, segments and motions."""
    run = metronome(max_events=1000)
    log = log_of(run, 100.0)
    assert len(log) == 201  # an event at exactly the end still counts
    assert run.status == FINISHED
    assert run.events == 200
    assert np.array_equal(log[1:, CAUSE], np.full(200, IMPACT))
    times = log[:, PERIODS] * run.cycle + log[:, TIME]
    assert np.abs(times - 0.5 * np.arange(201)).max() < 1e-13
    assert run.state_at(*run.whole_periods(100.0)).x == pytest.approx(200.0, abs=1e-12)


def test_budget_of_events() -> None:
    run = metronome(max_events=7)
    run.skip(10)
    assert (run.status, run.events) == (TOO_MANY_EVENTS, 7)
    # For good: nothing goes on.
    run.skip(20)
    assert [len(piece) for piece in run.segments(30)] == [0]
    assert run.events == 7


@pytest.mark.parametrize(
    ("beat", "steps"), [(1.0, LONG_SEARCH), (0.5 * BRIEF, 1)], ids=["long searches", "brief"]
)
def test_budget_of_evaluations_that_find_no_event(beat: float, steps: int) -> None:
    """A hundred for an event, and one whole search more."""
    run = metronome(beat=beat, bar=math.inf, steps=steps, max_events=50)
    run.skip(1e9)
    assert (run.status, run.events) == (TOO_MANY_EVENTS, 0)
    assert 0 < run.evaluations - (LONG_SEARCH * 50 + MAX_STEPS) <= steps


def test_a_search_that_gave_up_ends_the_run() -> None:
    run = metronome(lost_after=5.0, max_events=100)
    run.skip(10)
    assert (run.status, run.events) == (SEARCH_FAILED, 5)


# --- a run is the same however it is read and split

SCENES = [
    (Parameters(0.1, 0.05, 0.2, 0.25, 0.6), None),
    (Parameters(0.1, 0.05, 0.8, 1.0, 0.9), State(0.1, 0.2, 0.3, 0.4, time=5.0)),
    (Parameters(0.1, 0.05, 0.2, 0.25, 0.0), None),
    (Parameters(0.1, 0.05, 0.7, 50.0, 0.5), None),
    (Parameters(0.1, 0.05, 0.2, 0.25, 0.6, support_stiffness_ratio=0.05), None),
    (Parameters(0.1, 0.05, 0.2, 0.25, 0.3, contact_stiffness_ratio=1e5), None),
    (Parameters(0.1, 0.05, 0.2, 0.25, 0.3, modulation_depth=0.4, modulation_order=3), None),
    (Parameters(0.1, 0.05, 0.2, 0.25, 0.3, masses=[{}, {"clearance": 0.3}]), None),
]


@pytest.mark.parametrize(("p", "state"), SCENES)
def test_rows_do_not_depend_on_how_the_run_is_split(p: Parameters, state: State | None) -> None:
    """Skips and pieces at random times, also inside tails and exactly at events."""
    unsplit = start_run(p, state)
    whole = log_of(unsplit, 100.0)
    for rows in (1, 7):
        assert np.array_equal(log_of(start_run(p, state), 100.0, rows), whole)
    ends = whole[:, PERIODS] * p.cycle + whole[:, TIME]
    known = {tuple(row[[PERIODS, TIME, MODE, CAUSE]]): row for row in whole}
    for seed in range(3):
        rng = np.random.default_rng(seed)
        later = ends[ends > ends[0]]
        stops = [*rng.uniform(ends[0], 100.0, 12), *rng.choice(later, min(6, len(later)))]
        run = start_run(p, state)
        pieces = []
        for stop in [*sorted(stops), 100.0]:
            if rng.random() < 0.4 and stop < 100.0:
                run.skip(*run.whole_periods(float(stop)))
                continue
            pieces.extend(log_of(run, float(stop), int(rng.integers(1, 9))))
        # A segment that a stop has cut comes again from its start, then to its end.
        for row in pieces:
            same = known[tuple(row[[PERIODS, TIME, MODE, CAUSE]])]
            assert np.array_equal(row[:DURATION], same[:DURATION])
        assert np.array_equal(pieces[-1], whole[-1])
        assert run.events == unsplit.events
        assert run.evaluations >= unsplit.evaluations


# --- the clock


@pytest.mark.parametrize("time", [0.0, 1e-300, 3.0, -3.0, -1e-300, 7.0, -7.0, 1e9, -1e9])
def test_whole_periods(time: float) -> None:
    p = Parameters(0.1, 0.05, 0.9, 0.25, 0.6)
    periods, rest = start_run(p).whole_periods(time)
    assert periods == int(periods)
    assert 0.0 <= rest < p.cycle
    assert periods * p.cycle + rest == pytest.approx(time, abs=4 * EPS * abs(time) + 1e-15)


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"support_stiffness_ratio": 0.05, "support_damping_ratio": 0.02},
        {"contact_stiffness_ratio": 1e4},
        {"modulation_depth": 0.4},  # a subharmonic one counts in cycles
    ],
    ids=["rigid", "grounded", "compliant", "time_varying"],
)
def test_the_clock_may_count_in_several_forcing_periods(more: dict[str, Any]) -> None:
    """Only the times' roundoff may differ, and what few impacts make of it."""
    p = Parameters(0.1, 0.05, 0.2, 0.25, 0.3, 0.4, **more)
    model = model_of(p)
    logs = []
    for times in (1, 3):
        run = Trajectory(model._replace(cycle=times * p.cycle))
        log = log_of(run, 250.0)
        assert np.all(log[:, TIME] < run.cycle)
        log[:, TIME] += log[:, PERIODS] * run.cycle
        logs.append(log[log[:, CAUSE] >= IMPACT])
    one, three = logs
    assert len(one) > 100
    assert np.array_equal(one[:, CAUSE], three[:, CAUSE])
    rest = [k for k in range(COLUMNS) if k != PERIODS]
    assert np.abs(one - three)[:-1, rest].max() < 1e-10
    assert np.abs(one - three)[:8, rest].max() < 1e-13


def test_model_settings_are_checked() -> None:
    p = Parameters(0.1, 0.05, 0.2, 0.25, 0.6)
    with pytest.raises(ValueError, match="outside the box"):
        start_run(p, State(0.0, 0.0, 0.3, 0.0))
    with pytest.raises(ValueError, match=r"^accuracy = 0.0"):
        start_run(p, accuracy=0.0)
    with pytest.raises(ValueError, match=r"^max_events = 0"):
        start_run(p, max_events=0)
