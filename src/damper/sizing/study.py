"""The studies that a damper is judged by: the same points for the search, the answer and a file.

`worst_case` starts at each frequency at rest and far out, with all tolerances; `sweep` follows the
motion through the frequencies, both ways; `motions` starts anywhere, at one frequency.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from damper.parameters import Parameters
from damper.sizing.machine import Machine
from damper.sweep.grid import product
from damper.theory.free_decay import (
    amplitude_range,
    decay_time,
    largest_at_resonance,
    least_at_resonance,
)
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
#: Runs of a damper at each frequency that are made at a time.
_PIECE = 2
#: Starts far out: displacement over the least amplitude, at most that without the damper.
_FAR = 10.0
#: Starts anywhere, at the frequency of the worst case.
STARTS = 60


#: Points, each of which starts from the end of the one before.
Chain = list[dict[str, float]]


class Sizes(NamedTuple):
    """A free mass in kg and its gap in m, the whole travel."""

    mass: float
    gap: float


@dataclass(frozen=True)
class Judge:
    """How dampers of a machine are judged: frequencies, starts, lengths of runs."""

    machine: Machine

    @property
    def least(self) -> float:
        """Least amplitude in m that the resonance law allows, of the largest mass."""
        m = self.machine
        return m.static * least_at_resonance(self._dimensionless(m.largest_mass)).amplitude

    def law_gap(self, mass: float) -> float:
        """The gap in m that the closed laws give a free mass, however large."""
        m = self.machine
        if m.is_free:  # the amplitude that is to be reached is where the motion ends
            return 2.0 * m.decay_to * m.initial_displacement / fold(m.restitution).xi
        return 2.0 * m.static * least_at_resonance(self._dimensionless(mass)).clearance

    @property
    def distance(self) -> float:
        """Largest amplitude without the damper over the law's, where the band is off resonance."""
        m = self.machine
        return 1.0 if m.is_free else min(max(map(m.undamped, self.band)) / self.least, 1.0)

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
        least, best = least_at_resonance(self._dimensionless(damper.mass))
        if clearance > 1.01 * best:
            return {}
        p = self._dimensionless(damper.mass, clearance=min(clearance, best))
        largest = largest_at_resonance(p)
        least = least if clearance > 0.99 * best else largest
        return {"value": size * least, "largest": size * largest}

    def _dimensionless(self, mass: float, **options: float) -> Parameters:
        """A damper of this machine at resonance, for the closed laws."""
        m = self.machine
        given = {"clearance": 1.0, "restitution": m.restitution} | options
        return Parameters(mass / m.mass, m.damping_ratio, 1.0, **given)

    def _decay_time(self, damper: Sizes) -> float:
        """Time in s by the law of free decay; infinite where the motion ends before."""
        m, start = self.machine, self.machine.initial_displacement
        p = self._dimensionless(damper.mass, clearance=0.5 * damper.gap, force_amplitude=0.0)
        low, _ = amplitude_range(p)
        end = m.decay_to * start * (1.0 + 1e-9)
        return decay_time(p, start, end) / m.rate if low <= end else math.inf

    @property
    def band(self) -> list[float]:
        """Frequencies in the band, in Hz."""
        low, high = self.machine.band or (1.0, 1.0)
        wide = self.machine.damping_ratio + 0.1 * self.machine.largest_mass / self.machine.mass
        count = math.ceil((high - low) / (0.15 * (low + high) * max(wide, 1e-3)))
        return _digits(np.linspace(low, high, max(_LEAST, min(count, _MOST)) | 1))

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
            law = m.rate * self._decay_time(Sizes(m.largest_mass, self.law_gap(m.largest_mass)))
            cycles = min(1.1 * alone, _SLOWER * law) / (2.0 * math.pi)
            return {"transient": 0, "periods": math.ceil(cycles) + 5}
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
            "restitution": (m.restitution, m.restitution_tolerance),
        }
        axes = {name: [v - t, v, v + t] if t else [v] for name, (v, t) in ranges.items()}
        axes["gap"] = [max(gap, 0.0) for gap in axes["gap"]]
        if m.is_free:
            return axes | {"initial_position": [-0.5, 0.0, 0.5]}
        return axes | {"initial_displacement": [0.0, self.far]}

    @property
    def fixed(self) -> dict[str, float]:
        """Quantities that no damper changes."""
        m = self.machine
        if m.is_free:
            start, rate = m.initial_displacement, m.rate
            own = {"forcing_frequency": rate, "initial_displacement": start}
            return m.primary | own | {"initial_relative_velocity": rounded(_STIRRED * rate * start)}
        return m.primary | {"initial_relative_velocity": rounded(_STIRRED * m.rate * self.least)}

    def stages(self, damper: Sizes) -> list[list[Chain]]:
        """All runs of a damper in the band, in the order in which they are made.

        First as built, then with all tolerances at their ends, then what is between.
        """
        own, grid = self.nominal(damper), product(self.axes(damper), self.fixed)
        # As many of its three values are as built: 3, then 0, 1, 2.
        order = sorted(grid, key=lambda point: (sum(point[n] == own[n] for n in own) + 1) % 4)
        rates = [2.0 * math.pi * frequency for frequency in self.band]
        if self.machine.is_free:
            return _pieces([[point] for point in order], _PIECE)
        runs = [[point | {"forcing_frequency": rate}] for point in order for rate in rates]
        fixed = self.fixed | own | {"initial_position": 1.0}
        followed = [
            [fixed | {"forcing_frequency": rate} for rate in way] for way in (rates, rates[::-1])
        ]
        first, *others = _pieces(runs, _PIECE * len(rates))
        return [first, followed, *others]

    def worst_case(self, damper: Sizes) -> dict[str, Any]:
        """The study of tolerances and starts at all frequencies, in the band and beyond."""
        axes: dict[str, dict[str, Any]] = {
            name: {"values": values} for name, values in self.axes(damper).items()
        }
        if not self.machine.is_free:
            every = sorted([*self.band, *self.beyond])
            axes["forcing_frequency"] = {"values": every, "unit": "Hz"}
        if self.machine.is_free:
            return self._study("the worst case", axes, self.fixed, self.observers)
        made = self._study("the worst case", axes, self.fixed, self.observers | {"impacts": {}})
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

    def motions(self, damper: Sizes, frequency: float) -> dict[str, Any]:
        """The study of the motions that random starts lead to at a frequency in Hz."""
        fixed: dict[str, Any] = self.machine.primary | self.nominal(damper)
        fixed["forcing_frequency"] = {"value": frequency, "unit": "Hz"}
        far, speed = self.far, self.far * self.machine.rate
        draws = {"count": STARTS, "seed": 1, "initial_position": [-1, 1]}
        draws["initial_displacement"] = [-far, far]
        draws["initial_relative_velocity"] = [-speed, speed]
        observers = {"motion": {"tolerance": 1e-4}, "response": {}, "impacts": {}}
        return self._study("motions from anywhere", {}, fixed, observers) | {"draws": draws}

    def nominal(self, damper: Sizes) -> dict[str, float]:
        """Quantities of the damper itself."""
        made = {"free_mass": damper.mass, "gap": damper.gap}
        return made | {"restitution": self.machine.restitution}

    def _study(
        self, what: str, axes: dict[str, Any], fixed: dict[str, Any], observers: dict[str, Any]
    ) -> dict[str, Any]:
        single = {n: axes.pop(n)["values"][0] for n in list(axes) if len(axes[n]["values"]) == 1}
        return {
            "title": f"{self.machine.title}: {what}",
            "source": "damper design",
            "parameters": fixed | single,
            "axes": axes,
            "forcing": self.machine.force[0],
            **self.run,
            "observers": observers,
        }


def _pieces(runs: list[Chain], size: int) -> list[list[Chain]]:
    return [runs[start : start + size] for start in range(0, len(runs), size)]


def rounded(value: float, digits: int = 3) -> float:
    """A number of few digits."""
    return float(f"{value:.{digits}g}")


def _digits(values: np.ndarray) -> list[float]:
    return [rounded(value, 8) for value in values.tolist()]
