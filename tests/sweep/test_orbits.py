"""Periodic motions against closed forms, and against the runs that they are."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import damper
from damper import periodic_orbit
from damper.models import start_run
from damper.parameters import Parameters, SIParameters, State
from damper.parameters.forcing import Base, Forcing, Harmonics, NoForce, Record
from damper.parameters.named import value_of, with_values
from damper.sweep.orbits import periodic
from damper.theory.two_impacts import orbits

TWO_IMPACTS = Parameters(
    mass_ratio=0.1, damping_ratio=0.1, frequency_ratio=1.0, clearance=5.5, restitution=0.5
)

CHATTER = {"mass_ratio": 0.1, "damping_ratio": 0.02, "clearance": 0.05, "restitution": 0.3}


@pytest.mark.parametrize("stable", [True, False])
def test_two_impacts_a_period(stable: bool) -> None:
    """The unstable one has a multiplier of 2123."""
    known = next(orbit for orbit in orbits(TWO_IMPACTS) if orbit.stable == stable)
    start = known.start
    guess = State(start.x * (1 + 1e-5), start.v, start.y - 1e-3, start.u, start.time)
    found = periodic_orbit(TWO_IMPACTS, guess=guess)
    np.testing.assert_allclose([found.state.x, found.state.v], known.stroboscopic(), rtol=1e-12)
    assert found.stable == stable
    multipliers = known.multipliers**2  # those of half a period
    order = np.lexsort((-multipliers.imag, -abs(multipliers)))
    error = abs(found.multipliers - multipliers[order]).max()
    assert error < 1e-9 * abs(multipliers).max()
    assert found.events["side"].tolist() in ([1, -1], [-1, 1])


def five_points(at: Callable[[float], np.ndarray], step: float) -> np.ndarray:
    """Derivative at zero, to the fourth order."""
    return (at(-2 * step) - 8.0 * at(-step) + 8.0 * at(step) - at(2 * step)) / (12.0 * step)


@pytest.mark.parametrize("stable", [True, False])
@pytest.mark.parametrize(
    "name", ["mass_ratio", "damping_ratio", "frequency_ratio", "clearance", "restitution"]
)
def test_sensitivity_of_two_impacts(name: str, stable: bool) -> None:
    """Differences of the closed form."""

    def closed_form(way: float) -> np.ndarray:
        p = replace(TWO_IMPACTS, **{name: value + way})
        return np.array(next(each for each in orbits(p) if each.stable == stable).stroboscopic())

    value = getattr(TWO_IMPACTS, name)
    start = next(each for each in orbits(TWO_IMPACTS) if each.stable == stable).start
    found = periodic_orbit(TWO_IMPACTS, state=start).sensitivity(name)[:2]
    np.testing.assert_allclose(found, five_points(closed_form, 1e-4 * value), rtol=1e-8)


def test_an_orbit_in_si_units() -> None:
    """A derivative from a value of 0, which has no power; what is refused."""
    si = SIParameters(2.0, 4.0, 200.0, 10.0, 10.0, 0.2, 0.55, 0.5, support_stiffness=0.2)
    guess = next(orbit for orbit in orbits(TWO_IMPACTS) if orbit.stable).start
    orbit = periodic_orbit(si, state=guess.times(si.units))
    assert orbit not in {periodic_orbit(si, state=guess.times(si.units)): 1}
    scaled = periodic_orbit(si.dimensionless, state=guess).sensitivity("support_damping_ratio")
    slope = orbit.sensitivity("support_damping")
    np.testing.assert_allclose(slope, scaled / 40.0 * (0.05, 0.5, 0.05, 0.5), rtol=1e-9)
    with pytest.raises(TypeError, match=r"unknown parameter 'clearance'.*must be one of primary_m"):
        orbit.sensitivity("clearance")
    with pytest.raises(ValueError, match=r"outside the box: must be at most gap / 2 = 0.275"):
        periodic_orbit(si, state=State(0.0, 0.0, 1.0, 0.0))


@pytest.fixture(scope="module")
def uneven() -> damper.PeriodicOrbit:
    """A motion under two harmonics, of which the second breaks the mirror."""
    forcing = Harmonics((1, 2), (1.0, 0.3), (0.0, 0.7))
    orbit = periodic_orbit(replace(TWO_IMPACTS, clearance=5.0, forcing=forcing))
    assert abs(abs(orbit.events["x"]) - abs(orbit.events["x"][::-1])).max() > 0.1
    return orbit


@pytest.mark.parametrize(
    "name", ["harmonic_2", "harmonic_2_phase", "force_amplitude", "frequency_ratio", "clearance"]
)
def test_sensitivity_under_two_harmonics(uneven: damper.PeriodicOrbit, name: str) -> None:
    p, value = uneven.parameters, value_of(uneven.parameters, name)

    def beside(way: float) -> np.ndarray:
        return periodic_orbit(with_values(p, {name: value + way}), state=uneven.state).start

    found = uneven.sensitivity(name)
    np.testing.assert_allclose(found, five_points(beside, 3e-4 * value), rtol=1e-7)


#: Two unlike masses, each with two impacts a period.
UNLIKE = Parameters(
    mass_ratio=0.1,
    damping_ratio=0.1,
    frequency_ratio=1.0,
    clearance=3.0,
    restitution=0.5,
    masses=[{}, {"mass_ratio": 0.09, "clearance": 3.6, "gravity": 0.05, "restitution": 0.5}],
)


#: With dry friction: both rest off the walls, slide both ways, and move each other.
BOTH_REST = Parameters(
    mass_ratio=0.13,
    damping_ratio=0.084,
    frequency_ratio=0.83,
    clearance=2.8,
    restitution=0.54,
    friction=0.37,
    masses=[{}, {"mass_ratio": 0.26, "clearance": 1.3, "friction": 0.23}],
)
#: Near its motion.
NEAR = State(-3.91, -0.28, [-4.47, -5.12], [-2.87, 1.63])


@pytest.mark.parametrize(
    ("p", "word", "names"),
    [
        (UNLIKE, "R1 L1 | R1 L1", ["clearance", "clearance_1", "mass_ratio_0", "restitution_1"]),
        (
            SIParameters.of(UNLIKE, 2.0, 200.0, 10.0),
            "R1 L1 | R1 L1",
            ["gap_1", "free_mass_1", "stiffness", "gravity_1", "force_amplitude"],
        ),
        (BOTH_REST, "R1 L1 | R2 L2", ["friction", "friction_1", "clearance_1", "mass_ratio_1"]),
    ],
    ids=["dimensionless", "SI", "dry friction"],
)
def test_sensitivity_of_several_masses(
    p: Parameters | SIParameters, word: str, names: list[str]
) -> None:
    """By what all have, and by what one of them has of its own or takes from all."""
    orbit = periodic_orbit(p, state=NEAR if p == BOTH_REST else None)
    assert orbit.word == word
    for name in names:
        value = value_of(p, name)

        def beside(way: float, name: str = name, value: float = value) -> np.ndarray:
            return periodic_orbit(with_values(p, {name: value + way}), state=orbit.state).start

        known = five_points(beside, 3e-4 * (value or 1.0))
        found = orbit.sensitivity(name)
        np.testing.assert_allclose(found, known, rtol=0, atol=1e-7 * abs(known).max(), err_msg=name)


@pytest.mark.parametrize(("clearance", "vanish"), [(2.9, 2), (2.8, 1)])
def test_rests_of_two_masses(clearance: float, vanish: int) -> None:
    """At the same time they take two directions, one after the other one."""
    orbit = periodic_orbit(replace(BOTH_REST, clearance=clearance), state=NEAR)
    happens = set(zip(orbit.events["kind"].tolist(), orbit.events["body"].tolist(), strict=True))
    assert happens == {(kind, body) for kind in (0, 4, 5, 6) for body in (0, 1)}
    assert np.count_nonzero(abs(orbit.multipliers) < 1e-12) == vanish


def test_sensitivity_from_no_friction_of_several_masses() -> None:
    """One-sided differences, of runs with the events of friction."""
    orbit = periodic_orbit(UNLIKE)
    for name in ("friction", "friction_1"):
        at = [
            periodic_orbit(with_values(UNLIKE, {name: 1e-4 * k}), state=orbit.state).start
            for k in range(5)
        ]
        known = np.dot([-25.0, 48.0, -36.0, 16.0, -3.0], at) / 12e-4
        found = orbit.sensitivity(name)
        np.testing.assert_allclose(found, known, rtol=0, atol=1e-7 * abs(known).max())


def test_masses_in_step_are_sensitive_as_one() -> None:
    """A parameter that parts them is refused, and so is what is no parameter."""
    start = next(orbit for orbit in orbits(TWO_IMPACTS) if orbit.stable).start
    twice = State(start.x, start.v, [start.y] * 2, [start.u] * 2, start.time)
    one = periodic_orbit(TWO_IMPACTS, state=start)
    masses = [{"mass_ratio": 0.03}, {"mass_ratio": 0.07}]
    both = periodic_orbit(replace(TWO_IMPACTS, masses=masses), state=twice)
    for name, same in (("clearance", "clearance"), ("mass_ratio_1", "mass_ratio")):
        known = one.sensitivity(same)[[0, 1, 2, 3, 2, 3]]
        np.testing.assert_allclose(both.sensitivity(name), known, rtol=1e-9)
    for refused in (both.sensitivity, lambda name: damper.continue_orbit(both, name, 5.0, 6.0)):
        with pytest.raises(ValueError, match=r"^clearance_1 parts the masses 0 and 1, which move "):
            refused("clearance_1")
        with pytest.raises(TypeError, match=r"^initial_position_1 is where a run starts"):
            refused("initial_position_1")
        with pytest.raises(TypeError, match=r"^unknown parameter 'clearance_2' .*'clearance_1'"):
            refused("clearance_2")


#: With dry friction: two impacts on each wall that it stops between; one on each, begun at rest.
RUBBING = {
    "begins in a slide": Parameters(0.1, 0.05, 1.06, 1.2, 0.4, 3.6, friction=0.6),
    "begins at rest": Parameters(0.1, 0.13, 1.17, 0.8, 0.4, 5.9, friction=0.6),
}


@pytest.mark.parametrize("name", RUBBING)
def test_multipliers_and_sensitivities_with_dry_friction(name: str) -> None:
    """Against differences of the period's map, and of motions beside; a rest takes a direction."""
    p = RUBBING[name]
    orbit = periodic_orbit(p)
    assert {0, 4, 5, 6} == set(orbit.events["kind"])
    assert orbit.word == ("R1 L1" if name == "begins at rest" else "R2 L2")
    assert (orbit.state.v == orbit.state.u) == (name == "begins at rest")
    assert abs(orbit.multipliers[3]) < 1e-12 < abs(orbit.multipliers[2])
    ways = np.eye(4)
    if name == "begins at rest":
        # A part of a second order would be that of the slide to this rest.
        ways = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0]])
    for way in ways:
        known = five_points(lambda step, way=way: after_a_period(orbit, step * way), 1e-4)  # type: ignore[misc]
        np.testing.assert_allclose(orbit.derivative @ way, known, rtol=0, atol=1e-8)
    for quantity in ("friction", "clearance", "mass_ratio", "frequency_ratio"):
        value = value_of(p, quantity)

        def beside(way: float, quantity: str = quantity, value: float = value) -> np.ndarray:
            return periodic_orbit(with_values(p, {quantity: value + way}), state=orbit.state).start

        slope = five_points(beside, 1e-4 * value)
        np.testing.assert_allclose(orbit.sensitivity(quantity), slope, rtol=1e-6, atol=1e-7)


