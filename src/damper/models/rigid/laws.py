"""What the observer `laws` has to know of the rigid damper: that its walls are rigid."""

from damper.models.laws import have_rigid_walls
from damper.models.rigid import Rigid

have_rigid_walls(Rigid)
