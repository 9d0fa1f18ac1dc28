"""`damper.run` has the motion of its events, and a point of a cube the motion of its run."""

import numpy as np
import pytest
import xarray as xr

import damper
import damper.notebook

P = damper.Parameters(0.1, 0.05, 0.2, 0.25, 0.6)
SI = damper.SIParameters(
    primary_mass=100.0,
    damping=800.0,
    stiffness=4e6,
    force_amplitude=200.0,
    forcing_frequency=190.0,
    free_mass=10.0,
    gap=1e-4,
    restitution=0.6,
)


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    return damper.simulate(
        mass_ratio=0.1,
        damping_ratio=0.02,
        frequency_ratio=1.3,
        clearance=0.05,
        restitution=[0.3, 0.6, 0.9],
        transient=3,
        periods=5,
    )


@pytest.mark.parametrize("parameters", [P, SI], ids=["numbers", "SI"])
def test_motion_meets_the_walls_at_the_events(parameters) -> None:
    until = 60.0 if parameters is P else 0.2
    run = damper.run(parameters, until)
    found = damper.events(parameters, until=until)
    assert np.array_equal(run.events, found)
    motion = run.motion
    d = parameters.clearance if parameters is P else parameters.gap / 2.0
    relative = motion.free_displacement - motion.displacement
    assert abs(relative).max() == pytest.approx(d, rel=1e-12)
    impacts = found["time"][found["kind"] == 0]
    twice = motion.time.values[1:][np.diff(motion.time.values) == 0.0]
    np.testing.assert_allclose(twice, impacts, rtol=1e-13)
    assert f"{len(impacts)} impacts" in repr(run)


def test_a_run_may_end_within_a_period() -> None:
    run = damper.run(P, 1.4 * P.period)
    assert float(run.motion.time.max()) == pytest.approx(1.4 * P.period, rel=1e-12)
    assert (run.bursts["onset"] < 1.4 * P.period).all()


def test_a_run_begins_at_the_time_of_its_state() -> None:
    later = damper.State(0.0, 0.0, 0.1, 0.3, time=3.0)
    run = damper.run(P, 60.0, later)
    assert np.array_equal(run.events, damper.events(P, later, until=run.motion.time.values[-1]))
    assert run.motion.time.values[0] == 3.0
    assert 60.0 - P.period / 200 < run.motion.time.values[-1] <= 60.0
    twice = run.motion.time.values[1:][np.diff(run.motion.time.values) == 0.0]
    np.testing.assert_allclose(twice, run.events["time"][run.events["kind"] == 0], rtol=1e-13)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"until": -1.0}, "until = -1.0: must be a time >= 0.157"),
        ({"until": 0.1}, "until = 0.1: must be a time >= 0.157"),
        ({"until": 1e300}, r"until = 1e\+300: ends after 3.18e\+298 forcing periods; at most"),
        ({"samples_per_period": 0}, "samples_per_period = 0: must be a whole number >= 1"),
        ({"samples_per_period": "many"}, "samples_per_period = 'many': must be a real number"),
        ({"state": (0, 0, 0, 0)}, "must be a damper.State"),
    ],
)
def test_a_slip_is_named_before_anything_is_run(given: dict, message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        damper.run(P, **({"until": 5.0} | given))


def test_a_point_is_run_as_it_was(cube: xr.Dataset) -> None:
    for restitution in (0.3, 0.9):
        run = cube.damper.run(restitution=restitution)
        there = cube.sel(restitution=restitution)
        np.testing.assert_array_equal(run.cube.displacement, there.displacement)
        begun = 3 * run.parameters.period
        assert run.motion.time.values[0] == pytest.approx(begun, rel=1e-14)
        assert run.events["time"].min() >= begun
        assert np.isclose(run.bursts["onset"].iloc[0], run.events["time"]).any()


def test_figures_and_orbit(cube: xr.Dataset) -> None:
    assert len(cube.damper.bifurcation("restitution").axes) >= 2
    assert len(cube.damper.history(restitution=0.3).axes) == 2
    assert len(cube.damper.portrait(restitution=0.3).axes) == 3
    assert cube.damper.orbit(restitution=0.3).stable


@pytest.mark.parametrize(
    ("point", "message"),
    [
        ({}, "restitution is not given; a point says where it lies along restitution"),
        ({"restitutoin": 0.3}, r"unknown dimension 'restitutoin' \(did you mean 'restitution'\?\)"),
        ({"restitution": 7.0}, "restitution = 7.0: must be a finite number with 0 <= rest"),
        ({"restitution": None}, "restitution = None: must be a real number"),
    ],
)
def test_a_point_that_is_none_is_refused(cube: xr.Dataset, point: dict, message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        cube.damper.run(**point)


def test_what_is_no_cube_is_refused(cube: xr.Dataset) -> None:
    with pytest.raises(ValueError, match="does not say how its points were run: make it by"):
        cube.drop_attrs().damper.run(restitution=0.3)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"rowz": "clearance"}, "unknown key 'rowz'.*did you mean 'rows'"),
        ({"variables": ["displacment"]}, "value: 'displacment'.*did you mean 'displacement'"),
        ({"variables": "displacement"}, "variables: not a list.*must be list of"),
    ],
)
def test_settings_of_a_figure_that_are_none_are_refused(
    cube: xr.Dataset, settings: dict, message: str
) -> None:
    with pytest.raises(ValueError, match=f"(?s){message}"):
        cube.damper.bifurcation("restitution", **settings)


def test_only_what_is_not_the_default_is_shown() -> None:
    assert repr(P) == (
        "Parameters(mass_ratio=0.1, damping_ratio=0.05, frequency_ratio=0.2, clearance=0.25, "
        "restitution=0.6)"
    )
    assert eval(repr(SI), vars(damper)) == SI
