"""Forces of a free mass between rigid walls, for the observer `laws`."""

from damper.engine.impact import inertia_of
from damper.engine.segment import STICKING
from damper.models import laws as declared
from damper.models.masses import Rigid, Slide, friction_of

declared.have_rigid_walls(Rigid)


@declared.mass_motion.of(Slide)
def _motion_in_slide(start):
    return declared.mass_motion(start.start)


@declared.force_bound.of(Rigid)
def _force_bound(model):
    heavier = 1.0 + inertia_of(model.mass_ratio)
    return declared.largest_force(model) + heavier * friction_of(model.friction)


@declared.contact_force.of(Rigid)
def _contact_force(model, segment, k, tau, at):
    # Beyond the force at which friction gives way; off the walls it may give way either way.
    force, size = declared.rigid_contact_force(model, segment, k, tau, at)
    most = friction_of(model.friction)
    if most > 0.0 and segment.mode != STICKING:
        force = -abs(force)
    return force + most, size + most
