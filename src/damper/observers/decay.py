"""Decay of a free vibration: its peaks, equivalent damping ratio, and where the energy goes."""

import math
from typing import Any, NamedTuple

import numpy as np

from damper.engine.compiled import compiled, plain
from damper.engine.forcing.none import ZeroForce
from damper.engine.forcing.record import PiecewiseLinear
from damper.engine.forcing.weighed import WeighedForce
from damper.engine.model import begin_samples, motion_sample, read_segment
from damper.engine.roundoff import EPSILON
from damper.engine.segment import IMPACT, TAIL
from damper.engine.trajectory import Trajectory
from damper.models.response import (
    fastest_rate,
    integrate_segment,
    own_loss,
    own_share,
    prepare_tables,
)
from damper.observers.common.base import Observer, Window, part_within, read_record, record_type
from damper.observers.common.settings import BODIES, Setting
from damper.observers.response import TOTALS, follow, lost_between_impacts
from damper.parameters.models import ON_PRIMARY
from damper.parameters.variables import ENERGY, LENGTH, TIME, Variable

#: Half cycles so far; the side of zero that x is on; the highest |x| there and its time; the first
#: peak and the last one, with their times; energy that impacts take from one of several masses.
_HALF = record_type(
    *("number", "side", "highest", "moment", "first", "first_moment", "last", "last_moment"),
    "lost",
)
#: A step in which v changes its sign once at most, in units of 1/rate of the free vibration, which
#: turns no sooner than after pi/rate.
_STEP = 1.5
#: Steps after which a zero of v is as good as found; bisection alone needs no more.
_MAX_ITERATIONS = 100
#: Rounding of the end of a record, as a part of it.
_AT_END = 1e-12

_NONE = "missing unless the vibration is free"
#: Choices of `vibration`, in the order of their values.
_VIBRATIONS = ("free", "forced")


