"""The motion of a damper in many digits: oscillators, walls and a force.

It shares no formula with the engine. On short panels the displacement of the primary and each gap
are Taylor series, of which the equations of motion give one coefficient after the other. Every
damping and every model runs the same code. Events are roots of these polynomials, found by steps
that provably pass none. The gap to the wall that was touched last is a quantity of its own, so a
bounce of height 1e-50 loses no digits. The end of a complete chatter sequence is extrapolated from
its impacts: time, place and common velocity differ from their limits by a power series in the
rebound speed, of which Neville's scheme removes one term after the other. Panels end at the samples
of a record, where its force is not smooth. With dry friction a free mass slides one way until its
relative velocity vanishes.

All contacts of several free masses at an instant are solved at once, by trying every set of pushing
masses. An extrapolated end holds if no other mass has an event before it. If several masses
chatter on one wall, the impacts of a mass kick another mass off the wall, and the speeds have no
power series. A mass then rests once the rest of its sequence is below the wanted digits.
"""

import math
from bisect import bisect_right
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations, pairwise, product, zip_longest
from typing import Any, NamedTuple

from mpmath import mp, mpf

from damper.parameters import forcing as given

GUARD_DIGITS = 15
#: Length of a panel times the fastest rate, and the least distance of a pole in units of it.
PANEL, POLE = 3, 8
#: Impacts that are not slower are all listed. A bounce of speed w rises w^2 / (2 a) above its wall,
#: which is lost in the roundoff of doubles of size 1 at w of some 1e-8. Nothing that works with
#: absolute positions can distinguish slower ones from contact; this leaves them a decade.
RESOLVED = 1e-9
#: A chatter sequence is not closed before the time to its accumulation, times the fastest rate, is
#: below `REACH`, nor before it has converged to `TAIL_DIGITS` digits more than are asked for, in
#: `ORDERS` orders at most.
REACH, TAIL_DIGITS, ORDERS = 1e-6, 5, 12
#: Steps of a search for a root after which it need not be a simple one.
QUICK = 60

FLIGHT, CONTACT, STICKING, RESTING = "flight", "contact", "sticking", "resting"


class Event(NamedTuple):
    """An event, and the state just after it.

    ``kind`` is ``"impact"``, ``"stick"`` or ``"release"``. A compliant contact begins with an
    ``"impact"`` and ends with a ``"separation"``; where its force is positive again before the gap
    has reopened, that is a ``"contact"``. With dry friction there are also, with side 0, a
    ``"rest"`` off the walls, the ``"slip"`` that ends it, and a ``"reversal"``.
    """

    time: mpf
    kind: str
    side: int
    """+1 right wall, -1 left wall."""
    approach_speed: mpf
    """0 unless it is an impact."""
    x: mpf
    v: mpf
    gap: mpf
    """To this wall: y = x + side (clearance - gap)."""
    rate: mpf
    body: int = 0
    """Number of the free mass."""


class ExactRun(NamedTuple):
    """Events in order of time, and ``(x, v, y, u)`` at the end, with y and u of each free mass."""

    events: list[Event]
    final: tuple[mpf, ...]


class Sine(NamedTuple):
    """amplitude sin(rate t + phase)."""

    rate: mpf
    phase: mpf
    amplitude: mpf = mpf(1)

    def coefficients(self, t: mpf, count: int) -> list[mpf]:
        """Taylor coefficients about a time."""
        cos, sin = mp.cos_sin(self.rate * t + self.phase)
        cycle, scale, found = (sin, cos, -sin, -cos), self.amplitude, []
        for n in range(count):
            found.append(scale * cycle[n % 4])
            scale *= self.rate / (n + 1)
        return found


class Sines(NamedTuple):
    """A sum of sines. Another force needs the same: a rate, coefficients, how long it is smooth."""

    parts: tuple[Sine, ...]

    @property
    def rate(self) -> mpf:
        """The fastest one."""
        return max((part.rate for part in self.parts), default=mpf(0))

    def coefficients(self, t: mpf, count: int) -> list[mpf]:
        """Taylor coefficients about a time."""
        columns = zip(*(part.coefficients(t, count) for part in self.parts), strict=True)
        return [mp.fsum(column) for column in columns] or [mpf(0)] * count

    def end(self, t: mpf) -> mpf:
        """Until when it is smooth, from a time on."""
        return mp.inf


class Pieces(NamedTuple):
    """Lines from one sample to the next; zero before the first, a constant after the last."""

    times: tuple[mpf, ...]
    values: tuple[mpf, ...]
    after: mpf
    rate: mpf = mpf(0)

    def coefficients(self, t: mpf, count: int) -> list[mpf]:
        """Taylor coefficients just after a time."""
        n = bisect_right(self.times, t)
        value, slope = self.after if n else mpf(0), mpf(0)
        if 0 < n < len(self.times):
            (start, end), (a, b) = self.times[n - 1 : n + 1], self.values[n - 1 : n + 1]
            slope = (b - a) / (end - start)
            value = a + slope * (t - start)
        return [value, slope, *[mpf(0)] * count][:count]

    def end(self, t: mpf) -> mpf:
        """Until when it is smooth, from a time on."""
        n = bisect_right(self.times, t)
        return self.times[n] if n < len(self.times) else mp.inf


