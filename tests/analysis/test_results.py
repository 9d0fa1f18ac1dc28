"""Files of results: what is damaged is named and goes."""

from pathlib import Path

import pytest
import xarray as xr

from damper.analysis.results import opened
from damper.sweep.cube import write_cube


def cube() -> xr.Dataset:
    axis = {"restitution": [0.1, 0.2, 0.3, 0.4]}
    return xr.Dataset({"chatter": ("restitution", [0.0, 1.0, 2.0, 2.0])}, axis)


def test_results_are_opened_in_order(tmp_path: Path) -> None:
    write_cube(cube(), tmp_path / "cube.nc")
    (tmp_path / "cost.json").write_text('{"a": 1}')
    settings = {"also": {"other": "a study"}}
    paths = [tmp_path / "cost.json", tmp_path / "cube.nc"]
    with opened(paths, settings, [tmp_path / "cube.nc"]) as (first, second):
        assert first == {"a": 1}
        assert second.equals(cube())
        assert settings["also"]["other"].equals(cube())


def test_a_flipped_byte_of_a_value_is_an_error_and_no_number(tmp_path: Path) -> None:
    """HDF5's index of chunks has no check sum: a byte of it can lose a chunk, which shows."""
    path = tmp_path / "cube.nc"
    write_cube(cube(), path)
    data, removed = path.read_bytes(), []
    for place in range(0, len(data), 41):
        path.write_bytes(data[:place] + bytes([data[place] ^ 4]) + data[place + 1 :])
        try:
            with opened([path]) as (found,):
                lost = (found.chatter > 1e36).all()
                assert lost or found.load().equals(cube())
        except SystemExit as error:
            removed.append(str(error))
            assert not path.exists()
    assert len(removed) > 5
    message = f"Damaged, and now removed: {path}. The same command again makes it anew."
    assert set(removed) == {message}


def test_another_error_removes_nothing(tmp_path: Path) -> None:
    path = tmp_path / "cube.nc"
    write_cube(cube(), path)
    with pytest.raises(ValueError, match="mine"), opened([path]):
        raise ValueError("mine")
    assert path.exists()


def test_two_jobs_that_read_one_damaged_file_both_name_it(tmp_path: Path) -> None:
    path = tmp_path / "cube.nc"
    write_cube(cube(), path)

    def read_while_the_other_job_removes_it() -> None:
        with opened([path]):
            path.unlink()
            raise OSError("HDF error")

    with pytest.raises(SystemExit, match=r"Damaged, and now removed: .*cube\.nc"):
        read_while_the_other_job_removes_it()
