"""Whether `damper design` finds the best damper: random machines against whole grids, with times.

    python benchmarks/design.py [machines] [gaps] [masses]

The grid runs every damper in full, the search as few as its bounds allow; both judge alike. Given
is the worst case found over the best one of the grid: 1 or less where no damper there is better.
Times are of the processor, all threads together; the first one compiles.
"""

import random
import sys
import time

import numpy as np

from damper.sizing.machine import Machine, machine_of
from damper.sizing.search import Search
from damper.sizing.study import Damper, Judge
from damper.verification.timing import machine, machine_text


def random_machine(seed: int) -> Machine:
    """A machine of 100 kg at 20 Hz, its damping, force, band, room and tolerances drawn."""
    draw = random.Random(seed)
    resonance, most = 20.0, 100.0 * draw.uniform(0.02, 0.15)
    kinds = {"force_amplitude": 200.0, "base_amplitude": 1e-4, "unbalance": 0.01}
    kind = draw.choice(list(kinds))
    return machine_of(
        {
            "mass": 100.0,
            "natural_frequency": resonance,
            "damping_ratio": draw.uniform(0.005, 0.05),
            kind: kinds[kind],
            "band": [draw.uniform(0.85, 0.97) * resonance, draw.uniform(1.03, 1.15) * resonance],
            "largest_mass": most,
            "largest_gap": 1.0,
            "restitution": draw.uniform(0.0, 0.8),
            "gap_tolerance": 1e-5 * draw.choice([0, 1, 5]),
        }
    )


def main(machines: int = 20, gaps: int = 60, masses: int = 3) -> None:
    """Print a line for each machine."""
    print(machine_text(machine()))
    for seed in range(machines):
        search = Search(Judge(random_machine(seed)))
        start = time.process_time()
        found = search.best()
        middle = time.process_time()
        law = search.judge.law_gap(found.mass) * search.judge.distance
        whole = Search(search.judge)
        grid = [
            Damper(float(mass), float(gap))
            for mass in search.judge.machine.largest_mass * np.linspace(1.0, 0.4, masses)
            for gap in law * np.geomspace(0.1, 4.0, gaps)
        ]
        best = min(map(whole.worst, grid))
        end = time.process_time()
        print(
            f"machine {seed}: {search.bounds[found] / best:.3f}, {search.runs} runs in "
            f"{middle - start:.1f} s; the grid {whole.runs} in {end - middle:.1f} s",
            flush=True,
        )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
