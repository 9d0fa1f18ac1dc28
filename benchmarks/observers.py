"""What observers cost: time with each one against the bare engine, on one core.

    python benchmarks/observers.py [--repeats 40] [--periods 200] [--lanes 10]

Every repeat runs the bare engine and each set of observers once, one after the other, so that a
change of the machine's pace meets all of them; the table gives medians of the paired differences
and ratios over the repeats, with their quartiles. Observers have their default settings. At the
end: what a run without observers costs, and which modules a run with a single one loads. Nothing
here is a test: machines differ and are shared.
"""

import argparse
import subprocess
import sys
import time
from collections.abc import Callable, Sequence

import numpy as np
from engine import SCENES, machine

import damper
from damper.compiled import COMPILED
from damper.engine import LOG_ROWS, Trajectory
from damper.observers import OBSERVERS, make_observers
from damper.observers.base import Window
from damper.segment import COLUMNS

#: What the restitution study observes.
STUDY = ("stroboscopic_section", "impacts", "bursts")
LOADED = """
import sys
from damper.lanes import run_lanes
point = dict(mass_ratio=0.1, damping_ratio=0.05, frequency_ratio=0.8, clearance=1.0,
             restitution=0.6)
run_lanes([point], [{name!r}], transient=1, periods=2)
known = {known!r}
print(*(module for module in known if module in sys.modules))
"""


def main() -> None:
    """Print the costs."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--repeats", type=int, default=40)
    arguments.add_argument("--periods", type=int, default=200)
    arguments.add_argument("--lanes", type=int, default=10)
    given = arguments.parse_args()
    print(f"machine: {machine()}; {'numba' if COMPILED else 'plain Python'}")
    print(
        f"{given.repeats} repeats of {given.lanes} lanes (clearance +-2 %), "
        f"{given.periods} periods each; [quartiles]"
    )
    for name, p in SCENES.items():
        print(f"\n{name}: {p}")
        compare(p, given.lanes, given.periods, given.repeats)
    print("\nobserver modules loaded by a run with one observer:")
    for name in OBSERVERS:
        print(f"  {name:<22} {', '.join(loaded(name))}")


def compare(p: damper.Parameters, lanes: int, periods: int, repeats: int) -> None:
    """Print one scene's table."""
    many = [
        damper.Parameters(**vars(p) | {"clearance": p.clearance * factor})
        for factor in np.linspace(0.98, 1.02, lanes)
    ]
    buffer = np.empty((LOG_ROWS, COLUMNS))
    cases: dict[str, Callable[[], int]] = {
        "bare": lambda: sum(skip(values, periods) for values in many),
        "no observer": lambda: sum(observe(values, (), periods, buffer) for values in many),
    }
    for names in (*((name,) for name in OBSERVERS), STUDY):

        def run(names: Sequence[str] = names) -> int:
            return sum(observe(values, names, periods, buffer) for values in many)

        cases[" + ".join(names)] = run
    for case in cases.values():
        events = case()  # compile
    times = np.array([[seconds(case) for case in cases.values()] for _ in range(repeats)])
    times *= 1e6 / events
    bare = times[:, 0]
    print(f"  {events} events; bare engine {spread(bare)} us/event")
    print(f"  {'with':<42} {'more, us/event':<28} times the bare engine")
    for column, name in enumerate(cases):
        if column:
            more = times[:, column] - bare
            print(f"  {name:<42} {spread(more):<28} {spread(times[:, column] / bare)}")


def seconds(case: Callable[[], int]) -> float:
    """Time that a case takes."""
    started = time.perf_counter()
    case()
    return time.perf_counter() - started


def skip(p: damper.Parameters, periods: int) -> int:
    """Run the bare engine; return the number of events."""
    trajectory = Trajectory(p)
    trajectory.skip(periods)
    return trajectory.events


def observe(p: damper.Parameters, names: Sequence[str], periods: int, buffer: np.ndarray) -> int:
    """Run a lane as `damper.lanes.run_lanes` does; return the number of events."""
    made = make_observers(names)
    trajectory = Trajectory(p)
    window = Window(*trajectory.start, periods)
    for observer in made:
        observer.allocate(1, periods)
        observer.begin(0, trajectory, window)
    if not made:
        trajectory.skip(periods)
    else:
        for log in trajectory.segments(periods, 0.0, buffer):
            for observer in made:
                observer.observe(log)
    for observer in made:
        observer.finish(True)
    return trajectory.events


def spread(values: np.ndarray) -> str:
    """Median and quartiles."""
    low, middle, high = np.quantile(values, [0.25, 0.5, 0.75])
    return f"{middle:.3f} [{low:.3f}, {high:.3f}]"


def loaded(name: str) -> list[str]:
    """Observers whose modules are loaded after a run with one of them, in a process of its own."""
    known = [module for module, _ in OBSERVERS.values()]
    done = subprocess.run(
        [sys.executable, "-c", LOADED.format(name=name, known=known)],
        capture_output=True,
        text=True,
        check=True,
    )
    return [module.rpartition(".")[2] for module in done.stdout.split()]


if __name__ == "__main__":
    main()
