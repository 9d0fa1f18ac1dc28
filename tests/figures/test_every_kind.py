"""What holds for every kind of figure: names and units, room for all of it, empty panels, files."""

from typing import Any

import pytest
import xarray as xr
from figures.drawing import SI, assert_nothing_overlaps, drawn, svg_of
from matplotlib.figure import Figure

import damper
from damper.study.kinds import FIGURES, TABLES
from damper.tables import make

OBSERVERS: dict[str, Any] = {
    "stroboscopic_section": {"free_mass": True},
    "response": None,
    "impacts": {"speeds": 40},
    "bursts": {"records": 40},
    "accumulation": {"bursts": 6},
    "motion": None,
    "trajectory": {"samples_per_period": 60},
}
RUN: dict[str, Any] = {"transient": 3, "periods": 6, "observers": OBSERVERS}
#: Names of the axes in both systems of units: a frequency, and the free travel.
SYSTEMS = {False: ("frequency_ratio", "clearance"), True: ("forcing_frequency", "gap")}
DAMPER = {"mass_ratio": 0.2, "damping_ratio": 0.02, "restitution": 0.6}


def simulated(si: bool, **changes: Any) -> xr.Dataset:
    """Return runs with complete bursts over both axes."""
    frequency, travel = SYSTEMS[si]
    fixed = SI if si else DAMPER
    values = {frequency: [4.0, 5.0], travel: [1e-3, 2e-3]} if si else {}
    values = values or {frequency: [0.2, 0.25], travel: [0.03, 0.05]}
    return damper.simulate(**{**fixed, **values, **RUN, **changes})


@pytest.fixture(scope="module", params=[False, True], ids=["dimensionless", "SI"])
def made(request: pytest.FixtureRequest) -> tuple[bool, xr.Dataset]:
    return request.param, simulated(request.param)


@pytest.fixture(scope="module")
def stopped() -> xr.Dataset:
    """Return the same runs, all of which stop before their record begins."""
    return simulated(False, max_events=5)


def settings_of(kind: str, si: bool, cube: xr.Dataset) -> dict[str, Any]:
    """Return settings with which a kind shows the cube."""
    frequency, travel = SYSTEMS[si]
    first = {frequency: cube[frequency].values[0].item()}
    one = {**first, travel: cube[travel].values[0].item()}
    return {
        "bifurcation": {"along": frequency, "rows": travel},
        "map": {"variable": "peak_displacement", "x": frequency, "y": travel},
        "curves": {"variables": ["peak_displacement"], "along": frequency, "lines": travel},
        "trajectory": {"at": one},
        "histories": {"panels": travel, "at": first},
        "phase_portrait": {"columns": travel, "at": first},
        "free_mass": {"at": one},
        "accumulation": {"rows": travel, "at": first},
    }[kind]


#: What each kind writes into a panel of runs that stopped; None where it refuses them.
EMPTY = {
    "bifurcation": "no run finished here",
    "map": "no run finished here",
    "curves": "no run finished here",
    "trajectory": None,
    "histories": "no run finished here",
    "phase_portrait": "no run finished here",
    "free_mass": None,
    "accumulation": "no complete burst with a prediction here",
}
#: Kinds of other cubes, with tests of their own for what is asked here.
OTHERS = {"basins", "convergence", "damping", "laws", "special_points", "schematic", "statistics"}


#: Runs of the kinds in `OTHERS` and of tables, all of which stop: their cube, and what is made.
STOPS = {"transient": 5, "periods": 4, "max_events": 3}
RESONANT = {"mass_ratio": 0.1, "damping_ratio": 0.02, "frequency_ratio": 1.0, "restitution": 0.6}
MOVED = RESONANT | {"clearance": 1.0, "initial_displacement": 30.0} | STOPS
TWO: dict[str, Any] = {"restitution": [0.3, 0.6]}
GRID = TWO | {"frequency_ratio": [0.9, 1.0], "clearance": [1.0, 2.0]}
DRAWS = {"count": 3, "seed": 1, "initial_relative_velocity": [5.0, 30.0]}
NOISE = damper.Noise(1, 0.1, 90.0, (0.0, 6.0))
DISTANCE = {"variables": ["peak_displacement"], "along": "contact_stiffness_ratio"}
STOPPED: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "basins": (TWO | {"observers": ["motion"], "draws": DRAWS}, {"along": "restitution"}),
    "convergence": (
        {"observers": ["response"], "contact_stiffness_ratio": [1e4, 1e5, 1e6]},
        DISTANCE,
    ),
    "damping": (TWO | {"observers": ["decay"], "forcing": "none"}, {"lines": "restitution"}),
    "laws": (GRID | {"observers": ["laws"]}, {}),
    "statistics": (TWO | {"observers": ["statistics"], "forcing": NOISE}, {"along": "restitution"}),
    "accumulation": (TWO | {"observers": {"accumulation": {"bursts": 4}, "bursts": None}}, {}),
    "performance": (
        GRID | {"observers": ["response", "impacts", "bursts"]},
        {"along": "frequency_ratio", "over": "clearance"},
    ),
    "two_impacts": (
        GRID | {"observers": ["stroboscopic_section", "response", "impacts"]},
        {"along": "clearance"},
    ),
    "intervals": (GRID | {"observers": ["bursts"]}, {"along": "restitution", "resolution": 0.1}),
}
#: What the figures of these say.
NOTHING = dict.fromkeys(("basins", "laws", "statistics"), "no run finished here")
NOTHING |= {
    "convergence": "no distance to show",
    "damping": "no whole cycle of a free vibration here",
}
#: Tables that bisect between runs, and refuse runs that stopped.
REFUSED = {"intervals": "chatter is not known: the run at .* stopped early"}
#: Kinds that show no runs, or orbits.
OF_NO_RUNS = {"special_points", "schematic", "scores"}


