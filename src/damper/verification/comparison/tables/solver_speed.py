"""How long each solver takes for a wanted error."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from damper.analysis.labels import capital, short, time_text
from damper.parameters.lazy import pd, xr
from damper.study.study_file import ProductBase
from damper.tables import Table
from damper.verification.comparison import best
from damper.verification.comparison.tables.solver_errors import levels
from damper.verification.timing import machine_text

#: What is compared: of the run as a whole, and not of its end, where most motions settle.
ERROR = "impact_time_error"
#: Values of it for which the time is stated.
TARGETS = (1e-3, 1e-6, 1e-9, 1e-12)


class SolverSpeed(ProductBase):
    """The time that each solver takes to reach a given error, beside the engine's."""

    reads: ClassVar[tuple[str, ...]] = best.FILES


def make(results: Mapping[str, Any], settings: SolverSpeed) -> Table:
    """Make the table of how long each solver takes for a wanted error."""
    errors, timings = results["cube"], results["timings"]
    cube = errors.assign(run_time=timings.run_time)
    cube["time_per_impact"] = cube.run_time / cube.reference_impacts
    body: list[str | pd.DataFrame] = [
        "Run time of the cheapest good level whose error of impact times is no larger than the "
        "column's, and in brackets how many times that of the exact engine for the same error it "
        "is.",
        f"Machine: {machine_text(timings.attrs)}.",
    ]
    found = {_power(t): best.time_to_reach(errors, timings, ERROR, t) for t in TARGETS}
    for scene in errors.scene.values:
        rows = []
        for solver in errors.solver.values:
            at = {"scene": scene, "solver": solver}
            cells = {head: _time_and_ratio(times, at) for head, times in found.items()}
            label = str(errors.label.sel(solver=solver).item())
            rows.append({"solver": label} | cells)
        body += [f"## {_title(errors, scene)}", pd.DataFrame(rows)]
    columns = [ERROR, "state_error", "run_time", "time_per_impact"]
    return Table.of(errors, "run times", levels(cube)[columns].reset_index(), body)


def _title(errors: xr.Dataset, scene: str) -> str:
    return capital(str(errors.title.sel(scene=scene).item()))


def _power(value: float) -> str:
    return f"{value:.0e}".replace("e-0", "e-")


def _time_and_ratio(times: xr.DataArray, at: dict[str, Any]) -> str:
    time, ratio = float(times.sel(at)), float(best.relative_to_base(times).sel(at))
    if np.isnan(time):
        return "not reached"
    alone = np.isnan(ratio) or at["solver"] == best.BASE
    return time_text(time) + ("" if alone else f" (×{short(ratio)})")
