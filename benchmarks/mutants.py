"""Mutation test: how many small mistakes in the source do the tests find?

    python benchmarks/mutants.py --count 200 [--seed 1] [--only engine,study] [--jobs 2]
    python benchmarks/mutants.py --count 200 --again 17,98

The second command runs two of the same mutants again, such as survivors with other tests.

Mutants are drawn at random, the same ones for a seed and a source: a sign, an operator, a
comparison, a number off by one, a negated condition, a dropped term. Each runs the tests of its
room in plain Python until the first failure. Printed: a line for each surviving mutant, and the
share of killed mutants by room. A surviving mutant is a place to look: many change nothing.
"""

import argparse
import ast
import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).parents[1]
#: Room -> the tests that should find its mutants, the likeliest first.
ROOMS = {
    "engine": ("tests/engine", "tests/models"),
    "models": ("tests/models", "tests/observers"),
    "sweep/orbits": ("tests/sweep/test_orbits.py", "tests/sweep/test_orbit_branches.py"),
    "sweep": ("tests/sweep", "tests/study"),
    "observers": ("tests/observers",),
    "study": ("tests/study",),
    "parameters": ("tests/parameters", "tests/sweep", "tests/study"),
    "analysis": ("tests/analysis", "tests/tables", "tests/figures"),
    "figures": ("tests/figures", "tests/analysis"),
    "theory": ("tests/theory", "tests/analysis"),
    "papers": ("tests/papers",),
    "verification": ("tests/verification",),
}
#: Processor time of a mutant's tests in s; a mutant that takes longer counts as killed.
MOST_SECONDS = 600
SWAPPED = {
    ast.Add: "-",
    ast.Sub: "+",
    ast.Mult: "/",
    ast.Div: "*",
    ast.Lt: "<=",
    ast.LtE: "<",
    ast.Gt: ">=",
    ast.GtE: ">",
    ast.Eq: "!=",
    ast.NotEq: "==",
    ast.And: "or",
    ast.Or: "and",
}


def changes(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the mutants of an expression."""
    if isinstance(node, ast.BinOp) and type(node.op) in SWAPPED:
        yield ast.parse(
            f"({ast.unparse(node.left)}) {SWAPPED[type(node.op)]} ({ast.unparse(node.right)})"
        )
        if isinstance(node.op, ast.Add | ast.Sub):
            yield node.left
    elif isinstance(node, ast.Compare) and type(node.ops[0]) in SWAPPED and len(node.ops) == 1:
        sign = SWAPPED[type(node.ops[0])]
        yield ast.parse(f"({ast.unparse(node.left)}) {sign} ({ast.unparse(node.comparators[0])})")
    elif isinstance(node, ast.BoolOp):
        sign = f" {SWAPPED[type(node.op)]} "
        yield ast.parse(sign.join(f"({ast.unparse(value)})" for value in node.values))
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.Not):
        yield node.operand
    elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
        yield ast.Constant(node.value + 1)


def mutants(path: Path) -> Iterator[tuple[int, str, str, str]]:
    """Yield line, old text, new text and whole source of every mutant of a module."""
    source = path.read_text(encoding="utf-8")
    lines = source.splitlines(keepends=True)
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line.encode()))
    raw = source.encode()
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.expr):
            continue
        begin = starts[node.lineno - 1] + node.col_offset
        end = starts[node.end_lineno - 1] + node.end_col_offset
        for change in changes(node):
            new = f"({ast.unparse(change)})".encode()
            changed = (raw[:begin] + new + raw[end:]).decode()
            yield node.lineno, raw[begin:end].decode(), new.decode(), changed


def run(number: int, room: str, path: Path, mutant: tuple[int, str, str, str]) -> tuple[str, bool]:
    """Run the room's tests with a mutant; return the room and whether a test failed."""
    line, old, new, source = mutant
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "project"
        shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(".*", "results", "site"))
        (copy / path.relative_to(ROOT)).write_text(source, encoding="utf-8")
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "0", "-p", "no:cacheprovider"]
        command += ["--ignore=tests/engine/test_compiled.py"]
        done = subprocess.run(
            [*command, *ROOMS[room]],
            cwd=copy,
            env=os.environ | {"PYTHONPATH": f"{copy / 'src'}", "DAMPER_COMPILE": "0"},
            capture_output=True,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (MOST_SECONDS,) * 2),
        )
    killed = done.returncode != 0
    word = "killed  " if killed else "SURVIVED"
    text = f"{path.relative_to(ROOT)}:{line}: {' '.join(old.split())} -> {' '.join(new.split())}"
    print(f"{number:4d} {word} {text[:150]}", flush=True)
    return room, killed


def main() -> None:
    """Draw mutants, run their tests, and print who survived."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default=",".join(ROOMS), help="rooms, separated by commas")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--again", default="", help="numbers of mutants, separated by commas")
    options = parser.parse_args()
    draw, drawn = random.Random(options.seed), []
    rooms = options.only.split(",")
    files = {room: sorted((ROOT / "src/damper" / room).rglob("*.py")) for room in rooms}
    for number in range(options.count):
        room = rooms[number % len(rooms)]
        found: list[tuple[int, str, str, str]] = []
        while not found:
            path = draw.choice(files[room])
            found = list(mutants(path))
        drawn.append((number, room, path, draw.choice(found)))
    if options.again:
        drawn = [each for each in drawn if str(each[0]) in options.again.split(",")]
    with ThreadPoolExecutor(options.jobs) as pool:
        results = list(pool.map(lambda each: run(*each), drawn))
    killed, runs = Counter(room for room, yes in results if yes), Counter(r for r, _ in results)
    for room, count in runs.items():
        print(f"{room}: {killed[room]} of {count} killed")


if __name__ == "__main__":
    main()
