"""Tables of the comparison of solvers: errors, orders, outcomes; and times for a wanted error."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from damper.tables import markdown_table
from damper.verification.comparison.best import (
    BASE,
    GOOD,
    check_same_runs,
    relative_to_base,
    time_to_reach,
)
from damper.verification.comparison.cube import ERRORS
from damper.verification.comparison.errors import MEASURES, MISSES, VERDICTS

if TYPE_CHECKING:
    import xarray as xr

#: Errors for which the time is told.
TARGETS = (1e-3, 1e-6, 1e-9, 1e-12)
#: And of what.
WANTED = ("impact_time_error", "state_error")

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


def errors_table(errors: xr.Dataset) -> tuple[str, str]:
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


def times_table(errors: xr.Dataset, timings: xr.Dataset) -> tuple[str, str]:
    """Write how long each solver takes for a wanted error, and what its first use costs.

    Parameters
    ----------
    errors, timings : xarray.Dataset
        Of the same scenes, solvers and settings.

    Returns
    -------
    csv, markdown : str

    Raises
    ------
    ValueError
        When the two are not of the same runs.
    """
    check_same_runs(errors, timings)
    return _times_csv(errors, timings), _times_markdown(errors, timings)


def outcomes_text(place: xr.Dataset) -> str:
    """Tell in words what became of every level at one scene and solver.

    Parameters
    ----------
    place : xarray.Dataset
        With the dimension ``level`` alone.

    Returns
    -------
    str
    """
    told: list[tuple[str, list[str]]] = []
    for level in range(place.sizes["level"]):
        one = place.isel(level=level)
        if int(one.verdict) < 0:
            continue
        text = _outcome_text(one)
        if told and told[-1][0] == text:
            told[-1][1].append(_short(float(one.setting)))
        else:
            told.append((text, [_short(float(one.setting))]))
    if not told:
        return "another model"
    if len(told) == 1:
        return told[0][0]
    return "; ".join(f"{', '.join(settings)}: {text}" for text, settings in told)


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


def _places(cube: xr.Dataset) -> Iterator[tuple[str, str, xr.Dataset]]:
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
    for scene, solver, place in _places(errors):
        for level in range(place.sizes["level"]):
            one = place.isel(level=level)
            if int(one.verdict) < 0:
                continue
            numbers = [one.reached, *(one[name] for name in MEASURES)]
            writer.writerow(
                [
                    *(scene, solver, str(one.setting_name.item()), f"{float(one.setting):g}"),
                    VERDICTS[int(one.verdict)],
                    *(_number(float(value), 6) for value in numbers),
                    *(_number(float(place[name]), 4) for name in orders),
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
            f"## {_capital(str(here.title.item()))}",
            "",
            f"Until t = {float(here.until):g}, {float(here.periods):.3g} forcing periods; "
            f"{int(here.reference_impacts)} impacts count; a small change of the start has grown "
            f"by {float(here.sensitivity):.2g} at the end.",
            "",
        ]
        rows = []
        for solver in errors.solver.values.tolist():
            place = here.sel(solver=solver)
            good = np.flatnonzero(place.verdict.values == GOOD)
            row = [str(place.label.item())]
            if good.size:
                one = place.isel(level=int(good[-1]))
                row.append(f"{_words(place.setting_name.item())} {_short(float(one.setting))}")
                for name in _HEADS:
                    value, order = float(one[name]), float(place[f"order_{name}"])
                    row.append(_dash(value) + (f" ({order:.2f})" if math.isfinite(order) else ""))
            else:
                row += ["–"] * (1 + len(_HEADS))
            rows.append([*row, outcomes_text(place)])
        lines += markdown_table(heads, rows)
    return "\n".join(lines) + "\n"


def _times_csv(errors: xr.Dataset, timings: xr.Dataset) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(
        [
            *("scene", "solver", "setting_name", "setting", "verdict", *WANTED),
            *("run_time", "run_time_low", "run_time_high", "repeats"),
            *("time_per_impact", "time_per_period", "import_time", "warm_up_time"),
        ]
    )
    for scene, solver, place in _places(errors):
        times = timings.sel(scene=scene, solver=solver)
        for level in range(place.sizes["level"]):
            one, time = place.isel(level=level), times.isel(level=level)
            if int(one.verdict) < 0:
                continue
            numbers = [
                *(one[name] for name in WANTED),
                *(time.run_time, time.run_time_low, time.run_time_high, time.repeats),
                *(_per_impact(one, time), time.run_time / one.periods),
                *(times.import_time, times.warm_up_time),
            ]
            writer.writerow(
                [
                    *(scene, solver, str(one.setting_name.item()), f"{float(one.setting):g}"),
                    VERDICTS[int(one.verdict)],
                    *(_number(float(value), 4) for value in numbers),
                ]
            )
    return text.getvalue()


def _times_markdown(errors: xr.Dataset, timings: xr.Dataset) -> str:
    lines = [
        f"# {errors.attrs.get('title', 'Comparison of solvers')}: run times",
        "",
        "Run time of the cheapest good level whose error is no larger than the column's, and in "
        "brackets how many times that of the exact engine for the same error it is. Times per "
        "impact and per forcing period are those of the finest good level. Import and warm-up are "
        "in none of these; see the last table.",
        "",
        f"Machine: {', '.join(_machine(timings))}.",
    ]
    for name in WANTED:
        lines += ["", f"## Error of {'impact times' if name == WANTED[0] else 'the end state'}"]
        found = [time_to_reach(errors, timings, name, target) for target in TARGETS]
        ratios = [relative_to_base(times) for times in found]
        for scene in errors.scene.values.tolist():
            rows = []
            for solver in errors.solver.values.tolist():
                at = {"scene": scene, "solver": solver}
                place, times = errors.sel(at), timings.sel(at)
                if (place.verdict < 0).all():
                    continue
                cells = [
                    _time_and_ratio(float(time.sel(at)), float(ratio.sel(at)), solver)
                    for time, ratio in zip(found, ratios, strict=True)
                ]
                rows.append([str(place.label.item()), *cells, *_rates(place, times)])
            heads = ["solver", *(f"{target:.0e}".replace("e-0", "e-") for target in TARGETS)]
            lines += ["", f"### {_capital(str(errors.title.sel(scene=scene).item()))}", ""]
            lines += markdown_table([*heads, "per impact", "per period"], rows)
    lines += ["", "## First use", ""]
    rows = [
        [
            str(timings.label.sel(solver=solver).item()),
            _time_text(float(timings.import_time.sel(solver=solver))),
            _time_text(float(timings.warm_up_time.sel(solver=solver))),
        ]
        for solver in timings.solver.values.tolist()
    ]
    lines += markdown_table(["solver", "import", "warm-up"], rows)
    return "\n".join(lines) + "\n"


def _rates(place: xr.Dataset, times: xr.Dataset) -> list[str]:
    good = np.flatnonzero(place.verdict.values == GOOD)
    if not good.size:
        return ["–", "–"]
    one, time = place.isel(level=int(good[-1])), times.isel(level=int(good[-1]))
    return [
        _time_text(_per_impact(one, time)),
        _time_text(float(time.run_time) / float(one.periods)),
    ]


def _per_impact(one: xr.Dataset, time: xr.Dataset) -> float:
    impacts = int(one.reference_impacts)
    return float(time.run_time) / impacts if impacts else math.nan


def _time_and_ratio(time: float, ratio: float, solver: str) -> str:
    if math.isnan(time):
        return "not reached"
    told = math.isnan(ratio) or solver == BASE
    return _time_text(time) + ("" if told else f" (×{_short(ratio)})")


def _time_text(seconds: float) -> str:
    if math.isnan(seconds):
        return "–"
    seconds = float(f"{seconds:.2g}")  # 999.9 µs are 1 ms
    for size, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs")):
        if seconds >= size:
            return f"{_short(seconds / size)} {unit}"
    return f"{_short(seconds * 1e9)} ns"


def _machine(timings: xr.Dataset) -> Sequence[str]:
    names = ("processor", "cores", "system", "python", "numpy", "numba", "scipy")
    plain = {"processor": "", "system": ""}
    texts = []
    for name in names:
        if name in timings.attrs:
            value = str(timings.attrs[name])
            texts.append(
                f"{value} cores" if name == "cores" else f"{plain.get(name, name)} {value}"
            )
    return [text.strip() for text in texts]


def _short(value: float) -> str:
    """Two digits, without a power of ten from 0.01 to 100000."""
    if 1e-2 <= abs(value) < 1e5:
        rounded = float(f"{value:.2g}")
        return f"{rounded:.0f}" if rounded >= 10.0 else f"{rounded:g}"
    return f"{value:.2g}".replace("e-0", "e-").replace("e+0", "e").replace("e+", "e")


def _dash(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.1e}".replace("e-0", "e-").replace("e+0", "e")


def _number(value: float, digits: int) -> str:
    return "" if math.isnan(value) else f"{value:.{digits}g}"


def _words(name: str) -> str:
    return name.replace("_", " ")


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
