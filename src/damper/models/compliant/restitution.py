"""Coefficient of restitution of a compliant contact from its damping, and back.

While two free bodies touch through a spring and a dashpot, the gap is a damped oscillator,
g'' + 2 z w g' + w^2 g = 0, that starts at g = 0. Two conventions say when the contact ends:

- ``tension=True``: the contact force may be tensile, and the contact ends when the gap reopens,
  half a damped period later: r = exp(-pi z / sqrt(1 - z^2)), and r = 0 for z >= 1;
- ``tension=False``: it ends when its force, w^2 g + 2 z w g', vanishes. With z = cos(a)
  that is a time 2 a / (w sin(a)) later and r = exp(-2 a cot(a)); with z = cosh(a), a hyperbolic
  cotangent stands in its place. So z = 1 has r = exp(-2), and no damping gives r = 0.

(Derived in docs/models.md.)
"""

import math

#: Newton's steps; it converges in six from the starting values below.
_ITERATIONS = 40


def restitution_of(contact_damping: float, tension: bool = False) -> float:
    """Coefficient of restitution of a free contact; ValueError for an invalid damping ratio.

    The damping ratio z >= 0 is that of the contact oscillation, with the reduced mass; `tension`
    says whether the contact force may be tensile.
    """
    z = float(contact_damping)
    if not 0.0 <= z < math.inf:
        raise ValueError(f"contact_damping = {contact_damping!r}: must be a finite number >= 0")
    if tension:
        return 0.0 if z >= 1.0 else math.exp(-math.pi * z / math.sqrt((1.0 - z) * (1.0 + z)))
    root = math.sqrt(abs((1.0 - z) * (1.0 + z)))
    if root < 1e-8:
        return math.exp(-2.0)
    # The angle by its sine, or the sinh: the inverse cosine is ill-conditioned at z = 1.
    angle = math.atan2(root, z) if z < 1.0 else math.asinh(root)
    return math.exp(-2.0 * z * angle / root)


def contact_damping(restitution: float, tension: bool = False) -> float:
    """Damping ratio of the contact that gives a restitution 0 < r <= 1; ValueError beyond.

    With tension 0 will do too: it is damped critically then. Accurate relative to itself, also as r
    -> 1, where it is (1 - r) / pi.
    """
    r = float(restitution)
    if not (0.0 < r <= 1.0 or (tension and r == 0.0)):
        limits = "0 <= restitution <= 1" if tension else "0 < restitution <= 1"
        raise ValueError(f"restitution = {restitution!r}: must be a number with {limits}")
    if r == 1.0:
        return 0.0
    if r == 0.0:
        return 1.0
    half = -0.5 * math.log(r)
    if tension:
        return 2.0 * half / math.hypot(math.pi, 2.0 * half)
    if half < 0.5:
        # In the angle from pi / 2, of which z is the sine: no digit is lost as r -> 1.
        angle = 2.0 * half / math.pi
        for _ in range(_ITERATIONS):
            tan = math.tan(angle)
            rest = 0.5 * math.pi - angle
            step = (tan * rest - half) / ((1.0 + tan * tan) * rest - tan)
            angle -= step
            if abs(step) <= 1e-17 + 1e-16 * angle:
                break
        return math.sin(angle)
    if half < 1.0:
        # a cot(a) = half in the square of a, in which it is nearly a line: 1 - a^2 / 3.
        square = 3.0 * (1.0 - half)
        for _ in range(_ITERATIONS):
            a = math.sqrt(max(square, 0.0))
            if a < 1e-4:
                value, slope = 1.0 - square / 3.0, -1.0 / 3.0
            else:
                sin = math.sin(a)
                value = a * math.cos(a) / sin
                slope = (math.cos(a) / sin - a / (sin * sin)) / (2.0 * a)
            step = (value - half) / slope
            square -= step
            if abs(step) <= 1e-16:
                break
        return math.cos(math.sqrt(max(square, 0.0)))
    # a coth(a) = half.
    if half - 1.0 < 1e-8:
        return 1.0 + 1.5 * (half - 1.0)
    a = math.sqrt(3.0 * (half - 1.0)) if half < 2.0 else half
    for _ in range(_ITERATIONS):
        tanh = math.tanh(a)
        # 1 / sinh(a)^2 = 1 / tanh(a)^2 - 1, without the overflow.
        step = (a / tanh - half) / (1.0 / tanh - a * (1.0 - tanh) * (1.0 + tanh) / (tanh * tanh))
        a -= step
        if abs(step) <= 1e-16 * a:
            break
    return math.cosh(a)


def contact_phase(contact_damping: float, tension: bool = False) -> float:
    """Duration of a contact of free bodies times its undamped frequency; 0 where it lasts."""
    z = contact_damping
    root = math.sqrt(abs((1.0 - z) * (1.0 + z)))
    if tension:
        return math.pi / root if z < 1.0 else 0.0
    if root < 1e-8:
        return 2.0
    angle = math.atan2(root, z) if z < 1.0 else math.asinh(root)
    return 2.0 * angle / root
