"""Whether `damper design` finds the best damper: random machines against whole grids, with times.

    python benchmarks/design.py [machines] [runs] [first]

The grid runs every damper in full, some 100 000 runs for each machine over gap, mass, frequency,
start and tolerances; the search as few as its bounds allow. Both judge alike. Given is the worst
case found over the best one of the grid: 1 or less where no damper there is better. Times are of
the processor, all threads together; what compiles is run before.
"""

import random
import sys
import time

import numpy as np

from damper.sizing.machine import Machine, machine_of
from damper.sizing.search import Search, measure
from damper.sizing.study import Judge, Sizes
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


def grid(judge: Judge, runs: int) -> list[Sizes]:
    """Masses by gaps about the law's, so many that they take `runs` runs."""
    m = judge.machine
    (restitution,) = m.restitutions
    each = sum(map(len, judge.chains(Sizes(m.largest_mass, m.largest_gap, restitution))))
    masses = m.largest_mass * np.array([1.0, 0.75, 0.5])
    law = judge.law_gap(m.largest_mass, restitution) * judge.distance
    gaps = law * np.geomspace(0.1, 4.0, round(runs / each / len(masses)))
    return [Sizes(float(mass), float(gap), restitution) for mass in masses for gap in gaps]


def worst(judge: Judge, damper: Sizes) -> float:
    """Worst case of a damper, of all its runs at once."""
    return float(measure(judge, judge.chains(damper)).max())


def main(machines: int = 20, runs: int = 100_000, first: int = 0) -> None:
    """Print a line for each machine."""
    print(machine_text(machine()))
    judge = Judge(random_machine(first))
    worst(judge, grid(judge, runs)[0])
    for seed in range(first, first + machines):
        search = Search(Judge(random_machine(seed)))
        start = time.process_time()
        found = search.best()
        middle = time.process_time()
        dampers = grid(search.judge, runs)
        values = [worst(search.judge, damper) for damper in dampers]
        end = time.process_time()
        best = int(np.argmin(values))
        print(
            f"machine {seed}: {search.bounds[found] / values[best]:.3f}, found {found.mass:.3g} kg "
            f"{1e3 * found.gap:.3g} mm by {search.runs} runs in {middle - start:.1f} s; of "
            f"{len(dampers)} dampers {dampers[best].mass:.3g} kg {1e3 * dampers[best].gap:.3g} mm "
            f"in {end - middle:.1f} s",
            flush=True,
        )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
