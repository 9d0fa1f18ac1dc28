"""Slices: the runs' own numbers, written and read without loss, with the same bytes each time."""

import re
import time
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from new_process import in_new_process

from damper.parameters.variables import Variable
from damper.sweep.grid import product
from damper.sweep.runs import run_points
from damper.sweep.slices import DamagedSliceError, Slice, read_slice, simulate_slice, write_slice

FIXED = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.02,
    "frequency_ratio": 1.3,
    "clearance": 0.05,
    "phase": 0.0,
}
AXES = {"restitution": [0.2, 0.5, 0.9]}
OBSERVERS: dict[str, Any] = {
    "stroboscopic_section": {"at": 0.25},
    "impacts": {"threshold": {"speed": 0.1}},
    "bursts": {"compare_thresholds": [0.1, 0.01], "records": 2},
}
RUN: dict[str, Any] = {
    "transient": 4,
    "periods": 5,
    "accuracy": 1e-12,
    "max_events": 1_000_000,
    "observers": OBSERVERS,
}


def assert_equal(a: Slice, b: Slice) -> None:
    assert a.variables == b.variables
    assert a.coordinates == b.coordinates
    assert (a.branches, a.labels) == (b.branches, b.labels)
    assert list(a.arrays) == list(b.arrays)
    for name, array in a.arrays.items():
        assert array.dtype == b.arrays[name].dtype
        np.testing.assert_array_equal(array, b.arrays[name])


def test_slice_holds_the_lanes_of_its_axes() -> None:
    part = simulate_slice(FIXED, {"clearance": [0.05, 0.2], **AXES}, **RUN)
    arrays, made = run_points(product({"clearance": [0.05, 0.2], **AXES}, FIXED), **RUN)
    assert part.arrays["displacement"].shape == (6, 5)
    assert set(part.arrays) == set(arrays)
    for name, array in arrays.items():
        np.testing.assert_array_equal(part.arrays[name], array)
    assert list(part.variables) == [v for observer in made for v in observer.variables]
    assert part.coordinates == {"threshold": [0.1, 0.01]}


def test_a_changed_byte_is_noticed(tmp_path: Path) -> None:
    """Wherever it is: the file is refused, or holds what it held."""
    path = tmp_path / "slice.npz"
    part = simulate_slice(
        {**FIXED, "restitution": 0.5}, {}, transient=0, periods=1, observers=["impacts"]
    )
    write_slice(part, path)
    whole = path.read_bytes()
    refused = 0
    for place in range(len(whole)):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :])
        try:
            assert_equal(read_slice(path), part)
        except DamagedSliceError:
            refused += 1
    assert refused > 0.5 * len(whole)
    for length in range(0, len(whole), 7):
        path.write_bytes(whole[:length])
        with pytest.raises(DamagedSliceError, match=re.escape(str(path))):
            read_slice(path)


def test_single_point() -> None:
    part = simulate_slice({**FIXED, "restitution": 0.5}, {}, **RUN)
    whole = simulate_slice(FIXED, AXES, **RUN)
    assert part.arrays["status"].shape == (1,)
    np.testing.assert_array_equal(part.arrays["velocity"][0], whole.arrays["velocity"][1])


def test_written_and_read_back(tmp_path: Path) -> None:
    part = simulate_slice(FIXED, AXES, **RUN, progress=None)
    write_slice(part, tmp_path / "slice.npz")
    back = read_slice(tmp_path / "slice.npz")
    assert isinstance(back.variables, tuple)
    assert all(isinstance(v, Variable) and isinstance(v.dims, tuple) for v in back.variables)
    assert_equal(back, part)


def test_branches_are_written_and_read_back(tmp_path: Path) -> None:
    """Directions, draws and their numbers to the last bit; runs of every branch."""
    draws = {"count": 3, "seed": 5, "initial_velocity": {"range": (-0.1, 1 / 3)}}
    part = simulate_slice(FIXED, AXES, **RUN, draws=draws, follow={"restitution": "both"})
    assert part.branches == {"direction": ["up", "down"], "draw": [0, 1, 2]}
    assert part.arrays["status"].shape == (3 * 2 * 3,)
    assert len(part.labels["initial_velocity"]) == 3
    write_slice(part, tmp_path / "slice.npz")
    assert_equal(read_slice(tmp_path / "slice.npz"), part)
    plain = simulate_slice(FIXED, AXES, **RUN)
    assert (plain.branches, plain.labels) == ({}, {})


