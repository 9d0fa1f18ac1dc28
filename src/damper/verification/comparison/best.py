"""How exact each solver becomes, and how long it takes to be so exact."""

from __future__ import annotations

from damper.parameters.lazy import xr
from damper.verification.comparison.errors import GOOD

#: Files of a study with errors and timings.
FILES = ("cube.nc", "timed/timings.nc")
#: The solver that others are measured by.
BASE = "exact"


def best_error(errors: xr.Dataset, name: str) -> xr.DataArray:
    """Smallest error `name` over the levels of good runs, by scene and solver; NaN for none."""
    return errors[name].where(errors.outcome == GOOD).min("level")


def time_to_reach(
    errors: xr.Dataset, timings: xr.Dataset, name: str, target: float
) -> xr.DataArray:
    """Run time in s of the cheapest good run whose error `name` is at most `target`; NaN for none.

    The result is over scene and solver.
    """
    reached = (errors.outcome == GOOD) & (errors[name] <= target)
    return timings.run_time.where(reached).min("level")


def relative_to_base(times: xr.DataArray) -> xr.DataArray:
    """Times over those of the exact engine; NaN where either is missing."""
    if BASE not in times.solver.values:
        return times * float("nan")
    return times / times.sel(solver=BASE, drop=True)
