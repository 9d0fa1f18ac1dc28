"""What drives the dampers of a study: the kinds of forces, each with the settings of its class.

Names, types, choices and meanings are those of `damper.parameters.forcing`, and so are the checks:
a force is made of what a study says, and what its class refuses is a mistake in the file.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import MISSING, fields
from functools import cache, cached_property
from inspect import cleandoc
from pathlib import Path
from types import GenericAlias
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

from pydantic import Field, PlainValidator, WithJsonSchema, create_model
from pydantic_core import PydanticCustomError

from damper.parameters.forcing import (
    EACH_DRAW,
    FORCINGS,
    SETTING_UNITS,
    Forcing,
    Noise,
    Record,
    forcing_of,
)
from damper.study.fields import OrWord, Pair, SIUnit, StrictModel, Text, one_of
from damper.study.jobs import file_digest
from damper.study.kinds import Kinds
from damper.study.messages import Mistakes
from damper.study.schema import Schema, first_line
from damper.study.settings import Assumed, Stated, check_origin
from damper.study.yaml_file import Loc, unreadable


class _Named(StrictModel):
    """What a study says of any force."""

    shorthand = "kind"
    kind: Annotated[
        str,
        one_of(FORCINGS),
        Field(description="Which kind of force it is; alone, it stands for the mapping."),
    ]


class ForceEntry(_Named):
    """What drives every damper of the study."""

    assumed: Assumed = None
    stated: Stated = None

    @property
    def settings(self) -> dict[str, Any]:
        """Its kind and what it is made of, in plain values, as `forcing_of` takes them."""
        remarks = {"assumed", "stated"}
        kept = ((key, value) for key, value in self if key not in remarks and value is not None)
        return {key: list(v) if isinstance(v, tuple) else v for key, v in kept}

    @property
    def drawn(self) -> bool:
        """Whether each draw has a force of its own."""
        return False

    def path(self, folder: Path) -> Path | None:
        """Return the file of its samples, if it has one; `folder` is that of the study's file."""
        return None

    def force(self, folder: Path) -> Forcing:
        """Return the force; of several, one. ValueError, TypeError or OSError if it is refused."""
        return forcing_of(self.settings, self.path(folder))

    def about(self, folder: Path) -> dict[str, Any]:
        """Return what a cube and the page say of it."""
        about = self.force(folder).settings | ({"seed": EACH_DRAW} if self.drawn else {})
        path = self.path(folder)
        file = {} if path is None else {"file": path.name, "digest": file_digest(path)}
        return about | file

    def check_together(self, mistakes: Mistakes) -> None:
        check_origin(self, mistakes)
        if not mistakes and self.path(_NOWHERE) is None:
            self.check_force(_NOWHERE, mistakes)

    def check_force(self, folder: Path, mistakes: Mistakes) -> None:
        """Note what the class of the force refuses."""
        try:
            self.force(folder)
        except OSError as error:
            path: Any = self.path(folder)
            problem, near = unreadable(path, error)
            message, allowed = f"{path}: {problem}", "a file of a record, relative to the study's"
            mistakes.add(("file",), message, allowed, near)
        except (ValueError, TypeError) as error:
            loc, words = _place(str(error))
            message, _, allowed = words.partition(": must be ")
            mistakes.add(loc or (("file",) if self.path(folder) else ()), message, allowed)


class RecordEntry(ForceEntry):
    """A record, by its file or by its samples."""

    file: Annotated[
        Text | None,
        Field(
            description="File of CSV (one sample a line), PEER (AT2), MATLAB, WAV or UFF, relative "
            "to the folder of the study's file; it may name columns and units. Not with time and "
            "value."
        ),
    ] = None

    @property
    def settings(self) -> dict[str, Any]:
        return {key: value for key, value in super().settings.items() if key != "file"}

    def path(self, folder: Path) -> Path | None:
        return None if self.file is None else folder / self.file

    def check_together(self, mistakes: Mistakes) -> None:
        given = {key for key, value in self if value is not None}
        if self.file is None and not {"time", "value"} <= given:
            message = "neither file, nor time and value, are given"
            mistakes.add((), message, "file: <a file of a record>, or time: [...] and value: [...]")
        elif self.file is not None and {"time", "value"} & given:
            mistakes.add((), "file and samples are both given", "file, or time and value")
        for key in sorted(_READING.keys() & given) if self.file is None else ():
            mistakes.add((key,), f"{key} says how a file is read, and there is none", "file")
        super().check_together(mistakes)


class NoiseEntry(ForceEntry):
    """Noise of one seed, or in each draw of another one."""

    @property
    def drawn(self) -> bool:
        return bool(self.settings["seed"] == EACH_DRAW)

    def force(self, folder: Path) -> Forcing:
        return forcing_of(self.settings | ({"seed": 0} if self.drawn else {}))


_NOWHERE = Path()


def _units_of(name: str) -> list[Any]:
    """The unit that a setting may have in a study in SI units, as a note; none of others."""
    return [SIUnit(SETTING_UNITS[name][1])] if name in SETTING_UNITS else []


