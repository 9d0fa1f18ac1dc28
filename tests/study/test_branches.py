"""Branches: who follows whom, against a search by brute force, and draws that anyone can repeat."""

import random
from itertools import product as combinations
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from new_process import in_new_process

from damper.sweep.branches import DIRECTIONS, branches, draw
from damper.sweep.grid import product

DRAWS: dict[str, Any] = {
    "count": 3,
    "seed": 7,
    "initial_velocity": {"range": (-2.0, 1.0)},
    "initial_position": {"range": (-1.0, 1.0)},
}


def neighbour(values: list[float], value: float, direction: str) -> float | None:
    """The value from whose end a run at `value` starts."""
    if direction == "up":
        return max((other for other in values if other < value), default=None)
    return min((other for other in values if other > value), default=None)


NAMES = ("mass_ratio", "clearance", "restitution")
VALUES = st.lists(st.floats(0.01, 0.99), min_size=1, max_size=4, unique=True)


@given(
    axes=st.lists(VALUES, min_size=1, max_size=3),
    place=st.integers(0, 2),
    way=st.sampled_from(list(DIRECTIONS)),
    drawn=st.integers(0, 3),
)
def test_predecessors_by_brute_force(
    axes: list[list[float]], place: int, way: str, drawn: int
) -> None:
    """Same direction, same draw, same other axes, and the neighbouring value, however listed."""
    named = dict(zip(NAMES, axes, strict=False))
    followed = list(named)[place % len(named)]
    draws = {**DRAWS, "count": drawn} if drawn else {}
    plan = branches(product(named, {"phase": 0.0}), named, draws, {followed: way})
    directions = {"up": ["up"], "down": ["down"], "both": ["up", "down"]}[way]
    numbers = list(range(drawn)) or [0]
    runs = list(combinations(*named.values(), directions, numbers))
    assert len(plan.points) == len(plan.predecessor) == len(runs)
    assert plan.dimensions == {"direction": directions} | ({"draw": numbers} if drawn else {})
    for run, (*where, direction, number) in enumerate(runs):
        point = dict(zip(named, where, strict=True))
        assert plan.points[run].items() >= point.items()
        for name, values in plan.labels.items():
            assert plan.points[run][name] == values[number]
        before = neighbour(named[followed], point[followed], direction)
        expected = -1
        if before is not None:
            there = point | {followed: before}
            expected = runs.index((*(there[name] for name in named), direction, number))
        assert plan.predecessor[run] == expected


def test_draws_are_those_of_pythons_generator() -> None:
    """Spelt out: draw by draw, the quantities of one draw in the order of the language."""
    generator = random.Random(7)
    velocities, positions = [], []
    for _ in range(3):
        for values, low, high in ((velocities, -2.0, 1.0), (positions, -1.0, 1.0)):
            part = generator.random()
            values.append(low * (1.0 - part) + high * part)
    found = draw(DRAWS)
    assert found == {"initial_velocity": velocities, "initial_position": positions}
    # Whatever the order in which the file names them.
    assert draw(dict(reversed(DRAWS.items()))) == found


def test_more_draws_begin_with_the_fewer_and_seeds_differ() -> None:
    few, many = draw(DRAWS), draw({**DRAWS, "count": 50})
    assert all(many[name][:3] == values for name, values in few.items())
    other = draw({**DRAWS, "seed": 8})
    assert all(set(other[name]).isdisjoint(values) for name, values in few.items())


def test_draws_are_spread_as_the_rule_says() -> None:
    rules = {
        "clearance": {"range": (1e-4, 1e4), "spacing": "log", "values": (0.0, 1e6), "share": 0.2},
        "contact_tension": {"values": (0.0, 1.0)},
        "initial_position": {"range": (-1.0, 1.0)},
    }
    found = {name: np.array(v) for name, v in draw({"count": 4000, "seed": 0, **rules}).items()}
    uniform, logarithms = found["initial_position"], np.log10(found["clearance"].clip(1e-9, 1e9))
    for value, part in ((0.0, 0.1), (1e6, 0.1)):
        assert np.mean(found["clearance"] == value) == pytest.approx(part, abs=0.02)
    inside = abs(logarithms) <= 4.0
    for spread in (4.0 * uniform, logarithms[inside]):
        counts, _ = np.histogram(spread, 8, (-4.0, 4.0))
        assert counts.sum() == spread.size
        assert np.all(abs(counts / spread.size - 0.125) < 0.02)
    assert np.mean(found["contact_tension"]) == pytest.approx(0.5, abs=0.03)
    assert set(found["contact_tension"]) == {0.0, 1.0}


def test_draws_do_not_depend_on_the_process() -> None:
    code = (
        "import json, random; random.seed(99)\n"
        "from damper.sweep.branches import draw\n"
        f"print(json.dumps(draw({DRAWS!r})))"
    )
    assert in_new_process(code, PYTHONHASHSEED="4242") == draw(DRAWS)
