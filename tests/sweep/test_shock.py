"""The smallest shock: what bounds the basin is known in closed form, and runs on either side."""

from dataclasses import replace

import numpy as np
import pytest
from fixed_stop import OSCILLATOR, one_impact
from scipy.optimize import brentq

from damper import Parameters, PeriodicOrbit, SIParameters, State, periodic_orbit, smallest_shock
from damper.models import start_run
from damper.sweep.orbits.arcs import vector


def distances(state: State, orbit: PeriodicOrbit, periods: int) -> np.ndarray:
    """Of a run from an orbit, at the start of each forcing period."""
    run, found = start_run(orbit.parameters, state), []
    for k in range(1, periods + 1):
        run.skip(run.start[0] + k)
        found.append(abs(vector(run.state_at(run.start[0] + k)) - orbit.start).max())
    return np.array(found)


def test_the_basin_ends_at_the_manifold_of_the_unstable_motion() -> None:
    """At the threshold a run passes that motion; just below it comes back, just above it does not.

    Near the fold there are both motions, of two impact speeds beside the same stop.
    """
    low = 0.99 * OSCILLATOR.fold_speed
    high = brentq(
        lambda speed: OSCILLATOR.stop(speed, -1.0) - OSCILLATOR.stop(low, -1.0),
        OSCILLATOR.fold_speed,
        abs(OSCILLATOR.g) / OSCILLATOR.d,
    )
    stable, unstable = one_impact(high), one_impact(low)
    assert (stable.stable, unstable.stable) == (True, False)
    shock = smallest_shock(stable, moments=1, largest=1.0, tolerance=1e-4)
    assert shock.size - shock.returns <= 1e-4 * shock.size
    passed = distances(shock.state, unstable, 80) / abs(stable.start - unstable.start).max()
    assert passed[0] > 0.5
    assert passed.min() < 0.01
    assert distances(shock.state, stable, 300)[-1] > 1.0
    below = shock.direction * (shock.returns - shock.size)
    back = replace(shock.state, v=shock.state.v + below)
    assert distances(back, stable, 300)[-1] < 1e-6


def test_what_has_no_threshold() -> None:
    p = Parameters(0.1, 0.1, 1.0, 5.0, 0.5)
    working = periodic_orbit(p)
    with pytest.raises(ValueError, match="no shock up to 2 throws the motion out"):
        smallest_shock(working, moments=1, largest=2.0)
    idle = periodic_orbit(replace(p, clearance=6.0))
    with pytest.raises(ValueError, match="only a stable motion"):
        smallest_shock(idle)


def test_a_shock_in_si_units() -> None:
    """The same one, its size in m/s; it need but be back soon."""
    p = SIParameters(2.0, 4.0, 200.0, 10.0, 10.0, 0.2, gap=0.5, restitution=0.5)
    settings = {"moments": 1, "settle": 5, "tolerance": 0.01}
    scaled = smallest_shock(periodic_orbit(p.dimensionless), **settings, largest=1.0)
    orbit = periodic_orbit(p)
    shock = smallest_shock(orbit, **settings, largest=0.5)
    assert (shock.direction, shock.motion) == (scaled.direction, scaled.motion)
    assert (shock.size, shock.returns) == pytest.approx((0.5 * scaled.size, 0.5 * scaled.returns))
    assert shock.state.v - orbit.state.v == pytest.approx(shock.direction * shock.size)


def test_a_shock_on_a_damper_with_several_masses() -> None:
    """A list of one mass is the damper; of two each has its motion. The threshold parts runs."""
    settings = {"moments": 1, "settle": 3, "tolerance": 0.02, "largest": 1.0}
    alone = periodic_orbit(Parameters(0.1, 0.1, 1.0, 5.0, 0.5))
    known = smallest_shock(alone, **settings)
    p, (x, v, y, u) = alone.parameters, alone.start
    found = smallest_shock(periodic_orbit(replace(p, masses=[{}])), **settings)
    assert (found.size, found.returns) == pytest.approx((known.size, known.returns), rel=1e-9)
    assert (found.direction, found.motion) == (known.direction, known.motion)
    masses = [{}, {"clearance": 4.9}]
    two = replace(p, mass_ratio=0.05, masses=masses)
    orbit = periodic_orbit(two, state=State(x, v, [y, y], [u, u]))
    shock = smallest_shock(orbit, **settings)
    assert shock.motion.startswith("mass 0: period 1, 1 impact on each wall")
    assert "; mass 1: period 1" in shock.motion
    below = replace(shock.state, v=shock.state.v + shock.direction * (shock.returns - shock.size))
    back = 1e-5 * abs(orbit.start[:2]).max()
    assert distances(shock.state, orbit, 3)[-1] > back > distances(below, orbit, 3)[-1]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"largest": 1e300}, "largest = 1e[+]300: must be a positive number <= 2700.26, 1000"),
        ({"moments": 1e9}, "moments = 1000000000.0: must be a whole number >= 1 and <= 1000"),
        ({"settle": 1e10}, "settle = 10000000000.0: must be a whole number >= 1 and <= 1000000000"),
        ({"tolerance": 1e-17}, "tolerance = 1e-17: must be a number with 1e-12 <= tolerance < 1"),
    ],
)
def test_a_search_without_bounds_is_refused(given: dict[str, float], message: str) -> None:
    working = periodic_orbit(Parameters(0.1, 0.1, 1.0, 5.0, 0.5))
    with pytest.raises(ValueError, match=message):
        smallest_shock(working, **given)
