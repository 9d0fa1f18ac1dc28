"""New interpreters: what they answer, and what memory they take."""

import os
from pathlib import Path

import pytest

from damper.verification.cost.process import fresh, peak_memory


@pytest.fixture(autouse=True)
def _find_helpers(monkeypatch):
    here = str(Path(__file__).parent)
    before = os.environ.get("PYTHONPATH")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, (here, before))))


def test_the_peak_sees_an_allocation_of_known_size_also_after_it_is_gone():
    before, after = (fresh("memory_taker:take", megabytes=size) for size in (0, 100))
    assert after - before == pytest.approx(100e6, rel=0.03)


def test_a_large_parent_does_not_hide_a_small_child():
    block = bytearray(200_000_000)
    block[::1024] = b"x" * len(block[::1024])
    assert peak_memory() > 200e6
    assert fresh("memory_taker:take", megabytes=0) < 100e6


def test_what_is_printed_is_no_answer_and_nothing_heavy_is_loaded():
    assert fresh("memory_taker:talk", text="é\n1") == ["é\n1", False]


def test_a_failure_is_reported(capfd):
    with pytest.raises(RuntimeError, match="memory_taker:fail failed in its process"):
        fresh("memory_taker:fail")
    assert "as asked" in capfd.readouterr().err
