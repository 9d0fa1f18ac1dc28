"""docs/records.md runs as it is written."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from damper.study.config import load_study

TEXT = (Path(__file__).parents[2] / "docs/records.md").read_text(encoding="utf-8")


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
