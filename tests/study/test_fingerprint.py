"""Fingerprints are in the files, and the files are what they were."""

import json
from pathlib import Path
from xml.etree import ElementTree

import matplotlib.pyplot as plt
import netCDF4
import numpy as np
import pytest

from damper.study.fingerprint import fingerprint, fingerprint_in, stamp

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
