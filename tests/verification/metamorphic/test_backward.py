"""Backward error: sound runs have one of some units of roundoff, spoilt logs do not."""

import mpmath
import numpy as np
import pytest

from damper.engine.compiled import plain
from damper.engine.segment import CAUSE, DURATION, FLIGHT, IMPACT, MODE, RELEASE, SIDE, V, X
from damper.parameters import Parameters, State
from damper.verification.metamorphic.backward import LONG, Oscillators, _motion, residuals
from damper.verification.metamorphic.runs import short_run

pytestmark = pytest.mark.skipif(not LONG, reason="long double has no digits to spare")

GENERIC = Parameters(0.1, 0.05, 0.8, 1.0, 0.6)
CHATTERING = Parameters(0.1, 0.05, 0.2, 0.25, 0.6)
# What is enough for all of these, in units of roundoff.
FEW = 60.0


@plain
def log_of(parameters, state=None, periods=20.0, events=100):
    return short_run(parameters, state, periods=periods, events=events).log


def worst(parameters, log):
    return {n: np.max(v, initial=0.0) for n, v in residuals(parameters, log).items()}


@pytest.mark.parametrize(
    ("beta", "omega"), [(0.0, 1.0 + 1e-9), (1.0 - 1e-12, 1e-3), (1.0, 1.0), (10.0, 1e3)]
)
def test_motions_are_those_of_the_matrix_exponential(beta, omega):
    x0, v0, theta, tau = 0.3, -1.1, 0.7, np.geomspace(1e-6, 30.0, 8)
    one = np.ones(8, dtype=np.longdouble)
    given = [np.longdouble(v) * one for v in (x0, v0, theta)]
    osc = Oscillators(beta * one, one, one, np.longdouble(omega))
    found = _motion(osc, *given, tau.astype(np.longdouble))
    with mpmath.workdps(60):
        system = mpmath.matrix(
            [[0, 1, 0, 0], [-1, -2 * mpmath.mpf(beta), 1, 0], [0, 0, 0, omega], [0, 0, -omega, 0]]
        )
        start = mpmath.matrix([x0, v0, mpmath.sin(theta), mpmath.cos(theta)])
        for k, time in enumerate(tau):
            x, v, _, _ = mpmath.expm(system * time) * start
            bend, dv = x - x0 - v0 * mpmath.mpf(time), v - v0
            for mine, exact in zip(found, (bend, dv), strict=False):
                size = max(abs(exact), 1e-3 * min(time, 1.0) ** 2)
                assert abs(float((mine[k] - np.longdouble(float(exact))) / size)) < 1e-15


@pytest.mark.parametrize(
    ("zeta", "omega", "amplitude"),
    [(0.0, 1.0 + 1e-9, 1.0), (1.0 - 1e-12, 1e3, 50.0), (10.0, 1e-3, 0.3), (0.05, 1.0, 0.0)],
)
def test_every_kind_of_damping_and_forcing_is_sound(zeta, omega, amplitude):
    for mass_ratio, clearance, restitution in (
        (0.1, 1e-3, 0.6),
        (1e-6, 0.3, 0.0),
        (1e4, 1e-8, 1.0),
    ):
        force = {"force_amplitude": amplitude} | ({"phase": 0.7} if amplitude else {})
        p = Parameters(mass_ratio, zeta, omega, clearance, restitution, **force)
        start = State(0.3, -1.1, 0.3, 0.4)
        assert max(worst(p, log_of(p, start, events=40)).values()) < FEW


def row_of(log, **columns):
    """First inner row with these values."""
    names = {"mode": MODE, "cause": CAUSE}
    fits = np.all([log[:, names[name]] == value for name, value in columns.items()], axis=0)
    fits[[0, -1]] = False
    return int(np.flatnonzero(fits)[0])


@pytest.mark.parametrize(
    ("check", "column"), [("contact", DURATION), ("motion", V), ("motion", X), ("contact", SIDE)]
)
def test_a_wrong_impact_is_found(check, column):
    log = log_of(GENERIC).copy()
    row = row_of(log, mode=FLIGHT, cause=IMPACT)
    before = worst(GENERIC, log)[check]
    log[row, column] *= -1.0 if column == SIDE else 1.0 + 1e-9
    assert before < FEW < 1e4 < worst(GENERIC, log)[check]


def test_a_late_release_is_found():
    log = log_of(CHATTERING).copy()
    log[row_of(log, cause=RELEASE) - 1, DURATION] *= 1.2
    assert worst(CHATTERING, log)["release"] > 1e9


def test_a_yielding_contact_has_its_own_restitution():
    p = Parameters(0.1, 0.05, 0.8, 1.0, 0.6, yield_speed=0.1)
    log = log_of(p)
    assert worst(p, log)["motion"] < FEW
    constant = Parameters(0.1, 0.05, 0.8, 1.0, 0.6)
    assert worst(constant, log)["motion"] > 1e9
