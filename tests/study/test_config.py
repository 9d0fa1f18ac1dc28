"""The study language: what is accepted, and what each mistake is told as."""

import contextlib
import copy
import math
import os
import random
import re
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Any

import pytest
import studies
import yaml
from new_process import modules_after
from studies import MISTAKES

from damper.study.axes import coordinate_name
from damper.study.config import ConfigError, load_config, load_study
from damper.study.yaml_file import dump_yaml, unreadable

GOOD = """\
title: Restitution and chatter
source: "Paper B, doi:10.1177/14613484211051849"
parameters:
  damping_ratio: {value: 0.02, assumed: "the paper's value is lost"}
  clearance: 0.05
axes:
  mass_ratio: {values: [0.25, 0.1, 0.05, 1e-3], fan: true}
  frequency_ratio: {values: [1.1, 2], fan: true, assumed: "three of four"}
  restitution: {start: 0, stop: 1, step: 0.002}
transient: 300
periods: 100
observers:
  impact_section: {wall: left, samples: 20, free_mass: true}
  impacts:
  bursts: {threshold: {speed: 1e-8}, compare_thresholds: [0.01, 0.1], records: 5}
figures:
  bifurcation: {kind: bifurcation, along: restitution, each: mass_ratio, rows: frequency_ratio}
tables:
  chatter: {kind: intervals, along: restitution}
"""


load = partial(studies.load, name="good")
blame = partial(studies.blame, name="good")


def write(folder: Path, text: str, name: str = "good") -> None:
    path = folder / "config" / "studies" / f"{name}.yaml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def changed(old: str, new: str) -> str:
    assert GOOD.count(old) == 1
    return GOOD.replace(old, new)


# What is accepted.


def test_good_file(tmp_path: Path) -> None:
    study = load(tmp_path, GOOD)
    assert study.name == "good"
    assert list(study.axis_values) == ["mass_ratio", "frequency_ratio", "restitution"]
    assert study.axis_values["mass_ratio"] == (0.25, 0.1, 0.05, 0.001)
    assert study.fixed == {"damping_ratio": 0.02, "clearance": 0.05, "phase": 0.0}
    assert study.assumed == {
        "damping_ratio": "the paper's value is lost",
        "frequency_ratio": "three of four",
    }
    assert study.fan_axes == ("mass_ratio", "frequency_ratio")
    assert study.inner_axes == ("restitution",)
    slices = study.slices()
    assert len(slices) == 8
    assert slices[1] == {"mass_ratio": 0.25, "frequency_ratio": 2.0}
    assert study.slice_path(slices[7]) == "mass_ratio~0.001/frequency_ratio~2"
    path, (figure, settings) = list(study.files("figures").items())[1]
    assert (path, figure) == ("figures/bifurcation_mass_ratio~0.1", study.figures["bifurcation"])
    assert settings["at"] == {"mass_ratio": 0.1}
    assert study.outputs()[:3] == [
        "cube.nc",
        "figures/bifurcation_mass_ratio~0.25.svg",
        "figures/bifurcation_mass_ratio~0.25.png",
    ]
    assert study.outputs()[-2:] == ["tables/chatter.csv", "tables/chatter.md"]
    assert study.observers["bursts"].threshold.speed == 1e-8
    assert study.observers["impacts"].threshold.fraction == 0.03
    assert study.tables["chatter"].resolution == 1e-3


def test_canonical_text_is_a_fixed_point(tmp_path: Path) -> None:
    text = changed("clearance: 0.05", 'clearance: {value: 0.05, stated: "table 1\\n"}')
    study = load(tmp_path, text.replace("step: 0.002", 'step: 0.002, stated: "1e-3"'))
    assert study.stated == {"clearance": "table 1", "restitution": "1e-3"}
    text = study.to_yaml()
    again = load(tmp_path, text)
    assert (again, again.to_yaml()) == (study, text)
    shuffled = yaml.safe_load(text)
    shuffled = {key: shuffled[key] for key in sorted(shuffled)}
    shuffled["parameters"] = dict(reversed(shuffled["parameters"].items()))
    assert load(tmp_path, dump_yaml(shuffled)).to_yaml() == text


@pytest.mark.parametrize("words", ["no", "1e-8", "a: b # c", "é\n\ttab"])
def test_canonical_text_keeps_odd_words(tmp_path: Path, words: str) -> None:
    quoted = yaml.safe_dump(words, default_style='"').strip()
    study = load(tmp_path, f"description: {quoted}\n{GOOD}")
    assert study.description == words
    assert yaml.safe_load(study.to_yaml())["description"] == words
    assert load(tmp_path, study.to_yaml()) == study


