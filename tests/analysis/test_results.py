"""Files of results: what is damaged is named and goes."""

from pathlib import Path

import pytest
import xarray as xr

from damper.analysis.results import Results
from damper.sweep.cube import write_cube


def cube() -> xr.Dataset:
    axis = {"restitution": [0.1, 0.2, 0.3, 0.4]}
    return xr.Dataset({"chatter": ("restitution", [0.0, 1.0, 2.0, 2.0])}, axis)


def test_results_are_opened_when_they_are_asked_for(tmp_path: Path) -> None:
    write_cube(cube(), tmp_path / "cube.nc")
    (tmp_path / "cost.json").write_text('{"a": 1}')
    names = {"cube": "cube.nc", "cost": "cost.json", "orbits": "missing.nc"}
    with Results({name: tmp_path / path for name, path in names.items()}) as results:
        assert results["cost"] == {"a": 1}
        assert results["cube"].equals(cube())
        assert results["cube"] is results["cube"]
        assert list(results) == list(names)
        assert "orbits" in results
        with pytest.raises(KeyError, match="timings"):
            results["timings"]


def test_a_flipped_byte_of_a_value_is_an_error_and_no_number(tmp_path: Path) -> None:
    """HDF5's index of chunks has no check sum: a byte of it can lose a chunk, which shows."""
    path = tmp_path / "cube.nc"
    write_cube(cube(), path)
    data, removed = path.read_bytes(), []
    for place in range(0, len(data), 41):
        path.write_bytes(data[:place] + bytes([data[place] ^ 4]) + data[place + 1 :])
        try:
            with Results({"cube": path}) as results:
                found = results["cube"]
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

    def fail_otherwise() -> None:
        with Results({"cube": path}) as results:
            assert "chatter" in results["cube"]
            raise ValueError("mine")

    with pytest.raises(ValueError, match="mine"):
        fail_otherwise()
    assert path.exists()


def test_two_jobs_that_read_one_damaged_file_both_name_it(tmp_path: Path) -> None:
    path = tmp_path / "cube.nc"
    write_cube(cube(), path)

    def read_while_the_other_job_removes_it() -> None:
        with Results({"cube": path}) as results:
            assert "chatter" in results["cube"]
            path.unlink()
            raise OSError("HDF error")

    with pytest.raises(SystemExit, match=r"Damaged, and now removed: .*cube\.nc"):
        read_while_the_other_job_removes_it()
