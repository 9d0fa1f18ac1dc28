"""What an engineer gives: one clear message for what is wrong, and what would be feasible."""

import math
import re
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner
from new_process import modules_after

import damper
from damper.shell import main
from damper.sizing.answer import machine_from
from damper.sizing.machine import machine_of, read_machine
from damper.sizing.page import sketch
from damper.sizing.study import Sizes
from damper.study.yaml_file import ConfigError, dump_yaml

FRAME = {
    "mass": 100.0,
    "stiffness": 4e6,
    "damping_ratio": 0.02,
    "force_amplitude": 200.0,
    "band": [28.0, 36.0],
    "largest_mass": 10.0,
    "largest_gap": 5e-3,
    "restitution": 0.3,
}


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"band": [30.0, 30.0]}, ["low must be less than high (value: [30.0, 30.0])"]),
        ({"band": [0.0, 30.0]}, ["0 to 30 Hz with a natural", "31.83 Hz: must be within 0.3183"]),
        ({"band": [1.0, 1e300]}, ["1 to 1e+300 Hz with a natural", "to 3183 Hz"]),
        ({"stiffness": 1e-300}, ["stiffness", "value: 1e-300", ">= 1e-09 and <= 1e+24"]),
        ({"force_amplitude": 1e-320}, ["force_amplitude", "value: 1e-320", ">= 1e-12"]),
        ({"gap_tolerance": 1e-20}, ["gap_tolerance: 1e-20 is lost in roundoff", "least 5e-09"]),
        ({"title": "a\nb"}, ["title: the text has more than one line"]),
        ({"largest_gp": 1.0}, ["key 'largest_gp'", ", units", "did you mean 'largest_gap'"]),
        ({"largest_mass": 200.0}, ["machine of 100 kg", "0.001 to 100 kg"]),
        ({"largest_mass": 1e-4}, ["0.001 to 100 kg"]),
        ({"gap_tolerance": 6e-3}, ["largest_gap", "more than gap_tolerance = 0.006 m"]),
        ({"restitution_tolerance": 0.4}, ["restitution from -0.1 to 0.7", "up to 0.3"]),
        ({"natural_frequency": 30.0}, ["exactly one of natural_frequency, stiffness"]),
        ({"unbalance": 1.0}, ["force_amplitude and unbalance are given"]),
        ({"decay_to": 0.2}, ["decay_to says where a free motion ends", "or with initial_disp"]),
        ({"counts": "decay_time"}, ["decay_time does not go with force_amplitude"]),
        ({"materials": {"rubber": 0.3}}, ["restitution and materials are given", "exactly one"]),
        ({"materials": {f"m{k}": 0.3 for k in range(21)}}, ["21 materials", "at most 20"]),
        ({"units": [1, 0]}, ["units[1]: ", "value: 0", ">= 1"]),
        ({"units": [1, 17]}, ["units[1]: ", "value: 17", "<= 16"]),
        ({"units": "1, two"}, ["units[1]: ", "'two'"]),
        ({"units": [1, 2, 3, 4, 5, 6]}, ["6 numbers of masses", "at most 5"]),
        ({"units": "1,2"}, ["quick: units = [1, 2]: the closed forms know one free mass alone"]),
        ({"units": 4}, ["quick: units = [4]: the closed forms know one free mass alone"]),
        ({"orientation": "uprite"}, ["orientation", "'uprite'", "'upright'"]),
        (
            {"orientation": "upright", "friction_coefficient": 0.1},
            ["friction_coefficient in an upright box", "0, or orientation: lying"],
        ),
        ({"orientation": "upright"}, ["quick: orientation = upright: the closed forms know"]),
        ({"friction_coefficient": 0.1}, ["quick: friction_coefficient = 0.1: the closed forms"]),
        ({"unit": 4}, ["unknown key 'unit'", "did you mean 'units'"]),
        (
            {"band": [40.0, 50.0]},
            ["band = [40, 50] Hz", "closed forms hold at the natural frequency, 31.83 Hz"],
        ),
        ({"limit": "0.1 s"}, ["limit: '0.1 s': has the unit 's': must be a number in m, or with"]),
        ({"limit": "0.1 mm"}, ["limit = 0.0001 m", "limit >= 0.181 mm", "mass of some 19.5 kg"]),
    ],
)
def test_what_is_wrong_is_told_with_what_would_be_feasible(given: dict, words: list) -> None:
    with pytest.raises(ValueError, match=r".") as error:
        damper.design(**FRAME | given, quick=True)
    for word in words:
        assert word in str(error.value)


