import math
import re
from pathlib import Path

import numpy as np
import pytest
import pyuff
import scipy.io
import scipy.sparse
import yaml

import damper

MISTAKES = yaml.safe_load((Path(__file__).parent / "mistakes.yaml").read_text())
M, K = np.diag([2.0, 1.0]), np.array([[3.0, -1.0], [-1.0, 1.0]])
WHOLE = damper.Structure(M, None, K, boxes={"roof": 1}, force=0, base=[1.0, 1.0])
TABLE = "frequency,damping_ratio,tip,force\n0.16,0.01,1,1\n0.43,0.02,0.6,0.5\n"
MODES = damper.Structure.from_modes(
    [0.16, 0.43], [0.01, 0.02], {"tip": [1.0, 0.6], "force": [1.0, 0.5]}
)


def file(folder, text, name="modes.csv"):
    path = folder / name
    path.write_text(text, "utf-8")
    return path


def test_a_modal_table_is_read(tmp_path):
    assert damper.Structure.read_modes(file(tmp_path, TABLE)) == MODES
    other = "# a beam\n" + TABLE.replace(",", ";").replace("frequency", "frequency (Hz)")
    assert damper.Structure.read_modes(file(tmp_path, other)) == MODES


def test_a_modal_table_in_rad_per_second_with_modal_masses(tmp_path):
    text = "frequency (rad/s),damping_ratio,modal_mass,tip\n2,0.01,4,1\n"
    s = damper.Structure.read_modes(file(tmp_path, text), force="tip")
    assert s.frequencies[0] == pytest.approx(1.0 / math.pi, rel=1e-15)
    assert (s.mass[0, 0], s.force[0]) == (4.0, 1.0)


@pytest.mark.parametrize(
    ("text", "message"),
    MISTAKES["modal files"],
)
def test_mistakes_in_a_modal_table_name_the_line(tmp_path, text, message):
    with pytest.raises(ValueError, match=message):
        damper.Structure.read_modes(file(tmp_path, text))


def test_matrices_are_read_from_every_format(tmp_path):
    named = {"boxes": {"roof": "b"}, "force": 0, "base": "e"}
    arrays = {"M": M, "K": K, "b": [0.0, 1.0], "e": [1.0, 1.0]}
    np.savez(tmp_path / "s.npz", **arrays)
    scipy.io.savemat(tmp_path / "s.mat", arrays | {"M": scipy.sparse.csc_matrix(M)})
    for name in ("s.npz", "s.mat"):
        assert damper.Structure.read_matrices(tmp_path / name, **named) == WHOLE
    scipy.io.mmwrite(tmp_path / "m.mtx", scipy.sparse.coo_matrix(M))
    np.save(tmp_path / "k.npy", K)
    files = {"mass": tmp_path / "m.mtx", "stiffness": tmp_path / "k.npy"}
    given = {"boxes": {"roof": 1}, "force": 0, "base": [1, 1]}
    assert damper.Structure.read_matrices(files, **given) == WHOLE


def test_mistakes_in_matrices_name_the_file(tmp_path):
    np.savez(tmp_path / "s.npz", M=M, K=K + np.triu(K, 1))
    with pytest.raises(ValueError, match=r"s.npz: stiffness is not symmetric: stiffness\[0, 1\]"):
        damper.Structure.read_matrices(tmp_path / "s.npz")
    np.savez(tmp_path / "s.npz", M=M)
    with pytest.raises(ValueError, match=r"s.npz: stiffness is missing.*it has M"):
        damper.Structure.read_matrices(tmp_path / "s.npz")
    with pytest.raises(TypeError, match=r"unknown matrix 'mas' \(did you mean 'mass'"):
        damper.Structure.read_matrices({"mas": "m.mtx"})
    for name in ("s.mat", "s.npz"):
        (tmp_path / name).write_bytes(b"no such file")
        with pytest.raises(ValueError, match=f"{name}: not a file of"):
            damper.Structure.read_matrices(tmp_path / name)
    with pytest.raises(FileNotFoundError):
        damper.Structure.read_matrices(tmp_path / "none.npz")


def test_the_document_reads_a_universal_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file_of_modes = pyuff.UFF("beam.uff")
    nothing = np.zeros(2)
    for k in range(2):
        values = {"freq": [0.16, 0.43][k], "modal_damp_vis": [0.01, 0.02][k], "modal_m": 1.0}
        numbers = {"analysis_type": 2, "data_ch": 2, "spec_data_type": 8, "load_case": 1}
        shape = {"r1": nothing, "r2": nothing, "r3": np.array([[1.0, 1.0], [0.5, 0.6]][k])}
        nodes = {"mode_n": k + 1, "node_nums": [6, 12]}
        file_of_modes.write_sets({"type": 55} | values | numbers | shape | nodes, "add")
    text = (Path(__file__).parents[2] / "docs/structures.md").read_text("utf-8")
    (block,) = re.findall(r"```python\n(import pyuff\n.*?)```", text, re.DOTALL)
    scope = {"damper": damper}
    exec(block.replace("damper.Structure.from_modes", "found = damper.Structure.from_modes"), scope)
    assert scope["found"] == MODES
