"""The primary alone: its steady response against the closed form in 30 digits."""

import math
import re

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from mpmath import mp, mpf

from damper import Parameters, State
from damper.models import start_run
from damper.theory.steady import steady_amplitude, steady_gain, steady_state

#: So far away that nothing touches.
FAR = 1e9


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


@given(
    zeta=st.one_of(st.just(0.0), st.floats(1e-300, 10)),
    omega=st.floats(1e-3, 1e3).filter(lambda omega: omega != 1.0),
    phase=st.floats(-10, 10),
)
@example(0.02, 1.0, 0.7)
@example(1e-12, 1.0, -1.0)
@example(0.0, 1.0 + 1e-9, 0.3)
@example(0.0, math.nextafter(1.0, 0.0), 2.0)
@example(1e-9, 1.0 - 1e-8, 4.0)
@example(0.3, 7.0, 1e3)
def test_steady_response_is_the_closed_form(zeta: float, omega: float, phase: float) -> None:
    """To roundoff of the amplitude: near resonance 1 - omega^2 alone would lose every digit."""
    with mp.workdps(30):
        amplitude, x, v = closed_form(zeta, omega, phase)
        found = steady_state(Parameters(0.1, zeta, omega, 1.0, 0.6, phase))
        assert abs(found[0] - x) < 2e-15 * amplitude
        assert abs(found[1] - v) < 2e-15 * omega * amplitude
        assert abs(steady_amplitude(zeta, omega) - amplitude) < 2e-15 * amplitude


@pytest.mark.parametrize(
    ("zeta", "omega", "phase"), [(0.02, 1.0, 0.7), (0.0, 1.3, 2.0), (2.0, 3.0, -1.0)]
)
def test_start_on_the_steady_response_stays_on_it(zeta: float, omega: float, phase: float) -> None:
    """For 1000 periods, even undamped, where what the start has wrong would stay for good."""
    p = Parameters(0.1, zeta, omega, FAR, 0.6, phase)
    x, v = steady_state(p)
    run = start_run(p, State(x, v, x, v))
    run.skip(1000.0)
    end = run.state_at(1000.0)
    # An undamped run forgets no roundoff: at most 1e-15 of the amplitude per period.
    limit = 1e-12 * steady_amplitude(zeta, omega) * max(omega, 1.0)
    assert abs(end.x - x) < limit
    assert abs(end.v - v) < limit


def test_undamped_resonance_has_no_steady_response() -> None:
    message = re.escape("damping_ratio = 0 with frequency_ratio = 1") + ".*no steady"
    with pytest.raises(ValueError, match=message):
        steady_gain(0.0, 1.0)
    with pytest.raises(ValueError, match=message):
        steady_state(Parameters(0.1, 0.0, 1.0, 1.0, 0.6))
    assert steady_amplitude(0.0, 1.0) == math.inf
