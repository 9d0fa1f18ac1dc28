"""The workflow, run for real by Snakemake on a reduced configuration."""

import os
import shutil
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml
from project_copy import REDUCED, ROOT, copy_project, digests, jobs, snakemake

import damper
from damper.observers.common.laws import LAW_NAMES, broken

#: Studies that check the engine; what they make is their own.
CHECKS = ("solvers",)
#: Studies of which the reduced workflow makes the cube, and no figure.
UNDRAWN = (
    "restitution_below_resonance",
    "paper_b_portraits",
    "paper_b_histories",
    "paper_a_clearance",
    "paper_a_frequency",
    "paper_a_histories",
    "performance",
    "accumulation",
    "burst_duration",
    "stress",
    "stress_random",
)


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


def test_reduced_run_makes_everything(reduced):
    made = digests(reduced / "results/ci/restitution")
    figures = [
        f"figures/bifurcation_mass_ratio~{m}.{e}" for m in ("0.25", "0.05") for e in ("png", "svg")
    ]
    tables = ["tables/paper_b_table.csv", "tables/paper_b_table.md"]
    figures += ["figures/paper_b_fig_1.png", "figures/paper_b_fig_1.svg"]
    figures += ["interactive/bifurcation.js"]
    assert set(made) == {"cube.nc", *figures, *tables, "parts/all.npz"}


def test_cube_opens_in_plain_xarray_and_matches_simulate(reduced):
    with xr.open_dataset(reduced / "results/ci/restitution/cube.nc") as cube:
        assert cube.displacement.dims == ("mass_ratio", "frequency_ratio", "restitution", "sample")
        assert dict(cube.sizes) == {
            "mass_ratio": 2,
            "frequency_ratio": 1,
            "restitution": 41,
            "sample": 20,
            "threshold": 3,
            "impact": 60,
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
        assert bool(list(made.rglob("figures/*.png"))) == (name not in UNDRAWN), name
        for path in made.rglob("figures/*"):
            assert 1000 < path.stat().st_size < 2_000_000, path
        if name not in CHECKS:
            with xr.open_dataset(made / "cube.nc") as cube:
                # Elastic impacts use up the events that the studies of extremes allow.
                stopped = {0, 1} if name.startswith("stress") else {0}
                assert set(np.unique(cube.status)) <= stopped, name


def test_solvers_are_compared(reduced):
    folder = reduced / "results/ci/solvers"
    with xr.open_dataset(folder / "cube.nc") as errors:
        scenes, solvers = errors.scene.values.tolist(), errors.solver.values.tolist()
        assert scenes == ["one_burst"]
        exact = errors.sel(solver="exact", level=2)
        assert (exact.state_error < 1e-10).all()
        outcome = errors.outcome.sel(scene="one_burst", solver="rk4_step_end", level=1)
        meanings = errors.outcome.flag_meanings.split()
        assert meanings[list(errors.outcome.flag_values).index(int(outcome))] == "left_box"
    with xr.open_dataset(folder / "timed/timings.nc") as timings:
        assert timings.scene.values.tolist() == scenes
        assert timings.solver.values.tolist() == solvers
        assert (timings.run_time.sel(solver="exact", level=2) > 0.0).all()
        assert timings.attrs["processor"]


def test_the_engine_keeps_the_laws_in_the_reduced_study_of_extremes(reduced):
    with xr.open_dataset(reduced / "results/ci/stress_random/cube.nc") as cube:
        assert cube.status.size >= 100
        assert not broken({n: cube[n].values for n in (*LAW_NAMES, "segments")}).any()
        assert cube.penetration.max() < 1e-12
        # It finished, or its event budget says so.
        assert set(np.unique(cube.status)) <= {0, 1}


def test_times_are_not_taken_again_for_a_figure(reduced, tmp_path):
    folder = shutil.copytree(reduced, tmp_path / "other")
    config = (folder / "config/studies/solvers.yaml").read_text()
    (folder / "config/studies/solvers.yaml").write_text(
        config.replace(
            "kind: work_precision", "kind: work_precision\n    caption: Errors and times"
        )
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
            clearance=12.0,
            restitution=0.6,
            initial_relative_velocity=0.1,
            frequency_ratio=cube.frequency_ratio.values,
            follow={"frequency_ratio": "both"},
            transient=60,
            periods=20,
            observers=["stroboscopic_section"],
        )
        np.testing.assert_array_equal(cube.displacement.isel(restitution=0), direct.displacement)
        assert cube.attrs["followed"] == direct.attrs["followed"]
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
        rigid = cube.sel(gap=0.0, forcing_frequency=190.0).isel(draw=0)
        exact = 200.0 / abs(4e6 - 110.0 * 190.0**2 + 800.0j * 190.0)
        # Transients have not died out altogether.
        assert float(rigid.peak_displacement) == pytest.approx(exact, rel=1e-3)


def test_performance_table_has_its_numbers(reduced):
    folder = reduced / "results/ci/performance/tables"
    assert "\n| well damped runs | " in (folder / "performance.md").read_text()
    assert len((folder / "performance.csv").read_text().splitlines()) == 3


def test_the_texts_of_the_page_count_by_content_and_may_be_missing(reduced, tmp_path):
    """A clone dates them by its own clock, and a new kind of figure comes without.

    The first run here is a second one of the whole reduced workflow, too: it has nothing to do.
    """
    folder = shutil.copytree(reduced, tmp_path / "other")
    texts, tomorrow = folder / "workflow/report", time.time() + 86400
    for path in texts.iterdir():
        os.utime(path, (tomorrow, tomorrow))
    assert "Nothing to be done" in snakemake(folder, *REDUCED)
    (texts / "bifurcation.rst").unlink()
    assert jobs(snakemake(folder, *REDUCED)) == {"report": 1, "all": 1}
    assert "Nothing to be done" in snakemake(folder, *REDUCED)
    assert (
        'src="restitution/figures/paper_b_fig_1.' in (folder / "results/ci/report.html").read_text()
    )


def test_same_bytes_from_an_empty_results_folder(reduced, tmp_path):
    """A study from its first job on, and what is made of all of them."""
    made = digests(reduced / "results")
    study = "ci/restitution"
    asked = [f"{study}/cube.nc", f"{study}/figures/paper_b_fig_1.svg"]
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


@pytest.mark.exhaustive
def test_reduced_calibration(everything):
    made = everything / "results/ci"
    for study in ("calibration_a3", "calibration_a3_compliant", "calibration_a1", "calibration_b"):
        with xr.open_dataset(made / study / "cube.nc") as cube:
            assert (cube.status == 0).all()
    text = (made / "calibration_a3/tables/scores.md").read_text()
    for name in ("A3", "A4", "A5"):
        assert f"\n| {name} |" in text
    # On this grid, thinned out about it, the preset is the best set.
    assert "number 1 of 180 sets" in text
    text = (made / "calibration_a3_compliant/tables/scores.md").read_text()
    assert "| contact stiffness ratio |" in text
    # Two stiffnesses, with and without tension.
    assert "of 60 sets" in text
