"""Free decay with two impacts a period, of a light free mass: its damping against the law."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from damper import Parameters, State, events
from damper.engine.compiled import plain

RESTITUTION = 0.3
RHO = 2 / math.pi * (1 - RESTITUTION) / (1 + RESTITUTION)


def theta_of(xi: float) -> float:
    """Displacement of the free mass at an impact, over the clearance."""
    square = 1 + RHO * RHO
    return (1 + math.sqrt(1 - square * (1 - xi * xi))) / square


def time_of_decay(start: float, end: float, mass_ratio: float, damping_ratio: float) -> float:
    """Time in which the primary's amplitude over the clearance falls, to first order in the mass.

    Its amplitude falls at the rate zeta + (4 mu rho / pi^2) (theta / xi)^2.
    """

    def rate(theta: float) -> float:
        xi2 = (theta - 1) ** 2 + (RHO * theta) ** 2
        loss = 4 * mass_ratio * RHO * (theta / math.pi) ** 2 + damping_ratio * xi2
        return ((1 + RHO * RHO) * theta - 1) / loss

    return quad(rate, theta_of(end), theta_of(start), epsabs=0, epsrel=1e-12)[0]


def measured(mass_ratio: float, damping_ratio: float) -> tuple[float, float, float]:
    """Amplitude over the clearance after an early and a late impact, and the time between them."""
    d, xi = 1.0, 0.8
    theta = theta_of(xi)
    x, v = (theta - 1) * d, -RHO * theta * d  # after an impact on the right wall
    state = State(x, v, x + d, -2 / math.pi * theta * d)
    p = Parameters(mass_ratio, damping_ratio, 1.0, d, RESTITUTION, force_amplitude=0.0)
    table = events(p, state, until=time_of_decay(xi, 0.45, mass_ratio, damping_ratio))
    assert set(table["kind"]) == {0}
    assert np.all(np.diff(table["side"]) != 0)  # two impacts a period
    hits = table[table["side"] == 1]
    first, last = hits[len(hits) // 10], hits[-1]
    return (
        math.hypot(first["x"], first["v"]) / d,
        math.hypot(last["x"], last["v"]) / d,
        last["time"] - first["time"],
    )


@pytest.mark.parametrize("loss", [0.0, 1.0], ids=["undamped", "damped"])
@plain
def test_error_of_the_law_of_decay_is_of_the_order_of_the_mass(loss: float) -> None:
    """Without a dashpot, and with one whose damping ratio is the mass ratio."""
    errors = []
    for mass_ratio in (1e-2, 1e-3, 1e-4):
        start, end, time = measured(mass_ratio, loss * mass_ratio)
        errors.append(time / time_of_decay(start, end, mass_ratio, loss * mass_ratio) - 1)
    assert 0 < errors[-1] < 3e-4
    assert errors[:-1] == pytest.approx([10 * error for error in errors[1:]], rel=0.05)
