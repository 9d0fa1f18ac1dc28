"""The motion of free masses on a structure in many digits.

It shares no formula with the engine. Structure and free masses are one set of coordinates Q with
one mass matrix. Each wall is a unilateral constraint with its own multiplier: the force of a mass
that sticks, or the impulse of an impact. A mass that friction holds is a constraint, too. No
inertia of joined masses and no mode is formed. On short panels Q is a Taylor series, of which the
equations of motion give one coefficient after the other. Events are found on closely spaced samples
of each gap and its slope, and by bisection. A chatter sequence is followed impact by impact down to
a speed of `RESTS`. The reference tries every choice of masses that walls and friction hold.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import Any, NamedTuple

import numpy as np
from mpmath import mp, mpf

from damper.parameters import forcing as given
from damper.parameters.structural import StructureMass, StructureParameters
from damper.verification.reference import (
    GUARD_DIGITS,
    Event,
    between_rows,
    force_in_digits,
    horner,
    term_count,
)

#: Length of a panel times the fastest rate, and samples of each gap in it.
PANEL, SAMPLES = 2, 24
#: Speed, in units of clearance over the fastest rate's time, below which a rebound is none.
RESTS = mpf(10) ** -22
#: Most events of a run.
MOST_EVENTS = 20_000

FLIGHT, STICKING, RESTING = "flight", "sticking", "resting"
Vector = list[mpf]


class RunInDigits(NamedTuple):
    """Events in order of time, and the state at the end."""

    events: list[Event]
    x: Vector
    v: Vector
    y: Vector
    u: Vector


class Terms(NamedTuple):
    """What gives an acceleration, or a multiplier: matrices of Q and Q', factors of the force."""

    place: list[Vector]
    rate: list[Vector]
    force: Vector
    constant: Vector


@dataclass
class Wall:
    """The wall of a free mass that it touched last, and how the mass moves there."""

    mass: StructureMass
    number: int
    side: int
    mode: str = FLIGHT
    zeros: int = 0
    """Derivatives of the gap, the gap among them, that the last event has made zero."""
    way: int = 0
    """Sign of the mass's velocity less that of its box, where it slides."""
    still: int = 0
    """Derivatives of that velocity, itself among them, that the last event has made zero."""

    @property
    def most(self) -> mpf:
        """Largest force of friction."""
        return mpf(self.mass.mass) * mpf(self.mass.friction)


def exact_run(
    parameters: StructureParameters, state: Any = None, *, until: Any, digits: int = 50
) -> RunInDigits:
    """Return every event up to a time, and the state then.

    Parameters
    ----------
    parameters : StructureParameters
    state : damper.State, optional
        From rest when left out.
    until : float
        In s.
    digits : int, default 50
        Digits of the arithmetic.

    Raises
    ------
    ValueError
        For more than `MOST_EVENTS` events.
    """
    with mp.workdps(digits + GUARD_DIGITS):
        n, m = len(parameters.structure), len(parameters.each)
        t, x, v, y, u = mpf(0), [0.0] * n, [0.0] * n, [0.0] * m, [0.0] * m
        if state is not None:
            (x, v), (y, u) = state.of_coordinates(n), state.of_each(m)
            t = mpf(state.time)
        motion = _Motion(parameters, t, [*map(mpf, x), *map(mpf, y)], [*map(mpf, v), *map(mpf, u)])
        motion.turn()
        motion.decide()
        motion.run(mpf(until))
        q, r = motion.place, motion.rate
        return RunInDigits(motion.events, q[:n], r[:n], q[n:], r[n:])


