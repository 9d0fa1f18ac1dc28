"""Strict YAML files: numbers as YAML 1.2 has them, no key twice, and the line of every key.

PyYAML follows YAML 1.1, where 1e-8 is text and `on` is true, and lets a later key silently replace
an earlier one. Its parsers are used as they are; what the scalars mean is decided here.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from yaml.error import MarkedYAMLError, YAMLError
from yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode
from yaml.reader import ReaderError

from damper.parameters.files import contents
from damper.parameters.names import nearest

NUMBER = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
"""A decimal number as YAML 1.2 writes it."""

Loc = tuple[str | int, ...]


class Quoted(str):
    """Text that a file marks as text although it looks like a number."""


class ConfigError(Exception):
    """The configuration cannot be used; the text says everything that is wrong with it."""

    problems: tuple[Problem, ...] = ()

    @classmethod
    def of(cls, problems: Sequence[Problem]) -> ConfigError:
        """Return the error that lists `problems`."""
        count = "1 error" if len(problems) == 1 else f"{len(problems)} errors"
        error = cls("\n".join([f"{count} in the configuration", *(p.block() for p in problems)]))
        error.problems = tuple(problems)
        return error


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong: where, what, and what would be right."""

    place: str
    loc: Loc
    message: str
    allowed: str = ""
    near: str = ""
    line: int = 0

    def block(self) -> str:
        """Return the lines that describe it."""
        path = key_path(self.loc)
        place = self.place if self.place.isprintable() else display(self.place)
        lines = [f"{place}  {path}" if path else place, f"    {self.message}"]
        if self.allowed:
            lines.append(f"    allowed: {self.allowed}")
        if self.near:
            lines.append(f"    did you mean '{self.near}'?")
        return "\n".join(lines)


@dataclass
class YamlFile:
    """A YAML file: its data, where its keys stand, and what YAML itself has against it.

    Settings that no file holds are one without a `root`: its keys stand in no line.
    """

    label: str
    data: Any
    root: Node | None = None
    problems: list[Problem] = field(default_factory=list)

    def find(self, loc: Loc) -> Found:
        """Return how far the file goes along `loc`."""
        node, line = self.data if self.root is None else self.root, 0
        for depth, part in enumerate(loc):
            found = _child(node, part)
            if found is None:
                return Found(depth, self, line, node)
            mark, node = found
            line = mark + 1
        return Found(len(loc), self, line, node)


class Found(NamedTuple):
    """How much of a path a file has: so many parts, the last one in this line (or 0)."""

    depth: int
    file: YamlFile
    line: int
    node: Any

    @property
    def place(self) -> str:
        """How messages call it."""
        return f"{self.file.label}:{self.line}" if self.line else self.file.label

    @property
    def is_mapping(self) -> bool:
        """Whether keys may stand below it."""
        return isinstance(self.node, dict | MappingNode)


def read_yaml(path: Path, label: str | None = None) -> YamlFile:
    """Read a YAML file whose top level is a mapping; messages call it `label`, by default its path.

    Doubled keys and the like are listed in `problems`, so that they can be reported together with
    what the reader finds wrong with the rest. ConfigError if there is nothing to go on: no such
    file, not text, not YAML, empty, or no mapping.
    """
    file = YamlFile(str(path) if label is None else label, None)
    try:
        data = contents(path)
        file.root = _tree(data.decode("utf-8-sig"))
        file.data = None if file.root is None else _value(file, file.root, ())
    except OSError as error:
        message, near = unreadable(path, error)
        raise ConfigError.of([Problem(file.label, (), message, near=near)]) from None
    except (YAMLError, UnicodeDecodeError) as error:
        line, column, message = _not_yaml(data, error)
        message = f"not valid YAML at line {line}, column {column}: {message}"
        raise ConfigError.of([Problem(f"{file.label}:{line}", (), message)]) from None
    except RecursionError:
        message = "lists or mappings stand too deep inside each other, or an alias (*) in itself"
        raise ConfigError.of([Problem(file.label, (), message)]) from None
    if isinstance(file.data, dict):
        return file
    problem = Problem(file.label, (), "the file is empty", "a mapping (key: value)")
    if file.data is not None:
        message = f"the top level must be a mapping (it is {display(file.data)})"
        problem = Problem(f"{file.label}:{_line(file.root)}", (), message, "key: value")
    raise ConfigError.of(file.problems or [problem])


