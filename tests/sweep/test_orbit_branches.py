"""Branches of periodic motions against closed forms, and against motions found by themselves."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from cases import thinned
from fixed_stop import OSCILLATOR, REST, ImpactOscillator, beside_a_stop, one_impact
from scipy.optimize import brentq

import damper
from damper import continue_orbit, continue_point, periodic_orbit
from damper.analysis.closed_forms import reduced_gap
from damper.models import start_run
from damper.parameters import Parameters, SIParameters, State
from damper.parameters.forcing import Base, Harmonics
from damper.parameters.named import value_of
from damper.sweep.orbits.branch import Branch, SpecialPoint
from damper.sweep.orbits.point_curve import PointCurve
from damper.theory.small_mass import critical_restitution
from damper.theory.two_impacts import largest_clearance, orbits

TWO_IMPACTS = Parameters(
    mass_ratio=0.1, damping_ratio=0.1, frequency_ratio=1.0, clearance=5.0, restitution=0.5
)
CHATTER = Parameters(
    mass_ratio=0.1, damping_ratio=0.02, frequency_ratio=1.3, clearance=0.05, restitution=0.73
)


def steady_amplitude(p: Parameters) -> float:
    """The primary's amplitude where no mass touches it."""
    w = p.frequency_ratio
    return 1.0 / float(np.hypot(1.0 - w * w, 2.0 * p.damping_ratio * w))


def points(branch: Branch, kind: str) -> list[SpecialPoint]:
    return [point for point in branch.special_points if point.kind == kind]


@pytest.fixture(scope="module")
def oscillator() -> Branch:
    """The impact oscillator's motion with one impact a period, followed along sigma."""
    guess = State(-0.28, -0.57, REST, 0.0)
    orbit = periodic_orbit(beside_a_stop(0.0), state=guess)
    assert orbit.word == "L1"
    return continue_orbit(orbit, "clearance", -0.5 - REST, 0.2 - REST)


def test_impact_oscillator(oscillator: Branch) -> None:
    """Its period doubling, and where the impact is lost: at the amplitude of the steady motion."""
    (doubling,) = points(oscillator, "period doubling")
    assert doubling.value + REST == pytest.approx(OSCILLATOR.period_doubling(1.0), abs=1e-10)
    assert doubling.value + REST == pytest.approx(-0.068575652279, abs=1e-11)
    (grazing,) = points(oscillator, "grazing")
    assert grazing.value + REST == pytest.approx(abs(OSCILLATOR.g), abs=1e-10)
    assert oscillator.orbits[-1].word == ""
    for orbit in oscillator.orbits[::20]:
        if orbit.impacts:
            sigma = orbit.parameters.clearance + REST
            trace = OSCILLATOR.trace(orbit.slowest_impact, 1.0)
            assert OSCILLATOR.stop(orbit.slowest_impact, 1.0) == pytest.approx(sigma, abs=1e-11)
            assert orbit.multipliers.sum() == pytest.approx(trace, rel=1e-7)


def test_a_branch_may_end_where_the_motion_changes(oscillator: Branch) -> None:
    """Down to the period doubling; up through the grazing, no change of kind, to the end."""
    (asked,) = points(oscillator, "period doubling")
    orbit = next(
        o for o in oscillator.orbits if o.impacts and o.parameters.clearance > asked.value + 0.05
    )
    ends = -0.5 - REST, 0.2 - REST
    branch = continue_orbit(orbit, "clearance", *ends, until_change=True)
    assert [point.kind for point in branch.special_points] == ["period doubling", "grazing"]
    assert branch.special_points[0].value == pytest.approx(asked.value, abs=1e-10)
    assert branch.ends[0].startswith("changes its kind at the period doubling clearance = ")
    assert branch.ends[1] == oscillator.ends[1]


def unstable(part: float) -> damper.PeriodicOrbit:
    """The impact oscillator's motion of a part of the impact speed that it has at the fold."""
    return one_impact(part * OSCILLATOR.fold_speed)


def test_fold_of_the_impact_oscillator() -> None:
    branch = continue_orbit(unstable(0.97), "clearance", -1.79 - REST, -1.75 - REST)
    (fold,) = points(branch, "fold")
    assert fold.value + REST == pytest.approx(-OSCILLATOR.fold, abs=1e-10)
    assert fold.value + REST == pytest.approx(-1.780235601, abs=1e-9)
    assert {orbit.stable for orbit in branch.orbits} == {True, False}


