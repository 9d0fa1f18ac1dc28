"""Motion of the damper with compliant contact, in arbitrary precision.

Everything is relative to the wall s in contact, as in `damper.models.compliant.flow`: with X = s x,
the gap g, beta = mu / (1 + mu) = 1 / gamma, and U = X - beta g the centre of mass,

    U'' = P / (1 + mu),    g'' = P - gamma (k g + c g'),    P = s sin(...) - 2 zeta X' - X.

Contacts are followed by Taylor series on panels that are short against the contact's own
oscillation, and their ends found by steps that cannot pass a root. Where a contact lasts, the four
modes of its equation separate slow from fast motion: as long as the slow part of the event function
exceeds the fast one's amplitude, which never grows, the contact goes on for certain, and steps are
those of the slow motion.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from mpmath import mp, mpf

from damper import parameters
from damper.engine.search import HORIZON
from damper.models.compliant.restitution import contact_damping
from damper.verification.comparison.reference_rigid import (
    GUARD_DIGITS,
    PANEL,
    Event,
    FlightState,
    PreciseParameters,
    ReferenceRun,
    advance_flight,
    fastest_rate,
    first_order,
    taylor,
)
from damper.verification.comparison.reference_series import (
    first_root,
    horner,
    lowest_order,
    term_count,
)

#: A panel that most contacts end in: over the fastest rate.
CONTACT_PANEL = 4
#: Modes nearer than this, of the fastest, are not separated: lasting contacts then take long.
_DISTINCT = 1e-6


class PreciseContact(NamedTuple):
    """Walls and masses as ``mpf``."""

    share: mpf
    """1 / (1 + mu)."""
    beta: mpf
    gamma: mpf
    k: mpf
    c: mpf
    tension: bool
    rate: mpf
    """Bound on the fastest rate."""
    lasting: mpf
    """Time after which a contact counts as sticking."""


class Modes(NamedTuple):
    """The free motion in contact as exponentials; the two fastest come last."""

    rates: list
    vectors: mp.matrix
    inverse: mp.matrix
    steady: mp.matrix
    """Response (U, U', g, g') to exp(i omega t)."""
    slowest: mpf
    """Bound on the rates of the two slow modes and of the forcing."""


def run(
    p: parameters.Parameters,
    state: Sequence[float],
    *,
    until: float,
    dps: int = 50,
    start_time: float = 0.0,
) -> ReferenceRun:
    """Return every event up to a time, and the state then.

    Impacts are the moments at which the gap closes. ``stick`` comes one period of the contact's
    oscillation (25 time units at most) after a contact that lasts longer began, and ``release`` at
    the end of that contact, as in `damper.models.compliant`.

    Parameters
    ----------
    p : damper.parameters.Parameters
        With a finite contact stiffness. The contact's damping is taken from the restitution in
        all digits.
    state : sequence
        ``(x, v, y, u)``; the free mass may be in touch.
    until, dps, start_time
        As in `reference_rigid.run`.
    """
    # Slow modes have gaps of the size 1 / k.
    extra = GUARD_DIGITS + round(abs(math.log10(p.contact_stiffness_ratio)))
    extra += round(abs(math.log10(p.mass_ratio)))
    with mp.workdps(dps + GUARD_DIGITS + extra):
        walk = _CompliantSolution(p, mpf(start_time), mpf(until))
        walk.run(*(mpf(value) for value in state))
        return ReferenceRun(walk.found, walk.final)


def damping_of(restitution: float, tension: bool) -> mpf:
    """Damping ratio of the contact for a coefficient of restitution, to the precision set.

    The maps of `damper.models.compliant.restitution`, inverted by the secant rule from its value.
    """
    start = mpf(contact_damping(restitution, tension))
    if restitution in (0.0, 1.0):
        return start
    log = mp.log(mpf(restitution))
    if tension:
        return -log / mp.hypot(mp.pi, log)

    def excess(z: mpf) -> mpf:
        if z == 1:
            return 2 + log
        root = mp.sqrt(abs((1 - z) * (1 + z)))
        return 2 * z * (mp.acos(z) if z < 1 else mp.acosh(z)) / root + log

    return mp.findroot(excess, (start, start * (1 + mpf(10) ** -12)), verify=False)


class _CompliantSolution:
    """One run at the precision that is set."""

    def __init__(self, p: parameters.Parameters, t: mpf, until: mpf) -> None:
        numbers = (
            p.mass_ratio,
            p.damping_ratio,
            p.frequency_ratio,
            p.clearance,
            p.restitution,
            p.phase,
        )
        self.p = PreciseParameters(*(mpf(value) for value in numbers))
        self.t, self.until = t, until
        self.contact = _contact(self.p, p)
        self.modes = _modes(self.p, self.contact)
        self.found: list[Event] = []
        self.final: tuple[mpf, ...] = ()

    def run(self, x: mpf, v: mpf, y: mpf, u: mpf) -> None:
        """Go from contact to contact."""
        p, contact = self.p, self.contact
        side = 1 if y >= x else -1
        pair = FlightState(x, v, side, p.d - side * (y - x), side * (v - u))
        # What comes next: a flight from the wall's surface on, a contact, or a flight below it.
        # Of the event function the terms below `order` are exactly zero.
        order = 0
        if pair.gap > 0:
            phase = "flight"
        elif pair.gap < 0:
            acts = contact.k * pair.gap + contact.c * pair.rate < 0
            phase = "contact" if contact.tension or acts else "below"
        elif pair.rate < 0:
            self._impact(pair)
            phase = "contact"
        else:
            phase, order = self._on_wall(pair)
        while self.t < self.until:
            if phase == "flight":
                hit, pair = advance_flight(p, self.t, pair, self.until, order)
                if hit is None:
                    break
                self.t, order = hit.time, 0
                pair = FlightState(hit.x, hit.v, hit.side, mpf(0), -hit.approach_speed)
                if hit.approach_speed > 0:
                    self._impact(pair)
                    phase = "contact"
                else:
                    phase, order = self._on_wall(pair)
            elif phase == "contact":
                ended, pair = self._touch(pair, order)
                if not ended:
                    break
                if contact.tension or contact.c == 0:
                    pair = pair._replace(gap=mpf(0), rate=max(pair.rate, mpf(0)))
                    phase, order = ("flight", 1) if pair.rate > 0 else self._on_wall(pair)
                else:
                    phase, order = "below", 1
            else:
                reopened, pair = self._below(pair, order)
                if reopened is None:
                    break
                phase, order = ("flight", 1) if reopened else ("contact", 1)
        x, v, side = pair.x, pair.v, pair.side
        self.final = (x, v, x + side * (p.d - pair.gap), v - side * pair.rate)

    def _impact(self, pair: FlightState) -> None:
        self.found.append(Event(self.t, "impact", pair.side, -pair.rate, pair.x, pair.v))

    def _on_wall(self, pair: FlightState) -> tuple[str, int]:
        """At the surface: whether it separates or is pressed against, or held by, the wall."""
        order, falls = first_order(self.p, self.t, pair)
        return ("contact", 0) if falls else ("flight", order)

    def _watched(self, g: Sequence[mpf]) -> list[mpf]:
        """Taylor coefficients of what is positive in contact: the depth, or the force."""
        contact = self.contact
        if contact.tension:
            return [-value for value in g]
        return [-(contact.k * g[n] + contact.c * (n + 1) * g[n + 1]) for n in range(len(g) - 1)]

    def _touch(self, pair: FlightState, order: int) -> tuple[bool, FlightState]:
        """Follow a contact to its end, or to the end of all."""
        p, contact = self.p, self.contact
        side, begun, sticks = pair.side, self.t, False
        short = CONTACT_PANEL / contact.rate
        count = term_count(mpf(CONTACT_PANEL))
        beta = contact.beta
        z = (
            side * pair.x - beta * pair.gap,
            side * pair.v - beta * pair.rate,
            pair.gap,
            pair.rate,
        )
        fresh, tau = True, None
        while self.t < self.until:
            # The moment at which it begins to count as sticking is an event of its own.
            goal = self.until if sticks else min(self.until, begun + contact.lasting)
            left = goal - self.t
            step = mpf(0) if fresh else self._sure_step(side, z, left)
            if step > 2 * short:
                z = self._slow_flow(side, z, step)
            else:
                step = min(short, left)
                centre, gap = _series(p, contact, self.t, side, z, count)
                q = self._watched(gap)
                if fresh:
                    q[:order] = [mpf(0)] * order
                    order = max(order, lowest_order(q))
                tau = first_root(q[order:], step, absolute=order == 0)
                step = step if tau is None else tau
                z = (*horner(centre, step), *horner(gap, step))
            fresh, order = False, 0
            self.t = goal if step == left else self.t + step
            x, v = side * (z[0] + beta * z[2]), side * (z[1] + beta * z[3])
            pair = FlightState(x, v, side, z[2], z[3])
            if tau is not None:
                if sticks:
                    self.found.append(Event(self.t, "release", side, mpf(0), x, v))
                return True, pair
            if not sticks and self.t == begun + contact.lasting:
                sticks = True
                self.found.append(Event(self.t, "stick", side, mpf(0), x, v))
        return False, pair

    def _sure_step(self, side: int, z: tuple, left: mpf) -> mpf:
        """Time for which the contact goes on whatever the fast mode does; 0 where not known."""
        p, contact, modes = self.p, self.contact, self.modes
        if modes is None:
            return mpf(0)
        row = (0, 0, -1, 0) if contact.tension else (0, 0, -contact.k, -contact.c)
        forced = side * mp.expj(p.omega * self.t + p.phase)
        amplitudes = modes.inverse * mp.matrix(
            [a - mp.im(b * forced) for a, b in zip(z, modes.steady, strict=True)]
        )
        seen = [sum(row[i] * modes.vectors[i, m] for i in (2, 3)) * amplitudes[m] for m in range(4)]
        fast = abs(seen[2]) + abs(seen[3])
        steady = -1j * forced * sum(row[i] * modes.steady[i] for i in (2, 3))
        terms = [*zip(seen[:2], modes.rates[:2], strict=True), (steady, 1j * p.omega)]
        if mp.re(sum(value for value, _ in terms)) <= fast:
            return mpf(0)
        step = min(PANEL / modes.slowest, left)
        q = []
        for n in range(term_count(mpf(PANEL))):
            q.append(mp.re(sum(value for value, _ in terms)))
            terms = [(value * rate / (n + 1), rate) for value, rate in terms]
        q[0] -= fast
        root = first_root(q, step, absolute=True)
        return step if root is None else root

    def _slow_flow(self, side: int, z: tuple, span: mpf) -> tuple:
        """Exact flow in contact, by its modes."""
        p, modes = self.p, self.modes
        assert modes is not None  # else no step is sure
        forced = side * mp.expj(p.omega * self.t + p.phase)
        free = modes.inverse * mp.matrix(
            [a - mp.im(b * forced) for a, b in zip(z, modes.steady, strict=True)]
        )
        for m in range(4):
            free[m] *= mp.exp(modes.rates[m] * span)
        free = modes.vectors * free
        forced *= mp.expj(p.omega * span)
        return tuple(mp.re(free[i]) + mp.im(modes.steady[i] * forced) for i in range(4))

    def _below(self, pair: FlightState, order: int) -> tuple[bool | None, FlightState]:
        """A flight below the wall's surface: True if the gap reopens, False if the wall catches up.

        None at the end of all.
        """
        p, contact = self.p, self.contact
        x, v, side, g, rate = pair
        longest = PANEL / fastest_rate(p, mpf(1))
        while self.t < self.until:
            step = min(longest, self.until - self.t)
            if rate > 0:
                step = min(step, -2 * g / rate)
            c = taylor(p, mpf(1), self.t, x, v, term_count(PANEL * step / longest))
            gap = [g, rate] + [side * value for value in c[2:]]
            slack = [
                contact.k * gap[n] + contact.c * (n + 1) * gap[n + 1] for n in range(len(gap) - 1)
            ]
            slack[:order] = [mpf(0)] * order
            opens = first_root([-value for value in gap], step, absolute=True)
            caught = first_root(
                slack[order:], step if opens is None else opens, absolute=order == 0
            )
            tau = opens if caught is None else caught
            step = step if tau is None else tau
            x, v = horner(c, step)
            g, rate = horner(gap, step)
            self.t = self.until if step == self.until - self.t else self.t + step
            order = 0
            if caught is not None:
                return False, FlightState(x, v, side, g, rate)
            if opens is not None:
                return True, FlightState(x, v, side, mpf(0), rate)
        return None, FlightState(x, v, side, g, rate)


def _contact(p: PreciseParameters, given: parameters.Parameters) -> PreciseContact:
    k = mpf(given.contact_stiffness_ratio)
    tension = bool(given.contact_tension)
    z = damping_of(given.restitution, tension)
    beta = p.mu / (1 + p.mu)
    frequency = mp.sqrt(k / beta)
    rate = frequency * (1 + 2 * z) + 2 * p.zeta + p.omega + 1
    lasting = min(2 * mp.pi / frequency, mpf(HORIZON))
    return PreciseContact(
        1 / (1 + p.mu), beta, 1 / beta, k, 2 * z * mp.sqrt(k * beta), tension, rate, lasting
    )


def _series(
    p: PreciseParameters, contact: PreciseContact, t: mpf, side: int, z: tuple, count: int
) -> tuple[list[mpf], list[mpf]]:
    """Taylor coefficients of the centre of mass and of the gap in contact."""
    angle = p.omega * t + p.phase
    sine, cosine = side * mp.sin(angle), side * mp.cos(angle)
    cycle = (sine, cosine, -sine, -cosine)
    centre, gap = [z[0], z[1]], [z[2], z[3]]
    spring, damper = contact.gamma * contact.k, contact.gamma * contact.c
    scale = mpf(1)  # omega**n / n!
    for n in range(count - 2):
        load = scale * cycle[n % 4] - (centre[n] + contact.beta * gap[n])
        load -= 2 * p.zeta * (n + 1) * (centre[n + 1] + contact.beta * gap[n + 1])
        wall = spring * gap[n] + damper * (n + 1) * gap[n + 1]
        both = (n + 1) * (n + 2)
        centre.append(contact.share * load / both)
        gap.append((load - wall) / both)
        scale *= p.omega / (n + 1)
    return centre, gap


def _modes(p: PreciseParameters, contact: PreciseContact) -> Modes | None:
    """Modes of the contact, or None where they are not distinct enough to be of use.

    With f = 2 zeta s + 1 for exp(s t), the equations are (s^2 + share f) U + share beta f g = 0 and
    f U + (s^2 + beta f + gamma (c s + k)) g = 0.
    """
    share, beta, drag = contact.share, contact.beta, 2 * p.zeta
    first = (1, share * drag, share)
    second = (1, beta * drag + contact.gamma * contact.c, beta + contact.gamma * contact.k)
    quartic = [mpf(0)] * 5
    for i, a in enumerate(first):
        for j, b in enumerate(second):
            quartic[i + j] += a * b
    for i, a in enumerate((drag**2, 2 * drag, mpf(1))):
        quartic[i + 2] -= share * beta * a
    # In U, U', g, g' it is a matrix; Newton's rule on the quartic gives small rates their digits.
    matrix = mp.matrix(
        [
            [0, 1, 0, 0],
            [-share, -share * drag, -share * beta, -share * drag * beta],
            [0, 0, 0, 1],
            [-1, -drag, -second[2], -second[1]],
        ]
    )
    rates = [_polished(quartic, s) for s in mp.eig(matrix, left=False, right=False)]
    rates.sort(key=abs)
    nearest = min(abs(a - b) for i, a in enumerate(rates) for b in rates[:i])
    slowest = max(abs(rates[1]), p.omega)
    if nearest < _DISTINCT * slowest or abs(rates[2]) < 2 * slowest:
        return None
    vectors = mp.matrix(4, 4)
    for m, s in enumerate(rates):
        f = drag * s + 1
        shape = (-share * beta * f, s**2 + share * f)
        for i, value in enumerate((shape[0], s * shape[0], shape[1], s * shape[1])):
            vectors[i, m] = value
    s = 1j * p.omega
    f = drag * s + 1
    matrix = mp.matrix(
        [
            [s**2 + share * f, share * beta * f],
            [f, s**2 + beta * f + contact.gamma * (contact.c * s + contact.k)],
        ]
    )
    u, g = mp.lu_solve(matrix, mp.matrix([share, 1]))
    return Modes(rates, vectors, vectors**-1, mp.matrix([u, s * u, g, s * g]), slowest)


def _polished(polynomial: Sequence[mpf], root: mpf) -> mpf:
    """Root of a polynomial, highest power first, by three steps from very near."""
    for _ in range(3):
        value = slope = mpf(0)
        for coefficient in polynomial:
            slope = slope * root + value
            value = value * root + coefficient
        if slope == 0:
            break
        root -= value / slope
    return root