def unreadable(path: Path, error: OSError) -> tuple[str, str]:
    """Say why a file cannot be read, and which one beside it was probably meant, or nothing."""
    if not isinstance(error, FileNotFoundError):
        return f"cannot be read: {error.strerror or 'unknown reason'}", ""
    if path.is_symlink():
        return f"is a link to {path.readlink()}, which does not exist", ""
    names: list[str] = []
    with suppress(OSError):
        names = sorted(other.name for other in path.parent.iterdir())
    # A file of another kind counts only under the very name; of equal names that of the same kind.
    names.sort(key=lambda name: Path(name).suffix == path.suffix)
    kind = {path.stem, path.suffix}
    stems = {Path(name).stem: name for name in names if kind & {Path(name).stem, Path(name).suffix}}
    return "there is no such file", stems.get(nearest(path.stem, stems), "")


def words_of(error: Exception) -> str:
    """Say what is wrong; of a file that cannot be used, why, and which one was probably meant."""
    if not isinstance(error, OSError) or not error.filename:
        return str(error)
    path = Path(os.fsdecode(error.filename))
    if not isinstance(error, FileNotFoundError):
        return f"{path}: {error.strerror}"
    if not path.parent.is_dir():
        return f"{path}: there is no folder {path.parent}"
    told, near = unreadable(path, error)
    return f"{path}: {told}" + (f"; did you mean {near!r}?" if near else "")


def dump_yaml(data: Any) -> str:
    """Return `data` as YAML that `read_yaml` and readers of YAML 1.1 take alike."""
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100)


def display(value: object) -> str:
    """Return a value as a message shows it: on one line, short, in the spelling of YAML."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "a mapping" if value else "an empty mapping"
    if isinstance(value, list | tuple):
        if len(value) == 2 and not any(isinstance(item, dict | list | tuple) for item in value):
            return _cut(f"[{', '.join(map(display, value))}]")
        return "a list" if value else "an empty list"
    if isinstance(value, str):
        return _cut(repr(str(value)))
    if isinstance(value, float) and (value != value or value in (float("inf"), float("-inf"))):
        return {"inf": ".inf", "-inf": "-.inf"}.get(str(value), ".nan")
    return _cut(repr(value))


def as_part(key: object) -> str:
    """Return a key as a part of a path, whatever it is."""
    return key if isinstance(key, str) else display(key)


def key_path(loc: Loc) -> str:
    """Return a place within a file as ``axes.restitution.values[2]``."""
    text = ""
    for part in loc:
        if isinstance(part, int):
            text += f"[{part}]"
            continue
        plain = re.fullmatch(r"[\w~<-]+", part) is not None and len(part) <= 60
        text += ("." if text else "") + (part if plain else display(part))
    return text


def _tree(text: str) -> Node | None:
    """Return the root of the only document, or None if there is none.

    libyaml is ten times as fast; PyYAML itself reports mistakes, the same everywhere.
    """
    try:
        root: Node | None = _FastLoader(text).get_single_node()
    except YAMLError:
        root = _Loader(text).get_single_node()
    return root


def _not_yaml(data: bytes, error: Exception) -> tuple[int, int, str]:
    """Return line and column, from 1, of a mistake in a file, and a message."""
    if isinstance(error, MarkedYAMLError) and (mark := error.problem_mark or error.context_mark):
        message = error.problem or error.context or "not understood"
        tab = " (indent with spaces, not with tabs)" if "'\\t'" in message else ""
        return mark.line + 1, mark.column + 1, message + tab
    if isinstance(error, ReaderError):
        message = f"the character {display(chr(error.character))} may not stand in a file"
        before = data.decode("utf-8-sig")[: error.position]
    else:
        message = "not text in UTF-8"
        before = data[: getattr(error, "start", 0)].decode("latin-1")
    return before.count("\n") + 1, len(before) - before.rfind("\n"), message


class _Loader(yaml.BaseLoader):
    """PyYAML up to the tree of nodes, with the scalars of YAML 1.2's core schema."""


class _FastLoader(getattr(yaml, "CBaseLoader", yaml.BaseLoader)):  # type: ignore[misc]
    """The loader of libyaml, where PyYAML has it."""


