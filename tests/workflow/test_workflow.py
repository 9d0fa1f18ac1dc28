"""The workflow, run for real by Snakemake on a reduced configuration."""

import hashlib
import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml

import damper
from damper.verification.stress.laws import LAW_NAMES, broken

ROOT = Path(__file__).parents[2]
PARTS = ("Snakefile", "workflow", "config", "profiles")

#: Studies that check the engine; what they make is their own.
CHECKS = ("solvers", "stress", "cost")


def copy_project(folder: Path) -> Path:
    for part in PARTS:
        source = ROOT / part
        if source.is_dir():
            shutil.copytree(source, folder / part)
        else:
            shutil.copy(source, folder / part)
    return folder


def snakemake(folder: Path, *arguments: str, code: int = 0, **environment: str) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "snakemake", "--cores", "2", *arguments],
        cwd=folder,
        env=os.environ | environment,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert done.returncode == code, done.stdout
    return done.stdout


def jobs(output: str) -> dict[str, int]:
    """Rule -> number of jobs, from Snakemake's job table."""
    lines = output.splitlines()
    if "Job stats:" not in lines:
        return {}
    start = lines.index("Job stats:") + 3
    table = {}
    for line in lines[start:]:
        if not line.strip():
            break
        name, count = line.split()
        table[name] = int(count)
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


def write_small(folder: Path, **changes) -> None:
    (folder / "config/studies/small.yaml").write_text(
        yaml.safe_dump(small_study(**changes), sort_keys=False)
    )
    (folder / "config/config.yaml").write_text("studies: [small]\n")


REDUCED = ("--configfile", "config/ci.yaml")


@pytest.fixture(scope="module")
def reduced(tmp_path_factory) -> Path:
    """Return a copy of the project in which the reduced workflow has run."""
    folder = copy_project(tmp_path_factory.mktemp("reduced"))
    snakemake(folder, *REDUCED)
    return folder


@pytest.fixture(scope="module")
def everything(tmp_path_factory) -> Path:
    """Return a copy of the project in which all studies have run, each of them small."""
    folder = copy_project(tmp_path_factory.mktemp("everything"))
    names = yaml.safe_load((ROOT / "config/config.yaml").read_text())["studies"]
    snakemake(folder, "all", "calibration", *REDUCED, "--config", f"studies={names}")
    return folder


@pytest.fixture
def small(tmp_path) -> Path:
    folder = copy_project(tmp_path)
    write_small(folder)
    return folder


MODEL = {"kind": "schematic", "drawing": "impact_damper"}
SECTION = {"kind": "bifurcation", "along": "restitution", "rows": "mass_ratio"}
PRODUCTS = {
    "figures": {"model": MODEL, "section": SECTION},
    "tables": {"edges": {"kind": "intervals", "along": "restitution"}},
}


@pytest.fixture(scope="module")
def small_run(tmp_path_factory) -> Path:
    """Return a copy of the project in which a small study has run."""
    folder = copy_project(tmp_path_factory.mktemp("small"))
    write_small(folder, **PRODUCTS)
    snakemake(folder)
    return folder


@pytest.fixture
def made(small_run, tmp_path) -> Path:
    """Return a copy of that, to be changed."""
    return shutil.copytree(small_run, tmp_path / "made")


def test_reduced_run_makes_everything(reduced):
    made = digests(reduced / "results/ci/restitution")
    figures = [
        f"figures/bifurcation_mass_ratio~{m}.{e}" for m in ("0.25", "0.05") for e in ("png", "svg")
    ]
    tables = ["tables/paper_b_table.csv", "tables/paper_b_table.md"]
    figures += ["figures/paper_b_fig_1.png", "figures/paper_b_fig_1.svg"]
    assert set(made) == {"cube.nc", *figures, *tables, "slices/frequency_ratio~1.5.npz"}