def test_a_corner_where_a_touch_begins() -> None:
    """The branch turns back with the second impact, whose speed is zero there."""
    branch = continue_orbit(unstable(0.14), "clearance", -0.5 - REST, -0.3 - REST)
    (grazing,) = points(branch, "grazing")
    assert min(branch.values) < grazing.value == pytest.approx(max(branch.values), abs=0.01)
    words = [orbit.word for orbit in branch.orbits]
    assert set(words) == {"L1", "L2"}
    slowest = [orbit.slowest_impact for orbit in branch.orbits if orbit.word == "L2"]
    values = [orbit.parameters.clearance for orbit in branch.orbits if orbit.word == "L2"]
    # The speed is that of a smooth curve through the grazing.
    (near, nearer), (v_near, v_nearer) = sorted(values)[-2:], sorted(slowest)[1::-1]
    assert nearer + (nearer - near) / (v_near - v_nearer) * v_nearer == pytest.approx(
        grazing.value, abs=1e-3
    )


def test_switch_to_the_doubled_branch(oscillator: Branch) -> None:
    doubling = points(oscillator, "period doubling")[0]
    doubled = oscillator.switch(doubling)
    assert (doubled.period, doubled.word, doubled.stable) == (2, "L2", True)
    value = doubling.value
    branch = continue_orbit(doubled, "clearance", value - 0.005, value + 0.005)
    assert any("motions of half the period near clearance = 9.93142" in end for end in branch.ends)
    with pytest.raises(ValueError, match="no branch crosses at a point of the kind 'grazing'"):
        oscillator.switch(points(oscillator, "grazing")[0])


