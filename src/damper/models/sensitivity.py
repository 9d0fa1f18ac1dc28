"""Change of the motion by a small change of a parameter, along the segment log.

It is one more deviation, of the states at the same phase of the forcing. Flights, contacts and
impacts take it along as `damper.models.tangent` does, but for two things. The walls move where the
clearance changes. And the flow and the impact law change: from one state they lead to another one.
That change is added to each segment and impact. Flow and impact are known in closed form for any
value of the parameter, so their derivative is taken from four values beside, to the fourth order.
No event lies between these values, so the derivative is accurate to some 1e-11 beside a grazing as
well, and serves every model and parameter. Derivation: docs/orbits.md.
"""

from collections.abc import Collection, Mapping
from functools import singledispatch
from typing import Any, NamedTuple

import numpy as np

from damper.engine.bodies import body_at
from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class_or_default
from damper.engine.forcing import phase_at
from damper.engine.model import begin, mass_ratio_at, motion
from damper.engine.oscillator import increments, motion_from
from damper.engine.segment import FLIGHT, IMPACT, Segment, centre_velocity, segment_at
from damper.engine.tuples import changed
from damper.models import model_of
from damper.models.flights import course_of
from damper.models.tangent import enter, joins, over_time, velocities_after
from damper.parameters import Parameters
from damper.parameters.named import value_of, with_values

#: Values beside a parameter's own, in steps: on both sides of it, or on one where its range ends or
#: another model begins.
_STENCILS = ((-2, -1, 1, 2), (0, 1, 2, 3), (0, -1, -2, -3), (1, 2, 3, 4), (-1, -2, -3, -4))
#: A step as a part of the value, and the smallest one.
_STEP, _LEAST = 1e-4, 1e-6


class Stencil(NamedTuple):
    """Models beside one, and what makes a derivative of what they give."""

    models: tuple[Any, Any, Any, Any]
    weights: tuple[float, float, float, float]
    """They add up to zero."""
    clearance: Any
    """Derivative of the clearance, or of that of each of several free masses."""


def neighbours(parameters: Parameters, rates: Mapping[str, float]) -> Stencil:
    """Models beside that of `parameters`, of which those named change at these rates.

    Raises
    ------
    ValueError
        Where there are none on either side; for the frequency of the clock under a force that does
        not repeat with it.
    """
    if "frequency_ratio" in rates and not parameters.forcing.repeats:
        raise ValueError(
            f"no derivative by frequency_ratio under a {parameters.forcing.kind}: the force does "
            "not repeat, so there is no same phase of it"
        )
    rubs = along_friction(rates)
    own = {name: value_of(parameters, name) for name in rates}
    step = min(
        (max(_STEP * abs(own[name]), _LEAST) / abs(rates[name]) for name in rates if rates[name]),
        default=1.0,
    )
    for steps in _STENCILS:
        try:
            models = [
                model_of(
                    with_values(parameters, {n: own[n] + k * step * rates[n] for n in rates}),
                    along_friction=rubs,
                )
                for k in steps
            ]
        except ValueError:
            continue
        kinds = {
            (type(m), type(m.law), type(m.free.forcing), type(m.stuck.forcing)) for m in models
        }
        if len(kinds) == 1:
            # Exact for polynomials of the third degree.
            powers = np.vander(steps, increasing=True).T
            weights = np.linalg.solve(powers, [0.0, 1.0 / step, 0.0, 0.0]).tolist()
            clearances = [clearances_of(model) - clearances_of(models[0]) for model in models]
            moved = np.dot(weights, clearances)
            return Stencil(tuple(models), tuple(weights), moved if moved.ndim else float(moved))
    raise ValueError(f"no derivative by {', '.join(rates)} at {parameters}")


def model_along(parameters: Parameters, names: Collection[str]) -> Any:
    """Model of a damper along these parameters: along friction with its events, also from none."""
    return model_of(parameters, along_friction=along_friction(names))


def along_friction(names: Collection[str]) -> bool:
    """Whether any of these parameters is friction, of a mass or of all."""
    return any(name.startswith("friction") for name in names)


@singledispatch
def clearances_of(model: Any) -> Any:
    """Clearance of a model, or of each of several free masses."""
    return model.clearance


@by_class_or_default
def follow_change(
    model: Any, stencil: Stencil, log: np.ndarray, change: np.ndarray, begun: bool
) -> None:
    """Take a change of the state (4, 1), or of several free masses, along a piece of the log."""
    for index in range(len(log)):
        s = segment_at(log[index])
        happened = begun or index > 0
        # From the wall, but for a flight, which knows of none.
        moved = s.side * stencil.clearance
        change[2, 0] -= moved
        enter(model, s, change, happened)
        if happened and s.cause == IMPACT:
            _add(model, stencil, s, True, change)
        if s.mode == FLIGHT:
            change[2, 0] += moved
        over_time(model, s, 0.0, s.duration, change)
        _add(model, stencil, s, False, change)
        if s.mode != FLIGHT:
            change[2, 0] += moved


@compiled
def _add(model, stencil, s, struck, change):
    """Add what the impact that begins a segment, or the flow over it, changes by."""
    y = s.x + s.side * (model.clearance - s.gap)
    v = s.v
    if joins(model, s):
        # A tail goes on with the masses' centre.
        v = centre_velocity(s, mass_ratio_at(model, s.periods, s.time))
    first = _lead(stencil.models[0], s, y, v, struck, stencil.models[0].cycle / model.cycle)
    for k in range(1, 4):
        there = stencil.models[k]
        other = _lead(there, s, y, v, struck, there.cycle / model.cycle)
        for i in range(4):
            change[i, 0] += stencil.weights[k] * (other[i] - first[i])


@compiled
def _lead(model, s, y, v, struck, slower):
    """Values of x, v, y and u later, without terms that are the same in all models.

    From `y` and `v` at the start, with a period that is `slower` times as long.
    """
    if struck:
        v, u = velocities_after(model, s, s.time * slower)
        return 0.0, v, 0.0, u
    if s.mode == FLIGHT:
        return _flight(model, s, y, slower)
    return _contact(model, s, v, slower)


@compiled
def _flight(model, s, y, slower):
    tau = s.duration * slower
    mass, shift = course_of(begin(model, s), model)
    phase = phase_at(model.free.forcing, s.periods, s.time * slower)
    dx, dv, _ = increments(model.free, motion_from(model.free, s.x - shift, s.v, phase), tau)
    u = s.v - s.side * s.gap_rate
    dy, later = body_at(mass, y, u, phase, tau)
    return s.v * tau + dx, dv, dy, later - u


@compiled
def _contact(model, s, v, slower):
    """State after a contact, the free mass's place measured from the wall."""
    apart = 0.0 if joins(model, s) else 1.0
    start = _beside(s, s.time * slower, v, apart * s.gap, apart * s.gap_rate)
    x, v, gap, rate = motion(model, start, s.duration * slower)
    return x, v, x - s.side * gap, v - s.side * rate


_beside = changed(Segment, "time", "v", "gap", "gap_rate")
