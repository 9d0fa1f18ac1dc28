"""Restitution that falls with the approach speed: r (v_y / v)^p above the yield speed v_y."""

from typing import Any

import numpy as np
import pytest
from scenes import GENERIC

from damper import simulate

SCENE = GENERIC | {"phase": 0.0}
#: The models with rigid walls.
MODELS: dict[str, dict[str, float]] = {
    "rigid": {},
    "grounded": {"support_stiffness_ratio": 0.01, "support_damping_ratio": 0.001},
    "time_varying": {"modulation_depth": 0.2, "modulation_order": 2},
}
IMPACT = 0


def restitution(r: float, yield_speed: float, speed: Any, exponent: float = 0.25) -> Any:
    """The law a second time."""
    return r * np.minimum(1.0, yield_speed / speed) ** exponent


@pytest.mark.parametrize(
    ("model", "exponent"), [*((model, 0.25) for model in MODELS), ("rigid", 0.1), ("rigid", 1.0)]
)
def test_momentum_and_restitution_at_each_impact(model: str, exponent: float) -> None:
    """From the states before and after each impact that the trajectory lists."""
    yields = 0.3 if exponent == 0.25 else 1.2
    scene = {**SCENE, **MODELS[model], "yield_speed": yields, "yield_exponent": exponent}
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
    expected = restitution(0.6, yields, speed, exponent)
    assert np.max(abs(ratio - expected) * speed / size) < 1e-14
    assert np.count_nonzero(speed > yields) > 10
    assert np.count_nonzero(speed < yields) > 10
