"""Events of two versions beside each other, over random scenes of all models.

Correct versions round differently, and a chaotic run multiplies that about tenfold every two or
three impacts. So each scene is run again with its numbers changed by `NOISE`, and with complete
bursts closed more accurately. Time, approach speed, x and v of event k may differ by

    TOLERANCE * (eps * size + largest difference of those runs up to event k)

each. From where those runs disagree in an event's kind or side, or by `LOST` of the size, nothing
is compared. A yardstick: one version with the force reversed differs from itself by 0.003, 0.03,
0.1 of what is allowed in 50, 90, 99 % of the scenes.
"""

import json
import math
import random
from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from compare_versions import Version, parameters_of

NOISE, TOLERANCE, LOST = 1e-14, 10.0, 1e-4
#: Settings of the runs with noise.
NOISY = [{}] * 3 + [{"accuracy": 1e-13}] * 3
SEED = 20240229
#: Scenes of each model, and what it adds to the rigid one.
MODELS = {
    "rigid": (900, ()),
    "grounded": (600, ("support_stiffness_ratio", "support_damping_ratio")),
    "compliant": (600, ("contact_stiffness_ratio",)),
    "time-varying": (600, ("modulation_depth",)),
}
#: Generic range, promised range, probability of zero.
RANGES = {
    "mass_ratio": ((1e-2, 1.0), (1e-6, 1e6), 0.0),
    "damping_ratio": ((1e-3, 1.0), (1e-6, 10.0), 0.15),
    "frequency_ratio": ((0.1, 3.0), (1e-3, 1e3), 0.0),
    "clearance": ((1e-2, 10.0), (1e-6, 1e4), 0.04),
    "support_stiffness_ratio": ((1e-3, 1.0), (1e-6, 1e4), 0.2),
    "support_damping_ratio": ((1e-3, 1.0), (1e-6, 10.0), 0.3),
    "contact_stiffness_ratio": ((1.0, 1e5), (1e-2, 1e8), 0.0),
    "modulation_depth": ((0.05, 0.9), (1e-4, 0.999), 0.0),
    "heavy": ((1e-2, 1.0), (1e-6, 1e18), 0.0),
    "speed": ((1e-2, 10.0), (1e-6, 1e2), 0.2),
    "cycles": ((5.0, 50.0), (2.0, 50.0), 0.0),
}
TIME, KIND, SIDE, SPEED, X, V = range(6)
VALUES = [TIME, SPEED, X, V]
IMPACT, STICK, RELEASE, STOPPED = range(4)


class Reference(NamedTuple):
    """A scene's events, how far runs with noise come off, how many agree, why it was refused."""

    rows: np.ndarray
    spread: np.ndarray
    agreed: int
    refusal: str


def random_scene(draw: random.Random, model: str) -> dict:
    """Model, parameters, start (None: from rest) and end of a scene."""
    promised = draw.random() < 0.5

    def size(name: str) -> float:
        *ranges, zero = RANGES[name]
        low, high = map(math.log, ranges[promised])
        return 0.0 if draw.random() < zero else math.exp(draw.uniform(low, high))

    names = ("mass_ratio", "damping_ratio", "frequency_ratio", "clearance", *MODELS[model][1])
    p = {name: size(name) for name in names}
    near_one = 1.0 - 10.0 ** draw.uniform(-6, -1)
    p["restitution"] = draw.choice([0.0, 1.0, near_one, *(draw.random() for _ in range(6))])
    p["phase"] = draw.uniform(0.0, 2.0 * math.pi)
    if model == "rigid":
        p["mass_ratio"] = size("heavy")
    elif model == "compliant":
        p["contact_tension"] = draw.choice((0.0, 0.0, 1.0))
        p["restitution"] = max(p["restitution"], 0.01 * (1.0 - p["contact_tension"]))
    elif model == "time-varying":
        p["modulation_order"] = draw.choice((1, 1, 2, 3, 7))
        p["modulation_phase"] = draw.uniform(0.0, 2.0 * math.pi)
    slow = 2.0 * math.pi * max(1.0, 1.0 / p["frequency_ratio"])
    # Fast enough to cross a large box; in the centre, on a wall, anywhere.
    speed = size("speed") * draw.choice((-1.0, 1.0)) * max(1.0, p["clearance"] / slow)
    position = draw.choice((0.0, -1.0, 1.0, *(draw.uniform(-1.0, 1.0) for _ in range(7))))
    start = (draw.gauss(0, 1), draw.gauss(0, 1), position, speed)
    start = start if draw.random() < 0.6 else None
    return {"model": model, "parameters": p, "start": start, "until": slow * size("cycles")}


