"""How long each solver takes for a wanted error."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from damper.analysis.labels import capital, short, time_text
from damper.parameters.lazy import pd, xr
from damper.study.study_file import ProductBase
from damper.tables import Table
from damper.verification.comparison import GOOD
from damper.verification.comparison.tables.solver_errors import levels
from damper.verification.timing import machine_text

#: What is compared: of the run as a whole, and not of its end, where most motions settle.
ERROR = "impact_time_error"
#: Values of it for which the time is stated.
TARGETS = (1e-3, 1e-6, 1e-9, 1e-12)
#: The solver that others are measured by.
BASE = "exact"


class SolverSpeed(ProductBase):
    """The time that each solver takes to reach a given error, beside the engine's."""

    reads: ClassVar[tuple[str, ...]] = ("cube.nc", "timed/timings.nc")


def make(results: Mapping[str, Any], settings: SolverSpeed) -> Table:
    """Make the table of how long each solver takes for a wanted error."""
    cube = results["cube"].assign(run_time=results["timings"].run_time)
    cube["time_per_impact"] = cube.run_time / cube.reference_impacts
    body: list[str | pd.DataFrame] = [
        "Run time of the cheapest good level whose error of impact times is no larger than the "
        "column's, and in brackets how many times that of the exact engine for the same error it "
        "is.",
        f"Machine: {machine_text(results['timings'].attrs)}.",
    ]
    for scene in cube.scene.values:
        here = cube.sel(scene=scene)
        rows = {head: times_to_reach(here, ERROR, target) for head, target in _heads().items()}
        table = pd.DataFrame({head: _cells(times) for head, times in rows.items()})
        table.insert(0, "solver", here.label.values)
        body += [f"## {capital(str(here.title.item()))}", table]
    columns = [ERROR, "state_error", "run_time", "time_per_impact"]
    return Table.of(cube, "run times", levels(cube)[columns].reset_index(), body)


def times_to_reach(place: xr.Dataset, error: str, target: float) -> xr.DataArray:
    """Time in s of each solver's cheapest good run with at most this error; NaN for none."""
    reached = (place.outcome == GOOD) & (place[error] <= target)
    return place.run_time.where(reached).min("level")


def _heads() -> dict[str, float]:
    return {f"{target:.0e}".replace("e-0", "e-"): target for target in TARGETS}


def _cells(times: xr.DataArray) -> list[str]:
    """Time of each solver, and over the engine's where both are known."""
    known = dict(zip(times.solver.values.tolist(), times.values.tolist(), strict=True))
    base = known.get(BASE, np.nan)
    return [
        "not reached"
        if np.isnan(time)
        else time_text(time)
        + ("" if np.isnan(base) or name == BASE else f" (×{short(time / base)})")
        for name, time in known.items()
    ]