def test_cube_opens_in_plain_xarray_and_matches_simulate(reduced):
    with xr.open_dataset(reduced / "results/ci/restitution/cube.nc") as cube:
        assert cube.displacement.dims == ("mass_ratio", "frequency_ratio", "restitution", "sample")
        assert dict(cube.sizes) == {
            "mass_ratio": 2,
            "frequency_ratio": 1,
            "restitution": 41,
            "sample": 20,
            "threshold": 3,
        }
        for name in ("title", "source", "references", "study", "code_digest", "accuracy"):
            assert cube.attrs[name]
        assert "lost in the text" in cube.clearance.attrs["assumed"]
        for variable in cube.data_vars.values():
            assert variable.attrs["long_name"]
            assert variable.attrs["units"]
        assert set(np.unique(cube.chatter)) == {0, 1, 2}
        assert (cube.status == 0).all()
        point = {"mass_ratio": 0.05, "frequency_ratio": 1.5, "restitution": 0.5}
        direct = damper.simulate(
            **point, damping_ratio=0.02, clearance=0.05, transient=60, periods=20
        )
        there = cube.sel(point)
        np.testing.assert_array_equal(there.displacement, direct.displacement)
        assert there.chatter == direct.chatter == 2


@pytest.mark.exhaustive
def test_every_study_of_the_default_configuration(everything):
    studies = yaml.safe_load((ROOT / "config/config.yaml").read_text())["studies"]
    for name in studies:
        made = everything / "results/ci" / name
        assert list(made.rglob("figures/*.png")), name
        for path in made.rglob("figures/*"):
            assert 1000 < path.stat().st_size < 2_000_000, path
        if name not in CHECKS:
            with xr.open_dataset(made / "cube.nc") as cube:
                assert (cube.status == 0).all(), name


def test_solvers_are_compared(reduced):
    folder = reduced / "results/ci/solvers"
    with xr.open_dataset(folder / "cube.nc") as errors:
        scenes, solvers = errors.scene.values.tolist(), errors.solver.values.tolist()
        assert scenes == ["one_burst"]
        exact = errors.sel(solver="exact", level=2)
        assert (exact.state_error < 1e-10).all()
        assert (exact.missed_impacts == 0).all()
        outcome = errors.outcome.sel(scene="one_burst", solver="dop853_free", level=1)
        meanings = errors.outcome.flag_meanings.split()
        assert meanings[list(errors.outcome.flag_values).index(int(outcome))] == "stalled"
    with xr.open_dataset(folder / "timed/timings.nc") as timings:
        assert timings.scene.values.tolist() == scenes
        assert timings.solver.values.tolist() == solvers
        assert (timings.run_time.sel(solver="exact", level=2) > 0.0).all()
        assert timings.attrs["processor"]
    assert "stalled" in (folder / "tables/errors.md").read_text()


def test_the_engine_keeps_the_laws_in_the_reduced_stress_study(reduced):
    with xr.open_dataset(reduced / "results/ci/stress/cube.nc") as cube:
        assert {origin.split()[0] for origin in np.unique(cube.origin)} == {
            "corner",
            "random",
            "long",
        }
        assert cube.sizes["run"] > 200
        ran = cube.isel(run=cube.status.values != 3)  # a refused run has no segments
        assert not broken({name: ran[name].values for name in (*LAW_NAMES, "segments")}).any()
        assert cube.penetration.max() < 1e-12
        # It finished, or its event budget says so; walls that only push refuse restitution 0.
        assert set(np.unique(cube.status)) <= {0, 1, 3}
    with xr.open_dataset(reduced / "results/ci/stress/metamorphic.nc") as again:
        assert again.sizes["run"] == 20
        for name in ("mirrored", "shifted", "units", "sharper", "looser"):
            assert (again[f"{name}_verdict"] != 2).all(), name


def test_times_are_not_taken_again_for_a_figure(reduced, tmp_path):
    folder = shutil.copytree(reduced, tmp_path / "other")
    config = (folder / "config/studies/solvers.yaml").read_text()
    (folder / "config/studies/solvers.yaml").write_text(
        config.replace("{kind: solver_summary}", "{kind: solver_summary, caption: Another}")
    )
    out = snakemake(folder, "-n", "--configfile", "config/ci.yaml")
    assert set(jobs(out)) <= {"figure", "report", "all"}
    assert jobs(out)["figure"] == 1


