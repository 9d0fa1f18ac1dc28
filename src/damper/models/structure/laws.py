"""The laws of a run on a structure, for the observer `laws`, in the structure's own coordinates.

Mass, damping and stiffness are the matrices that were given: nothing here knows the modes by which
the engine finds events. The motion between events is read from the run.
"""

import math
from collections.abc import Iterable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre

from damper.engine.compiled import compiled, plain
from damper.engine.forcing import bound_of, derivative_of, phase_at, rate_of, turn_over, turned
from damper.engine.impact import restitution_at
from damper.engine.model import read_segment
from damper.engine.quadrature import FEWEST, NODES, REACH, WEIGHTS, nodes_for
from damper.engine.segment import FLIGHT, IMPACT, NOTHING, RESTING, STICKING, TAIL
from damper.engine.trajectory import Trajectory
from damper.models.forces import drive_of
from damper.models.friction import SLIP_DIRECTION
from damper.models.many import CAUSE, MODE, SIDE
from damper.models.structure.constants import HEAD, SYSTEM_RATE, mass_in
from damper.models.wall_laws import law_of

#: Largest reach of a part of a segment: that of 12 nodes.
_REACH = float(REACH[12 - FEWEST])


class _State(NamedTuple):
    """Displacements and velocities of coordinates and free masses, a row for each time."""

    x: np.ndarray
    v: np.ndarray
    y: np.ndarray
    u: np.ndarray


class _Part(NamedTuple):
    """A segment: its masses, and how all move from its start to its end."""

    row: np.ndarray
    segment: Any
    modes: np.ndarray
    sides: np.ndarray
    hits: np.ndarray
    """Whether an impact of the mass begins it."""
    tells_all: bool
    """Whether the log has told of all events at its start."""
    taus: np.ndarray
    weights: np.ndarray
    """Of Gauss sums over these times; 0 at both ends."""
    states: _State


