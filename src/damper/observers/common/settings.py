"""Settings of observers: default, range and meaning of each, declared once.

An observer declares them in its class; checks in Python, keys of study files, schemas and the
reference follow from that.
"""

from collections.abc import Mapping
from typing import Any

from damper.parameters.models import ONE_BY_ONE
from damper.parameters.names import MOST_MASSES
from damper.parameters.setting import Setting as Setting
from damper.parameters.units import SI_UNITS, TIME


class Visibility(Setting):
    """The approach speed from which an impact is visible; held as (fraction, speed), one zero."""

    allowed = (
        "a fraction in (0, 1) of the burst's first approach speed, "
        "or {'speed': an absolute one > 0}"
    )

    def _read(self, value: Any) -> tuple[float, float]:
        absolute = isinstance(value, Mapping) and set(value) == {"speed"}
        if isinstance(value, Mapping) and not absolute and set(value) != {"fraction"}:
            raise ValueError
        number = self._number(next(iter(value.values())) if isinstance(value, Mapping) else value)
        if not (number > 0.0 and (absolute or number < 1.0)):
            raise ValueError
        return (0.0, number) if absolute else (number, 0.0)


class AxisPlace(Setting):
    """Values of some axes."""

    allowed = "a mapping of axes to one of their values"

    def _read(self, value: Any) -> dict[str, float]:
        if not isinstance(value, Mapping):
            raise TypeError
        return {name: self._number(one) for name, one in value.items()}


#: Of a time in a study, dimensionless or in SI units.
TIME_UNITS = f"{TIME}, {SI_UNITS[TIME]}"
#: Of every observer that counts impacts.
VISIBILITY = Visibility(
    0.03,
    "From which approach speed an impact is visible, and so counts: a complete burst has "
    "infinitely many.",
)
#: Of every observer of one free mass that can be made for each of several.
BODIES = Setting(
    (),
    "Of several free masses those to observe, from 0, along the dimension `body`.",
    ge=0,
    lt=MOST_MASSES,
    integers=True,
)
#: Of observers that keep all of a run.
AT = AxisPlace(
    None,
    "Values of some axes: only the runs there are observed with it, and its variables have no such "
    "dimension.",
)
FREE_MASS = Setting(False, "Whether to record the free mass as well.", models=ONE_BY_ONE)
