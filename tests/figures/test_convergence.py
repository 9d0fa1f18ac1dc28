"""The convergence figure and table: distances to a rigid run, and their order."""

from typing import Any

import numpy as np
import pytest
import xarray as xr
from figures.drawing import assert_nothing_overlaps, drawn

from damper import simulate
from damper.analysis.convergence import distance_to_rigid
from damper.tables import make

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


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    return simulate(
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
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels[:2] == ["releases at zero force", "holds until the gap reopens"]
    assert_nothing_overlaps(figure)


def test_table(cube: xr.Dataset) -> None:
    table = make("convergence", {"cube": cube}, **SETTINGS)
    assert len(table.data) == len(VARIABLES) * 2 * 5
    markdown = table.markdown()
    assert markdown.startswith("# Impact damper simulation: distance to the rigid damper\n")
    assert "| max approach speed | 0 |" in markdown