_TAG = "tag:yaml.org,2002:"
# Tag, pattern of the plain scalars that get it, and the characters that those begin with.
_CORE = [
    ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    ("bool", r"true|True|TRUE|false|False|FALSE", list("tTfF")),
    ("int", r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+", list("-+0123456789")),
    ("float", NUMBER.pattern, list("-+.0123456789")),
    ("float", r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)", list("-+.")),
]


class _Dumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):  # type: ignore[misc]
    """Quotes what YAML 1.1 or 1.2 would not take for text, and writes no anchors."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


for _name, _pattern, _first in _CORE:
    for _class in (_Loader, _FastLoader, _Dumper):
        _class.add_implicit_resolver(_TAG + _name, re.compile(rf"(?:{_pattern})\Z"), _first)


def _value(file: YamlFile, node: Node, loc: Loc) -> Any:
    """Return the value of a node; list in the file's `problems` why it has none."""
    kind = node.tag.removeprefix(_TAG)
    if isinstance(node, MappingNode) and kind == "map":
        return _mapping(file, node, loc)
    if isinstance(node, SequenceNode) and kind == "seq":
        return [_value(file, item, (*loc, i)) for i, item in enumerate(node.value)]
    if isinstance(node, ScalarNode) and kind in _SCALARS:
        try:
            return _SCALARS[kind](node.value)
        except (ValueError, KeyError):
            _blame(file, node, loc, f"{display(node.value)} is not of the kind !!{kind}")
            return None
    _blame(file, node, loc, f"the tag {display(node.tag)} has no meaning here")
    return None


def _mapping(file: YamlFile, node: MappingNode, loc: Loc) -> dict[Any, Any]:
    mapping: dict[Any, Any] = {}
    lines: dict[Any, int] = {}
    for key_node, value_node in node.value:
        if not isinstance(key_node, ScalarNode):
            _blame(file, key_node, loc, "a key must be a name, not a list or a mapping")
            continue
        key = _value(file, key_node, loc)
        key = str(key) if isinstance(key, Quoted) else key
        here = (*loc, as_part(key))
        value = _value(file, value_node, here)
        if key in mapping:
            message = f"the key {display(key)} is given twice (first in line {lines[key]})"
            _blame(file, key_node, here, message)
            continue
        mapping[key], lines[key] = value, _line(key_node)
    return mapping


def _blame(file: YamlFile, node: Node, loc: Loc, message: str) -> None:
    line = _line(node)
    file.problems.append(Problem(f"{file.label}:{line}", loc, message, line=line))


def _integer(text: str) -> int:
    return int(text, {"0o": 8, "0x": 16}.get(text[:2], 10))


def _float(text: str) -> float:
    special = {".inf": "inf", "+.inf": "inf", "-.inf": "-inf", ".nan": "nan"}
    return float(special.get(text.lower(), text))


_SCALARS: dict[str, Callable[[str], Any]] = {
    "null": lambda text: None,
    "bool": lambda text: {"true": True, "false": False}[text.lower()],
    "int": _integer,
    "float": _float,
    "str": lambda text: Quoted(text) if NUMBER.fullmatch(text) else text,
}


def _child(node: Any, part: str | int) -> tuple[int, Any] | None:
    """Return the line (from 0) and the node of one part of a path; data have no lines."""
    if isinstance(node, dict) and part in node:
        return -1, node[part]
    if isinstance(node, list | tuple) and isinstance(part, int) and part < len(node):
        return -1, node[part]
    if isinstance(node, SequenceNode) and isinstance(part, int) and part < len(node.value):
        item = node.value[part]
        return item.start_mark.line, item
    if isinstance(node, MappingNode):
        for key, value in node.value:
            if key.value == part:
                return key.start_mark.line, value
    return None


def _line(node: Node | None) -> int:
    return 1 if node is None else node.start_mark.line + 1


def _cut(text: str, most: int = 60) -> str:
    return text if len(text) <= most else f"{text[: most - 3]}..."


def join_names(names: Iterable[str], most: int = 30) -> str:
    """Return names as a list in words, cut after `most`."""
    listed = list(names)
    most += len(listed) == most + 1  # its name is as short as "and 1 more"
    rest = f", and {len(listed) - most} more" if len(listed) > most else ""
    return ", ".join(listed[:most]) + rest if listed else "none"
