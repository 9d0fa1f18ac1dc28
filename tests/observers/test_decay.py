"""Decay of free vibrations against closed forms, numerical integration, and the energy balance."""

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

import damper

DAMPER = {"mass_ratio": 0.1, "damping_ratio": 0.02, "frequency_ratio": 1.0, "restitution": 0.5}
FREE = DAMPER | {"clearance": 0.6, "force_amplitude": 0.0, "transient": 0, "periods": 8}


def observed(**changes: Any) -> xr.Dataset:
    settings = {"decay": {"half_cycles": 40, "parts": [0.5, 0.1]}}
    return damper.simulate(
        **{"observers": settings, "initial_displacement": 2.0, **FREE, **changes}
    )


def listed(cube: xr.Dataset, name: str) -> np.ndarray:
    values = cube[name].values
    return values[np.isfinite(values)]


@pytest.mark.parametrize("mass", ["far from the walls", "without a clearance"])
def test_linear_vibration_has_the_damping_of_its_dashpot(mass: str) -> None:
    """A free mass that touches nothing, and one that moves with the primary for good."""
    together = mass == "without a clearance"
    cube = observed(clearance=0.0 if together else 9.0)
    heavier = 1.1 if together else 1.0
    zeta, omega = 0.02 / math.sqrt(heavier), 1.0 / math.sqrt(heavier)
    turn = math.pi / (omega * math.sqrt(1 - zeta**2))
    k = np.arange(int(cube.half_cycles))
    assert len(k) == int((8 * math.tau - 0.5 * turn) / turn) + 1
    np.testing.assert_allclose(listed(cube, "peak_time"), turn * k, atol=1e-13)
    peaks = 2 * np.exp(-zeta * omega * turn * k)
    np.testing.assert_allclose(listed(cube, "peak_amplitude"), peaks, rtol=1e-13)
    ratios = cube.equivalent_damping_ratio.values
    np.testing.assert_allclose(ratios[1 : len(k) - 1], zeta, rtol=1e-11)
    assert np.isnan([ratios[0], *ratios[len(k) - 1 :]]).all()
    halved, tenth = cube.fall_time.values
    assert halved == pytest.approx(math.log(2) / (zeta * omega), rel=1e-12)
    assert math.isnan(tenth)
    assert cube.energy_at_start == 2.0
    assert cube.energy_to_impacts == 0.0


def test_peaks_through_impacts_are_those_of_the_motion() -> None:
    """Largest |x| between zeros of x, by dense samples; what impacts take, by their speeds."""
    changes = {"initial_position": 0.0, "clearance": 1.6}
    cube = observed(**changes, periods=5)
    p = damper.Parameters(**DAMPER, clearance=1.6, force_amplitude=0.0)
    run = damper.run(p, 5 * math.tau, damper.State(2.0, 0.0, 2.0, 0.0), samples_per_period=2000)
    x, time = run.motion.displacement.values, run.motion.time.values
    halves = np.split(np.arange(len(x)), np.flatnonzero(np.diff(np.sign(x))) + 1)[:-1]
    tops = [half[np.argmax(abs(x[half]))] for half in halves]
    assert len(tops) >= 9
    np.testing.assert_allclose(listed(cube, "peak_time"), time[tops], atol=4e-3)
    np.testing.assert_allclose(listed(cube, "peak_amplitude"), abs(x[tops]), rtol=2e-6)
    speeds = run.events["approach_speed"]
    lost = 0.5 * 0.1 / 1.1 * (1.0 - 0.5**2) * float((speeds**2).sum())
    assert cube.energy_to_impacts == pytest.approx(lost, rel=1e-8)
    assert lost > 0.1


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"restitution": 0.0},
        {"mass_ratio": 2.0, "initial_velocity": 1.0},
        {"damping_ratio": 1.5},
        {"support_stiffness_ratio": 0.3, "support_damping_ratio": 0.02},
        {"contact_stiffness_ratio": 1e3},
        {"gravity": 0.05},
        {"friction": 0.02},
        {"friction": 0.02, "masses": [{}, {"clearance": 0.5, "friction": 0.1}]},
    ],
    ids=[
        "chattering",
        "plastic",
        "heavy",
        "overdamped",
        "grounded",
        "compliant",
        "gravity",
        "friction",
        "friction of two",
    ],
)
def test_energies_add_up(changes: dict[str, Any]) -> None:
    cube = observed(**changes)
    takes = ("to_impacts", "to_dashpot", "left", "to_friction")
    parts = [float(cube[f"energy_{name}"]) for name in takes]
    assert (parts[3] > 0.0) == ("friction" in changes)
    start = float(cube.energy_at_start)
    if changes.keys().isdisjoint({"support_stiffness_ratio", "gravity"}):
        v = changes.get("initial_velocity", 0.0)
        mu = changes.get("mass_ratio", 0.1)
        assert start == pytest.approx(0.5 * (4.0 + (1.0 + mu) * v * v), rel=1e-14)
    assert min(parts[:2]) > 0.0
    assert sum(parts) == pytest.approx(start, rel=1e-10)


