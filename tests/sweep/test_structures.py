"""Runs on structures: what is measured of them, `damper.run` and `damper.simulate`."""

import math

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import damper

BEAM = damper.Structure.from_modes(
    [1.0, 6.3],
    [0.1, 0.02],
    {"tip": [1.0, -1.0], "middle": [0.3, 0.7], "force": "middle", "base": [0.8, 0.3]},
)
BALL = {"box": "tip", "free_mass": 0.1, "gap": 0.04, "restitution": 0.6}
LOW = {"box": "middle", "free_mass": 0.05, "gap": 0.02, "restitution": 0.3}


def on(*masses, **given):
    values = {"force_amplitude": 2.0, "forcing_frequency": "1 Hz"} | given
    return damper.SIParameters(structure=BEAM, masses=masses or [BALL], **values)


def test_without_contact_the_response_is_that_of_the_transfer_function():
    p = on(BALL | {"gap": 9.0}, forcing_frequency="1.3 Hz")
    cube = damper.simulate(p, transient=30, periods=2)
    rate, modes = 2.0 * math.pi * 1.3, 2.0 * math.pi * np.array([1.0, 6.3])
    answer = modes**2 - rate**2 + 2j * np.array([0.1, 0.02]) * modes * rate
    force = np.array([0.3, 0.7])
    for place, shape in (("tip", [1.0, -1.0]), ("middle", force)):
        size, one = abs(2.0 * np.sum(shape * force / answer)), cube.sel(point=place)
        for order, name in enumerate(("displacement", "velocity", "acceleration")):
            wanted = pytest.approx(size * rate**order, rel=1e-6)
            assert one[f"peak_{name}"].item() == wanted
            assert one[f"rms_{name}"].item() * math.sqrt(2.0) == wanted
        assert one.amplitude.item() == pytest.approx(size, rel=1e-6)
    moving = abs(2.0 * force / answer) * rate
    lost = np.array([0.1, 0.02]) * modes * moving**2
    assert cube.mode_power.values == pytest.approx(lost, rel=1e-6)
    assert cube.input_power.item() == pytest.approx(lost.sum(), rel=1e-6)
    assert np.isnan(cube.mean_approach_speed.item())


@pytest.mark.parametrize("kind", [pd.Series, xr.DataArray, range])
def test_arrays_of_any_kind_make_a_dimension(kind):
    gaps = range(1, 3) if kind is range else kind(["1 m", "200 cm"])
    cube = damper.simulate(on(), gap_0=gaps, transient=0, periods=1)
    assert cube.gap_0.values.tolist() == [1.0, 2.0]
    with pytest.raises(ValueError, match="gap_0: has the attribute units = 'mm': must be in m;"):
        damper.simulate(on(), gap_0=cube.gap_0.assign_attrs(units="mm"))


RUBS = {"friction_coefficient": 0.05}


@pytest.mark.parametrize(
    ("masses", "given"),
    [
        ((BALL | {"tie_stiffness": 1.5, "tie_damping": 0.05}, LOW | {"gravity": 2.0}), {}),
        ((BALL, LOW), {"forcing": "base", "force_amplitude": 0.1}),
        ((BALL | {"restitution": 0.0},), {}),
        ((BALL | RUBS, LOW | RUBS), {"transverse_acceleration": 1.0}),
    ],
)
def test_power_put_in_is_lost_or_stored(masses, given):
    """Also where bursts are closed, masses stick, and the base moves."""
    run = damper.run(on(*masses, **given), until=1.7)
    found, rubs = run.results, any(one.friction for one in run.parameters.each)
    assert set(run.events["kind"]) == ({0, 4, 5, 6} if rubs else {0, 1, 2})
    lost = found.impact_power.sum() + found.tie_power.sum() + found.mode_power.sum()
    lost += found.friction_power.sum()
    assert (found.friction_power > 0.0).all() == rubs
    assert found.impact_power.min() > 0.0
    assert abs(found.power_residual) < 1e-12 * (abs(found.input_power) + lost)