@pytest.mark.parametrize("kind", STOPPED)
def test_a_study_whose_runs_all_stop_has_its_figures_and_tables(kind: str) -> None:
    given, settings = STOPPED[kind]
    cube = damper.simulate(**MOVED | given)
    assert cube.attrs["runs_stopped_early"] == cube.attrs["runs"]
    if kind in REFUSED:
        with pytest.raises(ValueError, match=REFUSED[kind]):
            make(kind, {"cube": cube}, **settings)
        return
    if kind in OTHERS:
        figure = drawn(kind, cube, **settings)
        assert NOTHING[kind] in [text.get_text() for ax in figure.axes for text in ax.texts]
    if kind in TABLES:
        table_settings = {} if kind == "statistics" else settings
        table = make(kind, {"cube": cube}, **table_settings)
        assert table.markdown().startswith("# Impact damper simulation")
        assert table.csv()
        if kind == "basins":
            assert "6 of 6 runs stopped early" in table.markdown()


def test_every_kind_is_asked() -> None:
    assert not {*TABLES, *OTHERS} - {*STOPPED, *OF_NO_RUNS}
    assert set(EMPTY) | OTHERS == set(FIGURES)


def labels(figure: Figure) -> list[str]:
    """Labels of all axes, on one line each."""
    found = [figure.get_supylabel()]
    found += [label for ax in figure.axes for label in (ax.get_xlabel(), ax.get_ylabel())]
    return [" ".join(label.split()) for label in found if label]


#: Kinds without a quantity of a unit: time in periods, and lengths over the clearance.
RATIOS = {"histories"}


@pytest.mark.parametrize("kind", EMPTY)
def test_axes_have_names_and_units(kind: str, made: tuple[bool, xr.Dataset], tmp_path) -> None:
    si, cube = made
    before = cube.copy(deep=True)
    figure = drawn(kind, cube, caption="What it is", **settings_of(kind, si, cube))
    xr.testing.assert_identical(cube, before)
    units = ("m", "mm", "s", "(m/s)", "(rad/s)") if si else ("($F_0/K$)", r"($F_0/\sqrt{KM}$)")
    found = labels(figure)
    assert any(label.endswith(f"/ {unit}") for label in found for unit in units) or kind in RATIOS
    assert not any("F_0" in label for label in found) or not si
    heading = figure.get_suptitle()
    assert heading.startswith("What it is\n")
    assert ("$K$ = 800 N/m" if si else r"$\zeta$ = 0.02") in heading.replace("\n", " ")
    # Labels with prefixes are the longer ones; saving is the same in either system.
    if si:
        assert_nothing_overlaps(figure)
    else:
        svg_of(figure, tmp_path)


@pytest.mark.parametrize("kind", EMPTY)
def test_an_empty_panel_says_why(kind: str, stopped: xr.Dataset) -> None:
    settings = settings_of(kind, False, stopped)
    words = EMPTY[kind]
    if words is None:
        with pytest.raises(ValueError, match=r"the run stopped before|ends 0 cycles"):
            drawn(kind, stopped, **settings)
        return
    figure = drawn(kind, stopped, **settings)
    panels = [ax for ax in figure.axes if ax.get_label() != "<colorbar>"]
    assert panels
    for ax in panels:
        assert words in [text.get_text() for text in ax.texts]
    assert_nothing_overlaps(figure)
