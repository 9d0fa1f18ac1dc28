"""Laws of compliant contact, for the observer `laws`."""

import math

from damper.models.compliant import Compliant, CompliantPair, of_a_wall
from damper.models.laws import contact_force, contact_speed, force_bound, largest_force

force_bound.of(Compliant)(largest_force)
force_bound.like(CompliantPair, Compliant)


@contact_speed.of(Compliant)
def _contact_speed(model, segment):
    return math.sqrt(model.contact.stiffness) * max(-segment.gap, 0.0)


@contact_force.of(Compliant)
def _contact_force(model, segment, k, tau, at):
    if model.tension != 0.0:
        return 0.0, 1.0
    s = segment
    k = model.contact.stiffness
    c = model.contact.damping
    # Terms of the rate: the depth at the start times the rate of the contact's own oscillation.
    speed = abs(at.rate) + abs(s.gap_rate) + math.sqrt(k) * abs(s.gap)
    # The acceleration at the wall from the other forces on the masses.
    other = (
        model.contact.largest
        + abs(at.x)
        + abs(s.x)
        + 2.0 * model.free.damping * (abs(at.v) + abs(s.v))
    )
    size = k * (abs(at.gap) + abs(s.gap)) + c * speed + model.contact.reduced * other
    return -(k * at.gap + c * at.rate), size


of_a_wall(contact_speed)
of_a_wall(contact_force)
