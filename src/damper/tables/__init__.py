"""Tables: a cube -> CSV and Markdown, one file for each kind.

The file's name is that of the kind; it holds the class of its settings and its `make`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from damper.study.kinds import TABLES

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class About:
    """What a table says of its study, and needs to run more points of it."""

    title: str
    fixed: Mapping[str, float]
    observers: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    assumed: Mapping[str, str] = field(default_factory=dict)
    run: Mapping[str, Any] = field(default_factory=dict)
    """Settings of `damper.sweep.runs.run_points`: transient, periods, ..."""


def make(kind: str, cube: xr.Dataset, settings: Mapping[str, Any], about: About) -> tuple[str, str]:
    """Make one table of a cube.

    Parameters
    ----------
    kind : str
        A key of `damper.study.kinds.TABLES`.
    cube : xarray.Dataset
    settings : mapping
        Those of the kind in the study file.
    about : About

    Returns
    -------
    csv, markdown : str

    Raises
    ------
    ValueError
        For an unknown kind, with the known ones.
    """
    return TABLES.module(kind).make(cube, settings, about)


def markdown_table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a Markdown table."""
    return [
        "| " + " | ".join(heads) + " |",
        "|" + "---|" * len(heads),
        *("| " + " | ".join(row) + " |" for row in rows),
    ]


def remarks(about: About) -> list[str]:
    """Lines that say which values are assumed, and why."""
    if not about.assumed:
        return []
    return [
        "",
        "## Assumed",
        "",
        "These values are not stated in the source's text:",
        "",
        *(f"- {name.replace('_', ' ')}: {reason}" for name, reason in about.assumed.items()),
    ]


def fixed_values(about: About) -> str:
    """Sentence with the fixed quantities."""
    return f"Fixed: {', '.join(f'{name} = {value:g}' for name, value in about.fixed.items())}."
