"""Two impacts per period against 50 digits, an independent closed form, and the engine."""

import math
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import damper
from damper.models import start_run
from damper.sweep.runs import run_points
from damper.theory.two_impacts import Orbit, orbits

EXAMPLE = damper.Parameters(0.1, 0.1, 1.0, 5.5, 0.5)
#: Stable and unstable ones, light and heavy damping, below and above resonance.
SCENES = [
    EXAMPLE,
    damper.Parameters(0.1, 0.02, 0.8, 5.0, 0.3),
    damper.Parameters(0.1, 0.02, 1.15, 5.0, 0.6, phase=1.0),
    damper.Parameters(0.3, 0.0, 1.0, 3.0, 0.7, phase=-2.0),
    damper.Parameters(2.0, 0.3, 1.7, 0.2, 0.9),
    damper.Parameters(0.01, 1.5, 0.6, 0.3, 0.8),
    damper.Parameters(0.001, 0.05, 0.3, 1.0, 0.2),
]


def exact_speeds(p: damper.Parameters) -> list[mpf]:
    """Speeds of the free mass in 50 digits, from steady plus free motion."""
    with mp.workdps(60):
        mu, z, w, d, r = (
            mpf(x)
            for x in (p.mass_ratio, p.damping_ratio, p.frequency_ratio, p.clearance, p.restitution)
        )
        flow = mp.expm(mp.matrix([[0, 1], [-1, -2 * z]]) * mp.pi / w) + mp.eye(2)
        free = mp.lu_solve(flow, mp.matrix([0, 1]))
        amplitude = 1 / mp.sqrt((1 - w**2) ** 2 + (2 * z * w) ** 2)
        s = mp.pi / (2 * w) - 2 * mu * free[0]
        c = ((2 * mu * r - 1 + r) / (1 + r) - 2 * mu * free[1]) / w
        square = s**2 + c**2
        root = mp.sqrt((s * d) ** 2 - square * (d**2 - amplitude**2))
        return [v for v in ((s * d + root) / square, (s * d - root) / square) if v > 0]


def test_stated_example() -> None:
    fast, slow = orbits(EXAMPLE)
    assert fast.speed == pytest.approx(4.594001326355, abs=5e-13)
    assert fast.displacement == pytest.approx(1.716240408729, abs=5e-13)
    assert fast.approach_speed == pytest.approx(6.737868611987, abs=5e-13)
    assert fast.peak == pytest.approx(2.58569621, abs=5e-9)
    assert fast.forcing_phase == pytest.approx(4.3308, abs=5e-5)
    assert abs(fast.multipliers[0]) == pytest.approx(0.727671, abs=5e-7)
    assert fast.stable
    assert slow.speed == pytest.approx(0.318, abs=5e-4)
    assert abs(slow.multipliers[0]) == pytest.approx(46.0, abs=0.1)
    assert not slow.stable


@pytest.mark.parametrize(
    ("mu", "zeta", "omega", "d", "r", "digits"),
    [
        (0.1, 0.1, 1.0, 5.5, 0.5, 1e-14),
        (0.1, 1e-5, 1.0, 5.5, 0.5, 1e-13),
        (0.1, 1e-9, 1.0 + 1e-7, 12.0, 0.9, 1e-13),
        (5.0, 0.0, 2.3, 0.1, 0.3, 1e-14),
        (1e-4, 2.0, 0.7, 0.3, 0.8, 1e-14),
        (0.2, 10.0, 0.4, 0.02, 0.6, 1e-13),
        # 1/omega nearly odd and hardly damped: half a period nearly mirrors the motion.
        (1e-6, 1e-4, 1.0 / 3.0, 0.5, 0.6, 1e-10),
    ],
)
def test_speeds_in_fifty_digits(
    mu: float, zeta: float, omega: float, d: float, r: float, digits: float
) -> None:
    p = damper.Parameters(mu, zeta, omega, d, r)
    expected = exact_speeds(p)
    assert expected
    assert [orbit.speed for orbit in orbits(p)] == pytest.approx(
        [float(v) for v in expected], rel=10 * digits
    )


# Against the engine.


@pytest.mark.parametrize("p", SCENES)
def test_engine_runs_along_it(p: damper.Parameters) -> None:
    ran = 0
    for orbit in orbits(p):
        if not orbit.admissible:
            continue
        start = orbit.start
        # An unstable one is left as soon as roundoff has grown.
        grows = max(abs(orbit.multipliers[0]), 1.0)
        halves = 200 if orbit.stable else max(int(math.log(1e6) / math.log(grows)), 1)
        half = math.pi / p.frequency_ratio
        rows = damper.events(p, start, until=start.time + (halves + 0.5) * half)
        assert len(rows) == halves
        signs = -((-1.0) ** np.arange(halves))
        np.testing.assert_array_equal(rows["kind"], 0)
        np.testing.assert_array_equal(rows["side"], signs)
        times = start.time + half * np.arange(1, halves + 1)
        np.testing.assert_allclose(rows["time"], times, rtol=0, atol=1e-7)
        np.testing.assert_allclose(signs * rows["x"], orbit.displacement, atol=1e-7)
        np.testing.assert_allclose(signs * rows["v"], orbit.velocity_after, atol=1e-7)
        np.testing.assert_allclose(rows["approach_speed"], orbit.approach_speed, atol=1e-7)
        ran += 1
    assert ran


