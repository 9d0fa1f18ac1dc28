"""The forces that a damper may be under: what they may be given, the message for each mistake."""

import math
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyuff
import yaml
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf
from scenes import GENERIC
from scipy.io import savemat, wavfile

from damper import (
    Base,
    Harmonic,
    Harmonics,
    NoForce,
    Noise,
    Parameters,
    Record,
    SIParameters,
    Unbalance,
    read_recording,
)
from damper.models import model_of
from damper.parameters.files import contents
from damper.parameters.forcing import FORCINGS, forcing_of

MISTAKES = yaml.safe_load((Path(__file__).parent / "mistakes.yaml").read_text())
SI = SIParameters(2.0, 4.0, 200.0, 10.0, 11.0, 0.2, 0.1, 0.5)
NOISE = Noise(1, 0.1, 200.0, (0.5, 2.0))
#: One of each kind.
FORCES = (
    NoForce(),
    Harmonic(),
    Harmonics((1, 3), (1.0, 0.5), (0.0, 0.3)),
    Base("base"),
    Unbalance(),
    Record([0.0, 1.0, 3.0], [0.0, 1.0, -0.5], of="base_acceleration", after="hold"),
    NOISE,
)


def refused(call: Callable[[], Any]) -> str:
    with pytest.raises((ValueError, TypeError)) as caught:
        call()
    return str(caught.value)


# --- values


def test_a_force_of_each_kind_is_here() -> None:
    assert [force.kind for force in FORCES] == list(FORCINGS)


@pytest.mark.parametrize("force", FORCES, ids=lambda force: force.kind)
def test_settings_make_the_force_again(force: Any) -> None:
    if isinstance(force, Record):
        assert refused(lambda: forcing_of(force.settings)) == (
            "forcing: its 3 samples are not kept with the cube"
        )
    else:
        assert forcing_of(force.settings) == force


def test_a_record_has_arrays_of_its_own_that_nobody_writes_to() -> None:
    time, value = np.array([0, 1, 2]), [0.0, 1.0, -0.0]
    record = Record(time, value)
    time[0] = 7
    assert record == Record([0.0, 1.0, 2.0], [0.0, 1.0, 0.0])
    assert hash(record) == hash(Record([0.0, 1.0, 2.0], [-0.0, 1.0, 0.0]))
    assert record != Record([0.0, 1.0, 2.0], [0.0, 1.0, 0.0], after="hold")
    with pytest.raises(ValueError, match="read-only"):
        record.value[0] = 1.0


def test_no_force_is_an_amplitude_of_zero() -> None:
    models = [
        model_of(Parameters(**GENERIC, **given))
        for given in (
            {"forcing": "none"},
            {"forcing": "none", "force_amplitude": 0},
            {"forcing": NOISE, "force_amplitude": 0},
            {"force_amplitude": 0.0},
        )
    ]
    assert all(model == models[0] for model in models)


@pytest.mark.parametrize(("call", "words"), MISTAKES["forces"])
def test_what_is_refused(call: str, words: str) -> None:
    assert words in refused(lambda: eval(call))


class WithUnits(list):
    """Numbers as a library of units has them."""

    units = "seconds"


# --- files


@pytest.mark.parametrize(
    ("text", "given"),
    [
        ("0,1\n0.5,-2e-1\n", {}),
        ("\ufefftime,force\n0,1\n0.5,-.2", {}),
        ("# a comment\n\ntime (s); force [N]\n 0 ; 1\r\n0.5; -0.2\n", {"delimiter": ";"}),
        ("v,t,w\n1,0,7\n-0.2,0.5,x\n", {"columns": ("t", "v")}),
        ("7,1,0\n7,-0.2,0.5\n", {"columns": (2, 1)}),
        ('0,1\r  \r # a, b\r"0.5","-0.2"\r', {}),
        ("t_s\tF_N\tG\n0\t1\ta b\n0.5\t-0.2\t\n", {"columns": ("t", "F_N")}),
    ],
    ids=range(7),
)
def test_files_of_a_record(tmp_path: Path, text: str, given: dict[str, Any]) -> None:
    (tmp_path / "record.csv").write_text(text, encoding="utf-8")
    found = Record.read(tmp_path / "record.csv", **given)
    assert found == Record([0.0, 0.5], [1.0, -0.2])


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_encoding_and_decimal_sign_are_found(tmp_path: Path, encoding: str) -> None:
    (tmp_path / "record.csv").write_text("0,0  1\n 1,0 2,5\n", encoding=encoding)
    found = Record.read(tmp_path / "record.csv")
    assert found == Record([0.0, 1.0], [1.0, 2.5])
    assert found.layout == "blanks between columns, decimal commas"


