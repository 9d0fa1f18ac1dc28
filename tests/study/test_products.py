"""Figures and tables in study files: what is accepted, and what is said of each mistake."""

from itertools import combinations
from pathlib import Path
from typing import Any

import pytest
import yaml
from studies import MISTAKES

import damper
from damper.figures import draw
from damper.observers import OBSERVERS, make_observers
from damper.study.config import ConfigError, Study, load_study

GOOD: dict[str, Any] = {
    "title": "t",
    "source": "s",
    "parameters": {"damping_ratio": 0.02},
    "axes": {
        "mass_ratio": {"values": [0.1, 0.2]},
        "frequency_ratio": {"start": 0.8, "stop": 1.2, "step": 0.1},
        "clearance": {"start": 0.5, "stop": 2, "step": 0.5},
        "restitution": {"values": [0.5]},
    },
    "transient": 10,
    "periods": 10,
    "observers": {
        "stroboscopic_section": None,
        "bursts": {"records": 10},
        "response": None,
        "accumulation": None,
        "trajectory": None,
    },
}
POINT = {"mass_ratio": 0.2, "frequency_ratio": 0.9, "clearance": 1.5}
PLACE = {"frequency_ratio": 0.9, "clearance": 1.5}
MAP = {"kind": "map", "variable": "chatter", "x": "frequency_ratio", "y": "clearance"}
CURVES = {"kind": "curves", "variables": ["rms_ratio"], "along": "frequency_ratio"}
STIFFNESSES = {"along": "contact_stiffness_ratio", "lines": "contact_tension"}
RECORDED = {"variables": ["rms_ratio", "displacement", "burst_onset"]}
CONVERGENCE = {"kind": "convergence"} | RECORDED | STIFFNESSES
#: As mistakes.yaml calls them.
FIGURE = {
    "MAP": MAP,
    "CURVES": CURVES,
    "BIFURCATION": {"kind": "bifurcation", "along": "frequency_ratio"},
    "ACCUMULATION": {"kind": "accumulation", "at": {"frequency_ratio": 1}},
    "TRAJECTORY": {"kind": "trajectory", "at": POINT},
    "FREE_MASS": {"kind": "free_mass", "at": POINT},
    "HISTORIES": {"kind": "histories", "panels": "mass_ratio", "at": PLACE},
    "PORTRAIT": {"kind": "phase_portrait", "columns": "mass_ratio", "at": PLACE},
    "BASINS": {"kind": "basins", "along": "clearance"},
    "CONVERGENCE": CONVERGENCE,
    "SPECIAL_POINTS": {"kind": "special_points", "x": "damping_ratio", "y": "clearance"},
}


def followed(way: str) -> dict[str, Any]:
    return {"axes": {"frequency_ratio": GOOD["axes"]["frequency_ratio"] | {"follow": way}}}


DRAWS = {"draws": {"count": 3, "seed": 1, "initial_position": [-1, 1]}}
PERFORMANCE = {"kind": "performance", "along": "frequency_ratio", "over": "clearance"}
IMPACTS = {"observers": {"impacts": None, "motion": None}}
START = {"axes": {"initial_displacement": {"values": [0, 1]}}}
CONTACT: dict[str, Any] = {
    "parameters": POINT | {"clearance": 1.0, "restitution": 0.5},
    "axes": {
        **dict.fromkeys(GOOD["axes"]),
        "contact_stiffness_ratio": {"values": [1e4, 1e6]},
        "contact_tension": {"values": [0, 1]},
    },
    "without": ["accumulation", "trajectory"],
}
UNLISTED = CONTACT | {"observers": {"bursts": None}}
ORBIT: dict[str, Any] = {
    "along": "clearance",
    "start": 1,
    "at": {"mass_ratio": 0.1, "frequency_ratio": 1},
    "curves": {"fold": {"restitution": [0.4, 0.6], "damping_ratio": [0.01, 0.1]}},
}
#: What is changed in the good study.
CHANGE: dict[str, dict[str, Any]] = {
    "UP": followed("up"),
    "BOTH": followed("both"),
    "DRAWS": DRAWS,
    "BRANCHES": followed("both") | DRAWS,
    "MOTION": {"observers": {"motion": None}},
    "MOTIONS": DRAWS | IMPACTS,
    "DRAWN_MOTION": DRAWS | {"observers": {"motion": None}},
    "STARTS": START | {"observers": {"motion": None}},
    "PERFORMANCE": DRAWS | IMPACTS | {"tables": {"one": PERFORMANCE}},
    "PERFORMANCE_OVER": IMPACTS
    | {"tables": {"one": PERFORMANCE | {"along": "clearance", "over": "frequency_ratio"}}},
    "PERFORMANCE_OF_WORST": followed("both")
    | DRAWS
    | IMPACTS
    | {"tables": {"one": PERFORMANCE | {"worst": ["draw", "direction"]}}},
    "CONTACT": CONTACT,
    "UNLISTED": UNLISTED,
    "UNLISTED_TABLE": UNLISTED | {"tables": {"one": CONVERGENCE}},
    "FOLLOWED": {"orbits": {"two": ORBIT}},
}


