"""Tables and figures of theory: how mistakes in asking for them are told."""

from pathlib import Path
from typing import Any

import pytest
import yaml
from studies import blame, load

GOOD: dict[str, Any] = {
    "title": "t",
    "source": "s",
    "parameters": {"damping_ratio": 0.02, "mass_ratio": 0.1, "frequency_ratio": 1},
    "axes": {"clearance": {"values": [1, 2, 3]}, "restitution": {"values": [0.3, 0.6]}},
    "transient": 10,
    "periods": 10,
    "observers": {"stroboscopic_section": {"when": 0.5}, "bursts": None, "impacts": None},
}
MAP = {"kind": "map", "x": "clearance", "y": "restitution", "theory": "small_mass_limit"}
LINE = {"kind": "bifurcation", "along": "clearance", "rows": "restitution"}


def test_good_ones(tmp_path: Path) -> None:
    figures = {
        "a": MAP | {"variable": "complete_fraction"},
        "b": MAP | {"variable": "chatter", "x": "restitution", "y": "clearance"},
        "c": LINE | {"theory": "two_impacts"},
    }
    tables = {"a": {"kind": "two_impacts", "along": "clearance"}}
    study = load(tmp_path, GOOD | {"figures": figures, "tables": tables})
    drawn = {path: settings for path, (_, settings) in study.files("figures").items()}
    assert drawn["figures/a"]["theory"] == "small_mass_limit"
    assert drawn["figures/c"]["theory"] == "two_impacts"
    assert study.tables["a"].resolution == 1e-3


STUDY = Path(__file__).parents[1] / "study"
MISTAKES = yaml.safe_load((STUDY / "mistakes.yaml").read_text())["closed forms"]


@pytest.mark.parametrize("name", MISTAKES)
def test_refused(tmp_path: Path, name: str) -> None:
    changes, *parts = MISTAKES[name]
    message = blame(tmp_path, GOOD | changes)
    assert message.startswith("1 error "), message
    for part in parts:
        assert part in message, message


@pytest.mark.parametrize(
    "asked",
    [
        {"figures": {"a": MAP | {"variable": "chatter"}}},
        {"figures": {"a": LINE | {"theory": "two_impacts"}}},
        {"tables": {"a": {"kind": "two_impacts", "along": "clearance"}}},
    ],
)
def test_other_models_are_refused(tmp_path: Path, asked: dict[str, Any]) -> None:
    parameters = GOOD["parameters"] | {"support_stiffness_ratio": 0.1}
    message = blame(tmp_path, GOOD | {"parameters": parameters} | asked)
    assert "its formulas are those of rigid walls alone, this damper has a support" in message
    load(tmp_path, GOOD | {"parameters": parameters, "figures": {"a": LINE}})