def test_along_dry_friction_from_none() -> None:
    """The motion without friction at one end, and each beside it found by itself."""
    smooth = periodic_orbit(TWO_IMPACTS)
    branch = continue_orbit(smooth, "friction", 0.0, 1.0)
    assert branch.ends[1] == "friction = 1.0 is the end of the range"
    first, beyond = branch.orbits[0], branch.orbits[len(branch.orbits) // 2]
    assert branch.values[0] == 0.0
    np.testing.assert_allclose(first.start, smooth.start, atol=1e-12)
    np.testing.assert_allclose(first.multipliers, smooth.multipliers, rtol=1e-9)
    step = 1e-5
    near = periodic_orbit(replace(TWO_IMPACTS, friction=step), state=smooth.state)
    slope = (near.start - smooth.start) / step
    np.testing.assert_allclose(smooth.sensitivity("friction"), slope, atol=1e-4)
    again = periodic_orbit(beyond.parameters)
    np.testing.assert_allclose(again.start, beyond.start, atol=1e-9)


def test_a_branch_goes_on_where_a_rest_is_lost() -> None:
    """A rest of no length is a touch of no relative velocity: there the branch has a corner."""
    p = Parameters(0.1, 0.1121278925, 1.4504636963, 0.4709681468, 0.7743247236, 2.5399586938)
    orbit = periodic_orbit(replace(p, friction=0.0804231145))
    branch = continue_orbit(orbit, "friction", 0.0, 1.0, step=0.5)
    assert [point.kind for point in branch.special_points] == ["period doubling", "fold"]
    assert branch.values[0] == branch.values[-1] == 0.0
    last = max(k for k, each in enumerate(branch.orbits) if 4 in each.events["kind"])
    before, after = branch.orbits[last : last + 2]
    first, second = np.flatnonzero(before.events["kind"] >= 4)[:2]
    assert 0.0 < before.events["time"][second] - before.events["time"][first] < 1e-2
    np.testing.assert_allclose(before.start, after.start, atol=1e-3)


@pytest.fixture(scope="module")
def two_impacts() -> Branch:
    orbit = periodic_orbit(TWO_IMPACTS, state=orbits(TWO_IMPACTS)[0].start)
    return continue_orbit(orbit, "clearance", 4.5, 9.5, max_orbits=150)


def test_two_impacts(two_impacts: Branch) -> None:
    """Both motions of the closed form, the fold where they meet, and how they lose stability."""

    def largest(clearance: float, root: int = 0) -> np.ndarray:
        return orbits(at(clearance))[root].multipliers

    def at(clearance: float) -> Parameters:
        return Parameters(0.1, 0.1, 1.0, clearance, 0.5)

    (fold,) = points(two_impacts, "fold")
    assert fold.value == pytest.approx(largest_clearance(TWO_IMPACTS), abs=1e-10)
    # The half period map has the multiplier -1: the mirror image of a deviation comes back.
    (breaking,) = points(two_impacts, "symmetry breaking")
    known = brentq(lambda d: largest(d)[0].real + 1.0, 4.5, 4.8, xtol=1e-13)
    assert breaking.value == pytest.approx(known, abs=1e-9)
    (torus,) = points(two_impacts, "torus")
    known = brentq(lambda d: abs(largest(d)[0]) - 1.0, 8.5, 9.2, xtol=1e-13)
    assert torus.value == pytest.approx(known, abs=1e-9)
    for orbit in two_impacts.orbits[::10]:
        theory = orbits(orbit.parameters)
        matches = [each for each in theory if abs(each.stroboscopic()[0] - orbit.state.x) < 1e-9]
        assert len(matches) == 1
        growth = abs(matches[0].multipliers[0]) ** 2
        assert abs(orbit.multipliers[0]) == pytest.approx(growth, rel=1e-8)


def test_compliant_walls_tend_to_rigid_ones(two_impacts: Branch) -> None:
    """What a stiff wall changes goes with the duration of a contact, 1 / sqrt(k)."""
    (known,) = points(two_impacts, "symmetry breaking")
    differences = []
    for stiffness in (1e6, 1e8):
        p = replace(TWO_IMPACTS, clearance=4.65, contact_stiffness_ratio=stiffness)
        branch = continue_orbit(periodic_orbit(p), "clearance", 4.59, 4.65, step=0.5)
        (found,) = points(branch, "symmetry breaking")
        differences.append(found.value - known.value)
    assert differences[0] / differences[1] == pytest.approx(10.0, rel=1e-2)
    assert abs(differences[1]) < 1e-3


def test_through_a_second_harmonic_of_no_amplitude() -> None:
    """There alone the motion is its own mirror image; beyond it is that of the one before."""
    p = replace(TWO_IMPACTS, forcing=Harmonics((1, 2), (1.0, 0.0)))
    orbit = periodic_orbit(p)
    known = orbits(TWO_IMPACTS)[0].stroboscopic()
    np.testing.assert_allclose([orbit.state.x, orbit.state.v], known, rtol=1e-10)
    branch = continue_orbit(orbit, "harmonic_2", -0.3, 0.3, step=0.2)
    assert branch.ends == tuple(f"harmonic_2 = {e} is the end of the range" for e in (-0.3, 0.3))
    assert branch.special_points == ()
    assert branch.to_dataset().harmonic_2.long_name == "amplitude of the harmonic of order 2"
    first, last = (branch.orbits[k] for k in (0, -1))
    run = start_run(first.parameters, first.state)
    run.skip(0.0, 0.5 * p.cycle)
    half = run.state_at(0.0, 0.5 * p.cycle)
    for name in ("x", "v", "y", "u"):
        assert -getattr(half, name) == pytest.approx(getattr(last.state, name), abs=1e-9)
    with pytest.raises(ValueError, match="force_amplitude from 0 to 2 in free motion"):
        continue_orbit(orbit, "force_amplitude", 0, 2)


def test_symmetry_breaks_under_odd_harmonics_alone(two_impacts: Branch) -> None:
    (known,) = points(two_impacts, "symmetry breaking")
    found = {}
    for order in (2, 3):
        p = replace(TWO_IMPACTS, clearance=4.7, forcing=Harmonics((1, order), (1.0, 0.002)))
        branch = continue_orbit(periodic_orbit(p), "clearance", 4.5, 4.75, step=0.1)
        found[order] = points(branch, "symmetry breaking")
    assert found[2] == []
    (breaking,) = found[3]
    assert 0.0 < abs(breaking.value - known.value) < 1e-3
    ranges = {"clearance": (4.5, 4.75), "harmonic_3": (0.0, 0.1)}
    curve = continue_point(breaking, ranges, step=0.2)
    without = min(curve.orbits, key=lambda orbit: value_of(orbit.parameters, "harmonic_3"))
    assert without.parameters.clearance == pytest.approx(known.value, abs=1e-9)


def test_border_of_complete_chatter() -> None:
    """The motion on one side completes, the one on the other does not."""
    p = Parameters(0.03, 0.025, 1.4, 0.5407, 0.2)
    branch = continue_orbit(
        periodic_orbit(p, settle=60), "clearance", 0.5406, 0.54075, step=0.5, max_orbits=6
    )
    border = points(branch, "complete chatter")[0]
    assert border.orbit.word == "RS LS"
    for way, completes in ((-1e-9, True), (1e-9, False)):
        beside = replace(p, clearance=border.value + way)
        assert ("S" in periodic_orbit(beside, state=border.orbit.state).word) == completes


def shrinking(r: float) -> float:
    """One over the multiplier of chatter that completes just as the contact force vanishes.

    The acceleration is then j T with the time T that is left. With the rebound speed xi j T^2 the
    next impact is after s T, where xi = s / 2 - s^2 / 6, and its own xi is r (s / 2 - s^2 / 3) over
    (1 - s)^2. This map has a fixed point, at which it grows by r^2 / (1 - s)^5.
    """
    left = brentq(lambda q: q**3 + 2.0 * q**2 - 2.0 * r * q - r, 0.0, 1.0)
    return left**5 / r**2


@pytest.mark.exhaustive
@pytest.mark.parametrize(
    ("r", "clearance", "width", "step"),
    [
        (0.2, 0.5407353334788, 1.1e-3, 0.05),
        (0.3, 0.3666215616072, 3.4e-4, 0.1),
        (0.4, 0.2454929971865, 2.4e-4, 0.3),
    ],
)
def test_distances_before_complete_chatter(
    r: float, clearance: float, width: float, step: float
) -> None:
    """Those of the touches from the border shrink by one over its multiplier, in the limit."""
    p = Parameters(0.03, 0.025, 1.4, clearance - 0.02 * width, r)
    ends = clearance - 0.04 * width, clearance + width
    branch = continue_orbit(periodic_orbit(p, settle=60), "clearance", *ends, step=step)
    (border,) = points(branch, "complete chatter")
    beyond = np.array([point.value - border.value for point in points(branch, "grazing")][-4:])
    first, second, third = beyond[:-1] / beyond[1:]
    # By Aitken's extrapolation.
    limit = first - (first - second) ** 2 / (first - 2.0 * second + third)
    assert limit == pytest.approx(shrinking(r), abs=1e-3)
    assert abs(limit - r) > 3e-3


@pytest.mark.exhaustive
def test_a_touch_of_a_compliant_wall_begins_and_ends() -> None:
    """At the same place, whichever way the branch is followed, and it turns back there."""
    p = Parameters(0.032, 0.2, 1.0807, 0.4, 0.54, contact_stiffness_ratio=1e4)
    guess = State(-1.8601, -0.9267, -1.8019, -2.0698)

    def follow(orbit: damper.PeriodicOrbit, most: int) -> Branch:
        return continue_orbit(orbit, "frequency_ratio", 1.0802, 1.0815, step=0.5, max_orbits=most)

    one = follow(periodic_orbit(p, state=guess), 5)
    other = follow(next(orbit for orbit in one.orbits if orbit.word == "R3 L3"), 12)
    (first,), (again,) = points(one, "grazing"), points(other, "grazing")
    assert first.value == pytest.approx(again.value, abs=1e-10)
    for branch in (one, other):
        assert {orbit.word for orbit in branch.orbits} == {"R2 L2", "R3 L3"}
        assert min(branch.values) > first.value - 1e-6


def curve(point: SpecialPoint, **ranges: tuple[float, float]) -> PointCurve:
    """A few points, both ways along the second parameter."""
    return continue_point(point, ranges, step=0.1, max_points=2)


@pytest.mark.parametrize(
    "other",
    [
        {"restitution": (0.6, 0.95)},
        pytest.param({"frequency_ratio": (2.6, 3.0)}, marks=pytest.mark.exhaustive),
    ],
)
def test_curves_of_the_impact_oscillator(
    oscillator: Branch, other: dict[str, tuple[float, float]]
) -> None:
    """The closed form along both parameters: of the period doubling, of grazing, of the fold."""

    def closed_form(orbit: damper.PeriodicOrbit, kind: str) -> float:
        p = orbit.parameters
        known = ImpactOscillator(p.frequency_ratio, p.restitution)
        if kind == "fold":
            return -known.fold
        return abs(known.g) if kind == "grazing" else known.period_doubling(1.0)

    branch = continue_orbit(unstable(0.97), "clearance", -1.79 - REST, -1.75 - REST)
    for point in (*oscillator.special_points, *points(branch, "fold")):
        found = curve(point, clearance=(5.0, 10.5), **other)
        assert len(found.orbits) == 5
        assert np.ptp(found.values(*other)) > 0.01
        for orbit in found.orbits:
            place = orbit.parameters.clearance + REST
            assert place == pytest.approx(closed_form(orbit, point.kind), abs=1e-11)


@pytest.mark.parametrize(("frequency_ratio", "kind"), [(1.97, "fold"), (2.03, "period doubling")])
def test_curves_from_resonant_grazing(frequency_ratio: float, kind: str) -> None:
    """They touch the curve of grazing where omega is twice the damped natural frequency.

    For any linear impact oscillator, and quadratically: Simpson and Ghosh, Resonant grazing
    bifurcations revisited, arXiv:2602.22797 (2026). Below are folds, above it period doublings.
    """
    damping_ratio = 0.05
    resonance = 2.0 * np.sqrt(1.0 - damping_ratio**2)

    def amplitude(omega: float | np.ndarray) -> float | np.ndarray:
        """That of the motion without impacts."""
        return 1.0 / np.hypot(1.0 - omega**2, 2.0 * damping_ratio * omega)

    place = 0.9 * amplitude(frequency_ratio)
    p = replace(beside_a_stop(place), damping_ratio=damping_ratio, frequency_ratio=frequency_ratio)
    last = damper.events(p, State(0.0, 0.0, REST, 0.0), until=300.0 * p.cycle)[-1]
    start = State(place - 1e-12, last["v"], REST, 0.0, last["time"] % p.cycle)
    branch = continue_orbit(
        periodic_orbit(p, state=start), "clearance", p.clearance, p.clearance + 0.3 * place
    )
    (point,) = points(branch, kind)
    ranges = {"clearance": (10.0, 11.0), "frequency_ratio": (1.94, 2.06)}
    found = continue_point(point, ranges, step=0.2, max_points=8)
    omega = found.values("frequency_ratio")
    beyond = (found.values("clearance") + REST) / amplitude(omega) - 1.0
    near = np.argsort(abs(omega - resonance))[:2]
    (a, b), (root_a, root_b) = omega[near], np.sqrt(abs(beyond[near]))
    assert (beyond > 0.0).all() == (kind == "fold")
    assert a - root_a * (b - a) / (root_b - root_a) == pytest.approx(resonance, abs=1e-5)


def test_curves_of_two_impacts(two_impacts: Branch) -> None:
    """Fold, and multipliers of half the period on the unit circle, from the closed form."""
    for kind in ("fold", "symmetry breaking", "torus"):
        (point,) = points(two_impacts, kind)
        found = curve(point, restitution=(0.3, 0.7), clearance=(1.0, 12.0))
        assert len(found.orbits) == 5
        for orbit in found.orbits:
            p = orbit.parameters
            if kind == "fold":
                assert p.clearance == pytest.approx(largest_clearance(p), abs=1e-10)
                continue
            known = min(orbits(p), key=lambda each: abs(each.displacement - at_impact(orbit)))
            critical = abs(known.multipliers) if kind == "torus" else -known.multipliers
            assert abs(critical - 1.0).min() < 1e-9


def at_impact(orbit: damper.PeriodicOrbit) -> float:
    return float(orbit.events[orbit.events["side"] == 1]["x"][0])


@pytest.mark.parametrize(
    "other",
    [
        {"clearance": (0.02, 1.0)},
        pytest.param({"frequency_ratio": (1.1, 2.0)}, marks=pytest.mark.exhaustive),
    ],
)
def test_border_of_complete_chatter_of_a_small_mass(other: dict[str, tuple[float, float]]) -> None:
    """The limit of a vanishing mass, which is bisected by itself."""
    first = periodic_orbit(Parameters(1e-6, 0.02, 1.3, 0.3, 0.437))
    branch = continue_orbit(first, "restitution", 0.437, 0.44, step=0.5, max_orbits=5)
    (border,) = points(branch, "complete chatter")
    ranges = {"restitution": (0.05, 0.95), **other}
    found = continue_point(border, ranges, step=0.1, max_points=1)
    assert np.ptp(found.values("restitution")) > 0.01
    for orbit in found.orbits:
        known = critical_restitution(reduced_gap(orbit.parameters))
        assert orbit.parameters.restitution == pytest.approx(known, abs=1e-6)


def test_a_branch_goes_on_where_nothing_damps_a_heavy_mass() -> None:
    """Two of its multipliers are 1 all along, so that the torus's function is roundoff."""
    p = Parameters(1e15, 0.0, 2.8, 10.0, 0.8)
    orbit = periodic_orbit(p, state=State(-0.28, -0.57, -10.0, 0.0))
    branch = continue_orbit(orbit, "clearance", 8.0, 10.5, step=0.1, max_orbits=15)
    assert (branch.values.min(), branch.values.max()) == (8.0, 10.5)
    assert not branch.special_points


def test_a_curve_ends_at_the_edge_of_its_ranges(oscillator: Branch) -> None:
    (grazing,) = points(oscillator, "grazing")
    ranges = {"clearance": (9.0, 10.5), "frequency_ratio": (2.8, 2.81)}
    found = continue_point(grazing, ranges, step=0.4)
    values = found.values("frequency_ratio").tolist()
    assert (values[0], values[-1]) == (2.8, 2.81)
    assert values == sorted({*values})
    assert "frequency_ratio = 2.8 is the end of the range" in found.ends[0]
    with pytest.raises(TypeError, match=r"'frequency_ration' \(did you mean 'frequency_ratio'\?\)"):
        found.values("frequency_ration")
    with pytest.raises(ValueError, match="ranges of clearance: must be of clearance, along which"):
        continue_point(grazing, {"clearance": (9.0, 10.5)})
    with pytest.raises(TypeError, match=r"unknown parameter 'restitutoin'.*mean 'restitution'"):
        continue_point(grazing, {"clearance": (9.0, 10.5), "restitutoin": (0.1, 0.9)})
    with pytest.raises(TypeError, match="must be one of a branch's special_points"):
        continue_point("grazing", {"clearance": (9.0, 10.5)})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("name", "stop", "more"),
    thinned(
        [
            ("mass_ratio", 0.2, {}),
            ("damping_ratio", 0.0, {}),
            ("phase", 1.0, {}),
            ("restitution_left", 0.2, {"restitution_left": 0.25}),
            ("yield_speed", 0.02, {"yield_speed": 0.01}),
            ("yield_exponent", 0.1, {"yield_speed": 0.01}),
            ("support_stiffness_ratio", 0.02, {"support_stiffness_ratio": 0.01}),
            ("modulation_depth", 0.0, {"modulation_depth": 0.1}),
        ],
        lambda case: case[0] not in ("damping_ratio", "phase"),
    ),
)
def test_any_parameter_of_any_model(name: str, stop: float, more: dict[str, float]) -> None:
    """The end of the branch is the motion that is found there by itself."""
    values = {**CHATTER.__dict__, "restitution": 0.3, **more}
    values = {key: value for key, value in values.items() if key in Parameters.__annotations__}
    values = {name: Parameters.__dataclass_fields__[name].default} | values
    first = periodic_orbit(Parameters(**values), settle=60)
    branch = continue_orbit(first, name, values[name], stop, step=0.2)
    end = branch.orbits[0 if stop < values[name] else -1]
    assert getattr(end.parameters, name) == stop
    known = periodic_orbit(Parameters(**{**values, name: stop}), state=end.state)
    assert end.state.x == pytest.approx(known.state.x, abs=1e-10)
    assert any(f"{name} = {stop!r} is the end of the range" in text for text in branch.ends)


