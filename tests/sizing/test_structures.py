"""`damper design` on a structure: the search, its runs and what it refuses."""

import math

import numpy as np
import pytest

import damper
from damper.shell import main
from damper.sizing.structures import BoxedDamper, StructureCase, StructureMachine, StructureSearch

MODES = [
    {"frequency": 1.0, "damping_ratio": 0.1, "shapes": {"tip": 1.0, "middle": 0.3}},
    {"frequency": 6.3, "damping_ratio": 0.02, "shapes": {"tip": -1.0, "middle": 0.7}},
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


def search(**changed):
    return StructureSearch(StructureMachine.checked("", MACHINE | changed))


def test_a_run_is_one_of_simulate():
    made = search(counts="rms_displacement")
    found = made.value(BoxedDamper("middle", 0.08, 0.03), StructureCase(1.1, 0, 0, 0.5, 0))
    cube = damper.simulate(
        structure=made.machine.made,
        masses=[{"box": "middle", "free_mass": 0.08, "gap": 0.03, "restitution": 0.6}],
        force_amplitude=2.0,
        forcing_frequency="1.1 Hz",
        state=damper.State([0, 0], [0, 0], 0.0075, 0.0),
        transient=1,
        periods=1,
    )
    assert found == pytest.approx(cube.rms_displacement.sel(point="tip").item(), rel=1e-12)


def test_a_start_on_the_motion_without_damper_stays_on_it():
    made = search(transient=0)
    case = StructureCase(1.1, 1.0, 0.0, 0.0, 0.0)
    found = made.value(BoxedDamper("tip", 1e-9, 9.0), case)
    assert found == pytest.approx(made.machine.without(1.1), rel=1e-6)


def test_a_fresh_start_that_only_still_falls_does_not_exceed():
    made = search()
    damper, falls = BoxedDamper("middle", 1e-6, 9.0), StructureCase(1.0, 1.5, 0.0, 0.0, 0.0)
    made.bounds[damper] = 1.001 * made.machine.without(1.0)
    assert made.value(damper, falls) > made.bounds[damper]
    assert made.lasting(damper, falls) < made.bounds[damper]


def test_the_search_finds_the_least_worst_case(monkeypatch):
    """Of a known worst case; and most dampers get few of their runs."""

    def value(self, damper, case, longer=1):
        self.runs += 1
        off = math.log(damper.gap / 0.031) ** 2 + math.log(damper.mass / 0.1) ** 2
        return (1.0 + off) * (1.5 if damper.box == "tip" else 1.0) * (1.0 + case.hertz / 10.0)

    monkeypatch.setattr(StructureSearch, "value", value)
    made = search()
    found = made.best()
    assert found.box == "middle"
    assert found.mass == 0.1
    assert found.gap == pytest.approx(0.031, rel=0.05)
    assert made.bounds[found] >= max(value(made, found, case) for case in made.cases)
    assert made.runs < 0.5 * len(made.bounds) * len(made.cases)


def test_the_card_has_the_check_by_fresh_starts(monkeypatch, tmp_path):
    random = np.random.default_rng(3)

    def value(self, damper, case, longer=1):
        return (1.0 if damper.box == "tip" else 2.0) + 0.1 * random.uniform()

    monkeypatch.setattr(StructureSearch, "value", value)
    found = damper.design(MACHINE)
    assert found.box == "tip"
    assert found.boxes["box"].tolist() == ["tip", "middle"]
    assert 0.0 < found.fresh_share < 20.0
    assert "It does not help" in found.warnings[-1]
    found.save(tmp_path / "made")
    text = (tmp_path / "made" / "design.txt").read_text()
    assert "fresh random runs above, of 100" in text
    assert len((tmp_path / "made" / "boxes.csv").read_text().splitlines()) == 3


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"point": "tpi"}, r"'tpi' \(did you mean 'tip'\?\)"),
        ({"boxes": ["tpi"]}, r"'tpi' \(did you mean 'tip'\?\)"),
        ({"base_amplitude": "1 mm"}, "the drive is missing, or there are two"),
        ({"structure": {"modes": MODES}}, "it has no force, which moves it"),
        ({"largest_gap": "8 kg"}, "has the unit 'kg'"),
        ({"gap_tolerance": 0.1}, "gap_tolerance"),
        ({"band": [0.0, 1.0]}, "frequencies above 0"),
    ],
)
def test_mistakes_are_named(changed, message):
    with pytest.raises(ValueError, match=f"(?s){message}"):
        damper.design(MACHINE | changed)


def test_quick_is_refused():
    with pytest.raises(ValueError, match="no closed forms for structures"):
        damper.design(MACHINE, quick=True)


def test_the_command_reads_a_file(monkeypatch, tmp_path):
    from click.testing import CliRunner

    monkeypatch.setattr(StructureSearch, "value", lambda self, damper, case: damper.gap)
    (tmp_path / "beam.csv").write_text(
        "frequency,damping_ratio,tip,middle\n1,0.1,1,0.3\n6.3,0.02,-1,0.7\n"
    )
    (tmp_path / "machine.yaml").write_text(
        "title: A beam\nstructure: {modes: beam.csv, force: middle}\nforce_amplitude: 2 N\n"
        "band: [0.9 Hz, 1.1 Hz]\npoint: tip\nlargest_mass: 0.1 kg\nlargest_gap: 80 mm\n"
        "restitution: 0.6\n"
    )
    given = ["design", str(tmp_path / "machine.yaml"), "--output", str(tmp_path / "made")]
    done = CliRunner().invoke(main, given)
    assert done.exit_code == 0, done.output
    assert "A beam: a damper against the largest displacement at tip" in done.output
    assert (tmp_path / "made" / "design.txt").exists()
