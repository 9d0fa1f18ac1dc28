"""How a quantity is declared: symbol, meaning, units, range, default, model, form in SI units.

A class of parameters declares each of its quantities once, as a field:

    class Parameters(Declared):
        mass_ratio: float = quantity(r"$\\mu$", "mass ratio m/M", minimum=1e-6, maximum=1e18)

Checks, docstrings, the names and ranges of the study language, its schema and reference, labels of
figures and the arguments of `damper.simulate` follow from that.
"""

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields, replace
from functools import wraps
from inspect import cleandoc
from textwrap import wrap
from typing import Any, ClassVar, Self, dataclass_transform

from damper.parameters.names import unknown_name
from damper.parameters.unit_text import number_in
from damper.parameters.units import SI_UNITS


@dataclass(frozen=True)
class Quantity:
    """One quantity; `symbol` is matplotlib mathtext, `default` is None where it must be given."""

    name: str
    symbol: str
    long_name: str
    units: str = "1"
    minimum: float = -math.inf
    maximum: float = math.inf
    above: bool = False
    """Whether the minimum itself is excluded."""
    below: bool = False
    """Whether the maximum itself is excluded."""
    whole: bool = False
    """Whether only whole numbers are allowed."""
    limit_cases: tuple[float, ...] = ()
    """Values beyond the range that are allowed: exact limits, such as infinity."""
    words: tuple[tuple[str, float], ...] = ()
    """Words that may stand for values."""
    default: float | None = None
    note: str = ""
    """Remark in error messages, beside the range."""
    definition: str = ""
    """Remark in the documentation, beside the long name."""
    option: bool = False
    """Whether the basic damper does without it; given by name only."""
    model: str = ""
    """Model of `damper.models` that it belongs to; none for what every model has."""
    chooses: bool = True
    """Whether a value other than the default asks for this model."""
    needs: str = ""
    """Quantity without which this one has no effect and is refused."""
    unless: str = ""
    """Name that may be given in place of this quantity, which is infinite then."""
    law: str = ""
    """Contact law of `damper.engine.impact` that a value other than the default asks for."""
    from_si: Callable[..., float] | None = None
    """Value from quantities of `SIParameters`, which are the names of its arguments."""

    @property
    def limits(self) -> str:
        """The range, as a table shows it."""
        words = "any"
        if self.maximum < math.inf:
            words = f"{self.minimum:g} to {'< ' if self.below else ''}{self.maximum:g}"
        elif self.minimum > -math.inf:
            words = f"{'>' if self.above else '>='} {self.minimum:g}"
        words += "".join(f", or {value:g}" for value in self.limit_cases)
        words += ", whole" if self.whole else ""
        return f"{words} ({self.note})" if self.note else words

    @property
    def about(self) -> str:
        """A sentence: its meaning, units and range."""
        parts = [
            self.long_name[0].upper() + self.long_name[1:],
            self.definition,
            "" if self.units == "1" else f"in {self.units}",
            "" if self.limits == "any" else self.limits,
        ]
        return "; ".join(filter(None, parts)) + "."

    @property
    def allowed(self) -> str:
        """The range in words that name the quantity."""
        if self.maximum < math.inf:
            upper = "<" if self.below else "<="
            words = f"{self.minimum:g} <= {self.name} {upper} {self.maximum:g}"
        elif self.minimum > -math.inf:
            words = f"{self.name} {'>' if self.above else '>='} {self.minimum:g}"
        else:
            # In an SI study units of F0/K are metres, so they are not named here.
            words = f"any {self.name}" + (f" in {self.units}" if self.units == "rad" else "")
        words += "".join(f", or {value:g}" for value in self.limit_cases)
        words += ", whole" if self.whole else ""
        return f"{words} ({self.note})" if self.note else words

    def holds(self, value: float) -> bool:
        """Whether a number is allowed."""
        if value == self.default or value in self.limit_cases:
            return True
        low = value > self.minimum if self.above else value >= self.minimum
        high = value < self.maximum if self.below else value <= self.maximum
        return low and high and math.isfinite(value) and not (self.whole and value % 1.0)

    def check(self, value: float) -> float:
        """Return `value` as a float if it is allowed; text with a unit is read, as "20 mm".

        Raises
        ------
        ValueError
            Not finite or out of range; the message names quantity, value and range.
        TypeError
            Not a real number.
        """
        if type(value) is float and self.holds(value):
            return value
        if self.words and isinstance(value, str):
            value = self.number_of(value)
        number = real(self.name, number_in(self.name, value, [self.units]))
        if not self.holds(number):
            raise ValueError(
                f"{self.name} = {value!r}: must be a finite number with {self.allowed}"
            )
        return number

    def number_of(self, word: Any) -> Any:
        """Return the value that a word stands for; anything else as it is.

        Raises
        ------
        ValueError
            For an unknown word, with the known ones.
        """
        if not self.words or not isinstance(word, str):
            return word
        known = dict(self.words)
        if word not in known:
            raise unknown_name(self.name, word, known)
        return known[word]

    def text_of(self, value: float) -> str:
        """Return the word that stands for a value, or else its number."""
        return {number: word for word, number in self.words}.get(value, f"{value:g}")

    @property
    def si_names(self) -> tuple[str, ...]:
        """Quantities of `SIParameters` that it is formed from; its own counterpart first."""
        if self.from_si is None:
            return (self.name,)
        code = self.from_si.__code__
        return code.co_varnames[: code.co_argcount]