def test_ends_of_the_asymmetric_branch(two_impacts: Branch) -> None:
    """Where it meets the symmetric one, whatever the range: beyond is its mirror image."""
    (breaking,) = points(two_impacts, "symmetry breaking")
    orbit = two_impacts.switch(breaking)
    for ends in ((4.2, 5.4), (4.5, 5.0), (4.6, 4.7)):
        branch = continue_orbit(orbit, "clearance", *ends)
        assert branch.ends[0] == f"clearance = {ends[0]!r} is the end of the range"
        assert branch.ends[1] == "meets symmetric motions near clearance = 4.61615"
        assert (np.diff(branch.values) > 0.0).all()
    assert branch.orbits[0].stable  # of the last one, which begins near the other end


def test_a_branch_in_si_units() -> None:
    """Along the stiffness, on which all depends: the fold is where the closed form has it."""
    p = SIParameters(2.0, 4.0, 200.0, 10.0, 10.0, 0.2, gap=0.93, restitution=0.5)
    orbit = periodic_orbit(p, state=orbits(p.dimensionless)[0].start.times(p.units))
    branch = continue_orbit(orbit, "stiffness", 180.0, 205.0, step=0.1)
    (fold,) = points(branch, "fold")
    there = fold.orbit.parameters.dimensionless
    assert there.clearance == pytest.approx(largest_clearance(there), rel=1e-10)
    data = branch.to_dataset()
    assert [data[name].units for name in ("stiffness", "x", "v")] == ["N/m", "m", "m/s"]
    np.testing.assert_array_equal(data.x, [orbit.state.x for orbit in branch.orbits])
    ranges = {"stiffness": (180.0, 205.0), "gap": (0.85, 0.95)}
    found = continue_point(fold, ranges, step=0.2, max_points=2)
    assert np.ptp(found.values("gap")) > 0.01
    for orbit in found.orbits:
        there = orbit.parameters.dimensionless
        assert there.clearance == pytest.approx(largest_clearance(there), rel=1e-10)


