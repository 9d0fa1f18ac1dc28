"""Least squares: from many starts, and from short windows of the records to the whole."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from damper.engine.compiled import compiling
from damper.identification.draws import Draws
from damper.identification.problem import OF_RECORD, RecordedDamper
from damper.identification.recordings import TIMES, Recording

#: First part of the records that is fitted, and by what the next ones grow.
_FIRST, _GROWS = 0.125, 1.3
#: Part of the records from which on the next one is the whole.
_LAST_PART = 0.9
#: Starts of each round, and how many of them, and of points that come from the window before, are
#: fitted in a window; there are more rounds until two of them end in the best place.
_ROUNDS = ((200, 3), (400, 4), (800, 6))
#: Points around a fit.
_DRAWS = 20
#: Steps of a fit in a window, of one of the whole, of the last one and of one in a profile.
_IN_WINDOW, _WHOLE, _LAST, _NEAR = 5, 8, 30, 2
#: Neighbours whose correlation counts.
_LAGS = 10
#: Chance of a residual in white noise below which the search goes on.
_DOUBT = 0.01
#: Fits of a profile to one side at most, those by which it gets to the end of an interval if the
#: sum of squares rises as the covariance says, and part of the rise there at which it ends.
_OUTWARD, _TO_END, _RISEN = 8, 2, 0.95
#: Sum of squares, over the variance, by which minima differ that one 95 % interval holds.
_ALIKE = 4.0
#: Part of the probability on each side of an interval.
_TAIL = 0.025
#: Longest step of a profile over the range of starts.
_LONGEST = 0.15
#: Variance, over the noise that is taken at first, of records that are nearly as exact as runs,
#: and that of runs.
_EXACT, _RUNS = 1e-12, 1e-14
#: Degrees of freedom from which on the variance of a window says something.
_TELLING = 4
#: Decrease of the sum of squares, over the noise, at which a fit ends: in windows and at last. The
#: unknowns then are within the root of it, in standard errors.
_ROUGH, _FINE = 0.5, 1e-3
#: Points nearer than this part of their ranges are one start.
_SAME = 0.05
#: Singular value, over the largest one, below which data say nothing, or hardly anything.
_NOTHING, _HARDLY = 1e-7, 0.04
#: Variance below which there is no noise.
_TINY = 1e-24
#: Numbers of a vector for whose product OpenBLAS takes one thread. With more of them threads wait
#: for each other in a loop, which takes a thousand times as long beside other processes.
_ONE_THREAD = 10_000
#: Part of a combination that is named.
_NAMED = 0.05


@dataclass(frozen=True, eq=False)
class Fit:
    """A point with the least sum of squares, and what the data say about it."""

    problem: RecordedDamper
    point: np.ndarray
    residuals: np.ndarray
    jacobian: np.ndarray
    converged: bool

    @property
    def cost(self) -> float:
        """Sum of squares over the noise."""
        return sum_of_squares(self.residuals)

    @cached_property
    def freedom(self) -> int:
        """Data that count, less the unknowns."""
        return max(int(np.count_nonzero(self.residuals)) - len(self.point), 1)

    @property
    def variance(self) -> float:
        """Variance of the residual, over the noise; that of exact records is of the runs."""
        return max(self.cost / self.freedom, _RUNS)

    @cached_property
    def _directions(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Sizes of the jacobian's columns, singular values without these, and directions."""
        sizes = np.linalg.norm(self.jacobian, axis=0)
        sizes[sizes == 0.0] = 1.0
        _, values, rows = np.linalg.svd(self.jacobian / sizes, full_matrices=False)
        return sizes, values, rows

    @cached_property
    def covariance(self) -> np.ndarray:
        """Covariance of the unknowns; infinite variance of what the data say nothing about."""
        sizes, values, rows = self._directions
        told = values > _NOTHING * values[0]
        part = rows[told].T / values[told]
        found = self.variance * (part @ part.T) / np.outer(sizes, sizes)
        lost = (abs(rows[~told]) > 1e-3).any(axis=0)
        found[lost, lost] = math.inf
        return found

    @property
    def confused(self) -> list[tuple[float, list[int]]]:
        """Singular value and unknowns of each combination that the data hardly tell apart."""
        _, values, rows = self._directions
        found = []
        for value, row in zip(values / values[0], rows, strict=True):
            if value < _HARDLY:
                found.append((float(value), np.flatnonzero(abs(row) > _NAMED).tolist()))
        return found

    @property
    def each(self) -> list[np.ndarray]:
        """Residuals of each record."""
        return [some[some != 0.0] for some in _of_each(self.problem.records, self.residuals)]

    @cached_property
    def chance(self) -> float:
        """Probability in white noise of a residual as correlated, or a value as large, as here.

        The least one of the records. Of correlations of neighbours by Ljung and Box (Biometrika 65,
        297, 1978), of the largest value by the normal distribution; times two, as there are two.
        """
        from scipy.stats import chi2, norm

        least = 0.5
        for some in self.each if self.variance > _EXACT else ():
            count, lags = len(some), np.arange(1, min(_LAGS, len(some) // 4) + 1)
            if lags.size and (power := float(some @ some)):
                parts = np.array([some[lag:] @ some[:-lag] for lag in lags]) / power
                sum_of_squares = count * (count + 2) * float(np.sum(parts**2 / (count - lags)))
                most = abs(some).max() * math.sqrt(count / power)
                each = chi2.sf(sum_of_squares, lags.size), 2.0 * count * norm.sf(most)
                least = min(least, *map(float, each))
        return 2.0 * least

    def excess(self, chance: float) -> dict[str, float]:
        """Rms of the residual over the noise, by the labels of records where it is too large.

        Noise makes it as large with less than this chance, by the F test, which is chi-square for a
        stated noise. Of records whose noise is known without the fit; that of times is below a
        tenth of the mean one between impacts, which could not be counted otherwise.
        """
        from scipy.stats import f

        found = {}
        share = self.freedom / (self.freedom + len(self.point))
        for k, (some, record) in enumerate(zip(self.each, self.problem.records, strict=True)):
            told = (self.problem.size(k), math.inf) if record.kind in TIMES else None
            if len(some) and (told := record.own_noise or told):
                noise, known = told
                freedom = max(share * len(some), 1.0)
                rms = self.problem.noise[k] * math.sqrt(float(some @ some) / freedom)
                most = noise * math.sqrt(f.isf(chance, freedom, min(known, 1e9)))
                if rms > max(most, math.sqrt(_EXACT) * self.problem.size(k)):
                    found[record.label] = rms / noise if noise else math.inf
        return found


class Fitter:
    """Finds the best point of a problem."""

    def __init__(self, problem: RecordedDamper) -> None:
        self.problem = problem
        unknowns = problem.unknowns
        self.bounds = tuple(np.array([u.allowed[k] for u in unknowns]) for k in (0, 1))
        starts = tuple(np.array([u.starts[k] for u in unknowns]) for k in (0, 1))
        spread = starts[0] < starts[1]
        #: Bounds in windows, which tell some unknowns hardly.
        self.narrow = tuple(
            np.where(spread, *pair) for pair in zip(starts, self.bounds, strict=True)
        )
        self.widths = np.where(spread, starts[1] - starts[0], 1.0)
        self.linear = [
            j for j, u in enumerate(unknowns) if u.name in OF_RECORD and u.name != "scale"
        ]
        self.count = sum(len(record.times) for record in problem.records)
        self.generator = random.Random(0)
        #: Variance of all draws over that within populations of them.
        self.spread_of_means = 1.0
        #: Part of the records and point of each window's best fit.
        self.windows: list[tuple[float, np.ndarray]] = []
        #: Chance of the whole fitting as much worse than a window.
        self.in_part = 1.0
        #: Whether two rounds have ended in the best place.
        self.again = False
        #: Sum of squares of each record, in its own units, and point of all that was tried on the
        #: whole records.
        self.sums: list[tuple[np.ndarray, np.ndarray]] = []

    def best(self) -> Fit:
        """Return the best fit of all rounds of starts."""
        # Thousands of short runs: compiled ones, with differences for derivatives.
        begin, found = 0, list[Fit]()
        with compiling():
            for number, (count, kept) in enumerate(_ROUNDS):
                found.append(self._round(self._parts(number), begin, count, kept))
                begin += count
                if self.problem.hide(min(found, key=lambda fit: fit.cost).point):
                    self.sums.clear()
                    found = [self.fit(fit.point, 1.0, _WHOLE) for fit in found]
                found.sort(key=lambda fit: fit.cost)
                best = found[0]
                # The order of impacts makes many minima, some of nearly the same depth.
                near = best.cost + _ALIKE * max(best.variance, _EXACT)
                # What is exact is no chance.
                self.again = best.variance <= _EXACT or (len(found) > 1 and found[1].cost <= near)
                self.in_part = self._chance_in_part(best)
                doubts = min(best.chance, self.in_part) < _DOUBT or best.excess(_DOUBT)
                if self.again and not doubts:
                    break
        return self.exact(self._weighed(best).point)

    @property
    def tried(self) -> list[tuple[float, np.ndarray]]:
        """Sum of squares over the noise and point of all that was tried on the whole records."""
        weights = np.array(self.problem.noise) ** -2.0
        return [(float(sums @ weights), point) for sums, point in self.sums]

    def keep(self, residuals: np.ndarray, point: np.ndarray) -> None:
        """Keep what was tried on the whole records, whatever their noise turns out to be."""
        sums = np.array(list(map(sum_of_squares, _of_each(self.problem.records, residuals))))
        self.sums.append((sums * np.array(self.problem.noise) ** 2.0, point))

    def _chance_in_part(self, fit: Fit) -> float:
        """Chance of white noise to make the rest of the records fit as much worse than a window.

        The least one of the windows, times their number; by the F test of Chow (Econometrica 28,
        591, 1960).
        """
        from scipy.stats import f

        least = 1.0
        for part, point in self.windows if fit.variance > _EXACT else ():
            window = Fit(self.problem, point, *self.problem.residuals(point, part), True)
            if (rest := fit.freedom - window.freedom) > 0:
                ratio = (fit.cost - window.cost) / rest / max(window.variance, _TINY)
                least = min(least, len(self.windows) * float(f.sf(ratio, rest, window.freedom)))
        return least

    def _parts(self, number: int) -> list[float]:
        """Windows of a round; every second round has windows that end halfway between."""
        part = _FIRST * _GROWS ** (0.5 * (number % 2))
        part, parts = max(part, (2 + len(self.problem.unknowns)) / self.count), []
        while part < _LAST_PART:
            parts.append(part)
            part *= _GROWS
        return [*parts, 1.0]

    def exact(self, point: np.ndarray) -> Fit:
        """Fit by the engine's own derivatives, which also tell what the data cannot."""
        sampled = any(record.is_sampled for record in self.problem.records)
        self.problem.fine = True
        # Of times the few derivatives take less than compiling.
        with compiling(sampled):
            fit = self.fit(point, 1.0, _LAST)
        self.problem.fine = False
        return fit

    def _weighed(self, fit: Fit) -> Fit:
        """Return the fit with the noise of each kind of record as found."""
        records, problem = self.problem.records, self.problem
        for _ in range(3 if len({record.kind for record in records}) > 1 else 0):
            sums: dict[str, list[np.ndarray]] = {}
            for record, noise, some in zip(records, problem.noise, fit.each, strict=True):
                if record.noise is None:
                    sums.setdefault(record.kind, []).append(some * noise)
            share = fit.freedom / (fit.freedom + len(fit.point))
            for k, record in enumerate(records):
                if record.noise is None and (found := np.concatenate(sums[record.kind])).size:
                    size = math.sqrt(float(found @ found) / found.size / share)
                    problem.noise[k] = size or problem.noise[k]
            fit = self.fit(fit.point, 1.0, _WHOLE)
        return fit

    def _round(self, parts: Sequence[float], begin: int, count: int, kept: int) -> Fit:
        """Fit the best of so many starts, from short windows to the whole."""
        starts = [self._scored(self.start(k), parts) for k in range(begin, begin + count)]
        points: list[np.ndarray] = []
        for number, part in enumerate(parts):
            some = self.best_of([start[number] for start in starts], kept)
            more = self.best_of([self._scored(p, (part,))[0] for p in points], kept)
            steps = _IN_WINDOW if part < 1.0 else _WHOLE
            fits = [self.fit(point, part, steps) for point in self._different(more + some)]
            fits.sort(key=lambda fit: fit.cost)
            if part < 1.0 and fits[0].freedom >= _TELLING:
                self.windows.append((part, fits[0].point))
            # Without steps beside the best ones, which the next window may tell apart.
            points = [fit.point for fit in fits[kept:]]
            points += [point for fit in fits[:kept] for point in self._around(fit)]
        return fits[0]

    def best_of(self, scored: list[tuple[float, np.ndarray]], count: int) -> list[np.ndarray]:
        """So many different points, the best one first."""
        kept: list[np.ndarray] = []
        for _, point in sorted(scored, key=lambda one: one[0]):
            if len(kept) < count:
                kept = self._different([*kept, point])
        return kept

    def _around(self, fit: Fit) -> Iterator[np.ndarray]:
        """A fit's point, and points that the data hardly tell from it."""
        yield fit.point
        spread = self.spread(fit, fit.variance)
        for k in range(_DRAWS):
            drawn = np.array([self.generator.gauss(0.0, 3.0 ** (k % 3)) for _ in fit.point])
            yield np.clip(fit.point + spread @ drawn, *self.narrow)

    def start(self, k: int) -> np.ndarray:
        """The start with a number: the values that are given or found, then spread evenly."""
        found = []
        for j, unknown in enumerate(self.problem.unknowns):
            part = (0.5 + k * _step(j, len(self.problem.unknowns))) % 1.0
            given = unknown.value is not None and k == 0
            found.append(unknown.value if given else unknown.at(part))
        return np.clip(np.array(found, float), *self.narrow)

    def _scored(self, point: np.ndarray, parts: Sequence[float]) -> list[tuple[float, np.ndarray]]:
        """Sum of squares in each window with the best constants of the records, and that point.

        The last window is the longest one.
        """
        residuals, columns = self.problem.residuals(point, parts[-1])
        found = []
        for part in parts:
            inside = self._inside(part, parts[-1])
            missed, there = residuals[inside], point
            if self.linear:
                some = columns[inside][:, self.linear]
                step = np.linalg.lstsq(some, -missed, rcond=None)[0]
                there = point.copy()
                there[self.linear] += step
                missed = missed + some @ step
            found.append((sum_of_squares(missed), there))
        if parts[-1] == 1.0:
            self.keep(missed, there)
        return found

    def _inside(self, part: float, whole: float) -> np.ndarray:
        """Numbers of the data of a window within those of a longer one."""
        found, end = [], 0
        for k in range(len(self.problem.records)):
            found.append(end + np.arange(self.problem.count(k, part)))
            end += self.problem.count(k, whole)
        return np.concatenate(found)

    def _different(self, points: list[np.ndarray]) -> list[np.ndarray]:
        kept: list[np.ndarray] = []
        for point in points:
            if all(abs((point - other) / self.widths).max() > _SAME for other in kept):
                kept.append(point)
        return kept

    def fit(self, point: np.ndarray, part: float, steps: int, fixed: int | None = None) -> Fit:
        """Least squares of a part of the records, from a point; one unknown may be fixed."""
        from scipy.optimize import least_squares

        free = [j for j in range(len(point)) if j != fixed]
        if not free:
            residuals, jacobian = self.problem.residuals(point, part)
            return Fit(self.problem, point, residuals, jacobian, True)
        low, high = (b[free] for b in (self.bounds if part == 1.0 else self.narrow))

        def whole(some: np.ndarray) -> np.ndarray:
            full = point.copy()
            full[free] = some
            return full

        room = np.where(np.isfinite(high - low), 1e-9 * (high - low), 1e-12)
        begin = np.clip(point[free], low + room, high - room)
        found = least_squares(
            lambda some: self.problem.residuals(whole(some), part)[0],
            begin,
            lambda some: self.problem.residuals(whole(some), part, True)[1][:, free],
            (low, high),
            x_scale="jac",
            max_nfev=steps,
            ftol=(_FINE if part == 1.0 else _ROUGH) / self.count,
            xtol=1e-10,
            gtol=float(np.finfo(float).eps),  # of exact records the gradient vanishes
        )
        jacobian = found.jac
        if fixed is not None:
            jacobian = np.insert(jacobian, fixed, 0.0, axis=1)
        fit = Fit(self.problem, whole(found.x), found.fun, jacobian, found.status > 0)
        if part == 1.0:
            self.keep(fit.residuals, fit.point)
        return fit

    def profile(self, fit: Fit, j: int, way: float) -> Iterator[Fit]:
        """Fits of the other unknowns, of which one goes off to where the data are against it.

        By parts of `way` standard errors, until the sum of squares has risen as much as these say.
        """
        covariance, point = fit.covariance, fit.point
        step = way / _TO_END * covariance[:, j] / math.sqrt(covariance[j, j])
        step *= min(1.0, _LONGEST * self.widths[j] / abs(step[j]))
        for _ in range(_OUTWARD):
            before, point = point[j], np.clip(point + step, *self.bounds)
            if point[j] == before:
                return
            other = self.fit(point, 1.0, _NEAR, j)
            yield other
            if other.cost >= fit.cost + way**2 * fit.variance * _RISEN:
                return
            point = other.point

    def likely(self, fit: Fit) -> np.ndarray:
        """Points that the records leave possible, all as probable; the best ones are fitted."""
        if fit.variance <= _EXACT:
            return fit.point[None]
        points, self.spread_of_means = Draws(self, fit).draw()
        some = fit.jacobian[:, self.linear]
        noise = np.random.default_rng(0).standard_normal((len(points), len(some)))
        points[:, self.linear] += math.sqrt(fit.variance) * noise @ np.linalg.pinv(some).T
        return points

    def other(self, fit: Fit) -> np.ndarray | None:
        """The furthest point that one interval holds with the fit, if it is in another minimum.

        It then is more than twice as far from the fit as the covariance allows.
        """
        free = [j for j in range(len(fit.point)) if j not in self.linear]
        errors = np.sqrt(np.diag(fit.covariance))[free]
        near = [point for cost, point in self.tried if cost <= fit.cost + _ALIKE * fit.variance]
        off = [(abs(point - fit.point)[free] / errors).max() for point in near]
        return near[int(np.argmax(off))] if max(off, default=0.0) > 2.0 * _ALIKE**0.5 else None

    def spread(self, fit: Fit, variance: float) -> np.ndarray:
        """Root of the covariance of the unknowns, which are somewhere in the range of starts."""
        scaled = fit.jacobian * self.widths
        information = scaled.T @ scaled / max(variance, _TINY)
        values, rows = np.linalg.eigh(information + np.eye(len(fit.point)))
        return self.widths[:, None] * rows / np.sqrt(values)  # type: ignore[no-any-return]

    def ends(self, fit: Fit, errors: float, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest values of the unknowns in 95 % of what the records leave possible.

        They are at least so many standard errors off: far out there are few draws.
        """
        span = errors * np.sqrt(np.diag(fit.covariance))
        ends = np.quantile(points, [_TAIL, 1.0 - _TAIL], axis=0)
        low, high = np.minimum(ends[0], fit.point - span), np.maximum(ends[1], fit.point + span)
        return np.maximum(low, self.bounds[0]), np.minimum(high, self.bounds[1])


def sum_of_squares(values: np.ndarray) -> float:
    """Sum of squares, by products that are short enough for one thread."""
    parts = (values[k : k + _ONE_THREAD] for k in range(0, len(values), _ONE_THREAD))
    return float(sum(part @ part for part in parts))


def _of_each(records: Sequence[Recording], values: np.ndarray) -> list[np.ndarray]:
    """Values of all records, as those of each."""
    found, end = [], 0
    for record in records:
        begin, end = end, end + len(record.times)
        found.append(values[begin:end])
    return found


def _step(j: int, count: int) -> float:
    """Step of an even sequence in a cube: powers of the root of x^(n+1) = x + 1."""
    root = 1.5
    for _ in range(50):
        root = (1.0 + root) ** (1.0 / (count + 1))
    return root ** -(j + 1) % 1.0
