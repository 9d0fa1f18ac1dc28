"""Largest force, acceleration, impulse and loss; the primary alone; decay after a shock."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.signal import lsim

import damper
from damper.sweep.runs import run_points

POINT: dict[str, Any] = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.9,
    "clearance": 0.5,
    "restitution": 0.6,
}
RECORD = damper.Record([0.0, 1.0, 2.0, 4.0], [0.0, 2.0, -3.0, 0.0], of="base_acceleration")
MASSES = [{"clearance": 0.3}, {"mass_ratio": 0.3, "gravity": 0.2}]
RESPONSE = {"response": {"extremes": True}}
SAMPLED = RESPONSE | {"trajectory": {"samples_per_period": 4000}}


@pytest.mark.parametrize(
    "change",
    [
        {},
        {"gravity": 0.3},
        {"support_stiffness_ratio": 0.02, "support_damping_ratio": 0.01},
        {"support_stiffness_ratio": 0.02, "friction": 0.1, "frequency_ratio": 0.3},
        {"clearance": 0.02, "frequency_ratio": 0.3, "restitution": 0.3},
        {"damping_ratio": 1.2},
        {"forcing": damper.Base("base")},
        {"forcing": damper.Harmonics((1, 3), (1.0, 0.5))},
        {"masses": MASSES, "frequency_ratio": 0.5, "restitution": 0.3},
        {"masses": MASSES, "restitution": 0.3, "forcing": damper.Base("base")},
    ],
    ids=str,
)
def test_extremes_are_those_of_dense_samples(change: dict[str, Any]) -> None:
    bodies = {"bodies": range(2)} if "masses" in change else {}
    ask = {name: {**given, **bodies} for name, given in SAMPLED.items()} | RESPONSE
    cube = damper.simulate(**POINT | change, transient=3, periods=1, observers=ask)
    x, v, time = (
        cube[f"trajectory_{n}"].values[np.isfinite(cube.trajectory_time.values)]
        for n in ("displacement", "velocity", "time")
    )
    zeta = change.get("damping_ratio", POINT["damping_ratio"])
    assert abs(x + 2.0 * zeta * v).max() == pytest.approx(cube.peak_force.item(), rel=1e-5)
    # Between impacts the mean acceleration of a step is one that occurs, but for inertia.
    steps = np.diff(time)
    long = steps > 0.9 * steps.max()
    slopes = np.diff(v)[long] / steps[long]
    if "forcing" in change and change["forcing"].kind == "base":
        middle = (time[1:] + time[:-1])[long] / 2.0 + 3.0 * 2.0 * math.pi / 0.9
        slopes = slopes - 0.9**2 * np.sin(0.9 * middle)
    assert abs(slopes).max() == pytest.approx(cube.peak_acceleration.item(), rel=4e-3)


def test_extremes_are_the_same_in_both_frames_of_a_base() -> None:
    # Base motion sin(omega t): relative to it, all starts with minus its velocity.
    omega = POINT["frequency_ratio"]
    run = {"transient": 0, "periods": 30}
    found = []
    for frame, v in (("ground", 0.0), ("base", -omega)):
        point = POINT | {"forcing": damper.Base(frame)}
        found.append(run_points([point], RESPONSE, state=damper.State(0.0, v, 0.0, v), **run)[0])
    for name in ("peak_force", "peak_acceleration"):
        np.testing.assert_allclose(found[0][name], found[1][name], rtol=1e-9)


def test_of_several_masses_each_impact_takes_what_it_changes() -> None:
    """Impulse and loss from velocities before and after; without `bodies` the largest of all."""
    largest = {"impacts": {"largest": True}}
    run = POINT | {"masses": MASSES, "restitution": 0.3, "transient": 3, "periods": 4}
    bodies = {"bodies": [0, 1]}
    ask = {"impacts": {"largest": True} | bodies, "trajectory": bodies}
    each, every = damper.simulate(**run, observers=ask), damper.simulate(**run, observers=largest)
    assert int(each.trajectory_events_left_out) == 0
    rows = each.isel(instant=np.isfinite(each.trajectory_time.values))
    v, u = rows.trajectory_velocity.values, rows.trajectory_free_velocity.values
    before = np.flatnonzero(rows.trajectory_event.values == 0)[::2]
    hit = rows.trajectory_body.values[before].astype(int)
    for body, ratio in enumerate([0.1, 0.3]):
        own = before[hit == body]
        impulse = ratio * abs(u[body, own + 1] - u[body, own])
        speeds = abs(u[body, own] - v[own]), abs(u[body, own + 1] - v[own + 1])
        found = each.sel(body=body)
        assert len(own) > 5
        assert float(found.max_impulse) == pytest.approx(impulse.max(), rel=1e-9)
        loss = 0.5 * impulse * (speeds[0] - speeds[1])
        assert float(found.max_impact_loss) == pytest.approx(loss.max(), rel=1e-9)
    for name in ("max_impulse", "max_impact_loss"):
        assert float(every[name]) == float(each[name].max())


def test_a_single_impact_takes_what_its_speed_says() -> None:
    si = {"primary_mass": 2.0, "damping": 1.0, "stiffness": 300.0, "forcing_frequency": 12.0}
    si |= {"force_amplitude": 5.0, "free_mass": 0.3, "gap": 0.01, "restitution": 0.6}
    cube = damper.simulate(
        **si, transient=10, periods=4, observers=SAMPLED | {"impacts": {"largest": True}}
    )
    speed, reduced = cube.max_approach_speed.item(), 2.0 * 0.3 / 2.3
    assert cube.max_impulse.item() == pytest.approx(reduced * 1.6 * speed, rel=1e-12)
    loss = 0.5 * reduced * (1.0 - 0.36) * speed**2
    assert cube.max_impact_loss.item() == pytest.approx(loss, rel=1e-12)
    units = {n: cube[n].attrs["units"] for n in ("max_impulse", "peak_force", "peak_acceleration")}
    assert units == {"max_impulse": "N s", "peak_force": "N", "peak_acceleration": "m/s2"}
    force = 300.0 * cube.trajectory_displacement + 1.0 * cube.trajectory_velocity
    assert abs(force).max().item() == pytest.approx(cube.peak_force.item(), rel=1e-5)


def test_ratios_compare_with_the_primary_alone() -> None:
    # Exact for a force that is linear between samples: scipy's first-order hold.
    zeta, run = POINT["damping_ratio"], {"transient": 0, "periods": {"time": 20.0}}
    observers = {"response": {"without_damper": True}}
    cube = damper.simulate(**POINT, forcing=RECORD, observers=observers, **run)
    time = np.linspace(0.0, 20.0, 200_001)
    force = -np.interp(time, RECORD.time, RECORD.value)
    system = ([[0.0, 1.0], [-1.0, -2.0 * zeta]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]])
    _, _, states = lsim(system, force, time)
    x = states[:, 0]
    peak = cube.peak_displacement.item() / cube.amplitude_ratio.item()
    rms = cube.rms_displacement.item() / cube.rms_ratio.item()
    assert peak == pytest.approx(abs(x).max(), rel=1e-8)
    assert rms == pytest.approx(math.sqrt(np.mean(x**2)), rel=1e-4)
    far = damper.simulate(**POINT | {"clearance": 1e6}, forcing=RECORD, observers=observers, **run)
    assert (far.amplitude_ratio.item(), far.rms_ratio.item()) == (1.0, 1.0)


def test_what_is_not_known_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^response\.extremes does not know compliant contact"):
        damper.simulate(
            **POINT, contact_stiffness_ratio=100, transient=1, periods=1, observers=RESPONSE
        )