def test_dataset_of_several_masses() -> None:
    p = replace(TWO_IMPACTS, clearance=3.0, masses=[{}, {"mass_ratio": 0.09, "clearance": 3.6}])
    orbit = periodic_orbit(p, settle=30)
    branch = continue_orbit(orbit, "clearance_1", 3.5, 3.7, step=0.5, max_orbits=2)
    data = branch.to_dataset()
    assert data.sizes == {"orbit": len(branch.orbits), "multiplier": 6, "body": 2, "point": 0}
    for name in ("x", "y", "u"):
        states = [getattr(orbit.state, name) for orbit in branch.orbits]
        np.testing.assert_array_equal(data[name], states)
    assert data.point_y.dims == ("point", "body")


IDLE = Parameters(0.08, 0.04, 1.34, 1.85, 0.38)


@pytest.mark.parametrize(
    "more", [{}, {"contact_stiffness_ratio": 100.0}, {"modulation_depth": 0.1}]
)
def test_an_idle_mass_is_left_out_of_the_equation(more: dict[str, float]) -> None:
    """It may be anywhere, so its multipliers of 1 made the equation singular."""
    orbit = periodic_orbit(replace(IDLE, clearance=20.0, **more), settle=50)
    assert (orbit.idle, orbit.stable) == ((0,), False)
    assert "with idle masses [0]" in repr(orbit)
    branch = continue_orbit(orbit, "damping_ratio", 0.038, 0.042, step=0.2)
    assert branch.values[[0, -1]].tolist() == [0.038, 0.042]
    assert branch.idle == (0,)
    for each in branch.orbits:
        p = each.parameters
        assert each.peak == pytest.approx(steady_amplitude(p), rel=1e-12)
        assert each.state.u == 0.0


