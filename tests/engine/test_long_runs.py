"""After a million forcing periods everything is as sharp as after ten.

Time is whole periods plus a local time. Held as one double it would be known to 1e-9 after 1e6
periods, and with it phases, durations and sections; every test here asks for four digits more.
"""

import functools
import math
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from reference.fine_step import flight_matrix
from reference.two_impacts import two_impacts
from scipy.linalg import expm

import damper
from damper import Parameters, State
from damper.engine.compiled import COMPILED
from damper.engine.segment import PERIOD
from damper.engine.trajectory import Trajectory
from damper.observers import make_observers
from damper.observers.base import Window
from damper.sweep.runs import run_lanes

#: Plain Python is some 45 times slower, and shows the same.
LONG = 1_000_000 if COMPILED else 10_000
NAMES = ("mass_ratio", "damping_ratio", "frequency_ratio", "clearance", "restitution", "phase")


def lane(scene: tuple, observers: Any, **run: Any) -> dict[str, np.ndarray]:
    """Results of the observers for one lane."""
    values = dict(zip(NAMES, scene, strict=False))
    arrays, _ = run_lanes([values], observers, max_events=10**9, **run)
    assert arrays["status"][0] == 0
    return {name: array[0] for name, array in arrays.items()}


# --- the stable orbit with two impacts per cycle, in closed form

ORBIT = two_impacts(0.1, 0.1, 1.0, 5.5, 0.5)[0]
#: Where in the period the right-wall impact lies: not at its edge.
IMPACT_TIME = 1.0
SCENE = (0.1, 0.1, 1.0, 5.5, 0.5, ORBIT.forcing_phase - IMPACT_TIME)
PERIOD_LENGTH = 2.0 * math.pi


def start(time: float = IMPACT_TIME) -> State:
    """Just after the right-wall impact, on the orbit."""
    return State(*ORBIT.state, time)


@pytest.mark.parametrize("transient", [10, LONG])
def test_stroboscopic_section_of_the_orbit(transient: int) -> None:
    """A quarter of a period after the right-wall impact the flight has a closed form."""
    found = lane(
        SCENE,
        {"stroboscopic_section": {"at": 0.25, "free_mass": True}},
        transient=transient,
        periods=50,
        state=start(),
    )
    z0 = [*ORBIT.state, math.sin(ORBIT.forcing_phase), math.cos(ORBIT.forcing_phase)]
    exact = expm(0.25 * PERIOD_LENGTH * flight_matrix(0.1, 1.0)) @ z0
    names = ("displacement", "velocity", "free_displacement", "free_velocity")
    for name, value in zip(names, exact, strict=False):
        assert np.abs(found[name] - value).max() < 1e-13, name