@cache
def force_entry(kind: str) -> type[ForceEntry]:
    """Class of what a study says of a force of this kind, from what its class declares."""
    declared = FORCINGS[kind]
    hints, meanings = get_type_hints(declared), _meanings(declared)
    known: Any = Literal[kind]
    kinds = Field(description=_Named.model_fields["kind"].description)
    given: dict[str, Any] = {"kind": (Annotated[known, kinds], ...)}
    for one in fields(declared):
        of: Any = _type(hints[one.name])
        default = ... if one.default is MISSING else one.default
        if declared is Record and default is ...:
            of, default = _Samples | None, None
        if declared is Noise and one.name == "seed":
            of = Annotated[of, OrWord(EACH_DRAW)]
            meanings[one.name] += f" `{EACH_DRAW}`: in each draw another one, by the seed of draws."
        about = Field(description=meanings.get(one.name, ""))
        given[one.name] = Annotated[of, about, *_units_of(one.name)], default
    bases: dict[type[Forcing], type[ForceEntry]] = {Record: RecordEntry, Noise: NoiseEntry}
    base = bases.get(declared, ForceEntry)
    if declared is Record:
        meanings = _meanings(Record.read)
        for name, how in _READING.items():
            about = Field(description=meanings[name])
            given[name] = Annotated[how | None, about, *_units_of(name)], None
    made: Any = create_model(
        declared.__name__, __base__=base, __doc__=first_line(declared), **given
    )
    return made  # type: ignore[no-any-return]


def _column(column: Any) -> str | int:
    if isinstance(column, bool) or not isinstance(column, str | int):
        raise PydanticCustomError("column", "must be the name or the number of a column")
    return column


_COLUMN: Schema = {"anyOf": [{"type": "string"}, {"type": "integer"}]}
_Band = Pair[float]
_Samples = Annotated[tuple[float, ...], Field(strict=False)]
_Column = Annotated[Any, PlainValidator(_column), WithJsonSchema(_COLUMN)]
Columns = Annotated[tuple[_Column, ...], Field(strict=False, min_length=1, max_length=2)]
Letter = Annotated[str, Field(min_length=1, max_length=1)]
_Positive = Annotated[float, Field(gt=0)]
#: How `Record.read` reads a file.
_READING: dict[str, Any] = {
    "columns": Columns,
    "delimiter": Letter,
    "step": _Positive,
    "factor": float,
}


def _type(hint: Any) -> Any:
    """Return the type of what a study may give for a field of a force."""
    if get_origin(hint) is Sequence:
        return Annotated[GenericAlias(tuple, (get_args(hint)[0], ...)), Field(strict=False)]
    return _Band if get_origin(hint) is tuple else hint


def _meanings(declared: Any) -> dict[str, str]:
    """Return the meaning of each parameter in a docstring of numpydoc's form."""
    listed = cleandoc(declared.__doc__ or "").partition("Parameters\n----------\n")[2]
    entries = re.findall(r"^([\w, ]+) : .*\n((?:    .*\n?)+)", listed.partition("\n\n")[0], re.M)
    return {
        name: " ".join(text.replace("``", "`").split())
        for names, text in entries
        for name in names.split(", ")
    }


def _place(message: str) -> tuple[Loc, str]:
    """Return the key that an error of a force names, and its words as a study has them."""
    classes = "|".join(cls.__name__ for cls in FORCINGS.values())
    named = re.match(rf"(?:{classes})\.(\w+)", message)
    words = re.sub(rf"\b(?:{classes})\.(?=[a-z])", "", message)
    words = words.replace("damper.NoForce()", "forcing: none")
    return ((named[1],) if named else ()), words


class _Forces(Kinds):
    """Kind of a force -> the class of what a study says of it; a name may be all."""

    @cached_property
    def modules(self) -> dict[str, str]:
        return {kind: cls.__module__ for kind, cls in FORCINGS.items()}

    def class_of(self, data: Any) -> type[Any]:
        if isinstance(data, dict):
            data = {key: data[key] for key in data if key == "kind"}
        return self[_Named.model_validate(data).kind]

    def __getitem__(self, kind: str) -> type[Any]:
        return force_entry(kind)


FORCES = _Forces(ForceEntry)


#: Why the decay of a vibration is not observed.
NOT_FREE = ": its vibration is not free, and does not decay by itself"


def check_undriven(
    force: Forcing,
    amplitudes: Iterable[float],
    begins: Iterable[float],
    mistakes: Mistakes,
    later: str = "transient: {time: end}",
) -> bool:
    """Note where a force drives the damper whose decay is observed; whether none does.

    `begins` are times at which windows of the runs begin; `later` says how they begin later.
    """
    over = bool(force.samples and getattr(force, "after", "") == "zero")
    over = over and all(begin >= force.end * (1.0 - 1e-12) for begin in begins)
    if over or force.kind == "none" or not any(amplitudes):
        return True
    allowed = f"force_amplitude: 0, forcing: none, or {later} after a record"
    mistakes.add(("observers", "decay"), f"a force drives the damper{NOT_FREE}", allowed)
    return False
