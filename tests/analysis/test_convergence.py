"""Convergence of a compliant contact: distances to a rigid run, their order, drawn and tabled."""

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr
from figures.drawing import assert_nothing_overlaps, drawn, legend_texts
from scenes import QUIET as POINT

from damper import Parameters, events, simulate
from damper.analysis.convergence import distance_to_rigid, order_of_convergence
from damper.tables import make

STIFFNESS = "contact_stiffness_ratio"
GRID = [1e4, 1e5, 1e6, 1e7, 1e8]
VARIABLES = ["burst_onset", "burst_accumulation_time", "displacement", "max_approach_speed"]
SETTINGS: dict[str, Any] = {
    "variables": VARIABLES,
    "along": STIFFNESS,
    "lines": "contact_tension",
}


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    return simulate(
        **POINT,
        contact_stiffness_ratio=GRID,
        contact_tension=[0, 1],
        transient=0,
        periods=1,
        observers={
            "stroboscopic_section": {"at": 0.75},
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
        **POINT, transient=0, periods=1, observers={"stroboscopic_section": {"at": 0.75}}
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


def test_figure(cube: xr.Dataset) -> None:
    figure = drawn("convergence", cube, **SETTINGS)
    found = distance_to_rigid(cube, VARIABLES, "contact_stiffness_ratio")
    for ax, name in zip(figure.axes, VARIABLES, strict=True):
        rows = found[(found["variable"] == name) & (found["contact_tension"] == 1)]
        expected = rows["distance"].to_numpy()
        seen = np.where(expected > 0, expected, np.nan)
        np.testing.assert_array_equal(ax.lines[1].get_ydata(), seen)
        # The first impact from rest is the same, and the first burst not complete.
        seen = (expected > 0.0).any()
        assert ax.texts[0].get_text().startswith("slope" if seen else "no distance to show")
        assert seen == (not name.startswith("burst"))
    assert legend_texts(figure)[:2] == ["releases at zero force", "holds until the gap reopens"]
    assert_nothing_overlaps(figure)


def test_table(cube: xr.Dataset) -> None:
    table = make("convergence", {"cube": cube}, **SETTINGS)
    assert len(table.data) == len(VARIABLES) * 2 * 5
    markdown = table.markdown()
    assert markdown.startswith("# Impact damper simulation: distance to the rigid damper\n")
    assert "| max approach speed, F0/sqrt(K M) | 0 |" in markdown
