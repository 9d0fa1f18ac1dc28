import math
from pathlib import Path

import numpy as np
import pytest
import yaml

import damper
from damper.models import check_state
from damper.parameters.structural import StructureParameters
from damper.sweep.points import require_parameters

MISTAKES = yaml.safe_load((Path(__file__).parent / "mistakes.yaml").read_text())
M = [[2.0, 0.1], [0.1, 1.0]]
C = [[0.2, -0.1], [-0.1, 0.1]]
K = [[3.0, -1.0], [-1.0, 1.0]]
TABLE = {
    "frequencies": [0.16, 0.43],
    "damping_ratios": [0.01, 0.02],
    "shapes": {"tip": [1.0, 0.6], "force": [1.0, 0.5], "deck": [0.3, 0.2]},
}
MASS = {"box": "tip", "free_mass": 0.05, "gap": 0.8, "restitution": 0.5}


def beam(**more):
    return damper.Structure.from_modes(**TABLE, **more)


def building(**more):
    given = {"mass": M, "damping": C, "stiffness": K, "boxes": {"roof": 1}, "force": 0}
    return damper.Structure(**given | more)


def parameters(structure=None, **more):
    given = {"force_amplitude": 1.0, "forcing_frequency": 1.1, "masses": [MASS]}
    return damper.SIParameters(structure=structure or beam(), **given | more)


def test_modes_are_a_diagonal_structure():
    s, omega = beam(), 2.0 * math.pi * np.array([0.16, 0.43])
    assert (s.mass == np.eye(2)).all()
    assert np.allclose(s.stiffness, np.diag(omega**2), rtol=1e-15)
    assert np.allclose(s.damping, np.diag(2.0 * omega * [0.01, 0.02]), rtol=1e-15)
    assert s.force.tolist() == [1.0, 0.5]
    assert list(s.boxes) == list(s.points) == ["tip", "deck"]


def test_modal_masses_scale_the_matrices_of_modes():
    plain, s = beam(), beam(modal_masses=[4.0, 9.0])
    for name in ("mass", "damping", "stiffness"):
        assert np.allclose(getattr(s, name), getattr(plain, name) * [[4.0], [9.0]], rtol=1e-15)


def test_frequencies_of_matrices():
    squares = np.linalg.eigvals(np.linalg.solve(M, K))
    found = building().frequencies
    assert np.allclose(found, np.sqrt(sorted(squares)) / (2.0 * math.pi), rtol=1e-14)


def test_equal_structures_have_one_hash_and_fingerprint():
    one, same, other = building(), building(boxes={"roof": [0.0, 1.0]}), building(force=1)
    assert one == same != other
    assert building(boxes={"a": 0, "b": 1}) == building(boxes={"b": 1, "a": 0})
    assert building(points={"mid": [0.5, 0.5]}) != one
    assert hash(one) == hash(same)
    assert one.fingerprint == same.fingerprint != other.fingerprint