def real(name: str, value: float) -> float:
    """Return a real number as float; TypeError with name and value for anything else."""
    if type(value) is float:
        return value
    # bool is an int to Python, but restitution=True is a slip, not a number.
    if isinstance(value, bool | str | bytes):
        raise TypeError(f"{name} = {value!r}: must be a real number")
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"{name} = {value!r}: must be a real number") from None


def is_listed(given: Any) -> bool:
    """Whether it has parts one after the other, and is neither text nor a mapping."""
    # An array without a dimension counts as iterable, too.
    other = isinstance(given, str | bytes | Mapping) or getattr(given, "shape", None) == ()
    return isinstance(given, Iterable) and not other


def finite(name: str, value: float) -> float:
    """Return a real number as float; ValueError with name and value where it is not finite."""
    number = real(name, value)
    if not math.isfinite(number):
        raise ValueError(f"{name} = {value!r}: must be a finite number")
    return number


def whole(
    name: str, value: float, least: int, what: str = "whole number", most: float = math.inf
) -> int:
    """Return a whole number in a range as int; ValueError or TypeError as for `real`."""
    number = real(name, value)
    if not (least <= number <= most and number % 1.0 == 0.0):
        limit = f" and <= {most}" if most < math.inf else ""
        raise ValueError(f"{name} = {value!r}: must be a {what} >= {least}{limit}")
    return int(number)


def check_needs(quantities: Iterable[Quantity], given: Collection[str]) -> None:
    """Raise ValueError for a name that is given without the one that it needs."""
    for q in quantities:
        if q.needs and q.name in given and q.needs not in given:
            raise ValueError(f"{q.name} without {q.needs}: it has no effect; give both or none")


def check_needs_of(damper: Any, given: Iterable[str]) -> None:
    """As `check_needs`, with what single masses of a damper have of their own."""
    of_masses = {name for mass in getattr(damper, "masses", None) or () for name, _ in mass}
    check_needs(damper.quantities, {*given, *of_masses})


def in_range(name: str, value: float, **limits: Any) -> float:
    """Return a finite number as float; `limits` and errors are those of `Quantity`.

    Examples
    --------
    >>> in_range("resolution", 1e-3, minimum=0, above=True)
    0.001
    """
    return Quantity(name, "", "", **limits).check(value)


def quantity(
    symbol: str, long_name: str, units: str = "1", *, default: Any = MISSING, **about: Any
) -> Any:
    """Field of a class that is `QuantityClass`; the arguments are those of `Quantity`."""
    described = {"symbol": symbol, "long_name": long_name, "units": units, **about}
    return field(default=default, metadata=described)


def shared(*, default: Any = MISSING) -> Any:
    """Field that the class of the other system of units declares, under the same name."""
    return field(default=default)


