"""Free masses in boxes of a structure, against references that share no formula with the engine."""

import math
from itertools import product
from typing import Any

import numpy as np
import pytest
from scenes import FORCES, SLOW, coupled_structure, scene_of

from damper import Parameters, SIParameters, State, Structure, events
from damper.models import model_of
from damper.parameters.forcing import NoForce, Record
from damper.verification.structures import exact_run

#: The same structures by modes and by matrices: light damping, a rigid-body mode, close modes.
BEAM = Structure.from_modes(
    [0.16, 0.43, 0.9],
    0.02,
    {"a": [1.0, 0.6, -0.3], "b": [0.4, -0.9, 0.7], "force": [1.0, 0.3, 0.5], "base": [1, 0.4, 0.2]},
)
RECORD = Record([0.0, 1.0, 2.5, 4.0, 8.0, 12.0, 20.0], [0.0, 1.0, -0.7, 0.3, -1.0, 0.5, 0.0])
HEAVY = {"box": "b", "free_mass": 0.3, "gap": 0.6, "restitution": 0.3}
TIES = {"tie_stiffness": 0.05, "tie_damping": 0.02}, HEAVY | {"tie_stiffness": 0.1}


def on(structure: Structure, *masses: dict[str, Any], **given: Any) -> SIParameters:
    values: dict[str, Any] = {"force_amplitude": 1.0, "forcing_frequency": 0.8} | given
    if values.get("forcing") == NoForce():
        del values["force_amplitude"]
    own = [{"box": "a", "free_mass": 0.1, "gap": 0.8, "restitution": 0.4} | one for one in masses]
    return SIParameters(structure=structure, masses=own, **values)


def same(found: np.ndarray, wanted: np.ndarray, error: float = 1e-11) -> None:
    assert len(wanted) > 4
    assert found["kind"].tolist() == wanted["kind"].tolist()
    for name in ("time", "approach_speed", "x", "v"):
        assert found[name] == pytest.approx(wanted[name], abs=error), name


#: Without a coefficient of its own, which `on` gives.
TABLED = {"box": "a", "free_mass": 0.1, "gap": 0.8, "restitution_table": [(0.1, 0.8), (1.0, 0.3)]}
SCENES: dict[str, tuple[SIParameters, float]] = {
    "tables": (
        SIParameters(
            structure=BEAM,
            force_amplitude=1.0,
            forcing_frequency=0.8,
            masses=[TABLED, HEAVY | {"restitution_table_left": [(0.2, 0.5), (0.6, 0.4)]}],
        ),
        8.0,
    ),
    "two boxes": (on(BEAM, {}, HEAVY), 14.0),
    "one box": (on(BEAM, {}, HEAVY | {"box": "a"}), 9.0),
    "base and gravity": (on(BEAM, {}, HEAVY, forcing="base", gravity=0.3), 12.0),
    "ties": (on(BEAM, *TIES), 14.0),
    "record": (on(BEAM, {"restitution": 0.0}, HEAVY, forcing=RECORD, force_amplitude=2.0), 16.0),
    "matrices": (on(coupled_structure(1), {"tie_damping": 0.05}, HEAVY, force_amplitude=6.0), 6.0),
}
#: Approach speed from which on each impact is one of `events`: below, tails are closed.
SEEN = 1e-2
KINDS = "impact", "stick", "release"


@pytest.mark.parametrize(
    "name", ["matrices", *(pytest.param(n, marks=pytest.mark.exhaustive) for n in [*SCENES][:-1])]
)
def test_events_agree_with_many_digits(name: str) -> None:
    p, until = SCENES[name]
    found, exact = events(p, until=until), exact_run(p, until=until, digits=20).events
    assert set(found["kind"]) == {0, 1, 2} or name == "one box"
    for row in found:
        error = min(
            abs(float(e.time - row["time"])) + abs(float(e.approach_speed - row["approach_speed"]))
            for e in exact
            if (e.kind, e.body, e.side) == (KINDS[row["kind"]], row["body"], row["side"])
        )
        assert error < 5e-11
    hits = found[(found["kind"] == 0) & (found["approach_speed"] > SEEN)]
    wanted = [e for e in exact if e.kind == "impact" and e.approach_speed > SEEN]
    assert hits["body"].tolist() == [e.body for e in wanted]
    assert hits["x"] == pytest.approx([float(e.x) for e in wanted], abs=5e-11)
    assert hits["v"] == pytest.approx([float(e.v) for e in wanted], abs=5e-11)


