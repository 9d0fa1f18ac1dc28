"""The sampled stretch lies in the record, its figure in the stretch: told as a study is read."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from damper.observers.trajectory import SampledTrajectory
from damper.study.config import ConfigError, load_study

BURST = Path(__file__).parents[2] / "config/studies/burst.yaml"


def study(folder: Path, periods: int, observer: dict[str, Any], **figure: Any) -> Path:
    data = yaml.safe_load(BURST.read_text())
    data |= {"periods": periods, "observers": {"trajectory": observer}}
    data["figures"]["history"] |= figure
    path = folder / "burst.yaml"
    path.write_text(yaml.safe_dump(data))
    return path


@pytest.mark.parametrize(
    ("samples_per_period", "start", "length"),
    [(1, 0.0, None), (400, 1.9, None), (3, 2.0, None), (3, 0.5, 0.1), (400, 0.0, 2.1)],
)
def test_study_refuses_what_the_observer_refuses(
    tmp_path: Path, samples_per_period: int, start: float, length: float | None
) -> None:
    settings = {"samples_per_period": samples_per_period, "start": start}
    settings |= {} if length is None else {"length": length}
    path = study(tmp_path, 2, settings)
    try:
        SampledTrajectory(**settings).size("instant", 2)
    except ValueError:
        with pytest.raises(
            ConfigError, match=r"observers.trajectory\n.*does not lie in the record"
        ):
            load_study(path)
    else:
        load_study(path)


def test_figure_starts_in_the_stretch(tmp_path: Path) -> None:
    load_study(study(tmp_path, 4, {"start": 1, "length": 2}, start=1.9))
    with pytest.raises(ConfigError, match=r"figures.history.start\n.*starts 2 periods") as caught:
        load_study(study(tmp_path, 4, {"start": 1, "length": 2}, start=2))
    assert "number >= 0 and < 2" in str(caught.value)


def test_figure_stops_in_the_stretch(tmp_path: Path) -> None:
    load_study(study(tmp_path, 4, {"start": 1, "length": 2}, stop=2))
    with pytest.raises(ConfigError, match=r"figures.history.stop\n.*stops 2.5 periods") as caught:
        load_study(study(tmp_path, 4, {"start": 1, "length": 2}, stop=2.5))
    assert "number <= 2" in str(caught.value)
