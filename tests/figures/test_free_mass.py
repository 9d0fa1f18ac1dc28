"""The free mass in time: what is annotated and shaded is what the event list says."""

import re
from typing import Any

import numpy as np
import pytest
import xarray as xr
from figures.drawing import assert_nothing_overlaps, drawn, legend_texts
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from scenes import PAPER_A
from scenes import SLOW as COMPLETE

from damper import Parameters, events, simulate
from damper.analysis.stretches import listed_bursts
from damper.figures.common.style import BLUE, ORANGE, YELLOW

#: Paper A's Fig. 7, as assumed: chatter without sticking.
INCOMPLETE = PAPER_A | {"frequency_ratio": 0.3}
PERIOD = 2 * np.pi / 0.2
#: Of `COMPLETE`, from 50-digit arithmetic.
ACCUMULATION, RELEASE = 44.249718778208865, 46.2709500002439


def simulated(values: dict[str, float], periods: int = 4, **settings: Any) -> xr.Dataset:
    trajectory = {"samples_per_period": 100} | settings.pop("trajectory", {})
    observers = {"trajectory": trajectory, "bursts": {"records": settings.pop("records", 60)}}
    return simulate(**values, transient=0, periods=periods, observers=observers, **settings)


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    return simulated(COMPLETE)


@pytest.fixture(scope="module")
def incomplete() -> xr.Dataset:
    return simulated(INCOMPLETE, periods=3)


def draw(cube: xr.Dataset, **settings: Any) -> Figure:
    return drawn("free_mass", cube, **settings)


def columns(figure: Figure) -> tuple[list[Axes], list[Axes]]:
    return figure.axes[0::2], figure.axes[1::2]


def annotations(figure: Figure) -> dict[str, float]:
    """The numbers above the burst."""
    ax = figure.axes[1]
    text = "\n".join([ax.get_title("left"), *(text.get_text() for text in ax.texts)])
    found = {}
    for name, pattern in (
        ("onset", r"onset \$t\$ = "),
        ("duration", "duration "),
        ("sticking", "sticking "),
    ):
        if match := re.search(pattern + r"([\d.]+)", text):
            found[name] = float(match[1])
    return found


def shades(ax: Axes) -> dict[str, list[tuple[float, float]]]:
    """Stretches of each colour."""
    names = {to_rgb(BLUE): "complete", to_rgb(ORANGE): "incomplete", to_rgb(YELLOW): "sticking"}
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in names.values()}
    for collection in ax.collections:
        assert isinstance(collection, PolyCollection)
        for path in collection.get_paths():
            x = path.vertices[:, 0]
            name = names[to_rgb(collection.get_facecolor()[0])]
            found[name].append((x.min(), x.max()))
    return found


def test_annotated_numbers_are_those_of_the_events(cube: xr.Dataset) -> None:
    found = events(Parameters(**COMPLETE), until=4 * PERIOD)
    (stick,) = np.flatnonzero(abs(found["time"] - ACCUMULATION) < 1e-6)
    assert found["kind"][stick] == 1
    # Back to the first impact of the run on this wall.
    first = stick
    while found["kind"][first - 1] == 0 and found["side"][first - 1] == found["side"][stick]:
        first -= 1
    onset = float(found["time"][first])
    figure = draw(cube, near=onset + 0.1)
    assert annotations(figure) == {
        "onset": pytest.approx(onset, abs=6e-4),
        "duration": pytest.approx(ACCUMULATION - onset, abs=6e-4),
        "sticking": pytest.approx(RELEASE - ACCUMULATION, abs=6e-4),
    }
    visible = found["approach_speed"][first:stick] >= 0.03 * found["approach_speed"][first]
    title = figure.axes[1].get_title("left")
    assert f"right wall, {visible.sum()} visible impacts" in title
    assert title.endswith("complete chatter")


def test_every_resolved_impact_of_the_burst_has_its_speed(cube: xr.Dataset) -> None:
    figure = draw(cube, near=40.0)
    points = figure.axes[9].lines[0]
    found = events(Parameters(**COMPLETE), until=4 * PERIOD)
    low, high = annotations(figure)["onset"] - 1e-3, ACCUMULATION + 1e-9
    inside = (found["kind"] == 0) & (found["time"] > low) & (found["time"] < high)
    assert inside.sum() > 10
    np.testing.assert_allclose(points.get_xdata(), found["time"][inside], rtol=1e-12)
    speeds = found["approach_speed"][inside]
    np.testing.assert_allclose(points.get_ydata(), speeds, rtol=1e-6, atol=1e-12)
    assert figure.axes[9].get_yscale() == "log"


