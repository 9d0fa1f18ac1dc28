"""Random branches: what they must have in common, wherever they go."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from cases import thinned

import damper
from damper.parameters import Parameters
from damper.sweep.orbits.branch import Branch, SpecialPoint

MODELS = ("rigid", "compliant", "grounded")
#: Special points at which the parameter may turn.
TURNS = ("fold", "grazing", "complete chatter")
CROSSED = ("symmetry breaking", "period doubling")


@dataclass(frozen=True)
class Scene:
    """A damper that does something, and the range of one of its parameters."""

    orbit: damper.PeriodicOrbit
    along: str
    ends: tuple[float, float]

    def follow(self, orbit: damper.PeriodicOrbit) -> Branch:
        return damper.continue_orbit(orbit, self.along, *self.ends, max_orbits=60)


def scene(number: int) -> Scene | None:
    """The random damper of a number; None where it has not settled from rest, or hits nothing."""
    draw = np.random.default_rng([25, number])
    omega, zeta = draw.uniform(0.5, 2.0), 10.0 ** draw.uniform(-2.3, -0.7)
    amplitude = 1.0 / np.hypot(1.0 - omega**2, 2.0 * zeta * omega)
    values: dict[str, Any] = {
        "mass_ratio": 10.0 ** draw.uniform(-2.0, -0.3),
        "damping_ratio": zeta,
        "frequency_ratio": omega,
        "clearance": amplitude * 10.0 ** draw.uniform(-1.5, 0.3),
        "restitution": draw.uniform(0.2, 0.8),
    }
    model = MODELS[number % 3]
    if model == "compliant":
        values["contact_stiffness_ratio"] = 10.0 ** draw.uniform(1.0, 5.0)
    if model == "grounded":
        values["support_stiffness_ratio"] = values["mass_ratio"] * 10.0 ** draw.uniform(-2.0, 0.5)
        values["support_damping_ratio"] = values["mass_ratio"] * draw.choice([0.0, 0.05])
    along = str(draw.choice(["clearance", "restitution", "frequency_ratio"]))
    ends = values[along] * draw.uniform(0.8, 0.95), values[along] * draw.uniform(1.05, 1.2)
    try:
        orbit = damper.periodic_orbit(Parameters(**values), settle=100)
    except ValueError:
        return None
    return Scene(orbit, along, ends) if orbit.events.size else None


def check(branch: Branch, ends: tuple[float, float]) -> None:
    """Every turn is a listed special point of its own, and none of these is listed twice."""
    values, span = branch.values, ends[1] - ends[0]
    size = max(abs(orbit.start).max() for orbit in branch.orbits)
    left = [point for point in branch.special_points if point.kind in TURNS]

    def apart(point: SpecialPoint, orbit: damper.PeriodicOrbit, value: float) -> float:
        off = abs(point.orbit.start - orbit.start).max() / size
        return float(off + abs(point.value - value) / span)

    for before, value, after, orbit in zip(
        values[:-2], values[1:-1], values[2:], branch.orbits[1:-1], strict=True
    ):
        way = np.sign(value - before)
        if way * (after - value) < 0.0:
            # It lies beyond the last orbit before it, no farther than a corner is looked for.
            beyond = [way * (point.value - value) / span for point in left]
            near = [p for p, ahead in zip(left, beyond, strict=True) if -1e-7 < ahead < 0.06]
            assert near, f"the parameter turns at {value!r}, {orbit.word}: {branch}"
            left.remove(min(near, key=lambda point: apart(point, orbit, value)))
    for k, point in enumerate(branch.special_points):
        for other in branch.special_points[:k]:
            same = point.kind == other.kind and abs(point.value - other.value) < 1e-8 * span
            assert not same or apart(point, other.orbit, other.value) > 1e-6, (point, other)


@pytest.mark.parametrize("number", thinned(range(200), lambda number: number in (7, 9)))
def test_random_branch(number: int) -> None:
    """It turns at special points alone, each listed once, and so do the branches that cross it.

    These end where they meet it.
    """
    given = scene(number)
    if given is None:
        pytest.skip("no motion from rest with an impact")
    branch = given.follow(given.orbit)
    check(branch, given.ends)
    for point in [point for point in branch.special_points if point.kind in CROSSED][:2]:
        crossing = given.follow(branch.switch(point))
        check(crossing, given.ends)
        meetings = [end for end in crossing.ends if end.startswith("meets")]
        places = [float(end.split("= ")[1].split(",")[0]) for end in meetings]
        off = min(abs(np.array(places) - point.value), default=np.inf)
        assert off < 1e-5 * point.value, crossing.ends