@pytest.mark.parametrize("key", FRAME)
@pytest.mark.parametrize("orientation", ["lying", "upright"])
def test_a_key_that_is_left_out_is_named_whatever_the_box(key: str, orientation: str) -> None:
    free = {"initial_displacement": 0.01, "decay_to": 0.1}
    for drive in ({}, free):
        given = FRAME | {"orientation": orientation} | drive
        if drive:
            given = {k: v for k, v in given.items() if k not in ("force_amplitude", "band")}
        if key not in given:
            continue
        with pytest.raises(ValueError, match=f"{key}|the drive") as error:
            machine_of({k: v for k, v in given.items() if k != key})
        assert "missing" in str(error.value) or "exactly one" in str(error.value)


def test_a_value_that_few_machines_have_is_asked_about_and_taken() -> None:
    """A gap of 20 m may be meant, so it is no mistake; 20 mm is not spoken of."""
    asked = damper.design(FRAME | {"largest_gap": 20.0}, quick=True)
    assert repr(asked).splitlines()[1] == (
        "! largest_gap = 20 m is unusual: 1e-06 to 0.5 m is usual. Is another unit meant, as in "
        "20 mm? It is taken as it stands."
    )
    assert asked.machine.largest_gap == 20.0
    assert not damper.design(FRAME | {"largest_gap": "20 mm"}, quick=True).warnings
    damped = damper.design(FRAME | {"damping_ratio": 0.4}, quick=True)
    assert "damping_ratio = 0.4 is unusual: 0 to 0.3 is usual" in damped.warnings[0]


def test_each_mistake_has_a_line() -> None:
    given = {"mass": -1.0, "restitution": "a", "stiffness": "4 kg", "largest_gap": "0,5 mm"}
    with pytest.raises(ValueError, match=r".") as error:
        damper.design(**FRAME | given, quick=True)
    gap, mass, restitution, stiffness = sorted(str(error.value).splitlines())
    assert gap == "largest_gap: '0,5 mm': has a decimal comma: must be '0.5 mm'"
    assert stiffness.startswith("stiffness: '4 kg': has the unit 'kg': must be a number in N/m")
    assert mass == "mass: out of range (value: -1.0): must be number >= 1e-09 and <= 1e+12"
    assert restitution.startswith("restitution: not a number (value: 'a'): must be number >= 0")
    with pytest.raises(TypeError, match=r"^machine = 3: must be the path of a YAML file, or a map"):
        damper.design(3)  # type: ignore[arg-type]


def test_runs_that_cannot_help_or_end_are_refused_before_the_search() -> None:
    with pytest.raises(ValueError, match=r"largest_gap = 1e-07: .* must be at least 1.06 µm"):
        damper.design(FRAME, largest_gap=1e-7)
    free = {k: v for k, v in FRAME.items() if k not in ("force_amplitude", "band")}
    free |= {"largest_mass": 1e-3, "damping_ratio": 0.0, "restitution": 0.99, "decay_to": 1e-6}
    with pytest.raises(ValueError, match=r"decay_to = 1e-06: the decay takes .* at most 1e\+06"):
        damper.design(free, initial_displacement=1.0)


def test_a_weight_that_hides_the_end_of_a_decay_is_refused() -> None:
    """10 kg on 4e6 N/m: 0.0245 mm, where the decay from 1 mm ends at 0.1 mm."""
    free = {k: v for k, v in FRAME.items() if k not in ("force_amplitude", "band")}
    free |= {"orientation": "upright", "initial_displacement": 1e-3}
    with pytest.raises(ValueError, match=r"orientation: the weight .* by 2.45e-05 m, more than"):
        machine_of(free)
    assert machine_of(free | {"decay_to": 0.5}).weight == {"gravity": 9.81}


def test_what_does_not_go_with_a_record_is_told(tmp_path: Path) -> None:
    path = tmp_path / "shock.csv"
    given = {k: v for k, v in FRAME.items() if k not in ("force_amplitude", "band")}
    given["acceleration_record"] = str(path)
    with pytest.raises(ValueError, match=r"acceleration_record: .*shock.csv"):
        damper.design(given)
    path.write_text("time (s),acceleration (m/s2)\n0,0\n0.01,5\n0.02,0\n")
    with pytest.raises(ValueError, match=r"quick: the closed forms .* not under a record"):
        damper.design(given, quick=True)
    with pytest.raises(ValueError, match=r"acceleration_record has no band of frequencies"):
        damper.design(given, band=[20.0, 30.0])
    with pytest.raises(ValueError, match=r"decay_time does not go with acceleration_record"):
        damper.design(given, counts="decay_time")


