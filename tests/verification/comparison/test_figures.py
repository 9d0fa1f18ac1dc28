"""Work-precision diagrams and the summary, of solvers whose errors and times are known."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from figures.drawing import legend_texts
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from verification.comparison.fake_solvers import fake_cubes

from damper.figures.common.style import save, style
from damper.verification.comparison.errors import VERDICTS
from damper.verification.comparison.figures import solver_summary, work_precision
from damper.verification.comparison.marks import FAILURES, SHORT_LABELS, SOLVER_MARKS
from damper.verification.comparison.solvers import SOLVERS


@pytest.fixture(scope="module")
def cubes() -> Iterator[tuple[xr.Dataset, xr.Dataset]]:
    with pytest.MonkeyPatch.context() as patch:
        yield fake_cubes(patch)


def drawn(kind, cubes, **settings) -> Figure:
    with style():
        figure = kind.draw(*cubes, **settings)
        canvas = FigureCanvasAgg(figure)
        for _ in range(2):
            canvas.draw()
    return figure


def assert_apart(figure: Figure) -> None:
    """Panels with their labels, legend and heading lie within the page and apart."""
    renderer = figure.canvas.get_renderer()
    with style():
        boxes = [ax.get_tightbbox(renderer) for ax in figure.axes]
        texts = [text for text in (figure._suptitle, figure._supylabel) if text]
        boxes += [text.get_window_extent(renderer) for text in texts]
        boxes += [legend.get_window_extent(renderer) for legend in figure.legends]
    for k, box in enumerate(boxes):
        assert box.x0 >= -1
        assert box.y0 >= -1
        assert box.x1 <= figure.bbox.x1 + 1
        assert box.y1 <= figure.bbox.y1 + 1
        for other in boxes[k + 1 :]:
            across = min(box.x1, other.x1) - max(box.x0, other.x0)
            along = min(box.y1, other.y1) - max(box.y0, other.y0)
            assert min(across, along) <= 2


def lines_of(ax, solver: str) -> list:
    look = SOLVER_MARKS[solver]
    return [
        line
        for line in ax.lines
        if line.get_marker() == look["marker"] and to_hex(line.get_color()) == to_hex(look["color"])
    ]


# --- marks


def test_each_solver_and_failure_has_its_look() -> None:
    assert tuple(SOLVER_MARKS) == tuple(SHORT_LABELS) == tuple(SOLVERS)
    assert len({look["marker"] for look in SOLVER_MARKS.values()}) == len(SOLVERS)
    assert set(FAILURES) == set(VERDICTS) - {"good"}
    assert len({letter for _, letter in FAILURES.values()}) == len(FAILURES)


# --- work and precision


def test_good_runs_are_lines_and_failures_lie_in_runs(cubes) -> None:
    errors, timings = cubes
    figure = drawn(work_precision, cubes)
    hard, soft = figure.axes
    (line,) = lines_of(hard, "rk4_located")
    place = errors.sel(scene="hard", solver="rk4_located")
    np.testing.assert_array_equal(line.get_ydata(), place.state_error)
    times = timings.run_time.sel(scene="hard", solver="rk4_located")
    np.testing.assert_array_equal(line.get_xdata(), times)
    strips = dict(
        zip((t.get_text() for t in hard.get_yticklabels()), hard.get_yticks(), strict=True)
    )
    assert list(strips)[-5:] == ["events missed", "beyond a wall", "stalled", "capped", "failed"]
    for solver, strip, count in (
        ("radau", "events missed", 1),
        ("rk4_step_end", "beyond a wall", 2),
        ("lsoda", "stalled", 1),
        ("rk45", "capped", 1),
    ):
        good, failed = lines_of(hard, solver)
        assert failed.get_ydata().tolist() == [strips[strip]] * count
        assert failed.get_linestyle() == "None"
        assert np.isfinite(good.get_ydata()).sum() == (2 if solver == "rk45" else 0)
        assert 10.0 < strips[strip] < hard.get_ylim()[1]
    # An error of nothing is drawn on the floor.
    assert lines_of(hard, "exact")[0].get_ydata()[-1] == 1e-16
    assert lines_of(soft, "compliant_flow")[1].get_ydata().tolist() == [strips["failed"]]
    assert [ax.get_title() for ax in figure.axes] == ["Hard walls", "Compliant contact"]
    assert len(legend_texts(figure)) == 7
    assert_apart(figure)


def test_one_scene_fits_a_column(cubes) -> None:
    figure = drawn(work_precision, cubes, scenes=("soft",), error="impact_time_error")
    (ax,) = figure.axes
    assert figure.get_figwidth() == 3.5
    assert ax.get_title() == "Compliant contact"
    # Solvers that have no such model are not in the legend, nor strips of what did not happen.
    assert len(legend_texts(figure)) == 2
    texts = [text.get_text() for text in ax.get_yticklabels()]
    assert texts[-1] == "failed"
    assert "stalled" not in texts
    assert_apart(figure)
    assert_apart(drawn(work_precision, cubes, scenes=("soft",), error="accumulation_error"))


def test_scene_without_such_events_says_so(cubes) -> None:
    errors, timings = cubes
    at = {"scene": ["soft"], "solver": ["exact", "radau"]}
    figure = drawn(work_precision, (errors.sel(at), timings.sel(at)), error="release_error")
    assert "nothing to compare" in [text.get_text() for text in figure.axes[0].texts]


def test_scenes_without_such_an_error_are_left_out(cubes) -> None:
    errors, timings = (cube.copy(deep=True) for cube in cubes)
    errors["release_error"].loc[{"scene": "soft", "solver": "exact"}] = 1e-3
    figure = drawn(work_precision, (errors, timings), error="release_error")
    assert [ax.get_title() for ax in figure.axes] == ["Compliant contact"]
    figure = drawn(work_precision, (errors, timings), error="release_error", scenes=["hard"])
    assert [text.get_text() for text in figure.axes[0].texts] == ["nothing to compare"]


def test_faults_are_named(cubes) -> None:
    with pytest.raises(ValueError, match="no scene 'gone': must be one of hard, soft"):
        work_precision.draw(*cubes, scenes=["gone"])
    with pytest.raises(ValueError, match="error = 'nonsense': must be one of state_error"):
        work_precision.draw(*cubes, error="nonsense")
    errors, timings = cubes
    many = [xr.concat([cube] * 7, "scene", data_vars="minimal") for cube in cubes]
    with pytest.raises(ValueError, match="14 scenes do not fit a page: give at most 12"):
        work_precision.draw(*many, scenes=["hard", "soft"] * 7)
    with pytest.raises(ValueError, match="not those of the same scenes"):
        solver_summary.draw(errors, timings.isel(level=[0, 1]))


# --- summary


def test_summary_tells_errors_failures_and_ratios(cubes) -> None:
    figure = drawn(solver_summary, cubes)
    left, right = figure.axes
    cells = [{}, {}]
    for ax, found in zip((left, right), cells, strict=True):
        for text in ax.texts:
            if text.get_ha() == "center":
                x, y = text.get_position()
                found[int(y), int(x)] = text.get_text()
    errors, _ = cubes
    solvers = errors.solver.values.tolist()
    row = dict(zip(solvers, (cells[0][0, k] for k in range(7)), strict=True))
    assert row == {
        "exact": "<1e\N{MINUS SIGN}16",
        "rk4_step_end": "w",
        "rk4_located": "4e\N{MINUS SIGN}7",
        "rk45": "2e\N{MINUS SIGN}3",
        "lsoda": "s",
        "radau": "m",
        "compliant_flow": "",
    }
    corners = [text.get_text() for text in left.texts if text.get_ha() == "right"]
    assert corners == ["c"]  # rk45's finest
    row = dict(zip(solvers, (cells[1][0, k] for k in range(7)), strict=True))
    assert row["exact"] == "100 ms"
    assert row["rk4_located"] == "0.08"
    assert row["rk45"] == row["radau"] == "\N{EN DASH}"
    assert row["compliant_flow"] == ""
    assert [text.get_text() for text in left.get_yticklabels()] == [
        "Hard walls",
        "Compliant contact",
    ]
    assert "s stalled" in figure._suptitle.get_text()
    assert_apart(figure)


def test_letters_are_sorted_by_frequency() -> None:
    codes = [VERDICTS.index(name) for name in ("good", "capped", "missed", "missed")]
    assert solver_summary.letters(np.array([*codes, -1])) == "mc"
    assert solver_summary.letters(np.array([0, -1])) == ""


@pytest.mark.parametrize(
    ("value", "text"), [(1.0, "1"), (12.4, "12"), (1234.0, "1.2k"), (23456.0, "23k"), (0.5, "0.5")]
)
def test_ratios_are_short(value: float, text: str) -> None:
    assert solver_summary._ratio(value) == text


def test_same_bytes_twice(cubes, tmp_path: Path) -> None:
    for kind in (work_precision, solver_summary):
        for name in "ab":
            figure = drawn(kind, cubes)
            with style():
                save(figure, tmp_path / f"{name}.svg")
        a, b = ((tmp_path / f"{name}.svg").read_bytes() for name in "ab")
        assert a == b