def test_study_without_axes_is_one_point(tmp_path: Path) -> None:
    text = re.sub(r"(?s)axes:.*?transient", "axes:\ntransient", GOOD).split("figures:")[0]
    point = "parameters: {mass_ratio: 1, frequency_ratio: 1, restitution: 1, phase: -1,"
    text = text.replace("parameters:", point).replace("\n  damping_ratio", " damping_ratio")
    text = text.replace("\n  clearance: 0.05", ", clearance: 0.05}")
    study = load(tmp_path, text)
    assert study.slices() == [{}]
    assert study.slice_path({}) == "all"
    assert study.outputs() == ["cube.nc"]
    assert study.fixed["phase"] == -1.0


@pytest.mark.parametrize(
    ("axis", "values"),
    [
        ("{start: 0, stop: 1, step: 0.1}", tuple(i / 10 for i in range(11))),
        ("{start: 0.1, stop: 0.7, num: 7}", (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7)),
        ("{start: 0, stop: 1, step: 0.3333333333}", (0.0, 0.3333333333, 0.6666666666, 1.0)),
        ("{start: 1e-8, stop: 1, num: 5, spacing: log}", (1e-8, 1e-6, 1e-4, 1e-2, 1.0)),
        ("{start: 1, stop: 1000, num: 3, spacing: log}", (1.0, 31.6227766017, 1000.0)),
        ("{start: 0, stop: 1, num: 4}", (0.0, 1 / 3, 2 / 3, 1.0)),
        ("{values: [-0.0, 1e-8, .5, 1, 0x2]}", (0.0, 1e-8, 0.5, 1.0, 2.0)),
        ("{values: [3, 1, 2]}", (3.0, 1.0, 2.0)),
    ],
)
def test_values_are_formed_in_decimal(tmp_path: Path, axis: str, values: Any) -> None:
    text = changed("clearance: 0.05", "").replace("axes:", f"axes:\n  clearance: {axis}")
    got = load(tmp_path, text.split("figures:")[0]).axis_values["clearance"]
    assert got == values
    assert all(math.copysign(1, value) == 1 for value in got)


def test_coordinate_names() -> None:
    names = [coordinate_name("r", v) for v in (0.3, 1.0, 1e-8, 0.1, -0.0, -0.5, 1e22, 100000)]
    assert names == ["r~0.3", "r~1", "r~1e-08", "r~0.1", "r~0", "r~-0.5", "r~1e+22", "r~100000"]


@pytest.mark.parametrize(
    ("override", "count"),
    [({"values": [0.5, 0.6, 0.7, 0.8]}, 4), ({"step": "5e-1"}, 3), ({"start": 0.5}, 251)],
)
def test_override_replaces_the_way_an_axis_is_given(
    tmp_path: Path, override: dict[str, Any], count: int
) -> None:
    study = load(tmp_path, GOOD, override={"axes": {"restitution": override}, "periods": 2})
    assert len(study.axis_values["restitution"]) == count
    assert (study.periods, study.transient) == (2, 300)
    again = load(
        tmp_path, GOOD, override={"axes": {"mass_ratio": {"start": 0.1, "stop": 1, "num": 2}}}
    )
    assert again.axis_values["mass_ratio"] == (0.1, 1.0)
    assert again.fan_axes == study.fan_axes


# What is refused.

TABLE = {name: MISTAKES[name].copy() for name in ("files", "configurations")}
LONG = {
    "no parameters": (GOOD[GOOD.index("  damping_ratio") : GOOD.index("axes:")], "2 errors "),
    "no observers": (GOOD[GOOD.index("  impact_section") :], "at least one observer"),
}
TABLE["files"] |= {name: (old, "", part) for name, (old, part) in LONG.items()}
TABLE["files"] |= {
    "name too long": ("  chatter:", f"  {'x' * 101}:", "name of a table", "up to 100 letters"),
    "nesting": ("0.05\n", "[" * 3000 + "\n", "good.yaml\n    lists or mappings stand too deep"),
}


