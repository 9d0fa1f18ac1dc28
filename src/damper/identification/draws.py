"""Draws of the unknowns, as probable as the records leave them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from damper.identification.fit import Fit, Fitter

#: Points of a population.
_POINTS = 200
#: Lengths of the records at which the sums of squares of a point are known.
_NODES = 100
#: Draws around the minima of the whole records: few, and many where these are worth it.
_DRAWS = 600, 3000
#: Populations at most.
_POPULATIONS = 3
#: Populations agree where the variance of all their points is less than so many times the mean
#: variance within a population.
AGREE = 1.5
#: Parts of the records at which populations may begin: the first one that is smooth there.
_PARTS = (0.3, 0.2, 0.15, 0.1)
#: The first points are spread so many times wider than the covariance.
_WIDE = 2.0
#: Degrees of freedom of their distribution t, unless the residual has fewer.
_TAILS = 5
#: A part of the records is smooth where the first points are worth so much of what they would be
#: worth for a normal distribution, and so is the whole.
_SMOOTH, _SMOOTH_WHOLE = 0.5, 0.9
#: The records go on to where this part of a population's worth is left.
_LEFT = 0.4
#: A population has moved when there were so many moves for each point, or so many sweeps.
_MOVED, _SWEEPS = 0.6, 4
#: Sweeps over the whole records at last. The first half is not drawn from.
_LAST_SWEEPS = 10
#: A point moves by a part of the distance of two others, which is at least this one.
_NEAREST = 0.05
#: Part of the last moves that go anywhere around the minima of the whole.
_JUMPS = 0.3
#: Fits of the best draws, which find more minima.
_MORE_FITS = 3
#: Minima around which points are drawn, at most.
_CENTRES = 8
#: Over the variance, their sum of squares is less than this above that of the fit.
_FAR = 40.0
#: A population is lost where its least sum of squares, over the variance, is this far above the
#: least one of all.
_LOST = 20.0
#: Steps of a fit.
_STEPS = 5


class Draws:
    """A population of points that follows the records from a part to the whole.

    Of n data with white noise of unknown size, a point is as probable as its sum of squares to the
    power -n/2, wherever it is in the allowed ranges. Of a part of the records, the rest counts with
    its mean sum of squares, so that all parts have one law. A sequential Monte Carlo sampler
    (Chopin, Biometrika 89, 539, 2002): the part grows by as much as leaves the points enough
    worth; the probable ones are repeated; and all move, by parts of the distance of two others
    (ter Braak, Statistics and Computing 16, 239, 2006).
    """

    def __init__(self, fitter: Fitter, fit: Fit) -> None:
        self.fitter, self.fit = fitter, fit
        #: Parts of the records at which the next population may begin.
        self.parts: tuple[float, ...] = _PARTS
        self.generator = np.random.default_rng(0)
        self.free = [j for j in range(len(fit.point)) if j not in fitter.linear]
        self.power = 0.5 * (fit.freedom + len(self.free))
        #: Data in the order of the parts of the records that hold them.
        records = fitter.problem.records
        parts = [np.arange(1, len(r.times) + 1) / len(r.times) for r in records]
        self.order = np.argsort(np.concatenate(parts), kind="stable")
        count = len(self.order)
        self.nodes = np.unique(np.linspace(1, count, min(count, _NODES)).round().astype(int)) - 1
        self.columns = fit.jacobian[:, fitter.linear][self.order]
        squares = self.columns[:, :, None] * self.columns[:, None, :]
        self.inverse = np.zeros((len(self.nodes), *squares.shape[1:]))
        if fitter.linear:
            self.inverse = np.linalg.pinv(np.cumsum(squares, axis=0)[self.nodes], hermitian=True)

    def sums(self, point: np.ndarray) -> np.ndarray:
        """Sum of squares at each node, from none of the data on; sets a point's best constants."""
        if not self._inside(point):
            return np.full(len(self.nodes) + 1, math.inf)
        missed = self.fitter.problem.residuals(point)[0]
        ordered = missed[self.order]
        found = np.cumsum(ordered**2)[self.nodes]
        if self.fitter.linear:
            slopes = np.cumsum(self.columns * ordered[:, None], axis=0)[self.nodes]
            steps = np.einsum("nij,nj->ni", self.inverse, slopes)
            found -= (slopes * steps).sum(axis=1)
            point[self.fitter.linear] -= steps[-1]
            missed[self.order] -= self.columns @ steps[-1]
        self.fitter.keep(missed, point.copy())
        return np.append(0.0, np.maximum(found, 0.0))

    def _inside(self, point: np.ndarray) -> bool:
        """Whether a point is in the allowed ranges."""
        low, high = self.fitter.bounds
        return bool(((low <= point) & (point <= high)).all())

    def chances(self, sums: np.ndarray, reach: float) -> np.ndarray:
        """Logarithms of the probabilities of points where the data reach to a node."""
        k = min(int(reach), len(self.nodes) - 1)
        part = reach - k
        with np.errstate(invalid="ignore"):
            known = (1.0 - part) * sums[..., k] + part * sums[..., k + 1]
        rest = 1.0 - reach / len(self.nodes)
        logs = -self.power * np.log(np.maximum(known + rest * self.fit.cost, 1e-300))
        return np.where(np.isnan(logs), -math.inf, logs)  # type: ignore[no-any-return]

    def _first(self, part: float, count: int) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
        """Points around fits of a part of the records, their sums and logarithms of their weights.

        And before these the worth, over that where the points are distributed normally.
        """
        around = self._around(part)
        points = np.tile(self.fit.point, (count, 1))
        points[:, self.free] = [around.draw(self.generator) for _ in points]
        if not any(map(self._inside, points)):  # as beside the ends of many ranges
            points[0] = self.fit.point
        sums = np.array([self.sums(point) for point in points])
        logs = self.chances(sums, len(self.nodes) * part) - around.logs(points[:, self.free])
        normal = count * (math.sqrt(2.0 * _WIDE**2 - 1.0) / _WIDE**2) ** len(self.free)
        return _worth(logs) / normal, points, sums, logs

    def _begin(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """First points of a population, their sums, logarithms of weights, and their node."""
        best = 0.0
        for part in self.parts:
            worth, points, sums, logs = self._first(part, _POINTS)
            if worth > best:
                best, begun, smooth = worth, (points, sums, logs), part
            if worth >= _SMOOTH:
                break
        self.parts = (smooth,)
        return *begun, len(self.nodes) * smooth

    def _around(self, part: float) -> _Around:
        """Points around fits of a part of the records, which begin at minima of the whole."""
        centres, roots = list[np.ndarray](), list[np.ndarray]()
        fitter, most = self.fitter, self.fit.cost + _FAR * self.fit.variance
        near = [one for one in fitter.tried if one[0] <= most]
        for point in [self.fit.point, *fitter.best_of(near, _CENTRES)]:
            fit = fitter.fit(point, part, _STEPS)
            there = fit.point[self.free]
            if any(
                np.linalg.norm(np.linalg.solve(root, there - centre)) < 1.0 / _WIDE
                for centre, root in zip(centres, roots, strict=True)
            ):
                continue
            spread = fitter.spread(fit, self.fit.variance)[self.free]
            centres.append(there)
            roots.append(_WIDE * np.linalg.cholesky(spread @ spread.T))
        return _Around(np.array(centres), np.array(roots), min(_TAILS, self.fit.freedom))

    def draw(self) -> tuple[np.ndarray, float]:
        """Draw points, all as probable, and the variance of all over that within populations.

        The largest one of the unknowns (Gelman and Rubin, Statistical Science 7, 457, 1992).
        """
        for count in _DRAWS:
            worth, points, _, logs = self._first(1.0, count)
            if worth < _SMOOTH_WHOLE:
                break
        else:
            return points[self._repeated(logs, count)], 1.0
        kept, ratio = list[tuple[np.ndarray, np.ndarray]](), math.inf
        for _ in range(_POPULATIONS):
            kept.append(self._population(*self._begin()))
            costs = [float(sums[:, -1].min()) for _, sums in kept]
            most = min(costs) + _LOST * self.fit.variance
            kept = [one for one, cost in zip(kept, costs, strict=True) if cost <= most]
            each, kept = self._mixed(kept)
            ratio = _spread_of_means(each[..., self.free])
            if ratio < AGREE:
                break
        return np.concatenate(each), ratio

    def _mixed(
        self, kept: list[tuple[np.ndarray, np.ndarray]]
    ) -> tuple[np.ndarray, list[tuple[np.ndarray, np.ndarray]]]:
        """Draws of each population while all move together, and their last points and sums."""
        points, sums = (np.concatenate(some) for some in zip(*kept, strict=True))
        for point in self.fitter.best_of(self.fitter.tried, _MORE_FITS):
            self.fitter.fit(point, 1.0, _STEPS)
        around, drawn = self._around(1.0), []
        for _ in range(_LAST_SWEEPS):
            self._move(points, sums, len(self.nodes), around)
            drawn.append(np.split(points.copy(), len(kept)))
        last = list(zip(drawn[-1], np.split(sums, len(kept)), strict=True))
        return np.concatenate(drawn[_LAST_SWEEPS // 2 :], axis=1), last

    def _population(
        self, points: np.ndarray, sums: np.ndarray, logs: np.ndarray, reach: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Points of a population that has followed the records, and their sums."""
        whole = float(len(self.nodes))
        while True:
            before = self.chances(sums, reach)
            inside = np.isfinite(before)
            points, sums, logs = points[inside], sums[inside], logs[inside] - before[inside]

            def weights(there: float, sums: np.ndarray = sums, logs: np.ndarray = logs) -> Any:
                return logs + self.chances(sums, there)

            least = min(_LEFT * _POINTS, 0.95 * _worth(weights(reach)))
            low, reach = reach, whole
            if _worth(weights(whole)) < least:
                while reach - low > 1e-3:
                    middle = 0.5 * (low + reach)
                    if _worth(weights(middle)) < least:
                        reach = middle
                    else:
                        low = middle
            which = self._repeated(weights(reach), _POINTS)
            points, sums, logs = points[which], sums[which], np.zeros(_POINTS)
            if reach == whole:
                return points, sums
            moved = 0
            for _ in range(_SWEEPS):
                moved += self._move(points, sums, reach)
                if moved >= _MOVED * _POINTS:
                    break

    def _repeated(self, logs: np.ndarray, count: int) -> np.ndarray:
        """Numbers of so many points, each as often as its weight says."""
        each = np.exp(logs - logs.max())
        ends = np.cumsum(each / each.sum())
        which = np.searchsorted(ends, (self.generator.random() + np.arange(count)) / count)
        return np.minimum(which, len(logs) - 1)  # type: ignore[no-any-return]

    def _move(
        self, points: np.ndarray, sums: np.ndarray, reach: float, around: _Around | None = None
    ) -> int:
        """Try to move each point, also to these places; how many moved."""
        chances, moved = self.chances(sums, reach), 0
        for k in range(len(points)):
            point, back = points[k].copy(), 0.0
            if around and self.generator.random() < _JUMPS:
                point[self.free] = around.draw(self.generator)
                pair = around.logs(np.array([points[k], point])[:, self.free])
                back = float(pair[0] - pair[1])
            else:
                one, other = self.generator.integers(len(points), size=2)
                point += _NEAREST ** self.generator.random() * (points[one] - points[other])
            there = self.sums(point)
            chance = float(self.chances(there, reach))
            if math.log(self.generator.random()) < chance - chances[k] + back:
                points[k], sums[k], chances[k] = point, there, chance
                moved += 1
        return moved


@dataclass(frozen=True)
class _Around:
    """Distributions t around centres, all as probable."""

    centres: np.ndarray
    roots: np.ndarray
    tails: int
    """Their degrees of freedom."""

    def draw(self, generator: np.random.Generator) -> np.ndarray:
        """Draw a place."""
        k = generator.integers(len(self.centres))
        step = generator.standard_normal(self.centres.shape[1])
        step *= math.sqrt(self.tails / generator.chisquare(self.tails))
        return self.centres[k] + self.roots[k] @ step  # type: ignore[no-any-return]

    def logs(self, places: np.ndarray) -> np.ndarray:
        """Logarithms of the density at places, but for a constant."""
        offsets = (places - self.centres[:, None]).transpose(0, 2, 1)
        squares = (np.linalg.solve(self.roots, offsets) ** 2).sum(axis=1)
        power = -0.5 * (self.tails + places.shape[1])
        heights = (1.0 + squares / self.tails) ** power / self.sizes[:, None]
        return np.log(heights.sum(axis=0))  # type: ignore[no-any-return]

    @cached_property
    def sizes(self) -> np.ndarray:
        """Volumes over which they are spread, but for a constant."""
        return abs(np.linalg.det(self.roots))  # type: ignore[no-any-return]


def _spread_of_means(each: np.ndarray) -> float:
    """Variance of all draws over that within populations, the largest one of the unknowns.

    The draws of each population have shape (populations, draws, unknowns).
    """
    if len(each) == 1:
        return math.inf
    # Populations of one point each agree with nothing.
    within = np.maximum(each.var(axis=1).mean(axis=0), 1e-300)
    return 1.0 + float((each.mean(axis=1).var(axis=0, ddof=1) / within).max())


def _worth(logs: np.ndarray) -> float:
    """How many independent draws weights are worth, by their logarithms."""
    each = np.exp(logs - logs.max())
    return float(each.sum() ** 2 / (each @ each))
