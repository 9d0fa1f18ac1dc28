"""One setting: default, range and meaning, declared once.

Checks in Python, keys of study files, schemas, docstrings and the reference follow from that.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

#: Stands for the end of what drives the damper, in place of a time.
END = "end"


@dataclass(frozen=True)
class Setting:
    """A setting with the type of its default: a whole number, a number, a flag, a word or a list.

    Parameters
    ----------
    default : int, float, bool, str, tuple of float, or None
        Its type is that of the setting; an empty tuple is a list of numbers, and None a number
        that may be left out.
    meaning : str
    units : str, optional
    choices : tuple of str, optional
        All words allowed.
    ge, gt, le, lt : float, optional
        Bounds of the number, or of each number in a list.
    least : int, default 0
        Fewest numbers in a list.
    stated : bool, default False
        Whether a study has to give it; in Python the default holds.
    timed : bool, default False
        Whether the number may be a mapping: ``{"time": 30}`` in s or sqrt(M/K), or ``{"time":
        "end"}``, the end of the damper's record.
    integers : bool, default False
        Whether the numbers of a list must be whole.
    models : tuple of str, optional
        Models that an observer's setting knows, where its observer knows more.
    """

    default: Any
    meaning: str
    units: str = ""
    choices: tuple[str, ...] = ()
    ge: float | None = None
    gt: float | None = None
    le: float | None = None
    lt: float | None = None
    least: int = 0
    stated: bool = False
    timed: bool = False
    integers: bool = False
    models: tuple[str, ...] = ()

    def __get__(self, observer: Any, kind: type | None = None) -> Any:
        """Return the setting, from the class; an object holds the value in its place."""
        return self

    @property
    def whole(self) -> bool:
        """Whether numbers must be whole."""
        return self.integers or (
            isinstance(self.default, int) and not isinstance(self.default, bool)
        )

    @property
    def bounds(self) -> dict[str, float]:
        """The bounds that there are, by name."""
        bounds = {"gt": self.gt, "ge": self.ge, "lt": self.lt, "le": self.le}
        return {name: bound for name, bound in bounds.items() if bound is not None}

    @property
    def limits(self) -> str:
        """The bounds, in words."""
        signs = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
        texts = {n: str(b) if isinstance(b, int) else f"{b:g}" for n, b in self.bounds.items()}
        return " and ".join(f"{signs[name]} {text}" for name, text in texts.items())

    @property
    def allowed(self) -> str:
        """What is allowed, in words."""
        if self.choices:
            return "one of " + ", ".join(map(repr, self.choices))
        if isinstance(self.default, bool):
            return "True or False"
        kind = "whole number" if self.whole else "number"
        if isinstance(self.default, tuple):
            count = f"at least {self.least} " if self.least else ""
            kind = f"list of {count}distinct {kind}s, each"
        words = "a", kind, self.limits, f"({self.units})" if self.units else ""
        allowed = " ".join(word for word in words if word)
        return f"{allowed}, or {{'time': a number > 0, or 'end'}}" if self.timed else allowed

    def checked(self, name: str, value: Any) -> Any:
        """Return the value as the observer holds it.

        Raises
        ------
        ValueError
            With name, value and what is allowed.
        """
        if value is None and self.default is None:
            return None
        try:
            return self._read(value)
        except (TypeError, ValueError, OverflowError):
            raise ValueError(f"{name} = {value!r}: must be {self.allowed}") from None

    def _read(self, value: Any) -> Any:
        """Return the value in its type, or raise one of the errors that `checked` expects."""
        if self.choices or isinstance(self.default, bool):
            # Not 1 for True.
            if isinstance(value, type(self.default)) and value in (self.choices or (True, False)):
                return value
            raise ValueError
        if isinstance(self.default, tuple):
            numbers = tuple(self._number(item) for item in _items(value))
            if len(numbers) < self.least or len(set(numbers)) < len(numbers):
                raise ValueError
            return numbers
        if self.timed and isinstance(value, Mapping):
            time = value["time"] if list(value) == ["time"] else math.nan
            if time != END and not Setting(0.0, "")._number(time) > 0.0:
                raise ValueError
            return {"time": time if time == END else float(time)}
        return self._number(value)

    def _number(self, value: Any) -> float:
        number = float(value)
        if isinstance(value, str | bool) or not math.isfinite(number):
            raise ValueError
        if self.whole and number != int(number):
            raise ValueError
        within = (
            (self.ge is None or number >= self.ge)
            and (self.gt is None or number > self.gt)
            and (self.le is None or number <= self.le)
            and (self.lt is None or number < self.lt)
        )
        if not within:
            raise ValueError
        return int(value) if self.whole else number


def _items(value: Any) -> Sequence[Any]:
    if isinstance(value, str | Mapping):
        raise TypeError
    return list(value)
