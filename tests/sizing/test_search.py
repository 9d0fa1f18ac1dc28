"""The optimiser against the closed forms in their limits and against whole grids."""

import math
import random

import numpy as np
import pytest
from machines import FRAME

from damper.sizing import search as search_module
from damper.sizing import study
from damper.sizing.machine import machine_of
from damper.sizing.search import Search, measure
from damper.sizing.study import Case, Chain, Sizes, WorstCase

#: The natural frequency of a machine of rate 1, in Hz.
F = 0.5 / math.pi
LIGHT = {"mass": 1000.0, "stiffness": 1000.0, "largest_mass": 1.0, "largest_gap": 1e6}


@pytest.mark.exhaustive
@pytest.mark.usefixtures("few_starts")
@pytest.mark.parametrize("whole", [False, True])
def test_the_decay_law_is_found_in_its_limit(whole: bool) -> None:
    """At a mass ratio of 1e-3: the time to 1 %, by a gap within 5 % of the law's fold.

    From all dampers, or from gaps about the law's in steps of 8 %. The law knows no start: it is
    the median of all of them, and the worst one, which falls into step late, is a little longer.
    """
    given = {"damping_ratio": 1e-3, "initial_displacement": 1.0, "decay_to": 0.5}
    judge = WorstCase(machine_of({**LIGHT, **given, "restitution": 0.2}))
    search, asked = Search(judge), Sizes(1.0, judge.closed_form_gap(1.0, 0.2), 0.2)
    about = [Sizes(1.0, asked.gap * (1.0 + 0.08 * k), 0.2) for k in (-1, 0, 1)]
    found = search.best() if whole else search.best_of(about)
    assert found.mass == 1.0
    value = judge.closed_form(asked)["value"]
    assert math.isclose(np.median(measure(judge, judge.chains(found))), value, rel_tol=0.01)
    assert value < search.bounds[found] < 1.05 * value
    assert math.isclose(found.gap, asked.gap, rel_tol=0.05)


@pytest.mark.usefixtures("few_starts")
@pytest.mark.parametrize(
    ("restitution", "whole"),
    [(0.0, False), (0.2, False), pytest.param(0.0, True, marks=pytest.mark.exhaustive)],
)
def test_the_resonance_law_is_found_in_its_limit(restitution: float, whole: bool) -> None:
    """At a mass ratio of 1e-3, from all dampers or from gaps about the law's in steps of 2 %.

    In a wider band the free mass falls out of step at its ends, and the best gap is smaller.
    """
    given = {"damping_ratio": 5e-4, "force_amplitude": 1000.0, "band": [0.9997 * F, 1.0003 * F]}
    judge = WorstCase(machine_of({**LIGHT, **given, "restitution": restitution}))
    search, gap = Search(judge), judge.closed_form_gap(1.0, restitution)
    about = [Sizes(1.0, gap * (1.0 + 0.02 * k), restitution) for k in (-1, 0, 1)]
    found = search.best() if whole else search.best_of(about)
    assert found.mass == 1.0
    assert math.isclose(found.gap, gap, rel_tol=0.0101)
    value = judge.closed_form(Sizes(1.0, gap, restitution))["value"]
    assert math.isclose(search.bounds[found], value, rel_tol=0.01)


def test_no_start_of_a_lightly_damped_machine_moves_further() -> None:
    """From anywhere in the amplitude without damper the large motion with two impacts is found.

    The amplitude is F/(2 zeta K). From rest and from ten times the least amplitude of the closed
    law all runs stay below 2.2 mm.
    """
    machine = machine_of(FRAME | {"damping_ratio": 1e-3, "restitution": 0.8})
    judge, draw = WorstCase(machine), random.Random(3)
    asked = Sizes(5.0, 0.006, 0.8)
    alone = 200.0 / (100.0 * (math.tau * 31.8) ** 2) / (2.0 * 1e-3)
    starts = [
        {
            "initial_displacement": alone * draw.uniform(-1.0, 1.0),
            "initial_position": draw.choice([-1.0, 1.0]),
            "forcing_frequency": math.tau * draw.uniform(28.0, 36.0),
        }
        for _ in range(300)
    ]
    sizes = {"free_mass": 5.0, "gap": 0.006, "restitution": 0.8}
    brute = measure(judge, [[machine.primary | sizes | start] for start in starts])
    assert brute.max() > 4e-3
    assert Search(judge).worst(asked) > 0.99 * brute.max()


@pytest.mark.usefixtures("few_starts")
def test_no_place_of_the_free_mass_lets_a_motion_ring_longer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of all places in the box and gaps within the tolerance, by a fifth of the search's own."""
    monkeypatch.setattr(study, "_FINE_PLACES", 11)
    monkeypatch.setattr(study, "_FINE_GAPS", 5)
    given = {"damping_ratio": 0.005, "initial_displacement": 0.01, "decay_to": 0.2}
    machine = machine_of(
        {
            "mass": 100.0,
            "natural_frequency": 10.0,
            "largest_mass": 6.0,
            "largest_gap": 0.2,
            "restitution": 0.4,
            "gap_tolerance": 1e-3,
            **given,
        }
    )
    judge, draw = WorstCase(machine), random.Random(3)
    asked = Sizes(6.0, 0.02787, 0.4)
    brute = measure(
        judge,
        [
            [
                judge.fixed
                | {"free_mass": 6.0, "restitution": 0.4, "gap": draw.uniform(0.02687, 0.02887)}
                | {"initial_position": draw.uniform(-1.0, 1.0)}
            ]
            for _ in range(60)
        ],
    )
    assert brute.max() > 0.5
    assert 0.95 * brute.max() < Search(judge).worst(asked) < math.inf


