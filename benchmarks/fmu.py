"""Error of an FMU by its input within a step.

    python benchmarks/fmu.py

A machine of 100 kg, 31.8 Hz and a damping ratio of 0.02 with a damper of 10 kg under 200 N at
31 Hz, 30 cycles from rest. The error is the largest one of its displacement at
communication points, over the largest displacement, against `damper.start` under the same harmonic
force; the order is the exponent of the step from row to row.
"""

import math
import time

import numpy as np

import damper
from damper.fmu.stepped import PARAMETERS, SteppedMachine

FRAME = {
    "mass": 100.0,
    "natural_frequency": 31.8,
    "damping_ratio": 0.02,
    "free_mass": 10.0,
    "gap": 1.057e-3,
    "restitution": 0.3,
    "initial_position": 0.5,
}
FORCE, RATE, CYCLES = 200.0, math.tau * 31.0, 30


def main() -> None:
    """Print the table."""
    own = math.tau * FRAME["natural_frequency"]
    place = 0.5 * FRAME["gap"] * FRAME["initial_position"]
    exact = damper.start(
        state=damper.State(0.0, 0.0, place, 0.0),
        primary_mass=FRAME["mass"],
        damping=2.0 * FRAME["damping_ratio"] * FRAME["mass"] * own,
        stiffness=FRAME["mass"] * own**2,
        free_mass=FRAME["free_mass"],
        gap=FRAME["gap"],
        restitution=FRAME["restitution"],
        force_amplitude=FORCE,
        forcing_frequency=RATE,
    )
    impacts = exact.advance(CYCLES * math.tau / RATE)["kind"] == damper.IMPACT
    print(f"{impacts.sum()} impacts")
    print(
        "| steps in a cycle | held: error | order | extrapolated | order | interpolated | order |"
    )
    print("|" + "---|" * 7)
    before, began, count = [math.nan] * 3, time.perf_counter(), 0
    for steps in (10, 20, 40, 80, 160):
        times = math.tau / RATE / steps * np.arange(CYCLES * steps + 1)
        wanted = exact.motion(np.minimum(times, exact.time)).displacement.values
        errors = [_error(times, wanted, order) for order in range(3)]
        orders = [math.log2(a / b) for a, b in zip(before, errors, strict=True)]
        cells = [f"{e:.1e} | {n:.1f}" for e, n in zip(errors, orders, strict=True)]
        print(f"| {steps} | {' | '.join(cells)} |".replace("nan", ""))
        before, count = errors, count + 3 * CYCLES * steps
    print(f"{1e3 * (time.perf_counter() - began) / count:.2g} ms for a step and its comparison")


def _error(times: np.ndarray, wanted: np.ndarray, order: int) -> float:
    """Largest error of the displacement over its largest value."""
    defaults = {name: setting.default for name, setting in PARAMETERS.items()}
    values = FORCE * np.sin(RATE * times)
    machine = SteppedMachine(defaults | FRAME | {"input_order": order}, "force", float(values[0]))
    found = [0.0]
    for k, length in enumerate(np.diff(times).tolist()):
        machine.step(length, float(values[k + (order == 2)]))
        found.append(machine.state.x)
    return float(np.abs(found - wanted).max() / np.abs(wanted).max())


if __name__ == "__main__":
    main()
