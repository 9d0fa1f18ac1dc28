"""Masses that a study lists: what each has of its own, its quantities as axes, what is refused."""

import json
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from jsonschema import Draft202012Validator
from studies import MISTAKES, blame, cube_of, load

import damper
from damper.analysis.orbits import follow_orbits
from damper.notebook.accessor import CubeAccessor
from damper.parameters.named import named_quantity
from damper.sweep.record import recorded
from damper.sweep.runs import run_points

ROOT = Path(__file__).parents[2]
SCHEMA = Draft202012Validator(json.loads((ROOT / "config/schema/study.schema.json").read_text()))
STUDY = """\
title: Two unlike masses
source: our own
parameters: {damping_ratio: 0.05, frequency_ratio: 0.8, restitution: 0.6}
masses:
  - {mass_ratio: 0.1, clearance: {value: 1, stated: table 2}}
  - {mass_ratio: {value: 0.02, assumed: light}, restitution: 0.3}
axes: {clearance_1: {values: [0.5, 2]}}
draws: {count: 2, seed: 1, gravity_0: [0, 0.2]}
transient: 1
periods: 3
observers: {response: , bursts: {bodies: [0, 1], records: 2}}
"""
COMMON = {"damping_ratio": 0.05, "frequency_ratio": 0.8, "restitution": 0.6}


def test_a_study_is_the_same_as_simulate(tmp_path: Path) -> None:
    text = STUDY.replace("restitution: 0.6}", "restitution: 0.6, clearance: 9}")  # no mass takes it
    study = load(tmp_path, text)
    assert SCHEMA.is_valid(yaml.safe_load(text))
    again = load(tmp_path, study.to_yaml())
    assert again.to_yaml() == study.to_yaml()
    cube = cube_of(study)
    same = damper.simulate(
        **COMMON,
        masses=[
            {"mass_ratio": 0.1, "clearance": 1.0},
            {"mass_ratio": 0.02, "restitution": 0.3, "clearance": [0.5, 2.0]},
        ],
        draws={"count": 2, "seed": 1, "gravity_0": [0, 0.2]},
        transient=1,
        periods=3,
        observers={"response": {}, "bursts": {"bodies": [0, 1], "records": 2}},
    )
    assert cube.rms_displacement.dims == ("clearance_1", "draw")
    assert cube.burst_onset.dims == ("clearance_1", "draw", "body", "burst")
    assert {*cube.coords} == {*same.coords}
    for name in (*same.data_vars, *same.coords):
        assert np.array_equal(cube[name], same[name], equal_nan=True), name
    assert cube.clearance_0.attrs["stated"] == "table 2"
    assert cube.mass_ratio_1.attrs["assumed"] == "light"
    assert study.values["clearance_1"] == "0.5, 2 F0/K"
    # Each point is that damper, and its cube says how to run it again.
    place = cube.isel(clearance_1=1, draw=0)
    masses: list[dict[str, float]] = [
        {"mass_ratio": 0.1, "clearance": 1.0, "gravity": float(place.gravity_0)},
        {"mass_ratio": 0.02, "restitution": 0.3, "clearance": 2.0},
    ]
    p = damper.Parameters(mass_ratio=9.0, clearance=9.0, **COMMON, masses=masses)
    found, _ = run_points([p.given], ["response"], transient=1, periods=3)
    assert float(place.rms_displacement) == found["rms_displacement"][0]
    assert recorded(place.drop_vars("draw"))["masses"] == 2
    assert CubeAccessor(place).run().parameters.masses == p.masses


