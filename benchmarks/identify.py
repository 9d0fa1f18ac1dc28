"""How often `damper.identify` finds random dampers in records of them, and says so if not.

python benchmarks/identify.py intervals 200
python benchmarks/identify.py impacts 200
python benchmarks/identify.py displacement 60 0.1
python benchmarks/identify.py acceleration 60 0.01 1000

A damper is `held` where all intervals hold the truth, `missed` where one does not, and `wrong`
where one misses the truth by more than half of its width; it is `worse` where the sum of squares is
larger than with the true values, so that the search has failed. It is `warned` where a warning
doubts the fit: any but those that the data tell too little. After every ten dampers:

- how many are held, missed and wrong, with and without a warning;
- how often each warning comes;
- for each unknown, the part of them whose 95 % interval holds the truth, with its binomial 95 %
  limits.

White noise is 1 % of the first displacement and acceleration, or of the mean time between impacts,
unless a third argument says so. A fourth one is the number of the first damper, 0. An impact within
0.1 after the last one that was heard is not heard.
"""

import math
import random
import sys
from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.stats import binomtest

import damper
from damper.identification.problem import RecordedDamper
from damper.sweep.points import one_run

_FREE = {
    "intervals": ["restitution", "initial_position"],
    "impacts": ["restitution", "clearance", "damping_ratio"],
    "displacement": ["restitution", "clearance", "damping_ratio", "initial_displacement"],
    "acceleration": ["restitution", "clearance", "damping_ratio", "initial_displacement"],
}
#: A ball on a heavy floor, in units of its height and weight: gravity is 1.
_FLOOR = {"mass_ratio": 1e-6, "damping_ratio": 0.0, "clearance": 10.0, "gravity": 1.0}

#: Rms of the residual of an exact record.
_EXACT = 1e-8
#: Time between the three velocities whose parabola has the slope that is an acceleration.
_LITTLE = 1e-5


def truth(kind: str, generator: random.Random) -> dict[str, Any]:
    """Return a random damper and its start."""
    common = {"frequency_ratio": 1.0, "forcing": "none"}
    if kind == "intervals":
        height = generator.uniform(0.5, 2.0)
        r = generator.uniform(0.5, 0.95)
        return common | _FLOOR | {"restitution": r, "initial_position": height / 10.0 - 1.0}
    return common | {
        "mass_ratio": generator.uniform(0.05, 0.2),
        "damping_ratio": generator.uniform(0.005, 0.03),
        "clearance": generator.uniform(0.1, 0.4),
        "restitution": generator.uniform(0.4, 0.85),
        "initial_displacement": 1.0,
        "initial_position": generator.choice((-1.0, 1.0)),
    }


def recorded(kind: str, true: Mapping[str, Any], noise: float, seed: int) -> damper.Recording:
    """Return the record of a damper, with noise."""
    white = np.random.default_rng(seed)
    parameters, state = one_run(None, None, true)
    run = damper.start(parameters, state)
    run.advance({"intervals": 40.0, "acceleration": 31.0}.get(kind, 30.0))
    times = run.events["time"][run.events["kind"] == damper.IMPACT]
    if kind in ("displacement", "acceleration"):
        samples = np.linspace(0.0, 30.0, 400)
        motion = run.motion(samples)
        values = motion.displacement.values
        if kind == "acceleration":
            found = []
            # Ahead and, but for the start, where masses in touch may part, behind.
            for way in (np.ones(len(samples)), np.where(samples > 0.0, -1.0, 1.0)):
                steps = _LITTLE * way
                one, two = (run.motion(samples + k * steps).velocity.values for k in (1, 2))
                found.append((4.0 * one - 3.0 * motion.velocity.values - two) / (2.0 * steps))
            # The larger one of the two has an impact between its velocities.
            values = np.where(abs(found[0]) <= abs(found[1]), *found)
        values = values + noise * white.standard_normal(len(values))
        return damper.Recording(samples, values, kind)
    if kind == "intervals":
        times = np.diff(times[:9])
        noise *= times.mean()
        blank = None
    else:
        blank = 0.1
        heard = times[:1]
        for time in times:
            heard = np.append(heard, time) if time > heard[-1] + blank else heard
        times = heard[:25]
        noise *= times[-1] / len(times)
    times = times + noise * white.standard_normal(len(times))
    return damper.Recording(times, kind=kind, blank=blank)


def main(
    kind: str = "intervals", trials: str = "20", noise: str = "0.01", first: str = "0"
) -> None:
    """Print what is found of random dampers."""
    hits: dict[str, list[bool]] = {name: [] for name in _FREE[kind]}
    judged, warnings = Counter[str](), Counter[str]()
    for count in range(1, int(trials) + 1):
        seed = int(first) + count - 1
        true = truth(kind, random.Random(seed))
        known = {name: value for name, value in true.items() if name not in _FREE[kind]}
        record = recorded(kind, true, float(noise), seed)
        ranges = {"clearance": (0.02, 2.0)} if kind == "impacts" else {}
        found = damper.identify(record, _FREE[kind], known, ranges=ranges)
        missed, off = [], 0.0
        for name, held in hits.items():
            low, high = found.interval(name)
            held.append(low <= true[name] <= high)
            off = max(off, abs(true[name] - 0.5 * (low + high)) / (high - low))
            if not held[-1]:
                missed.append(f"{name} {true[name]:.6g}, {low:.6g} to {high:.6g}")
        verdict = "wrong" if off > 1.0 else "missed" if missed else "held"
        if any(not text.startswith("The data") for text in found.warnings):
            verdict += ", warned"
        judged[verdict] += 1
        texts = [text.removeprefix("record: ") for text in found.warnings]
        warnings.update(" ".join(text.split()[:5]) for text in texts)
        counts = ~np.isnan(found.motion.residual.to_numpy())
        if found.rms["record"] > 1.001 * _rms(record, true, known, _FREE[kind], counts) + _EXACT:
            judged["worse than the truth"] += 1
            verdict += ", worse"
        if verdict != "held":
            print(f"{seed}: {'; '.join([verdict, *missed, *texts])}", flush=True)
        if count % 10 == 0 or count == int(trials):
            about = f"{kind}, noise {noise}, {count} dampers: "
            for counted in (judged, warnings):
                print(about + "; ".join(f"{text}: {n}" for text, n in counted.most_common()))
            for name, held in hits.items():
                limits = binomtest(sum(held), len(held)).proportion_ci()
                part = sum(held) / len(held)
                ends = f"{100 * limits.low:.1f} to {100 * limits.high:.1f} %"
                print(f"{about}{name} {100 * part:.1f} % ({ends})", flush=True)


def _rms(
    record: damper.Recording,
    true: Mapping[str, Any],
    known: Mapping[str, Any],
    free: list[str],
    counts: np.ndarray,
) -> float:
    """Rms of the residual of the truth over data that count, with a fit's degrees of freedom."""
    starts = {name: true[name] for name in free}
    problem = RecordedDamper(known, [record], free, starts, {})
    point = np.array([true.get(unknown.name, 0.0) for unknown in problem.unknowns])
    problem.hidden = [np.zeros(len(record.times), bool)]
    computed = problem.computed(point, 0, len(record.times), False)[0]
    squares = (computed - record.values)[counts] ** 2
    return math.sqrt(squares.sum() / max(len(squares) - len(point), 1))


if __name__ == "__main__":
    main(*sys.argv[1:])