@dataclass_transform(frozen_default=True, field_specifiers=(quantity, shared))
class QuantityClass:
    """Base of the classes whose fields are quantities: frozen dataclasses of checked values.

    `shares` is the class that declares the `shared` fields, in dimensionless units. In the
    docstring ``{quantities}`` and ``{options}`` stand for the fields that may be given by position
    and for those that are given by name only.
    """

    quantities: ClassVar[tuple[Quantity, ...]]
    """Every quantity, in the order of the fields."""
    _init: ClassVar[Callable[..., None]]
    _names: ClassVar[tuple[str, ...]]
    _checks: ClassVar[tuple[tuple[str, object, Callable[[float], float], bool], ...]]

    def __init_subclass__(cls, shares: "type[QuantityClass] | None" = None) -> None:
        dataclass(frozen=True, repr=False)(cls)
        cls._names = tuple(f.name for f in fields(cls))  # type: ignore[arg-type]
        known = {q.name: q for q in shares.quantities} if shares else {}
        numbers = [f for f in fields(cls) if f.type in (float, "float")]  # type: ignore[arg-type]
        made = {f.name: _quantity_of(f, known) for f in numbers}
        cls.quantities = tuple(made.values())
        cls._checks = tuple(
            (f.name, f.default, made[f.name].check, bool(f.kw_only)) for f in numbers
        )
        cls.__doc__ = filled(cls.__doc__, cls.quantities)
        _check_names(cls)

    def __repr__(self) -> str:
        words = {q.name: {n: word for word, n in q.words} for q in self.quantities if q.words}
        shown = {n: words.get(n, {}).get(v, v) if n in words else v for n, v in self.given.items()}
        text = ", ".join(f"{name}={value!r}" for name, value in shown.items())
        return f"{type(self).__name__}({text})"

    @property
    def given(self) -> dict[str, float]:
        """Values that differ from their defaults, by name, with the values that they need."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}  # type: ignore[arg-type]
        kept = {f.name for f in fields(self) if values[f.name] != f.default}  # type: ignore[arg-type]
        kept |= {q.needs for q in self.quantities if q.needs and q.name in kept}
        return {name: value for name, value in values.items() if name in kept}

    @classmethod
    def unchecked(cls, **values: Any) -> Self:
        """Make one of values whose names are known: runs are made so, in their thousands."""
        made = object.__new__(cls)
        cls._init(made, **values)
        return made

    def replaced(self, **changed: Any) -> Self:
        """Return this with some other values, checked; their names are known to be right."""
        own = {name: self.__dict__[name] for name in self._names}
        return self.unchecked(**own | changed)

    @classmethod
    def left_out(cls, forcing: Any) -> Mapping[str, float]:
        """Return what need not be given under a force, with its values."""
        return {}

    @classmethod
    def of_masses(cls, masses: Any, given: Collection[str]) -> dict[str, Any]:
        """Return what need not be given where each mass has its own; TypeError for the rest."""
        return {}

    def check_each(self) -> bool:
        """Check every value in place; return whether an option is given."""
        values, options = self.__dict__, False
        for name, default, check, option in self._checks:
            value = values[name]
            # An omitted value is the default object itself, so identity is enough. This loop is a
            # good part of a run's cost before its start.
            if value is not default:
                values[name] = check(value)
                options = options or option
        return options


def _check_names(kind: type[QuantityClass]) -> None:
    """Refuse a name without effect, and let the error for an unknown one have the nearest."""
    plain = kind.__init__

    @wraps(plain)
    def init(self: Any, *values: Any, **named: Any) -> None:
        at = kind._names[: len(values)]
        for name in named:
            if name not in kind._names:
                raise unknown_name("parameter", name, kind._names)
        if "forcing" in named:
            free = kind.left_out(named["forcing"])
            named = {n: v for n, v in free.items() if n not in at} | named
        named = kind.of_masses(named.get("masses"), {*at, *named}) | named
        plain(self, *values, **named)
        check_needs_of(self, named)

    kind.__init__ = init  # type: ignore[method-assign]
    kind._init = plain


def _quantity_of(field: Field[Any], known: Mapping[str, Quantity]) -> Quantity:
    if field.metadata:
        default: Any = None if field.default is MISSING else field.default
        default = None if "unless" in field.metadata else default
        return Quantity(field.name, default=default, option=bool(field.kw_only), **field.metadata)
    same = known[field.name]
    needs = same.needs and known[same.needs].si_names[0]
    return replace(same, units=SI_UNITS.get(same.units, same.units), needs=needs)


def filled(text: str | None, quantities: Iterable[Quantity], kind: str = "float") -> str:
    """Return a docstring, without its indentation, with its lists of quantities filled in."""
    listed = {False: "", True: ""}
    for quantity in quantities:
        listed[quantity.option] += _entry(quantity, kind)
    text = cleandoc(text or "")  # as Python does itself from 3.13 on
    for name, option in (("{quantities}", False), ("{options}", True)):
        text = text.replace(f"{name}\n", listed[option])
    return text


def _entry(quantity: Quantity, kind: str) -> str:
    """Entry of one quantity in a docstring, in numpydoc's form."""
    default = "" if quantity.default is None else f", default {quantity.default:g}"
    # A range keeps its sign on the line of its number.
    about = quantity.about.replace("= ", "=~")
    lines = (line.replace("=~", "= ") for line in wrap(about, 90))
    return "".join([f"{quantity.name} : {kind}{default}\n", *(f"    {line}\n" for line in lines)])
