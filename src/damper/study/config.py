"""The study language: loads study files and the workflow's configuration.

A study file is one `Study`, or one of the `STUDIES` if it says so; `load_config` turns
config/config.yaml into the studies it names, or raises one `ConfigError` that lists every mistake
in every file.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from functools import reduce
from operator import attrgetter
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from damper.parameters.names import nearest
from damper.parameters.quantities import is_si
from damper.parameters.tables import WALL_TABLES, read_table
from damper.study.fields import STEM, STEM_WORDS, NamedMapping
from damper.study.kinds import STUDIES
from damper.study.messages import Mistakes, Report, mistakes_of
from damper.study.model import Config, Settings, Study
from damper.study.parts import SimulatedStudy
from damper.study.rules import check_study
from damper.study.study_file import StudyFile
from damper.study.yaml_file import (
    ConfigError,
    Found,
    Loc,
    Problem,
    YamlFile,
    as_part,
    display,
    join_names,
    read_yaml,
    words_of,
)

__all__ = ["Config", "ConfigError", "Study", "load_config", "load_study"]


def load_config(
    given: Any, directory: Path, files: Iterable[Path] = (), checked: bool = False
) -> Config:
    """Check the workflow's configuration and load the studies it names, in that order.

    `given` is what is configured beside the files, such as by ``--config``; Snakemake's reader
    makes text of 1e-12, so text that looks like a number counts as one here. Each of the files is
    merged over those before it, and `given` over all. `directory` holds ``config/``. ConfigError
    lists everything that is wrong, in the configuration and in all files. Where all has been
    `checked` by another process, what takes long, such as records, is not read again.
    """
    directory = Path(directory)
    parts = _Parts.of(given, files)
    problems = [problem for file in parts.files for problem in file.problems]
    mapping = parts.data
    settings, studies = None, {}
    try:
        settings = Settings.model_validate(mapping)
    except ValidationError as error:
        problems += [parts.problem(loc, **report) for loc, report in mistakes_of(error)]
    rules = _rules(directory)
    for name in filter(rules.__contains__, _part_of(mapping, "targets", dict)):
        message = f"{display(name)} is a rule of the workflow"
        problems.append(parts.problem(("targets", name), message, "another name"))
    overrides = _part_of(mapping, "overrides", dict)
    paths = _paths(_asked(mapping), overrides, directory, parts, problems)
    for name, path in paths.items():
        try:
            override, loc = _part_of(overrides, name, dict), ("overrides", name)
            studies[name] = _load(path, _label(path, directory), override, parts, loc, checked)
        except ConfigError as error:
            problems += error.problems
    if problems or settings is None:
        raise ConfigError.of(problems)
    targets = {name: tuple(map(_stem, names)) for name, names in settings.targets.items()}
    default = tuple(map(_stem, settings.studies))
    return Config(studies, default, targets, settings.engine, settings.results)


def load_study(path: Path, override: dict[str, Any] | None = None) -> Any:
    """Load one study file; its stem is the study's name.

    `override` is a partial study that is merged over the file. Its values of an axis replace the
    file's, in whatever form the file gives them; null leaves out a figure or table. As in
    `load_config`, text that looks like a number counts as a number. ConfigError lists all mistakes
    of both.
    """
    above = YamlFile(f"{path} (override)", override)
    return _load(Path(path), str(path), override, _Parts([above]), ())


@dataclass(frozen=True)
class _Parts:
    """What a configuration is made of; each part is merged over those before it."""

    files: list[YamlFile]

    @classmethod
    def of(cls, given: Any, paths: Iterable[Path]) -> _Parts:
        """Read the files, whose names in messages are relative to the working directory."""
        files = [read_yaml(path, _label(Path(path), Path.cwd())) for path in paths]
        if given or not files:
            files.append(YamlFile("--config" if files else "config", given))
        return cls(files)

    @property
    def data(self) -> Any:
        """The settings, merged."""
        return reduce(_over, (file.data for file in self.files))

    def problem(self, loc: Loc, message: str, allowed: str = "", near: str = "") -> Problem:
        """Return a problem of what stands at `loc`."""
        found = self.find(loc)
        return Problem(found.place, loc, message, allowed, near, found.line)

    def find(self, loc: Loc) -> Found:
        """Return where `loc` stands: of several parts that set the same, in the last one."""
        found = [file.find(loc) for file in self.files]
        deepest = max(reversed(found), key=attrgetter("depth"))
        return deepest if deepest.depth else found[0]


def _over(below: Any, above: Any) -> Any:
    """Return settings merged as Snakemake merges them: mappings by key, all else replaced."""
    if not isinstance(below, dict) or not isinstance(above, dict):
        return above
    return below | {
        key: _over(below[key], value) if key in below else value for key, value in above.items()
    }


def _label(path: Path, directory: Path) -> str:
    """Return how messages call a file: relative to a folder where it is below it."""
    return (path.relative_to(directory) if path.is_relative_to(directory) else path).as_posix()


def _rules(directory: Path) -> set[str]:
    """Return the names of the workflow's own rules, which no target may take."""
    files = [directory / "Snakefile", *(directory / "workflow" / "rules").glob("*.smk")]
    texts = (file.read_text("utf-8") for file in files if file.is_file())
    return {name for text in texts for name in re.findall(r"(?m)^rule (\w+):", text)}


