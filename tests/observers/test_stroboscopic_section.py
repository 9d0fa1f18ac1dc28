"""Stroboscopic samples against a numerical integration from the event row before each of them."""

import math

import numpy as np
import pytest
from plain_events import Scene
from scenes import SCENES
from scipy.integrate import solve_ivp

from damper import State, simulate

NAMES = ("study", "incomplete", "elastic", "plastic", "slow", "overdamped", "stuck", "free")


def scene(name: str, transient: int, periods: int, **more: object) -> Scene:
    return Scene(SCENES[name], transient, periods, **more)


def integrated(run: Scene, rows: np.ndarray, time: float) -> tuple[float, float, float, float]:
    """x, v, y, u at a time: the linear motion since the last event, by scipy."""
    p = run.parameters
    k = int(np.searchsorted(rows["time"], time)) - 1
    state = run.state or State(0.0, 0.0, 0.0, 0.0)
    t, x, v, y, u = state.time, state.x, state.v, state.y, state.u
    inertia = 1.0
    stuck = p["clearance"] == 0.0
    side = 0
    if k >= 0:
        t, x, v, side = (float(rows[name][k]) for name in ("time", "x", "v", "side"))
        stuck = rows["kind"][k] == 1
        y = x + side * p["clearance"]
        u = v - side * p["restitution"] * float(rows["approach_speed"][k])
    if stuck:
        inertia += p["mass_ratio"]

    def motion(s: float, z: np.ndarray) -> list[float]:
        force = math.sin(p["frequency_ratio"] * s + p["phase"])
        return [z[1], (force - 2.0 * p["damping_ratio"] * z[1] - z[0]) / inertia]

    end = solve_ivp(motion, (t, time), [x, v], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    x, v = (float(value) for value in end)
    return (x, v, x + side * p["clearance"], v) if stuck else (x, v, y + u * (time - t), u)


def samples(run: Scene, at: float = 0.0) -> np.ndarray:
    """x, v, y, u at each sample."""
    found = run.observed("stroboscopic_section", when=at, free_mass=True)
    names = ("displacement", "velocity", "free_displacement", "free_velocity")
    return np.column_stack([found[name] for name in names])


@pytest.mark.parametrize(("transient", "at"), [(0, 0.0), (6, 0.37)])
@pytest.mark.parametrize("name", NAMES)
def test_samples_follow_from_the_event_before(name: str, transient: int, at: float) -> None:
    run = scene(name, transient, 6)
    found = samples(run, at)
    first = 0
    if transient == 0:
        assert (found[0] == 0.0).all()
        first = 1
    for k in range(first, 6):
        expected = integrated(run, run.rows, run.start + (k + at) * run.cycle)
        np.testing.assert_allclose(found[k], expected, rtol=0, atol=2e-10, err_msg=f"sample {k}")


def test_start_time_and_state_move_the_section() -> None:
    """The section is taken whole periods after the start, wherever that lies in the force."""
    run = scene("study", 0, 5, state=State(0.3, -0.1, 0.32, 0.2, time=-11.3))
    found = samples(run)
    np.testing.assert_allclose(found[0], (0.3, -0.1, 0.32, 0.2), rtol=0, atol=1e-14)
    for k in range(1, 5):
        expected = integrated(run, run.rows, run.start + k * run.cycle)
        np.testing.assert_allclose(found[k], expected, rtol=0, atol=2e-10)


@pytest.mark.parametrize("accuracy", [1e-4, 1e-6])
def test_samples_inside_a_closed_tail(accuracy: float) -> None:
    """Moments between a burst's last resolved impact and sticking, of a coarse run.

    The rest of the burst is a formula there; the same burst resolved to 1e-15 is what it stands
    for. The state at the tail's start is the same, as nothing was cut before.
    """
    p = SCENES["chattering"]
    coarse, fine = Scene(p, 0, 1, accuracy=accuracy), Scene(p, 0, 1, accuracy=1e-15)
    stick = int(np.flatnonzero(coarse.rows["kind"] == 1)[0])
    first, last = coarse.rows["time"][stick - 1 : stick + 1]
    assert first < last < coarse.cycle
    length, speed = last - first, coarse.rows["approach_speed"][stick - 1]
    bounces = []
    for part in (0.02, 0.1, 0.2, 0.5, 0.65, 0.95):
        at = float((first + part * length) / coarse.cycle)
        got, true = samples(coarse, at)[0], samples(fine, at)[0]
        off = abs(got - true) / (speed * np.array([length, 1.0, length, 1.0]))
        assert off.max() < 1e-3, part
        bounces.append((p["clearance"] - abs(true[2] - true[0])) / (speed * length))
    assert max(bounces) > 0.03, "the bounces are large against what is allowed"


def test_only_the_last_cycles() -> None:
    run = {**SCENES["study"], "phase": 0.0, "transient": 3, "periods": 6}
    some, every = (
        simulate(**run, observers={"stroboscopic_section": {"last": last}}) for last in (2, 9)
    )
    assert every.displacement.size == 6
    np.testing.assert_array_equal(some.displacement, every.displacement[-2:])
    np.testing.assert_array_equal(some.velocity, every.velocity[-2:])
