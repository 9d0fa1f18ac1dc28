"""Every force in every model: laws, another solver, closed forms, identities."""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from cases import thinned
from event_pairs import assert_as_in_digits
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import CASES, GENERIC, MODELS, QUIET, SEVERAL, scene_of
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from damper import Parameters, State, equal_masses, events
from damper.engine.segment import DURATION, SIDE
from damper.models import start_run
from damper.observers.common.laws import broken
from damper.parameters.forcing import Base, Harmonics, NoForce, Record
from damper.sweep.runs import run_points

#: Model of several masses -> forces under which its run takes a few seconds of plain Python.
SHORT = {
    "several": ("five harmonics", "base in the ground's frame", "held record of a force"),
    "several, sliding": ("harmonic", "base in its own frame", "record of a force"),
    "several, grounded": ("unbalance", "record of the base", "harmonic"),
    "several, grounded, sliding": ("two harmonics", "base in the ground's frame", "harmonic"),
}
#: Some of all cases.
OFTEN = [c for k, c in enumerate(CASES) if k % 9 == 1 and c[0] not in SEVERAL]
OFTEN += [(model, force, "") for model, forces in SHORT.items() for force in forces]


@pytest.mark.parametrize(("model", "force", "features"), thinned(CASES, OFTEN.__contains__))
def test_energy_is_kept_and_no_law_is_broken(model: str, force: str, features: str) -> None:
    """To 1e-12 of the turnover, the losses in friction and in supports with it.

    Free motion without losses has none: there of the energy at the start, too.
    """
    observers = {"response": {"friction_loss": True}, "laws": {}}
    periods, free, all_lost = 1 if model in SEVERAL else 2, force == "none", 0.0
    for seed in range(periods):
        values, state = scene_of(model, force, seed, features)
        ask = {"state": State(*state), "transient": 0, "periods": periods, "max_events": 20_000}
        arrays, _ = run_points([values], observers, **ask)
        assert not broken(arrays).any(), seed
        assert arrays["status"] == 0
        found = {name: float(array[0]) for name, array in arrays.items() if array.ndim == 1}
        lost = found["impact_loss"] + found["friction_loss"]
        turnover = abs(found["energy_input"]) + found["dashpot_loss"] + lost
        turnover += 0.5 * (state[0] ** 2 + state[1] ** 2) * free
        assert abs(found["energy_residual"]) < 1e-12 * turnover, seed
        assert lost > 0.0 or free
        all_lost += lost
    assert all_lost > 0.0


# --- another solver, closed forms, identities


def with_scipy(
    values: dict[str, Any], force: Callable[[float], float], share: float, pieces: Sequence[float]
) -> list[tuple[float, float, float]]:
    """Time, x and v of each impact; `pieces` are times between which the force is smooth."""
    mu, zeta, d, r = (
        values[name] for name in ("mass_ratio", "damping_ratio", "clearance", "restitution")
    )

    def rates(t: float, z: np.ndarray) -> list[float]:
        x, v, _, u = z
        f = force(min(max(t, piece[0] + 1e-13), piece[1] - 1e-13))  # at a jump, that of this side
        return [v, f - 2 * zeta * v - x, u, share * f]

    def wall(side: int) -> Callable[[float, np.ndarray], float]:
        def gap(t: float, z: np.ndarray) -> float:
            return d - side * (z[2] - z[0])

        gap.terminal, gap.direction = True, -1
        return gap

    found, z, t = [], np.array([0.2, 0.1, 0.0, 0.9]), 0.0
    for piece in pairwise(pieces):
        while t < piece[1]:
            part = solve_ivp(
                rates,
                (t, piece[1]),
                z,
                "DOP853",
                events=(wall(1), wall(-1)),
                rtol=1e-13,
                atol=1e-14,
            )
            t, z = part.t[-1], part.y[:, -1]
            if part.status == 1:
                change = (1 + r) / (1 + mu) * (z[3] - z[1])
                z[1] += mu * change
                z[3] -= change
                found.append((t, z[0], z[1]))
    return found


TWO = Harmonics((1, 2), (1.0, 0.5), (0.0, 0.3))
SAMPLES = Record([0.3, 2.0, 3.5, 4.0, 7.0], [1.0, 0.0, 2.0, -1.5, 1.0])


@pytest.mark.parametrize(
    ("forcing", "force", "share"),
    [
        (NoForce(), lambda t: 0.0, 0),
        (TWO, lambda t: math.sin(0.8 * t) + 0.5 * math.sin(1.6 * t + 0.3), 0),
        (Base("base"), lambda t: 0.64 * math.sin(0.8 * t), 1),
        (SAMPLES, lambda t: np.interp(t, SAMPLES.time, SAMPLES.value, left=0, right=0), 0),
    ],
    ids=["none", "two harmonics", "base", "record"],
)
def test_impacts_against_scipy(forcing: Any, force: Callable[[float], float], share: float) -> None:
    values = GENERIC | {"clearance": 0.5}
    exact = with_scipy(values, force, share, [0.0, *SAMPLES.time.tolist(), 9.0])
    found = events(Parameters(**values, forcing=forcing), State(0.2, 0.1, 0.0, 0.9), until=9.0)
    assert set(found["kind"]) == {0}
    assert len(found) >= 3
    numbers = np.array(found[["time", "x", "v"]].tolist())
    assert numbers == pytest.approx(np.array(exact), rel=0, abs=2e-10)


