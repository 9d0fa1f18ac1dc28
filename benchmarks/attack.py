"""Attack a small study while the workflow runs, and see whether the same command mends it.

    PYTHONPATH=tests python benchmarks/attack.py [kills] [full] [read-only] [two] [memory]
        [damage] [install]

After each attack RECOVERY must end well and give the bytes of an undisturbed run. KILLS is the
number of kills, and of damaged files, 20 unless told. Not a part of the tests: it takes a quarter
of an hour, and a full disk and a read-only one are mounted, which takes root. `install` kills
README's first command while it installs; there the same command is all it takes.
"""

import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import project_copy as project

RECOVERY = "snakemake --unlock; snakemake --cores 2"
FIGURE = {"kind": "bifurcation", "along": "restitution", "rows": "mass_ratio"}
TABLE = {"kind": "intervals", "along": "restitution"}
ROUNDS = int(os.environ.get("KILLS", "20"))
SNAKEMAKE = (sys.executable, "-m", "snakemake")


def start(folder: Path, limit: Callable[[], None] | None = None) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [*SNAKEMAKE, "--cores", "2"],
        cwd=folder,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
        preexec_fn=limit,
    )


def recover(folder: Path) -> str:
    """Empty if RECOVERY mended it, else what was wrong."""
    subprocess.run([*SNAKEMAKE, "--unlock"], cwd=folder, capture_output=True)
    output, _ = (process := start(folder)).communicate()
    if process.returncode:
        return f"the recovery failed:\n{output}"
    made = project.digests(folder / "results")
    wrong = {path for path in EXPECTED.keys() | made if EXPECTED.get(path) != made.get(path)}
    return f"other bytes: {sorted(wrong)}" if wrong else ""


def kills(folder: Path) -> Iterator[tuple[str, str]]:
    """kill -9 at random moments and in the midst of files; every other time jobs stay alive."""
    chance = random.Random(13)
    for each in range(ROUNDS):
        shutil.rmtree(folder / "results/small", ignore_errors=True)
        process = start(folder)
        watched = chance.choice(["cube.nc", "figures/section.svg", "parts", None, None, None])
        end = time.monotonic() + (chance.uniform(2, TIME / 2) if watched is None else 3 * TIME)
        while time.monotonic() < end and process.poll() is None:
            if watched and (folder / "results/small" / watched).exists():
                break
            time.sleep(0.001)
        if process.poll() is not None:
            yield f"{watched or 'some time'}", "the run ended before it could be killed"
            continue
        (os.kill if each % 2 else os.killpg)(process.pid, signal.SIGKILL)
        how = f"kill {'with orphans' if each % 2 else 'of all'}, {watched or 'some time'}"
        yield how, recover(folder)
        process.communicate()


def on_disk(folder: Path, options: str) -> str:
    """Run with results on a disk of their own; enlarge it, make it writable and recover."""
    shutil.rmtree(folder / "results/small", ignore_errors=True)
    (folder / "results/small").mkdir()
    place = str(folder / "results/small")
    subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", place], check=True)
    try:
        output, _ = (process := start(folder)).communicate()
        if process.returncode == 0:
            return "the attack did nothing"
        subprocess.run(["mount", "-o", "remount,rw,size=100m", place], check=True)
        shown = (
            ""
            if any(reason in output for reason in ("No space", "free on its disk", "Read-only"))
            else f"no reason in:\n{output}"
        )
        return recover(folder) or shown
    finally:
        subprocess.run(["umount", "--lazy", place], check=True)


def full(folder: Path) -> Iterator[tuple[str, str]]:
    """A disk that is full at the first part, the second, the cube, the figure."""
    for size in (4, 16, 64):
        yield f"disk of {size} kB", on_disk(folder, f"size={size}k")


def read_only(folder: Path) -> Iterator[tuple[str, str]]:
    yield "read-only results", on_disk(folder, "ro")


def two(folder: Path) -> Iterator[tuple[str, str]]:
    """The second one must refuse to run, and say so."""
    shutil.rmtree(folder / "results/small", ignore_errors=True)
    first = start(folder)
    time.sleep(TIME / 3)
    output, _ = (second := start(folder)).communicate()
    first.communicate()
    refused = second.returncode and "lock" in output
    yield "two at once", "" if refused else f"the second one ran:\n{output}"
    yield "after two at once", recover(folder) or ("the first one failed" * first.returncode)


def memory(folder: Path) -> Iterator[tuple[str, str]]:
    """Jobs that may take so many MB."""
    for size in (300, 400):
        shutil.rmtree(folder / "results/small", ignore_errors=True)

        def limit(size: int = size) -> None:
            resource.setrlimit(resource.RLIMIT_AS, (size * 2**20, size * 2**20))

        output, _ = (process := start(folder, limit)).communicate()
        wrong = "" if process.returncode else "the attack did nothing"
        yield f"{size} MB: {output.strip().splitlines()[-1][:80]}", recover(folder) or wrong


def damage(folder: Path) -> Iterator[tuple[str, str]]:
    """A flipped byte, a cut, or a line too many in any result, and dates in the future."""
    chance = random.Random(13)
    yield "before", recover(folder)
    for _ in range(ROUNDS):
        path = folder / "results" / chance.choice([p for p in EXPECTED if p.startswith("small/")])
        data = bytearray(path.read_bytes())
        at, how = chance.randrange(len(data)), chance.choice(["flipped", "cut", "longer"])
        data[at] ^= 1 << chance.randrange(8) if how == "flipped" else 0
        path.write_bytes(data[:at] if how == "cut" else data + b"\n" * (how == "longer"))
        days = chance.choice([0, 1, 1000])
        os.utime(path, (date := time.time() + 86400 * days, date))
        yield f"{path.name} {how} at {at}, {days} days ahead", recover(folder)


def install(folder: Path) -> Iterator[tuple[str, str]]:
    """kill -9 while the environment is made, packages are fetched, and installed."""
    clone = folder / "clone"
    subprocess.run(["git", "clone", "--quiet", project.ROOT, clone], check=True)
    readme = (project.ROOT / "README.md").read_text()
    command = next(line for line in readme.splitlines() if line.startswith("python3 -m venv"))
    command = command.replace("snakemake --cores 2", "snakemake -n")
    run = {"shell": True, "cwd": clone, "text": True, "stdout": subprocess.PIPE}
    run |= {"stderr": subprocess.STDOUT, "start_new_session": True}
    for seconds in (1.5, 12, 25):
        process = subprocess.Popen(command, **run)
        time.sleep(seconds)
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
    done = subprocess.run(command, **run)
    yield "kills during installation", done.stdout if done.returncode else ""


ATTACKS = {
    "kills": kills,
    "full": full,
    "read-only": read_only,
    "two": two,
    "memory": memory,
    "damage": damage,
    "install": install,
}

if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        folder = project.copy_project(Path(name))
        project.MOST_EVENTS = 100_000  # all runs come to their end, which the table needs
        project.write_small(folder, figures={"section": FIGURE}, tables={"edges": TABLE})
        project.snakemake(folder)
        EXPECTED = project.digests(folder / "results")
        shutil.rmtree(folder / "results/small")
        began = time.monotonic()
        project.snakemake(folder)
        TIME = time.monotonic() - began
        print(f"an undisturbed run takes {TIME:.0f} s", flush=True)
        failed = 0
        for attack in sys.argv[1:] or ATTACKS:
            for what, wrong in ATTACKS[attack](folder):
                failed += bool(wrong)
                print(f"{what}: {wrong or 'mended'}", flush=True)
        sys.exit(f"{failed} attacks were not mended" if failed else 0)
