"""Studies that check the engine: what their files may say, and what the workflow gets of them."""

from pathlib import Path

import pytest
import yaml
from jsonschema import Draft202012Validator
from scenes import SLOW as POINT
from studies import MISTAKES

from damper.study.config import ConfigError, load_study
from damper.study.kinds import STUDIES
from damper.study.reference import schemas

SCHEMA = Draft202012Validator(schemas()["config/schema/study.schema.json"])
COMPARISON = {
    "kind": "comparison",
    "title": "T",
    "source": "S",
    "scenes": {
        "burst": {"title": "One burst", "parameters": POINT, "until": 60},
        "other": {
            "title": "Another start",
            "parameters": POINT | {"initial_velocity": 0.5},
            "until": 5.0,
        },
    },
    "solvers": {"exact": [1e-6, 1e-12], "rk4_step_end": [100, 1000]},
    "figures": {
        "all": {"kind": "work_precision"},
        "impacts": {"kind": "work_precision", "error": "impact_time_error"},
    },
    "tables": {"errors": {"kind": "solver_errors"}, "speed": {"kind": "solver_speed"}},
}
STRUCTURE = {
    "title": "A beam",
    "source": "a test",
    "kind": "structure",
    "structure": {
        "modes": [{"frequency": 1.0, "damping_ratio": 0.01, "shapes": {"tip": 1.0, "force": 1.0}}]
    },
    "masses": [{"box": "tip", "free_mass": 0.1, "gap": "40 mm", "restitution": 0.6}],
    "parameters": {"force_amplitude": 2.0, "forcing_frequency": "1 Hz"},
    "axes": {"gap_0": {"values": [0.04, 9.0]}},
    "transient": 2,
    "periods": 2,
    "figures": {
        "peak": {"kind": "lines", "variables": ["peak_displacement"], "along": "gap_0"}
        | {"lines": "point"}
    },
}
GOOD = {"comparison": COMPARISON, "structure": STRUCTURE}


def write(folder: Path, data: object) -> Path:
    path = folder / "good.yaml"
    path.write_text(yaml.safe_dump(data, sort_keys=False))
    return path


def changed(data: dict, *keys: str, to: object) -> dict:
    """Return the data with the value at some keys replaced."""
    if not keys:
        return to
    here = dict(data)
    here[keys[0]] = changed(here.get(keys[0], {}), *keys[1:], to=to)
    return here


@pytest.mark.parametrize("kind", GOOD)
def test_loads_and_passes_the_schema(tmp_path, kind):
    study = load_study(write(tmp_path, GOOD[kind]))
    assert type(study) is STUDIES[kind]
    assert study.name == "good"
    assert list(SCHEMA.iter_errors(GOOD[kind])) == []
    # What is written out loads again, as the same study.
    again = load_study(write(tmp_path, yaml.safe_load(study.attributes()["study"])))
    assert again.attributes() == study.attributes()


def test_every_kind_is_tried_here():
    assert GOOD.keys() == STUDIES.keys()


@pytest.mark.parametrize(("kind", "keys", "value", "place", "words"), MISTAKES["kinds"])
def test_mistakes_are_stated_in_words(tmp_path, kind, keys, value, place, words):
    with pytest.raises(ConfigError) as error:
        load_study(write(tmp_path, changed(GOOD[kind], *keys, to=value)))
    text = str(error.value)
    assert f"  {place}\n" in f"{text}\n"
    assert words in text


def test_an_override_leaves_out_what_is_null_in_it(tmp_path):
    override = {"scenes": {"other": None}, "solvers": {"exact": [1e-3], "rk4_step_end": None}}
    study = load_study(write(tmp_path, COMPARISON), override | {"figures": {"impacts": None}})
    assert list(study.scenes) == ["burst"]
    assert study.solvers == {"exact": (1e-3,)}
    assert list(study.figures) == ["all"]


def test_what_shows_times_lies_with_the_times(tmp_path):
    study = load_study(write(tmp_path, COMPARISON))
    assert list(study.files("tables")) == ["tables/errors", "timed/tables/speed"]
    assert list(study.files("figures")) == ["timed/figures/all", "timed/figures/impacts"]
    about = study.about()
    assert [path for path, *_ in about["tables"]] == [
        "good/tables/errors",
        "good/timed/tables/speed",
    ]
