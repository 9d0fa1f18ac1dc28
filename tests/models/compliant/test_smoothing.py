"""Bounds by the age of a contact's motion, against matrix exponentials in 60 digits."""

import math
import random

import numpy as np
import pytest
from mpmath import expm, matrix, mp, mpf
from new_process import in_new_process

from damper import Parameters
from damper.engine.search import HORIZON, LONG_SEARCH, search_budget
from damper.engine.trajectory import Trajectory
from damper.models.compliant import Compliant, prepare
from damper.models.compliant.flow import derivative, energy_size
from damper.models.compliant.search import FOUND, MAX_STEPS, find_switch
from damper.models.compliant.smoothing import fill_later, later_bound4
from damper.sweep.points import read_point

#: Damping ratio, frequency ratio, mass ratio, restitution, stiffness, tension: rates from 1e-4 to
#: 1e11, of which the damping, the contact or its creep is the fastest.
EXTREMES = {
    "creep": (0.0558463, 0.00910892, 0.0748867, 1e-6, 23969.9, 0),
    "damped creep": (1e3, 0.00221493, 0.0386412, 1e-6, 1270.02, 0),
    "damping": (1e6, 0.0015998, 234.224, 0.0125921, 350.7, 0),
    "ring in damping": (1e6, 0.0150525, 0.00623059, 0.916123, 437959.0, 1),
    "slow forcing": (55.7755, 1e-4, 429.713, 1e-6, 5345.99, 0),
    "light mass": (38.2528, 0.0440249, 1e-9, 0.000189134, 1e10, 0),
}
#: Lanes of the study stress_random that once took 1e5 evaluations for one contact, or never ended
#: one: evaluations now, events and segments' count left out.
LANES = {
    15719: (3e4, "0.0558463 0.00910892 0.0748867 1e-6 3.55786e-4 2.06626 0.0759848 2.97165 -2.4375"
            " -0.284579 23969.9 0"),
    30935: (3e4, "1000 0.00221493 0.0386412 1e-6 0.00413607 -2.70915 -1 -2.19562 -1.6548 -2.41515"
            " 1270.02 0"),
    2069: (6e4, "0.999999999999 0.0001 0.00539452 1e-6 0.120508 -1.26536 -0.328054 2.20881 -1.72526"
            " 1e-9 529.02 0"),
    39820: (7e4, "1e6 0.0150525 0.00623059 0.916123 0 1.73406 -0.212826 -2.89482 -0.7749 0.567901"
            " 437959 1"),
    60219: (2e4, "0.112442 0.0001 0.00136919 1e-6 0.0840557 2.76738 -1 -2.16015 1.27218 0 1e10 0"),
    42908: (1e4, "0.975298 0.00113756 6.85443e-6 1e-6 8.98881e-4 2.15859 1 -1.88614 -0.442867 0"
            " 24291.7 0"),
    # No clearance: a push within rounding ended contacts that its derivative keeps.
    2010: (4e4, "0.00826797 1e-4 1.28794e-5 0.476985 0 2.6837 0.948891 1.76083 2.78644 -1.41134"
           " 2710.19 0"),
}  # fmt: skip
NAMES = [
    "damping_ratio",
    "frequency_ratio",
    "mass_ratio",
    "restitution",
    "clearance",
    "phase",
    "initial_position",
    "initial_displacement",
    "initial_velocity",
    "initial_relative_velocity",
    "contact_stiffness_ratio",
    "contact_tension",
]


def model(name: str) -> Compliant:
    zeta, omega, mu, r, k, tension = EXTREMES[name]
    p = Parameters(mu, zeta, omega, 1.0, r, contact_stiffness_ratio=k, contact_tension=tension)
    return prepare(p, 1e-12)


def rates(m: Compliant) -> matrix:
    """Rates of U, U', g, g', S, C from the equations of docs/models.md."""
    t = m.touch
    mu, drag, k, c = mpf(m.mass_ratio), mpf(t.drag), mpf(t.stiffness), mpf(t.damping)
    beta = mu / (1 + mu)
    push = matrix([[-1, -drag, -beta, -drag * beta, 1, 0]])
    a = mp.zeros(6, 6)
    a[0, 1], a[2, 3], a[4, 5], a[5, 4] = 1, 1, mpf(t.omega), -mpf(t.omega)
    a[1, :] = push / (1 + mu)
    a[3, :] = push - matrix([[0, 0, k / beta, c / beta, 0, 0]])
    return a


def watched(m: Compliant) -> matrix:
    return matrix([[0, 0, mpf(m.ending.gap), mpf(m.ending.gap_rate), 0, 0]])


@pytest.fixture(autouse=True)
def digits() -> None:
    with mp.workdps(60):
        yield


