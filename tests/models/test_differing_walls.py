"""Walls of different restitution: `restitution` of the right one, `restitution_left` of the left.

Plain where each case would compile for one short run; the bytes are the same.
"""

from dataclasses import replace

import numpy as np
import pytest
from forced_scenes import MODELS
from scenes import QUIET

from damper import Parameters, continue_orbit, events, periodic_orbit, simulate
from damper.engine.compiled import plain
from damper.theory.accumulation import predict

#: What may be given beside walls that differ.
BESIDES = {name: values for name, values in MODELS.items() if name != "sliding"}
each = pytest.mark.parametrize("name", BESIDES)
STICK, RELEASE = 1, 2
#: Two impacts a period.
TWO_IMPACTS = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.1,
    "frequency_ratio": 1.0,
    "clearance": 5.0,
    "restitution": 0.5,
}
ORBIT = Parameters(**TWO_IMPACTS, restitution_left=0.6)


@pytest.mark.parametrize("name", ["compliant", "tension"])
@plain
def test_compliant_walls_keep_energy_volumes_and_laws(name: str) -> None:
    values = QUIET | BESIDES[name] | {"restitution_left": 0.3, "gravity": 0.1}
    watched = ["response", "lyapunov", "laws"]
    found = simulate(**values, transient=3, periods=10, observers=watched)
    assert abs(found.energy_residual) < 1e-12 * found.energy_input
    assert abs(found.lyapunov_residual) < 1e-10
    for law in ("energy_balance", "continuity", "penetration", "tensile_force"):
        assert found[law] < 1e-13, law


@each
@plain
def test_equal_values_change_no_byte(name: str) -> None:
    alike = QUIET | BESIDES[name]
    known = events(Parameters(**alike), until=100.0)
    found = events(Parameters(**alike, restitution_left=QUIET["restitution"]), until=100.0)
    assert {STICK, RELEASE} <= set(known["kind"])
    assert found.tobytes() == known.tobytes()


@pytest.mark.parametrize("name", ["restitution", "restitution_left"])
@plain
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


def test_a_motion_has_a_mirror_image_between_equal_walls_alone() -> None:
    for left, side in ((0.5, 0), (0.6, None)):
        values = TWO_IMPACTS | {"restitution_left": left}
        cube = plain(simulate)(**values, transient=150, periods=10, observers=["motion"])
        assert int(cube.motion_period) == 1
        assert (None if np.isnan(cube.motion_side) else int(cube.motion_side)) == side


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
