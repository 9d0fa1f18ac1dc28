"""The studies that a damper is judged by: the same points for the search, the answer and a file.

`worst_case` starts at each frequency at rest and far out, with all tolerances; `sweep` follows the
motion through the frequencies, both ways; `motions` starts anywhere, at one frequency.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from damper.parameters import Parameters
from damper.sizing.machine import Machine
from damper.sweep.grid import product
from damper.sweep.runs import run_points
from damper.theory import free_decay
from damper.theory.slow_manifold import fold

#: Frequencies in the band, at least and at most, and on each side of it.
_LEAST, _MOST, _BEYOND = 11, 51, 14
#: Beyond the band: parts of its lowest and of its highest frequency.
_RANGE = (0.5, 1.5)
#: What a transient falls to, as an exponent, and its bounds in cycles.
_DIES, _TRANSIENT = 30.0, (100, 2000)
#: Peaks of a free motion that are kept.
_PEAKS = 4000
#: Decays so many times as slow as the law's are not run to their end.
_SLOWER = 4.0
#: Part of the primary's speed with which the free mass begins: at exact rest it may stay there.
_STIRRED = 0.1
#: Most frequencies of a band whose order is from coarse to fine.
_COARSE = 64
#: Places of the free mass as a record begins, and sizes of the record off design.
_PLACES, _SIZES = [-1.0, -0.5, 0.0, 0.5, 1.0], [0.5, 1.0, 2.0]
#: Cycles of the machine's own in which a peak after a record is looked for.
_AFTER = 2.0
#: A gap over the displacement that no free mass crosses.
_NO_WALLS = 1e9
#: Part of a quantity by which it is changed to see what that does.
PART = 0.01
#: Starts far out: displacement over the least amplitude, at most that without the damper.
_FAR = 10.0
#: Quantities of which a card says what a change does.
CHANGED = ("free_mass", "gap", "restitution", "damping")
#: Starts anywhere, at the frequency of the worst case.
STARTS = 60


#: Points, each of which starts from the end of the one before.
Chain = list[dict[str, float]]


class Sizes(NamedTuple):
    """A free mass in kg, its gap in m (the whole travel), and the restitution of its stops."""

    mass: float
    gap: float
    restitution: float


@dataclass(frozen=True)
class Judge:
    """How dampers of a machine are judged: frequencies, starts, lengths of runs."""

    machine: Machine

    @property
    def least(self) -> float:
        """Least amplitude in m that the resonance law allows, of the largest mass."""
        m = self.machine
        heaviest = Sizes(m.largest_mass, 0.0, min(m.restitutions))
        return m.static * free_decay.least_at_resonance(self._dimensionless(heaviest)).amplitude

    def law_gap(self, mass: float, restitution: float) -> float:
        """The gap in m that the closed laws give a free mass, however large."""
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
        points = [self.without()["parameters"]]
        arrays, _ = run_points(points, {"response": {}}, forcing=self.machine.record, **self.run)
        return float(arrays["peak_displacement"][0]) * self.machine.length

    @property
    def distance(self) -> float:
        """Largest amplitude without the damper over the law's, where the band is off resonance."""
        m = self.machine
        if m.band is None:
            return 1.0
        return min(max(map(m.undamped, self.band)) / self.least, 1.0)

    def law(self, damper: Sizes) -> dict[str, float]:
        """What the closed laws say of a damper, of what counts; nothing where they hold not."""
        m = self.machine
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

    def _dimensionless(self, damper: Sizes, **options: float) -> Parameters:
        """A damper of this machine at resonance, for the closed laws."""
        m = self.machine
        given = {"clearance": 1.0, "restitution": damper.restitution} | options
        return Parameters(damper.mass / m.mass, m.damping_ratio, 1.0, **given)

    def _decay_time(self, damper: Sizes) -> float:
        """Time in s by the law of free decay; infinite where the motion ends before."""
        m, start = self.machine, self.machine.initial_displacement
        p = self._dimensionless(damper, clearance=0.5 * damper.gap, force_amplitude=0.0)
        low, _ = free_decay.amplitude_range(p)
        end = m.decay_to * start * (1.0 + 1e-9)
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
    def beyond(self) -> list[float]:
        """Frequencies outside of the band, in Hz."""
        low, high = self.machine.band or (1.0, 1.0)
        below = np.linspace(_RANGE[0] * low, low, _BEYOND, endpoint=False)
        above = np.linspace(_RANGE[1] * high, high, _BEYOND, endpoint=False)
        return _digits(np.concatenate([below, above[::-1]]))

    @property
    def run(self) -> dict[str, Any]:
        """How long runs are, in cycles."""
        m = self.machine
        if m.is_free:
            alone = -math.log(m.decay_to) / m.damping_ratio if m.damping_ratio else math.inf
            most = m.largest_mass
            slowest = (Sizes(most, self.law_gap(most, r), r) for r in m.restitutions)
            law = m.rate * max(map(self._decay_time, slowest))
            cycles = min(1.1 * alone, _SLOWER * law) / (2.0 * math.pi)
            return {"transient": 0, "periods": math.ceil(cycles) + 5}
        if m.is_recorded:  # an rms is over the record, a peak may follow it
            after = 0.0 if m.counts == "rms_displacement" else _AFTER * math.tau / m.rate
            return {"transient": 0, "periods": {"time": rounded(m.record.end + after, 8)}}
        # The damping that impacts add falls with the amplitude's distance from the best one.
        rate = m.damping_ratio + 0.15 * m.largest_mass / m.mass
        transient = math.ceil(_DIES / (2.0 * math.pi * rate))
        transient = min(max(transient, _TRANSIENT[0]), _TRANSIENT[1])
        return {"transient": transient, "periods": max(40, transient // 4)}

    @property
    def far(self) -> float:
        """Where runs start that start far out, in m."""
        m = self.machine
        if m.is_free:
            return m.initial_displacement
        return rounded(min(_FAR * self.least, max(map(m.undamped, self.band))))

    @property
    def observers(self) -> dict[str, Any]:
        """What is measured of each run, by the search as well."""
        m = self.machine
        if m.is_free:
            return {"decay": {"half_cycles": 3, "parts": [m.decay_to]}}
        return {"response": {"extremes": True} if m.counts == "peak_acceleration" else {}}

    def axes(self, damper: Sizes) -> dict[str, list[float]]:
        """Values of the axes of the worst case but for the frequency: tolerances and starts."""
        m = self.machine
        ranges = {
            "free_mass": (damper.mass, m.mass_tolerance),
            "gap": (damper.gap, m.gap_tolerance),
            "restitution": (damper.restitution, m.restitution_tolerance),
        }
        axes = {name: [v - t, v, v + t] if t else [v] for name, (v, t) in ranges.items()}
        axes["gap"] = [max(gap, 0.0) for gap in axes["gap"]]
        if m.is_free:
            return axes | {"initial_position": [-0.5, 0.0, 0.5]}
        if m.is_recorded:
            return axes | {"initial_position": _PLACES}
        return axes | {"initial_displacement": [0.0, self.far]}

    @property
    def fixed(self) -> dict[str, float]:
        """Quantities that no damper changes."""
        m = self.machine
        if m.is_free:
            start, rate = m.initial_displacement, m.rate
            own = {"forcing_frequency": rate, "initial_displacement": start}
            return m.primary | own | {"initial_relative_velocity": rounded(_STIRRED * rate * start)}
        if m.is_recorded:  # its cycle is the clock
            return m.primary | {"forcing_frequency": m.rate}
        return m.primary | {"initial_relative_velocity": rounded(_STIRRED * m.rate * self.least)}

    def chains(self, damper: Sizes) -> list[Chain]:
        """All runs of a damper in the band, in the order in which they are made at first.

        As built, then with all tolerances at their ends, then what is between; frequencies from
        coarse to fine. A number of the list is the same case of any damper.
        """
        own, grid = self.nominal(damper), product(self.axes(damper), self.fixed)
        # As many of its three values are as built: 3, then 0, 1, 2.
        order = sorted(grid, key=lambda point: (sum(point[n] == own[n] for n in own) + 1) % 4)
        if self.machine.band is None:
            return [[point] for point in order]
        rates = [2.0 * math.pi * frequency for frequency in self.band]
        coarse = sorted(range(len(rates)), key=lambda k: -math.gcd(k, _COARSE))
        runs = [[point | {"forcing_frequency": rates[k]}] for point in order for k in coarse]
        fixed = self.fixed | own | {"initial_position": 1.0}
        followed = [
            [fixed | {"forcing_frequency": rate} for rate in way] for way in (rates, rates[::-1])
        ]
        built = 2 * len(rates)
        return [*runs[:built], *followed, *runs[built:]]

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
        fixed = self.fixed | self.nominal(damper) | {"initial_position": 1.0}
        return self._study("followed through the frequencies", axes, fixed, self.observers)

    def envelope(self, damper: Sizes) -> dict[str, Any]:
        """The study of all peaks of the free motion of the damper as built."""
        count = min(2 * self.run["periods"] + 2, _PEAKS)
        observers = {"decay": {"half_cycles": count, "parts": [self.machine.decay_to]}}
        fixed = self.fixed | self.nominal(damper) | {"initial_position": 0.5}
        return self._study("every peak", {}, fixed, observers)

    def without(self) -> dict[str, Any]:
        """The study of a record without damper: between walls that nothing reaches."""
        m = self.machine
        damper = self.nominal(Sizes(m.largest_mass, _NO_WALLS, min(m.restitutions)))
        return self._study("without damper", {}, self.fixed | damper, self.observers)

    def history(self, damper: Sizes) -> dict[str, Any]:
        """The study of the motion under a record of the damper as built, and without it."""
        sampled = {"samples_per_period": 40, "events": 0, "without_damper": True}
        fixed = self.fixed | self.nominal(damper)
        return self._study("time history", {}, fixed, {"trajectory": sampled})

    def nearby(self, damper: Sizes, frequency: float) -> dict[str, Any]:
        """The study of what a part of each quantity, more or less, changes at a frequency in Hz."""
        fixed = self.fixed | ({"forcing_frequency": math.tau * frequency} if frequency else {})
        own = fixed | self.nominal(damper)
        changed = (n for n in CHANGED if own[n] and not (n == "restitution" and own[n] > 0.99))
        axes = {name: [(1.0 + k * PART) * own[name] for k in (-1, 0, 1)] for name in changed}
        starts = {k: v for k, v in self.axes(damper).items() if k.startswith("initial")}
        made = {name: {"values": values} for name, values in (axes | starts).items()}
        return self._study(f"{100.0 * PART:g} % more or less", made, own, self.observers)

    def motions(self, damper: Sizes, frequency: float) -> dict[str, Any]:
        """The study of the motions that random starts lead to at a frequency in Hz."""
        fixed: dict[str, Any] = self.machine.primary | self.nominal(damper)
        fixed["forcing_frequency"] = {"value": frequency, "unit": "Hz"}
        far, speed = self.far, self.far * self.machine.rate
        draws = {"count": STARTS, "seed": 1, "initial_position": [-1, 1]}
        draws["initial_displacement"] = [-far, far]
        draws["initial_relative_velocity"] = [-speed, speed]
        own = {"response": {}} | self.observers
        observers = {"motion": {"tolerance": 1e-4}, **own, "impacts": {}}
        return self._study("motions from anywhere", {}, fixed, observers) | {"draws": draws}

    def nominal(self, damper: Sizes) -> dict[str, float]:
        """Quantities of the damper itself."""
        made = {"free_mass": damper.mass, "gap": damper.gap}
        return made | {"restitution": damper.restitution}

    def _study(
        self, what: str, axes: dict[str, Any], fixed: dict[str, Any], observers: dict[str, Any]
    ) -> dict[str, Any]:
        single = {n: axes.pop(n)["values"][0] for n in list(axes) if len(axes[n]["values"]) == 1}
        return {
            "title": f"{self.machine.title}: {what}",
            "source": "damper design",
            "parameters": {n: v for n, v in (fixed | single).items() if n not in axes},
            "axes": axes,
            "forcing": self.machine.forcing,
            **self.run,
            "observers": observers,
        }


def rounded(value: float, digits: int = 3) -> float:
    """A number of few digits."""
    return float(f"{value:.{digits}g}")


def _digits(values: np.ndarray) -> list[float]:
    return [rounded(value, 8) for value in values.tolist()]
