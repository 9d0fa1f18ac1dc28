"""Where runs start: axes, draws and steady starts, in Python and in study files."""

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from damper import State, simulate
from damper.parameters.quantities import INITIAL_NAMES, INITIAL_QUANTITIES
from damper.parameters.units import attributes_of
from damper.study.config import ConfigError, Study, load_config, load_study
from damper.sweep.branches import draws
from damper.sweep.cube import CONVENTIONS, gather, write_cube
from damper.sweep.slices import read_slice, simulate_slice, write_slice

SCENE: dict[str, Any] = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.8,
    "clearance": 0.5,
    "restitution": 0.6,
    "phase": 0.2,
}
SEEN: dict[str, Any] = {"stroboscopic_section": {"free_mass": True}, "impacts": {}, "bursts": {}}
RUN: dict[str, Any] = {"transient": 0, "periods": 4, "observers": SEEN}
RANGES = {"initial_position": [-1, 1], "initial_relative_velocity": [-0.5, 2]}


def state(x: float, v: float, place: float, relative: float, d: float = 0.5) -> State:
    """The start by hand."""
    return State(x, v, x + place * d, v + relative)


# --- grids


def test_grid_of_initial_quantities() -> None:
    """Each point equals a run from the state made by hand; the walls are exact."""
    axes = {
        "initial_displacement": [0.3, -0.2],
        "initial_velocity": [0.5],
        "initial_position": [-1, 0, 0.25, 1],
        "initial_relative_velocity": [0.0, -0.4, 0.4],
    }
    cube = simulate(**SCENE, **axes, **RUN)
    assert cube.displacement.dims == (*axes, "sample")
    for place in itertools.product(*axes.values()):
        where = dict(zip(axes, place, strict=True))
        alone = simulate(**SCENE, **RUN, state=state(*place))
        for name, variable in alone.data_vars.items():
            # Not chaotic within four periods: y of a state rounds otherwise.
            np.testing.assert_allclose(
                cube[name].sel(where).values, variable.values, rtol=1e-6, atol=1e-8, err_msg=name
            )
        alone = simulate(**SCENE, **where, **RUN)
        # The attributes count runs.
        alone, part = (one.drop_attrs(deep=False) for one in (alone, cube.sel(where)))
        xr.testing.assert_identical(part, alone)
        assert cube.displacement.sel(where)[0] == place[0]
        found = float(cube.free_displacement.sel(where)[0])
        assert found == pytest.approx(place[0] + 0.5 * place[2], abs=1e-15)


def test_position_follows_the_clearance() -> None:
    """A place between the walls, not a length: 1 is the right wall of any damper."""
    cube = simulate(
        **{**SCENE, "clearance": [0.0, 0.5, 2.0]}, initial_position=[-1.0, 0.5, 1.0], **RUN
    )
    found = cube.free_displacement.isel(sample=0) - cube.displacement.isel(sample=0)
    expected = np.outer([0.0, 0.5, 2.0], [-1.0, 0.5, 1.0])
    np.testing.assert_allclose(found.transpose("clearance", "initial_position"), expected)


def test_coordinates_are_described(tmp_path: Path) -> None:
    cube = simulate(
        **SCENE,
        **RUN,
        initial_displacement=[0.0, 0.1],
        initial_velocity=0.5,
        initial={"draws": 2, "seed": 0, **RANGES},
    )
    dims = [cube[name].dims for name in INITIAL_NAMES]
    assert dims == [("initial_displacement",), (), ("draw",), ("draw",)]
    for quantity in INITIAL_QUANTITIES:
        attrs = cube[quantity.name].attrs
        assert attrs == {"long_name": quantity.long_name, **attributes_of(quantity.units)}
    assert cube.draw.values.tolist() == [0, 1]
    assert cube.draw.attrs["long_name"] == "random initial state"
    write_cube(cube, tmp_path / "cube.nc")
    with xr.open_dataset(tmp_path / "cube.nc") as back:
        xr.testing.assert_identical(back.load(), cube.assign_attrs(Conventions=CONVENTIONS))


def test_zero_is_rest() -> None:
    zeros = dict.fromkeys(INITIAL_NAMES, 0.0)
    cube, rest = simulate(**SCENE, **zeros, **RUN), simulate(**SCENE, **RUN)
    named = {"quantities": cube.attrs["quantities"]}
    assert cube.drop_vars(INITIAL_NAMES).identical(rest.assign_attrs(named))