def test_peaks_and_means_do_not_depend_on_samples():
    run = damper.run(on(), until=2.0, samples_per_period=1000)
    found, x = run.results, run.motion.displacement
    assert found.peak_displacement.values == pytest.approx(abs(x).max("time").values, rel=1e-4)
    assert (found.peak_displacement >= abs(x).max("time") * (1.0 - 1e-9)).all()
    assert found.rms_displacement.values == pytest.approx(
        np.sqrt((x[1:] ** 2).mean("time").values), rel=1e-3
    )
    cycles = [x.sel(time=slice(k, k + 1)) for k in range(2)]
    ranges = [0.5 * (one.max("time") - one.min("time")) for one in cycles]
    assert found.amplitude.values == pytest.approx(sum(ranges).values / 2, rel=1e-4)
    assert found.mean_energy.values == pytest.approx(
        run.motion.mode_energy.mean("time").values, rel=1e-2
    )
    speeds = run.events["approach_speed"][run.events["kind"] == damper.IMPACT]
    assert found.mean_approach_speed.item() == pytest.approx(speeds.mean())
    assert found.max_approach_speed.item() == pytest.approx(speeds.max())
    assert found.impacts_per_cycle.item() == len(speeds) / 2


def test_a_run_says_what_happened_and_draws_it():
    start = damper.State([0.0, 0.0], [0.0, 0.0], 0.01, 0.0, time=1.0)
    run = damper.run(on(), 2.0, start, gap_0="5 cm")
    assert run.events["time"][0] > 1.0
    assert "from time 1 to 2" in repr(run)
    assert f"{run.results.peak_displacement.sel(point='tip').item():.4g} m" in repr(run)
    assert [len(ax.lines) for ax in run.plot(0.1, 0.9, ["tip"]).axes] == [1, 1, 2]
    with pytest.raises(TypeError, match="unknown point 'tpi'"):
        run.plot(points=["tpi"])
    with pytest.raises(ValueError, match="the run has no such stretch"):
        run.plot(2.0)


