"""The figures of the cost study show what was measured."""

import warnings

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


@pytest.mark.parametrize("show", ["suite", "growth"])
def test_nothing_overlaps_and_the_machine_is_named(show):
    figure = shown(TIMINGS, show=show)
    assert_nothing_overlaps(figure)
    assert "A processor, 2 cores" in figure._suptitle.get_text().replace("\n", " ")


def test_suite_shows_each_ratio_that_there_is():
    figure = shown(TIMINGS, show="suite")
    time, memory = figure.axes
    names = [tick.get_text() for tick in time.get_yticklabels()]
    assert names == ["bare engine", "impacts", "grounded"]
    shown_points = [container.lines[0].get_xydata().tolist() for container in time.containers]
    assert shown_points == [[[1.0625, 1]], [[1.0, -0.2], [2.0, 1.8]], [[2.0, 2.2]]]
    assert [bar.get_width() for bar in memory.patches] == [0.0, 3.0, 0.0, 0.0, 0.25, 0.0]


def test_growth_shows_time_and_memory_with_and_without_observers_and_a_guide():
    figure = shown(TIMINGS, show="growth")
    time, _, memory, _ = figure.axes
    bare, observed, guide = time.lines
    assert list(bare.get_ydata()) == [4e-4, 0.04, 4.0]
    assert list(observed.get_ydata()) == [6e-4, 0.06, 6.0]
    x, y = guide.get_data()
    assert y[-1] / y[0] == pytest.approx(x[-1] / x[0])
    assert list(memory.lines[1].get_ydata())[1:] == [0.4, 40.0]
    assert legend_texts(figure) == ["bare engine", "observed", "arrays of the observers", "slope 1"]
    titles = [ax.get_title() for ax in figure.axes[:2]]
    assert titles == ["slope 0.99 bare, slope 0.99 observed", "slope 0.99 observed"]