@pytest.mark.parametrize("name", SCENES)
def test_constants_are_numbers_of_python(name: str) -> None:
    """Code is compiled for each type of each number: NumPy's would need code of their own."""

    def numbers(constants: Any) -> list[Any]:
        if isinstance(constants, tuple):
            return [one for part in constants for one in numbers(part)]
        return [constants]

    p, _ = SCENES[name]
    found = numbers(model_of(p.dimensionless))
    assert not [one for one in found if isinstance(one, np.generic)]


def test_two_impacts_that_others_have_computed() -> None:
    """Two modes in free motion; times and speeds in 16 digits from another program."""
    modes = Structure.from_modes(
        np.array([1.0, 2.7]) / (2.0 * math.pi), 0.01, {"a": [1.0, 0.6], "force": [1.0, 0.6]}
    )
    p = on(modes, {"gap": 2.0, "restitution": 0.6}, forcing=NoForce())
    found = events(p, State([2.0, 0.3], [0.0, 0.0], 2.18, 0.0), until=3.0)
    assert found["side"].tolist() == [1, -1]
    assert found["time"] == pytest.approx([0.8654351775263009, 2.575966985714633], abs=1e-14)
    assert found["approach_speed"] == pytest.approx([1.8519143280624, 1.2355699265415], abs=1e-13)


# --- one mode is the damper of one primary mass


def one_mode(
    p: Parameters, mass: float = 1.0, length: float = 1.0, rate: float = 1.0
) -> SIParameters:
    """The same damper as a structure of one mode, in these units; other than 1 for a harmonic."""
    acceleration = length * rate**2
    structure = Structure(
        mass=[[mass]],
        damping=[[2.0 * p.damping_ratio * mass * rate]],
        stiffness=[[mass * rate**2]],
        boxes={"a": [1.0]},
        force=[1.0],
        base=[1.0],
    )
    own = [
        {
            "free_mass": one.mass_ratio * mass,
            "gap": 2.0 * one.clearance * length,
            "restitution": one.restitution,
            "friction_coefficient": one.friction,
            "gravity": one.gravity * acceleration,
        }
        | ({"restitution_left": one.restitution_left} if one.restitution_left <= 1.0 else {})
        for one in p.each
    ]
    phase = {"phase": p.phase} if p.forcing.has_phase else {}
    return on(
        structure,
        *own,
        forcing=p.forcing,
        forcing_frequency=p.frequency_ratio * rate,
        force_amplitude=p.force_amplitude * mass * acceleration,
        transverse_acceleration=acceleration,
        **phase,
    )


ONE_MODE = [*product(("several", "several, sliding"), (0, 1)), ("rigid", 0), ("sliding", 2)]
ALL = [
    (model, force, seed)
    for model, seed in ONE_MODE
    for force in FORCES
    if force != "base in the ground's frame"  # coordinates are relative to the base
]
#: Here another mass's event cuts the closed rest of chatter.
ALL += [("several", "two harmonics", 2)]


@pytest.mark.parametrize(("model", "force", "seed"), ALL)
def test_one_mode_is_one_primary_mass(model: str, force: str, seed: int) -> None:
    """Error grows in chaotic motion: it may double with each event."""
    values, (x, v, y, u) = scene_of(model, force, seed)
    p = Parameters(**values)
    until = {"until": 15.0, "max_events": 40}
    found = events(one_mode(p), State([x], [v], y, u), **until)
    wanted = events(p, State(x, v, y, u), **until)
    same(found, wanted, 2e-12)
    if "several" in model:
        assert found["body"].tolist() == wanted["body"].tolist()