@pytest.mark.parametrize("name", EXTREMES)
def test_bound_holds_and_says_something(name: str) -> None:
    """From states of any past: the fourth derivative never exceeds it; both of its parts matter."""
    m = model(name)
    chance = random.Random(name)
    later = np.zeros((m.touch.levels + 1, 4))
    row = np.array([0.0, 0.0, m.ending.gap, m.ending.gap_rate, 0.0, 0.0])
    fill_later(m.touch, m.table, row, later)
    a = rates(m)
    fourth = watched(m) * a * a * a * a
    closest = 0.0
    for level in range(0, m.touch.levels, 3):
        angle, age = chance.uniform(0.0, 6.3), m.touch.shortest * 2.0**level * 1.5
        z = (*(10.0 ** chance.uniform(-9, 0) * chance.choice((-1, 1)) for _ in range(4)),)
        z = (*z, math.sin(angle), math.cos(angle))
        first = derivative(m.touch, z)
        sizes = (energy_size(m.touch, first), energy_size(m.touch, derivative(m.touch, first)))
        bound = later_bound4(m.touch, later, 0.0, sizes, age, age)
        now = expm(a * mpf(age)) * matrix(z)
        step = expm(a * mpf(age / 8))
        for _ in range(9):
            found = abs((fourth * now)[0])
            # What is left of a bound so small is rounding of the state's sizes.
            assert found <= bound * (1 + 1e-3)
            closest = max(closest, float(found / bound))
            now = step * now
    assert closest > 1e-3


@pytest.mark.parametrize("name", EXTREMES)
def test_rows_are_those_of_sixty_digits(name: str) -> None:
    """Rounding stays small although the fastest rate is up to 1e16 times the slowest."""
    m = model(name)
    later = np.zeros((m.touch.levels + 1, 4))
    row = np.array([0.0, 0.0, m.ending.gap, m.ending.gap_rate, 0.0, 0.0])
    fill_later(m.touch, m.table, row, later)
    a = rates(m)
    power = expm(a * mpf(m.touch.shortest))
    beta, mu = mpf(m.touch.reduced), mpf(m.mass_ratio)
    for level in range(m.touch.levels + 1):
        for order, r in ((1, watched(m) * a * a * a * power), (2, watched(m) * a * a * power)):
            g = r[2] - beta * r[0]
            norm = mp.sqrt(
                r[0] ** 2 + r[1] ** 2 / (1 + mu) + g**2 / mpf(m.touch.stiffness) + r[3] ** 2 / beta
            )
            force = mp.hypot(r[4], r[5])
            assert later[level, 2 * order - 2] == pytest.approx(float(norm), rel=0.05)
            assert later[level, 2 * order - 1] == pytest.approx(float(force), rel=0.05)
        power = power * power


@pytest.mark.parametrize("name", EXTREMES)
def test_a_creeping_contact_costs_some_steps_and_skips_nothing(name: str) -> None:
    """Up to the end of the search, or of the contact, the wall pushes; there it does not."""
    m = model(name)
    a, row = rates(m), watched(m)
    # Where the fast motion has died; of either sign, for all is linear.
    start = expm(a * mpf(1)) * matrix((0.0, 0.0, 0.0, 0.0, -0.6, 0.8))
    if (row * start)[0] < 0:
        start = -start
    z = tuple(float(v) for v in start)
    tau, found, _, steps = find_switch(m.touch, m.table, m.free, m.ending, z, HORIZON)
    assert steps < 700
    end = mpf(tau)
    first = (row * matrix(z))[0]
    times = [end * mpf(i) / 40 for i in range(1, 40)] + [
        end - end * mpf(2) ** -n for n in range(4, 30)
    ]
    assert min((row * expm(a * t) * matrix(z))[0] for t in times) > -1e-12 * first
    if found == FOUND:
        assert abs((row * expm(a * end) * matrix(z))[0]) < 1e-6 * first


@pytest.mark.parametrize("lane", LANES)
def test_lanes_that_once_took_for_ever(lane: int) -> None:
    most, numbers = LANES[lane]
    point = read_point(dict(zip(NAMES, map(float, numbers.split()), strict=True)))
    run = Trajectory(point.parameters, point.start(), max_events=5000)
    periods, time = run.start
    run.skip(periods + max(math.ceil(min(20.0, 20000.0 / run.period)), 1), time)
    assert run.status == 0
    assert run.evaluations < most


def test_long_searches_count_against_the_budget() -> None:
    """A lane of few events and long searches stops where the budget, made small, is used up."""
    code = """
import damper.models.compliant as compliant
from damper import Parameters
from damper.engine.trajectory import Trajectory
compliant.search_budget = lambda events: 1000.0
p = Parameters(0.00473156, 1e6, 0.00162584, 2.65173e-5, 0.108811, contact_stiffness_ratio=602.136)
run = Trajectory(p, max_events=1000)
run.skip(20)
print(run.status * 10 + (run.events < 1000))
"""
    assert search_budget(1000) == 1000 * LONG_SEARCH + MAX_STEPS
    assert in_new_process(code, DAMPER_COMPILE="0") == 11