def with_noise(scene: dict, draw: random.Random) -> dict:
    """The scene with its numbers changed a little; whole numbers are edges and stay."""

    def noisy(value: float) -> float:
        return value if value == int(value) else value * (1.0 + NOISE * draw.uniform(-1, 1))

    p = {name: noisy(value) for name, value in scene["parameters"].items()}
    if scene["start"] is None:
        return scene | {"parameters": p}
    x, v, position, speed = map(noisy, scene["start"])
    if abs(position) < 1.0 and p["clearance"] > 0.0:
        # The place of the free mass is rounded as x is, also in a narrow box.
        position += NOISE * draw.uniform(-1, 1) * abs(x) / p["clearance"]
        position = min(max(position, -1.0), 1.0)
    return scene | {"parameters": p, "start": (x, v, position, speed)}


def events_of(scene: dict, settings: dict[str, float]) -> np.ndarray:
    """Rows of time, kind, side, approach speed, x, v."""
    import damper

    p, state = damper.Parameters(**parameters_of(scene["parameters"])), None
    if scene["start"]:
        x, v, position, relative_velocity = scene["start"]
        state = damper.State(x, v, x + position * p.clearance, v + relative_velocity)
    rows = damper.events(p, state, until=scene["until"], max_events=300, **settings)
    names = ("time", "kind", "side", "approach_speed", "x", "v")
    return np.stack([rows[name].astype(float) for name in names], axis=1)


def references(version: Version) -> tuple[list[dict], list[Reference]]:
    """Random scenes and their references."""
    draw = random.Random(SEED)
    scenes = [random_scene(draw, model) for model in MODELS for _ in range(MODELS[model][0])]
    return scenes, [reference(version, scene, draw) for scene in scenes]


def reference(version: Version, scene: dict, draw: random.Random) -> Reference:
    """Run a scene with and without noise."""
    rows = version.call(events_of, scene, {})
    others = [version.call(events_of, with_noise(scene, draw), settings) for settings in NOISY]
    if isinstance(rows, Exception):
        return Reference(np.empty((0, 6)), np.empty((0, 4)), 0, repr(rows))
    spread, agreed = np.zeros((len(rows), 4)), len(rows)
    for other in others:
        mine, its = common(rows, rows[:0] if isinstance(other, Exception) else other)
        apart = np.zeros_like(spread)
        apart[mine] = difference(rows[mine], other[its]) if len(mine) else 0.0
        spread = np.maximum(spread, np.maximum.accumulate(apart))
        agreed = min(agreed, int(mine[-1]) + 1 if len(mine) else 0)
    return Reference(rows, spread, agreed, "")


