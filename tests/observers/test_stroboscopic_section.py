"""Stroboscopic samples against states of a run, and inside a tail against its bounces."""

import numpy as np
import pytest
from plain_events import Scene
from scenes import SCENES

from damper import Parameters, State, simulate, start

NAMES = ("study", "incomplete", "elastic", "plastic", "slow", "overdamped", "stuck", "free")


def samples(run: Scene, at: float = 0.0) -> np.ndarray:
    """x, v, y, u at each sample."""
    found = run.observed("stroboscopic_section", when=at, free_mass=True)
    names = ("displacement", "velocity", "free_displacement", "free_velocity")
    return np.column_stack([found[name] for name in names])


@pytest.mark.parametrize(("transient", "at"), [(0, 0.0), (6, 0.37)])
@pytest.mark.parametrize("name", [*NAMES, "later"])
def test_samples_are_states_of_a_run_that_is_advanced_there(
    name: str, transient: int, at: float
) -> None:
    """Whole periods after the start, wherever that lies in the force."""
    state = State(0.3, -0.1, 0.32, 0.2, time=-11.3) if name == "later" else None
    scene = Scene(SCENES["study" if state else name], transient, 6, state=state)
    run = start(Parameters(**scene.parameters), state)
    for k, sample in enumerate(samples(scene, at)):
        run.advance(scene.start + (k + at) * scene.cycle)
        s = run.state
        np.testing.assert_allclose(sample, (s.x, s.v, s.y, s.u), rtol=0, atol=2e-12)


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
