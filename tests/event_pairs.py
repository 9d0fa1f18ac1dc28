"""Events of the engine beside those of a reference with many digits, pair by pair."""

import numpy as np

from damper.verification.comparison import reference_rigid as reference

#: Name of each kind in the reference -> its code in `damper.events`.
KINDS = {"impact": 0, "stick": 1, "release": 2}

Pairs = list[tuple[np.void, reference.Event]]


def paired(found: np.ndarray, exact: list[reference.Event]) -> Pairs:
    """Pair engine and reference; impacts that the engine's tail stands for have no partner."""
    pairs, k = [], 0
    for row in found:
        if row["kind"] == KINDS["stick"]:
            while k < len(exact) and exact[k].kind == "impact" and exact[k].side == row["side"]:
                k += 1
        if k == len(exact):
            break
        pairs.append((row, exact[k]))
        k += 1
    return pairs


def distance(row: np.void | reference.Event, event: reference.Event) -> float:
    """Return the largest difference in time, position, velocity and approach speed."""
    names = ("time", "x", "v", "approach_speed")
    if isinstance(row, np.void):
        values = [row[name] for name in names]
    else:
        values = [getattr(row, name) for name in names]
    exact = [getattr(event, name) for name in names]
    return max(float(abs(one - two)) for one, two in zip(values, exact, strict=True))


def assert_agree(pairs: Pairs, error: float) -> None:
    """Same kinds and sides in order, and every value within `error`."""
    for row, event in pairs:
        assert (row["kind"], row["side"]) == (KINDS[event.kind], event.side)
        assert distance(row, event) <= error
