"""Free decay with two impacts a period, of a light free mass: damping against closed form."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from damper import Parameters, State, events, simulate
from damper.theory.free_decay import (
    amplitude_range,
    equivalent_damping,
    largest_damping,
    least_at_resonance,
    time_of_decay,
)
from damper.theory.slow_manifold import SYMMETRIC_LIMIT, amplitude
from damper.theory.two_impacts import orbits

RESTITUTION = 0.3
RHO = 2 / math.pi * (1 - RESTITUTION) / (1 + RESTITUTION)
CLEARANCE = 2.5


def free(mass_ratio: float = 1e-3, damping_ratio: float = 0.0, **changes: float) -> Parameters:
    values = {"clearance": CLEARANCE, "restitution": RESTITUTION, "force_amplitude": 0.0}
    return Parameters(mass_ratio, damping_ratio, 1.0, **values | changes)


def theta_of(xi: float) -> float:
    """Displacement of the free mass at an impact, over the clearance."""
    square = 1 + RHO * RHO
    return (1 + math.sqrt(1 - square * (1 - xi * xi))) / square


def integrated_time(start: float, end: float, mass_ratio: float, damping_ratio: float) -> float:
    """Time in which the primary's amplitude over the clearance falls, to first order in the mass.

    Its amplitude falls at the rate zeta + (4 mu rho / pi^2) (theta / xi)^2.
    """

    def rate(theta: float) -> float:
        xi2 = (theta - 1) ** 2 + (RHO * theta) ** 2
        loss = 4 * mass_ratio * RHO * (theta / math.pi) ** 2 + damping_ratio * xi2
        return ((1 + RHO * RHO) * theta - 1) / loss

    return quad(rate, theta_of(end), theta_of(start), epsabs=0, epsrel=1e-12)[0]


def measured(p: Parameters) -> tuple[float, float, float]:
    """Amplitude after an early and a late impact, and the time between them."""
    d, xi = CLEARANCE, 0.8
    theta = theta_of(xi)
    x, v = (theta - 1) * d, -RHO * theta * d  # after an impact on the right wall
    state = State(x, v, x + d, -2 / math.pi * theta * d)
    table = events(p, state, until=time_of_decay(p, xi * d, 0.45 * d))
    assert set(table["kind"]) == {0}
    assert np.all(np.diff(table["side"]) != 0)  # two impacts a period
    hits = table[table["side"] == 1]
    first, last = hits[len(hits) // 10], hits[-1]
    return (
        math.hypot(first["x"], first["v"]),
        math.hypot(last["x"], last["v"]),
        last["time"] - first["time"],
    )


@pytest.mark.parametrize("loss", [0.0, 1.0], ids=["undamped", "damped"])
def test_error_of_the_time_of_decay_is_of_the_order_of_the_mass(loss: float) -> None:
    """Without a dashpot, and with one whose damping ratio is the mass ratio."""
    errors = []
    for mass_ratio in (1e-2, 1e-3, 1e-4):
        p = free(mass_ratio, loss * mass_ratio)
        start, end, time = measured(p)
        errors.append(time / time_of_decay(p, start, end) - 1)
    assert 0 < errors[-1] < 3e-4
    assert errors[:-1] == pytest.approx([10 * error for error in errors[1:]], rel=0.05)


def test_error_of_the_damping_ratio_is_of_the_order_of_the_mass() -> None:
    """That of the logarithmic decrement of every cycle, at all amplitudes well within the range."""
    masses = [1e-2, 3e-3, 1e-3]
    cube = simulate(
        mass_ratio=masses, damping_ratio=1e-5, frequency_ratio=1.0, clearance=CLEARANCE,
        restitution=RESTITUTION, force_amplitude=0.0, initial_displacement=0.85 * CLEARANCE,
        transient=0, periods=300, observers={"decay": {"half_cycles": 600}},
    )  # fmt: skip
    errors = []
    for mass_ratio in masses:
        p, run = free(mass_ratio, 1e-5), cube.sel(mass_ratio=mass_ratio)
        peak, ratio = run.peak_amplitude.values, run.equivalent_damping_ratio.values
        low, high = amplitude_range(p)
        inside = (peak > 1.1 * low) & (peak < 0.85 * high) & np.isfinite(ratio)
        assert inside.sum() > 20
        law = equivalent_damping(p, peak[inside])
        errors.append(np.sqrt(np.mean((ratio[inside] / law - 1) ** 2)))
    order, _ = np.polyfit(np.log(masses), np.log(errors), 1)
    assert order == pytest.approx(1.0, abs=0.05)
    assert errors[-1] < 3e-3


@pytest.mark.parametrize("zeta", [0.0, 1e-12, 1e-6, 1e-3, 0.3])
def test_time_of_decay_is_the_integral(zeta: float) -> None:
    p = free(1e-3, zeta)
    for start, end in ((0.85, 0.4), (0.7, 0.33), (0.5, 0.4999)):
        time = time_of_decay(p, start * CLEARANCE, end * CLEARANCE)
        assert time == pytest.approx(integrated_time(start, end, 1e-3, zeta), rel=1e-11)
    low, high = amplitude_range(p)
    rate = equivalent_damping(p, 0.6 * CLEARANCE)
    step = time_of_decay(p, 0.6001 * CLEARANCE, 0.5999 * CLEARANCE)
    assert rate == pytest.approx(math.log(0.6001 / 0.5999) / step, rel=1e-6)
    assert 0.0 < time_of_decay(p, high, low) < math.inf
    assert time_of_decay(p, low, low) == 0.0


def test_largest_damping() -> None:
    p = free(1e-3, 2e-4)
    found = largest_damping(p)
    assert found.damping_ratio == pytest.approx(2e-4 + 2e-3 / math.pi * 1.3 / 0.7, rel=1e-14)
    assert found.amplitude == pytest.approx(2 * CLEARANCE / math.pi * 0.7 / 1.3, rel=1e-14)
    low, high = amplitude_range(p)
    assert low < found.amplitude < high
    assert high == CLEARANCE * amplitude(SYMMETRIC_LIMIT, RESTITUTION)
    all_of_it = equivalent_damping(p, np.linspace(low, high, 10_001))
    assert np.nanmax(all_of_it) <= found.damping_ratio * (1 + 1e-15)
    assert np.nanmax(all_of_it) == pytest.approx(found.damping_ratio, rel=1e-6)
    below, inside = equivalent_damping(p, [0.999 * low, found.amplitude])
    assert math.isnan(below)
    assert inside == pytest.approx(found.damping_ratio, rel=1e-14)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"force_amplitude": 2.0}, r"force_amplitude = 2\.0: .* free motion; must be 0"),
        ({"clearance": 0.0}, r"clearance = 0\.0: .* must be > 0"),
        ({"damping_ratio": 1.0}, r"damping_ratio = 1\.0: .* must be < 1"),
        ({"yield_speed": 1.0}, "constant restitution, this is the yielding law"),
        ({"support_stiffness_ratio": 0.1}, "this damper has a support"),
        ({"contact_stiffness_ratio": 1e4}, "this damper has compliant contact"),
        ({"modulation_depth": 0.1}, "this damper has a free mass that varies"),
        ({"gravity": 0.01}, r"gravity = 0\.01: the closed form holds for .* only"),
    ],
)
def test_what_the_law_does_not_know_is_refused(changes: dict[str, float], message: str) -> None:
    p = free(**changes)
    for ask in (lambda: equivalent_damping(p, 1.0), lambda: largest_damping(p),
                lambda: amplitude_range(p), lambda: time_of_decay(p, 1.0, 0.9)):  # fmt: skip
        with pytest.raises(ValueError, match=message):
            ask()


@pytest.mark.parametrize(("r", "zeta"), [(0.3, 0.0), (0.8, 0.02)])
def test_least_amplitude_at_resonance(r: float, zeta: float) -> None:
    """That of the closed form of two impacts per period; the error is in proportion to the mass."""

    def least(mu: float) -> tuple[float, float]:
        found = least_at_resonance(Parameters(mu, zeta * mu, 1.0, 1.0, r))
        clearances = found.clearance * np.linspace(0.97, 1.05, 161)
        peaks = [orbits(Parameters(mu, zeta * mu, 1.0, d, r))[0].peak for d in clearances]
        k = int(np.argmin(peaks))
        return peaks[k] / found.amplitude - 1.0, clearances[k] / found.clearance - 1.0

    masses = np.array([3e-2, 1e-2, 3e-3, 1e-3])
    errors = np.array([least(mu) for mu in masses])
    order, _ = np.polyfit(np.log(masses), np.log(errors[:, 0]), 1)
    assert order == pytest.approx(1.0, abs=0.02)
    assert errors[0, 1] < masses[0]
    if not zeta:
        # (1 + mu) times that of the closed form, as it turns out.
        np.testing.assert_allclose(errors[:, 0], masses, rtol=1e-3)


def test_least_amplitude_is_simulated() -> None:
    p = {"mass_ratio": 0.02, "damping_ratio": 0.01, "frequency_ratio": 1.0, "restitution": 0.3}
    law = least_at_resonance(Parameters(**p, clearance=1.0))
    d = law.clearance * np.array([0.8, 1.0, 1.2])
    cube = simulate(
        **p, clearance=d, initial_position=0.3, transient=150, periods=5, observers=["response"]
    )
    below, best, above = cube.peak_displacement.values / law.amplitude
    assert best == pytest.approx(1.0, abs=0.02)
    assert below > best + 0.01 < above


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"frequency_ratio": 0.9}, "frequency_ratio = 0.9: the closed form is for resonance"),
        ({"restitution": 1.0}, "no clearance is best"),
        ({"forcing": "base"}, "forcing"),
    ],
)
def test_what_is_no_resonance_is_refused(changes: dict[str, Any], words: str) -> None:
    given: dict[str, Any] = {"frequency_ratio": 1.0, "restitution": 0.5, **changes}
    with pytest.raises(ValueError, match=words):
        least_at_resonance(Parameters(0.1, 0.02, clearance=1.0, **given))
