"""What the observer `laws` has to know of the rigid damper."""

from damper.engine.forcing import phase_at
from damper.engine.model import mass_ratio_at
from damper.engine.oscillator import increments, motion_from
from damper.models.flights import begin
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

flight_start.of(Rigid)(begin)


@flight_at.of(Rigid)
def _flight_at(model, segment, start, tau):
    s = segment
    dx, dv, _ = increments(model.free, start, tau)
    size = s.gap + (abs(s.gap_rate) + abs(s.v)) * tau
    gap = s.gap + s.gap_rate * tau + s.side * dx
    return Sample(s.x + (s.v * tau + dx), s.v + dv, gap, s.gap_rate + s.side * dv, size)


@contact_force.of(Rigid)
def _contact_force(model, segment, tau, at):
    # The masses have the acceleration (force - 2 zeta v - x) / (1 + mu).
    s = segment
    free = model.free
    # What the velocity is made of: itself, and what spring and force add against the dashpot.
    drag = max(2.0 * free.damping, 1.0)
    speed = abs(at.v) + abs(s.v) + (1.0 + abs(s.x)) * min(tau, 1.0 / drag)
    time = s.time + tau
    heavier = 1.0 + mass_ratio_at(model, s.periods, time)
    a = motion_from(free, at.x, at.v, phase_at(free.forcing, s.periods, time)).a
    size = 1.0 + 2.0 * free.damping * speed + abs(at.x) + abs(s.x)
    return -s.side * a / heavier, size / heavier


@support_stiffness.of(Rigid)
def _support_stiffness(model):
    return 0.0


@support_speed.of(Rigid)
def _support_speed(model, x, v, duration):
    return 0.0


@contact_speed.of(Rigid)
def _contact_speed(model, segment):
    return 0.0
