"""The search for the end of a contact: nothing is skipped, and long contacts are cheap."""

import math
import random
from typing import Any

import numpy as np
import pytest

from damper import Parameters
from damper.engine.compiled import compiled
from damper.engine.search import first_root
from damper.models import model_of
from damper.models.compliant import Compliant
from damper.models.compliant.flow import advance, derivative, dot, force_rates_in
from damper.models.compliant.search import ContactMotion, contact_point
from damper.parameters.forcing import Harmonics, NoForce, Record

#: Sides of a root: found, or none up to the limit.
FOUND, NONE = 1.0, 0.0


@compiled
def search(model, z, limit):
    """Side, time and steps of the first root, and the event function's slope there."""
    moving = ContactMotion(model.contact, model.table, model.ending, 1.0, z)
    point = contact_point(moving, 0.0, z)
    lifts_off = point.value == 0.0 and point.slope == 0.0 and point.second == 0.0
    root = first_root(moving, point, math.inf, lifts_off, limit, 0.0)
    tau = root.point.tau + root.step
    end = contact_point(moving, tau, advance(model.contact, model.table, z, tau))
    return root.side, tau, root.steps, end.slope


@compiled
def scan(model, z, times, found):
    """Event function, its fourth derivative and slow part, and the fast, at some times."""
    event = model.ending
    for k in range(len(times)):
        w = advance(model.contact, model.table, z, float(times[k]))
        w4 = (w[0], w[1], w[2], w[3])
        for order in range(4):
            w4 = derivative(model.contact, w4, force_rates_in(model.contact, w)[order])
        found[k, 0] = event.gap * w[2] + event.gap_rate * w[3]
        found[k, 1] = event.gap * w4[2] + event.gap_rate * w4[3]
        found[k, 2] = dot(model.contact, event.slow[0], w)
        found[k, 3] = dot(model.contact, event.fast[0], w)
        found[k, 4] = dot(model.contact, event.fast[1], w)


@compiled
def bound_at_start(model, z):
    """Bound on the fourth derivative, and its growth."""
    point = contact_point(ContactMotion(model.contact, model.table, model.ending, 1.0, z), 0.0, z)
    return point.bound4, point.growth


def scanned(model: Compliant, z: tuple, times: np.ndarray) -> np.ndarray:
    """Columns of `scan`."""
    found = np.empty((len(times), 5))
    scan(model, z, np.ascontiguousarray(times, dtype=float), found)
    return found.T


def model(k: float, tension: int = 0, r: float = 0.6, **changes: Any) -> Compliant:
    given = {"mass_ratio": 0.1, "damping_ratio": 0.05, "frequency_ratio": 0.2, "clearance": 1.0}
    values = given | {"restitution": r, "contact_stiffness_ratio": k, "contact_tension": tension}
    return model_of(Parameters(**values | changes))


#: A harmonic, a sum of them on both masses, a record, none.
FORCES = [
    {},
    {"forcing": Harmonics((1, 2, 5), (0.7, -0.5, 0.2), (0.0, 1.0, 2.0)), "force_amplitude": 1.5},
    {"forcing": Record([0.0, 1.0, 3.0], [-0.8, 1.0, 0.5], of="base_acceleration")},
    {"forcing": NoForce()},
]
each_force = pytest.mark.parametrize("force", FORCES, ids=["harmonic", "sum", "record", "none"])


def random_case(seed: int, force: dict) -> tuple[Compliant, tuple]:
    chance = random.Random(seed)
    m = model(
        10 ** chance.uniform(0, 6),
        chance.choice([0, 1]),
        chance.choice([0.05, 0.5, 0.9, 0.99, 1.0]),
        mass_ratio=10 ** chance.uniform(-2, 1),
        damping_ratio=chance.choice([0.0, 0.02, 0.5, 3.0]),
        frequency_ratio=10 ** chance.uniform(-1, 1),
        **force,
    )
    angle = chance.uniform(0, 6.3)
    speed = 10 ** chance.uniform(-8, 0)
    u, w = chance.uniform(-2, 2), chance.uniform(-2, 2)
    # Sine and cosine; or value and slope.
    return m, (u, w, 0.0, -speed, math.sin(angle), math.cos(angle))


@each_force
def test_no_end_is_skipped(force: dict) -> None:
    """Against a scan of the exact motion at a hundredth of the fastest period."""
    ends = 0
    for seed in range(12):
        m, z = random_case(seed, force)
        limit = 6.0 / math.sqrt(m.contact.relative_stiffness)
        side, tau, _, slope = search(m, z, limit)
        values = scanned(m, z, np.linspace(0.0, tau, 600)[1:])[0]
        top = values.max()
        assert values[:-1].min() > -1e-12 * top
        if side == FOUND:
            ends += 1
            assert abs(values[-1]) < 1e-12 * top
            assert slope < 0.0
        else:
            assert side == NONE
            assert tau >= limit
    assert ends > 5


