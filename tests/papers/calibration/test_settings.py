"""What a study file may say of a calibration, and what is said of mistakes."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from damper.study.config import Config, ConfigError, load_config

ROOT = Path(__file__).parents[3]
BURSTS: dict[str, Any] = {
    "title": "t",
    "source": "s",
    "parameters": {"damping_ratio": 0.01, "restitution": 0.8},
    "axes": {
        "mass_ratio": {"values": [0.1, 0.2]},
        "clearance": {"values": [0.02, 0.03]},
        "frequency_ratio": {"values": [0.2, 0.25, 0.3]},
    },
    "transient": 0,
    "periods": 25,
    "observers": {"burst_at": {"time": 332}, "chatter_bursts": {"since": [0, 15]}},
}
CLEARANCE: dict[str, Any] = {
    **BURSTS,
    "axes": {
        "mass_ratio": {"values": [0.1, 0.2]},
        "frequency_ratio": {"values": [0.5]},
        "clearance": {"start": 0.5, "stop": 2, "step": 0.5},
    },
    "observers": {"bursts": None},
}
RANKING: dict[str, Any] = {"kind": "ranking", "statements": ["A3", "A4"]}
ALSO = RANKING | {"also": {"A1": "diagram"}}


def loaded(folder: Path, config: dict[str, Any] | None = None, **studies: dict[str, Any]) -> Config:
    """Configuration of studies that are given."""
    files = folder / "config/studies"
    files.mkdir(parents=True, exist_ok=True)
    for name, study in studies.items():
        (files / f"{name}.yaml").write_text(yaml.safe_dump(study))
    return load_config(config or {"studies": list(studies)}, folder)


def blamed(folder: Path, config: dict[str, Any] | None = None, **studies: dict[str, Any]) -> str:
    """Return the message, of one mistake only."""
    with pytest.raises(ConfigError) as caught:
        loaded(folder, config, **studies)
    message = str(caught.value)
    assert message.startswith("1 error "), message
    return message


def with_table(study: dict[str, Any], table: dict[str, Any], **changes: Any) -> dict[str, Any]:
    return {**study, "tables": {"one": table}, **changes}


@pytest.mark.parametrize("kind", ["ranking", "profiles"])
def test_accepted(tmp_path: Path, kind: str) -> None:
    entry = ALSO | {"kind": kind, "preset": {"clearance": 0.03}}
    section = "tables" if kind == "ranking" else "figures"
    found = loaded(tmp_path, chatter={**BURSTS, section: {"one": entry}}, diagram=CLEARANCE)
    product = getattr(found.studies["chatter"], section)["one"]
    assert product.beside == {"A1": "diagram"}
    assert product.statements == ("A3", "A4")


MISTAKES = {
    "statement": (
        RANKING | {"statements": ["A3", "A6"]},
        {},
        ("statements[1]", "not one of the choices (value: 'A6')", "allowed: A1, A1_contact, A3"),
    ),
    "observer": (
        RANKING,
        {"observers": {"chatter_bursts": None}},
        ("tables.one", "A3 needs burst_at among the observers"),
    ),
    "frequency": (
        RANKING,
        {"axes": BURSTS["axes"] | {"frequency_ratio": {"values": [0.2, 0.24]}}},
        ("A4 needs an axis frequency_ratio with the values 0.2, 0.25",),
    ),
    "no set": (
        RANKING | {"statements": ["A3"]},
        {
            "parameters": BURSTS["parameters"] | {"mass_ratio": 0.1, "clearance": 0.1},
            "axes": {"frequency_ratio": {"values": [0.2]}},
        },
        ("no axis is left whose values could be ranked",),
    ),
    "preset": (
        RANKING | {"preset": {"clearance": 0.031}},
        {},
        ("preset.clearance", "has no value 0.031", "the nearest is 0.03"),
    ),
    "twice": (
        RANKING | {"also": {"A3": "chatter"}},
        {},
        ("also.A3", "'A3' is among the statements that this study tests"),
    ),
    "other statement": (
        RANKING | {"also": {"A11": "chatter"}},
        {},
        ("also.A11", "unknown statement 'A11'"),
    ),
    "branches": (
        RANKING,
        {"draws": {"count": 2, "seed": 1, "initial_position": [-1, 1]}},
        ("several runs at each point (draw)",),
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes(tmp_path: Path, name: str) -> None:
    table, changes, parts = MISTAKES[name]
    message = blamed(tmp_path, chatter=with_table(BURSTS, table, **changes))
    assert "Traceback" not in message
    for part in parts:
        assert part in message, message


@pytest.mark.parametrize("clearances", [[0.5, 1.0], [0, 1.5, 2]])
def test_a1_needs_both_sides(tmp_path: Path, clearances: list[float]) -> None:
    axes = CLEARANCE["axes"] | {"clearance": {"values": clearances}}
    table = {"kind": "ranking", "statements": ["A1"]}
    message = blamed(tmp_path, diagram=with_table(CLEARANCE, table, axes=axes))
    assert "A1 needs an axis clearance with values up to 1.35 and beyond" in message


def test_another_study_that_is_not_made(tmp_path: Path) -> None:
    message = blamed(tmp_path, chatter=with_table(BURSTS, ALSO), diagrams=CLEARANCE)
    assert "study chatter  tables.one.also.A1" in message
    assert "the study 'diagram' is not among those to be made" in message
    assert "did you mean 'diagrams'?" in message


def test_another_study_that_cannot_test_it(tmp_path: Path) -> None:
    other = CLEARANCE | {"observers": {"impacts": None}}
    message = blamed(tmp_path, chatter=with_table(BURSTS, ALSO), diagram=other)
    assert "in the study 'diagram' A1 needs bursts among the observers" in message


def test_a_part_after_the_record(tmp_path: Path) -> None:
    observers = BURSTS["observers"] | {"chatter_bursts": {"since": [0, 25]}}
    message = blamed(tmp_path, chatter=BURSTS | {"observers": observers})
    assert "observers.chatter_bursts.since[1]" in message
    assert "begins 25 periods into a record of 25" in message


# --- targets


def test_targets_are_studies_outside_of_the_default_run(tmp_path: Path) -> None:
    config = {"studies": ["a"], "targets": {"more": ["b", "a"], "else": ["b", "c"]}}
    found = loaded(tmp_path, config, a=BURSTS, b=BURSTS, c=CLEARANCE, d=BURSTS)
    assert found.default == ("a",)
    assert found.targets == {"more": ("b", "a"), "else": ("b", "c")}
    assert set(found.studies) == {"a", "b", "c"}


def test_another_study_may_be_one_of_a_target(tmp_path: Path) -> None:
    config = {"studies": ["chatter"], "targets": {"more": ["diagram"]}}
    assert loaded(tmp_path, config, chatter=with_table(BURSTS, ALSO), diagram=CLEARANCE)


@pytest.mark.parametrize(
    ("targets", "parts"),
    [
        ({"more": ["smal"]}, ("targets.more[0]", "unknown study 'smal'", "did you mean 'small'")),
        ({"two words": ["small"]}, ("cannot be the name of a target", "letters, digits, _ and -")),
        ({"-n": ["small"]}, ("targets.-n", "'-n' reads like an option of snakemake", "without -")),
        ({"figure": ["small"]}, ("targets.figure", "'figure' is a rule of the workflow")),
    ],
)
def test_bad_targets(tmp_path: Path, targets: dict[str, Any], parts: tuple[str, ...]) -> None:
    (tmp_path / "workflow").symlink_to(ROOT / "workflow")
    message = blamed(tmp_path, {"studies": ["small"], "targets": targets}, small=BURSTS)
    for part in parts:
        assert part in message, message
