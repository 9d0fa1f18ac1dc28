"""Studies that check the engine: what their files may say, and what the workflow gets of them."""

from pathlib import Path

import pytest
import yaml
from jsonschema import Draft202012Validator
from scenes import SLOW as POINT

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
        "summary": {"kind": "solver_summary"},
    },
    "tables": {"errors": {"kind": "solver_errors"}, "speed": {"kind": "solver_speed"}},
}
STRESS = {
    "kind": "stress",
    "title": "T",
    "source": "S",
    "periods": 20,
    "corners": {
        "rigid": {
            "parameters": {name: [value, 2 * value] for name, value in POINT.items()}
            | {"restitution": [0, 0.5, 1]},
            "starts": ["centre", "grazing"],
            "parts": 3,
        }
    },
    "random": {
        "box": {
            "runs": 10,
            "seed": 1,
            "parameters": {name: [value, 2 * value] for name, value in POINT.items()}
            | {"restitution": {"range": [0, 1], "values": [0, 1]}, "phase": {"values": [0.5]}},
            "models": {
                "grounded": {"share": 0.5, "parameters": {"support_stiffness_ratio": [0, 1]}}
            },
            "metamorphic": 4,
            "parts": 2,
        }
    },
    "long_runs": {"orbit": {"periods": 1000, "parameters": POINT}},
    "figures": {"laws": {"kind": "stress"}, "metamorphic": {"kind": "metamorphic"}},
    "tables": {"laws": {"kind": "stress"}, "metamorphic": {"kind": "metamorphic"}},
}
COST = {
    "kind": "cost",
    "title": "T",
    "source": "S",
    "cases": {
        "bare": {"parameters": POINT},
        "observed": {"parameters": POINT, "observers": {"impacts": None, "response": {}}},
    },
    "figures": {"suite": {"kind": "cost"}},
    "tables": {"suite": {"kind": "cost"}},
}
GOOD = {"comparison": COMPARISON, "stress": STRESS, "cost": COST}


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


#: Of each rule that only these studies have one; what all files have in common is tested with them.
MISTAKES = [
    ("comparison", ("kind",), "comparisons", "kind", "did you mean 'comparison'?"),
    ("comparison", ("scenes",), {}, "scenes", "at least one of the scenes must be given"),
    ("comparison", ("solvers", "dop583"), [1], "solvers.dop583", "did you mean 'dop853'?"),
    (
        "comparison",
        ("solvers", "exact"),
        [0],
        "solvers.exact[0]",
        "must be greater than 0 (value: 0)",
    ),
    (
        "comparison",
        ("scenes", "burst", "parameters"),
        {"mass_ratio": 1},
        "scenes.burst.parameters.clearance",
        "'clearance' is not given",
    ),
    (
        "comparison",
        ("scenes", "burst", "parameters", "yield_speed"),
        0.1,
        "scenes.burst.parameters",
        "rigid walls and a constant restitution",
    ),
    ("comparison", ("figures", "all", "kind"), "map", "figures.all.kind", "work_precision"),
    (
        "stress",
        ("corners", "rigid", "starts"),
        ["center"],
        "corners.rigid.starts[0]",
        "did you mean 'centre'?",
    ),
    (
        "stress",
        ("random", "box", "parameters", "mass_ratio"),
        {},
        "random.box.parameters.mass_ratio",
        "neither range nor values is given",
    ),
    ("stress", ("random", "box", "metamorphic"), 11, "random.box.metamorphic", "integer <= 10"),
    ("cost", ("cases",), {}, "cases", "at least one case"),
    ("cost", ("cases", "bare", "parameters", "gap"), 0.1, "cases.bare.parameters", "mixed"),
    (
        "cost",
        ("cases", "observed", "observers"),
        {"stroboscopic_section": None, "impact_section": None},
        "cases.observed.observers",
        "cannot both be asked for",
    ),
]


@pytest.mark.parametrize(("kind", "keys", "value", "place", "words"), MISTAKES)
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
    assert list(study.figures) == ["all", "summary"]
    stress = load_study(write(tmp_path, STRESS), {"corners": {"rigid": None}})
    assert stress.corners == {}


def test_what_shows_times_lies_with_the_times(tmp_path):
    study = load_study(write(tmp_path, COMPARISON))
    assert list(study.files("tables")) == ["tables/errors", "timed/tables/speed"]
    assert list(study.files("figures")) == [
        "timed/figures/all",
        "timed/figures/impacts",
        "timed/figures/summary",
    ]
    about = study.about()
    assert [path for path, *_ in about["tables"]] == [
        "good/tables/errors",
        "good/timed/tables/speed",
    ]


def test_only_models_that_a_study_asks_for_are_compiled(tmp_path):
    assert load_study(write(tmp_path, STRESS)).models == ("rigid", "grounded")
    assert load_study(write(tmp_path, STRESS), {"random": {"box": None}}).models == ("rigid",)


def test_parts_of_a_stress_study_cover_its_runs(tmp_path):
    study = load_study(write(tmp_path, STRESS))
    parts = {name: job.settings for name, job in study.parts({}).items()}
    checks = [*(f"corners_rigid~{i}" for i in range(3)), "random_box~0", "random_box~1"]
    assert list(parts) == [*checks, "long_orbit", "metamorphic/box~0", "metamorphic/box~1"]
    assert study.corners["rigid"].count == 2**4 * 3 * 2
    box = parts["random_box~1"]["random"]["box"]
    assert box["parameters"]["mass_ratio"] == (0.1, 0.2)
    assert parts["random_box~1"]["part"] == (1, 2)
    assert parts["long_orbit"]["run"] == POINT
    again = [parts[f"metamorphic/box~{i}"]["runs"] for i in range(2)]
    assert [(runs["first"], runs["count"]) for runs in again] == [(0, 2), (2, 2)]
    gathered = study.gathered({})
    assert gathered["cube.nc"].needs == (*checks, "long_orbit")
    assert gathered["metamorphic.nc"].needs == ("metamorphic/box~0", "metamorphic/box~1")