@pytest.mark.parametrize("tension", [0, 1])
@pytest.mark.parametrize(("k", "r"), [(1e5, 0.3), (1e8, 0.999999)])
def test_a_long_contact_costs_tens_of_evaluations(k: float, r: float, tension: int) -> None:
    """Half a forcing period of 1e5 oscillations of the contact; with r near 1 they all fast."""
    m = model(k, tension, r)
    # Pressed by the force, with a fast part as weak as a hundredth of the pressure.
    gap = -1.0 / m.contact.relative_stiffness
    z = (0.0, 0.0, 1.01 * gap, 0.0, -1.0, 0.0)
    side, tau, steps, _ = search(m, z, 25.0)
    assert side == FOUND
    assert 1.0 < tau < 25.0
    assert steps < (100 if r < 0.999 else 400)
    # A scan in the slow time, and around the end in the fast one, sees nothing before.
    fast = 1.0 / math.sqrt(m.contact.relative_stiffness)
    times = [*np.linspace(0.0, tau, 400)[:-1], *(tau - fast * np.linspace(30.0, 0.01, 300)), tau]
    values = scanned(m, z, np.array(times))[0]
    assert values[:-1].min() > 0.0
    assert abs(values[-1]) < 1e-10 * values[0]


@each_force
def test_slow_part_and_ring_move_apart(force: dict) -> None:
    """The fast part of a state is a free oscillation, whatever the rest does; both add up."""
    separated = 0
    for seed in range(12):
        m, z = random_case(seed, force)
        event = m.ending
        if not event.separated:
            continue
        separated += 1
        b, parts = 0.5 * event.fast_drag, np.array([0.0, 0.1, 1.0, 5.0, 40.0])
        tau = parts / math.sqrt(event.fast_stiffness)
        value, _, slow, fast, fast1 = scanned(m, z, tau)
        scale = abs(value[0]) + abs(fast[0]) + abs(slow[0])
        assert slow + fast == pytest.approx(value, abs=1e-12 * scale)
        # y'' + 2 b y' + w^2 y = 0 from (y, y1), by its own closed form.
        root = np.sqrt(complex(event.fast_stiffness - b * b))
        c, s = np.cos(root * tau), np.sin(root * tau) / root
        expected = np.exp(-b * tau) * (fast[0] * (c + b * s) + fast1[0] * s).real
        size = math.hypot(fast[0], fast1[0] / math.sqrt(event.fast_stiffness))
        assert fast == pytest.approx(expected, abs=1e-11 * size + 1e-14 * scale)
    assert separated > 4


@pytest.mark.parametrize(
    ("mu", "zeta", "omega", "k", "tension", "r"),
    [(0.0496, 0.0, 0.0225, 0.00271, 1, 0.95), (0.538, 10.0, 0.00308, 0.00762, 1, 1.0)],
)
def test_a_slow_contact_is_not_split(
    mu: float, zeta: float, omega: float, k: float, tension: int, r: float
) -> None:
    """The iteration diverges; that is noticed before numbers overflow, which would be a warning."""
    m = model(k, tension, r, mass_ratio=mu, damping_ratio=zeta, frequency_ratio=omega)
    assert m.split.separated == m.ending.separated == 0.0


@pytest.mark.parametrize("by_energy", [False, True])
@each_force
def test_fourth_derivative_stays_below_its_bound(force: dict, by_energy: bool) -> None:
    """Both bounds hold along the motion, and are not so loose that they say nothing."""
    used = 0
    for seed in range(30):
        m, z = random_case(seed, force)
        if by_energy:
            m = m._replace(ending=m.ending._replace(separated=0.0))
        if not by_energy and not m.ending.separated:
            continue
        used += 1
        bound, growth = bound_at_start(m, z)
        for span in (0.1 / m.contact.rate, 3.0 / m.contact.rate, 1.0):
            fourth = np.abs(scanned(m, z, np.linspace(0.0, span, 80))[1])
            assert fourth.max() <= (bound + growth * span) * (1 + 1e-9)
        assert fourth[0] > 1e-6 * bound or by_energy
    assert used > 8


@pytest.mark.parametrize("force", [-1e-9, -1e-3, -1.0])
def test_contact_from_rest_begins_at_second_order(force: float) -> None:
    m = model(1e4, 1)
    z = (0.0, 0.0, 0.0, 0.0, force, 0.0)
    side, tau, _, _ = search(m, z, 0.05)
    assert side == NONE
    assert scanned(m, z, np.array([tau]))[0][0] > 0.0


def test_contact_from_rest_begins_at_third_order() -> None:
    """No force, but one that grows against the wall: neither skipped nor a crawl."""
    m = model(1e4, 1)
    z = (0.0, 0.0, 0.0, 0.0, 0.0, -1.0)
    side, tau, steps, _ = search(m, z, 2.0)
    assert side == NONE
    assert steps < 100
    assert scanned(m, z, np.array([tau]))[0][0] > 0.0
