"""Tables: a cube -> CSV and Markdown, one file each kind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # the Snakefile reads TABLES
    import xarray as xr

#: Rms ratio below which damping is good, and amplitude ratio below which the damped band lies.
GOOD, DAMPED = 0.5, 0.9
#: Kind in study files -> module; each has `make(cube, settings, about) -> (csv, markdown)`.
TABLES = {
    "intervals": "damper.tables.intervals",
    "performance": "damper.tables.performance",
    "small_mass_limit": "damper.tables.small_mass_limit",
    "two_impacts": "damper.tables.two_impacts",
    "ranking": "damper.papers.calibration.ranking_table",
    "convergence": "damper.tables.convergence",
    "accumulation": "damper.tables.accumulation",
}
#: Of studies that check the engine: kind -> module and function (``of(*results, **settings)``),
#: which returns the same two texts.
TABLES_OF_RESULTS = {
    "solver_errors": ("damper.verification.comparison.tables", "errors_table"),
    "solver_speed": ("damper.verification.comparison.tables", "times_table"),
    "stress": ("damper.verification.stress.table", "make"),
    "twins": ("damper.verification.stress.twins_table", "make"),
    "cost": ("damper.verification.cost.table", "make"),
}


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
        A key of `TABLES`.
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
    if kind not in TABLES:
        raise ValueError(f"unknown table kind {kind!r}: must be one of {', '.join(TABLES)}")
    return import_module(TABLES[kind]).make(cube, settings, about)


def make_of_results(kind: str, *results: Any, **settings: Any) -> tuple[str, str]:
    """Make one table of a study that checks the engine.

    Parameters
    ----------
    kind : str
        A key of `TABLES_OF_RESULTS`.
    *results
        What the files hold that this kind reads.
    **settings
        Those of the kind in the study file.

    Returns
    -------
    csv, markdown : str

    Raises
    ------
    ValueError
        For an unknown kind, with the known ones.
    """
    if kind not in TABLES_OF_RESULTS:
        known = ", ".join(TABLES_OF_RESULTS)
        raise ValueError(f"unknown table kind {kind!r}: must be one of {known}")
    module, function = TABLES_OF_RESULTS[kind]
    return getattr(import_module(module), function)(*results, **settings)


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
