"""What a run is: the parameters of the damper, its units, and the state it starts from.

`dampers` declares every parameter once, `state` the initial quantities; `quantities` lists them.
"""

from damper.parameters.dampers import Parameters, SIParameters
from damper.parameters.state import State
from damper.parameters.units import NO_UNITS, Units

__all__ = ["NO_UNITS", "Parameters", "SIParameters", "State", "Units"]