def test_si_units(tmp_path: Path) -> None:
    text = STUDY.replace(
        "damping_ratio: 0.05, frequency_ratio: 0.8",
        "primary_mass: 2, stiffness: 200, damping: 2, force_amplitude: 10, forcing_frequency: 8",
    )
    text = text.replace("mass_ratio: 0.1, clearance", "free_mass: 0.2, gap")
    text = text.replace("mass_ratio: {value: 0.02", "free_mass: {value: 0.04")
    text = text.replace("clearance_1: {values: [0.5, 2]}", "gap_1: {values: [0.05, 0.2]}")
    text = text.replace("value: 1,", "value: 0.1,").replace(
        "gravity_0: [0, 0.2]}", "gravity_0: [0, 1]}"
    )
    made, cube = cube_of(load(tmp_path, text)), cube_of(load(tmp_path, STUDY))
    assert made.gap_1.attrs["units"] == "m"
    assert made.gravity_0.values == pytest.approx(5 * cube.gravity_0.values, rel=1e-15)
    assert made.rms_displacement.values == pytest.approx(0.05 * cube.rms_displacement.values, 1e-9)


def test_corners_have_each_mass_at_all_ends_it_knows(tmp_path: Path) -> None:
    ends = "phase: [0, 1], gravity_0: [0, 1], gravity_1: [1, 2], clearance_2: [3, 4]"
    text = STUDY.replace("gravity_0: [0, 0.2]", ends)
    study = load(tmp_path, text.replace("axes:", "  - {mass_ratio: 3}\naxes:"))
    found = [
        {(p.phase, p.each[k].gravity, p.each[k].clearance) for p in study.corners} for k in range(3)
    ]
    assert found == [
        {*product((0.0, 1.0), (0.0, 1.0), (1.0,))},
        {*product((0.0, 1.0), (1.0, 2.0), (0.5, 2.0))},
        {*product((0.0, 1.0), (0.0,), (3.0, 4.0))},
    ]
    assert len(study.corners) == 2 * 2 * 4  # of 32: the masses go through theirs side by side


ORBITS = """\
title: Periodic motions of two unlike masses
source: our own
parameters: {damping_ratio: 0.1, frequency_ratio: 1, restitution: 0.5}
masses:
  - {mass_ratio: 0.1, clearance: 3}
  - {mass_ratio: 0.09, gravity: 0.05}
axes: {clearance_1: {values: [3.5, 3.6]}}
transient: 100
periods: 3
observers: {stroboscopic_section: }
orbits: {a: {along: clearance_1, start: 3.5, max_orbits: 2}}
"""


@pytest.mark.parametrize("friction", ["", "friction: 0.05, "])
def test_orbits_along_a_quantity_of_one_mass(tmp_path: Path, friction: str) -> None:
    """That at the start is on the section of the study's runs."""
    text = ORBITS.replace("gravity: 0.05", f"{friction}gravity: 0.05")
    study = load(tmp_path, text)
    assert SCHEMA.is_valid(yaml.safe_load(text))
    entries = {name: {"settle": 100, **entry.model_dump()} for name, entry in study.orbits.items()}
    found = follow_orbits(entries, study.fixed, study.axis_values, masses=len(study.masses))
    at = int(np.flatnonzero(found.value == 3.5)[0])
    cube = cube_of(study)
    for name in ("displacement", "velocity"):
        known = cube[name].sel(clearance_1=3.5).values
        assert found[name].values[at, 0] == pytest.approx(known, abs=1e-9)
    assert found.word[at] == "R1 L1 | R1 L1"


WRONG = MISTAKES["masses"]


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_said_once(name: str, tmp_path: Path) -> None:
    old, new, *said = WRONG[name]
    assert old in STUDY
    message = blame(tmp_path, STUDY.replace(old, new, 1))
    for words in said:
        assert words in message


