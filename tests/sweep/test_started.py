"""`damper.start`: however a run is split, it is the run as a whole."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import damper
from damper.parameters.units import units_of

CHATTER = damper.Parameters(0.1, 0.05, 0.2, 0.25, 0.6)
TWO = damper.Parameters(0.1, 0.05, 0.7, 0.3, 0.6, masses=[{}, {"clearance": 0.2, "friction": 0.05}])
IN_SI = damper.SIParameters(
    primary_mass=2.0,
    free_mass=0.2,
    stiffness=800.0,
    damping=4.0,
    force_amplitude=3.0,
    forcing_frequency=19.0,
    gap=0.01,
    restitution=0.6,
)


@pytest.mark.parametrize(("scene", "until"), [(CHATTER, 60.0), (TWO, 8.0), (IN_SI, 3.0)])
@given(parts=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=6))
@settings(max_examples=5, deadline=None)
def test_a_split_run_is_the_whole_one(scene: Any, until: float, parts: list[float]) -> None:
    run, got = damper.start(scene), []
    for part in [*sorted(parts), 1.0]:
        got.append(run.advance(part * until))
    whole = damper.events(scene, until=until)
    assert run.events.tobytes() == whole.tobytes()
    assert sum(map(len, got)) == len(whole)
    assert run.time == until


@pytest.mark.parametrize("scene", [CHATTER, TWO])
def test_its_state_goes_on_elsewhere(scene: damper.Parameters) -> None:
    run = damper.start(scene, damper.State(0.1, 0.0, 0.1, 0.3, time=2.0))
    run.advance(11.0)
    there = damper.events(scene, run.state, until=30.0)
    here = run.advance(30.0)
    assert len(here) == len(there)
    assert np.abs(here["time"] - there["time"]).max() < 1e-9


def test_motion_keeps_the_free_mass_between_the_walls_and_meets_each_impact() -> None:
    run = damper.start(CHATTER)
    impacts = run.advance(40.0)
    impacts = impacts[impacts["kind"] == damper.IMPACT]
    motion = run.motion(np.linspace(0.0, 40.0, 400))
    apart = motion.free_displacement - motion.displacement
    assert float(abs(apart).max()) <= 0.25 * (1.0 + 1e-12)
    at = run.motion(impacts["time"])
    assert np.allclose(at.displacement, impacts["x"], rtol=0.0, atol=1e-12)
    touched = impacts["side"] * 0.25
    assert np.allclose(at.free_displacement - at.displacement, touched, rtol=0.0, atol=1e-12)


def test_motion_of_several_masses_is_theirs() -> None:
    run = damper.start(TWO)
    run.advance(20.0)
    motion = run.motion(20.0)
    assert motion.free_displacement.dims == ("time", "body")
    assert motion.free_displacement.values[0].tolist() == list(run.state.y)


ONE_MODE = damper.Structure.from_modes([3.0], [0.02], {"tip": [1.0], "force": [1.0]})
ON_BASE = damper.Parameters(0.1, 0.05, 0.7, 0.3, 0.6, forcing="base")
OF_A_MODE = damper.SIParameters(
    structure=ONE_MODE,
    force_amplitude=1.0,
    forcing_frequency=19.0,
    masses=[{"free_mass": 0.1, "gap": 0.01, "restitution": 0.6}],
)


@pytest.mark.parametrize(
    ("scene", "length", "speed", "time"),
    [
        (CHATTER, "F0/K", "F0/sqrt(K M)", "sqrt(M/K)"),
        (ON_BASE, "B", "B sqrt(K/M)", "sqrt(M/K)"),
        (IN_SI, "m", "m/s", "s"),
        (OF_A_MODE, "m", "m/s", "s"),
    ],
)
def test_motion_has_its_units(scene: Any, length: str, speed: str, time: str) -> None:
    motion = damper.start(scene).motion(0.0)
    got = {str(name): units_of(variable.attrs) for name, variable in motion.variables.items()}
    of_masses = {"free_displacement": length, "free_velocity": speed}
    assert got.items() >= {"displacement": length, "velocity": speed, "time": time}.items()
    assert got.items() >= of_masses.items()
    assert got.get("mode_energy", "J") == "J"


def test_it_says_where_it_stopped_early() -> None:
    run = damper.start(CHATTER, max_events=3)
    found = run.advance(40.0)
    assert found["kind"][-1] == damper.STOPPED
    assert run.time == found["time"][-1] < 40.0
    with pytest.raises(ValueError, match="stopped early"):
        run.advance(41.0)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda run: run.advance(1.0), "must be >= 5.0, the time reached"),
        (lambda run: run.advance(math.nan), "must be a finite time"),
        (lambda run: run.advance(1e300), "at most"),
        (lambda run: run.motion([1.0, 6.0]), "6.0 is outside the run, 0.0 to 5.0"),
        (lambda run: run.motion(math.nan), "outside the run"),
        (lambda run: run.motion([[1.0, 2.0]]), r"one-dimensional, not of shape \(1, 2\)"),
    ],
)
def test_times_outside_are_refused(call: Any, said: str) -> None:
    run = damper.start(CHATTER)
    run.advance(5.0)
    with pytest.raises(ValueError, match=said):
        call(run)
    assert run.time == 5.0


def test_it_says_which_masses_stick() -> None:
    run, last = damper.start(CHATTER), 0
    for until in np.linspace(1.0, 60.0, 30).tolist():
        found = run.advance(until)["kind"]
        last = found[-1] if len(found) else last
        assert run.sticking == (last == damper.STICK,)
    one = damper.start(TWO, damper.State(0.0, 0.0, (-0.3, 0.0), 0.0))
    one.advance(0.1)
    assert one.sticking == (True, False)
