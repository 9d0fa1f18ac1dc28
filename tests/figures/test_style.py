"""One style, whatever the user's own settings, and files with the same bytes."""

import re
import time
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from new_process import modules_after

from damper import simulate
from damper.figures import draw
from damper.figures.common import style
from damper.parameters.quantities import ALL
from damper.parameters.variables import SI_UNITS


def figure() -> Figure:
    made = Figure(figsize=(2, 1.5), layout="constrained")
    ax = made.add_subplot()
    ax.plot([0, 1, 2], [0, 1, 0], label=r"$\omega$")
    ax.fill_between([0, 1], [0, 1], hatch="/")  # hatches get an id in SVG
    ax.legend()
    return made


@pytest.mark.parametrize("end", ["svg", "png"])
def test_same_bytes_at_any_time_whatever_the_users_settings(tmp_path: Path, end: str) -> None:
    with style.style():
        style.save(figure(), tmp_path / f"a.{end}")
    time.sleep(1.1)  # dates in files are in seconds
    with mpl.rc_context(
        {"font.size": 20.0, "lines.linewidth": 7.0, "svg.hashsalt": "x", "savefig.dpi": 30}
    ):
        with style.style():
            style.save(figure(), tmp_path / f"b.{end}")
        assert mpl.rcParams["font.size"] == 20.0, "the user's settings come back"
    first, second = ((tmp_path / f"{name}.{end}").read_bytes() for name in "ab")
    assert first == second
    assert len(first) > 1000


def test_a_colour_of_one_thing_is_named_by_it() -> None:
    """In modules that draw, and on the page of results."""
    own = {style.FREE_MASS, style.RELATIVE, style.THEORY, style.WITHOUT}
    assert own.isdisjoint({*style.COLOURS, style.ORANGE, style.BLUE, style.PURPLE, style.SKY})
    package = Path(style.__file__).parents[2]
    for path in package.rglob("*.py"):
        text = path.read_text("utf-8")
        if path != Path(style.__file__):
            assert not re.search(r"\b(VERMILION|GREEN)\b", text), path
    page = (Path(__file__).parents[2] / "workflow/report/page.js").read_text("utf-8")
    for name in ("FREE_MASS", "RELATIVE", "THEORY", "BLUE", "ORANGE", "SKY"):
        assert f'{name} = "{getattr(style, name)}"' in page


def test_all_files_of_a_figure_have_one_layout(tmp_path: Path) -> None:
    with style.style():
        drawn = figure()
        before = drawn.axes[0].get_position().bounds
        style.save(drawn, tmp_path / "a.svg")
        fitted = drawn.axes[0].get_position().bounds
        style.save(drawn, tmp_path / "a.png")
    assert before != fitted == drawn.axes[0].get_position().bounds


def test_labels_name_every_parameter() -> None:
    assert set(style.SYMBOLS) == set(style.LONG_NAMES) == set(ALL)
    assert style.axis_label("restitution") == "coefficient of restitution $r$"
    assert style.value_text("frequency_ratio", 1.5) == r"$\omega$ = 1.5"
    assert style.value_text("mass_ratio", 0.1 + 0.2) == r"$\mu$ = 0.3"
    assert style.value_text("mass_ratio", 0.001) == r"$\mu$ = 0.001"
    assert style.value_text("clearance", 0.05) == "$d$ = 0.05 $F_0/K$"
    assert style.value_text("stiffness", 800.0) == "$K$ = 800 N/m"
    assert style.value_text("initial_displacement", 0.1, "m") == "$x_0$ = 0.1 m"
    assert style.value_text("direction", "up") == "continued upwards"
    assert style.value_text("stiffness", 4e6) == r"$K$ = $4\times 10^{6}$ N/m"
    assert style.value_text("draw", 3) == "draw 3"
    assert style.value_text("walls", -1.0) == "walls: left"
    assert style.axis_label("clearance") == "clearance to each wall $d$ / ($F_0/K$)"
    assert style.axis_label("initial_velocity", "m/s").endswith(r"$\dot x_0$ / (m/s)")
    assert len({style.axis_label(name) for name in ALL}) == len(ALL)


def test_every_unit_of_a_cube_is_set_as_mathematics() -> None:
    for units in SI_UNITS:
        shown = style.label("x", "", units)
        assert shown.count("$") == 2, shown
        assert "sqrt(" not in shown
    assert style.label("x", "$x$", "1") == "x $x$"
    assert style.label("x", "", "J") == "x / J"


def test_colours_differ_in_grey() -> None:
    """Blue and orange mark chatter: a print without colour must tell them apart."""
    grey = [
        0.2126 * r + 0.7152 * g + 0.0722 * b
        for r, g, b in (to_rgb(style.BLUE), to_rgb(style.ORANGE))
    ]
    assert abs(grey[0] - grey[1]) > 0.2


def test_one_thing_has_one_colour_in_all_figures() -> None:
    point = {"mass_ratio": 0.1, "damping_ratio": 0.02, "frequency_ratio": 1.0, "restitution": 0.6}
    observers: dict[str, Any] = {
        "bursts": {"records": 9},
        "trajectory": {"without_damper": True, "samples_per_period": 40},
        "stroboscopic_section": None,
    }
    run = {"clearance": [2.0], "transient": 0, "periods": 2, "observers": observers}
    cube = simulate(**point, **run)
    place = cube.isel(clearance=0)
    x, y = place.trajectory_displacement.values, place.trajectory_free_displacement.values
    things = {style.PRIMARY: x, style.FREE_MASS: y, style.RELATIVE: y - x}
    things[style.WITHOUT] = place.trajectory_alone.values
    assert len({*things}) == 4
    assert not {*style.COLOURS} & {*things}
    seen = set()
    for kind, settings in {
        "trajectory": {},
        "histories": {"panels": "clearance"},
        "phase_portrait": {},
        "free_mass": {},
    }.items():
        axes = draw(kind, {"cube": cube}, **settings).axes
        for line in (line for ax in axes for line in ax.lines):
            for data in (line.get_xdata(), line.get_ydata()):
                for colour, values in things.items():
                    known = values[np.isfinite(values)]
                    for scale in (1.0, 2.0):  # histories are over the clearance
                        if len(data) == len(known) and np.allclose(data * scale, known):
                            assert line.get_color() == colour, kind
                            seen.add((kind, colour))
    assert len(seen) == 3 + 1 + 2 + 2


def test_unknown_kind_is_refused_with_the_known_ones() -> None:
    with pytest.raises(ValueError, match=r"unknown kind 'pie'.*bifurcation"):
        draw("pie", {})


def test_drawing_needs_no_display_and_no_engine() -> None:
    kinds = ("bifurcation", "map", "curves", "trajectory")
    loaded = modules_after("\n".join(f"import damper.figures.{kind}" for kind in kinds))
    heavy = {"matplotlib.pyplot", "numba", "damper.engine.trajectory", "tkinter"}
    assert not loaded & heavy
