"""Workers: what they answer, and what memory they are found to take."""

import os
from pathlib import Path

import pytest

from damper.verification.cost.process import Worker, fresh, peak_memory


@pytest.fixture(autouse=True)
def _find_helpers(monkeypatch):
    here = str(Path(__file__).parent)
    before = os.environ.get("PYTHONPATH")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, (here, before))))


def test_the_peak_sees_an_allocation_of_known_size_also_after_it_is_gone():
    with Worker() as worker:
        before = worker.call("memory_taker:take", megabytes=0)
        after = worker.call("memory_taker:take", megabytes=100)
        again = worker.call("memory_taker:take", megabytes=10)
    assert after - before == pytest.approx(100e6, rel=0.03)
    assert again == after


def test_a_large_parent_does_not_hide_a_small_child():
    block = bytearray(200_000_000)
    block[::1024] = b"x" * len(block[::1024])
    assert peak_memory() > 200e6
    assert fresh("memory_taker:take", megabytes=0) < 100e6


def test_a_worker_keeps_its_state_and_starts_with_nothing_heavy():
    with Worker() as worker:
        assert not worker.call("memory_taker:loaded", name="numpy")
        assert worker.call("memory_taker:talk", text="é\n1") == "é\n1"
        worker.call("numpy:geterr")
        assert worker.call("memory_taker:loaded", name="numpy")


def test_a_worker_that_fails_says_so(capfd):
    with (
        pytest.raises(RuntimeError, match="memory_taker:fail failed in its process"),
        Worker() as w,
    ):
        w.call("memory_taker:fail")
    assert "as asked" in capfd.readouterr().err
