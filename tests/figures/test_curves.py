"""Curves of small cubes, where every line's points are known."""

from typing import Any

import numpy as np
import pytest
import xarray as xr
from figures.drawing import assert_nothing_overlaps, drawn, legend_texts, made_up
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

X = [0.8, 0.9, 1.0, 1.1]
MASSES = [0.05, 0.1, 0.2]
D = [0.5, 1.0, 1.5]
VALUES = np.arange(12.0).reshape(3, 4) + 0.5


def cube_of(values: Any = VALUES, variable: str = "peak_displacement") -> xr.Dataset:
    return made_up({"mass_ratio": MASSES, "frequency_ratio": X}, **{variable: values})


def curves(cube: xr.Dataset, *variables: str, **settings: Any) -> Figure:
    names = variables or ("peak_displacement",)
    return drawn("curves", cube, variables=names, **{"along": "frequency_ratio", **settings})


def lines(ax: Axes) -> list[Line2D]:
    """All but the line at 1 and marks."""
    return [line for line in ax.lines if len(line.get_xdata()) > 2]


# --- lines


def test_a_line_for_each_value() -> None:
    figure = curves(cube_of(), lines="mass_ratio")
    (ax,) = figure.axes
    for line, values in zip(lines(ax), VALUES, strict=True):
        assert list(line.get_xdata()) == X
        np.testing.assert_array_equal(line.get_ydata(), values)
    assert {line.get_linestyle() for line in lines(ax)} == {"-"}
    grey = [np.dot((0.2126, 0.7152, 0.0722), to_rgb(line.get_color())) for line in lines(ax)]
    assert grey == sorted(set(grey))
    assert legend_texts(figure) == []
    assert [text.get_text() for text in ax.texts] == [rf"$\mu$ = {mass:g}" for mass in MASSES]
    for line, text in zip(lines(ax), ax.texts, strict=True):
        assert text.get_color() == line.get_color()
    assert ax.get_xlim() == (0.8, 1.1)
    assert_nothing_overlaps(figure)


def test_labels_at_ends_of_lines_keep_their_distance_and_order() -> None:
    values = np.ones((3, 4)) * [[1.02], [1.0], [5.0]]
    values[0, -1] = np.nan  # its last point is the one before
    (ax,) = (figure := curves(cube_of(values), lines="mass_ratio")).axes
    texts = sorted(ax.texts, key=lambda text: text.get_position()[1])
    assert [text.get_text()[-4:].strip(" =") for text in texts] == ["0.1", "0.05", "0.2"]
    heights = [text.get_position()[1] for text in texts]
    assert np.diff(heights).min() > 0.09
    place = ax.transAxes.inverted().transform(ax.transData.transform((1.1, 5.0)))
    assert heights[-1] == pytest.approx(place[1])
    assert_nothing_overlaps(figure)


def test_jumps_are_not_joined() -> None:
    """A step far higher than those beside it; a steep or a rough line is whole."""
    x = list(np.linspace(0.8, 1.2, 9))
    for values, parted in (
        ([1, 2, 3, 4, 9, 10, 11, 12, 13], [1, 2, 3, 4, np.nan, 9, 10, 11, 12, 13]),
        ([1, 1, 1, 2, 4, 8, 9, 9, 9], None),
        ([1, 5, 2, 6, 1, 7, 2, 8, 3], None),
        ([np.nan, 1, 2, np.nan, 9, 10, 11, 12, 13], None),
    ):
        cube = made_up({"frequency_ratio": x}, peak_displacement=np.array(values, float))
        (line,) = lines(curves(cube).axes[0])
        np.testing.assert_array_equal(line.get_ydata(), parted or values)


def test_a_power_law_beneath() -> None:
    figure = curves(cube_of(), lines="mass_ratio", log=True, slope=0.5)
    law = figure.axes[0].lines[-1]
    np.testing.assert_allclose(law.get_ydata() / np.sqrt(X), law.get_ydata()[0] / np.sqrt(X[0]))
    assert (law.get_ydata() < VALUES).all()
    assert legend_texts(figure)[-1] == "slope 0.5"
    with pytest.raises(ValueError, match="log: true"):
        curves(cube_of(), lines="mass_ratio", slope=0.5)


# --- the ratio 1, stopped runs, logarithms


def test_stopped_runs_leave_a_gap() -> None:
    values = VALUES.copy()
    values[1, 2] = np.nan
    line = lines(curves(cube_of(values), lines="mass_ratio").axes[0])[1]
    assert np.isnan(line.get_ydata()).tolist() == [False, False, True, False]
    counts = np.full((3, 4), 3)
    counts[0, 1] = -1
    cube = cube_of(counts, "visible_impacts")
    line = lines(curves(cube, "visible_impacts", lines="mass_ratio").axes[0])[0]
    assert np.isnan(line.get_ydata()).tolist() == [False, True, False, False]


# --- several runs at a point

DRAWN = np.stack([VALUES, VALUES[:, ::-1]], axis=-1)


def test_the_worst_and_the_share_of_several_runs() -> None:
    axes = {"mass_ratio": MASSES, "frequency_ratio": X}
    cube = made_up(axes, {"draw": [0, 1]}, peak_displacement=DRAWN)
    figure = curves(cube, lines="mass_ratio", worst=["draw"])
    for line, values in zip(lines(figure.axes[0]), DRAWN, strict=True):
        np.testing.assert_array_equal(line.get_ydata(), values.max(axis=-1))
    assert figure.get_suptitle().endswith("worst of 2 draws")
    figure = curves(cube, lines="mass_ratio", share=["draw"], above=3)
    for line, values in zip(lines(figure.axes[0]), DRAWN, strict=True):
        np.testing.assert_array_equal(line.get_ydata(), (values > 3).mean(axis=-1))
    label = " ".join(figure.axes[0].get_ylabel().split())
    assert label == "part of 2 draws above 3: largest primary displacement, either way"
    assert_nothing_overlaps(figure)


