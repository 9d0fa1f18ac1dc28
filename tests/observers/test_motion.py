"""What a motion is, for motions that are known."""

import math
from typing import Any

import numpy as np
import pytest

import damper
from damper.observers.motion import in_words
from damper.parameters.forcing import Harmonics
from damper.sweep.runs import run_points

simulate = damper.simulate
TWO_IMPACTS = {"mass_ratio": 0.1, "damping_ratio": 0.1, "frequency_ratio": 1.0, "restitution": 0.5}
COUNTS = ("impacts_left", "impacts_right", "completions_left", "completions_right")


def observed(transient: int = 150, **values: float) -> tuple[int, int, tuple[int, ...]]:
    cube = simulate(**values, transient=transient, periods=40, observers=["motion"])
    counts = tuple(int(cube[f"motion_{name}"]) for name in COUNTS)
    return int(cube.motion_period), int(cube.motion_side), counts


def test_two_impacts_a_period() -> None:
    """Its mirror image is broken below clearance 4.616; a branch of orbits says so."""
    assert observed(clearance=5.0, **TWO_IMPACTS) == (1, 0, (1, 1, 0, 0))
    assert observed(300, clearance=4.4, **TWO_IMPACTS) == (1, 1, (1, 1, 0, 0))
    # Started half a period later, with both masses mirrored, the same force makes its image.
    assert observed(300, clearance=4.4, phase=np.pi, **TWO_IMPACTS) == (1, -1, (1, 1, 0, 0))


@pytest.mark.parametrize(
    ("given", "symmetric"),
    [
        ({"forcing": Harmonics((1, 3), (1.0, 0.01))}, True),
        ({"forcing": Harmonics((1, 2), (1.0, 0.01))}, False),
        ({"gravity": 1e-3}, False),
        ({"restitution_left": 0.6}, False),
    ],
    ids=["odd", "even", "gravity", "walls"],
)
def test_no_side_where_nothing_has_a_mirror_image(given: dict[str, Any], symmetric: bool) -> None:
    """The odd harmonic leaves the motion symmetric."""
    values = {"clearance": 5.0, **TWO_IMPACTS, **given}
    found, _ = run_points([values], ["motion"], transient=100, periods=10)
    words = in_words({name: array[0] for name, array in found.items()})
    assert words == "period 1, 1 impact on each wall" + ", symmetric" * symmetric


def test_complete_chatter() -> None:
    values = {"mass_ratio": 0.1, "damping_ratio": 0.02, "clearance": 0.05, "restitution": 0.3}
    assert observed(frequency_ratio=1.3, **values) == (1, 0, (0, 0, 1, 1))


def test_sticking_on_both_walls_has_a_side_too() -> None:
    """At the moments compared the free mass sticks on one wall, and half a period later on the
    other."""
    values = {"mass_ratio": 1.0, "damping_ratio": 0.01, "clearance": 0.2, "restitution": 0.1}
    sides = []
    for sign, phase in ((1, 1.5), (-1, 1.5 + np.pi)):
        start = {"initial_displacement": 2.33 * sign, "initial_relative_velocity": 0.157 * sign}
        period, side, counts = observed(frequency_ratio=0.3306, phase=phase, **start, **values)
        assert (period, counts) == (1, (0, 0, 1, 1))
        sides.append(side)
    assert sides == [1, -1]


def test_the_doubled_motion_beside_a_stop() -> None:
    """All impacts are on one wall, in one burst without an end."""
    values = {**TWO_IMPACTS, "mass_ratio": math.inf, "damping_ratio": 0.0, "frequency_ratio": 2.8}
    values |= {"clearance": 9.95, "restitution": 0.8}
    guess = damper.State(-0.28, -0.57, -10.0, 0.0)
    orbit = damper.periodic_orbit(damper.Parameters(**values), period=2, state=guess)
    observers = {"motion": {"longest": 4}}
    cube = simulate(**values, state=orbit.state, transient=0, periods=12, observers=observers)
    assert int(cube.motion_period) == int(cube.motion_impacts_left) == len(orbit.events) == 2
    assert int(cube.motion_impacts_right) == 0
    assert int(cube.motion_side) == -1


def test_a_motion_that_does_not_repeat() -> None:
    """Chaos; and what was not looked for long enough."""
    values = {"mass_ratio": 0.3, "damping_ratio": 0.02, "clearance": 0.5, "restitution": 0.7}
    cube = simulate(frequency_ratio=0.4, **values, transient=50, periods=40, observers=["motion"])
    assert int(cube.motion_period) == 0
    assert np.isnan(cube.motion_side)
    assert np.isnan(cube.motion_impacts_left)
