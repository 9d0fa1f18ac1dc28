"""Two versions of damper beside each other: events, speed, first calls, size, results.

    git worktree add /tmp/before <commit>
    python benchmarks/compare.py /tmp/before/src [src] [--what events,speed,cold,size]
    python benchmarks/compare.py /tmp/before/src --save before.npz
    python benchmarks/compare.py before.npz [src]
    python benchmarks/compare.py --results /tmp/before/results results [--what cubes,claims]

Each version runs in a process of its own. A file made by --save stands for the events of its
version. Nothing here is a test: machines differ and are shared.
"""

import argparse
import ast
import json
import math
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from itertools import product
from pathlib import Path
from typing import Any

import compare_events
import compare_results
from compare_versions import Version, parameters_of

NAMES = ("mass_ratio", "damping_ratio", "frequency_ratio", "clearance", "restitution")
#: What is timed with every model, and with the rigid one only.
SCENES = {"generic": (0.1, 0.05, 0.8, 1.0, 0.6), "chattering": (0.1, 0.05, 0.2, 0.25, 0.3)}
RIGID_SCENES = {
    "resonant": (0.1, 0.0, 1.0, 1.0, 0.6),
    "study": (0.1, 0.02, 1.3, 0.05, 0.6),
    "study, r = 0.9": (0.1, 0.02, 1.3, 0.05, 0.9),
    "slow forcing": (0.1, 0.05, 0.02, 0.25, 0.5),
    "overdamped": (0.1, 3.0, 0.5, 0.1, 0.6),
    "no impacts": (0.1, 0.05, 0.8, 50.0, 0.6),
}
MODELS = {
    "rigid": {},
    "grounded": {"support_stiffness_ratio": 0.1, "support_damping_ratio": 0.01},
    "compliant": {"contact_stiffness_ratio": 1e4},
    "stiff": {"contact_stiffness_ratio": 1e8},
    "time-varying": {"modulation_depth": 0.3},
}
#: The free mass divided into so many, with restitutions in even steps from 0.8 to 1.2 times one.
COUNTS = {"two masses": 2, "three masses": 3, "eight masses": 8}
#: Forcing periods of a timed run, and factors of the clearance that make many runs of a scene.
PERIODS, SPREAD = 300, [0.98 + 0.04 * k / 59 for k in range(60)]
FIRST_CALL = """
import json, sys, time
sys.path[:0] = sys.argv[1:3]
from compare_versions import parameters_of
clock = lambda: (time.perf_counter(), time.process_time())
clocks = [clock()]
import damper
clocks.append(clock())
damper.events(damper.Parameters(**parameters_of(json.loads(sys.argv[3]))), until=20.0)
clocks.append(clock())
print(*(f"{b[0] - a[0]:.2f} ({b[1] - a[1]:.2f})" for a, b in zip(clocks, clocks[1:])), sep=", ")
"""


