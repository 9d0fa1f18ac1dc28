"""`damper fmu`: a machine with its damper as an FMU."""

import importlib.util
import math
import os
import re
import shutil
import sys
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from damper import __version__
from damper.fmu.stepped import PARAMETERS, Drive, SteppedMachine
from damper.parameters.files import path_of
from damper.sizing.answer import design, machine_from
from damper.sizing.machine import LARGEST_RESTITUTION, Machine
from damper.sizing.structures import structure_machine
from damper.study.yaml_file import read_yaml

#: Sizes of the damper, which a machine does not have.
SIZES = ("free_mass", "gap", "restitution")
#: Size -> the key of a machine for which the closed forms have that size.
_ROOM = {"free_mass": "largest_mass", "gap": "largest_gap", "restitution": "restitution"}
#: Keys of a machine that let a search choose a restitution.
_CHOICES = {"restitution_range", "materials"}
#: What the importing machine has to have.
NEEDS = f"Python 3.11 or newer with the package damper {__version__}"
_SCRIPT = """\
from pythonfmu3 import Fmi3Slave

from damper.fmu.slave import DamperSlave


class {name}(DamperSlave, Fmi3Slave):
    drive = {drive!r}
    begin = {begin!r}

    def __init__(self, **given):
        super().__init__(**given)
        self.description = {about!r}
"""


def build_fmu(
    machine: Any, output: str | os.PathLike[str], sizes: Mapping[str, float]
) -> tuple[str, dict[str, float]]:
    """Write the FMU of a machine with its damper.

    Parameters
    ----------
    machine : path or mapping
        As for `damper.design`.
    output : path
        File to write, ``.fmu``.
    sizes : mapping of str to float
        Any of `SIZES`, in SI units; the closed forms of `damper.design` give the others.

    Returns
    -------
    drive : str
        Name of the input.
    begin : dict of str to float
        Start value of each parameter.

    Raises
    ------
    ValueError, OSError, ConfigError
        Where the machine or a size is not valid, the closed forms do not hold, the file cannot be
        written, or pythonfmu3 is missing.
    """
    path = Path(path_of(output, "output"))
    if path.suffix != ".fmu":
        raise ValueError(f"output = {str(output)!r}: must end in .fmu")
    if not importlib.util.find_spec("pythonfmu3"):
        raise ValueError("pythonfmu3 is missing: pip install -e '.[fmu]'")
    from pythonfmu3.builder import FmuBuilder

    if structure_machine(machine, {}) is not None:
        raise ValueError("structure: an FMU has a machine of one mass: leave structure out")
    asked = machine_from(machine, _restitution_for(machine, sizes))
    for name in ("units", "orientation", "friction_coefficient"):
        value, usual = getattr(asked, name), type(asked).model_fields[name].default
        if value != usual and value != (1,):
            raise ValueError(
                f"{name} = {value!r}: an FMU has one mass without weight: leave it out"
            )
    based = asked.base_amplitude is not None or asked.acceleration_record is not None
    drive: Drive = "base_acceleration" if based else "force"
    usual = {name: setting.default for name, setting in PARAMETERS.items()}
    SteppedMachine(usual | dict(sizes), drive)  # refuses what no run has
    begin = _begin(asked, sizes)
    SteppedMachine(begin, drive)
    about = f"{asked.title} with an impact damper; needs {NEEDS}"
    name = re.sub(r"\W", "_", f"damper_{path.stem}", flags=re.ASCII)
    text = _SCRIPT.format(name=name, drive=drive, begin=begin, about=about)
    # Of its own: in one process Python loads a module of one name once.
    module = f"{name}_{sha256(text.encode()).hexdigest()[:8]}"
    with TemporaryDirectory() as folder:
        script = Path(folder, f"{module}.py")
        script.write_text(text, encoding="utf-8")
        try:
            made = FmuBuilder.build_FMU(script, folder, canHandleVariableCommunicationStepSize=True)
        finally:
            sys.modules.pop(module, None)
        shutil.move(made, path)
    return drive, begin


def _restitution_for(machine: Any, sizes: Mapping[str, float]) -> dict[str, float]:
    """The given restitution as a key of a machine that does not choose among several."""
    data = machine if isinstance(machine, Mapping) else read_yaml(Path(machine)).data
    chooses = isinstance(data, Mapping) and not _CHOICES.isdisjoint(data)
    r = sizes.get("restitution", -1.0)
    return {} if chooses or not 0.0 <= r <= LARGEST_RESTITUTION else {"restitution": r}


def _begin(machine: Machine, sizes: Mapping[str, float]) -> dict[str, float]:
    """Start values of the parameters, with the sizes of the damper."""
    known = {} if machine.restitution is None else {"restitution": machine.restitution}
    known |= sizes
    if missing := [name for name in SIZES if name not in known]:
        given = machine.model_dump(exclude_unset=True)
        for name, key in _ROOM.items():
            if name in known:
                given[key] = known[name]
        if "restitution" in known:
            given = {key: value for key, value in given.items() if key not in _CHOICES}
        try:
            found = design(given, quick=True)
        except ValueError as error:
            raise ValueError(
                f"{', '.join(missing)}: must be given, or found by `damper design`; by the closed "
                f"forms: {error}"
            ) from None
        known |= {name: getattr(found, name) for name in missing}
    return {
        "mass": machine.mass,
        "natural_frequency": machine.rate / math.tau,
        "damping_ratio": machine.damping_ratio,
        **known,
        "initial_displacement": machine.initial_displacement or 0.0,
        "initial_position": 0.0,
        "input_order": 1,
    }
