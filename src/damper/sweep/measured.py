"""Measures of a run on a structure: response at each point, energies, impacts.

Integrals are Gauss-Legendre sums over parts of segments that resolve the fastest motion to
roundoff (`damper.engine.quadrature`), and peaks are those of the polynomials through the same
nodes. Nothing depends on a step of sampling.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from damper.engine.compiled import compiled, plain
from damper.engine.forcing import derivative_of, phase_at, rate_of
from damper.engine.loop import FINISHED
from damper.engine.model import read_segment
from damper.engine.quadrature import FEWEST, NODES, REACH, WEIGHTS
from damper.engine.segment import CAUSE, DURATION, FLIGHT, IMPACT, PERIODS, TAIL, TIME
from damper.engine.trajectory import Trajectory
from damper.models.flights import rubbed_part
from damper.models.forces import drive_of
from damper.models.friction import SLIP_DIRECTION
from damper.models.many import MODE
from damper.models.structure.motion import bounce_in
from damper.observers.common.base import Window, part_within
from damper.parameters.run import DEFAULTS
from damper.parameters.structural import StructureParameters
from damper.parameters.structure_results import RESULTS_OF_POINTS
from damper.parameters.variables import SI_UNITS, STATUS
from damper.sweep.runs import observed

#: The rule of all parts, and the largest reach (rate times length) that it integrates.
_RULE = 12
_NODES, _WEIGHTS = NODES[_RULE - FEWEST, :_RULE], WEIGHTS[_RULE - FEWEST, :_RULE]
_REACH = float(REACH[_RULE - FEWEST])
#: Points between nodes at which a polynomial is taken, for each node.
_FINE = 4
#: Rules at a time at most: their numbers take less than their calls, and some megabytes.
_AT_ONCE = 256
#: Multiplications in a product of matrices for which OpenBLAS takes one thread. More of them wait
#: for each other, and other runs have the cores.
_ONE_THREAD = 4 * 65536
#: Reading one row takes less time than to compile for it.
_read, _part_within = plain(read_segment), plain(part_within)


class _Rules(NamedTuple):
    """Gauss rules on parts of segments, an entry for each."""

    row: np.ndarray
    """Row of the log."""
    begin: np.ndarray
    """Time since the segment's start."""
    step: np.ndarray
    cycle: np.ndarray
    """Cycle of the window."""


