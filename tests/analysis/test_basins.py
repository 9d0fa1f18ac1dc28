"""Fractions of starts by the motion they end in, with their limits."""

import numpy as np
import pytest
import xarray as xr

from damper.analysis.basins import basin_fractions, wilson_limits
from damper.observers.motion import ObservedMotion
from damper.tables.basins import Basins, make


@pytest.mark.parametrize(("count", "of"), [(0, 7), (3, 7), (7, 7), (120, 25_600)])
@pytest.mark.parametrize("confidence", [0.5, 0.95])
def test_limits_are_wilsons(count: int, of: int, confidence: float) -> None:
    # It takes a second to import: not while tests are collected.
    from scipy.stats import binomtest

    known = binomtest(count, of).proportion_ci(confidence, method="wilson")
    assert wilson_limits(count, of, confidence) == pytest.approx((known.low, known.high), abs=1e-14)


def test_each_motion_at_each_value_of_an_axis() -> None:
    """A run that stopped does not count."""
    period = np.array([[1.0, 1.0, 2.0, np.nan], [2.0, 2.0, 2.0, 2.0]])
    dims = ("clearance", "initial_velocity")
    names = [variable.name for variable in ObservedMotion.variables]
    cube = xr.Dataset(
        {name: (dims, np.where(np.isnan(period), np.nan, 1.0)) for name in names}
        | {"motion_period": (dims, period), "status": (dims, np.zeros_like(period))},
        coords={"clearance": [0.5, 1.0], "initial_velocity": np.arange(4.0)},
    )
    found = basin_fractions(cube, "clearance")
    assert found.clearance.tolist() == [0.5, 0.5, 1.0, 1.0]
    assert found.starts.tolist() == [1, 2, 4, 0]
    assert found.of.tolist() == [3, 3, 4, 4]
    assert basin_fractions(cube).fraction.tolist() == [5 / 7, 2 / 7]
    with pytest.raises(ValueError, match="of each mass: choose one"):
        basin_fractions(xr.concat([cube, cube], "body"))
    table = make({"cube": cube}, Basins.model_construct(along="clearance", confidence=0.9))
    assert "90% confidence" in str(table.body)