def test_a_band_from_the_worst_to_the_best() -> None:
    runs = np.stack([VALUES, VALUES[:, ::-1], VALUES + 1.0], axis=-1)
    axes = {"mass_ratio": MASSES, "frequency_ratio": X}
    cube = made_up(axes, {"draw": [0, 1, 2]}, peak_displacement=runs)
    figure = curves(cube, panels="mass_ratio", band=["draw"])
    texts = ["worst of 3 draws", "their median", "their best to their worst"]
    assert legend_texts(figure) == texts
    for ax, values in zip(figure.axes, runs, strict=True):
        highest, middle = lines(ax)
        np.testing.assert_array_equal(highest.get_ydata(), values.max(axis=-1))
        np.testing.assert_array_equal(middle.get_ydata(), np.median(values, axis=-1))
        (band,) = ax.collections
        corners = band.get_paths()[0].vertices[:, 1]
        assert {*values.min(axis=-1), *values.max(axis=-1)} == {*corners}
    assert [ax.get_title(loc="left") for ax in figure.axes] == [rf"$\mu$ = {m:g}" for m in MASSES]
    assert_nothing_overlaps(figure)


# --- best


def best_cube(worst: Any) -> xr.Dataset:
    """Greatest value along the frequency by mass ratio and clearance."""
    shape = np.array([0.2, 1.0, 0.5, 0.1])
    values = np.asarray(worst, dtype=float)[..., None] * shape
    axes = {"mass_ratio": MASSES, "clearance": D, "frequency_ratio": X}
    return made_up(axes, peak_displacement=values, energy_input=10 * values)


WORST = [[3.0, 2.0, 1.0], [1.0, 2.0, 3.0], [3.0, 1.0, 2.0]]


def test_best_value_of_each_line() -> None:
    figure = curves(
        best_cube(WORST), "peak_displacement", "energy_input", lines="mass_ratio", best="clearance"
    )
    assert legend_texts(figure) == [
        *(
            rf"$\mu$ = {mass:g}, best $d$ = {d:g} $F_0/K$, highest at $\omega$ = {X[1]:g}"
            for mass, d in zip(MASSES, (1.5, 0.5, 1.0), strict=True)
        ),
        "where a line is highest",
    ]
    assert "best: lowest peak over the band" in figure.get_suptitle()
    above, below = figure.axes
    for a, b in zip(lines(above), lines(below), strict=True):
        assert max(a.get_ydata()) == 1.0
        np.testing.assert_allclose(b.get_ydata(), 10 * a.get_ydata())
    assert "$d$" not in figure.get_suptitle()


def test_a_free_axis_has_its_best_value_at_each_point() -> None:
    """A front: the best clearance of the worst over the frequency, for each mass."""
    cube = best_cube(WORST)
    settings: dict[str, Any] = {"worst": ["frequency_ratio"], "choose": ["clearance"]}
    figure = curves(cube, along="mass_ratio", **settings)
    above, below = figure.axes
    np.testing.assert_array_equal(lines(above)[0].get_ydata(), np.min(WORST, axis=1))
    np.testing.assert_array_equal(lines(below)[0].get_ydata(), [1.5, 0.5, 1.0])
    assert below.get_ylabel().startswith("best clearance")
    assert_nothing_overlaps(figure)


def test_amplitude_without_damper_stands_beside_it() -> None:
    cube = best_cube(WORST)
    undamped = np.array([1.0, 4.0, 2.0, 1.0])
    ratio = (cube.peak_displacement / undamped).assign_attrs(units="1")
    figure = curves(cube.assign(amplitude_ratio=ratio), at={"mass_ratio": 0.1, "clearance": 0.5})
    (wide,) = (line for line in figure.axes[0].lines if line.get_linewidth() == 2.0)
    np.testing.assert_allclose(wide.get_ydata(), undamped)
    assert legend_texts(figure) == ["with damper", "without damper"]


def test_lines_of_other_primaries_have_their_own_amplitudes_without_damper() -> None:
    undamped = np.array([[4.0], [2.0], [1.0]]) * np.ones(4)
    cube = made_up({"damping_ratio": D, "frequency_ratio": X}, peak_displacement=VALUES)
    cube["amplitude_ratio"] = (cube.peak_displacement / undamped).assign_attrs(units="1")
    figure = curves(cube, lines="damping_ratio")
    (ax,) = figure.axes
    thin, wide = (
        {str(line.get_color()): line.get_ydata() for line in ax.lines if line.get_linewidth() == w}
        for w in (1.1, 2.0)
    )
    assert list(wide) == list(thin)
    np.testing.assert_allclose([*wide.values()], undamped)
    assert legend_texts(figure) == ["without damper, in the colours of the lines"]


def test_abscissa_may_be_the_natural_frequency() -> None:
    stiffness = [100.0, 200.0, 400.0]
    cube = made_up({"frequency_ratio": stiffness}, peak_displacement=np.arange(3.0) + 1.0)
    cube = cube.rename(frequency_ratio="stiffness").assign_coords(primary_mass=4.0)
    figure = curves(cube, along="stiffness", natural_frequency=True)
    (line,) = lines(figure.axes[0])
    np.testing.assert_allclose(line.get_xdata(), np.sqrt(np.array(stiffness) / 4.0) / (2.0 * np.pi))
    assert figure.axes[0].get_xlabel().startswith("natural frequency")
