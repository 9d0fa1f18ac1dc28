"""How often the intervals of `damper.identify` hold the truth, on records of random dampers.

python benchmarks/identify.py intervals 200
python benchmarks/identify.py impacts 200
python benchmarks/identify.py displacement 40

A line for each damper that an interval misses, then for each unknown the part of the dampers whose
95 % interval holds the truth, with its binomial 95 % limits. White noise is 1 % of the first
displacement, or of the mean time between impacts, unless a third argument says so.
"""

import random
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.stats import binomtest

import damper
from damper.engine.compiled import plain
from damper.sweep.points import one_run

_FREE = {
    "intervals": ["restitution", "initial_position"],
    "impacts": ["restitution", "clearance", "damping_ratio"],
    "displacement": ["restitution", "clearance", "damping_ratio", "initial_displacement"],
}
#: A ball on a heavy floor, in units of its height and weight: gravity is 1.
_FLOOR = {"mass_ratio": 1e-6, "damping_ratio": 0.0, "clearance": 10.0, "gravity": 1.0}


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
    run.advance(40.0 if kind == "intervals" else 30.0)
    times = run.events["time"][run.events["kind"] == damper.IMPACT]
    if kind == "displacement":
        samples = np.linspace(0.0, 30.0, 400)
        values = run.motion(samples).displacement.values
        return damper.Recording(samples, values + noise * white.standard_normal(len(values)))
    if kind == "intervals":
        times = np.diff(times[:9])
        noise *= times.mean()
    else:
        times = times[:25]
        noise *= times[-1] / len(times)
    times = times + noise * white.standard_normal(len(times))
    return damper.Recording(times if kind == "intervals" else np.sort(times), kind=kind)


@plain
def main(kind: str = "intervals", trials: str = "20", noise: str = "0.01") -> None:
    """Print how often each interval holds the truth."""
    hits: dict[str, list[bool]] = {name: [] for name in _FREE[kind]}
    for seed in range(int(trials)):
        true = truth(kind, random.Random(seed))
        known = {name: value for name, value in true.items() if name not in _FREE[kind]}
        record = recorded(kind, true, float(noise), seed)
        ranges = {"clearance": (0.02, 2.0)} if kind == "impacts" else {}
        found = damper.identify(record, _FREE[kind], known, ranges=ranges)
        for name, held in hits.items():
            low, high = found.interval(name)
            held.append(low <= true[name] <= high)
            if not held[-1]:
                print(f"{seed}: {name} {true[name]:.6g}, {low:.6g} to {high:.6g}", flush=True)
    for name, held in hits.items():
        limits = binomtest(sum(held), len(held)).proportion_ci()
        part = sum(held) / len(held)
        print(f"{kind}, noise {noise}, {trials} dampers: {name} {100 * part:.1f} % "
              f"({100 * limits.low:.1f} to {100 * limits.high:.1f} %)", flush=True)  # fmt: skip


if __name__ == "__main__":
    main(*sys.argv[1:])
