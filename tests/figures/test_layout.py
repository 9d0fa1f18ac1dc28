"""What all figures share: selection, labels, scales, legends."""

import numpy as np
import pytest
from figures.drawing import made_up

from damper.analysis.optimum import least
from damper.figures.common.layout import select

AXES = {"mass_ratio": [0.1, 0.2], "clearance": [0.5, 1.0, 1.5]}
DIRECTIONS = {"direction": ["up", "down"]}


def test_selection_keeps_what_is_shown_and_squeezes_the_rest() -> None:
    cube = made_up({**AXES, "restitution": [0.5]}, DIRECTIONS, chatter=1)
    place = select(cube, ["chatter"], {"mass_ratio": 0.2, "direction": "up"}, ("clearance", None))
    assert place.chatter.dims == ("clearance",)
    assert (place.mass_ratio, place.restitution, place.direction) == (0.2, 0.5, "up")
    # A parameter that is the same throughout may be given as well.
    at = {"restitution": 0.5, "damping_ratio": 0.02}
    select(cube, ["chatter"], at, ("mass_ratio", "clearance", "direction"))


@pytest.mark.parametrize(
    ("variable", "at", "keep", "words"),
    [
        ("chater", {}, (), r"unknown variable 'chater' \(did you mean 'chatter'\?\): must"),
        ("chatter", {}, ("gap",), r"unknown axis 'gap': must be one of mass_ratio, clearance"),
        ("chatter", {}, ("mass_ratio",), r"clearance has 3 values but no place.*'clearance': 0.5"),
        (
            "chatter",
            {"clearance": 1.8},
            (),
            r"clearance = 1.8: outside .* 0.5 to 1.5; .* 1.5",
        ),
        ("chatter", {"gap": 1.0}, (), r"no axis 'gap' with 1.0: must be one of mass_ratio"),
        ("chatter", {"restitution": 0.7}, (), r"no axis 'restitution' with 0.7"),
        ("chatter", {"direction": "left"}, (), r"direction = 'left': must be one of up, down"),
        ("chatter", {}, ("mass_ratio", "clearance"), r"direction has 2 values"),
    ],
)
def test_selection_tells_what_is_wrong(
    variable: str, at: dict[str, object], keep: tuple[str, ...], words: str
) -> None:
    cube = made_up(AXES, DIRECTIONS, chatter=1)
    with pytest.raises(ValueError, match=words):
        select(cube, [variable], at, keep)


def test_least_of_nearly_equal_values_is_the_first() -> None:
    assert least(np.array([2.0, 1.0 + 1e-9, 1.0, 1.5])) == 1
    assert least(np.array([2.0, 1.1, 1.0])) == 2
    assert least(np.array([np.inf, np.inf])) == 0
    assert least(np.array([0.0, -1.0, -1.0])) == 1