def load(folder: Path, figure: dict[str, Any], **changes: Any) -> Study:
    """Load the good study with a figure and changes: a null axis is left out."""
    study: dict[str, Any] = {**GOOD, "figures": {"one": figure} if figure else {}}
    without = changes.pop("without", [])
    for section, change in changes.items():
        study[section] = {**GOOD.get(section, {}), **change}
    study["axes"] = {name: axis for name, axis in study["axes"].items() if axis}
    study["observers"] = {n: one for n, one in study["observers"].items() if n not in without}
    path = folder / "good.yaml"
    path.write_text(yaml.safe_dump(study, sort_keys=False))
    return load_study(path)


def asked(row: list[Any]) -> tuple[dict[str, Any], dict[str, Any], list[str]]:
    """Return the figure of a row of mistakes.yaml, what is changed in the study, what is said."""
    base, change, *parts = row
    figure = (base if isinstance(base, dict) else FIGURE.get(base, {})) | change
    changes: dict[str, Any] = {}
    if parts and (isinstance(parts[0], dict) or parts[0] in CHANGE):
        named = parts.pop(0)
        changes = named if isinstance(named, dict) else CHANGE[named]
    return {k: v for k, v in figure.items() if v is not None}, dict(changes), parts


@pytest.mark.parametrize("name", MISTAKES["figures"])
def test_refused(tmp_path: Path, name: str) -> None:
    figure, changes, parts = asked(MISTAKES["figures"][name])
    with pytest.raises(ConfigError) as caught:
        load(tmp_path, figure, **changes)
    message = str(caught.value)
    assert message.startswith("1 error "), message
    for jargon in ("pydantic", "type=", "Traceback", "tuple", "None"):
        assert jargon not in message
    for part in parts:
        assert part in message, message


@pytest.mark.parametrize("row", MISTAKES["accepted"], ids=str)
def test_accepted(tmp_path: Path, row: list[Any]) -> None:
    figure, changes, _ = asked(row)
    load(tmp_path, figure, **changes)


@pytest.mark.parametrize("figure", [MAP, CURVES | {"lines": "clearance"}])
def test_a_file_for_each_value(tmp_path: Path, figure: dict[str, Any]) -> None:
    def places(change: dict[str, Any]) -> dict[str, Any]:
        files = load(tmp_path, figure | change).files("figures")
        return {path: settings["at"] for path, (_, settings) in files.items()}

    assert places({"each": "mass_ratio"}) == {
        "figures/one_mass_ratio~0.1": {"mass_ratio": 0.1},
        "figures/one_mass_ratio~0.2": {"mass_ratio": 0.2},
    }
    assert places({"at": {"mass_ratio": 0.1}}) == {"figures/one": {"mass_ratio": 0.1}}


# Whatever observers write.


def test_observers_that_write_one_variable_do_not_go_together(tmp_path: Path) -> None:
    written = {name: {v.name for v in make_observers([name])[0].variables} for name in OBSERVERS}
    refused = set()
    for pair in combinations(OBSERVERS, 2):
        others = [name for name in GOOD["observers"] if name not in pair]
        try:
            load(tmp_path, {}, observers=dict.fromkeys(pair), without=others)
        except ConfigError as error:
            both = "both be asked for: both write" in str(error)
            # The good study has a force, which is no mistake of the pair's.
            if both or "a force drives the damper" not in str(error):
                refused.add(pair if both else str(error))
    assert refused == {
        (one, other) for one, other in combinations(OBSERVERS, 2) if written[one] & written[other]
    }


ALL_WRITTEN = {"response": {"modulation_work": True}, "bursts": {"records": 2}}
POINTS = {"frequency_ratio": [0.8, 0.9], "clearance": [0.2, 0.4]}
DAMPER = {"mass_ratio": 0.1, "damping_ratio": 0.02, "restitution": 0.5}


@pytest.mark.parametrize("observer", OBSERVERS)
def test_every_variable_with_one_value_at_each_point_is_drawn(
    tmp_path: Path, observer: str
) -> None:
    observers = {observer: ALL_WRITTEN.get(observer)}
    run: dict[str, Any] = {"transient": 2, "periods": 5, "observers": observers}
    given = DAMPER | ({"force_amplitude": 0.0} if observer == "decay" else {})
    cube = damper.simulate(**given, **POINTS, **run)
    (made,) = make_observers(observers)
    axes = {axis: {"values": values} for axis, values in POINTS.items()}
    study = {"title": "t", "source": "s", "parameters": given, "axes": axes} | run
    path = tmp_path / "study.yaml"
    for name in [variable.name for variable in made.variables if not variable.dims]:
        for figure in (
            MAP | {"variable": name},
            CURVES | {"variables": [name], "lines": "clearance"},
        ):
            path.write_text(yaml.safe_dump(study | {"figures": {"one": figure}}))
            _, settings = load_study(path).files("figures")["figures/one"]
            assert draw(settings.pop("kind"), {"cube": cube}, **settings).axes
