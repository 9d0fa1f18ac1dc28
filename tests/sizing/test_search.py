"""The optimiser against the closed laws in their limits and against whole grids."""

import math
import random

import numpy as np
import pytest

from damper.sizing.machine import machine_of
from damper.sizing.search import Search
from damper.sizing.study import Judge, Sizes

#: The natural frequency of a machine of rate 1, in Hz.
F = 0.5 / math.pi
LIGHT = {"mass": 1000.0, "stiffness": 1000.0, "largest_mass": 1.0, "largest_gap": 1e9}


ALL_DAMPERS = [False, pytest.param(True, marks=pytest.mark.exhaustive)]


@pytest.mark.parametrize("whole", ALL_DAMPERS)
def test_the_decay_law_is_found_in_its_limit(whole: bool) -> None:
    """At a mass ratio of 1e-3: the time to 1 %, by a gap within 5 % of the law's fold.

    From all dampers, or from gaps about the law's in steps of 4 %.
    """
    given = {"damping_ratio": 1e-3, "initial_displacement": 1.0, "decay_to": 0.5}
    judge = Judge(machine_of({**LIGHT, **given, "restitution": 0.2}))
    search, asked = Search(judge), Sizes(1.0, judge.law_gap(1.0, 0.2), 0.2)
    about = [Sizes(1.0, asked.gap * (1.0 + 0.04 * k), 0.2) for k in range(-2, 3)]
    found = search.best() if whole else search.best_of(about)
    assert found.mass == 1.0
    assert math.isclose(search.bounds[found], judge.law(asked)["value"], rel_tol=0.01)
    assert math.isclose(found.gap, asked.gap, rel_tol=0.05)


@pytest.mark.parametrize(
    ("restitution", "whole"),
    [(0.0, False), (0.2, False), pytest.param(0.0, True, marks=pytest.mark.exhaustive)],
)
def test_the_resonance_law_is_found_in_its_limit(restitution: float, whole: bool) -> None:
    """At a mass ratio of 1e-3, from all dampers or from gaps about the law's in steps of 1 %.

    In a wider band the free mass falls out of step at its ends, and the best gap is smaller.
    """
    given = {"damping_ratio": 5e-4, "force_amplitude": 1000.0, "band": [0.9997 * F, 1.0003 * F]}
    judge = Judge(machine_of({**LIGHT, **given, "restitution": restitution}))
    search, gap = Search(judge), judge.law_gap(1.0, restitution)
    about = [Sizes(1.0, gap * (1.0 + 0.01 * k), restitution) for k in range(-3, 4)]
    found = search.best() if whole else search.best_of(about)
    assert found.mass == 1.0
    assert math.isclose(found.gap, gap, rel_tol=0.0101)
    law = judge.law(Sizes(1.0, gap, restitution))["value"]
    assert math.isclose(search.bounds[found], law, rel_tol=0.01)


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.exhaustive)])
def test_no_damper_of_a_whole_grid_is_better(seed: int) -> None:
    """Each damper of a grid with all of its runs, against one that is found by bounds."""
    search = Search(Judge(random_machine(seed)))
    found = search.best()
    most, r = search.judge.machine.largest_mass, found.restitution
    gaps = search.judge.law_gap(found.mass, r) * np.linspace(0.2, 2, 8)
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


def test_each_restitution_has_its_best_damper() -> None:
    given = {"mass": 1.0, "stiffness": 1.0, "damping_ratio": 0.05, "force_amplitude": 1.0}
    given |= {"band": [0.97 * F, 1.03 * F], "largest_mass": 0.1, "largest_gap": 1e3}
    judge = Judge(machine_of(given | {"materials": {"soft": 0.1, "hard": 0.4, "cork": 0.1}}))
    dampers = [Sizes(0.1, gap, r) for gap in (8.0, 12.0) for r in (0.1, 0.4)]
    worst = {damper: Search(judge).worst(damper) for damper in dampers}
    search, shown = Search(judge), []
    search.show = lambda done, total: shown.append((search.doing, done, total))
    found = search.best_of_each(search.best_of(dampers))
    of_each = [[one for one in dampers if one.restitution == r] for r in (0.1, 0.4)]
    assert found == [min(some, key=worst.__getitem__) for some in of_each]
    assert shown[0] == ("dampers tried", 0, 4)
    doing, done, total = shown[-1]
    assert (doing, done) == ("cases of the best damper", total)
