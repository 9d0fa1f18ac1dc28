"""Walls of different restitution: `restitution` of the right one, `restitution_left` of the left.

Plain where each case would compile for one short run; the bytes are the same.
"""

from dataclasses import replace

import numpy as np
import pytest
from event_pairs import assert_same
from forced_scenes import MODELS, assert_first_ones_agree
from scenes import QUIET

from damper import Parameters, State, continue_orbit, events, periodic_orbit, simulate
from damper.engine.compiled import plain
from damper.theory.accumulation import predict
from damper.verification.reference import exact_run

#: What may be given beside walls that differ.
BESIDES = {name: values for name, values in MODELS.items() if name != "sliding"}
each = pytest.mark.parametrize("name", BESIDES)
IMPACT, STICK, RELEASE = 0, 1, 2
#: Two impacts a period.
TWO_IMPACTS = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.1,
    "frequency_ratio": 1.0,
    "clearance": 5.0,
    "restitution": 0.5,
}
ORBIT = Parameters(**TWO_IMPACTS, restitution_left=0.6)


def random_scene(name: str, rng: np.random.Generator) -> tuple[dict[str, float], State]:
    """A slow force, so that chatter completes on both walls, from a state in flight."""
    values = {
        "mass_ratio": 10 ** rng.uniform(-2.0, -0.3),
        "damping_ratio": 10 ** rng.uniform(-2.0, -0.5),
        "frequency_ratio": rng.uniform(0.15, 0.3),
        "clearance": rng.uniform(0.03, 0.15),
        "restitution": rng.uniform(0.05, 0.6),
        "restitution_left": rng.uniform(0.05, 0.6),
        "phase": rng.uniform(0.0, 6.0),
    }
    x, v = rng.uniform(-0.5, 0.5, size=2)
    y = x + values["clearance"] * rng.uniform(-0.9, 0.9)
    return values | BESIDES[name], State(x, v, y, v + rng.uniform(-0.3, 0.3))


@pytest.mark.parametrize(
    ("name", "scenes"), [("rigid", 8), ("yielding", 3), ("grounded", 3), ("time_varying", 3)]
)
@plain
def test_events_are_those_of_many_digits(name: str, scenes: int) -> None:
    rng = np.random.default_rng([7, scenes])
    kinds: set[tuple[int, int]] = set()
    for _ in range(scenes):
        values, state = random_scene(name, rng)
        found = events(Parameters(**values), state, until=40.0)
        exact = exact_run(values, (state.x, state.v, state.y, state.u), until=40.0, digits=25)
        assert_same(found, exact.events, 5e-11)
        kinds |= {(int(row["kind"]), int(row["side"])) for row in found}
    assert kinds == {(kind, side) for kind in (IMPACT, STICK, RELEASE) for side in (-1, 1)}


compliant = pytest.mark.parametrize("name", ["compliant", "tension"])


@compliant
@pytest.mark.parametrize("gravity", [0.0, 0.2])
@plain
def test_compliant_walls_are_those_of_many_digits(name: str, gravity: float) -> None:
    rng = np.random.default_rng(8)
    for _ in range(3):
        values, state = random_scene(name, rng)
        values["gravity"] = gravity
        assert_first_ones_agree((values, (state.x, state.v, state.y, state.u)))


@compliant
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
