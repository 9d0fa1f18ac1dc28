"""Observers of each of several free masses, against one mass and against the list of events."""

from typing import Any

import numpy as np
import pytest
from scenes import QUIET, SLOW

import damper
from damper import Parameters, State
from damper.observers import observer_class

OBSERVERS: dict[str, dict[str, Any]] = {
    "bursts": {"records": 20, "threshold": 1e-3},
    "chatter_bursts": {"threshold": 1e-3},
    "burst_at": {"time": 30.0, "threshold": 1e-3},
    "impact_section": {"free_mass": True},
    "motion": {"tolerance": 1e-4},
    "trajectory": {"length": 2.0, "samples_per_period": 40},
}
RUN = {"transient": 1, "periods": 5}


def test_masses_in_step_are_seen_as_one() -> None:
    """Two halves that move as one: each has what the whole has, to rounding."""
    halves = [{"mass_ratio": 0.5 * QUIET["mass_ratio"]}] * 2
    bodies = {name: {**settings, "bodies": [0, 1]} for name, settings in OBSERVERS.items()}
    one = damper.simulate(**QUIET, **RUN, observers=OBSERVERS)
    both = damper.simulate(**QUIET, **RUN, observers=bodies, masses=halves)
    assert float(one.chatter_complete[0]) >= 4
    for name in one.data_vars:
        if name == "status" or name.startswith("trajectory"):
            continue
        for body in (0, 1):
            found = both[name].sel(body=body) if "body" in both[name].dims else both[name]
            assert found.values == pytest.approx(one[name].values, rel=1e-8, abs=1e-9, nan_ok=True)
    # Rows of both, at the same times: those of the one are every second.
    assert int((both.trajectory_event == 0).sum()) == 2 * int((one.trajectory_event == 0).sum())
    for body in (0, 1):
        rows = (both.trajectory_body == body) | both.trajectory_event.isnull()
        here = both.isel(instant=rows.values & np.isfinite(both.trajectory_time.values))
        there = one.isel(instant=np.isfinite(one.trajectory_time.values))
        for name in ("time", "displacement", "free_displacement", "free_velocity", "mode"):
            own = here[f"trajectory_{name}"]
            own = own.sel(body=body) if "body" in own.dims else own
            wanted = there[f"trajectory_{name}"].values
            after = np.append(np.diff(there.trajectory_time.values) > 0.0, True)
            assert own.values[after] == pytest.approx(wanted[after], abs=1e-7), name


UNLIKE = SLOW | {"frequency_ratio": 0.9}
MASSES = [{"mass_ratio": 0.05, "clearance": 0.3}, {"gravity": 0.2, "restitution": 0.8}, {}]
START = State(0.0, 0.3, [0.1, -0.1, 0.2], [0.2, -0.4, 0.0])


def observed(observers: dict[str, Any]) -> Any:
    return damper.simulate(
        **UNLIKE, masses=MASSES, state=START, transient=0, periods=4, observers=observers
    )


def test_unlike_masses_against_the_list_of_events() -> None:
    """Each has its own impacts, bursts and sticking, whatever happens to the others meanwhile."""
    p = Parameters(**UNLIKE, masses=MASSES)
    end = 4 * p.cycle
    table = damper.events(p, START, until=end)
    # In the order of the list, which is that of the coordinate.
    bodies = [2, 0, 1]
    cube = observed(
        {
            "impacts": {"bodies": bodies, "speeds": 8, "threshold": {"speed": 1e-300}},
            "bursts": {"bodies": bodies, "records": 200},
            "impact_section": {"bodies": bodies, "wall": "left", "free_mass": True, "samples": 3},
        }
    )
    assert cube.body.values.tolist() == bodies
    for body in range(3):
        own, here = table[table["body"] == body], cube.sel(body=body)
        impacts = own[own["kind"] == 0]
        assert len(impacts) >= 8
        assert np.array_equal(here.approach_speed, impacts["approach_speed"][:8])
        assert float(here.max_approach_speed) == impacts["approach_speed"].max()
        left = impacts[impacts["side"] == -1][:3]
        assert np.array_equal(here.displacement[: len(left)], left["x"])
        each = p.each[body]
        assert here.free_displacement.values[: len(left)] == pytest.approx(
            left["x"] - each.clearance, abs=1e-14
        )
        onsets = here.burst_onset.values[np.isfinite(here.burst_onset.values)]
        assert set(onsets.tolist()) <= set(impacts["time"].tolist())
        complete = own[own["kind"] == 1]["time"]
        ends = here.burst_accumulation_time.values
        assert set(ends[np.isfinite(ends)].tolist()) <= set(complete.tolist())
        stuck = 0.0
        for k, row in enumerate(own):
            if row["kind"] == 1:
                stuck += (own["time"][k + 1] if k + 1 < len(own) else end) - row["time"]
        assert float(here.sticking_fraction) == pytest.approx(stuck / end, abs=1e-12)


