"""Errors and outcomes of every solver on every scene."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from damper.analysis.labels import capital, label_of, short
from damper.parameters.lazy import pd, xr
from damper.study.study_file import ProductBase
from damper.tables import Table
from damper.verification.comparison import GOOD, OUTCOMES
from damper.verification.comparison.errors import MEASURES

_HEADS = {
    "impact_time_error": "impact times",
    "accumulation_error": "accumulation",
    "release_error": "release",
    "state_error": "end state",
    "penetration": "penetration",
}
_ABOUT = (
    "Errors are those of the finest level that is good: finished, no event missed or too many, "
    "inside the box. The outcome of each level stands in the last column."
)


class SolverErrors(ProductBase):
    """Errors and outcomes of every solver on every scene."""


def make(results: Mapping[str, Any], settings: SolverErrors) -> Table:
    """Make the table of errors and outcomes of every scene and solver.

    The data have a row for each level. The body has a table
    for each scene: errors at the finest good level, and the outcome of every level.
    """
    errors = results["cube"]
    body: list[str | pd.DataFrame] = [_ABOUT]
    for scene in errors.scene.values:
        here = errors.sel(scene=scene)
        body += [
            f"## {capital(str(here.title.item()))}",
            f"Until t = {float(here.until):g}, {float(here.periods):.3g} forcing periods; "
            f"{int(here.reference_impacts)} impacts count.",
            pd.DataFrame(_errors_row(here.sel(solver=solver)) for solver in errors.solver.values),
        ]
    data = levels(errors)[["reached", *(v.name for v in MEASURES)]].reset_index()
    return Table.of(errors, "errors", data, body)


def levels(cube: xr.Dataset) -> pd.DataFrame:
    """All variables, a row for each run, by the names of scene, solver, setting and outcome."""
    frame = cube.to_dataframe(dim_order=["scene", "solver", "level"]).reset_index()
    frame = frame[frame.outcome.notna()]
    words = [OUTCOMES[int(code)] for code in frame.outcome]
    keys = ["scene", "solver", "setting_name", "setting", "outcome"]
    return frame.assign(outcome=words).set_index(keys)


def outcomes_text(place: xr.Dataset) -> str:
    """Return in words the outcome of every level at one scene and solver."""
    stated: dict[str, list[str]] = {}
    for level in np.flatnonzero(place.outcome.notnull()):
        one = place.isel(level=level)
        stated.setdefault(_outcome_text(one), []).append(short(float(one.setting)))
    if len(stated) == 1:
        return next(iter(stated))
    return "; ".join(f"{', '.join(settings)}: {text}" for text, settings in stated.items())


def _outcome_text(one: xr.Dataset) -> str:
    outcome = OUTCOMES[int(one.outcome)]
    if outcome == "left_box":
        return f"beyond a wall by {float(one.penetration):.2g}"
    if outcome in ("good", "missed"):
        return outcome.replace("missed", "events missed")
    return f"{outcome} at t = {float(one.reached):.6g}"


def _errors_row(place: xr.Dataset) -> dict[str, str]:
    good = np.flatnonzero(place.outcome == GOOD)
    row = {"solver": str(place.label.item())} | dict.fromkeys(["setting", *_HEADS.values()], "–")
    if good.size:
        one = place.isel(level=good[-1])
        row["setting"] = f"{label_of(place.setting_name.item())} {short(float(one.setting))}"
        for name, head in _HEADS.items():
            row[head] = short(float(one[name]))
    return row | {"outcome": outcomes_text(place)}