@pytest.mark.parametrize(
    ("more", "other"),
    [
        ({"forcing": Base(frame="base")}, None),
        ({"friction": 5.0}, None),
        ({"friction": 0.1}, None),
        ({"friction": 0.5, "forcing": Base(frame="base")}, None),
        ({"friction": 0.1}, {"friction": 0.2}),
    ],
    ids=["frame of a base", "rests", "slides", "slides, frame of a base", "two that slide"],
)
def test_an_idle_mass_that_moves(more: dict[str, Any], other: dict[str, float] | None) -> None:
    """Its place is no unknown, whatever moves it; runs from rest tend to the same motions."""
    p = replace(IDLE, clearance=20.0, **more, **({"masses": [{}, other]} if other else {}))
    state = State(0.0, 0.0, (0.0, 0.5), (0.0, 0.0)) if other else None
    orbit = periodic_orbit(p, state=state, settle=50)
    masses = (0, 1) if other else (0,)
    assert (orbit.idle, orbit.stable) == (masses, False)
    branch = continue_orbit(orbit, "frequency_ratio", 1.3, 1.36, step=0.2)
    assert branch.values[[0, -1]].tolist() == [1.3, 1.36]
    assert (branch.idle, branch.special_points) == (masses, ())
    for each in branch.orbits[:: len(branch.orbits) - 1]:
        assert each.change < 1e-11
        settled = periodic_orbit(each.parameters, state=state, settle=50)
        assert each.peak == pytest.approx(settled.peak, rel=1e-10)