def test_the_units_are_those_of_the_parameters() -> None:
    length, rate, p = 0.02, 30.0, Parameters(**SLOW)
    found = events(one_mode(p, 5.0, length, rate), until=46.0 / rate)
    scale = {"time": rate, "x": 1.0 / length, "v": 1.0 / (length * rate)}
    scale["approach_speed"] = scale["v"]
    for name, factor in scale.items():
        found[name] *= factor
    same(found, events(p, until=46.0))


# --- motions that are the same


def turned(turn: np.ndarray) -> Structure:
    """The beam in other coordinates."""
    return Structure(
        mass=turn @ BEAM.mass @ turn.T,
        damping=turn @ BEAM.damping @ turn.T,
        stiffness=turn @ BEAM.stiffness @ turn.T,
        boxes={name: turn @ box for name, box in BEAM.boxes.items()},
        force=turn @ BEAM.force,
    )


def modes(count: int) -> Structure:
    """As many of three modes, of which the last one has no share in box and force."""
    shapes = {"a": [1.0, 0.6, 0.0][:count], "force": [1.0, 0.3, 0.0][:count]}
    return Structure.from_modes([0.16, 0.43, 7.0][:count], 0.02, shapes)


MATRICES = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
PERMUTATION = np.eye(3)[[2, 0, 1]]
#: Name -> two dampers that move alike, and to how much.
ALIKE = {
    "matrices": (on(turned(MATRICES), {}, HEAVY), on(BEAM, {}, HEAVY), 1e-11),
    "permutation": (on(turned(PERMUTATION), {}, HEAVY), on(BEAM, {}, HEAVY), 1e-11),
    "matrices, ties": (on(turned(MATRICES), *TIES), on(BEAM, *TIES), 1e-11),
    "permutation, ties": (on(turned(PERMUTATION), *TIES), on(BEAM, *TIES), 1e-11),
    "a mode without a share": (on(modes(3), {}), on(modes(2), {}), 1e-13),
    "hardly a tie": (on(BEAM, {"tie_stiffness": 1e-13}), on(BEAM, {}), 1e-10),
}


@pytest.mark.parametrize("name", ALIKE)
def test_dampers_that_move_alike(name: str) -> None:
    one, other, error = ALIKE[name]
    same(events(one, until=14.0), events(other, until=14.0), error)


def test_two_halves_in_step_are_one() -> None:
    halves = events(on(BEAM, {"free_mass": 0.05}, {"free_mass": 0.05}), until=14.0)
    same(halves[halves["body"] == 1], events(on(BEAM, {}), until=14.0), 1e-12)


def test_one_mass_alone_may_have_weight_in_an_inclined_box() -> None:
    each = on(BEAM, {"gravity": 1.0}, {}, inclination=30.0).each
    assert [one.gravity for one in each] == [pytest.approx(0.5), 0.0]


def test_speeds_that_fall_without_end_are_none() -> None:
    """A wall presses mass 1 only as long as friction holds mass 0, which each impact moves."""
    shapes = {"a": [-0.81, -0.32, -0.91], "base": [-0.11, -0.51, 0.68]}
    beam = Structure.from_modes([0.08, 0.17, 0.82], 0.01, shapes)
    rubs = {"free_mass": 8.0, "gap": 0.18, "restitution": 1.0, "friction_coefficient": 0.064}
    ball = {"free_mass": 3.0, "gap": 0.026, "restitution": 1.0}
    given = {"forcing": "base", "forcing_frequency": 0.25, "transverse_acceleration": 1.0}
    found = events(on(beam, rubs, ball, **given), until=5.0, max_events=400)
    assert found["body"][found["kind"] == 1].tolist() == [1]
    assert found["kind"][-1] != 3