def common(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the rows of two runs that are the same events, up to where the runs part.

    A complete burst may be closed after different numbers of impacts: those that only one of the
    runs has are left out.
    """
    i = j = 0
    pairs = [np.empty((0, 2), dtype=int)]
    while True:
        n = min(len(a) - i, len(b) - j)
        same = (a[i : i + n, KIND : SIDE + 1] == b[j : j + n, KIND : SIDE + 1]).all(axis=1)
        k = n if same.all() else int(np.argmin(same))
        pairs.append(np.arange(k)[:, None] + (i, j))
        i, j = i + k, j + k
        if k == n or a[i, SIDE] != b[j, SIDE] or STICK not in (a[i, KIND], b[j, KIND]):
            break
        i, j = i + impacts_left(a[i:]), j + impacts_left(b[j:])
        if i == len(a) or j == len(b) or not a[i, KIND] == b[j, KIND] == STICK:
            break
    return tuple(np.concatenate(pairs).T)


def impacts_left(rows: np.ndarray) -> int:
    """How many impacts on the first one's wall come before anything else."""
    others = (rows[:, KIND] != IMPACT) | (rows[:, SIDE] != rows[0, SIDE])
    return int(np.argmax(others)) if others.any() else len(rows)


def difference(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Absolute differences of time, approach speed, x and v."""
    return np.where(a[:, VALUES] == b[:, VALUES], 0.0, np.abs(a[:, VALUES] - b[:, VALUES]))


def save(path: Path, scenes: list[dict], found: list[Reference]) -> None:
    """Write scenes and references."""
    rest = [(len(item.rows), item.agreed, item.refusal) for item in found]
    both = np.concatenate([np.hstack(item[:2]) for item in found])
    np.savez_compressed(path, rows=both, texts=[json.dumps(scenes), json.dumps(rest)])


def load(path: Path) -> tuple[list[dict], list[Reference]]:
    """Read scenes and references."""
    with np.load(path) as file:
        rows, (scenes, rest) = file["rows"], map(json.loads, file["texts"])
    pieces = np.split(rows, np.cumsum([length for length, *_ in rest])[:-1])
    known = zip(pieces, rest, strict=True)
    return scenes, [Reference(both[:, :6], both[:, 6:], *more) for both, (_, *more) in known]


def allowed_and_end(scene: dict, before: Reference) -> tuple[np.ndarray, int]:
    """What each event may differ by, and the first one that is lost to chaos."""
    rows = before.rows
    speed = np.maximum.accumulate(np.abs(rows[:, V]) + rows[:, SPEED])
    place = np.maximum.accumulate(np.abs(rows[:, X])) + scene["parameters"]["clearance"]
    sizes = np.stack([np.abs(rows[:, TIME]), speed, place, speed], axis=1)
    lost = np.append((before.spread > LOST * sizes).any(axis=1), True)
    # What ends sticking changes as omega^3 t under slow forcing: rounding of x moves a release.
    flat = np.where(rows[:, KIND] == RELEASE, scene["parameters"]["frequency_ratio"] ** -3, 0.0)
    sizes[:, [0, 2]] += np.stack([flat, np.abs(rows[:, V]) * flat], axis=1)
    # The smallest number: where nothing is rounded nothing may differ.
    rounding = np.finfo(float).eps * sizes + np.finfo(float).tiny
    return TOLERANCE * (rounding + before.spread), min(before.agreed, int(np.argmax(lost)))


def judge(scene: dict, before: Reference, after: Any) -> dict:
    """What came of a scene: verdict, events compared, largest difference over what is allowed."""
    refusals = before.refusal, repr(after) if isinstance(after, Exception) else ""
    if any(refusals):
        which = "both" if all(refusals) else "before only" if before.refusal else "after only"
        result = {"verdict": f"refused by {which}", "text": " / ".join(refusals)}
        return result | {"compared": 0, "chaotic": False, "ratio": 0.0}
    rows = before.rows
    allowed, end = allowed_and_end(scene, before)
    mine, its = common(rows, after)
    i, j = (mine[-1] + 1, its[-1] + 1) if len(mine) else (0, 0)
    its, mine = its[mine < end], mine[mine < end]
    apart = difference(rows[mine], after[its])
    ratio = (apart / allowed[mine]).max(axis=1, initial=0.0)
    verdict, text = "within rounding", ""
    if rows.shape == after.shape and rows.tobytes() == after.tobytes():
        verdict = "identical"
    elif not (ratio <= 1.0).all():
        k = int(np.argmin(ratio <= 1.0))
        here = [values.tolist() for values in (rows[mine[k], VALUES], apart[k], allowed[mine[k]])]
        words = [
            f"{value!r} by {off:.2g} of {most:.2g}" for value, off, most in zip(*here, strict=True)
        ]
        verdict = "beyond"
        text = f"event {mine[k]}: time, approach speed, x, v = {', '.join(words)}"
    elif i < end or end == len(rows):
        # The first event that only one of the runs has, unless that is at their very end.
        rest = [*rows[i : i + 1, :3].tolist(), *after[j : j + 1, :3].tolist()]
        if any(time < scene["until"] * (1.0 - 1e-9) for time, *_ in rest):
            verdict = "stop differs" if any(kind == STOPPED for _, kind, _ in rest) else "beyond"
            text = f"event {i}: [time, kind, side] {rest} of {len(rows)} -> {len(after)}"
    numbers = {"compared": len(mine), "chaotic": end < len(rows), "ratio": ratio.max(initial=0.0)}
    return numbers | {"verdict": verdict, "text": text}


def compare(before: Path, after: Path, listed: int) -> None:
    """Print what came of every scene, model by model."""
    scenes, known = load(before) if before.suffix == ".npz" else references(Version(before))
    version = Version(after)
    results = [
        scene | judge(scene, reference, version.call(events_of, scene, {}))
        for scene, reference in zip(scenes, known, strict=True)
    ]
    for model in MODELS:
        here = [result for result in results if result["model"] == model]
        counts = Counter(result["verdict"] for result in here)
        print(f"\n{model}: " + ", ".join(f"{counts[name]} {name}" for name in sorted(counts)))
        compared, chaotic = (sum(result[key] for result in here) for key in ("compared", "chaotic"))
        print(f"  {compared} events compared; {chaotic} scenes chaotic from some event on")
        ratios = np.quantile([result["ratio"] for result in here], (0.5, 0.9, 0.99, 1.0))
        words = ", ".join(f"{ratio:.2g}" for ratio in ratios)
        print(f"  largest difference over what is allowed, 50, 90, 99, 100 % of scenes: {words}")
        for verdict in sorted(counts.keys() - {"identical", "within rounding", "refused by both"}):
            these = [result for result in here if result["verdict"] == verdict]
            for result in sorted(these, key=lambda result: -result["ratio"])[:listed]:
                print(f"  {verdict}: {result['text']}\n    {result['parameters']!r}")
                print(f"    start {result['start']!r}, until {result['until']!r}")
