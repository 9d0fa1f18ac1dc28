"""docs/records.md runs as it is written, and the records that are shipped can be made again."""

import re
import runpy
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from scipy.signal import cont2discrete, dlsim

from damper import Record
from damper.study.config import load_study

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs/records.md").read_text(encoding="utf-8")


def test_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for code in re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL):
        exec(code, names)
    # The peak of a shock stays, what comes after is damped; a fall to a tenth takes longer.
    assert (abs(names["cube"].amplitude_ratio - 1.0) < 0.1).all()
    assert (names["cube"].rms_ratio < 0.9).all()
    assert (np.diff(names["after"].fall_time.values) > 0.0).all()
    for number, text in enumerate(re.findall(r"```yaml\n(.*?)```", TEXT, re.DOTALL)):
        path = tmp_path / f"study{number}.yaml"
        path.write_text(text)
        assert load_study(path).figures  # type: ignore[attr-defined]
    assert number == 1


def test_shipped_records_are_what_their_program_makes(tmp_path: Path) -> None:
    folder = ROOT / "config/records"
    program = tmp_path / "make.py"
    program.write_bytes((folder / "make.py").read_bytes())
    made = runpy.run_path(str(program), run_name="__main__")
    for path in folder.glob("*.csv"):
        assert (tmp_path / path.name).read_bytes() == path.read_bytes()
    # The ground is a linear oscillator that the noise of its seed shakes, held over each step.
    random, (omega, zeta) = Random(made["SEED"]), made["GROUND"]
    quake = Record.read(folder / "earthquake.csv", of="base_acceleration")
    noise = [random.gauss(0.0, 1.0) for _ in quake.time]
    a = np.array([[0.0, 1.0], [-(omega**2), -2.0 * zeta * omega]])
    step = cont2discrete((a, np.array([[0.0], [-1.0]]), np.eye(2), np.zeros((2, 1))), made["STEP"])
    _, states, _ = dlsim(step, noise)
    envelope = np.array([made["_envelope"](t) for t in quake.time])
    values = (states @ [-(omega**2), -2.0 * zeta * omega]) * envelope
    values -= values.mean() * envelope
    np.testing.assert_allclose(quake.value, values / abs(values).max(), atol=6e-6)
    assert abs(quake.value).max() == 1.0