@pytest.mark.parametrize("transient", [10, LONG])
def test_impact_section_and_bursts_of_the_orbit(transient: int) -> None:
    """The record starts a quarter of a period after the right-wall impact."""
    half = 0.5 * PERIOD_LENGTH
    z0 = [*ORBIT.state, math.sin(ORBIT.forcing_phase), math.cos(ORBIT.forcing_phase)]
    later = expm(0.5 * half * flight_matrix(0.1, 1.0)) @ z0
    found = lane(
        SCENE,
        {"impact_section": {"samples": 40}, "bursts": {"records": 40}, "impacts": {}},
        transient=transient,
        periods=50,
        state=State(*later[:4], IMPACT_TIME + 0.5 * half),
    )
    assert np.abs(found["displacement"] - ORBIT.x0).max() < 1e-13
    assert np.abs(found["velocity"] - ORBIT.velocity_after).max() < 1e-13
    assert found["impacts_per_period"] == 2.0
    assert abs(found["mean_approach_speed"] - ORBIT.approach_speed) < 1e-13
    # Each impact is a burst of its own, from the left wall on.
    k = np.arange(40)
    assert np.array_equal(found["burst_wall"], np.where(k % 2, 1.0, -1.0))
    assert np.array_equal(found["burst_onset_period"], k // 2)
    onset = np.where(k % 2, 1.5, 0.5) * half
    assert np.abs(found["burst_onset_time_in_period"] - onset).max() < 1e-13
    assert np.array_equal(found["burst_duration"], np.zeros(40))


@pytest.mark.parametrize("periods", [10, 2**20])
def test_events_of_the_orbit(periods: int) -> None:
    late = periods * PERIOD_LENGTH + IMPACT_TIME  # rounded: that local time is the exact one
    whole, rest = Trajectory(Parameters(*SCENE)).whole_periods(late)
    assert whole == periods
    scene = (*SCENE[:5], ORBIT.forcing_phase - rest)
    found = damper.events(Parameters(*scene), start(late), until=late + 20.75 * PERIOD_LENGTH)
    k = np.arange(1, 42)
    local = rest + 0.5 * PERIOD_LENGTH * (k % 2)
    assert len(found) == 41
    assert np.array_equal(found["period"], periods + k // 2)
    assert np.abs(found["time_in_period"] - local).max() < 1e-13
    assert np.abs(found["x"] - np.where(k % 2, -1, 1) * ORBIT.x0).max() < 1e-13


# --- a start many periods later changes nothing but the count of the periods

SHIFTED = {
    "orbit": (SCENE, start()),
    "chatter": ((0.1, 0.05, 0.2, 0.25, 0.6, 0.4), State(0.1, -0.2, 0.15, 0.3, 2.0)),
    "complete bursts": ((0.1, 0.05, 0.2, 0.25, 0.3), State(0.0, 0.0, 0.0, 0.0)),
    "fast force": ((0.1, 0.02, 7.0, 0.05, 0.6), State(0.0, 0.1, 0.0, 0.3, -0.3)),
    "period of eight": ((0.3, 0.0, math.pi / 4.0, 0.8, 0.9, -2.0), State(1.0, 0.3, 0.4, -0.8)),
}


@pytest.mark.parametrize("name", SHIFTED)
@pytest.mark.parametrize("periods", [1_000_000, 2**20, -1_000_000])
def test_events_a_million_periods_later_are_the_same_bits(name: str, periods: int) -> None:
    scene, state = SHIFTED[name]
    p = Parameters(*scene)
    late = periods * p.period + state.time
    # The same local time as that of the late start, to the last bit.
    whole, rest = Trajectory(p).whole_periods(late)
    if name == "period of eight":
        assert (whole, rest) == (periods, 0.0)
    here = damper.events(p, State(state.x, state.v, state.y, state.u, rest), until=rest + 150.0)
    there = damper.events(p, State(state.x, state.v, state.y, state.u, late), until=late + 150.0)
    # `until` is rounded, so one of them may hold one more.
    count = min(len(here), len(there))
    assert count > 10
    assert max(len(here), len(there)) <= count + 1
    here, there = here[:count], there[:count]
    for field in ("kind", "side", "approach_speed", "x", "v", "time_in_period"):
        assert np.array_equal(here[field], there[field]), field
    assert np.array_equal(here["period"] + int(whole), there["period"])


@pytest.mark.parametrize("name", SHIFTED)
@pytest.mark.parametrize("periods", [0, -3, 2**40])
def test_time_is_the_sum_of_whole_periods_and_the_rest(name: str, periods: int) -> None:
    scene, state = SHIFTED[name]
    p = Parameters(*scene)
    late = periods * p.period + state.time
    state = State(state.x, state.v, state.y, state.u, late)
    for limit in range(1, 40):
        found = damper.events(p, state, until=late + 1000.0, max_events=limit)
        assert found["kind"][-1] == 3
        assert found["period"].dtype == np.dtype("i8")
        assert (found["time_in_period"] >= 0.0).all()
        assert (found["time_in_period"] < p.period).all()
        total = found["period"] * p.period + found["time_in_period"]
        assert np.array_equal(found["time"], total)


def test_the_stopped_row_counts_its_periods() -> None:
    """It lies where the next event would, also where that is many periods after the last one."""
    for name in ("orbit", "fast force", "chatter"):
        scene, state = SHIFTED[name]
        p = Parameters(*scene)
        late = State(state.x, state.v, state.y, state.u, state.time + 2**40 * p.period)
        whole = damper.events(p, late, until=late.time + 60.0 * p.period, max_events=40)
        for limit in range(1, len(whole) - 1):
            found = damper.events(p, late, until=late.time + 60.0 * p.period, max_events=limit)
            last, following = found[-1], whole[limit]
            assert last["kind"] == 3
            turns = int(following["period"] - last["period"])
            apart = turns * p.period + (following["time_in_period"] - last["time_in_period"])
            assert abs(apart) < 1e-13


# --- undamped free flight against 50 digits


def free_flight(damping: float, force: float, state: State, time: mpf) -> tuple[mpf, mpf]:
    """x and v at `time` from `state` at time 0, forced by sin(force t)."""
    gain = 1 / mp.mpc(1 - force**2, 2 * damping * force)
    own = mp.sqrt(1 - mpf(damping) ** 2)
    x0 = state.x - mp.im(gain)
    v0 = state.v - force * mp.re(gain)
    decay = mp.exp(-damping * time)
    c, s = decay * mp.cos(own * time), decay * mp.sin(own * time) / own
    steady = gain * mp.expj(force * time)
    x = x0 * (c + damping * s) + v0 * s + mp.im(steady)
    v = v0 * (c - damping * s) - x0 * s + force * mp.re(steady)
    return x, v


#: Error after n periods, relative to the largest displacement: a random walk of roundings.
DRIFT = 1e-14


REST, SWINGING = State(0, 0, 0, 0), State(0.3, -0.5, 0, 0)


@pytest.mark.parametrize(
    ("damping", "force", "state"),
    [
        (0.0, 0.37, REST),
        (0.0, 1.3, SWINGING),
        (0.0, 5.3, SWINGING),
        (0.0, 1.0, REST),
        (1e-9, 1.0, SWINGING),
        (1e-9, 1.3, REST),
        (1e-3, 1.0, REST),
    ],
)
def test_free_flight_against_fifty_digits(damping: float, force: float, state: State) -> None:
    """The force repeats with the double nearest 2 pi / omega; so does that of the reference."""
    scene = (0.1, damping, force, 1e9, 0.5)
    period = Parameters(*scene).period
    for periods in (10, 1000, LONG):
        found = lane(scene, ["stroboscopic_section"], transient=periods, periods=1, state=state)
        with mp.workdps(50):
            time = periods * mpf(period)
            x, v = free_flight(damping, 2 * mp.pi / mpf(period), state, time)
            size = max(1, abs(x), abs(v))
            error = max(abs(found["displacement"][0] - x), abs(found["velocity"][0] - v)) / size
        # Damping forgets what is older than its time constant.
        kept = min(periods, 3.0 / (damping * period)) if damping else periods
        assert error < DRIFT * math.sqrt(10 + kept), periods


# --- chatter that repeats every period

#: Two complete bursts per period (model section 7), truly periodic.
PERIODIC = (0.1, 0.05, 0.2, 0.25, 0.3)
RECORDS = {"stroboscopic_section": {"free_mass": True}, "bursts": {"records": 20}}


@functools.cache
def periodic(transient: int, time: float = 0.0) -> dict[str, np.ndarray]:
    """Steady state after some periods."""
    state = State(0.0, 0.0, 0.0, 0.0, time)
    return lane(PERIODIC, RECORDS, transient=transient, periods=50, state=state)


def test_periodic_chatter_spreads_no_more_after_very_many_periods() -> None:
    early, late = periodic(1000), periodic(LONG // 10)
    for name in ("displacement", "velocity", "free_displacement", "free_velocity"):
        for found in (early, late):
            assert np.ptp(found[name]) < 2e-14
        assert np.abs(late[name] - early[name]).max() < 2e-14


def test_burst_records_after_very_many_periods() -> None:
    early, late = periodic(1000), periodic(LONG // 10)
    assert late["complete_fraction"] == 1.0
    assert late["burst_duration"][0] == pytest.approx(2.86397875, abs=1e-7)
    for name in (name for name in early if name.startswith("burst_")):
        assert np.abs(late[name] - early[name]).max() < 1e-13, name


def test_burst_records_from_a_start_a_million_periods_late() -> None:
    p = Parameters(*PERIODIC)
    late = 1_000_000 * p.period
    _, rest = Trajectory(p).whole_periods(late)
    here, there = periodic(100, rest), periodic(100, late)
    for name, array in here.items():
        assert np.array_equal(array, there[name]), name


def test_late_bursts_of_a_long_record_are_as_sharp_as_the_first() -> None:
    """Twenty thousand periods in one record: only float times since its start may blur."""
    count = 20_000 if COMPILED else 1000
    found = lane(PERIODIC, {"bursts": {"records": 2 * count}}, transient=100, periods=count)
    periods = found["burst_onset_period"]
    assert np.array_equal(periods[:-4:2], np.arange(periods[0], periods[0] + count - 2))
    for name in ("burst_onset_time_in_period", "burst_duration", "burst_sticking_time"):
        for wall in (0, 1):
            assert np.ptp(found[name][wall:-4:2]) < 1e-13, name
    total = periods * Parameters(*PERIODIC).period + found["burst_onset_time_in_period"]
    seen = np.isfinite(total)
    assert np.array_equal(found["burst_onset"][seen], total[seen])


# --- observers on a log that lies many periods later

LOGGED = {
    "complete": ((0.1, 0.05, 0.2, 0.25, 0.3), 40),
    "incomplete": ((0.1, 0.02, 1.3, 0.05, 0.9), 40),
    "long bursts": ((0.2, 0.01, 0.2, 0.03, 0.8), 40),
    "many periods apart": ((0.1, 0.02, 40.0, 0.001, 0.8), 400),
}
OBSERVED = {
    "stroboscopic_section": {"at": 0.3, "free_mass": True},
    "impact_section": {"samples": 30, "free_mass": True},
    "impacts": {},
    "bursts": {"compare_thresholds": [0.1], "records": 60},
    "accumulation": {"bursts": 60},
}


def observe(
    name: str, trajectory: Trajectory, log: np.ndarray, window: Window
) -> dict[str, np.ndarray]:
    """Give a log to one observer."""
    (observer,) = make_observers({name: OBSERVED[name]})
    observer.allocate(1, window.length)
    observer.begin(0, trajectory, window)
    observer.observe(log)
    observer.finish(True)
    return {variable: array[0] for variable, array in observer.arrays.items()}


def logged(name: str) -> tuple[Trajectory, np.ndarray, int]:
    """A run and its log."""
    scene, periods = LOGGED[name]
    trajectory = Trajectory(Parameters(*scene), State(0.0, 0.3, 0.0, 0.4))
    log = np.concatenate([piece.copy() for piece in trajectory.segments(periods)])
    return trajectory, log, periods


@pytest.mark.parametrize("shift", [1_000_000, 2**45, -1_000_000])
@pytest.mark.parametrize("part", [0.0, 0.37])
@pytest.mark.parametrize("name", OBSERVED)
@pytest.mark.parametrize("run", LOGGED)
def test_observers_see_no_difference_in_a_late_log(
    run: str, name: str, part: float, shift: int
) -> None:
    """Log and record moved by whole periods: the same bits, whatever the record's phase."""
    trajectory, log, periods = logged(run)
    window = Window(2.0, part * trajectory.period, periods - 4)
    later = log.copy()
    later[:, PERIOD] += shift
    here = observe(name, trajectory, log, window)
    there = observe(name, trajectory, later, window._replace(period=2.0 + shift))
    assert np.isfinite(next(iter(here.values()))).all()
    for variable, array in here.items():
        np.testing.assert_array_equal(array, there[variable], variable)


@pytest.mark.parametrize("shift", [1_000_000, 2**45])
@pytest.mark.parametrize("part", [0.0, 0.37])
@pytest.mark.parametrize("run", LOGGED)
def test_bursts_far_into_a_record(run: str, part: float, shift: int) -> None:
    """The record begins `shift` periods before the same log: only the times since then blur."""
    trajectory, log, periods = logged(run)
    window = Window(0.0, part * trajectory.period, shift + periods)
    log = log[log[:, PERIOD] >= 2]
    later = log.copy()
    later[:, PERIOD] += shift
    here = observe("bursts", trajectory, log, window)
    there = observe("bursts", trajectory, later, window)
    assert np.isfinite(here["burst_onset"]).sum() > 20
    for name in (name for name in here if name.startswith("burst_")):
        if name in ("burst_onset", "burst_accumulation_time"):
            blur = 2.0 * np.spacing(shift * trajectory.period)
            moved = there[name] - shift * trajectory.period
            np.testing.assert_allclose(moved, here[name], rtol=0.0, atol=blur)
        elif name == "burst_onset_period":
            np.testing.assert_array_equal(there[name], here[name] + shift)
        else:
            np.testing.assert_array_equal(there[name], here[name], name)


def test_onset_is_split_at_whole_periods_of_the_record() -> None:
    """Not at those of the run: the record may begin at any phase."""
    trajectory, log, periods = logged("complete")
    length = trajectory.period
    bits = set()
    for part in np.linspace(0.0, 0.99, 34):
        window = Window(3.0, part * length, periods - 5)
        found = observe("bursts", trajectory, log, window)
        whole, rest = found["burst_onset_period"], found["burst_onset_time_in_period"]
        seen = np.isfinite(whole)
        assert seen.sum() > 20
        assert ((rest[seen] >= 0.0) & (rest[seen] < length)).all()
        assert (whole[seen] >= 0).all()
        assert np.array_equal(found["burst_onset"][seen], whole[seen] * length + rest[seen])
        bits.add(int(whole[0]))
    assert bits == {0}
