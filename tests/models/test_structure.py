"""Free masses in boxes of a structure, against references that share no formula with the engine."""

import math
import random
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scenes import SLOW, coupled_structure

from damper import Parameters, SIParameters, State, Structure, events
from damper.engine.model import read_segment
from damper.engine.segment import CAUSE, DURATION, MODE, PERIODS, TAIL, TIME
from damper.models import start_run
from damper.parameters.forcing import Base, Forcing, Harmonic, Harmonics, NoForce, Record
from damper.verification.structures import exact_run

#: The same structures by modes and by matrices: light damping, a rigid-body mode, close modes.
BEAM = Structure.from_modes(
    [0.16, 0.43, 0.9],
    0.02,
    {"a": [1.0, 0.6, -0.3], "b": [0.4, -0.9, 0.7], "force": [1.0, 0.3, 0.5], "base": [1, 0.4, 0.2]},
)
RECORD = Record([0.0, 1.0, 2.5, 4.0, 8.0, 12.0, 20.0], [0.0, 1.0, -0.7, 0.3, -1.0, 0.5, 0.0])


def on(structure: Structure, *masses: dict[str, Any], **given: Any) -> SIParameters:
    values: dict[str, Any] = {"force_amplitude": 1.0, "forcing_frequency": 0.8} | given
    if values.get("forcing") == NoForce():
        del values["force_amplitude"]
    own = [{"box": "a", "free_mass": 0.1, "gap": 0.8, "restitution": 0.4} | one for one in masses]
    return SIParameters(structure=structure, masses=own, **values)


HEAVY = {"box": "b", "free_mass": 0.3, "gap": 0.6, "restitution": 0.3}
TIES = {"tie_stiffness": 0.05, "tie_damping": 0.02}, HEAVY | {"tie_stiffness": 0.1}
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


def _drawn(seed: int, rubs: bool) -> tuple[Parameters, SIParameters, tuple[Any, ...]]:
    rng = random.Random(seed)
    force: Forcing = [
        Harmonic(),
        Base("base"),
        RECORD,
        Harmonics((1, 2), (1.0, 0.5), (0.0, 0.3)),
        Record(RECORD.time, RECORD.value, of="base_acceleration"),
        NoForce(),
    ][seed % 6]
    zeta, omega = rng.choice([0.0, 0.02, 0.3]), rng.choice([0.3, 0.8, 1.4])
    gravity, amplitude = rng.choice([0.0, 0.2]), float(seed % 6 != 5)
    masses = [
        {
            "mass_ratio": rng.choice([0.05, 0.3]),
            "clearance": rng.choice([0.1, 0.5]),
            "restitution": rng.choice([0.0, 0.3, 0.7]),
        }
        for _ in range(1 + seed % 2)
    ]
    common = {"forcing": force, "force_amplitude": amplitude, "gravity": gravity}
    one = Parameters(
        mass_ratio=0.1,
        clearance=1.0,
        restitution=0.5,
        damping_ratio=zeta,
        frequency_ratio=omega,
        masses=masses,
        **common,
    )
    structure = Structure(
        mass=[[1.0]], damping=[[2.0 * zeta]], stiffness=[[1.0]], boxes={"a": [1.0]}, force=[1.0],
        base=[1.0],
    )  # fmt: skip
    own = [
        {"free_mass": m["mass_ratio"], "gap": 2 * m["clearance"], "restitution": m["restitution"]}
        for m in masses
    ]
    x, v = rng.uniform(-2, 2), rng.uniform(-1, 1)
    y = [x + rng.uniform(-1, 1) * m["clearance"] for m in masses]
    u = [v + rng.uniform(-1, 1) for _ in masses]
    if rubs:
        common["transverse_acceleration"] = 1.0
        for m, of_structure in zip(masses, own, strict=True):
            m["friction"] = rng.choice([0.02, 0.1, 0.3, 0.8])
            of_structure["friction_coefficient"] = m["friction"]
        one = replace(one, masses=masses)
    other = SIParameters(structure=structure, forcing_frequency=omega, masses=own, **common)
    return one, other, (x, v, y, u)


@pytest.mark.parametrize("rubs", [False, True])
@pytest.mark.parametrize("seed", range(12))
def test_one_mode_is_one_primary_mass(seed: int, rubs: bool) -> None:
    """Error grows in chaotic motion: it may double with each event."""
    one, other, (x, v, y, u) = _drawn(seed, rubs)
    wanted = events(one, State(x, v, y, u), until=15.0)[:40]
    found = events(other, State([x], [v], y, u), until=15.0)[:40]
    assert [found["kind"].tolist(), found["body"].tolist()] == [
        wanted["kind"].tolist(),
        wanted["body"].tolist(),
    ]
    for name in ("time", "approach_speed", "x", "v"):
        assert found[name] == pytest.approx(wanted[name], abs=2e-12), name


def test_the_units_are_those_of_the_parameters() -> None:
    """Lengths, times and masses of 1, 2 pi, ... scale the events of the damper without units."""
    length, rate, mass = 0.02, 30.0, 5.0
    p = Parameters(**SLOW)
    structure = Structure(
        mass=[[mass]],
        damping=[[2.0 * p.damping_ratio * mass * rate]],
        stiffness=[[mass * rate**2]],
        boxes={"a": [1.0]},
        force=[1.0],
    )
    si = SIParameters(
        structure=structure,
        force_amplitude=mass * rate**2 * length,
        forcing_frequency=p.frequency_ratio * rate,
        free_mass=p.mass_ratio * mass,
        gap=2.0 * p.clearance * length,
        restitution=p.restitution,
    )
    found, wanted = events(si, until=46.0 / rate), events(p, until=46.0)
    assert found["kind"].tolist() == wanted["kind"].tolist()
    assert found["time"] * rate == pytest.approx(wanted["time"], abs=1e-11)
    assert found["v"] / (length * rate) == pytest.approx(wanted["v"], abs=1e-11)


