"""Continuation: every run equals a chain made by hand, and finds what no start from rest does."""

import itertools
from typing import Any

import numpy as np
import pytest
import xarray as xr
from cases import thinned
from studies import MISTAKES

from damper import Parameters, SIParameters, State, simulate
from damper.engine.segment import CAUSE, GAP, GAP_RATE, MODE, SIDE, STICK, STICKING
from damper.engine.trajectory import Trajectory
from damper.models import start_run
from damper.sweep import runs
from damper.sweep.cube import gather
from damper.sweep.parts import PartData, read_part, write_part
from damper.sweep.runs import run_points
from damper.sweep.slices import simulate_slice

#: Two impacts per cycle, not chaotic: what two runs have in common stays in common.
SCENE: dict[str, float] = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.1,
    "frequency_ratio": 1.0,
    "clearance": 4.0,
    "restitution": 0.5,
}
RUN: dict[str, Any] = {"transient": 3, "periods": 4}
LENGTH = 7
SEEN: dict[str, Any] = {"stroboscopic_section": {"when": 0.2, "free_mass": True}, "impacts": {}}
#: Values in no order, of each parameter that can be followed.
AXES = {
    "mass_ratio": [0.15, 0.05, 0.1],
    "damping_ratio": [0.12, 0.08, 0.1],
    "frequency_ratio": [1.05, 0.95, 1.0],
    "clearance": [4.0, 3.0, 5.0],
    "restitution": [0.5, 0.3, 0.7],
    "phase": [1.0, 0.0, 2.0],
}


def ends(point: dict[str, float], start: State | None, length: int) -> tuple[float, ...]:
    """State `length` periods after the start, read off a longer run's section."""
    observers = {"stroboscopic_section": {"free_mass": True}}
    arrays, _ = run_points([point], observers, transient=length, periods=1, state=start)
    names = ("displacement", "velocity", "free_displacement", "free_velocity")
    return tuple(float(arrays[name][0, 0]) for name in names)


def chain(points: list[dict[str, float]], start: State | None) -> list[dict[str, np.ndarray]]:
    """Results of each point, started by hand at the end of the one before."""
    found = []
    for this, following in itertools.zip_longest(points, points[1:]):
        arrays, _ = run_points([this], SEEN, state=start, **RUN)
        found.append({name: array[0] for name, array in arrays.items()})
        if following is None:
            return found
        x, v, y, u = ends(this, start, LENGTH)
        part = 0.0 if start is None else start.time / Parameters(**this).cycle
        y = x + (y - x) / this["clearance"] * following["clearance"]
        start = State(x, v, y, u, part * Parameters(**following).cycle)
    raise AssertionError


def assert_close(cube: xr.Dataset, arrays: dict[str, np.ndarray]) -> None:
    assert set(arrays) == set(cube.data_vars)
    for name, array in arrays.items():
        np.testing.assert_allclose(cube[name].values, array, rtol=1e-9, atol=1e-9, err_msg=name)


class Recorder:
    """Keeps parameters, state and first segment of every start."""

    def __init__(self) -> None:
        self.starts: list[tuple[Parameters, State | None, np.ndarray]] = []

    def __call__(self, parameters: Parameters, state: State | None, *settings: Any) -> Trajectory:
        trajectory = start_run(parameters, state, *settings)
        self.starts.append((parameters, state, trajectory._state.copy()))
        return trajectory


@pytest.fixture
def recorder(monkeypatch: pytest.MonkeyPatch) -> Recorder:
    # One thread keeps the starts in order.
    monkeypatch.setattr(runs, "_threads", lambda *_: 1)
    found = Recorder()
    monkeypatch.setattr(runs, "start_run", found)
    return found


# --- chains made by hand


@pytest.mark.parametrize("start", [None, State(0.4, -0.2, 1.4, 0.3, 1.7)], ids=["rest", "state"])
@pytest.mark.parametrize("name", AXES)
def test_followed_runs_are_a_chain(name: str, start: State | None) -> None:
    cube = simulate(
        **{**SCENE, name: AXES[name]}, **RUN, observers=SEEN, follow={name: "both"}, state=start
    )
    assert cube.displacement.dims == (name, "direction", "sample")
    assert cube.direction.values.tolist() == ["up", "down"]
    assert cube[name].values.tolist() == AXES[name]
    for direction, values in (("up", sorted(AXES[name])), ("down", sorted(AXES[name])[::-1])):
        made = chain([{**SCENE, name: value} for value in values], start)
        for value, arrays in zip(values, made, strict=True):
            assert_close(cube.sel({name: value, "direction": direction}), arrays)
        alone = simulate(
            **{**SCENE, name: AXES[name]},
            **RUN,
            observers=SEEN,
            follow={name: direction},
            state=start,
        )
        assert alone.direction.values.tolist() == [direction]
        xr.testing.assert_equal(alone, cube.sel(direction=[direction]))


