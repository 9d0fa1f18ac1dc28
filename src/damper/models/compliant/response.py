"""The response of the damper with compliant contact: what a segment of it adds.

**Integrals** of quadratic functions of the state, x^2, v^2, force times v and what the contact's
dashpot takes, over the intervals h of the propagators T of `damper.models.compliant.flow` are
quadratic forms G of the state, with G(2 h) = G(h) + T' G(h) T. They are made once for a run, and a
contact of any length and any oscillation costs some twenty of them. The rest of the time is a
Gauss-Legendre sum. The forms' state is that of the propagators: where a heavily damped primary
hardly moves, its velocity is one of the variables and not a difference of two.

**The peak** is found as in flight, by bounds on the derivatives of x, which the energy gives; or,
where the contact is faster than the rest, by those on its slow part and on the size of the fast
one.

**The energy in the contact** is k g^2 / 2 while g < 0. A contact without tension loses what is left
of it when it has ended, as the gap reopens.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.forcing import bound_of
from damper.engine.impact import DifferingWalls, law_at
from damper.engine.model import motion
from damper.engine.peak import Moment, bounds_of, highest, moment_at, stays_below
from damper.engine.quadrature import FEWEST, NODES, WEIGHTS
from damper.engine.segment import FLIGHT
from damper.models import response as declared
from damper.models.compliant import Compliant, CompliantPair, flow, of_a_wall, pair_at
from damper.models.compliant.pairs import MASSES, write_pairs
from damper.models.compliant.search import ContactMotion, EventFunction, event_function

#: Nodes for an interval of the propagators.
_NODES = 10
_FORMS = 4


class Tables(NamedTuple):
    """What `integrate_segment` needs beside the model."""

    forms: np.ndarray
    """(levels + 1, 4, n, n) integrals over the intervals of the propagators."""
    displacement: EventFunction
    """The primary's displacement, as slow and fast part."""


def prepare(model: Any) -> Any:
    """Make what `integrate_segment` needs beside the model, once for a run; `Tables` of a wall."""
    if isinstance(model, CompliantPair):
        return DifferingWalls(prepare(model.left), prepare(model.right))
    n = flow.row_length(model.contact)
    if model.contact.rest.gap:
        n += 1  # for a constant: x^2 is that of the distance to rest and of the place of rest
    forms = np.zeros((model.contact.levels + 1, _FORMS, n, n))
    _fill(model.contact, model.table, forms)
    row = np.array([1.0, 0.0, model.contact.reduced, 0.0])
    return Tables(forms, event_function(model.contact, model.split, row))


@declared.impact_loss.of(Compliant)
def _impact_loss(model, segment):
    # The contact loses energy while it lasts.
    return 0.0


@declared.energy_in.of(Compliant)
def _energy_in(model, segment, mass_ratio, state):
    x, v, gap, rate = state
    # Both walls are one case: the free mass moves at v - side * rate.
    u = v - segment.side * rate
    depth = min(gap, 0.0)
    energy = v * v + x * x + mass_ratio * u * u + model.contact.stiffness * depth * depth
    return declared.with_height(
        model.stuck.forcing, model, 0.5 * energy, mass_ratio, segment, state
    )


@declared.integrate_segment.of(Compliant)
def _integrate_segment(model, tables, segment, low, high, peak):
    if segment.mode != FLIGHT:
        return _contact(model, tables, segment, low, high, peak)
    found = declared.integrate_flight(model, segment, low, high, peak)
    loss = 0.0
    if segment.gap < 0.0:
        for k in range(2):
            _, _, gap, _ = motion(model, segment, high if k == 1 else low)
            gap = min(gap, 0.0)
            loss += (1.0 if k == 0 else -1.0) * 0.5 * model.contact.stiffness * gap * gap
    return declared.with_energies(found, found.work, loss, 0.0, 0.0, 0.0)


@declared.integrate_segment.of(CompliantPair)
def _integrate_segment_of_pair(model, tables, segment, low, high, peak):
    own, its = law_at(model, segment.side), law_at(tables, segment.side)
    return _integrate_segment(own, its, segment, low, high, peak)


