"""The search for the end of a contact: nothing is skipped, and long contacts are cheap."""

import math
import random

import numpy as np
import pytest
from new_process import in_new_process

from damper import Parameters
from damper.models.compliant import Compliant, prepare
from damper.models.compliant.flow import advance, derivative, energy_size
from damper.models.compliant.search import FOUND, NOT_YET, _bound4, _parts, dot, find_switch


def model(k: float, tension: int = 0, r: float = 0.6, **changes: float) -> Compliant:
    given = {"mass_ratio": 0.1, "damping_ratio": 0.05, "frequency_ratio": 0.2, "clearance": 1.0}
    values = given | {"restitution": r, "contact_stiffness_ratio": k, "contact_tension": tension}
    return prepare(Parameters(**values | changes), 1e-12)


def watched(m: Compliant, z: tuple) -> float:
    return m.ending.gap * z[2] + m.ending.gap_rate * z[3]


def search(m: Compliant, z: tuple, limit: float = 25.0) -> tuple:
    return find_switch(m.touch, m.table, m.free, m.ending, z, limit)


def random_case(seed: int) -> tuple[Compliant, tuple]:
    chance = random.Random(seed)
    m = model(
        10 ** chance.uniform(0, 6),
        chance.choice([0, 1]),
        chance.choice([0.05, 0.5, 0.9, 0.99, 1.0]),
        mass_ratio=10 ** chance.uniform(-2, 1),
        damping_ratio=chance.choice([0.0, 0.02, 0.5, 3.0]),
        frequency_ratio=10 ** chance.uniform(-1, 1),
    )
    angle = chance.uniform(0, 6.3)
    speed = 10 ** chance.uniform(-8, 0)
    u, w = chance.uniform(-2, 2), chance.uniform(-2, 2)
    return m, (u, w, 0.0, -speed, math.sin(angle), math.cos(angle))


@pytest.mark.parametrize("seed", range(60))
def test_no_end_is_skipped(seed: int) -> None:
    """Against a scan of the exact motion at a fiftieth of the fastest period."""
    m, z = random_case(seed)
    limit = 6.0 / math.sqrt(m.touch.relative_stiffness)
    tau, found, end, _ = search(m, z, limit)
    times = np.linspace(0.0, tau, 500)[1:-1]
    scan = [watched(m, advance(m.touch, m.table, z, float(t))) for t in times]
    top = max(scan)
    assert min(scan) > -1e-12 * top
    if found == FOUND:
        assert abs(watched(m, end)) < 1e-12 * top
        fall = m.ending.gap * end[3] + m.ending.gap_rate * derivative(m.touch, end)[3]
        assert fall < 0.0
    else:
        assert found == NOT_YET
        assert tau == limit


@pytest.mark.parametrize("tension", [0, 1])
@pytest.mark.parametrize("r", [0.3, 0.6, 0.99, 0.999999])
@pytest.mark.parametrize("k", [1e6, 1e10])
def test_a_long_contact_costs_tens_of_evaluations(k: float, r: float, tension: int) -> None:
    """Half a forcing period of 1e6 oscillations of the contact; with r near 1 they all ring."""
    m = model(k, tension, r)
    # Pressed by the force, with a ring as weak as a hundredth of the pressure.
    gap = -1.0 / m.touch.relative_stiffness
    z = (0.0, 0.0, 1.01 * gap, 0.0, -1.0, 0.0)
    tau, found, end, steps = search(m, z)
    assert found == FOUND
    assert 1.0 < tau < 25.0
    assert abs(watched(m, end)) < 1e-10 * abs(watched(m, z))
    assert steps < (100 if r < 0.999 else 400)
    # A scan in the slow time, and around the end in the fast one, sees nothing before.
    fast = 1.0 / math.sqrt(m.touch.relative_stiffness)
    times = [*np.linspace(0.0, tau, 400)[1:-1], *(tau - fast * np.linspace(30.0, 0.01, 300))]
    scan = [watched(m, advance(m.touch, m.table, z, float(t))) for t in times]
    assert min(scan) > 0.0


