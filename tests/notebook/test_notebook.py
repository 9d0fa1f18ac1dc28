"""`damper.run` has the motion of its events, and a point of a cube the motion of its run."""

from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import damper
import damper.notebook
from damper.analysis.closed_forms import damper_at, reduced_gap
from damper.figures.common.style import THEORY
from damper.models import start_run
from damper.sweep.cube import write_cube
from damper.sweep.record import recorded

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
    motion, cube = run.motion, run.cube
    steps = np.diff(motion.time.values)
    # As few as there can be of at most the 200th part of a cycle, up to the very end.
    count = np.ceil(200 * until / parameters.cycle)
    np.testing.assert_allclose(steps, until / count, rtol=1e-9)
    d = parameters.clearance if parameters is P else parameters.gap / 2.0
    relative = motion.free_displacement - motion.displacement
    assert 0.9 * d < abs(relative).max() <= d * (1.0 + 1e-12)
    # The cube has the rows of the events, too.
    apart = cube.trajectory_free_displacement - cube.trajectory_displacement
    assert abs(apart).max() == pytest.approx(d, rel=1e-12)
    impacts = found["time"][found["kind"] == 0]
    twice = cube.trajectory_time.values[cube.trajectory_event.values == 0.0][::2]
    np.testing.assert_allclose(twice, impacts, rtol=1e-13)
    assert f"{len(impacts)} impacts" in repr(run)


@pytest.mark.parametrize("until", [10.0, 31.5, 100.0 / 3.0])
def test_a_motion_ends_where_it_is_asked_to(until: float) -> None:
    """In equal steps; the state there is that of a run to this time."""
    run = damper.run(P, until)
    times = run.motion.time.values
    assert times[-1] == pytest.approx(until, rel=1e-15)
    steps = np.diff(times)
    assert steps == pytest.approx(steps[0], rel=1e-9)
    assert until / (until / P.cycle * 200 + 1) < steps[0] <= P.cycle / 200 * (1 + 1e-9)
    trajectory = start_run(P)
    end = trajectory.whole_periods(until)
    trajectory.skip(*end)
    state, last = trajectory.state_at(*end), run.motion.isel(time=-1)
    found = [float(last[name]) for name in ("displacement", "velocity", "free_displacement")]
    assert found == pytest.approx([state.x, state.v, state.y], abs=1e-14)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"until": -1.0}, "until = -1.0: must be a time >= 0.157"),
        ({"until": None}, "until is missing: give the time at which the run ends"),
        ({"until": 0.1}, "until = 0.1: must be a time >= 0.157"),
        ({"until": 1e300}, r"until = 1e\+300: ends after 3.18e\+298 cycles; at most"),
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
        begun = 3 * run.parameters.cycle
        assert run.motion.time.values[0] == pytest.approx(begun, rel=1e-14)
        assert run.events["time"].min() >= begun
        assert np.isclose(run.bursts["onset"].iloc[0], run.events["time"]).any()


#: Chaotic at a restitution of 0.9, so that no motion but the very same has its sections.
CHAOS = {"mass_ratio": 0.1, "damping_ratio": 0.02, "frequency_ratio": 1.3, "clearance": 0.05}
STARTS = {
    "branch": {"clearance": [0.07, 0.05, 0.06], "follow": {"clearance": "both"}},
    "branch in SI": {"gap": [6e-6, 8e-6, 7.5e-6], "follow": {"gap": "both"}},
    "steady": {"initial": "steady"},
    "initial values": {"initial_displacement": [0.5, 1.0], "initial_relative_velocity": 0.3},
    "draws": {"draws": {"count": 3, "seed": 1, "initial_position": [-1, 1]}},
}


@pytest.mark.parametrize("kind", STARTS)
def test_a_point_moves_from_where_it_started(kind: str) -> None:
    given = SI.given | {"forcing_frequency": 260.0} if "SI" in kind else CHAOS
    given = given | {"restitution": [0.8, 0.9], "transient": 10, "periods": 30} | STARTS[kind]
    cube = damper.simulate(**given, accuracy=1e-9)
    place = {"restitution": 0.9}
    for name in ("clearance", "gap", "initial_displacement", "direction", "draw"):
        if name in cube.dims:
            place[name] = cube[name].values.tolist()[-1]
    run = cube.damper.run(**place)
    there = cube.sel(place)
    np.testing.assert_array_equal(run.cube.displacement, there.displacement)
    rest = damper.simulate(**run.parameters.given, transient=10, periods=30, accuracy=1e-9)
    assert abs(rest.displacement - there.displacement).max() > 1e-3 * abs(rest.displacement).max()
    # Its events are those of its motion, and it is found in a part of the cube, too.
    rows = run.cube.trajectory_time.values[run.cube.trajectory_event.values == 0.0][::2]
    impacts = run.events["time"][run.events["kind"] == 0]
    np.testing.assert_allclose(rows - rows[0], impacts - impacts[0], atol=1e-7)
    np.testing.assert_array_equal(there.damper.run().cube.displacement, there.displacement)