of_a_wall(declared.impact_loss)
of_a_wall(declared.energy_in)


@compiled
def _fill(contact, table, forms):
    """Quadratic forms over the shortest interval by a Gauss sum, then by doubling."""
    n = forms.shape[2]
    length = flow.row_length(contact)
    propagator = np.zeros((n, n))
    form = np.zeros((_FORMS, n, n))
    # x less the first variable, over r.
    beta = contact.reduced - contact.shift
    for a, b in ((0, 0), (0, 2), (2, 0), (2, 2)):
        factor = beta if a + b == 2 else (beta * beta if a + b == 4 else 1.0)
        form[0, a, b] = factor
        form[1, a + 1, b + 1] = factor
    if n > length:
        rest = contact.rest.centre + contact.reduced * contact.rest.gap
        form[0, length, 0] = form[0, 0, length] = rest
        form[0, length, 2] = form[0, 2, length] = beta * rest
        form[0, length, length] = rest * rest
        propagator[length, length] = 1.0
    # Half of each number, for both places of a product.
    of_rate = 0.5 * contact.strength * (1.0 + contact.on_mass)
    of_gap = beta * of_rate - 0.5 * contact.strength * contact.on_mass
    for k in range(MASSES, length, 2):
        form[2, k, 1] = form[2, 1, k] = of_rate
        form[2, k, 3] = form[2, 3, k] = of_gap
    form[3, 3, 3] = contact.damping
    for node in range(_NODES):
        tau = contact.shortest * float(NODES[_NODES - FEWEST, node])
        weight = contact.shortest * float(WEIGHTS[_NODES - FEWEST, node])
        _fill_propagator(contact, table, tau, propagator)
        for kind in range(_FORMS):
            _accumulate(form[kind], propagator, weight, forms[0, kind])
    tau = contact.shortest
    for level in range(contact.levels):
        _fill_propagator(contact, table, tau, propagator)
        tau *= 2.0
        for kind in range(_FORMS):
            _accumulate(forms[level, kind], propagator, 1.0, forms[level + 1, kind])
            # By elements: numba takes seconds to compile the message of a failed slice assignment.
            for i in range(n):
                for j in range(n):
                    forms[level + 1, kind, i, j] += forms[level, kind, i, j]


@compiled
def _fill_propagator(contact, table, tau, propagator):
    for column in range(flow.row_length(contact)):
        unit, pair = flow.unit_state(column)
        after = flow.advance_under(contact, table, pair, unit, tau)
        for row in range(MASSES):
            propagator[row, column] = after[row]
        if column >= MASSES:
            propagator[MASSES + 2 * pair, column] = after[MASSES]
            propagator[MASSES + 2 * pair + 1, column] = after[MASSES + 1]


@compiled
def _accumulate(form, propagator, weight, result):
    """Add weight T' G T to the result."""
    n = len(form)
    half = np.zeros((n, n))
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(n):
                total += form[i, k] * propagator[k, j]
            half[i, j] = total
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(n):
                total += propagator[k, i] * half[k, j]
            result[i, j] += weight * total


@compiled
def _quadratic(form, z):
    n = len(z)
    total = 0.0
    for i in range(n):
        inner = 0.0
        for j in range(n):
            inner += float(form[i, j]) * float(z[j])
        total += float(z[i]) * inner
    return total


@moment_at.of(ContactMotion)
def _moment_at(moving, tau):
    contact = moving.contact
    z = flow.advance(contact, moving.table, moving.start, tau) if tau > 0.0 else moving.start
    force, _, _, _, _ = flow.force_rates_in(contact, z)
    first = flow.derivative(contact, flow.from_rest(contact.rest, z), force)
    beta = contact.reduced
    return Moment(tau, z[0] + beta * z[2], z[1] + beta * z[3], first[1] + beta * first[3], z)


