"""`damper fmu`: the steps are the run, and another simulation finds them in the FMU."""

import ctypes
import math
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from zipfile import ZipFile

import numpy as np
import pytest
import yaml
from click.testing import CliRunner

import damper
from damper.fmu.stepped import PARAMETERS, SteppedMachine
from damper.shell import main
from damper.sizing.answer import design

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


class Host:
    """A simulation that imports an FMU by the C functions of FMI 3."""

    def __init__(self, path: Path, folder: Path) -> None:
        with ZipFile(path) as files:
            files.extractall(folder)
        about = ElementTree.parse(folder / "modelDescription.xml").getroot()
        self.variables = {v.get("name"): v for v in about.find("ModelVariables")}
        name = about.find("CoSimulation").get("modelIdentifier")
        self._library = ctypes.CDLL(str(folder / f"binaries/x86_64-linux/{name}.so"))
        self.logged: list[str] = []
        words = [ctypes.c_char_p] * 2
        self._log = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, *words)(
            lambda _, status, kind, text: self.logged.append(text.decode())
        )
        make = self._library.fmi3InstantiateCoSimulation
        make.restype = ctypes.c_void_p
        token, place = about.get("instantiationToken"), f"{folder / 'resources'}/"
        needs = *[False] * 4, None, ctypes.c_size_t(0), None, self._log, None
        self._instance = ctypes.c_void_p(make(b"it", token.encode(), place.encode(), *needs))

    def call(self, name: str, *arguments: Any) -> None:
        assert getattr(self._library, f"fmi3{name}")(self._instance, *arguments) == 0, self.logged

    def start(self, **values: float) -> None:
        for name, value in values.items():
            self.set(name, value)
        no, zero = ctypes.c_bool(False), ctypes.c_double(0.0)
        self.call("EnterInitializationMode", no, zero, zero, no, zero)
        self.call("ExitInitializationMode")

    def _about(self, name: str, value: Any) -> tuple[Any, ...]:
        number, one = int(self.variables[name].get("valueReference")), ctypes.c_size_t(1)
        return ctypes.byref(ctypes.c_uint32(number)), one, ctypes.byref(value), one

    def set(self, name: str, value: float) -> None:
        kind = self.variables[name].tag
        of = {"Float64": ctypes.c_double, "Int32": ctypes.c_int32}[kind]
        self.call(f"Set{kind}", *self._about(name, of(value)))

    def get(self, name: str) -> float:
        kind = self.variables[name].tag
        of = {"Float64": ctypes.c_double, "Int32": ctypes.c_int32, "Boolean": ctypes.c_bool}[kind]
        value = of()
        self.call(f"Get{kind}", *self._about(name, value))
        return value.value

    def step(self, time: float, length: float) -> None:
        flags = [ctypes.byref(ctypes.c_bool()) for _ in range(3)]
        end = ctypes.byref(ctypes.c_double())
        times = ctypes.c_double(time), ctypes.c_double(length)
        self.call("DoStep", *times, ctypes.c_bool(True), *flags, end)


def made(folder: Path, *options: str, text: str = FRAME, code: int = 0) -> str:
    pytest.importorskip("pythonfmu3")
    (folder / "frame.yaml").write_text(text)
    given = ["fmu", str(folder / "frame.yaml"), "--output", str(folder / "frame.fmu"), *options]
    result = CliRunner().invoke(main, given, prog_name="damper")
    assert result.exit_code == code, result.output
    return result.output


