"""What the observer `laws` has to know of a grounded free mass: that its walls are rigid."""

from damper.models.grounded import Grounded
from damper.models.laws import have_rigid_walls

have_rigid_walls(Grounded)