def test_the_orbit_of_a_branch_is_the_one_it_shows() -> None:
    """Above resonance two impacts per period if it comes from below, and an idle damper."""
    cube = damper.simulate(
        **CHAOS | {"frequency_ratio": [1.05, 1.1, 1.15, 1.2], "clearance": 5.0},
        **{"restitution": 0.7, "transient": 150, "periods": 10},
        follow={"frequency_ratio": "both"},
    )
    words = [cube.damper.orbit(frequency_ratio=1.2, direction=way).word for way in ("up", "down")]
    assert words == ["R1 L1", ""]


def test_what_a_part_of_a_cube_has_lost_is_named() -> None:
    cube = damper.simulate(**CHAOS, **STARTS["draws"], restitution=[0.5, 0.6], periods=1)
    for place in ({"draw": 0}, {"restitution": 0}):
        rest = {"restitution": 0.5, "draw": 1}
        del rest[next(iter(place))]
        with pytest.raises(ValueError, match=r"the cube has lost '(initial_position|restitution)'"):
            cube.isel(place, drop=True).damper.run(**rest)
    with pytest.raises(ValueError, match="the cube has lost 'clearance', which its runs depend on"):
        cube.drop_vars("clearance").damper.run(restitution=0.5, draw=1)
    with pytest.raises(ValueError, match="the cube has lost 'restitution'"):
        cube.drop_vars("restitution").damper.bifurcation("restitution")
    with pytest.raises(ValueError, match="the cube has nothing along 'draw': select at least one"):
        cube.isel(draw=[]).damper.run(restitution=0.5)
    with pytest.raises(ValueError, match="draw = 3: must be one of 0, 1, 2"):
        cube.damper.run(restitution=0.5, draw=3)
    branch = damper.simulate(**CHAOS | STARTS["branch"], restitution=0.5, transient=0, periods=1)
    with pytest.raises(ValueError, match="the cube has lost 'direction'"):
        branch.isel(direction=0, drop=True).damper.run(clearance=0.06)
    del branch.attrs["followed"]  # as of a cube of an earlier version
    with pytest.raises(ValueError, match="does not say what was followed: make it again"):
        branch.sel(direction="up").damper.run(clearance=0.06)


def test_figures_and_orbit(cube: xr.Dataset) -> None:
    assert len(cube.damper.bifurcation("restitution").axes) >= 2
    assert len(cube.damper.history(restitution=0.3).axes) == 2
    portrait = cube.damper.portrait(restitution=0.3)
    assert len(portrait.axes) == 3
    # What a notebook asks for; it knows by itself how to show figures of pyplot only.
    assert portrait._repr_png_().startswith(b"\x89PNG")
    assert cube.damper.orbit(restitution=0.3).stable
    assert (
        repr(cube.damper)
        == "<cube.damper: bifurcation, map, curves, run, history, portrait, orbit>"
    )


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


@pytest.mark.parametrize(
    ("axis", "there", "beyond"),
    [
        ([0.1, 0.2, 0.5], {0.06: 0.1, 0.31: 0.2, 0.64: 0.5}, [0.04, 0.66]),
        ([1e-1, 1e-3, 1e-2], {4e-4: 1e-3, 4e-3: 1e-2, 0.3: 0.1}, [3e-4, 0.32]),
        ([0.3], {0.3: 0.3, 0.1 + 0.2: 0.3}, [0.300001]),
    ],
    ids=["uneven", "logarithmic", "one value"],
)
def test_a_point_is_at_most_half_a_step_away(
    axis: list[float], there: dict[float, float], beyond: list[float]
) -> None:
    given = CHAOS | {"mass_ratio": axis, "restitution": 0.5, "transient": 0, "periods": 1}
    cube = damper.simulate(**given, observers=["impacts"])
    for asked, found in there.items():
        near = pytest.warns(UserWarning, match=f"mass_ratio = {asked!r} .* {found!r}, is taken")
        with nullcontext() if found == pytest.approx(asked, rel=1e-12) else near:
            assert cube.damper.run(mass_ratio=asked).parameters.mass_ratio == found
    for asked in beyond:
        ends = f"{min(axis):g} to {max(axis):g}; the nearest value is "
        nearest = min(axis) if asked < min(axis) else max(axis)
        with pytest.raises(ValueError, match=f"mass_ratio = {asked}: .*{ends}{nearest}"):
            cube.damper.history(mass_ratio=asked)


