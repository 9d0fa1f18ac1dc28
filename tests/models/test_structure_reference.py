"""The reference of structures against that of one oscillator, and against published numbers."""

import math

import numpy as np
import pytest
from cases import thinned

import damper
from damper.engine.segment import EventKind
from damper.observers.common.laws import LAW_NAMES
from damper.verification import reference
from damper.verification.structures import exact_run

ONE = damper.Structure(1.0, 0.1, 1.0, boxes={"tip": 1.0}, force=0)


HEAVY = {"mass_ratio": 0.1, "clearance": 0.25, "restitution": 0.2, "gravity": 0.3}
OTHER = {"mass_ratio": 0.2, "clearance": 0.35, "restitution": 0.1, "gravity": 0.3}


@pytest.mark.parametrize(
    ("masses", "until"), [([HEAVY], 4.2), ([HEAVY | {"gravity": 0.4}, OTHER], 1.325)]
)
def test_one_coordinate_is_the_oscillator(masses, until):
    """Bursts end a little sooner or later: one is extrapolated, the other followed to the end."""
    values = {"damping_ratio": 0.05, "frequency_ratio": 0.8, "masses": masses} | masses[0]
    start = (0, 0, *[[0] * len(masses)] * 2)
    other = reference.exact_run(values, start, until=until, digits=30)
    own = [
        {
            "free_mass": one["mass_ratio"],
            "gap": 2.0 * one["clearance"],
            "restitution": one["restitution"],
            "gravity": one["gravity"],
        }
        for one in masses
    ]
    p = damper.SIParameters(structure=ONE, force_amplitude=1.0, forcing_frequency=0.8, masses=own)
    run = exact_run(p, until=until, digits=30)
    found, wanted = (
        [e for e in events if e.kind != "impact" or e.approach_speed > 1e-8]
        for events in (run.events, other.events)
    )
    assert {e.kind for e in found} == {"impact", "stick", "release"}
    for one, two in zip(found, wanted, strict=True):
        assert (one.kind, one.side, one.body) == (two.kind, two.side, two.body)
        for name in ("time", "approach_speed", "x", "v"):
            assert abs(getattr(one, name) - getattr(two, name)) < 1e-18


def test_free_motion_of_two_modes():
    hertz = [1.0 / (2.0 * math.pi), 2.7 / (2.0 * math.pi)]
    modes = damper.Structure.from_modes(hertz, 0.01, {"tip": [1.0, 0.6]})
    p = damper.SIParameters(
        structure=modes, forcing="none", free_mass=0.1, gap=2.0, restitution=0.6
    )
    run = exact_run(p, damper.State([2.0, 0.3], [0.0, 0.0], 2.18, 0.0), until=2.7, digits=30)
    assert [e.side for e in run.events] == [1, -1]
    found = [float(v) for e in run.events for v in (e.time, e.approach_speed)]
    wanted = [0.8654351775263009, 1.8519143280624, 2.575966985714633, 1.2355699265415]
    assert found == pytest.approx(wanted, rel=1e-13)


# --- the engine against it

MASS = [[2.0, 0.1], [0.1, 1.0]]
STIFFNESS = [[3.0, -1.0], [-1.0, 1.0]]
#: Not classical: it couples the modes.
DAMPING = [[0.25, -0.02], [-0.02, 0.05]]
BALL = {"box": "tip", "free_mass": 0.1, "gap": 1.0, "restitution": 0.6}
TIE = {"free_mass": 0.05, "gap": 0.8, "restitution": 0.5, "tie_stiffness": 0.045}
START = damper.State([2.0, 0.3], [0.0, 0.0], 2.18, 0.0)


def modes(rates, damping_ratio, **shapes):
    hertz = [rate / (2.0 * math.pi) for rate in rates]
    return damper.Structure.from_modes(hertz, damping_ratio, shapes)


def matrices(**more):
    given = {"mass": MASS, "damping": DAMPING, "stiffness": STIFFNESS, "force": 0}
    places = {"boxes": {"tip": 1, "low": 0}, "base": [1.0, 1.0]}
    return damper.Structure(**given | places | more)


def scene(structure, frequency, *masses, **more):
    given = {"force_amplitude": 1.0, "forcing_frequency": frequency}
    return damper.SIParameters(structure=structure, masses=masses, **given | more)


