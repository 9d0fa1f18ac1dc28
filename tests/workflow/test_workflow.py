"""What the workflow does, on a small study, without compiled code: that is not the point here."""

import functools
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml
from cases import thinned
from project_copy import (
    MODEL,
    MOST_EVENTS,
    ROOT,
    copy_project,
    digests,
    jobs,
    small_study,
    snakemake,
    write_config,
    write_small,
)

import damper


@pytest.fixture(autouse=True, scope="module")
def _plain():
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("DAMPER_COMPILE", "0")
        yield


@pytest.fixture
def small(tmp_path) -> Path:
    folder = copy_project(tmp_path)
    write_small(folder)
    return folder


SECTION = {"kind": "bifurcation", "along": "restitution", "at": {"mass_ratio": 0.1}}

PRODUCTS = {
    "observers": {"stroboscopic_section": {}, "bursts": {}, "impacts": {}},
    "figures": {
        "model": MODEL,
        "section": SECTION,
        "velocity": SECTION | {"variables": ["velocity"]},
    },
    "tables": {"orbits": {"kind": "two_impacts", "along": "restitution"}},
}


@pytest.fixture(scope="module")
def small_run(tmp_path_factory) -> Path:
    """Return a copy of the project in which a small study has run, and what the run printed."""
    folder = copy_project(tmp_path_factory.mktemp("small"))
    write_small(folder, **PRODUCTS)
    (folder / "printed").write_text(snakemake(folder))
    return folder


@pytest.fixture
def made(small_run, tmp_path) -> Path:
    """Return a copy of that, to be changed."""
    return shutil.copytree(small_run, tmp_path / "made")


def test_each_target_makes_just_what_it_needs(small):
    write_small(small, **PRODUCTS)
    figure = "results/small/figures/section.png"
    before = {"part": 2, "gather": 1}
    assert jobs(snakemake(small, "-n", figure)) == before | {"figure": 1}
    # A schematic waits for no simulation.
    assert jobs(snakemake(small, "-n", "results/small/figures/model.svg")) == {"figure": 1}


PUSH = "time (s),force\n0,0\n0.1,4\n0.2,0\n"


def add_pushed(folder: Path) -> Path:
    """Add a study under a record to the small one; return the file of the record."""
    study = small_study(
        forcing={"kind": "record", "file": "of {2}/{study} push.csv"},
        axes={"restitution": {"values": [0.6]}},
        observers={"impacts": {}},
    )
    study["parameters"] |= {"mass_ratio": 0.1, "frequency_ratio": 1.3}
    (folder / "config/studies/pushed.yaml").write_text(yaml.safe_dump(study))
    write_config(folder, "small", "pushed")
    push = folder / "config/studies/of {2}/{study} push.csv"
    push.parent.mkdir(exist_ok=True)
    push.write_text(PUSH)
    return push


def test_changes_rerun_just_what_hangs_on_them(made):
    slices = made / "results/small/parts"
    before = {path: path.stat().st_mtime_ns for path in slices.rglob("*.npz")}
    assert len(before) == 2

    def planned(*targets: str) -> dict[str, int]:
        return jobs(snakemake(made, "-n", *targets))

    # A touch is not an edit.
    for path in (made / "workflow/scripts").glob("*.py"):
        path.touch()
    assert planned() == {}

    # A caption concerns the figure alone, as does another drawing under the same name.
    drawing = MODEL | {"drawing": "collision_system"}
    changed = {"section": SECTION | {"caption": "New"}, "model": drawing}
    write_small(made, **PRODUCTS | {"figures": PRODUCTS["figures"] | changed})
    assert planned() == {"figure": 2, "all": 1}

    # One more value on an inner axis: all slices.
    axes = small_study()["axes"]
    longer = {"axes": axes | {"restitution": {"start": 0.3, "stop": 0.9, "num": 7}}}
    write_small(made, **longer, **PRODUCTS)
    assert planned()["part"] == 2

    # One more value on the fanned axis: its slice, and what hangs on the cube.
    wider = {"axes": axes | {"mass_ratio": {"values": [0.1, 0.2, 0.3], "fan": True}}}
    write_small(made, **wider, **PRODUCTS)
    push = add_pushed(made)
    output = snakemake(made, "all", "crate")
    assert jobs(output) == {"part": 2, "gather": 2, "figure": 1, "table": 1, "all": 1, "crate": 1}
    assert (made / "results/pushed" / push.name).read_bytes() == push.read_bytes()
    assert {path: path.stat().st_mtime_ns for path in before} == before
    with xr.open_dataset(made / "results/small/cube.nc") as cube:
        assert cube.mass_ratio.values.tolist() == [0.1, 0.2, 0.3]

    # The bytes of a record count for the jobs that use it, and not its date.
    postpone(push)
    assert planned() == {}
    push.write_text(PUSH.replace("0.1,4", "0.1,5"))
    assert planned("crate") == {"part": 1, "gather": 1, "crate": 1}


