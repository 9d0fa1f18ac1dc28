"""Lyapunov exponents: how fast small deviations grow, through impacts, chatter and sticking."""

import math

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.model import read_segment
from damper.engine.segment import IMPACT, REVERSAL
from damper.engine.trajectory import Trajectory
from damper.models.tangent import (
    OF_PARTED,
    coordinates_in,
    damping_in,
    directions_at,
    enter,
    leaders_of,
    lost_in,
    over_time,
    parted_in,
    shrunk_by,
)
from damper.observers.common.base import Observer, Window, part_within, read_record, record_type
from damper.observers.common.settings import Setting
from damper.parameters.models import ON_PRIMARY
from damper.parameters.variables import SPEED, Variable

#: Of a run: whether the window has begun; periods of it before its second half; directions that
#: have vanished; the smallest approach speed.
_TOTALS = record_type("begun", "halved", "lost", "slowest")
_DIM = ("exponent",)
#: By this power of e volumes may shrink until deviations are orthonormalised again: the direction
#: that shrinks most must not be lost in the roundoff of the others.
_SHRUNK = 10.0


class Lyapunov(Observer):
    """Lyapunov exponents over the window, per cycle, the largest first.

    They are those of the masses' displacements and velocities: four, and two more for each further
    free mass; beside a fixed stop two, those of the primary. A positive one means chaos.
    A chatter sequence that completes lets two directions vanish: the last two exponents are then
    minus infinity, and two more for each further mass that sticks at the same time. Without one the
    sum of all is known: flight shrinks volumes at the rate of the
    dashpots, and each impact by the square of the coefficient of restitution. `lyapunov_residual`
    is what the sum differs by; it takes all of them. Under dry friction each reversal shrinks
    volumes as well, and a rest off the walls lets one direction vanish: the last exponent is then
    minus infinity, and one more for each further mass that rests at the same time.

    Several masses in step hit as one. A deviation that parts them changes their impacts by a finite
    amount, however small it is: its two exponents are infinite, or minus infinity where they stick
    together in the window; where they only rest, 0 and minus infinity. Start them apart, or give
    them different clearances.

    An impact that only grazes makes deviations unbounded: see `slowest_impact`.

    Compliant contact lets no direction vanish, and its own dashpot shrinks volumes in the place of
    impacts.

    Everything stays missing where the run stopped early.
    """

    models = (*ON_PRIMARY, "structure")
    exponents = Setting(4, "How many exponents to follow, the largest.", ge=1, le=202)
    variables = (
        Variable("largest_lyapunov_exponent", "largest Lyapunov exponent per cycle", "1"),
        Variable("lyapunov_exponents", "Lyapunov exponent per cycle", "1", _DIM),
        Variable(
            "lyapunov_drift",
            "Lyapunov exponent of the window's second half less that of the first",
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
        return int(self.exponents)

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run."""
        super().begin(run, trajectory, window)
        self._totals = np.zeros(1, _TOTALS)
        self._totals["slowest"] = math.inf
        self._frame = np.empty((0, 0))
        self._own, self._parted = np.empty(0), np.empty(0, int)
        #: Which masses are in step with another one, and how many directions there are.
        self._follows, self._directions = np.empty(0, bool), 0
        # Logarithms of growth, of which first half of the window, and of volumes.
        self._growth, self._volume = np.empty((2, 0)), np.zeros(1)

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        if not len(log):
            return
        if not len(self._frame):
            self._take_frame(log[0])
        if self._follows.any():
            self._parted = np.maximum(self._parted, parted_in(self._model, log))
        _follow(
            self._model,
            log,
            self._window,
            self._frame,
            self._growth,
            self._volume,
            self._totals,
            self._own,
            2.0 * coordinates_in(self._model),
        )

    def _take_frame(self, row: np.ndarray) -> None:
        """The directions to follow, orthonormal: masses in step are moved as one."""
        leaders = leaders_of(self._model, row)
        self._own = (leaders == np.arange(len(leaders))).astype(float)
        self._follows = (leaders >= 0) & (self._own == 0.0)
        primary = coordinates_in(self._model)
        self._directions = 2 * primary + 2 * int((leaders >= 0).sum())
        kept = np.repeat(np.append(np.ones(primary), self._own), 2) > 0.0
        frame = directions_at(self._model, row)[:, kept]
        if len(leaders) > 1:
            # A coordinate vanishes where its mass rests, so no direction may consist of it alone:
            # reflected, each direction has a share of every coordinate.
            across = 1.0 / np.arange(1.0, frame.shape[1] + 1.0)
            frame = frame - np.outer(frame @ across, across) * (2.0 / (across @ across))
        frame = frame[:, : self.exponents]
        self._frame = np.ascontiguousarray(frame / np.linalg.norm(frame, axis=0))
        self._parted = np.zeros(len(leaders), int)
        self._growth = np.zeros((2, self._frame.shape[1]))

    def finish(self, finished: bool) -> None:
        """Write the run's results."""
        if not finished or not len(self._frame):
            return
        total, length = read_record(self._totals), self._window.length
        with np.errstate(divide="ignore"):
            of_parted = np.log(OF_PARTED[self._parted[self._follows]]).ravel()
        whole = np.append(self._growth[1], of_parted)
        order = np.argsort(-whole, kind="stable")[: self.exponents]
        found = {"lyapunov_exponents": whole[order] / length}
        if total.halved:
            first = np.append(self._growth[0], of_parted)
            with np.errstate(invalid="ignore"):
                drift = (whole - first) / (length - total.halved) - first / total.halved
            found["lyapunov_drift"] = drift[order]
        for name, values in found.items():
            self.arrays[name][self._run, : len(values)] = values
        self._put({"largest_lyapunov_exponent": whole[order[0]] / length})
        if not total.lost and len(self._growth[1]) == self._directions:
            self._put({"lyapunov_residual": (whole.sum() - self._volume[0]) / length})
        if total.slowest < math.inf:
            self._put({"slowest_impact": total.slowest})


@compiled
def _follow(model, log, window, frame, growth, volume, totals, own, primary):
    total = totals[0]
    for index in range(len(log)):
        s = read_segment(model, log[index])
        start, low, high = part_within(s, model.cycle, window)
        if high < low:
            continue
        if total.halved == 0.0 and 2.0 * start >= window.length * model.cycle:
            total.halved = start / model.cycle
            for k in range(growth.shape[1]):
                growth[0, k] = growth[1, k]
        if start >= 0.0 and s.cause in (IMPACT, REVERSAL):
            if s.cause == IMPACT:
                total.slowest = min(total.slowest, s.speed)
            shrunk = shrunk_by(model, s)
            volume[0] += math.log(shrunk) if shrunk > 0.0 else -math.inf
        if start >= 0.0 or total.begun == 0.0:
            enter(model, s, frame, start >= 0.0)
        total.lost = max(total.lost, lost_in(model, s, own))
        total.begun = 1.0
        damped = damping_in(model, s) * (high - low)
        volume[0] -= damped
        pieces = 1 + int(damped / _SHRUNK)
        left = primary + 2.0 * own.sum() - total.lost
        for piece in range(pieces):
            begin = low + (high - low) * piece / pieces
            over_time(model, s, begin, begin + (high - low) / pieces, frame)
            _orthonormalise(frame, growth, left)


@compiled
def _orthonormalise(frame, growth, left):
    """Modified Gram-Schmidt; of masses that have joined, so many directions are left."""
    size_of, count = frame.shape
    for k in range(count):
        if k >= left:
            for row in range(size_of):
                frame[row, k] = 0.0
            growth[1, k] = -math.inf
            continue
        for other in range(k):
            along = 0.0
            for row in range(size_of):
                along += frame[row, other] * frame[row, k]
            for row in range(size_of):
                frame[row, k] -= along * frame[row, other]
        size = 0.0
        for row in range(size_of):
            size += frame[row, k] * frame[row, k]
        size = math.sqrt(size)
        if size == 0.0:
            growth[1, k] = -math.inf
            continue
        growth[1, k] += math.log(size)
        for row in range(size_of):
            frame[row, k] /= size
