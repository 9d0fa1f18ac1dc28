"""Measures of a run on a structure: response at each point, energies, impacts.

Integrals are Gauss-Legendre sums over parts of segments that resolve the fastest motion to
roundoff (`damper.engine.quadrature`), and peaks are those of the polynomials through the same
nodes. Nothing depends on a step of sampling.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from damper.engine.compiled import compiled, plain
from damper.engine.forcing import derivative_of, phase_at, rate_of
from damper.engine.loop import FINISHED
from damper.engine.model import read_segment
from damper.engine.quadrature import FEWEST, NODES, REACH, WEIGHTS, nodes_for
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

#: Largest reach (rate times length) of a part: that of 12 nodes.
_REACH = float(REACH[12 - FEWEST])
#: Points between nodes at which a polynomial is taken, for each node.
_FINE = 4
#: Reading one row takes less time than to compile for it.
_read, _part_within = plain(read_segment), plain(part_within)


class _Body(NamedTuple):
    """A free mass, in SI units."""

    box: np.ndarray
    mass: float
    stiffness: float
    damping: float
    gravity: float
    friction: float
    """Its acceleration while it slides."""
    carried: float
    """Its acceleration by the shape of the force, where that moves the base."""


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
        self._bodies = [
            _Body(
                s.boxes[one.box],
                one.mass,
                one.tie_stiffness,
                one.tie_damping,
                one.gravity,
                one.friction,
                drive.share * size * s.base_shares[one.box],
            )
            for one in p.each
        ]
        self._boxes = np.array([b.box for b in self._bodies])
        self._dampings = np.array([b.damping for b in self._bodies])
        self._rubs = np.array([b.mass * b.friction for b in self._bodies])
        self._carried = np.array([b.mass * b.carried for b in self._bodies])
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
        model, cycle = self._trajectory.model, self._trajectory.cycle
        for row in log:
            segment = _read(model, row)
            start, low, high = _part_within(segment, cycle, self._window)
            if high < low:
                continue
            if not self._stored:
                self._stored.append(self._energy_at(row, low))
                if start >= 0.0:
                    self._stored[0] += segment.loss * self._units.energy
            if start >= 0.0 and row[CAUSE] == IMPACT:
                body = int(segment.body)
                self._speeds[body].append(segment.speed * self._units.speed)
                self._lost[body] += segment.loss * self._units.energy
            modes = segment.bodies[:, MODE]
            if start >= 0.0 and row[DURATION] > 0.0 and (modes == TAIL).any():
                body, lost = int(segment.body), self._lost_in_tail(row, modes != FLIGHT)
                rubbed = lost * rubbed_part(bounce_in(model, segment.bodies, body))
                self._lost[body] += lost - rubbed
                self._rubbed[body] += rubbed
            self._end = self._energy_at(row, high)
            self._sample(row, start, low, high)
            for at, upto in self._parts(start, low, high):
                self._integrate(row, segment.bodies, (start, at, upto))

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

    def _states(self, row: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, ...]:
        """Displacements and velocities of coordinates and free masses, in SI units."""
        units = self._units
        x, v, y, u = self._trajectory.states_in(row, times)
        return x * units.length, v * units.speed, y * units.length, u * units.speed

    def _energy_at(self, row: np.ndarray, tau: float) -> float:
        x, v, y, u = (one[0] for one in self._states(row, np.array([tau])))
        energy = float(self._structure.mode_energies(x, v).sum())
        for k, b in enumerate(self._bodies):
            apart = y[k] - b.box @ x
            energy += (
                0.5 * (b.mass * u[k] ** 2 + b.stiffness * apart**2) + b.mass * b.gravity * y[k]
            )
        return energy

    def _lost_in_tail(self, row: np.ndarray, sticks: np.ndarray) -> float:
        """Energy of the motion relative to the boxes, all of which a closed burst takes."""
        _, v, _, u = (one[0] for one in self._states(row, np.zeros(1)))
        those = [b for b, joins in zip(self._bodies, sticks, strict=True) if joins]
        boxes = np.array([b.box for b in those])
        rates = u[sticks] - boxes @ v
        yields = boxes @ np.linalg.solve(self._structure.mass, boxes.T)
        yields += np.diag([1.0 / b.mass for b in those])
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

    def _integrate(
        self, row: np.ndarray, bodies: np.ndarray, part: tuple[float, float, float]
    ) -> None:
        """Add a part of a segment, in one cycle of the window, to integrals and peaks."""
        start, low, high = part
        # The integrands are products of two motions.
        pieces = math.ceil(2.0 * self._rate * (high - low) / _REACH)
        step = (high - low) / pieces
        number = nodes_for(2.0 * self._rate * step)
        nodes, weights = NODES[number - FEWEST, :number], WEIGHTS[number - FEWEST, :number]
        taus = (low + step * (np.arange(pieces)[:, None] + nodes)).ravel()
        x, v, y, u = self._states(row, taus)
        force = np.empty(len(taus))
        _write_force(self._forcing, float(row[PERIODS]), float(row[TIME]), taus, force)
        joined, ways = bodies[:, MODE] != FLIGHT, bodies[:, SLIP_DIRECTION]
        moved = self._forced(joined, self._rubs * ways, force, (x, v, y, u))
        weigh = np.tile(weights, pieces) * step * self._units.time
        s, sums = self._structure, self._sums
        drags = (v @ self._to_modes.T) * (v @ s.damping @ s.shapes)
        sums["work"] += float(weigh @ (force * (v @ self._push + u @ self._carried)))
        sums["modes"] = sums["modes"] + weigh @ drags
        sums["energy"] = sums["energy"] + weigh @ s.mode_energies(x, v)
        rates = u - v @ self._boxes.T
        sums["ties"] = sums["ties"] + weigh @ (rates**2) * self._dampings
        sums["friction"] = sums["friction"] + weigh @ rates * (self._rubs * ways)
        fine, drawn = _finer(number), []
        for (name, _), values in zip(RESULTS_OF_POINTS, (x, v, moved), strict=True):
            there = values @ self._points.T
            sums[name] = sums[name] + weigh @ there**2
            drawn.append(fine @ there.reshape(pieces, number, -1))
        # At once: a call takes longer than its numbers.
        signs = [*drawn, *(-one for one in drawn)]
        above, below = _highest(np.concatenate(signs, axis=-1)).reshape(2, *self._peaks.shape)
        self._peaks = np.maximum(self._peaks, np.maximum(above, below))
        cycle = math.floor((start + 0.5 * (low + high)) / self._trajectory.cycle)
        if cycle < self._ranges.shape[1]:
            ends = np.array([above[0], below[0]])
            self._ranges[:, cycle] = np.maximum(self._ranges[:, cycle], ends)

    def _forced(
        self,
        joined: np.ndarray,
        rubs: np.ndarray,
        force: np.ndarray,
        state: tuple[np.ndarray, ...],
    ) -> np.ndarray:
        """Accelerations of the coordinates, with the masses that are joined as a part of them.

        `rubs` are the forces of friction on the boxes.
        """
        (x, v, y, u), s = state, self._structure
        mass = s.mass.copy()
        acting = np.outer(force, self._push) - v @ s.damping - x @ s.stiffness
        for k, b in enumerate(self._bodies):
            if joined[k]:
                mass += b.mass * np.outer(b.box, b.box)
                acting += np.outer(b.mass * (b.carried * force - b.gravity), b.box)
            else:
                tie = b.stiffness * (y[:, k] - x @ b.box) + b.damping * (u[:, k] - v @ b.box)
                acting += np.outer(tie + rubs[k], b.box)
        return np.linalg.solve(mass, acting.T).T


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
def _write_force(forcing, periods, time, taus, found):
    for k in range(len(taus)):
        found[k] = derivative_of(forcing, phase_at(forcing, periods, time + taus[k]), 0)


@lru_cache(maxsize=32)
def _finer(number: int) -> np.ndarray:
    """Matrix from values at the nodes of a rule to those at equal steps, both ends included."""
    nodes = 2.0 * NODES[number - FEWEST, :number] - 1.0
    fine = np.linspace(-1.0, 1.0, _FINE * number + 1)
    degree = number - 1
    return np.polynomial.legendre.legvander(fine, degree) @ np.linalg.inv(
        np.polynomial.legendre.legvander(nodes, degree)
    )


def _highest(drawn: np.ndarray) -> np.ndarray:
    """Largest value of each column over parts and points, by a parabola about it."""
    parts, points, columns = drawn.shape
    whole = drawn.reshape(parts * points, columns)
    at, every = whole.argmax(axis=0), np.arange(columns)
    top = whole[at, every]
    inside = np.clip(at % points, 1, points - 2) == at % points
    before, after = whole[at - inside, every], whole[np.minimum(at + inside, len(whole) - 1), every]
    bend = 2.0 * top - before - after
    found = top + np.where(
        bend > 0.0, (after - before) ** 2 / (8.0 * np.where(bend > 0.0, bend, 1.0)), 0.0
    )
    return np.where(inside, found, top)  # type: ignore[no-any-return]


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
