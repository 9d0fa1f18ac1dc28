"""Errors, orders and outcomes of every solver on every scene."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from damper.tables import markdown_table
from damper.verification.base import Made
from damper.verification.comparison.best import GOOD_RUN
from damper.verification.comparison.cube import ERRORS
from damper.verification.comparison.errors import MEASURES, MISSES, VERDICTS

if TYPE_CHECKING:
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


def make(errors: xr.Dataset) -> tuple[str, str]:
    """Write errors, orders and outcomes of every scene, solver and level.

    Parameters
    ----------
    errors : xarray.Dataset
        See `damper.verification.comparison.cube.gather_errors`.

    Returns
    -------
    csv, markdown : str
        The CSV has a line for each level, with the order of the solver repeated; missing numbers
        are empty. The Markdown has a table for each scene: errors at the finest good level, and
        what became of every level.
    """
    return _errors_csv(errors), _errors_markdown(errors)


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
        if int(one.verdict) < 0:
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


def places(cube: xr.Dataset) -> Iterator[tuple[str, str, xr.Dataset]]:
    """Yield scene and solver with their part of a cube."""
    for scene in cube.scene.values.tolist():
        for solver in cube.solver.values.tolist():
            yield scene, solver, cube.sel(scene=scene, solver=solver)


def _errors_csv(errors: xr.Dataset) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    orders = [f"order_{name}" for name in ERRORS]
    writer.writerow(
        ["scene", "solver", "setting_name", "setting", "verdict", "reached", *MEASURES, *orders]
    )
    for scene, solver, place in places(errors):
        for level in range(place.sizes["level"]):
            one = place.isel(level=level)
            if int(one.verdict) < 0:
                continue
            numbers = [one.reached, *(one[name] for name in MEASURES)]
            writer.writerow(
                [
                    *(scene, solver, str(one.setting_name.item()), f"{float(one.setting):g}"),
                    VERDICTS[int(one.verdict)],
                    *(number(float(value), 6) for value in numbers),
                    *(number(float(place[name]), 4) for name in orders),
                ]
            )
    return text.getvalue()


def _errors_markdown(errors: xr.Dataset) -> str:
    lines = [
        f"# {errors.attrs.get('title', 'Comparison of solvers')}: errors",
        "",
        "Errors are those of the finest level that is good: finished, no event missed or too many, "
        "inside the box. In brackets the observed order: the power of the setting (of its inverse, "
        "if larger is finer) with which the error falls, over the good levels above rounding; none "
        "if these are fewer than three. What became of each level stands in the last column.",
    ]
    heads = ["solver", "setting", *_HEADS.values(), "outcome"]
    for scene in errors.scene.values.tolist():
        here = errors.sel(scene=scene)
        lines += [
            "",
            f"## {capital(str(here.title.item()))}",
            "",
            f"Until t = {float(here.until):g}, {float(here.periods):.3g} forcing periods; "
            f"{int(here.reference_impacts)} impacts count; a small change of the start has grown "
            f"by {float(here.sensitivity):.2g} at the end.",
            "",
        ]
        rows = []
        for solver in errors.solver.values.tolist():
            place = here.sel(solver=solver)
            good = np.flatnonzero(place.verdict.values == GOOD_RUN)
            row = [str(place.label.item())]
            if good.size:
                one = place.isel(level=int(good[-1]))
                row.append(f"{_words(place.setting_name.item())} {short(float(one.setting))}")
                for name in _HEADS:
                    value, order = float(one[name]), float(place[f"order_{name}"])
                    row.append(_dash(value) + (f" ({order:.2f})" if math.isfinite(order) else ""))
            else:
                row += ["–"] * (1 + len(_HEADS))
            rows.append([*row, outcomes_text(place)])
        lines += markdown_table(heads, rows)
    return "\n".join(lines) + "\n"


def short(value: float) -> str:
    """Two digits, without a power of ten from 0.01 to 100000."""
    if 1e-2 <= abs(value) < 1e5:
        rounded = float(f"{value:.2g}")
        return f"{rounded:.0f}" if rounded >= 10.0 else f"{rounded:g}"
    return f"{value:.2g}".replace("e-0", "e-").replace("e+0", "e").replace("e+", "e")


def _dash(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.1e}".replace("e-0", "e-").replace("e+0", "e")


def number(value: float, digits: int) -> str:
    """Write a number for the CSV; nothing for a missing one."""
    return "" if math.isnan(value) else f"{value:.{digits}g}"


def _words(name: str) -> str:
    return name.replace("_", " ")


def capital(text: str) -> str:
    """Return a text with a capital first letter."""
    return text[:1].upper() + text[1:]
