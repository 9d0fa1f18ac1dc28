"""Decisions and messages of the workflow, without Snakemake."""

import os
import shutil
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from damper.report.workflow import JobSettings, cost_by_stage, failed_lines, left_over, redate
from damper.study.fingerprint import Checked, stamp


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(path: str, text: str = "text") -> Path:
    file = Path(path)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    return file


@pytest.fixture
def made(folder) -> JobSettings:
    """Two figures and a table, as their jobs have written them."""
    settings = JobSettings()
    for name in ("a/one.svg", "a/two.svg", "a/three.md"):
        settings[name] = {"name": name}.copy
        write(name)
        if name.endswith(".md"):
            write("a/three.csv", "1,2")
        stamp([name], {"name": name})
    return settings


def verified(made: JobSettings, *expected: str) -> tuple[list[str], bool]:
    return made.verify(Checked(Path("checked")), expected, lambda path: path == "skipped.svg")


def test_sound_results(made):
    assert verified(made, *made) == (["3 files are sound, 0 are not."], False)


def test_damaged_stale_and_missing_results_are_named(made):
    write("skipped.svg")
    made |= {"skipped.svg": dict, "a/later.svg": dict, "a/one.svg": lambda: {"name": "other"}}
    path = Path("a/two.svg")
    path.write_text(path.read_text().replace("text", "tyxt"))
    write("a/three.csv", "1,3")
    assert verified(made, *made) == (
        [
            "a/later.svg: missing",
            "a/one.svg: out of date, made with other settings or code",
            "a/three.md or the CSV beside it: damaged, or of an earlier version",
            "a/two.svg: damaged, or of an earlier version",
            "0 files are sound, 4 are not.",
        ],
        True,
    )


def test_results_that_are_gone_are_counted_by_their_folder(made):
    deleted = ["b/cube.nc", "b/figures/x.svg", "b/figures/y.svg", "a/later/z.svg"]
    assert verified(made, *made, *deleted) == (
        ["a/later/z.svg: missing", "b, 3 files: missing", "3 files are sound, 4 are not."],
        True,
    )
    assert verified(JobSettings(), "c/cube.nc")[1]


def test_a_file_under_the_name_of_another_is_out_of_date(made):
    checked = Checked(Path("checked"))
    assert made.mistake_in("a/one.svg", checked) == ""
    shutil.copy2("a/two.svg", "a/one.svg")
    assert made.mistake_in("a/one.svg", checked) == "out of date"


def test_settings_of_a_job_are_formed_once():
    calls = []
    made = JobSettings()
    made["a"] = lambda: calls.append("a") or {"value": 1}
    assert made.settings_of("a") == {"value": 1}
    assert len(made.fingerprint_of("a")) == 16
    assert calls == ["a"]


def test_files_of_the_future_get_the_present_date(folder):
    now = time.time()
    old, late = write("results/old"), write("results/late")
    os.utime(old, (1.0, 1.0))
    os.utime(late, (now + 1e5, now + 1e5))
    text = "1 files in results were dated in the future, such as results/late: now they have"
    assert redate("results", now).startswith(text)
    assert (old.stat().st_mtime, late.stat().st_mtime) == (1.0, pytest.approx(now))
    assert redate("results", now) == ""


NAMES = ("full", "full", "empty", "none", "killed", "wrong")
LOG = "log: {} (check log file(s) for error details)\n"


def test_logs_of_failed_jobs(folder):
    write("full.log"), write("empty.log", "")
    # As after scancel: no more than how far the job was.
    write("killed.log", "1 of 40 points\n12 of 40 points, 3.4 a second, 8.2 s left\n")
    write("wrong.log", "1 of 40 points\nKeyError: 1\n")
    logs = [LOG.format(f"{name}.log") for name in NAMES]
    end = "The same command makes what is missing, and again what was cut short."
    assert failed_lines("".join(logs)) == [
        "Some jobs failed; the reason of each is in its log:",
        *("  full.log", "  wrong.log"),
        "Jobs that were killed, or could not write; above it says how they ended:",
        *("  empty.log", "  none.log", "  killed.log"),
        end,
    ]
    assert failed_lines("Terminating processes") == ["The run was stopped before its end.", end]


def test_a_full_disk_is_named(folder, monkeypatch):
    """Once, although two folders lie on it."""
    usage = SimpleNamespace(free=4096)
    monkeypatch.setattr("shutil.disk_usage", lambda path: usage)
    said = failed_lines(LOG.format("none.log"), [Path("nowhere"), folder.parent, folder])
    assert said[2] == f"The disk that holds {folder} is full: 4 kB are free"
    assert len(said) == 4
    usage.free = 10**9
    assert len(failed_lines(LOG.format("none.log"), [folder])) == 3


def test_costs_are_summed_by_stage(folder):
    for path, seconds in {"s/parts/a": 1, "s/parts/b": 2, "report/report": 4, "s/old": 8}.items():
        write(f"times/{path}.tsv", f"s\th:m:s\n{seconds}.0\t0:00:01\n")
    os.utime("times/s/old.tsv", (1.0, 1.0))
    assert cost_by_stage(Path("times"), 2.0).splitlines()[1:] == [
        "  report        1 jobs      4.0 s",
        "  parts         2 jobs      3.0 s",
    ]
    assert cost_by_stage(Path("nowhere"), 2.0) == ""


def test_figures_of_no_entry(folder):
    left = [f"r/s/{path}" for path in ("figures/old.svg", "timed/tables/t.md", "interactive/i.js")]
    for path in (*left, "r/s/figures/new.svg", "r/other/figures/o.svg", "r/s/cube.nc"):
        write(path)
    assert list(map(str, left_over(Path("r"), ["s"], ["s/figures/new.svg"]))) == left
