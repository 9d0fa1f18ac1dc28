"""Convergence of a compliant contact: distances to a rigid run, their order, drawn and tabled."""

import math

import numpy as np
import pytest
import xarray as xr
from scenes import QUIET as POINT

from damper import Parameters, events, simulate
from damper.analysis.convergence import distance_to_rigid, order_of_convergence

STIFFNESS = "contact_stiffness_ratio"
GRID = [1e4, 1e5, 1e6, 1e7, 1e8]


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    return simulate(
        **POINT,
        contact_stiffness_ratio=GRID,
        contact_tension=[0, 1],
        transient=0,
        periods=1,
        observers={
            "stroboscopic_section": {"when": 0.75},
            "impacts": None,
            "bursts": {"threshold": 0.05, "records": 2},
        },
    )


def test_rigid_values_are_those_of_the_rigid_damper(cube: xr.Dataset) -> None:
    names = ["burst_onset", "displacement", "max_approach_speed"]
    found = distance_to_rigid(cube, names, STIFFNESS)
    assert found["variable"].tolist() == [name for name in names for _ in range(10)]
    assert found["contact_tension"].tolist() == 3 * [*[0.0] * 5, *[1.0] * 5]
    assert found[STIFFNESS].tolist() == 6 * GRID
    displacement = cube.displacement.transpose("contact_tension", ...).values.ravel()
    np.testing.assert_array_equal(found["value"][10:20], displacement)
    np.testing.assert_array_equal(found["distance"], abs(found["value"] - found["rigid_value"]))
    rigid = events(Parameters(**POINT), until=31.4)
    impacts = rigid[rigid["kind"] == 0]
    one = simulate(
        **POINT, transient=0, periods=1, observers={"stroboscopic_section": {"when": 0.75}}
    )
    assert found.groupby("variable")["rigid_value"].unique().str[0].to_dict() == {
        "burst_onset": impacts["time"][0],
        "displacement": float(one.displacement[0]),
        "max_approach_speed": impacts["approach_speed"].max(),
    }


def test_order_is_that_of_a_power_law() -> None:
    k = np.geomspace(1e2, 1e10, 9)
    far = 3.0 * k**-0.7
    far[:4] = 7.0  # the soft half does not count
    assert order_of_convergence(k, far) == pytest.approx(-0.7)
    far[-1] = math.nan
    assert order_of_convergence(k, far) == pytest.approx(-0.7)
    assert math.isnan(order_of_convergence(k, np.zeros(9)))


def test_other_axes_and_unknown_variables_are_refused(cube: xr.Dataset) -> None:
    with pytest.raises(ValueError, match="axis 'clearance': only the contact may vary"):
        distance_to_rigid(cube.expand_dims(clearance=[0.2]), ["max_approach_speed"], STIFFNESS)
    with pytest.raises(ValueError, match="unknown variable 'nonsense': must be one of"):
        distance_to_rigid(cube, ["nonsense"], STIFFNESS)