AT2 = """PEER NGA STRONG MOTION DATABASE RECORD
made up, 2000, north
ACCELERATION TIME SERIES IN UNITS OF G
"""
#: Row of the table in docs/records.md -> files of the two samples 2 and -1, 0.5 s apart: suffix,
#: text or what else is in it, how it is read, words of the layout.
FORMATS: dict[str, list[tuple[str, Any, dict[str, Any], str]]] = {
    "two columns": [
        ("csv", "0,2\n0.5,-1\n", {}, ""),
        ("txt", "t;a\n0;2\n0.5;-1\n", {}, "semicolons between columns"),
        ("txt", "0\t2\n0.5\t-1\n", {}, "tabs between columns"),
        ("dat", "# time (s)  a (m/s2)\n 0   2\n .5 -1\n", {}, "blanks between columns"),
        ("csv", "0|2\n0.5|-1\n", {"delimiter": "|"}, "'|' between columns"),
    ],
    "decimal commas": [
        ("csv", "0;2,0\n0,5;-1\n", {}, "semicolons between columns, decimal commas"),
        ("csv", "2,00\n-1,0\n", {"step": 0.5}, "decimal commas, one column"),
        ("csv", "2,0\n-1,0\n", {"step": 0.5, "delimiter": ";"}, "decimal commas, one column"),
    ],
    "more columns": [
        ("csv", "t,n,e\n0,7,2\n0.5,7,-1\n", {"columns": ["t", "e"]}, ""),
        ("csv", "7,2,0\n7,-1,0.5\n", {"columns": [2, 1]}, ""),
        ("csv", "n,e\n7,2\n7,-1\n", {"columns": "e", "step": 0.5}, ""),
    ],
    "values alone": [("txt", "north acc (m/s2)\n2\n-1\n", {"step": 0.5}, "one column")],
    "another unit": [
        ("csv", "t (ms),a [cm/s²]\n0,200\n500,-100\n", {}, "a in cm/s², which is taken as 0.01"),
        ("csv", "t,a (Gal)\n0,200\n.5,-100\n", {}, "a in Gal, which is taken as 0.01 m/s2"),
        ("csv", "t,a_g\n0,1\n.5,-.5\n", {"factor": 2.0}, ""),
    ],
    "PEER (`.AT2`)": [
        (
            "AT2",
            f"{AT2}NPTS=   2, DT=   .5000 SEC\n  .2E+01 -.1E+01\n",
            {"factor": 1},
            "a PEER file",
        ),
        (
            "txt",
            f"{AT2}  2  0.5000  NPTS, DT\n  .2E+01\n -.1E+01",
            {"factor": 1},
            "of 2 samples, 0.5",
        ),
    ],
    "MATLAB (`.mat`)": [
        ("mat", {"a": [2.0, -1.0], "t": [0, 0.5], "name": "x"}, {}, "variables t, a of a MATLAB"),
        ("mat", {"a": [[2], [-1]], "b": [1, 2]}, {"columns": "a", "step": 0.5}, "variables a of"),
    ],
    "WAV (`.wav`)": [
        ("wav", np.array([16384, -8192], np.int16), {"factor": 4}, "of 2 samples a second"),
        ("wav", np.array([[0, 2], [7, -1]], np.float32), {"columns": 1}, "full scale is 1 m/s2"),
    ],
    "universal file (`.uff`, `.unv`)": [
        ("uff", [("m/s^2", [2.0, -1.0])], {}, "time response 0 of a universal file"),
        ("unv", [("NONE", [7.0, 5.0]), ("mm/s^2", [2e3, -1e3])], {"columns": 1}, "in mm/s^2"),
    ],
}


