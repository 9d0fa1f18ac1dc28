"""The statements that a calibration scores, and what a cube must have to test each.

Kept light: studies are checked without NumPy. The numbers here stand in the papers' texts;
``shared/design/model.md``, section 8, lists all statements; docs/calibration.md says how each is
scored.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

#: Paper A: onset and duration of the chatter at the lowest frequency, its three frequencies, and
#: the clearance up to which it finds chatter (all in its dimensionless units).
ONSET, DURATION = 332.0, 11.0
LOW, MIDDLE, HIGH = 0.20, 0.25, 0.30
CHATTER_UP_TO = 1.35
#: Paper B: where all chatter lies.
RESTITUTION_RANGE = (0.5, 0.9)


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
class Statement:
    """A statement in our words, the observers it takes, and the axes it is about.

    `tolerant` tells whether its score depends on tolerances.
    """

    text: str
    observers: tuple[str, ...]
    needs: Mapping[str, Values]
    tolerant: bool = False

    @property
    def axes(self) -> tuple[str, ...]:
        """Axes that the statement is about; the others span the sets of parameters."""
        return tuple(self.needs)


def _at(*frequencies: float) -> dict[str, Values]:
    return {"frequency_ratio": Values(these=frequencies)}


_CLEARANCES = {"clearance": Values(around=CHATTER_UP_TO)}
_INTERVALS = {
    "mass_ratio": Values(least=2),
    "frequency_ratio": Values(least=2),
    "restitution": Values(least=3),
}

STATEMENTS = {
    "A1": Statement(
        "over the clearance, chatter up to 1.35 and none from there to 2",
        ("bursts",),
        _CLEARANCES,
    ),
    "A1_contact": Statement(
        "as A1, and beyond 1.35 there are impacts still",
        ("bursts", "impacts"),
        _CLEARANCES,
    ),
    "A3": Statement(
        "at frequency ratio 0.20 a complete chatter starts at about 332 and lasts about 11",
        ("burst_at",),
        _at(LOW),
        tolerant=True,
    ),
    "A4": Statement(
        "at 0.25 chatter is complete too, and lasts nearly as long as at 0.20",
        ("chatter_bursts",),
        _at(LOW, MIDDLE),
        tolerant=True,
    ),
    "A5": Statement(
        "at 0.30, after the transient, chatter is incomplete and nothing sticks",
        ("chatter_bursts",),
        _at(HIGH),
    ),
    "A5_record": Statement(
        "at 0.30, from the start on, chatter is incomplete and nothing sticks",
        ("chatter_bursts",),
        _at(HIGH),
    ),
    "A7": Statement(
        "at 0.20 a long transient passes before the first complete chatter",
        ("chatter_bursts",),
        _at(LOW),
    ),
    "B1": Statement("chatter lies in restitutions 0.5 to 0.9", ("bursts",), _INTERVALS),
    "B2": Statement(
        "the interval of restitution that chatters widens as the mass ratio falls",
        ("bursts",),
        _INTERVALS,
    ),
    "B3": Statement("it narrows as the frequency ratio rises", ("bursts",), _INTERVALS),
}