# --- draws


def test_draws_are_a_dimension() -> None:
    """The same ones at every point, each as if given by itself."""
    settings = {"draws": 4, "seed": 11, **RANGES}
    cube = simulate(**{**SCENE, "restitution": [0.2, 0.8]}, **RUN, initial=settings)
    assert cube.displacement.dims == ("restitution", "draw", "sample")
    expected = draws(settings)
    for name, (low, high) in RANGES.items():
        assert cube[name].values.tolist() == expected[name]
        assert (low <= cube[name]).all()
        assert (cube[name] <= high).all()
        assert len(set(expected[name])) == 4
    for number, r in itertools.product(range(4), (0.2, 0.8)):
        drawn = {name: expected[name][number] for name in RANGES}
        alone = simulate(**{**SCENE, "restitution": r}, **drawn, **RUN)
        for name, variable in alone.data_vars.items():
            found = cube[name].sel(restitution=r, draw=number)
            np.testing.assert_array_equal(found.values, variable.values)


def test_draws_go_with_a_steady_start() -> None:
    initial = {"primary": "steady", "draws": 3, "seed": 1, "initial_position": [-1, 1]}
    cube = simulate(**SCENE, **RUN, initial=initial)
    steady = simulate(**SCENE, **RUN, initial="steady")
    assert (cube.displacement.isel(sample=0) == steady.displacement[0]).all()
    apart = cube.free_displacement.isel(sample=0) - cube.displacement.isel(sample=0)
    np.testing.assert_allclose(apart, 0.5 * cube.initial_position, atol=1e-15)


def test_draws_through_slices_and_files(tmp_path: Path) -> None:
    """However the study is cut into jobs, each has the same draws."""
    fan = ("phase", "restitution")
    axes = {"restitution": [0.2, 0.8], "phase": [0.0, 1.0]}
    fixed = {name: value for name, value in SCENE.items() if name not in axes}
    initial = {"draws": 3, "seed": 4, **RANGES}
    parts = []
    for place in itertools.product(*(axes[name] for name in fan)):
        part = simulate_slice(
            fixed | dict(zip(fan, place, strict=True)),
            {name: values for name, values in axes.items() if name not in fan},
            initial=initial,
            accuracy=1e-12,
            max_events=10**6,
            **RUN,
        )
        assert part.branches == {"draw": [0, 1, 2]}
        write_slice(part, tmp_path / "a.npz")
        write_slice(read_slice(tmp_path / "a.npz"), tmp_path / "b.npz")
        assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
        parts.append(read_slice(tmp_path / "b.npz"))
    cube = gather(parts, axes, fan, fixed, {})
    whole = simulate(**fixed, **axes, **RUN, initial=initial)
    for name in whole.variables:
        xr.testing.assert_identical(cube[name].variable, whole[name].variable)


# --- refusals in Python


@pytest.mark.parametrize(
    ("change", "parts"),
    [
        ({"initial": "stedy"}, ["initial: ", "'stedy'", "mean 'steady'?): must be rest, steady"]),
        ({"initial": {"draws": 2, "initial_position": [-1, 1]}}, ["initial.seed", "'seed' is mi"]),
        ({"initial": {"draws": 2.0, "seed": 1, **RANGES}}, ["initial.draws", "write 2"]),
        (
            {"initial": {"draws": 2, "seed": 1, "initial_position": [-1.5, 1]}},
            ["initial.initial_position[0]", "-1.5", ">= -1 and <= 1"],
        ),
        (
            {"initial": {"draws": 2, "seed": 1, **RANGES}, "initial_position": 0.5},
            ["initial_position is given, and random"],
        ),
        (
            {"initial": "steady", "initial_velocity": [0.5]},
            ["initial_velocity is given, but the primary starts on its steady response"],
        ),
        ({"initial": "steady", "state": State(0, 0, 0, 0)}, ["state stands alone"]),
        ({"initial_position": 0.0, "state": State(0, 0, 0, 0)}, ["state stands alone"]),
        ({"initial_position": 1.01}, ["initial_position = 1.01", "-1 at the left wall"]),
    ],
    ids=str,
)
def test_refused_in_python(change: dict[str, Any], parts: list[str]) -> None:
    with pytest.raises(ValueError, match=r"initial|state") as caught:
        simulate(**SCENE, transient=10**8, periods=1, **change)
    for part in parts:
        assert part in str(caught.value)
    assert "pydantic" not in str(caught.value)


