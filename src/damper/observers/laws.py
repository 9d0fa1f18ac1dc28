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
from damper.engine.impact import inertia_of, law_at, mean_of, restitution_at
from damper.engine.model import begin, mass_ratio_at, motion, read_segment
from damper.engine.segment import (
    COLUMNS,
    CONTACT,
    FLIGHT,
    IMPACT,
    RESTING,
    STICKING,
    TAIL,
    segment_at,
    write_segment,
)
from damper.engine.trajectory import Trajectory
from damper.models.flights import travel_of
from damper.models.laws import (
    FEWEST_SAMPLES,
    SAMPLES,
    SHORT,
    Sample,
    compare_masses,
    contact_force,
    contact_speed,
    flight_at,
    force_bound,
    larger,
    mass_speed,
    sample_masses,
    samples_in,
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


_SAMPLE = record_type(*Sample._fields)


class Laws(Observer):
    """How far each law of the model is violated over the window, at worst.

    A violation is a difference of two sides of a law over the size of its terms, so roundoff is
    some 1e-16 to 1e-15; beyond 1e-12 a law is broken. A run without impacts has NaN for their laws.
    The window begins with the segment under way; the window of a run that stopped early ends where
    the run stopped.
    """

    models = ON_PRIMARY
    variables = (*LAW_VARIABLES, SEGMENTS)

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run."""
        super().begin(run, trajectory, window)
        room = room_of(models_of(self._model)[0])
        import_module(f"damper.models.{room}.laws")
        self._tables = prepare_tables(self._model)
        self._found = np.zeros(1, _FOUND)
        for name in ("touch", "momentum", "restitution_law", "tensile_force"):
            self._found[name] = np.nan
        self._several = trajectory.columns > COLUMNS
        self._last = np.zeros(trajectory.columns)
        self._end = np.zeros(1, _SAMPLE)

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        if self._several:
            _follow_several(self._model, self._tables, log, self._found, self._last)
            return
        _follow(self._model, self._tables, log, self._found, self._last, self._end)

    def finish(self, finished: bool) -> None:
        """Write what was found, up to a stop too; nothing where the window was not reached."""
        # Plain numbers: NumPy's warn of infinite ones.
        found = dict(zip(fields_of(_FOUND), self._found[0].tolist(), strict=True))
        if not found["segments"]:
            return
        left = found["input"] - found["lost"] - (found["stored_last"] - found["stored"])
        size = found["input_size"] + found["lost"] + found["largest"]
        found["energy_balance"] = abs(left) / size if size > 0.0 else abs(left)
        self._put({name: found[name] for name in (*LAW_NAMES, "segments")})


@compiled
def _follow(model, tables, log, records, last, ends):
    found = records[0]
    end = ends[0]
    at = Sample(end.x, end.v, end.gap, end.rate, end.terms)
    for index in range(len(log)):
        for column in range(COLUMNS):
            if not math.isfinite(log[index, column]):
                found.not_finite += 1.0
                break
        s = segment_at(log[index])
        if found.segments > 0.0:
            _compare(model, segment_at(last), at, s, found)
        if s.mode == FLIGHT and s.gap >= 0.0:
            at = _sample_flight(model, s, found)
        else:
            at = _sample_contact(model, s, found)
        _add_energies(model, tables, s, index == len(log) - 1, found)
        mass_ratio = inertia_of(mass_ratio_at(model, s.periods, s.time))
        last_size = _kinetic_size(mass_ratio, at.v, at.rate, at.v - s.side * at.rate)
        found.largest = larger(found.largest, last_size)
        found.segments += 1.0
        write_segment(last, s, s.duration)
    end.x = at.x
    end.v = at.v
    end.gap = at.gap
    end.rate = at.rate
    end.terms = at.terms


@compiled
def _follow_several(model, tables, log, records, last):
    found = records[0]
    for index in range(len(log)):
        if not np.all(np.isfinite(log[index])):
            found.not_finite += 1.0
        s = read_segment(model, log[index])
        if found.segments > 0.0:
            before = read_segment(model, last)
            passed = (s.periods - before.periods) * model.cycle + (s.time - before.time)
            found.clock = larger(found.clock, abs(passed - before.duration) / model.cycle)
            compare_masses(model, before, s, found)
        sample_masses(model, s, found)
        _add_energies(model, tables, s, index == len(log) - 1, found)
        found.segments += 1.0
        last[:] = log[index]


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
    found.largest = max(found.largest, _energy_size(model, s))
    for k in range(2):
        if (k == 0 and found.segments == 0.0) or (k == 1 and is_last):
            energy = stored_energy(model, s, 0.0 if k == 0 else s.duration)
            if k == 0:
                found.stored = energy
            else:
                found.stored_last = energy


@compiled
def _compare(model, last, end, s, found):
    """Compare the end of one segment with the start of the next one."""
    passed = (s.periods - last.periods) * model.cycle + (s.time - last.time)
    found.clock = larger(found.clock, abs(passed - last.duration) / model.cycle)
    gap = end.gap
    rate = end.rate
    force = force_bound(model)
    size = end.terms + force + abs(end.x)
    if s.side != last.side:
        gap = travel_of(model) - gap
        rate = -rate
        size += travel_of(model)
    # Terms of a velocity: the velocity at the start, and the share of spring, force and dashpot.
    added = (force + abs(last.x)) * min(last.duration, 1.0)
    added += abs(last.v) * min(2.0 * model.free.damping * last.duration, 1.0)
    added += mass_speed(model.mass, model.clearance, abs(end.x), abs(last.v), last.duration)
    speeds = abs(last.v) + abs(last.gap_rate) + abs(end.v) + abs(rate) + added
    jump = larger(violation(s.x - end.x, size), violation(s.v_before - end.v, speeds))
    if s.cause == IMPACT and s.mode != CONTACT:
        found.touch = larger(found.touch, violation(gap, size))
        rebound = -restitution_at(law_at(model.law, s.side), -rate) * rate
        law = violation(s.gap_rate - rebound, abs(last.gap_rate) + abs(rate) + added)
        found.restitution_law = larger(found.restitution_law, law)
        mass_ratio = mass_ratio_at(model, s.periods, s.time)
        # The free mass's velocity is v - side * rate, from the new segment's wall on both sides.
        of_free = (s.v - end.v) - s.side * (s.gap_rate - rate)
        momentum = violation(mean_of(mass_ratio, s.v - end.v, of_free), speeds)
        found.momentum = larger(found.momentum, momentum)
    else:
        jump = larger(jump, violation(s.gap - gap, size))
        jump = larger(jump, violation(s.v - end.v, speeds))
        jump = larger(jump, violation(s.gap_rate - rate, speeds))
    found.continuity = larger(found.continuity, jump)


@compiled
def _sample_flight(model, s, found):
    """Look beyond both walls at samples of a flight, at its end, and where the gap turns between.

    Returns the sample at its end.
    """
    start = begin(model, s)
    forcing_rate = rate_of(model.free.forcing)
    samples = samples_in(model.free.rate, forcing_rate, s.duration)
    tau = 0.0
    rate = s.gap_rate
    depth = 0.0
    end = Sample(s.x, s.v, s.gap, s.gap_rate, s.gap)
    # Where the gap turns between two samples, to look there too.
    turn = -1.0
    k = 0
    while k <= samples or turn >= 0.0:
        part = (k + 0.5) / samples
        # Denser towards both ends, where the walls are.
        now = s.duration * (part * part * (3.0 - 2.0 * part)) if k < samples else s.duration
        at = flight_at(model, s, start, turn if turn >= 0.0 else now)
        depth = larger(depth, _depth(model, at))
        if turn >= 0.0:
            turn = -1.0
            continue
        end = at
        if not math.isfinite(at.gap + at.rate + at.x):
            found.not_finite += 1.0
            break
        if rate * at.rate < 0.0:
            turn = tau + (now - tau) * (rate / (rate - at.rate))
        tau = now
        rate = at.rate
        k += 1
    found.penetration = larger(found.penetration, depth)
    return end


@compiled
def _depth(model, at):
    """Depth beyond either wall, over the size of the lengths there; 0 between them."""
    depth = max(-at.gap, at.gap - travel_of(model))
    return depth / (force_bound(model) + abs(at.x) + at.terms) if depth > 0.0 else 0.0


@compiled
def _sample_contact(model, s, found):
    """Look whether everything is finite, and whether the contact force is tensile; as above."""
    # A jump of the force may end it as it begins.
    sticks = s.duration > 0.0 and ((s.mode == STICKING and s.side != 0.0) or s.mode == RESTING)
    if s.mode == TAIL and s.duration > 0.0:
        # Its first bounce rises highest.
        half = 0.5 * (1.0 - restitution_at(law_at(model.law, s.side), 0.0)) * s.completion
        x, v, gap, rate = motion(model, s, min(half, s.duration))
        depth = _depth(model, Sample(x, v, gap, rate, gap))
        found.penetration = larger(found.penetration, depth)
    # Without a contact force, one sample in the middle: a value that is not finite stays so.
    samples = 1
    if sticks:
        rate = max(model.free.rate, rate_of(model.free.forcing))
        samples = SAMPLES if rate * s.duration > SHORT else FEWEST_SAMPLES
    at = Sample(0.0, 0.0, 0.0, 0.0, 0.0)
    for k in range(samples + 1):
        part = (k + 0.5) / samples
        tau = s.duration * (part * part * (3.0 - 2.0 * part)) if k < samples else s.duration
        x, v, gap, rate = motion(model, s, tau)
        size = abs(gap) + (abs(s.v) + abs(s.gap_rate)) * s.duration
        at = Sample(x, v, gap, rate, size)
        if not math.isfinite(x + v + gap + rate):
            found.not_finite += 1.0
            break
        if sticks:
            force, size = contact_force(model, s, tau, at)
            found.tensile_force = larger(found.tensile_force, violation(min(force, 0.0), size))
    return at


@compiled
def _energy_size(model, s):
    """Sizes of the stored energy's terms, just before and after what begins a segment."""
    mass_ratio = inertia_of(mass_ratio_at(model, s.periods, s.time))
    y = abs(s.x) + model.clearance
    springs = 0.5 * (s.x * s.x + mass_ratio * model.mass.stiffness * y * y)
    springs += mass_ratio * abs(weight_on(model.mass)) * y
    kinetic = _kinetic_size(mass_ratio, s.v, s.gap_rate, s.v - s.side * s.gap_rate)
    if s.cause == IMPACT:
        before = _kinetic_size(mass_ratio, s.v_before, s.speed, s.v_before + s.side * s.speed)
        kinetic = max(kinetic, before)
    return springs + kinetic


@compiled
def _kinetic_size(mass_ratio, v, rate, u):
    # The free mass's velocity is a difference, with the roundoff of its terms.
    return 0.5 * v * v + mass_ratio * abs(u) * (abs(v) + abs(rate))