class Body(NamedTuple):
    """A free mass ``mean (1 + depth wave)`` over that of the primary, its box and its support."""

    mean: mpf
    depth: mpf
    wave: Sine
    clearance: mpf
    restitution: Callable[[int, mpf], mpf]
    """Of the rigid wall of a side, at an approach speed; constant for small ones."""
    contact_stiffness: mpf
    """Of compliant walls, else infinite."""
    contact_damping: Mapping[int, mpf]
    """Of each side."""
    tension: bool
    """Whether a compliant wall may pull: then its force acts until the gap reopens."""
    stiffness: mpf
    damping: mpf
    friction: mpf
    """Acceleration by dry friction while it slides."""
    gravity: mpf
    """Acceleration to the left wall."""

    @property
    def rigid(self) -> bool:
        """Whether impacts take no time."""
        return self.contact_stiffness == math.inf

    def ratio(self, t: mpf, count: int = 1) -> list[mpf]:
        """Taylor coefficients of the mass ratio; the first alone where it is constant."""
        if self.depth == 0:
            return [self.mean]
        found = [self.mean * self.depth * c for c in self.wave.coefficients(t, count)]
        return [self.mean + found[0], *found[1:]]

    def push(self, side: int, gap: Sequence[mpf]) -> list[mpf]:
        """Taylor coefficients of a compliant wall's force."""
        k, c = self.contact_stiffness, self.contact_damping[side]
        return [-k * a - c * n * b for n, (a, b) in enumerate(pairwise(gap), 1)]

    def pull(self, side: int, x: Sequence[mpf], gap: Sequence[mpf], n: int) -> mpf:
        """Taylor coefficient `n` of the support's force; a `gap` of one coefficient is constant."""
        y, u = x[n], (n + 1) * x[n + 1]
        if n < len(gap):
            y -= side * gap[n]
        if n + 1 < len(gap):
            u -= side * (n + 1) * gap[n + 1]
        if n == 0:
            y += side * self.clearance
        return -2 * self.damping * u - self.stiffness * y


class System(NamedTuple):
    """A primary of mass and stiffness 1, what drives it, and its free masses."""

    damping: mpf
    force: Sines | Pieces
    inertial: bool
    """Whether that is the inertia in a frame that moves: it accelerates every mass alike."""
    masses: tuple[Body, ...]


class Place(NamedTuple):
    """How a free mass moves, and the gap to the wall that it touched last."""

    mode: str
    side: int
    gap: mpf
    rate: mpf
    zeros: int = 0
    """Derivatives of the gap that are zero by the event that began this: its rate, the second one;
    the gap itself among them where it is zero."""
    way: int = 0
    """With dry friction, sign of the free mass's velocity less the primary's."""

    @property
    def joined(self) -> bool:
        """Whether both masses move as one."""
        return self.mode in (STICKING, RESTING)


def system_of(
    mass_ratio: Any,
    damping_ratio: Any,
    frequency_ratio: Any,
    clearance: Any,
    restitution: Any = math.inf,
    phase: Any = 0,
    *,
    restitution_left: Any = math.inf,
    yield_speed: Any = math.inf,
    yield_exponent: Any = 0.25,
    restitution_table: Any = None,
    restitution_table_left: Any = None,
    support_stiffness_ratio: Any = 0,
    support_damping_ratio: Any = 0,
    contact_stiffness_ratio: Any = math.inf,
    contact_tension: Any = 0,
    modulation_depth: Any = 0,
    modulation_order: Any = 1,
    modulation_phase: Any = 0,
    gravity: Any = 0,
    friction: Any = 0,
    force_amplitude: Any = 1,
    forcing: given.Forcing = given.HARMONIC,
    masses: Sequence[Mapping[str, Any]] = (),
) -> System:
    """Return the system that `damper.Parameters` of these values mean, exact as they are."""
    if masses:
        values = {k: v for k, v in locals().items() if k != "masses"}
        each = []
        for own in masses:
            # A mass's own restitution is in place of a table of all.
            table = {"restitution_table": None} if "restitution" in own else {}
            each.append(system_of(**(values | table | dict(own))))
        return each[0]._replace(masses=tuple(one.masses[0] for one in each))
    mu, zeta, omega, r = map(mpf, (mass_ratio, damping_ratio, frequency_ratio, restitution))
    k, yields, tension = mpf(contact_stiffness_ratio), mpf(yield_speed), bool(contact_tension)
    exponent = mpf(yield_exponent)
    walls = {1: r, -1: r if restitution_left == math.inf else mpf(restitution_left)}
    c: dict[int, mpf] = {}
    if k < math.inf:
        for side, r in walls.items():
            c[side] = 2 * contact_damping(r, tension) * mp.sqrt(k * mu / (1 + mu))
    tables = {1: restitution_table, -1: restitution_table_left}
    if restitution_left == math.inf and not restitution_table_left:
        tables[-1] = restitution_table

    def coefficient(side: int, w: mpf) -> mpf:
        if tables[side]:
            return between_rows([(mpf(v), mpf(r)) for v, r in tables[side]], w)
        return walls[side] * ((yields / w) ** exponent if w > yields else 1)

    mass = Body(
        mu,
        mpf(modulation_depth),
        Sine(omega / mpf(modulation_order), mpf(modulation_phase) + mp.pi / 2),
        mpf(clearance),
        coefficient,
        *(k, c, tension),
        mpf(support_stiffness_ratio),
        mpf(support_damping_ratio),
        mpf(friction),
        mpf(gravity),
    )
    force, inertial = force_in_digits(forcing, mpf(force_amplitude), omega, mpf(phase), zeta)
    return System(zeta, force, inertial, (mass,))