def main() -> None:
    """Print the parts that are asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("before", type=Path, nargs="?", help="folder that holds damper, or a .npz")
    parser.add_argument("after", type=Path, nargs="?", default=Path(__file__).parents[1] / "src")
    parser.add_argument("--results", type=Path, nargs=2, metavar=("BEFORE", "AFTER"))
    parser.add_argument("--what", help="parts, comma-separated; when left out, all that can be")
    parser.add_argument("--save", type=Path, help="write the events of `before` and stop")
    parser.add_argument("--models", help="those that are timed; when left out, all")
    parser.add_argument("--repeats", type=int, default=15, help="turns of each timed scene")
    parser.add_argument("--listed", type=int, default=5, help="scenes listed of each kind")
    given = parser.parse_args()
    if not given.before and not given.results:
        parser.error("give two versions, or --results")
    if given.save:
        compare_events.save(given.save, *compare_events.references(Version(given.before)))
        return
    versions = (given.before, given.after)
    folders = (
        "events" if given.before and given.before.suffix == ".npz" else "events,speed,cold,size"
    )
    print(f"{platform.system()} {platform.machine()}, Python {platform.python_version()}")
    for part in (given.what or ("cubes,claims" if given.results else folders)).split(","):
        print(f"\n== {part} ==")
        if part in ("cubes", "claims"):
            getattr(compare_results, part)(*given.results)
        elif part == "events":
            compare_events.compare(*versions, given.listed)
        elif part == "speed":
            models = given.models.split(",") if given.models else [*MODELS, *COUNTS]
            speed([Version(source) for source in versions], models, given.repeats)
        else:
            {"cold": cold, "size": size}[part](versions)


def values_of(scene: tuple[float, ...], model: str) -> dict[str, Any]:
    """Parameters of a scene."""
    values: dict[str, Any] = dict(zip(NAMES, scene, strict=True))
    if model not in COUNTS:
        return values | MODELS[model]
    count, ratio, restitution = COUNTS[model], values["mass_ratio"], values["restitution"]
    factors = [0.8 + 0.4 * k / (count - 1) for k in range(count)]
    return values | {
        "masses": [{"mass_ratio": ratio / count, "restitution": restitution * f} for f in factors]
    }


def speed(pair: list[Version], models: list[str], repeats: int) -> None:
    """Print CPU time per event; the versions take turns, scene by scene."""
    scenes = {(model, name): SCENES[name] for model in models for name in SCENES}
    if "rigid" in models:
        scenes |= {("rigid", name): scene for name, scene in RIGID_SCENES.items()}
    print(f"medians of {repeats} turns: CPU us per event, before over after [quartiles],")
    print("CPU us per run that are not spent on events")
    for (model, name), scene in scenes.items():
        values = values_of(scene, model)
        counts = [version.call(count_of, values) for version in pair]
        # The first turn compiles.
        turns = [[v.call(time_of, values) for v in pair] for _ in range(1 + repeats)][1:]
        failed = [item for item in counts + turns[0] if isinstance(item, Exception)]
        if failed:
            print(f"{model}, {name}: {failed[0]}")
            continue
        old, new = ([1e6 * turn[k][0] / counts[k] for turn in turns] for k in range(2))
        around = [1e6 * statistics.median(turn[k][1] for turn in turns) for k in range(2)]
        ratios = [before / after for before, after in zip(old, new, strict=True)]
        low, ratio, high = statistics.quantiles(ratios, n=4, method="inclusive")
        print(
            f"{model + ', ' + name:<26} {statistics.median(old):7.3f} -> "
            f"{statistics.median(new):7.3f}   x {ratio:.2f} [{low:.2f}, {high:.2f}]   "
            f"{around[0] / len(SPREAD):4.0f} -> {around[1] / len(SPREAD):4.0f}"
        )


def time_of(values: dict[str, Any]) -> tuple[float, float]:
    """CPU seconds of many runs that are spent on events, and those around it."""
    import damper

    given = parameters_of(values) | {"clearance": [values["clearance"] * c for c in SPREAD]}
    clock = [time.process_time()]
    for periods in (1, PERIODS + 1):
        damper.simulate(**given, transient=0, periods=periods, observers=[])
        clock.append(time.process_time())
    around = clock[1] - clock[0]
    return clock[2] - clock[1] - around, around


def count_of(values: dict[str, Any]) -> int:
    """Events of the same runs; periods if there are none."""
    import damper

    runs = [
        damper.Parameters(**parameters_of(values | {"clearance": values["clearance"] * c}))
        for c in SPREAD
    ]
    end = PERIODS * math.tau / values["frequency_ratio"]
    return sum(len(damper.events(p, until=end)) for p in runs) or PERIODS * len(runs)


def cold(sources: tuple[Path, Path]) -> None:
    """Print what a first call costs in a fresh process, with an empty and with a full cache."""
    print("seconds of wall time (CPU): import, first events; cold, then warm; before, then after")
    models = [model for model in MODELS if model != "stiff"] + ["two masses"]
    for model, source in product(models, sources):
        values = json.dumps(values_of(SCENES["generic"], model))
        command = [
            sys.executable,
            "-c",
            FIRST_CALL,
            source.resolve(),
            Path(__file__).parent,
            values,
        ]
        with tempfile.TemporaryDirectory() as cache:
            settings = {"env": os.environ | {"NUMBA_CACHE_DIR": cache}, "text": True}
            runs = [subprocess.run(command, capture_output=True, **settings) for _ in range(2)]
        texts = [run.stdout.strip() or run.stderr.strip().rpartition("\n")[2] for run in runs]
        print(f"{model:<14} {'; '.join(texts)}")


def size(sources: tuple[Path, Path]) -> None:
    """Print the size of the sources."""
    for source in map(Path.resolve, sources):
        for folder in (source, source.parent / "tests"):
            lines = sum(len(path.read_text().splitlines()) for path in folder.rglob("*.py"))
            print(f"{folder}: {lines} lines")
        functions, crowded, compiled = [], 0, 0
        for path in sorted(source.rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.FunctionDef):
                    name = f"{path.relative_to(source)}: {node.name}"
                    functions.append((node.end_lineno - node.lineno + 1, name))
                    crowded += sum(isinstance(part, ast.arg) for part in ast.walk(node.args)) > 7
                    names = [ast.unparse(part).split("(")[0] for part in node.decorator_list]
                    compiled += any(name.endswith(("compiled", ".of")) for name in names)
        print(f"  {len(functions)} functions; {crowded} have more than 7 arguments, {compiled} are")
        print("  compiled (also as implementations by model); the longest:")
        for lines, name in sorted(functions, reverse=True)[:10]:
            print(f"  {lines:5} lines: {name}")


if __name__ == "__main__":
    main()