def test_a_damper_whose_fresh_starts_move_further_gives_way_to_a_better_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Fresh starts raise the worst case of the first one above that of the second.

    The values are made up, since the largest of chaotic motions depends on the processor.
    """
    search = Search(WorstCase(machine_of(FRAME)))
    rare, steady = Sizes(5.0, 0.0036, 0.7), Sizes(5.0, 0.003717, 0.7)
    draw = WorstCase.fresh
    fresh: list[list[Case]] = []
    moved = {rare.gap: 1e-3, steady.gap: 1.5e-3}

    def fresh_of(judge: WorstCase, worst: Case, seed: int) -> list[Case]:
        moved[rare.gap] = 2e-3
        fresh.append(draw(judge, worst, seed))
        return fresh[-1]

    def measured(judge: WorstCase, chains: list[Chain]) -> np.ndarray:
        gaps = np.array([point["gap"] for chain in chains for point in chain])
        nearest = [min(moved, key=lambda one: abs(one - gap)) for gap in gaps]
        return np.array([moved[gap] for gap in nearest])

    monkeypatch.setattr(WorstCase, "fresh", fresh_of)
    monkeypatch.setattr("damper.sizing.search.measure", measured)
    assert search.best_of([rare, steady]) == rare
    assert search.checked(rare) == steady
    assert (search.bounds[rare], search.bounds[steady]) == (2e-3, 1.5e-3)
    of_rare, of_steady = fresh
    assert of_rare != of_steady
    assert [one for one in of_steady if one not in search.near[steady]] == []


def test_a_damper_without_fresh_starts_is_never_the_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    """All dampers move further from fresh starts; with two rounds the third one is not tried."""
    search = Search(WorstCase(machine_of(FRAME)))
    dampers = [Sizes(5.0, gap, 0.7) for gap in (0.0036, 0.0037, 0.0038)]
    moved = dict(zip([one.gap for one in dampers], (1.0, 1.1, 1.2), strict=True))
    from_fresh = dict(zip(moved, (3.0, 2.0, 4.0), strict=True))

    def rises(search: Search, damper: Sizes, seed: int) -> bool:
        search.bounds[damper] = from_fresh[damper.gap]
        return True

    def measured(judge: WorstCase, chains: list[Chain]) -> np.ndarray:
        return np.array([moved[point["gap"]] for chain in chains for point in chain])

    monkeypatch.setattr(Search, "_rises", rises)
    monkeypatch.setattr(search_module, "measure", measured)
    monkeypatch.setattr(search_module, "_ROUNDS", 2)
    found = search.best_of(dampers)
    assert found == dampers[0]
    assert search.checked(found) == dampers[1]
    assert search.bounds[dampers[1]] == 2.0


def test_no_random_start_leaves_the_free_mass_where_no_wall_comes() -> None:
    """Slow starts would stay idle for longer than a run; from exact rest they stay so for ever."""
    judge, damper = WorstCase(machine_of(FRAME)), Sizes(5.0, 0.004, 0.7)
    speed = "initial_relative_velocity"
    least = judge.fixed[speed]
    cases = [*judge.cases, *judge.fresh(judge.cases[0], 0)]
    assert min(abs(case.start.get(speed, least)) for case in cases) >= least > 0.0
    check, motions = judge.check(damper)["draws"], judge.motions(damper, 30.0)["draws"]
    assert check["initial_velocity"][0] == motions[speed][0] == least
    assert (check["count"], motions["count"]) == (1000, 60)


@pytest.mark.exhaustive
@pytest.mark.parametrize(
    ("given", "own"),
    [
        ({"orientation": "upright"}, {"gravity": 9.81}),
        (
            {"friction_coefficient": 0.2},
            {"friction_coefficient": 0.2, "transverse_acceleration": 9.81},
        ),
    ],
)
def test_no_start_under_weight_moves_further(given: dict, own: dict) -> None:
    """In an upright and in a rough box, from either wall at any speed of the machine."""
    machine = machine_of(FRAME | {"damping_ratio": 0.02, "largest_mass": 10.0} | given)
    judge, draw, sizes = WorstCase(machine), np.random.default_rng(4), Sizes(10.0, 1e-3, 0.3)
    brute = []
    for _ in range(200):
        x, v = draw.uniform(-1.0, 1.0, 2) * 2e-3 * [1.0, machine.rate]
        start = {"initial_displacement": x, "initial_velocity": v}
        start["initial_position"] = draw.choice([-1.0, 1.0])
        start["forcing_frequency"] = math.tau * draw.uniform(28.0, 36.0)
        brute.append([machine.primary | own | judge.sizes(sizes) | start])
    worst = Search(judge).worst(sizes)
    assert 0.9 * worst < measure(judge, brute).max() < 1.02 * worst
    lying = Search(WorstCase(machine_of(FRAME | {"damping_ratio": 0.02, "largest_mass": 10.0})))
    assert not math.isclose(worst, lying.worst(sizes), rel_tol=0.01)


@pytest.mark.usefixtures("few_starts")
def test_no_damper_of_a_grid_is_better_with_all_of_its_runs() -> None:
    """Each damper of a grid with all of its runs, against one that is found by bounds."""
    search = Search(WorstCase(random_machine(1)))
    r, most = search.judge.machine.restitutions[0], search.judge.machine.largest_mass
    gaps = search.judge.closed_form_gap(most, r) * np.linspace(0.4, 1.6, 4)
    dampers = [Sizes(most, float(gap), r) for gap in gaps]
    every = [Search(search.judge).worst(one) for one in dampers]
    found = search.best_of(dampers)
    assert found == dampers[int(np.argmin(every))]
    assert math.isclose(search.bounds[found], min(every), rel_tol=1e-12)


@pytest.mark.exhaustive
@pytest.mark.parametrize("seed", [1, 2])
def test_no_damper_of_a_whole_grid_is_better(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The best of all dampers, by the cases of every damper and without a check after them."""
    monkeypatch.setattr(search_module, "_ROUNDS", 0)
    search = Search(WorstCase(random_machine(seed)))
    found = search.best()
    most, r = search.judge.machine.largest_mass, found.restitution
    gaps = search.judge.closed_form_gap(found.mass, r) * np.linspace(0.2, 2, 8)
    others = [Sizes(most * part, float(gap), r) for part in (1.0, 0.8) for gap in gaps]
    assert search.bounds[found] <= 1.01 * min(map(Search(search.judge).worst, others))
    assert math.isclose(Search(search.judge).worst(found), search.bounds[found], rel_tol=1e-12)


