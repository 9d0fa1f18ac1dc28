"""What the observer `laws` has to know of dry friction: what it adds to forces and holds."""

from damper.engine.segment import STICKING
from damper.models import laws as declared
from damper.models.sliding import Slide, Sliding

declared.have_rigid_walls(Sliding)


@declared.mass_motion.of(Slide)
def _motion_in_slide(start):
    return declared.mass_motion(start.start)


@declared.force_bound.of(Sliding)
def _force_bound(model):
    return declared.largest_force(model) + (1.0 + model.mass_ratio) * model.friction


@declared.contact_force.of(Sliding)
def _contact_force(model, segment, tau, at):
    # What is left of friction; off the walls it may be overcome either way.
    force, size = declared.rigid_contact_force(model, segment, tau, at)
    if segment.mode != STICKING:
        force = -abs(force)
    return force + model.friction, size + model.friction
