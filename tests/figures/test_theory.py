"""Theory drawn over simulations: where its lines lie, and that nothing is paid for unasked."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from figures.drawing import assert_nothing_overlaps, drawn, legend_texts
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from new_process import modules_after

import damper
from damper.analysis.orbits import follow_orbits
from damper.figures import modules
from damper.figures.common.style import SKY, THEORY
from damper.study.digest import files_behind
from damper.study.kinds import FIGURES
from damper.theory.small_mass import critical_restitution
from damper.theory.two_impacts import orbits

SCRIPT = Path(__file__).parents[2] / "workflow/scripts/figure.py"


def lines(ax: Axes, colour: str) -> list[Line2D]:
    return [line for line in ax.lines if to_rgba(line.get_color()) == to_rgba(colour)]


def curves(ax: Axes, dashed: bool) -> np.ndarray:
    """Points of the closed form's curves."""
    found = [
        line.get_xydata() for line in lines(ax, THEORY) if (line.get_linestyle() == "--") == dashed
    ]
    points = np.concatenate(found)
    return points[np.isfinite(points).all(axis=1)]


# --- a ball on a table


def test_a_ball_bounces_on_its_closed_form() -> None:
    cube = damper.simulate(
        mass_ratio=0, damping_ratio=0, frequency_ratio=1.0, clearance=0, restitution=0.8,
        carrier="prescribed", walls="left", gravity=1.0,
        force_amplitude=[0.3, 0.5, 0.7, 0.9, 1.3], phase=1.0,
        initial_relative_velocity=2.8, transient=100, periods=4,
        observers={"impacts": {"speeds": 4}},
    )  # fmt: skip
    settings = {"along": "force_amplitude", "variables": ["approach_speed"]}
    (ax, *_) = drawn("bifurcation", cube, theory="ball_on_table", **settings).axes
    found = [line.get_xydata() for line in lines(ax, THEORY) if len(line.get_xdata())]
    assert len(found) == 3
    for n, curve in enumerate(found, 1):
        stable = curve[np.isfinite(curve[:, 1])]
        assert stable[:, 1] == pytest.approx(n * 2.0 * np.pi / 1.8)
        onset = n * np.pi / 9.0
        ends = max(onset, 0.3), min(np.hypot(onset, 2.0 * 1.64 / 3.24), 1.3)
        assert (stable[0, 0], stable[-1, 0]) == pytest.approx(ends, abs=0.06)
    speeds = cube.approach_speed.sel(force_amplitude=[0.5, 0.7, 0.9]).values
    assert speeds == pytest.approx(2.0 * np.pi / 1.8, rel=1e-9)


# --- two impacts per period


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    return damper.simulate(
        mass_ratio=0.1,
        damping_ratio=0.02,
        frequency_ratio=[1.0, 1.1],
        clearance=np.arange(2.0, 16.1, 1.0),
        restitution=0.6,
        transient=150,
        periods=10,
        observers={"stroboscopic_section": {"when": 0.25}, "impacts": {}},
    )


def over_clearance(cube: xr.Dataset, **settings: Any) -> Figure:
    settings = {"along": "clearance", "rows": "frequency_ratio"} | settings
    return drawn("bifurcation", cube, theory="two_impacts", **settings)


def test_curves_are_the_closed_form(cube: xr.Dataset) -> None:
    figure = over_clearance(cube)
    assert_nothing_overlaps(figure)
    for row, omega in enumerate((1.0, 1.1)):
        for column in (0, 1):
            ax = figure.axes[2 * row + column]
            for dashed in (False, True):
                points = curves(ax, dashed)
                assert len(points) > 10
                for d, y in points[::7]:
                    p = damper.Parameters(0.1, 0.02, omega, d, 0.6)
                    values = [
                        orbit.stroboscopic(0.25)[column]
                        for orbit in orbits(p)
                        if orbit.admissible and orbit.stable != dashed
                    ]
                    assert min(abs(y - value) for value in values) < 1e-9


def test_no_line_joins_both_sides_of_an_impact() -> None:
    """Where the impact's instant passes the section, the velocity jumps."""
    omega = np.linspace(0.68, 0.8, 13)
    cube = damper.simulate(
        mass_ratio=0.1,
        damping_ratio=0.02,
        frequency_ratio=omega,
        clearance=5.0,
        restitution=0.3,
        transient=10,
        periods=2,
        observers=["stroboscopic_section"],
    )
    figure = drawn("bifurcation", cube, along="frequency_ratio", theory="two_impacts")
    steps = [
        np.nanmax(abs(np.diff(line.get_ydata())), initial=0.0)
        for line in lines(figure.axes[1], THEORY)
        if line.get_transform() == figure.axes[1].transData
    ]
    ends = curves(figure.axes[1], dashed=False)[:, 1]
    assert abs(np.diff(ends)).max() > 0.3  # the jump is in the range
    assert max(steps) < 0.1


