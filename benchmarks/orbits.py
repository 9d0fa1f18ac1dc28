"""What orbits and exponents cost: orbits per second along branches, and a map of exponents.

    python benchmarks/orbits.py

A branch is the motion of a run that has settled (or of a closed form), followed both ways on one
core. The last column is the time of 1000 orbits. The map is a small one on all cores, with the
observer `lyapunov` and with `impacts`, and what 100 000 points would take by that. Nothing here is
a test: machines differ and are shared.
"""

import math
import time
from dataclasses import replace

import numpy as np

import damper
from damper.engine.compiled import compile_at_once
from damper.theory.two_impacts import orbits
from damper.verification.timing import machine, machine_text

TWO_IMPACTS = damper.Parameters(0.1, 0.1, 1.0, 5.0, 0.5)
CHATTER = damper.Parameters(0.1, 0.02, 1.3, 0.05, 0.3)
COMPLIANT = replace(TWO_IMPACTS, contact_stiffness_ratio=1e4)
STOP = damper.Parameters(math.inf, 0.0, 2.8, 10.0, 0.8)
#: What it is, where it starts, along what.
BRANCHES = (
    ("two impacts a period", TWO_IMPACTS, orbits(TWO_IMPACTS)[0].start, "clearance", 2.0, 9.5),
    ("compliant walls", COMPLIANT, None, "clearance", 4.0, 9.5),
    ("complete chatter", CHATTER, None, "frequency_ratio", 0.8, 2.0),
    (
        "impact oscillator",
        STOP,
        damper.State(-0.28, -0.57, -10.0, 0.0),
        "clearance",
        8.0,
        10.5,
    ),
)


def main() -> None:
    """Print the costs."""
    compile_at_once()
    print(f"machine: {machine_text(machine())}")
    print(f"{'branch':24}{'orbits':>8}{'points':>8}{'s':>8}{'orbits/s':>10}{'s of 1000':>11}")
    for name, parameters, guess, along, start, stop in BRANCHES:
        orbit = damper.periodic_orbit(parameters, state=guess)
        damper.continue_orbit(orbit, along, start, stop, max_orbits=3)  # compiles
        began = time.perf_counter()
        branch = damper.continue_orbit(orbit, along, start, stop, max_orbits=1000)
        took, count = time.perf_counter() - began, len(branch.orbits)
        print(
            f"{name:24}{count:8}{len(branch.special_points):8}{took:8.2f}{count / took:10.0f}"
            f"{1000.0 * took / count:11.2f}"
        )
    print_map()


#: Points and forcing periods of the map.
SIDE, PERIODS, WHOLE = 40, 500, 100_000


def print_map() -> None:
    """Print what a map of Lyapunov exponents costs."""
    axes = {
        "restitution": np.linspace(0.3, 0.9, SIDE),
        "frequency_ratio": np.linspace(0.5, 2.0, SIDE),
    }
    fixed = {"mass_ratio": 0.1, "damping_ratio": 0.02, "clearance": 0.5}
    print(f"\n{'observer':24}{'points':>8}{'periods':>9}{'s':>8}{'s of 100 000':>14}")
    for observer in ("impacts", "lyapunov"):
        taken = []
        for periods in (1, PERIODS):  # the first one compiles
            began = time.perf_counter()
            damper.simulate(**fixed, **axes, transient=0, periods=periods, observers=[observer])
            taken.append(time.perf_counter() - began)
        points = SIDE * SIDE
        print(f"{observer:24}{points:8}{PERIODS:9}{taken[1]:8.2f}{taken[1] / points * WHOLE:14.0f}")


if __name__ == "__main__":
    main()
