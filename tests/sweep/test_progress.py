"""How far a sweep is, in a log and on a terminal, by a clock of our own."""

import io
import sys
import time
from collections.abc import Iterator

import pytest

from damper.engine import terminal
from damper.sweep import progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def clock(monkeypatch: pytest.MonkeyPatch, step: float) -> None:
    """Let each look at the clock take so many seconds."""

    def seconds() -> Iterator[float]:
        now = 0.0
        while True:
            yield now
            now += step

    monkeypatch.setattr(progress, "monotonic", seconds().__next__)


@pytest.mark.parametrize(
    ("step", "lines"),
    [
        (
            0.5,
            ["20 of 200 points, 2 a second, 90 s left", "40 of 200 points, 2 a second, 80 s left"],
        ),
        (45.0, ["2 of 200 points, 0.0222 a second, 2.5 h left"]),
    ],
    ids=["each tenth", "each minute"],
)
def test_lines(monkeypatch: pytest.MonkeyPatch, step: float, lines: list[str]) -> None:
    clock(monkeypatch, step)
    log = io.StringIO()
    show = progress.progress_lines(log)
    for done in range(1, 201):
        show(done, 200)
    found = log.getvalue().splitlines()
    assert found[: len(lines)] == lines
    assert found[-1].startswith("200 of 200 points")
    assert "left" not in found[-1]


def test_what_compiles_between_points_does_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "monotonic", iter([0.0, 1.0, 2.0, 99.0, 99.5, 100.0]).__next__)
    log = io.StringIO()
    show = progress.progress_lines(log)
    for done in range(1, 6):
        show(done, 10)
    assert log.getvalue().splitlines()[2:] == [
        "3 of 10 points",
        "4 of 10 points, 2 a second, 3 s left",
        "5 of 10 points, 2 a second, 2.5 s left",
    ]


def test_bar_goes_when_all_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    clock(monkeypatch, 0.4)
    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    monkeypatch.setenv("COLUMNS", "200")
    with progress.progress_bar() as show:
        assert show is not None
        for done in range(1, 101):
            show(done, 100)
    first, *_, last, blank, end = terminal.getvalue().split("\r")[1:]
    assert first.startswith("[")
    assert "3 of 100 points, 2.5 a second, 39 s left" in first
    assert f"[{'#' * 24}] 100 of 100 points" in last
    assert not blank.strip()
    assert len(blank) >= len(last.rstrip())
    assert end == ""


def test_bar_is_for_terminals_and_for_what_takes_longer_than_a_second(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock(monkeypatch, 0.01)
    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    with progress.progress_bar() as show:
        assert show is not None
        show(10, 10)
    assert terminal.getvalue() == ""
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    with progress.progress_bar() as show:
        assert show is None


def test_what_takes_long_is_said_and_the_line_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(terminal, "_PATIENCE", 0.01)
    monkeypatch.setattr(terminal, "_AGAIN", 0.01)
    monkeypatch.setattr(sys, "stderr", watched := Terminal())
    with terminal.saying("outer"), terminal.saying("inner"):
        while watched.getvalue().count("inner") < 2:
            time.sleep(0.01)
    text = watched.getvalue()
    assert "outer" not in text.partition("inner")[0]
    assert text.endswith("\r")
    assert not text.split("\r")[-2].strip()
    monkeypatch.setattr(sys, "stderr", quiet := io.StringIO())
    with terminal.saying("silent"):
        time.sleep(0.05)
    assert quiet.getvalue() == ""
