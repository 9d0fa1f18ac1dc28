"""What runs take, estimated from their settings, and what is refused from Python."""

import math
from typing import Any

import numpy as np
import pytest
from new_process import in_new_process
from scenes import STUDY as POINT

import damper
from damper.observers import OBSERVERS, make_observers
from damper.parameters.forcing import HARMONIC, Forcing, Harmonics, Record
from damper.sweep import estimate
from damper.sweep.runs import run_points


@pytest.mark.parametrize("name", OBSERVERS)
def test_observers_know_how_large_their_arrays_will_be(name: str) -> None:
    settings: dict[str, Any] = {"records": 5, "compare_thresholds": [0.1]}
    (observer,) = make_observers({name: settings if name == "bursts" else {}})
    observer.allocate(3, 7)
    made = sum(array.nbytes for array in observer.arrays.values())
    assert 3 * observer.bytes_per_run(7) == made > 0


def test_runs_that_do_not_go_into_this_machine_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """At the limit they run, a byte beyond it they do not."""
    needed = estimate.Workload({"points": 2}, 0, 1, make_observers(["impacts"])).memory
    run = {"transient": 0, "periods": 1}
    monkeypatch.setattr(estimate, "machine_memory", lambda: needed)
    assert len(run_points([POINT] * 2, ["impacts"], **run)[0]["status"]) == 2
    monkeypatch.setattr(estimate, "machine_memory", lambda: needed - 1)
    message = (
        r"^points: points \(2\): 2 runs in one process take some 250 MB of memory; at most 250 MB"
    )
    with pytest.raises(ValueError, match=message):
        run_points([POINT] * 2, ["impacts"], **run)


def test_events_of_more_periods_than_end_are_refused() -> None:
    """Without impacts no budget would stop them."""
    parameters = damper.Parameters(**{**POINT, "clearance": 1e4})
    late = damper.State(0.0, 0.0, 0.0, 0.0, time=1e15)
    assert len(damper.events(parameters, late, until=1e15 + 10.0)) == 0
    with pytest.raises(ValueError, match=r"^until = 1000000000000.0: ends after 2.07e\+11 cycles"):
        damper.events(parameters, until=1e12)
    most = estimate.MOST_PERIODS * 2.0 * math.pi / 1.3
    with pytest.raises(ValueError, match=r"at most 1000000000$"):
        damper.events(parameters, until=1.000001 * most)


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.25, "0.25 s"), (99.0, "99 s"), (120.0, "2 min"), (6000.0, "1.7 h"), (1e6, "11.6 days")],
)
def test_times_are_in_words(seconds: float, words: str) -> None:
    assert estimate.duration(seconds) == words


@pytest.mark.parametrize(
    ("size", "words"), [(5, "5 B"), (999_600, "1 MB"), (1.6e9, "1.6 GB"), (2.5e16, "25 PB")]
)
def test_amounts_are_in_words(size: float, words: str) -> None:
    assert estimate.amount(size) == words


def test_a_force_takes_time() -> None:
    """Each sample of a record ends a segment; each harmonic is summed at each moment."""

    def seconds(forcing: Forcing) -> float:
        return estimate.Workload({"points": 10}, 0, 100, [], forcing=forcing).run_seconds

    samples = np.arange(100_000.0)
    assert seconds(Record(samples, samples)) - seconds(HARMONIC) > 10 * 100_000 * 2e-7
    assert seconds(Harmonics((1, 2), (1.0, 1.0))) > 1.5 * seconds(HARMONIC)


def test_samples_of_a_record_take_memory() -> None:
    """As measured: 145 bytes for each from its file to the engine, and 8 in each unit of time."""
    samples = np.arange(1_000_000.0)

    def memory(**given: Any) -> int:
        return estimate.Workload({"points": 100}, 0, 100, [], **given).memory

    record = Record(samples, samples)
    assert memory(forcing=record) - memory() > 145_000_000
    assert memory(forcing=record, copies=60) - memory(forcing=record) > 59 * 8_000_000
    # Dampers of one unit of time share them.
    assert record.over(2.0) is record.over(2.0)
    assert np.shares_memory(record.over(2.0).value, record.over(3.0).value)


MANY = """
import tracemalloc
from damper.sweep.points import read_point

def taken(point, length):
    read_point(point | {length: 1.0, "masses": [{}, {}]})
    tracemalloc.start()
    points = [read_point(point | {length: 0.1 + 1e-4 * k}) for k in range(1000)]
    assert {point.parameters.features for point in points} == {("rigid",)}
    memory = tracemalloc.get_traced_memory()[0] / len(points)
    tracemalloc.stop()
    return memory

ratios = dict(mass_ratio=0.1, damping_ratio=0.05, frequency_ratio=0.8)
machine = dict(primary_mass=2.0, damping=4.0, stiffness=200.0, free_mass=0.2)
machine |= dict(force_amplitude=10.0, forcing_frequency=11.0)
made = [taken(ratios | {"restitution": 0.5}, "clearance")]
print([*made, taken(machine | {"restitution": 0.5}, "gap")])
"""


def test_a_point_takes_less_than_the_estimate_has_for_a_run() -> None:
    """It did not when each damper had names of its own, as where one of another sort came first."""
    scaled, si = in_new_process(MANY)
    assert scaled < 0.5 * estimate._RUN_BYTES
    assert si < 0.75 * estimate._RUN_BYTES
