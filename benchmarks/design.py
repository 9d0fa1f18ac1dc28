"""Whether `damper design` finds the best damper and its worst case, by brute force, with times.

    python benchmarks/design.py [usual|light] [machines] [runs] [first]

The brute force shares no start and no formula with the search. It starts anywhere in the amplitude
without damper, to both sides and with any speed that goes with it, with the free mass at either
wall and as fast as this, at any frequency of the band, with any tolerances. A free mass at exact
rest in space would stay there where no wall comes, for ever, and the machine moves as without
damper: so the speed is drawn, too. The dampers of a grid get so many runs in all: some each, then
the better half twice as many, and so on. Its best damper and the found one then get `FRESH` runs
each (`FRESH_LIGHT` with little damping), from the same fresh starts. These runs have ten times the
transient: the card speaks of motions that last, and some motions from the whole amplitude without
damper are still falling when a search looks at them. These runs give

- how many of the found damper exceed the worst case on its card, and by how much;
- the largest of the found damper over that of the grid's best: below 1 it is better.

Times are of the processor, all threads together; code is compiled before.
"""

import math
import random
import sys
import time

import numpy as np

from damper.sizing.machine import Machine, machine_of
from damper.sizing.search import Search
from damper.sizing.study import Sizes, WorstCase
from damper.sweep.runs import run_points
from damper.verification.timing import machine, machine_text

#: Runs of the two dampers that are compared (of lightly damped machines fewer, whose transients
#: take thousands of cycles), and how many times the transient of the search they get.
FRESH, FRESH_LIGHT, LONGER = 2000, 300, 10
#: The grid: parts of the largest mass, and gaps over the amplitude without damper.
MASSES, GAPS = (1.0, 0.75, 0.5), np.geomspace(0.05, 3.0, 41)


def random_machine(seed: int, light: bool = False) -> Machine:
    """A machine of 100 kg at 20 Hz, its damping, force, band, room and tolerances drawn."""
    draw = random.Random(seed)
    resonance, most = 20.0, 100.0 * draw.uniform(0.02, 0.15)
    kinds = {"force_amplitude": 200.0, "base_amplitude": 1e-4, "unbalance": 0.01}
    kind = draw.choice(list(kinds))
    damping = draw.uniform(0.0005, 0.005) if light else draw.uniform(0.005, 0.05)
    return machine_of(
        {
            "mass": 100.0,
            "natural_frequency": resonance,
            "damping_ratio": damping,
            kind: kinds[kind],
            "band": [draw.uniform(0.85, 0.97) * resonance, draw.uniform(1.03, 1.15) * resonance],
            "largest_mass": most,
            "largest_gap": 1.0,
            "restitution": draw.uniform(0.6, 0.9) if light else draw.uniform(0.0, 0.8),
            "gap_tolerance": 1e-5 * draw.choice([0, 1, 5]),
        }
    )


def alone(m: Machine) -> float:
    """Amplitude in m without damper at the natural frequency, which is in the band."""
    static = {"base": m.force[1] * math.hypot(1.0, 2.0 * m.damping_ratio)}
    static["harmonic"] = m.force[1] / (m.mass * (40.0 * math.pi) ** 2)
    static["unbalance"] = m.force[1] / m.mass
    return static[m.force[0]] / (2.0 * m.damping_ratio)


def largest(
    judge: WorstCase, dampers: list[Sizes], count: int, draw: np.random.Generator, longer: int = 1
) -> np.ndarray:
    """Largest displacements in m of each damper from the same starts; (dampers, count)."""
    m = judge.machine
    assert m.band is not None
    starts = [
        {
            "initial_displacement": draw.uniform(-1.0, 1.0) * alone(m),
            "initial_velocity": draw.uniform(-1.0, 1.0) * alone(m) * 40.0 * math.pi,
            "initial_position": draw.choice([-1.0, 1.0]),
            "forcing_frequency": math.tau * draw.uniform(*m.band),
        }
        for _ in range(count)
    ]
    off = m.gap_tolerance * draw.uniform(-1.0, 1.0, count)
    points = [
        m.primary
        | start
        | {"free_mass": one.mass, "gap": max(one.gap + more, 0.0), "restitution": one.restitution}
        for one in dampers
        for start, more in zip(starts, off.tolist(), strict=True)
    ]
    run = judge.run | {"transient": longer * judge.run["transient"]}
    arrays, _ = run_points(points, {"response": {}}, forcing=m.force[0], workers=None, **run)
    found = m.length * arrays["peak_displacement"]
    return np.where(np.isnan(found), np.inf, found).reshape(len(dampers), count)


def best_of_grid(judge: WorstCase, runs: int, draw: np.random.Generator) -> Sizes:
    """The damper of a grid whose largest run is least: each round half of them, twice the runs."""
    m = judge.machine
    dampers = [
        Sizes(part * m.largest_mass, float(gap), m.restitutions[0])
        for part in MASSES
        for gap in alone(m) * GAPS
    ]
    rounds = math.ceil(math.log2(len(dampers)))
    each = runs / rounds
    worst = dict.fromkeys(dampers, 0.0)
    while len(dampers) > 1:
        found = largest(judge, dampers, round(each / len(dampers)), draw).max(axis=1)
        for damper, value in zip(dampers, found.tolist(), strict=True):
            worst[damper] = max(worst[damper], value)
        dampers = sorted(dampers, key=worst.__getitem__)[: len(dampers) // 2]
    return dampers[0]


def main(kind: str = "usual", machines: int = 20, runs: int = 20_000, first: int = 0) -> None:
    """Print a line of a table for each machine."""
    print(machine_text(machine()))
    draw = np.random.default_rng(7)
    judge = WorstCase(random_machine(first))
    largest(judge, [Sizes(2.0, 1e-3, 0.5)], 20, draw)
    Search(judge).worst(Sizes(2.0, 1e-3, 0.5))
    print(
        "| machine | card, mm | share above | largest over card | over the grid's best | search |"
    )
    for seed in range(first, first + machines):
        search = Search(WorstCase(random_machine(seed, kind == "light")))
        start = time.process_time()
        found = search.best()
        middle = time.process_time()
        best = best_of_grid(search.judge, runs, draw)
        end = time.process_time()
        fresh = FRESH_LIGHT if kind == "light" else FRESH
        ours, theirs = largest(search.judge, [found, best], fresh, draw, LONGER)
        card = search.bounds[found]
        print(
            f"| {seed} | {1e3 * card:.4g} | {(ours > card).mean():.2%} | {ours.max() / card:.3f} | "
            f"{ours.max() / theirs.max():.3f} | {search.runs} runs, {middle - start:.1f} s; grid "
            f"{end - middle:.1f} s |",
            flush=True,
        )


if __name__ == "__main__":
    main(*sys.argv[1:2], *map(int, sys.argv[2:]))