class _Motion:
    """Where a run is, at the precision that is set."""

    def __init__(self, p: StructureParameters, t: mpf, place: Vector, rate: Vector) -> None:
        s, each = p.structure, p.each
        self.n, self.t, self.place, self.rate = len(s), t, place, rate
        size = self.n + len(each)
        mass, damping, stiffness = (mp.zeros(size) for _ in range(3))
        for i in range(self.n):
            for j in range(self.n):
                mass[i, j], damping[i, j] = mpf(s.mass[i, j]), mpf(s.damping[i, j])
                stiffness[i, j] = mpf(s.stiffness[i, j])
        self.boxes = [[mpf(b) for b in s.boxes[one.box].tolist()] for one in each]
        constant = [mpf(0)] * size
        for k, one in enumerate(each):
            mass[self.n + k, self.n + k] = mpf(one.mass)
            constant[self.n + k] = -mpf(one.mass) * mpf(one.gravity)
            stretch = self._row(k, -1)  # y - x
            for i in range(size):
                for j in range(size):
                    damping[i, j] += mpf(one.tie_damping) * stretch[i] * stretch[j]
                    stiffness[i, j] += mpf(one.tie_stiffness) * stretch[i] * stretch[j]
        self.forcing, inertial = self._force_of(p)
        load = [mpf(0)] * size
        if inertial:
            for i in range(self.n):
                load[i] = mp.fsum(mass[i, j] * mpf(s.base[j]) for j in range(self.n))
            for k, one in enumerate(each):
                load[self.n + k] = mpf(one.mass) * mpf(s.base_shares[one.box])
        elif s.force is not None:
            load[: self.n] = [mpf(b) for b in s.force.tolist()]
        self.inverse = mass**-1
        self.forces = Terms(
            [[-stiffness[i, j] for j in range(size)] for i in range(size)],
            [[-damping[i, j] for j in range(size)] for i in range(size)],
            load,
            constant,
        )
        self.fastest = max(self._fastest(stiffness, damping), self.forcing.rate)
        self.walls = [
            Wall(one, k, 1 if place[self.n + k] >= self._at(k, place) else -1)
            for k, one in enumerate(each)
        ]
        self.events: list[Event] = []
        self._known: dict[tuple[Any, ...], tuple[Terms, Terms]] = {}

    def _force_of(self, p: StructureParameters) -> tuple[Any, bool]:
        spec = p.forcing if p.force_amplitude else given.NoForce()
        amplitude, rate, phase = map(mpf, (p.force_amplitude, p.forcing_frequency, p.phase))
        return force_in_digits(spec, amplitude, rate, phase)

    def _fastest(self, stiffness: Any, damping: Any) -> mpf:
        """A bound on the rates: by the norms of the matrices, in coordinates of unit mass."""
        root = mp.cholesky(self.inverse)
        k = mp.mnorm(root.T * stiffness * root, 1)
        return mp.sqrt(k) + mp.mnorm(root.T * damping * root, 1)

    def _row(self, k: int, side: int) -> Vector:
        """Gradient of the gap of mass `k` to a wall."""
        own = [mpf(0)] * len(self.boxes)
        own[k] = -mpf(side)
        return [*(side * b for b in self.boxes[k]), *own]

    def _at(self, k: int, place: Sequence[mpf]) -> mpf:
        """Displacement, or velocity, of the box of mass `k`."""
        return mp.fdot(self.boxes[k], place[: self.n])

    def gap(self, wall: Wall) -> tuple[mpf, mpf]:
        """Gap of a mass to its wall, and its rate; zero where an event has made them zero."""
        apart = self.place[self.n + wall.number] - self._at(wall.number, self.place)
        gap = mpf(wall.mass.clearance) - wall.side * apart
        rate = self.rate[self.n + wall.number] - self._at(wall.number, self.rate)
        stuck, rests = wall.mode == STICKING, wall.mode == RESTING or wall.still > 0
        return (
            mpf(0) if stuck or wall.zeros > 0 else gap,
            mpf(0) if stuck or rests or wall.zeros > 1 else -wall.side * rate,
        )

    # --- motion between events

    def _terms(self) -> tuple[Terms, Terms]:
        """Accelerations of all coordinates, and forces on the masses that are held."""
        held = [wall for wall in self.walls if wall.mode != FLIGHT]
        slides = [wall for wall in self.walls if wall.mode == FLIGHT and wall.way]
        key = tuple((w.number, w.side, w.way) for w in (*held, *slides)), len(held)
        if key not in self._known:
            constant = list(self.forces.constant)
            for wall in slides:
                rubs = [wall.way * wall.most * part for part in self._row(wall.number, 1)]
                constant = [a + b for a, b in zip(constant, rubs, strict=True)]
            rows = [self._row(w.number, w.side) for w in held]
            self._known[key] = self._constrained(rows, constant)
        return self._known[key]

    def _constrained(self, rows: list[Vector], constant: Vector) -> tuple[Terms, Terms]:
        """Accelerations that keep gaps of these gradients, and the multipliers of these."""
        size = len(self.place)

        def solved(force: Sequence[mpf]) -> tuple[Vector, Vector]:
            free = list(self.inverse * mp.matrix(list(force)))
            if not rows:
                return free, []
            lacks = mp.matrix([-dot(r, free) for r in rows])
            forces = list(mp.lu_solve(self._yields(rows), lacks))
            more = self._pushed(forces, rows)
            return [a + b for a, b in zip(free, more, strict=True)], forces

        columns = [
            [solved([row[j] for row in matrix]) for j in range(size)]
            for matrix in (self.forces.place, self.forces.rate)
        ]
        vectors = [solved(self.forces.force), solved(constant)]
        made = []
        for part in (0, 1):
            count = size if part == 0 else len(rows)
            place, rate = (
                [[column[part][i] for column in matrix] for i in range(count)] for matrix in columns
            )
            made.append(Terms(place, rate, *(vector[part] for vector in vectors)))
        return made[0], made[1]

    def _yields(self, rows: Sequence[Vector]) -> Any:
        """Change of each gap's rate by a unit impulse at each wall."""
        found = mp.zeros(len(rows))
        for i, one in enumerate(rows):
            for j, other in enumerate(rows):
                found[i, j] = dot(one, list(self.inverse * mp.matrix(other)))
        return found

    def _series(self, count: int) -> tuple[list[Vector], list[Vector]]:
        """Taylor coefficients of every coordinate, and of every force on a mass that is held."""
        accelerations, contacts = self._terms()
        load = self.forcing.coefficients(self.t, count)
        q, forces = [self.place, self.rate], []
        for n in range(count):
            at, slope = q[n], [(n + 1) * c for c in q[n + 1]]
            second = applied(accelerations, at, slope, load[n], n == 0)
            q.append([a / ((n + 1) * (n + 2)) for a in second])
            forces.append(applied(contacts, at, slope, load[n], n == 0))
        return [list(row) for row in zip(*q, strict=True)], [
            list(row) for row in zip(*forces, strict=True)
        ]

    def _gap_series(self, wall: Wall, q: Sequence[Sequence[mpf]]) -> Vector:
        row = self._row(wall.number, wall.side)
        found = [dot(row, column) for column in zip(*q, strict=True)]
        found[0] += mpf(wall.mass.clearance)
        found[: wall.zeros] = [mpf(0)] * wall.zeros
        return found

    def _speed_series(self, wall: Wall, q: Sequence[Sequence[mpf]]) -> Vector:
        """Of the velocity of a mass less that of its box."""
        row = self._row(wall.number, -1)
        found = [n * dot(row, c) for n, c in enumerate(zip(*q, strict=True)) if n]
        found[: wall.still] = [mpf(0)] * wall.still
        return found

    def run(self, until: mpf) -> None:
        """Go on to a time."""
        while self.t < until:
            if len(self.events) > MOST_EVENTS:
                raise ValueError(f"more than {MOST_EVENTS} events before {until}")
            end = min(until, self.forcing.end(self.t))
            step = min(mpf(PANEL) / self.fastest, end - self.t, self._bounce())
            q, forces = self._series(term_count(self.fastest * step, mpf(0)))
            found: list[tuple[mpf, str, Wall, int]] = []
            held = iter(forces)
            for wall in self.walls:
                if wall.mode != FLIGHT:
                    force = next(held)
                    away = [wall.most + force[0], *force[1:]]
                    watched: list[tuple[str, int, Vector]] = [("release", wall.side, away)]
                    if wall.mode == RESTING:
                        near = [wall.most - force[0], *(-c for c in force[1:])]
                        watched.append(("release", -wall.side, near))
                else:
                    gap = self._gap_series(wall, q)
                    far = [2 * mpf(wall.mass.clearance) - gap[0], *(-c for c in gap[1:])]
                    watched = [("impact", wall.side, gap), ("impact", -wall.side, far)]
                    if wall.way:
                        speed = [wall.way * c for c in self._speed_series(wall, q)]
                        watched.append(("stop", wall.side, speed))
                for kind, side, c in watched:
                    tau = first_zero(c, step)
                    if tau is not None:
                        found.append((tau, kind, wall, side))
            span = min((tau for tau, *_ in found), default=step)
            now = [one for one in found if one[0] <= span * (1 + mp.eps * 1000)]
            self.t = end if span == end - self.t else self.t + span
            moved = [horner(c, span) for c in q]
            self.place, self.rate = [a for a, _ in moved], [b for _, b in moved]
            for wall in self.walls:
                wall.zeros, wall.still = (0, 0) if span else (wall.zeros, wall.still)
            self._change([(kind, wall, side) for _, kind, wall, side in now])
            if not now and span == end - self.t:
                self.decide()

    def _bounce(self) -> mpf:
        """A few times the shortest bounce that has just begun."""
        begun = [w for w in self.walls if w.mode == FLIGHT and w.zeros == 1]
        found = mp.inf
        for gap in (self._gap_series(w, self._series(1)[0]) for w in begun):
            if gap[2] < 0:
                found = min(found, -3 * gap[1] / gap[2])
        return found

    # --- events

    def _change(self, events: Iterable[tuple[str, Wall, int]]) -> None:
        hits, stops = [], False
        for kind, wall, side in events:
            if kind == "release":
                kind = "release" if wall.mode == STICKING else "slip"
                wall.zeros, wall.still = (3 if wall.mode == STICKING else 0), 2
                wall.mode, wall.way = FLIGHT, -side if wall.most else 0
                self._list(kind, wall)
            elif kind == "stop":
                wall.still = 1
                stops = True
                own = self.n + wall.number
                self.rate[own] = self._at(wall.number, self.rate)
            else:
                wall.side = side
                hits.append(wall)
        if not hits:
            if stops:
                self.decide()
            return
        touching = [w for w in self.walls if w.mode == STICKING or w in hits]
        speeds = {w.number: -self._opening(w) if w in hits else mpf(0) for w in touching}
        self._push(touching, {n: (1 + self._restitution(n, w)) * w for n, w in speeds.items()})
        for wall in touching:
            if wall in hits:
                self._close(wall)
                wall.zeros, wall.way = 1, -wall.side if wall.most else 0
                self._list("impact", wall, speeds[wall.number])
            elif self._opening(wall) > self._slowest(wall) * mp.sqrt(mp.eps):
                wall.mode, wall.zeros, wall.way = FLIGHT, 1, -wall.side if wall.most else 0
                self._list("release", wall)
        self.turn()
        resting = [w for w in hits if abs(self._opening(w)) < self._slowest(w)]
        if resting:
            settled = [w for w in self.walls if w.mode == STICKING or w in resting]
            self._push(settled, {w.number: -self._opening(w) for w in settled})
            for wall in resting:
                wall.zeros, wall.still = 2, 1
            self.turn()
        self.decide()

    def turn(self) -> None:
        """Let masses off the walls slide as they move relative to their boxes."""
        for wall in self.walls:
            speed = -wall.side * self._opening(wall)
            slow = self._slowest(wall) * mp.sqrt(mp.eps)
            if wall.most and wall.mode != STICKING and not wall.still and abs(speed) > slow:
                way = int(mp.sign(speed))
                if wall.mode == RESTING:
                    wall.mode = FLIGHT
                    self._list("slip", wall)
                elif wall.way == -way:
                    self._list("reversal", wall)
                wall.way = way
            elif wall.most and wall.mode == FLIGHT and abs(speed) <= slow:
                wall.still = max(wall.still, 1)

    def _restitution(self, number: int, speed: mpf) -> mpf:
        """Coefficient of restitution of the wall of a mass at an approach speed."""
        wall = self.walls[number]
        if wall.mass.tables:
            rows = wall.mass.tables[wall.side > 0]
            return between_rows([(mpf(v), mpf(r)) for v, r in rows], speed)
        one, yields = wall.mass.restitutions[wall.side > 0], mpf(wall.mass.yield_speed)
        falls = (yields / speed) ** mpf(wall.mass.yield_exponent) if speed > yields else 1
        return mpf(one) * falls

    def _slowest(self, wall: Wall) -> mpf:
        """Speed below which a rebound is none."""
        return RESTS * self.fastest * mpf(wall.mass.clearance)

    def _opening(self, wall: Wall) -> mpf:
        """Rate of a gap as the velocities have it."""
        return dot(self._row(wall.number, wall.side), self.rate)

    def _close(self, wall: Wall) -> None:
        """Put a mass on its wall, to the last digit."""
        wanted = wall.side * mpf(wall.mass.clearance)
        self.place[self.n + wall.number] = self._at(wall.number, self.place) + wanted

    def _push(self, touching: Sequence[Wall], asked: dict[int, mpf]) -> None:
        """Apply the impulses by which the rate of each gap changes by as much as is asked, or more.

        A wall with an impulse changes it by just so much.
        """
        rows = {w.number: self._row(w.number, w.side) for w in touching}
        rounding = mp.sqrt(mp.eps) * max(map(abs, asked.values()))
        for active in subsets(list(rows)):
            chosen = [rows[k] for k in active]
            wanted = mp.matrix([asked[k] for k in active])
            impulses = list(mp.lu_solve(self._yields(chosen), wanted)) if active else []
            change = self._pushed(impulses, chosen)
            opens = (dot(rows[k], change) >= asked[k] - rounding for k in rows if k not in active)
            if all(impulse >= -rounding for impulse in impulses) and all(opens):
                self.rate = [a + b for a, b in zip(self.rate, change, strict=True)]
                return
        raise AssertionError("the problem of impulses has a solution")

    def _pushed(self, forces: Sequence[mpf], rows: Sequence[Vector]) -> Vector:
        """Return what forces, or impulses, at walls do to each coordinate."""
        columns = zip(*rows, strict=True) if rows else [()] * len(self.rate)
        return list(self.inverse * mp.matrix([dot(forces, column) for column in columns]))

    def decide(self) -> None:
        """Let masses without relative velocity be held by walls and friction, or part."""
        asked = [w for w in self.walls if self._is_asked(w)]
        before = {w.number: (w.mode, w.way) for w in asked}
        # Ways in which each parts, after 0 for none: from a wall away alone.
        choices = [[(0, True), *((way, False) for way in self._ways(w))] for w in asked]
        for chosen in sorted(product(*choices), key=lambda of: -sum(held for _, held in of)):
            for wall, (way, held) in zip(asked, chosen, strict=True):
                on_wall = self.gap(wall)[0] <= 0
                if held:
                    wall.mode, wall.zeros = STICKING if on_wall else RESTING, 0
                else:
                    wall.mode, wall.zeros = FLIGHT, 2 if on_wall else 0
                wall.way, wall.still = way, 0 if held else 1
            q, forces = self._series(1)
            pushes = zip([w for w in self.walls if w.mode != FLIGHT], forces, strict=True)
            holds = (
                -w.most <= force[0] and (w.mode == STICKING or force[0] <= w.most)
                for w, force in pushes
            )
            parts = (
                (w.way or -w.side) * self._speed_series(w, q)[1] >= 0
                for w in asked
                if w.mode == FLIGHT
            )
            if all(holds) and all(parts):
                break
        names = {STICKING: "stick", RESTING: "rest"}
        for wall in asked:
            mode, way = before[wall.number]
            if wall.mode == STICKING:
                self._close(wall)
            if wall.mode != mode:
                left = "release" if mode == STICKING else "slip"
                self._list(left if wall.mode == FLIGHT else names[wall.mode], wall)
            elif mode == FLIGHT and way and wall.way == -way and wall.zeros == 0:
                self._list("reversal", wall)

    def _is_asked(self, wall: Wall) -> bool:
        gap, rate = self.gap(wall)
        return rate == 0 and (gap <= 0 or wall.most > 0)

    def _ways(self, wall: Wall) -> list[int]:
        """Directions in which a mass may part."""
        if not wall.most:
            return [0]
        return [-wall.side] if self.gap(wall)[0] <= 0 else [-1, 1]

    def _list(self, kind: str, wall: Wall, speed: Any = 0) -> None:
        k, side = wall.number, 0 if kind in ("rest", "slip", "reversal") else wall.side
        x, v = self._at(k, self.place), self._at(k, self.rate)
        self.events.append(Event(self.t, kind, side, mpf(speed), x, v, *self.gap(wall), k))