@pytest.mark.exhaustive
def test_followed_study_has_both_branches(everything):
    with xr.open_dataset(everything / "results/ci/hysteresis/cube.nc") as cube:
        assert cube.direction.values.tolist() == ["up", "down"]
        assert cube.displacement.dims == ("restitution", "frequency_ratio", "direction", "sample")
        direct = damper.simulate(
            mass_ratio=0.1,
            damping_ratio=0.02,
            clearance=5.0,
            restitution=0.6,
            frequency_ratio=cube.frequency_ratio.values,
            follow={"frequency_ratio": "both"},
            transient=60,
            periods=20,
            observers=["stroboscopic_section"],
        )
        np.testing.assert_array_equal(cube.displacement.isel(restitution=0), direct.displacement)
        up, down = (direct.displacement.sel(direction=way) for way in ("up", "down"))
        assert (abs(up - down) > 0.1).any(), "no hysteresis in the study that is to show it"


@pytest.mark.exhaustive
def test_study_in_si_units_answers_in_them(everything):
    with xr.open_dataset(everything / "results/ci/machine_frame/cube.nc") as cube:
        assert cube.peak_displacement.attrs["units"] == "m"
        assert cube.max_approach_speed.attrs["units"] == "m/s"
        assert cube.energy_input.attrs["units"] == "J"
        assert cube.gap.attrs["units"] == "m"
        # Without a gap the free mass rides along: 200 N on 110 kg, 800 N s/m and 4e6 N/m.
        rigid = cube.sel(gap=0.0, forcing_frequency=190.0)
        exact = 200.0 / abs(4e6 - 110.0 * 190.0**2 + 800.0j * 190.0)
        # Transients have not died out altogether.
        assert float(rigid.peak_displacement) == pytest.approx(exact, rel=1e-3)


def test_performance_table_has_its_numbers(reduced):
    folder = reduced / "results/ci/performance/tables"
    assert "\n| well damped points | " in (folder / "performance.md").read_text()
    assert len((folder / "performance.csv").read_text().splitlines()) == 3


def test_second_run_has_nothing_to_do(reduced):
    assert "Nothing to be done" in snakemake(reduced, *REDUCED)


def test_same_bytes_from_an_empty_results_folder(reduced, tmp_path):
    """Some studies from their first job on, and what is made of all of them."""
    made = digests(reduced / "results")
    # Times are not made again: they differ anyway, and take a while.
    asked = [f"ci/{name}/cube.nc" for name in ("restitution", "solvers", "stress")]
    asked += ["ci/restitution/figures/bifurcation_mass_ratio~0.05.svg"]
    asked += ["ci/restitution/tables/paper_b_table.md", "ci/solvers/tables/errors.md"]
    other = copy_project(tmp_path)
    # The marks alone: the compiled code is elsewhere, and serves both.
    for marks in (reduced / "results/ci").glob("compiled*"):
        shutil.copytree(marks, other / "results/ci" / marks.name)
    snakemake(other, *(f"results/{path}" for path in asked), "--configfile", "config/ci.yaml")
    again = digests(other / "results")
    assert set(asked) < set(again)
    assert again == {path: made[path] for path in again}
    whole = [f"results/ci/{name}" for name in ("claims.md", "claims.csv", "report.html")]
    snakemake(reduced, *whole, "--configfile", "config/ci.yaml", "--force")
    assert digests(reduced / "results") == made


def test_each_target_makes_just_what_it_needs(small):
    write_small(small, **PRODUCTS)
    figure = "results/small/figures/section.png"
    before = {"compile": 3, "simulate": 2, "gather": 1}
    assert jobs(snakemake(small, "-n", figure)) == before | {"figure": 1}
    # A schematic waits for no simulation.
    assert jobs(snakemake(small, "-n", "results/small/figures/model.svg")) == {"figure": 1}