def test_equal_masses_in_a_study(tmp_path: Path) -> None:
    text = f"""\
title: Equal masses
source: our own
parameters: {COMMON | {"mass_ratio": 0.1}}
masses: {{count: 3, clearance_spread: 0.2}}
axes: {{clearance: {{values: [1, 2]}}}}
transient: 1
periods: 3
observers: {{response: }}
"""
    study = load(tmp_path, text)
    assert SCHEMA.is_valid(yaml.safe_load(text))
    assert load(tmp_path, study.to_yaml()).to_yaml() == study.to_yaml()
    for clearance, found in zip((1.0, 2.0), cube_of(study).rms_displacement, strict=True):
        each = [{"mass_ratio": 0.1 / 3, "clearance": part * clearance} for part in (0.8, 1.0, 1.2)]
        given = {"transient": 1, "periods": 3, "observers": ["response"]}
        same = damper.simulate(**COMMON, masses=each, **given)
        assert float(found) == pytest.approx(float(same.rms_displacement), rel=1e-12)
    for wrong, words in (
        ("count: 0", "masses.count\n    out of range (value: 0)"),
        ("share: 3", "masses.share\n    unknown key 'share'"),
    ):
        assert words in blame(tmp_path, text.replace("count: 3", wrong))


def test_masses_replace_those_of_a_damper_in_any_form() -> None:
    p = damper.Parameters(0.1, 0.05, 0.8, 2.0, 0.6)
    equal = {"count": 2, "clearance_spread": 0.1}
    found = damper.events(p, masses=equal, until=20.0)
    assert np.array_equal(found, damper.events(p, masses=damper.equal_masses(**equal), until=20.0))
    assert {0, 1} == {*found["body"].tolist()}


def test_a_value_that_no_mass_takes_is_not_varied() -> None:
    """It may be there, and does nothing."""
    each = [{"clearance": 1.0}, {"clearance": 1.2}]
    p = damper.Parameters(0.1, 0.05, 0.8, 2.0, 0.6, masses=each)
    made = damper.simulate(p, transient=1, periods=1)
    assert {"clearance_0", "restitution"} <= {*made.coords}
    assert "clearance" not in made.coords
    on_structure = damper.SIParameters(
        structure=damper.Structure(mass=[[1]], stiffness=[[1]], boxes={"top": [1]}),
        forcing="none",
        masses=[{"free_mass": 0.1, "gap": 1.0, "restitution": 0.5}],
    )
    for name, ask in (
        ("clearance", lambda: damper.events(p, clearance=3.0, until=1.0)),
        ("clearance", lambda: damper.simulate(p, clearance=3.0)),
        ("clearance", lambda: named_quantity(p, "clearance")),
        ("gap", lambda: damper.events(on_structure, gap=2.0, until=1.0)),
        ("gap", lambda: damper.simulate(on_structure, gap=[1.0, 2.0])),
    ):
        with pytest.raises(ValueError, match=f"^{name}: each of masses has its own.*give {name}_0"):
            ask()


SLIPS: list[tuple[dict[str, Any], str]] = [
    (
        {"masses": [{}, {}], "clearance_2": 1.0},
        r"^clearance_2 = 1\.0: is of mass 2, and masses has",
    ),
    ({"clearance_0": 1.0}, r"^clearance_0 = 1\.0: is of mass 0, and there is no list masses"),
    ({"masses": [{"clearance": 2}], "clearance_0": 1.0}, r"^clearance_0 is given, and in masses"),
    ({"masses": [{"mass_ratio": 1}, {}]}, r"^missing parameters, of all masses .*: mass_ratio$"),
    ({"masses": [{"clearance": 1}], "clearance": [1, 2]}, "^clearance: each of masses has its own"),
    (
        {"masses": [{"clearance": 1}], "draws": {"count": 2, "seed": 1, "clearance": [1, 2]}},
        "^clearance: each of masses has its own",
    ),
    ({"masses": [{"restitution": [0.1, 2]}]}, r"^mass 0: restitution = 2\.0: must be a finite"),
]


@pytest.mark.parametrize(("given", "message"), SLIPS, ids=lambda part: str(part)[:40])
def test_arguments_that_are_refused(given: dict[str, Any], message: str) -> None:
    more = {} if "{'mass_ratio'" in str(given) else {"mass_ratio": 0.1}
    with pytest.raises((ValueError, TypeError), match=message):
        damper.simulate(**{**COMMON, "clearance": 1.0, **more, **given}, transient=1, periods=1)
