"""The response of the rigid damper."""

from damper.models.response import have_rigid_walls
from damper.models.rigid import Rigid

have_rigid_walls(Rigid)
