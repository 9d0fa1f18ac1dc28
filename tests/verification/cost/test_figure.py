"""The figures of the cost study show what was measured."""

import warnings

import numpy as np
import pytest
from figures.drawing import assert_nothing_overlaps, legend_texts
from matplotlib.backends.backend_agg import FigureCanvasAgg
from verification.cost.cost_timings import TIMINGS

from damper.figures.common.style import style
from damper.verification.cost.figures.cost import draw


def shown(timings, **settings):
    with style(), warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = draw(timings, **settings)
        canvas = FigureCanvasAgg(figure)
        for _ in range(2):
            canvas.draw()
    return figure


@pytest.mark.parametrize("show", ["ladder", "scaling"])
def test_nothing_overlaps_and_the_machine_is_named(show):
    figure = shown(TIMINGS, show=show)
    assert_nothing_overlaps(figure)
    assert "A processor, 2 cores" in figure._suptitle.get_text().replace("\n", " ")


def test_ladder_shows_each_ratio_where_it_says_something():
    figure = shown(TIMINGS, show="ladder")
    time, memory = figure.axes
    names = [tick.get_text() for tick in time.get_yticklabels()]
    assert names == ["bare engine", "impacts", "grounded"]
    points = [line for line in time.lines if len(line.get_xdata()) == 3]
    values = np.array([line.get_xdata() for line in points], dtype=float)
    np.testing.assert_equal(
        values,
        [[np.nan, 1.0625, np.nan], [1.0, np.nan, 2.0], [np.nan, np.nan, 2.0]],
    )
    assert [bar.get_width() for bar in memory.patches] == [3.0] * 3 + [0.25] * 3


def test_scaling_shows_time_and_memory_of_both_runs_and_a_guide():
    figure = shown(TIMINGS, show="scaling")
    time, _, memory, _ = figure.axes
    bare, guide, observed = time.lines
    assert list(bare.get_ydata()) == [4e-4, 0.04, 4.0]
    assert list(observed.get_ydata()) == [6e-4, 0.06, 6.0]
    x, y = guide.get_data()
    assert y[1] / y[0] == pytest.approx(x[1] / x[0])
    assert list(memory.lines[1].get_ydata())[1:] == [0.4, 40.0]
    assert legend_texts(figure) == ["bare engine", "observed", "arrays of the observers", "slope 1"]


def test_what_was_not_measured_is_refused():
    with pytest.raises(ValueError, match="must be one of ladder, scaling"):
        draw(TIMINGS, show="memory")
    with pytest.raises(ValueError, match="have no ladder"):
        draw({"machine": "", "core": ""}, show="ladder")
