"""How long each solver takes for a wanted error, and what its first use costs."""

from __future__ import annotations

import csv
import io
import math
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from damper.tables import markdown_table
from damper.verification.base import Made
from damper.verification.comparison.best import (
    BASE,
    FILES,
    GOOD_RUN,
    LONGER,
    PEERS,
    check_same_runs,
    relative_to_base,
    time_to_reach,
)
from damper.verification.comparison.errors import VERDICTS
from damper.verification.comparison.tables.solver_errors import capital, number, places, short
from damper.verification.timing import machine_text

if TYPE_CHECKING:
    import xarray as xr

#: Errors for which the time is stated.
TARGETS = (1e-3, 1e-6, 1e-9, 1e-12)
#: And for which the engine is compared with RK4.
TARGETS_OF_PEERS = (1e-4, 1e-6, 1e-9, 1e-12)
#: And of what.
WANTED = ("impact_time_error", "state_error")


class SolverSpeed(Made):
    """The time that each solver takes to reach a given error, beside the engine's."""

    reads: ClassVar[tuple[str, ...]] = FILES


def make(errors: xr.Dataset, timings: xr.Dataset) -> tuple[str, str]:
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


def _times_csv(errors: xr.Dataset, timings: xr.Dataset) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(
        [
            *("scene", "solver", "setting_name", "setting", "verdict", *WANTED),
            *("run_time", "run_time_low", "run_time_high", "repeats"),
            *("time_per_impact", "time_per_period", "import_time", "warm_up_time"),
            *("call_time", "stretch_time", "stretch_impacts"),
        ]
    )
    for scene, solver, place in places(errors):
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
                *(time.call_time, time.stretch_time, time.stretch_impacts),
            ]
            writer.writerow(
                [
                    *(scene, solver, str(one.setting_name.item()), f"{float(one.setting):g}"),
                    VERDICTS[int(one.verdict)],
                    *(number(float(value), 4) for value in numbers),
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
        f"Machine: {machine_text(timings.attrs)}.",
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
            lines += ["", f"### {capital(str(errors.title.sel(scene=scene).item()))}", ""]
            lines += markdown_table([*heads, "per impact", "per period"], rows)
    lines += _peers_lines(errors, timings)
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


def _peers_lines(errors: xr.Dataset, timings: xr.Dataset) -> list[str]:
    """The engine beside RK4 with located impacts: per call, and per impact in long runs."""
    if not set(PEERS) <= set(errors.solver.values.tolist()):
        return []
    engine, peer = PEERS
    lines = [
        "",
        "## Exact engine and compiled RK4 with located impacts",
        "",
        "How many times the engine's time RK4 takes, each at its cheapest good level whose error "
        "of impact times is no larger than the column's. Per call: the scene alone, with the fixed "
        "cost of a Python call, which is most of the engine's time here. Per impact: without that "
        f"cost, in runs {LONGER} times as long.",
        "",
    ]
    ratios = [
        [
            relative_to_base(time_to_reach(errors, timings, "impact_time_error", target, time)).sel(
                solver=peer
            )
            for time in ("run_time", "stretch_time")
        ]
        for target in TARGETS_OF_PEERS
    ]
    calls = timings.call_time.median("level")
    impacts = (timings.stretch_time / timings.stretch_impacts).median("level")
    rows = []
    for scene in errors.scene.values.tolist():
        here = errors.sel(scene=scene)
        if (here.verdict.sel(solver=peer) < 0).all():
            continue
        found = [
            calls.sel(scene=scene, solver=engine),
            calls.sel(scene=scene, solver=peer),
            impacts.sel(scene=scene, solver=engine),
        ]
        pairs = [[float(ratio.sel(scene=scene)) for ratio in pair] for pair in ratios]
        rows.append(
            [
                capital(str(here.title.item())),
                *(_time_text(float(value)) for value in found),
                *("–" if math.isnan(sum(pair)) else "; ".join(map(short, pair)) for pair in pairs),
            ]
        )
    targets = [f"{target:.0e}".replace("e-0", "e-") for target in TARGETS_OF_PEERS]
    heads = ["scene", "a call: engine", "RK4", "an impact: engine"]
    heads += [f"{target}: per call; per impact" for target in targets]
    return lines + markdown_table(heads, rows)


def _rates(place: xr.Dataset, times: xr.Dataset) -> list[str]:
    good = np.flatnonzero(place.verdict.values == GOOD_RUN)
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
    alone = math.isnan(ratio) or solver == BASE
    return _time_text(time) + ("" if alone else f" (×{short(ratio)})")


def _time_text(seconds: float) -> str:
    if math.isnan(seconds):
        return "–"
    seconds = float(f"{seconds:.2g}")  # 999.9 µs are 1 ms
    for size, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs")):
        if seconds >= size:
            return f"{short(seconds / size)} {unit}"
    return f"{short(seconds * 1e9)} ns"
