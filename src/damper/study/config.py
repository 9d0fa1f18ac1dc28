"""The study language: what a study file and the workflow's configuration may say.

A study file is one `Study`; `load_config` turns the mapping that Snakemake hands over into the
studies it names, or raises one `ConfigError` that lists every mistake in every file. To add an
observer, a figure or a table, write its class of settings and enter it in the registry.

Values are checked by the kinds at the end of this module (`Number`, `Choice`, ...) rather than by
pydantic's own types: a kind can say in words what it allows, and does so in every message.
"""

from __future__ import annotations

import difflib
import math
import re
from abc import abstractmethod
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import BaseModel, ConfigDict, PrivateAttr, ValidationError, ValidationInfo
from pydantic import model_serializer, model_validator
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from damper.parameters import PARAMETER_NAMES, QUANTITIES, check_parameter
from damper.study.axes import MOST_VALUES, WAYS, axis_values, coordinate_name
from damper.study.yaml_file import NUMBER, ConfigError, Loc, Problem, YamlFile
from damper.study.yaml_file import dump_yaml, read_yaml, show, words

__all__ = ["Config", "ConfigError", "Study", "load_config", "load_study"]

MOST_SLICES = 1000
"""One slice is one job; beyond this the workflow spends its time on bookkeeping."""


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
    mapping = _from_snakemake(mapping)
    settings, problems = _settings(mapping)
    found = _StudyFiles(directory, mapping, problems)
    studies = {name: study for name, study in found.load() if study is not None}
    if problems or settings is None:
        raise ConfigError.of(problems)
    return Config(studies=studies, engine=settings.engine, results=settings.results)


def load_study(path: Path, override: dict[str, Any] | None = None) -> Study:
    """Load one study file.

    Parameters
    ----------
    path : Path
        The file; its stem is the study's name.
    override : dict, optional
        A partial study that is merged over the file. What it says about the values of an axis
        replaces the way in which the file gives them.

    Returns
    -------
    Study
        The study as merged and checked.

    Raises
    ------
    ConfigError
        Everything that is wrong with the file and the override.
    """
    study, problems = _study(Path(path), str(path), _from_snakemake(override or {}))
    if study is None:
        raise ConfigError.of(problems)
    return study


class _Strict(BaseModel):
    """A mapping of settings: unknown, missing and misspelt keys are told in plain words."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    @classmethod
    def _expanded(cls, data: Any) -> Any:
        """Return the mapping that a shorthand stands for."""
        return data

    @classmethod
    def _related(cls, data: Mapping[str, Any], model: Any, faults: Faults) -> None:
        """Check what no setting can check alone; `model` is None if some setting is wrong."""

    @model_validator(mode="wrap")
    @classmethod
    def _in_plain_words(cls, data: Any, handler: Callable[[Any], Any]) -> Any:
        if isinstance(data, cls):
            return data
        data = _mapping(cls._expanded(data), words(cls.model_fields))
        faults, model = Faults(), None
        for key in data:
            faults.unknown(key, data[key], cls.model_fields)
        for key, field in cls.model_fields.items():
            if field.is_required() and key not in data:
                allowed = next((kind.words for kind in field.metadata if hasattr(kind, "words")), "")
                faults.add((key,), f"'{key}' is missing", allowed)
        with faults.of():
            model = handler({key: data[key] for key in data if key in cls.model_fields})
        cls._related(data, model, faults)
        faults.settle()
        return model


# The kinds are used in annotations below, which pydantic reads when the last class is there.
Flag_ = Annotated


class Config(_Strict):
    """The workflow's configuration, checked."""

    studies: dict[str, Study]
    engine: Engine
    results: str


class Engine(_Strict):
    """Settings of the event-driven engine."""

    accuracy: Annotated[float, Number(ge=1e-15, le=1e-3)] = 1e-12
    max_events: Annotated[int, Number(ge=1, whole=True)] = 1_000_000
