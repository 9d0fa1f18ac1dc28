"""The grounded free mass: many digits, another solver, matrix exponentials between the events."""

import math
import random

import numpy as np
import pytest
from event_pairs import KINDS, log_of

from damper import Parameters, State, events
from damper.engine.model import motion
from damper.engine.segment import CAUSE, FLIGHT, IMPACT, MODE, SPEED, TIME, segment_at
from damper.models import start_run


def parameters(values: tuple) -> Parameters:
    """Return the parameters of a scene of the reference."""
    *rigid, stiffness, damping = values
    return Parameters(*rigid, support_stiffness_ratio=stiffness, support_damping_ratio=damping)


# --- between the events


def test_no_swing_into_a_wall_is_missed() -> None:
    """Undamped swings against motions in closed form, sampled thirty times a radian."""
    rng = random.Random(1)
    hits = 0
    for _ in range(60):
        rate, mass_ratio = 10 ** rng.uniform(0.5, 2.5), 0.1
        omega, clearance = rng.choice([0.3, 0.7, 2.5]), 10 ** rng.uniform(-0.5, 0.5)
        stiffness = rate * rate * mass_ratio
        scene = parameters((mass_ratio, 0.0, omega, clearance, 0.5, 0.0, stiffness, 0.0))
        x0, v0 = rng.uniform(-1, 1) * clearance, rng.uniform(-0.3, 0.3)
        swing = rng.uniform(0, 1.2) * clearance
        turn = rng.uniform(0, 2 * math.pi)
        y0, u0 = swing * math.cos(turn), -rate * swing * math.sin(turn)
        if abs(y0 - x0) >= clearance:
            continue
        run = start_run(scene, State(x0, v0, y0, u0), max_events=1)
        log = log_of(run, run.cycle)
        until = run.cycle
        if run.events:
            end = log[log[:, SPEED] > 0][0]
            until = end[0] * run.cycle + end[TIME]
            hits += 1
        t = np.append(np.arange(0.0, until, 1 / (30 * rate)), until)
        gain = 1 / (1 - omega * omega)
        x = x0 * np.cos(t) + (v0 - gain * omega) * np.sin(t) + gain * np.sin(omega * t)
        y = y0 * np.cos(rate * t) + u0 / rate * np.sin(rate * t)
        outside = abs(y - x) - clearance
        assert outside[:-1].max() < 1e-11 * (1 + swing), scene
        if run.events:
            assert abs(outside[-1]) < 1e-10 * (1 + rate), scene
    assert hits > 15


# --- sticking and release


def test_a_release_is_where_the_contact_force_vanishes_however_heavy_the_support_damping() -> None:
    """Damping over the free mass, squared, would have to cancel in the force's slope."""
    p = Parameters(
        *(1e-3, 0.000327676, 1.19794, 0.000574656, 1e-6),
        support_stiffness_ratio=0.0466184,
        support_damping_ratio=0.99,
    )
    found = events(p, State(-2.97, 0.0, -2.97, 2.27), until=60.0)
    releases = found[found["kind"] == KINDS["release"]]
    assert len(releases) >= 5
    for row in releases:
        x, v, side = float(row["x"]), float(row["v"]), int(row["side"])
        spring = p.support_stiffness_ratio * (x + side * p.clearance)
        dashpots = 2.0 * (p.damping_ratio + p.support_damping_ratio) * v
        force = math.sin(p.frequency_ratio * row["time_in_cycle"]) - dashpots - x - spring
        common = force / (1.0 + p.mass_ratio)
        contact = p.mass_ratio * common + 2.0 * p.support_damping_ratio * v + spring
        assert abs(contact) < 1e-12


def test_a_flight_that_is_cut_goes_on_as_it_was_however_far_the_walls_are() -> None:
    """The free mass's place, 1e6 from the middle, rounds by 1e-10; gap and rate must not."""
    p = Parameters(
        *(1e18, 0.00089056, 0.00192579, 1e6, 0.764261, 2.06194),
        support_stiffness_ratio=0.102989,
        support_damping_ratio=1.48324e-06,
    )
    run = start_run(p, State(0.661809, 0.0, 1e6 + 0.661809, -1e-9))
    log = log_of(run, run.cycle)
    cut = [k for k in range(len(log) - 1) if log[k, MODE] == FLIGHT and log[k + 1, CAUSE] < IMPACT]
    assert cut
    for k in cut:
        before, after = segment_at(log[k]), segment_at(log[k + 1])
        _, _, gap, rate = motion(run.model, before, before.duration)
        assert after.gap == pytest.approx(gap, abs=1e-15)
        assert after.gap_rate == pytest.approx(rate, abs=1e-16)
