"""Jobs of studies: what they read of each other, and what every kind of study says of its own."""

import json
import os
from importlib import import_module
from inspect import signature
from pathlib import Path

import numpy as np
import pytest

from damper.study.config import load_config
from damper.study.fingerprint import fingerprint, stamp
from damper.study.jobs import read_parts
from damper.sweep.parts import PartData, write_part

ROOT = Path(__file__).parents[2]


def written(path: Path, value: float, settings: object) -> str:
    write_part(PartData({"value": np.array([value])}), path)
    stamp([path], settings)
    return str(path)


def test_parts_are_read_in_order_and_what_is_wrong_is_named_and_removed(tmp_path: Path) -> None:
    paths = [written(tmp_path / f"{k}.npz", k, {"k": k}) for k in range(4)]
    wanted = [fingerprint({"k": k}) for k in range(4)]
    assert [part.arrays["value"][0] for part in read_parts(paths, wanted)] == [0, 1, 2, 3]
    os.truncate(paths[1], 50)
    written(Path(paths[2]), 2, {"k": 7})
    with pytest.raises(SystemExit) as error:
        read_parts(paths, wanted)
    assert str(error.value).splitlines() == [
        f"{paths[1]} is damaged",
        f"{paths[2]} is of other parameters, settings or code",
        "They are removed: the same command again makes them anew.",
    ]
    assert [Path(path).exists() for path in paths] == [True, False, False, True]


def test_jobs_of_all_studies_name_functions_that_take_their_settings() -> None:
    """Settings are what JSON holds, and parts that are needed are there."""
    config = load_config({}, ROOT, [ROOT / "config/config.yaml"])
    engine = {"accuracy": 1e-12, "max_events": 1000}
    for study in config.studies.values():
        parts, gathered = study.parts(engine), study.gathered(engine)
        for jobs, function in (
            (parts, "run_part"),
            (gathered, "gather"),
            (study.timed(), "measure"),
        ):
            first = {(job.module, tuple(job.settings)): job for job in jobs.values()}
            for job in first.values():
                called = signature(getattr(import_module(job.module), function))
                called.bind(*([[]] if function != "measure" else []), **job.settings)
                json.dumps(job.settings)
            assert all(set(job.needs) <= parts.keys() for job in jobs.values())
        needed = {part for job in (*parts.values(), *gathered.values()) for part in job.needs}
        assert needed == parts.keys()
