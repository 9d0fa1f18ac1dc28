"""Complete bursts beside theory: the time left after each impact, predicted and resolved.

The bursts are those of `damper.observers.bursts` that begin in the window and end in sticking in
it. Their ends are resolved bounce by bounce up to a tail so short that the engine closes it by the
second-order formula itself, to its `accuracy`. A prediction can therefore be judged only where its
error is well above that: each burst says how sharply its end is known.
"""

from dataclasses import replace

import numpy as np

from damper.engine.compiled import compiled, plain
from damper.engine.forcing import repeats
from damper.engine.impact import restitution_change
from damper.engine.model import columns_of, read_segment
from damper.engine.roundoff import EPSILON
from damper.engine.segment import IMPACT, STICK, TAIL, segment_at
from damper.engine.trajectory import Trajectory
from damper.models.walls import chatter_of, law_of_mass
from damper.observers.common.base import Observer, Window, fields_of, record_type, since
from damper.observers.common.settings import BODIES, Setting
from damper.parameters.variables import LENGTH, Variable
from damper.parameters.variables import SPEED as SPEED_UNIT
from damper.parameters.variables import TIME as TIME_UNIT
from damper.theory.accumulation import MODELS, predict_rest

_OF_IMPACTS = (
    Variable("rebound_speed", "rate of the gap just after the impact", SPEED_UNIT),
    Variable("remaining_time", "time from the impact to accumulation", TIME_UNIT),
    Variable(
        "remaining_displacement", "primary displacement from the impact to accumulation", LENGTH
    ),
    Variable("first_order_time", "remaining time predicted to first order", TIME_UNIT),
    Variable("second_order_time", "remaining time predicted to second order", TIME_UNIT),
    Variable("first_order_displacement", "remaining displacement predicted to first order", LENGTH),
    Variable(
        "second_order_displacement", "remaining displacement predicted to second order", LENGTH
    ),
    Variable(
        "prediction_error_estimate",
        "estimated error of the second-order time over the first-order time",
        "1",
        comment="the formulas hold where it is small; infinite where they claim nothing, or where "
        "the wall does not push just after the impact, so that there is no prediction",
    ),
)

_OF_BURSTS = (
    Variable("accumulation_wall", "wall of the burst: -1 left, +1 right", "1"),
    Variable("accumulation_impacts", "impacts resolved one by one", "1"),
    Variable("accumulation_displacement", "primary displacement at accumulation", LENGTH),
    Variable(
        "accumulation_time_uncertainty",
        "error estimate of the resolved accumulation time",
        TIME_UNIT,
        comment="of the closed tail, and rounding",
    ),
    Variable(
        "accumulation_displacement_uncertainty",
        "error estimate of the resolved accumulation displacement",
        LENGTH,
    ),
)

_IMPACT = record_type(*(variable.name for variable in _OF_IMPACTS))
_BURST = record_type(*(variable.name for variable in _OF_BURSTS))
#: The burst under way: its wall, its impacts so far (-1 if it began before the window), the error
#: of its accumulation time; and how many bursts are complete.
_STATE = record_type("wall", "impacts", "error", "complete")
# Walls: no burst under way; nothing read yet.
_NONE, _UNKNOWN = 0.0, 3.0

#: Speed beyond those of all impacts.
_FAST = 1e100


