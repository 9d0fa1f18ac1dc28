"""Intervals of made-up chatter functions with known edges, and of simulated cubes."""

from bisect import bisect_right
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from scenes import STUDY

from damper import simulate
from damper.analysis.intervals import (
    PREDICATES,
    ChatterAt,
    chatter_in_range,
    chatter_intervals,
    intervals,
)
from damper.sweep.runs import run_points

#: Edges of four thresholds and predicates take thousands of runs.
pytestmark = pytest.mark.compiled


class Steps:
    """A step function of known edges that remembers where it was evaluated."""

    def __init__(self, edges: list[float], levels: list[int]) -> None:
        assert len(levels) == len(edges) + 1
        self.edges, self.levels = edges, levels
        self.seen: list[float] = []

    def level(self, value: float) -> int:
        return self.levels[bisect_right(self.edges, value)]

    def __call__(self, value: float) -> int:
        self.seen.append(value)
        return self.level(value)


def found(
    steps: Steps, grid: list[float], predicate: str = "any", resolution: float = 1e-3
) -> list[tuple[float, float, bool, bool]]:
    least = PREDICATES[predicate]
    inside = [steps.level(value) >= least for value in grid]
    return [one[:4] for one in intervals(grid, inside, lambda v: steps(v) >= least, resolution)]


GRID = [k / 20 for k in range(21)]


# --- one interval


@pytest.mark.parametrize("resolution", [0.03, 1e-6])
def test_no_more_evaluations_than_bisection_needs(resolution: float) -> None:
    steps = Steps([0.4123, 0.8371], [0, 2, 0])
    found(steps, GRID, resolution=resolution)
    halvings = int(np.ceil(np.log2(0.05 / resolution)))
    assert len(steps.seen) == 2 * halvings
    assert len(set(steps.seen)) == len(steps.seen)


# --- any step function


@given(
    edges=st.lists(st.floats(0.001, 0.999), max_size=8, unique=True).map(sorted),
    levels=st.lists(st.integers(-1, 2), min_size=9, max_size=9),
    count=st.integers(2, 40),
    resolution=st.sampled_from([0.1, 1e-2, 1e-3, 1e-7]),
    predicate=st.sampled_from(list(PREDICATES)),
)
def test_random_step_functions(
    edges: list[float], levels: list[int], count: int, resolution: float, predicate: str
) -> None:
    steps = Steps(edges, levels[: len(edges) + 1])
    grid = [float(value) for value in np.linspace(0.0, 1.0, count)]
    got = found(steps, grid, predicate, resolution)
    holds = {"any": (1, 2), "complete": (2,)}[predicate]
    inside = [steps.level(value) in holds for value in grid]

    # Exactly the runs of grid values at which the predicate holds, in order.
    covered = [any(a <= value <= b for a, b, *_ in got) for value in grid]
    assert covered == inside
    assert len(got) == sum(b and not a for a, b in zip([False, *inside], inside, strict=False))
    assert [a for a, *_ in got] == sorted(a for a, *_ in got)

    looked_at = sorted({*grid, *steps.seen})
    for lower, upper, narrow, cut in got:
        assert steps.level(lower) in holds
        assert steps.level(upper) in holds
        at_end = (lower == grid[0], upper == grid[-1])
        assert cut == any(at_end)
        assert (
            narrow == (upper - lower < 2.0 / (count - 1))
            or abs(upper - lower - 2.0 / (count - 1)) < 1e-12
        )
        for edge, end, toward in ((lower, at_end[0], -1), (upper, at_end[1], 1)):
            if end:
                continue
            neighbour = looked_at[looked_at.index(edge) + toward]
            assert steps.level(neighbour) not in holds
            assert abs(neighbour - edge) <= resolution * (1 + 1e-8) or neighbour in grid
            assert abs(neighbour - edge) <= max(resolution, 1e-15) * (1 + 1e-8)
            # A true change of the function lies within the resolution.
            between = sorted((edge, neighbour))
            assert any(between[0] <= true <= between[1] for true in edges)
    assert len(steps.seen) == len(set(steps.seen))


# --- chatter of single runs

