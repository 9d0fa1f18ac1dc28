"""What all figures share: selection, labels, scales, legends."""

import numpy as np
import pytest
from figures.drawing import made_up

from damper.analysis.optimum import least
from damper.analysis.places import geometric
from damper.figures.common.layout import edges, jumps, numbers, select, wrap

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


def test_missing_numbers() -> None:
    cube = made_up(AXES, chatter=[[0, 1, 2], [-1, 0, 0]], rms_ratio=[[0, 1, 2], [3, np.nan, 1]])
    assert np.isnan(numbers(cube.chatter, "clearance", "mass_ratio")).sum() == 1
    assert numbers(cube.chatter, "clearance", "mass_ratio").shape == (3, 2)
    assert np.isnan(numbers(cube.rms_ratio)).sum() == 2


@pytest.mark.parametrize(
    ("values", "is_geometric"),
    [
        ([1.0, 2.0, 4.0], True),
        ([1.0, 31.6227766017, 1000.0], True),
        ([1.0, 2.0, 3.0], False),
        ([1.0, 2.0], False),
        ([0.0, 0.0, 0.0], False),
        ([-1.0, -2.0, -4.0], False),
    ],
)
def test_geometric_values(values: list[float], is_geometric: bool) -> None:
    assert geometric(np.array(values)) is is_geometric


@pytest.mark.parametrize(
    "values", [[0.0, 1.0], [0.1, 0.2, 0.5], [1.0, 10.0, 100.0], [1.0, 2.0, 4.0]]
)
def test_edges_enclose_their_values(values: list[float]) -> None:
    found = edges(np.array(values))
    assert len(found) == len(values) + 1
    assert (found[:-1] < values).all()
    assert (values < found[1:]).all()


def test_jumps_are_steps_among_flat_ones() -> None:
    x = np.linspace(0.0, 1.0, 11)
    steep = np.tanh(20.0 * (x - 0.5))  # a step beside others nearly as high
    assert jumps(np.where(x < 0.55, x, x + 1.0), 5.0, 0.02).tolist() == [6]
    assert jumps(steep, 5.0, 0.02).tolist() == jumps(x, 5.0, 0.02).tolist() == []
    assert jumps(np.where(x < 0.55, np.nan, x), 5.0, 0.02).tolist() == []


def test_least_of_nearly_equal_values_is_the_first() -> None:
    assert least(np.array([2.0, 1.0 + 1e-9, 1.0, 1.5])) == 1
    assert least(np.array([2.0, 1.1, 1.0])) == 2
    assert least(np.array([np.inf, np.inf])) == 0
    assert least(np.array([0.0, -1.0, -1.0])) == 1


def test_wrapping() -> None:
    assert wrap(["aa", "bb", "cc"], 6) == "aa bb\ncc"
    assert wrap([r"$\omega_\mathrm{a}$", "b"], 20) == r"$\omega_\mathrm{a}$ b"
    assert wrap([], 5) == ""
    assert wrap(["longer than that"], 3) == "longer than that"
