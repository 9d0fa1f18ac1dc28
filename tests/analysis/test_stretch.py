"""The sampled stretch lies in the window, its figure in the stretch: told as a study is read."""

import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from studies import blame, load

from damper.observers.trajectory import SampledTrajectory

BURST = Path(__file__).parents[2] / "config/studies/burst.yaml"


def study(periods: int, observer: dict[str, Any], **figure: Any) -> dict[str, Any]:
    data = yaml.safe_load(BURST.read_text())
    data["figures"]["history"] |= figure
    return data | {"periods": periods, "observers": {"trajectory": observer}}


@pytest.mark.parametrize(
    ("samples_per_period", "start", "length"),
    [(1, 0.0, None), (400, 1.9, None), (3, 2.0, None), (3, 0.5, 0.1), (400, 0.0, 2.1)],
)
def test_study_refuses_what_the_observer_refuses(
    tmp_path: Path, samples_per_period: int, start: float, length: float | None
) -> None:
    settings = {"samples_per_period": samples_per_period, "start": start}
    settings |= {} if length is None else {"length": length}
    try:
        SampledTrajectory(**settings).size("instant", 2)
    except ValueError:
        message = blame(tmp_path, study(2, settings))
        assert re.search(r"observers.trajectory\n.*does not lie in the window", message)
    else:
        load(tmp_path, study(2, settings))


@pytest.mark.parametrize(
    ("end", "inside", "outside", "words", "allowed"),
    [
        ("start", 1.9, 2, "starts 2 cycles", "number >= 0 and < 2"),
        ("stop", 2, 2.5, "stops 2.5 cycles", "number <= 2"),
    ],
)
def test_figure_lies_in_the_stretch(
    tmp_path: Path, end: str, inside: float, outside: float, words: str, allowed: str
) -> None:
    stretch = {"start": 1, "length": 2}
    load(tmp_path, study(4, stretch, **{end: inside}))
    message = blame(tmp_path, study(4, stretch, **{end: outside}))
    assert re.search(rf"figures.history.{end}\n.*{words}", message)
    assert allowed in message
