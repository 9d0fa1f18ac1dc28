"""Stiff springs in place of rigid walls: exact flow and a stiff solver."""

import math
from dataclasses import replace

import numpy as np
import pytest

import damper
from damper.models.compliant.restitution import contact_damping, restitution_of
from damper.verification.comparison.restarted import solve_restarted
from damper.verification.comparison.scene import read_scene
from damper.verification.comparison.solution import CAPPED, FINISHED
from damper.verification.comparison.solvers import load
from damper.verification.comparison.springs import with_springs

BURST = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.2,
    "clearance": 0.25,
    "restitution": 0.6,
}
#: In 50 digits: second impact, accumulation, release.
SECOND_IMPACT, ACCUMULATION, RELEASE = 5.25460925811892195, 44.249718778208865, 46.2709500002439


def errors(found):
    assert found.outcome == FINISHED
    assert len(found.stick_times) == len(found.release_times) == 1
    return np.abs(
        [
            found.impact_times[1] - SECOND_IMPACT,
            found.stick_times[0] - ACCUMULATION,
            found.release_times[0] - RELEASE,
        ]
    )


@pytest.mark.parametrize(("name", "high"), [("compliant_flow", 1e8), ("compliant_stiff", 1e8)])
def test_errors_fall_with_the_root_of_the_stiffness(name, high):
    scene = read_scene(BURST, 60.0)
    low = 1e-4 * high
    coarse, fine = (errors(load(name).solve(scene, k)) for k in (low, high))
    order = np.log(fine / coarse) / math.log(high / low)
    assert order[0] == pytest.approx(-0.5, abs=0.01)
    # Contacts before sticking are more the stiffer the wall: a logarithm bends the slope.
    assert order[1:] == pytest.approx(-0.5, abs=0.08)
    assert (order[1:] > -0.5).all()


def test_both_solve_the_same_equations():
    scene = read_scene(BURST, 60.0)
    exact, stiff = (
        load(name).solve(scene, 1e6, times=(10.0, 45.5))
        for name in ("compliant_flow", "compliant_stiff")
    )
    np.testing.assert_allclose(stiff.impact_times, exact.impact_times, rtol=0.0, atol=1e-5)
    np.testing.assert_array_equal(stiff.impact_sides, exact.impact_sides)
    np.testing.assert_allclose(stiff.approach_speeds, exact.approach_speeds, rtol=0.0, atol=1e-5)
    np.testing.assert_allclose(stiff.stick_times, exact.stick_times, rtol=0.0, atol=1e-5)
    np.testing.assert_allclose(stiff.release_times, exact.release_times, rtol=0.0, atol=1e-5)
    np.testing.assert_allclose(stiff.states, exact.states, rtol=0.0, atol=1e-5)
    # The integrator's own steps pass near the deepest point.
    assert exact.penetration == pytest.approx(stiff.penetration, rel=5e-3)


def test_sticking_begins_where_the_lasting_contact_does():
    found = load("compliant_flow").solve(read_scene(BURST, 60.0), 1e6)
    assert np.abs(found.impact_times - found.stick_times[0]).min() < 1e-12


@pytest.mark.parametrize("restitution", [0.3, 0.9, 0.0, 1.0])
def test_depth_of_one_impact(restitution):
    # Against free bodies: v / w exp(-z t) with t where the rate vanishes, by sampling.
    scene = read_scene({**BURST, "restitution": restitution}, 3.0)
    stiffness = 1e8
    found = load("compliant_flow").solve(scene, stiffness)
    assert len(found.impact_times) == 1
    z = contact_damping(restitution, restitution == 0.0)
    w = math.sqrt(stiffness * 1.1 / 0.1)
    t = np.linspace(0.0, 2.0 / w, 20_001)
    damped = w * math.sqrt(max(1.0 - z * z, 0.0))
    shape = np.sin(damped * t) / damped if damped else t
    depth = found.approach_speeds[0] * np.exp(-z * w * t) * shape
    assert found.penetration == pytest.approx(depth.max(), rel=1e-3)


def test_restitution_is_kept():
    for restitution in (0.0, 0.6, 1.0):
        p = with_springs(read_scene({**BURST, "restitution": restitution}, 1.0), 1e5).parameters
        assert p.contact_stiffness_ratio == 1e5
        tension = bool(p.contact_tension)
        kept = restitution_of(contact_damping(p.restitution, tension), tension)
        assert kept == pytest.approx(restitution, abs=1e-12)


@pytest.mark.parametrize("name", ["compliant_flow", "compliant_stiff"])
def test_restitution_0_sticks_at_the_first_impact(name):
    scene = read_scene({**BURST, "restitution": 0.0}, 15.0)
    rows = damper.events(scene.parameters, scene.state, until=15.0)
    found = load(name).solve(scene, 1e8)
    sticks = rows["time"][rows["kind"] == 1]
    assert len(sticks) == 3
    np.testing.assert_allclose(found.impact_times, sticks, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(found.stick_times, sticks, rtol=0.0, atol=1e-7)
    releases = rows["time"][rows["kind"] == 2]
    np.testing.assert_allclose(found.release_times, releases, rtol=0.0, atol=1e-4)


def test_a_contact_that_still_lasts_at_the_end_has_begun():
    scene = read_scene(BURST, 46.0)
    for name in ("compliant_flow", "compliant_stiff"):
        found = load(name).solve(scene, 1e6)
        assert found.stick_times == pytest.approx([ACCUMULATION], abs=0.1)
        assert len(found.release_times) == 0


@pytest.mark.parametrize("name", ["compliant_flow", "compliant_stiff"])
def test_evaluations_are_capped(name):
    found = load(name).solve(read_scene(BURST, 60.0), 1e6, times=(59.0,), max_evaluations=60)
    assert found.outcome == CAPPED
    assert 60 < found.evaluations < 120
    assert found.reached < 50.0
    assert np.isnan(found.states).all()


def test_energy_balance_counts_what_springs_hold():
    # The end is in a contact, where the spring holds energy.
    scene = read_scene(BURST, 60.0)
    first = load("compliant_flow").solve(scene, 1e6).impact_times[0]
    cut = replace(scene, until=float(first) + 5e-4)
    found = load("compliant_stiff").solve(cut, 1e6, balance=True)
    assert found.outcome == FINISHED
    assert abs(found.energy_residual) < 1e-8


def test_contacts_are_noted_as_sticking_only_where_asked():
    springs = with_springs(read_scene(BURST, 46.0), 1e6)
    for lasting in (False, True):
        found = solve_restarted("LSODA", springs, 1e-8, (), False, 50_000, lasting=lasting)
        assert len(found.stick_times) == lasting
