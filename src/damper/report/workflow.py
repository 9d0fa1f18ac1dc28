"""Decisions and messages of the workflow that need no Snakemake: stale files, costs, failures."""

from __future__ import annotations

import os
import re
import shutil
import time
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from damper.study.fingerprint import Checked, fingerprint
from damper.study.study_file import SUFFIXES

#: Sorts of jobs that belong to no study.
_OF_NO_STUDY = ("compile", "claims", "report")
#: Free bytes of a disk below which jobs cannot write.
_FULL_DISK = 2_000_000


class JobSettings(dict[str, Callable[[], Any]]):
    """Path of each file of results -> function that returns the settings of the job behind it."""

    def __init__(self) -> None:
        super().__init__()
        self._found: dict[str, tuple[Any, str]] = {}

    def settings_of(self, path: str) -> Any:
        """Return the settings of the job that makes a file."""
        return self._read(path)[0]

    def fingerprint_of(self, path: str) -> str:
        """Return the fingerprint that a file should have."""
        return self._read(path)[1]

    def _read(self, path: str) -> tuple[Any, str]:
        if path not in self._found:
            settings = self[path]()
            self._found[path] = settings, fingerprint(settings)
        return self._found[path]

    def mistake_in(self, path: str, checked: Checked) -> str:
        """Return ``damaged`` or ``out of date`` for a file that is; nothing for a sound one."""
        found = checked.fingerprint_in(path)
        if found is None:
            return "damaged"
        return "" if found == self.fingerprint_of(path) else "out of date"

    def verify(
        self, checked: Checked, expected: Iterable[str], skip: Callable[[str], bool]
    ) -> tuple[list[str], bool]:
        """Compare all files of results with the settings of their jobs.

        Parameters
        ----------
        checked : Checked
        expected : iterable of str
            Files that should exist.
        skip : callable
            Whether a path is not compared.

        Returns
        -------
        lines : list of str
            A line for each mistake, and one with the numbers of sound and other files.
        wrong : bool
            Whether there is any mistake.
        """
        sound, wrong = 0, []
        for path in self:
            if skip(path) or not os.path.exists(path):
                continue
            match self.mistake_in(path, checked):
                case "":
                    sound += 1
                case "damaged":
                    beside = " or the CSV beside it" if path.endswith(".md") else ""
                    wrong.append(f"{path}{beside}: damaged, or of an earlier version")
                case _:
                    wrong.append(f"{path}: out of date, made with other settings or code")
        missing: dict[str, list[str]] = {}
        for path in {path for path in expected if not os.path.exists(path)}:
            gone = [str(folder) for folder in Path(path).parents if not folder.exists()]
            missing.setdefault(gone[-1] if gone else path, []).append(path)
        lines = wrong + [
            f"{f'{place}, {len(paths)} files' if paths[1:] else paths[0]}: missing"
            for place, paths in missing.items()
        ]
        bad = len(wrong) + sum(map(len, missing.values()))
        return [*sorted(lines), f"{sound} files are sound, {bad} are not."], bool(bad)


def redate(folder: str, now: float) -> str:
    """Date files of the future to `now`; return a message, or nothing where there are none.

    A wrong clock or another machine dates files so. Results made of them now would be older
    than they are, and out of date for ever.
    """
    late = []
    for path in (Path(parent, name) for parent, _, names in os.walk(folder) for name in names):
        with suppress(OSError):  # gone meanwhile, where another run is under way
            if path.lstat().st_mtime > time.time():
                os.utime(path, (now, now), follow_symlinks=False)
                late.append(path)
    if not late:
        return ""
    text = f"{len(late)} files in {folder} were dated in the future, such as {late[0]}"
    return f"{text}: now they have the present date"


def failed_lines(text: str, folders: Iterable[Path] = ()) -> list[str]:
    """Return the logs of failed jobs, full disks, and the next step.

    `text` is Snakemake's own log, which names those of failed jobs; jobs write to `folders`.
    """
    logs: dict[bool, dict[str, None]] = {True: {}, False: {}}
    for path in map(Path, re.findall(r"log: (.+) \(check log file", text)):
        logs[_gives_reason(path)][f"  {path}"] = None
    lines = []
    if logs[True]:
        lines += ["Some jobs failed; the reason of each is in its log:", *logs[True]]
    if logs[False]:
        head = "Jobs that were killed, or could not write; above it says how they ended:"
        lines += [head, *logs[False]]
        if Path(".snakemake/slurm_logs").is_dir():
            lines += ["Logs of Slurm, which say what it has cancelled: .snakemake/slurm_logs"]
    lines = lines or ["The run was stopped before its end."]
    for folder in {folder.stat().st_dev: folder for folder in folders if folder.is_dir()}.values():
        free = shutil.disk_usage(folder).free
        if free < _FULL_DISK:
            lines += [f"The disk that holds {folder} is full: {free // 1000} kB are free"]
    return [*lines, "The same command makes what is missing, and again what was cut short."]


def _gives_reason(log: Path) -> bool:
    """Whether a log ends with more than how far the job is."""
    text = log.read_text(encoding="utf-8", errors="replace").rstrip() if log.is_file() else ""
    return not re.fullmatch(r"|\d+ of \d+ points.*", text.rpartition("\n")[2])


def cost_by_stage(folder: Path, since: float) -> str:
    """Return the wall seconds of the jobs since a time, by stage, from Snakemake's benchmarks."""
    seconds: dict[str, list[float]] = {}
    for path in sorted(folder.rglob("*.tsv")):
        if path.stat().st_mtime > since:
            # <study>/<stage>..., or <stage>/... of no study.
            first, second = (*path.relative_to(folder).with_suffix("").parts, "")[:2]
            stage = first if first in _OF_NO_STUDY else second or first
            numbers = path.read_text(encoding="utf-8").splitlines()[1]
            seconds.setdefault(stage, []).append(float(numbers.split("\t")[0]))
    lines = [
        f"  {stage:<10} {len(each):4d} jobs {sum(each):8.1f} s" for stage, each in seconds.items()
    ]
    return "\n".join(["Cost by stage (wall time, summed over jobs):", *lines]) if lines else ""


def left_over(results: Path, studies: Iterable[str], made: Collection[str]) -> Iterator[Path]:
    """Yield figures and tables of studies that are not `made` by any entry, such as one renamed.

    Paths in `made` are below `results`.
    """
    folders = (*SUFFIXES, *(f"timed/{section}" for section in SUFFIXES), "interactive")
    for study in studies:
        for folder in folders:
            for path in sorted((results / study / folder).glob("*")):
                if path.relative_to(results).as_posix() not in made:
                    yield path
