"""`damper design` on a structure: the search, its runs and what it refuses."""

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
import yaml

import damper
from damper.shell import main
from damper.sizing import answer, structures, study
from damper.sizing import search as search_module
from damper.sizing.machine import GRAVITY
from damper.sizing.search import Grid
from damper.sizing.structures import (
    BoxedDamper,
    BoxedRun,
    StructureCase,
    StructureJudge,
    StructureMachine,
    StructureSearch,
    structure_machine,
)
from damper.structures.structure.runs import run_part
from damper.structures.structure.settings import StructureStudy

MODES = [
    {"frequency": 1.0, "damping_ratio": 0.1, "shapes": {"tip": 1.0, "middle": 0.3, "base": 1.0}},
    {"frequency": 6.3, "damping_ratio": 0.02, "shapes": {"tip": -1.0, "middle": 0.7, "base": 0.4}},
]
MACHINE = {
    "structure": {"modes": MODES, "force": "middle"},
    "force_amplitude": "2 N",
    "band": ["0.9 Hz", "1.1 Hz"],
    "frequencies": 3,
    "point": "tip",
    "largest_mass": "100 g",
    "largest_gap": "8 cm",
    "restitution": 0.6,
    "transient": 1,
    "periods": 1,
}
STOPS = {"rubber": {"restitution": 0.3, "stated": "data sheet"}, "steel": 0.6}
OF_STEEL = 0.6


def without(*keys, **more):
    """The machine without some of its settings, and with others."""
    return {name: value for name, value in MACHINE.items() if name not in keys} | more


def judge(workers=1, **changed):
    return StructureJudge(StructureMachine.checked("", MACHINE | changed), workers)


def run_of(box, mass, gap, **case):
    return BoxedRun(BoxedDamper(mass, gap, OF_STEEL, box), StructureCase(**case))


@pytest.fixture
def few(monkeypatch):
    """A small search."""
    monkeypatch.setattr(StructureSearch, "_grid", Grid(2.0, (1.0,), (1.4, 1.1)))
    monkeypatch.setattr(StructureSearch, "promising", 1)
    monkeypatch.setattr(study, "_BEYOND", 1)
    monkeypatch.setattr(search_module, "_STEPS", 1)
    monkeypatch.setattr(search_module, "_ROUNDS", 1)
    few = {"_RANDOM": 1, "_FRESH": 3, "_LEAST_GAP": 0.5, "PLACES": [0.0, 0.5]}
    for name, count in few.items():
        monkeypatch.setattr(structures, name, count)
    monkeypatch.setattr(answer, "CHECK", 3)


@pytest.mark.parametrize("friction", [0.0, 0.02])
def test_a_run_is_one_of_simulate(friction):
    made = judge(counts="rms_displacement", gap_tolerance="2 mm", friction_coefficient=friction)
    run = run_of("middle", 0.08, 0.028, place=0.5, hertz=(1.1,), off=(0, 1, 0))
    cube = damper.simulate(
        structure=made.machine.made,
        masses=[{"box": "middle", "free_mass": 0.08, "gap": 0.03, "restitution": OF_STEEL}],
        force_amplitude=2.0,
        forcing_frequency="1.1 Hz",
        state=damper.State([0, 0], [0, 0], 0.0075, 0.0),
        friction_coefficient=friction,
        transverse_acceleration=GRAVITY,
        transient=1,
        periods=1,
    )
    found = made.measured(run)
    assert (cube.friction_power.item() > 0.0) == (friction > 0.0)
    assert f"friction of coefficient {friction}" in next(made.assumptions(False)) or not friction
    wanted = cube.rms_displacement.sel(point="tip").item()
    assert found["rms_displacement"] == pytest.approx(wanted, rel=1e-12)
    assert found["impact_power"] == pytest.approx(cube.impact_power.item(), rel=1e-12)


