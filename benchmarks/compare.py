"""Two versions of the engine beside each other: microseconds and evaluations per event.

    git worktree add /tmp/before <commit>
    python benchmarks/compare.py /tmp/before/src [src] [--repeats 25]

Each version runs in a process of its own, and they take turns, scene by scene, so that a change of
the machine's pace meets both; the table gives medians, and the median of the paired ratios. Nothing
here is a test: machines differ and are shared.
"""

import argparse
import json
import statistics
import subprocess
import sys
from pathlib import Path

from damper.cost.machine import machine

#: mass_ratio, damping_ratio, frequency_ratio, clearance, restitution
SCENES = {
    "generic": (0.1, 0.05, 0.8, 1.0, 0.6),
    "chattering": (0.1, 0.05, 0.2, 0.25, 0.3),
    "resonant": (0.1, 0.0, 1.0, 1.0, 0.6),
    "study": (0.1, 0.02, 1.3, 0.05, 0.6),
    "study, r = 0.9": (0.1, 0.02, 1.3, 0.05, 0.9),
    "slow forcing": (0.1, 0.05, 0.02, 0.25, 0.5),
    "overdamped": (0.1, 3.0, 0.5, 0.1, 0.6),
    "no impacts": (0.1, 0.05, 0.8, 50.0, 0.6),
}
WORKER = """
import json, sys, time
sys.path.insert(0, sys.argv[1])
import numpy as np
from damper import Parameters
from damper.engine import Trajectory

for line in sys.stdin:
    scene = json.loads(line)
    runs = [
        Trajectory(Parameters(*scene[:3], scene[3] * factor, scene[4]))
        for factor in np.linspace(0.98, 1.02, 60)
    ]
    started = time.perf_counter()
    for run in runs:
        run.skip(200)
    spent = time.perf_counter() - started
    # A scene without events is counted by its periods.
    events = sum(run.events for run in runs) or 60 * 200
    print(json.dumps([1e6 * spent / events, sum(r.evaluations for r in runs) / events]), flush=True)
"""


def main() -> None:
    """Print the comparison."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("before", type=Path, help="folder that holds the package damper")
    arguments.add_argument("after", type=Path, nargs="?", default=Path(__file__).parents[1] / "src")
    arguments.add_argument("--repeats", type=int, default=25)
    given = arguments.parse_args()
    versions = [Version(given.before), Version(given.after)]
    print(f"machine: {machine()}")
    print(f"median of {given.repeats} turns; us and evaluations of the flow per event")
    print(f"{'scene':<16} {'before':>8} {'after':>8} {'ratio':>7} {'evaluations':>16}")
    for name, scene in SCENES.items():
        for version in versions:
            version.run(scene)  # compile
        turns = [[version.run(scene) for version in versions] for _ in range(given.repeats)]
        before, after = ([turn[k][0] for turn in turns] for k in range(2))
        ratio = statistics.median(b / a for a, b in zip(before, after, strict=True))
        evaluations = " -> ".join(f"{turns[0][k][1]:.2f}" for k in range(2))
        print(
            f"{name:<16} {statistics.median(before):8.3f} {statistics.median(after):8.3f} "
            f"{ratio:7.2f} {evaluations:>16}"
        )


class Version:
    """A process that times one version of the engine."""

    def __init__(self, source: Path) -> None:
        if not (source / "damper" / "engine.py").is_file():
            sys.exit(f"{source}: must be a folder that holds the package damper")
        self._process = subprocess.Popen(
            [sys.executable, "-c", WORKER, str(source.resolve())],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def run(self, scene: tuple[float, ...]) -> tuple[float, float]:
        """Microseconds and evaluations per event."""
        self._process.stdin.write(json.dumps(scene) + "\n")
        self._process.stdin.flush()
        return tuple(json.loads(self._process.stdout.readline()))


if __name__ == "__main__":
    main()
