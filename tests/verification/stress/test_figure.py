"""The figure of the stress study: every law and regime, with the number that it stands for."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from figures.drawing import assert_same_files
from matplotlib.backends.backend_agg import FigureCanvasAgg

from damper.figures.common.style import style
from damper.verification.stress.box import corners, part
from damper.verification.stress.cube import gather_checks
from damper.verification.stress.figures.stress import draw
from damper.verification.stress.laws import LAW_VARIABLES, LIMIT, RUN_VARIABLES
from damper.verification.stress.parts import write_part
from damper.verification.stress.tables.stress import GRADED, regimes

RUNS = corners(
    {
        "mass_ratio": [1e-9, 0.3],
        "damping_ratio": [0.0, 0.1, 1e6],
        "frequency_ratio": [1.0],
        "clearance": [1e-9, 1.0],
        "restitution": [0.0, 0.5],
    }
)


@pytest.fixture(scope="module")
def cube(tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    count = len(RUNS)
    values = np.geomspace(1e-17, 1e-13, count)
    arrays = {variable.name: values.copy() for variable in LAW_VARIABLES}
    arrays |= {name: np.zeros(count) for name in ("backwards", "not_finite")}
    arrays |= {variable.name: np.zeros(count, dtype=variable.dtype) for variable in RUN_VARIABLES}
    arrays["touch"][:] = np.nan
    arrays["energy"][-1] = 5e-12
    arrays["status"][:3] = 1
    path = tmp_path_factory.mktemp("part") / "0.npz"
    write_part(path, part(RUNS, 0, 1), arrays)
    return gather_checks({"corner": [path]}, {"title": "Made-up runs"})


def drawn(cube: xr.Dataset):
    with style():
        figure = draw(cube)
        FigureCanvasAgg(figure).draw()
    return figure


def test_distributions_are_those_of_the_runs(cube: xr.Dataset) -> None:
    upper = drawn(cube).axes[0]
    lines = {line.get_label(): line for line in upper.lines}
    assert "gap at impact" not in lines
    x, y = lines["momentum"].get_data()
    values = cube.momentum.values
    for place, share in zip(x, y, strict=True):
        assert share == pytest.approx((values >= place * (1.0 - 1e-9)).mean())
    assert lines["energy"].get_xdata().max() == pytest.approx(5e-12)
    assert [line for line in upper.lines if list(line.get_xdata()) == [LIMIT, LIMIT]]


def test_matrix_shows_the_worst_of_each_regime(cube: xr.Dataset) -> None:
    lower = drawn(cube).axes[1]
    rows = regimes(cube)
    texts = {text.get_position(): text for text in lower.texts}
    assert len(texts) == len(rows) * len(GRADED)
    for number, row in enumerate(rows):
        for column, law in enumerate(GRADED):
            text = texts[column, number]
            if np.isnan(row.worst[law]):
                assert text.get_text() == "\N{EN DASH}"
                continue
            mantissa, exponent = f"{row.worst[law]:.0e}".split("e")
            assert text.get_text() == rf"${mantissa}\times 10^{{{int(exponent)}}}$"
            beyond = law == "energy" and row.worst[law] == 5e-12
            assert (text.get_color() == "white") == beyond
    labels = [label.get_text() for label in lower.get_yticklabels()]
    assert labels[0] == f"all ({len(RUNS)}, 3)"


def test_files_are_the_same_twice_and_small(cube: xr.Dataset, tmp_path: Path) -> None:
    assert_same_files(lambda: draw(cube), tmp_path)
