"""Closed forms and limits to compare simulations with."""

from damper.parameters import Parameters
from damper.parameters.dampers import BASIC, require_known
from damper.parameters.models import own_feature


def require_basic(parameters: Parameters, *also: str) -> None:
    """Raise ValueError unless these make the damper of the closed forms.

    It has rigid walls, a constant restitution, and no quantity but those of `BASIC` and `also`.
    """
    p = parameters
    if p.main_feature != "rigid":
        has = own_feature(p.main_feature)
        raise ValueError(f"the closed form is that of rigid walls alone, this damper has {has}")
    if p.law != "constant":
        raise ValueError(f"the closed form has a constant restitution, this is the {p.law} law")
    require_known(p, (*BASIC, *also), "the closed form")
