"""The response of a damper with one free mass between rigid walls."""

from damper.models.masses import Rigid
from damper.models.response import have_rigid_walls

have_rigid_walls(Rigid)
