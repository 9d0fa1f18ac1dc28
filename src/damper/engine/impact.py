"""The impact: momentum is kept, the relative velocity is reversed and multiplied by r.

The mass ratio mu may be 0, of a free mass that does not act back, and infinite, of a fixed stop.
Each law has the weights mu/(1 + mu) and 1/(1 + mu), which are in [0, 1].

A contact law says what r is. It is a NamedTuple of parameters, under their names, and one function,
`restitution_at`, implemented for its class: docs/extending.md adds one. The engine takes r only
from this function, so no part of it assumes a constant r. Where the walls differ, the run has a law
for each wall (`DifferingWalls`); `law_at` chooses the wall's law.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class, by_class_or_default


@by_class
def restitution_at(law: Any, approach_speed: float) -> float:
    """Coefficient of restitution of an impact; at speed 0 its limit for small speeds."""


@by_class_or_default
def rebound_slope(law: Any, approach_speed: float) -> float:
    """Derivative of the rebound speed by the approach speed: by a difference, unless a law says."""
    step = 1e-6 * approach_speed
    high, low = approach_speed + step, approach_speed - step
    return (restitution_at(law, high) * high - restitution_at(law, low) * low) / (high - low)


@by_class_or_default
def restitution_change(law: Any, approach_speed: float) -> float:
    """Largest change of the coefficient from its limit for small speeds, up to a speed.

    It is that at the speed itself, unless a law that both falls and rises says otherwise.
    """
    return abs(restitution_at(law, approach_speed) - restitution_at(law, 0.0))


@by_class_or_default
def law_at(law: Any, side: float) -> Any:
    """Contact law of the right (side = 1) or left wall: the law itself, where they are alike."""
    return law


class DifferingWalls(NamedTuple):
    """A law of each wall; both are of one class."""

    left: Any
    right: Any


@law_at.of(DifferingWalls)
def _of_one_wall(law, side):
    return law.left if side < 0.0 else law.right


class ConstantRestitution(NamedTuple):
    """Newton's law: the same coefficient at each speed."""

    restitution: float


@restitution_at.of(ConstantRestitution)
def _constant(law, approach_speed):
    return law.restitution


@rebound_slope.of(ConstantRestitution)
def _constant_slope(law, approach_speed):
    return law.restitution


class YieldingRestitution(NamedTuple):
    """Restitution that falls above the speed v_y by a power law: r (v_y / v)^p, at v <= v_y r.

    With p = 1/4 it is that of fully plastic indentation: K. L. Johnson, Contact Mechanics,
    Cambridge University Press 1985, section 11.5. With p <= 1 no harder hit comes back slower.
    """

    restitution: float
    yield_speed: float
    yield_exponent: float


@restitution_at.of(YieldingRestitution)
def _yielding(law, approach_speed):
    if approach_speed <= law.yield_speed:
        return law.restitution
    return law.restitution * (law.yield_speed / approach_speed) ** law.yield_exponent


@rebound_slope.of(YieldingRestitution)
def _yielding_slope(law, approach_speed):
    r = restitution_at(law, approach_speed)
    return r if approach_speed <= law.yield_speed else (1.0 - law.yield_exponent) * r


class TabledRestitution(NamedTuple):
    """Restitution by a table: linear in log v between its rows, constant before and beyond them."""

    table: np.ndarray
    """Rows (v, r) at rising speeds; the last one may be repeated."""


@compiled
def _in_table(table, speed):
    """Restitution at a speed, and its derivative by the logarithm of the speed."""
    last = len(table) - 1
    if speed > table[0, 0]:
        for k in range(last):
            low, high = float(table[k, 0]), float(table[k + 1, 0])
            if speed <= high:
                r = float(table[k, 1])
                slope = (float(table[k + 1, 1]) - r) / math.log(high / low)
                return r + slope * math.log(speed / low), slope
        return float(table[last, 1]), 0.0
    return float(table[0, 1]), 0.0


@restitution_at.of(TabledRestitution)
def _tabled(law, approach_speed):
    return _in_table(law.table, approach_speed)[0]


@rebound_slope.of(TabledRestitution)
def _tabled_slope(law, approach_speed):
    r, slope = _in_table(law.table, approach_speed)
    return r + slope


@restitution_change.of(TabledRestitution)
def _tabled_change(law, approach_speed):
    limit = float(law.table[0, 1])
    change = abs(_in_table(law.table, approach_speed)[0] - limit)
    for k in range(len(law.table)):
        if law.table[k, 0] < approach_speed:
            change = max(change, abs(float(law.table[k, 1]) - limit))
    return change


#: Name -> class, whose fields are those of `damper.Parameters` that it takes.
LAWS: dict[str, Any] = {"constant": ConstantRestitution, "yielding": YieldingRestitution}


@compiled
def impact(
    mass_ratio: float, restitution: float, side: float, v: float, approach_speed: float
) -> tuple[float, float]:
    """Velocity of the primary and gap rate just after an impact on the wall `side`."""
    if mass_ratio == math.inf:
        return side * restitution * approach_speed, restitution * approach_speed
    v += side * mass_ratio * (1.0 + restitution) / (1.0 + mass_ratio) * approach_speed
    return v, restitution * approach_speed


@compiled
def share_of(mass_ratio: float) -> float:
    """Part mu/(1 + mu) of a relative velocity that the primary takes: 1 beside a fixed stop.

    It is also the reduced mass over the primary's.
    """
    return mass_ratio / (1.0 + mass_ratio) if mass_ratio < math.inf else 1.0


@compiled
def inertia_of(mass_ratio: float) -> float:
    """Mass ratio in kinetic and potential energies: 0 of a fixed stop, which has none."""
    return mass_ratio if mass_ratio < math.inf else 0.0


@compiled
def mean_of(mass_ratio: float, of_primary: float, of_free: float) -> float:
    """Mean of both masses' displacements, velocities or accelerations, by mass."""
    if mass_ratio == math.inf:
        return of_free
    return (of_primary + mass_ratio * of_free) / (1.0 + mass_ratio)
