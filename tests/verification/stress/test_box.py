"""The points of the stress study: all corners, and random ones that are the same everywhere."""

import math

import pytest

from damper.engine.compiled import plain
from damper.engine.segment import CAUSE, GAP, GAP_RATE, IMPACT, SPEED
from damper.models import start_run
from damper.sweep.points import read_point
from damper.verification.stress.box import STARTS, corners, part, random_points, start_of

VALUES = {
    "mass_ratio": [1e-6, 0.3],
    "damping_ratio": [0.0, 10.0],
    "frequency_ratio": [1.0],
    "clearance": [0.0, 1e-12, 1.0],
    "restitution": [0.0, 1.0],
}
BOX = {
    "share": 0.25,
    "parameters": {
        "mass_ratio": {"range": [1e-6, 1e3], "values": [1e-6, 1e18]},
        "damping_ratio": {"range": [1e-6, 10.0], "values": [0.0]},
        "frequency_ratio": {"range": [1e-3, 1e3]},
        "clearance": {"range": [1e-6, 1e3]},
        "restitution": {"range": [0.0, 1.0], "values": [0.0, 1.0]},
        "initial_position": [-1.0, 1.0],
    },
    "models": {
        "grounded": {
            "share": 0.2,
            "parameters": {"support_stiffness_ratio": {"range": [1e-3, 1.0]}},
        }
    },
}


#: Run 0 of seed 7.
FIRST = {
    "mass_ratio": 0.000195609,
    "damping_ratio": 1.78466e-06,
    "frequency_ratio": 136.533,
    "clearance": 1.60252e-06,
    "restitution": 0.0,
    "initial_position": -0.249243,
}


@plain
def test_corners_are_the_whole_product_and_can_be_read():
    points = corners(VALUES)
    assert len(points) == 2 * 2 * 3 * 2 * len(STARTS)
    assert len({tuple(sorted(point.items())) for point in points}) == len(points)
    for name, values in VALUES.items():
        assert {point[name] for point in points} == set(values)
    for point in points:
        point = read_point(point)
        start_run(point.parameters, point.start())


@plain
def first_row(start, clearance):
    point = {
        "mass_ratio": 0.3,
        "damping_ratio": 0.0,
        "frequency_ratio": 1.0,
        "clearance": clearance,
        "restitution": 0.5,
    }
    point = read_point(point | start_of(start, clearance))
    point = start_run(point.parameters, point.start())
    return next(iter(point.segments(1.0, 0.0))).copy()


def test_starts_are_what_they_are_called():
    centre, wall, approaching, grazing = (first_row(name, 1.0) for name in STARTS)
    assert centre[0][GAP] == 1.0
    assert wall[0][GAP] == wall[0][GAP_RATE] == 0.0
    assert approaching[1][CAUSE] == IMPACT
    assert approaching[1][SPEED] == 1.0
    # It comes within a hundredth of a percent of the wall without momentum to speak of.
    gap, rate = grazing[0][GAP], grazing[0][GAP_RATE]
    assert rate == pytest.approx(-math.sqrt(2.0 * gap), rel=1e-7)
    assert gap == pytest.approx(1e-8, rel=1e-6)


def test_random_points_are_those_of_their_seed_and_number():
    points = random_points(40, 7, BOX)
    assert points[0] == random_points(1, 7, BOX)[0]
    assert points[30:] == random_points(10, 7, BOX, first=30)
    assert points != random_points(40, 8, BOX)
    # Written down, so that another platform or version is seen to draw the same.
    assert points[0] == FIRST


def test_random_points_fill_the_box():
    points = random_points(2000, 1, BOX)
    masses = [point["mass_ratio"] for point in points]
    edges = sum(mass in (1e-6, 1e18) for mass in masses)
    assert 400 < edges < 600
    inside = [math.log10(mass) for mass in masses if mass not in (1e-6, 1e18)]
    assert -6.0 <= min(inside) < -5.9
    assert 2.9 < max(inside) <= 3.0
    assert -1.7 < sum(inside) / len(inside) < -1.3
    assert 340 < sum("support_stiffness_ratio" in point for point in points) < 460
    for point in points[:200]:
        read_point(point)


def test_parts_make_up_the_whole():
    points = list(range(10))
    parts = [part(points, number, 3) for number in range(3)]
    assert sorted(point for some in parts for point in some) == points
    assert max(map(len, parts)) - min(map(len, parts)) <= 1
