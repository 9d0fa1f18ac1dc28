"""Cubes: descriptions, plain types, equal bytes, and slices put together in any order."""

import itertools
import sys
import time
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest
import xarray as xr
from new_process import in_new_process

from damper import simulate
from damper.parameters.quantities import ALL
from damper.parameters.units import SI_UNITS, attributes_of, units_of
from damper.sweep.cube import CONVENTIONS, REFERENCES, gather, write_cube
from damper.sweep.parts import PartData, read_part, write_part
from damper.sweep.slices import simulate_slice

FIXED = {"damping_ratio": 0.02, "clearance": 0.05, "phase": 0.0}
AXES: dict[str, list[float]] = {
    "mass_ratio": [0.25, 0.05],
    "frequency_ratio": [1.1, 1.5, 2.0],
    "restitution": [0.2, 0.6, 0.9, 1.0],
}
OBSERVERS: dict[str, Any] = {
    "stroboscopic_section": {"free_mass": True},
    "impacts": {},
    "bursts": {"compare_thresholds": [0.1, 0.01, 0.03], "records": 2},
}
RUN: dict[str, Any] = {"transient": 2, "periods": 3, "accuracy": 1e-12, "max_events": 1_000_000}
#: SI units by their symbols, powers and products: all of the grammar of UDUNITS.
READ_BY_UDUNITS = {
    "1",
    "rad",
    "degree",
    "kg",
    "m",
    "s",
    "m/s",
    "N",
    "N s",
    "N/m",
    "N s/m",
    "rad/s",
    "J",
    "m/s2",
}
ATTRIBUTES = {"title": "T", "source": "S", "study": "a: 1\n", "transient_periods": 2}


def gathered(
    fan_axes: tuple[str, ...],
    axes: dict[str, list[float]] = AXES,
    folder: Path | None = None,
    notes: dict[str, dict[str, str]] | None = None,
    **more: Any,
) -> xr.Dataset:
    """Cube of a study fanned along some axes, through files if there is a folder."""
    parts: list[PartData] = []
    for place in itertools.product(*(axes[name] for name in fan_axes)):
        fixed = FIXED | dict(zip(fan_axes, place, strict=True))
        inner = {name: values for name, values in axes.items() if name not in fan_axes}
        part = simulate_slice(fixed, inner, observers=OBSERVERS, **{**RUN, **more})
        if folder:
            write_part(part, folder / f"{len(parts)}.npz")
            part = read_part(folder / f"{len(parts)}.npz")
        parts.append(part)
    return gather(parts, axes, fan_axes, FIXED, ATTRIBUTES, notes)


@pytest.fixture(scope="module")
def whole() -> xr.Dataset:
    """The same grid by `simulate`."""
    return simulate(**FIXED, **AXES, observers=OBSERVERS, **RUN)


# --- gathering


def test_values_lie_at_their_coordinates(whole: xr.Dataset) -> None:
    """Of slices that are gathered; in any order of axes: test_continuation.py."""
    fingerprints = whole.max_approach_speed.values.ravel()
    assert len(np.unique(fingerprints)) == fingerprints.size == 24
    cube = gathered(("restitution",))
    point = {"mass_ratio": 0.05, "frequency_ratio": 2.0, "restitution": 0.6}
    alone = simulate(**FIXED, **point, observers=OBSERVERS, **RUN)
    assert cube.max_approach_speed.sel(point) == alone.max_approach_speed


# --- descriptions


def test_every_variable_has_units_and_long_name(whole: xr.Dataset) -> None:
    for cube in (whole, gathered(("mass_ratio",))):
        for name, variable in cube.variables.items():
            assert variable.attrs["units"] in READ_BY_UDUNITS, name
            assert len(variable.attrs["long_name"]) > 3, name


def test_udunits_reads_every_unit_of_a_quantity() -> None:
    units = {quantity.units for quantity in ALL.values()} | set(SI_UNITS.values()) | set(SI_UNITS)
    assert {attributes_of(one)["units"] for one in units} <= READ_BY_UDUNITS


def test_status_has_flags(whole: xr.Dataset) -> None:
    flags = whole.status.attrs["flag_values"]
    assert flags.dtype == whole.status.dtype
    assert flags.tolist() == [0, 1, 2]
    assert len(whole.status.attrs["flag_meanings"].split()) == 3
    assert whole.status.attrs["flag_meanings"].split()[1] == "max_events_reached"
    stopped = gathered(("mass_ratio",), max_events=5)
    assert (stopped.status == 1).all()
    assert stopped.chatter.isnull().all()
    assert stopped.complete_fraction.isnull().all()
    assert stopped.attrs["runs"] == stopped.attrs["runs_stopped_early"] == 24
    assert (whole.attrs["runs"], whole.attrs["runs_stopped_early"]) == (24, 0)