def test_a_process_of_one_job_reads_no_record_of_another(small):
    """Such as a job on a cluster: what has no sample would be refused."""
    write_small(small, figures={"model": MODEL})
    push = add_pushed(small)
    snakemake(small, "-n")
    push.write_text("")
    target = ("--target-jobs", "figure_0_of_small:", "--allowed-rules", "figure_0_of_small")
    snakemake(small, "--mode", "subprocess", *target)
    assert (small / "results/small/figures/model.svg").exists()


def test_edit_in_the_package_reruns_what_depends_on_it(made):
    """Decisions are the same without Snakemake's records, which a clone does not have."""
    shutil.rmtree(made / ".snakemake")
    package = made / "src"
    shutil.copytree(ROOT / "src", package, ignore=shutil.ignore_patterns("__pycache__"))
    # The results are those of the same package elsewhere, whose compiled code is there already.
    environment = {"PYTHONPATH": str(package)}
    assert "Nothing to be done" in snakemake(made, "-n", **environment)

    def append(name: str) -> None:
        path = package / "damper" / name
        path.write_text(path.read_text() + "\n# edited\n")

    append("figures/bifurcation.py")
    assert jobs(snakemake(made, "-n", **environment)) == {"figure": 1, "all": 1}
    append("observers/impacts.py")  # also imported by bursts
    append("engine/search.py")
    planned = jobs(snakemake(made, "-n", **environment))
    assert planned["part"] == 2
    assert planned["gather"] == planned["table"] == 1


def test_the_cube_is_that_of_python_and_the_run_says_what_it_cost(small_run):
    """Runs that reach their number of events say so, and stop nothing else."""
    output = (small_run / "printed").read_text()
    assert "parts         2 jobs" in output[output.index("Cost by stage") :]
    with xr.open_dataset(small_run / "results/small/cube.nc") as cube:
        direct = damper.simulate(
            mass_ratio=[0.1, 0.2],
            damping_ratio=0.02,
            frequency_ratio=1.3,
            clearance=0.05,
            restitution=cube.restitution.values,
            transient=10,
            periods=5,
            observers=("stroboscopic_section", "bursts", "impacts"),
            max_events=MOST_EVENTS,
        )
        there = cube.sel(frequency_ratio=1.3)
        for name in ("displacement", "status", "chatter", "complete_fraction"):
            np.testing.assert_array_equal(there[name], direct[name])
        assert set(np.unique(cube.status)) == {0, 1}
        stopped = int((cube.status != 0).sum())
        assert cube.attrs["runs_stopped_early"] == stopped
    assert f"small: {stopped} of 10 runs stopped early (`status` in the cube)\n" in output


