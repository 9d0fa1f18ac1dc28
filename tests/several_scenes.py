"""Random dampers with several free masses, and their events beside those in many digits."""

import random
from collections.abc import Callable
from typing import Any

import forced_scenes
from event_pairs import KINDS
from forced_scenes import ERROR, driven

from damper import Parameters, State, events
from damper.verification.reference import exact_run

#: Time before a mass comes to rest within which its last events are not compared: masses that
#: chatter on one wall kick each other off it until all that is left is below the tolerance, and
#: which kick is the last one is a matter of digits.
LAST = 1e-9

Row = tuple[Any, ...]


def several_scene(force: str, seed: int) -> tuple[dict[str, Any], tuple[Any, ...]]:
    """Parameters and a start of two or three masses; most chatter, and stick."""
    draw = random.Random(f"several, {force}, {seed}")
    values = driven(draw, force, (-2, 0))
    if draw.random() < 0.3:
        values["gravity"] = draw.choice([-1, 1]) * 10 ** draw.uniform(-1, 0.5)
    may_differ = {
        "mass_ratio": (0.7, lambda: 10 ** draw.uniform(-2, 0)),
        "clearance": (0.7, lambda: values["clearance"] * draw.uniform(0.5, 2)),
        "restitution": (0.5, lambda: draw.uniform(0, 0.5)),
        "restitution_left": (0.2, lambda: draw.uniform(0, 0.5)),
        "gravity": (0.2, lambda: draw.uniform(-1, 1)),
    }
    masses: list[dict[str, float]] = [{}]
    for _ in range(draw.choice([1, 1, 2])):
        own = {name: value() for name, (share, value) in may_differ.items()}
        masses.append({n: own[n] for n in own if draw.random() < may_differ[n][0]})
    values["masses"] = masses
    x = draw.uniform(-2, 2)
    clearances = [own.get("clearance", values["clearance"]) for own in masses]
    y = [x + clearance * draw.uniform(-1, 1) for clearance in clearances]
    return values, (x, draw.uniform(-1, 1), y, [draw.uniform(-1, 1) for _ in masses])


def length_of(values: dict[str, Any], state: tuple[Any, ...], count: int = 40) -> float:
    """Until when there are so many events: twice those of one mass."""
    return forced_scenes.length_of(values, state, count)


def rests_of(rows: list[Row], body: int) -> list[Any]:
    """When a body comes to rest; of what is closer than `LAST` the latest."""
    found: list[Any] = []
    for row in reversed(rows):
        if row[:2] == (KINDS["stick"], body) and not (found and found[-1] - row[3] < LAST):
            found.append(row[3])
    return found


def compared(rows: list[Row], body: int, rests: list[Any]) -> list[Row]:
    """Events of one body; of the very last before it comes to rest the one that says so."""
    kept: list[Row] = []
    over: set[Any] = set()
    for row in reversed(rows):
        if row[1] != body:
            continue
        near = next((rest for rest in rests if -ERROR < rest - row[3] < LAST), None)
        if near is None or (row[0] == KINDS["stick"] and near not in over):
            kept.append(row)
        if near is not None and row[0] == KINDS["stick"]:
            over.add(near)
    return kept[::-1]


def pairs_of(
    values: dict[str, Any], state: tuple[Any, ...], until: float
) -> list[tuple[Row, Row | None]]:
    """Each event of the engine, and the one in many digits: kind, body, side, and numbers."""
    table = events(Parameters(**values), State(*state), until=until)
    fields = ("kind", "body", "side", "time", "x", "v", "approach_speed")
    found = table[list(fields)].tolist()
    exact = [
        (KINDS[e.kind], e.body, e.side, e.time, e.x, e.v, e.approach_speed)
        for e in exact_run(values, state, until=until, digits=16).events
    ]
    pairs: list[tuple[Row, Row | None]] = []
    for body in range(len(values["masses"])):
        rests = rests_of(exact, body)
        others, k = compared(exact, body, rests), 0
        for row in compared(found, body, rests):
            if row[0] == KINDS["stick"]:
                # Impacts that a closed tail stands for.
                while k < len(others) and others[k][:3] == (KINDS["impact"], body, row[2]):
                    k += 1
            pairs.append((row, others[k] if k < len(others) else None))
            k += 1
        assert all(row[0] == KINDS["impact"] for row in others[k:])
    return pairs


def largest_error(pairs: list[tuple[Row, Row | None]]) -> float:
    """Of any number of any event."""
    errors = [0.0]
    for row, exact in pairs:
        assert exact is not None
        assert row[:3] == exact[:3], (row, exact)
        errors += [float(abs(a - b)) for a, b in zip(row[3:], exact[3:], strict=True)]
    return max(errors)


