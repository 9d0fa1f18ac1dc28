"""Limit of a vanishing free mass: which restitution lets every burst complete.

A free mass without weight does not move the primary, whose walls go as A sin(psi). It leaves the
left wall where that wall's acceleration turns, at psi = 0, and meets the right one at theta, with
theta - sin(theta) = G = 2 d / A and the approach speed 1 - cos(theta), in units of A and of phase.
If its bounces accumulate before psi = pi, both masses stick until then and the mirror image of it
all follows; the restitution up to which they do is r_crit(G).

Times are counted back from pi, as the phase that is *left* of the contact force, so that its end
keeps its digits. After an impact with rebound speed w the gap is, a time tau later,

    g = w tau - 2 sin(left) sin(tau/2)^2 + cos(left) (tau - sin(tau)).

Its second derivative is negative up to pi: Newton's iteration from the right of the one root falls
on it monotonically, and no impact can be missed. Derivation: docs/theory.md.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

#: Part of the contact force that the rest of a burst may take for it to complete for sure.
_SURE = 0.125
#: The rest of a burst is closed by the formula of first order when it is shorter than this part.
_CLOSED = 1e-9
#: Below this angle tau - sin(tau) is summed as a series.
_SMALL = 0.5


def first_impact(reduced_gap: float) -> float:
    """Phase theta of the first impact after a release, theta - sin(theta) = G, from 0 to pi.

    G = 2 d / A is the free travel over the amplitude of the walls; ValueError unless 0 <= G <= pi:
    beyond, the wall draws away before the free mass arrives.
    """
    gap = _checked("reduced_gap", reduced_gap, math.pi, "pi")
    # theta - sin(theta) >= theta^3 / pi^2 on [0, pi]: this lies at or beyond the root, and the
    # function is convex, so Newton's iteration comes down to it.
    theta = min(math.cbrt(math.pi * math.pi * gap), math.pi)
    while theta > 0.0:
        lower = theta - (_less_sine(theta) - gap) / _less_cosine(theta)
        if not lower < theta:
            break
        theta = lower
    return theta


def completes(reduced_gap: float, restitution: float) -> bool:
    """Whether the burst after a release completes before the walls' acceleration reverses.

    Certain but for roundoff: a flight outlasts the force, or a bound on all further flights does
    not. With `left` of the force left and the rebound speed w, let a be the least and q a the
    greatest acceleration over the next left/2. A flight under a to q a returns with at most sqrt(q)
    w, and with no more than w once the acceleration falls, so the n-th rebound speed is at most q w
    r^n and all flights together last at most 2 q w / (a (1 - r)) while that is below left/2. With a
    >= sin(left)/2 and q <= 2/sin(left), or q <= 2 from the greatest acceleration on, this is the
    test used. ValueError unless 0 <= G <= pi and 0 <= r <= 1.
    """
    return _follow(first_impact(reduced_gap), restitution, _SURE) is not None


def accumulation(reduced_gap: float, restitution: float) -> float:
    """Phase of the walls' motion, below pi, at which the burst after a release completes.

    NaN if their acceleration reverses first; arguments and errors are those of `completes`.
    """
    end = _follow(first_impact(reduced_gap), restitution, _CLOSED)
    if end is None:
        return math.nan
    left, rebound = end
    tail = 2.0 * rebound / (math.sin(left) * (1.0 - restitution)) if rebound else 0.0
    return math.pi - (left - tail)


def critical_restitution(reduced_gap: ArrayLike) -> np.ndarray:
    """Largest restitution at which the burst after a release completes, r_crit(G).

    In the shape of G, bisected to neighbouring doubles. 1 at G = 0, 0 at G = pi, and NaN beyond,
    where such a cycle does not exist. ValueError for a value that is negative or NaN.
    """
    gaps = np.asarray(reduced_gap, dtype=float)
    if not (gaps >= 0.0).all():
        raise ValueError(f"reduced_gap = {reduced_gap!r}: must be numbers >= 0")
    return np.array([_bisect(gap) for gap in gaps.ravel().tolist()]).reshape(gaps.shape)


def _bisect(gap: float) -> float:
    if gap > math.pi:
        return math.nan
    if gap == 0.0:
        return 1.0
    theta = first_impact(gap)
    low, high = 0.0, 1.0
    while low < (middle := 0.5 * (low + high)) < high:
        if _follow(theta, middle, _SURE) is not None:
            low = middle
        else:
            high = middle
    return low


def _follow(theta: float, restitution: float, part: float) -> tuple[float, float] | None:
    """Follow a burst from its first impact until the rest takes a small part of the phase left.

    Returns the phase left to pi and the rebound speed after the last impact followed; None if a
    flight outlasts the force.
    """
    r = _checked("restitution", restitution, 1.0, "1")
    left = math.pi - theta
    rebound = r * _less_cosine(theta)
    while left > 0.0:
        force = math.sin(left)
        bound = part * left if left <= 0.5 * math.pi else part * left * force
        if 2.0 * rebound <= bound * force * (1.0 - r):
            return left, rebound
        flight = _flight(left, rebound)
        if flight is None:
            return None
        time, speed = flight
        left -= time
        rebound = r * speed
    return None


def _flight(left: float, rebound: float) -> tuple[float, float] | None:
    """Duration and approach speed of the next flight; None if it outlasts the contact force."""
    sine, cosine = math.sin(left), math.cos(left)
    gap, rate = _motion(left, rebound, sine, cosine)
    if gap >= 0.0:
        return None
    time = left
    if 2.0 * rebound < sine * left:
        # A start with the acceleration of now. Wherever the gap falls, one step leads to the right
        # of the root.
        guess = 2.0 * rebound / sine
        near, slope = _motion(guess, rebound, sine, cosine)
        if slope < 0.0 and guess - near / slope < left:
            time = guess - near / slope
            gap, rate = _motion(time, rebound, sine, cosine)
    while True:
        earlier = time - gap / rate
        if not 0.0 < earlier < time:
            return time, -rate
        time = earlier
        gap, rate = _motion(time, rebound, sine, cosine)


def _motion(time: float, rebound: float, sine: float, cosine: float) -> tuple[float, float]:
    """Gap and its rate in a flight."""
    versine = _less_cosine(time)
    gap = rebound * time - sine * versine + cosine * _less_sine(time)
    return gap, rebound - sine * math.sin(time) + cosine * versine


def _less_cosine(angle: float) -> float:
    """1 - cos(angle) without cancellation."""
    half = math.sin(0.5 * angle)
    return 2.0 * half * half


def _less_sine(angle: float) -> float:
    """angle - sin(angle) without cancellation."""
    if abs(angle) > _SMALL:
        return angle - math.sin(angle)
    square = angle * angle
    total = 0.0
    for n in (17, 15, 13, 11, 9, 7, 5):
        total = square / (n * (n - 1)) * (1.0 - total)
    return angle * square / 6.0 * (1.0 - total)


def _checked(name: str, value: float, most: float, words: str) -> float:
    number = float(value)
    if not 0.0 <= number <= most:
        raise ValueError(f"{name} = {value!r}: must be a number from 0 to {words}")
    return number
