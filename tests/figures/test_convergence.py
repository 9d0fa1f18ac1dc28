"""The convergence figure and table: distances to a rigid run, and their order."""

import csv
import io
import math
from typing import Any

import numpy as np
import pytest
import xarray as xr
from figures.drawing import assert_nothing_overlaps, drawn

from damper import Parameters, events, simulate
from damper.tables import About
from damper.tables.convergence import make, order_of, rigid_values

POINT = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.2,
    "clearance": 0.25,
    "restitution": 0.3,
}
VARIABLES = ["burst_onset", "burst_accumulation_time", "displacement", "max_approach_speed"]
SETTINGS: dict[str, Any] = {
    "variables": VARIABLES,
    "along": "contact_stiffness_ratio",
    "lines": "contact_tension",
}
STUDY = """
observers:
  stroboscopic_section: {at: 0.75}
  impacts:
  bursts: {threshold: {fraction: 0.05, assumed: a guess}, records: 2}
"""


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    made = simulate(
        **POINT,
        contact_stiffness_ratio=[1e4, 1e5, 1e6, 1e7, 1e8],
        contact_tension=[0, 1],
        transient=0,
        periods=1,
        observers={
            "stroboscopic_section": {"at": 0.75},
            "impacts": None,
            "bursts": {"threshold": 0.05, "records": 2},
        },
    )
    made.attrs["study"] = STUDY
    return made


def test_rigid_values_are_those_of_the_rigid_damper(cube: xr.Dataset) -> None:
    found = rigid_values(cube, VARIABLES)
    rigid = events(Parameters(**POINT), until=31.4)
    impacts = rigid[rigid["kind"] == 0]
    assert found["burst_onset"] == impacts["time"][0]
    assert found["max_approach_speed"] == impacts["approach_speed"].max()
    one = simulate(
        **POINT, transient=0, periods=1, observers={"stroboscopic_section": {"at": 0.75}}
    )
    assert found["displacement"] == float(one.displacement[0])


def test_order_is_that_of_a_power_law() -> None:
    k = np.geomspace(1e2, 1e10, 9)
    far = 3.0 * k**-0.7
    far[:4] = 7.0  # the soft half does not count
    assert order_of(k, far) == pytest.approx(-0.7)
    far[-1] = math.nan
    assert order_of(k, far) == pytest.approx(-0.7)
    assert math.isnan(order_of(k, np.zeros(9)))


def test_figure(cube: xr.Dataset) -> None:
    figure = drawn("convergence", cube, **SETTINGS)
    rigid = rigid_values(cube, VARIABLES)
    for ax, name in zip(figure.axes, VARIABLES, strict=True):
        value = cube[name].isel(contact_tension=1)
        for dim, place in (("burst", 0), ("sample", -1)):
            value = value.isel({dim: place}) if dim in value.dims else value
        line = ax.lines[1]
        expected = np.abs(value.values - rigid[name])
        np.testing.assert_array_equal(line.get_ydata(), np.where(expected > 0, expected, np.nan))
        # The first impact from rest is the same, and the first burst not complete.
        seen = (expected > 0.0).any()
        assert ax.texts[0].get_text().startswith("slope" if seen else "no distance to show")
        assert seen == (not name.startswith("burst"))
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels[:2] == ["lets go at zero force", "holds until the gap reopens"]
    assert_nothing_overlaps(figure)


def test_table(cube: xr.Dataset) -> None:
    about = About("A study", POINT)
    text, markdown = make(cube, SETTINGS, about)
    rows = list(csv.DictReader(io.StringIO(text)))
    assert len(rows) == len(VARIABLES) * 2 * 5
    for row in rows:
        far = abs(float(row["value"]) - float(row["rigid_value"]))
        assert float(row["distance"]) == far or math.isnan(far)
    assert "| max approach speed | 0 |" in markdown
    assert "restitution = 0.3" in markdown


def test_other_axes_are_refused() -> None:
    made = simulate(
        **POINT | {"clearance": [0.2, 0.3]},
        contact_stiffness_ratio=[1e4, 1e5],
        transient=0,
        periods=1,
        observers=["impacts"],
    )
    with pytest.raises(ValueError, match="only the contact may vary"):
        rigid_values(made, ["max_approach_speed"])
    with pytest.raises(ValueError, match="no variable 'nonsense'"):
        rigid_values(made, ["nonsense"])