@pytest.mark.parametrize("p", SCENES)
def test_multipliers_against_differences_of_engine_runs(p: damper.Parameters) -> None:
    """Half-period map of the state in mid-flight, differentiated numerically."""
    checked = 0
    for orbit in orbits(p):
        if orbit.admissible:
            expected = np.sort(abs(orbit.multipliers))
            found = np.sort(abs(np.linalg.eigvals(differences(orbit))))
            np.testing.assert_allclose(found, expected, rtol=2e-5, atol=1e-5 * expected[-1])
            checked += 1
    assert checked


def differences(orbit: Orbit) -> np.ndarray:
    p = orbit.parameters
    half = math.pi / p.frequency_ratio
    start = orbit.start
    run = start_run(p, start)
    begin = start.time + 0.4 * half
    run.skip(*run.whole_periods(begin))
    here = run.state_at(*run.whole_periods(begin))
    middle = np.array([here.x, here.v, here.y, here.u])

    def after(state: np.ndarray) -> np.ndarray:
        run = start_run(p, damper.State(*state.tolist(), begin))
        end = run.whole_periods(begin + half)
        run.skip(*end)
        there = run.state_at(*end)
        return -np.array([there.x, there.v, there.y, there.u])

    np.testing.assert_allclose(after(middle), middle, atol=1e-8 * (1.0 + abs(middle).max()))
    size = 1e-5 * min(1.0, p.clearance)
    columns = [
        (after(middle + step) - after(middle - step)) / (2.0 * size) for step in size * np.eye(4)
    ]
    return np.array(columns).T


@pytest.mark.parametrize(
    ("section", "at"),
    [("stroboscopic_section", 0.1), ("stroboscopic_section", 0.7), ("impact_section", None)],
)
@pytest.mark.parametrize("p", SCENES[:2])
def test_section_is_the_observers(p: damper.Parameters, section: str, at: float | None) -> None:
    orbit = next(orbit for orbit in orbits(p) if orbit.admissible)
    # Observers count their periods from the start of the run.
    begun = orbit.start.time / p.cycle
    for wall in ("right", "left") if at is None else (None,):
        values = {name: getattr(p, name) for name in damper.Parameters.__dataclass_fields__}
        observer: dict[str, Any] = {section: {"wall": wall} if wall else {"when": at}}
        arrays, _ = run_points([values], observer, transient=0, periods=2, state=orbit.start)
        expected = orbit.after_impact(wall) if wall else orbit.stroboscopic(begun + at)
        samples = np.array([arrays["displacement"][0, 0], arrays["velocity"][0, 0]])
        np.testing.assert_allclose(samples, expected, atol=1e-9)


# Cases of their own.


def test_undamped_resonance_has_one() -> None:
    """There the force puts in what the impacts take: V = pi / (4 mu), by hand."""
    for d in (0.5, 3.0, 40.0):
        p = damper.Parameters(0.1, 0.0, 1.0, d, 0.6)
        (orbit,) = orbits(p)
        assert orbit.speed == pytest.approx(math.pi / 0.4, rel=1e-14)
        assert orbit.forcing_phase == pytest.approx(1.5 * math.pi, rel=1e-14)


def test_a_plastic_impact_into_a_push_is_not_admissible() -> None:
    """With r = 0 the masses separate only where the wall draws away at once."""
    seen = set()
    for omega in np.linspace(0.5, 1.5, 41):
        for orbit in orbits(damper.Parameters(0.1, 0.1, omega, 2.0, 0.0)):
            x, v, phase = orbit.displacement, orbit.velocity_after, orbit.forcing_phase
            pulls = math.sin(phase) - 0.2 * v - x > 0.0
            if not pulls:
                assert not orbit.admissible
            seen.add(pulls)
    assert seen == {True, False}


def test_other_models_are_refused() -> None:
    p = damper.Parameters(0.1, 0.1, 1.0, 5.5, 0.5, support_stiffness_ratio=0.1)
    yields = damper.Parameters(0.1, 0.1, 1.0, 5.5, 0.5, yield_speed=1.0)
    with pytest.raises(ValueError, match="that of rigid walls alone, this damper has a support"):
        orbits(p)
    with pytest.raises(ValueError, match="constant restitution, this is the yielding law"):
        orbits(yields)
