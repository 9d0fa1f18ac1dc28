"""JSON schemas by pydantic, a little shorter for editors, and what they say in words.

What is in them beside pydantic's: ``unit`` and ``$comment``, see `damper.study.fields.SchemaNote`.
"""

from __future__ import annotations

import math
from typing import Any

from pydantic import GetJsonSchemaHandler, TypeAdapter
from pydantic.json_schema import GenerateJsonSchema
from pydantic_core import core_schema

from damper.parameters.quantities import Quantity
from damper.parameters.unit_text import SIZES

Schema = dict[str, Any]

COORDINATE = "in the parameter's range"
"""The rule of a value of the quantity under whose name it stands."""
THE_PARAMETERS = "the parameter's"
"""Its unit."""


class Generator(GenerateJsonSchema):
    """Leaves out what an editor does not need: titles of fields, null, and that keys are required.

    An override is a part of a study, and config/ci.yaml a part of a configuration.
    """

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False

    def field_is_required(self, field: Any, total: bool) -> bool:
        return False

    def nullable_schema(self, schema: core_schema.NullableSchema) -> Schema:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> Schema:
        if schema.get("default") is None:
            return self.generate_inner(schema["schema"])
        return super().default_schema(schema)

    def model_schema(self, schema: core_schema.ModelSchema) -> Schema:
        made, cls = super().model_schema(schema), schema["cls"]
        made["description"] = first_line(cls)
        del made["title"]
        for part in made.get("properties", {}).values():
            unit = part.pop("unit", part.get("items", {}).pop("unit", ""))
            of_si = part.pop("si_unit", part.get("items", {}).pop("si_unit", ""))
            if of_si or unit in (*SIZES, THE_PARAMETERS):
                _allow_text(part)
            if unit not in ("", THE_PARAMETERS):
                part["description"] = f"{part['description']} [{unit}]"
        if alone := getattr(cls, "shorthand", ""):
            kept = made["properties"][alone].items()
            short = {key: value for key, value in kept if key not in ("description", "default")}
            made = {"anyOf": [short, made]}
        return made


#: Type of a number that may be text with a unit.
_NUMBER_OR_TEXT = ["number", "string"]


def _allow_text(part: Schema) -> None:
    """Let numbers be text with a unit, also in a list or a pair."""
    for one in (part, part.get("items"), *part.get("prefixItems", ()), *part.get("anyOf", ())):
        if isinstance(one, dict) and one.get("type") == "number":
            one["type"] = _NUMBER_OR_TEXT


def schema_of(annotation: Any) -> Schema:
    """Return the JSON schema of what may be written for a class or an annotation."""
    return TypeAdapter(annotation).json_schema(schema_generator=Generator)


def nested(handler: GetJsonSchemaHandler, core: core_schema.CoreSchema) -> Schema:
    """Return the schema of what `core` validates: a reference where `core` has a name."""
    # As part of something, for pydantic defines names only on the way down.
    made: Schema = handler(core_schema.list_schema(core))["items"]
    return made


def once(handler: GetJsonSchemaHandler, name: str, made: Schema) -> Schema:
    """Define `made` under `name` and return a reference to it."""
    reference: Schema = handler(core_schema.list_schema(core_schema.any_schema(ref=name)))["items"]
    handler.resolve_ref_schema(reference).update(made)
    return reference


def quantity_schema(handler: GetJsonSchemaHandler, quantity: Quantity) -> Schema:
    """Return the schema of a value of a quantity, or of a mapping in its place."""
    low = "exclusiveMinimum" if quantity.above else "minimum"
    high = "exclusiveMaximum" if quantity.below else "maximum"
    cases = quantity.limit_cases
    ends = {low: min((quantity.minimum, *cases)), high: max((quantity.maximum, *cases))}
    made: Schema = {"description": about(quantity)}
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


def first_line(cls: object) -> str:
    """Return the first line of a docstring."""
    return (cls.__doc__ or "").strip().split("\n")[0]


# What a schema says, in words.

_BOUNDS = {"exclusiveMinimum": ">", "minimum": ">=", "exclusiveMaximum": "<", "maximum": "<="}
_SORTS = {"string": "text", "boolean": "flag", "object": "mapping"}


def sort_of(schema: Schema) -> str:
    """Return the type that a schema asks for, such as ``list of number``."""
    if "enum" in schema or "const" in schema:
        return "one of"
    if "prefixItems" in schema:
        return "[low, high]" if "$comment" in schema else "pair"
    if "anyOf" in schema and not any(
        "properties" in one or ("$ref" in one and "$comment" not in one) for one in schema["anyOf"]
    ):
        return " or ".join(", ".join(choices_of(one)) or sort_of(one) for one in schema["anyOf"])
    if schema.get("type") == "array":
        return f"list of {sort_of(schema['items'])}"
    if schema.get("type") == _NUMBER_OR_TEXT:
        return "number"
    if "type" not in schema or isinstance(schema["type"], list):
        return "mapping"
    sort: str = schema["type"]
    return _SORTS.get(sort, sort)


def choices_of(schema: Schema) -> tuple[str, ...]:
    """Return the allowed words, where the schema lists them."""
    if schema.get("type") == "boolean":
        return ("true", "false")
    return tuple(schema.get("enum", [schema["const"]] if "const" in schema else ()))


def limits_of(schema: Schema) -> str:
    """Return what a schema allows beyond the type, such as ``> 0 and <= 1``."""
    bounds = " and ".join(
        f"{sign} {schema[key]:.12g}" for key, sign in _BOUNDS.items() if key in schema
    )
    found = [bounds, schema.get("$comment", "")]
    if len(schema.get("anyOf", ())) == 2 and "type" in schema["anyOf"][0]:
        found += map(limits_of, schema["anyOf"])
    if schema.get("type") != "array":
        choices = ", ".join(f"`{name}`" for name in choices_of(schema))
        return choices or " ".join(filter(None, found))
    if "items" in schema:
        least = schema.get("minItems")
        rules = [f"at least {least}"] * bool(least) + ["distinct"] * ("uniqueItems" in schema)
        found.append(", ".join(rules))
    each = limits_of((schema.get("prefixItems") or [schema["items"]])[0])
    return "; ".join(filter(None, [*found, each and f"each {each}"]))


def words_of(schema: Schema) -> str:
    """Return type and limits as a message gives them."""
    if choices := choices_of(schema):
        return ", ".join(choices)
    if "anyOf" in schema and "$comment" not in schema and "properties" not in schema["anyOf"][-1]:
        return " or ".join(map(words_of, schema["anyOf"]))
    if schema.get("type") == "array" and "items" in schema:
        least = schema.get("minItems", 0)
        return f"list of {words_of(schema['items'])}" + f", at least {least}" * bool(least)
    between = ", " if schema.get("type") == "array" else " "
    return between.join(filter(None, [sort_of(schema), limits_of(schema)]))
