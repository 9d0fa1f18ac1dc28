"""The response of the damper with a grounded free mass."""

from damper.models.grounded import Grounded
from damper.models.response import have_rigid_walls

have_rigid_walls(Grounded)
