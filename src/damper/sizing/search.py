"""The optimiser: the damper whose worst case is least, over exact runs.

The worst case of a damper is the greatest of many runs, so some of its runs bound it from below.
Dampers of a grid wait in the order of their bounds; the first ones get more runs, until the first
has all of its own: then no other can be better, and most were never run in full. The cases that
were worst for the dampers before are run first. The first one then gets more runs about its worst
case, and is the best where it remains the first. A finer grid about the most promising dampers
follows, twice. At last the best one has to pass rounds of fresh random starts, of which each that
exceeds its worst case raises that; then another damper may be better. A method that follows slopes
is lost here: motions are born and die as the gap changes, and the worst case jumps. One that draws
at random pays for every run of every damper.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from damper.parameters.lazy import pd
from damper.sizing.machine import GRAVITY
from damper.sizing.study import Case, Sizes, rounded
from damper.sweep.progress import Progress

_NONE = Sizes(0.0, 0.0, 0.0)
#: Gaps of the first grid: parts of that of the closed forms.
_GAPS = (0.08, 5.0)
#: Parts of the best damper's gap of which a card says what they leave.
_GAPS_ABOUT = (0.8, 0.9, 0.95, 1.0, 1.05, 1.1, 1.25)
#: Largest gap of an upright box over g T^2: a flight of two cycles T is g (2 T)^2 / 8 high.
_FLIGHT = 0.5
#: Parts of the best damper's mass of which a card says what they leave, and of the gap that the
#: closed form's goes with them: in a band the best one is a little less.
MASS_PARTS, _LIGHTER_GAPS = (1.0, 0.75, 0.5), (1.0, 0.95, 0.9)
#: Those parts under weight.
_WEIGHED_GAPS = (1.0, 0.84, 0.7, 0.5, 0.35, 0.25)
#: Digits of masses and gaps: the best damper may stand next to where its motion ends.
DIGITS = 4


class Grid(NamedTuple):
    """How close the dampers of the first grid and of the finer ones are."""

    ratio: float
    """Of its gaps, for one restitution; of several as many dampers over all."""
    masses: tuple[float, ...]
    """Parts of the largest one."""
    finer: tuple[float, ...]
    """Ratios of gaps, `_STEPS` of them either way."""


_SMOOTH = Grid(1.1, (1.0, 0.85, 0.7, 0.5, 0.3), (1.025, 1.006))
#: Over a band motions are born and die at one frequency after another: the worst case jumps.
_BAND = Grid(1.0125, (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3), (1.006, 1.0015))
#: Of several masses, which fall out of step: the worst case jumps less, and runs take longer.
_SEVERAL = Grid(1.05, (1.0, 0.8, 0.6, 0.4), (1.015, 1.004))
#: Finer grids: steps either way, and those of a range of restitutions in its length.
_STEPS, _PARTS = 4, (12.0, 48.0)
#: Dampers about which the grid is made finer: at most, and with bounds over the best worst case.
_PROMISING, _NEAR = 8, 1.1
#: Dampers that get more runs at a time, so that there is work for all cores, and cases of each, at
#: first; then twice as many.
_AT_ONCE, _CASES = 8, 4
#: Times that the worst case of a damper is looked for nearby, and its rise that is worth another.
_LOOKS, _RISE = 4, 1.001
#: Sets of fresh random starts that a best damper has to pass at most.
_ROUNDS = 10


class Search:
    """Dampers of a machine, with what is known of their worst cases."""

    #: Dampers about which the grid is made finer, at most; cases that a damper gets at first.
    promising, first_cases = _PROMISING, _CASES

    def __init__(self, judge: Any) -> None:
        self.judge = judge
        self.bounds: dict[Any, float] = {}
        """Sizes -> the greatest value of its runs so far."""
        self.runs = 0
        self.doing = ""
        """The present step, for a person who waits."""
        self.show: Progress | None = None
        self.near: dict[Any, list[Any]] = {}
        """Sizes -> cases about the worst one, of dampers that had all of their own."""
        self.hardest: dict[Any, Any] = {}
        """Sizes -> the case that was the worst, up to there."""
        self._left: dict[Any, list[int]] = {}
        self._done = 0
        # Of each case the sum of its values over the bounds of their dampers, and their number.
        self._hard = np.zeros((2, len(judge.cases)))

    @property
    def _grid(self) -> Grid:
        if self.judge.machine.band is None:
            return _SMOOTH
        return _BAND if self.judge.count == 1 else _SEVERAL

    def best(self) -> Any:
        """The best damper, in numbers of four digits."""
        found = self.best_of(self.first_grid())
        for ratio, parts in zip(self._grid.finer, _PARTS, strict=True):
            order = sorted(self.bounds, key=self.bounds.__getitem__)
            near = [d for d in order if self.bounds[d] <= _NEAR * self.bounds[found]]
            about = [d for one in near[: self.promising] for d in self._about(one, ratio, parts)]
            found = self.best_of(list(dict.fromkeys([found, *about])))
        return self.checked(found)

    def checked(self, found: Any) -> Any:
        """Try the best damper by fresh random starts; the best one of all once they raise it.

        When no round is left, the best one of those that were tried: another one might be the best
        only because its rare motions were missed.
        """
        tried: list[Any] = []
        for seed in range(_ROUNDS):
            if self.show:
                self.doing = "rounds of fresh starts, at most"
                self.show(seed, _ROUNDS)
            tried.append(found)
            if not self._rises(found, seed):
                return found
            found = self.best_of(list(self.bounds))
        return self.best_of(list(dict.fromkeys(tried))) if tried else found

    def first_grid(self) -> list[Any]:
        """Gaps by masses and restitutions, within the room there is."""
        m, made = self.judge.machine, []
        step = math.log(self._grid.ratio) * (len(m.restitutions) if self._grid is _BAND else 1)
        for part, restitution in product(self._grid.masses, m.restitutions):
            mass = self._mass(part * m.largest_mass)
            gap = self.judge.closed_form_gap(mass, restitution) * self.judge.distance
            highest = _GAPS[1] * gap
            if m.weight.get("gravity") and m.band:
                # Upright, it may bounce on the lower wall alone.
                highest = max(highest, _FLIGHT * GRAVITY / m.band[0] ** 2)
            high = min(highest, m.largest_gap)
            low = min(max(_GAPS[0] * min(gap, high), m.gap_tolerance), high)
            wider = max(math.log(highest / gap) / math.log(_GAPS[1]), 1.0)
            count = math.ceil(math.log(high / low) / (step * wider)) + 1
            gaps = np.geomspace(low, high, count).tolist()
            made += self._dampers(_NONE, [mass], gaps, [restitution])
        return made

    def best_of(self, dampers: Sequence[Any]) -> Any:
        """The damper of these whose worst case is least; of equals the first."""
        for damper in dampers:
            self._left.setdefault(damper, list(range(self._hard.shape[1])))
            self.bounds.setdefault(damper, 0.0)
        self._done = 0
        while True:
            self._report(dampers)
            ordered = sorted(dampers, key=self.bounds.__getitem__)
            first = ordered[0]
            if self._left[first]:
                self._advance([one for one in ordered if self._left[one]][:_AT_ONCE])
            elif first in self.near:
                return first
            else:
                self._look_near(first)

    def best_of_each(self, found: Any, what: str) -> list[Any]:
        """The best damper of each value of a field, beside the one that is found."""
        tried: dict[Any, list[Any]] = {}
        for damper in self.bounds:
            tried.setdefault(getattr(damper, what), []).append(damper)
        own = getattr(found, what)
        return [found if one == own else self.best_of(some) for one, some in tried.items()]

    def best_of_masses(self, found: Any) -> list[Any]:
        """The damper `found`, and the best damper of each of `MASS_PARTS`, of a few gaps each.

        Their gaps are to that of the found one as those of the closed forms. Under weight those
        say nothing: gaps down to a quarter are tried.
        """
        m, made = self.judge.machine, [found]
        of = self.judge.closed_form_gap(found.mass, found.restitution)
        for mass in (self._mass(part * found.mass) for part in MASS_PARTS[1:]):
            ratio = self.judge.closed_form_gap(mass, found.restitution) / of
            parts = [part * ratio for part in _LIGHTER_GAPS] if not m.weight else _WEIGHED_GAPS
            gaps = [min(found.gap * part, m.largest_gap) for part in parts]
            some = self._dampers(found, [mass], gaps, [found.restitution])
            made += [self.best_of(some)] if some else []
        return made

    def gaps_about(self, found: Any) -> list[Any]:
        """The damper `found` and others that were tried, some per cent off in gap; all run in full.

        All but the gap is as found.
        """
        tried = (one for one in self.bounds if one._replace(gap=found.gap) == found and one.gap)
        like = list(dict.fromkeys([found, *tried]))
        logs = np.log([one.gap for one in like])
        wanted = (math.log(part * found.gap) for part in _GAPS_ABOUT)
        near = {like[int(np.argmin(np.abs(logs - gap)))] for gap in wanted}
        for one in near:
            self.worst(one)
        return sorted(near, key=lambda one: one.gap)

    def _report(self, dampers: Sequence[Any]) -> None:
        """Report how many of these are tried; then the most cases that a promising one has run."""
        if self.show is None:
            return
        done, total = sum(self.bounds[one] > 0.0 for one in dampers), len(dampers)
        self.doing = "dampers tried"
        if done == total:
            self.doing = "cases of the best damper"
            total = self._hard.shape[1]
            first = min(dampers, key=self.bounds.__getitem__)
            # Another damper may come first, with fewer cases: the report does not fall back.
            self._done = done = max(self._done, total - len(self._left[first]))
        self.show(done, total)

    def worst(self, damper: Any) -> float:
        """Worst case of a damper, of all its runs."""
        self.best_of([damper])
        return self.bounds[damper]

    def every_run(self, damper: Any) -> pd.DataFrame:
        """All runs of a damper again: value, frequency, whether it is as built, impacts."""
        self.worst(damper)
        judge, m = self.judge, self.judge.machine
        cases = [*judge.cases, *self.near[damper]]
        chains = [judge.chain(damper, case) for case in cases]
        observers = judge.observers | {"impacts": {"largest": True}}
        arrays = judge.observed(chains, observers)
        points = [point for chain in chains for point in chain]
        values, own = arrays[m.measured[0]].reshape(-1) * m.size, judge.sizes(damper)
        table = {
            "value": np.where(np.isnan(values), np.inf, values),
            "frequency": [point.get("forcing_frequency", math.tau) / math.tau for point in points],
            "built": [own.items() <= point.items() for point in points],
        }
        # Lengths of free motion are over half of the gap, which its tolerance changes.
        length = np.array([0.5 * point["gap"] if m.is_free else m.length for point in points])
        momentum = m.mass * m.rate * length
        table["approach_speed"] = m.rate * length * arrays["max_approach_speed"]
        table["impulse"] = momentum * arrays["max_impulse"]
        table["impact_energy"] = momentum * m.rate * length * arrays["max_impact_loss"]
        if not m.is_free:
            table["impact_rate"] = np.array(table["frequency"]) * arrays["impacts_per_period"]
        return pd.DataFrame(table)

    def _about(self, damper: Any, ratio: float, parts: float) -> list[Any]:
        m = self.judge.machine
        masses = [self._mass(damper.mass * ratio**k) for k in (0, -_STEPS, _STEPS)]
        gaps = [damper.gap * ratio**k for k in range(-_STEPS, _STEPS + 1)]
        restitutions = [damper.restitution]
        if m.restitution_range is not None:
            low, high = m.restitution_range
            others = (damper.restitution + k * (high - low) / parts for k in (-1, 1))
            restitutions += [rounded(min(max(other, low), high)) for other in others]
        return self._dampers(damper, masses, gaps, restitutions)

    def _mass(self, mass: float) -> float:
        return min(rounded(mass, DIGITS), self.judge.machine.largest_mass)

    def _dampers(
        self,
        like: Any,
        masses: Iterable[float],
        gaps: Iterable[float],
        restitutions: Iterable[float],
    ) -> list[Any]:
        """Dampers like one, with gaps as one would order them, within the room there is."""
        m = self.judge.machine
        kept = [min(rounded(gap, DIGITS), m.largest_gap) for gap in gaps if gap >= m.gap_tolerance]
        heavy = [one for one in masses if one - m.mass_tolerance >= m.least_mass]
        sizes = product(heavy, kept, restitutions)
        return [like._replace(mass=a, gap=b, restitution=c) for a, b, c in dict.fromkeys(sizes)]

    def _advance(self, dampers: Sequence[Any]) -> None:
        """Run the cases of each of these that are the hardest so far; those of many runs last."""
        mean, cases = self._hard[0] / np.maximum(self._hard[1], 1.0), self.judge.cases
        taken = []
        for damper in dampers:
            left = self._left[damper]
            count = max(self.first_cases, (self._hard.shape[1] - len(left)) // 2)
            left.sort(key=lambda case: (len(cases[case].hertz) > 1, -mean[case]))
            taken.append((damper, left[:count]))
            del left[:count]
        asked = [(damper, [cases[number] for number in some]) for damper, some in taken]
        for (damper, numbers), found in zip(taken, self._run(asked), strict=True):
            bound = self.bounds[damper]
            self._hard[0, numbers] += found / bound if bound < math.inf else found == bound
            self._hard[1, numbers] += 1.0

    def _look_near(self, damper: Any) -> None:
        """Run more cases about the worst one, and again while that raises it."""
        bound, kept = 0.0, self.near.setdefault(damper, [])
        for _ in range(_LOOKS):
            if self.bounds[damper] <= _RISE * bound or self.bounds[damper] == math.inf:
                return
            bound, cases = self.bounds[damper], self.judge.near(self.hardest[damper])
            if not cases:
                return
            kept += cases
            self._run([(damper, cases)])

    def _rises(self, damper: Any, seed: int) -> bool:
        """Run fresh random starts of a damper; if one exceeds its worst case, look near that."""
        bound, cases = self.bounds[damper], self.judge.fresh(self.hardest[damper], seed)
        self.near[damper] += cases
        self._run([(damper, cases)])
        if self.bounds[damper] > bound:
            self._look_near(damper)
        return self.bounds[damper] > bound

    def _run(self, asked: Sequence[tuple[Sizes, Sequence[Case]]]) -> list[np.ndarray]:
        """Run cases of dampers, keep the worst ones, and return the greatest value of each case."""
        chains = [self.judge.chain(damper, case) for damper, cases in asked for case in cases]
        values = measure(self.judge, chains)
        self.runs += len(values)
        ends = np.cumsum([len(chain) for chain in chains])
        parts = np.split(values, ends[:-1])
        greatest = np.array([part.max() for part in parts])
        places = np.cumsum([len(cases) for _, cases in asked])
        for (damper, cases), last in zip(asked, places, strict=True):
            first = last - len(cases)
            at = first + int(np.argmax(greatest[first:last]))
            if greatest[at] > self.bounds[damper] or damper not in self.hardest:
                self.bounds[damper] = float(greatest[at])
                case = cases[at - first]
                link = int(np.argmax(parts[at])) + 1
                self.hardest[damper] = case._replace(hertz=case.hertz[:link])
        return np.split(greatest, places[:-1])


def measure(judge: Any, chains: Iterable[Any]) -> np.ndarray:
    """What counts, of each run; infinite where it stopped early or never fell so low."""
    m = judge.machine
    values = judge.observed(list(chains), judge.observers)[m.measured[0]]
    return np.where(np.isnan(values), np.inf, values * m.size).reshape(-1)