def subsets(of: Sequence[Any]) -> list[tuple[Any, ...]]:
    """Return all choices of some, the largest first."""
    return [one for size in range(len(of), -1, -1) for one in combinations(of, size)]


def dot(a: Sequence[mpf], b: Sequence[mpf]) -> mpf:
    """Return the product of two vectors."""
    return mp.fdot(zip(a, b, strict=True))


def applied(
    terms: Terms, place: Sequence[mpf], rate: Sequence[mpf], load: mpf, first: bool
) -> Vector:
    """Return what terms come to for a place, a rate and a load; constants in the `first` order."""
    found = []
    for k, row in enumerate(terms.place):
        value = dot(row, place) + dot(terms.rate[k], rate) + terms.force[k] * load
        found.append(value + terms.constant[k] if first else value)
    return found


def first_zero(c: Sequence[mpf], end: mpf) -> mpf | None:
    """Return where a polynomial first ceases to be positive in (0, end], or None.

    It is divided by the powers of its variable that it begins with. Between two samples at most one
    turning point is looked for: samples are a small part of the fastest period apart.
    """
    order = next((n for n, value in enumerate(c) if value != 0), None)
    if order is None:
        return None
    q = list(c[order:])
    if q[0] < 0:
        return mpf(0)
    scaled = np.array([float(value * end**n) for n, value in enumerate(q)])
    values = np.polynomial.polynomial.polyval(np.linspace(0.0, 1.0, 8 * SAMPLES), scaled)
    if (values > 1e-3 * abs(scaled).max()).all():
        return None  # far from zero
    at, slope = mpf(0), q[1] if len(q) > 1 else mpf(0)
    for k in range(1, SAMPLES + 1):
        there = end * k / SAMPLES
        value, slope_there = horner(q, there)
        if value > 0 and slope < 0 < slope_there:
            lowest = zero_between([-n * a for n, a in enumerate(q)][1:], at, there)
            if horner(q, lowest)[0] <= 0:
                return zero_between(q, at, lowest)
        elif value <= 0:
            return zero_between(q, at, there)
        at, slope = there, slope_there
    return None


def zero_between(q: Sequence[mpf], low: mpf, high: mpf) -> mpf:
    """Return where a polynomial, positive at the first time and not at the second, is zero.

    By Newton's steps, and by bisection where they leave the bracket.
    """
    at = (low + high) / 2
    while True:
        value, slope = horner(q, at)
        low, high = (at, high) if value > 0 else (low, at)
        there = at - value / slope if slope else low
        if not low < there < high:
            there = (low + high) / 2
        if abs(there - at) <= 4 * mp.eps * high or high - low <= 4 * mp.eps * high:
            return there
        at = there
