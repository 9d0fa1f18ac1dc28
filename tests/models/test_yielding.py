"""Restitution that falls with the approach speed: r (v_y / v)^(1/4) above the yield speed v_y.

Plain where each model would compile for one short run; the bytes are the same.
"""

from typing import Any

import numpy as np
import pytest
from event_pairs import assert_same
from scenes import GENERIC

from damper import Parameters, State, events, simulate
from damper.engine.compiled import plain
from damper.verification.reference import exact_run

SCENE = GENERIC | {"phase": 0.0}
#: The models with rigid walls.
MODELS: dict[str, dict[str, float]] = {
    "rigid": {},
    "grounded": {"support_stiffness_ratio": 0.01, "support_damping_ratio": 0.001},
    "time_varying": {"modulation_depth": 0.2, "modulation_order": 2},
}
IMPACT, STICK = 0, 1


def restitution(r: float, yield_speed: float, speed: Any) -> Any:
    """The law a second time."""
    return r * np.minimum(1.0, yield_speed / speed) ** 0.25


@pytest.mark.parametrize(
    ("change", "yield_speed", "until"),
    [
        ({}, 0.3, 13.0),
        ({"mass_ratio": 1e-6}, 1e-3, 10.0),
        ({"mass_ratio": 30.0, "restitution": 1.0}, 0.1, 25.0),
    ],
    ids=["generic", "light", "heavy"],
)
def test_events_are_those_of_many_digits(
    change: dict[str, float], yield_speed: float, until: float
) -> None:
    """Generic and light with chatter sequences across the yield speed, sticking and release."""
    scene = {**SCENE, **change}
    values = {**scene, "yield_speed": yield_speed}
    found = events(Parameters(**values), until=until)
    assert_same(found, exact_run(values, until=until, digits=25).events, 1e-11)
    assert (found["approach_speed"] > yield_speed).sum() >= 4
    if scene["restitution"] < 1.0:
        assert set(found["kind"]) == {0, 1, 2}


@pytest.mark.parametrize("model", MODELS)
@plain
def test_momentum_and_restitution_at_each_impact(model: str) -> None:
    """From the states before and after each impact that the trajectory lists."""
    scene = {**SCENE, **MODELS[model], "yield_speed": 0.3}
    # Nothing but events, two rows each.
    seen = {"trajectory": {"samples_per_period": 1, "events": 10_000}}
    cube = simulate(**scene, transient=0, periods=20, observers=seen)
    rows = np.flatnonzero(cube.trajectory_event.values == IMPACT)
    before, after = rows[::2], rows[1::2]
    time, v, u = (
        cube[f"trajectory_{name}"].values for name in ("time", "velocity", "free_velocity")
    )
    np.testing.assert_array_equal(time[before], time[after])
    mass = scene["mass_ratio"] * (
        1.0 + scene.get("modulation_depth", 0.0) * np.cos(0.4 * time[before])
    )
    speed = abs(u[before] - v[before])
    size = 1.0 + abs(v[before]) + abs(u[before])
    lost = v[after] - v[before] + mass * (u[after] - u[before])
    assert np.max(abs(lost) / size) < 1e-14
    ratio = -(u[after] - v[after]) / (u[before] - v[before])
    expected = restitution(0.6, 0.3, speed)
    assert np.max(abs(ratio - expected) * speed / size) < 1e-14
    assert np.count_nonzero(speed > 0.3) > 10
    assert np.count_nonzero(speed < 0.3) > 10


@plain
def test_sequence_below_the_yield_speed_completes_as_with_constant_restitution() -> None:
    scene = {**SCENE, "clearance": 0.3}
    found = events(Parameters(**scene, yield_speed=0.3), until=60.0)
    stick = int(np.flatnonzero(found["kind"] == STICK)[0])
    slow = stick - 1
    while found[slow]["kind"] == IMPACT and found[slow]["approach_speed"] <= 0.3:
        slow -= 1
    first = found[slow + 1]
    side, rebound = first["side"], 0.6 * first["approach_speed"]
    state = State(
        first["x"], first["v"], first["x"] + side * 0.3, first["v"] - side * rebound, first["time"]
    )
    until = found[stick]["time"] + 0.01
    same = events(Parameters(**scene), state, until=until)
    rest = found[slow + 2 : stick + 1]
    assert len(rest) >= 10
    np.testing.assert_array_equal(same["kind"], rest["kind"])
    for name in ("time", "x", "v", "approach_speed"):
        np.testing.assert_allclose(same[name], rest[name], rtol=0, atol=2e-12)


@pytest.mark.parametrize("model", MODELS)
@plain
def test_high_yield_speed_changes_no_byte(model: str) -> None:
    plain = events(Parameters(**SCENE, **MODELS[model]), until=100.0)
    high = events(Parameters(**SCENE, **MODELS[model], yield_speed=1e300), until=100.0)
    assert len(plain) > 50
    assert high.tobytes() == plain.tobytes()