def test_rows_of_a_trajectory_keep_momentum_and_stay_in_the_boxes() -> None:
    cube = observed({"trajectory": {"bodies": [0, 1, 2]}})
    p = Parameters(**UNLIKE, masses=MASSES)
    rows = cube.isel(instant=np.isfinite(cube.trajectory_time.values))
    x, v = rows.trajectory_displacement.values, rows.trajectory_velocity.values
    y, u = rows.trajectory_free_displacement.values, rows.trajectory_free_velocity.values
    for k, each in enumerate(p.each):
        assert np.all(abs(y[k] - x) <= each.clearance + 1e-13)
    before = np.flatnonzero(rows.trajectory_event.values == 0)[::2]
    hit = rows.trajectory_body.values[before].astype(int)
    assert len(before) > 30
    assert set(hit) == {0, 1, 2}
    momentum = v + np.array([each.mass_ratio for each in p.each]) @ u
    alone = np.diff(rows.trajectory_time.values[before], append=np.inf) > 0.0
    alone &= np.diff(rows.trajectory_time.values[before], prepend=-np.inf) > 0.0
    here = before[alone]
    assert momentum[here + 1] == pytest.approx(momentum[here], abs=1e-13)
    for row, body in zip(here, hit[alone], strict=True):
        own = p.each[body]
        relative = u[body] - v
        assert relative[row + 1] == pytest.approx(-own.restitution * relative[row], abs=1e-13)
        others = [k for k in range(3) if k != body]
        assert u[others, row + 1] == pytest.approx(u[others, row], abs=1e-13) or np.any(
            rows.trajectory_mode.values[others, row + 1] == 1
        )


def test_the_primary_alone_is_beside_several_masses() -> None:
    """It is that beside one mass, whatever the masses do."""
    setting = {"length": 2.0, "samples_per_period": 40, "without_damper": True}
    one = damper.simulate(**QUIET, **RUN, observers={"trajectory": setting})
    both = damper.simulate(
        **QUIET, **RUN, observers={"trajectory": setting | {"bodies": [0, 1]}}, masses=[{}, {}]
    )
    alone = [cube.trajectory_alone.dropna("instant").values for cube in (one, both)]
    assert len(alone[0]) == 81
    assert np.array_equal(*alone)


def test_segments_of_all_masses_are_the_motion() -> None:
    """Each has its own events; a run from the rows of one instant goes on as the whole one."""
    cube = observed({"segments": {"bodies": [0, 1, 2], "periods": 4, "rows": 9999}})
    rows = cube.isel(segment=np.isfinite(cube.segment_time.values[0]))
    p = Parameters(**UNLIKE, masses=MASSES)
    table, time = damper.events(p, START, until=4 * p.cycle), rows.segment_time.values[0]
    for body in range(3):
        here, own = rows.sel(body=body), table[table["body"] == body]
        told = here.segment_cause.values >= 0
        assert here.segment_cause.values[told].tolist() == own["kind"].tolist()
        assert time[told] == pytest.approx(own["time"], abs=1e-14)
        assert np.array_equal(here.segment_displacement.values[told], own["x"])
    lasts = np.append(np.diff(time) > 0.01, False)
    flies = (rows.segment_mode.values == 0).all(0) & (rows.segment_gap.values > 0.01).all(0)
    [k, *_] = np.flatnonzero(lasts & flies)
    at = rows.isel(segment=k)
    side, x, v = at.segment_side.values, at.segment_displacement.values, at.segment_velocity.values
    y = x + side * ([own.clearance for own in p.each] - at.segment_gap.values)
    state = State(x[0], v[0], y, v - side * at.segment_gap_rate.values, time[k] % p.cycle)
    found = damper.events(p, state, until=time[k] % p.cycle + 0.5)
    later = table[table["time"] > time[k]][: len(found)]
    assert len(found) > 0
    assert found[["kind", "body", "side"]].tolist() == later[["kind", "body", "side"]].tolist()
    assert found["time"] - state.time == pytest.approx(later["time"] - time[k], abs=1e-9)


@pytest.mark.parametrize("name", ["bursts", "trajectory", "impact_section", "motion", "segments"])
def test_a_mass_has_to_be_chosen(name: str) -> None:
    with pytest.raises(
        ValueError, match=rf"^{name} observes free masses by their numbers: give bodies"
    ):
        observed({name: {}})
    with pytest.raises(ValueError, match=rf"^{name}\.bodies = \[3\]: there is no mass 3: this dam"):
        observed({name: {"bodies": [3]}})
    assert "bodies" in observer_class(name).settings


def test_bodies_are_the_same_for_all_observers() -> None:
    with pytest.raises(ValueError, match=r"^observers 'bursts' and 'impacts' observe other masses"):
        observed({"bursts": {"bodies": [0]}, "impacts": {"bodies": [1]}})


def test_a_run_shows_all_masses() -> None:
    run = damper.run(**UNLIKE, masses=MASSES, until=20.0)
    assert run.motion.free_displacement.dims == ("body", "time")
    assert set(run.bursts["body"]) <= {0, 1, 2}
    titles = [ax.get_title(loc="left") for ax in run.plot().axes]
    assert [title for title in titles if title] == ["mass 0", "mass 1", "mass 2"]
    texts = [text.get_text() for text in run.plot().legends[0].texts]
    assert texts[:4] == ["primary $x$", "mass 0 $y_{0}$", "mass 1 $y_{1}$", "mass 2 $y_{2}$"]
    with pytest.raises(ValueError, match="body = 3: must be one of 0, 1, 2"):
        run.portrait(0, 3)
    walls = [ax.get_xlim() for ax in run.portrait(0, 2).axes[2:4]]
    assert walls[0] == walls[1]
