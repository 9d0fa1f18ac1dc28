"""Events of the engine beside those of the reference in many digits, pair by pair."""

from typing import Any, NamedTuple

import numpy as np

from damper import Parameters, State, events
from damper.engine.segment import (
    CAUSE,
    CONTACT,
    FLIGHT,
    IMPACT,
    MODE,
    NOTHING,
    PERIODS,
    RELEASE,
    SEPARATION,
    SIDE,
    SPEED,
    TIME,
    V,
    X,
)
from damper.engine.trajectory import Trajectory
from damper.models import start_run
from damper.verification.reference import exact_run

#: Name of each kind in the reference -> its code in `damper.events`.
KINDS = {"impact": 0, "stick": 1, "release": 2, "rest": 4, "slip": 5, "reversal": 6}
NAMES = {code: kind for kind, code in KINDS.items()}
#: Largest error of an event: its time, x, v and approach speed, over their size where that is
#: above 1.
ERROR = 5e-11
#: Time before a mass sticks within which the last events of several are not compared: masses that
#: chatter on one wall kick each other off it until all that is left is below the tolerance, and
#: which kick is the last one is a matter of digits.
LAST = 1e-9


class Row(NamedTuple):
    """An event: kind, number of the mass and wall; and numbers."""

    kind: str
    body: int
    side: int
    time: Any
    x: Any
    v: Any
    approach_speed: Any


def rows_in_digits(
    values: dict[str, Any], state: tuple[Any, ...], until: float, digits: int = 16
) -> list[Row]:
    """Events of the reference."""
    found = exact_run(values, state, until=until, digits=digits).events
    rows = [Row(e.kind, e.body, e.side, e.time, e.x, e.v, e.approach_speed) for e in found]
    return resolved(rows) if "masses" in values else rows


def rows_of_engine(values: dict[str, Any], state: tuple[Any, ...], until: float) -> list[Row]:
    """Events of the engine; of a compliant wall the starts and ends of its force."""
    p, start = Parameters(**values), State(*state)
    if p.model == "compliant":
        return changes(p, until, start)
    table = events(p, start, until=until)
    bodies = table["body"].tolist()
    names = ("kind", "side", "time", "x", "v", "approach_speed")
    rows = [
        Row(NAMES[kind], body, *rest)
        for (kind, *rest), body in zip(table[list(names)].tolist(), bodies, strict=True)
    ]
    return resolved(rows) if p.masses else rows


def resolved(rows: list[Row]) -> list[Row]:
    """All but the last events of chatter, which move whatever rests: kicks, slips and rests."""
    kept: list[Row] = []
    dropped: dict[int, Row] = {}
    for k, row in enumerate(rows):
        near = [n for n in rows[k + 1 :] if n.kind == "stick" and -ERROR < n.time - row.time < LAST]
        if not (near if row.kind != "stick" else any(n.body == row.body for n in near)):
            # What a kick moves rests again.
            last = dropped.get(row.body, row)
            if row.kind != "rest" or last.kind != "slip" or row.time - last.time > LAST:
                kept.append(row)
                continue
        dropped[row.body] = row
    return kept


def pairs_of(
    values: dict[str, Any], state: tuple[Any, ...], until: float, digits: int = 16
) -> list[tuple[Row, Row]]:
    """Each event of the engine and that in many digits; a closed tail stands for impacts."""
    found, exact = (
        rows_of_engine(values, state, until),
        rows_in_digits(values, state, until, digits),
    )
    pairs: list[tuple[Row, Row]] = []
    for body in {row.body for row in found + exact}:
        own, others = ([row for row in rows if row.body == body] for rows in (found, exact))
        k = 0
        for row in own:
            # With friction a bounce turns round on its way.
            while row.kind == "stick" and others[k].kind in ("impact", "reversal"):
                assert others[k].side in (row.side, 0)
                k += 1
            assert row[:3] == others[k][:3], (row, others[k])
            pairs.append((row, others[k]))
            k += 1
        if k < len(others):
            # The end lies within a closed tail, which stands for what is left.
            more = rows_of_engine(values, state, until + 1.0)
            (last,) = [row for row in more if row.body == body][len(own) :][:1]
            assert last.kind == "stick"
            assert {row[:3] for row in others[k:]} == {("impact", body, last.side)}, others[k:]
    return pairs


def largest_error(pairs: list[tuple[Row, Row]]) -> float:
    """Of any number of any event."""
    errors = [0.0]
    for one, other in pairs:
        errors += [
            float(abs(a - b) / max(1, abs(b))) for a, b in zip(one[3:], other[3:], strict=True)
        ]
    return max(errors)


def growth(values: dict[str, Any], state: tuple[Any, ...], until: float) -> float:
    """How far events move with the start, over that, as long as the same ones happen."""
    x, v, *masses = state
    runs = [rows_in_digits(values, (x, there, *masses), until) for there in (v, v + 1e-13)]
    pairs: list[tuple[Row, Row]] = []
    for body in {row.body for rows in runs for row in rows}:
        for pair in zip(*([r for r in rows if r.body == body] for rows in runs), strict=False):
            if pair[0][:3] != pair[1][:3]:
                break
            pairs.append(pair)
    return largest_error(pairs) / 1e-13


def assert_as_in_digits(
    values: dict[str, Any],
    state: tuple[Any, ...],
    until: float,
    error: float = ERROR,
    digits: int = 16,
) -> list[str]:
    """All events are those of many digits; return their kinds.

    Rounding may only grow as motions part anyway.
    """
    pairs = pairs_of(values, state, until, digits)
    off = largest_error(pairs)
    assert off < error or off < 1e-14 * growth(values, state, until), (off, values, state)
    return [row.kind for row, _ in pairs]


def length_of(values: dict[str, Any], state: tuple[Any, ...], count: int = 20) -> float:
    """Until when there are some so many events, twenty unless told."""
    table = events(Parameters(**values), State(*state), until=25.0, max_events=count)
    return 25.0 if len(table) < count else float(table["time"][-2]) + 1e-3


def log_of(run: Trajectory, until: float) -> np.ndarray:
    """All segments up to a time."""
    return np.concatenate([log.copy() for log in run.segments(*run.whole_periods(until))])


def rows_of(p: Parameters, until: float, state: State | None = None) -> np.ndarray:
    """The log of a run."""
    return log_of(start_run(p, state), until)


def changes(p: Parameters, until: float, state: State | None = None) -> list[Row]:
    """Starts and ends of a compliant contact's force."""
    log = rows_of(p, until, state)
    found, before = [], log[0, MODE]
    for row in log:
        kind = None
        if row[CAUSE] == IMPACT:
            kind = "impact"
        elif row[CAUSE] in (SEPARATION, RELEASE):
            kind = "separation"
        elif row[MODE] == CONTACT and row[CAUSE] == NOTHING and before == FLIGHT:
            kind = "contact"
        if kind:
            time = float(row[PERIODS] * p.cycle + row[TIME])
            speed = float(row[SPEED]) if kind == "impact" else 0.0
            found.append(Row(kind, 0, int(row[SIDE]), time, float(row[X]), float(row[V]), speed))
        before = row[MODE]
    return found
