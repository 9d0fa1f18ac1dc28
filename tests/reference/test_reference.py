"""Tests of the references themselves: known numbers, and agreement with each other."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from mpmath import mp, mpf

from damper.comparison import reference_rigid as mp_reference
from damper.comparison.reference_rigid import Event, Parameters, events

from . import dop853, fine_step
from .accumulation import (
    accumulation_time,
    kinematic_accumulation_time,
    small_mass_burst_completes,
    small_mass_critical_restitution,
)
from .two_impacts import coefficients, two_impacts


def of_kind(found: list[Event], kind: str) -> list[Event]:
    """Return the events of one kind."""
    return [event for event in found if event.kind == kind]


def digits(value: mpf, printed: str) -> bool:
    """Tell whether a value rounds to the printed decimals."""
    places = len(printed.split(".")[1])
    with mp.workdps(60):
        return abs(value - mpf(printed)) <= mpf(10) ** -places / 2


def decimals(*printed: str) -> list[mpf]:
    """Return decimal parameters that are not rounded to doubles first.

    The printed event times belong to these: the doubles nearest to .1, .05, .2, .6 shift them by
    some 1e-16 at the first impacts and by 3e-14 at the end of the burst.
    """
    with mp.workdps(80):
        return [mpf(text) for text in printed]


# --- known numbers: the events of two scenes


@pytest.fixture(scope="module")
def complete_burst() -> list[Event]:
    """Events of a scene whose second half holds a complete burst."""
    return events(*decimals("0.1", "0.05", "0.2", "0.25", "0.6"), until=46.5)


def test_first_impacts(complete_burst: list[Event]) -> None:
    first = of_kind(complete_burst, "impact")[:3]
    printed = ["2.15860318928243951", "5.25460925811892195", "14.2978156676934251"]
    assert [event.side for event in first] == [-1, 1, 1]
    assert all(digits(event.time, text) for event, text in zip(first, printed, strict=True))


def test_burst_end_and_release(complete_burst: list[Event]) -> None:
    rest = [event for event in complete_burst if event.kind != "impact"]
    assert [(event.kind, event.side) for event in rest] == [("stick", 1), ("release", 1)]
    assert digits(rest[0].time, "44.249718778208865")
    assert digits(rest[1].time, "46.2709500002439")


def test_low_restitution_burst_and_release() -> None:
    scene = decimals("0.1", "0.05", "0.2", "0.25", "0.3")
    rest = [event for event in events(*scene, until=20) if event.kind != "impact"]
    assert [event.kind for event in rest] == ["stick", "release"]
    assert digits(rest[0].time, "17.868561780955439")
    assert digits(rest[1].time, "18.992457098508703")


def test_low_restitution_count_of_bursts() -> None:
    """39 bursts in 20 periods, then two a period: 399 in 200 periods."""
    period = 2 * np.pi / 0.2
    run = events(0.1, 0.05, 0.2, 0.25, 0.3, until=20 * period, dps=15, burst_floor=1e-9)
    assert len(of_kind(run, "stick")) == 39
    released = [float(event.time) for event in of_kind(run, "release")]
    drift = np.abs(np.array(released[2:]) - released[:-2] - period)
    assert drift[-1] < 1e-10  # the orbit has become periodic, and ever more so
    assert np.all(drift[10:] < 0.7 * drift[9:-1])


# --- known numbers: accumulation


SCENE = (0.5, 0.2, 0.3, 0.6)
ON_WALL = {"time": 2, "position": 2, "velocity": 0.1}


@pytest.mark.parametrize(("w", "printed"), [(0.01, "0.0340400694"), (0.005, "0.0169819753")])
def test_accumulation_time(w: float, printed: str) -> None:
    value = accumulation_time(*SCENE, **ON_WALL, rebound_speed=w)
    assert abs(value - mpf(printed)) < 0.51e-10


def test_accumulation_formulas() -> None:
    """First and second order, and the common velocity: the errors fall as they should."""
    mu, zeta, omega, r = SCENE
    t, x, v = (ON_WALL[name] for name in ("time", "position", "velocity"))
    p = Parameters(*(mpf(value) for value in (mu, zeta, omega, 1, r, 0)))
    errors = []
    with mp.workdps(40):
        for w in (mpf("0.01"), mpf("0.005")):
            exact = accumulation_time(*SCENE, **ON_WALL, rebound_speed=w)
            a = -(mp.sin(p.omega * t) - 2 * p.zeta * v - x)
            j = p.omega * mp.cos(p.omega * t) + 2 * p.zeta * a - v
            first = 2 * w / (a * (1 - p.r))
            second = first + mpf(4) / 3 * j * w**2 / (a**3 * (1 - p.r) ** 2)
            second -= 4 * p.zeta * mu * p.r * w**2 / ((1 + mu) * a**2 * (1 - p.r) ** 2)
            run = events(
                *SCENE[:3], 1.0, r, state=(x, v, x + 1, v - w), start_time=t, until=t + 0.1
            )
            stuck = of_kind(run, "stick")[0]
            assert abs(stuck.time - t - exact) < mpf(10) ** -38
            common = v - p.mu * w / (1 + p.mu)
            shared = mp_reference.stick_flow(p, mpf(t), mpf(x), common, exact)
            own = mp_reference.stick_flow(p, mpf(t), mpf(x), mpf(v), exact)
            errors.append([first - exact, second - exact, shared[0] - stuck.x, own[1] - stuck.v])
        ratios = [float(coarse / fine) for coarse, fine in zip(*errors, strict=True)]
    assert ratios[:2] == pytest.approx([4.06, 8.07], abs=0.006)
    assert ratios[2] > 7.8  # x along the sticking flow: third order
    assert ratios[3] == pytest.approx(2, abs=0.05)  # the primary's own velocity: first order only


@pytest.mark.parametrize(
    ("r", "w", "printed"), [(0.6, 0.05, "0.26156342"), (0.8, 0.025, "0.26157446")]
)
def test_kinematic_accumulation_time(r: float, w: float, printed: str) -> None:
    assert abs(kinematic_accumulation_time(1, 0.5, r, w) - mpf(printed)) < 0.51e-8


@pytest.mark.parametrize(
    ("gap", "printed"), [(0.05, 0.7918), (0.1, 0.7060), (0.2, 0.5918), (0.5, 0.3944), (1, 0.2189)]
)
def test_small_mass_critical_restitution(gap: float, printed: float) -> None:
    assert small_mass_burst_completes(gap, printed - 5e-5)
    assert not small_mass_burst_completes(gap, printed + 5e-5)


def test_small_mass_critical_restitution_by_bisection() -> None:
    assert small_mass_critical_restitution(1) == pytest.approx(0.218920, abs=2e-6)


# --- known numbers: two impacts per cycle


def test_two_impacts_numbers() -> None:
    stable, unstable = two_impacts(0.1, 0.1, 1.0, 5.5, 0.5)
    assert stable.speed == pytest.approx(4.594001326355, abs=1e-12)
    assert stable.x0 == pytest.approx(1.716240408729, abs=1e-12)
    assert stable.approach_speed == pytest.approx(6.737868611987, abs=1e-12)
    assert stable.peak == pytest.approx(2.58569621, abs=6e-9)
    assert stable.forcing_phase == pytest.approx(4.3308, abs=5e-5)
    assert np.abs(stable.multipliers).max() == pytest.approx(0.727671, abs=6e-7)
    assert unstable.speed == pytest.approx(0.318, abs=5e-4)
    assert np.abs(unstable.multipliers).max() == pytest.approx(46, abs=0.5)
    assert stable.admissible
    assert unstable.admissible


@pytest.mark.parametrize("which", [0, 1])
def test_two_impacts_against_events(which: int) -> None:
    orbit = two_impacts(0.1, 0.1, 1.0, 5.5, 0.5)[which]
    found = events(
        0.1, 0.1, 1.0, mpf(5.5), 0.5, orbit.forcing_phase, _inside(orbit.state), until=6.5, dps=20
    )
    assert [event.side for event in found] == [-1, 1]
    for k, event in enumerate(found, start=1):
        error = 1e-12 * 50.0 ** (k * which)
        assert float(event.time) == pytest.approx(k * np.pi, abs=error)
        assert float(event.approach_speed) == pytest.approx(orbit.approach_speed, abs=error)
        assert float(event.x) == pytest.approx((-1) ** k * orbit.x0, abs=error)


def _inside(state: tuple[float, float, float, float]) -> tuple[float, float, mpf, float]:
    """Put the free mass of an orbit exactly on the right wall at 5.5, whatever the rounding."""
    x, v, _, u = state
    return x, v, mpf(x) + mpf(5.5), u


def test_two_impacts_slow_invariant_manifold() -> None:
    omega, r, d = 0.8, 0.6, 1.0
    rho = 2 / np.pi * (1 - r) / (1 + r)
    xi = coefficients(0.0, 0.05, omega, r).amplitude / d
    for orbit in two_impacts(0.0, 0.05, omega, d, r):
        theta = (orbit.x0 + d) / d
        assert xi**2 == pytest.approx((theta - 1) ** 2 + (rho * theta) ** 2, rel=1e-12)


def test_two_impacts_singular() -> None:
    with pytest.raises(ValueError, match="singular"):
        coefficients(0.1, 0.0, 1.0, 0.5)


# --- agreement of independent methods, event by event


SCENES = {
    "plain": (0.1, 0.05, 0.8, 1.0, 0.6),
    "another": (0.1, 0.02, 1.2, 1.0, 0.7),
    "resonance, undamped": (0.1, 0.0, 1.0, 3.0, 0.6),
    "critical damping": (0.1, 1.0, 0.7, 0.4, 0.8),
    "over-damped": (0.2, 3.0, 0.5, 0.2, 0.9),
    "heavy free mass": (2.0, 0.1, 1.3, 0.5, 0.8),
    "elastic": (0.05, 0.2, 0.9, 1.0, 1.0),
}


@pytest.mark.parametrize("name", SCENES)
def test_three_methods_agree(name: str) -> None:
    scene = SCENES[name]
    exact = events(*scene, until=50, dps=30, max_impacts=18)
    end = float(exact[-1].time) + 0.01
    for method, early, late in ((fine_step, 1e-11, 1e-9), (dop853, 1e-11, 1e-9)):
        found = method.impacts(*scene, until=end)
        assert [hit.side for hit in found] == [event.side for event in exact]
        errors = [
            max(
                abs(float(hit.time - event.time)),
                abs(float(hit.approach_speed - event.approach_speed)),
            )
            for hit, event in zip(found, exact, strict=True)
        ]
        assert max(errors[:5]) < early
        assert max(errors) < late


def test_methods_refuse_chatter() -> None:
    for method in (fine_step, dop853):
        with pytest.raises(fine_step.ChatterError):
            method.impacts(0.1, 0.05, 0.2, 0.25, 0.6, until=46)


def test_precision_and_floor_do_not_matter(complete_burst: list[Event]) -> None:
    scene = decimals("0.1", "0.05", "0.2", "0.25", "0.6")
    other = events(*scene, until=46.5, dps=35, burst_floor=1e-15)
    for kind, error in (("impact", 1e-32), ("stick", 1e-26), ("release", 1e-26)):
        pairs = zip(of_kind(complete_burst, kind), of_kind(other, kind), strict=False)
        assert max(abs(a.time - b.time) for a, b in pairs) < error
    assert len(of_kind(complete_burst, "impact")) > len(of_kind(other, "impact"))


def test_doubles_against_decimals(complete_burst: list[Event]) -> None:
    """How far the rounding of the parameters alone moves the printed times."""
    rounded = events(0.1, 0.05, 0.2, 0.25, 0.6, until=46.5, dps=30)
    shifts = [
        abs(float(of_kind(rounded, kind)[0].time - of_kind(complete_burst, kind)[0].time))
        for kind in ("impact", "stick", "release")
    ]
    assert shifts == pytest.approx([4.5196e-17, 3.2903e-14, 6.3163e-15], rel=1e-3)


# --- the flow against closed forms


@pytest.mark.parametrize(
    ("zeta", "omega"), [(0.0, 1.0), (0.0, 0.5), (0.3, 1.0), (1.0, 2.0), (4.0, 0.3)]
)
def test_taylor_flow_against_closed_form(zeta: float, omega: float) -> None:
    with mp.workdps(40):
        z, om, tau = mpf(zeta), mpf(omega), mpf("0.3")
        p = Parameters(mpf(0), z, om, mpf(1), mpf(1), mpf(0))
        x0, v0 = mpf("0.7"), mpf("-0.4")
        taylor = mp_reference.horner(mp_reference.taylor(p, mpf(1), mpf(0), x0, v0, 70), tau)

        def steady(t: mpf) -> mpf:
            if z == 0 and om == 1:
                return -t * mp.cos(t) / 2
            return mp.im(mp.expj(om * t) / (1 - om**2 + 2j * z * om))

        h0, h1 = x0 - steady(mpf(0)), v0 - mp.diff(steady, 0)
        if z == 1:
            free = mp.exp(-tau) * (h0 + (h1 + h0) * tau)
        else:
            root = mp.sqrt(mp.mpc(z**2 - 1))
            fast, slow = -z - root, -z + root
            free = (h1 - fast * h0) * mp.exp(slow * tau) - (h1 - slow * h0) * mp.exp(fast * tau)
            free = mp.re(free / (slow - fast))
        assert abs(free + steady(tau) - taylor[0]) < mpf(10) ** -25


# --- the ordinary cases that have a rule each


def test_no_clearance_has_no_events() -> None:
    assert events(0.1, 0.05, 0.2, 0.0, 0.6, until=50) == []


def test_start_outside_is_refused() -> None:
    with pytest.raises(ValueError, match="outside"):
        events(0.1, 0.05, 0.2, 0.5, 0.6, state=(0, 0, 1, 0), until=50)


def test_plastic_impact_sticks_at_once_or_flies() -> None:
    found = events(0.1, 0.05, 0.2, 0.25, 0.0, until=100)
    kinds = [event.kind for event in found]
    for event, following in pairwise(found):
        if event.kind == "stick":
            assert following.kind == "release"
            assert following.side == event.side
        if event.kind == "impact":
            force = np.sin(0.2 * float(event.time)) - 0.1 * float(event.v) - float(event.x)
            assert (following.kind == "stick") == (-event.side * force > 0)
            assert (following.time == event.time) == (following.kind == "stick")
    assert kinds.count("stick") > 3


def test_elastic_impacts_never_stick() -> None:
    found = events(0.1, 0.05, 0.2, 0.25, 1.0, until=60, dps=20)
    assert {event.kind for event in found} == {"impact"}


def test_release_is_where_the_acceleration_vanishes(complete_burst: list[Event]) -> None:
    with mp.workdps(60):
        event = of_kind(complete_burst, "release")[0]
        zeta, omega = decimals("0.05", "0.2")
        force = mp.sin(omega * event.time) - 2 * zeta * event.v - event.x
        assert abs(force) < mpf(10) ** -48


def test_start_on_a_wall() -> None:
    scene = (0.1, 0.05, 0.2, 0.5, 0.6)
    hit = events(*scene, state=(0, 0, 0.5, 0.25), until=1)[0]
    assert (hit.kind, hit.side, hit.time, hit.approach_speed) == ("impact", 1, 0, 0.25)
    leaving = events(*scene, state=(0, 0, 0.5, -1), until=5)[0]
    assert (leaving.kind, leaving.side) == ("impact", -1)
    pushed = events(*scene, state=(1, 0, 1.5, 0), until=1)[0]  # wall accelerates to the left
    assert (pushed.kind, pushed.side, pushed.time) == ("stick", 1, 0)
    free = events(*scene, state=(1, 0, 0.5, 0), until=5)[0]  # left wall moves away from it
    assert (free.kind, free.side) == ("impact", 1)
    assert abs(free.x) < mpf(10) ** -48
    # at rest in the origin the acceleration is 0: the third derivative (positive) decides
    lifted = events(*scene, state=(0, 0, 0.5, 0), until=10)[0]
    assert lifted.kind == "impact"
    assert lifted.time > 0.5
    held = events(*scene, state=(0, 0, -0.5, 0), until=20)
    assert [(event.kind, event.side) for event in held[:2]] == [("stick", -1), ("release", -1)]
    assert held[0].time == 0
    assert held[1].time > 0.5
