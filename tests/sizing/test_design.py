"""An answer: its numbers are those of its studies, its page shows them, what is bad comes first."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from machines import MACHINE
from scipy.signal import lsim
from studies import cube_of

from damper.sizing import study
from damper.sizing.answer import Design, _answer, _changes, _history, _orbit, _without
from damper.sizing.answer import cube_of as cube_of_study
from damper.sizing.clauses import Clause, clauses_of, table_of
from damper.sizing.contact import BALLS, STEEL, ball_diameter
from damper.sizing.machine import machine_of, read_machine
from damper.sizing.page import box, response
from damper.sizing.search import Search
from damper.sizing.study import Sizes, WorstCase
from damper.study.config import load_study

pytestmark = pytest.mark.usefixtures("few_starts_throughout")


@pytest.fixture(scope="module")
def found(few_starts_throughout: None) -> Design:
    """The answer for one damper; the search for the best one has tests of its own."""
    return answer(MACHINE, Sizes(8.0, 0.01, 0.3))


def answer(given: dict, sizes: Sizes) -> Design:
    return _answer(Search(WorstCase(machine_of(given))), sizes)


@pytest.fixture(scope="module")
def folder(found: Design, tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("design")
    found.save(made)
    return made


def damper_of(found: Design) -> Sizes:
    return Sizes(found.free_mass, found.gap, found.restitution)


def test_its_numbers_are_those_of_its_studies(found: Design, folder: Path) -> None:
    cubes = {name: cube_of(load_study(folder / f"studies/{name}.yaml")) for name in found.studies}
    hertz = cubes["worst_case"].forcing_frequency
    inside = (hertz > 18.9) & (hertz < 21.1)
    peaks = [float(cubes[name].peak_displacement.max()) for name in ("sweep", "motions", "worst")]
    peaks.append(float(cubes["worst_case"].peak_displacement.where(inside).max()))
    assert found.worst == max(peaks)
    fresh = cubes["check"].peak_displacement
    assert fresh.sizes == {"draw": study._FRESH}
    assert found.fresh_share == 100.0 * float((fresh > found.worst).mean())
    assert found.fresh_ratio == float(fresh.max()) / found.worst
    assert found.worst >= Search(WorstCase(found.machine)).worst(damper_of(found)) * (1.0 - 1e-12)
    rate = (cubes["worst_case"].impacts_per_period * hertz).where(inside).max()
    assert found.impact_rate >= float(rate) * (1.0 - 1e-12)
    assert found.approach_speed >= float(cubes["worst_case"].max_approach_speed.where(inside).max())
    assert found.motions is not None
    assert cubes["motions"].sizes == {"draw": study.STARTS}
    table = pd.read_csv(folder / "numbers.csv").set_index("name")
    assert table.value["worst"] == found.worst
    assert table.unit["impact_rate"] == "1/s"


def test_the_time_history_is_that_of_the_worst_case(found: Design, folder: Path) -> None:
    """Its largest displacement is the worst case but for its 100 samples in a cycle."""
    table = pd.read_csv(folder / "history.csv")
    assert found.worst * (1.0 - 2e-3) < table.with_damper.abs().max() <= found.worst
    shown = load_study(folder / "studies/history.yaml")
    reached = 0.5 * shown.parameters["gap"].value
    assert np.allclose([table.relative.min(), table.relative.max()], [-reached, reached])
    ratio = found.worst_frequency / 20.0
    own = 1.0 + 0.1j * ratio
    assert math.isclose(table.without.max(), 1e-3 * abs(own / (own - ratio**2)), rel_tol=2e-3)
    assert math.isclose(table.time.iloc[-1], 10.0 / found.worst_frequency, rel_tol=1e-9)
    assert "history.png" in (folder / "design.md").read_text()


def test_the_machine_alone_is_beside_a_mass_that_rubs() -> None:
    """From a study of its own: 7.38 mm at 19 Hz, as the linear machine has it."""
    judge, studies = WorstCase(machine_of(MACHINE | {"friction_coefficient": 0.2})), {}
    case = judge.cases[0]
    table = _history(judge, Sizes(8.0, 0.01, 0.3), case, studies)["history"]
    assert list(studies) == ["history", "history_without"]
    assert math.isclose(table.without.max(), judge.machine.undamped(case.hertz[0]), rel_tol=1e-3)
    assert abs(table.relative).max() <= 0.005 * (1.0 + 1e-9)


@pytest.mark.parametrize(
    ("given", "own", "words"),
    [
        (
            {"orientation": "upright"},
            {"gravity": 9.81},
            "9.81 m/s² pull the free mass to the lower",
        ),
        (
            {"friction_coefficient": 0.2},
            {"friction_coefficient": 0.2, "transverse_acceleration": 9.81},
            "with dry friction of coefficient 0.2, in a box",
        ),
    ],
)
def test_weight_acts_in_every_study(given: dict, own: dict, words: str) -> None:
    """And no closed form is used; without damper nothing rubs."""
    judge, sizes = WorstCase(machine_of(MACHINE | given)), Sizes(8.0, 0.01, 0.3)
    made = [judge.worst_case(sizes), judge.check(sizes), judge.sweep(sizes)]
    made += [judge.one(sizes, judge.cases[0]), judge.motions(sizes, 20.0)]
    made += [judge.motion(sizes, judge.cases[0], 5.0), judge.nearby(sizes, 20.0)]
    assert all(own.items() <= study["parameters"].items() for study in made)
    assert not own.keys() & judge.without()["parameters"].keys()
    assert own.items() <= judge.chain(sizes, judge.cases[0])[0].items()
    assert judge.closed_form(sizes) == {}
    assert words in next(judge.assumptions(quick=False))
    assert judge.check(sizes)["draws"]["initial_velocity"][0] < 0.0


def test_tolerances_are_spoken_of_where_there_are_some(found: Design) -> None:
    exact = replace(found, machine=machine_of(MACHINE | {"gap_tolerance": 0.0}))
    legends = [
        {text.get_text() for text in response(one).axes[0].get_legend().get_texts()}
        for one in (found, exact)
    ]
    assert legends[0] - legends[1] == {"all tolerances, too"}
    cards = [" ".join(words for _, words, _ in one.lines) for one in (found, exact)]
    assert ["tolerances" in card for card in cards] == [True, False]


def test_without_damper_it_is_the_response_of_the_machine_alone(found: Design) -> None:
    """To a base: sqrt(1 + (2 zeta w)^2) / |1 - w^2 + 2 i zeta w|."""
    assert found.response is not None
    ratio = found.response.frequency / 20.0
    own = 1.0 + 0.1j * ratio
    assert np.allclose(found.response.without, 1e-3 * abs(own / (own - ratio**2)), rtol=1e-12)


def test_what_amplifies_outside_of_its_band_says_so_first(found: Design, folder: Path) -> None:
    assert found.outside_ratio > 1.05
    first = "Outside of the band it amplifies"
    assert repr(found).splitlines()[1].startswith(f"! {first}")
    assert (folder / "design.md").read_text().splitlines()[2].startswith(f"> **{first}")
    page = (folder / "design.html").read_text()
    assert page.index(first) < page.index("<svg")


def test_an_idle_free_mass_is_a_warning() -> None:
    """Without damper 7.4 mm at 19 Hz: the walls of a gap of 15 mm reach no free mass at rest."""
    judge = WorstCase(machine_of(MACHINE))
    small = {"worst": 5e-3, "fresh_ratio": 1.0, "without": 6e-3}
    every = [clauses_of(judge, Sizes(8.0, gap, 0.3), small) for gap in (0.01, 0.015)]
    told = [[one.warning for one in clauses if not one.passed] for clauses in every]
    assert told[0] == []
    ratio = 0.95
    alone = 1e-3 * abs((1.0 + 0.1j * ratio) / (1.0 + 0.1j * ratio - ratio**2))
    assert judge.idle(Sizes(8.0, 0.015, 0.3)) == pytest.approx(alone, rel=1e-9)
    assert "by up to 7.38 mm in the band" in told[1][0]


def test_each_clause_has_a_number_a_limit_and_a_verdict(found: Design) -> None:
    clauses = {one.number: one for one in found.clauses}
    assert list(clauses) == sorted(clauses)
    assert not clauses["2.5"].passed
    assert clauses["2.5"].value == found.outside_ratio
    assert clauses["1.1"].passed
    text = repr(found)
    assert re.search(r"\n +2\.5 .* outside of the band +≤ 1\.01 +\S+ +NO\n", text)
    assert sum(not one.passed for one in clauses.values() if one.warning) == len(found.warnings)


@pytest.mark.parametrize(
    ("value", "limit", "shown"),
    [
        (1.0511, 1.05, "1.051"),
        (1.0499, 1.05, "1.05"),
        (1.2, 1.05, "1.2"),
        (1.05001, 1.05, "1.05001"),
    ],
)
def test_a_value_that_does_not_pass_differs_from_its_limit_as_shown(
    value: float, limit: float, shown: str
) -> None:
    table = table_of([Clause("3.1", "largest", value, "<=", limit)])
    assert table[["limit", "value"]].values.tolist() == [["≤ 1.05", shown]]


def test_the_hardest_impact_is_that_of_its_momentum_and_energy(found: Design) -> None:
    """Of 8 kg in a machine of 100 kg at r = 0.3: impulse (1 + r) m v, energy m v^2 (1 - r^2)/2."""
    reduced, v = 800.0 / 108.0, found.approach_speed
    assert math.isclose(found.impulse, 1.3 * reduced * v, rel_tol=1e-9)
    assert math.isclose(found.impact_energy, 0.5 * reduced * v**2 * 0.91, rel_tol=1e-9)
    assert 0.0 < found.power <= found.impact_rate * found.impact_energy * (1.0 + 1e-12)


def test_the_box_is_drawn_with_its_dimensions(found: Design) -> None:
    texts = {text.get_text() for text in box(found).axes[0].texts}
    diameter, *lengths = found.ball_and_box(STEEL.density)
    assert diameter == ball_diameter(8.0, STEEL.density)
    assert {"10 mm", "direction of motion", f"ball, steel: Ø {lengths[0]}"} <= texts
    assert any(text.startswith(f"inside {lengths[1]}") for text in texts)


@pytest.mark.parametrize("gap", [1.061e-6, 1.061e-3, 0.09876, 1.2])
def test_a_box_is_longer_than_its_ball_by_the_gap(found: Design, gap: float) -> None:
    """A ball of 125 mm in a box of 125.9 mm has no gap of 1.06 mm."""
    of = replace(found, gap=gap, slopes={})
    (build,) = (table for heading, _, table in of.tables if heading == "What to build")
    size = {"mm": 1e-3, "m": 1.0}
    for _, row in build.iterrows():
        ball, inside = (
            float(number) * size[unit]
            for number, unit in (row[key].split() for key in ("diameter", "length inside"))
        )
        assert inside - ball == pytest.approx(float(f"{gap:.3g}"), rel=1e-6)
        assert ball == pytest.approx(ball_diameter(8.0, BALLS[row["ball of"]].density), rel=5e-3)


def test_accelerations_may_count() -> None:
    """Without the damper omega^2 A; the largest one between impacts of all runs in the band."""
    given = MACHINE | {"counts": "peak_acceleration", "gap_tolerance": 0.0}
    judge = WorstCase(machine_of(given))
    heavy = Sizes(8.0, judge.closed_form_gap(8.0, 0.3), 0.3)
    studies = judge.sweep(heavy), judge.worst_case(heavy)
    made = [cube_of_study(study).peak_acceleration for study in studies]
    hertz = made[1].forcing_frequency
    most = max(made[0].max(), made[1].where((hertz > 18.9) & (hertz < 21.1)).max())
    assert most <= Search(judge).worst(heavy) * (1.0 + 1e-12) < 1.2 * most
    assert math.isclose(judge.machine.counted(1e-3, 20.0), 1e-3 * (40.0 * math.pi) ** 2)


def test_what_one_per_cent_changes_is_the_slope_of_runs() -> None:
    """By the periodic motion and by differences."""
    judge = WorstCase(machine_of(MACHINE | {"gap_tolerance": 0.0}))
    heavy = Sizes(8.0, 0.9 * judge.closed_form_gap(8.0, 0.3), 0.3)
    orbit = _orbit(judge, heavy, 20.0)
    studies: dict = {}
    exact, near = (_changes(judge, heavy, 20.0, one, studies)["changes"] for one in (orbit, None))
    values = [[float(text[:-2]) for text in table.iloc[:, 1]] for table in (exact, near)]
    assert np.allclose(*values, rtol=0.06, atol=0.01)  # both have two digits
    assert list(studies) == ["nearby"]


def test_a_record_is_the_case(tmp_path: Path) -> None:
    """Without damper as scipy has it; the numbers are those of the files that are saved."""
    time, value = np.array([0.0, 0.02, 0.03, 0.05, 0.1]), np.array([0.0, 9.0, -4.0, 2.0, 0.0])
    rows = zip(time, value, strict=True)
    (tmp_path / "shock.csv").write_text("".join(f"{t},{a}\n" for t, a in rows))
    given = {k: v for k, v in MACHINE.items() if k not in ("base_amplitude", "band")}
    counts = "peak_acceleration"
    given |= {"acceleration_record": str(tmp_path / "shock.csv")}
    displaced = WorstCase(machine_of(given))
    judge = WorstCase(machine_of(given | {"counts": counts}))
    found = _answer(Search(judge), Sizes(8.0, 0.002, 0.3))
    fine = np.linspace(0.0, judge.run["periods"]["time"], 20001)
    shaken = np.interp(fine, time, value)
    rate = 40.0 * math.pi
    system = ([[0, 1], [-(rate**2), -0.1 * rate]], [[0], [-1]], [[1, 0], [0, 1]], [[0], [0]])
    x, v = lsim(system, shaken, fine)[1].T
    alone = abs(rate**2 * x + 0.1 * rate * v).max()
    assert math.isclose(found.without, alone, rel_tol=1e-4)
    assert math.isclose(_without(displaced, [])[0], abs(x).max(), rel_tol=1e-4)
    found.save(tmp_path)
    studies = [path.read_text() for path in (tmp_path / "studies").glob("*.yaml")]
    assert len(studies) > 4
    assert not any("forcing_frequency" in text for text in studies)  # nothing has one
    cube = cube_of(load_study(tmp_path / "studies/worst_case.yaml"))[counts]
    worst = float(cube_of(load_study(tmp_path / "studies/worst.yaml"))[counts])
    assert math.isclose(found.worst, worst, rel_tol=1e-12)
    assert worst >= float(cube.sel(force_amplitude=1.0).max()) * (1.0 - 1e-12)
    assert math.isclose(Search(judge).worst(damper_of(found)), found.worst, rel_tol=1e-12)
    assert found.strong_ratio == float(cube.sel(force_amplitude=2.0).max()) / 2.0 / found.without
    assert read_machine(tmp_path / "machine.yaml").record == judge.machine.record


def test_a_machine_that_is_let_go(tmp_path: Path) -> None:
    free = {"initial_displacement": 0.05, "decay_to": 0.3}
    free |= {"restitution_tolerance": 0.1, "gap_tolerance": 0.0}
    given = {k: v for k, v in MACHINE.items() if k not in ("base_amplitude", "band")}
    found = answer(given | free, Sizes(8.0, 0.08, 0.3))
    assert found.worst < 0.62 * found.without
    assert found.approach_speed < 0.05 * 40.0 * math.pi * (1.0 + 1.3 * 8.0 / 100.0) * 1.5
    momentum = 800.0 / 108.0 * found.approach_speed
    assert 1.2 * momentum < found.impulse <= 1.4 * momentum  # restitutions of 0.2 to 0.4
    assert found.units["worst"] == "s"
    found.save(tmp_path)
    assert "frequency" not in "".join(file.read_text() for file in tmp_path.glob("studies/*"))
    worst = cube_of(load_study(tmp_path / "studies/worst.yaml"))
    assert math.isclose(found.worst, float(worst.fall_time.squeeze()), rel_tol=1e-12)
    envelope = cube_of(load_study(tmp_path / "studies/envelope.yaml"))
    assert found.response is not None
    peaks = envelope.peak_amplitude.values
    assert np.array_equal(found.response.as_built, peaks[~np.isnan(peaks)])


def test_a_study_that_cannot_be_run_is_refused_in_plain_words() -> None:
    with pytest.raises(ValueError, match=r"(?m)^periods: 'periods' is missing: must be") as error:
        cube_of_study({"title": "search: runs"})
    assert "validation error" not in str(error.value)