UNLIKE = [{"clearance": 0.5, "gravity": 0.05}, {"mass_ratio": 0.3, "restitution": 0.3}, {}]


def test_a_heavy_mass_that_rubs_is_a_coulomb_damper() -> None:
    """Of Coulomb friction F peaks fall by 2 F each half cycle, and take as long as without."""
    force = 0.05
    cube = observed(damping_ratio=0.0, mass_ratio=1e10, friction=force / 1e10, clearance=100.0)
    peaks = listed(cube, "peak_amplitude")
    assert len(peaks) > 10
    np.testing.assert_allclose(peaks, 2.0 - 2.0 * force * np.arange(len(peaks)), atol=1e-8)
    np.testing.assert_allclose(
        listed(cube, "peak_time"), math.pi * np.arange(len(peaks)), atol=1e-7
    )


def test_what_each_of_several_masses_takes_adds_up() -> None:
    together = observed(masses=UNLIKE)
    each = observed(masses=UNLIKE, observers={"decay": {"half_cycles": 40, "bodies": [0, 1, 2]}})
    assert each.energy_to_impacts.dims == ("body",)
    assert each.energy_to_impacts.values.min() > 0.0
    total = float(together.energy_to_impacts)
    assert float(each.energy_to_impacts.sum()) == pytest.approx(total, rel=1e-10)
    left = float(each.energy_left + each.energy_to_dashpot)
    assert total + left == pytest.approx(float(each.energy_at_start), rel=1e-10)
    np.testing.assert_array_equal(each.peak_amplitude, together.peak_amplitude)


def test_masses_in_step_make_a_vibration_decay_as_one() -> None:
    one = observed()
    parts = observed(masses=[{"mass_ratio": 0.03}, {"mass_ratio": 0.07}],
                     observers={"decay": {"half_cycles": 40, "bodies": [0, 1]}})  # fmt: skip
    for name in ("peak_time", "peak_amplitude", "equivalent_damping_ratio", "energy_left"):
        np.testing.assert_allclose(parts[name], one[name], rtol=1e-10, err_msg=name)
    lost = float(one.energy_to_impacts) * np.array([0.3, 0.7])
    np.testing.assert_allclose(parts.energy_to_impacts, lost, rtol=1e-10)


def test_lists_that_are_too_short_leave_counts_and_times() -> None:
    whole, short = observed(), observed(observers={"decay": {"half_cycles": 3}})
    assert short.half_cycles == whole.half_cycles > 3
    np.testing.assert_array_equal(short.peak_amplitude, whole.peak_amplitude[:3])
    np.testing.assert_array_equal(short.fall_time, whole.fall_time)


@pytest.mark.parametrize("driven", [{"force_amplitude": 1.0}, {"modulation_depth": 0.1}])
def test_of_a_driven_vibration_all_is_missing_which_is_said(driven: dict[str, float]) -> None:
    cube = observed(**driven)
    for name in ("peak_amplitude", "equivalent_damping_ratio", "fall_time", "energy_left"):
        assert np.isnan(cube[name]).all()
    assert cube.vibration == 1
    assert observed().vibration == 0