def write_responses(path: Path, made: list[tuple[str, list[float]]]) -> None:
    """Write time responses, two samples a second, as a measuring system does."""
    numbers = ("spec_data_type", "len_unit_exp", "force_unit_exp", "temp_unit_exp")
    axes = ("abscissa", "ordinate", "orddenom", "z_axis")
    about: dict[str, Any] = {f"{axis}_{name}": 0 for axis in axes for name in numbers}
    about |= {f"{axis}_axis_units_lab": "NONE" for axis in axes} | {"type": 58, "binary": 0}
    about |= {"func_type": 1, "rsp_node": 1, "rsp_dir": 1, "ref_node": 1, "ref_dir": 1}
    for unit, values in made:
        samples = {"num_pts": len(values), "x": np.array([0.0, 0.5]), "data": np.array(values)}
        samples |= {"ord_data_type": 4, "abscissa_spacing": 1, "abscissa_inc": 0.5}
        samples |= {"abscissa_min": 0.0, "ordinate_axis_units_lab": unit}
        pyuff.UFF(str(path)).write_sets(about | samples, "add")


@pytest.mark.parametrize("row", FORMATS)
def test_each_format_of_the_documents_is_read(tmp_path: Path, row: str) -> None:
    text = (Path(__file__).parents[2] / "docs/records.md").read_text("utf-8")
    table = text.split("| file |")[1].split("|---|---|---|\n")[1].split("\n\n")[0]
    assert re.findall(r"^\| ([^|]*) \|", table, re.M) == list(FORMATS)
    for suffix, made, how, layout in FORMATS[row]:
        path = tmp_path / f"record.{suffix}"
        if suffix == "mat":
            savemat(path, made)
        elif suffix == "wav":
            wavfile.write(path, 2, made)
        elif suffix in ("uff", "unv"):
            write_responses(path, made)
        else:
            path.write_text(made, encoding="utf-8")
        found = Record.read(path, of="base_acceleration", **how)
        assert found == Record([0.0, 0.5], [2.0, -1.0], of="base_acceleration")
        assert layout in found.layout
        assert layout or not found.layout
        same = read_recording(path, "acceleration", **how)
        assert (same.times.tolist(), same.values.tolist()) == ([0.0, 0.5], [2.0, -1.0])


def test_a_comma_between_whole_numbers_is_asked_about(tmp_path: Path) -> None:
    (path := tmp_path / "a.csv").write_text("0,1\n1,2\n")
    assert "line 1: 0,1 may be two columns or one number" in refused(
        lambda: Record.read(path, step=0.5)
    )
    assert Record.read(path, 1, step=0.5).value.tolist() == [1.0, 2.0]
    assert Record.read(path, step=0.5, delimiter=";").value.tolist() == [0.1, 1.2]


def test_a_peer_file_says_its_samples_and_its_unit(tmp_path: Path) -> None:
    (path := tmp_path / "a.AT2").write_text(f"{AT2}NPTS= 2, DT= .01 SEC\n 1. -2.\n")
    assert Record.read(path, of="base_acceleration").value.tolist() == [9.80665, -19.6133]
    assert "a PEER file in G: must be in N, kN," in refused(lambda: Record.read(path))
    path.write_text(f"{AT2}NPTS= 3, DT= .01 SEC\n 1. -2.\n")
    words = "2 samples: must be 3, as NPTS says"
    assert words in refused(lambda: Record.read(path, of="base_acceleration"))
    path.write_text("1 2 3\n")
    assert "NPTS=, DT=" in refused(lambda: Record.read(path))
    assert "no use for step" in refused(lambda: Record.read(path, step=1.0))


def test_numbers_of_a_file_are_rounded_as_python_rounds_them(tmp_path: Path) -> None:
    chance = np.random.default_rng(5)
    words = [f"{x:.{n}e}" for x, n in zip(chance.normal(size=300), [8, 16, 25] * 100, strict=True)]
    (tmp_path / "record.csv").write_text("".join(f"{k},{w}\n" for k, w in enumerate(words)))
    assert Record.read(tmp_path / "record.csv").value.tolist() == [float(w) for w in words]


@pytest.mark.parametrize(
    ("head", "time", "value"),
    MISTAKES["heads"],
)
def test_a_unit_in_a_head_is_understood_or_asked_about(
    tmp_path: Path, head: str, time: str, value: str
) -> None:
    path = tmp_path / "record.csv"
    path.write_text(f"{head}\n0,1\n1,2\n", encoding="utf-8")
    if not (time or value):
        assert Record.read(path, of="base_acceleration").samples == 2
        return
    message = refused(lambda: Record.read(path, of="base_acceleration"))
    units = "s, ms, msec, us" if time else "m/s2, g, mg, mm/s2"
    assert message.startswith(f"{path}, line 1: {time or value}: must be in {units}, ")