def test_masses_side_by_side_in_an_upright_box_are_those_of_simulate():
    """They share the mass, their gaps differ a little, and they begin apart."""
    made = judge(orientation="upright", transient=0)
    made = replace(made, count=2)
    run = run_of("middle", 0.08, 0.03, place=0.5, spacing=0.7, hertz=(1.1,))
    mass = {"box": "middle", "free_mass": 0.04, "restitution": OF_STEEL}
    gaps = [0.03 * (1.0 - study.SPREAD), 0.03 * (1.0 + study.SPREAD)]
    cube = damper.simulate(
        structure=made.machine.made,
        masses=[mass | {"gap": gap} for gap in gaps],
        gravity=9.81,
        force_amplitude=2.0,
        forcing_frequency="1.1 Hz",
        state=damper.State([0, 0], [0, 0], [0.25 * gaps[0], 0.4 * gaps[1]], [0.0, 0.0]),
        transient=0,
        periods=1,
    )
    found = made.measured(run)
    wanted = cube.peak_displacement.sel(point="tip").item()
    assert found["peak_displacement"] == pytest.approx(wanted, rel=1e-12)
    assert found["impact_power"] == pytest.approx(cube.impact_power.sum().item(), rel=1e-12)
    assert found["max_approach_speed"] == pytest.approx(cube.max_approach_speed.max().item())
    assert any("2 rigid free masses side by side" in one for one in made.assumptions(False))
    studied = StructureStudy.checked("", made.studies(run.damper, run.case)["from_rest"])
    (first, _), axis = studied.masses, tuple(studied.axes["gap"].points)
    assert first == mass
    assert axis == (0.03,)
    assert studied.parameters["gravity"] == 9.81


def test_the_best_number_of_masses_is_chosen(monkeypatch, few):
    def value(self, run):
        found = dict.fromkeys(structures._OF_MASS, 0.0)
        return found | {"peak_displacement": 1.0 / self.count + 0.1 * run.damper.gap}

    monkeypatch.setattr(StructureJudge, "measured", value)
    found = damper.design(MACHINE | {"units": [1, 2]})
    assert found.counts["units"].tolist() == ["2", "1"]
    assert (found.count, found.boxes_to_build) == (2.0, 2)
    assert found.alike == pytest.approx(found.worst + 0.5)


def test_a_start_on_the_motion_without_damper_stays_on_it():
    made = judge(transient=0)
    found = made.measured(run_of("tip", 1e-9, 9.0, part=1.0, hertz=(1.1,)))
    assert found["peak_displacement"] == pytest.approx(made.machine.undamped(1.1), rel=1e-6)


def test_a_fresh_start_that_only_still_falls_does_not_exceed():
    made = StructureSearch(judge())
    run = run_of("middle", 1e-6, 9.0, part=1.5, hertz=(1.0,))
    made.bounds[run.damper] = 1.001 * made.judge.machine.undamped(1.0)
    assert made.judge.measured(run)["peak_displacement"] > made.bounds[run.damper]
    assert made.lasting(run.damper, [run.case])[0] < made.bounds[run.damper]


def known(value):
    """A judge's measurement whose value is known."""

    def measured(self, run):
        found = dict.fromkeys(structures._OF_MASS, 0.0)
        return found | {"peak_displacement": value(run.damper, run.case)}

    return measured


def test_the_search_finds_the_least_worst_case(monkeypatch):
    """Of a known worst case; and most dampers get few of their runs."""

    def value(damper, case):
        off = math.log(damper.gap / 0.031) ** 2 + math.log(damper.mass / 0.1) ** 2
        return (1.0 + off) * (1.5 if damper.box == "tip" else 1.0) * (1.0 + case.hertz[0] / 10.0)

    monkeypatch.setattr(StructureJudge, "measured", known(value))
    made = StructureSearch(judge())
    found = made.best()
    assert found.box == "middle"
    assert found.mass == 0.1
    assert found.gap == pytest.approx(0.031, rel=0.02)
    assert made.bounds[found] >= max(value(found, case) for case in made.judge.cases)
    assert len(made.judge.seen) < 0.5 * len(made.bounds) * len(made.judge.cases)


