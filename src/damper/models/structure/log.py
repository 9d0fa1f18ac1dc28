"""The log of free masses in boxes of a structure: all in a row, which speaks of one mass."""

import numpy as np

from damper.engine import model as declared
from damper.engine import segment as columns
from damper.engine.compiled import compiled, plain
from damper.engine.forcing import is_odd
from damper.engine.segment import COLUMNS, FLIGHT, NOTHING
from damper.engine.tuples import made_of
from damper.models.flights import has_mirror
from damper.models.many import (
    MassesSegment,
    box_of,
    have_many,
    log_of_mass,
    read_modes,
    widths_of,
    write_modes,
)
from damper.models.structure.constants import (
    BEFORE,
    BODY,
    DISPLACEMENT,
    VELOCITY,
    WEIGHTS,
    WIDTH,
    OnStructure,
    box_at,
    mass_in,
    size_of,
)

have_many(OnStructure)


@widths_of.of(OnStructure)
def _widths_of(model):
    return size_of(model), BODY, WIDTH


@box_of.of(OnStructure)
def _box_of(model, s, k):
    at = box_at(model, s, DISPLACEMENT, k), box_at(model, s, VELOCITY, k)
    return at[0], at[1], box_at(model, s, BEFORE, k)


@declared.primary_in.register(OnStructure)
def _primary_in(model, state):
    count = size_of(model)
    at_rest = not (isinstance(state.x, tuple) or state.x or state.v)
    x, v = ([0.0] * count, [0.0] * count) if at_rest else state.of_coordinates(count)
    return np.array(x), np.array(v)


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
    made, n = log_of_mass(model, log, body), size_of(model)
    modes = log[:, COLUMNS + 2 : COLUMNS + 2 + 3 * n].reshape(-1, 3, n)
    of_box = modes @ model.table[WEIGHTS + body, :n]
    made[:, columns.X], made[:, columns.V] = of_box[:, DISPLACEMENT], of_box[:, VELOCITY]
    return made


@read_modes.of(OnStructure)
def _read_modes(model, row):
    modes, place = np.zeros((3, size_of(model))), COLUMNS + 2
    for i in range(3):
        for j in range(modes.shape[1]):
            modes[i, j] = row[place]
            place += 1
    return modes


@write_modes.of(OnStructure)
def _write_modes(model, row, modes):
    place = COLUMNS + 2
    for i in range(3):
        for j in range(modes.shape[1]):
            row[place] = modes[i, j]
            place += 1


@compiled
def segment_of_all(
    periods: float, time: float, modes: np.ndarray, bodies: np.ndarray
) -> MassesSegment:
    """A segment that starts here, before anything is told."""
    return _of_all(periods, time, FLIGHT, NOTHING, modes, bodies)


_of_all = made_of(MassesSegment, "periods", "time", "mode", "cause", "modes", "bodies")
