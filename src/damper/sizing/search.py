"""The optimiser: the damper whose worst case is least, over exact runs.

The worst case of a damper is the greatest of many runs, so some of its runs bound it from below.
Dampers of a grid wait in the order of their bounds; the first ones get more runs, until the first
has all of its own: then no other can be better, and most were never run in full. A finer grid about
it follows, twice. A method that follows slopes is lost here: motions are born and die as the gap
changes, and the worst case jumps. One that draws at random pays for every run of every damper.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import product

import numpy as np

from damper.sizing.study import Chain, Damper, Judge, rounded
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
    """Dampers of a machine, with what is known of their worst cases."""

    def __init__(self, judge: Judge) -> None:
        self.judge = judge
        self.bounds: dict[Damper, float] = {}
        """Damper -> the greatest value of its runs so far."""
        self.runs = 0
        self._waiting: dict[Damper, list[list[Chain]]] = {}

    def best(self) -> Damper:
        """The best damper, in numbers of three digits."""
        found = self.best_of(self.first_grid())
        for ratio, steps in _FINER:
            found = self.best_of([found, *self._about(found, ratio, steps)])
        return found

    def first_grid(self) -> list[Damper]:
        """Gaps by masses, within the room there is."""
        m, made = self.judge.machine, []
        for mass in (rounded(part * m.largest_mass) for part in _MASSES):
            law = self.judge.law_gap(mass) * self.judge.distance
            high = min(_GAPS[1] * law, m.largest_gap)
            low = min(max(_GAPS[0] * min(law, high), m.gap_tolerance), high)
            count = math.ceil(math.log(high / low) / math.log(_RATIO)) + 1
            made += self._dampers([mass], np.geomspace(low, high, count).tolist())
        return made

    def best_of(self, dampers: Sequence[Damper]) -> Damper:
        """The damper of these whose worst case is least; of equals the first."""
        for damper in dampers:
            self._waiting.setdefault(damper, self.judge.stages(damper))
            self.bounds.setdefault(damper, 0.0)
        while True:
            ordered = sorted(dict.fromkeys(dampers), key=self.bounds.__getitem__)
            if not self._waiting[ordered[0]]:
                return ordered[0]
            self._advance([one for one in ordered if self._waiting[one]][:_AT_ONCE])

    def worst(self, damper: Damper) -> float:
        """Worst case of a damper, of all its runs."""
        self.best_of([damper])
        return self.bounds[damper]

    def _about(self, damper: Damper, ratio: float, steps: int) -> list[Damper]:
        most = self.judge.machine.largest_mass
        masses = [min(damper.mass * ratio**k, most) for k in (0, -steps, steps)]
        gaps = [damper.gap * ratio**k for k in range(-steps, steps + 1)]
        return self._dampers(map(rounded, masses), gaps)

    def _dampers(self, masses: Iterable[float], gaps: Iterable[float]) -> list[Damper]:
        """Dampers with gaps as one would order them, within the room there is."""
        m = self.judge.machine
        kept = [min(rounded(gap), m.largest_gap) for gap in gaps if gap >= m.gap_tolerance]
        return list(dict.fromkeys(Damper(mass, gap) for mass, gap in product(masses, kept)))

    def _advance(self, dampers: Sequence[Damper]) -> None:
        """Make the next runs of each of these."""
        stages = [self._waiting[damper].pop(0) for damper in dampers]
        values = measure(self.judge, [chain for stage in stages for chain in stage])
        ends = np.cumsum([sum(map(len, stage)) for stage in stages])
        self.runs += len(values)
        for damper, part in zip(dampers, np.split(values, ends[:-1]), strict=True):
            self.bounds[damper] = max(self.bounds[damper], float(part.max()))


def measure(judge: Judge, chains: Iterable[Chain]) -> np.ndarray:
    """What counts, of each run; infinite where it stopped early or never fell so low."""
    points: Chain = []
    before: list[int] = []
    for chain in chains:
        before += [-1, *range(len(points), len(points) + len(chain) - 1)]
        points += chain
    arrays, _ = run_points(
        points,
        judge.observers,
        forcing=judge.machine.force[0],
        predecessor=before,
        workers=None,
        **judge.run,
    )
    values = arrays[judge.machine.measured[0]].reshape(len(points))
    return np.where(np.isnan(values), np.inf, values * judge.machine.size)