def after_a_period(orbit: damper.PeriodicOrbit, deviation: np.ndarray) -> np.ndarray:
    run = start_run(orbit.parameters, State(*(orbit.start + deviation)), accuracy=1e-15)
    run.skip(1.0)
    end = run.state_at(1.0)
    return np.array([end.x, end.v, end.y, end.u])


@pytest.mark.parametrize("name", RUBBING)
def test_a_list_of_masses_that_rub_is_the_damper_with_friction(name: str) -> None:
    """One of them; two in step, of which what parts them has no bounds."""
    alone = periodic_orbit(RUBBING[name])
    x, v, y, u = alone.start
    for masses in ([{}], [{"mass_ratio": 0.03}, {"mass_ratio": 0.07}]):
        count = len(masses)
        start = State(x, v, [y] * count, [u] * count)
        orbit = periodic_orbit(replace(RUBBING[name], masses=masses), state=start)
        np.testing.assert_allclose(orbit.derivative[:4, :4], alone.derivative, atol=1e-12)
        np.testing.assert_allclose(orbit.multipliers[-4:], alone.multipliers, atol=1e-12)
        assert np.isinf(orbit.multipliers[:-4]).all()
        for quantity in ("friction", "clearance", "frequency_ratio"):
            known = alone.sensitivity(quantity)[[0, 1, *[2, 3] * count]]
            found = orbit.sensitivity(quantity)
            np.testing.assert_allclose(found, known, atol=1e-9 * abs(known).max())
    with pytest.raises(ValueError, match=r"^friction_1 parts the masses 0 and 1, which move in"):
        orbit.sensitivity("friction_1")


