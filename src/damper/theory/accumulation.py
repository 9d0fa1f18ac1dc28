"""When and where a complete chatter sequence ends, from its state just after one impact.

With w the rebound speed, a = -g'' > 0 the contact force and j = g''' just after the impact (g the
gap), the infinitely many bounces that follow take

    T1 = 2 w / (a (1 - r))
    T2 = T1 + (4/3) j w^2 / (a^3 (1 - r)^2) - 4 z r w^2 / (a^2 (1 - r)^2)
    z = (zeta mu + zeta2 / mu) / (1 + mu)

with errors O(w^2) and O(w^3): `damper.engine.accumulation.accumulation_times`. zeta2 is the
`support_damping_ratio`. A free mass that varies has its mu at the impact: the change enters
with O(w^3). The pair's centre of mass moves as if the masses stuck already, up to O(w^3): from x
with the common velocity V = (x' + mu y') / (1 + mu). T1 is what Nordmark and Piiroinen (2009) take:
their 2 r v / (a (1 - r)), v = w / r. Derivation: docs/theory.md.
"""

import math
from typing import Any, NamedTuple

from damper.engine.accumulation import accumulation_times
from damper.engine.compiled import compiled
from damper.engine.segment import FLIGHT, IMPACT, Segment
from damper.models import model_of
from damper.models.walls import chatter_of, travel_together
from damper.parameters import Parameters
from damper.parameters.models import require_model
from damper.parameters.quantities import check_quantity
from damper.parameters.quantity import finite

#: Models whose chatter sequences the formulas describe.
MODELS = ("rigid", "grounded", "time_varying", "prescribed")
#: Longest time, in units of sqrt(M/K), over which a prediction follows the sticking flow.
LONGEST = 1e6


class Prediction(NamedTuple):
    """Time and travel from an impact to the end of its chatter sequence; NaN without a prediction.

    Times in units of sqrt(M/K); the primary's displacements from that impact to accumulation, in
    units of F0/K. `error` estimates that of the second-order time, relative to the first-order
    one: the formulas hold where it is small, and it is infinite where they claim nothing.
    """

    first_order_time: float
    second_order_time: float
    first_order_displacement: float
    second_order_displacement: float
    error: float


def predict(
    parameters: Parameters, side: int, time: float, x: float, v: float, rebound_speed: float
) -> Prediction:
    """Predict the rest of a chatter sequence from the state just after one of its impacts.

    Parameters
    ----------
    parameters : Parameters
        Of the damper; restitution < 1.
    side : {-1, 1}
        Wall of the sequence: -1 left, 1 right.
    time, x, v : float
        Time of the impact (units of sqrt(M/K)), displacement and velocity of the primary just
        after it.
    rebound_speed : float
        Rate of the gap then, >= 0.

    Returns
    -------
    Prediction

    Raises
    ------
    ValueError
        For compliant contact, friction, several masses, a table of restitutions, a force that is a
        record, another side or one without a wall, restitution = 1, a negative rebound speed, what
        is not finite, and a contact force that is not positive just after the impact: such a
        sequence need not complete.
    TypeError
        When a value is not a real number.

    Examples
    --------
    >>> p = Parameters(mass_ratio=0.5, damping_ratio=0.2, frequency_ratio=0.3, clearance=0.5,
    ...                restitution=0.6)
    >>> found = predict(p, 1, 2.0, 2.0, 0.1, 0.01)  # 0.0340400694 bounce by bounce
    >>> round(found.first_order_time, 7), round(found.second_order_time, 7)
    (0.0338901, 0.0340356)
    """
    if side not in (-1, 1):
        raise ValueError(f"side = {side!r}: must be -1 (left wall) or 1 (right wall)")
    t, x, v = finite("time", time), finite("x", x), finite("v", v)
    w = finite("rebound_speed", rebound_speed)
    if w < 0.0:
        raise ValueError(f"rebound_speed = {rebound_speed!r}: must be a finite number >= 0")
    p = parameters
    require_model(p, MODELS, "the prediction")
    if p.walls == -side:
        raise ValueError(f"side = {side}: this damper has no wall there, walls = {p.walls:g}")
    if p.law not in ("constant", "yielding"):
        raise ValueError(f"{p!r}: must have a constant restitution at low speeds")
    if not p.forcing.repeats:
        raise ValueError(
            f"forcing = {p.forcing!r}: the prediction is that of a smooth force, not of one from "
            "sample to sample"
        )
    if w > p.yield_speed:
        raise ValueError(
            f"rebound_speed = {rebound_speed!r}: must be <= yield_speed = {p.yield_speed!r}, below "
            "which the restitution is constant"
        )
    own = "restitution_left" if side < 0 and p.restitution_left != math.inf else "restitution"
    _check_inelastic(own, getattr(p, own))
    periods, here = divmod(t, p.cycle)
    after = Segment(
        periods, here, x, v, 0.0, w, float(side), FLIGHT, IMPACT, 0.0, v, 0.0, 0.0, 0.0, 0.0, 0.0
    )
    found = predict_rest(model_of(p), after)
    if math.isnan(found.first_order_time):
        raise ValueError(
            f"the contact force is not positive just after this impact (side = {side}, x = {x!r}, "
            f"v = {v!r}, time = {time!r}): must be a state with side x'' < 0"
        )
    return found


@compiled
def predict_rest(model: Any, segment: Segment) -> Prediction:
    """Predict the rest of a chatter sequence from the segment that one of its impacts begins.

    NaN where the contact force is not positive, and of second order where that time is not, which
    it cannot be.
    """
    c, speed = chatter_of(model, segment), segment.gap_rate
    if not c.force * (1.0 - c.restitution) > 0.0:
        return Prediction(math.nan, math.nan, math.nan, math.nan, math.inf)
    if speed == 0.0:
        return Prediction(0.0, 0.0, 0.0, 0.0, 0.0)
    first, second = accumulation_times(c.damping, c.restitution, c.force, c.jerk, speed)
    dx = math.nan
    if 0.0 < second <= LONGEST:
        dx = travel_together(model, segment, second)
    else:
        second = math.nan
    return Prediction(first, second, c.velocity * first, dx, c.error / first)


def _check_inelastic(name: str, restitution: float) -> None:
    """Raise ValueError for a restitution with which no chatter sequence completes."""
    if check_quantity(name, restitution) == 1.0:
        raise ValueError(
            f"{name} = {restitution!r}: must be a finite number with 0 <= {name} < 1, "
            "for with 1 no chatter sequence completes"
        )
