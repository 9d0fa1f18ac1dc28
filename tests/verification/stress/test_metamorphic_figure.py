"""The figure of the metamorphic tests: what it shows is what there is."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from figures.drawing import assert_same_files
from matplotlib.backends.backend_agg import FigureCanvasAgg

from damper.figures.common.style import style
from damper.verification.stress.box import random_points
from damper.verification.stress.figures.metamorphic import draw, largest
from damper.verification.stress.metamorphic_cube import METAMORPHIC_VARIABLES, gather_metamorphic
from damper.verification.stress.parts import write_part
from damper.verification.stress.verdicts import ALLOWANCE, EPS, FAILED, PASSED, RELATIONS, SOUND

COUNT = 40


@pytest.fixture(scope="module")
def cube(tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    kinds = np.arange(COUNT) % 4
    growth = np.geomspace(1.0, 1e10, COUNT)
    arrays = {name: np.ones(COUNT) for name in METAMORPHIC_VARIABLES}
    arrays |= {f"{name}_verdict": np.full(COUNT, PASSED, dtype="i1") for name in RELATIONS}
    arrays |= {f"{name}_difference": EPS * growth for name in RELATIONS}
    arrays["units_difference"] = 3.0 * EPS * growth
    # Of another accuracy: not what rounding does.
    arrays["looser_difference"] = np.full(COUNT, 0.1)
    for name in RELATIONS:
        arrays[f"{name}_difference"][0] = np.nan
    arrays |= {"growth": growth, "condition": kinds.astype("i1")}
    arrays["backward_error"] = np.geomspace(0.5, 90.0, COUNT)
    arrays["backward_error"][5] = np.nan
    path = tmp_path_factory.mktemp("metamorphic") / "0.npz"
    box = {"parameters": {"clearance": {"range": [0.1, 1.0]}}}
    write_part(path, random_points(COUNT, 1, box), arrays)
    return gather_metamorphic([path], {"title": "Made-up runs"})


def drawn(cube: xr.Dataset):
    with style():
        figure = draw(cube)
        FigureCanvasAgg(figure).draw()
    return figure


def test_differences_are_shown_class_by_class(cube: xr.Dataset) -> None:
    left = drawn(cube).axes[0]
    clouds = [line for line in left.lines if line.get_linestyle() == "None"]
    assert len(clouds) == 4
    for kind, cloud in enumerate(clouds):
        chosen = (cube.condition.values == kind) & (np.arange(COUNT) > 0)
        np.testing.assert_array_equal(cloud.get_xdata(), cube.growth.values[chosen])
        np.testing.assert_array_equal(cloud.get_ydata(), cube.units_difference.values[chosen])
    ratios = {
        float(f"{y / x:.6g}")
        for line in left.lines
        if line.get_color() == "black"
        for x, y in zip(*line.get_data(), strict=True)
    }
    assert ratios == {float(f"{EPS:.6g}"), float(f"{ALLOWANCE * EPS:.6g}")}
    assert np.isnan(largest(cube)[0])


def test_errors_are_distributions_with_their_limit(cube: xr.Dataset) -> None:
    right = drawn(cube).axes[1]
    curves = [line for line in right.lines if line.get_drawstyle() == "steps-pre"]
    errors = cube.backward_error.values
    for kind, curve in enumerate(curves):
        values = errors[(cube.condition.values == kind) & ~np.isnan(errors)]
        for place, share in zip(*curve.get_data(), strict=True):
            assert share == pytest.approx((values >= place).mean())
        assert curve.get_xdata().max() == values.max()
    assert len(curves) == 4
    assert [line for line in right.lines if list(line.get_xdata()) == [SOUND, SOUND]]


def test_heading_counts_failures(cube: xr.Dataset) -> None:
    assert "none failed" in drawn(cube).get_suptitle()
    bad = cube.copy(deep=True)
    bad.units_verdict[3:5] = FAILED
    assert "2 failed" in drawn(bad).get_suptitle()


def test_no_runs_are_said() -> None:
    figure = drawn(gather_metamorphic([], {"title": "None"}))
    for ax in figure.axes:
        assert [text.get_text() for text in ax.texts] == ["no runs were compared"]


def test_files_are_the_same_twice_and_small(cube: xr.Dataset, tmp_path: Path) -> None:
    assert_same_files(lambda: draw(cube), tmp_path)
