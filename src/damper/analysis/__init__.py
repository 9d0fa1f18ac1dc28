"""What a cube says in numbers: cubes in, numbers out; for tables, figures and notebooks.

Each function takes a cube from `damper.simulate` or a study's ``cube.nc``, and returns a pandas or
xarray object. A name loads what it needs when it is first used.
"""

from importlib import import_module
from typing import Any

#: Function -> the module that holds it.
HOME = {
    "attractors": "motions",
    "basin_fractions": "basins",
    "best_clearance": "optimum",
    "burst_statistics": "bursts",
    "chatter_in_range": "intervals",
    "chatter_intervals": "intervals",
    "accumulation_errors": "accumulation",
    "damping_shares": "optimum",
    "distance_to_rigid": "convergence",
    "first_lasting_change": "sections",
    "list_bursts": "bursts",
    "means_under_noise": "statistics",
    "order_of_convergence": "convergence",
    "section_period": "sections",
    "section_points": "sections",
    "share": "reduction",
    "two_impact_errors": "two_impacts",
    "two_impact_ranges": "two_impacts",
    "worst": "reduction",
}

__all__ = list(HOME)


def __getattr__(name: str) -> Any:
    if name not in HOME:
        message = f"module 'damper.analysis' has no attribute {name!r}"
        # Python names the nearest one.
        raise AttributeError(message, name=name, obj=import_module(__name__))
    value = getattr(import_module(f"damper.analysis.{HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(HOME)