def test_attributes_are_kept(whole: xr.Dataset, tmp_path: Path) -> None:
    cube = gathered(("mass_ratio",))
    write_cube(cube, tmp_path / "cube.nc")
    with xr.open_dataset(tmp_path / "cube.nc") as back:
        assert {name: back.attrs[name] for name in ATTRIBUTES} == ATTRIBUTES
        assert back.attrs.pop("Conventions") == CONVENTIONS
        counted = back.attrs["quantities"].split()
        assert sorted(counted) == sorted([*AXES, *FIXED])
        assert set(back.attrs) == {*ATTRIBUTES, "quantities", "runs", "runs_stopped_early"}
    assert whole.attrs["references"] == REFERENCES
    for doi in ("10.1177/1687814017743110", "10.1177/14613484211051849"):
        assert doi in REFERENCES


def test_notes_stand_on_the_coordinates(tmp_path: Path) -> None:
    """Reasons for assumed values, on axes and on fixed parameters, and nowhere else."""
    notes = {
        "assumed": {"clearance": "lost in the text", "restitution": "our grid"},
        "stated": {"mass_ratio": "p. 3"},
    }
    for fan_axes in ((), ("restitution",), ("mass_ratio", "restitution")):
        cube = gathered(fan_axes, notes=notes)
        path = tmp_path / f"{len(fan_axes)}.nc"
        write_cube(cube, path)
        with xr.open_dataset(path) as back:
            assert back.clearance.attrs["assumed"] == "lost in the text"
            assert back.restitution.attrs["assumed"] == "our grid"
            assert back.mass_ratio.attrs["stated"] == "p. 3"
            assert units_of(back.clearance.attrs) == "F0/K"
            marked = [name for name in back.variables if "assumed" in back[name].attrs]
            assert sorted(marked) == ["clearance", "restitution"]
            assert [name for name in back.variables if "stated" in back[name].attrs] == [
                "mass_ratio"
            ]


# --- files


def test_round_trip_in_plain_xarray(whole: xr.Dataset, tmp_path: Path) -> None:
    """No arguments when opening: types, missing numbers and attributes come back as they were."""
    cube = gathered(("mass_ratio",), max_events=40)
    assert set(np.unique(cube.status)) == {0, 1}
    write_cube(cube, tmp_path / "cube.nc")
    with xr.open_dataset(tmp_path / "cube.nc") as back:
        back.load()
    xr.testing.assert_identical(back, cube.assign_attrs(Conventions=CONVENTIONS))
    for name in cube.variables:
        assert back[name].dtype == cube[name].dtype, name
    assert float(back.visible_impacts.min()) >= 0.0  # no average is made of what is missing
    assert (back.chatter.isnull() == (back.status == 1)).all()
    with netCDF4.Dataset(tmp_path / "cube.nc") as file:
        kinds = {name: one.dtype for name, one in file.variables.items() if one.dtype.kind == "i"}
        missing = {name for name, one in file.variables.items() if "_FillValue" in one.ncattrs()}
        assert {file[name]._FillValue.item() for name in missing} == {-1}
    assert kinds == {
        "status": np.int8,
        "chatter": np.int8,
        "chatter_by_threshold": np.int8,
        "visible_impacts": np.int32,
        "visible_impacts_by_threshold": np.int32,
    }
    assert missing == {*kinds} - {"status"}


def test_same_bytes_each_time(tmp_path: Path) -> None:
    first, second = tmp_path / "a.nc", tmp_path / "b.nc"
    write_cube(gathered(("mass_ratio",)), first)
    time.sleep(1.2)
    write_cube(gathered(("mass_ratio",)), second)
    assert first.read_bytes() == second.read_bytes()


# --- the layout by hand


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no limit on the size of files")
def test_a_cube_that_cannot_be_written_names_its_file_and_the_room_left(tmp_path):
    """netCDF only says that something went wrong in HDF."""
    path = tmp_path / "cube.nc"
    code = f"""
import json, pathlib, resource, signal, numpy, xarray
from damper.sweep.cube import write_cube
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))
noise = numpy.random.default_rng(1).random(100000)
try:
    write_cube(xarray.Dataset({{"a": ("x", noise)}}), pathlib.Path({str(path)!r}))
except OSError as error:
    print(json.dumps(str(error)))
"""
    message = in_new_process(code)
    assert message.startswith(f"{path}: ")
    assert message.endswith(" MB are free on its disk")