def random_machine(seed: int):
    draw = random.Random(seed)
    ratio = draw.uniform(0.05, 0.15)
    return machine_of(
        {
            "mass": 1.0,
            "stiffness": 1.0,
            "damping_ratio": draw.uniform(0.03, 0.06),
            "force_amplitude": 1.0,
            "band": [draw.uniform(0.94, 0.98) * F, draw.uniform(1.02, 1.06) * F],
            "largest_mass": ratio,
            "largest_gap": 1e3,
            "restitution": draw.uniform(0.1, 0.6),
            "gap_tolerance": draw.choice([0.0, 0.2]),
        }
    )


@pytest.mark.usefixtures("few_starts")
def test_each_restitution_has_its_best_damper() -> None:
    given = {"mass": 1.0, "stiffness": 1.0, "damping_ratio": 0.05, "force_amplitude": 1.0}
    given |= {"band": [0.97 * F, 1.03 * F], "largest_mass": 0.1, "largest_gap": 1e3}
    judge = WorstCase(machine_of(given | {"materials": {"soft": 0.1, "hard": 0.4, "cork": 0.1}}))
    dampers = [Sizes(0.1, gap, r) for gap in (8.0, 12.0) for r in (0.1, 0.4)]
    worst = {damper: Search(judge).worst(damper) for damper in dampers}
    search, shown = Search(judge), []
    search.show = lambda done, total: shown.append((search.doing, done, total))
    found = search.best_of_each(search.best_of(dampers), "restitution")
    of_each = [[one for one in dampers if one.restitution == r] for r in (0.1, 0.4)]
    about = search.gaps_about(found[0])
    assert about == sorted(of_each[0])
    assert [search.bounds[one] for one in about] == [worst[one] for one in about]
    assert found == [min(some, key=worst.__getitem__) for some in of_each]
    assert shown[0] == ("dampers tried", 0, 4)
    doing, done, total = shown[-1]
    assert (doing, done) == ("cases of the best damper", total)


def test_the_report_does_not_fall_back_when_another_damper_comes_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """One damper is better up to its 20th case, the other has run four cases then."""
    search, shown = Search(WorstCase(machine_of(FRAME))), []
    first, second = Sizes(5.0, 0.0036, 0.7), Sizes(5.0, 0.003717, 0.7)
    runs = {first.gap: 0, second.gap: 0}

    def measured(judge: WorstCase, chains: list[Chain]) -> np.ndarray:
        values = []
        for chain in chains:
            gap = chain[0]["gap"]
            runs[gap] += 1
            value = 1.0 if gap == second.gap else 0.5 if runs[gap] < 20 else 2.0
            values += [value] * len(chain)
        return np.array(values)

    monkeypatch.setattr("damper.sizing.search.measure", measured)
    monkeypatch.setattr("damper.sizing.search._AT_ONCE", 1)
    search.show = lambda done, total: shown.append((search.doing, done, total))
    assert search.best_of([first, second]) == second
    cases = [done for doing, done, _ in shown if doing == "cases of the best damper"]
    assert cases[0] >= 4
    assert cases == sorted(cases)
