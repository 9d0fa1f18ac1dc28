"""What a study takes: estimated as it is made, refused where it cannot end, printed by `check`."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from studies import MISTAKES, load

import damper
from damper.engine import compiled
from damper.engine.loop import run
from damper.engine.trajectory import Trajectory
from damper.models import model_of
from damper.study import check
from damper.study.config import ConfigError, Study
from damper.study.estimate import estimate
from damper.sweep.branches import branches
from damper.sweep.grid import product
from damper.sweep.parts import write_part
from damper.sweep.slices import simulate_slice

STUDIES = Path(__file__).parents[2] / "config/studies"
NAMES = ("mass_ratio", "damping_ratio", "frequency_ratio", "clearance", "restitution")
LARGE: dict[str, Any] = {
    "title": "large",
    "source": "our own",
    "parameters": {"mass_ratio": 0.1, "damping_ratio": 0.02, "frequency_ratio": 1.3},
    "axes": {
        "clearance": {"start": 0.1, "stop": 1, "num": 100},
        "restitution": {"start": 0, "stop": 0.9, "num": 100},
    },
    "transient": 150,
    "periods": 50,
    "observers": {"bursts": {}},
}


@st.composite
def studies(draw: st.DrawFn) -> Study:
    """Studies with some axes, fanned or not, one perhaps followed, and perhaps random states."""
    axes: dict[str, Any] = {}
    for name in draw(st.lists(st.sampled_from(NAMES), unique=True)):
        size = draw(st.integers(1, 4))
        axes[name] = {"values": [0.1 + 0.1 * i for i in range(size)], "fan": draw(st.booleans())}
    inner = [name for name, axis in axes.items() if not axis["fan"]]
    if inner and draw(st.booleans()):
        axes[inner[0]]["follow"] = draw(st.sampled_from(["up", "down", "both"]))
    drawn: dict[str, Any] = {}
    if count := draw(st.integers(0, 3)):
        drawn = {"count": count, "seed": 1, "initial_position": [-1, 1]}
    fixed = {name: 0.1 for name in NAMES if name not in axes}
    return Study.model_validate(LARGE | {"parameters": fixed, "axes": axes, "draws": drawn})


@given(studies())
def test_slices_points_and_runs_are_those_that_are_made(study: Study) -> None:
    found = estimate(study)
    axes = {name: study.axis_values[name] for name in study.inner_axes}
    grid = product(axes, {})
    runs = branches(grid, axes, study.draw_settings(), study.follow).points
    assert found.slices == len(study.slices())
    assert found.points == found.slices * len(grid)
    assert found.job.runs == len(runs)
    assert found.runs == found.slices * len(runs)


def test_arrays_and_disk_are_those_of_a_slice(tmp_path: Path) -> None:
    axes = {"clearance": {"values": [0.2, 0.3]}, "restitution": {"values": [0.5, 0.6, 0.7]}}
    observers = {"bursts": {"records": 500}, "stroboscopic_section": {}, "trajectory": {}}
    study = load(tmp_path, LARGE | {"axes": axes, "observers": observers} | BRIEF)
    found = estimate(study)
    part = simulate_slice(
        study.fixed, study.axis_values, observers=study.observer_settings(), **study.run
    )
    assert found.job.array_bytes == sum(array.nbytes for array in part.arrays.values())
    write_part(part, tmp_path / "all.npz")
    assert found.job.array_bytes < (tmp_path / "all.npz").stat().st_size < found.disk


BRIEF = {"transient": 0, "periods": 2}
FANNED = {"start": 0.1, "stop": 0.9, "num": 1000, "fan": True}


@pytest.mark.parametrize("given", MISTAKES["unending"])
def test_what_cannot_end_is_refused(tmp_path: Path, given: list[Any]) -> None:
    change, message = given
    with pytest.raises(ConfigError) as caught:
        load(tmp_path, LARGE | change)
    assert message in str(caught.value)
    assert str(caught.value).startswith("1 error ")


def test_large_study_that_is_fanned_passes(tmp_path: Path) -> None:
    """1e8 points, as on a cluster; a million of them is the study `atlas`."""
    axes = {"clearance": FANNED, "restitution": {"start": 0, "stop": 0.9, "num": 100_000}}
    found = estimate(load(tmp_path, LARGE | {"axes": axes}))
    assert found.runs == 10**8
    assert found.simulate_resources["mem_mb"] < 1000
    assert found.simulate_resources["runtime"] < 60


def test_a_record_counts_once_for_each_unit_of_time(tmp_path: Path) -> None:
    """A record of 10 samples in a study whose masses are in SI units."""
    record = {"kind": "record", "time": [*range(10)], "value": [1.0] * 10}
    given = dict.fromkeys(("primary_mass", "damping", "free_mass", "gap", "stiffness"), 1.0)
    given |= {"force_amplitude": 1.0, "forcing_frequency": 1.0, "restitution": 0.5}

    def memory(*names: str) -> int:
        axes = {name: {"start": 1, "stop": 2, "num": 11} for name in names}
        fixed = {name: value for name, value in given.items() if name not in names}
        study = LARGE | {"axes": axes, "parameters": fixed, "forcing": record}
        return estimate(load(tmp_path, study)).job.memory

    assert memory("stiffness") - memory("gap") == 10 * 16 * 10
    assert memory("stiffness", "gap") == memory("primary_mass", "gap")


def test_check_prints_a_table_and_what_is_wrong(tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text(yaml.safe_dump(LARGE | {"periods": 10**12}, sort_keys=False))
    files = [STUDIES / "restitution.yaml", wrong, STUDIES / "solvers.yaml"]
    done = subprocess.run(
        [sys.executable, "-m", "damper.study.check", *files], capture_output=True, text=True
    )
    assert done.returncode == 1
    _, good, bad, other, *_ = [line.split() for line in done.stdout.splitlines()]
    assert good[:6] == ["restitution", "yes", "4", "8016", "8016", "6.41e+07"]
    assert bad == ["wrong", "no", *"-" * 9]
    assert other == ["solvers", "yes", *"-" * 9]
    assert "wrong.yaml:17  periods\n" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("moved", "noted"),
    [
        ({}, True),
        ({"initial": "steady"}, False),
        ({"draws": {"count": 2, "seed": 1, "initial_relative_velocity": [-1, 1]}}, False),
        ({"parameters": LARGE["parameters"] | {"friction": 0.1}}, False),
    ],
)
def test_check_says_that_all_runs_start_at_exact_rest(
    moved: dict[str, Any], noted: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "small.yaml"
    path.write_text(yaml.safe_dump(LARGE | moved, sort_keys=False))
    assert check.main([str(path)]) == 0
    assert ("small: all runs start at exact rest" in capsys.readouterr().out) == noted


SI = """\
title: In SI units
source: our own
parameters: {primary_mass: 800, damping: 480, force_amplitude: 1e-3, free_mass: 40,
  restitution: 0.5}
