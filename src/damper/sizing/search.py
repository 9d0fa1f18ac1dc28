"""The optimiser: the damper whose worst case is least, over exact runs.

The worst case of a damper is the greatest of many runs, so some of its runs bound it from below.
Dampers of a grid wait in the order of their bounds; the first ones get more runs, until the first
has all of its own: then no other can be better, and most were never run in full. A finer grid about
it follows, twice. A method that follows slopes is lost here: motions are born and die as the gap
changes, and the worst case jumps. One that draws at random pays for every run of every damper.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np

from damper.sizing.study import Damper, Judge
from damper.sweep.grid import product as points_of
from damper.sweep.runs import run_points

#: Gaps of the first grid: parts of that of the closed laws, and their ratio.
_GAPS, _RATIO = (0.08, 5.0), 1.1
#: Masses of the first grid, parts of the largest one.
_MASSES = (1.0, 0.85, 0.7, 0.5, 0.3)
#: Finer grids about the best damper: ratios of gaps, steps either way.
_FINER = ((1.025, 4), (1.006, 4))
#: Dampers that get more runs at a time, so that there is work for all cores.
_AT_ONCE = 6


class Search:
    """The dampers of a machine with what is known of their worst cases."""

    def __init__(self, judge: Judge) -> None:
        self.judge = judge
        self.bounds: dict[Damper, float] = {}
        """Damper -> the greatest value of its runs so far."""
        self.runs = 0
        self._done: dict[Damper, int] = {}
        self._stages: dict[Damper, list[list[dict[str, float]]]] = {}

    def best(self) -> Damper:
        """The best damper: rounded numbers, and none of the grids' better."""
        grid = self.first_grid()
        found = self.best_of(grid)
        for ratio, steps in _FINER:
            found = self.best_of([found, *self._about(found, ratio, steps)])
        return found

    def first_grid(self) -> list[Damper]:
        """Gaps by masses, within the room there is."""
        m = self.judge.machine
        made = []
        for part in _MASSES:
            mass = _round(part * m.largest_mass)
            law = self.judge.law_gap(mass)
            low = max(_GAPS[0] * min(law, m.largest_gap), m.gap_tolerance * 1.01)
            high = min(_GAPS[1] * law, m.largest_gap)
            low = min(low, high)
            count = max(math.ceil(math.log(high / low) / math.log(_RATIO)) + 1, 1)
            made += [Damper(mass, gap) for gap in self._rounded(np.geomspace(low, high, count))]
        return made

    def best_of(self, dampers: Sequence[Damper]) -> Damper:
        """The damper of these whose worst case is least; of equals the first."""
        for damper in dampers:
            self.bounds.setdefault(damper, 0.0)
            self._done.setdefault(damper, 0)
        while True:
            waiting = sorted(dict.fromkeys(dampers), key=self.bounds.__getitem__)
            first = waiting[0]
            if self._is_known(first):
                return first
            self._advance([one for one in waiting if not self._is_known(one)][:_AT_ONCE])

    def worst(self, damper: Damper) -> float:
        """Worst case of a damper, of all its runs."""
        self.best_of([damper])
        return self.bounds[damper]

    def _is_known(self, damper: Damper) -> bool:
        return self._done[damper] >= len(self._stages_of(damper))

    def _about(self, damper: Damper, ratio: float, steps: int) -> list[Damper]:
        powers = [ratio**k for k in range(-steps, steps + 1)]
        most = self.judge.machine.largest_mass
        masses = {_round(min(damper.mass * p, most)) for p in (1.0, ratio**-steps, ratio**steps)}
        gaps = self._rounded([damper.gap * power for power in powers])
        return [Damper(m, gap) for m, gap in product(sorted(masses, reverse=True), gaps)]

    def _rounded(self, gaps: Any) -> list[float]:
        """Gaps as one would order them, within the room there is."""
        m = self.judge.machine
        made = (min(_round(gap), m.largest_gap) for gap in gaps)
        return list(dict.fromkeys(gap for gap in made if gap >= m.gap_tolerance))

    def _stages_of(self, damper: Damper) -> list[list[dict[str, float]]]:
        """Points of a damper's runs in the order in which they are made: those as built first."""
        if damper not in self._stages:
            judge = self.judge
            grid = points_of(judge.axes(damper), judge.fixed)
            own = judge.nominal(damper)
            as_built = [p for p in grid if all(p[name] == own[name] for name in own)]
            extreme = [p for p in grid if not any(_inner(p, own, name, judge) for name in own)]
            ends = [p for p in extreme if p not in as_built]
            rest = [p for p in grid if p not in as_built and p not in ends]
            half = len(as_built) // 2 or 1
            stages = [as_built[:half], as_built[half:], ends, rest]
            self._stages[damper] = [stage for stage in stages if stage]
            if not judge.machine.is_free:
                self._stages[damper].insert(1, [])  # the band followed, both ways
        return self._stages[damper]

    def _advance(self, dampers: Sequence[Damper]) -> None:
        """Make the next runs of each of these."""
        judge = self.judge
        points: list[dict[str, float]] = []
        before: list[int] = []
        ends = []
        rates = [2.0 * math.pi * f for f in judge.band]
        for damper in dampers:
            stage = self._stages_of(damper)[self._done[damper]]
            if judge.machine.is_free:
                points += stage
                before += [-1] * len(stage)
            elif stage:
                points += [{**p, "forcing_frequency": rate} for p in stage for rate in rates]
                before += [-1] * (len(stage) * len(rates))
            else:
                fixed = judge.fixed | judge.nominal(damper) | {"initial_position": 1.0}
                for way in (rates, rates[::-1]):
                    start = len(points)
                    points += [{**fixed, "forcing_frequency": rate} for rate in way]
                    before += [-1, *range(start, start + len(way) - 1)]
            ends.append(len(points))
        values = measure(judge, points, before)
        self.runs += len(points)
        for damper, part in zip(dampers, np.split(values, ends[:-1]), strict=True):
            self.bounds[damper] = max(self.bounds[damper], float(part.max()))
            self._done[damper] += 1


def measure(judge: Judge, points: list[dict[str, float]], before: list[int] | None) -> np.ndarray:
    """What counts, of each run; infinite where it stopped early or never fell so low."""
    from damper.sweep.points import read_point

    variable, unit, _ = judge.machine.measured
    force = judge.machine.force[0]
    arrays, _ = run_points(
        points, judge.observers, forcing=force, predecessor=before, workers=_cores(), **judge.run
    )
    values = arrays[variable].reshape(len(points))
    sizes = np.array([read_point({**p, "forcing": force}).units.size(_OF[unit]) for p in points])
    return np.where(np.isnan(values), np.inf, values * sizes)


_OF = {"m": "F0/K", "s": "sqrt(M/K)"}


def _cores() -> int | None:
    return None


def _inner(point: dict[str, float], own: dict[str, float], name: str, judge: Judge) -> bool:
    """Whether a quantity that has a tolerance is at its nominal value."""
    tolerance = {"free_mass": judge.machine.mass_tolerance, "gap": judge.machine.gap_tolerance}
    wide = tolerance.get(name, judge.machine.restitution_tolerance)
    return wide > 0.0 and point[name] == own[name]


def _round(value: float) -> float:
    return float(f"{value:.3g}")