class StructureLaws:
    """Follow the log of a run, a piece at a time.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    names : iterable of str
        Names of the laws.
    """

    def __init__(self, trajectory: Trajectory, names: Iterable[str]) -> None:
        p = trajectory.parameters
        s, each, drive = p.structure, p.each, drive_of(p)
        self._trajectory, self._model, self._forcing = trajectory, trajectory.model, drive.forcing
        self._mass, self._damping, self._stiffness = s.mass, s.damping, s.stiffness
        place = s.base if drive.share else s.force
        push = np.zeros(len(s.mass)) if place is None else drive.amplitude * place
        self._push = s.mass @ push if drive.share else push
        self._boxes = np.array([s.boxes[one.box] for one in each])
        names_of = "mass", "clearance", "gravity", "tie_stiffness", "tie_damping", "friction"
        self._free, self._clearances, self._gravity, self._ties, self._dashpots, self._rubs = (
            np.array([getattr(one, name) for one in each]) for name in names_of
        )
        shares = np.array([s.base_shares[one.box] for one in each])
        self._carried = drive.share * drive.amplitude * shares
        self._yields = np.sqrt(np.einsum("ki,ik->k", self._boxes, self._over_mass(self._boxes.T)))
        self._strength = plain(bound_of)(drive.forcing, 0) * self._norm(self._push)
        self._rate = float(self._model.flying[HEAD, SYSTEM_RATE]) + plain(rate_of)(drive.forcing)
        self._found = dict.fromkeys((*names, "segments"), 0.0)
        for name in ("touch", "momentum", "restitution_law", "tensile_force"):
            self._found[name] = math.nan
        #: Residual of the balance of energy, and its largest size so far; energy put in and lost;
        #: the largest stored energy.
        self._lacks, self._off, self._turnover, self._largest = 0.0, 0.0, 0.0, 0.0
        self._last: _Part | None = None

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        for row in log:
            if not np.isfinite(row).all():
                self._found["not_finite"] += 1.0
            part = self._part(row.copy())
            if not all(np.isfinite(one).all() for one in part.states):
                self._found["not_finite"] += 1.0
            elif self._last is not None:
                self._compare(self._last, part)
            self._look(part)
            self._press(part)
            self._balance(part)
            self._off = max(self._off, abs(self._lacks))
            self._last = part
            self._found["segments"] += 1.0

    def found(self) -> dict[str, float]:
        """How far each law is violated at worst, and how many segments there were."""
        size = self._turnover + self._largest
        return self._found | {"energy_balance": self._off / size if size > 0.0 else self._off}

    def _worse(self, name: str, difference: Any, size: Any) -> None:
        """Keep the largest of differences over the sizes of their terms."""
        off, size = np.broadcast_arrays(np.abs(difference), size)
        if off.size:
            share = np.divide(off, size, out=np.where(off > 0.0, np.inf, 0.0), where=size > 0.0)
            self._found[name] = float(np.nanmax([self._found[name], share.max()]))

    def _over_mass(self, forces: np.ndarray) -> np.ndarray:
        return np.linalg.solve(self._mass, forces)

    def _norm(self, forces: np.ndarray) -> float:
        """Size of the accelerations by forces on the coordinates, or by impulses of velocities."""
        return math.sqrt(max(float(forces @ self._over_mass(forces)), 0.0))

    def _part(self, row: np.ndarray) -> _Part:
        s = plain(read_segment)(self._model, row)
        hits = s.bodies[:, CAUSE] == IMPACT
        if s.cause == IMPACT:
            hits[int(s.body)] = True
        taus, weights, pieces = np.array([0.0, s.duration]), np.zeros(2), 0
        if s.duration > 0.0:
            pieces = math.ceil(2.0 * self._rate * s.duration / _REACH)
            step = s.duration / pieces
            number = nodes_for(2.0 * self._rate * step)
            nodes = step * (np.arange(pieces)[:, None] + NODES[number - FEWEST, :number])
            taus = np.concatenate([taus[:1], nodes.ravel(), taus[1:]])
            weights = step * np.tile(WEIGHTS[number - FEWEST, :number], pieces)
            weights = np.concatenate([[0.0], weights, [0.0]])
        states = _State(*self._trajectory.states_in(row, taus))
        flies = s.bodies[:, MODE] == FLIGHT
        if pieces and not (s.bodies[:, MODE] == TAIL).any():
            # The run reports no gap below 0; the integral of the velocity may pass a wall.
            rates = (states.u - states.v @ self._boxes.T)[1:-1].reshape(pieces, number, -1)
            ends = step * np.cumsum(
                np.einsum("i,pik->pk", WEIGHTS[number - FEWEST, :number], rates), axis=0
            )
            begun = np.concatenate([np.zeros((1, ends.shape[1])), ends[:-1]])
            ways = begun[:, None, :] + step * np.einsum("ij,pjk->pik", _ways(number), rates)
            ways = np.concatenate([begun[:1], ways.reshape(len(taus) - 2, -1), ends[-1:]])
            boxes = states.x @ self._boxes.T
            moved = boxes + (states.y[0] - boxes[0]) + ways
            states = states._replace(y=np.where(flies, moved, states.y))
        modes, sides = s.bodies[:, MODE], s.bodies[:, SIDE]
        told = not (s.bodies[:, CAUSE] != NOTHING).any()
        return _Part(row, s, modes, sides, hits, told, taus, weights, states)

    def _energies(self, state: _State) -> np.ndarray:
        """Stored energy at each time, and the sizes of its terms."""
        x, v, y, u = state
        apart = y - x @ self._boxes.T
        energy = 0.5 * (np.einsum("ti,ij,tj->t", v, self._mass, v) + u**2 @ self._free)
        energy += 0.5 * (np.einsum("ti,ij,tj->t", x, self._stiffness, x) + apart**2 @ self._ties)
        height = y * self._free * self._gravity
        return np.array([energy + height.sum(axis=1), energy + np.abs(height).sum(axis=1)])

    def _compare(self, a: _Part, b: _Part) -> None:
        """Compare the end of one segment with the start of the next one."""
        found, s, cycle = self._found, b.segment, self._trajectory.cycle
        passed = (s.periods - a.segment.periods) * cycle + (s.time - a.segment.time)
        found["clock"] = max(found["clock"], abs(passed - a.segment.duration) / cycle)
        before, after = (_State(*(one[k] for one in p.states)) for p, k in ((a, -1), (b, 0)))
        both = _State(*(np.array(pair) for pair in zip(before, after, strict=True)))
        energies = self._energies(both)
        speed = math.sqrt(2.0 * energies[1].max()) + self._strength * min(a.segment.duration, 1.0)
        place = speed * min(a.segment.duration, 1.0) + sum(
            math.sqrt(float(x @ self._mass @ x)) for x in (before.x, after.x)
        )
        lengths = self._yields * place + self._clearances + np.abs(before.y)
        lengths += np.abs(before.u) * a.segment.duration
        speeds = self._yields * speed + np.abs(before.u)
        self._worse("continuity", self._norm(self._mass @ (after.x - before.x)), place)
        self._worse("continuity", after.y - before.y, lengths)
        hits = b.hits if a.tells_all else np.zeros_like(b.hits)
        # Friction gives no impulse.
        touch = hits | np.isin(a.modes, (STICKING, TAIL)) | (b.modes == TAIL)
        gained = np.where(touch, self._free * (after.u - before.u), 0.0)
        left = self._mass @ (after.v - before.v) + gained @ self._boxes
        self._worse("momentum" if hits.any() else "continuity", self._norm(left), speed)
        self._worse("continuity", (after.u - before.u)[~touch], speeds[~touch])
        rates, rebounds = (-b.sides * (one.u - self._boxes @ one.v) for one in (before, after))
        gaps = self._clearances - b.sides * (before.y - self._boxes @ before.x)
        self._worse("touch", gaps[hits], lengths[hits])
        for k in np.flatnonzero(hits):
            m = plain(mass_in)(self._model.masses, int(k))
            law = plain(law_of)(self._model, m, float(b.sides[k]))
            wanted = plain(restitution_at)(law, -float(rates[k])) * -rates[k]
            rests = b.modes[k] == TAIL and abs(rebounds[k]) < wanted
            if not (rests and wanted <= self._model.tolerance * self._parting(int(k), before)):
                self._worse("restitution_law", rebounds[k] - wanted, speeds[k])
        if hits.any():
            others = touch & ~hits
            kept = np.where(b.modes == FLIGHT, np.minimum(rebounds, 0.0), rebounds)
            self._worse("restitution_law", kept[others], speeds[others])
            pulls = np.maximum(b.sides * gained / self._free, 0.0)
            self._worse("restitution_law", pulls[touch], speeds[touch])
            self._turnover += s.loss
        # No impact gives energy.
        self._lacks += energies[0, 0] - energies[0, 1] - max(s.loss, 0.0)

    def _parting(self, k: int, at: _State) -> float:
        """Size of the acceleration of a mass off its wall."""
        forces = self._stiffness @ at.x, self._damping @ at.v, self._boxes.T @ self._tied(at)
        size = self._yields[k] * (self._strength + sum(map(self._norm, forces)))
        return float(size + self._gravity[k] + abs(self._tied(at)[k]) / self._free[k])

    def _tied(self, at: _State) -> np.ndarray:
        """Force of each tie on the box."""
        rate = at.u - at.v @ self._boxes.T
        return self._ties * (at.y - at.x @ self._boxes.T) + self._dashpots * rate

    def _look(self, part: _Part) -> None:
        """Look for masses beyond their walls, at the samples and where a gap turns between two."""
        flies = part.modes == FLIGHT
        if part.segment.duration == 0.0 or (part.modes == TAIL).any():
            return
        taus, (x, v, y, u) = part.taus, part.states
        rates = u - v @ self._boxes.T
        apart = y - x @ self._boxes.T
        sizes = self._clearances + np.abs(y) + np.abs(x) @ np.abs(self._boxes).T
        sizes += np.abs(u[0]) * part.segment.duration
        deep = np.maximum(np.abs(apart) - self._clearances, 0.0)
        self._worse("penetration", deep[:, flies], sizes[:, flies])
        nodes, weights = NODES[-1, : len(NODES[-1])], WEIGHTS[-1, : len(NODES[-1])]
        for at, k in zip(*np.nonzero((rates[:-1] * rates[1:] < 0.0) & flies), strict=True):
            way = (taus[at + 1] - taus[at]) * rates[at, k] / (rates[at, k] - rates[at + 1, k])
            _, v, _, u = self._trajectory.states_in(part.row, taus[at] + way * nodes)
            turned_at = apart[at, k] + way * weights @ (u - v @ self._boxes.T)[:, k]
            self._worse("penetration", max(abs(turned_at) - self._clearances[k], 0.0), sizes[at, k])

    def _forces(self, part: _Part) -> np.ndarray:
        """What drives the structure, at each time; at the end that before a jump."""
        found = np.empty(len(part.taus))
        _write_force(self._forcing, part.segment.periods, part.segment.time, part.taus, found)
        return found

    def _press(self, part: _Part) -> None:
        """Look for masses that stick to a wall which would have to pull them.

        Friction helps a wall, and alone holds a mass off the walls.
        """
        sticks, (x, v, _, _) = np.isin(part.modes, (STICKING, RESTING)), part.states
        if part.segment.duration == 0.0 or not sticks.any() or (part.modes == TAIL).any():
            return
        force, ties = self._forces(part), self._tied(part.states)
        own = np.outer(force, self._carried) - self._gravity
        inner = v @ self._damping + x @ self._stiffness
        acting = np.outer(force, self._push) - inner + (ties * ~sticks) @ self._boxes
        acting += (own * self._free * sticks) @ self._boxes
        acting += (self._free * self._rubs * part.segment.bodies[:, SLIP_DIRECTION]) @ self._boxes
        heavier = self._mass + (self._boxes.T * (self._free * sticks)) @ self._boxes
        moved = np.linalg.solve(heavier, acting.T).T @ self._boxes.T
        # The tie pulls the mass as it pulls the box, the other way.
        pressed = -part.sides * (moved - own + ties / self._free)
        pressed = np.where(part.modes == RESTING, -np.abs(pressed), pressed) + self._rubs
        sizes = np.array([self._norm(one) for one in inner])[:, None] + self._strength
        sizes = self._yields * sizes + np.abs(own) + np.abs(ties) / self._free + self._rubs
        self._worse("tensile_force", np.minimum(pressed, 0.0)[:, sticks], sizes[:, sticks])

    def _balance(self, part: _Part) -> None:
        """Add what is put in and lost in a segment; the closed rest of a burst is left out."""
        energies, (_, v, _, u) = self._energies(part.states), part.states
        self._largest = max(self._largest, float(energies[1].max()))
        if part.segment.duration == 0.0 or (part.modes == TAIL).any():
            return
        rates = u - v @ self._boxes.T
        drag = np.einsum("ti,ij,tj->t", v, self._damping, v) + rates**2 @ self._dashpots
        drag += rates @ (self._free * self._rubs * part.segment.bodies[:, SLIP_DIRECTION])
        work = self._forces(part) * (v @ self._push + u @ (self._free * self._carried))
        put, lost = float(part.weights @ work), float(part.weights @ drag)
        self._lacks += put - lost - float(energies[0, -1] - energies[0, 0])
        self._turnover += float(part.weights @ np.abs(work)) + lost


@lru_cache(maxsize=32)
def _ways(number: int) -> np.ndarray:
    """Matrix from values at the nodes of a rule on [0, 1] to their integrals up to each node."""
    nodes, each = 2.0 * NODES[number - FEWEST, :number] - 1.0, np.eye(number)
    integrals = np.array([legendre.legval(nodes, legendre.legint(one, lbnd=-1)) for one in each])
    return 0.5 * integrals.T @ np.linalg.inv(legendre.legvander(nodes, number - 1))


@compiled
def _write_force(forcing, periods, time, taus, found):
    start = phase_at(forcing, periods, time)
    for k in range(len(taus)):
        phase = turned(forcing, start, turn_over(forcing, float(taus[k])))
        found[k] = derivative_of(forcing, phase, 0)
