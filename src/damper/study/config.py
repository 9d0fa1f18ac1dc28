"""The study language: what a study file and the workflow's configuration may say.

A study file is one `Study`, or one of the `STUDIES` if it says so; `load_config` turns the mapping
that Snakemake hands over into the studies it names, or raises one `ConfigError` that lists every
mistake in every file.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from damper.parameters.quantities import nearest
from damper.study.fields import STEM, STEM_WORDS, Entries
from damper.study.kinds import STUDIES
from damper.study.messages import Faults, faults_of
from damper.study.model import Config, Settings, Study
from damper.study.products import Offer
from damper.study.study_file import StudyFile
from damper.study.yaml_file import (
    ConfigError,
    Loc,
    Problem,
    YamlFile,
    as_part,
    read_yaml,
    show,
    words,
)

__all__ = ["Config", "ConfigError", "Study", "load_config", "load_study"]


def load_config(mapping: dict[str, Any], directory: Path) -> Config:
    """Check the workflow's configuration and load the studies it names.

    Parameters
    ----------
    mapping : dict
        The content of config/config.yaml as Snakemake read it. Its YAML reader makes text of
        1e-12, so text that looks like a number counts as one here, `overrides` included.
    directory : Path
        The folder that holds ``config/``.

    Returns
    -------
    Config
        The studies, in the order in which they are named, and the engine's settings.

    Raises
    ------
    ConfigError
        Everything that is wrong, in the configuration and in all files.
    """
    directory = Path(directory)
    problems: list[Problem] = []
    settings, studies = None, {}
    try:
        settings = Settings.model_validate(mapping)
    except ValidationError as error:
        problems += [Problem("config", loc, **report) for loc, report in faults_of(error)]
    overrides = _part_of(mapping, "overrides", dict)
    asked = _asked(mapping)
    paths = _paths(asked, overrides, directory, problems)
    for name, path in paths.items():
        label = path.relative_to(directory) if path.is_relative_to(directory) else path
        try:
            override = _part_of(overrides, name, dict)
            studies[name] = _load(path, label.as_posix(), override)
        except ConfigError as error:
            problems += error.problems
    if not problems:
        problems += _lacking_beside(studies)
    if problems or settings is None:
        raise ConfigError.of(problems)
    targets = {name: tuple(map(_stem, names)) for name, names in settings.targets.items()}
    default = tuple(map(_stem, settings.studies))
    return Config(studies, default, targets, settings.engine, settings.results)


def load_study(path: Path, override: dict[str, Any] | None = None) -> Any:
    """Load one study file.

    Parameters
    ----------
    path : Path
        The file; its stem is the study's name.
    override : dict, optional
        A partial study that is merged over the file. What it says about the values of an axis
        replaces the way in which the file gives them, and a figure or table that is null in it is
        left out. As in `load_config`, text that looks like a number counts as one in it.

    Returns
    -------
    Study or Verification
        The study, merged and checked.

    Raises
    ------
    ConfigError
        Everything that is wrong with the file and the override.
    """
    return _load(Path(path), str(path), override)


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
            problems.append(_unknown_study(loc, entry, files))
        elif not STEM.fullmatch(path.stem):
            message = f"{show(path.stem)} cannot be the name of a study"
            problems.append(Problem("config", loc, message, STEM_WORDS))
        elif path.stem.casefold() in map(str.casefold, paths):
            message = f"two studies are called '{path.stem}'"
            problems.append(Problem("config", loc, message, "each name once"))
        else:
            paths[path.stem] = path
    strangers = [n for n in overrides if isinstance(n, str) and n not in files and n not in paths]
    problems += [_unknown_study(("overrides", name), name, files) for name in strangers]
    return paths


def _stem(entry: str) -> str:
    """Return the name of a study from its name or path."""
    return Path(entry).stem if entry.endswith(".yaml") else entry


def _lacking_beside(studies: dict[str, StudyFile]) -> Iterator[Problem]:
    """Yield what figures and tables ask for and the other studies lack."""
    for name, study in studies.items():
        for section, stem, product in study.products():
            for what, other in getattr(product, "beside", {}).items():
                loc, place = (section, stem, "also", what), f"study {name}"
                cubes = {name: one for name, one in studies.items() if isinstance(one, Study)}
                beside = cubes.get(other)
                if beside is None:
                    message = f"the study '{other}' is not among those to be made"
                    allowed = f"{words(cubes)} (studies and targets in the configuration)"
                    yield Problem(place, loc, message, allowed, nearest(other, cubes))
                    continue
                found = Faults()
                product.fit_beside(what, Offer(beside.axis_values, beside.observers), found)
                for line in found.lines:
                    context = line["type"].context
                    message = f"in the study '{other}' {context['message']}"
                    yield Problem(place, loc, message, context["allowed"])


def _unknown_study(loc: Loc, name: str, files: Iterable[str]) -> Problem:
    allowed = f"{words(files)} (the files in config/studies), or a path that ends in .yaml"
    return Problem("config", loc, f"unknown study {show(name)}", allowed, nearest(name, files))


def _part_of(data: Any, key: str, sort: type) -> Any:
    """Return what `data` says under `key`, or an empty `sort` if that is in error."""
    value = data.get(key) if isinstance(data, dict) else None
    return value if isinstance(value, sort) else sort()


def _load(path: Path, label: str, override: Any) -> StudyFile:
    file = read_yaml(path, label)
    problems, data = file.problems, file.data
    if isinstance(override, dict):
        data = _merged(data, override, _dropped(data | override))
    elif override is not None:
        message = f"not a mapping (value: {show(override)})"
        problems.append(Problem(f"{label} (overrides of config)", (), message))
    try:
        study = _kind_of(data).model_validate(data)
    except ValidationError as error:
        for loc, report in faults_of(error):
            place, line = _place(loc, file, override)
            problems.append(Problem(place, loc, line=line, **report))
    if problems:
        raise ConfigError.of(sorted(problems, key=lambda problem: problem.line))
    study._name = path.stem
    return study


def _kind_of(data: dict[str, Any]) -> type[StudyFile]:
    """Return the class of a study as written."""
    if not isinstance(data, dict) or "kind" not in data:
        return Study
    return STUDIES.class_of(data)


def _place(loc: Loc, file: YamlFile, override: Any) -> tuple[str, int]:
    """Return where the value at `loc` comes from, in words, and the line to sort by."""
    depth, line = file.find(loc)
    here = f"{file.label}:{line}" if line else file.label
    over, value = 0, override
    while over < len(loc) and isinstance(value, dict) and loc[over] in value:
        value = value[loc[over]]
        over += 1
    if isinstance(value, list | tuple):
        over += sum(1 for part in loc[over : over + 1] if isinstance(part, int))
    if over == 0 or over < depth:
        return here, line
    both = over == depth and isinstance(value, dict)
    return f"{here if both else file.label} ({'and ' if both else ''}overrides of config)", line


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
        if any(isinstance(one, Entries) and one.dropped for one in field.metadata)
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
            value = _merged(old, value, dropped, (*loc, key))
        merged[key] = value
    return merged
