"""Errors of predicted accumulation over the rebound speed: points, laws, and the legend."""

import numpy as np
import pytest
import xarray as xr
from figures.drawing import drawn
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.lines import Line2D

import damper
from damper.analysis.accumulation import errors_of
from damper.figures.common.style import BLUE, ORANGE

POINT = {"mass_ratio": 0.2, "frequency_ratio": 0.25, "clearance": 0.03}
RUN = {"transient": 0, "periods": 5, "observers": {"accumulation": {"bursts": 6}}}


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    """Return complete bursts at two of three restitutions; 0.97 has none."""
    return damper.simulate(**POINT, damping_ratio=[0.01, 0.5], restitution=[0.6, 0.8, 0.97], **RUN)


AT = {"damping_ratio": 0.01}


def points(ax: Axes, colour: str) -> list[Line2D]:
    """Later and first impacts of one order."""
    return [
        line
        for line in ax.lines
        if line.get_marker() in ("o", "^") and to_hex(line.get_color()).upper() == colour
    ]


@pytest.mark.parametrize(("order", "colour"), [("first", ORANGE), ("second", BLUE)])
@pytest.mark.parametrize(("panel", "quantity"), [(0, "time"), (1, "displacement")])
def test_points_are_the_errors(
    cube: xr.Dataset, panel: int, quantity: str, order: str, colour: str
) -> None:
    figure = drawn("accumulation", cube, at=AT | {"restitution": 0.6})
    later, first = points(figure.axes[panel], colour)
    here = cube.sel(AT | {"restitution": 0.6})
    error = abs(here[f"{order}_order_{quantity}"] - here[f"remaining_{quantity}"])
    for line, expected, speed in (
        (first, error[:, 0], here.rebound_speed[:, 0]),
        (later, error[:, 1:], here.rebound_speed[:, 1:]),
    ):
        size, w = expected.values.ravel(), speed.values.ravel()
        kept = size > 0.0
        np.testing.assert_array_equal(line.get_xdata(), w[kept])
        np.testing.assert_array_equal(line.get_ydata(), size[kept])


def test_laws_have_the_slopes_two_and_three(cube: xr.Dataset) -> None:
    figure = drawn("accumulation", cube, rows="restitution", at=AT)
    for ax in figure.axes[:4]:
        laws = [line for line in ax.lines if line.get_marker() == "None"]
        slopes = [
            np.diff(np.log(line.get_ydata()))[0] / np.diff(np.log(line.get_xdata()))[0]
            for line in laws
        ]
        assert slopes == pytest.approx([2.0, 3.0])
        # Through the middle of the errors that the law is fitted to.
        name = "time" if "time" in ax.get_ylabel() else "displacement"
        restitution = 0.6 if ax in figure.axes[:2] else 0.8
        here = cube.sel(AT | {"restitution": restitution})
        for law, order in zip(laws, ("first", "second"), strict=True):
            found = errors_of(here, name, order)
            x, y = found.speed[found.asymptotic], np.abs(found.error[found.asymptotic])
            factor = law.get_ydata()[0] / law.get_xdata()[0] ** slopes[order == "second"]
            above = y > factor * x ** slopes[order == "second"]
            assert above.mean() == pytest.approx(0.5, abs=0.02)
