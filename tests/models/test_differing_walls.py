"""Walls of different restitution: `restitution` of the right, `restitution_left` of the left."""

from dataclasses import replace

import numpy as np
import pytest

from damper import Parameters, continue_orbit, periodic_orbit
from damper.theory.accumulation import predict

#: Two impacts a period.
TWO_IMPACTS = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.1,
    "frequency_ratio": 1.0,
    "clearance": 5.0,
    "restitution": 0.5,
}
ORBIT = Parameters(**TWO_IMPACTS, restitution_left=0.6)


@pytest.mark.parametrize("name", ["restitution", "restitution_left"])
def test_how_an_orbit_changes_with_each_wall(name: str) -> None:
    """Against the orbits beside it; with both walls alike too, where its mirror image is another
    damper's."""
    for p in (ORBIT, replace(ORBIT, restitution_left=0.5)):
        orbit, step = periodic_orbit(p), 1e-4
        beside = []
        for way in (step, -step, 2.0 * step, -2.0 * step):
            other = replace(p, **{name: getattr(p, name) + way})
            state = periodic_orbit(other, state=orbit.state).state
            beside.append(np.array([state.x, state.v, state.y, state.u]))
        near, far = beside[0] - beside[1], beside[2] - beside[3]
        known = (8.0 * near - far) / (12.0 * step)
        np.testing.assert_allclose(orbit.sensitivity(name), known, atol=1e-7 * abs(known).max())


def test_symmetry_breaks_between_equal_walls_alone() -> None:
    """Elsewhere the same damper with its walls exchanged has the other half of the fork."""
    kinds = {}
    for left in (0.5, 0.5001):
        orbit = periodic_orbit(replace(ORBIT, restitution_left=left))
        branch = continue_orbit(orbit, "clearance", 4.55, 5.05)
        kinds[left] = [point.kind for point in branch.special_points]
    assert kinds[0.5] == ["symmetry breaking"]
    assert "symmetry breaking" not in kinds[0.5001]


def test_the_prediction_of_a_sequence_takes_its_own_wall() -> None:
    known = Parameters(0.5, 0.2, 0.3, 0.5, 0.6)
    left = replace(known, restitution=0.2, restitution_left=0.6)
    assert predict(left, -1, 2.0, -2.0, -0.1, 0.01) == predict(known, -1, 2.0, -2.0, -0.1, 0.01)
    with pytest.raises(ValueError, match=r"restitution_left = 1\.0: must be"):
        predict(replace(left, restitution_left=1.0), -1, 2.0, -2.0, -0.1, 0.01)
