"""Paper B's studies: values typed in one are those of the other, choices are found anew."""

from itertools import product
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from damper import simulate
from damper.analysis import first_lasting_change, section_period
from damper.study.config import Study, load_study

STUDIES = Path(__file__).parents[2] / "config/studies"
#: Where the text says that bifurcation begins.
STATED = 0.5


def study(name: str) -> Study:
    return load_study(STUDIES / f"{name}.yaml")


RESTITUTION, HISTORIES, PORTRAITS = map(
    study, ("restitution", "paper_b_histories", "paper_b_portraits")
)
DIAGRAMS = [RESTITUTION.figures[f"paper_b_fig_{n}"] for n in (2, 3)]


def section_points(**point: object) -> np.ndarray:
    """Number of section points at each value of the restitution, as in the diagrams."""
    cube: xr.Dataset = simulate(
        **(RESTITUTION.fixed | point),
        transient=RESTITUTION.transient,
        periods=RESTITUTION.periods,
        observers={"stroboscopic_section": RESTITUTION.observer_settings()["stroboscopic_section"]},
    )
    return section_period(cube).values


@pytest.mark.parametrize("other", [HISTORIES, PORTRAITS], ids=lambda s: s.name)
def test_values_are_those_of_the_restitution_study(other: Study) -> None:
    grid = RESTITUTION.axis_values
    for name, value in other.fixed.items():
        assert value == RESTITUTION.fixed.get(name) or value in grid[name]
    for name, values in other.axis_values.items():
        assert set(values) <= set(grid[name]), name
    assert other.transient == RESTITUTION.transient
    kept = {"stroboscopic_section": ("when",), "bursts": ("threshold",)}
    for name, keys in kept.items():
        if name in other.observers:
            for key in keys:
                mine, theirs = (s.observer_settings()[name][key] for s in (other, RESTITUTION))
                assert mine == theirs


def test_histories_are_figures_6_to_17_in_the_order_of_the_text() -> None:
    assert HISTORIES.periods == RESTITUTION.periods, "panels are classed as the diagrams are"
    masses, frequencies = (HISTORIES.axis_values[n] for n in ("mass_ratio", "frequency_ratio"))
    assert masses == (0.25, 0.1, 0.05, 0.001)
    assert "mass_ratio" in HISTORIES.stated
    made = [(name, figure.at) for name, figure in HISTORIES.figures.items()]
    # A matrix of their classes precedes them.
    assert made[0] == ("classes", None)
    assert made[1:] == [
        (f"paper_b_fig_{6 + n}", {"mass_ratio": mass, "frequency_ratio": frequency})
        for n, (mass, frequency) in enumerate(product(masses, frequencies))
    ]


def test_what_the_text_does_not_state_is_assumed() -> None:
    for one in (RESTITUTION, HISTORIES, PORTRAITS):
        names = {*one.fixed, *one.axis_values} - {"restitution", "mass_ratio"}
        assert names <= set(one.assumed), one.name


@pytest.mark.exhaustive
def test_diagrams_are_at_the_frequency_whose_bifurcations_begin_nearest_the_stated_value() -> None:
    frequencies = RESTITUTION.axis_values["frequency_ratio"]
    grid = [value for value in RESTITUTION.axis_values["restitution"] if 0.4 <= value <= 0.9][::5]
    for figure in DIAGRAMS:
        begins = []
        for frequency in frequencies:
            found = section_points(
                mass_ratio=figure.at["mass_ratio"], frequency_ratio=frequency, restitution=grid
            )
            begins.append(grid[int(np.argmax(found != 1))])
        nearest = int(np.argmin(np.abs(np.array(begins) - STATED)))
        assert frequencies[nearest] == figure.at["frequency_ratio"]


def test_portraits_lie_before_and_after_the_first_lasting_bifurcation() -> None:
    least = 10
    grid = RESTITUTION.axis_values["restitution"]
    first = grid.index(STATED) - least
    grid = grid[first : first + 70]
    before, after = [], []
    for figure, portrait in zip(DIAGRAMS, PORTRAITS.figures.values(), strict=True):
        point = dict(figure.at)
        mass = point["mass_ratio"]
        assert portrait.at == {"mass_ratio": mass}
        assert point["frequency_ratio"] == PORTRAITS.fixed["frequency_ratio"]
        found = section_points(**point, restitution=list(grid))
        index = first_lasting_change(found.tolist(), least)
        assert index is not None
        before.append(grid[index - 1])
        after.append(grid[index])
    assert PORTRAITS.axis_values["restitution"] == (min(before), max(after))
    assert (before, after) == ([0.566, 0.58], [0.568, 0.582]), "as the study file says"
