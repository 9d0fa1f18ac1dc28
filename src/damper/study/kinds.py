"""The kinds of figures, tables and studies: a file each, found by its name.

A file holds the class of a kind's settings beside the function that draws or makes it, and is
imported when a study, the schema or the reference asks for that kind. The language imports nothing
of the rooms above it: it knows of their packages by name, here and nowhere else, as a program knows
of its plug-ins.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType
from typing import Annotated, Any

from pydantic import GetJsonSchemaHandler, TypeAdapter, create_model
from pydantic_core import CoreSchema, PydanticKnownError, core_schema

from damper.observers import class_in
from damper.parameters.names import unknown_name
from damper.study.fields import StrictModel, one_of
from damper.study.products import Product
from damper.study.schema import Schema, nested
from damper.study.study_file import StudyFile


class Kinds(Mapping[str, type[Any]]):
    """Name of a kind -> the class of its settings, imported when it is asked for.

    The class derives from `base`. The packages have a file for each kind; what kinds share lies in
    packages below. Where a kind is a package itself, its module `within` has the class.
    """

    def __init__(self, base: type[StrictModel], *packages: str, within: str = "") -> None:
        self._base, self._packages, self._within = base, packages, within

    @cached_property
    def modules(self) -> dict[str, str]:
        """Name of a kind -> name of its module."""
        return {
            found.name: ".".join(filter(None, (package, found.name, self._within)))
            for package in self._packages
            for found in iter_modules(import_module(package).__path__)
            if found.ispkg == bool(self._within)
        }

    def module(self, kind: str) -> ModuleType:
        """Import the module of a kind; ValueError with the known ones for an unknown kind."""
        if kind not in self.modules:
            raise ValueError(str(unknown_name("kind", kind, self.modules)))
        return import_module(self.modules[kind])

    def asked(self, kind: str, settings: Mapping[str, Any]) -> tuple[ModuleType, Any]:
        """Return the module of a kind and these settings of it; ValueError if they are wrong."""
        module = self.module(kind)
        given = {name: value for name, value in settings.items() if value is not None}
        return module, self[kind].checked(kind, {"kind": kind, **given})

    def class_of(self, data: Any) -> type[Any]:
        """Return the class of settings that say their ``kind``."""
        if not isinstance(data, dict):
            raise PydanticKnownError("dict_type")
        kind = self._named.model_validate({key: data[key] for key in data if key == "kind"})
        return self[kind.kind]

    @cached_property
    def _named(self) -> Any:
        """Class of what is said of a kind alone."""
        return create_model(
            "Kind", __base__=StrictModel, kind=(Annotated[str, one_of(self.modules)], ...)
        )

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(
            lambda data: self.class_of(data).model_validate(data)
        )

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> Schema:
        some = [
            nested(handler, TypeAdapter(cls).core_schema)
            | {"properties": {"kind": {"const": kind}}}
            for kind, cls in self.items()
        ]
        return {"anyOf": some, "$comment": "with a kind and its settings"}

    def __getitem__(self, kind: str) -> type[Any]:
        if kind not in self.modules:
            raise KeyError(kind)
        return class_in(self.module(kind), self._base)

    def __iter__(self) -> Iterator[str]:
        return iter(self.modules)

    def __len__(self) -> int:
        return len(self.modules)


FIGURES = Kinds(Product, "damper.figures")
TABLES = Kinds(Product, "damper.tables", "damper.papers.tables")
#: Studies with ``kind: <name>`` in their files, which check the engine or are of a structure;
#: without it, a file is a `damper.study.model.Study`.
STUDIES = Kinds(StudyFile, "damper.verification", "damper.structures", within="settings")
