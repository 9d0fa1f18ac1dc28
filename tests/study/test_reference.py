"""Schemas, the reference and the template: complete, in step, and of one mind with the loader."""

import copy
import itertools
import json
import random
import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from jsonschema import Draft202012Validator
from referencing import Registry
from referencing.jsonschema import DRAFT202012

from damper.parameters.models import ON_PRIMARY
from damper.parameters.quantities import ALL, MODEL_NAMES, SI_ONLY
from damper.parameters.tables import WALL_TABLES
from damper.study import reference
from damper.study.config import ConfigError, load_config, load_study
from damper.study.forcing import FORCES
from damper.study.kinds import FIGURES, STUDIES, TABLES
from damper.study.model import Settings, Study
from damper.study.settings import OBSERVER_SETTINGS, Axis, DrawKeys, Drawn, Fixed, Threshold
from damper.study.yaml_file import read_yaml
from damper.theory.accumulation import MODELS as ACCUMULATION

ROOT = Path(__file__).parents[2]
FILES = sorted((ROOT / "config/studies").glob("*.yaml"))
CONFIGS = sorted((ROOT / "config").glob("*.yaml"))
TEMPLATE = ROOT / "config/studies/template.yaml"
CLASSES = [Study, Fixed, Axis, DrawKeys, Drawn, Threshold, Settings, *OBSERVER_SETTINGS.values()]
CLASSES += [*FORCES.values(), *FIGURES.values(), *TABLES.values(), *STUDIES.values()]
CLASSES += [entry for kind in STUDIES.values() for entry in kind.entries.values()]
CLASSES += [
    made
    for kind in STUDIES.values()
    for registry in (kind.figure_kinds, kind.table_kinds)
    for made in registry.values()
]

SCHEMAS = [
    json.loads((ROOT / f"config/schema/{name}.schema.json").read_text())
    for name in ("study", "config")
]
REGISTRY = Registry().with_resource("study.schema.json", DRAFT202012.create_resource(SCHEMAS[0]))
STUDY, CONFIG = (Draft202012Validator(schema, registry=REGISTRY) for schema in SCHEMAS)


def loads(folder: Path, data: Any) -> bool:
    """Whether the loader accepts a study, given as data."""
    path = folder / "study.yaml"
    path.write_text(yaml.safe_dump(data, sort_keys=False, allow_unicode=False))
    try:
        load_study(path)
    except ConfigError:
        return False
    return True


def data_of(path: Path) -> Any:
    """The data of a file in YAML 1.2, as an editor sees it."""
    file = read_yaml(path)
    assert file.problems == []
    return file.data


WHOLE = data_of(TEMPLATE)
#: Studies to make mistakes in: of either system of units, with draws, with orbits, of each kind.
GOOD = [
    data_of(ROOT / f"config/studies/{name}.yaml")
    for name in (*("chatter_map", "machine_frame", "hysteresis", "burst", "solvers"),)
]


# Generated files.


def test_generated_files_are_in_step():
    for path, text in reference.files().items():
        assert (ROOT / path).read_text("utf-8") == text, f"run: {reference.MADE_BY}"


def test_every_file_names_its_schema():
    for path in (*FILES, *CONFIGS):
        name = "study" if path in FILES else "config"
        first = path.read_text().splitlines()[0]
        (target,) = re.fullmatch(r"# yaml-language-server: \$schema=(\S+)", first).groups()
        assert (path.parent / target).resolve() == ROOT / f"config/schema/{name}.schema.json"
        assert (path.parent / target).is_file()


@pytest.mark.parametrize("name", ["study", "config"])
def test_schema_is_a_schema(name):
    schema = json.loads((ROOT / f"config/schema/{name}.schema.json").read_text())
    Draft202012Validator.check_schema(schema)
    for target in re.findall(r'"#/\$defs/([^"]*)"', json.dumps(schema)):
        assert target in schema["$defs"]
    for defined in schema["$defs"]:
        assert f'#/$defs/{defined}"' in json.dumps(SCHEMAS)


# Every key.


def test_every_key_has_a_description_a_type_and_a_schema():
    for cls in CLASSES:
        assert cls.__doc__
        for key, field in cls.model_fields.items():
            assert field.description, f"{cls.__name__}.{key}"
            assert field.description.endswith("."), f"{cls.__name__}.{key}"
            if reference.settings_of(field) is None:
                schema = reference.setting_schema(field)
                for one in schema.get("anyOf", [schema]):
                    assert {"type", "enum", "const", "$ref"} & one.keys(), f"{cls.__name__}.{key}"