@pytest.mark.skipif(sys.platform != "linux", reason="the library of the FMU is that of Linux")
def test_another_simulation_finds_the_run_in_the_fmu(tmp_path: Path) -> None:
    printed = made(tmp_path, "--free-mass", "10", "--gap", "0.1mm")
    assert "driven by force; the machine that imports it needs Python 3.11" in printed
    host = Host(tmp_path / "frame.fmu", tmp_path / "unpacked")
    host.start(initial_position=0.5, restitution=0.4, input_order=2)
    asked = {"initial_position": 0.5, "restitution": 0.4, "input_order": 2}
    machine = SteppedMachine(VALUES | asked, "force")
    for k in range(40):
        value = 3000.0 * math.cos(0.2 * k)
        host.set("force", value)
        host.step(k * STEP, STEP)
        machine.step(STEP, value)
    assert host.get("impacts") == machine.impacts > 10
    assert host.get("displacement") == machine.state.x
    assert host.get("relative_velocity") == machine.state.u - machine.state.v
    assert host.get("impulse") == machine.impulse != 0.0
    assert host.get("sticking") == machine.sticking
    other = Host(tmp_path / "frame.fmu", tmp_path / "again")
    with pytest.raises(AssertionError, match=r"restitution = 2.0: must be a number >= 0 and <= 1"):
        other.start(restitution=2.0)


def test_fmpy_finds_nothing_wrong_in_the_fmu(tmp_path: Path) -> None:
    check = pytest.importorskip("fmpy.validation").validate_fmu
    made(tmp_path)
    assert check(tmp_path / "frame.fmu") == []


@pytest.mark.skipif(sys.platform != "linux", reason="the library of the FMU is that of Linux")
def test_fmpy_finds_the_run_in_the_fmu(tmp_path: Path) -> None:
    simulate = pytest.importorskip("fmpy").simulate_fmu
    made(tmp_path, "--free-mass", "10", "--gap", "0.1mm")
    times = STEP * np.arange(41)
    force = 3000.0 * np.cos(200.0 * times)
    found = simulate(
        tmp_path / "frame.fmu",
        start_values={"initial_position": 0.5, "input_order": 0},
        input=np.rec.fromarrays([times, force], names="time,force"),
        step_size=STEP,
        output_interval=STEP,
        stop_time=times[-1],
    )
    machine = SteppedMachine(VALUES | {"initial_position": 0.5, "input_order": 0}, "force")
    for row, value in zip(found[1:], force, strict=False):
        machine.step(STEP, value)
        assert row["displacement"] == pytest.approx(machine.state.x, rel=1e-9)
        assert row["impacts"] == machine.impacts
        assert row["impulse"] == pytest.approx(machine.impulse, rel=1e-9)
    assert len(found) == len(times)
    assert machine.impacts > 10


def test_a_machine_on_a_base_is_driven_by_the_acceleration_of_it(tmp_path: Path) -> None:
    text = FRAME.replace("force_amplitude: 200", "base_amplitude: 1 mm")
    assert "driven by base_acceleration" in made(tmp_path, text=text)


@pytest.mark.parametrize("text", [FRAME, FRAME.replace("restitution: 0.3", "")])
def test_sizes_that_are_left_are_those_for_the_given_ones(text: str, tmp_path: Path) -> None:
    given = {"largest_mass": 5.0, "restitution": 0.5}
    found = design(yaml.safe_load(text) | given, quick=True)
    printed = made(tmp_path, "--free-mass", "5", "--restitution", "0.5", text=text)
    for line in ("free_mass            5 kg", "restitution          0.5\n"):
        assert line in printed
    assert f"gap                  {found.gap:g} m\n" in printed


@pytest.mark.parametrize(
    ("options", "text", "message"),
    [
        (["--gap", "-1"], FRAME, "gap = -1.0: must be a number > 0 (m)"),
        (["--output", "frame.zip"], FRAME, "output = 'frame.zip': must end in .fmu"),
        (
            [],
            FRAME.replace("[28, 36]", "[40, 50]"),
            "free_mass, gap: must be given, or found by `damper design`; by the closed forms: band",
        ),
        ([], FRAME + "limit: 0.1 mm\n", "by the closed forms: limit = 0.0001 m: no damper of up"),
        (["--restitution", "2"], FRAME, "restitution = 2.0: must be a number >= 0 and <= 1"),
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