@pytest.mark.parametrize("name", TABLE["files"])
def test_mistake_is_told(tmp_path: Path, name: str) -> None:
    old, new, *parts = TABLE["files"][name]
    assert old in GOOD
    message = blame(tmp_path, GOOD.replace(old, new, 1))
    for part in parts:
        assert part in message, message


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("", "the file is empty"),
        ("- 1\n", "good.yaml:1\n    the top level must be a mapping (it is a list)"),
        (b"title: a\nsource: \xff\n", "line 2, column 9: not text in UTF-8"),
        (bytes(range(256)), "good.yaml:"),
        ("&a [*a]", "an alias (*)"),
    ],
)
def test_file_that_is_no_study(tmp_path: Path, text: str | bytes, part: str) -> None:
    message = blame(tmp_path, text)
    assert part in message


def test_file_that_is_not_there(tmp_path: Path) -> None:
    (tmp_path / "link.yaml").symlink_to("away.yaml")
    os.mkfifo(tmp_path / "pipe.yaml")
    for path, part in [
        (tmp_path / "none.yaml", "there is no such file"),
        (tmp_path / "link.yaml", "is a link to away.yaml, which does not exist"),
        (tmp_path / "pipe.yaml", "cannot be read: it is a pipe or a device, not a regular file"),
        (tmp_path, "cannot be read"),
    ]:
        with pytest.raises(ConfigError, match=part):
            load_study(path)


def test_value_from_an_override_is_told_as_such(tmp_path: Path) -> None:
    override = {"axes": {"restitution": {"num": "many"}}, "periods": 0, "perods": 1}
    message = blame(tmp_path, GOOD, override=override)
    assert "3 errors" in message
    for key in ("axes.restitution.num", "periods", "perods"):
        assert f"good.yaml (override)  {key}\n" in message
    message = blame(tmp_path, GOOD, override={"axes": {"restitution": {"stop": 0.999}}})
    assert "good.yaml (override))  axes.restitution\n" in message
    assert "good.yaml (override)\n    must be a mapping" in blame(tmp_path, GOOD, override=[1])


def test_override_leaves_out_what_is_null(tmp_path: Path) -> None:
    override = {"figures": {"bifurcation": None}, "tables": {"chatter": None}}
    study = load(tmp_path, GOOD, override=override)
    assert study.figures == study.tables == {}
    # Only there, and only what there is.
    assert "figures.bifurcaton\n" in blame(
        tmp_path, GOOD, override={"figures": {"bifurcaton": None}}
    )
    assert "parameters.clearance\n" in blame(
        tmp_path, GOOD, override={"parameters": {"clearance": None}}
    )


# The workflow's configuration.


def config(folder: Path, **mapping: Any) -> Any:
    return load_config({"studies": ["good"], **mapping}, folder)


def refuse(folder: Path, **mapping: Any) -> str:
    with pytest.raises(ConfigError) as caught:
        config(folder, **mapping)
    return str(caught.value)


def test_good_config(tmp_path: Path) -> None:
    write(tmp_path, GOOD)
    write(tmp_path, GOOD, "other")
    elsewhere = tmp_path / "elsewhere.yaml"
    elsewhere.write_text(GOOD)
    got = config(
        tmp_path,
        studies=["other", "good", "elsewhere.yaml"],
        engine={"accuracy": "1e-9", "max_events": "5000"},
        overrides={
            "good": {"tables": {"chatter": {"resolution": "1e-4"}}, "title": "1e-4"},
            "elsewhere": None,
        },
    )
    assert list(got.studies) == ["other", "good", "elsewhere"]
    assert [study.name for study in got.studies.values()] == list(got.studies)
    assert (got.engine.accuracy, got.engine.max_events, got.results) == (1e-9, 5000, "results")
    assert got.studies["good"].tables["chatter"].resolution == 1e-4
    assert got.studies["good"].title == "1e-4"
    assert type(got.studies["good"].title) is str
    assert got.studies["other"].tables["chatter"].resolution == 1e-3
    assert config(tmp_path).engine.accuracy == 1e-12


@pytest.mark.parametrize("name", TABLE["configurations"])
def test_mistake_in_the_config(tmp_path: Path, name: str) -> None:
    write(tmp_path, GOOD)
    mapping, *parts = TABLE["configurations"][name]
    with pytest.raises(ConfigError) as caught:
        load_config({"studies": ["good"], **mapping}, tmp_path)
    for part in parts:
        assert part in str(caught.value), str(caught.value)