def test_an_idle_mass_beside_one_that_hits() -> None:
    own = {name: getattr(IDLE, name) for name in ("mass_ratio", "clearance", "restitution")}
    idle = {"mass_ratio": 0.1, "clearance": 4.5, "restitution": 0.6}
    guess = State(-0.296, -1.240, 0.864, -2.065)
    alone = continue_orbit(periodic_orbit(IDLE, state=guess), "restitution", 0.36, 0.40)
    beside = replace(IDLE, masses=[own, idle])
    both = continue_orbit(
        periodic_orbit(beside, state=replace(guess, y=(guess.y, 0.3), u=(guess.u, 0.0))),
        "restitution_0",
        0.36,
        0.40,
    )
    assert (alone.idle, both.idle) == ((), (1,))
    assert both.ends == tuple(end.replace("restitution", "restitution_0") for end in alone.ends)
    assert both.values == pytest.approx(alone.values, abs=1e-9)
    peaks = [[orbit.peak for orbit in branch.orbits[::20]] for branch in (alone, both)]
    assert peaks[1] == pytest.approx(peaks[0], rel=1e-9)


def test_a_branch_ends_where_an_idle_mass_is_touched() -> None:
    """As near as the branch resolves to where the primary's amplitude is the gap that is left."""
    p = replace(IDLE, clearance=1.6)
    orbit = periodic_orbit(p, state=State(-0.1663, -1.654, 0.1, 0.0))
    branch = continue_orbit(orbit, "frequency_ratio", 1.28, 1.35, step=0.2)
    assert branch.ends[0].endswith("where the idle mass 0 is touched")
    touch = brentq(
        lambda w: steady_amplitude(replace(p, frequency_ratio=w)) - 1.5, 1.2, 1.34, xtol=1e-14
    )
    assert branch.values[0] == pytest.approx(touch, abs=1e-9)