def between_rows(rows: Sequence[tuple[mpf, mpf]], w: mpf) -> mpf:
    """Coefficient of a table: a mean of its neighbours by the distances of the logarithms."""
    after = sum(v < w for v, _ in rows)
    if after in (0, len(rows)):
        return rows[min(after, len(rows) - 1)][1]
    (low, before), (high, behind) = rows[after - 1 : after + 1]
    whole = mp.log(high) - mp.log(low)
    return (before * (mp.log(high) - mp.log(w)) + behind * (mp.log(w) - mp.log(low))) / whole


def force_in_digits(
    spec: given.Forcing, amplitude: mpf, omega: mpf, phase: mpf, zeta: Any = 0
) -> tuple[Sines | Pieces, bool]:
    """The force on a mass of 1, and whether it is an inertia."""
    unit = Sine(omega, phase, amplitude)
    match spec:
        case given.NoForce():
            return Sines(()), False
        case given.Harmonic():
            return Sines((unit,)), False
        case given.Harmonics():
            angles = spec.phases or [0] * len(spec.orders)
            parts = zip(spec.orders, spec.amplitudes, angles, strict=True)
            sines = (Sine(k * omega, k * phase + mpf(b), amplitude * mpf(a)) for k, a, b in parts)
            return Sines(tuple(sines)), False
        case given.Unbalance():
            return Sines((unit._replace(amplitude=amplitude * omega**2),)), False
        case given.Base(frame="ground"):  # z + 2 zeta z'
            rate = Sine(omega, phase + mp.pi / 2, 2 * zeta * omega * amplitude)
            return Sines((unit, rate)), False
        case given.Base(frame="base"):  # -z''
            return Sines((unit._replace(amplitude=amplitude * omega**2),)), True
        case given.Record():
            inertial = spec.of == "base_acceleration"
            scale = -amplitude if inertial else amplitude
            values = tuple(scale * mpf(value) for value in spec.value)
            after = values[-1] if spec.after == "hold" else mpf(0)
            return Pieces(tuple(map(mpf, spec.time)), values, after), inertial
        case given.Noise():
            return force_in_digits(spec.record, amplitude, omega, phase, zeta)
    raise TypeError(f"forcing = {spec!r}: the reference does not know it")


def contact_damping(restitution: mpf, tension: bool) -> mpf:
    """Damping ratio of a compliant contact that gives free bodies this restitution."""
    loss = -mp.log(restitution)
    if tension:  # half a period, until the gap reopens
        return mp.cos(mp.atan2(mp.pi, loss))

    def excess(z: mpf) -> mpf:  # until the force vanishes
        return mp.re(2 * z * mp.acos(z) / mp.sqrt(mp.mpc(1 - z * z))) - loss

    return mp.findroot(excess, (loss / 4, 1 / restitution), solver="anderson", verify=False)