def test_a_structure_does_not_change():
    s = beam()
    with pytest.raises(AttributeError, match="make another one, of another mass"):
        s.mass = 1.0
    for array in (s.stiffness, s.force, s.boxes["tip"]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_a_place_is_given_by_vector_number_or_name():
    named = building(points={"slab": [0.5, 0.5]}, force="slab")
    assert named.force.tolist() == [0.5, 0.5]
    assert building().boxes["roof"].tolist() == [0.0, 1.0]
    one = damper.Structure(2.0, stiffness=3.0, boxes={"tip": 1.0}, force=0)
    assert one.boxes["tip"].tolist() == one.force.tolist() == [1.0]
    assert beam().having().force.tolist() == [1.0, 0.5]


@pytest.mark.parametrize(
    ("changed", "message"),
    MISTAKES["structure"],
)
def test_mistakes_in_a_structure_name_matrix_and_entry(changed, message):
    with pytest.raises((ValueError, TypeError), match=message):
        building(**changed)


@pytest.mark.parametrize(
    ("changed", "message"),
    MISTAKES["modes"],
)
def test_mistakes_in_a_modal_table(changed, message):
    with pytest.raises((ValueError, TypeError), match=message):
        damper.Structure.from_modes(**TABLE | changed)


def test_other_numbers_of_modes():
    s = beam(base_shares={"deck": 0.5}).having(mode_1_frequency=0.2, mode_2_damping_ratio=0.3)
    assert s.numbers == {
        "mode_1_frequency": 0.2,
        "mode_1_damping_ratio": 0.01,
        "mode_2_frequency": 0.43,
        "mode_2_damping_ratio": 0.3,
    }
    assert s.base_shares == {"tip": 1.0, "deck": 0.5}
    with pytest.raises(TypeError, match="did you mean 'mode_2_frequency'"):
        s.having(mode_3_frequency=1.0)
    with pytest.raises(ValueError, match="is of a structure that is given by modes"):
        building().having(mode_1_frequency=1.0)


def test_parameters_on_a_structure():
    p = parameters(masses=[MASS | {"tie_stiffness": 0.045, "tie_damping": 0.002}])
    assert isinstance(p, StructureParameters)
    [mass] = p.each
    assert (mass.box, mass.mass, mass.clearance, mass.restitutions) == (
        "tip",
        0.05,
        0.4,
        (0.5, 0.5),
    )
    assert (mass.tie_stiffness, mass.tie_damping) == (0.045, 0.002)
    assert p.cycle == 2.0 * math.pi / 1.1


def test_numbers_may_have_units():
    p = parameters(masses=[MASS | {"gap": "20 mm"}], force_amplitude="2 kN")
    assert (p.each[0].clearance, p.force_amplitude) == (0.01, 2000.0)


def test_scaling_loses_no_digit():
    p = parameters(
        building(mass=np.multiply(M, 300.0), stiffness=np.multiply(K, 7e5)),
        masses=[MASS | {"box": "roof", "gap": 0.003, "tie_stiffness": 0.3, "yield_speed": 0.7}],
        gravity=9.81,
        forcing_frequency=40.0,
    )
    scaled, units = p.dimensionless, p.units
    for size in (units.length, units.time, units.energy):
        assert math.frexp(size)[0] == 0.5
    per_mass = units.energy / units.speed**2
    assert (scaled.structure.stiffness * (per_mass / units.time**2) == p.structure.stiffness).all()
    assert (scaled.structure.mass * per_mass == p.structure.mass).all()
    assert scaled.force_amplitude * units.force == 1.0
    assert scaled.frequency_ratio / units.time == 40.0
    [mass] = scaled.each
    assert mass.clearance * units.length == 0.0015
    assert mass.gravity * units.acceleration == 9.81
    assert mass.yield_speed * units.speed == 0.7
    assert mass.tie_stiffness * per_mass / units.time**2 == 0.3
    assert 0.5 < mass.clearance < 2.0


def test_masses_have_their_own_values_or_those_of_all():
    p = parameters(
        box="tip",
        gap=0.8,
        restitution=0.5,
        masses=[{"free_mass": 0.1}, {"free_mass": 0.2, "box": "deck", "restitution": 0.3}],
    )
    tabled = parameters(
        restitution_table=[(1.0, 0.4)],
        masses=[MASS, {"free_mass": 0.2, "gap": 0.1, "box": "tip"}],
    )
    assert [m.tables for m in tabled.each] == [(), (((1.0, 0.4),),) * 2]
    assert [(m.box, m.mass, m.restitution) for m in p.each] == [
        ("tip", 0.1, 0.5),
        ("deck", 0.2, 0.3),
    ]
    alone = damper.SIParameters(
        structure=building(), forcing="none", free_mass=0.1, gap=1.0, restitution=0.5
    )
    assert alone.each[0].box == "roof"


def test_free_motion_needs_no_force_and_counts_in_seconds():
    p = damper.SIParameters(structure=beam(), forcing="none", masses=[MASS])
    assert (p.force_amplitude, p.cycle) == (0.0, 1.0)


def test_a_pendulum_is_a_tie():
    p = parameters(masses=[MASS | {"pendulum_length": 0.5}], transverse_acceleration=9.81)
    assert p.each[0].tie_stiffness == pytest.approx(0.05 * 9.81 / 0.5, rel=1e-15)


def test_amplitudes_of_forces_have_units_of_their_own():
    s = damper.Structure.from_modes(**TABLE | {"shapes": TABLE["shapes"] | {"base": [1.2, 0.3]}})
    for forcing, unit in (
        ("base", lambda u: u.length),
        (damper.Unbalance(), lambda u: u.energy / u.speed**2 * u.length),
        (damper.Record([0.0, 1.0], [0.0, 1.0], of="base_acceleration"), lambda u: u.acceleration),
    ):
        p = parameters(s, forcing=forcing, force_amplitude=3.0)
        assert p.dimensionless.force_amplitude * unit(p.units) == 3.0


@pytest.mark.parametrize(
    ("changed", "message"),
    MISTAKES["on a structure"]
    + [
        ({"forcing": damper.Base()}, "relative to its base; give damper.Base"),
        ({"forcing": np.ones(2)}, r"forcing = array\(\[1., 1.\]\): must be a name, or a force"),
        ({"structure": building(force=None)}, "no place of the force; give force="),
        ({"structure": building(boxes={"tip": [0.0, 0.0]})}, "all its weights are zero"),
    ],
)
def test_mistakes_in_parameters_on_a_structure(changed, message):
    with pytest.raises((ValueError, TypeError), match=message):
        parameters(**changed)


def test_values_replace_those_of_single_masses_and_modes():
    p = parameters().having({"gap_0": 2.0, "mode_1_frequency": 0.2, "forcing_frequency": 3.0})
    assert p.each[0].clearance == 1.0
    assert p.structure.numbers["mode_1_frequency"] == 0.2
    assert p.forcing_frequency == 3.0
    assert p.each[0].mass == 0.05


def test_the_state_of_a_structure_has_a_value_for_each_coordinate():
    p = parameters()
    state = damper.State(np.array([2.0, 0.3]), [0.0, 0.1], 2.18 + 0.39, 0.0)
    assert state.times(p.units).over(p.units) == state
    check_state(p.dimensionless, state.over(p.units))
    with pytest.raises(
        ValueError, match=r"\|y - that of box 'tip'\| = 0.4[01]\d* is outside the box"
    ):
        check_state(p.dimensionless, damper.State([2, 0.3], [0, 0], 2.59, 0).over(p.units), p.units)
    with pytest.raises(ValueError, match="state: x is one number: must be 2 values"):
        check_state(p.dimensionless, damper.State(0.0, 0.0, 0.0, 0.0))
    one = damper.Parameters(0.1, 0.05, 0.8, 1.0, 0.6)
    with pytest.raises(ValueError, match="state: v is 2 values: must be one number"):
        damper.events(one, damper.State(0.0, [0.0, 1.0], 0.0, 0.0), until=1.0)


def test_what_follows_no_structure_says_so():
    with pytest.raises(TypeError, match=r"only damper\.events, damper\.start, damper\.run, "):
        require_parameters(parameters())
