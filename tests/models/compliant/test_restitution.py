"""The restitution of a contact against its own equation of motion, and the way back."""

import math

import pytest
from mpmath import mp, mpf

from damper.models.compliant.restitution import contact_damping, contact_phase, restitution_of

DAMPINGS = [1e-12, 1e-5, 0.1, 0.5, 0.9, 0.99999, 1 - 1e-12, 1.0, 1 + 1e-12, 1.00001, 1.3, 3.0, 50.0]
RESTITUTIONS = [1 - 1e-15, 1 - 1e-10, 0.999, 0.6, 0.37, 0.3678, 0.2, math.exp(-2), 0.13, 0.02, 1e-3]


def parting(z: mpf, tension: bool) -> tuple[mpf, mpf]:
    """When, and how fast, g'' + 2 z g' + g = 0 from g = 0, g' = -1 parts, found by root search."""
    root = mp.sqrt(mpf(1) - z * z + 0j)

    def gap(t: mpf) -> mpf:
        return mp.re(-mp.exp(-z * t) * (mp.sin(root * t) / root if root else t))

    def rate(t: mpf) -> mpf:
        return mp.re(mp.diff(gap, t))

    def force(t: mpf) -> mpf:
        return -(gap(t) + 2 * z * rate(t))

    value = (lambda t: -gap(t)) if tension else force
    step = mpf("0.05") / (1 + z)
    t = step
    while value(t + step) > 0:
        t += step
        if t > 100:
            return mpf(0), mpf(0)
    end = mp.findroot(value, (t, t + step), solver="anderson")
    return end, rate(end)


@pytest.mark.parametrize("tension", [False, True])
@pytest.mark.parametrize("z", [0.02, 0.9, 4.0])
def test_restitution_and_duration_are_those_of_the_contact(z: float, tension: bool) -> None:
    with mp.workdps(25):
        time, speed = parting(mpf(z), tension)
        assert restitution_of(z, tension) == pytest.approx(float(speed))
        assert contact_phase(z, tension) == pytest.approx(float(time))


@pytest.mark.parametrize("z", DAMPINGS)
def test_restitution_keeps_its_digits(z: float) -> None:
    with mp.workdps(40):
        w = mpf(z)
        root = mp.sqrt(abs(1 - w * w))
        angle = mp.acos(w) if z < 1 else mp.acosh(w)
        exact = mp.exp(-2 * w * angle / root) if z != 1 else mp.exp(-2)
        assert abs(restitution_of(z) / exact - 1) < 1e-14
        if z < 0.999:
            assert abs(restitution_of(z, True) / mp.exp(-mp.pi * w / root) - 1) < 1e-14


@pytest.mark.parametrize("r", RESTITUTIONS)
@pytest.mark.parametrize("tension", [False, True])
def test_damping_is_accurate_relative_to_itself(r: float, tension: bool) -> None:
    """The inverse in 40 digits, by a root search on the forward map."""
    with mp.workdps(40):
        goal = -mp.log(mpf(r))
        if tension:
            exact = goal / mp.sqrt(mp.pi**2 + goal**2)
        elif goal < mpf("1.99"):
            exact = mp.cos(
                mp.findroot(lambda a: 2 * a * mp.cot(a) - goal, mp.pi / 2 - goal / mp.pi)
            )
        elif goal > mpf("2.01"):
            exact = mp.cosh(mp.findroot(lambda a: 2 * a * mp.coth(a) - goal, goal / 2))
        else:
            s = 1 - goal / 2  # a cot(a) = 1 - a^2/3 - a^4/45, z = cos a
            square = 3 * s - 3 * (3 * s) ** 2 / 45
            exact = 1 - square / 2 + square**2 / 24
            assert contact_damping(r) == pytest.approx(float(exact), abs=1e-7)
            return
        # z goes as r^(-1/2) at last, so roundoff of log(r) grows with its size.
        assert abs(contact_damping(r, tension) / exact - 1) < 4e-16 * (1 + goal / 2)


def test_ends_of_the_range() -> None:
    assert contact_damping(1.0) == contact_damping(1.0, True) == 0.0
    assert contact_damping(0.0, True) == 1.0
    assert restitution_of(7.0, True) == 0.0
    assert restitution_of(0.0) == restitution_of(0.0, True) == 1.0
    assert contact_damping(1.0 - 1e-9) == pytest.approx(1e-9 / math.pi, rel=1e-6)
    for r in (-0.1, 1.1, 0.0, math.nan):
        with pytest.raises(ValueError, match="0 < restitution <= 1"):
            contact_damping(r)
    for z in (-1.0, math.nan, math.inf):
        with pytest.raises(ValueError, match="contact_damping"):
            restitution_of(z)