def test_a_hard_fresh_start_becomes_a_case_of_all_dampers(monkeypatch, few):
    """The tip is better but for a rare start, which the middle has not."""

    def value(damper, case):
        rare = damper.box == "tip" and case.speed > 0.5
        return 3.0 if rare else 1.0 if damper.box == "tip" else 2.0

    monkeypatch.setattr(StructureJudge, "measured", known(value))
    monkeypatch.setattr(structures, "_RANDOM", 0)
    monkeypatch.setattr(structures, "_FRESH", 40)
    monkeypatch.setattr(search_module, "_ROUNDS", 3)
    made = StructureSearch(judge())
    first = len(made.judge.cases)
    assert made.best().box == "middle"
    assert len(made.judge.cases) > first


def test_the_card_has_the_check_by_fresh_starts(monkeypatch):
    def value(damper, case):
        return (1.0 if damper.box == "tip" else 2.0) + 0.1 * case.turn

    monkeypatch.setattr(search_module, "_ROUNDS", 0)
    monkeypatch.setattr(StructureJudge, "measured", known(value))
    found = damper.design(MACHINE)
    assert found.box == "tip"
    assert found.boxes["box"].tolist() == ["tip", "middle"]
    assert 0.0 < found.fresh_share < 50.0
    assert any("It does not help" in text for text in found.warnings)


def test_tolerances_are_a_part_of_the_worst_case(monkeypatch):
    monkeypatch.setattr(StructureJudge, "measured", known(lambda _, case: 2.0 + case.off[1]))
    found = damper.design(MACHINE | {"gap_tolerance": "1 mm"})
    assert (found.worst, found.as_built) == (3.0, 2.0)
    assert found.tolerances.values.tolist() == [["gap, 1 mm", "1 m", "2 m", "3 m"]]


def test_the_same_design_by_any_number_of_threads(monkeypatch, few):
    """The best one of two materials."""
    cards = []
    for workers in (1, 2):
        monkeypatch.setattr("damper.sweep.runs.COMPILED", workers > 1)
        given = without("restitution", frequencies=2, materials=STOPS, boxes=["tip"])
        made = StructureJudge(StructureMachine.checked("", given), workers)
        search = StructureSearch(made)
        found = answer._answer_on(search, search.best())
        each = search.best_of_each(search.best_of([*search.bounds]), "restitution")
        cards.append((repr(found), each))
    assert cards[0] == cards[1]
    assert found.as_built == found.worst < found.without
    motion = found.history
    assert motion is not None
    assert abs(motion.with_damper).max() == pytest.approx(found.worst, rel=0.01)
    assert abs(motion.relative).max() <= 0.5 * found.gap * (1.0 + 1e-12)
    assert set(found.slopes) == {"free_mass", "gap", "restitution"}
    heavier = search.judge.nearby(BoxedDamper(found.free_mass, found.gap, OF_STEEL, "tip"), 1.0)
    assert dict(heavier)["gap"][1] > 0.0
    worst = StructureStudy.checked("", found.studies["worst"])
    (job,) = worst.parts({}).values()
    cube = run_part((), **job.settings).arrays
    assert cube["peak_displacement"].ravel()[0] == pytest.approx(found.worst, rel=1e-9)
    assert sorted(one.restitution for one in each) == [0.3, OF_STEEL]
    assert "(" in {name: text for name, _, text in found.lines}["restitution"]


