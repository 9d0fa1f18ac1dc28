"""`damper fmu`: the steps are the run, and another simulation finds them in the FMU."""

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import damper
from damper.fmu.stepped import PARAMETERS, SteppedMachine
from damper.shell import main

VALUES = {name: setting.default for name, setting in PARAMETERS.items()} | {
    "mass": 100.0,
    "natural_frequency": 31.8,
    "damping_ratio": 0.02,
    "free_mass": 10.0,
    "gap": 1e-4,
    "restitution": 0.3,
}
OWN = math.tau * 31.8
SAME: dict[str, Any] = {
    "primary_mass": 100.0,
    "damping": 0.04 * 100.0 * OWN,
    "stiffness": 100.0 * OWN**2,
    "free_mass": 10.0,
    "gap": 1e-4,
    "restitution": 0.3,
}
STEP = 1e-3
FRAME = """\
mass: 100
natural_frequency: 31.8
damping_ratio: 0.02
force_amplitude: 200
band: [28, 36]
largest_mass: 10
largest_gap: 5 mm
restitution: 0.3
"""
STRUCTURE = """\
structure: {modes: [{frequency: 1, damping_ratio: 0.1, shapes: {tip: 1}}], force: tip}
force_amplitude: 2
band: [0.9, 1.1]
point: tip
largest_mass: 0.1
largest_gap: 0.08
restitution: 0.6
"""


@pytest.mark.parametrize(("drive", "size"), [("force", 3000.0), ("base_acceleration", 5.0)])
def test_steps_are_one_run_under_a_record(drive: Any, size: float) -> None:
    """Through complete bursts and sticking, which begin and end within steps."""
    times = STEP * np.arange(61)
    values = size * np.sin(200.0 * times)
    machine = SteppedMachine(VALUES | {"input_order": 2}, drive, values[0])
    record = damper.Record(times, values, drive)
    whole = damper.start(**SAME, force_amplitude=1.0, forcing=record)
    states, pushed, stuck = [], 0.0, 0
    for time, value in zip(times[1:].tolist(), values[1:].tolist(), strict=True):
        machine.step(STEP, value)
        whole.advance(time)
        states.append((machine.state, whole.state))
        assert machine.sticking == whole.sticking[0]
        assert machine.impacts == (whole.events["kind"] == damper.IMPACT).sum()
        pushed, stuck = pushed + machine.impulse, stuck + machine.sticking
    assert 5 < stuck < 55
    got, want = (
        np.array([[s.x, s.v, s.y, s.u] for s in each]) for each in zip(*states, strict=True)
    )
    assert np.abs(got - want).max() < 1e-9
    # Momentum of the machine: that of the input, of spring and dashpot, and of the free mass.
    fine = np.linspace(0.0, whole.time, 2001)
    spring = SAME["stiffness"] * np.trapezoid(whole.motion(fine).displacement, fine)
    given = np.trapezoid(values, times) * (1.0 if drive == "force" else -100.0)
    given -= spring + SAME["damping"] * whole.state.x
    assert pushed == pytest.approx(100.0 * whole.state.v - given, rel=1e-3)


@pytest.mark.parametrize(("order", "falls"), [(0, 2.0), (1, 4.0), (2, 4.0)])
def test_the_error_falls_with_the_step_by_the_order_of_the_input(order: int, falls: float) -> None:
    rate, errors = math.tau * 31.0, []
    exact = damper.start(**SAME, force_amplitude=3000.0, forcing_frequency=rate)
    end = 0.7 * math.tau / rate
    exact.advance(end)
    for steps in (20, 40):
        machine = SteppedMachine(VALUES | {"input_order": order}, "force")
        for k in range(steps):
            machine.step(end / steps, 3000.0 * math.sin(rate * end * (k + (order == 2)) / steps))
        errors.append(abs(machine.state.x - exact.state.x))
    assert errors[0] / errors[1] == pytest.approx(falls, rel=0.2)


