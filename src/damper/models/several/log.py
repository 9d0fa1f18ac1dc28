"""The log of several free masses on one primary."""

import numpy as np

from damper.engine import model as declared
from damper.engine.compiled import compiled, plain
from damper.engine.impact import DifferingWalls
from damper.engine.segment import FLIGHT, NOTHING
from damper.engine.tuples import made_of
from damper.models.many import MassesSegment, have_many, widths_of
from damper.models.several.bodies import (
    BODY,
    CLEARANCE,
    LEFT,
    LEFT_TABLE,
    RATIO,
    RIGHT,
    RIGHT_TABLE,
    WIDTH,
    Several,
    mass_at,
)
from damper.models.wall_laws import law_of

have_many(Several)


@widths_of.of(Several)
def _widths_of(model):
    return 0, BODY, WIDTH


@declared.view_of_mass.register(Several)
def _view_of_mass(model, body):
    own = model.masses[body]
    # No motion has a mirror image where the walls of any mass differ.
    walls = model.masses[:, [LEFT, LEFT_TABLE]] != model.masses[:, [RIGHT, RIGHT_TABLE]]
    unlike = np.flatnonzero(walls.any(axis=1))
    m = plain(mass_at)(model, int(unlike[0]) if len(unlike) else body)
    left, right = (plain(law_of)(model.single, m, side) for side in (-1.0, 1.0))
    return model._replace(
        mass_ratio=float(own[RATIO]),
        clearance=float(own[CLEARANCE]),
        law=DifferingWalls(left, right),
    )


@declared.with_walls_at.register(Several)
def _with_walls_at(model, clearance):
    masses = model.masses.copy()
    masses[:, CLEARANCE] = clearance
    return model._replace(clearance=clearance, masses=masses)


@compiled
def segment_of_all(
    periods: float, time: float, x: float, v: float, bodies: np.ndarray
) -> MassesSegment:
    """A segment that starts here, before anything is told."""
    return _of_all(periods, time, x, v, FLIGHT, NOTHING, v, bodies)


_of_all = made_of(MassesSegment, "periods", "time", "x", "v", "mode", "cause", "v_before", "bodies")
