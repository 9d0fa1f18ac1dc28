"""Laws of a time-varying free mass, for the observer `laws`: its walls are rigid."""

from damper.models.laws import have_rigid_walls
from damper.models.time_varying import TimeVarying

have_rigid_walls(TimeVarying)
