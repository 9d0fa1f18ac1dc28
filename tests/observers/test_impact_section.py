"""Samples on an impact section are rows of `damper.events`, bit for bit."""

import numpy as np
import pytest
from plain_bursts import Scene
from scenes import STUDY

from damper.sweep.runs import run_points

SIDE = {"left": -1, "right": 1}


def observed(scene: Scene, **settings: object) -> dict[str, np.ndarray]:
    """Results of the observer for one run."""
    arrays, _ = run_points([scene.parameters], {"impact_section": settings}, **scene.run())
    return {name: array[0] for name, array in arrays.items()}


@pytest.mark.parametrize("wall", ["left", "right"])
@pytest.mark.parametrize(("restitution", "transient"), [(0.0, 9), (0.7, 0)])
def test_samples_are_impact_rows_of_one_wall(restitution: float, wall: str, transient: int) -> None:
    run = Scene({**STUDY, "restitution": restitution}, transient, 15)
    rows = run.rows()
    rows = rows[(rows["time"] >= run.start) & (rows["kind"] == 0) & (rows["side"] == SIDE[wall])]
    found = observed(run, wall=wall, samples=60, free_mass=True)
    taken = min(len(rows), 60)
    assert taken > 10
    rows = rows[:taken]
    np.testing.assert_array_equal(found["displacement"][:taken], rows["x"])
    np.testing.assert_array_equal(found["velocity"][:taken], rows["v"])
    # The free mass is at the wall and leaves it with the restituted speed.
    y = rows["x"] + SIDE[wall] * STUDY["clearance"]
    u = rows["v"] - SIDE[wall] * restitution * rows["approach_speed"]
    np.testing.assert_allclose(found["free_displacement"][:taken], y, rtol=0, atol=1e-14)
    np.testing.assert_allclose(found["free_velocity"][:taken], u, rtol=0, atol=1e-14)
    for array in (found[name] for name in found if name != "status"):
        assert array.shape == (60,)
        assert np.isnan(array[taken:]).all()


def test_walls_differ_and_right_is_the_default() -> None:
    run = Scene(STUDY, 5, 10)
    default, right = observed(run), observed(run, wall="right")
    np.testing.assert_array_equal(default["displacement"], right["displacement"])
    left = observed(run, wall="left")
    assert not np.array_equal(left["displacement"], right["displacement"], equal_nan=True)
    assert default["displacement"].shape == (100,)


def test_free_mass_is_recorded_only_if_asked_for() -> None:
    assert set(observed(Scene(STUDY, 0, 2))) == {"status", "displacement", "velocity"}


def test_no_impact_no_sample() -> None:
    for clearance in (0.0, 50.0):
        found = observed(Scene({**STUDY, "clearance": clearance}, 1, 4))
        assert np.isnan(found["displacement"]).all()
        assert found["status"] == 0