def test_what_a_branch_shows(oscillator: Branch) -> None:
    shown = repr(oscillator)
    assert len(shown) < 300
    assert f"<Branch of {len(oscillator.orbits)} orbits, clearance" in shown
    assert len(repr(oscillator.special_points)) < 200
    ax = oscillator.plot()
    assert ax.get_xlabel().startswith("clearance")
    assert "restitution" in ax.get_title()
    assert "clearance" not in ax.get_title()
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert labels == ["stable", "not stable", "period doubling", "grazing"]
    stable, other, doubling, _ = ax.get_lines()
    # Each orbit is drawn, and lines of both kinds meet.
    drawn = np.isfinite([stable.get_ydata(), other.get_ydata()])
    assert drawn.any(axis=0).all()
    assert drawn.all(axis=0).any()
    (point,) = points(oscillator, "period doubling")
    assert doubling.get_xydata().tolist() == [[point.value, point.orbit.peak]]


def test_bad_input(oscillator: Branch) -> None:
    orbit = oscillator.orbits[0]
    with pytest.raises(TypeError, match=r"unknown parameter 'clearence'.*mean 'clearance'"):
        damper.continue_orbit(orbit, "clearence", 9.0, 10.0)
    with pytest.raises(TypeError, match="parameter = 3: must be the name of a parameter"):
        damper.continue_orbit(orbit, 3, 9.0, 10.0)  # type: ignore[arg-type]
    with pytest.raises(
        ValueError, match=r"from 1\.0 to 2\.0: must be a range with the orbit's own"
    ):
        damper.continue_orbit(orbit, "clearance", 1.0, 2.0)
    with pytest.raises(ValueError, match=r"restitution = 1\.2: must be a finite number"):
        damper.continue_orbit(orbit, "restitution", 0.5, 1.2)
    with pytest.raises(ValueError, match="step = 0"):
        damper.continue_orbit(orbit, "clearance", 9.0, 10.5, step=0.0)
    with pytest.raises(TypeError, match="point = 5: must be one of a branch's special_points"):
        oscillator.switch(5)  # type: ignore[arg-type]
    ranges: Any
    for ranges, message in (
        (None, "ranges = None: must be a mapping of two parameters"),
        ({"clearance": 4, "restitution": (0.4, 0.6)}, r"clearance = 4: must be \(low, high\)"),
        ({"clearance": (9, 10, 11), "restitution": (0.4, 0.6)}, r"must be \(low, high\)"),
    ):
        with pytest.raises(TypeError, match=message):
            damper.continue_point(oscillator.special_points[0], ranges)