def test_missing_numbers_and_integer_types_survive(tmp_path: Path) -> None:
    part = simulate_slice(FIXED, AXES, **{**RUN, "max_events": 30})
    assert part.arrays["status"].tolist() == [1, 1, 1]
    write_slice(part, tmp_path / "slice.npz")
    back = read_slice(tmp_path / "slice.npz")
    assert_equal(back, part)
    assert back.arrays["chatter"].dtype == np.int8
    assert back.arrays["visible_impacts"].dtype == np.int32
    assert (back.arrays["chatter"] == -1).all()
    assert np.isnan(back.arrays["complete_fraction"]).all()


def test_unusual_text_and_no_variables(tmp_path: Path) -> None:
    odd = Variable("ω", 'μ "x" \\ line\nend', "F0/K", ("sample",), "f4", "—")
    part = Slice({"ω": np.zeros((2, 3), "f4"), "status": np.zeros(2, "i1")}, (odd,), {"sample": []})
    write_slice(part, tmp_path / "odd.npz")
    assert_equal(read_slice(tmp_path / "odd.npz"), part)
    none = Slice({"status": np.zeros(1, "i1")}, (), {})
    write_slice(none, tmp_path / "none.npz")
    assert_equal(read_slice(tmp_path / "none.npz"), none)


def test_reads_files_without_pickle(tmp_path: Path) -> None:
    """Plain arrays and text: numpy loads every member with its default, pickle off."""
    write_slice(simulate_slice(FIXED, AXES, **RUN), tmp_path / "slice.npz")
    with np.load(tmp_path / "slice.npz", allow_pickle=False) as file:
        kinds = {file[name].dtype.kind for name in file.files}
    assert kinds == {"f", "i", "U"}


def test_same_bytes_each_time(tmp_path: Path) -> None:
    first, second = tmp_path / "a.npz", tmp_path / "b.npz"
    write_slice(simulate_slice(FIXED, AXES, **RUN), first)
    time.sleep(2.1)  # times in zip files have a resolution of two seconds
    write_slice(simulate_slice(FIXED, AXES, **RUN), second)
    assert first.read_bytes() == second.read_bytes()
    with zipfile.ZipFile(first) as archive:
        assert {info.date_time for info in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}


def test_progress_is_passed_on() -> None:
    done: list[tuple[int, int]] = []
    simulate_slice(FIXED, AXES, **RUN, progress=lambda *number: done.append(number))
    assert done == [(1, 3), (2, 3), (3, 3)]


def test_bad_values_are_refused() -> None:
    with pytest.raises(ValueError, match=r"restitution = 1\.5"):
        simulate_slice(FIXED, {"restitution": [0.5, 1.5]}, **RUN)


JOB = """
import json, sys
from pathlib import Path
from damper.sweep.slices import {imported}
watched = ("xarray", "netCDF4", "pandas", "scipy", "matplotlib", "pydantic", "yaml", "numba",
           "damper.engine.trajectory")
{run}
print(json.dumps([name for name in watched if name in sys.modules]))
"""


def loaded(imported: str, run: str) -> list[str]:
    code = JOB.format(imported=imported, run=run)
    # numba itself loads scipy and yaml
    return in_new_process(code, DAMPER_COMPILE="0")


def test_simulation_job_loads_no_xarray(tmp_path: Path) -> None:
    path = tmp_path / "slice.npz"
    run = f"write_slice(simulate_slice({FIXED}, {AXES}, **{RUN}), Path({str(path)!r}))"
    assert loaded("simulate_slice, write_slice", run) == ["damper.engine.trajectory"]
    assert read_slice(path).arrays["status"].tolist() == [0, 0, 0]


def test_reading_loads_no_engine(tmp_path: Path) -> None:
    write_slice(simulate_slice(FIXED, AXES, **RUN), tmp_path / "slice.npz")
    path = str(tmp_path / "slice.npz")
    assert loaded("read_slice", f"read_slice(Path({path!r}))") == []
