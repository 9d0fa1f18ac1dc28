"""The figure of lanes run in other ways: what it shows is what there is."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg

from damper.figures.common.style import save, style
from damper.verification.stress.box import random_lanes
from damper.verification.stress.figures.twins import draw, largest
from damper.verification.stress.parts import write_part
from damper.verification.stress.twins_cube import VARIABLES, gather_twins
from damper.verification.stress.verdicts import ALLOWANCE, EPS, FAILED, IDENTITIES, PASSED, SOUND

COUNT = 40


@pytest.fixture(scope="module")
def twins(tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    kinds = np.arange(COUNT) % 4
    growth = np.geomspace(1.0, 1e10, COUNT)
    arrays = {name: np.ones(COUNT) for name in VARIABLES}
    arrays |= {f"{name}_verdict": np.full(COUNT, PASSED, dtype="i1") for name in IDENTITIES}
    arrays |= {f"{name}_difference": EPS * growth for name in IDENTITIES}
    arrays["units_difference"] = 3.0 * EPS * growth
    # Of another accuracy: not what rounding does.
    arrays["looser_difference"] = np.full(COUNT, 0.1)
    for name in IDENTITIES:
        arrays[f"{name}_difference"][0] = np.nan
    arrays |= {"growth": growth, "condition": kinds.astype("i1")}
    arrays["backward_error"] = np.geomspace(0.5, 90.0, COUNT)
    arrays["backward_error"][5] = np.nan
    path = tmp_path_factory.mktemp("twins") / "0.npz"
    box = {"parameters": {"clearance": {"range": [0.1, 1.0]}}}
    write_part(path, random_lanes(COUNT, 1, box), arrays)
    return gather_twins([path], {"title": "Made-up twins"})


def drawn(twins: xr.Dataset):
    with style():
        figure = draw(twins)
        FigureCanvasAgg(figure).draw()
    return figure


def test_differences_are_shown_class_by_class(twins: xr.Dataset) -> None:
    left = drawn(twins).axes[0]
    clouds = [line for line in left.lines if line.get_linestyle() == "None"]
    assert len(clouds) == 4
    for kind, cloud in enumerate(clouds):
        chosen = (twins.condition.values == kind) & (np.arange(COUNT) > 0)
        np.testing.assert_array_equal(cloud.get_xdata(), twins.growth.values[chosen])
        np.testing.assert_array_equal(cloud.get_ydata(), twins.units_difference.values[chosen])
    ratios = {
        float(f"{y / x:.6g}")
        for line in left.lines
        if line.get_color() == "black"
        for x, y in zip(*line.get_data(), strict=True)
    }
    assert ratios == {float(f"{EPS:.6g}"), float(f"{ALLOWANCE * EPS:.6g}")}
    assert np.isnan(largest(twins)[0])


def test_errors_are_distributions_with_their_limit(twins: xr.Dataset) -> None:
    right = drawn(twins).axes[1]
    curves = [line for line in right.lines if line.get_drawstyle() == "steps-pre"]
    errors = twins.backward_error.values
    for kind, curve in enumerate(curves):
        values = errors[(twins.condition.values == kind) & ~np.isnan(errors)]
        for place, share in zip(*curve.get_data(), strict=True):
            assert share == pytest.approx((values >= place).mean())
        assert curve.get_xdata().max() == values.max()
    assert len(curves) == 4
    assert [line for line in right.lines if list(line.get_xdata()) == [SOUND, SOUND]]


def test_heading_counts_failures(twins: xr.Dataset) -> None:
    assert "none failed" in drawn(twins).get_suptitle()
    bad = twins.copy(deep=True)
    bad.units_verdict[3:5] = FAILED
    assert "2 failed" in drawn(bad).get_suptitle()


def test_no_lanes_are_said() -> None:
    figure = drawn(gather_twins([], {"title": "None"}))
    for ax in figure.axes:
        assert [text.get_text() for text in ax.texts] == ["no lanes were compared"]


def test_files_are_the_same_twice_and_small(twins: xr.Dataset, tmp_path: Path) -> None:
    for name in "ab":
        with style():
            figure = draw(twins)
            for end in ("svg", "png"):
                save(figure, tmp_path / f"{name}.{end}")
    for end in ("svg", "png"):
        a, b = ((tmp_path / f"{name}.{end}").read_bytes() for name in "ab")
        assert a == b
        assert len(a) < 2_000_000
