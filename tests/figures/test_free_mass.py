"""The free mass in time: what is annotated and shaded is what the event list says."""

import re
from typing import Any

import numpy as np
import pytest
import xarray as xr
from figures.drawing import drawn
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
    assert f"right wall\ncomplete chatter, {visible.sum()} visible impacts" in title


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