def growth(values: dict[str, Any], state: tuple[Any, ...], until: float) -> float:
    """How far events move with the start, over that, as long as the same ones happen."""
    x, v, y, u = state
    starts = [(x, v, y, u), (x, v + 1e-13, y, u)]
    both = []
    for start in starts:
        exact = exact_run(values, start, until=until, digits=16).events
        rows = [(KINDS[e.kind], e.body, e.side, e.time, e.x, e.v) for e in exact]
        own = ((body, rests_of(rows, body)) for body in range(len(y)))
        both.append([compared(rows, *each) for each in own])
    errors = [0.0]
    for one, other in zip(*both, strict=True):
        for a, b in zip(one, other, strict=False):
            if a[:3] != b[:3]:
                break
            errors += [float(abs(p - q)) for p, q in zip(a[3:], b[3:], strict=True)]
    return max(errors) / 1e-13


# --- with dry friction


def rubbing_scene(force: str, seed: int) -> tuple[dict[str, Any], tuple[Any, ...]]:
    """As `several_scene`, with friction of all, of some their own, of some none."""
    values, state = several_scene(force, seed)
    draw = random.Random(f"rubbing, {force}, {seed}")
    values["friction"] = 10 ** draw.uniform(-2.5, 0)
    for own in values["masses"][1:]:
        if draw.random() < 0.5:
            own["friction"] = draw.choice([0.0, 10 ** draw.uniform(-2.5, 0)])
    return values, state


def supported(
    scene: Callable[[str, int], tuple[dict[str, Any], tuple[Any, ...]]], force: str, seed: int
) -> tuple[dict[str, Any], tuple[Any, ...]]:
    """A scene with supports, of all masses, of some their own or none; every third one yields."""
    values, state = scene(force, seed)
    draw = random.Random(f"supported, {force}, {seed}")
    mu = values["mass_ratio"]
    values["support_stiffness_ratio"] = draw.choice([0.0, mu * 10 ** draw.uniform(-2, 1)])
    values["support_damping_ratio"] = mu * 10 ** draw.uniform(-2, 0.5)
    for own in values["masses"][1:]:
        if draw.random() < 0.5:
            own["support_stiffness_ratio"] = draw.choice([0.0, 10 ** draw.uniform(-3, 0)])
        if draw.random() < 0.3:
            own["support_damping_ratio"] = draw.choice([0.0, 10 ** draw.uniform(-3, -1)])
    if seed % 3 == 2:
        values["yield_speed"] = 10 ** draw.uniform(-2.5, 0)
        values["masses"][-1]["yield_speed"] = 10 ** draw.uniform(-2.5, 0)
    return values, state


def resolved(rows: list[Row]) -> list[Row]:
    """All but the last events of chatter, which move whatever rests: kicks, slips and rests."""
    kept: list[Row] = []
    dropped: dict[int, Row] = {}
    for k, row in enumerate(rows):
        near = [
            n for n in rows[k + 1 :] if n[0] == KINDS["stick"] and -ERROR < n[3] - row[3] < LAST
        ]
        if not (near if row[0] != KINDS["stick"] else any(n[1] == row[1] for n in near)):
            # What a kick moves rests again.
            last = dropped.get(row[1], (row[0],))
            if row[0] != KINDS["rest"] or last[0] != KINDS["slip"] or row[3] - last[3] > LAST:
                kept.append(row)
                continue
        dropped[row[1]] = row
    return kept


def rubbing_error(values: dict[str, Any], state: tuple[Any, ...], until: float) -> float:
    """Largest error of any number of any event, of masses that rub."""
    table = events(Parameters(**values), State(*state), until=until)
    found = resolved(table[["kind", "body", "side", "time", "x", "v", "approach_speed"]].tolist())
    exact = resolved(
        [
            (KINDS[e.kind], e.body, e.side, e.time, e.x, e.v, e.approach_speed)
            for e in exact_run(values, state, until=until, digits=16).events
        ]
    )
    pairs: list[tuple[Row, Row | None]] = []
    for body in range(len(values["masses"])):
        own, other = ([row for row in rows if row[1] == body] for rows in (found, exact))
        k = 0
        for row in own:
            # What a closed tail stands for: impacts, and where they turn round.
            while row[0] == KINDS["stick"] and other[k][0] in (KINDS["impact"], KINDS["reversal"]):
                k += 1
            pairs.append((row, other[k]))
            k += 1
        assert k == len(other)
    return largest_error(pairs)
