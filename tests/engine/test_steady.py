"""The primary alone: its steady response against the closed form in 30 digits."""

import math
import re

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from mpmath import mp, mpf

from damper import Parameters, simulate
from damper.engine.steady import steady_amplitude, steady_gain, steady_state
from damper.sweep.runs import run_lanes

#: So far away that nothing touches.
FAR = 1e9
RESONANCE = "damping_ratio = 0 with frequency_ratio = 1"


def closed_form(zeta: float, omega: float, phase: float) -> tuple[mpf, mpf, mpf]:
    """Amplitude, displacement and velocity at time 0, from the textbook's real formulas.

    x = A sin(omega t + phase - lag), A = 1 / sqrt((1 - omega^2)^2 + (2 zeta omega)^2),
    tan lag = 2 zeta omega / (1 - omega^2).
    """
    zeta, omega, phase = mpf(zeta), mpf(omega), mpf(phase)
    stiff, drag = 1 - omega**2, 2 * zeta * omega
    amplitude = 1 / mp.hypot(stiff, drag)
    angle = phase - mp.atan2(drag, stiff)
    return amplitude, amplitude * mp.sin(angle), omega * amplitude * mp.cos(angle)


SCENES = [
    (0.05, 0.2, 0.0),
    (0.02, 1.0, 0.7),
    (0.0, 1.0 + 1e-9, 0.3),
    (0.0, math.nextafter(1.0, 0.0), 2.0),
    (1e-12, 1.0, -1.0),
    (1e-9, 1.0 - 1e-8, 4.0),
    (1.0, 0.5, 1.5),
    (40.0, 3.0, -2.5),
    (5.0, 1e-6, 0.1),
    (0.0, 1e4, 1.0),
    (0.3, 7.0, 1e3),
]


@pytest.mark.parametrize(("zeta", "omega", "phase"), SCENES)
def test_steady_response_is_the_closed_form(zeta: float, omega: float, phase: float) -> None:
    """To rounding of the amplitude: near resonance 1 - omega^2 alone would lose every digit."""
    with mp.workdps(30):
        amplitude, x, v = closed_form(zeta, omega, phase)
        found = steady_state(Parameters(0.1, zeta, omega, 1.0, 0.6, phase))
        # A phase of a thousand radians is exact in the arithmetic of both.
        assert abs(found[0] - x) < 1e-15 * amplitude
        assert abs(found[1] - v) < 1e-15 * omega * amplitude
        assert abs(steady_amplitude(zeta, omega) - amplitude) < 1e-15 * amplitude
        assert abs(abs(steady_gain(zeta, omega)) - amplitude) < 1e-15 * amplitude


@given(zeta=st.floats(0, 50), omega=st.floats(1e-3, 1e3), phase=st.floats(-10, 10, allow_nan=False))
def test_steady_response_is_the_closed_form_everywhere(
    zeta: float, omega: float, phase: float
) -> None:
    assume(zeta > 1e-300 or omega != 1.0)
    with mp.workdps(30):
        amplitude, x, v = closed_form(zeta, omega, phase)
        found = steady_state(Parameters(0.1, zeta, omega, 1.0, 0.6, phase))
        assert abs(found[0] - x) < 2e-15 * amplitude
        assert abs(found[1] - v) < 2e-15 * omega * amplitude


def test_sign_of_the_lag() -> None:
    """Slow forcing is followed in phase, fast forcing in antiphase, and damping makes it late."""
    quarter = math.pi / 2  # force 1 at time 0
    assert steady_state(Parameters(0.1, 0.1, 0.01, 1.0, 0.6, quarter))[0] == pytest.approx(1, 1e-3)
    assert steady_state(Parameters(0.1, 0.1, 100.0, 1.0, 0.6, quarter))[0] < 0.0
    x, v = steady_state(Parameters(0.1, 0.1, 1.0, 1.0, 0.6, quarter))
    assert x == pytest.approx(0.0, abs=1e-15)
    assert v == pytest.approx(5.0, 1e-15)  # 1 / (2 zeta): the force works on the velocity


@pytest.mark.parametrize(
    ("zeta", "omega", "phase"),
    [(0.02, 1.0, 0.7), (0.05, 0.2, 0.0), (0.0, 0.3, 0.4), (0.0, 1.3, 2.0), (2.0, 3.0, -1.0)],
)
def test_start_on_the_steady_response_stays_on_it(zeta: float, omega: float, phase: float) -> None:
    """For 1000 periods, even undamped, where what the start has wrong would stay for good."""
    cube = simulate(
        mass_ratio=0.1,
        damping_ratio=zeta,
        frequency_ratio=omega,
        clearance=FAR,
        restitution=0.6,
        phase=phase,
        initial="steady",
        transient=0,
        periods=1000,
        observers={"stroboscopic_section": {"free_mass": True}, "impacts": {}},
    )
    with mp.workdps(30):
        amplitude, x, v = (float(number) for number in closed_form(zeta, omega, phase))
    # An undamped run forgets no rounding: at most 1e-15 of the amplitude per period.
    limit = 1e-12 * amplitude
    np.testing.assert_allclose(cube.displacement, x, rtol=0, atol=limit)
    np.testing.assert_allclose(cube.velocity, v, rtol=0, atol=limit * max(omega, 1.0))
    assert cube.impacts_per_period == 0.0
    # The free mass starts at the centre and moves along with the primary, for good.
    np.testing.assert_allclose(cube.free_velocity, v, rtol=1e-12)
    assert cube.free_displacement[0] == cube.displacement[0]


def test_start_at_rest_does_not() -> None:
    """Guards the test above."""
    given = {"mass_ratio": 0.1, "damping_ratio": 0.0, "frequency_ratio": 0.3, "clearance": FAR}
    cube = simulate(**given, restitution=0.6, transient=0, periods=20)
    assert np.ptp(cube.velocity.values) > 0.1


def test_undamped_resonance_has_no_steady_response() -> None:
    for call in (
        lambda: steady_gain(0.0, 1.0),
        lambda: steady_state(Parameters(0.1, 0.0, 1.0, 1.0, 0.6)),
    ):
        with pytest.raises(ValueError, match=f"{re.escape(RESONANCE)}.*no steady"):
            call()
    assert steady_amplitude(0.0, 1.0) == math.inf


def test_undamped_resonance_cannot_be_started_on() -> None:
    """Wherever it lies in the grid, and before anything is run."""
    given = {"mass_ratio": 0.1, "clearance": 1.0, "restitution": 0.6, "transient": 10**9}
    with pytest.raises(ValueError, match=re.escape(RESONANCE)):
        simulate(
            **given,
            damping_ratio=[0.1, 0.0],
            frequency_ratio=[0.5, 1.0, 1.5],
            initial="steady",
        )
    done: list[int] = []
    points = [
        {"mass_ratio": 0.1, "clearance": 1.0, "restitution": 0.6, "damping_ratio": zeta}
        | {"frequency_ratio": 1.0}
        for zeta in (0.1, 0.0)
    ]
    run = {"transient": 1, "periods": 1, "primary": "steady", "progress": done.append}
    with pytest.raises(ValueError, match=re.escape(RESONANCE)):
        run_lanes(points, [], **run)
    assert done == []
    damped = {**given, "transient": 1, "periods": 1, "initial": "steady"}
    assert simulate(**damped, damping_ratio=0.01, frequency_ratio=1.0).status == 0
    assert simulate(**damped, damping_ratio=0.0, frequency_ratio=1.0 + 1e-9).status == 0
    rest = {**damped, "initial": "rest"}
    assert simulate(**rest, damping_ratio=0.0, frequency_ratio=1.0).status == 0