# --- energy


@pytest.mark.parametrize("friction", [0.0, 0.6])
def test_energy_is_balanced(friction: float) -> None:
    """Input less dashpots, ties, friction and impacts is what is stored; by quadrature, scaled."""
    own = {"restitution": 0.9, "tie_stiffness": 0.05, "tie_damping": 0.03}, HEAVY
    given = {"force_amplitude": 6.0, "gravity": 0.1, "friction_coefficient": friction}
    given["transverse_acceleration"] = 1.0
    p = on(coupled_structure(1), own[0], own[1] | {"restitution": 0.0}, **given).dimensionless
    run, s = start_run(p), p.structure
    log = np.concatenate([piece.copy() for piece in run.segments(*run.whole_periods(9.0))])
    nodes, weights = np.polynomial.legendre.leggauss(8)

    def gaps(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.array([y[k] - s.boxes[one.box] @ x for k, one in enumerate(p.each)])

    def stored(x: np.ndarray, v: np.ndarray, y: np.ndarray, u: np.ndarray) -> float:
        found = 0.5 * (v @ s.mass @ v + x @ s.stiffness @ x)
        for one, d, place, speed in zip(p.each, gaps(x, y), y, u, strict=True):
            found += 0.5 * (one.mass * speed**2 + one.tie_stiffness * d**2)
            found += one.mass * one.gravity * place
        return float(found)

    balance = turnover = 0.0
    for row in log:
        lost = read_segment(run.model, row).loss
        assert row[MODE] != TAIL or row[DURATION] == 0.0
        balance, turnover = balance - lost, turnover + lost
        parts = math.ceil(row[DURATION] / 0.2)
        for k in range(parts):
            half = 0.5 * row[DURATION] / parts
            for node, weight in zip(nodes, weights, strict=True):
                tau = half * (2 * k + 1 + node)
                _, v, _, u = run.state_in(row, tau)
                time = row[PERIODS] * p.cycle + row[TIME] + tau
                work = s.force @ v * p.force_amplitude * math.sin(p.frequency_ratio * time)
                lost = v @ s.damping @ v
                for m, d in zip(p.each, gaps(v, u), strict=True):
                    lost += m.tie_damping * d**2 + m.mass * m.friction * abs(d)
                balance += weight * half * (work - lost)
                turnover += weight * half * (abs(work) + lost)
    ends = [
        stored(*run.state_in(row, tau))
        for row, tau in ((log[0], 0.0), (log[-1], log[-1, DURATION]))
    ]
    assert ({4.0, 5.0, 6.0} if friction else {1.0, 2.0}) <= set(log[:, CAUSE])
    assert balance == pytest.approx(ends[1] - ends[0], abs=1e-12 * turnover)


# --- limits


def same(found: np.ndarray, wanted: np.ndarray, error: float = 1e-11) -> None:
    assert len(wanted) > 4
    assert found["kind"].tolist() == wanted["kind"].tolist()
    for name in ("time", "approach_speed", "x", "v"):
        assert found[name] == pytest.approx(wanted[name], abs=error), name


def _in_other_coordinates(turn: np.ndarray) -> Structure:
    return Structure(
        mass=turn @ BEAM.mass @ turn.T,
        damping=turn @ BEAM.damping @ turn.T,
        stiffness=turn @ BEAM.stiffness @ turn.T,
        boxes={name: turn @ box for name, box in BEAM.boxes.items()},
        force=turn @ BEAM.force,
    )


@pytest.mark.parametrize(
    "turn",
    [np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0], np.eye(3)[[2, 0, 1]]],
    ids=["matrices", "permutation"],
)
@pytest.mark.parametrize("tied", [False, True])
def test_other_coordinates_change_nothing(turn: np.ndarray, tied: bool) -> None:
    masses, until = TIES if tied else ({}, HEAVY), SCENES["two boxes"][1]
    found = events(on(_in_other_coordinates(turn), *masses), until=until)
    same(found, events(on(BEAM, *masses), until=until))


def test_a_mode_without_a_share_in_box_and_force_does_nothing() -> None:
    box, force = [1.0, 0.6, 0.0], [1.0, 0.3, 0.0]
    three = Structure.from_modes([0.16, 0.43, 7.0], 0.02, {"a": box, "force": force})
    two = Structure.from_modes([0.16, 0.43], 0.02, {"a": box[:2], "force": force[:2]})
    same(events(on(three, {}), until=14.0), events(on(two, {}), until=14.0), 1e-13)


def test_two_halves_in_step_are_one() -> None:
    halves = events(on(BEAM, {"free_mass": 0.05}, {"free_mass": 0.05}), until=14.0)
    same(halves[halves["body"] == 1], events(on(BEAM, {}), until=14.0), 1e-12)


def test_a_tie_of_hardly_any_stiffness_is_none() -> None:
    tied = events(on(BEAM, {"tie_stiffness": 1e-13}), until=14.0)
    same(tied, events(on(BEAM, {}), until=14.0), 1e-10)


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