FILE = """\
studies:
  - good
  - god
engine: {accuracy: '1e-9', max_events: 0}
overrides:
  good:
    periods: many
    axes: {restitution: {stop: 0.999}}
"""


def refuse_files(folder: Path, *texts: str | bytes, **given: Any) -> str:
    """Return what is said of files, each merged over those before it."""
    write(folder, GOOD)
    paths = [folder / f"{i}.yaml" for i in range(len(texts))]
    for path, text in zip(paths, texts, strict=True):
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with contextlib.chdir(folder), pytest.raises(ConfigError) as caught:
        load_config(given, folder, paths)
    return str(caught.value)


def test_mistakes_in_files_are_named_by_line(tmp_path: Path) -> None:
    message = refuse_files(tmp_path, FILE, "engine:\n  max_events: -1\nresluts: a\n", targets=3)
    heads = [line for line in message.splitlines() if not line.startswith(" ")][1:]
    assert set(heads) == {
        "0.yaml:3  studies[1]",
        "0.yaml:4  engine.accuracy",
        "1.yaml:2  engine.max_events",
        "1.yaml:3  resluts",
        "--config  targets",
        "0.yaml:7  overrides.good.periods",
        "config/studies/good.yaml:9 (and 0.yaml:8)  axes.restitution",
    }


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("studies: [good]\nresults: a\nresults: b", "0.yaml:3  results\n    the key 'results' is"),
        ("studies: [good\nresults: a", "0.yaml:2\n    not valid YAML at line 2, column 8"),
        (b"studies: [go\0od]", "0.yaml:1\n    not valid YAML at line 1, column 13: the character"),
        ("engine: {}", "0.yaml  studies\n    'studies' is missing"),
    ],
)
def test_file_that_is_no_configuration(tmp_path: Path, text: str | bytes, part: str) -> None:
    assert part in refuse_files(tmp_path, text)
    assert "good.yaml" not in refuse_files(tmp_path, text)


def test_files_are_merged_as_snakemake_merges_them(tmp_path: Path) -> None:
    write(tmp_path, GOOD)
    texts = [b"\xef\xbb\xbfstudies: [god]\nengine: {max_events: 7}\n", b"studies: [good]\n"]
    paths = [tmp_path / f"{i}.yaml" for i in range(2)]
    for path, text in zip(paths, texts, strict=True):
        path.write_bytes(text)
    got = load_config({"engine": {"accuracy": "1e-9"}}, tmp_path, paths)
    assert (got.default, got.engine.max_events, got.engine.accuracy) == (("good",), 7, 1e-9)
    with pytest.raises(ConfigError, match=r"nowhere.yaml\n    there is no such file"):
        load_config({}, tmp_path, [*paths, tmp_path / "nowhere.yaml"])


@pytest.mark.parametrize(
    ("asked", "meant"),
    [
        ("shok.csv", "shock.csv"),
        ("quak.csv", ""),
        ("quake.csv", "quake.yaml"),
        ("shock.cvs", "shock.csv"),
    ],
)
def test_a_file_of_another_kind_is_meant_only_by_its_very_name(
    tmp_path: Path, asked: str, meant: str
) -> None:
    for name in ("quake.yaml", "shock.csv"):
        (tmp_path / name).touch()
    assert unreadable(tmp_path / asked, FileNotFoundError())[1] == meant


@pytest.mark.parametrize("given", ["results/", "./a//b", "x" * 200])
def test_folder_of_results(tmp_path: Path, given: str) -> None:
    write(tmp_path, GOOD)
    assert config(tmp_path, results=given).results == PurePosixPath(given).as_posix()


@pytest.mark.parametrize(
    "given",
    [*("a{b}", "/tmp/a", "../a", ".git", "a b", "a\nb", "a\0b", "x" * 201, "Src/a", "here/a")],
)
def test_folder_that_is_not_for_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, given: str
) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path, GOOD)
    Path("here").write_text("a file")
    message = refuse(tmp_path, results=given)
    assert message.startswith("1 error in the configuration\nconfig  results\n")
    assert "\0" in given or "allowed: a path below the project's folder, of up to 200" in message


def test_what_is_wrong_between_parts_is_said_once_each_is_right(tmp_path: Path) -> None:
    """All of it together; where a part is wrong, more would follow from that alone."""
    text = changed("clearance: 0.05", "restitution: 0.5").replace("each: mass_ratio", "each: x")
    message = blame(tmp_path, text)
    assert [line.split()[1] for line in message.splitlines() if "good.yaml:" in line] == [
        "parameters.clearance",
        "axes.restitution",
        "figures.bifurcation.each",
    ]
    assert blame(tmp_path, text.replace("wall: left", "wall: up")).startswith("1 error ")