class Measured:
    """Measures a window of a run on a structure from pieces of its log.

    Parameters
    ----------
    parameters : StructureParameters
    trajectory : Trajectory
        The run.
    window : Window
    samples, history : int
        Samples in a cycle, and cycles of which they are kept.
    """

    def __init__(
        self,
        parameters: StructureParameters,
        trajectory: Trajectory,
        window: Window,
        samples: int = 0,
        history: int = 0,
    ) -> None:
        p, s, units = parameters, parameters.structure, parameters.units
        drive = drive_of(p.dimensionless)  # type: ignore[arg-type]
        size = drive.amplitude * (units.acceleration if drive.share else units.force)
        place = s.base if drive.share else s.force
        push = np.zeros(len(s)) if place is None or not size else size * place
        self._push = s.mass @ push if drive.share else push
        # Of each free mass; weight, friction and what the drive does to it are forces.
        self._boxes = np.array([s.boxes[one.box] for one in p.each])
        self._masses, self._stiffnesses, self._dampings, gravity, friction = (
            np.array([getattr(one, name) for one in p.each])
            for name in ("mass", "tie_stiffness", "tie_damping", "gravity", "friction")
        )
        self._weights, self._rubs = self._masses * gravity, self._masses * friction
        shares = np.array([s.base_shares[one.box] for one in p.each])
        self._carried = self._masses * (drive.share * size * shares)
        self._to_modes = s.shapes.T @ s.mass
        self._structure, self._units, self._trajectory = s, units, trajectory
        self._window = Window(*map(float, window))
        self._forcing = drive.forcing
        self._points = np.array([*s.points.values()]).reshape(-1, len(s))
        self._rate = _fastest(p) * units.time + rate_of(drive.forcing)
        count = len(p.each)
        self._sums: dict[str, Any] = {"work": 0.0}
        self._sums |= {name: np.zeros(len(self._points)) for name, _ in RESULTS_OF_POINTS}
        self._sums |= {name: np.zeros(len(s)) for name in ("modes", "energy")}
        self._sums |= {name: np.zeros(count) for name in ("ties", "friction")}
        self._peaks = np.zeros((3, len(self._points)))
        self._ranges = np.full((2, math.floor(window.length + 1e-9), len(self._points)), -math.inf)
        self._speeds: list[list[float]] = [[] for _ in range(count)]
        self._lost, self._rubbed = np.zeros(count), np.zeros(count)
        self._stored: list[float] = []
        self._end = 0.0
        self._step = trajectory.cycle / samples if history else math.inf
        self._kept: list[tuple[np.ndarray, np.ndarray]] = []
        self._wanted, self._taken = samples * history + 1 if history else 0, 0

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        segments = [_read(self._trajectory.model, row) for row in log]
        within = [_part_within(s, self._trajectory.cycle, self._window) for s in segments]
        kept = [k for k, (_, low, high) in enumerate(within) if high >= low]
        parts: list[tuple[float, ...]] = []
        for k in kept:
            start, low, high = within[k]
            if not self._stored:
                self._stored.append(self._energy_at(log[k], low))
                if start >= 0.0:
                    self._stored[0] += segments[k].loss * self._units.energy
            if start >= 0.0:
                self._count_losses(log[k], segments[k])
            if self._wanted:
                self._sample(log[k], start, low, high)
            parts += [(k, start, *ends) for ends in self._parts(start, low, high)]
        if kept:
            self._end = self._energy_at(log[kept[-1]], within[kept[-1]][2])
        if parts:
            self._integrate(log, np.array([s.bodies for s in segments]), np.array(parts))

    def _count_losses(self, row: np.ndarray, segment: Any) -> None:
        """Add the impact that begins a segment, and the bounces of a tail."""
        body = int(segment.body)
        if row[CAUSE] == IMPACT:
            self._speeds[body].append(segment.speed * self._units.speed)
            self._lost[body] += segment.loss * self._units.energy
        modes = segment.bodies[:, MODE]
        if row[DURATION] > 0.0 and (modes == TAIL).any():
            lost = self._lost_in_tail(row, modes != FLIGHT)
            bounce = bounce_in(self._trajectory.model, segment.bodies, body)
            rubbed = lost * rubbed_part(bounce)
            self._lost[body] += lost - rubbed
            self._rubbed[body] += rubbed

    def found(self) -> dict[str, Any]:
        """Return the arrays of `RESULTS`, and of `HISTORY` if that is kept."""
        cycle = self._trajectory.cycle * self._units.time
        length, sums = self._window.length * cycle, self._sums
        ranges = 0.5 * (self._ranges[0] + self._ranges[1])
        speeds = [np.array(own) for own in self._speeds]
        found: dict[str, Any] = {
            "amplitude": ranges.mean(axis=0) if len(ranges) else np.full(ranges.shape[1], math.nan),
            "impacts_per_cycle": np.array([len(own) for own in speeds]) / self._window.length,
            "mean_approach_speed": np.array(
                [own.mean() if len(own) else math.nan for own in speeds]
            ),
            "max_approach_speed": np.array([own.max() if len(own) else math.nan for own in speeds]),
            "impact_power": self._lost / length,
            "tie_power": sums["ties"] / length,
            "friction_power": (self._rubbed + sums["friction"]) / length,
            "mode_power": sums["modes"] / length,
            "mean_energy": sums["energy"] / length,
            "input_power": np.array(sums["work"] / length),
        }
        for k, (name, _) in enumerate(RESULTS_OF_POINTS):
            found[f"peak_{name}"] = self._peaks[k]
            found[f"rms_{name}"] = np.sqrt(sums[name] / length)
        losses = ("impact_power", "tie_power", "friction_power", "mode_power")
        lost = sum(found[name].sum() for name in losses)
        finished = self._trajectory.status == FINISHED
        gained = (self._end - self._stored[0]) / length if finished else math.nan
        found["power_residual"] = np.array(found["input_power"] - lost - gained)
        if self._wanted:
            if not finished:
                self._kept = [(np.full((self._wanted, len(self._structure)), math.nan),) * 2]
            x, v = (np.concatenate(parts) for parts in zip(*self._kept, strict=True))
            found["time"] = self._step * self._units.time * np.arange(len(x))
            found["displacement"] = x @ self._points.T
            found["mode_energy"] = self._structure.mode_energies(x, v)
        if not finished:
            found = {name: np.full_like(values, math.nan) for name, values in found.items()}
        return found | {"status": np.array(self._trajectory.status, dtype=STATUS.dtype)}

    def _states(
        self, log: np.ndarray, times: np.ndarray, at: np.ndarray | None = None
    ) -> tuple[np.ndarray, ...]:
        """Displacements and velocities of coordinates and free masses, in SI units."""
        units = self._units
        x, v, y, u = self._trajectory.states_in(log, times, at)
        return x * units.length, v * units.speed, y * units.length, u * units.speed

    def _energy_at(self, row: np.ndarray, tau: float) -> float:
        x, v, y, u = (one[0] for one in self._states(row, np.array([tau])))
        energy = float(self._structure.mode_energies(x, v).sum())
        apart = y - self._boxes @ x
        energy += 0.5 * float(self._masses @ u**2 + self._stiffnesses @ apart**2)
        return energy + float(self._weights @ y)

    def _lost_in_tail(self, row: np.ndarray, sticks: np.ndarray) -> float:
        """Energy of the motion relative to the boxes, all of which a closed burst takes."""
        _, v, _, u = (one[0] for one in self._states(row, np.zeros(1)))
        boxes = self._boxes[sticks]
        rates = u[sticks] - boxes @ v
        yields = boxes @ np.linalg.solve(self._structure.mass, boxes.T)
        yields += np.diag(1.0 / self._masses[sticks])
        return 0.5 * float(rates @ np.linalg.solve(yields, rates))

    def _sample(self, row: np.ndarray, start: float, low: float, high: float) -> None:
        """Keep the samples in a part of a segment."""
        last = min(math.floor((start + high) / self._step + 1e-9), self._wanted - 1)
        if last < self._taken:
            return
        taus = self._step * np.arange(self._taken, last + 1) - start
        x, v, _, _ = self._states(row, np.clip(taus, low, high))
        self._kept.append((x, v))
        self._taken = last + 1

    def _parts(self, start: float, low: float, high: float) -> list[tuple[float, float]]:
        """Parts of a segment that end where a cycle of the window does."""
        cycle = self._trajectory.cycle
        first, last = (math.floor((start + tau) / cycle) for tau in (low, high))
        ends = [low, *(k * cycle - start for k in range(first + 1, last + 1)), high]
        return [(a, b) for a, b in pairwise(ends) if b > a]

    def _integrate(self, log: np.ndarray, bodies: np.ndarray, parts: np.ndarray) -> None:
        """Add parts of segments, each in one cycle of the window, to integrals and peaks.

        Columns of the parts: row of the log, time from the window's start to that of the segment,
        both ends.
        """
        row, start, low, high = parts.T
        # The integrands are products of two motions.
        counts = np.ceil(2.0 * self._rate * (high - low) / _REACH).astype(int)
        of = np.repeat(np.arange(len(parts)), counts)
        place = np.arange(len(of)) - np.repeat(np.cumsum(counts) - counts, counts)
        step = ((high - low) / counts)[of]
        cycle = np.floor((start + 0.5 * (low + high)) / self._trajectory.cycle)
        rules = _Rules(row.astype(int)[of], low[of] + place * step, step, cycle.astype(int)[of])
        most = max(1, min(_AT_ONCE, _ONE_THREAD // (len(_NODES) * len(self._structure) ** 2)))
        for k in range(0, len(of), most):
            self._add(log, bodies, _Rules(*(one[k : k + most] for one in rules)))

    def _add(self, log: np.ndarray, bodies: np.ndarray, rules: _Rules) -> None:
        step = rules.step
        taus = (rules.begin[:, None] + step[:, None] * _NODES).ravel()
        at = np.repeat(rules.row, len(_NODES))
        x, v, _, u = state = self._states(log, taus, at)
        force = np.empty(len(taus))
        _write_force(self._forcing, log[at, PERIODS], log[at, TIME] + taus, force)
        rubs = self._rubs * bodies[at, :, SLIP_DIRECTION]
        joined = bodies[rules.row, :, MODE] != FLIGHT
        moved = self._forced(joined, rubs, force[:, None], state)
        weigh = np.outer(step, _WEIGHTS).ravel() * self._units.time
        s, sums = self._structure, self._sums
        drags = (v @ self._to_modes.T) * (v @ s.damping @ s.shapes)
        sums["work"] += float(weigh @ (force * (v @ self._push + u @ self._carried)))
        sums["modes"] = sums["modes"] + weigh @ drags
        sums["energy"] = sums["energy"] + weigh @ s.mode_energies(x, v)
        rates = u - v @ self._boxes.T
        sums["ties"] = sums["ties"] + weigh @ (rates**2) * self._dampings
        sums["friction"] = sums["friction"] + weigh @ (rates * rubs)
        drawn = []
        for (name, _), values in zip(RESULTS_OF_POINTS, (x, v, moved), strict=True):
            there = values @ self._points.T
            sums[name] = sums[name] + weigh @ there**2
            drawn.append(_FINER @ there.reshape(len(step), len(_NODES), -1))
        fine = np.stack(drawn, axis=-2)
        above, below = _highest(fine), _highest(-fine)
        self._peaks = np.maximum(self._peaks, np.maximum(above, below).max(axis=0))
        whole = rules.cycle < self._ranges.shape[1]
        for ends, found in zip(self._ranges, (above, below), strict=True):
            np.maximum.at(ends, rules.cycle[whole], found[whole, 0])

    def _forced(
        self,
        joined: np.ndarray,
        rubs: np.ndarray,
        force: np.ndarray,
        state: tuple[np.ndarray, ...],
    ) -> np.ndarray:
        """Accelerations of the coordinates, with the masses that are joined as a part of them.

        `rubs` are the forces of friction on the boxes. All arrays have a row for each time, but for
        `joined`, which has a row for each rule.
        """
        (x, v, y, u), s, boxes = state, self._structure, self._boxes
        ties = self._stiffnesses * (y - x @ boxes.T) + self._dampings * (u - v @ boxes.T)
        carried = force * self._carried - self._weights
        acting = force * self._push - v @ s.damping - x @ s.stiffness
        moved, sets = np.empty_like(x), np.unique(joined, axis=0)
        joined = joined.repeat(len(_NODES), axis=0)
        acting += np.where(joined, carried, ties + rubs) @ boxes
        for those in sets:
            now = (joined == those).all(axis=1)
            mass = s.mass + (boxes[those].T * self._masses[those]) @ boxes[those]
            moved[now] = np.linalg.solve(mass, acting[now].T).T
        return moved


def _fastest(p: StructureParameters) -> float:
    """Bound on the rates of motion in 1/s, whichever masses stick."""
    s = p.structure
    undamped = 2.0 * math.pi * float(s.frequencies[-1])
    dragged = float(np.abs(s.shapes.T @ s.damping @ s.shapes).sum(axis=1).max())
    for one in p.each:
        box = s.boxes[one.box]
        yields = 1.0 / one.mass + float(box @ np.linalg.solve(s.mass, box))
        undamped += math.sqrt(one.tie_stiffness * yields)
        dragged += one.tie_damping * yields
    return undamped + dragged


@compiled
def _write_force(forcing, periods, times, found):
    for k in range(len(times)):
        found[k] = derivative_of(forcing, phase_at(forcing, periods[k], times[k]), 0)


def _finer() -> np.ndarray:
    """Matrix from values at the nodes of the rule to those at equal steps, both ends included."""
    fine, degree = np.linspace(-1.0, 1.0, _FINE * len(_NODES) + 1), len(_NODES) - 1
    legendre = np.polynomial.legendre.legvander
    return legendre(fine, degree) @ np.linalg.inv(legendre(2.0 * _NODES - 1.0, degree))


_FINER = _finer()


def _highest(drawn: np.ndarray) -> np.ndarray:
    """Largest value of each column along the second axis, by a parabola about it."""
    at = drawn.argmax(axis=1, keepdims=True)
    inside = (at > 0) & (at < drawn.shape[1] - 1)
    near = (np.clip(at + k, 0, drawn.shape[1] - 1) for k in (-1, 0, 1))
    before, top, after = (np.take_along_axis(drawn, k, axis=1)[:, 0] for k in near)
    bend = 2.0 * top - before - after
    bends = inside[:, 0] & (bend > 0.0)
    rises = (after - before) ** 2 / (8.0 * np.where(bends, bend, 1.0))
    return np.where(bends, top + rises, top)  # type: ignore[no-any-return]


def measured(
    parameters: StructureParameters,
    cycles: tuple[float, float],
    samples: int = 0,
    history: int = 0,
    state: Any = None,
    engine: Mapping[str, Any] | None = None,
    observers: Mapping[str, Mapping[str, Any]] | None = None,
) -> dict[str, Any]:
    """Run a structure and return what is measured in its window.

    Parameters
    ----------
    parameters : StructureParameters
    cycles : (float, float)
        Cycles before the window, and in it.
    samples, history : int
        As for `Measured`.
    state : State, optional
        Where it starts.
    engine : mapping, optional
        `accuracy` and `max_events`.
    observers : mapping of str to settings, optional
        Observers that are to see the window as well.

    Returns
    -------
    dict of str to ndarray
        `RESULTS`, and `HISTORY` and what the observers write if asked for; missing but `status`
        where the run stopped early.
    """
    from damper.sweep.events import Started

    given = {name: DEFAULTS[name] for name in ("accuracy", "max_events")} | dict(engine or {})
    trajectory = Started(parameters, state, values={}, **given).trajectory
    periods, time = trajectory.start
    window = Window(periods + cycles[0], time, cycles[1])
    trajectory.skip(*Window(periods, time, cycles[0]).end(trajectory.cycle))
    seen = Measured(parameters, trajectory, window, samples, history)
    more, size = observed(trajectory, window, observers or {}, seen), parameters.units.size
    scaled = {v.name: a * size(v.units) if v.units in SI_UNITS else a for v, a in more}
    return seen.found() | scaled
