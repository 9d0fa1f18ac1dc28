"""The command `damper`."""

import csv
from pathlib import Path

import pytest
from click.testing import CliRunner
from scenes import SLOW as POINT

import damper
from damper.shell import TEMPLATE, main

EVENTS = ["events", *(f"--{name.replace('_', '-')}={value}" for name, value in POINT.items())]
ROOT = Path(__file__).parents[2]


def called(*arguments: str, code: int = 0) -> str:
    result = CliRunner().invoke(main, arguments, prog_name="damper")
    assert result.exit_code == code, result.output
    return result.output


def test_events_are_those_of_python(tmp_path: Path) -> None:
    files = tmp_path / "events.csv", tmp_path / "motion.png"
    called(*EVENTS, "--until=60", f"--csv={files[0]}", f"--plot={files[1]}")
    found = damper.events(damper.Parameters(**POINT), until=60.0)
    with files[0].open() as file:  # pandas rounds otherwise
        table = list(csv.DictReader(file))
    assert [float(row["time"]) for row in table] == found["time"].tolist()
    assert [row["kind"] for row in table].count("stick") == (found["kind"] == 1).sum()
    assert files[1].stat().st_size > 10_000
    printed = called(*EVENTS, "--until=60").splitlines()
    assert len(printed) == len(found) + 1


@pytest.mark.filterwarnings("default:.* is unusual")
def test_a_value_that_few_machines_have_is_asked_about_once() -> None:
    given = {
        **{"primary_mass": 100, "damping": 800, "stiffness": 4e6, "free_mass": 10, "gap": "20 m"},
        **{"force_amplitude": 200, "forcing_frequency": 200, "restitution": 0.3, "until": "100 ms"},
    }
    options = (f"--{name.replace('_', '-')}={value}" for name, value in given.items())
    printed = called("events-si", *options)
    assert "UserWarning" not in printed
    assert printed.count("! gap = 20 m is unusual: 1e-06 to 0.5 m is usual. Is another unit") == 1


def test_a_run_without_events_says_so() -> None:
    assert called(*EVENTS, "--until=0") == "No event until 0.\n"


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ([*EVENTS[:-1], "--restitution=2", "--until=1"], 1, "restitution = 2.0: must be"),
        ([*EVENTS, "--until=1", "--mas-ratio=1"], 2, "'--mass-ratio'"),
        (["evnts"], 2, "Did you mean"),
        (["new", "my/study"], 1, "'my/study' cannot be the name of a study: up to 100 letters"),
        (["verify"], 1, "no Snakefile here: this is not the project's folder"),
        (["view", "nowhere"], 1, "no nowhere/report.html"),
    ],
)
def test_a_mistake_is_told_in_one_message(
    arguments: list, code: int, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    output = called(*arguments, code=code)
    assert message in output
    assert "Traceback" not in output


def test_a_new_study_is_valid(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert "not the project's folder" in called("new", "mine", code=1)
    (tmp_path / TEMPLATE).parent.mkdir(parents=True)
    (tmp_path / TEMPLATE).write_bytes((ROOT / TEMPLATE).read_bytes())
    called("new", "mine")
    assert "exists" in called("new", "mine", code=1)
    assert "snakemake --cores 2 --config studies='[mine]'" in Path(
        "config/studies/mine.yaml"
    ).read_text("utf-8")
    assert "yes" in called("check", "config/studies/mine.yaml")
    assert "yes" in called("check", "mine")
    assert "yes" in called("check", "mine.yaml")
    assert called("check", "mien", code=1).count("did you mean 'mine.yaml'?") == 1
