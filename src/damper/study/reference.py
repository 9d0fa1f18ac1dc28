"""Schemas for editors and the reference of all keys, made from the classes that check a study.

``python -m damper.study.reference`` writes config/schema/*.json and docs/reference.md into the
project.

A schema accepts what the loader accepts, and completes and refuses what can be seen at one key: its
name, type, bounds and choices. An override is a part of a study, so inside a study no key is asked
for, and an entry may be null. The loader checks the rest: required keys, and keys that need or
exclude each other; the range of a quantity inside a mapping; that numbers rise, divide a range and
are finite; the variables and axes of figures and tables; file names that differ by case, and keys
that stand twice. A schema takes 100.0 for an integer.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from functools import reduce
from inspect import cleandoc
from operator import or_
from pathlib import Path
from typing import Any

from pydantic.fields import FieldInfo

from damper.observers import writable
from damper.parameters.forcing import FORCINGS, left_out
from damper.parameters.quantities import INITIAL_QUANTITIES, QUANTITIES, SI_QUANTITIES, Quantity
from damper.parameters.variables import OWN_DIMENSIONS, SI_UNITS, STATUS, STATUS_MEANINGS, Variable
from damper.study.estimate import MOST_SLICES
from damper.study.fields import StrictModel
from damper.study.forcing import FORCES, ForceEntry
from damper.study.kinds import FIGURES, STUDIES, TABLES
from damper.study.model import Settings, Study
from damper.study.schema import Schema, first_line, limits_of, schema_of, sort_of
from damper.study.settings import OBSERVER_SETTINGS, Axis, DrawKeys, Drawn, Fixed
from damper.study.study_file import StudyFile

ROOT = Path(__file__).parents[3]
DIALECT = "https://json-schema.org/draft/2020-12/schema"
MADE_BY = "python -m damper.study.reference"
_HEAD = {"$schema": DIALECT, "$comment": f"Made by `{MADE_BY}`; do not edit."}


def schemas() -> dict[str, Schema]:
    """Return the JSON schemas, of a study and of the configuration, by their paths."""
    kinds: list[type[StudyFile]] = [Study, *STUDIES.values()]
    study = schema_of(reduce(or_, kinds))
    study["$defs"]["part"] = {"anyOf": study["anyOf"]}
    study["anyOf"] = [
        part | {"required": [key for key, field in cls.model_fields.items() if field.is_required()]}
        for part, cls in zip(study["anyOf"], kinds, strict=True)
    ]
    override = {"anyOf": [{"$ref": "study.schema.json#/$defs/part"}, {"type": "null"}]}
    configuration = schema_of(Settings)
    configuration["properties"]["overrides"]["additionalProperties"] = override
    return {
        "config/schema/study.schema.json": _HEAD | {"title": "damper study"} | study,
        "config/schema/config.schema.json": _HEAD | configuration,
    }


def files() -> dict[str, str]:
    """Return the text of every generated file by its path in the project."""
    texts = {path: _json(schema) + "\n" for path, schema in schemas().items()}
    return texts | {"docs/reference.md": reference()}


def _json(value: Any, indent: str = "") -> str:
    """Return JSON of which every part stands on one line where it fits, or has no other part."""
    flat = json.dumps(value)
    below = value.values() if isinstance(value, dict) else value
    alone = not isinstance(value, dict | list) or not any(isinstance(v, dict | list) for v in below)
    if alone or len(indent) + len(flat) < 100:
        return flat
    deeper = indent + " "
    if isinstance(value, list):
        lines = [_json(item, deeper) for item in value]
    else:
        lines = [f"{json.dumps(key)}: {_json(item, deeper)}" for key, item in value.items()]
    inner = f",\n{deeper}".join(lines)
    left, right = "[]" if isinstance(value, list) else "{}"
    return f"{left}\n{deeper}{inner}\n{indent}{right}"


def write() -> None:
    """Write every generated file into the project."""
    for path, text in files().items():
        (ROOT / path).write_text(text, "utf-8", newline="\n")


# The reference.

_INTRO = f"""\
# Reference of all keys

Made by `{MADE_BY}` from the classes that check a study
(`src/damper/`): edit those, not this file. How to write a study: [studies.md](studies.md);
every key in place: [template.yaml](../config/studies/template.yaml). Editors that know the YAML
language server complete and check these keys as one types, from the schemas in
`config/schema/`, which the first line of each file names.