def test_reference_has_every_key_of_its_section():
    text = (ROOT / "docs/reference.md").read_text()
    for cls in CLASSES:
        for key in cls.model_fields:
            assert re.search(rf"\n\| `(?:[\w<>]+\.)*{key}` \|", text), f"{cls.__name__}.{key}"
    for kinds in (FIGURES, TABLES):
        for kind, cls in kinds.items():
            parts = [part.split("\n#")[0] for part in text.split(f"\n### kind: {kind}\n")[1:]]
            keys = [f"<file>.{key}` |" for key in cls.model_fields]
            assert any(all(key in part for key in keys) for part in parts), kind
    for name in ALL:
        assert f"\n| `{name}` |" in text


def test_reference_says_what_need_not_be_given():
    text = reference.reference()
    for start in (
        "| `frequency_ratio` | $\\omega$ | |",
        "| `forcing_frequency` | $\\Omega$ | rad/s |",
    ):
        assert f"{start} **required** but not under `none`, `record`, `noise` |" in text


# Schema and loader.


def test_schema_accepts_the_files_of_the_project():
    for path in CONFIGS:
        assert list(CONFIG.iter_errors(data_of(path))) == []
    for path in FILES:
        assert list(STUDY.iter_errors(data_of(path))) == []
        # What it accepts in full, it accepts as an override.
        override = {"studies": ["a"], "overrides": {"a": data_of(path)}}
        assert list(CONFIG.iter_errors(override)) == []


def test_loader_and_schema_accept_good_configurations(tmp_path):
    folder = tmp_path / "config/studies"
    folder.mkdir(parents=True)
    (folder / "good.yaml").write_text(yaml.safe_dump(WHOLE))
    for config in (
        {"studies": ["good"]},
        {"studies": ["good"], "engine": {"accuracy": 1e-9}, "results": "r", "overrides": None},
        {"studies": ["good"], "overrides": {"good": None}},
        {"studies": ["config/studies/good.yaml"], "overrides": {"good": {"axes": None} | CHANGE}},
        {"studies": ["good"], "overrides": {"good": {"figures": {"section": {"caption": "C"}}}}},
        {"studies": ["good"], "overrides": {"good": {"axes": {"clearance": {"values": [0.1, 1]}}}}},
        {"studies": ["good"], "overrides": {"good": {"figures": {"section": None}}}},
    ):
        load_config(config, tmp_path)
        assert list(CONFIG.iter_errors(config)) == []


POINT = {"restitution": 0.5, "frequency_ratio": 1, "clearance": 0.1}
CHANGE = {"parameters": POINT, "figures": None, "tables": None, "title": "U"}


def changed(data: dict[str, Any], path: str, value: Any) -> dict[str, Any]:
    data = copy.deepcopy(data)
    *parents, last = path.split(".")
    node = data
    for part in parents:
        node = node.setdefault(part, {})
    if value is ...:
        del node[last]
    else:
        node[last] = value
    return data


#: Path in the template -> a value that both refuse, for each way to say so. `...` takes it away.
MISTAKES: dict[str, Any] = {
    "title": "",
    "description": {},
    "perods": 1,
    "transient": 1.5,
    "periods": 0,
    "parameters": [],
    "parameters.damping_ratio": {"value": 1, "x": 1},
    "parameters.mass_ratio": -1,
    "axes.gain": {"values": [1]},
    "axes.restitution.values": [1, 1],
    "axes.clearance.spacing": "lin",
    "axes.frequency_ratio.num": 1,
    "initial": "moving",
    "draws": {"count": 1, "seed": 1, "initial_velocity": [1, 2, 3]},
    "draws.count": 0,
    "observers": ...,
    "observers.impact": {},
    "observers.bursts.threshold": 1,
    "figures.section.kind": "intervals",
    "figures.bif/urc": {"kind": "schematic", "drawing": "damper"},
    "tables": {"t": 1},
}


@pytest.mark.parametrize(("path", "value"), MISTAKES.items(), ids=str)
def test_loader_and_schema_refuse_a_mistake(tmp_path, path, value):
    data = changed(WHOLE, path, value)
    assert not loads(tmp_path, data)
    assert not STUDY.is_valid(data)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("studies", ["a", "a"]),
        ("studys", ["a"]),
        ("engine.accuracy", 1e-2),
        ("engine.max_event", 1),
        ("overrides.a.perods", 1),
        ("overrides.a.axes.gap.num", "many"),
        ("overrides.a b", {}),
    ],
)
def test_schema_refuses_a_mistake_in_the_configuration(path, value):
    axes = {"axes": {"gap": {"num": 3}}, "observers": {"bursts": {}}}
    good = {"studies": ["a"], "engine": {}, "overrides": {"a": axes}}
    assert CONFIG.is_valid(good)
    assert not CONFIG.is_valid(changed(good, path, value))