def test_all_mistakes_at_once(tmp_path: Path) -> None:
    write(tmp_path, changed("periods: 100", "periods: many\nperiods: 5"))
    write(tmp_path, changed("wall: left", "wall: up").replace("clearance: 0.05", "phase: no"), "b")
    write(tmp_path, "", "c")
    message = refuse(tmp_path, studies=["good", "b", "c", "d"], engine={"accuracy": 3})
    assert message.startswith("7 errors in the configuration\n")
    heads = [line for line in message.splitlines() if not line.startswith(" ")][1:]
    assert heads == [
        "config  engine.accuracy",
        "config  studies[3]",
        "config/studies/good.yaml:11  periods",
        "config/studies/good.yaml:12  periods",
        "config/studies/b.yaml:5  parameters.phase",
        "config/studies/b.yaml:13  observers.impact_section.wall",
        "config/studies/c.yaml",
    ]


# Whatever comes, it ends in a study or in a ConfigError.

ODD = [None, True, -1, 0, 1e400, math.nan, "", "é\ud800", "1e-3", [], {}, [[{}]], {1: 2}]
TOKENS = ["\t", "&a ", "*a ", "<<: ", "? ", "- ", "[", "}", "'", '"', "|", ">", "!!map ", "%", "\\"]
TOKENS += ["\n", ": ", "#", "---\n", "...\n", "~", "1e999", ".nan", "\0", "\x85", "\U0001f600", "@"]


def broken(rng: random.Random, data: Any) -> Any:
    """Return a copy with one part replaced, removed, renamed or moved."""
    data = copy.deepcopy(data)
    node, parent, key = data, None, None
    while isinstance(node, dict | list) and node and (parent is None or rng.random() < 0.8):
        parent = node
        key = rng.choice(list(node)) if isinstance(node, dict) else rng.randrange(len(node))
        node = node[key]
    if parent is None:
        return rng.choice(ODD)
    match rng.randrange(4):
        case 0:
            del parent[key]
        case 1 if isinstance(parent, dict):
            parent[rng.choice([None, 1.5, True, "x", f"{key}s", ""])] = parent.pop(key)
        case 2:
            parent[key] = data if rng.random() < 0.3 else copy.deepcopy(data)
        case _:
            parent[key] = rng.choice(ODD)
    return data


CASES = pytest.mark.parametrize(
    "count", [150, pytest.param(3000, marks=pytest.mark.exhaustive)], ids=str
)


@CASES
def test_any_mapping_ends_well(tmp_path: Path, count: int) -> None:
    rng = random.Random(1)
    write(tmp_path, GOOD)
    whole = yaml.safe_load(GOOD)
    good = {"studies": ["good"], "engine": {"accuracy": "1e-9"}, "overrides": {"good": whole}}
    outcomes = set()
    for _ in range(count):
        bad = good
        for _ in range(rng.randrange(1, 4)):
            bad = broken(rng, bad) if isinstance(bad, dict) else bad
        try:
            load_config(bad, tmp_path)
            outcomes.add("good")
        except ConfigError as error:
            outcomes.add("bad")
            str(error).encode()
    assert outcomes == {"good", "bad"}


@CASES
def test_any_text_ends_well(tmp_path: Path, count: int) -> None:
    rng = random.Random(2)
    outcomes = set()
    for _ in range(count):
        text = GOOD
        for _ in range(rng.randrange(1, 4)):
            i = rng.randrange(len(text))
            text = text[:i] + rng.choice(TOKENS) + text[i + rng.choice([0, 0, 1, 5, 40]) :]
        raw = bytearray(text.encode())
        if rng.random() < 0.1:
            raw[rng.randrange(len(raw))] = rng.randrange(256)
        try:
            study = load(tmp_path, bytes(raw))
            outcomes.add("good")
            assert load(tmp_path, study.to_yaml()) == study
        except ConfigError as error:
            outcomes.add("bad")
            str(error).encode()
    assert outcomes == {"good", "bad"}


def test_heavy_packages_stay_out() -> None:
    loaded = modules_after("import damper.study.config")
    assert not loaded & {"numpy", "xarray", "matplotlib", "numba", "damper.study.reference"}
