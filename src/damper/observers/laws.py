"""Laws that every run keeps, however extreme: how far off each it is.

The state at the end of each segment is read from the closed form and compared with the start of the
next one, so the laws of impact and continuity are tested on the log and not on what the event loop
reports of itself. Each model's own laws are in the module `laws` beside it.
"""

import math
from importlib import import_module

import numpy as np

from damper.engine.bodies import strength_on, weight_on
from damper.engine.compiled import compiled
from damper.engine.forcing import bound_of, rate_of
from damper.engine.impact import mean_of
from damper.engine.model import begin, count_masses, mass_ratio_at, read_segment, write_row
from damper.engine.segment import FLIGHT, IMPACT, RESTING, STICKING, TAIL
from damper.engine.trajectory import Trajectory
from damper.models.laws import (
    GAP,
    RATE,
    TERMS,
    Sample,
    begun,
    braked_by,
    contact_force,
    contact_speed,
    force_bound,
    free_mass,
    has_no_time,
    larger,
    mass_speed,
    rebound_of,
    sample,
    samples_in,
    tells_all,
    violation,
)
from damper.models.response import impact_loss, integrate_segment, prepare_tables, stored_energy
from damper.observers.common.base import Observer, Window, fields_of, record_type
from damper.observers.common.laws import LAW_NAMES, LAW_VARIABLES, SEGMENTS
from damper.parameters.models import ON_PRIMARY, models_of, room_of

#: Largest violation of each law in a run, what the energy balance needs, and how many segments.
_FOUND = record_type(
    *LAW_NAMES, "input", "input_size", "lost", "stored", "stored_last", "largest", "segments"
)


class Laws(Observer):
    """How far each law of the model is violated over the window, at worst.

    A violation is a difference of two sides of a law over the size of its terms, so roundoff is
    some 1e-16 to 1e-15; beyond 1e-12 a law is broken. A run without impacts has NaN for their laws.
    The window begins with the segment under way; the window of a run that stopped early ends where
    the run stopped.

    On a structure the laws are those of the mass, damping and stiffness matrices that were given,
    and the way of a free mass is the integral of its velocity. The balance of energy leaves out the
    closed rests of bursts, and is the worst of all moments.
    """

    models = (*ON_PRIMARY, "structure")
    variables = (*LAW_VARIABLES, SEGMENTS)

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run."""
        super().begin(run, trajectory, window)
        room = room_of(models_of(self._model)[0])
        laws = import_module(f"damper.models.{room}.laws")
        self._judge = None
        if room == "structure":
            self._judge = laws.StructureLaws(trajectory, LAW_NAMES)
            return
        self._tables = prepare_tables(self._model)
        self._found = np.zeros(1, _FOUND)
        for name in ("touch", "momentum", "restitution_law", "tensile_force"):
            self._found[name] = np.nan
        self._last = np.zeros(trajectory.columns)
        self._masses = np.zeros((3, count_masses(self._model), len((GAP, RATE, TERMS))))

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        if self._judge is not None:
            self._judge.observe(log)
            return
        _follow(self._model, self._tables, log, self._found, self._last, self._masses)

    def finish(self, finished: bool) -> None:
        """Write what was found, up to a stop too; nothing where the window was not reached."""
        found = _balanced(self._found) if self._judge is None else self._judge.found()
        if found["segments"]:
            self._put({name: found[name] for name in (*LAW_NAMES, "segments")})


def _balanced(records):
    """Violations by name, with that of the balance of energy."""
    # Plain numbers: NumPy's warn of infinite ones.
    found = dict(zip(fields_of(_FOUND), records[0].tolist(), strict=True))
    left = found["input"] - found["lost"] - (found["stored_last"] - found["stored"])
    size = found["input_size"] + found["lost"] + found["largest"]
    found["energy_balance"] = abs(left) / size if size > 0.0 else abs(left)
    return found


@compiled
def _follow(model, tables, log, records, last, masses):
    found = records[0]
    for index in range(len(log)):
        if not math.isfinite(np.sum(log[index])):
            found.not_finite += 1.0
        s = read_segment(model, log[index])
        if found.segments > 0.0:
            _compare(model, read_segment(model, last), s, masses[0], found)
        _sample(model, s, masses, found)
        _add_energies(model, tables, s, index == len(log) - 1, found)
        found.segments += 1.0
        write_row(model, last, s, s.duration)


@compiled
def _add_energies(model, tables, s, is_last, found):
    """Add the energies that a segment takes and loses; keep those stored at the run's ends."""
    part = integrate_segment(model, tables, s, 0.0, s.duration, math.inf)
    found.input += part.work + part.modulation
    # The work is at most this, however its parts cancel.
    way = math.sqrt(s.duration * max(part.speed_square, 0.0))
    way += s.duration * contact_speed(model, s)
    found.input_size += force_bound(model) * way + abs(part.modulation)
    on_mass = strength_on(model.mass) * bound_of(model.free.forcing, 0)
    if on_mass > 0.0:
        mass_ratio = mass_ratio_at(model, s.periods, s.time)
        if s.mode == FLIGHT:
            speed = mass_speed(model.mass, model.clearance, abs(s.x), abs(s.v), s.duration)
            way = s.duration * (abs(s.v) + abs(s.gap_rate) + speed)
        found.input_size += mass_ratio * on_mass * way
    lost = part.loss + part.support + part.friction
    found.lost += 2.0 * model.free.damping * part.speed_square + lost
    # The loss of an impact at the start of the first segment belongs to the time before the window.
    if s.cause == IMPACT and found.segments > 0.0:
        found.lost += impact_loss(model, s)
    for k in range(2):
        if (k == 0 and found.segments == 0.0) or (k == 1 and is_last):
            energy = stored_energy(model, s, 0.0 if k == 0 else s.duration)
            if k == 0:
                found.stored = energy
            else:
                found.stored_last = energy