def test_sequences_make_dimensions():
    masses = [BALL | {"gap": ["4 cm", 0.06]}]
    one = {"structure": BEAM, "force_amplitude": 2.0, "transient": 0, "periods": 1}
    frequencies = ["1 Hz", "1.5 Hz"]
    cube = damper.simulate(masses=masses, forcing_frequency=frequencies, **one)
    assert dict(cube.sizes) == {
        "forcing_frequency": 2, "gap_0": 2, "point": 2, "body": 1, "mode": 2
    }  # fmt: skip
    assert cube.gap_0.values.tolist() == [0.04, 0.06]
    assert cube.gap_0.units == "m"
    series = pd.Series(frequencies, index=[3, 4])
    assert cube.identical(damper.simulate(masses=masses, forcing_frequency=series, **one))
    with pytest.raises(ValueError, match="forcing_frequency: must be a number or a non-empty"):
        damper.simulate(masses=masses, forcing_frequency=[], **one)
    with pytest.raises(ValueError, match=r"on a structure.*damper\.run\(parameters\.having"):
        cube.damper.run(gap_0=0.06)
    alone = damper.run(on(BALL | {"gap": 0.06}, forcing_frequency="1.5 Hz"), until=1 / 1.5)
    there = cube.isel(forcing_frequency=1, gap_0=1)
    assert there.peak_displacement.values == pytest.approx(alone.results.peak_displacement.values)


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("bursts", {"records": 4}),
        ("chatter_bursts", {"since": [0, 2]}),
        ("burst_at", {"time": 4.0, "threshold": {"speed": 0.002}}),
        ("stroboscopic_section", {"free_mass": True}),
        ("impact_section", {"samples": 4}),
        ("segments", {"periods": 1}),
        ("trajectory", {"samples_per_period": 8, "events": 20, "length": 1.5}),
        ("harvest", {"coefficient": 2.0}),
        ("statistics", {"batches": 9, "above": 1e-3}),
        ("decay", {"half_cycles": 20}),
        ("accumulation", {"bursts": 4, "impacts": 20}),
    ],
)
def test_observers_see_on_one_mode_what_they_see_on_an_oscillator(name, settings):
    """Through complete chatter, sticking, impacts on both walls, slides and rests."""
    rate = 2.0 * math.pi
    shapes = {"tip": [1.0], "force": "tip"}
    one = damper.Structure.from_modes([1.0], [0.05], shapes, modal_masses=[2.0])
    mass = {"free_mass": 0.2, "gap": 0.02, "restitution": 0.6}
    # Under friction one of both may close a burst an impact earlier: another segment. The formulas
    # of accumulation know none.
    mass |= {} if name in ("segments", "accumulation") else RUBS
    driven = {"force_amplitude": 1.0, "forcing_frequency": 6.0, "transverse_acceleration": 1.0}
    oscillator = {"primary_mass": 2.0, "damping": 0.2 * rate, "stiffness": 2.0 * rate**2}
    more = {"transient": 3, "periods": 6, "observers": {name: settings}}
    if name == "decay":
        driven |= {"forcing": "none", "force_amplitude": 0.0}
        more |= {"transient": 0, "state": damper.State(0.05, 0.0, 0.05, 0.0)}
    found = damper.simulate(structure=one, masses=[mass], **driven, **more)
    wanted = damper.simulate(damper.SIParameters(**oscillator, **mass, **driven), **more)
    for variable in set(wanted.data_vars) - {"status"}:
        one, other = found[variable].values, wanted[variable].values
        assert np.isfinite(other).any(), variable
        assert np.squeeze(one) == pytest.approx(other, rel=1e-9, abs=1e-12, nan_ok=True), variable


def test_each_mass_has_a_box_of_its_own():
    """Sections and trajectories against the motion of the run, in two boxes."""
    p = on(BALL, LOW)
    observers = {"stroboscopic_section": {"free_mass": True}, "trajectory": {}}
    cube = damper.simulate(p, transient=0, periods=3, observers=observers)
    moved = damper.run(p, until=3.0, samples_per_period=1).motion.displacement
    assert cube.displacement.dims == ("body", "sample")
    boxes = moved.sel(point=["tip", "middle"]).isel(time=slice(3))
    assert cube.displacement.values == pytest.approx(boxes.values.T, abs=1e-14)
    rows = cube.isel(instant=cube.trajectory_event.values == 0)
    jump = rows.trajectory_free_velocity.diff("instant")[:, ::2]
    hit = rows.trajectory_body.values[::2].astype(int)
    assert set(hit) == {0, 1}
    assert (abs(jump.values[hit, range(len(hit))]) > 1e-9).all()
    assert (abs(jump.values[1 - hit, range(len(hit))]) < 1e-14).all()


THREE = damper.Structure.from_modes(
    [1.0, 2.7, 5.2],
    [0.02, 0.01, 0.01],
    {"tip": [1.0, 0.6, -0.4], "deck": [0.4, -0.9, 0.5], "force": [1.0, 0.6, 0.3]},
)
TIED = {"box": "deck", "free_mass": 0.1, "gap": 0.02, "tie_stiffness": 3.0, "tie_damping": 0.05}
TWO = [{"box": "tip", "free_mass": 0.1, "gap": 0.04}, TIED]


