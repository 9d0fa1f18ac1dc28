"""Studies of tests: written into a file and loaded, what is said of mistakes, and their cubes."""

import json
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import yaml

from damper.study.config import ConfigError, load_study

ENGINE = {"accuracy": 1e-12, "max_events": 10**6}
#: Mistakes in study files and what is said of them, by the test that makes them.
MISTAKES = yaml.safe_load((Path(__file__).parent / "study/mistakes.yaml").read_text())
#: What a user has no use for.
JARGON = ("pydantic", "type=", "input_", "Traceback", "https:", "Study", "tuple", "dict")


def load(
    folder: Path, given: str | bytes | dict[str, Any], name: str = "study", override: Any = None
) -> Any:
    """Write a study, as text or as data, into a file of this name and load it."""
    path = folder / f"{name}.yaml"
    text = yaml.safe_dump(given, sort_keys=False) if isinstance(given, dict) else given
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return load_study(path, override)


def blame(
    folder: Path, given: str | bytes | dict[str, Any], name: str = "study", override: Any = None
) -> str:
    """What is said of one that is wrong: in plain words, the path of the file cut to its name."""
    with pytest.raises(ConfigError) as caught:
        load(folder, given, name, override)
    message = str(caught.value)
    assert not [word for word in JARGON if word in message], message
    return message.replace(f"{folder}/", "")


def cube_of(study: Any) -> Any:
    """Its cube, by the jobs of the workflow and with settings as a job gets them."""

    def plainly(settings: Any) -> Any:
        return json.loads(json.dumps(settings))

    parts = [
        import_module(job.module).run_part((), **plainly(job.settings), **job.files)
        for job in study.parts(ENGINE).values()
    ]
    (job,) = study.gathered(ENGINE).values()
    return import_module(job.module).gather(parts, **plainly(job.settings))
