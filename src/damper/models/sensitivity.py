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
from damper.engine.model import begin, mass_ratio_at, motion, read_segment
from damper.engine.oscillator import increments, motion_from
from damper.engine.segment import (
    CONTACT,
    FLIGHT,
    IMPACT,
    RESTING,
    STICKING,
    TAIL,
    Segment,
    centre_velocity,
)
from damper.engine.tuples import changed
from damper.models import model_of
from damper.models.flights import course_of, free_mass_of
from damper.models.tangent import enter, joins, over_time, velocities_after
from damper.parameters import Parameters
from damper.parameters.named import size_of, value_of, with_values

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
    clearance: np.ndarray
    """Derivative of the clearance of each free mass."""


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
        (
            max(_STEP * abs(own[name]), _LEAST * size_of(parameters, name)) / abs(rates[name])
            for name in rates
            if rates[name]
        ),
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
        kinds = {tuple(map(type, (m, m.law, m.free.forcing, _joined(m)))) for m in models}
        if len(kinds) == 1:
            # Exact for polynomials of the third degree.
            powers = np.vander(steps, increasing=True).T
            weights = np.linalg.solve(powers, [0.0, 1.0 / step, 0.0, 0.0]).tolist()
            clearances = [clearances_of(model) - clearances_of(models[0]) for model in models]
            return Stencil(tuple(models), tuple(weights), np.dot(weights, clearances))
    raise ValueError(f"no derivative by {', '.join(rates)} at {parameters}")


def model_along(parameters: Parameters, names: Collection[str]) -> Any:
    """Model of a damper along these parameters: along friction with its events, also from none."""
    return model_of(parameters, along_friction=along_friction(names))


def along_friction(names: Collection[str]) -> bool:
    """Whether any of these parameters is friction, of a mass or of all."""
    return any(name.startswith("friction") for name in names)


def _joined(model: Any) -> Any:
    """Force on the primary with joined masses, in a model that has such a force."""
    return model.stuck.forcing if hasattr(model, "stuck") else None


@singledispatch
def clearances_of(model: Any) -> np.ndarray:
    """Clearance of each free mass."""
    return np.array([model.clearance])


@by_class_or_default
def wall_of(model: Any, segment: Any, k: int) -> tuple[float, float]:
    """Side of the wall of a free mass, and how the mass moves."""
    return segment.side, segment.mode


@by_class_or_default
def first_place(model: Any) -> int:
    """Number of the state's component that is the displacement of the first free mass."""
    return 2


@by_class_or_default
def strikes(model: Any, segment: Any) -> bool:
    """Whether a segment is the first of those that the impacts of an instant begin."""
    return segment.cause == IMPACT


@compiled
def follow_change(
    model: Any, stencil: Stencil, log: np.ndarray, change: np.ndarray, begun: bool
) -> None:
    """Take a change of the state, (4, 1) or of several free masses, along a piece of the log."""
    for index in range(len(log)):
        s = read_segment(model, log[index])
        happened = begun or index > 0
        # From the walls, but for masses that touch none.
        _shift(model, s, stencil, change, -1.0, True, True)
        enter(model, s, change, happened)
        if happened and strikes(model, s):
            _add(model, stencil, s, True, change)
        _shift(model, s, stencil, change, 1.0, False, True)
        over_time(model, s, 0.0, s.duration, change)
        _add(model, stencil, s, False, change)
        _shift(model, s, stencil, change, 1.0, True, False)


@compiled
def _shift(model, s, stencil, change, sign, on_walls, off_walls):
    """Add changes of the walls to places: of masses on a wall, of others, or of both."""
    for k in range(len(stencil.clearance)):
        side, mode = wall_of(model, s, k)
        touches = mode in (STICKING, TAIL, CONTACT)
        if (touches and on_walls) or (not touches and off_walls):
            change[first_place(model) + 2 * k, 0] += sign * side * stencil.clearance[k]


@compiled
def _add(model, stencil, s, struck, change):
    """Add what the impacts that begin a segment, or the flow over it, change by."""
    found = np.zeros((2, len(change)))
    lead(stencil.models[0], model, s, struck, found[0])
    for k in range(1, 4):
        lead(stencil.models[k], model, s, struck, found[1])
        for i in range(len(change)):
            change[i, 0] += stencil.weights[k] * (found[1, i] - found[0, i])


@by_class_or_default
def lead(there: Any, model: Any, s: Any, struck: bool, found: np.ndarray) -> None:
    """State later in a neighbouring model, without terms that are the same in all models.

    From the start of a segment of `model`, with a cycle that is longer in proportion.
    """
    slower = there.cycle / model.cycle
    if struck:
        found[1], found[3] = velocities_after(there, s, s.time * slower)
    elif s.mode == FLIGHT:
        found[0], found[1], found[2], found[3] = _flight(there, model, s, slower)
    else:
        found[0], found[1], found[2], found[3] = _contact(there, model, s, slower)


@compiled
def _flight(there, model, s, slower):
    tau = s.duration * slower
    mass, shift = course_of(begin(there, s), there)
    phase = phase_at(there.free.forcing, s.periods, s.time * slower)
    dx, dv, _ = increments(there.free, motion_from(there.free, s.x - shift, s.v, phase), tau)
    y, u = free_mass_of(model, s)
    dy, later = body_at(mass, y, u, phase, tau)
    return s.v * tau + dx, dv, dy, later - u


@compiled
def _contact(there, model, s, slower):
    """State after a contact, the free mass's place measured from the wall that it touches."""
    v, gap, rate = s.v, s.gap, s.gap_rate
    if joins(model, s):
        # A tail goes on with the masses' centre.
        v, gap, rate = centre_velocity(s, mass_ratio_at(model, s.periods, s.time)), 0.0, 0.0
    rests = s.mode == RESTING
    if rests:
        gap += there.clearance - model.clearance
    start = _beside(s, s.time * slower, v, gap, rate)
    x, v, gap, rate = motion(there, start, s.duration * slower)
    return x, v, x if rests else x - s.side * gap, v - s.side * rate


_beside = changed(Segment, "time", "v", "gap", "gap_rate")