masses: [{gap: 20 mm}, {gap: 15}]
forcing: base
axes: {stiffness: {values: [1e5, 2e6]}, forcing_frequency: {values: [0.04, 24], unit: Hz}}
transient: 10
periods: 10
observers: {response: }
"""


def test_check_asks_about_values_that_few_machines_have(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "si.yaml"
    for text, asked in (
        (SI, ["gap_1 = 15 m", "forcing_frequency = 0.04 Hz"]),
        (SI.replace("15", "15 mm").replace("0.04, 24", "1, 24"), []),
        (
            SI.replace("15", "15 mm").replace("0.04", "20").replace("480", "48000")
            .replace("amplitude: 1e-3", "amplitude: 3"),
            ["base_amplitude = 3 m", "damping_ratio = 0.6"],
        ),
    ):  # fmt: skip
        path.write_text(text)
        assert check.main([str(path)]) == 0
        printed = capsys.readouterr().out
        found = [line for line in printed.splitlines() if "is unusual" in line]
        assert [line.removeprefix("si: ").partition(" is")[0] for line in found] == asked


def test_check_names_what_this_machine_cannot_hold(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(check, "machine_memory", lambda: 200e6)
    assert check.main([str(STUDIES / "restitution.yaml")]) == 0
    printed = capsys.readouterr().out
    for what, size in (("a simulation job", "261 MB"), ("to gather the cube", "240 MB")):
        more = "of memory, more than the 200 MB of this machine"
        assert f"restitution: {what} takes some {size} {more}\n" in printed
    monkeypatch.setattr(check, "machine_memory", lambda: 262e6)
    check.main([str(STUDIES / "restitution.yaml")])
    assert "this machine" not in capsys.readouterr().out


@pytest.mark.skipif(not compiled.COMPILED, reason="needs numba")
@pytest.mark.compiled
def test_check_says_what_is_still_to_be_compiled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It asks the cache for what a run asks it for."""
    monkeypatch.setattr(compiled, "_cache", lambda: tmp_path)
    monkeypatch.setattr(compiled, "_spent", 1.0)
    monkeypatch.setattr(compiled, "_at_once", False)
    monkeypatch.setattr(run, "_entries", {})
    monkeypatch.setattr(run, "_looks", {})
    asked: list[Path] = []
    note = compiled.Compiled._note

    def noted(self: compiled.Compiled, kinds: tuple) -> Path:
        asked.append(note(self, kinds))
        return asked[-1]

    def printed() -> str:
        check.main([str(STUDIES / f"{name}.yaml") for name in ("modulated", "burst")])
        lines = capsys.readouterr().out.splitlines()
        return "\n".join(line for line in lines if "all runs start at exact rest" not in line)

    monkeypatch.setattr(compiled.Compiled, "_note", noted)
    more = "to compile for the model {} takes some {} more, the first time"
    both = more.format("rigid, time_varying", "2 min")
    assert printed().endswith(f"disk: slices and cube.\nmodulated: {both}")
    asked.clear()
    Trajectory(model_of(damper.Parameters(0.1, 0.02, 1.0, 5.0, 0.6))).skip(1.0)
    for path in asked:
        path.touch()
    assert printed().endswith(f"modulated: {more.format('time_varying', '60 s')}")