def test_changes_rerun_just_what_hangs_on_them(made):
    slices = made / "results/small/slices"
    before = {path: path.stat().st_mtime_ns for path in slices.rglob("*.npz")}
    assert len(before) == 2

    # A caption concerns the figure alone, as does another drawing under the same name.
    figures = {"model": MODEL, "section": SECTION | {"caption": "New"}}
    write_small(made, **PRODUCTS | {"figures": figures})
    assert jobs(snakemake(made, "-n")) == {"figure": 1, "all": 1}
    figures = {"model": MODEL | {"drawing": "collision_system"}, "section": SECTION}
    write_small(made, **PRODUCTS | {"figures": figures})
    target = "results/small/figures/model.svg"
    assert jobs(snakemake(made, "-n", target)) == {"figure": 1}

    # One more value on the fanned axis: its slice, and what hangs on the cube.
    axes = small_study()["axes"]
    wider = axes | {"mass_ratio": {"values": [0.1, 0.2, 0.3], "fan": True}}
    write_small(made, axes=wider, **PRODUCTS)
    output = snakemake(made)
    assert jobs(output) == {"simulate": 1, "gather": 1, "figure": 1, "table": 1, "all": 1}
    assert {path: path.stat().st_mtime_ns for path in before} == before
    with xr.open_dataset(made / "results/small/cube.nc") as cube:
        assert cube.mass_ratio.values.tolist() == [0.1, 0.2, 0.3]

    # One more value on an inner axis: all its slices.
    longer = wider | {"restitution": {"start": 0.3, "stop": 0.9, "num": 7}}
    write_small(made, axes=longer, **PRODUCTS)
    assert jobs(snakemake(made, "-n"))["simulate"] == 3

    # A touch is not an edit.
    write_small(made, axes=wider, **PRODUCTS)
    for path in (made / "workflow/scripts").glob("*.py"):
        path.touch()
    assert "Nothing to be done" in snakemake(made)


def test_edit_in_the_package_reruns_what_depends_on_it(made):
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
    assert planned["simulate"] == 2
    assert planned["gather"] == planned["table"] == 1


def test_one_job_per_point_and_what_each_stage_cost(small):
    """Runs that reach their number of events say so, and stop nothing else."""
    axes = small_study()["axes"] | {"restitution": {"values": [0.45, 0.9]}}
    write_small(small, axes={name: spec | {"fan": True} for name, spec in axes.items()})
    (small / "config/config.yaml").write_text("studies: [small]\nengine: {max_events: 200}\n")
    output = snakemake(small)
    assert jobs(output)["simulate"] == 4
    assert "simulate      4 jobs" in output[output.index("Cost by stage") :]
    path = small / "results/small/slices/mass_ratio~0.1/frequency_ratio~1.3/restitution~0.45.npz"
    assert path.is_file()
    with xr.open_dataset(small / "results/small/cube.nc") as cube:
        direct = damper.simulate(
            mass_ratio=[0.1, 0.2],
            damping_ratio=0.02,
            frequency_ratio=1.3,
            clearance=0.05,
            restitution=[0.45, 0.9],
            transient=10,
            periods=5,
            observers=("stroboscopic_section", "bursts"),
            max_events=200,
        )
        there = cube.sel(frequency_ratio=1.3)
        for name in ("displacement", "status", "chatter", "complete_fraction"):
            np.testing.assert_array_equal(there[name], direct[name])
        assert set(np.unique(cube.status)) == {0, 1}


