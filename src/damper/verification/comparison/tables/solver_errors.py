"""Errors, orders and outcomes of every solver on every scene."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from damper.tables import Table
from damper.verification.base import Made
from damper.verification.comparison.best import GOOD_RUN
from damper.verification.comparison.cube import ERRORS
from damper.verification.comparison.errors import MEASURES, MISSES, VERDICTS
from damper.verification.labels import label_of

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

_HEADS = {
    "impact_time_error": "impact times",
    "accumulation_error": "accumulation",
    "release_error": "release",
    "state_error": "end state",
    "penetration": "penetration",
    "energy_residual": "energy",
}
_COUNTS = {
    "missed_impacts": "missed {} impact",
    "extra_impacts": "{} impact too many",
    "missed_sticks": "missed {} start of sticking",
    "extra_sticks": "{} start of sticking too many",
    "missed_releases": "missed {} release",
}


class SolverErrors(Made):
    """Errors, orders and outcomes of every solver on every scene."""


def make(errors: xr.Dataset) -> Table:
    """Make the table of errors, orders and outcomes of every scene and solver.

    Parameters
    ----------
    errors : xarray.Dataset
        See `damper.verification.comparison.cube.gather_errors`.

    Returns
    -------
    Table
        The data have a row for each level, with the order of the solver repeated. The body has a
        table for each scene: errors at the finest good level, and the outcome of every level.
    """
    import pandas as pd

    orders = [f"order_{name}" for name in ERRORS]
    rows = [
        run
        | {name: float(one[name]) for name in ("reached", *MEASURES)}
        | {name: float(place[name]) for name in orders}
        for run, place, one in levels(errors)
    ]
    body: list[str | pd.DataFrame] = [
        "Errors are those of the finest level that is good: finished, no event missed or too many, "
        "inside the box. In brackets the observed order: the power of the setting (of its inverse, "
        "if larger is finer) with which the error falls, over the good levels above roundoff; none "
        "if these are fewer than three. The outcome of each level stands in the last column.",
    ]
    for scene in errors.scene.values.tolist():
        here = errors.sel(scene=scene)
        body += [
            f"## {capital(str(here.title.item()))}",
            f"Until t = {float(here.until):g}, {float(here.periods):.3g} forcing periods; "
            f"{int(here.reference_impacts)} impacts count; a small change of the start has grown "
            f"by {float(here.sensitivity):.2g} at the end.",
            pd.DataFrame(
                _errors_row(here.sel(solver=solver)) for solver in errors.solver.values.tolist()
            ),
        ]
    title = f"{errors.attrs.get('title', 'Comparison of solvers')}: errors"
    return Table(title, pd.DataFrame(rows), body)


def outcomes_text(place: xr.Dataset) -> str:
    """Return in words the outcome of every level at one scene and solver.

    Parameters
    ----------
    place : xarray.Dataset
        With the dimension ``level`` alone.

    Returns
    -------
    str
    """
    stated: list[tuple[str, list[str]]] = []
    for level in range(place.sizes["level"]):
        one = place.isel(level=level)
        if np.isnan(one.verdict):
            continue
        text = _outcome_text(one)
        if stated and stated[-1][0] == text:
            stated[-1][1].append(short(float(one.setting)))
        else:
            stated.append((text, [short(float(one.setting))]))
    if not stated:
        return "another model"
    if len(stated) == 1:
        return stated[0][0]
    return "; ".join(f"{', '.join(settings)}: {text}" for text, settings in stated)


def _outcome_text(one: xr.Dataset) -> str:
    verdict = VERDICTS[int(one.verdict)]
    if verdict == "good":
        return "good"
    misses = []
    for name in MISSES:
        count = int(one[name])
        if count:
            text = _COUNTS[name].format(count)
            noun = "impact", "start", "release"
            if count > 1:
                for word in noun:
                    text = text.replace(word, word + "s", 1)
            misses.append(text)
    if verdict == "left_box":
        return ", ".join([f"beyond a wall by {float(one.penetration):.2g}", *misses])
    if verdict == "missed":
        return ", ".join(misses)
    return ", ".join([f"{verdict} at t = {float(one.reached):.6g}", *misses])


def levels(cube: xr.Dataset) -> Iterator[tuple[dict[str, Any], xr.Dataset, xr.Dataset]]:
    """Yield the names of each run, what there is of its scene and solver, and of its level."""
    for scene in cube.scene.values.tolist():
        for solver in cube.solver.values.tolist():
            place = cube.sel(scene=scene, solver=solver)
            for level in np.flatnonzero(place.verdict.values >= 0).tolist():
                one = place.isel(level=level)
                yield (
                    {
                        "scene": scene,
                        "solver": solver,
                        "setting_name": str(one.setting_name.item()),
                        "setting": float(one.setting),
                        "verdict": VERDICTS[int(one.verdict)],
                    },
                    place,
                    one,
                )


def _errors_row(place: xr.Dataset) -> dict[str, str]:
    good = np.flatnonzero(place.verdict.values == GOOD_RUN)
    row = {"solver": str(place.label.item())} | dict.fromkeys(["setting", *_HEADS.values()], "–")
    if good.size:
        one = place.isel(level=int(good[-1]))
        row["setting"] = f"{label_of(place.setting_name.item())} {short(float(one.setting))}"
        for name, head in _HEADS.items():
            value, order = float(one[name]), float(place[f"order_{name}"])
            row[head] = _dash(value) + (f" ({order:.2f})" if math.isfinite(order) else "")
    return row | {"outcome": outcomes_text(place)}


def short(value: float) -> str:
    """Two digits, without a power of ten from 0.01 to 100000."""
    if 1e-2 <= abs(value) < 1e5:
        rounded = float(f"{value:.2g}")
        return f"{rounded:.0f}" if rounded >= 10.0 else f"{rounded:g}"
    return f"{value:.2g}".replace("e-0", "e-").replace("e+0", "e").replace("e+", "e")


def _dash(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.1e}".replace("e-0", "e-").replace("e+0", "e")


def capital(text: str) -> str:
    """Return a text with a capital first letter."""
    return text[:1].upper() + text[1:]
