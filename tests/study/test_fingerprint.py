"""Fingerprints are in the files, and the files are what they were."""

import json
import os
from pathlib import Path
from xml.etree import ElementTree

import matplotlib.pyplot as plt
import netCDF4
import numpy as np
import pytest

from damper.study.fingerprint import Checked, fingerprint, fingerprint_in, stamp

SETTINGS = {"fixed": {"clearance": 0.05}, "axes": {"restitution": (0.3, 0.6)}, "initial": None}
VALUES = np.linspace(0.0, 1.0, 50)


def write(path: Path) -> None:
    if path.suffix == ".npz":
        np.savez(path, values=VALUES)
    elif path.suffix == ".nc":
        with netCDF4.Dataset(path, "w") as file:
            file.createDimension("n", len(VALUES))
            file.createVariable("values", "f8", ("n",), zlib=True)[:] = VALUES
    elif path.suffix in (".svg", ".png"):
        figure, axes = plt.subplots()
        axes.plot(VALUES)
        figure.savefig(path)
        plt.close(figure)
    elif path.suffix == ".json":
        path.write_text(json.dumps({"values": VALUES.tolist()}))
    else:
        path.write_text("# Title\n\n| a |\n|---|\n| 1 |\n")


def content(path: Path) -> object:
    """What a program that knows nothing of fingerprints reads."""
    if path.suffix == ".npz":
        with np.load(path) as file:
            return {name: file[name].tolist() for name in file.files}
    if path.suffix == ".nc":
        with netCDF4.Dataset(path) as file:
            return file["values"][:].tolist()
    if path.suffix == ".png":
        return plt.imread(path).tolist()
    if path.suffix == ".json":
        return json.loads(path.read_text())["values"]
    if path.suffix == ".svg":
        return ElementTree.tostring(ElementTree.parse(path).getroot())
    return path.read_text().partition("<!--")[0]


@pytest.mark.parametrize("suffix", [".npz", ".nc", ".svg", ".png", ".json", ".md", ".html"])
def test_a_file_carries_its_fingerprint_and_reads_as_before(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"made{suffix}"
    write(path)
    before = content(path)
    assert fingerprint_in(path) is None
    stamp([path], SETTINGS)
    assert fingerprint_in(path) == fingerprint(SETTINGS)
    assert content(path) == before
    path.write_bytes(path.read_bytes()[:-40])
    assert fingerprint_in(path) is None


@pytest.mark.parametrize("suffix", [".npz", ".nc", ".svg", ".png", ".json", ".md", ".html"])
def test_no_byte_can_change(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"made{suffix}"
    write(path)
    stamp([path], SETTINGS)
    data = path.read_bytes()
    size = len(data)
    places = {*range(0, size, size // 200 + 1), *range(max(0, size - 120), size)}
    flipped = [data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :] for at in places]
    for other in (*flipped, data[:-1], data + b"\n", data[1:], b"", data[: size // 2] * 2):
        path.write_bytes(other)
        assert fingerprint_in(path) is None
    path.write_bytes(data)
    assert fingerprint_in(path) == fingerprint(SETTINGS)


def test_the_markdown_of_a_table_answers_for_its_csv(tmp_path: Path) -> None:
    csv, markdown = tmp_path / "table.csv", tmp_path / "table.md"
    csv.write_text("gap,worst\n0.1,0.5\n")
    write(markdown)
    stamp([csv, markdown], SETTINGS)
    assert csv.read_text() == "gap,worst\n0.1,0.5\n"
    assert fingerprint_in(markdown) == fingerprint(SETTINGS)
    for other in ("gap,worst\n0.1,0.4\n", "gap,worst\n"):
        csv.write_text(other)
        assert fingerprint_in(markdown) is None
    csv.unlink()
    assert fingerprint_in(markdown) is None


def test_a_file_is_read_again_where_its_times_or_its_size_changed(tmp_path: Path) -> None:
    path, record = tmp_path / "made.md", tmp_path / "checked"
    write(path)
    stamp([path], SETTINGS)
    first = path.stat()
    data = path.read_bytes()
    assert Checked(record).fingerprint_in(path) == fingerprint(SETTINGS)
    kept = record.read_text()
    with record.open("a") as file:
        file.write('["made.md", "12')  # killed while it wrote
    assert Checked(record).fingerprint_in(path) == fingerprint(SETTINGS)
    # A word in another's place, and the time set back: that of the change cannot be.
    while path.stat().st_ctime_ns == first.st_ctime_ns:
        path.write_bytes(data.replace(b"Title", b"Tilte"))
        os.utime(path, ns=(first.st_atime_ns, first.st_mtime_ns))
    now = path.stat()
    assert (now.st_size, now.st_mtime_ns) == (first.st_size, first.st_mtime_ns)
    assert Checked(record).fingerprint_in(path) is None
    # What the record says of a file that has not changed is taken for true.
    record.write_text(f"{now.st_ctime_ns}".join(kept.rsplit(f"{first.st_ctime_ns}", 1)))
    assert Checked(record).fingerprint_in(path) == fingerprint(SETTINGS)


def test_nobody_waits_for_a_pipe(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "cube.nc")
    (tmp_path / "cube.npz").symlink_to("/dev/zero")
    assert fingerprint_in(tmp_path / "cube.nc") is None
    assert fingerprint_in(tmp_path / "cube.npz") is None


def test_stamping_gives_the_same_bytes_each_time(tmp_path: Path) -> None:
    for suffix in (".npz", ".nc", ".png"):
        made = []
        for name in ("a", "b"):
            path = tmp_path / f"{name}{suffix}"
            write(path)
            stamp([path], SETTINGS)
            made.append(path.read_bytes())
        assert made[0] == made[1], suffix


def test_values_and_order_count_and_kinds_of_sequences_do_not() -> None:
    others = (
        {**SETTINGS, "fixed": {"clearance": np.nextafter(0.05, 1.0)}},
        {**SETTINGS, "axes": {"restitution": (0.6, 0.3)}},
        dict(reversed(SETTINGS.items())),
        {**SETTINGS, "initial": {}},
    )
    assert len({fingerprint(other) for other in (SETTINGS, *others)}) == 5
    assert fingerprint(SETTINGS) == fingerprint(json.loads(json.dumps(SETTINGS)))
    with pytest.raises(TypeError):
        fingerprint({"path": Path()})
