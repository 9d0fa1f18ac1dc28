"""What the observer `laws` has to know of a grounded free mass."""

from damper.engine.forcing import phase_at
from damper.engine.model import begin
from damper.engine.oscillator import increments, motion_from
from damper.models.grounded import Grounded
from damper.models.laws import (
    Sample,
    contact_force,
    contact_speed,
    flight_at,
    flight_start,
    support_speed,
    support_stiffness,
)
from damper.models.rigid import Rigid
from damper.models.rigid import laws as _rigid  # noqa: F401 - which is shared here

contact_speed.share(Grounded, Rigid)


@flight_start.of(Grounded)
def _flight_start(model, segment):
    return begin(model, segment)


@flight_at.of(Grounded)
def _flight_at(model, segment, start, tau):
    s = segment
    y = start.mass
    dx, dv, _ = increments(model.free, start.primary, tau)
    dy, du, _ = increments(model.mass, y, tau)
    gap = s.gap + s.gap_rate * tau + s.side * (dx - dy)
    size = s.gap + (abs(s.gap_rate) + abs(s.v) + abs(y.v)) * tau + abs(y.x)
    return Sample(s.x + (s.v * tau + dx), s.v + dv, gap, s.gap_rate + s.side * (dv - du), size)


@contact_force.of(Grounded)
def _contact_force(model, segment, tau, at):
    # What parts the masses: the difference of their accelerations in the flight that would begin.
    s = segment
    free = model.free
    support = model.mass
    phase = phase_at(free.forcing, s.periods, s.time + tau)
    a = motion_from(free, at.x, at.v, phase).a
    b = motion_from(support, at.x + s.side * model.clearance, at.v, phase).a
    # What the velocity is made of: itself, and what spring and force add.
    x0 = abs(s.x) + model.clearance
    drag = max(2.0 * model.stuck.damping, 1.0)
    speed = abs(at.v) + abs(s.v) + (1.0 + x0) * min(tau, 1.0 / drag)
    size = 1.0 + 2.0 * (free.damping + support.damping) * speed
    size += (1.0 + support.stiffness) * (abs(at.x) + x0 + speed * min(tau, 1.0))
    return -s.side * (a - b), size


@support_stiffness.of(Grounded)
def _support_stiffness(model):
    return model.stiffness


@support_speed.of(Grounded)
def _support_speed(model, x, v, duration):
    drag = 2.0 * model.mass.damping
    stiffness = model.mass.stiffness
    # What the spring gives and takes back, all swings added up until the dashpot has damped them:
    # the end of a flight is a double, and many swings magnify its roundoff.
    swings = stiffness * (duration if drag * duration < 1.0 else 1.0 / drag)
    return swings * (x + model.clearance) + v * min(drag * duration, 1.0)