@pytest.mark.parametrize("name", ["cube", "incomplete"])
def test_shading_lies_where_it_chatters_and_sticks(
    name: str, request: pytest.FixtureRequest
) -> None:
    cube = request.getfixturevalue(name)
    bursts = [burst for burst in listed_bursts(cube) if burst.chatter]
    left, right = columns(draw(cube))
    for ax in left[:4]:
        found = shades(ax)
        for kind, complete in (("complete", True), ("incomplete", False)):
            some = [(b.onset, b.end) for b in bursts if b.complete is complete]
            np.testing.assert_allclose(np.reshape(found[kind], (-1, 2)), np.reshape(some, (-1, 2)))
        stuck = [(b.end, b.release) for b in listed_bursts(cube) if b.complete]
        whole = [span for span in stuck if span[1] > span[0]]
        np.testing.assert_allclose(
            np.reshape(found["sticking"], (-1, 2))[: len(whole)], np.reshape(whole, (-1, 2))
        )
    assert bursts
    # At large the first one, whole, with what follows it.
    first = bursts[0]
    start, stop = right[0].get_xlim()
    assert start < first.onset < first.release < stop
    kind = "complete" if first.complete else "incomplete"
    assert shades(right[0])[kind] == [(first.onset, first.end)]


def test_lines_are_the_trajectory(cube: xr.Dataset) -> None:
    known = np.isfinite(cube.trajectory_time.values)
    x, v, y, u = (
        cube[f"trajectory_{name}"].values[known]
        for name in ("displacement", "velocity", "free_displacement", "free_velocity")
    )
    left, _ = columns(draw(cube))
    for ax, values in zip(left, (y, y - x, u, u - v), strict=False):
        np.testing.assert_array_equal(ax.lines[0].get_ydata(), values)
        np.testing.assert_array_equal(ax.lines[0].get_xdata(), cube.trajectory_time.values[known])
    assert {line.get_ydata()[0] for line in left[1].lines[1:]} == {-0.25, 0.25}


def test_durations_are_those_of_all_chatter(incomplete: xr.Dataset) -> None:
    left, _ = columns(draw(incomplete, stop=40.0))
    bursts = [b for b in listed_bursts(incomplete) if b.chatter and b.onset <= 40.0]
    points = [(x, y) for line in left[4].lines for x, y in zip(*line.get_data(), strict=True)]
    assert sorted(points) == [(b.onset, b.duration) for b in bursts]
    assert left[0].get_xlim() == (0.0, 40.0)


def test_nearest_burst_of_chatter_is_chosen(incomplete: xr.Dataset) -> None:
    bursts = [burst for burst in listed_bursts(incomplete) if burst.chatter]
    assert len(bursts) > 3
    for burst in bursts[2:4]:
        figure = draw(incomplete, near=burst.onset + 0.3)
        assert annotations(figure)["onset"] == pytest.approx(burst.onset, abs=6e-4)
    assert annotations(draw(incomplete))["onset"] == pytest.approx(bursts[0].onset, abs=6e-4)


def test_incomplete_chatter_is_called_so(incomplete: xr.Dataset) -> None:
    figure = draw(incomplete)
    assert figure.axes[1].get_title("left").endswith("incomplete chatter; no sticking follows")
    assert "sticking" not in annotations(figure)
    duration = "its duration (incomplete)"
    assert legend_texts(figure) == ["incomplete chatter", r"walls $y-x = \pm d$", duration]


def test_sampling_may_start_late(cube: xr.Dataset) -> None:
    late = simulated(COMPLETE, trajectory={"start": 1.0})
    figure, whole = draw(late, near=40.0), draw(cube, near=40.0)
    assert annotations(figure) == annotations(whole)
    assert figure.axes[0].get_xlim() == pytest.approx((PERIOD, 4 * PERIOD))
    np.testing.assert_allclose(
        figure.axes[9].lines[0].get_xdata(), whole.axes[9].lines[0].get_xdata()
    )
    with pytest.raises(ValueError, match=r"stop = 20: the sampled stretch begins at 31\.4159 only"):
        draw(late, stop=20.0)


def test_where_there_is_no_chatter_any_burst_will_do() -> None:
    figure = draw(simulated(COMPLETE | {"restitution": 0.1}))
    assert "burst, no chatter" in figure.axes[1].get_title("left")
    assert figure.axes[8].texts[0].get_text() == "no chatter in this stretch"
    assert_nothing_overlaps(figure)


def test_without_a_burst_it_says_so() -> None:
    figure = draw(simulated(COMPLETE | {"clearance": 9.0}, periods=1))
    _, right = columns(figure)
    assert {ax.texts[0].get_text() for ax in right} == {"no burst in this stretch"}


def test_what_did_not_fit_is_told() -> None:
    figure = draw(simulated(COMPLETE, records=3, trajectory={"events": 5}))
    told = figure.get_suptitle().replace("\n", " ")
    assert re.search(r"\d+ events did not fit", told)
    assert "bursts listed to $t$ = " in told
    assert_nothing_overlaps(figure)


def test_stated_burst_stands_beside_ours(cube: xr.Dataset) -> None:
    figure = draw(cube, near=40.0, stated=(41.0, 44.0))
    marks = [line for line in figure.axes[1].lines if line.get_marker() == "|"]
    assert [list(line.get_xdata()) for line in marks] == [[41.0, 44.0]]
    assert legend_texts(figure)[-1] == "as the paper's text states: onset 41, duration 3"