@pytest.mark.parametrize(("room", "gap"), [(0.08, 0.01234), (0.005, 0.005)])
def test_the_law_of_decay_answers_whether_its_gap_fits_or_not(room: float, gap: float) -> None:
    """It ends at the fold, xi^2 = 1 - 1/(1 + rho^2), which a gap 2 A / xi puts at A."""
    given = {"mass": 0.5, "natural_frequency": 8.0, "damping_ratio": 0.01, "restitution": 0.3}
    given |= {"initial_displacement": 0.02, "largest_mass": 0.05, "largest_gap": room}
    found = damper.design(**given, quick=True)
    rho = 2.0 / math.pi * 0.7 / 1.3
    assert found.gap == gap == min(room, float(f"{0.004 * math.hypot(1.0, rho) / rho:.4g}"))
    assert 0.0 < found.closed_form < found.without


def test_the_best_material_is_named_with_its_origin() -> None:
    """At resonance 1/A grows with (1 + r)/(1 - r); 0.6 has a larger motion at the same gap."""
    lead, rubber = {"restitution": 0.05, "stated": "a handbook"}, {"restitution": 0.25}
    given = FRAME | {"materials": {"lead": lead, "rubber": rubber, "steel": 0.6}}
    del given["restitution"]
    found = damper.design(given, quick=True)
    assert found.materials.material.tolist() == ["rubber", "lead", "steel"]
    card = repr(found)
    assert "0.25, rubber (the origin of its restitution is not given)" in card
    cork = {"materials": given["materials"] | {"cork": 0.25}}
    assert "rubber (the origin of its restitution is not given) or cork (" in repr(
        damper.design(given | cork, quick=True)
    )
    del given["materials"]["rubber"]
    assert "0.05, lead (stated: a handbook)" in repr(damper.design(given, quick=True))
    del given["materials"]
    with pytest.raises(ValueError, match=r"restitution_range: restitution from 1.2 to 1.2"):
        damper.design(given, restitution_range=[0.5, 1.2])


def test_a_file_is_read_with_its_lines_and_options_count_before_it(tmp_path: Path) -> None:
    path = tmp_path / "machine.yaml"
    path.write_text(dump_yaml(FRAME))
    assert repr(damper.design(path, quick=True)) == repr(damper.design(FRAME, quick=True))
    card = called("design", str(path), "--quick", "--restitution", "0.5")
    assert "coefficient of restitution                    0.5\n" in card
    assert card == f"{damper.design(path, quick=True, restitution=0.5)!r}\n"
    path.write_text("mas: 100\n" + dump_yaml(FRAME))
    with pytest.raises(ConfigError, match=r"machine.yaml:1  mas\n .*\n .*\n .*'mass'\?"):
        damper.design(path)
    assert "unknown key 'mas'" in called("design", str(path), code=1)
    assert "did you mean" not in called("design", str(tmp_path / "nofile.yaml"), code=1)
    near = (called("design", str(tmp_path / name), code=1) for name in ("machin.yaml", "machine"))
    assert all("did you mean 'machine.yaml'?" in message for message in near)
    assert "the drive is missing" in called("design", "--quick", code=1)


