"""Change of a motion with several free masses by a small change of a parameter.

As `damper.models.sensitivity`, by impacts and flows of neighbouring models from one state.
"""

from typing import Any

from damper.engine.bodies import body_at
from damper.engine.compiled import compiled
from damper.engine.forcing import phase_at
from damper.engine.oscillator import increments, motion_from
from damper.models import sensitivity
from damper.models.many import GAP, MODE, RATE, SIDE, SPEED, is_on_wall
from damper.models.several.bodies import (
    CLEARANCE,
    JOINED,
    PREVIOUS_STATE,
    RATIO,
    SLIP_DIRECTION,
    Several,
    begin,
    flying,
    is_joined,
    load_in,
    mass_at,
    primary_with,
    ways_in,
)
from damper.models.several.tangent import begins_impacts, change_by, impulses, offsets_in


@sensitivity.clearances_of.register(Several)
def _clearances_of(model: Several) -> Any:
    return model.masses[:, CLEARANCE]


@sensitivity.wall_of.of(Several)
def _wall_of(model, segment, k):
    return float(segment.bodies[k, SIDE]), float(segment.bodies[k, MODE])


sensitivity.strikes.of(Several)(begins_impacts)


@sensitivity.lead.of(Several)
def _lead(there, model, s, struck, found):
    if struck:
        _after_impacts(there, model, s, found)
    else:
        _after(there, model, s, begin(model, s).primary.v, found)


@compiled
def _after_impacts(there, model, s, found):
    """Velocities after the impacts that begin a segment, those of joined masses their centre's."""
    sides, _, pushes = impulses(model, s)
    _, levels, _ = impulses(there, s)
    v = s.v_before + change_by(there.masses[:, RATIO], levels, pushes)
    heavier, carried = 1.0, v
    for k in range(len(s.bodies)):
        b = s.bodies[k]
        u = 0.0
        if pushes[k] == 1.0:
            # The rebound is what the level has beyond the approach.
            u = v - (levels[k] - sides[k] * b[SPEED])
        elif b[PREVIOUS_STATE] == JOINED or is_joined(b[MODE]):
            u = s.v_before
        found[3 + 2 * k] = u
        if is_joined(b[MODE]):
            heavier += there.masses[k, RATIO]
            carried += there.masses[k, RATIO] * u
    found[1] = carried / heavier
    for k in range(len(s.bodies)):
        if is_joined(s.bodies[k, MODE]):
            found[3 + 2 * k] = found[1]


@compiled
def _after(there, model, s, v, found):
    """Change of the state by the flow over a segment, with a cycle that is longer in proportion."""
    slower = there.cycle / model.cycle
    offsets, beside = offsets_in(model, s.bodies), offsets_in(there, s.bodies)
    for k in range(len(offsets)):
        if is_on_wall(s.bodies[k, MODE]):
            offsets[k] = beside[k]
    tau, osc = s.duration * slower, primary_with(there, load_in(there, ways_in(s.bodies), offsets))
    phase = phase_at(osc.forcing, s.periods, s.time * slower)
    way, gained, _ = increments(osc, motion_from(osc, s.x, v, phase), tau)
    found[0], found[1] = v * tau + way, gained
    for k in range(len(s.bodies)):
        b = s.bodies[k]
        if is_joined(b[MODE]):
            found[2 + 2 * k], found[3 + 2 * k] = found[0], gained
        else:
            y = s.x + b[SIDE] * (model.masses[k, CLEARANCE] - b[GAP])
            u = s.v - b[SIDE] * b[RATE]
            mass = flying(there.single, mass_at(there, k), float(b[SLIP_DIRECTION]))
            way, later = body_at(mass, y, u, phase, tau)
            found[2 + 2 * k], found[3 + 2 * k] = way, later - u