TWO = modes([1.0, 2.7], 0.01, tip=[1.0, 0.6], force=[1.0, 0.5])
HALL = modes([1.0, 2.7, 5.2], 0.02, tip=[1, 0.6, -0.4], low=[0.5, -1, 0.8], force=[1, 0.6, 0.3])
RUBS = BALL | {"friction_coefficient": 0.2}
LOW = {"box": "low", "free_mass": 0.3, "gap": 0.6, "restitution": 0.3, "friction_coefficient": 0.3}
THREE = modes([1.0, 6.3, 17.5], 0.02, tip=[1.0, -1.0, 1.0], force=[0.3, 0.7, 0.2])
FAR = modes([1.0, 10.0, 100.0], 0.02, tip=[1.0, 0.5, 0.2], force=[1.0, 0.3, 0.1])
NEAR = modes([1.0, 1.0 + 1e-9], 0.3, tip=[1.0, 0.7], force=[0.5, 1.0])
#: The tie has the first mode's frequency and twice the damping: joined they are nearly defective.
DEFECTIVE = modes([1.0, 2.0], 0.0, tip=[1.0, 0.0001], force=[1.0, 0.5])
PAIR = {"free_mass": 1e-4, "tie_stiffness": 1e-4, "tie_damping": 2e-6}
RIGID = {"mass": [[1, 0], [0, 1]], "stiffness": [[1, -1], [-1, 1]]}
PULSE = damper.Record([0, 1, 2, 3.5, 6, 7], [0, 1, -1, 0.7, -0.3, 0.1], of="base_acceleration")
#: Name -> parameters, start, ends of a short and of a long run.
SCENES = {
    "classical damping": (scene(TWO, 1.1, BALL), None, 4.0, 25.0),
    "free": (scene(TWO, 1.0, BALL | {"gap": 2.0}, force_amplitude=0.0), START, 3.5, 20.0),
    "other damping": (scene(matrices(), 0.8, BALL), None, 8.0, 25.0),
    "two boxes": (
        scene(
            matrices(), 0.8, BALL, {"box": "low", "free_mass": 0.2, "gap": 0.6, "restitution": 0.7}
        ),
        None,
        8.0,
        22.0,
    ),
    "tie": (scene(TWO, 1.1, BALL | TIE | {"tie_damping": 0.002}), None, 5.0, 25.0),
    "dashpot": (scene(TWO, 1.1, BALL | {"tie_damping": 0.02}), None, 4.0, 15.0),
    "sticking": (scene(THREE, 0.35, BALL | {"restitution": 0.1}, gravity=0.25), None, None, 25.0),
    "tied, sticking": (
        scene(TWO, 0.3, BALL | {"restitution": 0.1, "tie_stiffness": 0.02}, gravity=0.6),
        None,
        5.0,
        20.0,
    ),
    "far modes": (scene(FAR, 1.1, BALL | {"gap": 0.8}), None, 1.5, 12.0),
    "far modes, sticking": (
        scene(FAR, 0.4, BALL | {"restitution": 0.1}, gravity=0.3),
        None,
        None,
        8.0,
    ),
    "near modes": (scene(NEAR, 0.7, BALL | {"restitution": 0.1}, gravity=0.2), None, 6.0, 20.0),
    "near-defective tie": (scene(DEFECTIVE, 0.7, BALL | PAIR), None, 8.0, 20.0),
    "rigid-body mode": (scene(matrices(**RIGID), 1.3, BALL, force_amplitude=0.5), None, 6.0, 15.0),
    "base": (
        scene(matrices(), 0.8, BALL | {"restitution": 0.2}, BALL | TIE, forcing="base"),
        None,
        3.97,
        5.5,  # then one mass kicks the other off its wall infinitely often
    ),
    "record": (scene(matrices(), 0.8, BALL, forcing=PULSE), None, 8.0, 14.0),
    "yielding": (
        scene(TWO, 1.1, BALL | {"yield_speed": 0.3, "restitution_left": 0.4}),
        None,
        3.0,
        15.0,
    ),
    "friction": (
        scene(HALL, 0.5, RUBS, LOW, transverse_acceleration=1.0),
        None,
        4.0,
        20.0,
    ),
    "friction, other damping": (
        scene(
            matrices(),
            0.8,
            BALL | {"friction_coefficient": 0.3},
            {"box": "low", "free_mass": 0.2, "gap": 0.6, "restitution": 0.7}
            | {"friction_coefficient": 0.2, "tie_stiffness": 0.1},
            transverse_acceleration=1.0,
        ),
        None,
        8.0,
        20.0,
    ),
    "harmonics": (
        scene(TWO, 0.5, BALL, forcing=damper.Harmonics((1, 3), (1.0, 0.4))),
        None,
        6.0,
        15.0,
    ),
}
KINDS = {kind.name.lower(): int(kind) for kind in EventKind}


def assert_as_in_digits(p, state, until):
    """Impacts that are not too slow, ends of bursts and releases; those of one instant by mass."""
    found = damper.events(p, state, until=until)
    wanted = exact_run(p, state, until=until, digits=30).events
    rows = [r for r in found if r["kind"] != damper.IMPACT or r["approach_speed"] > 1e-6]
    events = [e for e in wanted if e.kind != "impact" or e.approach_speed > 1e-6]
    rows.sort(key=lambda r: (round(float(r["time"]), 9), r["body"], r["kind"]))
    events.sort(key=lambda e: (round(float(e.time), 9), e.body, KINDS[e.kind]))
    assert rows
    waiting = iter(events)
    for row in rows:
        event = next(waiting)
        # Bounces of the closed part of a burst.
        while row["kind"] == damper.STICK and event.kind in ("impact", "reversal"):
            event = next(waiting)
        assert (row["kind"], row["side"], row["body"]) == (
            KINDS[event.kind],
            event.side,
            event.body,
        )
        for name in ("time", "approach_speed", "x", "v"):
            assert abs(float(getattr(event, name)) - row[name]) < 5e-12, (name, row, event)
    assert next(waiting, None) is None


@pytest.mark.parametrize("name", [name for name, (*_, short, _) in SCENES.items() if short])
def test_events_on_a_structure(name):
    p, state, until, _ = SCENES[name]
    assert_as_in_digits(p, state, until)


@pytest.mark.exhaustive
@pytest.mark.parametrize("name", SCENES)
def test_long_runs_on_a_structure(name):
    p, state, _, until = SCENES[name]
    assert_as_in_digits(p, state, until)


@pytest.mark.parametrize(
    "name", thinned(SCENES, {"sticking", "friction, other damping"}.__contains__)
)
def test_they_keep_the_laws_of_mechanics(name):
    p, state, _, until = SCENES[name]
    window = {"transient": 0, "periods": {"time": until}}
    cube = damper.simulate(p, state=state, observers={"laws": {}}, **window)
    assert cube.segments > 5
    worst = np.nanmax([cube[law].item() for law in LAW_NAMES])
    assert worst < 3e-14
