"""What a run is: the parameters of the damper, its units, and the state it starts from."""

from damper.parameters.parameters import NO_UNITS, Parameters, SIParameters, State, Units

__all__ = ["NO_UNITS", "Parameters", "SIParameters", "State", "Units"]
