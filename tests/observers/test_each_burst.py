"""The observers that read bursts one by one, against plain loops over the event rows."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_bursts import Burst, Scene, all_bursts

from damper import Parameters
from damper.engine.segment import COLUMNS
from damper.models import start_run
from damper.observers import make_observers
from damper.observers.common.base import Window
from damper.sweep.runs import run_points
from damper.sweep.slices import simulate_slice

#: Model section 8, A3: complete bursts in every half period after a transient.
PAPER_A = {
    "mass_ratio": 0.2,
    "damping_ratio": 0.01,
    "frequency_ratio": 0.2,
    "clearance": 0.03,
    "restitution": 0.8,
}
#: Model section 7.
SLOW = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.2,
    "clearance": 0.25,
    "restitution": 0.6,
}
FREQUENCIES = [0.2, 0.25, 0.3]


def observed(scene: Scene, name: str, **given: object) -> dict[str, np.ndarray]:
    """Results of one observer for one run."""
    arrays, _ = run_points([scene.parameters], {name: given}, **scene.run())
    return {key: array[0] for key, array in arrays.items()}


def ended_in(scene: Scene) -> list[Burst]:
    """Bursts that begin and end in the record."""
    return [b for b in all_bursts(scene.rows()) if b.onset >= scene.start and b.ended]


def is_chatter(burst: Burst, scene: Scene, fraction: float = 0.03) -> bool:
    return burst.visible(scene.restitution, fraction) >= 5


def duration(burst: Burst) -> float:
    return (burst.stick if burst.complete else burst.times[-1]) - burst.onset


# --- burst_at


def assert_nearest(scene: Scene, time: float, fraction: float = 0.03) -> None:
    found = observed(scene, "burst_at", time=time, threshold=fraction)
    chatter = [b for b in ended_in(scene) if is_chatter(b, scene, fraction)]
    if not chatter:
        assert found["burst_at_complete"] == found["burst_at_visible_impacts"] == -1
        assert np.isnan([found[f"burst_at_{n}"] for n in ("onset", "duration")]).all()
        return
    burst = min(chatter, key=lambda b: abs(b.onset - scene.start - time))
    assert found["burst_at_onset"] == pytest.approx(burst.onset - scene.start, abs=1e-9)
    assert found["burst_at_duration"] == pytest.approx(duration(burst), abs=1e-9)
    assert found["burst_at_complete"] == burst.complete
    assert found["burst_at_visible_impacts"] == burst.visible(scene.restitution, fraction)
    sticking = burst.release - burst.stick  # NaN where it does not stick, or not long enough
    assert found["burst_at_sticking_time"] == pytest.approx(sticking, abs=1e-9, nan_ok=True)


@pytest.mark.parametrize("transient", [0, 4])
@pytest.mark.parametrize("restitution", [0.45, 0.6, 0.8, 0.9])
@pytest.mark.parametrize("time", [0.0, 100.0, 155.0, 1e4])
@pytest.mark.parametrize("scene", [PAPER_A, SLOW], ids=["paper_a", "slow"])
def test_nearest_burst_of_the_event_rows(
    scene: dict[str, float], time: float, restitution: float, transient: int
) -> None:
    assert_nearest(Scene({**scene, "restitution": restitution}, transient, 8), time)


@settings(max_examples=60)
@given(
    mass_ratio=st.sampled_from([0.001, 0.1, 0.5, 2.0]),
    damping_ratio=st.sampled_from([0.0, 0.02, 0.3]),
    frequency_ratio=st.sampled_from([0.05, 0.2, 0.7, 1.3]),
    clearance=st.sampled_from([0.0, 0.02, 0.1, 0.4]),
    restitution=st.floats(0, 1),
    phase=st.sampled_from([0.0, 1.0, math.pi / 2]),
    transient=st.integers(0, 6),
    periods=st.integers(1, 8),
    time=st.floats(0, 300),
    fraction=st.floats(0.001, 0.5),
)
def test_nearest_burst_of_random_scenes(
    transient: int, periods: int, time: float, fraction: float, **parameters: float
) -> None:
    assert_nearest(Scene(parameters, transient, periods), time, fraction)


def test_the_burst_of_paper_a() -> None:
    """Model section 8, A3: found by simulators of its own."""
    found = observed(Scene(PAPER_A, 0, 14), "burst_at", time=332)
    assert found["burst_at_onset"] == pytest.approx(332.967, abs=1e-3)
    assert found["burst_at_duration"] == pytest.approx(10.844, abs=1e-3)
    assert found["burst_at_duration"] + found["burst_at_sticking_time"] == pytest.approx(
        12.345, abs=1e-3
    )
    assert found["burst_at_complete"] == 1


def test_no_chatter_is_missing() -> None:
    found = observed(Scene({**PAPER_A, "restitution": 0.0}, 2, 5), "burst_at", time=10)
    assert found["burst_at_complete"] == -1
    assert np.isnan(found["burst_at_onset"])


@pytest.mark.parametrize("name", ["burst_at", "chatter_bursts"])
def test_a_stopped_run_is_missing(name: str) -> None:
    arrays, _ = run_points([PAPER_A], [name], transient=0, periods=30, max_events=500)
    assert arrays.pop("status")[0] == 1
    for key, array in arrays.items():
        missing = np.isnan(array) if array.dtype.kind == "f" else array == -1
        assert missing.all(), key


def test_lanes_do_not_mix() -> None:
    """A lane that stops inside a burst leaves nothing to the next one."""
    points = [PAPER_A, {**PAPER_A, "restitution": 0.0}, {**SLOW, "clearance": 50.0}, PAPER_A]
    for name in ("burst_at", "chatter_bursts"):
        arrays, _ = run_points(points, [name], transient=0, periods=6)
        for k, point in enumerate(points):
            alone, _ = run_points([point], [name], transient=0, periods=6)
            for key, array in arrays.items():
                np.testing.assert_array_equal(array[k], alone[key][0], key)


def test_time_is_in_seconds_for_points_in_si() -> None:
    """A stiffness of 4 and a mass of 1 make the unit of time half a second."""
    mass, stiffness = 1.0, 4.0
    si = {
        "primary_mass": mass,
        "stiffness": stiffness,
        "damping": 2.0 * PAPER_A["damping_ratio"] * math.sqrt(mass * stiffness),
        "force_amplitude": 8.0,
        "forcing_frequency": PAPER_A["frequency_ratio"] * 2.0,
        "free_mass": PAPER_A["mass_ratio"] * mass,
        "gap": 2.0 * PAPER_A["clearance"] * 2.0,
        "restitution": PAPER_A["restitution"],
    }
    run = {"transient": 20, "periods": 8, "accuracy": 1e-12, "max_events": 10**6}
    in_si = simulate_slice(si, {}, observers={"burst_at": {"time": 60.0}}, **run)
    ratios = simulate_slice(PAPER_A, {}, observers={"burst_at": {"time": 120.0}}, **run)
    for name in ("onset", "duration", "sticking_time"):
        key = f"burst_at_{name}"
        assert in_si.arrays[key][0] == pytest.approx(0.5 * ratios.arrays[key][0], rel=1e-6)
    early = simulate_slice(PAPER_A, {}, observers={"burst_at": {"time": 60.0}}, **run)
    assert early.arrays["burst_at_onset"][0] < 90.0 < ratios.arrays["burst_at_onset"][0]


# --- chatter_bursts


@pytest.mark.parametrize("transient", [0, 7])
@pytest.mark.parametrize("omega", FREQUENCIES)
@pytest.mark.parametrize("restitution", [0.3, 0.6, 0.8, 0.9])
def test_counts_of_a_loop_over_the_events(restitution: float, omega: float, transient: int) -> None:
    parameters = {**PAPER_A, "restitution": restitution, "frequency_ratio": omega}
    run, parts = Scene(parameters, transient, 12), [0.0, 3.5, 8.0]
    found = observed(run, "chatter_bursts", since=parts)
    for k, part in enumerate(parts):
        bursts = [b for b in ended_in(run) if b.onset >= run.start + part * run.period]
        chatter = [b for b in bursts if is_chatter(b, run)]
        complete = [b for b in chatter if b.complete]
        assert found["chatter_bursts"][k] == len(chatter)
        assert found["chatter_complete"][k] == len(complete)
        assert found["sticking_bursts"][k] == sum(b.complete for b in bursts)
        if complete:
            mean = np.mean([duration(b) for b in complete])
            assert found["chatter_duration"][k] == pytest.approx(mean, abs=1e-9)
            first = complete[0].onset - run.start
            assert found["chatter_onset"][k] == pytest.approx(first, abs=1e-9)
        else:
            assert np.isnan(found["chatter_duration"][k])
            assert np.isnan(found["chatter_onset"][k])


def test_a_part_is_what_a_longer_transient_leaves() -> None:
    whole = observed(Scene(PAPER_A, 0, 40), "chatter_bursts", since=[0, 15])
    late = observed(Scene(PAPER_A, 15, 25), "chatter_bursts")
    shift = 15 * Scene(PAPER_A, 0, 1).period
    for name in ("chatter_bursts", "chatter_complete", "sticking_bursts"):
        assert whole[name][1] == late[name][0] > 0, name
    assert whole["chatter_duration"][1] == pytest.approx(late["chatter_duration"][0], abs=1e-11)
    assert whole["chatter_onset"][1] == pytest.approx(late["chatter_onset"][0] + shift, abs=1e-9)


def test_incomplete_only_after_the_transient_at_the_highest_frequency() -> None:
    """Model section 8, A5: two complete bursts at 107.2 and 118.3, none after that."""
    run = Scene({**PAPER_A, "frequency_ratio": 0.3}, 0, 30)
    found = observed(run, "chatter_bursts", since=[0, 15])
    assert found["chatter_complete"].tolist() == [2, 0]
    assert found["chatter_onset"][0] == pytest.approx(107.2, abs=0.1)
    assert found["chatter_bursts"][1] > 20


def test_many_pieces_of_the_log_lose_no_burst() -> None:
    """Some 5000 rows, five pieces: as many bursts as `bursts` counts and lists."""
    run = {"transient": 0, "periods": 60}
    many = {"chatter_bursts": {"since": [0]}, "bursts": {"records": 1000}}
    arrays, _ = run_points([PAPER_A], many, **run)
    visible = arrays["burst_visible_impacts"][0]
    complete = arrays["burst_complete"][0]
    assert (visible >= 5).sum() == arrays["chatter_bursts"][0, 0] > 100
    assert (complete == 1).sum() == arrays["sticking_bursts"][0, 0]
    chatter = (visible >= 5) & (complete == 1)
    mean = arrays["burst_duration"][0][chatter].mean()
    assert arrays["chatter_duration"][0, 0] == pytest.approx(mean, rel=1e-12)
    for time in (0.0, 300.0, 900.0, 1500.0):
        near, _ = run_points([PAPER_A], {"burst_at": {"time": time}}, **run)
        onsets = arrays["burst_onset"][0]
        k = np.nanargmin(np.where(visible >= 5, abs(onsets - time), np.nan))
        assert near["burst_at_onset"][0] == onsets[k]
        sticking = arrays["burst_sticking_time"][0][k]
        np.testing.assert_equal(near["burst_at_sticking_time"][0], sticking)


@pytest.mark.parametrize("rows", [1, 2, 7])
@pytest.mark.parametrize(
    ("name", "settings"),
    [("burst_at", {"time": 200.0}), ("burst_at", {}), ("chatter_bursts", {"since": [0, 5]})],
)
def test_short_pieces_of_the_log_change_nothing(
    name: str, settings: dict[str, object], rows: int
) -> None:
    """Pieces end within sticking, too, which a burst's record waits for."""
    periods = 12
    (observer,) = make_observers({name: settings})
    observer.allocate(1, periods)
    trajectory = start_run(Parameters(**PAPER_A))
    observer.begin(0, trajectory, Window(0, 0.0, periods))
    for log in trajectory.segments(periods, 0.0, np.empty((rows, COLUMNS))):
        assert len(log) <= rows
        observer.observe(log)
    observer.finish(True)
    whole = observed(Scene(PAPER_A, 0, periods), name, **settings)
    for key, array in observer.arrays.items():
        np.testing.assert_array_equal(array[0], whole[key], key)
    if "time" in settings:
        assert whole["burst_at_sticking_time"] > 0.0