@pytest.mark.parametrize(("text", "given", "words"), MISTAKES["files"])
def test_files_that_are_refused(
    tmp_path: Path, text: str, given: dict[str, Any], words: str
) -> None:
    given = {name: tuple(x) if isinstance(x, list) else x for name, x in given.items()}
    encoding = "latin-1" if text.startswith("\x1f") else "utf-8"
    (tmp_path / "record.csv").write_text(text, encoding=encoding)
    message = refused(lambda: Record.read(tmp_path / "record.csv", **given))
    assert words in message
    assert "record.csv" in message or given


@pytest.mark.parametrize(
    ("path", "given", "words"),
    MISTAKES["arguments"] + [(b"a.csv", {}, "path = b'a.csv': must be the path of a file")],
)
def test_arguments_that_read_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, path: Any, given: dict[str, Any], words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.csv").write_text("0,1\n1,2\n")
    with pytest.raises((TypeError, ValueError)) as error:
        Record.read(path, **given)
    assert str(error.value).startswith(words)


def test_files_that_never_end_are_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "device").symlink_to("/dev/zero")
    with (tmp_path / "huge").open("wb") as file:
        file.truncate(2 * 10**9)  # takes no room
    for name in ("pipe", "device"):
        with pytest.raises(OSError, match="it is a pipe or a device, not a regular file"):
            Record.read(tmp_path / name)
    with pytest.raises(OSError, match="it has 2000 MB, more than 1000 MB"):
        Record.read(tmp_path / "huge")


@pytest.mark.skipif(not os.path.exists("/proc/self/mounts"), reason="no such files here")
def test_no_more_is_read_of_a_file_than_its_size() -> None:
    """Some files of Linux have size 0 and no end, such as /proc/kmsg; this one ends."""
    assert contents("/proc/self/mounts") == b""


def test_a_file_is_read_again_where_it_has_changed(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text("0,1\n1,2\n")
    first = Record.read(path)
    assert Record.read(path) is first
    path.write_text("0,1\n1,3\n")
    assert Record.read(path).value[1] == 3.0


# --- noise


def test_noise_is_the_same_on_all_platforms() -> None:
    """By its definition, in many digits: sines of random phases, rounded to 2**-16."""
    count, (first, last) = 2000, (16, 63)
    value = NOISE.record.value
    assert (NOISE.lines, value.size, value[-1]) == (48, 2001, value[0])
    phases = [int(bits) >> 32 for bits in np.random.PCG64(1).random_raw(48)]
    # The generator's own stream.
    assert phases[:3] == [2198257139, 4082210491, 619160822]
    parts = math.isqrt(count) + 1

    def rounded(function: Callable[..., Any], turns: Any) -> int:
        return int(mp.nint(65536 * function(2 * mp.pi * turns)))

    with mp.workdps(30):
        for n in (0, 1, 777, 1999):
            coarse = n // parts * parts
            total = 0
            for line in range(first, last + 1):
                turns = mpf(line * coarse % count) / count + mpf(phases[line - first]) / 2**32
                fine = mpf(line * (n - coarse) % count) / count
                total += rounded(mp.sin, turns) * rounded(mp.cos, fine)
                total += rounded(mp.cos, turns) * rounded(mp.sin, fine)
            assert value[n] == total * (math.sqrt(2.0 / 48) / 2.0**32)


@given(st.integers(0, 2**64), st.floats(0, 3), st.floats(0.1, 3), st.integers(300, 5000))
def test_noise_has_its_band_alone(seed: int, low: float, width: float, count: int) -> None:
    high = low + width
    step = 0.6 / high
    try:
        noise = Noise(seed, step, count * step, (low, high))
    except ValueError as error:
        assert "too short" in str(error)  # noqa: PT017
        return
    value = noise.record.value
    lines = 2.0 * abs(np.fft.rfft(value[:-1])) / count
    rates = 2.0 * np.pi * np.arange(lines.size) / (count * step)
    inside = (rates >= low * (1 - 1e-9)) & (rates <= high * (1 + 1e-9)) & (rates > 0.0)
    assert noise.lines == inside.sum()
    np.testing.assert_allclose(lines[inside], math.sqrt(2.0 / noise.lines), rtol=1e-4)
    assert lines[~inside].max() < 1e-4
    assert math.sqrt((value[:-1] ** 2).mean()) == pytest.approx(1.0, rel=1e-4)
