"""How long each solver takes for a wanted error, and what its first use costs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from damper.tables import Table
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
from damper.verification.comparison.tables.solver_errors import capital, levels, short
from damper.verification.timing import machine_text

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

#: Errors for which the time is stated.
TARGETS = (1e-3, 1e-6, 1e-9, 1e-12)
#: And for which the engine is compared with RK4.
TARGETS_OF_PEERS = (1e-4, 1e-6, 1e-9, 1e-12)
#: And of what.
WANTED = ("impact_time_error", "state_error")
TIMED = (
    *("run_time", "run_time_low", "run_time_high", "import_time", "warm_up_time"),
    *("call_time", "stretch_time", "stretch_impacts"),
)


class SolverSpeed(Made):
    """The time that each solver takes to reach a given error, beside the engine's."""

    reads: ClassVar[tuple[str, ...]] = FILES


def make(errors: xr.Dataset, timings: xr.Dataset) -> Table:
    """Make the table of how long each solver takes for a wanted error, and of its first use.

    Parameters
    ----------
    errors, timings : xarray.Dataset
        Of the same scenes, solvers and settings.

    Returns
    -------
    Table

    Raises
    ------
    ValueError
        When the two are not of the same runs.
    """
    import pandas as pd

    check_same_runs(errors, timings)
    rows = []
    for run, place, one in levels(errors):
        at = {name: place[name].item() for name in ("scene", "solver")}
        time = timings.sel(**at, level=one.level)
        rows.append(
            run
            | {name: float(one[name]) for name in WANTED}
            | {name: float(time[name]) for name in TIMED}
            | {
                "repeats": int(time.repeats),
                "time_per_impact": _per_impact(one, time),
                "time_per_period": float(time.run_time / one.periods),
            }
        )
    body: list[str | pd.DataFrame] = [
        "Run time of the cheapest good level whose error is no larger than the column's, and in "
        "brackets how many times that of the exact engine for the same error it is. Times per "
        "impact and per forcing period are those of the finest good level. Import and warm-up are "
        "in none of these; see the last table.",
        f"Machine: {machine_text(timings.attrs)}.",
    ]
    for name in WANTED:
        body.append(f"## Error of {'impact times' if name == WANTED[0] else 'the end state'}")
        found = [time_to_reach(errors, timings, name, target) for target in TARGETS]
        both = [(times, relative_to_base(times)) for times in found]
        for scene in errors.scene.values.tolist():
            here = errors.sel(scene=scene)
            known = here.solver.values[(here.verdict >= 0).any("level").values].tolist()
            rows_here = []
            for solver in known:
                at = {"scene": scene, "solver": solver}
                cells = {
                    _target(target): _time_and_ratio(float(t.sel(at)), float(r.sel(at)), solver)
                    for target, (t, r) in zip(TARGETS, both, strict=True)
                }
                rates = _rates(errors.sel(at), timings.sel(at))
                rows_here.append({"solver": _label(errors, solver)} | cells | rates)
            body += [f"### {capital(str(here.title.item()))}", pd.DataFrame(rows_here)]
    body += _peers(errors, timings)
    first = [
        {
            "solver": _label(timings, solver),
            "import": _time_text(float(timings.import_time.sel(solver=solver))),
            "warm-up": _time_text(float(timings.warm_up_time.sel(solver=solver))),
        }
        for solver in timings.solver.values.tolist()
    ]
    body += ["## First use", pd.DataFrame(first)]
    title = f"{errors.attrs.get('title', 'Comparison of solvers')}: run times"
    return Table(title, pd.DataFrame(rows), body)


def _peers(errors: xr.Dataset, timings: xr.Dataset) -> list[str | pd.DataFrame]:
    """The engine beside RK4 with located impacts: per call, and per impact in long runs."""
    import pandas as pd

    if not set(PEERS) <= set(errors.solver.values.tolist()):
        return []
    engine, peer = PEERS
    ratios = {
        target: [
            relative_to_base(time_to_reach(errors, timings, "impact_time_error", target, time)).sel(
                solver=peer
            )
            for time in ("run_time", "stretch_time")
        ]
        for target in TARGETS_OF_PEERS
    }
    calls = timings.call_time.median("level")
    impacts = (timings.stretch_time / timings.stretch_impacts).median("level")
    rows = []
    for scene in errors.scene.values.tolist():
        here = errors.sel(scene=scene)
        if here.verdict.sel(solver=peer).isnull().all():
            continue
        row = {
            "scene": capital(str(here.title.item())),
            "a call: engine": _time_text(float(calls.sel(scene=scene, solver=engine))),
            "RK4": _time_text(float(calls.sel(scene=scene, solver=peer))),
            "an impact: engine": _time_text(float(impacts.sel(scene=scene, solver=engine))),
        }
        for target, pair in ratios.items():
            values = [float(ratio.sel(scene=scene)) for ratio in pair]
            cell = "–" if math.isnan(sum(values)) else "; ".join(map(short, values))
            row[f"{_target(target)}: per call; per impact"] = cell
        rows.append(row)
    return [
        "## Exact engine and compiled RK4 with located impacts",
        "How many times the engine's time RK4 takes, each at its cheapest good level whose error "
        "of impact times is no larger than the column's. Per call: the scene alone, with the fixed "
        "cost of a Python call, which is most of the engine's time here. Per impact: without that "
        f"cost, in runs {LONGER} times as long.",
        pd.DataFrame(rows),
    ]


def _rates(place: xr.Dataset, times: xr.Dataset) -> dict[str, str]:
    good = np.flatnonzero(place.verdict.values == GOOD_RUN)
    if not good.size:
        return {"per impact": "–", "per period": "–"}
    one, time = place.isel(level=int(good[-1])), times.isel(level=int(good[-1]))
    return {
        "per impact": _time_text(_per_impact(one, time)),
        "per period": _time_text(float(time.run_time) / float(one.periods)),
    }


def _label(cube: xr.Dataset, solver: str) -> str:
    return str(cube.label.sel(solver=solver).item())


def _target(value: float) -> str:
    return f"{value:.0e}".replace("e-0", "e-")


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
