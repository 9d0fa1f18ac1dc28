"""The response of the damper with a time-varying free mass: what a segment of it adds.

Flight is that of the rigid damper. While the masses move as one, each step is a polynomial
(`damper.models.time_varying.motion`) short enough for one Gauss rule, and the peak is sought on it.

The free mass gains and loses kinetic energy although nothing pushes it: (1/2) mu'(t) u^2 per unit
time, u its velocity, in every segment alike. That is the work of the modulation.
"""

import math
from typing import NamedTuple

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.forcing import force_rates, phase_at, turn_over, turned
from damper.engine.forcing.harmonic import Harmonic, Phase
from damper.engine.oscillator import Motion
from damper.engine.peak import Moment, bounds_of, moment_at
from damper.engine.quadrature import MOST
from damper.engine.segment import FLIGHT, TAIL, centre_velocity
from damper.models.response import (
    ResponseIntegrals,
    energy_in,
    gauss_sums,
    impact_loss,
    integrands,
    integrate_segment,
    lost_at_a_rigid_wall,
    oscillation,
    primary_and_masses,
    shifted_oscillator,
    tail_of,
    with_bounces,
)
from damper.models.time_varying import TimeVarying
from damper.models.time_varying.motion import DEGREE, MassLaw, evaluate, expand, modulation

impact_loss.of(TimeVarying)(lost_at_a_rigid_wall)
energy_in.of(TimeVarying)(primary_and_masses)


@integrate_segment.of(TimeVarying)
def _integrate_segment(model, tables, segment, low, high, peak):
    s = segment
    if s.mode == FLIGHT:
        found = oscillation(shifted_oscillator(model, model.mass_ratio, s, 0.0), low, high, peak)
        u = s.v - s.side * s.gap_rate
        before, _, _ = modulation(model.variation, s.periods, s.time + low)
        after, _, _ = modulation(model.variation, s.periods, s.time + high)
        gain = 0.5 * u * u * (after - before)
        return ResponseIntegrals(
            found.square, found.speed_square, found.work, 0.0, 0.0, gain, found.peak
        )
    mass_ratio, _, _ = modulation(model.variation, s.periods, s.time)
    start = _centre(model, mass_ratio, s)
    in_tail = s.mode == TAIL
    found = _contact(model, s, start, low, high, math.inf if in_tail else peak)
    if in_tail:
        # What bounces add is O(w^2) at most: the mass may stay what it was at the start.
        found = with_bounces(found, tail_of(model, mass_ratio, s, start, 0.0), low, high, peak)
    return found


@compiled
def _centre(model, mass_ratio, segment):
    """Motion of both masses' centre from a segment in contact, with the mass ratio as it is."""
    s = segment
    heavier = 1.0 + mass_ratio
    drag = 2.0 * model.free.damping
    phase = phase_at(model.free.forcing, s.periods, s.time)
    force, force1, _, _, _ = force_rates(model.free.forcing, phase)
    v = centre_velocity(s, mass_ratio)
    a = (force - drag * v - s.x) / heavier
    return Motion(s.x, v, a, (force1 - drag * a - v) / heavier, phase)


class Polynomial(NamedTuple):
    """One step of both masses' common motion, from its start."""

    terms: np.ndarray
    """Of x'', in parts of the step."""
    step: float
    x: float
    v: float
    bound2: float
    bound3: float
    """Bounds on |x''| and |x'''| on the step, by the sums of their terms."""
    forcing: Harmonic
    phase: Phase
    mass: MassLaw
    periods: float
    time: float


@moment_at.of(Polynomial)
def _moment_at(moving, tau):
    part = tau / moving.step
    dx, v = evaluate(moving.terms, moving.step, moving.v, part)
    a = 0.0
    for k in range(DEGREE, -1, -1):
        a = a * part + float(moving.terms[k])
    return Moment(tau, moving.x + dx, v, a, 0.0)


@bounds_of.of(Polynomial)
def _bounds_of(moving, moment, span):
    return moving.bound2, moving.bound3


@integrands.of(Polynomial)
def _integrands(moving, moment):
    phase = turned(moving.forcing, moving.phase, turn_over(moving.forcing, moment.tau))
    force, _, _, _, _ = force_rates(moving.forcing, phase)
    mass = moving.mass
    _, sin, _ = modulation(mass, moving.periods, moving.time + moment.tau)
    speed_square = moment.v * moment.v
    gain = -0.5 * mass.mean * mass.depth * mass.frequency * sin * speed_square
    return moment.x * moment.x, speed_square, force * moment.v, gain


@compiled
def _polynomial(model, periods, time, x, v, phase, terms):
    """The step from a state on; writes `terms`."""
    free = model.free
    step, _ = expand(free, model.variation, periods, time, x, v, phase, terms)
    bound2 = 0.0
    bound3 = 0.0
    for k in range(DEGREE + 1):
        bound2 += abs(float(terms[k]))
        bound3 += k * abs(float(terms[k]))
    bound3 /= step
    return Polynomial(
        terms, step, x, v, bound2, bound3, free.forcing, phase, model.variation, periods, time
    )


@compiled
def _contact(model, segment, start, low, high, peak):
    """What both masses' common motion adds on [low, high]."""
    s = segment
    forcing = model.free.forcing
    x = start.x
    v = start.v
    terms = np.empty(DEGREE + 1)
    square = 0.0
    speed_square = 0.0
    work = 0.0
    gain = 0.0
    passed = 0.0
    while True:
        phase = turned(forcing, start.phase, turn_over(forcing, passed))
        moving = _polynomial(model, s.periods, s.time + passed, x, v, phase, terms)
        first = max(low - passed, 0.0)
        last = min(high - passed, moving.step)
        if first <= last:
            sums = gauss_sums(moving, first, last, MOST, peak)
            square += sums.square
            speed_square += sums.speed_square
            work += sums.work
            gain += sums.own
            peak = sums.peak
        if passed + moving.step >= high:
            return ResponseIntegrals(square, speed_square, work, 0.0, 0.0, gain, peak)
        dx, v = evaluate(terms, moving.step, v, 1.0)
        x += dx
        passed += moving.step