def test_numpy_numbers_will_do() -> None:
    """As they do for every parameter."""
    plain = simulate(**SCENE, **RUN, initial={"draws": 2, "seed": 1, "initial_position": [-1, 1]})
    ranges = {"initial_position": np.array([-1.0, 1.0])}
    other = simulate(**SCENE, **RUN, initial={"draws": np.int64(2), "seed": np.int64(1), **ranges})
    assert other.identical(plain)


# --- study files


STUDY = """\
title: Starts
source: ours
parameters:
  mass_ratio: 0.1
  damping_ratio: 0.05
  frequency_ratio: 0.8
  restitution: 0.6
axes:
  clearance: {values: [0.5, 1, 2]}
transient: 1
periods: 2
observers:
  bursts:
"""
INITIAL = "initial: {draws: 5, seed: 1, initial_position: [-1, 1], initial_velocity: [0, 2]}\n"


def load(folder: Path, text: str) -> Study:
    path = folder / "starts.yaml"
    path.write_text(text)
    return load_study(path)


def blame(folder: Path, text: str) -> str:
    with pytest.raises(ConfigError) as caught:
        load(folder, text)
    message = str(caught.value)
    for jargon in ("pydantic", "type=", "input_", "Traceback", "https:", "tuple", "dict"):
        assert jargon not in message
    return message.replace(f"{folder}/", "")


def test_canonical_text_is_a_fixed_point(tmp_path: Path) -> None:
    more = INITIAL.replace("initial_velocity: [0, 2]", "primary: steady")
    text = (STUDY + more).replace("[0.5, 1, 2]", "[0.5, 1, 2], follow: both")
    study = load(tmp_path, text)
    assert study.follow == {"clearance": "both"}
    again = load(tmp_path, study.to_yaml())
    assert again == study
    assert again.to_yaml() == study.to_yaml()
    assert again.initial.settings() == study.initial.settings()


def test_settings_of_draws(tmp_path: Path) -> None:
    study = load(tmp_path, STUDY + INITIAL)
    assert study.initial.settings() == {
        "primary": "rest",
        "draws": 5,
        "seed": 1,
        "initial_position": (-1.0, 1.0),
        "initial_velocity": (0.0, 2.0),
    }
    assert study.initial.random == ("initial_velocity", "initial_position")
    # As text, too: Snakemake's reader makes text of 1e-3.
    (tmp_path / "config" / "studies").mkdir(parents=True)
    (tmp_path / "config" / "studies" / "starts.yaml").write_text(STUDY)
    mapping = {"draws": "5", "seed": "1", "initial_velocity": ["1e-3", "2"]}
    config = load_config(
        {"studies": ["starts"], "overrides": {"starts": {"initial": mapping}}}, tmp_path
    )
    settings = config.studies["starts"].initial.settings()
    assert settings["initial_velocity"] == (0.001, 2.0)
    assert (settings["draws"], settings["seed"]) == (5, 1)


def test_initial_quantities_among_parameters_and_axes(tmp_path: Path) -> None:
    text = STUDY.replace("parameters:\n", "parameters:\n  initial_velocity: 0.5\n")
    text = text.replace("axes:\n", "axes:\n  initial_position: {values: [-1, 1], fan: true}\n")
    study = load(tmp_path, text)
    assert study.fixed["initial_velocity"] == 0.5
    assert study.slices() == [{"initial_position": -1.0}, {"initial_position": 1.0}]
    assert study.slice_path({"initial_position": -1.0}) == "initial_position~-1"


