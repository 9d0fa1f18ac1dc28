"""The accumulation of a chatter sequence, in closed form, and whether masses in contact stick.

All is relative to one wall (side = +1 right, -1 left), with the gap g = clearance - side (y - x).
In a complete chatter sequence infinitely many impacts accumulate at an accumulation point, where
sticking begins. Derivations: docs/theory.md.
"""

import math
from typing import Any

from damper.engine.compiled import compiled
from damper.engine.impact import restitution_at, restitution_change


@compiled
def sticks(side: float, a: float, j: float, snap: float) -> bool:
    """Whether masses in contact with no relative velocity stay together.

    They do while the contact force is positive, -side a > 0; where `a` vanishes, the first
    derivative after it that does not decides.

    Parameters
    ----------
    a, j, snap : float
        Second to fourth derivative of side g in flight.
    """
    if a == 0.0:
        a = j
    if a == 0.0:
        a = snap
    return side * a <= 0.0


@compiled
def accumulation_times(
    impact_damping: float, restitution: float, force: float, jerk: float, gap_rate: float
) -> tuple[float, float]:
    """Time that infinitely many bounces take, to first and to second order in their speed.

    Parameters
    ----------
    impact_damping : float
        (damping mass_ratio + that of a support) / (1 + mass_ratio): each impact changes the
        velocities, and with them what the dashpots do.
    force, jerk : float
        -g'' > 0 and g''' of the gap just after an impact.
    gap_rate : float
        Rebound speed w.

    Returns
    -------
    first, second : float
        T1 and T2 of docs/theory.md, whatever they are worth here.
    """
    first = 2.0 * gap_rate / (force * (1.0 - restitution))
    # Each part is relative to `first` and of order w.
    bend = jerk / force * first / 3.0
    return first, first * (1.0 + bend - impact_damping * restitution * first)


@compiled
def accumulation(
    law: Any,
    impact_damping: float,
    dashpot_rate: float,
    snap_scale: float,
    force: float,
    jerk: float,
    gap_rate: float,
) -> tuple[float, float]:
    """Time to the accumulation point after an impact, and an estimate of its error, O(w^3).

    Parameters
    ----------
    law : NamedTuple
        Contact law; a change of its coefficient along the rest of the sequence counts as error.
    impact_damping, force, jerk, gap_rate : float
        As for `accumulation_times`.
    dashpot_rate : float
        Fastest rate at which dashpots change accelerations.
    snap_scale : float
        Size of the gap's fourth derivative, by the sizes of its terms: they need not cancel along
        the sequence.

    Returns
    -------
    duration, error : float
        An infinite error says that the sequence need not complete from here.
    """
    restitution = restitution_at(law, 0.0)
    if not (force > 0.0 and restitution < 1.0):
        return 0.0, math.inf
    if gap_rate == 0.0:
        return 0.0, 0.0
    first, duration = accumulation_times(impact_damping, restitution, force, jerk, gap_rate)
    change = (abs(jerk) / force + dashpot_rate) * first
    error = first * (change * change + snap_scale / force * first * first)
    # No later impact is faster than by this change.
    error += first * restitution_change(law, gap_rate * (1.0 + change)) / (1.0 - restitution)
    if not duration > 0.0 or not change < 0.5:
        return 0.0, math.inf
    return duration, error


@compiled
def accumulation_rubbing(
    law: Any,
    out: float,
    back: float,
    jerk: float,
    brake: float,
    snap_scale: float,
    gap_rate: float,
) -> tuple[float, float]:
    """As `accumulation` under dry friction, to first order. docs/models.md.

    Parameters
    ----------
    law, snap_scale, gap_rate
        As for `accumulation`.
    out, back : float
        -g'' on the way out of a bounce, friction with it, and on the way back.
    jerk : float
        Rate of a change of both, at most, but for what impacts change.
    brake : float
        Change of both by the impacts of a bounce, over its speed, at most.
    """
    shrinks = 0.0
    if back > 0.0:
        shrinks = restitution_at(law, 0.0) * math.sqrt(back / out)
    if not (back > 0.0 and shrinks < 1.0):
        return 0.0, math.inf
    left = gap_rate * (1.0 / out + 1.0 / math.sqrt(out * back)) / (1.0 - shrinks)
    change = (jerk + left * snap_scale) * left + brake * gap_rate
    if not change < 0.25 * back:
        return 0.0, math.inf
    # A bounce's time and speed change by that over `back`; each one's speed depends on all before.
    drift = change / back * (1.0 + (out - back) / (out * (1.0 - shrinks)))
    falls = restitution_change(law, gap_rate * (1.0 + change / back))
    error = left * (drift + falls / (1.0 - shrinks)) if change > 0.0 or falls > 0.0 else left
    return left, error


@compiled
def bounce_at(
    restitution: float, duration: float, gap_rate: float, tau: float
) -> tuple[float, float]:
    """Gap and gap rate in the closed rest of a sequence: its bounces are self-similar.

    Returns
    -------
    gap, gap_rate : float
        With a relative error that vanishes with the rebound speed `gap_rate`.
    """
    left = 1.0 - tau / duration
    if restitution == 0.0 or left <= 0.0:
        return 0.0, 0.0
    bounce = math.floor(math.log(left) / math.log(restitution))
    shrink = math.exp(bounce * math.log(restitution))
    length = duration * shrink * (1.0 - restitution)
    part = min(max((1.0 - left / shrink) / (1.0 - restitution), 0.0), 1.0)
    speed = gap_rate * shrink
    return speed * length * part * (1.0 - part), speed * (1.0 - 2.0 * part)
