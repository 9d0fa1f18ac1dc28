"""Copies of the project in which Snakemake runs."""

import hashlib
import multiprocessing
import os
import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import yaml

ROOT = Path(__file__).parents[1]

PARTS = ("Snakefile", "workflow", "config", "profiles")


def copy_project(folder: Path) -> Path:
    for part in PARTS:
        source = ROOT / part
        if source.is_dir():
            shutil.copytree(source, folder / part)
        else:
            shutil.copy(source, folder / part)
    return folder


#: Importing Snakemake takes as long as all that it does in most of the tests: done once.
_WITH_SNAKEMAKE = multiprocessing.get_context("forkserver")
_WITH_SNAKEMAKE.set_forkserver_preload(
    ["snakemake.cli", "smart_open", "snakemake.report.html_reporter"]
)


def snakemake(folder: Path, *arguments: str, code: int = 0, **environment: str) -> str:
    """Run Snakemake in a folder, in a process of its own; its output."""
    with TemporaryDirectory() as beside:
        output = Path(beside, "output")
        command = ["--cores", "2", *arguments]
        process = _WITH_SNAKEMAKE.Process(
            target=_snakemake, args=(folder, command, output, os.environ | environment)
        )
        process.start()
        process.join()
        text = output.read_text()
    assert process.exitcode == code, text
    return text


def _snakemake(folder: Path, command: list[str], output: Path, environment: dict) -> None:
    from snakemake.cli import main

    os.environ.clear()
    os.environ.update(environment)
    sys.path[:0] = [path for path in environment.get("PYTHONPATH", "").split(os.pathsep) if path]
    os.chdir(folder)
    file = os.open(output, os.O_CREAT | os.O_WRONLY)
    os.dup2(file, 1)
    os.dup2(file, 2)
    sys.argv = ["snakemake", *command]
    main(command)


def jobs(output: str) -> dict[str, int]:
    """Rule -> number of jobs, from Snakemake's job table; rules of figures are one."""
    lines = output.splitlines()
    if "Job stats:" not in lines:
        return {}
    start = lines.index("Job stats:") + 3
    table = {}
    for line in lines[start:]:
        if not line.strip():
            break
        name, count = line.split()
        name = "figure" if name.startswith("figure_") else name
        table[name] = table.get(name, 0) + int(count)
    table.pop("total")
    return table


def digests(folder: Path) -> dict[str, str]:
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        # What a run cost is no result: it differs each time, and no other file holds it.
        if path.is_file() and path.name not in (".gitkeep", "cost.txt")
        if not {"timed", "logs"} & set(path.relative_to(folder).parts)
    }


def small_study(**changes) -> dict:
    study = {
        "title": "Small",
        "source": "test",
        "parameters": {"damping_ratio": 0.02, "clearance": 0.05},
        "axes": {
            "mass_ratio": {"values": [0.1, 0.2], "fan": True},
            "frequency_ratio": {"values": [1.3]},
            "restitution": {"start": 0.3, "stop": 0.9, "num": 5},
        },
        "transient": 10,
        "periods": 5,
        "observers": {"stroboscopic_section": {}, "bursts": {}},
    }
    return study | changes


#: Some runs of the small study have more.
MOST_EVENTS = 200


def write_small(folder: Path, **changes) -> None:
    (folder / "config/studies/small.yaml").write_text(
        yaml.safe_dump(small_study(**changes), sort_keys=False)
    )
    write_config(folder, "small")


def write_config(folder: Path, *studies: str) -> None:
    config = {"studies": list(studies), "engine": {"max_events": MOST_EVENTS}}
    (folder / "config/config.yaml").write_text(yaml.safe_dump(config))


MODEL = {"kind": "schematic", "drawing": "impact_damper"}

REDUCED = ("--configfile", "config/ci.yaml")