TABLE = "tables:\n  edges: {kind: intervals, along: clearance}\n"
UP = ("[0.5, 1, 2]", "[0.5, 1, 2], follow: up")
MISTAKES: dict[str, tuple[tuple[str, str], str, list[str]]] = {
    "word": (("", ""), "initial: stedy\n", ["initial\n", "(value: 'stedy')", "rest, steady"]),
    "symbol": (
        ("", ""),
        INITIAL.replace("initial_velocity", "v0"),
        ["starts.yaml:14  initial.v0", "did you mean 'initial_velocity'?"],
    ),
    "no seed": (
        ("", ""),
        INITIAL.replace("seed: 1, ", ""),
        ["starts.yaml:14  initial.seed", "'seed' is missing: draws are random", "integer >= 0"],
    ),
    "no draws": (
        ("", ""),
        INITIAL.replace("draws: 5, ", ""),
        ["initial.draws", "'initial_velocity' is for random initial states, but 'draws' is mis"],
    ),
    "no range": (
        ("", ""),
        "initial: {draws: 5, seed: 1}\n",
        ["starts.yaml:14  initial\n", "no quantity has a range", "initial_position: [low, high]"],
    ),
    "out of the box": (
        ("", ""),
        INITIAL.replace("[-1, 1]", "[-1, 1.5]"),
        [
            "starts.yaml:14  initial.initial_position[1]",
            "out of range (value: 1.5)\n    allowed: number >= -1 and <= 1",
        ],
    ),
    "backwards": (("", ""), INITIAL.replace("[0, 2]", "[2, 0]"), ["low must be less than high"]),
    "random and fixed": (
        ("parameters:\n", "parameters:\n  initial_position: 0.5\n"),
        INITIAL,
        [
            "starts.yaml:15  initial.initial_position",
            "'initial_position' is random here and given under parameters as well",
            "one of the two",
        ],
    ),
    "steady and displaced": (
        ("parameters:\n", "parameters:\n  initial_displacement: 0.5\n"),
        "initial: steady\n",
        [
            "starts.yaml:4  parameters.initial_displacement",
            "given, but the primary starts on its steady response",
        ],
    ),
    "steady and random": (
        ("", ""),
        INITIAL.replace("{draws", "{primary: steady, draws"),
        ["initial.initial_velocity", "given, but the primary starts on its steady response"],
    ),
    "resonance": (
        ("damping_ratio: 0.05\n  frequency_ratio: 0.8", "damping_ratio: 0\n  frequency_ratio: 1"),
        "initial: steady\n",
        ["starts.yaml:14  initial.primary", "there is no steady linear response", "rest"],
    ),
    "steady and missing": (
        ("  damping_ratio: 0.05\n", ""),
        "initial: steady\n",
        ["'damping_ratio' is not given", "1 error "],
    ),
    "fan and follow": (
        ("[0.5, 1, 2]", "[0.5, 1, 2], follow: both, fan: true"),
        "",
        [
            "starts.yaml:9  axes.clearance.fan",
            "fan and follow (both) are both given",
            "cannot be cut into jobs",
            "1 error ",
        ],
    ),
    "follow two": (
        ("[0.5, 1, 2]}", "[0.5, 1, 2], follow: up}\n  phase: {values: [0, 1], follow: down}"),
        "",
        ["starts.yaml:10  axes.phase.follow", "'clearance' is followed already", "one axis"],
    ),
    "follow a start": (
        ("axes:\n", "axes:\n  initial_position: {values: [0, 1], follow: up}\n"),
        "",
        ["axes.initial_position.follow", "sets where a run starts, so it cannot be followed"],
    ),
    "follow and a table": (
        UP,
        TABLE,
        ["tables.edges", "several at each point (direction)", "without follow and without draws"],
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistake_is_told(tmp_path: Path, name: str) -> None:
    (old, new), more, parts = MISTAKES[name]
    assert not old or STUDY.count(old) == 1
    message = blame(tmp_path, STUDY.replace(old, new) + more if old else STUDY + more)
    for part in parts:
        assert part in message, message


def test_resonance_in_a_grid_is_told(tmp_path: Path) -> None:
    text = STUDY.replace("  damping_ratio: 0.05\n  frequency_ratio: 0.8\n", "").replace(
        "axes:\n",
        "axes:\n  damping_ratio: {start: 0, stop: 0.1, num: 3}\n"
        "  frequency_ratio: {start: 0.5, stop: 1.5, step: 0.1}\n",
    )
    assert "no steady linear response" in blame(tmp_path, text + "initial: steady\n")
    load(tmp_path, text.replace("stop: 1.5", "stop: 0.9") + "initial: steady\n")


def test_table_beside_a_steady_start(tmp_path: Path) -> None:
    """One state at each point, so edges can be bisected from it."""
    load(tmp_path, STUDY + "initial: steady\n" + TABLE)