@compiled
def _compare(model, last, s, ends, found):
    """Compare the end of one segment with the start of the next one."""
    passed = (s.periods - last.periods) * model.cycle + (s.time - last.time)
    found.clock = larger(found.clock, abs(passed - last.duration) / model.cycle)
    x, v = sample(model, last, begin(model, last), last.duration, ends)
    speeds = _speeds(model, last, x, v, ends)
    lengths = force_bound(model) + abs(x) + abs(last.x)
    # Events of one instant have a segment each; the first segment has the whole change.
    first = tells_all(model, last)
    for k in range(len(ends)):
        side, travel = begun(model, last, k).side, free_mass(model, s, k).travel
        if begun(model, s, k).side != side:
            ends[k, GAP], ends[k, RATE] = travel - ends[k, GAP], -ends[k, RATE]
            ends[k, TERMS] += travel
    jump = violation(s.x - x, lengths + abs(last.v) * last.duration)
    jump = larger(jump, violation((s.v_before if first else s.v) - v, speeds))
    change, any_hit = 0.0, False
    braked = braked_by(model, s, ends) if first else 0.0
    for k in range(len(ends)):
        b, gap, rate = begun(model, s, k), float(ends[k, GAP]), float(ends[k, RATE])
        gained, size = (s.v - v) - b.side * (b.rate - rate), lengths + ends[k, TERMS]
        change += free_mass(model, s, k).share * gained
        if first and b.is_hit:
            any_hit = True
            found.touch = larger(found.touch, violation(gap, size))
            rebound = rebound_of(model, k, b.side, -rate)
            if not (b.mode == TAIL and b.rate == 0.0 and has_no_time(model, s, k, rebound)):
                law = violation(b.rate - (rebound + b.side * braked), speeds)
                found.restitution_law = larger(found.restitution_law, law)
            continue
        if first and b.kick > 0.0:
            # It has been kicked off its wall by what the impacts alone do, and not for long.
            kick = b.side * (s.v - braked - v)
            if not has_no_time(model, s, k, kick):
                found.restitution_law = larger(found.restitution_law, violation(kick, speeds))
            law = violation(kick - b.kick, speeds)
            found.restitution_law = larger(found.restitution_law, law)
        jump = larger(jump, violation(b.gap - gap, size))
        # A mass that sticks is pressed on, also where it is released at once.
        if not (begun(model, last, k).mode == STICKING and b.rate == 0.0):
            jump = larger(jump, violation(gained, speeds))
    if any_hit:
        change = mean_of(mass_ratio_at(model, s.periods, s.time), s.v - v, change)
        found.momentum = larger(found.momentum, violation(change, speeds))
    else:
        jump = larger(jump, violation(s.v - v, speeds))
    found.continuity = larger(found.continuity, jump)