def test_what_no_machine_has_is_refused_by_name() -> None:
    with pytest.raises(ValueError, match=r"^gap = 0.0: must be a number > 0 \(m\)$"):
        SteppedMachine(VALUES | {"gap": 0.0}, "force")
    with pytest.raises(ValueError, match=r"input_order = 3: must be a whole number"):
        SteppedMachine(VALUES | {"input_order": 3}, "force")


def made(folder: Path, *options: str, text: str = FRAME, code: int = 0) -> str:
    pytest.importorskip("pythonfmu3")
    (folder / "frame.yaml").write_text(text)
    given = ["fmu", str(folder / "frame.yaml"), "--output", str(folder / "frame.fmu"), *options]
    result = CliRunner().invoke(main, given, prog_name="damper")
    assert result.exit_code == code, result.output
    return result.output


def test_fmpy_finds_nothing_wrong_in_the_fmu(tmp_path: Path) -> None:
    check = pytest.importorskip("fmpy.validation").validate_fmu
    made(tmp_path)
    assert check(tmp_path / "frame.fmu") == []


@pytest.mark.skipif(sys.platform != "linux", reason="the library of the FMU is that of Linux")
def test_another_simulation_finds_the_run_in_the_fmu(tmp_path: Path) -> None:
    simulate = pytest.importorskip("fmpy").simulate_fmu
    printed = made(tmp_path, "--free-mass", "10", "--gap", "0.1mm")
    assert "driven by force; the machine that imports it needs Python 3.11" in printed
    times = STEP * np.arange(41)
    force = 3000.0 * np.cos(200.0 * times)
    asked = {"initial_position": 0.5, "restitution": 0.4, "input_order": 0}
    run = {"step_size": STEP, "output_interval": STEP, "stop_time": times[-1]}
    run["input"] = np.rec.fromarrays([times, force], names="time,force")
    found = simulate(tmp_path / "frame.fmu", start_values=asked, **run)
    machine = SteppedMachine(VALUES | asked, "force")
    for row, value in zip(found[1:], force, strict=False):
        machine.step(STEP, value)
        assert row["displacement"] == pytest.approx(machine.state.x, rel=1e-9)
        relative = machine.state.u - machine.state.v
        assert row["relative_velocity"] == pytest.approx(relative, rel=1e-9, abs=1e-12)
        assert row["impulse"] == pytest.approx(machine.impulse, rel=1e-9)
        assert (row["impacts"], row["sticking"]) == (machine.impacts, machine.sticking)
    assert len(found) == len(times)
    assert machine.impacts > 10
    logged: list[str] = []
    with pytest.raises(Exception, match="fmi3"):
        simulate(
            tmp_path / "frame.fmu",
            start_values={"restitution": 2.0},
            logger=lambda *words: logged.append(str(words)),
            **run,
        )
    assert "restitution = 2.0: must be a number >= 0 and <= 1" in "".join(logged)


def test_a_machine_on_a_base_is_driven_by_the_acceleration_of_it(tmp_path: Path) -> None:
    text = FRAME.replace("force_amplitude: 200", "base_amplitude: 1 mm")
    assert "driven by base_acceleration" in made(tmp_path, text=text)


@pytest.mark.parametrize(
    ("options", "text", "message"),
    [
        (["--gap", "-1"], FRAME, "gap = -1.0: must be a number > 0 (m)"),
        (["--output", "frame.zip"], FRAME, "output = 'frame.zip': must end in .fmu"),
        ([], FRAME.replace("[28, 36]", "[40, 50]"), "free_mass, gap: no closed form holds"),
        ([], STRUCTURE, "structure: an FMU has a machine of one mass"),
        ([], FRAME.replace("natural_freq", "natural_frq"), "did you mean 'natural_frequency'?"),
    ],
)
def test_a_mistake_is_told_in_one_message(
    options: list[str], text: str, message: str, tmp_path: Path
) -> None:
    printed = made(tmp_path, *options, text=text, code=1)
    assert message in printed
    assert "Traceback" not in printed