Numbers are YAML 1.2 (`1e-8` is one), finite, and without quotes. In an SI study lengths are in m,
times in s, speeds in m/s and energies in J; where a table gives two units, the second is that.
A list holds distinct values. `<name>` stands for a name that the table or the text below it lists.
"""


def reference() -> str:
    """Return the reference of all keys as Markdown."""
    parts = [
        _INTRO,
        "## Study: config/studies/\\*.yaml",
        _keys(Study),
        *_quantities(),
        "### Parameters: a number, or a mapping",
        _keys(Fixed, "parameters.<name>."),
        "### Axes",
        "Either `values`, or `start` and `stop` with one of `num` and `step`. The fanned axes "
        f"together make at most {MOST_SLICES} jobs.",
        _keys(Axis, "axes.<name>."),
        "### Draws",
        "Beside `count` and `seed`, any quantity with its range alone, or a mapping.",
        _keys(DrawKeys, "draws."),
        _keys(Drawn, "draws.<name>."),
        *_forces(),
        *_observers(),
        "## Figures",
        *_products(FIGURES, "figures"),
        "## Tables",
        *_products(TABLES, "tables"),
        *_kinds(),
        "## Configuration: config/config.yaml",
        _keys(Settings, deep=True),
        *_cube(),
    ]
    return "\n\n".join(part.strip("\n") for part in parts) + "\n"


_HEAD_OF_KEYS = ("key", "type", "unit", "default", "allowed", "meaning")


def _keys(cls: type[StrictModel], path: str = "", *, deep: bool = False, **constants: str) -> str:
    return _table(_HEAD_OF_KEYS, _rows(cls, path, deep, constants))


def _rows(
    cls: type[StrictModel], path: str, deep: bool, constants: Mapping[str, str]
) -> Iterable[tuple[str, ...]]:
    for key, field in cls.model_fields.items():
        default = "**required**" if field.is_required() else _as_code(_default(field))
        settings = settings_of(field)
        if settings is None:
            schema = setting_schema(field)
            unit = schema.get("unit", schema.get("items", {}).get("unit", ""))
            limits = f"`{constants[key]}`" if key in constants else limits_of(schema)
            sort = sort_of(schema)
        else:
            sort = f"`{settings.shorthand}` or mapping" if settings.shorthand else "mapping"
            unit = limits = ""
        yield f"`{path}{key}`", sort, unit, default, limits, field.description or ""
        if deep and settings is not None:
            yield from _rows(settings, f"{path}{key}.", deep, {})


def _default(field: FieldInfo) -> Any:
    """Return the default of a field as a file would give it; None if there is none."""
    if field.is_required() or field.default is None:
        return None
    if isinstance(field.default, StrictModel):
        return field.default.model_dump(mode="json", exclude_none=True)
    return list(field.default) if isinstance(field.default, tuple) else field.default


def settings_of(field: FieldInfo) -> type[StrictModel] | None:
    """Return the class of a setting that is a mapping of settings itself."""
    of: Any = field.annotation
    return of if isinstance(of, type) and issubclass(of, StrictModel) else None


def setting_schema(field: FieldInfo) -> Schema:
    """Return the JSON schema of a setting that is none."""
    return schema_of(field.rebuild_annotation())


def _quantities() -> Iterable[str]:
    yield "### Names under parameters and axes"
    yield (
        "Parameters are given all dimensionless or all in SI units; those without a default are "
        "required, each once, under `parameters` or `axes`. Initial quantities may be added."
    )
    yield (
        "In place of `restitution`, or of `restitution_left`, `restitution_table` or "
        "`restitution_table_left` under `parameters` or in a mass has rows `[approach speed, "
        "restitution]` at rising speeds > 0, or the name of a CSV file of these in the study's "
        "folder. Between two rows the coefficient is linear in the logarithm of the speed, beyond "
        "the ends it is constant."
    )
    head = ("name", "symbol", "unit", "default", "allowed", "meaning")
    for title, quantities in (
        ("Dimensionless", QUANTITIES),
        ("In SI units", SI_QUANTITIES),
        ("Initial state", INITIAL_QUANTITIES),
    ):
        yield f"#### {title}"
        yield _table(head, map(_quantity, quantities))


def _quantity(quantity: Quantity) -> tuple[str, ...]:
    default = _required(quantity) if quantity.default is None else _as_code(quantity.default)
    # The parameters of an SI study have a table of their own; initial quantities have not.
    both = quantity in INITIAL_QUANTITIES
    units = _units(quantity.units) if both else quantity.units.removeprefix("1")
    meaning = f"{quantity.long_name}; {quantity.definition}".removesuffix("; ")
    return f"`{quantity.name}`", quantity.symbol, units, default, quantity.limits, meaning


def _required(quantity: Quantity) -> str:
    """That a quantity has to be given, and where not."""
    si = quantity in SI_QUANTITIES
    without = [k for k, of in FORCINGS.items() if quantity.name in left_out(of.__new__(of), si)]
    names = ", ".join(f"`{name}`" for name in filter(None, [quantity.unless, *without]))
    words = "without" if quantity.unless else "but not under"
    return f"**required**{f' {words} {names}' if names else ''}"


def _forces() -> Iterable[str]:
    yield "## Forcing"
    yield "The name of a kind alone, or a mapping of it and its settings."
    yield _keys(ForceEntry, "forcing.")
    for kind, cls in FORCES.items():
        yield f"### Forcing: {kind}"
        about = cleandoc(FORCINGS[kind].__doc__ or "")
        yield re.split(r"\n\n[A-Z]\w+\n---", about)[0].replace("``", "`")
        known = {row[0] for row in _rows(ForceEntry, "forcing.", False, {})}
        if own := [row for row in _rows(cls, "forcing.", False, {}) if row[0] not in known]:
            yield _table(_HEAD_OF_KEYS, own)


def _observers() -> Iterable[str]:
    yield "## Observers"
    yield "Written as `name:` alone, an observer takes its defaults."
    for name, cls in OBSERVER_SETTINGS.items():
        yield f"### {name}"
        yield first_line(cls)
        if cls.model_fields:
            yield _keys(cls, f"observers.{name}.", deep=True)
        yield "Variables of the cube:"
        head = ("variable", "along", "unit", "meaning", "written with")
        yield _table(head, (_variable(v, setting) for v, setting in writable(name)))


def _variable(variable: Variable, setting: str = "") -> tuple[str, ...]:
    meaning = f"{variable.long_name}; {variable.comment}".removesuffix("; ")
    along = ", ".join(f"`{dim}`" for dim in variable.dims)
    return f"`{variable.name}`", along, _units(variable.units), meaning, setting and f"`{setting}`"


def _products(registry: Mapping[str, type[StrictModel]], section: str) -> Iterable[str]:
    for kind, cls in registry.items():
        yield f"### kind: {kind}"
        yield cleandoc(cls.__doc__ or "")
        yield _keys(cls, f"{section}.<file>.", kind=kind)


def _kinds() -> Iterable[str]:
    yield "## Studies that check the engine: `kind`"
    yield (
        "A study file with `kind` makes no cube of parameters; it has the keys of its kind, in "
        "place of all above."
    )
    for kind, cls in STUDIES.items():
        yield f"### Study of kind: {kind}"
        yield cleandoc(cls.__doc__ or "")
        yield _keys(cls, deep=True, kind=kind)
        for section, entry in cls.entries.items():
            yield _keys(entry, f"{section}.<name>.")
        for section, registry in (("figures", cls.figure_kinds), ("tables", cls.table_kinds)):
            yield from _products(registry, section)


def _cube() -> Iterable[str]:
    yield "## Codes and dimensions of the cube"
    (chatter,) = (v for v, _ in writable("bursts") if v.name == "chatter")
    yield f"`{STATUS.name}`, {STATUS.long_name}: {STATUS.comment}."
    yield f"`{chatter.name}`: {chatter.comment}."
    names = ", ".join(f"{code} `{name}`" for code, name in enumerate(STATUS_MEANINGS))
    yield (
        f"`status` is in every cube, with the codes as `flag_meanings`: {names}. Where it is not "
        "0, averages and counts are missing (NaN); "
        "the attributes `runs` and `runs_stopped_early` count these runs."
    )
    dimensions = ((f"`{name}`", _units(u), text) for name, (text, u) in OWN_DIMENSIONS.items())
    yield _table(("dimension beside the axes", "unit", "meaning"), dimensions)


def _units(units: str) -> str:
    if units in SI_UNITS:
        return f"{units}, {SI_UNITS[units]}"
    return "" if units == "1" else units


def _as_code(value: Any) -> str:
    if isinstance(value, float):
        value = f"{value:g}"
    return "" if value is None else f"`{json.dumps(value)}`".replace('"', "")


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    cells = ([cell.replace("|", r"\|") for cell in line] for line in lines)
    return "\n".join(f"| {' | '.join(line)} |".replace("  ", " ") for line in cells)


if __name__ == "__main__":
    write()
