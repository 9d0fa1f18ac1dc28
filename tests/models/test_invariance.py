"""Runs that must have the same events: mirrored, later, in other units, with another accuracy.

For all models and forces, and at the edges of the ranges. Signs, powers of two and whole periods
are exact in floating point, so nothing but the accuracy may change a bit.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scenes import FORCES, MODELS, SEVERAL, scene_of

from damper import Parameters, SIParameters, State, events
from damper.parameters.forcing import Harmonics, Record
from damper.sweep.events import EventTable

Run = tuple[Parameters, State]
STICK = 1
#: Events of each run, and its longest time.
MOST, UNTIL = 40, 25.0
#: Values at the edges of what is allowed.
EDGES = {
    "damping_ratio": (0.0, 1.0, 1.0 - 1e-12, 10.0),
    "frequency_ratio": (1e-3, 1.0 + 1e-9, 100.0),
    "restitution": (0.0, 1e-6, 0.999999, 1.0),
    "clearance": (1e-9,),
    "mass_ratio": (1e-6, 1e3),
}
#: With the opposite force, to the last bit.
OPPOSITE = [name for name in FORCES if "harmonics" in name or "record" in name or name == "none"]
REPEATING = [name for name in FORCES if "record" not in name and name != "noise"]


@st.composite
def runs(draw: st.DrawFn, model: str, forces: list[str], **more: st.SearchStrategy[Any]) -> Run:
    """Draw a damper under one of the forces, and a start; some have an edge value."""
    force = draw(st.sampled_from(forces))
    seed = draw(st.integers(0, 10**6))
    values, (x, v, y, u) = scene_of(model, force, seed)
    edge = draw(st.sampled_from([None, *EDGES]))
    if edge:
        values[edge] = draw(st.sampled_from(EDGES[edge]))
    if values.get("contact_stiffness_ratio"):
        values["restitution"] = max(values["restitution"], 0.1)
    if edge == "clearance":  # not in the middle, where neither wall is the nearer one
        x, y = 0.0, 3e-10 if model in MODELS else [3e-10] * len(y)
    if draw(st.booleans()):
        values["gravity"] = draw(st.sampled_from([-1.0, -0.1, 0.3, 3.0]))
    if draw(st.booleans()) and model != "yielding":
        values["restitution_left"] = draw(st.sampled_from([0.1, 0.5, 1.0]))
    values |= {name: draw(value) for name, value in more.items() if name in values}
    try:
        return Parameters(**values), State(x, v, y, u)
    except ValueError:
        assume(False)
        raise


def rows(run: Run, **settings: Any) -> EventTable:
    return events(*run, **{"until": UNTIL, "max_events": MOST} | settings)


def assert_same_bits(one: EventTable, other: EventTable, **factors: float) -> None:
    """Columns are equal, once those of the first run are multiplied by their factors."""
    assert one.dtype == other.dtype
    for name in one.dtype.names:
        np.testing.assert_array_equal(one[name] * factors.get(name, 1), other[name], name)


each = pytest.mark.parametrize("model", [*MODELS, *SEVERAL])
few = settings(max_examples=6)


@each
@few
@given(data=st.data())
def test_mirrored(model: str, data: st.DataObject) -> None:
    """The opposite force, start and gravity, and the walls exchanged: the mirror image."""
    run = p, s = data.draw(runs(model, OPPOSITE))
    opposite: dict[str, Any] = {"gravity": 0.0 - p.gravity}
    if isinstance(p.forcing, Harmonics):
        negative = [-a for a in p.forcing.amplitudes]
        opposite["forcing"] = replace(p.forcing, amplitudes=negative)
    if isinstance(p.forcing, Record):
        opposite["forcing"] = replace(p.forcing, value=-p.forcing.value)
    if p.restitution_left <= 1.0:
        opposite |= {"restitution": p.restitution_left, "restitution_left": p.restitution}
    if p.masses:
        opposite["masses"] = [mirrored_mass(p, dict(own)) for own in p.masses]
    y, u = (tuple(-a for a in b) if isinstance(b, tuple) else -b for b in (s.y, s.u))
    there = rows((replace(p, **opposite), State(-s.x, -s.v, y, u)))
    assert_same_bits(rows(run), there, side=-1, x=-1, v=-1)


def mirrored_mass(p: Parameters, own: dict[str, float]) -> dict[str, float]:
    """Mirror the own values of a mass; the shared values are mirrored already."""
    right = own.get("restitution", p.restitution)
    left = own.get("restitution_left", p.restitution_left)
    exchanged = {"restitution": left, "restitution_left": right} if left <= 1.0 else {}
    pulled = {"gravity": -own["gravity"]} if "gravity" in own else {}
    return own | exchanged | pulled


@each
@few
@given(data=st.data(), power=st.sampled_from([2, 20, 40]))
def test_later(model: str, data: st.DataObject, power: int) -> None:
    """A time of 2^power cycles is exact."""
    orders = st.sampled_from([1, 2, 4])
    run = p, s = data.draw(runs(model, REPEATING, modulation_order=orders))
    periods = 2**power
    late = periods * p.cycle
    here, there = rows(run), rows((p, replace(s, time=late)), until=late + UNTIL)
    # The end of a late run is rounded: a run may hold an event more than the other.
    count = min(len(here), len(there))
    assert abs(len(here) - len(there)) <= 1
    here["cycle"] += periods
    here["time"] = here["cycle"] * p.cycle + here["time_in_cycle"]
    assert_same_bits(here[:count], there[:count])


@each
@few
@given(data=st.data(), powers=st.tuples(*[st.integers(-6, 6)] * 3))
def test_in_other_units(model: str, data: st.DataObject, powers: tuple[int, int, int]) -> None:
    """Of powers of two, those of mass and stiffness even."""
    mass, stiffness, force = powers
    driven = [name for name in FORCES if name != "none"]
    run = p, s = data.draw(runs(model, driven, force_amplitude=st.just(1.0)))
    try:
        si = SIParameters.of(p, 4.0**mass, 4.0**stiffness, 2.0**force)
    except ValueError:
        assume(False)
    units = si.units
    assert units.time == 2.0 ** (mass - stiffness)
    sizes = dict.fromkeys(("time", "time_in_cycle"), units.time)
    sizes |= {"x": units.length, "v": units.speed, "approach_speed": units.speed}
    y, u = (
        tuple(a * c for a in b) if isinstance(b, tuple) else b * c
        for b, c in ((s.y, units.length), (s.u, units.speed))
    )
    there = State(s.x * units.length, s.v * units.speed, y, u)
    assert_same_bits(rows(run), rows((si, there), until=UNTIL * units.time), **sizes)


@each
@few
@given(data=st.data(), accuracy=st.sampled_from([1e-14, 1e-8, 1e-5]))
def test_with_another_accuracy(model: str, data: st.DataObject, accuracy: float) -> None:
    """It moves the end of a complete chatter sequence by that much, and nothing before."""
    run = data.draw(runs(model, list(FORCES)))
    fine, coarse = (rows(run, accuracy=a) for a in sorted((1e-12, accuracy)))
    sticks = [np.flatnonzero(found["kind"] == STICK) for found in (fine, coarse)]
    count = min(len(fine), len(coarse))
    if len(sticks[1]):  # up to the last event of this mass before it sticks
        first = sticks[1][0]
        bodies = coarse["body"]
        before = np.flatnonzero(bodies[:first] == bodies[first])
        count = min(count, int(before.max(initial=-1)) + 1)
    assert_same_bits(fine[:count], coarse[:count])
    if all(map(len, sticks)) and not run[0].masses:
        ends = [found[k[0]] for found, k in zip((fine, coarse), sticks, strict=True)]
        assert ends[0]["side"] == ends[1]["side"]
        assert abs(ends[0]["time"] - ends[1]["time"]) <= max(accuracy, 1e-12) + 1e-13
