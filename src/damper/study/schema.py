"""JSON schemas for editors: pydantic's own, with what the kinds of `damper.study.fields` say."""

from __future__ import annotations

import math
from typing import Any

from pydantic import BaseModel, GetJsonSchemaHandler
from pydantic.json_schema import GenerateJsonSchema
from pydantic_core import core_schema

from damper.parameters.quantities import Quantity

Schema = dict[str, Any]

NULL_DROPS = "In an override, null leaves an entry out."
"""Marks the sections of which that is true; see `parts`."""


class Generator(GenerateJsonSchema):
    """Writes no title for a field, and no default where there is none."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> Schema:
        if schema.get("default") is None:
            return self.generate_inner(schema["schema"])
        return super().default_schema(schema)


def schema_of(cls: type[BaseModel]) -> Schema:
    """Return the JSON schema of what may be written for a class of settings."""
    return cls.model_json_schema(schema_generator=Generator)


def parts(schema: Any) -> Any:
    """Return the schema of any part of what `schema` describes: no key is required."""
    if isinstance(schema, list):
        return [parts(part) for part in schema]
    if not isinstance(schema, dict):
        return schema
    # Rules of several keys stand under allOf, kinds of study under if.
    left_out = ("required", "allOf", "if", "then", "else")
    made = {
        key: {name: parts(one) for name, one in part.items()}
        if key in ("properties", "$defs")
        else parts(part)
        for key, part in schema.items()
        if key not in left_out
    }
    if "if" in schema:
        made["anyOf"] = [parts(schema["else"]), *parts(schema["then"]["anyOf"])]
    if schema.get("$comment") == NULL_DROPS:
        made["additionalProperties"] = or_null(made["additionalProperties"])
        made["properties"] = {k: or_null(p) for k, p in made.get("properties", {}).items()}
    return made


def or_null(schema: Schema | bool) -> Schema | bool:
    """Return the schema of the same or nothing."""
    return schema and {"anyOf": [schema, {"type": "null"}]}


def once(handler: GetJsonSchemaHandler, name: str, made: Schema) -> Schema:
    """Define `made` under `name` and return a reference to it."""
    reference = nested(handler, core_schema.any_schema(ref=name))
    handler.resolve_ref_schema(reference).update(made)
    return reference


def nested(handler: GetJsonSchemaHandler, core: core_schema.CoreSchema) -> Schema:
    """Return the schema of what `core` validates: a reference where `core` has a name."""
    # As part of something, for pydantic defines names only on the way down.
    made: Schema = handler(core_schema.list_schema(core))["items"]
    return made


def quantity_schema(handler: GetJsonSchemaHandler, quantity: Quantity) -> Schema:
    """Return the schema of a value of a quantity."""
    low = "exclusiveMinimum" if quantity.above else "minimum"
    high = "exclusiveMaximum" if quantity.below else "maximum"
    ends = {low: quantity.minimum, high: quantity.maximum}
    made: Schema = {"description": about(quantity), "type": "number"}
    made |= {"multipleOf": 1} if quantity.whole else {}
    made |= {bound: end for bound, end in ends.items() if math.isfinite(end)}
    return once(handler, quantity.name, made)


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