def test_masses_in_one_state_with_unlike_supports_do_not_move_in_step() -> None:
    """Both rest on one wall throughout; in step their supports would have no derivatives."""
    p = replace(TWO_IMPACTS, gravity=9.0, masses=[{}, {"support_stiffness_ratio": 0.004}])
    rest = State(0.0, 0.0, [-p.clearance] * 2, [0.0] * 2)

    def start(way: float) -> np.ndarray:
        changed = with_values(p, {"support_stiffness_ratio_1": 0.004 + way})
        return periodic_orbit(changed, state=rest).start

    found = periodic_orbit(p, state=rest).sensitivity("support_stiffness_ratio_1")
    np.testing.assert_allclose(found, five_points(start, 1e-4), rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize(("clearance", "friction"), [(5.0, 0.0), (1.0, 0.5)])
def test_an_orbit_in_the_frame_of_the_base(clearance: float, friction: float) -> None:
    """It differs by the base's own motion, (0, omega) at time 0, and so does each derivative."""
    p = replace(TWO_IMPACTS, clearance=clearance, friction=friction)
    ground, base = (periodic_orbit(replace(p, forcing=Base(frame))) for frame in ("ground", "base"))
    assert (4 in base.events["kind"]) == (friction > 0.0)
    moves = np.array([0.0, 1.0, 0.0, 1.0])
    np.testing.assert_allclose(ground.start - base.start, moves, atol=1e-10)
    np.testing.assert_allclose(ground.multipliers, base.multipliers, rtol=1e-9, atol=1e-14)
    for name in ("frequency_ratio", "damping_ratio", "clearance", "friction"):
        change = ground.sensitivity(name) - base.sensitivity(name)
        known = moves * (name == "frequency_ratio")
        np.testing.assert_allclose(change, known, atol=1e-8)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (
            {"forcing": Record([0.0, 1.0], [0.0, 1.0])},
            "an orbit under a record: the force does not",
        ),
        ({"forcing": NoForce()}, r"an orbit in free motion \(forcing = none\)"),
        ({"force_amplitude": 0.0}, r"an orbit in free motion \(force_amplitude = 0\)"),
    ],
)
def test_an_orbit_needs_a_force_that_repeats(
    more: dict[str, Forcing | float], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        damper.periodic_orbit(replace(TWO_IMPACTS, **more))


@pytest.mark.parametrize("phase", [0.0, 2.2])
def test_sensitivity_through_chatter(phase: float) -> None:
    """The phase decides whether the motion starts in flight or in contact, where y is x + d."""
    p = Parameters(frequency_ratio=1.3, phase=phase, **CHATTER)
    orbit = periodic_orbit(p, settle=100)
    assert (orbit.state.v == orbit.state.u) == (phase > 0.0)

    def beside(way: float) -> np.ndarray:
        wider, state = replace(p, clearance=p.clearance + way), orbit.state
        y = state.x + (state.y - state.x) * wider.clearance / p.clearance
        return periodic_orbit(wider, state=replace(state, y=y)).start

    np.testing.assert_allclose(orbit.sensitivity("clearance"), five_points(beside, 1e-4), atol=1e-8)


FRAME = SIParameters(
    primary_mass=100.0,
    damping=800.0,
    stiffness=4e6,
    force_amplitude=200.0,
    forcing_frequency=189.0,
    free_mass=10.0,
    gap=0.92e-3,
    restitution=0.3,
)
#: Weight presses its free mass against one of two compliant walls.
PRESSED = Parameters(0.1, 0.05, 1.05, 4.0, 0.5, gravity=0.05, contact_stiffness_ratio=400.0)


@pytest.mark.parametrize(
    ("p", "names"),
    [
        (FRAME, ("gap", "free_mass", "stiffness", "force_amplitude", "forcing_frequency")),
        (Parameters(frequency_ratio=1.3, **CHATTER), ("clearance", "mass_ratio", "damping_ratio")),
        (PRESSED, ("gravity", "clearance", "contact_stiffness_ratio")),
    ],
)
def test_slope_of_the_largest_displacement(
    p: Parameters | SIParameters, names: tuple[str, ...]
) -> None:
    """Against peaks that the observer finds, and against differences of orbits beside."""
    orbit = periodic_orbit(p)
    values = {q.name: (getattr(p, q.name), q.default) for q in type(p).quantities}
    given = {name: value for name, (value, default) in values.items() if value != default}
    cube = damper.simulate(**given, transient=600, periods=2, observers=["response"])
    assert orbit.peak == pytest.approx(cube.peak_displacement.item(), rel=1e-9)
    for name in names:
        value = getattr(p, name)

        def peak(way: float, name: str = name, value: float = value) -> float:
            beside = replace(p, **{name: value * (1.0 + way)})
            return periodic_orbit(beside, state=orbit.state).peak

        slope = orbit.peak_sensitivity(name)
        assert slope == pytest.approx(five_points(peak, 1e-4) / value, rel=1e-6)


def test_a_sensitivity_without_bound_is_refused() -> None:
    """A free mass that nothing touches may be anywhere."""
    orbit = periodic_orbit(replace(TWO_IMPACTS, clearance=50.0))
    with pytest.raises(ValueError, match="no derivative by restitution: a multiplier is 1 at <Per"):
        orbit.sensitivity("restitution")
    with pytest.raises(TypeError, match=r"unknown parameter 'restitutoin'.*mean 'restitution'"):
        orbit.sensitivity("restitutoin")


def test_a_parameter_that_is_left_out_has_no_derivative() -> None:
    """The left wall's restitution changes the motion; left out, its derivative was 0."""
    orbit = periodic_orbit(replace(TWO_IMPACTS, clearance=5.0))
    alike = periodic_orbit(replace(orbit.parameters, restitution_left=0.5), state=orbit.state)
    own = alike.peak_sensitivity("restitution_left") + alike.peak_sensitivity("restitution")
    assert own == pytest.approx(orbit.peak_sensitivity("restitution"), rel=1e-9)
    for name in ("restitution_left", "yield_speed"):
        with pytest.raises(ValueError, match=f"no derivative by {name}: it is inf; give it a fin"):
            orbit.sensitivity(name)


@pytest.mark.parametrize(
    "more",
    [{}, {"support_stiffness_ratio": 0.01}, {"modulation_depth": 0.2}, {"yield_speed": 0.01}],
    ids=["rigid", "grounded", "time-varying", "yielding"],
)
def test_completed_chatter_leaves_two_directions(more: dict[str, float]) -> None:
    p = Parameters(frequency_ratio=1.3, **CHATTER, **more)
    orbit = periodic_orbit(p, settle=100)
    assert set(orbit.events["kind"]) == {0, 1, 2}
    assert orbit.stable
    assert (abs(orbit.multipliers[2:]) < 1e-12).all()
    run = start_run(p, orbit.state)
    run.skip(10.0)
    end = run.state_at(10.0)
    for name in ("x", "v", "y", "u"):
        assert getattr(end, name) == pytest.approx(getattr(orbit.state, name), abs=1e-10)


def test_what_is_not_found_is_said() -> None:
    resonant = Parameters(
        mass_ratio=0.1, damping_ratio=0.0, frequency_ratio=1.0, clearance=1e9, restitution=0.5
    )
    with pytest.raises(ValueError, match="no motion of period 1 found: the search stopped at"):
        periodic_orbit(resonant, settle=1)


def test_a_period_that_is_none_of_the_free_mass_is_refused() -> None:
    more = {"modulation_depth": 0.2, "modulation_order": 2}
    with pytest.raises(ValueError, match="a multiple of modulation_order = 2"):
        periodic_orbit(Parameters(frequency_ratio=1.3, **CHATTER, **more))


def test_a_run_that_does_not_settle_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its motion would be that of the last segment, carried on for ever."""
    monkeypatch.setattr(periodic, "start_run", partial(start_run, max_events=20))
    with pytest.raises(ValueError, match="settle = 100: the run stopped early, max_events"):
        periodic_orbit(replace(TWO_IMPACTS, clearance=5.0), settle=100)
    with pytest.raises(TypeError, match=r"state = \(0, 0, 0, 0\): must be a damper.State"):
        periodic_orbit(TWO_IMPACTS, state=(0, 0, 0, 0))


@pytest.mark.parametrize("period", [0, 1001, 10**9])
def test_a_period_without_bounds_is_refused(period: int) -> None:
    with pytest.raises(ValueError, match=f"period = {period}: must be a whole .* >= 1 and <= 1000"):
        periodic_orbit(TWO_IMPACTS, period)
