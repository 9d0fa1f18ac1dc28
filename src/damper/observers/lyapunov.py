"""Lyapunov exponents: how fast small deviations grow, through impacts, chatter and sticking."""

import math

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.segment import IMPACT, segment_at
from damper.engine.trajectory import Trajectory
from damper.models.tangent import damping_in, enter, joins, over_time, shrunk_by
from damper.observers.common.base import Observer, Window, part_within, read_record, record_type
from damper.parameters.models import SMOOTH
from damper.parameters.variables import SPEED, Variable

#: Of a run: whether the record has begun; periods of it before its second half; whether masses
#: joined; the smallest approach speed.
_TOTALS = record_type("begun", "halved", "joined", "slowest")
_DIM = ("exponent",)
#: By this power of e volumes may shrink until deviations are orthonormalised again: the direction
#: that shrinks most must not be lost in the roundoff of the others.
_SHRUNK = 10.0


class Lyapunov(Observer):
    """All four Lyapunov exponents over the record, per cycle, the largest first.

    They are those of both masses' displacements and velocities. A positive one means chaos.
    A chatter sequence that completes lets two directions vanish: the last two exponents are then
    minus infinity. Without one the sum of all is known: flight shrinks volumes at the rate of the
    dashpots, and each impact by the square of the coefficient of restitution. `lyapunov_residual`
    is what the sum differs by.

    An impact that only grazes makes deviations unbounded: see `slowest_impact`.

    Compliant contact lets no direction vanish, and its own dashpot shrinks volumes in the place of
    impacts.

    Everything stays missing where the run stopped early.
    """

    models = SMOOTH
    variables = (
        Variable("largest_lyapunov_exponent", "largest Lyapunov exponent per cycle", "1"),
        Variable("lyapunov_exponents", "Lyapunov exponent per cycle", "1", _DIM),
        Variable(
            "lyapunov_drift",
            "Lyapunov exponent of the record's second half less that of the first",
            "1",
            _DIM,
            comment="how far the exponents have converged",
        ),
        Variable(
            "lyapunov_residual",
            "sum of the exponents less the rate at which volumes shrink",
            "1",
            comment="zero in exact arithmetic; missing where masses have joined",
        ),
        Variable(
            "slowest_impact",
            "smallest approach speed of a resolved impact",
            SPEED,
            comment="deviations grow by its inverse; missing without an impact",
        ),
    )

    def size(self, dim: str, window_length: int) -> int:
        """Length of one of the observer's own dimensions."""
        return 4

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run."""
        super().begin(run, trajectory, window)
        self._totals = np.zeros(1, _TOTALS)
        self._totals["slowest"] = math.inf
        self._frame = np.eye(4)
        # Logarithms of growth, of which first half of the record, and of volumes.
        self._growth = np.zeros((2, 4))
        self._volume = np.zeros(1)

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        _follow(
            self._model, log, self._window, self._frame, self._growth, self._volume, self._totals
        )

    def finish(self, finished: bool) -> None:
        """Write the run's results."""
        if not finished:
            return
        total, length = read_record(self._totals), self._window.length
        whole = self._growth[1]
        order = np.argsort(-whole, kind="stable")
        if total.halved:
            first = self._growth[0]
            with np.errstate(invalid="ignore"):
                drift = (whole - first) / (length - total.halved) - first / total.halved
            self._put({"lyapunov_drift": drift[order]})
        exponents = whole[order] / length
        self._put({"lyapunov_exponents": exponents, "largest_lyapunov_exponent": exponents[0]})
        if not total.joined:
            self._put({"lyapunov_residual": (whole.sum() - self._volume[0]) / length})
        if total.slowest < math.inf:
            self._put({"slowest_impact": total.slowest})


@compiled
def _follow(model, log, window, frame, growth, volume, totals):
    total = totals[0]
    for index in range(len(log)):
        s = segment_at(log[index])
        start, low, high = part_within(s, model.cycle, window)
        if high < low:
            continue
        if total.halved == 0.0 and 2.0 * start >= window.length * model.cycle:
            total.halved = start / model.cycle
            for k in range(4):
                growth[0, k] = growth[1, k]
        if start >= 0.0 and s.cause == IMPACT:
            total.slowest = min(total.slowest, s.speed)
            shrunk = shrunk_by(model, s)
            volume[0] += math.log(shrunk) if shrunk > 0.0 else -math.inf
        if start >= 0.0 or total.begun == 0.0:
            enter(model, s, frame, start >= 0.0)
        if joins(model, s):
            total.joined = 1.0
        total.begun = 1.0
        damped = damping_in(model, s) * (high - low)
        volume[0] -= damped
        pieces = 1 + int(damped / _SHRUNK)
        for piece in range(pieces):
            begin = low + (high - low) * piece / pieces
            over_time(model, s, begin, begin + (high - low) / pieces, frame)
            _orthonormalise(frame, growth, total.joined == 1.0)


@compiled
def _orthonormalise(frame, growth, joined):
    """Modified Gram-Schmidt; of masses that have joined, two directions are left."""
    for k in range(4):
        if joined and k > 1:
            for row in range(4):
                frame[row, k] = 0.0
            growth[1, k] = -math.inf
            continue
        for other in range(k):
            along = 0.0
            for row in range(4):
                along += frame[row, other] * frame[row, k]
            for row in range(4):
                frame[row, k] -= along * frame[row, other]
        size = 0.0
        for row in range(4):
            size += frame[row, k] * frame[row, k]
        size = math.sqrt(size)
        growth[1, k] += math.log(size)
        for row in range(4):
            frame[row, k] /= size
