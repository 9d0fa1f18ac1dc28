"""The log of free masses in boxes of a structure: all in a row, which speaks of one mass."""

import numpy as np

from damper.engine import model as declared
from damper.engine import segment as columns
from damper.engine.compiled import compiled, plain
from damper.engine.forcing import is_odd
from damper.engine.segment import (
    COLUMNS,
    FLIGHT,
    NOTHING,
    segment_at,
    write_segment,
)
from damper.engine.tuples import changed, made_of
from damper.models.flights import has_mirror
from damper.models.several.log import OF_BODY, first_to_tell
from damper.models.structure.constants import (
    ACCUMULATION,
    BEFORE,
    BODY,
    CAUSE,
    DISPLACEMENT,
    FIRST,
    GAP,
    MODE,
    RATE,
    SIDE,
    SPEED,
    VELOCITY,
    WEIGHTS,
    WIDTH,
    OnStructure,
    StructureSegment,
    box_at,
    mass_in,
    size_of,
)

_of_mass = changed(
    StructureSegment,
    *("x", "v", "gap", "gap_rate", "side", "mode", "cause", "speed", "v_before", "first_speed"),
    *("accumulation", "body", "loss"),
)
_of_all = made_of(StructureSegment, "periods", "time", "mode", "cause", "modes", "bodies")
_read = changed(StructureSegment, "body", "loss", "modes", "bodies")


@declared.columns_of.register(OnStructure)
def _columns_of(model):
    return COLUMNS + 2 + 3 * size_of(model) + BODY * len(model.masses)


@declared.masses_in.register(OnStructure)
def _masses_in(model, state):
    y, u = state.of_each(len(model.masses))
    return np.array(y), np.array(u)


@declared.primary_in.register(OnStructure)
def _primary_in(model, state):
    count = size_of(model)
    at_rest = not (isinstance(state.x, tuple) or state.x or state.v)
    x, v = ([0.0] * count, [0.0] * count) if at_rest else state.of_coordinates(count)
    return np.array(x), np.array(v)


@declared.count_masses.register(OnStructure)
def _count_masses(model):
    return len(model.masses)


@declared.view_of_mass.register(OnStructure)
def _view_of_mass(model, body):
    return model._replace(clearance=plain(mass_in)(model.masses, body).clearance)


@has_mirror.register(OnStructure)
def _has_mirror(model):
    each = [plain(mass_in)(model.masses, k) for k in range(len(model.masses))]
    alike = all(m.left == m.right and m.left_table == m.right_table for m in each)
    # Under gravity the force has a weight beside it, so it is not odd.
    return alike and plain(is_odd)(model.forcing)


@declared.log_of_mass.register(OnStructure)
def _log_of_mass(model, log, body):
    made, others, n = log.copy(), log[:, COLUMNS] != body, size_of(model)
    first = COLUMNS + 2 + 3 * n + BODY * body
    for column, field in OF_BODY:
        made[others, column] = log[others, first + field]
    made[others, columns.CAUSE], made[others, columns.SPEED] = NOTHING, 0.0
    made[others, columns.ACCUMULATION] = np.maximum(log[others, first + ACCUMULATION], 0.0)
    modes = log[:, COLUMNS + 2 : COLUMNS + 2 + 3 * n].reshape(-1, 3, n)
    of_box = modes @ model.table[WEIGHTS + body, :n]
    made[:, columns.X], made[:, columns.V] = of_box[:, DISPLACEMENT], of_box[:, VELOCITY]
    made[:, COLUMNS] = body
    return made


@declared.read_segment.of(OnStructure)
def _read_segment(model, row):
    count, n = len(model.masses), size_of(model)
    modes, bodies = np.zeros((3, n)), np.zeros((count, WIDTH))
    place = COLUMNS + 2
    for i in range(3):
        for j in range(n):
            modes[i, j] = row[place]
            place += 1
    for k in range(count):
        for column in range(BODY):
            bodies[k, column] = row[place]
            place += 1
    return _read(segment_at(row), float(row[COLUMNS]), float(row[COLUMNS + 1]), modes, bodies)


@declared.write_row.of(OnStructure)
def _write_row(model, row, segment, duration):
    write_segment(row, segment, duration)
    row[COLUMNS], row[COLUMNS + 1] = segment.body, segment.loss
    place = COLUMNS + 2
    for i in range(3):
        for j in range(segment.modes.shape[1]):
            row[place] = segment.modes[i, j]
            place += 1
    for k in range(len(segment.bodies)):
        for column in range(BODY):
            row[place] = segment.bodies[k, column]
            place += 1


@compiled
def report_first(model: OnStructure, s: StructureSegment, loss: float) -> StructureSegment:
    """The segment with the fields of the first mass whose cause is not told; in place."""
    k = first_to_tell(s.bodies)
    b = s.bodies[k]
    cause, speed = float(b[CAUSE]), float(b[SPEED])
    b[CAUSE] = NOTHING
    return _of_mass(
        s,
        box_at(model, s, DISPLACEMENT, k),
        box_at(model, s, VELOCITY, k),
        float(b[GAP]),
        float(b[RATE]),
        float(b[SIDE]),
        float(b[MODE]),
        cause,
        speed,
        box_at(model, s, BEFORE, k),
        float(b[FIRST]),
        max(float(b[ACCUMULATION]), 0.0),
        float(k),
        loss,
    )


@compiled
def segment_of_all(
    periods: float, time: float, modes: np.ndarray, bodies: np.ndarray
) -> StructureSegment:
    """A segment that starts here, before anything is told."""
    return _of_all(periods, time, FLIGHT, NOTHING, modes, bodies)
