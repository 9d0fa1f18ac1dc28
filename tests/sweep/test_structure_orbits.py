"""Periodic motions, branches and exponents of free masses on a structure."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import fsolve

import damper
from damper import Parameters, SIParameters, Structure, continue_orbit, periodic_orbit

HERTZ = np.array([1.0, 2.7, 5.2]) / (2.0 * math.pi)
RATIOS = np.array([0.02, 0.01, 0.01])
BOX, FORCE = np.array([1.0, 0.6, -0.4]), np.array([1.0, 0.6, 0.3])
BEAM = Structure.from_modes(HERTZ, RATIOS, {"a": BOX, "b": [0.5, -1.0, 0.8], "force": FORCE})
BALL = {"box": "a", "free_mass": 0.1, "gap": 10.0, "restitution": 0.5}


def on_beam(**given):
    values = {"force_amplitude": 1.0, "forcing_frequency": 1.0, "masses": [BALL]} | given
    return SIParameters(structure=BEAM, **values)


def pair(**changes):
    """One damper as an oscillator and as a structure of one coordinate."""
    values = {"mass_ratio": 0.1, "damping_ratio": 0.1, "frequency_ratio": 1.0}
    values |= {"clearance": 5.0, "restitution": 0.5} | changes
    one = Parameters(**values)
    carrier = Structure(
        mass=[[1.0]],
        damping=[[2.0 * one.damping_ratio]],
        stiffness=[[1.0]],
        boxes={"a": [1.0]},
        force=[1.0],
    )
    return one, SIParameters(
        structure=carrier,
        force_amplitude=1.0,
        forcing_frequency=one.frequency_ratio,
        free_mass=one.mass_ratio,
        gap=2.0 * one.clearance,
        restitution=one.restitution,
        friction_coefficient=one.friction,
        transverse_acceleration=1.0,
        **{name: changes[name] for name in ("gravity", "restitution_left") if name in changes},
    )


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"damping_ratio": 0.02, "frequency_ratio": 1.3, "clearance": 0.05, "restitution": 0.3},
        {"friction": 0.05},
        {"friction": 0.3, "clearance": 1.0},
    ],
)
def test_one_mode_has_the_orbits_of_the_oscillator(changes):
    """Two impacts a cycle, complete chatter on both walls; slides that turn round, and rests."""
    wanted, found = map(periodic_orbit, pair(**changes))
    assert found.word == wanted.word in ("R1 L1", "RS LS", "R3 L3")
    assert found.start == pytest.approx(wanted.start, abs=1e-10)
    assert abs(found.multipliers) == pytest.approx(abs(wanted.multipliers), abs=1e-10)
    assert found.peak == pytest.approx(wanted.peak, rel=1e-12)
    for name, of_oscillator, part in (
        ("gap", "clearance", 0.5),
        ("free_mass", "mass_ratio", 1.0),
        ("forcing_frequency", "frequency_ratio", 1.0),
        ("restitution", "restitution", 1.0),
        *[("friction_coefficient", "friction", 1.0)] * ("friction" in changes),
    ):
        change = part * wanted.sensitivity(of_oscillator)
        assert found.sensitivity(name) == pytest.approx(change, abs=1e-8 * abs(change).max())
        change = part * wanted.peak_sensitivity(of_oscillator)
        assert found.peak_sensitivity(name) == pytest.approx(change, abs=1e-8 + 1e-8 * abs(change))


@pytest.mark.parametrize("friction", [0.0, 0.02])
def test_one_mode_has_the_exponents_of_the_oscillator(friction):
    changes = {"mass_ratio": 0.3, "damping_ratio": 0.02, "frequency_ratio": 1.2, "clearance": 0.5}
    one, other = pair(**changes, friction=friction)
    run = {"transient": 10, "periods": 8, "observers": ["lyapunov"]}
    wanted, found = damper.simulate(one, **run), damper.simulate(other, **run)
    assert found.lyapunov_exponents.values == pytest.approx(
        wanted.lyapunov_exponents.values, abs=1e-7
    )
    assert abs(found.lyapunov_residual) < 1e-12
    assert found.slowest_impact.item() == pytest.approx(wanted.slowest_impact.item(), rel=1e-6)
    with pytest.raises(TypeError, match="observers is not known on a structure"):
        damper.simulate(other, observers=["lyapunov", "impacts"])


@pytest.mark.parametrize(
    ("changes", "side"), [({}, 0), ({"clearance": 4.4}, 1), ({"gravity": 1e-3}, None)]
)
def test_one_mode_has_the_motion_of_the_oscillator(changes, side):
    run = {"transient": 300, "periods": 4, "observers": ["motion"]}
    wanted, found = (damper.simulate(p, **run) for p in pair(**changes))
    names = [name for name in wanted.data_vars if name.startswith("motion")]
    assert {name: found[name].fillna(9).item() for name in names} == {
        name: wanted[name].fillna(9).item() for name in names
    }
    assert (found.motion_period.item(), found.motion_impacts_left.item()) == (1, 1)
    assert found.motion_side.isnull() if side is None else found.motion_side.item() == side


def test_each_mass_on_a_structure_has_a_motion():
    p = on_beam(masses=[BALL | {"gap": 8.0}, BALL | {"box": "b", "gap": 50.0}])
    cube = damper.simulate(p, transient=300, periods=4, observers=["motion"])
    assert cube.motion_period.values.tolist() == [1, 1]
    assert cube.motion_impacts_left.values.tolist() == [2, 0]
    with pytest.raises(ValueError, match="each mass is observed"):
        damper.simulate(p, observers={"motion": {"bodies": [0]}})


def at_the_right_wall(p, speed, phase):
    """Displacements and velocities of the modes before and after an impact, in closed form.

    The free mass flies at a speed from wall to wall, twice a cycle. Each mode has the steady
    response to the force, which has a phase there, and that to impulses to and fro.
    """
    rates, omega = 2.0 * math.pi * HERTZ, p.forcing_frequency
    moved = FORCE / (rates**2 - omega**2 + 2j * RATIOS * rates * omega) * np.exp(1j * phase)
    turns = rates * np.sqrt(1.0 - RATIOS**2)
    poles = -RATIOS * rates + 1j * turns
    # Impulses of -1 half a cycle before, 1 a cycle before, ...
    lasting = np.exp(poles * math.pi / omega) / (1.0 + np.exp(poles * math.pi / omega)) / turns
    push = 2.0 * p.each[0].mass * speed * BOX
    before = (1j * omega * moved - poles * lasting * push).imag
    return (moved - lasting * push).imag, before, before + push


def two_impacts(p, speed, phase):
    """Residuals: the mass arrives after half a cycle, with the restitution of its walls."""
    x, before, after = at_the_right_wall(p, speed, phase)
    arrives = BOX @ x + 0.5 * BALL["gap"] - 0.5 * speed * math.pi / p.forcing_frequency
    return [arrives, speed + BOX @ after - BALL["restitution"] * (speed - BOX @ before)]


def closed_orbit(p):
    """The motion with two impacts, from the closed form."""
    speed, phase = fsolve(lambda at: two_impacts(p, *at), [7.0, 3.8], xtol=1e-13)
    x, _, v = at_the_right_wall(p, speed, phase)
    time = phase % (2.0 * math.pi) / p.forcing_frequency
    return damper.State(x, v, BOX @ x + 0.5 * BALL["gap"], -speed, time)


def test_two_impacts_on_three_modes_are_those_of_the_closed_form():
    """The product of the multipliers is what dashpots and impacts leave of a volume."""
    p = on_beam()
    start = closed_orbit(p)
    run = damper.start(p, start)
    run.advance(p.cycle)
    orbit = periodic_orbit(p, state=run.state)
    assert orbit.word == "R1 L1"
    hit = orbit.events[orbit.events["side"] == 1][0]
    assert hit["time"] == pytest.approx(start.time, abs=1e-9)
    assert hit["x"] == pytest.approx(BOX @ start.x, abs=1e-9)
    volume = np.exp(-2.0 * (RATIOS * 2.0 * math.pi * HERTZ).sum() * p.cycle) * 0.5**4
    assert np.prod(orbit.multipliers).real == pytest.approx(volume, rel=1e-9)


def test_a_branch_of_three_modes():
    """Along a gap, past where symmetry breaks; and changes by two quantities."""
    p = on_beam(masses=[BALL | {"gap": 7.87}])
    branch = continue_orbit(periodic_orbit(p), "gap_0", 7.85, 7.88, step=1.0)
    (point,) = branch.special_points
    assert point.kind == "symmetry breaking"
    nearest = abs(point.orbit.multipliers - 1.0).min()
    assert nearest < 1e-6
    cube = branch.to_dataset()
    assert (cube.x.dims, cube.y.dims) == (("orbit", "coordinate"), ("orbit",))
    orbit = branch.orbits[len(branch.orbits) // 2]
    own, step = orbit.parameters, 1e-4
    for name in ("gap_0", "mode_2_frequency"):
        value = own.value_of(name)
        ends = [
            periodic_orbit(own.having({name: value * (1.0 + way)}), state=orbit.state).start
            for way in (-step, step)
        ]
        wanted = (ends[1] - ends[0]) / (2.0 * step * value)
        assert orbit.sensitivity(name) == pytest.approx(wanted, abs=1e-5 * abs(wanted).max())


def test_what_orbits_on_structures_do_not_know_is_refused():
    p = on_beam(masses=[BALL | {"gap": 8.0}])
    orbit = periodic_orbit(p)
    with pytest.raises(ValueError, match=r"gap: masses\[0\] has its own; give gap_0"):
        orbit.sensitivity("gap")
    with pytest.raises(TypeError, match="unknown quantity of a structure"):
        orbit.sensitivity("clearance")
    with pytest.raises(TypeError, match="unknown place of a shock 'c': must be one of a, b"):
        damper.smallest_shock(orbit, place="c")


def test_a_shock_throws_one_of_two_modes_out_as_an_oscillator():
    """Coordinates mix the modes, so the impulse moves both of them; the second feels nothing."""
    ways = {"mass_ratio": 0.25, "damping_ratio": 0.02, "frequency_ratio": 0.74, "clearance": 4.62}
    one, p = pair(**ways)
    to_modes = np.linalg.inv([[1.0, 0.5], [0.3, 2.0]])
    mass, damping, stiffness = (
        to_modes.T @ np.diag(of) @ to_modes for of in ([1.0, 1.0], [0.04, 0.1], [1.0, 7.0])
    )
    box = to_modes[0]
    two = Structure(mass, damping, stiffness, boxes={"a": box}, force=box)
    x, v = np.linalg.solve(to_modes, [[-1.2, 1.1], [0.0, 0.0]]).T.tolist()
    wanted, found = (
        damper.smallest_shock(
            periodic_orbit(p, state=state), moments=1, largest=42.0, tolerance=0.5
        )
        for p, state in (
            (one, damper.State(-1.2, 1.1, -5.4, 4.0)),
            (replace(p, structure=two), damper.State(x, v, -5.4, 4.0)),
        )
    )
    assert found.size == pytest.approx(wanted.size, rel=1e-9)
    assert (found.direction, found.moment) == (wanted.direction, wanted.moment)
    assert wanted.motion == found.motion
    assert to_modes @ found.state.v == pytest.approx([wanted.state.v, 0.0], abs=1e-9)