class Accumulation(Observer):
    """Complete bursts between rigid walls beside theory: what is left after each impact.

    Raises
    ------
    ValueError
        When a run has friction, no constant restitution, or no smooth force.
    """

    models = (*MODELS, "structure")
    bodies = BODIES
    bursts = Setting(
        20,
        "Most complete bursts of each run to use, the first ones of the window.",
        ge=1,
        le=100_000,
    )
    impacts = Setting(100, "Most impacts of each burst to use, the first ones.", ge=1, le=100_000)

    @property
    def variables(self) -> list[Variable]:
        """What it writes."""
        dims = ("complete_burst", "burst_impact")
        return [
            Variable("complete_bursts", "bursts that begin and end in sticking", "1", (), "i4"),
            *(replace(variable, dims=dims[:1]) for variable in _OF_BURSTS),
            *(replace(variable, dims=dims) for variable in _OF_IMPACTS),
        ]

    def size(self, dim: str, window_length: int) -> int:
        """Number of bursts or of impacts asked for."""
        return self.bursts if dim == "complete_burst" else self.impacts

    def coordinates(self) -> dict[str, np.ndarray]:
        """Count bursts and impacts from 1."""
        sizes = {"complete_burst": self.bursts, "burst_impact": self.impacts}
        return {dim: np.arange(1.0, size + 1.0) for dim, size in sizes.items()}

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run."""
        super().begin(run, trajectory, window)
        model = trajectory.model
        laws = (plain(law_of_mass)(model, trajectory.body or 0, side) for side in (-1.0, 1.0))
        if any(plain(restitution_change)(law, _FAST) != 0.0 for law in laws):
            raise ValueError("accumulation: its formulas are those of a constant restitution")
        if not plain(repeats)(model.free.forcing):
            raise ValueError(
                "accumulation: its formulas are those of a smooth force, this forcing is one from "
                "sample to sample"
            )
        self._state = np.zeros(1, _STATE)
        self._state["wall"] = _UNKNOWN
        # Segments that the burst's impacts begin, until it is complete.
        self._kept = np.empty((self.impacts, columns_of(model)))
        self._of_bursts = np.full(self.bursts, np.nan, _BURST)
        self._of_impacts = np.full((self.bursts, self.impacts), np.nan, _IMPACT)

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        _follow(
            self._model,
            log,
            self._window,
            self._state,
            self._kept,
            self._of_bursts,
            self._of_impacts,
        )

    def finish(self, finished: bool) -> None:
        """Write the run's results; bursts that ended before an early stop are kept."""
        self._put({name: self._of_bursts[name] for name in fields_of(_BURST)})
        self._put({name: self._of_impacts[name] for name in fields_of(_IMPACT)})
        if finished:
            self._put({"complete_bursts": self._state["complete"][0]})


@compiled
def _follow(model, log, window, states, kept, of_bursts, of_impacts):
    state = states[0]
    if state.wall == _UNKNOWN and len(log) > 0:
        first = segment_at(log[0])
        state.wall = first.side if first.first_speed > 0.0 else _NONE
        state.impacts = -1.0
    for index in range(len(log)):
        s = segment_at(log[index])
        if s.cause == STICK:
            if state.wall != _NONE and state.impacts > 0.0:
                number = int(state.complete)
                if number < len(of_bursts):
                    _close(model, s, state, kept, of_bursts[number], of_impacts[number])
                state.complete += 1.0
            state.wall = _NONE
        elif s.cause == IMPACT:
            if s.side != state.wall:
                state.wall = s.side
                start = since(s, model.cycle, window.periods, window.time)
                state.impacts = 0.0 if start >= 0.0 else -1.0
            if state.impacts < 0.0:
                continue
            if state.impacts < len(kept):
                kept[int(state.impacts)] = log[index]
            state.impacts += 1.0
            if s.mode == TAIL:
                state.error = chatter_of(model, read_segment(model, log[index])).error


@compiled
def _close(model, end, state, kept, burst, of_impacts):
    """Compare a burst with theory; it ends where the segment `end` starts."""
    error = state.error + 2.0 * EPSILON * model.cycle
    burst.accumulation_wall = end.side
    burst.accumulation_impacts = state.impacts
    burst.accumulation_displacement = end.x
    burst.accumulation_time_uncertainty = error
    burst.accumulation_displacement_uncertainty = abs(end.v) * error + 2.0 * EPSILON * abs(end.x)
    for k in range(min(int(state.impacts), len(kept))):
        s = segment_at(kept[k])
        found = predict_rest(model, read_segment(model, kept[k]))
        impact = of_impacts[k]
        impact.rebound_speed = s.gap_rate
        impact.remaining_time = since(end, model.cycle, s.periods, s.time)
        impact.remaining_displacement = end.x - s.x
        impact.first_order_time = found.first_order_time
        impact.second_order_time = found.second_order_time
        impact.first_order_displacement = found.first_order_displacement
        impact.second_order_displacement = found.second_order_displacement
        impact.prediction_error_estimate = found.error
