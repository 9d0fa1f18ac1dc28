"""Where runs start, and what is drawn at random: in Python and in study files."""

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scenes import GENERIC
from studies import ENGINE, MISTAKES, blame, cube_of, load

from damper import State, simulate
from damper.analysis.basins import basin_fractions
from damper.analysis.reduction import share, worst
from damper.parameters.quantities import ALL, INITIAL_NAMES
from damper.parameters.units import attributes_of
from damper.study.config import load_config
from damper.study.estimate import estimate
from damper.sweep.branches import draw
from damper.sweep.cube import CONVENTIONS, write_cube

SCENE: dict[str, Any] = GENERIC | {"clearance": 0.5, "phase": 0.2}
SEEN: dict[str, Any] = {"stroboscopic_section": {"free_mass": True}, "impacts": {}, "bursts": {}}
RUN: dict[str, Any] = {"transient": 0, "periods": 4, "observers": SEEN}
#: Of parameters and initial quantities, in every way, in the order of the language.
RULES: dict[str, Any] = {
    "damping_ratio": {"values": [0.01, 0.05, 0.1]},
    "clearance": {"range": [0.1, 10], "spacing": "log", "values": [0, 1], "share": 0.4},
    "restitution": {"range": [0.2, 0.8]},
    "initial_position": {"range": [-1, 1]},
    "initial_relative_velocity": {"range": [-0.5, 2]},
}
DRAWS: dict[str, Any] = {"count": 4, "seed": 11, **RULES}
REST: dict[str, Any] = {name: value for name, value in SCENE.items() if name not in RULES}


# --- starts


def test_grid_of_initial_quantities() -> None:
    """Each point equals a run from the state made by hand; the walls are exact."""
    axes = {
        "initial_displacement": [0.3, -0.2],
        "initial_velocity": [0.5],
        "initial_position": [-1, 0.25, 1],
        "initial_relative_velocity": [0.0, -0.4],
    }
    cube = simulate(**SCENE, **axes, **RUN)
    assert cube.displacement.dims == (*axes, "sample")
    for x, v, place, relative in itertools.product(*axes.values()):
        where = dict(zip(axes, (x, v, place, relative), strict=True))
        by_hand = simulate(**SCENE, **RUN, state=State(x, v, x + place * 0.5, v + relative))
        for name, variable in by_hand.data_vars.items():
            # Not chaotic within four periods: y of a state rounds otherwise.
            np.testing.assert_allclose(
                cube[name].sel(where).values, variable.values, rtol=1e-6, atol=1e-8, err_msg=name
            )
        alone = simulate(**SCENE, **where, **RUN)
        # The attributes count runs.
        alone, part = (one.drop_attrs(deep=False) for one in (alone, cube.sel(where)))
        xr.testing.assert_identical(part, alone)
        assert cube.displacement.sel(where)[0] == x


# --- draws


def test_draws_are_a_dimension(tmp_path: Path) -> None:
    """The same ones at every point, each as if given by itself, and again by the accessor."""
    given = {**REST, "frequency_ratio": [0.8, 1.1]}
    cube = simulate(**given, **RUN, draws=DRAWS)
    assert cube.displacement.dims == ("frequency_ratio", "draw", "sample")
    assert cube.draw.values.tolist() == [0, 1, 2, 3]
    expected = draw(DRAWS)
    assert list(expected) == list(RULES)
    for name, values in expected.items():
        assert (cube[name].dims, cube[name].values.tolist()) == (("draw",), values)
        attrs = {"long_name": ALL[name].long_name, **attributes_of(ALL[name].units)}
        assert cube[name].attrs == attrs
    for number, omega in itertools.product(range(4), (0.8, 1.1)):
        drawn = {name: values[number] for name, values in expected.items()}
        alone = simulate(**{**REST, "frequency_ratio": omega}, **drawn, **RUN)
        for name, variable in alone.data_vars.items():
            found = cube[name].sel(frequency_ratio=omega, draw=number)
            np.testing.assert_array_equal(found.values, variable.values)
    again = cube.damper.run(frequency_ratio=1.1, draw=2)
    assert again.parameters.restitution == expected["restitution"][2]
    assert again.cube.displacement.values.tolist() == cube.displacement[1, 2].values.tolist()
    write_cube(cube, tmp_path / "cube.nc")
    with xr.open_dataset(tmp_path / "cube.nc") as back:
        xr.testing.assert_identical(back.load(), cube.assign_attrs(Conventions=CONVENTIONS))


def test_draws_are_reduced_and_are_starts_where_states_are_drawn() -> None:
    run = {"transient": 5, "periods": 5, "observers": ["response", "motion"]}
    cube = simulate(**{**REST, "frequency_ratio": [0.8, 1.1]}, **run, draws=DRAWS)
    worst_of = worst(cube.peak_displacement, "draw")
    assert worst_of.values.tolist() == cube.peak_displacement.max("draw").values.tolist()
    assert "restitution" not in worst_of.coords
    assert (share(cube.peak_displacement, "draw", above=0.0) == 1.0).all()
    assert basin_fractions(cube, "frequency_ratio").of.max() == 4
    others = {name: rule for name, rule in DRAWS.items() if name not in INITIAL_NAMES}
    with pytest.raises(ValueError, match="the cube has no starts"):
        basin_fractions(simulate(**REST, **run, draws=others))


@pytest.mark.parametrize("given", MISTAKES["starts in Python"], ids=str)
def test_refused_in_python(given: list[Any]) -> None:
    change, *parts = given
    if "state" in change:
        change = change | {"state": State(0, 0, 0, 0)}
    with pytest.raises((ValueError, TypeError), match=r"initial|state|draw") as caught:
        simulate(**SCENE, transient=10**8, periods=1, **change)
    for part in parts:
        assert part in str(caught.value)
    assert "pydantic" not in str(caught.value)