@compiled
def _speeds(model, last, x, v, ends):
    """Size of the terms of a velocity at a segment's end.

    They are the velocities at both ends, and the share of springs, forces and dashpots.
    """
    size = abs(last.v) + abs(v) + (force_bound(model) + abs(last.x)) * min(last.duration, 1.0)
    size += abs(last.v) * min(2.0 * model.free.damping * last.duration, 1.0)
    for k in range(len(ends)):
        mass = free_mass(model, last, k)
        size += abs(ends[k, RATE]) + abs(begun(model, last, k).rate)
        size += mass_speed(mass.body, mass.clearance, abs(x), abs(last.v), last.duration)
    return size


@compiled
def _sample(model, s, masses, found):
    """Look at samples of a segment: beyond both walls, at contact forces, at sizes of energies."""
    start = begin(model, s)
    bounces, flies, holds = False, False, False
    for k in range(masses.shape[1]):
        mode = begun(model, s, k).mode
        bounces = bounces or mode == TAIL
        flies = flies or mode in (FLIGHT, TAIL)
        holds = holds or mode in (STICKING, RESTING)
    # A jump of the force may end it as it begins.
    holds = holds and s.duration > 0.0 and not bounces
    # Without walls and forces to look at one in the middle: a value that is not finite stays so.
    samples = 1
    if flies or holds:
        samples = samples_in(model.free.rate, rate_of(model.free.forcing), s.duration)
    before, now = 0.0, 0.0
    x, v = sample(model, s, start, 0.0, masses[0])
    found.largest = larger(found.largest, _energy_size(model, s, x, v, masses[0]))
    for index in range(samples + 1):
        part = (index + 0.5) / samples
        # Denser towards both ends, where the walls are.
        now = s.duration * (part * part * (3.0 - 2.0 * part)) if index < samples else s.duration
        x, v = sample(model, s, start, now, masses[1])
        if not math.isfinite(x + v + np.sum(masses[1])):
            found.not_finite += 1.0
            break
        _look(model, s, x, masses[1], found)
        found.largest = larger(found.largest, _energy_size(model, s, x, v, masses[1]))
        for k in range(masses.shape[1]):
            b, rate, later = begun(model, s, k), masses[0, k, RATE], masses[1, k, RATE]
            if rate * later < 0.0 and b.mode in (FLIGHT, TAIL):
                # Where the gap turns between two samples.
                turn = before + (now - before) * (rate / (rate - later))
                at, _ = sample(model, s, start, turn, masses[2])
                _look(model, s, at, masses[2], found)
            if holds and b.mode in (STICKING, RESTING) and b.side != 0.0:
                here = Sample(x, v, masses[1, k, GAP], later, masses[1, k, TERMS])
                force, size = contact_force(model, s, k, now, here)
                found.tensile_force = larger(found.tensile_force, violation(min(force, 0.0), size))
            masses[0, k, RATE] = later
        before = now


@compiled
def _look(model, s, x, masses, found):
    """Take the depths of masses beyond either wall, over the sizes of the lengths there."""
    for k in range(len(masses)):
        b, gap = begun(model, s, k), float(masses[k, GAP])
        depth = max(-gap, gap - free_mass(model, s, k).travel, 0.0)
        # Compliant walls let a mass in.
        if b.gap >= 0.0 and b.mode in (FLIGHT, TAIL):
            size = force_bound(model) + abs(x) + masses[k, TERMS]
            found.penetration = larger(found.penetration, violation(depth, size))


@compiled
def _energy_size(model, s, x, v, masses):
    """Sizes of the stored energy's terms."""
    energy = 0.5 * (x * x + v * v)
    for k in range(len(masses)):
        mass, rate = free_mass(model, s, k), float(masses[k, RATE])
        y = abs(x) + mass.clearance
        # The free mass's velocity is a difference, with the roundoff of its terms.
        own = abs(v - begun(model, s, k).side * rate) * (abs(v) + abs(rate))
        own += abs(weight_on(mass.body)) * y + 0.5 * mass.body.stiffness * y * y
        energy += mass.ratio * own
    return energy
