"""The response of the damper with a time-varying free mass: what a segment of it adds.

Flight is that of the rigid damper. While the masses move as one, each step is a polynomial
(`damper.models.time_varying.motion`) short enough for one Gauss rule, and the peak is sought on it.

The free mass gains and loses energy although nothing pushes it: (1/2) mu'(t) u^2 per unit time, u
its velocity, in every segment alike, and mu'(t) gamma y under gravity. That is the work of the
modulation.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from damper.engine.bodies import Ballistic, acceleration_of, strength_on, weight_on
from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class
from damper.engine.forcing import force_rates, phase_at, turn_over, turned
from damper.engine.oscillator import Motion, Oscillator
from damper.engine.peak import Moment, bounds_of, moment_at
from damper.engine.quadrature import LONGEST_REACH, MOST
from damper.engine.search import HORIZON
from damper.engine.segment import FLIGHT, TAIL, Segment, centre_velocity
from damper.models import response as declared
from damper.models.time_varying import TimeVarying
from damper.models.time_varying.motion import DEGREE, MassLaw, evaluate, expand, modulation

declared.have_rigid_walls(TimeVarying)


@declared.integrate_segment.of(TimeVarying)
def _integrate_segment(model, tables, segment, low, high, peak):
    s = segment
    if s.mode == FLIGHT:
        found = declared.primary_in_flight(model, s, low, high, peak)
        work, gain = varying_in_flight(model.mass, model, s, low, high)
        return declared.with_energies(found, found.work + work, 0.0, 0.0, 0.0, gain)
    mass_ratio, _, _ = modulation(model.variation, s.periods, s.time)
    start = _centre(model, mass_ratio, s)
    in_tail = s.mode == TAIL
    found = _contact(model, s, start, low, high, math.inf if in_tail else peak)
    if in_tail:
        # What bounces add is O(w^2) at most: the mass may stay what it was at the start.
        found = declared.with_bounces(
            found, declared.tail_of(model, mass_ratio, s, start, 0.0), low, high, peak
        )
    return found


@compiled
def _centre(model, mass_ratio, segment):
    """Motion of both masses' centre from a segment in contact, with the mass ratio as it is."""
    s = segment
    heavier = 1.0 + mass_ratio
    drag = 2.0 * model.free.damping
    phase = phase_at(model.free.forcing, s.periods, s.time)
    force, force1, _, _, _ = force_rates(model.free.forcing, phase)
    own, own1 = acceleration_of(model.mass, 0.0, 0.0, phase), strength_on(model.mass) * force1
    strength = model.free.strength
    v = centre_velocity(s, mass_ratio)
    a = own + ((strength * force - own) - drag * v - s.x) / heavier
    return Motion(s.x, v, a, own1 + ((strength * force1 - own1) - drag * a - v) / heavier, phase)


@by_class
def varying_in_flight(
    mass: Any, model: Any, segment: Segment, low: float, high: float
) -> tuple[float, float]:
    """Work of the force on the free mass, and that of its modulation, over a part of a flight."""


@varying_in_flight.of(Ballistic)
def _varying_ballistic(mass, model, segment, low, high):
    s = segment
    u = s.v - s.side * s.gap_rate
    before, _, _ = modulation(model.variation, s.periods, s.time + low)
    after, _, _ = modulation(model.variation, s.periods, s.time + high)
    return 0.0, 0.5 * u * u * (after - before)


class VaryingMass(NamedTuple):
    """The free mass in flight, where the force acts on it."""

    body: declared.ShiftedOscillator
    law: MassLaw
    periods: float
    time: float


@varying_in_flight.of(Oscillator)
def _varying_driven(mass, model, segment, low, high):
    moving = VaryingMass(
        declared.mass_in_flight(model, segment), model.variation, segment.periods, segment.time
    )
    found = declared.oscillation(moving, low, high, math.inf)
    return strength_on(mass) * found.work, found.modulation


@moment_at.of(VaryingMass)
def _moment_of_mass(moving, tau):
    return moment_at(moving.body, tau)


@bounds_of.of(VaryingMass)
def _bounds_of_mass(moving, moment, span):
    return bounds_of(moving.body, moment, span)


@declared.longest_rule.of(VaryingMass)
def _longest_rule(moving, tau):
    # The mass turns beside what the force and the square of the velocity do.
    step = declared.longest_step(moving.body.osc, tau)
    return LONGEST_REACH / (LONGEST_REACH / step + moving.law.frequency)