# --- small-mass limit


@pytest.fixture(scope="module")
def light() -> xr.Dataset:
    return damper.simulate(
        mass_ratio=1e-4,
        damping_ratio=0.05,
        frequency_ratio=[0.3, 1.2],
        clearance=np.linspace(0.05, 1.5, 4),
        restitution=np.linspace(0.0, 0.9, 4),
        initial="steady",
        transient=0,
        periods=1,
        observers=["bursts"],
    )


LIMIT = {"variable": "complete_fraction", "theory": "small_mass_limit"}


@pytest.mark.parametrize("upright", [True, False])
def test_limit_is_drawn_in_place(light: xr.Dataset, upright: bool) -> None:
    names = ("clearance", "restitution") if upright else ("restitution", "clearance")
    figure = drawn("map", light, x=names[0], y=names[1], panels="frequency_ratio", **LIMIT)
    assert_nothing_overlaps(figure)
    assert r"small-mass limit $r_\mathrm{crit}(2d/A)$" in legend_texts(figure)
    for ax, omega in zip(figure.axes, (0.3, 1.2), strict=False):
        (line,) = lines(ax, SKY)
        d, r = line.get_data() if upright else line.get_data()[::-1]
        amplitude = 1.0 / math.hypot(1.0 - omega**2, 2.0 * 0.05 * omega)
        inside = d < 1.5
        assert inside.sum() > 10
        np.testing.assert_allclose(r[inside], critical_restitution(2.0 * d[inside] / amplitude))
        # The axes stay those of the map.
        assert (ax.get_xlim() if upright else ax.get_ylim())[1] < 1.8


# --- branches of orbits


def test_special_points_are_marked_where_a_multiplier_is_1() -> None:
    """Over the sizes of all multipliers, the one that changes the motion; grazing has none."""
    point = {"mass_ratio": 0.1, "damping_ratio": 0.1, "frequency_ratio": 1.0, "restitution": 0.5}
    axes = {"clearance": (4.4, 5.0, 5.6)}
    entry = {"along": "clearance", "start": 5.0, "period": 1, "settle": 200, "max_orbits": 60}
    branches = follow_orbits({"two": entry}, point | {"phase": 0.0}, axes)
    cube = damper.simulate(**point, **axes, transient=50, periods=5)
    settings = {"along": "clearance", "variables": ["displacement", "multiplier"], "orbits": True}
    motion, sizes = drawn("bifurcation", cube, branches, **settings).axes
    marked = [line for line in sizes.lines if line.get_marker() == "^"]
    (breaking,) = np.concatenate([line.get_xydata() for line in marked])
    assert breaking == pytest.approx([4.616152418, 1.0], abs=1e-6)
    assert not [line for line in sizes.lines if line.get_marker() == "x"]
    assert [line for line in motion.lines if line.get_marker() == "^"]
    about, _ = drawn("bifurcation", cube, branches, **settings, about_orbits=True).axes
    stable = branches.displacement.values[branches.stable.values == 1]
    (low, high), room = about.get_ylim(), 0.31 * np.ptp(stable)
    assert stable.min() - room < low < stable.min()
    assert stable.max() < high < stable.max() + room


# --- cost


def overlays_behind(kind: str, **settings: Any) -> set[str]:
    """Overlays whose code counts for the job of such a figure."""
    files = files_behind(SCRIPT, modules(FIGURES.modules[kind], settings))
    return {path.stem for path in files if path.parent.name == "overlays"} - {"__init__"}


def test_only_what_is_asked_for_counts_and_loads() -> None:
    assert modules(FIGURES.modules["bifurcation"], {}) == ["damper.figures.bifurcation"]
    both = modules(FIGURES.modules["map"], {"theory": "small_mass_limit"})
    assert both == ["damper.figures.map", "damper.figures.overlays.small_mass_limit"]
    assert overlays_behind("map", theory=None) == set()
    assert overlays_behind("map", theory="steady_amplitude") == {"steady_amplitude"}
    assert overlays_behind("bifurcation", theory="two_impacts", orbits=True) == {
        "two_impacts",
        "orbits",
    }
    assert overlays_behind("special_points") == {"orbits"}
    loaded = modules_after("import damper.figures.map, damper.figures.bifurcation")
    assert not [name for name in loaded if name.startswith("damper.theory")]