@pytest.mark.usefixtures("few_starts")
@pytest.mark.parametrize("key", ["force-record", "acceleration-record"])
def test_records_and_ranges_are_given_in_the_shell(
    key: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All but the search, which takes half a minute."""
    best = (10.0, 1e-3, 0.2)
    monkeypatch.setattr("damper.sizing.search.Search.best", lambda search: Sizes(*best))
    monkeypatch.chdir(tmp_path)
    names = ("mass", "stiffness", "damping_ratio", "largest_mass", "largest_gap")
    options = [f"--{name.replace('_', '-')}={FRAME[name]}" for name in names]
    options += ["--restitution-range", "0.2", "0.6", f"--{key}"]
    Path("shock.csv").write_text("0;0\n0,01;5\n0,02;0\n")
    card = called("design", *options, "shock.csv", "--output", "made")
    assert re.search(r"\n  coefficient of restitution +0\.2\n", card)
    assert card.count("! The file of the record") == 1
    assert re.search(r"\n  worst case: the largest over starts +\d", card)
    assert "anywhere in the box" in Path("made/design.md").read_text()
    message = called("design", *options, "shok.csv", code=1)
    name = key.replace("-", "_")
    assert f"{name}: shok.csv: there is no such file (did you mean 'shock.csv'?)" in message
    Path("shock.csv").write_text("a (V)\n0\n5\n0\n")
    message = called("design", *options, "shock.csv", code=1)
    assert "shock.csv, line 2: 1 column: must be two, time and value, and `record_delim" in message
    message = called("design", "--record-step", "10 ms", *options, "shock.csv", code=1)
    assert "a is in V: must be in " in message
    assert message.endswith("or without unit; `record_factor` may give its size\n")


def test_how_a_record_is_read_is_said_in_file_and_shell(tmp_path: Path) -> None:
    path = tmp_path / "machine.yaml"
    given = {k: v for k, v in FRAME.items() if k not in ("force_amplitude", "band")}
    (tmp_path / "shock.csv").write_text("t (ms);north (g);east (V)\n0;0;1\n10;0,5;3\n")
    given |= {"acceleration_record": "shock.csv", "record_columns": [0, "north"]}
    path.write_text(dump_yaml(given))
    found = read_machine(path)
    assert found.record == damper.Record([0.0, 0.01], [0.0, 4.903325], of="base_acceleration")
    assert "north in g, which is taken as 9.80665 m/s2 (record_columns" in found.notes[0]
    found = machine_from(path, {"record_columns": "t,2", "record_factor": "10"})
    assert found.record.value.tolist() == [10.0, 30.0]
    found = machine_from(path, {"record_columns": "2", "record_factor": 1, "record_step": "2 s"})
    assert found.record == damper.Record([0.0, 2.0], [1.0, 3.0], of="base_acceleration")
    with pytest.raises(ValueError, match=r"record_step says how .* must be left out, or with"):
        machine_of(FRAME | {"record_step": 1.0})


def test_nothing_of_it_is_loaded_before_it_is_asked_for() -> None:
    code = """
import contextlib, io
import damper
from damper.shell import main
with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
    main(["check", "config/studies/machine_frame.yaml"])
"""
    assert not [name for name in modules_after(code) if name.startswith("damper.sizing")]


def test_the_examples_in_the_documents_are_machines(tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "docs/sizing.md").read_text("utf-8")
    frame, materials = (part.split("```")[0] for part in text.split("```yaml\n")[1:])
    path = tmp_path / "frame.yaml"
    path.write_text(frame)
    assert "by the closed form" in repr(damper.design(path, quick=True))
    lines = frame.splitlines(keepends=True)
    path.write_text("".join(line for line in lines if "restitution:" not in line) + materials)
    assert "rubber (stated: the maker's data sheet)" in repr(damper.design(path, quick=True))


@pytest.mark.parametrize(
    ("place", "message"),
    [
        ("file.txt", "output = file.txt: cannot be written (Not a directory)"),
        ("file.txt/made", "output = file.txt/made: cannot be written (Not a directory)"),
        ("folder", "folder/design.md is a folder: must be free for a file"),
        ("studies", "studies/studies/sweep.yaml is a folder: must be free for a file"),
        (".", "machine.yaml is read, and would be replaced: must be another folder"),
        ("", "output = '': must be the path of a folder"),
    ],
)
def test_the_place_of_a_page_is_tested_before_anything_is_computed(
    place: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("damper.sizing.answer.design", lambda *_, **__: pytest.fail("computed"))
    Path("file.txt").touch()
    Path("folder/design.md").mkdir(parents=True)
    Path("studies/studies/sweep.yaml").mkdir(parents=True)
    Path("machine.yaml").write_text(dump_yaml(FRAME))
    assert message in called("design", "machine.yaml", "--output", place, code=1)


def test_the_sketch_shows_what_drives_it_in_units_of_suitable_size() -> None:
    given = {"mass": 2e7, "natural_frequency": 0.16, "damping_ratio": 0.02, "unbalance": 0.012}
    given |= {"band": [0.15, 0.17], "largest_mass": 2e5, "largest_gap": 1.0, "restitution": 0.3}
    figure = sketch(damper.design(given, quick=True))
    texts = {text.get_text() for text in figure.axes[0].texts}
    assert {"20000 t", "0.16 Hz", "2 % of critical", "free mass 200 t", "12 kg mm"} <= texts
    assert not texts & {"$F$", "$F(t)$"}
    del given["natural_frequency"]
    figure = sketch(damper.design(given, stiffness=2.0206e7, quick=True))
    assert {"20.21 MN/m", "804 kN s/m"} <= {text.get_text() for text in figure.axes[0].texts}


@pytest.mark.parametrize(
    ("slope", "gap", "worst"), [(-8.4, "0.965 mm", "0.409 mm"), (0.4, "0.97 mm", "0.409 mm")]
)
def test_numbers_have_the_digits_that_the_sensitivity_supports(
    slope: float, gap: str, worst: str
) -> None:
    """0.97 mm is 0.49 % more than 0.9653 mm, 0.965 mm is 0.03 % less."""
    quick = damper.design(FRAME, quick=True)
    found = replace(quick, gap=9.653e-4, worst=4.094e-4, slopes={"gap": slope})
    texts = {name: text for name, _, text in found.lines}
    assert (texts["gap"], texts["worst"]) == (gap, worst)


def called(*arguments: str, code: int = 0) -> str:
    result = CliRunner().invoke(main, arguments, prog_name="damper")
    assert result.exit_code == code, result.output
    return result.output