def flip_a_byte(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


FUTURE = "files in results were dated in the future"


def postpone(*paths: Path) -> None:
    for path in paths:
        os.utime(path, (time.time() + 86400,) * 2)


def test_what_is_damaged_is_found_by_its_bytes_and_made_anew(made):
    """Whatever its date: neither a backup nor a wrong clock hides it, or makes it for ever."""
    results, before = made / "results/small", digests(made / "results")
    left = [results / "figures/old.svg", results / "interactive/section.js"]
    left[1].parent.mkdir()
    for path in left:
        path.touch()
    slices = sorted((results / "parts").rglob("*.npz"))
    slices[0].write_bytes(slices[0].read_bytes()[:-100])
    csv = results / "tables/orbits.csv"
    csv.write_text(csv.read_text().replace("0.1", "0.2", 1))
    flipped = [slices[1], results / "cube.nc", *(results / "figures").glob("[ms]*.*g")]
    for path in flipped:
        flip_a_byte(path)
    postpone(*slices, results / "figures/section.png")
    output = snakemake(made)
    assert output.count(FUTURE) == 1
    damaged = {path.relative_to(made) for path in (*slices, *flipped, csv.with_suffix(".md"))}
    # Of two files of one job, one is enough.
    found = {line.split()[0] for line in output.splitlines() if " is damaged, or of " in line}
    assert {path.removesuffix(".png").removesuffix(".svg") for path in found} == {
        str(path).removesuffix(".png").removesuffix(".svg") for path in damaged
    }
    assert jobs(output) == {"part": 2, "gather": 1, "figure": 2, "table": 1, "all": 1}
    # A job draws all figures of the cube; those that are sound stay.
    log = (made / "results/logs/small/figures/section.log").read_text()
    assert log == "drawing results/small/figures/section.svg\n"
    assert max(path.stat().st_mtime for path in made.rglob("*")) <= time.time()
    # Files that no entry makes are named, and removed when asked.
    assert "`snakemake --cores 1 tidy`" in output
    for path in left:
        assert f"  {path.relative_to(made)}\n" in output
    output = snakemake(made, "all", "tidy")
    assert FUTURE not in output
    assert jobs(output) == {"tidy": 1}
    assert digests(made / "results") == before


def test_a_slice_that_is_damaged_unnoticed_is_named_in_the_log_and_made_anew(made):
    """Its times are the same, as where a disk loses a bit: it shows when the slice is read."""
    path = min((made / "results/small/parts").rglob("*.npz"))
    snakemake(made, "-n")
    record = made / ".snakemake/checked"
    first = path.stat()
    flip_a_byte(path)
    os.utime(path, ns=(first.st_atime_ns, first.st_mtime_ns))
    kept = record.read_text()
    record.write_text(kept.replace(str(first.st_ctime_ns), str(path.stat().st_ctime_ns)))
    (made / "results/small/cube.nc").unlink()
    output = snakemake(made, "results/small/cube.nc", code=1)
    assert jobs(output) == {"gather": 1}
    for text in (output, (made / "results/logs/small/gather/cube.nc.log").read_text()):
        assert "Traceback" not in text
        assert f"{path.relative_to(made)} is damaged" in text
    assert jobs(snakemake(made, "-n"))["part"] == 1


def test_verify_names_what_is_not_sound_of_the_studies_it_is_given_and_makes_nothing(made):
    cube, csv = (made / "results/small" / path for path in ("cube.nc", "tables/orbits.csv"))
    flip_a_byte(cube)
    csv.write_text("")
    (made / "results/small/figures/model.png").unlink()
    figures = PRODUCTS["figures"] | {"section": SECTION | {"caption": "New"}}
    write_small(made, **PRODUCTS | {"figures": figures})
    shutil.copy(made / "config/studies/small.yaml", made / "config/studies/other.yaml")
    write_config(made, "small", "other")
    before = digests(made)
    verify = "from damper.shell import main; main()", "verify", "--cores", "2", "other", "small"
    done = subprocess.run([sys.executable, "-c", *verify], cwd=made, capture_output=True, text=True)
    # Two slices, the cube, a schematic and two figures of two files each, a table.
    assert (done.returncode, done.stdout.splitlines()) == (
        1,
        [
            "results/other, 9 files: missing",
            "results/small/cube.nc: damaged, or of an earlier version",
            "results/small/figures/model.png: missing",
            "results/small/figures/section.png: out of date, made with other settings or code",
            "results/small/figures/section.svg: out of date, made with other settings or code",
            "results/small/tables/orbits.md or the CSV beside it: damaged, or of an earlier "
            "version",
            "5 files are sound, 14 are not.",
        ],
    ), done.stderr
    after = digests(made)
    unchanged = {path for path in before if not path.startswith(".snakemake")}
    assert {path: after[path] for path in unchanged} == {path: before[path] for path in unchanged}
    quiet = ("--quiet=all", "--dry-run")
    assert snakemake(made, *quiet, code=1, DAMPER_VERIFY="smal").splitlines()[-1] == (
        "damper verify: unknown study 'smal' (did you mean 'small'?): must be one of small, other"
    )


def test_the_reason_of_a_failure_is_in_its_log(small, tmp_path):
    """And that the cache of compiled code is not used is said on the screen, once."""
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(0o777)
    script = small / "workflow/scripts/part.py"
    script.write_text(
        script.read_text().replace("part = ", 'raise ValueError("as a test")\npart = ')
    )
    output = snakemake(small, code=1, NUMBA_CACHE_DIR=str(shared), DAMPER_COMPILE="1")
    assert output.count(f"others may write to {shared} (mode 777); each job compiles") == 1
    logs = sorted((small / "results/logs/small/parts").rglob("*.log"))
    for text in (output, logs[0].read_text()):
        assert "ValueError: as a test" in text
        assert "Traceback" in text
    end = output.partition("Some jobs failed; the reason of each is in its log:\n")[2].splitlines()
    assert sorted(end[:2]) == [f"  {log.relative_to(small)}" for log in logs]
    assert end[2] == "The same command makes what is missing, and again what was cut short."


CANCEL = """
import os, signal, time
from pathlib import Path
os.kill(os.getppid(), signal.SIGINT)
for _ in range(6000):
    if any("Terminating" in path.read_text() for path in Path(".snakemake/log").iterdir()):
        break
    time.sleep(0.05)
"""


def test_a_run_that_is_cancelled_says_so(small):
    """Nothing failed; what was under way comes to its end, and is made again."""
    script = small / "workflow/scripts/part.py"
    text = script.read_text()
    script.write_text(text.replace("part = ", f"{CANCEL}part = "))
    run = [sys.executable, "-m", "snakemake", "--cores", "1"]
    # A shell in the background lets its processes ignore an interrupt.
    heed = functools.partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    process = subprocess.run(run, cwd=small, capture_output=True, text=True, preexec_fn=heed)
    assert process.returncode == 1
    end = process.stderr.partition("Terminating processes on user request")[2].splitlines()
    assert end[1:3] == [
        "The run was stopped before its end.",
        "The same command makes what is missing, and again what was cut short.",
    ]
    script.write_text(text)
    assert jobs(snakemake(small, "-n"))["part"] == 2


def test_all_mistakes_of_all_files_at_once(small):
    """What is said of each mistake is in tests/study; here, that it is said, and harms nothing."""
    kept = small / "results/small/cube.nc"
    kept.parent.mkdir(parents=True)
    kept.write_text("made before")
    write_small(small, transient=-1, periods=0)
    (small / "config/studies/empty.yaml").write_text("")
    (small / "config/studies/broken.yaml").write_text("title: [")
    (small / "config/config.yaml").write_text(
        "studies: [small, empty, broken, smal]\nengine: {acuracy: 1e-8}\n"
    )
    output = snakemake(small, code=1)
    assert "Traceback" not in output
    for part in (
        "transient",
        "periods",
        "empty.yaml",
        "broken.yaml",
        "'smal'",
        "did you mean 'small'",
        "'acuracy'",
        "did you mean 'accuracy'",
    ):
        assert part in output
    assert kept.read_text() == "made before"


def test_targets_are_made_when_asked_for(small):
    other = yaml.safe_dump(small_study(title="Other", transient=1000))
    (small / "config/studies/other.yaml").write_text(other)
    (small / "config/config.yaml").write_text(
        "studies: [small]\ntargets: {1-more: [other, small]}\n"
    )
    asked = snakemake(small, "-n", "1-more")
    assert "results/other/cube.nc" in asked
    # It pays to compile for the longer one alone.
    assert jobs(asked) == {"compile": 1, "part": 4, "gather": 2, "1-more": 1}


def test_every_kind_of_study_of_the_default_run_is_planned(tmp_path: Path) -> None:
    planned = jobs(snakemake(copy_project(tmp_path), "-n", "all", "verification"))
    assert planned["part"] > planned["gather"] > 20
    # Run times of solvers, of a few scenes and of all.
    assert planned["timed"] == 2


@pytest.mark.parametrize("command", thinned(["--unlock", "--rulegraph"], ["--unlock"].__contains__))
def test_commands_that_start_no_job_need_no_cores(tmp_path: Path, command: str) -> None:
    """With all studies, those that take all cores among them."""
    folder = copy_project(tmp_path)
    done = subprocess.run(
        [sys.executable, "-m", "snakemake", command], cwd=folder, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


def test_lint_finds_nothing_but_what_is_argued(tmp_path):
    """Each of these is argued in docs/design.md."""
    output = snakemake(copy_project(tmp_path), "--lint", code=1)
    assert set(re.findall(r"^    \* (.*)", output, re.MULTILINE)) == {
        "Specify a conda environment or container for each rule.:",
        "Mixed rules and functions in same snakefile.:",
    }