def exact_run(
    values: Mapping[str, Any],
    state: Sequence[Any] = (0, 0, 0, 0),
    *,
    until: Any,
    digits: int = 50,
    start_time: Any = 0,
) -> ExactRun:
    """Return every event up to a time, and the state then; ValueError beyond a rigid wall.

    `values` are parameters as `system_of` takes them, the state is ``(x, v, y, u)``, with sequences
    y and u where there are several free masses. The last
    impacts of a complete chatter sequence are left out. A start at rest on a wall that presses
    gives a ``"stick"`` at once, but no impact; with no clearance between rigid walls there are no
    events.
    """
    with mp.workdps(digits + GUARD_DIGITS):
        system = system_of(**values)
        x, v = mpf(state[0]), mpf(state[1])
        several = isinstance(state[2], Sequence)
        places = []
        starts = zip(*(s if several else [s] for s in state[2:]), strict=True)
        for mass, (y, u) in zip(system.masses, starts, strict=True):
            side = 1 if y >= x else -1
            gap, rate = mass.clearance - side * (mpf(y) - x), side * (v - mpf(u))
            way = -side * int(mp.sign(rate)) if mass.friction else 0
            if gap < 0 and mass.rigid:
                raise ValueError("the free mass starts outside its box")
            pressed = gap < 0 and (mass.tension or mass.push(side, [gap, rate])[0] >= 0)
            places.append(Place(CONTACT if pressed else FLIGHT, side, gap, rate, way=way))
        motion = _Motion(system, mpf(start_time), x, v, places, mpf(until), digits)
        if system.masses[0].clearance == 0 and system.masses[0].rigid:
            motion.join(0)
        else:
            motion.rest_or_slide()
        while happened := motion.advance():
            motion.change(happened)
        final = [motion.x, motion.v]
        for mass, place in zip(system.masses, motion.places, strict=True):
            final.append(motion.x + place.side * (mass.clearance - place.gap))
            final.append(motion.v - place.side * place.rate)
        return ExactRun(motion.events, tuple(final))


