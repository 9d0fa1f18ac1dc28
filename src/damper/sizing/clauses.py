"""The checks of a damper in clauses, as an engineer files them."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from damper.parameters.lazy import pd
from damper.sizing.words import text_of

#: More than without the damper, by more than transients leave.
_MORE = 1.01
#: Fresh runs that exceed the worst case by more than this are a warning.
EXCEEDED = 1.05
#: Signs as a card shows them.
_SHOWN = {"<=": "≤", ">=": "≥", "<": "<"}
_SIGNS = {"<=": operator.le, ">=": operator.ge, "<": operator.lt}


class Clause(NamedTuple):
    """One check: a value against its limit. The number of a check is the same on all cards."""

    number: str
    what: str
    value: float
    sign: str
    limit: float
    unit: str = "1"
    warning: str = ""
    """Text of a card where it does not pass."""

    @property
    def passed(self) -> bool:
        """Whether the value is within the limit."""
        return bool(_SIGNS[self.sign](self.value, self.limit))


def table_of(clauses: Sequence[Clause]) -> pd.DataFrame:
    """The checks as a table: clause, check, limit, value, passes."""
    rows = []
    for one in clauses:
        limit, value = _told_apart(one)
        rows.append(
            {
                "clause": one.number,
                "check": one.what,
                "limit": f"{_SHOWN[one.sign]} {limit}",
                "value": value,
                "passes": "yes" if one.passed else "NO",
            }
        )
    return pd.DataFrame(rows)


def _told_apart(one: Clause) -> tuple[str, str]:
    """Limit and value; a value that does not pass has the digits by which it differs."""
    for digits in range(3, 9):
        limit, value = (text_of(number, one.unit, digits) for number in (one.limit, one.value))
        if one.passed or limit != value:
            break
    return limit, value


def clauses_of(judge: Any, damper: Any, numbers: Mapping[str, Any]) -> list[Clause]:
    """All checks that there are numbers for, in the order of their own numbers.

    Parameters
    ----------
    judge : WorstCase or StructureJudge
    damper : Sizes or BoxedDamper
    numbers : mapping
        Numbers of the answer, by the names of `Design`; `without` is among them.
    """
    m = judge.machine
    made = [
        Clause("1.1", "free mass", damper.mass, "<=", m.largest_mass, "kg"),
        Clause("1.2", "gap, within the room there is", damper.gap, "<=", m.largest_gap, "m"),
    ]
    made += _of_what_counts(judge, damper, numbers)
    made += _of_other_cases(judge, numbers)
    made += _of_the_evidence(judge, damper, numbers)
    return sorted(made, key=lambda one: one.number)


def _of_what_counts(judge: Any, damper: Any, numbers: Mapping[str, Any]) -> Iterator[Clause]:
    m = judge.machine
    unit, words = m.measured[1:]
    name = "worst" if "worst" in numbers else "closed_form"
    case = ", worst case" if name == "worst" else ", closed form"
    if m.limit is not None:
        yield Clause("2.1", f"{words}{case}", numbers[name], "<=", m.limit, unit)
    helps = "It does not help: the worst case is no better than without it."
    yield Clause(
        "2.2",
        f"{words}{case}, against that without",
        numbers[name],
        "<",
        numbers["without"],
        unit,
        helps,
    )
    form = judge.closed_form(damper)
    if "largest" in form:
        text = (
            f"By the closed form {text_of(form['largest'], unit)} are possible as well: a machine "
            "that comes from such a motion may stay in it."
        )
        ratio = form["largest"] / form["value"]
        what = "largest motion by the closed form, over the least"
        yield Clause("2.3", what, ratio, "<=", EXCEEDED, warning=text)


def _of_other_cases(judge: Any, numbers: Mapping[str, Any]) -> Iterator[Clause]:
    """In the band and outside of it, and under a record of another size."""
    words = judge.machine.measured[2]
    ratio = numbers.get("band_ratio", math.nan)
    cases = [
        (
            "2.4",
            "band_ratio",
            "over that without, in the band",
            f"In the band, too, it amplifies somewhere: up to {ratio:.2f} times the {words} there "
            "without it.",
        ),
        (
            "2.5",
            "outside_ratio",
            "over that without, outside of the band",
            f"Outside of the band it amplifies: up to {numbers.get('outside_ratio', 0.0):.2f} "
            f"times the {words} without it, at {numbers.get('outside_frequency', 0.0):.4g} Hz.",
        ),
    ]
    for number, name, size in (("2.6", "weak_ratio", "half"), ("2.7", "strong_ratio", "twice")):
        text = (
            f"Under {size} the record it amplifies: {numbers.get(name, 0.0):.2f} times the {words} "
            "without it."
        )
        cases.append((number, name, f"over that without, {size} the record", text))
    for number, name, what, text in cases:
        if name in numbers:
            yield Clause(number, f"{words} {what}", numbers[name], "<=", _MORE, warning=text)


def _of_the_evidence(judge: Any, damper: Any, numbers: Mapping[str, Any]) -> Iterator[Clause]:
    """How far the worst case is to be believed."""
    m = judge.machine
    if "fresh_ratio" in numbers:
        ratio = numbers["fresh_ratio"]
        text = (
            f"{numbers.get('fresh_share', 0.0):.2g} % of fresh random runs exceed the worst case "
            f"that the search found, by up to {100.0 * ratio - 100.0:.2g} %."
        )
        what = "largest of the fresh runs, over the worst case"
        yield Clause("3.1", what, ratio, "<=", EXCEEDED, warning=text)
        idle = judge.idle(damper)
        text = (
            "A free mass at exact rest in space stays there where no wall comes. The machine then "
            f"moves as without damper, by up to {text_of(idle, m.measured[1])} in the band. The "
            "worst case leaves this out."
        )
        what = f"{m.measured[2]} with the free mass at exact rest where no wall comes"
        if m.band is not None and not m.weight:
            yield Clause("3.2", what, idle, "<=", numbers["worst"], m.measured[1], text)
    if "alike" in numbers:
        text = (
            "Masses that are exactly alike and begin alike stay together for ever, as one mass: "
            f"then the {m.measured[2]} is up to {text_of(numbers['alike'], m.measured[1])}. The "
            "worst case leaves this out: gaps that differ a little end it."
        )
        what = f"{m.measured[2]} with all masses exactly alike"
        yield Clause("3.5", what, numbers["alike"], "<=", numbers["worst"], m.measured[1], text)
    off = m.gap_tolerance
    if "lowest_gap" in numbers:
        what = "least gap, above that where its periodic motion changes"
        yield Clause("3.3", what, damper.gap - off, ">=", numbers["lowest_gap"], "m")
    if "highest_gap" in numbers:
        what = "largest gap, below that where its periodic motion changes"
        yield Clause("3.4", what, damper.gap + off, "<=", numbers["highest_gap"], "m")