def test_a_record_of_the_ground(few, tmp_path):
    """From a file beside the machine's; the page has all that is needed to make it again."""
    time = np.linspace(0.0, 1.0, 21)
    rows = "".join(f"{t:.2f},{math.sin(7.0 * t):.6f}\n" for t in time)
    (tmp_path / "ground.csv").write_text("time (s),acceleration (m/s2)\n" + rows)
    given = without("force_amplitude", "band", "frequencies", "transient", "periods", boxes=["tip"])
    text = yaml.safe_dump(given | {"acceleration_record": "ground.csv"})
    (tmp_path / "machine.yaml").write_text(text)
    found = damper.design(tmp_path / "machine.yaml")
    ground = {"forcing": damper.Record.read(tmp_path / "ground.csv", of="base_acceleration")}
    cube = damper.simulate(
        structure=found.machine.made,
        masses=[{"box": "tip", "free_mass": 0.1, "gap": 100.0, "restitution": 0.0}],
        transient=0,
        force_amplitude=1.0,
        periods={"time": 3.0},
        **ground,
    )
    assert found.without == pytest.approx(cube.peak_displacement.sel(point="tip").item(), rel=1e-9)
    assert "from the base" in found.machine.measured[2]
    assert abs(found.response["without"]).max() == pytest.approx(found.without, rel=0.01)
    found.save(tmp_path / "page")
    again = structure_machine(tmp_path / "page" / "machine.yaml", {})
    assert again.record.value.tolist() == found.machine.record.value.tolist()
    study = yaml.safe_load((tmp_path / "page" / "studies" / "from_rest.yaml").read_text())
    assert StructureStudy.checked("", study).masses[0]["free_mass"] == found.free_mass


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"point": "tpi"}, r"'tpi' \(did you mean 'tip'\?\)"),
        ({"boxes": ["tpi"]}, r"'tpi' \(did you mean 'tip'\?\)"),
        ({"base_amplitude": "1 mm"}, "force_amplitude and base_amplitude are given"),
        ({"structure": {"modes": MODES}}, "it has no force, which moves it"),
        ({"largest_gap": "8 kg"}, "has the unit 'kg'"),
        ({"gap_tolerance": 0.1}, "is within its tolerance"),
        ({"record_step": 0.1}, "there is none"),
        ({"initial_displacement": "1 mm"}, "initial_displacement"),
        ({"band": [0.0, 1.0]}, "frequencies above 0"),
        (
            {"friction_coefficient": 0.1, "orientation": "upright"},
            "^friction_coefficient: friction_coefficient in an upright box",
        ),
        ({"units": [1, 2, 3, 4, 5, 6]}, "^units: 6 numbers of masses.*at most 5"),
    ],
)
def test_mistakes_are_named(changed, message):
    with pytest.raises(ValueError, match=f"(?s){message}"):
        damper.design(MACHINE | changed)


def test_a_structure_may_be_made_already():
    by_matrices = damper.Structure(
        mass=[[2, 0], [0, 1]],
        stiffness=[[300, -100], [-100, 100]],
        boxes={"tip": 1},
        force=0,
        base=[1, 1],
        points={"middle": [0.5, 0.5]},
    )
    for made in (StructureMachine.checked("", MACHINE).made, by_matrices):
        again = structure_machine(None, MACHINE | {"structure": made})
        assert again.made == made
        assert structure_machine(json.loads(json.dumps(again.written())), {}).made == made


def test_quick_is_refused():
    with pytest.raises(ValueError, match="no closed forms for structures"):
        damper.design(MACHINE, quick=True)


def test_the_command_reads_a_file(monkeypatch, tmp_path):
    from click.testing import CliRunner

    monkeypatch.setattr(StructureJudge, "measured", known(lambda damper, case: damper.gap))
    (tmp_path / "beam.csv").write_text(
        "frequency,damping_ratio,tip,middle\n1,0.1,1,0.3\n6.3,0.02,-1,0.7\n"
    )
    (tmp_path / "machine.yaml").write_text(
        "title: A beam\nstructure: {modes: beam.csv, force: middle}\nforce_amplitude: 2 N\n"
        "band: [0.9 Hz, 1.1 Hz]\npoint: tip\nlargest_mass: 0.1 kg\nlargest_gap: 80 mm\n"
        "restitution: 0.6\nunits: 1\ntransient: 1\nperiods: 1\n"
    )
    given = ["design", str(tmp_path / "machine.yaml"), "--output", str(tmp_path / "made")]
    done = CliRunner().invoke(main, given)
    assert done.exit_code == 0, done.output
    assert "A beam: a damper against the largest displacement at tip" in done.output
    assert re.search(r"\n  box +tip\n", done.output)
    assert (tmp_path / "made" / "design.html").exists()
    again = structure_machine(tmp_path / "made" / "machine.yaml", {})
    assert again.made.frequencies.tolist() == pytest.approx([1.0, 6.3])
