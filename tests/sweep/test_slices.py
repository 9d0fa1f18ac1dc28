"""Slices: the runs' own numbers, written and read without loss, with the same bytes each time."""

import json
import re
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from new_process import modules_after

from damper.sweep.grid import product
from damper.sweep.parts import DamagedPartError, PartData, read_part, write_part
from damper.sweep.runs import run_points
from damper.sweep.slices import simulate_slice

FIXED = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.02,
    "frequency_ratio": 1.3,
    "clearance": 0.05,
    "phase": 0.0,
}
AXES = {"restitution": [0.2, 0.5, 0.9]}
RUN: dict[str, Any] = {
    "transient": 4,
    "periods": 5,
    "accuracy": 1e-12,
    "max_events": 1_000_000,
    "observers": {
        "stroboscopic_section": {"when": 0.25},
        "impacts": {"threshold": {"speed": 0.1}},
        "bursts": {"compare_thresholds": [0.1, 0.01], "records": 2},
    },
}


def assert_equal(a: PartData, b: PartData) -> None:
    assert json.loads(json.dumps(a.about)) == json.loads(json.dumps(b.about))
    assert list(a.arrays) == list(b.arrays)
    for name, array in a.arrays.items():
        assert array.dtype == b.arrays[name].dtype
        np.testing.assert_array_equal(array, b.arrays[name])


def test_slice_holds_the_runs_of_its_axes() -> None:
    axes = {"clearance": [0.05, 0.2], **AXES}
    part = simulate_slice(FIXED, axes, **RUN)
    arrays, made = run_points(product(axes, FIXED), **RUN)
    variables = [asdict(variable) for observer in made for variable in observer.variables]
    assert part.arrays["displacement"].shape == (6, 5)
    about = {"variables": variables, "coordinates": {"threshold": [0.1, 0.01]}}
    assert_equal(part, PartData(arrays, about | {"branches": {}, "labels": {}}))
    single = simulate_slice({**FIXED, "clearance": 0.2, "restitution": 0.5}, {}, **RUN)
    np.testing.assert_array_equal(single.arrays["velocity"], part.arrays["velocity"][[4]])


def test_a_changed_byte_is_noticed(tmp_path: Path) -> None:
    """Wherever it is: the file is refused, or holds what it held."""
    path = tmp_path / "slice.npz"
    part = SLICES["odd text"]()
    write_part(part, path)
    whole = path.read_bytes()
    refused = 0
    for place in range(0, len(whole), 3):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :])
        try:
            assert_equal(read_part(path), part)
        except DamagedPartError:
            refused += 1
    assert refused > 0.5 * len(whole) / 3
    for length in range(0, len(whole), 17):
        path.write_bytes(whole[:length])
        with pytest.raises(DamagedPartError, match=re.escape(str(path))):
            read_part(path)


ODD = {"ω": 'μ "x" \\ line\nend — ', "third": 1 / 3, "none": None}
DRAWS = {"count": 3, "seed": 5, "initial_velocity": {"range": (-0.1, 1 / 3)}}
BRANCHES = {"draws": DRAWS, "follow": {"restitution": "both"}}
SLICES = {
    "some runs": lambda: simulate_slice(FIXED, AXES, **RUN),
    "branches": lambda: simulate_slice(FIXED, AXES, **RUN, **BRANCHES),
    "no values": lambda: simulate_slice(FIXED, AXES, **{**RUN, "max_events": 30}),
    "odd text": lambda: PartData({"ω": np.zeros((2, 3), "f4"), "status": np.zeros(2, "i1")}, ODD),
    "no arrays": lambda: PartData({}, ODD),
}


@pytest.mark.parametrize("kind", SLICES)
def test_written_and_read_back(tmp_path: Path, kind: str) -> None:
    """Every bit, in plain arrays and text: numpy loads them with its default, pickle off."""
    part, path = SLICES[kind](), tmp_path / "slice.npz"
    write_part(part, path)
    assert_equal(read_part(path), part)
    with np.load(path, allow_pickle=False) as file:
        assert {file[name].dtype.kind for name in file.files} <= {"f", "i", "U"}


JOB = """
from importlib import import_module
from pathlib import Path
from damper.study.jobs import read_parts
from damper.sweep.parts import read_part, write_part
"""
HEAVY = {"xarray", "netCDF4", "pandas", "scipy", "matplotlib", "pydantic", "yaml", "numba"}
HEAVY |= {"mpmath", "damper.engine.trajectory"}


def loaded(run: str) -> set[str]:
    # numba itself loads scipy and yaml
    return HEAVY & modules_after(JOB + run, DAMPER_COMPILE="0")


def test_a_simulation_job_loads_no_xarray_and_reading_no_engine(tmp_path: Path) -> None:
    path = tmp_path / "slice.npz"
    settings = {"fixed": FIXED, "axes": AXES, **RUN}
    run = f"import_module('damper.sweep.slices').run_part([], **{settings})"
    assert loaded(f"write_part({run}, Path({str(path)!r}))") == {"damper.engine.trajectory"}
    assert read_part(path).arrays["status"].tolist() == [0, 0, 0]
    assert loaded(f"read_part(Path({str(path)!r}))") == set()