# --- which run follows which


@pytest.mark.parametrize("name", ["mass_ratio", "clearance", "restitution"])
@pytest.mark.parametrize("way", ["up", "down", "both"])
def test_followed_axis_among_others(name: str, way: str) -> None:
    """First, middle or last: each line along it is the same as alone, to the bit."""
    axes = {"mass_ratio": [0.2, 0.1], "clearance": [2.0, 0.5, 1.0], "restitution": [0.6, 0.2]}
    run = {**RUN, "observers": SEEN, "follow": {name: way}}
    cube = simulate(**SCENE | axes, **run)
    assert cube.max_approach_speed.dims == (*axes, "direction")
    others = {other: values for other, values in axes.items() if other != name}
    for place in itertools.product(*others.values()):
        where = dict(zip(others, place, strict=True))
        alone = simulate(**SCENE | where | {name: axes[name]}, **run)
        xr.testing.assert_identical(
            cube.sel(where).drop_attrs(deep=False), alone.drop_attrs(deep=False)
        )
    speeds = cube.max_approach_speed.values
    assert len(np.unique(speeds)) == speeds.size


ORDERED = {"clearance": [2.0, 0.5, 1.0], "restitution": [0.6, 0.2], "phase": [0.1, 0.0]}
FOLLOWED: dict[str, Any] = {
    "draws": {"count": 2, "seed": 3, "initial_position": {"range": (-1.0, 1.0)}},
    "follow": {"clearance": "both"},
}


@pytest.fixture(scope="module")
def whole() -> xr.Dataset:
    """Those of `ORDERED`, by `simulate`."""
    return simulate(**SCENE | ORDERED, **RUN, observers=SEEN, **FOLLOWED)


#: Of all orders, those that begin with another axis each.
ORDERS = ["-".join(order) for order in itertools.permutations(ORDERED)]


@pytest.mark.parametrize("order", thinned(ORDERS, ORDERS[::2].__contains__))
@pytest.mark.parametrize("fanned", [0, 1, 2])
def test_gathered_slices_follow_alike(
    order: str, fanned: int, whole: xr.Dataset, tmp_path: Any
) -> None:
    """Axes in any order, other axes fanned out, draws as well, through files."""
    axes = {name: ORDERED[name] for name in order.split("-")}
    fixed = {name: value for name, value in SCENE.items() if name not in axes}
    fan = [name for name in axes if name != "clearance"][:fanned]
    parts: list[PartData] = []
    for place in itertools.product(*(axes[name] for name in fan)):
        part = simulate_slice(
            fixed | dict(zip(fan, place, strict=True)),
            {name: values for name, values in axes.items() if name not in fan},
            observers=SEEN,
            accuracy=1e-12,
            max_events=1_000_000,
            **FOLLOWED,
            **RUN,
        )
        write_part(part, tmp_path / "part.npz")
        parts.append(read_part(tmp_path / "part.npz"))
    cube = gather(parts, axes, fan, fixed, {})
    assert cube.displacement.dims == (*axes, "direction", "draw", "sample")
    assert set(cube.variables) == set(whole.variables)
    for name in whole.variables:
        assert cube[name].dtype == whole[name].dtype
        xr.testing.assert_identical(
            cube[name].variable.transpose(*whole[name].dims), whole[name].variable
        )


def test_each_draw_is_followed_on_its_own() -> None:
    axes = {"clearance": [2.0, 0.5, 1.0], "restitution": [0.6, 0.2]}
    run = {**RUN, "observers": SEEN, "follow": {"clearance": "both"}}
    ranges = {"initial_position": [-1, 1], "initial_velocity": [0, 2]}
    cube = simulate(**SCENE | axes, **run, draws={"count": 3, "seed": 5, **ranges})
    assert cube.displacement.dims == (*axes, "direction", "draw", "sample")
    for number in range(3):
        drawn = {name: float(cube[name][number]) for name in ranges}
        alone = simulate(**SCENE | axes | drawn, **run)
        for name, array in alone.data_vars.items():
            np.testing.assert_array_equal(cube[name].isel(draw=number).values, array.values)