PARTS = [None, True, -1, 0, 0.5, 1, 2, 3.0, 1e-8, "", "x", "rest", "steady", "up", "log", "linear"]
PARTS += [[], [0.5], [0.1, 0.2], [-1, 1], {}, {"value": 1}, {"fraction": 0.1}, {"speed": 2}]
KEYS = sorted(
    {key for cls in CLASSES for key in cls.model_fields} | set(ALL) | set(OBSERVER_SETTINGS)
)


def mutated(rng: random.Random, data: dict[str, Any]) -> dict[str, Any]:
    """Return a copy with one entry taken away, replaced, added, or moved from elsewhere."""
    data = copy.deepcopy(data)
    mappings = [data]
    for node in mappings:
        mappings += [value for value in node.values() if isinstance(value, dict)]
    node = rng.choice(mappings)
    key = rng.choice([*node, rng.choice(KEYS)])
    match rng.randrange(4):
        case 0:
            node.pop(key, None)
        case 1:
            node[rng.choice([*node, *KEYS])] = copy.deepcopy(rng.choice(mappings[1:] or [{}]))
        case _:
            node[key] = copy.deepcopy(rng.choice(PARTS))
    return data


def test_schema_accepts_whatever_the_loader_accepts(tmp_path):
    rng = random.Random(1)
    accepted = refused = 0
    starts = itertools.cycle(GOOD)
    for _ in range(200):
        data = next(starts)
        for _ in range(rng.randrange(1, 4)):
            data = mutated(rng, data)
        if loads(tmp_path, data):
            accepted += 1
            assert list(STUDY.iter_errors(data)) == []
        else:
            refused += not STUDY.is_valid(data)
    assert accepted > 5
    assert refused > 130


# The template.


def uncommented(text: str) -> str:
    return re.sub(r"(?m)^( *)# (\w+:(?: .*)?)$", r"\1\2", text)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The template with everything that is commented out."""
    path = tmp_path_factory.mktemp("template") / "template.yaml"
    path.write_text(uncommented(TEMPLATE.read_text()))
    return data_of(path)


def test_template_has_every_key(whole):
    entries = {
        Study: [whole],
        Fixed: [p for p in whole["parameters"].values() if isinstance(p, dict)],
        Axis: whole["axes"].values(),
        DrawKeys: [{key: whole["draws"][key] for key in DrawKeys.model_fields}],
        Drawn: [drawn for drawn in whole["draws"].values() if isinstance(drawn, dict)],
        Threshold: [whole["observers"]["bursts"]["threshold"]],
    }
    entries |= {cls: [whole["observers"][name] or {}] for name, cls in OBSERVER_SETTINGS.items()}
    for section, registry in (("figures", FIGURES), ("tables", TABLES)):
        for kind, cls in registry.items():
            entries[cls] = [e for e in whole[section].values() if e["kind"] == kind]
    for cls, given in entries.items():
        shown = {key for entry in given for key in entry}
        # All figures have it; the template explains it once.
        assert set(cls.model_fields) - {"see"} == shown - {"see"}, cls.__name__
    assert any("see" in figure for figure in whole["figures"].values())
    assert set(whole["parameters"]) | set(whole["axes"]) == {*ALL, *WALL_TABLES}


def test_what_the_template_has_commented_out_is_right(whole):
    assert list(CONFIG.iter_errors({"studies": ["a"], "overrides": {"a": whole}})) == []


ALONE = {"figures": None, "tables": None}


@pytest.mark.parametrize("model", [*(m for m in MODEL_NAMES if m in ON_PRIMARY), "yield_speed"])
def test_models_that_the_template_leaves_out(tmp_path, whole, model):
    data = data_of(TEMPLATE) | ALONE
    names = MODEL_NAMES.get(model, (model,))
    given = {n: whole["parameters"][n] for n in names if n not in SI_ONLY}
    data["parameters"] |= given
    # Of the dampers that the template says.
    assert loads(tmp_path, data) == (model in ACCUMULATION)
    del data["observers"]["accumulation"]
    if model == "several":
        # What knows one mass says so: tests/models/test_several.py.
        data["observers"] = {"impacts": {}, "response": {}}
        data.pop("orbits", None)
        data["masses"] = whole["masses"]
    assert loads(tmp_path, data)
    other = next(names[0] for name, names in MODEL_NAMES.items() if name != model)
    data["parameters"] |= {other: 0.5, "contact_stiffness_ratio": 9}
    assert not loads(tmp_path, data)
