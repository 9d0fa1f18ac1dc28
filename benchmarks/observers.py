"""What observers cost: time with each one against the bare engine, on one core.

    python benchmarks/observers.py [--repeats 40] [--periods 200] [--runs 10]

Every repeat runs each set of observers beside the bare engine, one after the other, so that a
change of the machine's pace meets all of them; the table gives medians of the times and of the
paired ratios over the repeats, with their quartiles. Observers have their default settings. At the
end: which modules a run with a single one loads. Nothing here is a test: machines differ and are
shared.
"""

import argparse
import subprocess
import sys

from engine import SCENES

import damper
from damper.observers import OBSERVERS
from damper.verification.cost.measure import measure
from damper.verification.timing import machine, machine_text

#: What the restitution study observes.
STUDY = ("stroboscopic_section", "impacts", "bursts")
LOADED = """
import sys
from damper.sweep.runs import run_points
point = dict(mass_ratio=0.1, damping_ratio=0.05, frequency_ratio=0.8, clearance=1.0,
             restitution=0.6)
run_points([point], [{name!r}], transient=1, periods=2)
known = {known!r}
print(*(module for module in known if module in sys.modules))
"""


def main() -> None:
    """Print the costs."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--repeats", type=int, default=40)
    arguments.add_argument("--periods", type=int, default=200)
    arguments.add_argument("--runs", type=int, default=10)
    given = arguments.parse_args()
    print(f"machine: {machine_text(machine())}")
    print(
        f"{given.repeats} repeats of {given.runs} runs (clearance +-2 %), "
        f"{given.periods} periods each; [quartiles]"
    )
    for name, p in SCENES.items():
        print(f"\n{name}: {p}")
        compare(p, given.runs, given.periods, given.repeats)
    print("\nobserver modules loaded by a run with one observer:")
    for name in OBSERVERS:
        print(f"  {name:<22} {', '.join(loaded(name))}")


def compare(p: damper.Parameters, runs: int, periods: int, repeats: int) -> None:
    """Print one scene's table."""
    sets = [(), *((name,) for name in OBSERVERS), STUDY]
    cases = {
        " + ".join(names) or "no observer": {
            "parameters": p.given,
            "observers": dict.fromkeys(names),
        }
        for names in sets
    }
    found = measure(cases, runs=runs, periods=periods, repeats=repeats)["cases"]
    first = found.pop("no observer")
    print(f"  {first['events']} events; bare engine {first['bare']} us/event")
    print(f"  {'with':<42} {'us/event':<28} times the bare engine")
    for name, case in found.items():
        print(f"  {name:<42} {case['observed']!s:<28} {case['over_bare']}")


def loaded(name: str) -> list[str]:
    """Observers whose modules are loaded after a run with one of them, in a process of its own."""
    known = [f"damper.observers.{each}" for each in OBSERVERS]
    done = subprocess.run(
        [sys.executable, "-c", LOADED.format(name=name, known=known)],
        capture_output=True,
        text=True,
        check=True,
    )
    return [module.rpartition(".")[2] for module in done.stdout.split()]


if __name__ == "__main__":
    main()