SAID = ["observers", "primary_starts", "transient_periods", "recorded_periods", "accuracy"]
SAID += ["max_events", "forcing", "followed", "masses"]


@pytest.mark.parametrize("name", SAID)
def test_an_attribute_that_a_cube_has_lost_is_named(cube: xr.Dataset, name: str) -> None:
    others = {key: value for key, value in cube.attrs.items() if key != name}
    # An empty start is that of runs from a given state.
    damages = [
        {name: value} for value in ([1.0], "nonsense", "" if name != "primary_starts" else 3)
    ]
    for damage in [*damages, *([{}] if name in cube.attrs else [])]:
        damaged = cube.drop_attrs().assign_attrs(others | damage)
        words = "does not say how its points were run: make it by .* "
        with pytest.raises(ValueError, match=rf"{words}\(its attribute '{name}' is"):
            recorded(damaged)
    with pytest.raises(ValueError, match="its attribute 'forcing' is"):
        recorded(cube.assign_attrs(forcing='{"kind": "forse"}'))
    older = '{"stroboscopic_section": {"at": 0.5}}'  # its `when`, in an earlier version
    with pytest.raises(ValueError, match="its attribute 'observers' is"):
        recorded(cube.assign_attrs(observers=older))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"rowz": "clearance"}, "unknown key 'rowz'.*did you mean 'rows'"),
        ({"variables": ["displacment"]}, "value: 'displacment'.*did you mean 'displacement'"),
        ({"variables": "displacement"}, "variables: must be a list.*must be list of"),
    ],
)
def test_settings_of_a_figure_that_are_none_are_refused(
    cube: xr.Dataset, settings: dict, message: str
) -> None:
    with pytest.raises(ValueError, match=f"(?s){message}"):
        cube.damper.bifurcation("restitution", **settings)


@pytest.mark.parametrize(
    "force",
    [
        damper.NoForce(),
        damper.Harmonics((1, 2), (1.0, 0.4)),
        damper.Base("base"),
        damper.Noise(3, 0.1, 150.0, (0.2, 2.0)),
    ],
    ids=lambda force: force.kind,
)
def test_a_point_of_a_cube_moves_under_the_force_of_the_cube(tmp_path: Path, force: Any) -> None:
    """Also after a file: as the cube found it, and as a run of the same parameters."""
    given = CHAOS | {"restitution": [0.4, 0.5], "initial_velocity": 2.0, "forcing": force}
    observers = {"stroboscopic_section": {}, "bursts": {}}
    cube = damper.simulate(**given, transient=3, periods=4, observers=observers)
    write_cube(cube, tmp_path / "cube.nc")
    with xr.open_dataset(tmp_path / "cube.nc") as back:
        found = back.damper.run(restitution=0.5)
    assert found.parameters == damper.Parameters(**CHAOS | {"restitution": 0.5, "forcing": force})
    assert found.cube.displacement.values.tolist() == cube.displacement[1].values.tolist()
    other, _ = damper_at(cube.sel(restitution=0.4))
    with pytest.raises(ValueError, match=r"^forcing = "):
        reduced_gap(other)


def test_a_cube_does_not_hold_the_samples_of_a_record() -> None:
    record = damper.Record([0.0, 1.0, 30.0], [0.0, 1.0, 0.0])
    cube = damper.simulate(**CHAOS, restitution=0.5, transient=1, periods=2, forcing=record)
    with pytest.raises(ValueError, match=r"^forcing: its 3 samples are not kept"):
        cube.damper.run()


def test_orbits_over_a_diagram() -> None:
    point = {"mass_ratio": 0.1, "damping_ratio": 0.1, "frequency_ratio": 1.0, "restitution": 0.5}
    cube = damper.simulate(**point, clearance=[4.8, 5.0, 5.2], transient=200, periods=5)
    figure = cube.damper.bifurcation(
        "clearance", variables=["displacement"], orbits={"two impacts": {"start": 5.0}}
    )
    (ax,) = figure.axes
    (line,) = (line for line in ax.lines if line.get_color() == THEORY)
    orbit = damper.periodic_orbit(damper.Parameters(**point, clearance=5.0))
    there = np.interp(5.0, *np.transpose(sorted(line.get_xydata().tolist())))
    assert there == pytest.approx(orbit.start[0], abs=1e-3)
    assert "periodic motion, stable" in {text.get_text() for text in figure.legends[0].get_texts()}
    with pytest.raises(ValueError, match="start"):
        cube.damper.bifurcation("clearance", orbits={"two impacts": {}})