def _asked(mapping: Any) -> list[tuple[Loc, Any]]:
    """Return the place and the name of every study that the configuration asks for."""
    asked: list[tuple[Loc, Any]] = [
        (("studies", i), entry) for i, entry in enumerate(_part_of(mapping, "studies", list))
    ]
    for target, names in _part_of(mapping, "targets", dict).items():
        for i, entry in enumerate(names if isinstance(names, list) else ()):
            asked.append((("targets", as_part(target), i), entry))
    return asked


def _paths(
    asked: list[tuple[Loc, Any]],
    overrides: dict[Any, Any],
    directory: Path,
    parts: _Parts,
    problems: list[Problem],
) -> dict[str, Path]:
    """Return names and files of the studies, and note what cannot be one."""
    files = {p.stem: p for p in sorted((directory / "config" / "studies").glob("*.yaml"))}
    paths: dict[str, Path] = {}
    seen: set[str] = set()
    for loc, entry in asked:
        if not isinstance(entry, str) or not entry.strip() or entry in seen:
            continue  # reported already, or a study of two targets
        seen.add(entry)
        path = directory / entry if entry.endswith(".yaml") else files.get(entry)
        if path is None:
            problems.append(_unknown_study(loc, entry, files, parts))
        elif not STEM.fullmatch(path.stem):
            message = f"{display(path.stem)} cannot be the name of a study"
            problems.append(parts.problem(loc, message, STEM_WORDS))
        elif path.stem.casefold() in map(str.casefold, paths):
            message = f"two studies are called '{path.stem}'"
            problems.append(parts.problem(loc, message, "each name once"))
        else:
            paths[path.stem] = path
    strangers = [n for n in overrides if isinstance(n, str) and n not in files and n not in paths]
    problems += [_unknown_study(("overrides", n), n, files, parts) for n in strangers]
    return paths


def _stem(entry: str) -> str:
    """Return the name of a study from its name or path."""
    return Path(entry).stem if entry.endswith(".yaml") else entry


def _unknown_study(loc: Loc, name: str, files: Iterable[str], parts: _Parts) -> Problem:
    allowed = f"{join_names(files)} (the files in config/studies), or a path that ends in .yaml"
    return parts.problem(loc, f"unknown study {display(name)}", allowed, nearest(name, files))


def _part_of(data: Any, key: str, sort: type) -> Any:
    """Return what `data` says under `key`, or an empty `sort` if that is in error."""
    value = data.get(key) if isinstance(data, dict) else None
    return value if isinstance(value, sort) else sort()


