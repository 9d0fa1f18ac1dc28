"""Backward error: sound runs have one of some units of roundoff, spoilt logs do not."""

import numpy as np
import pytest

from damper.engine.segment import (
    CAUSE,
    COMPLETION,
    DURATION,
    FLIGHT,
    IMPACT,
    MODE,
    RATE,
    RELEASE,
    SIDE,
    STICK,
    TAIL,
    V,
    X,
)
from damper.parameters import Parameters, State
from damper.verification.stress.backward import CHECKS, LONG, backward_error, residuals
from damper.verification.stress.runs import short_run

GENERIC = Parameters(0.1, 0.05, 0.8, 1.0, 0.6)
CHATTERING = Parameters(0.1, 0.05, 0.2, 0.25, 0.6)
# What is enough for all of these, in units of roundoff.
FEW = 60.0

needs_long = pytest.mark.skipif(not LONG, reason="long double has no digits to spare")


def log_of(parameters, state=None, periods=20.0, events=100):
    return short_run(parameters, state, periods=periods, events=events).log


def worst(parameters, log, **more):
    found = backward_error(parameters, log, **more)
    return max(found[name] for name in CHECKS)


@needs_long
@pytest.mark.parametrize("zeta", [0.0, 1e-12, 0.05, 1.0 - 1e-12, 1.0, 1.0 + 1e-12, 3.0, 10.0])
@pytest.mark.parametrize("omega", [1e-3, 0.2, 1.0, 1.0 + 1e-9, 1e3])
def test_every_kind_of_damping_and_forcing_is_sound(zeta, omega):
    for mass_ratio, clearance, restitution in (
        (0.1, 1e-3, 0.6),
        (1e-6, 0.3, 0.0),
        (1e4, 1e-8, 1.0),
    ):
        p = Parameters(mass_ratio, zeta, omega, clearance, restitution, phase=0.7)
        start = State(0.3, -1.1, 0.3, 0.4)
        assert worst(p, log_of(p, start, events=40)) < FEW


@needs_long
@pytest.mark.parametrize("zeta", [2.0, 5.0, 10.0])
@pytest.mark.parametrize("omega", [1e-3, 0.0117, 0.0909])
def test_speeds_under_heavy_damping_are_sound(zeta, omega):
    """They are as exact as the gap."""
    for mass_ratio, clearance, restitution in (
        (5e-6, 71.0, 0.44),
        (1e-6, 2.1, 0.54),
        (7e-4, 2e-3, 0.93),
    ):
        p = Parameters(mass_ratio, zeta, omega, clearance, restitution, phase=0.75)
        start = State(1.9, -2.0, 1.9 - 0.24 * clearance, -3.5)
        found = backward_error(p, log_of(p, start, events=40))
        assert max(found["contact"], found["law"]) < FEW


@needs_long
def test_more_digits_say_the_same():
    log = log_of(CHATTERING, events=12)
    quick, slow = residuals(CHATTERING, log), residuals(CHATTERING, log, digits=40)
    for name in CHECKS:
        np.testing.assert_allclose(quick[name], slow[name], atol=0.02)
    assert slow["closing"].max() <= 1e-12
    np.testing.assert_allclose(quick["closing"], slow["closing"], rtol=1e-3, atol=1e-19)


@needs_long
def test_stiff_long_double_against_more_digits():
    for zeta, omega in ((10.0, 3.0), (1.0, 1.0), (0.0, 1.0), (0.3, 1e3)):
        p = Parameters(0.1, zeta, omega, 1e-4, 0.5)
        log = log_of(p, State(0.3, -1.1, 0.3, 0.4), events=4)[:4]
        quick, slow = residuals(p, log), residuals(p, log, digits=40)
        for name in CHECKS:
            np.testing.assert_allclose(quick[name], slow[name], atol=0.05, rtol=1e-3)


def row_of(log, **columns):
    """First inner row with these values."""
    names = {"mode": MODE, "cause": CAUSE}
    fits = np.ones(len(log), dtype=bool)
    for name, value in columns.items():
        fits &= log[:, names[name]] == value
    fits[[0, -1]] = False
    return int(np.flatnonzero(fits)[0])


@needs_long
@pytest.mark.parametrize(
    ("check", "column", "change"),
    [
        ("contact", DURATION, 1e-9),
        ("law", RATE, 1e-9),
        ("law", V, 1e-9),
        ("motion", X, 1e-9),
    ],
)
def test_a_wrong_impact_is_found(check, column, change):
    log = log_of(GENERIC).copy()
    row = row_of(log, mode=FLIGHT, cause=IMPACT)
    before = backward_error(GENERIC, log)[check]
    log[row, column] *= 1.0 + change
    assert before < FEW < 1e4 < backward_error(GENERIC, log)[check]


@needs_long
def test_a_wrong_wall_is_found():
    log = log_of(GENERIC).copy()
    row = row_of(log, mode=FLIGHT, cause=IMPACT)
    log[row, SIDE] *= -1.0
    assert backward_error(GENERIC, log)["contact"] > 1e12


@needs_long
def test_a_skipped_impact_is_found():
    """The log goes through the wall where the impact was, and takes up the run later on."""
    log = log_of(GENERIC)
    row = row_of(log, mode=FLIGHT, cause=IMPACT)
    spoilt = np.delete(log, row, axis=0)
    spoilt[row - 1, DURATION] += log[row, DURATION]
    found = residuals(GENERIC, spoilt)
    assert found["inside"][row - 1] > 1e10
    assert np.delete(found["inside"], row - 1).max() < FEW


@needs_long
def test_a_late_release_is_found():
    log = log_of(CHATTERING).copy()
    row = row_of(log, cause=RELEASE)
    log[row - 1, DURATION] *= 1.2
    found = backward_error(CHATTERING, log)
    assert found["release"] > 1e9
    assert found["inside"] > 1e9
    assert found["clock"] > 1e9


@needs_long
def test_a_tail_closed_too_soon_is_found():
    log = log_of(CHATTERING)
    tail = row_of(log, mode=TAIL)
    assert log[tail + 1, CAUSE] == STICK
    spoilt = log.copy()
    spoilt[tail, COMPLETION] *= 1.0 + 1e-6
    assert (
        backward_error(CHATTERING, log)["tail"] < FEW < backward_error(CHATTERING, spoilt)["tail"]
    )
    # Closed three bounces earlier: the formula holds, what it leaves out does not.
    coarse = short_run(CHATTERING, None, periods=20.0, events=100, accuracy=1e-6).log
    found = backward_error(CHATTERING, coarse)
    assert found["tail"] < FEW
    assert backward_error(CHATTERING, log)["closing"] <= 1e-12 < 1e-8 < found["closing"] <= 1e-6


def test_other_models_are_refused():
    p = Parameters(0.1, 0.05, 0.8, 1.0, 0.6, support_stiffness_ratio=0.1)
    with pytest.raises(ValueError, match="grounded model"):
        backward_error(p, log_of(p))
