"""After a million forcing periods everything is as sharp as after ten.

Time is whole periods plus a local time. Held as one double it would be known to 1e-9 after 1e6
periods, and with it phases, durations and sections; every test here asks for four digits more.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf
from scipy.linalg import expm

import damper
from damper import Parameters, State, events
from damper.engine.compiled import COMPILED
from damper.engine.loop import FINISHED
from damper.engine.search import HORIZON
from damper.engine.segment import CAUSE, PERIODS, STICK, TIME
from damper.engine.trajectory import Trajectory
from damper.models import start_run
from damper.theory.two_impacts import orbits

pytestmark = pytest.mark.compiled
#: Plain Python is some 45 times slower, and shows the same.
LONG = 1_000_000 if COMPILED else 10_000
ORBIT = orbits(Parameters(0.1, 0.1, 1.0, 5.5, 0.5))[0]
#: Complete chatter sequences on both walls; what begins there; whole turns of 2 pi.
SCENES = {
    "orbit": ((0.1, 0.1, 1.0, 5.5, 0.5), ORBIT.start),
    "complete": ((0.1, 0.05, 0.2, 0.25, 0.3), State(0.0, 0.0, 0.0, 0.0)),
    "fast force": ((0.1, 0.02, 7.0, 0.05, 0.6), State(0.0, 0.1, 0.0, 0.3, -0.3)),
}


def scene(name: str) -> tuple[Parameters, State]:
    numbers, state = SCENES[name]
    return Parameters(*numbers), state


def ends(run: Trajectory, periods: float, time: float, count: int) -> np.ndarray:
    """States at a local time of `count` periods, one after the other."""
    found = []
    for k in range(count):
        run.skip(periods + k, time)
        end = run.state_at(periods + k, time)
        found.append([end.x, end.v, end.y, end.u])
    assert run.status == FINISHED
    return np.array(found)


@pytest.mark.parametrize("transient", [10, LONG])
def test_stable_orbit_with_two_impacts_per_cycle(transient: int) -> None:
    """A quarter of a period after the right-wall impact the flight has a closed form."""
    p, state = scene("orbit")
    tau, phase = 0.25 * p.cycle, ORBIT.forcing_phase
    found = ends(start_run(p, state, max_events=10**9), transient, state.time + tau, 20)
    primary = np.array([[0, 1, 0, 0], [-1, -0.2, 1, 0], [0, 0, 0, 1], [0, 0, -1, 0]])
    x, v, *_ = expm(tau * primary) @ [state.x, state.v, math.sin(phase), math.cos(phase)]
    exact = [x, v, state.y + tau * state.u, state.u]
    assert np.abs(found - exact).max() < 1e-13


def test_the_stopped_row_counts_its_periods() -> None:
    """It lies where the next event would, also where that is many periods after the last one."""
    p, state = scene("fast force")
    late = State(state.x, state.v, state.y, state.u, state.time + 2**40 * p.cycle)
    until = late.time + 60.0 * p.cycle
    whole = damper.events(p, late, until=until, max_events=40)
    for limit in range(1, len(whole) - 1, 3):
        last = damper.events(p, late, until=until, max_events=limit)[-1]
        following = whole[limit]
        assert last["kind"] == 3
        turns = int(following["cycle"] - last["cycle"])
        apart = turns * p.cycle + (following["time_in_cycle"] - last["time_in_cycle"])
        assert abs(apart) < 1e-13


# --- free flight against 50 digits


def free_flight(damping: float, force: mpf, state: State, time: mpf) -> tuple[mpf, mpf]:
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


#: Error after n segments, relative to the largest displacement: a random walk of roundings.
DRIFT = 1e-14
#: Error of a rounded natural frequency, which the damping ratio makes irrational.
SHIFT = 2e-16
#: Units of time of the longest flight.
LONGEST = 2.0 * math.pi * LONG
REST, SWINGING = State(0, 0, 0, 0), State(0.3, -0.5, 0, 0)


@settings(max_examples=12)
@given(
    damping=st.one_of(st.just(0.0), st.floats(-12, -0.5).map(lambda k: 10.0**k)),
    force=st.floats(-3, 1).map(lambda k: 10.0**k).filter(lambda w: abs(w - 1) > 0.01),
    clearance=st.sampled_from([1e9, 1000.0]),
    state=st.sampled_from([REST, SWINGING]),
)
@example(damping=0.0, force=1.6, clearance=1e9, state=SWINGING)
@example(damping=0.0, force=2.0, clearance=1000.0, state=REST)
@example(damping=0.0, force=1.0, clearance=1e9, state=REST)
@example(damping=1e-9, force=1.3, clearance=1e9, state=REST)
@example(damping=1e-3, force=1.0, clearance=1e9, state=SWINGING)
def test_free_flight_against_fifty_digits(
    damping: float, force: float, clearance: float, state: State
) -> None:
    """The force repeats with the period of the run; so does that of the reference."""
    run = start_run(Parameters(0.1, damping, force, clearance, 0.5), state)
    for span in (60.0, 6e3, LONGEST):
        error, time = flown(run, state, damping, span)
        # Damping forgets what is older than its time constant.
        kept = min(time, 3.0 / damping) if damping else time
        bound = DRIFT * math.sqrt(10 + kept / HORIZON)
        assert error < bound + (SHIFT * kept if damping else 0.0), span


def flown(run: Trajectory, state: State, damping: float, span: float) -> tuple[float, float]:
    """Error of a free flight after some whole periods, and how long they are."""
    periods = max(round(span / run.cycle), 1)
    (end,) = ends(run, periods, 0.0, 1)
    with mp.workdps(50):
        time = periods * mpf(run.cycle)
        x, v = free_flight(damping, 2 * mp.pi / mpf(run.cycle), state, time)
        error = max(abs(end[0] - x), abs(end[1] - v)) / max(1, abs(x), abs(v))
    return float(error), float(time)


@pytest.mark.parametrize("turns", [1, 9, 12])
def test_roundoff_adds_up_evenly_at_worst(turns: int) -> None:
    """The force meets each cut in the same phase of the free motion, so all err alike."""
    force = 2.0 * math.pi * turns / HORIZON - (1.0 if turns > 4 else -1.0)
    run = start_run(Parameters(0.1, 0.0, force, 1e9, 0.5), REST)
    error, time = flown(run, REST, 0.0, LONGEST)
    assert error < 1e-17 * time


# --- chatter


def test_periodic_chatter_spreads_no_more_after_very_many_periods() -> None:
    """Two complete sequences per period (model section 7), truly periodic."""
    run = start_run(scene("complete")[0], max_events=10**9)
    early = ends(run, 1000, 0.0, 50)
    late = ends(run, LONG // 10 + 100, 0.0, 50)
    for found in (early, late):
        assert np.ptp(found, axis=0).max() < 2e-14
    assert np.abs(late - early).max() < 2e-14
    # Sticking begins at the same local times, on both walls.
    log = np.concatenate([piece.copy() for piece in run.segments(LONG // 10 + 200)])
    sticks = log[log[:, CAUSE] == STICK]
    assert np.array_equal(np.diff(sticks[::2, PERIODS]), np.ones(len(sticks[::2]) - 1))
    for wall in (0, 1):
        assert np.ptp(sticks[wall::2, TIME]) < 1e-13


SLOW = Parameters(0.1, 0.05, 0.8, 6.0, 0.6)


def steady_state(p: Parameters) -> complex:
    """Amplitude of the primary that no mass touches, times a phase: x is its imaginary part."""
    w = p.frequency_ratio
    return 1.0 / complex(1.0 - w * w, 2.0 * p.damping_ratio * w)


@pytest.mark.parametrize(
    ("count", "walls"),
    [(None, {}), (1, {}), (2, {}), (None, {"contact_stiffness_ratio": 100.0})],
    ids=["one", "listed", "beside one that hits", "compliant walls"],
)
def test_what_nothing_acts_on_stays_as_it_is(count: int | None, walls: dict[str, float]) -> None:
    """A free mass flies on by itself: its velocity keeps each bit, whatever the primary does."""
    masses = [{}, {"clearance": 2.0, "mass_ratio": 0.02}][:count]
    p, y, u = replace(SLOW, masses=masses if count else None, **walls), 0.1, 1e-7
    state = State(0.1, 0.7, (y, 0.0)[:count], (u, 0.0)[:count]) if count else State(0.1, 0.7, y, u)
    run = start_run(p, state)
    cycles = 200 if count == 2 else 3000
    run.skip(cycles)
    (place, *_), (velocity, *_) = run.state_at(cycles).of_each(count or 1)
    assert velocity == u
    assert place == pytest.approx(y + u * cycles * p.cycle, abs=1e-14)


@pytest.mark.parametrize("count", [None, 2], ids=["one", "beside an idle mass"])
def test_a_slow_mass_hits_after_thousands_of_cycles(count: int | None) -> None:
    """At the first instant at which the steady primary reaches it, to the roundoff of that."""
    p = replace(SLOW, masses=[{}, {"mass_ratio": 0.2, "clearance": 50.0}] if count else None)
    amplitude, w = steady_state(p), p.frequency_ratio
    cycles = 2000.3
    u = 0.5 / (cycles * p.cycle)
    y = p.clearance - abs(amplitude) - 0.5
    x, v = amplitude.imag, w * amplitude.real
    state = State(x, v, (y, 0.0), (u, 0.0)) if count else State(x, v, y, u)
    hit = events(p, state, until=(cycles + 20) * p.cycle)[0]
    with mp.workdps(40):
        exact = 1 / mp.mpc(1 - mp.mpf(w) ** 2, 2 * mp.mpf(p.damping_ratio) * mp.mpf(w))

        def gap(t: mp.mpf) -> mp.mpf:
            return mp.mpf(p.clearance) - (mp.mpf(y) + mp.mpf(u) * t - mp.im(exact * mp.expj(w * t)))

        cycle = 2 * mp.pi / mp.mpf(w)
        guess = int(hit["cycle"]) * cycle + mp.mpf(float(hit["time_in_cycle"]))
        time = mp.findroot(gap, guess)
        assert abs(time - guess) < 3e-12
        # Nothing before it: the gap of the cycle before stays open.
        least = min(gap(time - cycle * (1 + mp.mpf(k) / 200)) for k in range(-20, 21))
        assert least > 0


def test_a_gap_beside_a_far_wall_keeps_its_digits() -> None:
    """Where y is a million and the gap small, the gap is not formed anew from y."""
    found = damper.simulate(
        mass_ratio=2.95415587069e-05,
        damping_ratio=1.19620715207,
        frequency_ratio=0.00469527063127,
        clearance=1e6,
        restitution=0.0,
        phase=3.0030479499718985,
        initial_position=1.0,
        initial_relative_velocity=2.2090747402160877,
        observers={"laws": {}},
        transient=0,
        periods=6,
    )
    assert float(found.continuity) < 1e-14