def flip_a_byte(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def test_a_damaged_slice_is_named_in_the_log_and_made_anew(made):
    """A slice that was cut is seen beforehand; one with a flipped byte when it is read."""
    cut, flipped = sorted((made / "results/small/slices").rglob("*.npz"))
    before = digests(made / "results")
    cut.write_bytes(cut.read_bytes()[:-100])
    flip_a_byte(flipped)
    output = snakemake(made, code=1)
    assert jobs(output)["simulate"] == 1
    assert f"{cut.relative_to(made)} is damaged" in output
    for text in (output, (made / "results/logs/small/gather.log").read_text()):
        assert "Traceback" not in text
        assert f"{flipped.relative_to(made)} is damaged" in text
    assert jobs(snakemake(made))["simulate"] == 1
    assert digests(made / "results") == before


def test_results_tell_what_they_were_made_of(made):
    """Decisions are the same without Snakemake's records, which a clone does not have."""
    records, slices = made / ".snakemake", made / "results/small/slices"

    def planned() -> dict[str, int]:
        return jobs(snakemake(made, "-n"))

    everything = {"simulate": 2, "gather": 1, "figure": 1, "table": 1, "all": 1}
    other = {"parameters": {"damping_ratio": 0.02, "clearance": 0.06}}
    write_small(made, **PRODUCTS | other)
    assert planned() == everything
    shutil.rmtree(records)
    assert planned() == everything
    write_small(made, **PRODUCTS)
    assert planned() == {}

    # A slice of another mass ratio under the name of this one, as old as it was.
    first, second = (slices / f"mass_ratio~{value}.npz" for value in (0.1, 0.2))
    kept = second.read_bytes()
    shutil.copy2(first, second)
    assert planned() == everything | {"simulate": 1}
    second.unlink()
    assert planned() == everything | {"simulate": 1}
    second.write_bytes(kept)
    os.utime(second, ns=(0, 0))
    assert planned() == {}
    # A figure of another study's, newer than its cube.
    (made / "results/small/figures/section.svg").write_text("<svg/>")
    assert planned() == {"figure": 1, "all": 1}


def test_what_no_entry_makes_any_more_is_named_and_removed_when_asked(made):
    old = made / "results/small/figures/section.svg"
    figures = {"model": MODEL, "bifurcation": SECTION}
    write_small(made, **PRODUCTS | {"figures": figures})
    output = snakemake(made)
    assert "`snakemake --cores 1 tidy`" in output
    assert f"  {old.relative_to(made)}\n" in output
    snakemake(made, "tidy")
    left = sorted(path.name for path in old.parent.iterdir())
    assert left == ["bifurcation.png", "bifurcation.svg", "model.png", "model.svg"]


def test_the_reason_of_a_failure_is_in_its_log(small):
    script = small / "workflow/scripts/simulate.py"
    text = script.read_text()
    script.write_text(text.replace("part = ", 'raise ValueError("as a test")\npart = '))
    output = snakemake(small, code=1)
    (log, *_) = (small / "results/logs/small/simulate").rglob("*.log")
    for text in (output, log.read_text()):
        assert "ValueError: as a test" in text
        assert "Traceback" in text


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


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "studies: [small\nresults: x",
            "config/config.yaml:2\n    not valid YAML at line 2, column 8",
        ),
        ("studies: [small]\nresults: x\nresults: y", "config/config.yaml:3  results\n    the key"),
        (None, "config/config.yaml\n    there is no such file"),
    ],
)
def test_configuration_that_cannot_be_read(small, text, message):
    (small / "config/config.yaml").unlink()
    if text is not None:
        (small / "config/config.yaml").write_text(text)
    assert f"1 error in the configuration\n{message}" in snakemake(small, "-n", code=1)


def test_unknown_target_is_refused(small):
    output = snakemake(small, "results/small/figures/nothing.png", code=1)
    assert "No rule to produce" in output
    assert "Traceback" not in output


