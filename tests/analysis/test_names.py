"""What `damper.analysis` offers is there, documented, and loaded late."""

import inspect
import math
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import xarray as xr
import yaml
from new_process import modules_after

import damper
from damper.analysis import HOME

SOURCE = Path(damper.__file__).parent
STUDIES = Path(__file__).parents[2] / "docs/studies.md"


def test_every_function_is_there_and_in_the_documents() -> None:
    text = STUDIES.read_text()
    for name in HOME:
        assert inspect.isfunction(getattr(damper.analysis, name))
        assert f"`{name}`" in text


OTHERS = ["stroboscopic_section", "impacts", "response", "motion"]
LISTS = {"bursts": {"records": 2}, "accumulation": {"bursts": 2, "impacts": 4}}
GIVEN: dict[str, Any] = {
    **{"mass_ratio": 0.1, "damping_ratio": 0.02, "frequency_ratio": [1.2, 1.3]},
    **{"clearance": [0.05, 5.0], "restitution": [0.3, 0.35], "transient": 2, "periods": 2},
    "observers": {**LISTS, **dict.fromkeys(OTHERS)},
}
CUBE = damper.simulate(**GIVEN)
POINT = GIVEN | {"frequency_ratio": 1.3, "clearance": 0.05, "restitution": 0.6}
STARTS = damper.simulate(**POINT | {"initial_displacement": [0.0, 1.0], "observers": ["motion"]})
CONTACT = damper.simulate(
    **POINT | {"contact_stiffness_ratio": [1e3, 1e4], "observers": ["response", "motion"]}
)
NOISE = damper.simulate(
    **GIVEN | {"frequency_ratio": 1.0, "clearance": 3.0, "observers": ["statistics"]},
    forcing=damper.Noise(seed=1, step=0.1, duration=40.0, band=(0.0, 6.0)),
)
CUBES = {"basin_fractions": STARTS, "distance_to_rigid": CONTACT, "means_under_noise": NOISE}
#: What functions take that has no default, and what keeps them from bisecting for long.
NEEDED = {
    **{"along": "restitution", "low": 0.1, "high": 0.9, "variables": ["rms_ratio"]},
    **{"resolution": 0.2, "periods": [1, 1, 2, 2], "parameter": [1.0, 2.0], "distance": [2.0, 1.0]},
    **{"array": CUBE.rms_ratio, "over": "clearance", "above": 1},
}
FUNCTIONS = {name: getattr(damper.analysis, name) for name in HOME}


def arguments(name: str) -> dict[str, Any]:
    """Return what a call of the function needs."""
    parameters = inspect.signature(FUNCTIONS[name]).parameters.values()
    cube = {"cube": CUBES.get(name, CUBE)}
    needed = [p.name for p in parameters if p.default is p.empty or p.name == "resolution"]
    return {name: (cube | NEEDED)[name] for name in needed}


@pytest.mark.parametrize("name", HOME)
def test_what_is_no_cube_is_refused(name: str) -> None:
    given = arguments(name)
    if "cube" in given:
        with pytest.raises(TypeError, match=r"cube is a \w+: must be an xarray.Dataset"):
            FUNCTIONS[name](**given | {"cube": CUBE.chatter})


@pytest.mark.parametrize("name", HOME)
def test_every_number_is_checked(name: str) -> None:
    """What is no number or not finite gives no table, least of all one that looks like a result."""
    given = arguments(name)
    FUNCTIONS[name](**given)
    for p in inspect.signature(FUNCTIONS[name]).parameters.values():
        ends = p.name in ("low", "high")  # a range may have no end
        for value in (math.nan, "1", None, [], *(() if ends else (math.inf, -math.inf))):
            if p.annotation in ("float", "int"):
                with pytest.raises(
                    (TypeError, ValueError), match=f"{p.name} = {value!r}".replace("[", r"\[")
                ):
                    FUNCTIONS[name](**given | {p.name: value})


def parts(cube: xr.Dataset) -> Iterator[xr.Dataset]:
    """Yield what a user may have made of a cube."""
    axis = next(name for name in cube.dims if name in cube.coords)
    yield cube.drop_vars("clearance")
    yield cube.isel({axis: 0}, drop=True)
    yield cube.isel({axis: slice(0, 0)})
    yield cube.isel(dict.fromkeys(cube.dims, 0))
    yield cube.rename({axis: "axis"})
    yield cube.drop_attrs()
    yield cube.where(cube.status > 0)  # as if every run had stopped
    one = cube.isel({name: slice(-1, None) for name in cube.dims if name in GIVEN})
    for name in cube.data_vars:
        yield one.drop_vars(name)


@pytest.mark.parametrize("name", HOME)
def test_every_slip_has_a_message_of_ours(name: str) -> None:
    """In one line and from a line that raises it, not from the libraries that stumble over it."""
    given = arguments(name)
    slips = [{"cube": part} for part in parts(given["cube"])] if "cube" in given else []
    odd = ("foo", "sample", "clearance", 3, [], {}, ["rms_ratio", "x"], b"a", None, math.nan)
    names = inspect.signature(FUNCTIONS[name]).parameters
    slips += [{key: value} for key in names for value in odd]
    for slip in slips:
        caught: Exception | None = None
        try:
            FUNCTIONS[name](**given | slip)
        except (TypeError, ValueError) as error:
            caught = error
        if caught:
            last = traceback.extract_tb(caught.__traceback__)[-1]
            assert Path(last.filename).is_relative_to(SOURCE), (slip, caught)
            assert (last.line or "").startswith("raise "), (slip, caught)
            assert "\n" not in str(caught), caught


AXES = ("frequency_ratio", "clearance", "restitution")
SLIPS = yaml.safe_load((Path(__file__).parent / "mistakes.yaml").read_text())
SLIPS += [
    ("basin_fractions", {"cube": CUBE}, "the cube has no starts: make it with draws, or"),
    (
        "chatter_intervals",
        {"cube": CUBE.where(CUBE.clearance > 0.05), "along": "restitution"},
        "chatter is not known: the run at .*'clearance': 0.05.* stopped early",
    ),
    (
        "chatter_intervals",
        {"cube": CUBE.isel(dict.fromkeys(AXES, 0))},
        "axis 'restitution': there are",
    ),
    ("first_lasting_change", {"periods": CUBE}, "periods is a Dataset: must be `section_period`"),
]


@pytest.mark.parametrize(("name", "given", "message"), SLIPS)
def test_slips_are_named(name: str, given: dict[str, Any], message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        FUNCTIONS[name](**arguments(name) | given)


def test_a_run_that_stops_between_two_points_is_no_answer() -> None:
    """It has as few bursts as one without chatter."""
    given = GIVEN | {"clearance": 0.05, "frequency_ratio": 1.3, "restitution": [0.3, 0.6]}
    cube = damper.simulate(**given).assign_attrs(max_events=20)
    with pytest.raises(ValueError, match="chatter is not known: the run at"):
        damper.analysis.chatter_intervals(cube, "restitution")


def test_names_load_nothing_until_they_are_used() -> None:
    loaded = modules_after("import damper; assert 'best_clearance' in dir(damper.analysis)")
    assert not loaded & {"numpy", "pandas", "xarray"}
