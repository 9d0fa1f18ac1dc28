"""Taking turns: order, pairing and medians, on clocks that are made up."""

import numpy as np
import pytest

from damper.verification.cost.paired import Spread, spread, take_turns


class Clock:
    """A clock that moves only when told to."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def test_each_case_is_timed_by_itself_once_a_repeat_forwards_then_backwards():
    clock = Clock()
    order = []

    def case(name, seconds):
        def run():
            order.append(name)
            clock.now += seconds

        return run

    seconds = take_turns([case("a", 1.0), case("b", 2.0), case("c", 4.0)], 3, clock)
    assert order == list("abc" + "cba" + "abc")
    assert np.array_equal(seconds, [[1.0, 2.0, 4.0]] * 3)


def test_a_machine_that_slows_down_does_not_change_the_ratio():
    clock = Clock()

    def case(work):
        def run():
            clock.now += work * 1.02**clock.runs
            clock.runs += 1

        return run

    clock.runs = 0
    seconds = take_turns([case(1.0), case(1.5)], 40, clock)
    assert seconds[-1, 0] > 3.0 * seconds[0, 0]
    assert spread(seconds[:, 1] / seconds[:, 0]).median == pytest.approx(1.5, rel=1e-3)


def test_spread_is_median_and_quartiles_and_leaves_missing_values_out():
    assert spread(np.array([9.0, 1.0, np.nan, 5.0, 3.0, 7.0])) == Spread(3.0, 5.0, 7.0)
    assert str(Spread(1.0, 2.0, 3.0)) == "2.000 [1.000, 3.000]"