@bounds_of.of(ContactMotion)
def _bounds_of(moving, moment, span):
    # The displacement's second and third derivative are velocities of derived motions.
    contact = moving.contact
    force, force1, _, _, _ = flow.force_rates_in(contact, moment.motion)
    first = flow.derivative(contact, flow.from_rest(contact.rest, moment.motion), force)
    push1 = contact.push * bound_of(contact.forcing, 1)
    push2 = contact.push * bound_of(contact.forcing, 2)
    return (
        flow.energy_size(contact, first) + push1 * span,
        flow.energy_size(contact, flow.derivative(contact, first, force1)) + push2 * span,
    )


@declared.integrands.of(ContactMotion)
def _integrands(moving, moment):
    contact = moving.contact
    z = moment.motion
    force, _, _, _, _ = flow.force_rates_in(contact, z)
    power = force * (moment.v + contact.on_mass * (moment.v - z[3]))
    return moment.x * moment.x, moment.v * moment.v, power, contact.damping * z[3] * z[3]


@stays_below.of(ContactMotion)
def _stays_below(moving, start, end, limit):
    """Slow and fast part together cannot exceed `limit`, or cannot turn, in a step."""
    contact = moving.contact
    event = moving.event
    if event.separated == 0.0:
        return False
    z = flow.from_rest(contact.rest, start.motion)
    last = flow.from_rest(contact.rest, end.motion)
    span = end.tau - start.tau
    y = flow.dot(contact, event.fast[0], z)
    y1 = flow.dot(contact, event.fast[1], z)
    speed = math.sqrt(event.fast_stiffness * y * y + y1 * y1)
    level = speed / math.sqrt(event.fast_stiffness)
    f1 = flow.dot(contact, event.slow[1], z)
    f2 = flow.dot(contact, event.slow[2], z)
    f3 = flow.dot(contact, event.slow[3], z)
    g1 = flow.dot(contact, event.slow[1], last)
    stiffness = max(event.stiffness, 0.0)
    eighth = 0.125 * span * span
    bound2 = math.sqrt(stiffness * f1 * f1 + f2 * f2) + event.driving1 * span
    largest = max(
        abs(flow.dot(contact, event.slow[0], z) + event.at_rest),
        abs(flow.dot(contact, event.slow[0], last) + event.at_rest),
    )
    if largest + bound2 * eighth + level <= limit:
        return True
    bound3 = math.sqrt(stiffness * f2 * f2 + f3 * f3) + event.driving2 * span
    one_way = (f1 > 0.0 and g1 > 0.0) or (f1 < 0.0 and g1 < 0.0)
    return one_way and min(abs(f1), abs(g1)) - bound3 * eighth > speed


@compiled
def _contact(model, tables, segment, low, high, peak):
    """What a contact adds on [low, high]."""
    contact = model.contact
    z = pair_at(model, segment)
    moving = ContactMotion(contact, model.table, tables.displacement, 1.0, z)
    start = moment_at(moving, low)
    square = speed_square = work = loss = 0.0
    own = flow.shifted(contact, start.motion)
    rest = flow.shifted_rest(contact, contact.rest)
    row = np.ones(tables.forms.shape[2])
    duration = high - low
    length = contact.shortest * math.ldexp(1.0, contact.levels)
    for level in range(contact.levels, -1, -1):
        while duration >= length:
            away = flow.from_rest(rest, own)
            for k in range(MASSES):
                row[k] = away[k]
            write_pairs(contact.forcing, own[4], own[5], row)
            forms = tables.forms[level]
            square += _quadratic(forms[0], row)
            speed_square += _quadratic(forms[1], row)
            work += _quadratic(forms[2], row)
            loss += _quadratic(forms[3], row)
            own = flow.leap(contact, model.table[level], rest, own)
            duration -= length
        length *= 0.5
    left = ContactMotion(
        contact, model.table, tables.displacement, 1.0, flow.unshifted(contact, own)
    )
    sums = declared.gauss_sums(left, 0.0, duration, _NODES, math.inf)
    if peak < math.inf:  # nothing is above that
        peak = highest(moving, start, moment_at(moving, high), max(peak, abs(start.x)))
    return declared.ResponseIntegrals(
        square + sums.square,
        speed_square + sums.speed_square,
        work + sums.work,
        loss + sums.own,
        0.0,
        0.0,
        0.0,
        peak,
    )
