"""Time of observers, models and forces beside the bare engine's, on one core.

    python benchmarks/cost.py [--repeats 30] [--periods 200] [--runs 10]

It prints the table of docs/cost.md. The cases take turns within each repeat; ratios are medians
over the repeats, with [quartiles]. All times are processor times, which a busy machine lengthens
less than clock times. Observers have their default settings.
"""

import argparse
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from damper import Base, Harmonics, Noise, Unbalance
from damper.engine.compiled import compile_at_once
from damper.models import start_run
from damper.observers import OBSERVERS, observer_class
from damper.sweep.points import read_point
from damper.sweep.runs import run_points
from damper.verification.timing import machine, machine_text, take_turns

BASE: dict[str, Any] = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.8,
    "clearance": 1.0,
    "restitution": 0.6,
}
NAMES = [name for name in OBSERVERS if "rigid" in observer_class(name).models]
#: Two sections exclude each other; laws and deviations are asked for by themselves.
TOGETHER = [n for n in NAMES if n not in ("impact_section", "laws", "lyapunov", "statistics")]
SI = {
    "primary_mass": 2.0,
    "damping": 2.0,
    "stiffness": 200.0,
    "force_amplitude": 10.0,
    "forcing_frequency": 8.0,
    "free_mass": 0.2,
    "gap": 0.1,
    "restitution": 0.6,
}
CHATTER = BASE | {"frequency_ratio": 0.2, "clearance": 0.25, "restitution": 0.3}
#: Case -> scene, observers.
CASES: dict[str, tuple[dict[str, Any], list[str]]] = {
    "bare engine": (BASE, []),
    **{name.replace("_", " "): (BASE, [name]) for name in NAMES},
    "observers together": (BASE, TOGETHER),
    "without chatter": (BASE | {"restitution": 0.9}, []),
    "chatter": (CHATTER, []),
    "chatter, observers together": (CHATTER, TOGETHER),
    "undamped": (BASE | {"damping_ratio": 0.0}, []),
    "SI units": (SI, []),
}
#: Case -> quantities beside those of `BASE`.
BESIDE: dict[str, dict[str, Any]] = {
    "grounded": {"support_stiffness_ratio": 0.01, "support_damping_ratio": 0.001},
    "time-varying": {"modulation_depth": 0.2, "modulation_order": 2},
    "compliant": {"contact_stiffness_ratio": 1e4},
    "gravity": {"gravity": 0.2},
    "walls that differ": {"restitution_left": 0.4},
    "friction": {"friction": 0.05},
    "two masses": {"mass_ratio": 0.05, "masses": [{"clearance": d} for d in (0.9, 1.1)]},
    "three masses": {"mass_ratio": 0.0333, "masses": [{"clearance": d} for d in (0.9, 1, 1.1)]},
    "eight masses": {
        "mass_ratio": 0.0125,
        "masses": [{"clearance": d} for d in np.linspace(0.9, 1.1, 8).tolist()],
    },
    "five harmonics": {"forcing": Harmonics((1, 2, 3, 4, 5), (1.0, 0.3, 0.2, 0.1, 0.1))},
    "base in its own frame": {"forcing": Base("base")},
    "unbalance": {"forcing": Unbalance()},
    "noise of 20 samples a cycle": {"forcing": Noise(1, 0.4, 1600.0, (0.5, 1.5))},
    "other models at zero": {
        "support_stiffness_ratio": 0.0,
        "support_damping_ratio": 0.0,
        "modulation_depth": 0.0,
    },
}
CASES |= {name: (BASE | more, []) for name, more in BESIDE.items()}
#: No run makes so many events: a run that stops early would take less time than it should.
NO_BUDGET = 10**12


def points_near(scene: dict[str, Any], runs: int) -> list[dict[str, Any]]:
    """Points whose clearances differ by up to 4 %."""
    travel = "gap" if "gap" in scene else "clearance"
    factors = 1.0 + 0.04 * (np.arange(runs) - 0.5 * (runs - 1)) / runs
    return [scene | {travel: scene[travel] * factor} for factor in factors.tolist()]


def bare(points: list[dict[str, Any]], periods: int) -> int:
    """Run points without observers, and count the events."""
    events = 0
    for values in points:
        point = read_point(values)
        run = start_run(point.parameters, point.start(), max_events=NO_BUDGET)
        run.skip(periods)
        events += run.events
    return events


def observed(points: list[dict[str, Any]], periods: int, observers: list[str]) -> int:
    """Run points as a simulation job does, and count the bytes of what the observers keep."""
    arrays, _ = run_points(points, observers, transient=0, periods=periods, max_events=NO_BUDGET)
    return sum(array.nbytes for array in arrays.values())


def text(values: np.ndarray) -> str:
    """Median and quartiles."""
    low, median, high = np.nanquantile(values, [0.25, 0.5, 0.75])
    return f"{median:.3f} [{low:.3f}, {high:.3f}]"


def main() -> None:
    """Print the table."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--repeats", type=int, default=30)
    arguments.add_argument("--periods", type=int, default=200)
    arguments.add_argument("--runs", type=int, default=10)
    given = arguments.parse_args()
    compile_at_once()
    calls: dict[tuple[str, bool], Callable[[], int]] = {}
    for name, (scene, observers) in CASES.items():
        points = points_near(scene, given.runs)
        calls[name, False] = partial(bare, points, given.periods)
        if observers:
            calls[name, True] = partial(observed, points, given.periods, observers)
    counts = {key: call() for key, call in calls.items()}  # the first run compiles
    seconds = take_turns(list(calls.values()), given.repeats)
    times = dict(zip(calls, 1e6 * seconds.T, strict=True))
    print(f"{machine_text(machine())}; {given.repeats} repeats of {given.runs} runs of", end=" ")
    print(f"{given.periods} cycles\n\n| case | us/event | over bare engine | arrays, MB |")
    print("|---|---|---|---|")
    base = times["bare engine", False] / counts["bare engine", False]
    for name, kept in calls:
        time = times[name, kept] / counts[name, False]
        if kept:
            ratio, size = time / (times[name, False] / counts[name, False]), counts[name, kept]
            print(f"| {name} | {np.median(time):.3f} | {text(ratio)} | {size / 1e6:.2f} |")
        elif not CASES[name][1]:
            print(f"| {name} | {np.median(time):.3f} | {text(time / base)} | |")


if __name__ == "__main__":
    main()
