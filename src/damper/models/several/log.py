"""The log of several free masses: all of them in a row, which speaks of one."""

import numpy as np

from damper.engine import model as declared
from damper.engine import segment as columns
from damper.engine.compiled import compiled, plain
from damper.engine.impact import DifferingWalls
from damper.engine.segment import (
    COLUMNS,
    FLIGHT,
    IMPACT,
    NOTHING,
    segment_at,
    write_segment,
)
from damper.engine.tuples import changed, made_of
from damper.models.several.bodies import (
    ACCUMULATION,
    BODY,
    CAUSE,
    CLEARANCE,
    FIRST,
    GAP,
    LEFT,
    LEFT_TABLE,
    MODE,
    RATE,
    RATIO,
    RIGHT,
    RIGHT_TABLE,
    SIDE,
    WIDTH,
    Several,
    SeveralSegment,
    body_in,
    law_of,
    mass_at,
)

_of_body = changed(
    SeveralSegment,
    *("gap", "gap_rate", "side", "mode", "cause", "speed", "v_before", "first_speed"),
    *("accumulation", "body", "loss"),
)
_with_bodies = changed(SeveralSegment, "body", "loss", "bodies")
_of_all = made_of(
    SeveralSegment, "periods", "time", "x", "v", "mode", "cause", "v_before", "bodies"
)

#: Columns of the log -> those of a body.
OF_BODY = (
    (columns.GAP, GAP),
    (columns.GAP_RATE, RATE),
    (columns.SIDE, SIDE),
    (columns.MODE, MODE),
    (columns.FIRST_SPEED, FIRST),
)


@declared.columns_of.register(Several)
def _columns_of(model):
    return COLUMNS + 2 + BODY * len(model.masses)


@declared.masses_in.register(Several)
def _masses_in(model, state):
    y, u = state.of_each(len(model.masses))
    return np.array(y), np.array(u)


@declared.count_masses.register(Several)
def _count_masses(model):
    return len(model.masses)


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


@declared.log_of_mass.register(Several)
def _log_of_mass(model, log, body):
    made = log.copy()
    others = log[:, COLUMNS] != body
    rows = log[others]
    first = COLUMNS + 2 + BODY * body
    for column, field in OF_BODY:
        made[others, column] = rows[:, first + field]
    made[others, columns.CAUSE], made[others, columns.SPEED] = NOTHING, 0.0
    made[others, columns.ACCUMULATION] = np.maximum(rows[:, first + ACCUMULATION], 0.0)
    made[:, COLUMNS] = body
    return made


@declared.read_segment.of(Several)
def _read_segment(model, row):
    count = len(model.masses)
    bodies = np.zeros((count, WIDTH))
    for k in range(count):
        for column in range(BODY):
            bodies[k, column] = row[COLUMNS + 2 + BODY * k + column]
    return _with_bodies(segment_at(row), float(row[COLUMNS]), float(row[COLUMNS + 1]), bodies)


@declared.write_row.of(Several)
def _write_row(model, row, segment, duration):
    write_segment(row, segment, duration)
    row[COLUMNS] = segment.body
    row[COLUMNS + 1] = segment.loss
    for k in range(len(segment.bodies)):
        for column in range(BODY):
            row[COLUMNS + 2 + BODY * k + column] = segment.bodies[k, column]


@compiled
def first_to_tell(bodies: np.ndarray) -> int:
    """Number of the first body whose cause is not told; 0 if there is none."""
    k = 0
    for j in range(len(bodies) - 1, -1, -1):
        cause = bodies[j, CAUSE]
        # Impacts come first: they release the masses that they kick off a wall.
        if cause == IMPACT or (cause != NOTHING and bodies[k, CAUSE] != IMPACT):
            k = j
    return k


@compiled
def report_first(s: SeveralSegment, v_before: float, loss: float) -> SeveralSegment:
    """The segment with the fields of the first body whose cause is not told; in place."""
    bodies = s.bodies
    k = first_to_tell(bodies)
    b = body_in(bodies, k)
    bodies[k, CAUSE] = NOTHING
    left = max(b.accumulation, 0.0)
    return _of_body(
        s, b.gap, b.rate, b.side, b.mode, b.cause, b.speed, v_before, b.first, left, float(k), loss
    )


@compiled
def segment_of_all(
    periods: float, time: float, x: float, v: float, bodies: np.ndarray
) -> SeveralSegment:
    """A segment that starts here, before anything is told."""
    return _of_all(periods, time, x, v, FLIGHT, NOTHING, v, bodies)