@pytest.mark.exhaustive
def test_reduced_calibration(everything):
    made = everything / "results/ci"
    for study in (
        "calibration_a3",
        "calibration_a3_compliant",
        "calibration_a1",
        "calibration_b",
    ):
        for end in ("svg", "png"):
            assert 5000 < (made / study / f"figures/profiles.{end}").stat().st_size < 2_000_000
        with xr.open_dataset(made / study / "cube.nc") as cube:
            assert (cube.status == 0).all()
    text = (made / "calibration_a3/tables/ranking.md").read_text()
    for name in ("A1", "A3", "A4", "A5"):
        assert f"\n| {name} |" in text
    # On this grid, thinned out about it, the preset is the best set.
    assert "is number 1 of 180 sets" in text
    text = (made / "calibration_a3_compliant/tables/bursts.md").read_text()
    assert "| contact stiffness ratio |" in text
    # Two stiffnesses, with and without tension.
    assert "of 60 sets" in text


def test_targets_are_made_when_asked_for(small):
    other = yaml.safe_dump(small_study(title="Other"))
    (small / "config/studies/other.yaml").write_text(other)
    (small / "config/config.yaml").write_text("studies: [small]\ntargets: {more: [other, small]}\n")
    everything = snakemake(small, "-n")
    assert "results/other" not in everything
    asked = snakemake(small, "-n", "more")
    assert "results/other/cube.nc" in asked
    assert jobs(asked) == {"compile": 3, "simulate": 4, "gather": 2, "more": 1}


def test_target_with_the_name_of_a_rule(small):
    (small / "config/config.yaml").write_text("studies: [small]\ntargets: {table: [small]}\n")
    output = snakemake(small, code=1)
    assert "Traceback" not in output
    assert "'table' is a rule of the workflow" in output


@pytest.mark.parametrize("command", ["--unlock", "--rulegraph"])
def test_commands_that_start_no_job_need_no_cores(tmp_path: Path, command: str) -> None:
    """With all studies, those that take all cores among them."""
    folder = copy_project(tmp_path)
    done = subprocess.run(
        [sys.executable, "-m", "snakemake", command], cwd=folder, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


SLURM = Path(__file__).with_name("slurm.sh")
#: What the test on Slurm needs and this machine lacks.
MISSING = [
    *(name for name in ("munged", "slurmctld", "slurmd") if not shutil.which(name)),
    *(["slurm"] if not importlib.util.find_spec("snakemake_executor_plugin_slurm") else []),
]


@pytest.mark.exhaustive
@pytest.mark.skipif(bool(MISSING), reason=f"needs {', '.join(MISSING)}: see docs/cluster.md")
def test_a_slurm_cluster_makes_the_same_bytes(tmp_path):
    """A real one, of one node on this machine, by profiles/slurm."""
    axes = {
        "mass_ratio": {"start": 0.1, "stop": 0.3, "num": 4, "fan": True},
        "frequency_ratio": {"values": [1.3]},
        "restitution": {"values": [0.3, 0.6]},
    }
    for name in ("local", "slurm"):
        (tmp_path / name).mkdir()
        write_small(copy_project(tmp_path / name), axes=axes, figures={"model": MODEL})
    arguments = (*REDUCED, "--config", "studies=[small, cost]")
    snakemake(tmp_path / "local", *arguments)
    quick = ("--slurm-init-seconds-before-status-checks", "1", "--group-components", "slices=3")
    run = [sys.executable, "-m", "snakemake", "--profile", "profiles/slurm", *arguments, *quick]
    done = subprocess.run(
        [SLURM, "bash", "-c", '"$@" && scontrol --oneliner show jobs', "-", *run],
        cwd=tmp_path / "slurm",
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert done.returncode == 0, done.stdout
    made = digests(tmp_path / "slurm/results")
    assert made == digests(tmp_path / "local/results")

    # Four slices are two jobs, of one processor each; run times have the node's two to themselves.
    jobs_of = {}
    for job in re.findall("^JobId=.*", done.stdout, re.MULTILINE):
        rule = re.search(r"slurm_logs/(?:group|rule)_(\w+)", job)[1]
        jobs_of.setdefault(rule, []).append(int(re.search(r" NumCPUs=(\d+)", job)[1]))
    assert jobs_of["slices_simulate"] == [1, 1]
    assert jobs_of["gather"] == [1]
    assert jobs_of["cost"] == [2]
