"""Time of many records: an ensemble of made-up earthquakes of 30 s at 100 Hz, a seed each.

    python benchmarks/records.py [--runs 100] [--of 10000] [--workers 2]

Runs a part of the ensemble and says how long all of it would take: to make the records, and to run
them with `response` and `impacts`, without compiling. Nothing here is a test: machines differ and
are shared, so the load of the machine stands beside the times.
"""

import argparse
import math
import os
import time

import damper
from damper.engine.compiled import compile_at_once
from damper.sweep.runs import run_points
from damper.verification.timing import machine, machine_text

BUILDING = {
    "primary_mass": 1e5,
    "damping": 25e3,
    "stiffness": 4e6,
    "free_mass": 1e4,
    "gap": 0.2,
    "restitution": 0.5,
    "force_amplitude": 1.0,
    "forcing_frequency": 2.0 * math.pi,
}
OBSERVERS = ["response", "impacts"]
RUN = {"transient": 0, "periods": {"time": "end"}}


def main() -> None:
    """Print the times."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--runs", type=int, default=100)
    arguments.add_argument("--of", type=int, default=10_000)
    arguments.add_argument("--workers", type=int, default=2)
    given = arguments.parse_args()
    compile_at_once()
    run_points(_points(2), OBSERVERS, workers=1, **RUN)
    load = os.getloadavg()[0]
    clocks = [(time.perf_counter(), time.process_time())]
    points = _points(given.runs)
    clocks.append((time.perf_counter(), time.process_time()))
    run_points(points, OBSERVERS, workers=given.workers, **RUN)
    clocks.append((time.perf_counter(), time.process_time()))
    print(machine_text(machine()))
    print(f"load of the machine before: {load:.1f} on {os.cpu_count()} cores")
    for what, one, other in zip(("made", "run"), clocks[:-1], clocks[1:], strict=True):
        seconds, cpu = ((b - a) / given.runs for a, b in zip(one, other, strict=True))
        print(
            f"{what}: {1e3 * seconds:.2f} ms a record, {1e3 * cpu:.2f} ms of CPU; "
            f"{given.of} take {seconds * given.of:.0f} s, {cpu * given.of:.0f} s of CPU"
        )


def _points(count: int) -> list[dict[str, object]]:
    # Flat up to 10 Hz, as the shortest period that a step of 0.01 s allows; rms 1 m/s2.
    shape = {"step": 0.01, "duration": 30.0, "band": (0.5, 20.0 * math.pi)}
    return [
        BUILDING | {"forcing": damper.Noise(seed=k, of="base_acceleration", **shape).record}
        for k in range(count)
    ]


if __name__ == "__main__":
    main()
