"""Many free masses in rows of an array, the segment with all of them, and its log.

Each model has constants of its own for what carries the masses: one primary mass, or a structure.
"""

from typing import Any, NamedTuple

import numpy as np

from damper.engine import model as declared
from damper.engine import segment as columns
from damper.engine.compiled import compiled, plain
from damper.engine.dispatch import by_class, by_class_or_default
from damper.engine.segment import (
    COLUMNS,
    FLIGHT,
    IMPACT,
    NOTHING,
    STICKING,
    TAIL,
    segment_at,
    write_segment,
)
from damper.engine.tuples import changed

#: First columns of `MassesSegment.bodies`, as the fields of a `Segment`; each model has more.
#:
#: - cause: event not yet written to the log;
#: - speed: approach speed of an impact at this instant;
#: - accumulation: time left of a tail, or `LIFTS`.
GAP, RATE, SIDE, MODE, CAUSE, SPEED, FIRST, ACCUMULATION = range(8)
#: In place of an accumulation: the mass has left its wall without a jump of the force just now, so
#: its gap has no second derivative, exactly.
LIFTS = -1.0
#: Part of the tolerance that may be left of a pinch, whose impacts alone happen meanwhile, or of a
#: sequence which others disturb: they prolong it.
_NOTHING_LEFT = 1e-2
#: Columns of the log -> those of a body.
_OF_BODY = (
    (columns.GAP, GAP),
    (columns.GAP_RATE, RATE),
    (columns.SIDE, SIDE),
    (columns.MODE, MODE),
    (columns.FIRST_SPEED, FIRST),
)
#: First column of the log that a `Segment` does not have: the number of its mass, then the loss.
_OF_ALL = COLUMNS + 2


class MassesSegment(NamedTuple):
    """A segment; the fields of `damper.engine.segment.Segment` are those of one free mass.

    `x` and `v` are of its box. Of events at one instant each begins a segment of its own; all but
    the last of them have no length.
    """

    periods: float
    time: float
    x: float
    v: float
    gap: float
    gap_rate: float
    side: float
    mode: float
    cause: float
    speed: float
    v_before: float
    first_speed: float
    accumulation: float
    duration: float
    y: float
    u: float
    body: float
    """Number of the free mass that the other fields speak of, from 0."""
    loss: float
    """Energy lost in all impacts of this instant; the first of their segments has it."""
    modes: Any
    """(3, n) the structure; 0 where one primary mass carries the masses."""
    bodies: np.ndarray
    """A row for each free mass."""


@by_class
def widths_of(model: Any) -> tuple[int, int, int]:
    """How many modes the structure has, 0 for one primary mass; columns of a body: log's, all."""


@by_class_or_default
def box_of(model: Any, s: MassesSegment, k: int) -> tuple[float, float, float]:
    """Displacement and velocity of a mass's box, and its velocity before the event."""
    return s.x, s.v, s.v_before


@by_class_or_default
def read_modes(model: Any, row: np.ndarray) -> Any:
    """Read `MassesSegment.modes` from a row of the log."""
    return 0.0


@by_class_or_default
def write_modes(model: Any, row: np.ndarray, modes: Any) -> None:
    """Write `MassesSegment.modes` into a row of the log."""


def have_many(kind: type) -> None:
    """Let the log of a model be that of many masses."""
    declared.columns_of.register(kind)(_columns_of)
    declared.masses_in.register(kind)(_masses_in)
    declared.count_masses.register(kind)(_count_masses)
    declared.log_of_mass.register(kind)(log_of_mass)
    declared.read_segment.of(kind)(_read_segment)
    declared.write_row.of(kind)(_write_row)


def _columns_of(model):
    modes, columns_of_body, _ = plain(widths_of)(model)
    return _OF_ALL + 3 * modes + columns_of_body * len(model.masses)


def _masses_in(model, state):
    y, u = state.of_each(len(model.masses))
    return np.array(y), np.array(u)


def _count_masses(model):
    return len(model.masses)


def log_of_mass(model: Any, log: np.ndarray, body: int) -> np.ndarray:
    """As `damper.engine.model.log_of_mass`; of a structure, with the displacements as they are."""
    modes, columns_of_body, _ = plain(widths_of)(model)
    made, others = log.copy(), log[:, COLUMNS] != body
    first = _OF_ALL + 3 * modes + columns_of_body * body
    for column, field in _OF_BODY:
        made[others, column] = log[others, first + field]
    made[others, columns.CAUSE], made[others, columns.SPEED] = NOTHING, 0.0
    made[others, columns.ACCUMULATION] = np.maximum(log[others, first + ACCUMULATION], 0.0)
    made[:, COLUMNS] = body
    return made


@compiled
def _read_segment(model, row):
    modes, width, whole = widths_of(model)
    bodies, place = np.zeros((len(model.masses), whole)), _OF_ALL + 3 * modes
    for k in range(len(bodies)):
        for column in range(width):
            bodies[k, column] = row[place]
            place += 1
    of_one, number, loss = segment_at(row), float(row[COLUMNS]), float(row[COLUMNS + 1])
    return _read(of_one, number, loss, read_modes(model, row), bodies)


_read = changed(MassesSegment, "body", "loss", "modes", "bodies")


@compiled
def _write_row(model, row, segment, duration):
    modes, width, _ = widths_of(model)
    place = _OF_ALL + 3 * modes
    write_segment(row, segment, duration)
    row[COLUMNS], row[COLUMNS + 1] = segment.body, segment.loss
    write_modes(model, row, segment.modes)
    for k in range(len(segment.bodies)):
        for column in range(width):
            row[place] = segment.bodies[k, column]
            place += 1


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
def report_first(model: Any, s: MassesSegment, loss: float) -> MassesSegment:
    """The segment with the fields of the first body whose cause is not told; in place."""
    bodies, k = s.bodies, first_to_tell(s.bodies)
    x, v, v_before = box_of(model, s, k)
    told = _of_body(
        s,
        x,
        v,
        float(bodies[k, GAP]),
        float(bodies[k, RATE]),
        float(bodies[k, SIDE]),
        float(bodies[k, MODE]),
        float(bodies[k, CAUSE]),
        float(bodies[k, SPEED]),
        v_before,
        float(bodies[k, FIRST]),
        max(float(bodies[k, ACCUMULATION]), 0.0),
        float(k),
        loss,
    )
    bodies[k, CAUSE] = NOTHING
    return told


with_bodies = changed(MassesSegment, "bodies")
_of_body = changed(
    MassesSegment,
    *("x", "v", "gap", "gap_rate", "side", "mode", "cause", "speed", "v_before", "first_speed"),
    *("accumulation", "body", "loss"),
)


@compiled
def before_event(
    s: MassesSegment, k: int, mode: float, box: float, velocity: float
) -> tuple[float, float]:
    """Velocity and mode of a mass just before the impacts at a segment's start.

    `velocity` is that of the mass after the impacts, and `box` that of its box before them. A mass
    that is not hit keeps its `mode`.
    """
    b = s.bodies[k]
    told = k == int(s.body) and s.cause == IMPACT
    if told or b[CAUSE] == IMPACT:
        return box + float(b[SIDE]) * (s.speed if told else float(b[SPEED])), FLIGHT
    # A mass that is not hit goes on; a mass that sticks moves with its box.
    return box if mode == STICKING else velocity, mode


@compiled
def is_on_wall(mode: float) -> bool:
    """Whether a free mass sticks to its wall, or will where its tail ends."""
    return mode in (STICKING, TAIL)


@compiled
def negligible(tolerance: float) -> float:
    """Longest time that counts as none."""
    return _NOTHING_LEFT * tolerance