POINT = {name: value for name, value in STUDY.items() if name != "restitution"} | {"phase": 0.0}
RUN: dict[str, Any] = {"transient": 40, "periods": 10}


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Restitution of every run."""
    calls: list[float] = []

    def counting(parameters: Any, **keywords: Any) -> Any:
        parameters = list(parameters)
        calls.extend(values["restitution"] for values in parameters)
        return run_points(parameters, **keywords)

    monkeypatch.setattr("damper.sweep.runs.run_points", counting)
    return calls


def test_chatter_at_is_that_of_a_run_for_each_threshold() -> None:
    thresholds = [0.03, 0.01, 0.2, 0.03]
    chatter_at = ChatterAt("restitution", POINT, thresholds, RUN)
    seen = set()
    for r in (0.2, 0.42, 0.5, 0.7, 0.95):
        got = chatter_at(r)
        assert len(got) == 4
        for k, threshold in enumerate(thresholds):
            arrays, _ = run_points(
                [{**POINT, "restitution": r}], {"bursts": {"threshold": threshold}}, **RUN
            )
            assert got[k] == arrays["chatter"][0]
            seen.add(int(got[k]))
    assert seen == {0, 1, 2}


def test_each_value_is_simulated_once(counted: list[float]) -> None:
    """However many thresholds and predicates ask for it."""
    chatter_at = ChatterAt("restitution", POINT, (0.03, 0.01, 0.1), RUN)
    grid = [k / 10 for k in range(11)]
    levels = [chatter_at(value) for value in grid]
    assert counted == grid
    for k in range(3):
        for least in PREDICATES.values():
            inside = [level[k] >= least for level in levels]
            list(intervals(grid, inside, lambda v, k=k, m=least: chatter_at(v)[k] >= m, 1e-2))
    assert len(counted) > len(grid) + 5
    assert len(counted) == len(set(counted))


# --- cubes

GRID_R = [round(0.3 + 0.02 * k, 2) for k in range(31)]
MASSES = [0.25, 0.001]
THRESHOLDS = [0.01, 0.03, 0.1]
LONG: dict[str, Any] = {"transient": 60, "periods": 10}
HOLDS = {"complete": (2,), "any": (1, 2)}
FIXED = {name: value for name, value in POINT.items() if name != "mass_ratio"}


def make_cube(observer: dict[str, Any], **axes: Any) -> xr.Dataset:
    given = {**FIXED, "mass_ratio": MASSES, "restitution": GRID_R, **axes}
    return simulate(**given, observers={"bursts": observer}, **LONG)


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    return make_cube({"threshold": 0.03, "compare_thresholds": THRESHOLDS})


@pytest.fixture(scope="module")
def table(cube: xr.Dataset) -> pd.DataFrame:
    return chatter_intervals(cube, "restitution")


def chatter(point: dict[str, float], threshold: Any = 0.03) -> int:
    """Chatter of one run from rest."""
    arrays, _ = run_points([{**FIXED, **point}], {"bursts": {"threshold": threshold}}, **LONG)
    return int(arrays["chatter"][0])


def test_all_places_thresholds_and_predicates_in_order(table: pd.DataFrame) -> None:
    names = ["3 %", "1 %", "10 %"]  # the main one first, and once
    order = [(m, t, c) for m in MASSES for t in names for c in HOLDS]
    groups = table.groupby(["mass_ratio", "threshold", "chatter"], sort=False)
    assert [name for name, _ in groups] == order
    assert groups["restitution_lower"].apply(lambda lower: lower.is_monotonic_increasing).all()


def test_edges_are_where_runs_from_rest_change(table: pd.DataFrame) -> None:
    """The edge has chatter; a value within the resolution outside of it has none."""
    checked = 0
    for item in table.to_dict("records"):
        threshold = float(item["threshold"].removesuffix(" %")) / 100
        levels = HOLDS[item["chatter"]]
        mass = {"mass_ratio": item["mass_ratio"]}
        for edge, end, outwards in (
            (item["restitution_lower"], GRID_R[0], -1),
            (item["restitution_upper"], GRID_R[-1], 1),
        ):
            assert chatter({**mass, "restitution": edge}, threshold) in levels
            if edge == end:
                assert item["cut"]
                continue
            # The last halving of a grid step of .02 that is still within the resolution.
            outside = edge + outwards * 0.02 / 32
            assert chatter({**mass, "restitution": outside}, threshold) not in levels
            checked += 1
    assert checked > 10


def test_of_several_masses_each_has_its_own_intervals() -> None:
    """Beside a mass that no wall reaches, those of the other alone."""
    common = {**FIXED, "mass_ratio": 0.25, "restitution": GRID_R[::3]}
    alone = simulate(**common, observers={"bursts": {"threshold": 0.03}}, **LONG)
    masses = [{}, {"clearance": 1e3}]
    bursts = {"threshold": 0.03, "bodies": [0, 1]}
    both = simulate(**common, masses=masses, observers={"bursts": bursts}, **LONG)
    wanted, found = (chatter_intervals(c, "restitution", 1e-2) for c in (alone, both))
    assert set(found["body"]) == {0}
    edges = ["restitution_lower", "restitution_upper"]
    assert np.allclose(found[edges], wanted[edges], atol=1e-2)


def test_edges_that_are_chance_do_not_survive() -> None:
    """Where a shift of the clearance, far below anything that is asked for, changes a run beside
    an edge, the edge is marked; where none of twenty does, it is not."""
    point = POINT | {"mass_ratio": 0.001, "frequency_ratio": 2.0}
    run: dict[str, Any] = {"transient": 150, "periods": 40}
    grid = [round(0.4 + 0.02 * k, 2) for k in range(31)]
    cube = simulate(**point | {"restitution": grid}, observers=["bursts"], **run)
    clearances = 0.05 * (1.0 + np.random.default_rng(1).uniform(-1e-13, 1e-13, 20))

    def part(value: float, levels: tuple[int, ...]) -> float:
        points = [point | {"restitution": value, "clearance": shifted} for shifted in clearances]
        arrays, _ = run_points(points, ["bursts"], **run)
        return float(np.isin(arrays["chatter"], levels).mean())

    seen = set()
    for item in chatter_intervals(cube, "restitution").to_dict("records"):
        for end, outwards in (("lower", -1), ("upper", 1)):
            edge = item[f"restitution_{end}"]
            if edge == grid[-1]:
                assert item[f"{end}_survives"]
                continue
            parts = [
                part(value, HOLDS[item["chatter"]]) for value in (edge, edge + outwards * 0.02 / 32)
            ]
            assert item[f"{end}_survives"] == (parts == [1.0, 0.0]), (item, end, parts)
            seen.add(item[f"{end}_survives"])
    assert seen == {True, False}


def test_cubes_whose_points_cannot_be_run_are_refused(cube: xr.Dataset) -> None:
    with pytest.raises(ValueError, match="has no variable 'chatter'"):
        chatter_intervals(cube.drop_vars("chatter"), "restitution")
    with pytest.raises(ValueError, match="does not say how its points were run"):
        chatter_intervals(cube.drop_attrs(), "restitution")
    with pytest.raises(ValueError, match="a dimension 'direction'"):
        chatter_intervals(cube.expand_dims(direction=["up", "down"]), "restitution")
    given = FIXED | {"mass_ratio": [0.1, 0.2], "frequency_ratio": 1.3, "restitution": [0.4, 0.6]}
    followed = simulate(**given, periods=1, follow={"mass_ratio": "up"})
    with pytest.raises(ValueError, match="a dimension 'direction'"):
        chatter_intervals(followed.isel(mass_ratio=1, direction=0), "restitution")
    draws = {"count": 2, "seed": 1, "initial_position": [-1, 1]}
    drawn = simulate(**given, periods=1, draws=draws).isel(mass_ratio=0)
    with pytest.raises(ValueError, match="the cube has lost 'initial_position'"):
        chatter_intervals(drawn.isel(draw=0, drop=True), "restitution")


def test_chatter_in_a_range_leaves_out_what_is_unknown() -> None:
    chatter = xr.DataArray([[0, 2], [np.nan, 1], [np.nan, 0], [0, 0]], dims=("clearance", "draw"))
    cube = xr.Dataset({"chatter": chatter}, {"clearance": [1.0, 2.0, 3.0, 4.0]})
    counts = chatter_in_range(cube, "clearance", 1.0, 3.0)
    assert counts == {
        "lowest": 1.0, "highest": 2.0, "in_range": 2, "chatter_in_range": 2,
        "outside": 1, "chatter_outside": 0, "unknown": 1,
    }  # fmt: skip