@dataclass
class _Motion:
    """Where a run is, at the precision that is set."""

    system: System
    t: mpf
    x: mpf
    v: mpf
    places: list[Place]
    until: mpf
    digits: int
    events: list[Event] = field(default_factory=list)
    rows: dict[int, tuple[int, list[mpf], list[tuple[mpf, ...]]]] = field(default_factory=dict)
    """Of a mass the wall of its last impacts, their rebounds, and extrapolations by order."""

    def advance(self) -> list[tuple[int, str, int]]:
        """Go to the next instant at which something happens: to which mass, what, at which wall."""
        fastest, pole = self._rates()
        while self.t < self.until:
            step = min(PANEL / fastest, pole / POLE, self._end() - self.t)
            if any(place.gap == 0 < place.rate for place in self.places):
                for number, gap in enumerate(self._series(4)[1]):
                    place = self.places[number]
                    if place.gap == 0 < place.rate and gap[2] < 0:
                        if self._completes(number, gap, fastest):
                            return [(number, "stick", place.side)]
                        # About twice the time of the bounce.
                        step = min(step, -2 * place.rate / gap[2])
            x, gaps = self._series(term_count(fastest * step, step / pole))
            span = step
            roots: list[tuple[mpf, tuple[int, str, int]]] = []
            for number, gap in enumerate(gaps):
                for kind, side, q in self._watched(number, gap):
                    tau = first_root(q, min(step, span + self._instant))
                    if tau is not None:
                        if len(self.places) == 1:
                            roots = []  # the later one of a mass decides nothing
                        span = min(span, tau)
                        roots.append((tau, (number, kind, side)))
            self._move(x, gaps, span)
            if happened := [what for tau, what in roots if tau <= span + self._instant]:
                return happened
        return []

    @property
    def _instant(self) -> mpf:
        """Times that are no further apart are one: masses that were released together."""
        return mpf(10) ** -(self.digits + GUARD_DIGITS // 2) if len(self.places) > 1 else mpf(0)

    # --- events

    def change(self, happened: list[tuple[int, str, int]]) -> None:
        """Do what the events of an instant do, and list them."""
        hits, rubs = {}, any(mass.friction for mass in self.system.masses)
        for number, kind, side in happened:
            place, mass = self.places[number], self.system.masses[number]
            if kind == "impact" and mass.rigid:
                if place.gap or place.rate:
                    hits[number] = side
                    continue
                kind = "stick"  # at rest on a wall that presses
            if not (kind == "jump" and rubs):
                self._change_one(number, kind, side)
        if hits:
            self._hit(hits)
        if any(kind != "release" for _, kind, _ in happened):
            self.rest_or_slide()

    def _change_one(self, number: int, kind: str, side: int) -> None:
        mass, (_, own, gap, rate, *_) = self.system.masses[number], self.places[number]
        speed = mpf(0)
        if kind == "stop":
            self.places[number] = self.places[number]._replace(rate=mpf(0), zeros=0)
            return
        if kind == "stick":
            place = self.join(number)
        elif kind == "impact":
            speed = max(-rate if side == own else rate, mpf(0))
            place = Place(CONTACT, side, mpf(0), -speed)
        elif kind in ("release", "jump"):  # a release is where the gap's second derivative vanishes
            way = self._breaks(number)
            place = Place(FLIGHT, own, gap, mpf(0), zeros=3 * (kind == "release"), way=way)
            kind = "release" if gap == 0 else "slip"
        elif kind == "contact":
            place = Place(CONTACT, side, gap, rate)
        else:
            opens = kind == "opening" or mass.tension
            place = Place(FLIGHT, side, mpf(0) if opens else gap, rate)
        self.places[number] = place
        self._forget(number)
        if kind != "opening":
            self._list(number, kind, 0 if kind == "slip" else side, speed)

    def _hit(self, hits: dict[int, int]) -> None:
        """Let masses hit walls together; masses at rest on a wall take part, or are kicked off."""
        masses, contacts = self.system.masses, {}
        for number, (mode, side, gap, rate, *_) in enumerate(self.places):
            if number in hits:
                contacts[number] = hits[number], max(-rate * hits[number] * side, mpf(0))
            elif mode == STICKING or gap == rate == 0:
                contacts[number] = side, mpf(0)
        ratio = {n: masses[n].ratio(self.t)[0] for n in contacts}
        asks = {n: (1 + masses[n].restitution(s, w)) * w for n, (s, w) in contacts.items()}

        def change(pushing: Sequence[int]) -> mpf:
            """Momentum is kept, and each pushing mass leaves its wall by its restitution."""
            gained = sum(contacts[n][0] * ratio[n] * asks[n] for n in pushing)
            return gained / (1 + sum(ratio[n] for n in pushing))

        tried = (p for size in range(len(contacts), 0, -1) for p in combinations(contacts, size))
        pushing = next(
            p
            for p in tried
            if all(
                asks[n] >= contacts[n][0] * change(p)
                if n in p
                else asks[n] <= contacts[n][0] * change(p)
                for n in contacts
            )
        )
        gained = change(pushing)
        for number, place in enumerate(self.places):
            if gained and place.mode == RESTING:
                self.places[number] = place._replace(mode=FLIGHT)
        self._push(gained, among=contacts)
        for number, (side, speed) in contacts.items():
            leaves, stuck = side * gained - speed, self.places[number].mode == STICKING
            if number in pushing and number in hits:
                rate = asks[number] - speed
                way = -side if masses[number].friction else 0
                self.places[number] = Place(FLIGHT, side, mpf(0), rate, way=way)
            elif number not in pushing and leaves != 0:
                self.places[number] = Place(FLIGHT, side, mpf(0), leaves)
            elif not stuck:
                self.places[number] = self.places[number]._replace(zeros=0)
            if stuck and self.places[number].mode == FLIGHT:
                self._list(number, "release", side, mpf(0))
            elif number in pushing and number in hits:
                self._list(number, "impact", side, speed)
        for number, place in enumerate(self.places):
            way = -place.side * int(mp.sign(place.rate))
            if way and masses[number].friction and way != place.way:
                self.places[number] = place._replace(way=way)
                if number not in contacts:
                    self._list(number, "reversal" if place.way else "slip", 0, mpf(0))
        self._forget(*hits)

    def _push(self, gained: mpf, among: Collection[int]) -> None:
        """Change the primary's velocity, and with it the rates of all other masses in flight."""
        self.v += gained
        for number, place in enumerate(self.places):
            if number not in among and not place.joined:
                rate = place.rate + place.side * gained
                self.places[number] = place._replace(rate=rate, zeros=0)

    def rest_or_slide(self) -> None:
        """Let masses without a relative velocity rest, or slide, where any rubs on its box.

        All at once, by trying who does which: on a wall friction has to hold on one side only.
        """
        masses, before = self.system.masses, list(self.places)
        if not any(mass.friction for mass in masses):
            return
        asked = [
            n
            for n, (mass, place) in enumerate(zip(masses, before, strict=True))
            if place.joined or (place.rate == 0 and (mass.friction or place.gap == 0))
        ]
        options = [
            (0, -place.side) if place.gap == 0 else (0, 1, -1)
            for place in (before[n] for n in asked)
        ]
        force = self.system.force.coefficients(self.t, 1)[0]
        carried = force if self.system.inertial else mpf(0)
        for ways in product(*options):
            for n, way in zip(asked, ways, strict=True):
                place = before[n]._replace(rate=mpf(0), way=way if masses[n].friction else 0)
                mode = FLIGHT if way else STICKING if place.gap == 0 else RESTING
                self.places[n] = place._replace(mode=mode, zeros=0)
            x = self._series(3)[0]
            a = 2 * x[2] - carried
            if all(self._allows(n, way, a, x) for n, way in zip(asked, ways, strict=True)):
                break
        for n in asked:
            self._list_change(n, before[n])

    def _allows(self, number: int, way: int, a: mpf, x: Sequence[mpf]) -> bool:
        """Whether a mass rests, or slides a way, where the primary has this acceleration.

        It is that beyond what inertia gives all masses in the frame of a base.
        """
        place, mass = self.places[number], self.system.masses[number]
        pull = mass.pull(place.side, x, [place.gap], 0) / mass.mean
        asks, most = a + mass.gravity - pull, mass.friction
        if way:
            return -way * asks > most
        return (place.side * asks if place.gap == 0 else abs(asks)) <= most

    def _list_change(self, number: int, before: Place) -> None:
        """List that a mass rests which did not, or slides which did rest, or slid the other way."""
        now = self.places[number]
        on_wall = now.gap == 0
        kind, side = "", 0
        if now.joined and not before.joined:
            kind, side = ("stick", now.side) if on_wall else ("rest", 0)
            self.rows.pop(number, None)
        elif before.joined and not now.joined:
            kind, side = ("release", now.side) if on_wall else ("slip", 0)
        elif before.way == -now.way != 0:
            kind = "reversal"
        if kind:
            self._list(number, kind, side, mpf(0))

    def _held(self, number: int) -> mpf:
        """Contact force over the free mass that it takes to let it move with the primary."""
        place = self.places[number]
        self.places[number] = Place(RESTING, place.side, place.gap, mpf(0))
        [held] = self._series(3)[1][number]
        self.places[number] = place
        return held

    def _breaks(self, number: int) -> int:
        """Direction in which a mass begins to slide when friction no longer holds it."""
        if not self.system.masses[number].friction:
            return 0
        side, gap = self.places[number][1:3]
        return -side if gap == 0 else side * int(mp.sign(self._held(number)))

    def _list(self, number: int, kind: str, side: int, speed: mpf) -> None:
        place = self.places[number]
        at = self.t, kind, side, speed, self.x, self.v, place.gap, place.rate
        self.events.append(Event(*at, number))

    def _forget(self, *numbers: int) -> None:
        """Keep no extrapolations but that of the one mass that something has happened to."""
        self.rows = {n: row for n, row in self.rows.items() if (n,) == numbers}

    def _inertia(self) -> mpf:
        """Mass of the primary with all that sticks to it."""
        parts = zip(self.system.masses, self.places, strict=True)
        return 1 + sum(mass.ratio(self.t)[0] for mass, place in parts if place.joined)

    def join(self, number: int) -> Place:
        """Let a mass stick to its wall, with the common velocity."""
        side, mu = self.places[number].side, self.system.masses[number].ratio(self.t)[0]
        self._push(-mu / (self._inertia() + mu) * side * self.places[number].rate, [number])
        self.rows.pop(number, None)
        self.places[number] = Place(STICKING, side, mpf(0), mpf(0))
        return self.places[number]

    def _completes(self, number: int, gap: Sequence[mpf], fastest: mpf) -> bool:
        """Whether a chatter sequence is at its end; goes there if so. `gap` is that ahead.

        Right at `until` or a sample it is not, as long as there is anything left of it.
        """
        mass, (_, side, _, w, *_) = self.system.masses[number], self.places[number]
        r, mu = mass.restitution(side, mpf(0)), mass.ratio(self.t)[0]
        if not mass.rigid or r == 1 or mass.restitution(side, 2 * w) != r:
            return False
        # Towards the wall, on the way out and on the way back.
        out = -2 * gap[2]
        back = out - 2 * (1 + mu / self._inertia()) * mass.friction
        if back <= 0:
            return False
        q = r * mp.sqrt(back / out)
        left = w * (1 / out + 1 / mp.sqrt(out * back)) / (1 - q)
        others = [n for n, p in enumerate(self.places) if n != number and p.mode != STICKING]
        shift = -mu / (self._inertia() + mu) * side * w
        if len(self.places) > 1 and left < mpf(10) ** -(self.digits + 2):
            # Masses already at rest on a wall stay at rest.
            at_rest = [n for n, p in enumerate(self.places) if p.gap == p.rate == 0]
            self._push(shift, [number, *at_rest])
            self.places[number] = Place(FLIGHT, side, mpf(0), mpf(0))
            return True
        if any(p.mode == STICKING and p.side == side for p in self.places):
            return False
        if len(self.places) > 1 and any(one.friction for one in self.system.masses):
            return False  # each impact moves those that rest
        wall, speeds, before = self.rows.get(number, (0, [], []))
        kept = ORDERS * (wall == side)
        row: list[tuple[mpf, ...]] = [(self.t, self.x, self.v + shift)]
        for place in (self.places[n] for n in others):
            row[0] += (place.gap, place.rate + place.side * shift)
        speeds = speeds[:kept]
        for u, old in zip(speeds, before[:kept], strict=True):
            row.append(tuple((u * b - w * a) / (u - w) for a, b in zip(old, row[-1], strict=True)))
        self.rows[number] = side, [w, *speeds], row
        rate = max(fastest, abs(3 * gap[3] / gap[2]))
        if w > RESOLVED or left * rate > REACH:
            return False
        for rough, fine in pairwise(row):
            errors = [abs(a - b) / max(1, abs(a)) for a, b in zip(rough, fine, strict=True)]
            if max(errors) < mpf(10) ** -(self.digits + TAIL_DIGITS):
                break
        else:
            return False
        if fine[0] > self._end() and w > mpf(10) ** -self.digits:
            return False
        for n, at in zip(others, fine[3::2], strict=True):
            if not 0 < at < 2 * self.system.masses[n].clearance:
                return False  # it arrives before
        self.t, self.x, self.v = min(fine[0], self._end()), *fine[1:3]
        for n, one, rate in zip(others, fine[3::2], fine[4::2], strict=True):
            self.places[n] = Place(FLIGHT, self.places[n].side, one, rate)
        self.places[number] = Place(FLIGHT, side, mpf(0), mpf(0))
        return True

    # --- between events

    def _end(self) -> mpf:
        """Until when the force is smooth, no later than the end of the run."""
        return min(self.until, self.system.force.end(self.t))

    def _rates(self) -> tuple[mpf, mpf]:
        """Fastest rate of the motion, and a distance within which it has no pole."""
        inertia, damping, stiffness = mpf(1), self.system.damping, mpf(1)
        swing, turn, contacts, fastest = mpf(0), mpf(0), mpf(0), self.system.force.rate
        for mass, place in zip(self.system.masses, self.places, strict=True):
            if place.joined:
                inertia += mass.mean
                damping += mass.damping
                stiffness += mass.stiffness
                swing += mass.mean * mass.depth
                turn = max(turn, mass.wave.rate)
            else:
                fastest = max(fastest, largest_rate(mass.mean, mass.damping, mass.stiffness))
            if place.mode == CONTACT:
                both = 1 + 1 / mass.mean
                k, c = mass.contact_stiffness * both, mass.contact_damping[place.side] * both
                contacts += largest_rate(mpf(1), c / 2, k)
        fastest = contacts + max(fastest, largest_rate(inertia - swing, damping, stiffness))
        # Poles are where the inertia vanishes, off the real axis.
        return fastest, mp.acosh(inertia / swing) / turn if swing else mp.inf

    def _series(self, count: int) -> tuple[list[mpf], list[list[mpf]]]:
        """`count` Taylor coefficients of the primary's displacement, and those of each gap.

        Of a mass that sticks or rests those of the contact force, over the mass.
        """
        x, zeta, force = [self.x, self.v], self.system.damping, self.system.force
        gaps = [[] if p.joined else [p.gap, p.rate] for p in self.places]
        masses = list(zip(self.system.masses, self.places, gaps, strict=True))
        inertia = [mpf(1)]
        second: list[mpf] = []
        for mass, place, _ in masses:
            if place.joined:
                ratio = mass.ratio(self.t, count)
                inertia = [a + b for a, b in zip_longest(inertia, ratio, fillvalue=0)]
        forces = force.coefficients(self.t, count - 2)
        for n, one in enumerate(forces):
            push, carried = one, mpf(0)
            if self.system.inertial:
                push, carried = mp.fdot(inertia[: n + 1], forces[n::-1]), one
            for mass, place, _ in masses:
                ratio = mass.ratio(self.t, count) if mass.gravity else []
                if place.joined and n < len(ratio):
                    push -= mass.gravity * ratio[n]
            push -= 2 * zeta * (n + 1) * x[n + 1] + x[n]
            pulls = []
            for mass, place, gap in masses:
                beside = [place.gap] if place.joined else gap
                supported = mass.stiffness or mass.damping
                pulls.append(mass.pull(place.side, x, beside, n) if supported else 0)
                if place.joined:
                    push += pulls[-1]
                elif place.way and n == 0:
                    push += place.way * mass.mean * mass.friction
                elif place.mode == CONTACT:
                    [contact] = mass.push(place.side, [gap[n], (n + 1) * gap[n + 1]])
                    push += place.side * contact
                    pulls[-1] -= place.side * contact
            if len(inertia) > 1:
                push -= mp.fdot(inertia[1 : n + 1], second[::-1])
            second.append(push / inertia[0])
            x.append(second[n] / ((n + 1) * (n + 2)))
            for (mass, place, gap), pull in zip(masses, pulls, strict=True):
                own = carried + pull / mass.mean if pull else carried
                if n == 0:
                    own -= mass.gravity + place.way * mass.friction
                opens = place.side * (second[n] - own)
                gap.append(-opens if place.joined else opens / ((n + 1) * (n + 2)))
        for place, gap in zip(self.places, gaps, strict=True):
            gap[1 : place.zeros] = [mpf(0)] * max(place.zeros - 1, 0)
        return x, gaps

    def _watched(self, number: int, gap: list[mpf]) -> Iterator[tuple[str, int, Sequence[mpf]]]:
        """Yield a mass's possible events: kind, wall, and the polynomial whose root is the time."""
        mass, place = self.system.masses[number], self.places[number]
        side, minus = place.side, [-c for c in gap]
        if place.joined:
            ways = [gap] if place.mode == STICKING else [gap, minus]
            for holds in ways if mass.clearance else []:
                holds = [holds[0] + mass.friction, *holds[1:]]
                if holds[0] < -mp.sqrt(mp.eps):  # no roundoff: the force has jumped
                    yield "jump", side, [holds[0]]
                elif any(holds):
                    yield "release", side, holds
        elif place.mode == CONTACT:
            yield "separation", side, minus if mass.tension else mass.push(place.side, gap)
        elif place.gap < 0:
            yield "opening", side, minus
            yield "contact", side, [-c for c in mass.push(place.side, gap)]
        else:
            if place.way:
                sliding = [-place.way * side * n * c for n, c in enumerate(gap)][1:]
                yield "stop", side, sliding
            yield "impact", side, gap
            yield "impact", -side, [2 * mass.clearance - gap[0], *minus[1:]]

    def _move(self, x: list[mpf], gaps: list[list[mpf]], span: mpf) -> None:
        """Go on by a time, with the Taylor coefficients of a panel."""
        if span == 0:
            return
        end = self._end()
        if span == end - self.t:
            self.t = end
            self.rows.clear()  # a new power series begins here
        else:
            self.t += span
        self.x, self.v = horner(x, span)
        for number, place in enumerate(self.places):
            if not place.joined:
                moved = Place(place.mode, place.side, *horner(gaps[number], span), way=place.way)
                self.places[number] = moved


def largest_rate(inertia: mpf, damping: mpf, stiffness: mpf) -> mpf:
    """Largest modulus of a rate of inertia z'' + 2 damping z' + stiffness z = 0."""
    square = damping**2 - inertia * stiffness
    return (damping + mp.sqrt(square)) / inertia if square > 0 else mp.sqrt(stiffness / inertia)


# --- Taylor polynomials and their first roots


def term_count(rate_times_step: mpf, step_over_pole: mpf) -> int:
    """How many Taylor terms bring the remainder below the working precision."""
    fast, near, bits, n = float(rate_times_step), float(step_over_pole), float(mp.prec), 0
    while bits > 0:
        n += 1
        bits += math.log2(max(fast / n, near))
    return n + 6


def horner(c: Sequence[mpf], tau: mpf) -> tuple[mpf, mpf]:
    """Return value and first derivative of the polynomial with coefficients ``c``."""
    value, slope = mpf(0), mpf(0)
    for coefficient in reversed(c):
        slope = slope * tau + value
        value = value * tau + coefficient
    return value, slope


def first_root(c: Sequence[mpf], end: mpf) -> mpf | None:
    """Return where a polynomial first ceases to be positive in [0, end], or None.

    A polynomial that is zero at 0 starts with its first coefficient that is not zero. With ``|q''|
    <= B`` on the panel, ``q(tau + s) >= q + q' s - B s**2 / 2``; the step to the zero of that
    parabola cannot pass a root and converges quadratically to a simple one. Towards a multiple root
    it would take ever smaller parts of what is left; after `QUICK` steps B is that of the next
    stretch alone. The error may be small against ``end``, not only against the root, unless it is
    zero at 0. Where the polynomial touches zero but for the roundoff of its terms, that is a root:
    a step further, roundoff alone would decide whether it is passed.
    """
    order = next((n for n, value in enumerate(c) if value != 0), len(c))
    q = c[order:]
    if order and q and q[0] < 0:
        return mpf(0)
    everywhere = _bend(q, end)
    tolerance = 1000 * mp.eps
    sizes = [abs(value) for value in q]
    most = _roundoff(sizes, end)
    tau = mpf(0)
    reach = end
    quick = QUICK
    while True:
        quick -= 1
        if quick >= 0:
            value, slope = horner(q, tau)
            bound = everywhere
        else:
            local = expand(q, tau)
            value, slope = local[0], local[1]
            bound = _bend(local, reach)
        if value <= 0 and slope <= 0:
            return tau
        if value <= most:
            roundoff = _roundoff(sizes, tau)
            if value <= roundoff and slope**2 <= 2 * bound * roundoff:
                return tau
        value = max(value, mpf(0))
        root = mp.sqrt(slope**2 + 2 * bound * value)
        if slope > 0:
            if bound == 0:
                return None
            step = (root + slope) / bound
        elif root == slope:  # a positive constant
            return None
        else:
            step = 2 * value / (root - slope)
        if quick < 0:
            step = min(step, reach)
            reach = 2 * step
        if tau + step > end:
            return None
        tau += step
        if step <= tolerance * (tau if order else end):
            return tau


def expand(q: Sequence[mpf], tau: mpf) -> list[mpf]:
    """Return the coefficients of a polynomial about another point, by repeated division."""
    local = list(q)
    for lowest in range(len(local) - 1):
        for n in range(len(local) - 2, lowest - 1, -1):
            local[n] += tau * local[n + 1]
    return local


def _roundoff(sizes: Sequence[mpf], tau: mpf) -> mpf:
    """Return a bound on the roundoff of a polynomial, by the sizes of its coefficients."""
    return 2 * len(sizes) * mp.eps * horner(sizes, tau)[0] if sizes and tau else mpf(0)


def _bend(q: Sequence[mpf], end: mpf) -> mpf:
    """Return a bound on |q''| on [0, end]."""
    bound = mpf(0)
    for n in range(len(q) - 1, 1, -1):
        bound = bound * end + n * (n - 1) * abs(q[n])
    return bound
