"""Numbers of a damper by their names: its quantities, and those of its force.

`harmonic_2` and `harmonic_2_phase` are amplitude and phase of the harmonic of order 2 of
`damper.Harmonics`. Motions are followed along these as along any quantity.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar

from damper.parameters.dampers import Parameters, SIParameters
from damper.parameters.quantities import unknown_name
from damper.parameters.quantity import Quantity

Damper = TypeVar("Damper", bound=Parameters | SIParameters)


def named_quantity(parameters: Parameters | SIParameters, name: str) -> Quantity:
    """What a number is that may vary without steps; TypeError with the nearest name for others."""
    varied = {q.name: q for q in parameters.quantities if not q.whole}
    varied |= {q.name: q for q in parameters.forcing.quantities}
    if name not in varied:
        raise unknown_name("parameter", name, varied)
    return varied[name]


def value_of(parameters: Parameters | SIParameters, name: str) -> float:
    """Value of a number of a damper."""
    own = parameters.forcing.numbers
    return own[name] if name in own else float(getattr(parameters, name))


def with_values(parameters: Damper, values: Mapping[str, float]) -> Damper:
    """The same damper with other values of some of its numbers."""
    forcing = parameters.forcing
    own = forcing.numbers
    changed: dict[str, Any] = {name: v for name, v in values.items() if name not in own}
    if len(changed) < len(values):
        of_force = {name: v for name, v in values.items() if name in own}
        changed["forcing"] = forcing.having(of_force)
    return replace(parameters, **changed)


def rates_of(parameters: Parameters | SIParameters, name: str) -> dict[str, float]:
    """As `SIParameters.rates`; the numbers of a force have no units."""
    own = parameters.forcing.numbers
    return {name: 1.0} if name in own else parameters.rates(name)