def _load(
    path: Path, label: str, override: Any, parts: _Parts, prefix: Loc, checked: bool = False
) -> StudyFile:
    file = read_yaml(path, label)
    problems, data = file.problems, file.data
    if isinstance(override, dict):
        data = _merged(data, override, _dropped(data | override))
    elif override is not None:
        problems.append(parts.problem(prefix, f"must be a mapping (value: {display(override)})"))
    try:
        study = _kind_of(data).model_validate(_with_tables(data, path.parent))
        study._name, study._folder = path.stem, path.parent
        if isinstance(study, Study) and not checked:
            check_study(study)
        if not checked:
            mistakes = Mistakes()
            study.check_files(mistakes)
            mistakes.raise_any()
    except ValidationError as error:
        problems += [_blame(loc, file, parts, prefix, report) for loc, report in mistakes_of(error)]
    if problems:
        raise ConfigError.of(sorted(problems, key=lambda problem: problem.line))
    return study


def _with_tables(data: Any, folder: Path) -> Any:
    """Return a study with the rows of the restitution tables that it names by files there."""
    mistakes = Mistakes()

    def read(given: Any, *loc: str | int) -> Any:
        rows = {}
        for name in WALL_TABLES if isinstance(given, dict) else ():
            if isinstance(given.get(name), str):
                try:
                    unit = "m/s" if is_si(_part_of(data, "parameters", dict)) else "1"
                    rows[name] = read_table(name, folder / given[name], unit)
                except (ValueError, OSError) as error:
                    mistakes.add((*loc, name), words_of(error))
        return given | rows if rows else given

    made = {"parameters": read(data.get("parameters"), "parameters")}
    if masses := _part_of(data, "masses", list):
        made["masses"] = [read(one, "masses", k) for k, one in enumerate(masses)]
    mistakes.raise_any()
    return data | {key: value for key, value in made.items() if key in data}


def _kind_of(data: dict[str, Any]) -> type[StudyFile]:
    """Return the class of a study as written."""
    if not isinstance(data, dict) or "kind" not in data:
        return SimulatedStudy
    return STUDIES.class_of(data)


def _blame(loc: Loc, file: YamlFile, parts: _Parts, prefix: Loc, report: Report) -> Problem:
    """Return a problem of a study, which stands in its file or in what is merged over it."""
    here, above = file.find(loc), parts.find((*prefix, *loc))
    over = above.depth - len(prefix)
    if over <= 0 or over < here.depth:
        return Problem(here.place, loc, line=here.line, **report)
    if over == here.depth and above.is_mapping:
        return Problem(f"{here.place} (and {above.place})", loc, line=here.line, **report)
    return Problem(above.place, (*prefix, *loc), line=above.line, **report)


# Overrides.

# The keys of an axis in the file that give way to a key in the override.
_YIELDS = {
    "values": ("start", "stop", "num", "step", "spacing"),
    "num": ("values", "step"),
    "step": ("values", "num", "spacing"),
    "start": ("values",),
    "stop": ("values",),
}


def _dropped(data: dict[str, Any]) -> set[str]:
    """Return the sections of a study in which null, in an override, leaves out an entry."""
    kind = data.get("kind")
    cls = STUDIES[kind] if isinstance(kind, str) and kind in STUDIES else Study
    return {
        key
        for key, field in cls.model_fields.items()
        if any(isinstance(one, NamedMapping) and one.dropped for one in field.metadata)
    }


def _merged(
    file: dict[str, Any], override: dict[str, Any], dropped: Collection[str], loc: Loc = ()
) -> dict[str, Any]:
    merged = dict(file)
    if len(loc) == 2 and loc[0] == "axes":
        for key in {old for new in override for old in _YIELDS.get(new, ())}:
            merged.pop(key, None)
    for key, value in override.items():
        if value is None and key in merged and len(loc) == 1 and loc[0] in dropped:
            del merged[key]
            continue
        old = merged.get(key)
        if isinstance(old, dict) and isinstance(value, dict):
            # Settings of another kind of force are none of this one.
            other = (*loc, key) == ("forcing",) and value.get("kind") not in (None, old.get("kind"))
            value = value if other else _merged(old, value, dropped, (*loc, key))
        merged[key] = value
    return merged
