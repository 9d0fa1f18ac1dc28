"""The studies that a damper is judged by: the same points for the search, the answer and a file.

The search runs the `cases` of a damper, which are those of any other: starts at rest, far out and
on the closed motion with two impacts, at each frequency and with all tolerances; motions followed
through the band both ways; random starts. More runs follow about the worst of them (`near`), and
fresh random ones of the best damper (`fresh`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product as combinations
from typing import Any, NamedTuple

import numpy as np

from damper.parameters import Parameters
from damper.parameters.masses import equal_masses
from damper.parameters.named import completed
from damper.sizing.machine import GRAVITY, Machine
from damper.sizing.words import text_of
from damper.sweep.grid import product
from damper.sweep.runs import run_points
from damper.theory import free_decay, two_impacts
from damper.theory.slow_manifold import fold

#: Frequencies in the band, at least and at most, and on each side of it.
_LEAST, _MOST, _BEYOND = 11, 51, 14
#: Beyond the band: parts of its lowest and of its highest frequency.
_RANGE = (0.5, 1.5)
#: What a transient falls to, as an exponent, and its bounds in cycles; and that without damper.
_DIES, _TRANSIENT, _DIES_ALONE = 30.0, (100, 2000), 7.0
#: Peaks of a free motion that are kept.
_PEAKS = 4000
#: Decays so many times as slow as the closed form's are not run to their end.
_SLOWER = 4.0
#: Part of the primary's speed with which the free mass begins: at exact rest it may stay there.
_STIRRED = 0.1
#: Most frequencies of a band whose order is from coarse to fine.
_COARSE = 64
#: Places of the free mass as a record begins, and sizes of the record off design.
PLACES, _SIZES = [-1.0, -0.5, 0.0, 0.5, 1.0], [0.5, 1.0, 2.0]
#: Cycles of the machine's own in which a peak after a record is looked for.
AFTER = 2.0
#: The first assumption of every card.
_ONE_MASS = "One rigid free mass without friction in a box along the motion, between equal walls."
#: Of several masses: how far the gaps differ either way, which is less than any workshop's, and
#: the distance in clearances between the places of one and the next where they begin apart.
SPREAD, APART = 1e-3, 0.73
#: Of several masses, each so many-th random start has them begin alike.
_ALIKE = 4
#: Samples of a time history in a cycle of the machine's own.
_SAMPLES = 40
#: Cycles of the worst case's time history, and samples of each.
SHOWN, FINE = 10, 100
#: A gap over the displacement that no free mass crosses.
_NO_WALLS = 1e9
#: How far the gap of a decay may be above the closed form's: numbers of four digits are rounded.
_DIGIT = 1e-3
#: Part of a quantity by which it is changed to see what that does.
PART = 0.01
#: Quantities of which a card says what a change does.
CHANGED = ("free_mass", "gap", "restitution", "damping")
#: Starts anywhere, at the frequency of the worst case.
STARTS = 60
#: Places of the free mass and gaps within the tolerance, where no frequency is to be chosen.
_FINE_PLACES, _FINE_GAPS = 41, 9
#: Random starts of any damper and near its worst case, and fresh ones that check the answer. With
#: fewer the best damper would be the one whose large motions were missed by chance.
_RANDOM, _NEARBY, _FRESH = 400, 100, 1000
#: Fresh starts of a round that the best damper has to pass: anywhere, and as many about its worst
#: case; and their first seed.
_MORE, _SEEDS = 500, 1000
#: Near: parts of the range of a place, and of a tolerance.
_NEAR_PLACE, _NEAR_OFF = 0.05, 0.125
#: The worst motion is followed to the next frequencies of the band: in so many steps.
_FINER = 8
#: Initial quantity that stirs the free mass, and that by which several masses begin apart.
_SPEED, _SPACING = "initial_relative_velocity", "initial_spacing"


#: Points, each of which starts from the end of the one before.
Chain = list[dict[str, float]]


class Sizes(NamedTuple):
    """A free mass in kg, its gap in m (the whole travel), and the restitution of its stops."""

    mass: float
    gap: float
    restitution: float


class Case(NamedTuple):
    """A start of any damper, or one that is followed through some frequencies."""

    off: tuple[float, ...]
    """How far its sizes are off, as parts of their tolerances."""
    start: Mapping[str, float]
    """Initial quantities, in SI units."""
    hertz: tuple[float, ...] = ()
    """The frequencies, one after another."""
    closed: bool = False
    """Whether it starts on the closed motion with two impacts per cycle, where there is one."""


class Judge:
    """How dampers are judged: how far they may be off, and frequencies beyond the band."""

    machine: Any
    band: Any
    """Frequencies in the band, in Hz."""

    @property
    def tolerances(self) -> Sizes:
        """How far a mass, a gap and a restitution may be off."""
        m = self.machine
        return Sizes(m.mass_tolerance, m.gap_tolerance, m.restitution_tolerance)

    def sizes(self, damper: Any, off: tuple[float, ...] = (0, 0, 0)) -> dict[str, float]:
        """Quantities of a damper that is off by parts of its tolerances."""
        found = (v + part * t for v, part, t in zip(damper[:3], off, self.tolerances, strict=True))
        mass, gap, restitution = found
        return {"free_mass": mass, "gap": max(gap, 0.0), "restitution": restitution}

    @property
    def corners(self) -> list[tuple[int, ...]]:
        """Parts of the tolerances: as built, then all at their ends, then what is between."""
        ends = combinations(*([-1, 0, 1] if t else [0] for t in self.tolerances))
        # As many of its three sizes are as built: 3, then 0, 1, 2.
        return sorted(ends, key=lambda off: (off.count(0) + 1) % 4)

    @property
    def fine(self) -> list[float]:
        """Frequencies at which the motion without a damper may be largest, in Hz."""
        return self.band

    @property
    def beyond(self) -> list[float]:
        """Frequencies outside of the band, in Hz."""
        low, high = self.machine.band or (1.0, 1.0)
        below = np.linspace(_RANGE[0] * low, low, _BEYOND, endpoint=False)
        above = np.linspace(_RANGE[1] * high, high, _BEYOND, endpoint=False)
        return _digits(np.concatenate([below, above[::-1]]))


@dataclass(frozen=True)
class WorstCase(Judge):
    """How dampers of a machine are judged: frequencies, starts, lengths of runs."""

    machine: Machine
    count: int = 1
    """Number of equal free masses side by side, which share the mass of a damper."""

    @property
    def least(self) -> float:
        """Least amplitude in m that the closed form at resonance allows, of the largest mass."""
        m = self.machine
        heaviest = Sizes(m.largest_mass, 0.0, min(m.restitutions))
        return m.static * free_decay.least_at_resonance(self._dimensionless(heaviest)).amplitude

    def closed_form_gap(self, mass: float, restitution: float) -> float:
        """The gap in m that the closed forms give a free mass, however large."""
        m = self.machine
        if m.is_free:  # the amplitude that is to be reached is where the motion ends
            return 2.0 * m.decay_to * m.initial_displacement / fold(restitution).xi
        if m.is_recorded:  # that of a resonance which moves the machine as far
            return math.pi * self.alone * (1 + restitution) / (1 - restitution)
        damper = Sizes(mass, 0.0, restitution)
        return 2.0 * m.static * free_decay.least_at_resonance(self._dimensionless(damper)).clearance

    @cached_property
    def alone(self) -> float:
        """Largest displacement in m under a record without a damper."""
        point = completed(self.without()["parameters"] | {"forcing": self.machine.record})
        arrays, _ = run_points([point], {"response": {}}, **self.run)
        return float(arrays["peak_displacement"][0]) * self.machine.length

    @property
    def distance(self) -> float:
        """Largest amplitude without the damper over the closed form's, in a band off resonance."""
        m = self.machine
        if m.band is None:
            return 1.0
        return min(max(map(m.undamped, self.band)) / self.least, 1.0)

    def closed_form(self, damper: Sizes) -> dict[str, float]:
        """What the closed forms say of a damper, of what counts; nothing where they hold not."""
        m = self.machine
        if self.count > 1 or m.weight:
            return {}
        if m.is_free:
            time = self._decay_time(damper)
            return {"value": time} if time < math.inf else {}
        if m.band is None or not m.band[0] <= m.rate / (2.0 * math.pi) <= m.band[1]:
            return {}
        size = m.counted(m.static, m.rate / math.tau)
        clearance = 0.5 * damper.gap / m.static
        least, best = free_decay.least_at_resonance(self._dimensionless(damper))
        if clearance > 1.01 * best:
            return {}
        p = self._dimensionless(damper, clearance=min(clearance, best))
        largest = free_decay.largest_at_resonance(p)
        least = least if clearance > 0.99 * best else largest
        return {"value": size * least, "largest": size * largest}

    def idle(self, damper: Sizes) -> float:
        """What counts where no wall of a damper reaches a free mass at rest; else 0."""
        m = self.machine
        if m.band is None or m.weight:  # weight lays it on a wall, friction takes it along
            return 0.0
        alone = ((m.undamped(hertz), hertz) for hertz in self.band)
        return max((m.counted(*one) for one in alone if one[0] < 0.5 * damper.gap), default=0.0)

    def _dimensionless(self, damper: Sizes, **options: float) -> Parameters:
        """A damper of this machine at resonance, for the closed forms."""
        m = self.machine
        given = {"clearance": 1.0, "restitution": damper.restitution} | options
        return Parameters(damper.mass / m.mass, m.damping_ratio, 1.0, **given)

    def _decay_time(self, damper: Sizes) -> float:
        """Time in s by the closed form of free decay; infinite where the motion ends before."""
        m, start = self.machine, self.machine.initial_displacement
        p = self._dimensionless(damper, clearance=0.5 * damper.gap, force_amplitude=0.0)
        low, _ = free_decay.amplitude_range(p)
        end = m.decay_to * start * (1.0 + _DIGIT)
        return free_decay.decay_time(p, start, end) / m.rate if low <= end else math.inf

    @property
    def band(self) -> list[float]:
        """Frequencies in the band, in Hz: evenly, and that of the machine."""
        low, high = self.machine.band or (1.0, 1.0)
        wide = self.machine.damping_ratio + 0.1 * self.machine.largest_mass / self.machine.mass
        count = math.ceil((high - low) / (0.15 * (low + high) * max(wide, 1e-3)))
        even = _digits(np.linspace(low, high, max(_LEAST, min(count, _MOST)) | 1))
        own = rounded(self.machine.rate / math.tau, 8)
        return sorted({*even, own}) if low < own < high else even

    @property
    def seconds(self) -> float:
        """How long runs in free motion or under a record are."""
        m = self.machine
        if m.is_recorded:  # an rms is over the record, a peak may follow it
            after = 0.0 if m.counts == "rms_displacement" else AFTER * math.tau / m.rate
            return rounded(m.record.end + after, 8)
        alone = -math.log(m.decay_to) / m.damping_ratio if m.damping_ratio else math.inf
        most = m.largest_mass
        slowest = (Sizes(most, self.closed_form_gap(most, r), r) for r in m.restitutions)
        longest = _SLOWER * m.rate * max(map(self._decay_time, slowest))
        alone *= 1.1
        if m.weight:  # a free mass that rests only slows the decay
            alone *= 1.0 + most / m.mass
            longest = longest if alone == math.inf else alone
        cycles = min(alone, longest) / math.tau + 5.0
        return rounded(math.tau * cycles / m.rate, 8)

    @property
    def run(self) -> dict[str, Any]:
        """How long runs are: in cycles, or in s where no frequency drives."""
        m = self.machine
        if m.band is None:
            return {"transient": 0, "periods": {"time": self.seconds}}
        # The damping that impacts add falls with the amplitude's distance from the best one.
        rate = m.damping_ratio + 0.15 * m.largest_mass / m.mass
        transient = math.ceil(_DIES / (2.0 * math.pi * rate))
        if m.weight:  # a free mass that rests adds no damping
            alone = _DIES_ALONE / (2.0 * math.pi * max(m.damping_ratio, 1e-6))
            transient = max(transient, math.ceil(alone))
        transient = min(max(transient, _TRANSIENT[0]), _TRANSIENT[1])
        return {"transient": transient, "periods": max(40, transient // 4)}

    @cached_property
    def far(self) -> float:
        """Displacement of the starts far out, in m: the largest amplitude without the damper.

        Or, with little damping, the amplitude that a resonance reaches in the transient.
        """
        m = self.machine
        if m.is_free:
            return m.initial_displacement
        reached = math.pi * self.run["transient"] * m.static
        return rounded(min(reached, max(map(m.undamped, self.band))))

    @property
    def observers(self) -> dict[str, Any]:
        """What is measured of each run, by the search as well."""
        m = self.machine
        if m.is_free:
            return {"decay": {"half_cycles": 3, "parts": [m.decay_to]}}
        return {"response": {"extremes": True} if m.counts == "peak_acceleration" else {}}

    def carrier_mass(self, damper: Sizes) -> float:
        """Mass in kg that a free mass is compared with."""
        return float(self.machine.mass)

    def observed(self, chains: Sequence[Chain], observers: Any) -> dict[str, np.ndarray]:
        """Run chains, each point from the end of the one before, and return what is observed."""
        m = self.machine
        force: dict[str, Any] = {"forcing": m.record if m.is_recorded else m.force[0]}
        if self.masses:
            force["masses"] = equal_masses(**self.masses)
        points = [completed(point | force) for chain in chains for point in chain]
        before: list[int] = []
        for chain in chains:
            before += [-1, *range(len(before), len(before) + len(chain) - 1)]
        return run_points(points, observers, predecessor=before, workers=None, **self.run)[0]

    @property
    def masses(self) -> dict[str, Any]:
        """Several masses, as the setting `masses` of a study; nothing of one."""
        return {"count": self.count, "clearance_spread": SPREAD} if self.count > 1 else {}

    @property
    def _bodies(self) -> dict[str, Any]:
        """Setting of observers that look at each of several masses."""
        return {"bodies": list(range(self.count))} if self.count > 1 else {}

    @property
    def starts(self) -> dict[str, list[float]]:
        """Starts of all dampers, as axes of a study; of several masses alike and apart."""
        apart = {_SPACING: [0.0, APART]} if self.count > 1 else {}
        if self.machine.is_free:
            return {"initial_position": [-0.5, 0.0, 0.5]} | apart
        if self.machine.is_recorded:
            return {"initial_position": PLACES} | apart
        return {"initial_displacement": [0.0, self.far, -self.far]} | apart

    def axes(self, damper: Sizes) -> dict[str, list[float]]:
        """Values of the axes of the worst case but for the frequency: tolerances and starts."""
        three = [self.sizes(damper, (k, k, k)) for k in (-1, 0, 1)]
        made = {name: list(dict.fromkeys(one[name] for one in three)) for name in three[0]}
        return made | self.starts

    def assumptions(self, quick: bool) -> Iterator[str]:
        """Sentences of a card on what was assumed."""
        m = self.machine
        yield in_words(m.weight, self.count)
        if m.weight.get("gravity"):
            yield "Displacements count from where the machine rests without the free mass."
        yield (
            "One mode of the machine; impacts take no time and have one coefficient of restitution."
        )
        if quick:
            yield "The closed forms are of a light mass: their error is of the order of its ratio."
            yield (
                "Other frequencies, tolerances and starts are not looked at; without quick they "
                "are."
            )
            return
        run = self.run
        if m.is_free:
            yield "It is let go at rest, the free mass anywhere in the box and a little stirred."
            return
        if m.is_recorded:
            yield (
                "All begins at rest, the free mass anywhere in the box. The run has "
                f"{run['periods']['time']:.4g} s; another record is another case."
            )
            return
        yield (
            f"Starts: at rest, from {text_of(self.far, 'm')} to either side, on the closed motion "
            "with two impacts per cycle, and at random; and motions followed through the band both "
            "ways. "
            f"{run['transient']} cycles pass before {run['periods']} count."
        )
        yield f"The band has {len(self.band)} frequencies; between them only random starts are."

    @property
    def fixed(self) -> dict[str, float]:
        """Quantities that no damper changes."""
        m = self.machine
        if m.is_free:
            own = m.weight | {"initial_displacement": (start := m.initial_displacement)}
            return m.primary | own | {_SPEED: rounded(_STIRRED * m.rate * start)}
        if m.is_recorded:
            return m.primary | m.weight
        return m.primary | m.weight | {_SPEED: rounded(_STIRRED * m.rate * self.least)}

    @cached_property
    def cases(self) -> list[Case]:
        """All cases of a damper, in the order in which they are run at first.

        As built, then with all tolerances at their ends, then what is between; frequencies from
        coarse to fine; at last random starts.
        """
        corners = self.corners
        starts, band = product(self.starts, {}), self.band
        if self.machine.band is None:
            made = [Case(off, start) for off in corners for start in starts]
            return [*made, *self._fine(), *self._random(_RANDOM)]
        coarse = [band[k] for k in sorted(range(len(band)), key=lambda k: -math.gcd(k, _COARSE))]
        made, wall = [], {"initial_position": 1.0}
        far = {"initial_displacement": -self.far}
        for off in corners:
            made += [Case(off, start, (hertz,)) for start in starts for hertz in coarse]
            made += [Case(off, wall | far, (hertz,), closed=True) for hertz in coarse]
        built = len(made) // len(corners)
        ways = tuple(band), tuple(band[::-1])
        followed = [Case(corners[0], start | wall, way) for start in starts for way in ways]
        at = max(range(len(band)), key=lambda k: self.machine.undamped(band[k]))
        ways = tuple(band[at:]), tuple(band[at::-1])
        followed += [Case(corners[0], wall | far, way, closed=True) for way in ways]
        return [*made[:built], *followed, *made[built:], *self._random(_RANDOM)]

    def _fine(self) -> Iterator[Case]:
        """Many places of the free mass, stirred either way, and gaps within the tolerance."""
        parts = np.linspace(-1.0, 1.0, _FINE_GAPS).tolist() if self.machine.gap_tolerance else [0.0]
        stirred = self.fixed.get(_SPEED, 0.0)
        for place in np.linspace(-1.0, 1.0, _FINE_PLACES).tolist():
            for speed in dict.fromkeys((stirred, -stirred)):
                start = {"initial_position": place, _SPEED: speed}
                for apart in self._apart:
                    yield from (Case((0, part, 0), start | apart) for part in parts)

    @property
    def _apart(self) -> list[dict[str, float]]:
        """Starts of several masses alike and apart; of one, nothing is to be said."""
        return [{}, {_SPACING: APART}] if self.count > 1 else [{}]

    def fresh(self, worst: Case, seed: int) -> list[Case]:
        """More random starts, others for each seed: of any damper, and near its worst case."""
        seed += _SEEDS
        return [*self._random(_MORE, seed=seed), *self._random(_MORE, worst, seed)]

    def _random(self, count: int, about: Case | None = None, seed: int = 1) -> Iterator[Case]:
        """Random starts of any damper, or near the worst case that was found."""
        m, draw = self.machine, np.random.default_rng(seed)
        slowest = self.fixed.get(_SPEED, 0.0)
        for number in range(count):
            rate, place, speed, x, *off = draw.uniform(-1.0, 1.0, 7).tolist()
            apart = {}
            if self.count > 1 and number % _ALIKE:
                apart[_SPACING] = draw.uniform(0.0, 4.0)
            if m.band is not None:
                low, high = m.band
                if about is not None:
                    low, high = self._next_to(about.hertz[-1])
                    off = list(about.off)
                # Slower, it may stay where no wall comes: the motion without damper.
                speed = speed * self.far * m.rate + math.copysign(slowest, speed)
                start = {"initial_displacement": x * self.far, _SPEED: speed}
                hertz: tuple[float, ...] = (low + 0.5 * (1.0 + rate) * (high - low),)
            else:
                if about is not None:
                    place = _part(about.start["initial_position"] + _NEAR_PLACE * place)
                    off = [_part(a + _NEAR_OFF * b) for a, b in zip(about.off, off, strict=True)]
                    apart = {k: v for k, v in about.start.items() if k == _SPACING}
                start, hertz = {_SPEED: math.copysign(slowest, speed) + 0.0}, ()
            yield Case(tuple(off), start | {"initial_position": place} | apart, hertz)

    def _next_to(self, hertz: float) -> tuple[float, float]:
        """The band from one of its frequencies before to one behind."""
        low, high = self.machine.band or (hertz, hertz)
        step = (high - low) / (len(self.band) - 1)
        return max(low, hertz - step), min(high, hertz + step)

    def near(self, worst: Case) -> list[Case]:
        """More cases about the worst one: random, and its motion followed to both sides."""
        made = list(self._random(_NEARBY, worst, seed=2))
        if self.machine.band is None:
            return made
        at = worst.hertz[-1]
        for end in self._next_to(at):
            hertz = tuple(_digits(np.linspace(at, end, _FINER + 1)[1:])) if end != at else ()
            if len(worst.hertz) < 2 or (worst.hertz[0] < at) == (at < end):
                made.append(worst._replace(hertz=worst.hertz + hertz))
        return made

    def chain(self, damper: Sizes, case: Case) -> Chain:
        """Runs of a case, each of which starts from the end of the one before."""
        point = self.fixed | self.sizes(damper, case.off) | dict(case.start)
        if case.closed:
            point |= self._on_closed_motion(point, case.hertz[0])
        if not case.hertz:
            return [point]
        return [point | {"forcing_frequency": math.tau * hertz} for hertz in case.hertz]

    def chains(self, damper: Sizes) -> list[Chain]:
        """All runs of a damper; a number of the list is the same case of any damper."""
        return [self.chain(damper, case) for case in self.cases]

    def _on_closed_motion(self, point: Mapping[str, float], hertz: float) -> dict[str, float]:
        """Start on the motion with two impacts per cycle and the fastest free mass; or none."""
        m, ratio = self.machine, math.tau * hertz / self.machine.rate
        length = m.driven(hertz)
        mass, clearance = point["free_mass"] / m.mass, 0.5 * point["gap"] / length
        p = Parameters(mass, m.damping_ratio, ratio, clearance, point["restitution"])
        found = two_impacts.orbits(p)
        if not found:
            return {}
        orbit, speed = found[0], length * m.rate
        # A base drives by its velocity, too, so its force is ahead.
        ahead = math.atan(2.0 * m.damping_ratio * ratio) if m.force[0] == "base" else 0.0
        return {
            "phase": (orbit.forcing_phase - ahead) % math.tau,
            "initial_position": 1.0,
            "initial_displacement": length * orbit.displacement,
            "initial_velocity": speed * orbit.velocity_after,
            _SPEED: -speed * (orbit.speed + orbit.velocity_after),
        }

    def one(self, damper: Sizes, case: Case) -> dict[str, Any]:
        """The study of one case, the worst one that the search found."""
        fixed: dict[str, Any] = dict(self.chain(damper, case)[0])
        axes: dict[str, Any] = {}
        if len(case.hertz) > 1:
            way = "up" if case.hertz[0] < case.hertz[-1] else "down"
            values = sorted(case.hertz)
            axes["forcing_frequency"] = {"values": values, "unit": "Hz", "follow": way}
        elif case.hertz:
            fixed["forcing_frequency"] = {"value": case.hertz[0], "unit": "Hz"}
        return self._study("the worst run", axes, fixed, self.observers)

    def motion(self, damper: Sizes, case: Case, about: float | None = None) -> dict[str, Any]:
        """The study of the motion in a case, with the machine alone from the same start.

        Sampled is the whole window, or some cycles of it about a moment, in cycles.
        """
        made = self.one(damper, case)
        sampled: dict[str, Any] = {"samples_per_period": FINE, "events": 0} | self._bodies
        if about is not None:
            first = min(max(round(about) - SHOWN // 2, 0), made["periods"] - SHOWN)
            sampled |= {"start": first, "length": SHOWN, "events": 1000} | self._beside
        at = {"at": {"forcing_frequency": case.hertz[-1]}} if made["axes"] else {}
        figures = {"history": {"kind": "trajectory", **at}}
        title = f"{self.machine.title}: time history of the worst run"
        observers = {"trajectory": sampled | at}
        return made | {"title": title, "observers": observers, "figures": figures}

    @property
    def _beside(self) -> dict[str, Any]:
        """Setting of a time history that has the machine alone beside it; not where a mass rubs."""
        return {} if "friction_coefficient" in self.machine.weight else {"without_damper": True}

    def apart(self, study: Mapping[str, Any]) -> dict[str, Any]:
        """The study of a time history with the machine alone: no walls, and nothing rubs."""
        kept = {n: v for n, v in study["parameters"].items() if n not in self.machine.weight}
        title = f"{study['title']}, without damper"
        parameters = kept | {"gap": _NO_WALLS, "initial_position": 0.0}
        return {**study, "title": title, "parameters": parameters}

    def check(self, damper: Sizes) -> dict[str, Any]:
        """The study of fresh random starts: another seed than the search's, and another rule."""
        m, fixed = self.machine, dict(self.fixed)
        draws: dict[str, Any] = {"count": _FRESH, "seed": 43}
        low, high = self.sizes(damper, (-1, -1, -1)), self.sizes(damper, (1, 1, 1))
        draws |= {name: [low[name], high[name]] for name in low if low[name] < high[name]}
        fixed |= {name: value for name, value in self.sizes(damper).items() if name not in draws}
        if m.band is None:
            draws["initial_position"] = [-1.0, 1.0]
            if stirred := fixed.pop(_SPEED, 0.0):
                draws[_SPEED] = {"values": [-stirred, stirred]}
        else:
            draws["forcing_frequency"] = {"range": list(m.band), "unit": "Hz"}
            draws |= {"phase": [0.0, math.tau], "initial_position": {"values": [-1.0, 1.0]}}
            draws["initial_displacement"] = [-self.far, self.far]
            draws["initial_velocity"] = self._speeds
        if self.count > 1:
            draws[_SPACING] = [0.0, 4.0]
        return self._study("a check by fresh starts", {}, fixed, self.observers) | {"draws": draws}

    def worst_case(self, damper: Sizes) -> dict[str, Any]:
        """The study of tolerances and starts at all frequencies, in the band and beyond."""
        axes: dict[str, dict[str, Any]] = {
            name: {"values": values} for name, values in self.axes(damper).items()
        }
        if self.machine.is_free:
            return self._study("the worst case", axes, self.fixed, self.observers)
        observers = self.observers | {"impacts": {}}
        if self.machine.is_recorded:
            axes["force_amplitude"] = {"values": _SIZES}
            return self._study("the worst case", axes, self.fixed, observers)
        every = sorted([*self.band, *self.beyond])
        axes["forcing_frequency"] = {"values": every, "unit": "Hz"}
        made = self._study("the worst case", axes, self.fixed, observers)
        worst = [name for name in made["axes"] if name != "forcing_frequency"]
        figure = {"kind": "curves", "variables": [self.machine.measured[0]], "worst": worst}
        return made | {"figures": {"response": figure | {"along": "forcing_frequency"}}}

    def sweep(self, damper: Sizes) -> dict[str, Any]:
        """The study that follows the motion through the band, both ways."""
        axes = {"forcing_frequency": {"values": self.band, "unit": "Hz", "follow": "both"}}
        fixed = self.fixed | self.sizes(damper) | {"initial_position": 1.0}
        return self._study("followed through the frequencies", axes, fixed, self.observers)

    def envelope(self, damper: Sizes) -> dict[str, Any]:
        """The study of all peaks of the free motion of the damper as built."""
        count = min(math.ceil(self.seconds * self.machine.rate / math.pi) + 2, _PEAKS)
        observers = {"decay": {"half_cycles": count, "parts": [self.machine.decay_to]}}
        fixed = self.fixed | self.sizes(damper) | {"initial_position": 0.5}
        return self._study("every peak", {}, fixed, observers)

    def without(self) -> dict[str, Any]:
        """The study of a record without damper: between walls that nothing reaches."""
        m = self.machine
        damper = self.sizes(Sizes(m.largest_mass, _NO_WALLS, min(m.restitutions)))
        return self._study("without damper", {}, m.primary | damper, self.observers)

    def history(self, damper: Sizes) -> dict[str, Any]:
        """The study of the motion under a record of the damper as built, and without it."""
        samples = math.ceil(_SAMPLES * self.machine.rate / math.tau)
        sampled: dict[str, Any] = {"samples_per_period": samples, "events": 0}
        sampled |= self._beside | self._bodies
        fixed = self.fixed | self.sizes(damper)
        return self._study("time history", {}, fixed, {"trajectory": sampled})

    def nearby(self, damper: Sizes, frequency: float) -> dict[str, Any]:
        """The study of what a part of each quantity, more or less, changes at a frequency in Hz."""
        driven = {"forcing_frequency": {"value": frequency, "unit": "Hz"}} if frequency else {}
        own = self.fixed | self.sizes(damper)
        changed = (n for n in CHANGED if own[n] and not (n == "restitution" and own[n] > 0.99))
        axes = {name: [(1.0 + k * PART) * own[name] for k in (-1, 0, 1)] for name in changed}
        starts = {k: v for k, v in self.axes(damper).items() if k.startswith("initial")}
        made = {name: {"values": values} for name, values in (axes | starts).items()}
        return self._study(f"{100.0 * PART:g} % more or less", made, own | driven, self.observers)

    @property
    def _speeds(self) -> list[float]:
        """To one side, for the other is its mirror image; slower, the free mass may stay idle.

        Under weight neither is so.
        """
        speed = self.far * self.machine.rate
        if self.machine.weight:
            return [-speed, speed]
        return [min(self.fixed[_SPEED], _STIRRED * speed), speed]

    def motions(self, damper: Sizes, frequency: float) -> dict[str, Any]:
        """The study of the motions that random starts lead to at a frequency in Hz."""
        m = self.machine
        fixed: dict[str, Any] = m.primary | m.weight | self.sizes(damper)
        fixed["forcing_frequency"] = {"value": frequency, "unit": "Hz"}
        draws = {"count": STARTS, "seed": 1, "initial_position": [-1, 1], "phase": [0.0, math.tau]}
        draws["initial_displacement"] = [-self.far, self.far]
        draws[_SPEED] = self._speeds
        motion: dict[str, Any] = {"tolerance": 1e-4}
        if self.count > 1:
            draws[_SPACING] = [0.0, 4.0]
            motion["bodies"] = [0]
        own = {"response": {}} | self.observers
        observers = {"motion": motion, **own, "impacts": {"largest": True}}
        return self._study("motions from anywhere", {}, fixed, observers) | {"draws": draws}

    def _study(
        self, what: str, axes: dict[str, Any], fixed: dict[str, Any], observers: dict[str, Any]
    ) -> dict[str, Any]:
        single = {n: axes.pop(n)["values"][0] for n in list(axes) if len(axes[n]["values"]) == 1}
        return {
            "title": f"{self.machine.title}: {what}",
            "source": "damper design",
            "parameters": {n: v for n, v in (fixed | single).items() if n not in axes},
            "axes": axes,
            **({"masses": self.masses} if self.masses else {}),
            "forcing": self.machine.forcing,
            **self.run,
            "observers": observers,
        }


def in_words(weight: Mapping[str, float], count: int) -> str:
    """First assumption of a card: the free masses, their boxes, weight and friction."""
    if count == 1 and not weight:
        return _ONE_MASS
    many = count > 1
    boxes = "each in a box of its own" if many else "in a box"
    friction = weight.get("friction_coefficient", 0.0)
    rubs = f"with dry friction of coefficient {friction:g}" if friction else "without friction"
    text = (
        f"{count if many else 'One'} rigid free mass{'es side by side' * many} {rubs}, {boxes} "
        "along the motion, between equal walls."
    )
    if "gravity" in weight:
        text += f" The motion is upright: {GRAVITY:g} m/s² pull the free mass to the lower wall."
    elif friction:
        text += f" The box lies: {GRAVITY:g} m/s² press the free mass on it."
    if many:
        text += (
            f" Gaps differ by {100.0 * SPREAD:g} % either way; the masses begin alike and apart."
        )
    return text


def rounded(value: float, digits: int = 3) -> float:
    """A number of few digits."""
    return float(f"{value:.{digits}g}")


def _part(value: float) -> float:
    """A place or a part of a tolerance, within its range."""
    return min(max(value, -1.0), 1.0)


def _digits(values: np.ndarray) -> list[float]:
    return [rounded(value, 8) for value in values.tolist()]
