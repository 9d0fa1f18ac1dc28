"""Targets of a configuration: more studies, outside of the default run."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from damper.study.config import Config, ConfigError, load_config

ROOT = Path(__file__).parents[2]
STUDY = {
    "title": "t",
    "source": "s",
    "parameters": {"damping_ratio": 0.01, "restitution": 0.8, "clearance": 0.1, "mass_ratio": 0.1},
    "axes": {"frequency_ratio": {"values": [0.2, 0.25, 0.3]}},
    "transient": 0,
    "periods": 25,
    "observers": {"bursts": None},
}


def loaded(folder: Path, *names: str, **config: Any) -> Config:
    """Load a configuration beside studies of these names."""
    files = folder / "config/studies"
    files.mkdir(parents=True)
    for name in names:
        (files / f"{name}.yaml").write_text(yaml.safe_dump(STUDY))
    return load_config(config, folder)


def test_targets_are_studies_outside_of_the_default_run(tmp_path: Path) -> None:
    targets = {"more": ["b", "a"], "else": ["b", "c"]}
    found = loaded(tmp_path, "a", "b", "c", "d", studies=["a"], targets=targets)
    assert found.default == ("a",)
    assert found.targets == {"more": ("b", "a"), "else": ("b", "c")}
    assert set(found.studies) == {"a", "b", "c"}


@pytest.mark.parametrize(
    ("targets", "parts"),
    [
        ({"more": ["smal"]}, ("targets.more[0]", "unknown study 'smal'", "did you mean 'small'")),
        ({"two words": ["small"]}, ("cannot be the name of a target", "letters, digits, _ and -")),
        ({"-n": ["small"]}, ("targets.-n", "'-n' reads like an option of snakemake", "without -")),
        ({"table": ["small"]}, ("targets.table", "'table' is a rule of the workflow")),
    ],
)
def test_bad_targets(tmp_path: Path, targets: dict[str, Any], parts: tuple[str, ...]) -> None:
    (tmp_path / "workflow").symlink_to(ROOT / "workflow")
    with pytest.raises(ConfigError) as caught:
        loaded(tmp_path, "small", studies=["small"], targets=targets)
    message = str(caught.value)
    assert message.startswith("1 error ")
    for part in parts:
        assert part in message, message