@declared.integrands.of(VaryingMass)
def _integrands_of_mass(moving, moment):
    square, speed_square, work, _ = declared.integrands(moving.body, moment)
    mass_ratio, rate = _mass_at(moving.law, moving.periods, moving.time + moment.tau)
    gain = 0.5 * rate * speed_square - rate * weight_on(moving.body.osc) * moment.x
    return square, speed_square, mass_ratio * work, gain


@compiled
def _mass_at(law, periods, time):
    """Mass ratio at a moment, and its rate of change."""
    mass_ratio, sin, _ = modulation(law, periods, time)
    return mass_ratio, -law.mean * law.depth * law.frequency * sin


class Polynomial(NamedTuple):
    """A step of the masses' common motion, from its start."""

    terms: np.ndarray
    """Of x'', in the first row, in parts of the step."""
    step: float
    x: float
    v: float
    bound2: float
    bound3: float
    """Bounds on |x''| and |x'''| on the step, by the sums of their terms."""
    driven: Oscillator
    """The primary in flight: it has the force."""
    on_mass: float
    """Strength of the force on the free mass, over its mass."""
    weight: float
    """Its constant acceleration in flight."""
    wall: float
    """Its place less the primary's."""
    phase: Any
    mass: MassLaw
    periods: float
    time: float


@moment_at.of(Polynomial)
def _moment_at(moving, tau):
    part = tau / moving.step
    dx, v = evaluate(moving.terms, moving.step, moving.v, part)
    a = 0.0
    for k in range(DEGREE, -1, -1):
        a = a * part + float(moving.terms[0, k])
    return Moment(tau, moving.x + dx, v, a, 0.0)


@bounds_of.of(Polynomial)
def _bounds_of(moving, moment, span):
    return moving.bound2, moving.bound3


@declared.integrands.of(Polynomial)
def _integrands(moving, moment):
    forcing = moving.driven.forcing
    phase = turned(forcing, moving.phase, turn_over(forcing, moment.tau))
    force, _, _, _, _ = force_rates(forcing, phase)
    mass_ratio, rate = _mass_at(moving.mass, moving.periods, moving.time + moment.tau)
    push = moving.driven.strength + mass_ratio * moving.on_mass
    speed_square = moment.v * moment.v
    gain = 0.5 * rate * speed_square - rate * moving.weight * (moment.x + moving.wall)
    return moment.x * moment.x, speed_square, push * force * moment.v, gain


@compiled
def _polynomial(model, side, periods, time, x, v, phase, terms):
    """The step from a state on; writes `terms`."""
    step, _ = expand(model, periods, time, x, v, phase, HORIZON, terms)
    bound2 = 0.0
    bound3 = 0.0
    for k in range(DEGREE + 1):
        bound2 += abs(float(terms[0, k]))
        bound3 += k * abs(float(terms[0, k]))
    bound3 /= step
    on_mass = strength_on(model.mass)
    return Polynomial(
        terms,
        step,
        x,
        v,
        bound2,
        bound3,
        model.free,
        on_mass,
        weight_on(model.mass),
        side * model.clearance,
        phase,
        model.variation,
        periods,
        time,
    )


@compiled
def _contact(model, segment, start, low, high, peak):
    """Integrals of the masses' common motion over [low, high]."""
    s = segment
    forcing = model.free.forcing
    x = start.x
    v = start.v
    terms = np.empty((2, DEGREE + 1))
    square = 0.0
    speed_square = 0.0
    work = 0.0
    gain = 0.0
    passed = 0.0
    while True:
        phase = turned(forcing, start.phase, turn_over(forcing, passed))
        moving = _polynomial(model, s.side, s.periods, s.time + passed, x, v, phase, terms)
        first = max(low - passed, 0.0)
        last = min(high - passed, moving.step)
        if first <= last:
            sums = declared.gauss_sums(moving, first, last, MOST, peak)
            square += sums.square
            speed_square += sums.speed_square
            work += sums.work
            gain += sums.own
            peak = sums.peak
        if passed + moving.step >= high:
            return declared.ResponseIntegrals(square, speed_square, work, 0.0, 0.0, 0.0, gain, peak)
        dx, v = evaluate(terms, moving.step, v, 1.0)
        x += dx
        passed += moving.step
