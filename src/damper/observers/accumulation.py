"""Complete bursts beside theory: what was left of each after each impact, predicted and resolved.

The bursts are those of `damper.observers.bursts` that begin in the window and end in sticking in
it. Their ends are resolved bounce by bounce up to a tail so short that the engine closes it by the
second-order formula itself, to its `accuracy`. A prediction can therefore be judged only where its
error is well above that: each burst says how sharply its end is known.
"""

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.oscillator import acceleration, sine_cosine
from damper.engine.search import tail_duration
from damper.engine.segment import (
    CAUSE,
    FIRST,
    IMPACT,
    MODE,
    PERIOD,
    RATE,
    SIDE,
    STICK,
    TAIL,
    TIME,
    V,
    X,
)
from damper.engine.trajectory import Trajectory
from damper.models.rigid import Rigid
from damper.observers.base import Observer, Window, since
from damper.parameters.variables import LENGTH, Variable
from damper.parameters.variables import SPEED as SPEED_UNIT
from damper.parameters.variables import TIME as TIME_UNIT
from damper.theory.accumulation import predict_tail

_OF_IMPACTS = (
    Variable("rebound_speed", "rate of the gap just after the impact", SPEED_UNIT),
    Variable("remaining_time", "time from the impact to completion", TIME_UNIT),
    Variable(
        "remaining_displacement", "primary displacement from the impact to completion", LENGTH
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
(_W, _LEFT, _LEFT_X, _T1, _T2, _X1, _X2, _ESTIMATE) = range(len(_OF_IMPACTS))

_OF_BURSTS = (
    Variable("completion_wall", "wall of the burst: -1 left, +1 right", "1"),
    Variable("completion_impacts", "impacts resolved one by one", "1"),
    Variable("completion_displacement", "primary displacement at completion", LENGTH),
    Variable(
        "completion_time_uncertainty",
        "error estimate of the resolved completion time",
        TIME_UNIT,
        comment="of the closed tail, and rounding",
    ),
    Variable(
        "completion_displacement_uncertainty",
        "error estimate of the resolved completion displacement",
        LENGTH,
    ),
)

# The burst under way: its wall, its impacts so far, and how sharply its end will be known.
_WALL, _COUNT, _TAIL_ERROR, _COMPLETE = range(4)
# No burst under way; nothing read yet. A burst that began before the window has a count of -1.
_NONE, _UNKNOWN = 0.0, 3.0
# What is kept of an impact until its burst is complete.
_KEPT = (PERIOD, TIME, X, V, RATE)
_ROUNDING = 2.220446049250313e-16


class Accumulation(Observer):
    """Complete bursts: what is left after each impact, resolved and predicted.

    Parameters
    ----------
    bursts : int, default 20
        Most complete bursts of each lane to use, the first ones that begin in the window.
    impacts : int, default 100
        Most impacts of each burst to use, the first ones; NaN fills the rest.

    Raises
    ------
    ValueError
        When either is below 1; when a run is not of the rigid damper.
    """

    def __init__(self, bursts: int = 20, impacts: int = 100) -> None:
        for name, value in (("bursts", bursts), ("impacts", impacts)):
            if value < 1:
                raise ValueError(f"{name} = {value!r}: must be at least 1")
        self._sizes = {"complete_burst": bursts, "burst_impact": impacts}
        count = Variable("complete_bursts", "bursts that begin and end in sticking", "1", (), "i4")
        dims = tuple(self._sizes)
        self.variables = [
            count,
            *(
                Variable(v.name, v.long_name, v.units, dims[:1], "f8", v.comment)
                for v in _OF_BURSTS
            ),
            *(Variable(v.name, v.long_name, v.units, dims, "f8", v.comment) for v in _OF_IMPACTS),
        ]

    def size(self, dim: str, window_length: int) -> int:
        """Number of bursts or of impacts asked for."""
        return self._sizes[dim]

    def coordinates(self) -> dict[str, np.ndarray]:
        """Count bursts and impacts from 1."""
        return {dim: np.arange(1.0, size + 1.0) for dim, size in self._sizes.items()}

    def begin(self, lane: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a lane."""
        if not isinstance(trajectory.model, Rigid):
            raise ValueError(
                "accumulation: its formulas are those of the rigid damper without support, "
                "not of this model"
            )
        super().begin(lane, trajectory, window)
        bursts, impacts = self._sizes.values()
        self._now = np.array([_UNKNOWN, 0.0, 0.0, 0.0])
        self._kept = np.empty((impacts, len(_KEPT)))
        self._of_bursts = np.full((bursts, len(_OF_BURSTS)), np.nan)
        self._of_impacts = np.full((bursts, impacts, len(_OF_IMPACTS)), np.nan)

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        _follow(
            self._model,
            log,
            self._window.period,
            self._window.time,
            self._now,
            self._kept,
            self._of_bursts,
            self._of_impacts,
        )

    def finish(self, finished: bool) -> None:
        """Write the lane's results; bursts that ended before an early stop are kept."""
        self._put({v.name: self._of_bursts[:, k] for k, v in enumerate(_OF_BURSTS)})
        self._put({v.name: self._of_impacts[..., k] for k, v in enumerate(_OF_IMPACTS)})
        if finished:
            self._put({"complete_bursts": self._now[_COMPLETE]})


@compiled
def _follow(model, log, periods, time, now, kept, of_bursts, of_impacts):
    if now[_WALL] == _UNKNOWN and len(log) > 0:
        now[_WALL] = log[0][SIDE] if log[0][FIRST] > 0.0 else _NONE
        now[_COUNT] = -1.0
    for index in range(len(log)):
        row = log[index]
        cause = float(row[CAUSE])
        if cause == STICK:
            if now[_WALL] != _NONE and now[_COUNT] > 0.0:
                number = int(now[_COMPLETE])
                if number < len(of_bursts):
                    _close(model, row, now, kept, of_bursts[number], of_impacts[number])
                now[_COMPLETE] += 1.0
            now[_WALL] = _NONE
        elif cause == IMPACT:
            if row[SIDE] != now[_WALL]:
                now[_WALL] = row[SIDE]
                now[_COUNT] = 0.0 if since(row, model.period, periods, time) >= 0.0 else -1.0
            if now[_COUNT] < 0.0:
                continue
            count = int(now[_COUNT])
            if count < len(kept):
                entry = kept[count]
                entry[0] = row[PERIOD]
                entry[1] = row[TIME]
                entry[2] = row[X]
                entry[3] = row[V]
                entry[4] = row[RATE]
            now[_COUNT] += 1.0
            if row[MODE] == TAIL:
                now[_TAIL_ERROR] = _tail_error(model, row)


@compiled
def _tail_error(model, row):
    free = model.free
    sin, cos, _ = sine_cosine(free[3] * float(row[TIME]) + model.phase)
    a, j = acceleration(free, float(row[X]), float(row[V]), sin, cos)
    _, error = tail_duration(
        free, model.mass_ratio, model.restitution, float(row[SIDE]), a, j, sin, float(row[RATE])
    )
    return error


@compiled
def _close(model, end, now, kept, of_burst, of_impacts):
    """Compare a burst with theory; it ends where the row `end` starts."""
    side = float(end[SIDE])
    x_end = float(end[X])
    sharp = float(now[_TAIL_ERROR]) + 2.0 * _ROUNDING * model.period
    of_burst[0] = side
    of_burst[1] = now[_COUNT]
    of_burst[2] = x_end
    of_burst[3] = sharp
    of_burst[4] = abs(float(end[V])) * sharp + 2.0 * _ROUNDING * abs(x_end)
    for k in range(min(int(now[_COUNT]), len(kept))):
        time = float(kept[k, 1])
        x = float(kept[k, 2])
        rate = float(kept[k, 4])
        first, second, dx1, dx2, error = predict_tail(
            model.free,
            model.stuck,
            model.mass_ratio,
            model.restitution,
            side,
            model.free[3] * time + model.phase,
            x,
            float(kept[k, 3]),
            rate,
        )
        entry = of_impacts[k]
        entry[_W] = rate
        entry[_LEFT] = since(end, model.period, float(kept[k, 0]), time)
        entry[_LEFT_X] = x_end - x
        entry[_T1] = first
        entry[_T2] = second
        entry[_X1] = dx1
        entry[_X2] = dx2
        entry[_ESTIMATE] = error
