"""The laws that every run keeps: their names, and how far off each may be. No engine is loaded.

A violation is a difference of two sides of a law over the size of its terms, so roundoff is some
1e-16 to 1e-15.
"""

from collections.abc import Mapping

import numpy as np

from damper.engine.roundoff import EPSILON
from damper.parameters.variables import Variable

#: Variables that the observer `laws` writes, one value a run.
LAW_VARIABLES = (
    Variable(
        "penetration",
        "largest distance beyond a wall in flight",
        "1",
        comment="over the largest force, |x| and the gap's terms; a compliant contact has none",
    ),
    Variable(
        "touch",
        "largest gap at the moment of an impact, either way",
        "1",
        comment="over the sizes of the gap's terms",
    ),
    Variable(
        "continuity",
        "largest jump of a displacement, or of a velocity where nothing hits",
        "1",
        comment="between a segment's end and the next one's start, over the sizes of its terms",
    ),
    Variable("momentum", "largest change of momentum in an impact", "1", comment="over its terms"),
    Variable(
        "restitution_law",
        "largest departure from the rebound speed r s, s the approach speed",
        "1",
        comment="over the sizes of the approach speed's terms",
    ),
    Variable(
        "tensile_force",
        "largest tensile contact force in sticking",
        "1",
        comment="over the sizes of the force's terms",
    ),
    Variable(
        "energy_balance",
        "input less losses and change of the stored energy",
        "1",
        comment="over the whole window and the sizes of the balance's terms",
    ),
    Variable(
        "clock",
        "largest distance between a segment's length and that from its start to the next one's",
        "1",
        comment="over the cycle",
    ),
    Variable("not_finite", "segments with a number that is not finite", "1"),
)
SEGMENTS = Variable("segments", "segments of the run's window", "1")
LAW_NAMES = tuple(variable.name for variable in LAW_VARIABLES)

#: Largest violation that is still roundoff; the target of the project for penetration.
LIMIT = 1e-12
#: Share of the energy balance that a segment may add: a roundoff, at worst always of the same sign.
ENERGY_PER_SEGMENT = EPSILON


def excess(name: str, values: np.ndarray, segments: np.ndarray) -> np.ndarray:
    """How far each run is off a law, over what is allowed: above 1 the law is broken.

    NaN where there is nothing to violate.
    """
    if name == "not_finite":
        return np.where(values > 0.0, np.inf, values)
    limit = LIMIT + (ENERGY_PER_SEGMENT * segments if name == "energy_balance" else 0.0)
    return values / limit


def broken(arrays: Mapping[str, np.ndarray]) -> np.ndarray:
    """Whether each run breaks any law."""
    found = np.zeros(np.shape(arrays["segments"]), dtype=bool)
    for name in LAW_NAMES:
        found |= excess(name, np.asarray(arrays[name]), np.asarray(arrays["segments"])) > 1.0
    return found