# --- a predecessor that stops


@pytest.mark.parametrize("start", [None, State(0.1, 0.2, 0.1, 0.2)], ids=["rest", "state"])
def test_successor_of_a_stopped_run_starts_afresh(start: State | None) -> None:
    """As the first runs do; and the chain goes on from there."""
    # Elastic in a narrow gap: far more impacts than the limit.
    scene = SCENE | {"restitution": 1.0, "damping_ratio": 0.02}
    points = [scene | {"clearance": d} for d in (2.0, 1.0, 0.0003, 1.5, 1.0)]
    run = RUN | {"max_events": 300, "state": start}
    chained, _ = run_points(points, SEEN, predecessor=range(-1, 4), **run)
    alone, _ = run_points(points, SEEN, **run)
    assert chained["status"].tolist() == [0, 0, 1, 0, 0]
    same = [all(np.array_equal(chained[n][k], alone[n][k]) for n in alone) for k in (0, 1, 3, 4)]
    assert same == [True, False, True, False]


# --- what goes on


def test_sticking_pair_sticks_at_the_next_clearance(recorder: Recorder) -> None:
    """Contact is kept from tiny clearances to large ones, and no burst comes up from nothing."""
    scene = {**SCENE, "restitution": 0.3, "frequency_ratio": 0.3}
    values = np.geomspace(1e-4, 1.0, 3).tolist()
    stuck = 0
    for length, after in itertools.product(range(3, 8), ([-1, 0, 1], [1, 2, -1])):
        for phase in (0.0, 0.5, 1.0, 1.5, 2.0, 2.5):
            recorder.starts = []
            points = [{**scene, "clearance": d, "phase": phase} for d in values]
            run_points(points, [], transient=length, periods=1, predecessor=after)
            for parameters, state, row in recorder.starts[1:]:
                # Ended in contact, to the rounding of positions at a tiny clearance.
                place = (state.y - state.x) / parameters.clearance
                if state.u == state.v and abs(abs(place) - 1.0) < 1e-10:
                    stuck += 1
                    assert row[GAP] == 0.0, (parameters, state)
                    assert (row[GAP_RATE], row[SIDE]) == (0.0, np.sign(place))
                    assert (row[MODE], row[CAUSE]) == (STICKING, STICK)
    assert stuck > 30


def test_motion_in_metres_goes_on_along_the_stiffness() -> None:
    """Each run has its own units; the state in m and m/s is the end of the run before."""
    si = {
        "primary_mass": 2.0,
        "damping": 4.0,
        "force_amplitude": 10.0,
        "forcing_frequency": 10.0,
        "free_mass": 0.2,
        "gap": 0.4,
        "restitution": 0.5,
    }
    values = [200.0, 150.0, 300.0]
    run = {**RUN, "observers": {"stroboscopic_section": {"free_mass": True}}}
    cube = simulate(**si, stiffness=values, **run, follow={"stiffness": "up"})
    names = ("displacement", "velocity", "free_displacement", "free_velocity")
    state = State(0.0, 0.0, 0.0, 0.0)
    for k in sorted(values):
        damper = SIParameters(**si, stiffness=k)
        alone = simulate(**si, stiffness=k, **run, state=state)
        for name in names:
            found = cube[name].sel(stiffness=k, direction="up").values
            np.testing.assert_allclose(found, alone[name], rtol=1e-9, atol=1e-12)
        longer = simulate(**si, stiffness=k, **{**run, "periods": 5}, state=state)
        # Period and gap are the same at every stiffness: nothing to convert in m and s.
        assert damper.cycle == pytest.approx(0.2 * np.pi, rel=1e-15)
        state = State(*(float(longer[name][-1]) for name in names))


# --- misuse


@pytest.mark.parametrize(("change", "follow", "message"), MISTAKES["followed in Python"], ids=str)
def test_misuse_is_refused(change: dict[str, Any], follow: dict[str, str], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        simulate(**{**SCENE, **change}, **RUN, follow=follow)


@pytest.mark.parametrize("after", [[-1, 0, 0], [-1, 2, 1], [0, -1, -1], [-1, 0], [-1, 0, 3]])
def test_runs_that_are_no_chains_are_refused(after: list[int]) -> None:
    """Rather than left out without a word, with status 0."""
    with pytest.raises(ValueError, match="predecessor"):
        run_points([SCENE] * 3, ["impacts"], transient=0, periods=1, predecessor=after)