@pytest.mark.parametrize("damping", [0.0, 0.3, 1.0, 4.0])
@pytest.mark.parametrize("after", ["zero", "hold"])
def test_record_of_a_straight_line_gives_the_closed_form(damping: float, after: str) -> None:
    """x = f - 2 zeta f' and free motion; after its end the same with f' = 0."""
    times = np.cumsum([0.0, *np.random.default_rng(1).uniform(0.01, 0.5, 40)])
    line = Record(times, 0.7 - 0.2 * times, after=after)
    p = Parameters(1e-6, damping, 0.8, 50.0, 0.5, forcing=line)
    run, end = start_run(p, State(0.4, -0.3, 0.0, 0.0)), times[-1]
    matrix = np.array([[0.0, 1.0], [-1.0, -2.0 * damping]])
    steady = np.array([0.7 + 0.4 * damping, -0.2])
    start = np.array([0.4, -0.3]) - steady
    for t in (0.5 * end, end, end + 3.0):
        x, v = expm(matrix * min(t, end)) @ start + steady + [-0.2 * min(t, end), 0.0]
        if t > end:
            held = np.array([0.7 - 0.2 * end if after == "hold" else 0.0, 0.0])
            x, v = expm(matrix * (t - end)) @ ([x, v] - held) + held
        at = run.whole_periods(t)
        run.skip(*at)
        found = run.state_at(*at)
        assert (found.x, found.v) == pytest.approx((x, v), rel=0, abs=1e-13)


@pytest.mark.parametrize("model", MODELS)
def test_one_term_of_a_sum_is_the_harmonic(model: str) -> None:
    """Byte for byte; and to rounding where a term that is next to nothing follows it."""
    scene = QUIET | MODELS[model] | {"phase": 0.3}
    single = events(Parameters(**scene), until=60.0)
    one = Harmonics((1,), (1.0,))
    assert events(Parameters(**scene, forcing=one), until=60.0).tobytes() == single.tobytes()
    nearly = Harmonics((1, 2), (1.0, 1e-300))
    found = events(Parameters(**scene, forcing=nearly), until=60.0)
    assert len(found) == len(single) > 20
    for name in ("kind", "side", "time", "x", "v", "approach_speed"):
        assert found[name] == pytest.approx(single[name], rel=0, abs=1e-11)


#: A support would be tied to different places.
IN_BOTH_FRAMES = {name: given for name, given in MODELS.items() if "grounded" not in name} | {
    "equal masses that rub": {"friction": 0.05, "masses": equal_masses(3, 0.2)}
}


@pytest.mark.parametrize("model", IN_BOTH_FRAMES)
def test_base_motion_is_the_same_in_both_frames(model: str) -> None:
    """x of the ground less z is x of the base."""
    amplitude, phase = 1.3, 0.4
    scene = QUIET | IN_BOTH_FRAMES[model] | {"phase": phase, "force_amplitude": amplitude}
    omega = scene["frequency_ratio"]

    def base(t: Any) -> tuple[Any, Any]:
        angle = omega * t + phase
        return amplitude * np.sin(angle), amplitude * omega * np.cos(angle)

    z, z_rate = base(0.0)
    starts = State(0.3, 0.1, 0.2, 0.0), State(0.3 - z, 0.1 - z_rate, 0.2 - z, -z_rate)
    ground, own = (
        events(Parameters(**scene, forcing=Base(frame)), start, until=60.0)
        for frame, start in zip(("ground", "base"), starts, strict=True)
    )
    assert len(ground) == len(own) > 20
    z, z_rate = base(ground["time"])
    for name, shift in {
        "kind": 0,
        "side": 0,
        "time": 0,
        "approach_speed": 0,
        "x": z,
        "v": z_rate,
    }.items():
        assert own[name] == pytest.approx(ground[name] - shift, rel=0, abs=1e-10)


@pytest.mark.parametrize("model", ["rigid", "grounded"])
@pytest.mark.parametrize(("start", "end"), [(1.0, 1.0), (-1.0, -1.0), (0.0, 1.0), (0.0, -1.0)])
@pytest.mark.parametrize("of", ["force", "base_acceleration"])
def test_at_rest_on_a_wall_until_a_record_begins(
    model: str, start: float, end: float, of: str
) -> None:
    """It jumps or rises, and throws the free mass off or presses it."""
    forcing = Record([1.0, 3.0], [start, end], of=of)
    values = GENERIC | MODELS[model] | {"clearance": 0.5, "forcing": forcing}
    assert_as_in_digits(values, (0.0, 0.0, 0.5, 0.0), 6.0)


# --- energy


def energy_of(p: Parameters, x: float, v: float, gap: float, rate: float, side: float) -> float:
    """Of both masses, their springs, and a wall that is compressed."""
    y, u = x + side * (p.clearance - gap), v - side * rate
    energy = 0.5 * (x * x + v * v + p.mass_ratio * u * u + p.support_stiffness_ratio * y * y)
    if gap < 0.0:
        energy += 0.5 * p.contact_stiffness_ratio * gap * gap
    return energy


@pytest.mark.parametrize("model", [name for name in MODELS if name != "time_varying"])
@settings(deadline=None, max_examples=15)
@given(seed=st.integers(0, 10**6))
def test_energy_of_free_motion_only_falls(model: str, seed: int) -> None:
    values, state = scene_of(model, "none", seed)
    p = Parameters(**values)
    run = start_run(p, State(*state))
    last = math.inf
    for log in run.segments(*run.whole_periods(15.0)):
        for row in log:
            for part in np.linspace(0.0, 1.0, 9).tolist():
                now = energy_of(p, *run.motion_in(row, part * row[DURATION]), row[SIDE])
                assert now < last + 1e-14 * (1.0 + now)
                last = min(last, now)
