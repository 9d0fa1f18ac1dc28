"""The classical impact oscillator, as a damper whose free mass is a fixed stop."""

import damper
from damper import Parameters, PeriodicOrbit, State
from damper.engine.compiled import plain
from tests.reference.impact_oscillator import ImpactOscillator

#: The free mass rests at REST, so x meets it at sigma = REST + clearance.
REST = -10.0
OSCILLATOR = ImpactOscillator(2.8, 0.8)


def beside_a_stop(sigma: float) -> Parameters:
    return Parameters(1e15, 0.0, 2.8, sigma - REST, 0.8)


def one_impact(speed: float) -> PeriodicOrbit:
    """The closed-form motion with one impact a period, of this impact speed."""
    x, v, time = OSCILLATOR.after_impact(speed, -1.0)
    guess = State(x, v, REST, 0.0, time)
    return plain(damper.periodic_orbit)(beside_a_stop(x), state=guess)