def test_a_decay_is_that_of_each_box_and_its_energy_that_of_all():
    """Peaks and times by dense samples of the boxes, energies by those of the modes."""
    p = damper.SIParameters(structure=THREE, masses=TWO, forcing="none", restitution=0.5)
    start = damper.State([0.1, 0.02, 0.0], [0.0] * 3, [0.11, 0.02], [0.0, 0.0])
    observers = {"decay": {"half_cycles": 60, "parts": [0.8, 0.3]}}
    cube = damper.simulate(p, state=start, transient=0, periods=4, observers=observers)
    run = damper.run(p, 4.0, start, samples_per_period=400)
    time, moved = run.motion.time.values, run.motion.displacement
    for body, place in enumerate(("tip", "deck")):
        x, own = moved.sel(point=place).values, cube.sel(body=body)
        halves = np.split(np.arange(len(x)), np.flatnonzero(np.diff(np.sign(x))) + 1)[:-1]
        tops = np.array([half[np.argmax(abs(x[half]))] for half in halves])
        count = own.half_cycles.item()
        assert count - len(tops) in (0, 1)
        assert own.peak_time.values[: len(tops)] == pytest.approx(time[tops], abs=2e-3)
        peaks = abs(x[tops])
        assert own.peak_amplitude.values[: len(tops)] == pytest.approx(peaks, rel=1e-3, abs=1e-5)
        for part, fall in zip((0.8, 0.3), own.fall_time.values, strict=True):
            last = np.flatnonzero(peaks > part * peaks[0])[-1]
            if last == len(peaks) - 1:
                assert math.isnan(fall)
                continue
            logs = np.log(peaks[last : last + 2] / (part * peaks[0]))
            share = logs[0] / (logs[0] - logs[1])
            wanted = time[tops[last]] + share * (time[tops[last + 1]] - time[tops[last]])
            assert fall == pytest.approx(wanted - time[tops[0]], abs=1e-2)
    assert np.isfinite(cube.fall_time.values).any()
    energy = 0.5 * np.array([0.1, 0.02]) ** 2 @ (2.0 * math.pi * np.array([1.0, 2.7])) ** 2
    energy += 0.5 * 3.0 * (0.02 - (0.4 * 0.1 - 0.9 * 0.02)) ** 2
    assert cube.energy_at_start.item() == pytest.approx(energy, rel=1e-13)
    results = run.results
    assert cube.energy_to_impacts.values == pytest.approx(4 * results.impact_power.values)
    lost = 4 * (results.mode_power.sum() + results.tie_power.sum())
    assert cube.energy_to_dashpot.item() == pytest.approx(lost.item(), rel=1e-12)
    parts = cube.energy_to_impacts.sum() + cube.energy_to_dashpot + cube.energy_left
    assert parts.item() == pytest.approx(energy, rel=1e-12)


def test_theory_of_accumulation_comes_as_close_to_what_is_resolved_as_its_order_says():
    """Of a mass tied to its box, and two in step in another: late in a burst, by powers of time."""
    alike = {"box": "tip", "free_mass": 0.05, "gap": 0.04}
    masses = [TIED, alike, alike | {"free_mass": 0.03}]
    driven = {"force_amplitude": 2.0, "forcing_frequency": "0.7 Hz", "restitution": 0.4}
    p = damper.SIParameters(structure=THREE, masses=masses, **driven)
    found = damper.simulate(p, transient=0, periods=3, observers={"accumulation": {"impacts": 14}})
    assert (found.complete_bursts > 1).all()
    left, moved = found.remaining_time.values, found.remaining_displacement.values
    late = (left[..., :-1] < 1.2e-3) & (left[..., 1:] > 1.2e-4)
    assert late.any(axis=(1, 2)).all()
    shorter = (left[..., 1:] / left[..., :-1])[late]
    for power, name in ((1, "first_order"), (2, "second_order")):
        times, ways = found[f"{name}_time"].values, found[f"{name}_displacement"].values
        for off, order in ((times - left, power + 1), (ways - moved, power + 1)):
            falls = (off[..., 1:] / off[..., :-1])[late]
            assert falls == pytest.approx(shorter**order, rel=0.3), (name, order)
    estimate = found.prediction_error_estimate.values
    known = (left > 1.2e-4) & (left < 1.2e-3)
    off = abs(found.second_order_time.values - left) / found.first_order_time.values
    assert (off[known] < estimate[known]).all()


