"""The observers that read bursts one by one, against plain loops over the event rows."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_bursts import Burst, Scene, all_bursts
from scenes import PAPER_A, SLOW

from damper.sweep.runs import run_points
from damper.sweep.slices import simulate_slice


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


@pytest.mark.parametrize(
    ("time", "restitution", "transient"), [(0.0, 0.45, 4), (155.0, 0.8, 4), (1e4, 0.9, 0)]
)
@pytest.mark.parametrize("scene", [PAPER_A, SLOW], ids=["paper_a", "slow"])
def test_nearest_burst_of_the_event_rows(
    scene: dict[str, float], time: float, restitution: float, transient: int
) -> None:
    assert_nearest(Scene({**scene, "restitution": restitution}, transient, 8), time)


@settings(max_examples=25)
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


@pytest.mark.parametrize(
    ("restitution", "omega", "transient"), [(0.3, 0.25, 0), (0.8, 0.2, 7), (0.9, 0.3, 7)]
)
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
