"""Deviations of a motion with one free mass between rigid walls.

Friction is constant in a slide, so deviations fly as without it. Where the relative velocity
vanishes, the relative acceleration falls by a factor, from one slide to the other or to nothing
where friction holds, and the relative velocity of a deviation by the same: of the four directions
one vanishes in a rest. At a slip all accelerations are continuous. docs/orbits.md.
"""

from damper.engine.bodies import flow_of
from damper.engine.segment import RESTING
from damper.models import tangent
from damper.models.masses import Rigid, friction_of, hold_in
from damper.models.masses.holds import hold_at_start

tangent.have_rigid_walls(Rigid)


@tangent.contact_flow.of(Rigid)
def _contact_flow(model, periods, time, tau):
    return flow_of(model.stuck, tau)


@tangent.mass_ratio_rate.of(Rigid)
def _mass_ratio_rate(model, periods, time):
    return 0.0


@tangent.friction_in.of(Rigid)
def _friction_in(model):
    return friction_of(model.friction)


@tangent.turned.of(Rigid)
def _turned(model, s):
    most = friction_of(model.friction)
    if s.mode == RESTING:
        return 0.0
    if most == 0.0:
        return 1.0
    force = abs(hold_at_start(hold_in(model, s)).value - most)
    return (force - most) / (force + most)
