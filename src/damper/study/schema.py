"""JSON schemas under way: what the kinds of `damper.study.fields` say to an editor."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field, replace
from typing import Any

from damper.parameters.quantities import Quantity

Schema = dict[str, Any]

_DEFS = "#/$defs/"


@dataclass(frozen=True)
class Draft:
    """A schema under way: what it defines once, and whether parts of a study are enough."""

    partial: bool = False
    definitions: dict[str, Schema] = field(default_factory=dict)
    uses: Counter[str] = field(default_factory=Counter)

    def of_parts(self) -> Draft:
        """Return the draft in which no key is required: for overrides."""
        return replace(self, partial=True)

    def once(self, name: str, made: Schema) -> Schema:
        """Define `made` under `name` and return a reference to it."""
        assert self.definitions.setdefault(name, made) == made, name
        self.uses[name] += 1
        return {"$ref": _DEFS + name}

    def finished(self, schema: Schema) -> Schema:
        """Return the schema with its definitions; one that is used once stands in its place."""
        named = {
            name: self._settled(made)
            for name, made in self.definitions.items()
            if self.uses[name] > 1
        }
        return self._settled(schema) | ({"$defs": named} if named else {})

    def _settled(self, part: Any) -> Any:
        if isinstance(part, list):
            return [self._settled(item) for item in part]
        if not isinstance(part, dict):
            return part
        name = part.get("$ref", "").removeprefix(_DEFS)
        if name and self.uses[name] == 1:
            beside = {key: value for key, value in part.items() if key != "$ref"}
            return self._settled(self.definitions[name] | beside)
        return {key: self._settled(value) for key, value in part.items()}


def quantity_schema(draft: Draft, quantity: Quantity) -> Schema:
    """Return the schema of a value of a quantity."""
    low = "exclusiveMinimum" if quantity.above else "minimum"
    high = "exclusiveMaximum" if quantity.below else "maximum"
    ends = {low: quantity.minimum, high: quantity.maximum}
    made: Schema = {"description": about(quantity), "type": "number"}
    made |= {"multipleOf": 1} if quantity.whole else {}
    made |= {bound: end for bound, end in ends.items() if math.isfinite(end)}
    return draft.once(quantity.name, made)


def about(quantity: Quantity) -> str:
    """Return a quantity in one line: meaning, symbol, units, range, default.

    Examples
    --------
    >>> from damper.parameters.quantities import ALL
    >>> about(ALL["clearance"])
    'clearance to each wall, $d$ [F0/K]: clearance >= 0'
    """
    units = "" if quantity.units == "1" else f" [{quantity.units}]"
    default = "" if quantity.default is None else f"; default {quantity.default:g}"
    return f"{quantity.long_name}, {quantity.symbol}{units}: {quantity.allowed}{default}"
