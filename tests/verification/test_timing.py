"""Taking turns: order and pairing, on a clock that is made up."""

import numpy as np
import pytest

from damper.verification import timing
from damper.verification.timing import take_turns


class Clock:
    """A clock that moves only when a case runs."""

    def __init__(self) -> None:
        self.now = 0.0
        self.log: list[str] = []

    def case(self, name, seconds):
        def run():
            self.log.append(name)
            self.now += seconds() if callable(seconds) else seconds

        return run


@pytest.fixture
def clock(monkeypatch):
    made = Clock()
    monkeypatch.setattr(timing, "process_time", lambda: made.now)
    return made


def test_each_case_is_timed_by_itself_once_a_repeat_forwards_then_backwards(clock):
    cases = [clock.case("a", 1.0), clock.case("b", 2.0), clock.case("c", 4.0)]
    seconds = take_turns(cases, 3)
    assert clock.log == list("abc" + "cba" + "abc")
    assert np.array_equal(seconds, [[1.0, 2.0, 4.0]] * 3)


def test_a_machine_that_slows_down_does_not_change_the_ratio(clock):
    def slower(work):
        return lambda: work * 1.02 ** len(clock.log)

    cases = [clock.case("a", slower(1.0)), clock.case("b", slower(1.5))]
    seconds = take_turns(cases, 40)
    assert seconds[-1, 0] > 3.0 * seconds[0, 0]
    assert np.median(seconds[:, 1] / seconds[:, 0]) == pytest.approx(1.5, rel=1e-3)


def test_slow_cases_are_repeated_less_and_short_ones_looped(clock):
    cases = [clock.case("slow", 3.0), clock.case("usual", 0.1), clock.case("short", 2.0**-12)]
    seconds = take_turns(cases, 9, spend=0.45)
    assert np.isfinite(seconds).sum(axis=0).tolist() == [1, 5, 9]
    assert seconds[0] == pytest.approx([3.0, 0.1, 2.0**-12])
    # Once to find that 5 make a sample of a millisecond, then nine samples.
    assert clock.log.count("short") == 1 + 9 * 5
