"""Classes of a paper's statements: words and numbers, a rule that judges them, scores."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from damper.parameters.lazy import xr

HOLDS, FAILS = "holds", "does not hold"
#: Where it holds if one of several readings, or one of the assumed values, is taken.
READING = "true only if read as follows"
#: Where the text says nothing that could be false, and where studies are missing.
UNTESTABLE, UNTESTED = "not testable", "not tested"


@dataclass(frozen=True)
class Statement:
    """One statement of a paper.

    `text` is the statement in our words, `where` its place in the paper's text, `stated` its
    number or words as they stand there. `judge` computes the verdict from the cubes of `studies`,
    by name; `figures` are the files that show it (below the folder of results, without suffix).
    `scores` are those of the calibration, by name.
    """

    name: str
    text: str
    where: str
    stated: str
    studies: tuple[str, ...]
    figures: tuple[str, ...]
    judge: Callable[[Mapping[str, xr.Dataset]], Verdict]
    scores: Mapping[str, Score] = field(default_factory=dict)


@dataclass(frozen=True)
class Verdict:
    """The verdict on a statement: its kind, the numbers found, and the reason in a line.

    `why` names the reading where the verdict is `READING`. `numbers` are the rows of a table, its
    heads first.
    """

    found: str
    verdict: str
    why: str
    numbers: Sequence[Sequence[str]] = ()


@dataclass(frozen=True)
class Score:
    """How far each set of parameters of a calibration meets a statement.

    `text` says what is scored, `measure` computes it from a cube with the variables of the
    `observers` and the axes that it `needs`. `tolerant`: whether it depends on tolerances.
    """

    text: str
    observers: tuple[str, ...]
    needs: Mapping[str, Values]
    measure: Callable[[xr.Dataset, Tolerances], Scored]
    tolerant: bool = False

    @property
    def axes(self) -> tuple[str, ...]:
        """Axes that the statement is about; the others span the sets of parameters."""
        return tuple(self.needs)


@dataclass(frozen=True)
class Values:
    """What an axis must have: some values, values on both sides of one, or just several."""

    these: tuple[float, ...] = ()
    around: float | None = None
    least: int = 0

    @property
    def words(self) -> str:
        """What is needed, in words."""
        if self.these:
            return f"the values {', '.join(map(str, self.these))}"
        if self.around is not None:
            return f"values up to {self.around} and beyond"
        return f"at least {self.least} values"

    def met(self, values: Sequence[float]) -> bool:
        """Whether an axis with these values will do."""
        if self.around is not None and not (
            any(0.0 < value <= self.around for value in values)
            and any(value > self.around for value in values)
        ):
            return False
        return set(self.these) <= set(values) and len(values) >= self.least


@dataclass(frozen=True)
class Tolerances:
    """Deviations that halve a score: in time, in the same unit, and as a part of a duration."""

    onset: float = 1.0
    duration: float = 1.0
    ratio: float = 0.1

    @property
    def doubled(self) -> Tolerances:
        """Twice each of them."""
        return Tolerances(2.0 * self.onset, 2.0 * self.duration, 2.0 * self.ratio)


@dataclass(frozen=True)
class Scored:
    """Scores in [0, 1] of all sets, and what was measured to get them, over their dimensions."""

    score: xr.DataArray
    measured: dict[str, xr.DataArray]