def test_statistics_are_those_of_the_structure_and_of_each_mass():
    """Powers and energies of the modes as measured without observers; means of samples."""
    driven = {"force_amplitude": 2.0, "forcing_frequency": "1 Hz"}
    p = damper.SIParameters(structure=THREE, masses=TWO, restitution=0.5, **driven)
    observers = {"statistics": {"batches": 8, "above": 1e-4}}
    cube = damper.simulate(p, transient=1, periods=2, observers=observers)
    assert cube.mean_input.dims == ()
    energy = cube.mean_potential_energy + cube.mean_kinetic_energy
    lost = cube.mode_power.sum() + cube.tie_power.sum() + cube.impact_power.sum()
    for found, wanted in (
        (energy, cube.mean_energy.sum()),
        (cube.mean_input, cube.input_power),
        (cube.mean_loss, lost),
        (cube.mean_impact_loss.sum(), cube.impact_power.sum()),
    ):
        assert found.values == pytest.approx(wanted.values, rel=1e-11)
    moved = damper.run(p, 3.0, samples_per_period=400).motion.sel(time=slice(1.0, 3.0))
    apart = moved.free_displacement - moved.displacement.sel(point=["tip", "deck"]).values
    place = (apart**2).mean("time").values / [4e-4, 1e-4]
    assert cube.mean_square_place.values == pytest.approx(place, rel=1e-2)
    kinetic = 0.05 * (moved.free_velocity**2).mean("time").values
    assert cube.mean_free_mass_energy.values == pytest.approx(kinetic, rel=1e-2)
    # An impact of restitution 1/2 takes 3/4 of what the masses have in approaching; more where the
    # other mass sticks.
    taken = 0.75 * cube.mean_approach_energy * cube.impact_rate
    assert cube.mean_impact_loss.values == pytest.approx(taken.values, rel=1e-4)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"observers": ["impacts"]}, "observers is not known on a structure"),
        ({"observers": {"segments": {"at": {"gap_0": 1}}}}, "segments.at: on a structure every"),
        ({"observers": {"trajectory": {"drive": True}}}, "trajectory.drive does not know"),
        ({"draws": {"count": 2}}, "draws is not known on a structure"),
        ({"gapp_0": [0.1, 0.2]}, r"unknown quantity .* 'gapp_0' \(did you mean 'gap_0'\?\)"),
        ({"gap_1": [0.1, 0.2]}, "gap_1 is of mass 1, and masses has 1"),
        ({"gap_0": [0.1, -0.2]}, "gap = -0.2"),
        ({"gap_0": [0.1, 0.1]}, "gap_0: 0.1 is given 2 times"),
        ({"gap_0": []}, "gap_0: must be a number or a non-empty"),
        ({"gap_0": np.linspace(0.01, 0.1, 10_001)}, "gap_0: too many points, at most 10000"),
        ({"periods": 0}, "periods = 0"),
        ({"periods": 1e300}, r"1e\+300 cycles \(transient \+ periods\): must be at most 1000000"),
        ({"observers": "respnse"}, r"'respnse' \(did you mean 'response'\?\)"),
        ({"observers": 0.5}, "observers = 0.5: must be names"),
        ({"follow": np.ones(2)}, "follow is not known on a structure"),
    ],
)
def test_mistakes_in_a_grid_are_named(given, message):
    with pytest.raises((ValueError, TypeError), match=message):
        damper.simulate(on(), **given)


def test_a_run_that_stops_early_says_so():
    cube = damper.simulate(on(), gap_0=[0.04, 9.0], transient=1, periods=1, max_events=3)
    assert cube.status.values.tolist() == [1, 0]
    assert np.isnan(cube.peak_displacement[0]).all()
    assert np.isfinite(cube.peak_displacement[1]).all()