class Decay(Observer):
    """How fast a free vibration of the primary decays, and what takes its energy.

    A half cycle is the time between two passages of the primary through zero, and its peak the
    largest displacement there: where the velocity vanishes, in flight as in sticking, or at an
    impact that turns it. Peaks are exact with rigid walls; within one compliant contact the
    velocity is taken to turn once. A window that begins with the primary on its way to zero is
    counted from there. Displacements are from the place of rest of the primary alone.

    The equivalent damping ratio is that of the linear vibration with the same logarithmic
    decrement (Rao, Mechanical Vibrations, chapter 2) over a whole cycle, from the peak A1 of the
    half cycle before to A2 of the one after:
    delta = ln(A1 / A2), delta / sqrt(4 pi^2 + delta^2). It is that of the dashpot where the free
    mass takes no part, and negative where the peaks grow.

    Energies are sums over the window, in units of F0^2/K: the energy at the end is the energy at
    the start less the losses. With `bodies`, each of several masses has its own impact loss. On a
    structure displacements are those of the box, and energies those of the whole structure, whose
    dashpots are its damping and the ties.

    Under a force, but after the end of a record or noise, and with a free mass that varies, all
    stays missing but `vibration`, which says so, and studies refuse it.
    """

    models = (*ON_PRIMARY, "structure")
    bodies = BODIES
    half_cycles = Setting(
        1000, "Half cycles of each run that are listed, the first ones.", ge=3, le=10_000_000
    )
    parts = Setting(
        (0.5, 0.1), "Parts of the first peak to which the fall is timed.", gt=0, lt=1, least=1
    )

    variables = (
        Variable(
            "peak_time",
            "time of the peak of a half cycle since the start of the window",
            TIME,
            ("half_cycle",),
            comment=_NONE,
        ),
        Variable(
            "peak_amplitude",
            "largest primary displacement in a half cycle, either way",
            LENGTH,
            ("half_cycle",),
            comment=_NONE,
        ),
        Variable(
            "equivalent_damping_ratio",
            "damping ratio of a linear vibration with the same logarithmic decrement",
            "1",
            ("half_cycle",),
            comment="over one cycle, from the peak before to the one after",
        ),
        Variable(
            "half_cycles",
            "half cycles of the primary in the window",
            "1",
            dtype="i4",
            comment=f"those not listed included; {_NONE}",
        ),
        Variable(
            "fall_time",
            "time from the first peak until peaks are down to a part of it for good",
            TIME,
            ("part",),
            comment="on the exponential between the two peaks; missing where none is so low",
        ),
        Variable("energy_at_start", "energy at the start of the window", ENERGY, comment=_NONE),
        Variable("energy_to_impacts", "energy lost in all impacts", ENERGY, comment=_NONE),
        Variable(
            "energy_to_dashpot",
            "energy lost in the dashpot",
            ENERGY,
            comment=f"with that of a support of the free mass; {_NONE}",
        ),
        Variable(
            "energy_to_friction",
            "energy lost in dry friction of all free masses",
            ENERGY,
            comment=_NONE,
        ),
        Variable("energy_left", "energy at the end of the window", ENERGY, comment=_NONE),
        Variable(
            "vibration",
            "whether the vibration is free",
            "1",
            dtype="i1",
            comment="0 free; 1 forced, also by a free mass that varies: nothing else is observed",
            flags=_VIBRATIONS,
        ),
    )

    shared = tuple(v.name for v in variables if v.name != "energy_to_impacts")
    of_box = tuple(
        v.name
        for v in variables
        if v.name in ("half_cycles", "fall_time") or "half_cycle" in v.dims
    )

    def size(self, dim: str, window_length: int) -> int:
        """Number of half cycles or of parts."""
        return self.half_cycles if dim == "half_cycle" else len(self.parts)

    def coordinates(self) -> dict[str, np.ndarray]:
        """Count half cycles from 1."""
        return {"half_cycle": np.arange(1.0, self.half_cycles + 1.0), "part": np.array(self.parts)}

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run."""
        super().begin(run, trajectory, window)
        model = self._model
        # A free mass that varies drives the primary as a force does.
        self._is_free = _ends_before(model.free.forcing, self._window) and not _varies(model)
        self._tables = prepare_tables(model)
        self._step = _STEP / plain(fastest_rate)(model)
        self._totals = np.zeros(1, TOTALS)
        self._half = np.zeros(1, _HALF)
        # Times and peaks, then those of the fall.
        self._listed = np.full((2, self.half_cycles), np.nan)
        self._parts = np.array(self.parts)
        self._falls = np.full(len(self.parts), np.nan)

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        if not self._is_free:
            return
        if self.is_first:
            follow(self._model, self._tables, log, self._window, self._totals)
            peaks = Peaks(self._half, self._listed, self._parts, self._falls)
            _find(self._model, log, self._window, self._step, peaks)
        if self.bodies:
            _lose(self._model, self._tables, log, self._window, self._half)

    def finish(self, finished: bool) -> None:
        """Write what there is; sums and counts stay missing where the run stopped early."""
        times, peaks = self._listed
        self._put({"peak_time": times, "peak_amplitude": peaks, "fall_time": self._falls})
        with np.errstate(divide="ignore", invalid="ignore"):
            decrement = np.log(peaks[:-2] / peaks[2:])
        ratios = decrement / np.hypot(2.0 * math.pi, decrement)
        self._put({"equivalent_damping_ratio": np.concatenate([[np.nan], ratios, [np.nan]])})
        if finished:
            self._put({"vibration": _VIBRATIONS.index("free" if self._is_free else "forced")})
        if not (finished and self._is_free):
            return
        total, half = read_record(self._totals), read_record(self._half)
        dashpot, friction = lost_between_impacts(self._model, total)
        self._put(
            {
                "half_cycles": half.number,
                "energy_at_start": total.stored,
                "energy_to_impacts": half.lost if self.bodies else total.loss,
                "energy_to_dashpot": dashpot,
                "energy_to_friction": friction,
                "energy_left": total.stored_last,
            }
        )


def _ends_before(forcing: Any, window: Window) -> bool:
    """Whether nothing drives the damper within the window."""
    if isinstance(forcing, WeighedForce):
        forcing = forcing.forcing
    if not isinstance(forcing, PiecewiseLinear) or forcing.value[-1]:
        return isinstance(forcing, ZeroForce)
    cycles, time = forcing.cycles[-1], forcing.time[-1]
    since = (window.periods - cycles) * forcing.cycle + (window.time - time)
    return bool(since >= -_AT_END * (cycles * forcing.cycle + time))


def _varies(model: Any) -> bool:
    return hasattr(model, "variation")


class Peaks(NamedTuple):
    """Where half cycles are noted."""

    half: np.ndarray
    """Of `_HALF`, one entry: the half cycle under way."""
    listed: np.ndarray
    """Times and sizes of the first peaks."""
    parts: np.ndarray
    falls: np.ndarray
    """Times of fall to these parts."""


@compiled
def _find(model, log, window, step, peaks):
    """Note all turning points and impacts of the primary in the window."""
    half = peaks.half[0]
    for index in range(len(log)):
        s = read_segment(model, log[index])
        start, low, high = part_within(s, model.cycle, window)
        if high < low:
            continue
        begun, tau = begin_samples(model, s), low
        x, v, _, _ = motion_sample(model, s, begun, tau)
        if half.side == 0.0 and half.highest == 0.0 and x * v < 0.0:
            half.highest = -1.0  # on its way to zero: no half cycle ends there
            half.side = math.copysign(1.0, x)
        _note(start + tau, x, peaks)
        while tau < high:
            end = min(tau + step, high)
            x, v_end, _, _ = motion_sample(model, s, begun, end)
            if v * v_end < 0.0:
                turn = _turning_time(model, s, begun, tau, end, v, v_end)
                x_turn, _, _, _ = motion_sample(model, s, begun, turn)
                _note(start + turn, x_turn, peaks)
            _note(start + end, x, peaks)
            tau = end
            v = v_end


@compiled
def _lose(model, tables, log, window, half):
    """Add what impacts in the window take from one of several masses."""
    for index in range(len(log)):
        s = read_segment(model, log[index])
        start, low, high = part_within(s, model.cycle, window)
        if high < low:
            continue
        if s.cause == IMPACT and start >= 0.0:
            half[0].lost += own_loss(model, s)
        if s.mode == TAIL:
            part = integrate_segment(model, tables, s, low, high, math.inf)
            half[0].lost += own_share(model, s) * part.loss


@compiled
def _note(moment, x, peaks):
    """Take a displacement into the half cycle under way; end that before where it has passed."""
    half = peaks.half[0]
    if x * half.side < 0.0:
        if half.highest > 0.0:
            _end_half_cycle(peaks)
        half.side = -half.side
        half.highest = 0.0
    elif half.side == 0.0 and x != 0.0:
        half.side = math.copysign(1.0, x)
    if half.highest >= 0.0 and abs(x) > half.highest:
        half.highest = abs(x)
        half.moment = moment


@compiled
def _end_half_cycle(peaks):
    half = peaks.half[0]
    number = int(half.number)
    if number < peaks.listed.shape[1]:
        peaks.listed[0, number] = half.moment
        peaks.listed[1, number] = half.highest
    if number == 0:
        half.first = half.highest
        half.first_moment = half.moment
    for k in range(len(peaks.parts)):
        level = peaks.parts[k] * half.first
        if half.highest > level:
            peaks.falls[k] = math.nan
        elif math.isnan(peaks.falls[k]):
            share = math.log(half.last / level) / math.log(half.last / half.highest)
            moment = half.last_moment + share * (half.moment - half.last_moment)
            peaks.falls[k] = moment - half.first_moment
    half.last = half.highest
    half.last_moment = half.moment
    half.number += 1.0


@compiled
def _turning_time(model, segment, begun, low, high, v_low, v_high):
    """Time in a step at which v vanishes: regula falsi, Illinois variant, kept in the bracket."""
    tau = low
    last = 0.0
    for _ in range(_MAX_ITERATIONS):
        tau = low - v_low * (high - low) / (v_high - v_low)
        if not low < tau < high:
            tau = 0.5 * (low + high)
        _, v, _, _ = motion_sample(model, segment, begun, tau)
        if v == 0.0 or high - low <= EPSILON * high:
            break
        if (v > 0.0) == (v_low > 0.0):
            if last < 0.0:
                v_high *= 0.5
            low, v_low, last = tau, v, -1.0
        else:
            if last > 0.0:
                v_low *= 0.5
            high, v_high, last = tau, v, 1.0
    return tau
