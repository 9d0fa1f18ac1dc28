"""Events of the engine beside those of the reference in many digits, pair by pair."""

from typing import Any

import numpy as np

from damper import Parameters, State
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
from damper.verification.reference import Event, exact_run

#: Name of each kind in the reference -> its code in `damper.events`.
KINDS = {"impact": 0, "stick": 1, "release": 2, "rest": 4, "slip": 5, "reversal": 6}
#: What a bounce consists of; with friction it turns round on its way.
BOUNCE = ("impact", "reversal")
#: Parameters of a scene that is given by their positions.
NAMES = (
    *("mass_ratio", "damping_ratio", "frequency_ratio", "clearance", "restitution", "phase"),
    *("support_stiffness_ratio", "support_damping_ratio"),
)

Pairs = list[tuple[np.void, Event]]


def exact_events(scene: tuple, state: tuple = (0, 0, 0, 0), **settings: Any) -> list[Event]:
    """Run the reference on a scene, the parameters of `NAMES`."""
    return exact_run(dict(zip(NAMES, scene, strict=False)), state, **settings).events


def paired(found: np.ndarray, exact: list[Event]) -> Pairs:
    """Pair engine and reference; impacts that the engine's tail stands for have no partner."""
    pairs, k = [], 0
    for row in found:
        if row["kind"] == KINDS["stick"]:
            while k < len(exact) and (exact[k].kind, exact[k].side) in (
                ("impact", row["side"]),
                ("reversal", 0),
            ):
                k += 1
        if k == len(exact):
            break
        pairs.append((row, exact[k]))
        k += 1
    return pairs


def distance(row: np.void | Event, event: Event, relative: bool = False) -> float:
    """Return the largest difference in time, position, velocity and approach speed.

    A `relative` one is over the value, where that is above 1.
    """
    worst = 0.0
    for name in ("time", "x", "v", "approach_speed"):
        exact = getattr(event, name)
        value = row[name] if isinstance(row, np.void) else getattr(row, name)
        worst = max(worst, float(abs(value - exact) / (max(1, abs(exact)) if relative else 1)))
    return worst


def assert_agree(pairs: Pairs, error: float, relative: bool = False) -> None:
    """Same kinds and sides in order, and every value within `error`."""
    for row, event in pairs:
        assert (row["kind"], row["side"]) == (KINDS[event.kind], event.side)
        assert distance(row, event, relative) <= error


def assert_same(
    found: np.ndarray, exact: list[Event], error: float, relative: bool = False
) -> None:
    """Agree in every event, but the impacts that a closed tail of the engine stands for."""
    pairs = paired(found, exact)
    assert len(pairs) == len(found)
    others = [event.kind for event in exact if event.kind not in BOUNCE]
    assert [event.kind for _, event in pairs if event.kind not in BOUNCE] == others
    assert_agree(pairs, error, relative)


def log_of(run: Trajectory, until: float) -> np.ndarray:
    """All segments up to a time."""
    return np.concatenate([log.copy() for log in run.segments(*run.whole_periods(until))])


def rows_of(p: Parameters, until: float, state: State | None = None) -> np.ndarray:
    """The log of a run."""
    return log_of(start_run(p, state), until)


def changes(p: Parameters, until: float, state: State | None = None) -> list[tuple]:
    """Starts and ends of a compliant contact's force: kind, side, time, x, v, approach speed."""
    found, before = [], FLIGHT
    for row in rows_of(p, until, state):
        kind = None
        if row[CAUSE] == IMPACT:
            kind = "impact"
        elif row[CAUSE] in (SEPARATION, RELEASE):
            kind = "separation"
        elif row[MODE] == CONTACT and row[CAUSE] == NOTHING and before == FLIGHT:
            kind = "contact"
        if kind:
            time = row[PERIODS] * p.cycle + row[TIME]
            speed = row[SPEED] if kind == "impact" else 0.0
            found.append((kind, int(row[SIDE]), time, row[X], row[V], speed))
        before = row[MODE]
    return found