# --- study files


STUDY = """\
title: Starts
source: ours
parameters:
  mass_ratio: 0.1
  damping_ratio: 0.05
  frequency_ratio: 0.8
  phase: 0.1
axes:
  clearance: {values: [0.5, 1, 2]}
transient: 1
periods: 2
observers:
  bursts:
"""
RANDOM = """\
draws:
  count: 5
  seed: 1
  initial_position: [-1, 1]
  restitution: {range: [1e-3, 1], spacing: log, values: [0, 1], share: 0.1, assumed: ours}
"""


def test_draws_of_a_study(tmp_path: Path) -> None:
    study = load(tmp_path, STUDY.replace("[0.5, 1, 2]", "[0.5, 1, 2], follow: both") + RANDOM)
    again = load(tmp_path, study.to_yaml())
    assert again == study
    assert again.to_yaml() == study.to_yaml()
    assert list(study.drawn) == ["restitution", "initial_position"]
    assert study.ends["restitution"] == (1e-3, 1.0, 0.0, 1.0)
    assert study.values["restitution"] == "at random: 0.001 to 1, log-uniform or 0, 1 (10%)"
    assert study.origins["restitution"] == "assumed: ours"
    assert study.draw_settings() == {
        "count": 5,
        "seed": 1,
        "restitution": {"range": (1e-3, 1.0), "spacing": "log", "values": (0.0, 1.0), "share": 0.1},
        "initial_position": {"range": (-1.0, 1.0), "spacing": "linear"},
    }
    assert estimate(study).runs == 3 * 2 * 5
    # As text, too: Snakemake's reader makes text of 1e-3.
    (tmp_path / "config" / "studies").mkdir(parents=True)
    (tmp_path / "config" / "studies" / "starts.yaml").write_text(STUDY + RANDOM)
    mapping = {"count": "7", "restitution": {"range": ["1e-3", "2e-3"]}}
    config = {"studies": ["starts"], "overrides": {"starts": {"draws": mapping}}}
    settings = load_config(config, tmp_path).studies["starts"].draw_settings()
    assert (settings["count"], settings["restitution"]["range"]) == (7, (1e-3, 2e-3))


def test_jobs_that_share_the_draws_make_the_same_cube(tmp_path: Path) -> None:
    """With directions of a continuation, an axis that is fanned, and noise of each draw."""
    noise = "{kind: noise, seed: draw, step: 0.4, duration: 60, band: [0.2, 1.5]}"
    text = STUDY.replace("[0.5, 1, 2]", "[0.5, 1], follow: both").replace("phase", "restitution")
    text += "draws: {count: 5, seed: 1, mass_ratio: [0.05, 0.2]}\nforcing: " + noise
    text = text.replace("  mass_ratio: 0.1\n", "", 1)
    text = text.replace("axes:\n", "axes:\n  initial_position: {values: [-1, 1], fan: FAN}\n")
    cubes = []
    for fan, jobs, parts in (("false", 1, 1), ("true", 1, 2), ("true", 3, 6)):
        study = load(tmp_path, f"{text.replace('FAN', fan)}\njobs: {jobs}\n")
        assert len(study.parts(ENGINE)) == parts
        cubes.append(cube_of(study))
        cubes[-1].attrs.pop("study")
    assert estimate(study).slices == 6
    assert cubes[0].sizes["draw"] == 5
    assert len(set(cubes[0].noise_seed.values)) == 5
    for other in cubes[1:]:
        xr.testing.assert_identical(cubes[0], other)


def test_a_drawn_quantity_decides_the_model(tmp_path: Path) -> None:
    """Any of its values counts."""
    text = STUDY.replace("axes:\n", "  restitution: 0.5\naxes:\n") + RANDOM.rpartition("  rest")[0]
    assert load(tmp_path, text).main_feature == "rigid"
    support = "{range: [1e-3, 1], values: [0], share: 0.5}"
    study = load(tmp_path, text + f"  support_stiffness_ratio: {support}\n")
    assert study.main_feature == "grounded"


def test_initial_quantities_among_parameters_and_axes(tmp_path: Path) -> None:
    text = STUDY.replace("  phase: 0.1\n", "  initial_velocity: 0.5\n  restitution: 0.6\n")
    text = text.replace("axes:\n", "axes:\n  initial_position: {values: [-1, 1], fan: true}\n")
    study = load(tmp_path, text)
    assert study.fixed["initial_velocity"] == 0.5
    assert study.slices() == [{"initial_position": -1.0}, {"initial_position": 1.0}]
    assert study.slice_path({"initial_position": -1.0}) == "initial_position~-1"


@pytest.mark.parametrize("name", MISTAKES["starts"])
def test_mistake_is_told(tmp_path: Path, name: str) -> None:
    old, new, more, *parts = MISTAKES["starts"][name]
    text, old = STUDY + RANDOM, RANDOM if old == "RANDOM" else old
    assert not old or text.count(old) == 1
    message = blame(tmp_path, (text.replace(old, new) if old else text) + more)
    for part in parts:
        assert part in message, message


def test_resonance_in_a_grid_is_told(tmp_path: Path) -> None:
    text = (
        (STUDY + RANDOM)
        .replace("  damping_ratio: 0.05\n  frequency_ratio: 0.8\n", "")
        .replace(
            "axes:\n",
            "axes:\n  damping_ratio: {start: 0, stop: 0.1, num: 3}\n"
            "  frequency_ratio: {start: 0.5, stop: 1.5, step: 0.1}\n",
        )
    )
    assert "no steady linear response" in blame(tmp_path, text + "initial: steady\n")
    load(tmp_path, text.replace("stop: 1.5", "stop: 0.9") + "initial: steady\n")