@pytest.mark.parametrize("seed", range(20))
def test_slow_part_and_ring_move_apart(seed: int) -> None:
    """The ring of a state is a free oscillation, whatever the rest does; both add up."""
    m, z = random_case(seed)
    watch = m.ending
    if not watch.separated:
        pytest.skip("not faster than the rest")
    y, y1 = dot(watch.ring[0], z), dot(watch.ring[1], z)
    scale = abs(watched(m, z)) + abs(y) + abs(dot(watch.slow[0], z))
    assert dot(watch.slow[0], z) + y == pytest.approx(watched(m, z), abs=1e-13 * scale)
    size = math.sqrt(y * y + y1 * y1 / watch.ring_stiffness)
    b = 0.5 * watch.ring_drag
    for part in (0.1, 1.0, 5.0, 40.0):
        tau = part / math.sqrt(watch.ring_stiffness)
        after = advance(m.touch, m.table, z, tau)
        # y'' + 2 b y' + w^2 y = 0 from (y, y1), by its own closed form.
        root = np.sqrt(complex(watch.ring_stiffness - b * b))
        c, s = np.cos(root * tau), np.sin(root * tau) / root
        expected = math.exp(-b * tau) * (y * (c + b * s) + y1 * s).real
        found = dot(watch.ring[0], after)
        assert found == pytest.approx(expected, abs=1e-11 * size + 1e-14 * scale)
        # The slow part goes on where the ring is taken away.
        assert dot(watch.slow[0], after) + found == pytest.approx(
            watched(m, after), abs=1e-12 * scale
        )


@pytest.mark.parametrize("push", [-1e-9, -1e-3, -1.0])
def test_contact_from_rest_begins_at_second_order(push: float) -> None:
    m = model(1e4, 1)
    _, found, end, _ = search(m, (0.0, 0.0, 0.0, 0.0, push, 0.0), 0.05)
    assert found == NOT_YET
    assert end[2] < 0.0


def test_contact_from_rest_begins_at_third_order() -> None:
    """No force, but one that grows against the wall: neither skipped nor a crawl."""
    m = model(1e4, 1)
    tau, found, end, steps = search(m, (0.0, 0.0, 0.0, 0.0, 0.0, -1.0), 2.0)
    assert (found, tau) == (NOT_YET, 2.0)
    assert end[2] < 0.0
    assert steps < 100
    tau, found, _, _ = search(m, (0.0, 0.0, 0.0, 0.0, 0.0, 1.0), 5.0)
    assert (found, tau) == (FOUND, 0.0)


@pytest.mark.parametrize("seed", range(40))
@pytest.mark.parametrize("by_energy", [False, True])
def test_fourth_derivative_stays_below_its_bound(seed: int, by_energy: bool) -> None:
    """Both bounds hold along the motion, and are not so loose that they say nothing."""
    m, z = random_case(seed)
    watch = m.ending._replace(separated=0.0) if by_energy else m.ending
    if not by_energy and not watch.separated:
        pytest.skip("not faster than the rest")

    def fourth(state: tuple) -> float:
        for _ in range(4):
            state = derivative(m.touch, state)
        return watched(m, state)

    swing, omega = 1.0 / math.sqrt(m.touch.reduced), m.touch.omega
    third = derivative(m.touch, derivative(m.touch, derivative(m.touch, z)))
    sizes = [swing * energy_size(m.touch, w) for w in (third, derivative(m.touch, third))]
    slow = ring = 0.0
    if not by_energy:
        *_, f3, f4, _, ring = _parts(watch, z)
        slow = math.sqrt(max(watch.stiffness, 0.0) * f3 * f3 + f4 * f4)
    for span in (0.1 / m.touch.rate, 3.0 / m.touch.rate, 1.0):
        bound = _bound4(watch, swing, omega**3, omega, *sizes, slow, ring, span)
        times = np.linspace(0.0, span, 60)
        found = [abs(fourth(advance(m.touch, m.table, z, float(t)))) for t in times]
        assert max(found) <= bound * (1 + 1e-9)
    assert abs(fourth(z)) > 1e-6 * bound or by_energy


def test_extreme_contacts_overflow_quietly_in_plain_python() -> None:
    """A contact that cannot be split makes the iteration diverge: NumPy's scalars would warn."""
    code = """
from damper import Parameters
from damper.models.compliant import prepare
p = Parameters(2e-6, 8e5, 757.8, 1.0, 0.9, contact_stiffness_ratio=158.0, contact_tension=1)
print(int(prepare(p, 1e-12).split.separated))
"""
    assert in_new_process(code, "-W", "error", DAMPER_COMPILE="0") == 0
