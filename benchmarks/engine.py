"""Time per impact of the engine, its errors, and scipy's DOP853 with events beside it.

    python benchmarks/engine.py [--runs 1000] [--periods 200] [--structures]

Everything runs in one process, on one core, and the ratios printed come from this one run. Errors
are against 40 digits (`damper.verification.reference`), over the first impacts of
the scene (later ones differ by chaos, not by error). Nothing here is a test: machines differ and
are shared.
"""

import argparse
import os
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp

import damper
from damper.engine.compiled import COMPILED, compile_at_once
from damper.engine.segment import COLUMNS
from damper.engine.trajectory import LOG_ROWS
from damper.models import start_run
from damper.verification import reference
from damper.verification.timing import machine, machine_text

SCENES = {
    "generic": damper.Parameters(0.1, 0.05, 0.8, 1.0, 0.6),
    "chattering": damper.Parameters(0.1, 0.05, 0.2, 0.25, 0.3),
}
#: Forces beside one harmonic; of the record a sample, between walls too far to be met, is timed.
FORCES = {
    "one harmonic": damper.Harmonic(),
    "five harmonics": damper.Harmonics((1, 2, 3, 4, 5), (1.0, 0.3, 0.2, 0.1, 0.1)),
    "unbalance": damper.Unbalance(),
    "base, its own frame": damper.Base("base"),
    "noise, 196 samples a cycle": damper.Noise(1, 0.04, 1600.0, (0.5, 1.5)),
}
#: Numbers of free masses.
COUNTS = (2, 3, 8)
#: Targets of the project in microseconds per impact, numba, one core.
TARGETS = {"generic": 0.2, "chattering": 0.15}
#: The reference solution is compared over this many impacts.
COMPARED = 15
#: DOP853 is given up after this long.
PATIENCE = 20.0


def main() -> None:
    """Print the comparison."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--runs", type=int, default=1000)
    arguments.add_argument("--periods", type=int, default=200)
    arguments.add_argument("--structures", action="store_true", help="time these alone")
    arguments.add_argument("--plain", action="store_true", help=argparse.SUPPRESS)
    given = arguments.parse_args()
    if given.plain:
        for name, p in SCENES.items():
            print(name, engine_time(p, 1, 20)[0])
        return
    compile_at_once()
    if given.structures:
        engine_time(SCENES["generic"], 1, 2)  # compile
        times_on_structures(given.runs, given.periods)
        return
    print(f"machine: {machine_text(machine())}")
    print(
        f"{given.runs} runs (clearance +-2 %) of {given.periods} periods each; times in us/impact"
    )
    plain = plain_times() if COMPILED else {}
    for name, p in SCENES.items():
        engine_time(p, 1, 2)  # compile
        bare, evaluations = engine_time(p, given.runs, given.periods)
        logged, _ = engine_time(p, given.runs, given.periods, keep=True)
        error, compared = engine_error(p)
        slow, outcome, slow_error = dop853(p, given.periods)
        print(f"\n{name}: {given_values(p)}")
        print(f"  engine, bare            {bare:10.3f}   target {TARGETS[name]:g}")
        print(f"  engine, with log        {logged:10.3f}   x {logged / bare:.2f}")
        if plain:
            print(f"  engine, plain Python    {plain[name]:10.3f}   x {plain[name] / bare:.0f}")
        print(f"  scipy DOP853 + events   {slow:10.3f}   x {slow / bare:.0f}   ({outcome})")
        print(f"  evaluations per impact  {evaluations:10.2f}")
        print(
            f"  largest error of the first {compared} impact times: engine {error:.1e}, "
            f"DOP853 {slow_error:.1e}"
        )

    times_of_forces(given.runs, given.periods)
    times_of_equal_masses(given.runs, given.periods)
    times_on_structures(given.runs, given.periods)


def times_on_structures(runs: int, periods: int) -> None:
    """Print the time per event of one free mass on structures, over that of the generic scene."""
    scene = SCENES["generic"]
    print("\ngeneric, at the top of a building or at the tip of a cantilever; times in us/event")
    for name, modes in (("building", building), ("cantilever", cantilever)):
        for count in (1, 3, 10):
            frequencies, shapes = modes(count)
            p = damper.SIParameters(
                structure=damper.Structure.from_modes(
                    frequencies / (2.0 * np.pi), scene.damping_ratio, {"a": shapes, "force": shapes}
                ),
                force_amplitude=1.0,
                forcing_frequency=scene.frequency_ratio,
                masses=[
                    {
                        "free_mass": scene.mass_ratio,
                        "gap": 2.0 * scene.clearance,
                        "restitution": scene.restitution,
                    }
                ],
            ).dimensionless
            engine_time(p, 1, 2)  # compile
            # In turns with the scene: a shared machine is now fast, now slow.
            one = engine_time(scene, runs, periods)[0]
            spent, evaluations = engine_time(p, max(1, runs // 20), periods)
            ratio = f"x {spent / one:.1f}   {evaluations:.2f} evaluations per event"
            print(f"  {name:10} {count:2} modes {spent:8.3f}   {ratio}")


def building(storeys: int) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies over the first one of equal storeys, and modes at the top; modal masses of 1."""
    angle = (2.0 * np.arange(1, storeys + 1) - 1.0) * np.pi / (2 * storeys + 1)
    shapes = np.sin(np.outer(angle, np.arange(1, storeys + 1)))
    top = shapes[:, -1] / np.linalg.norm(shapes, axis=1)
    frequencies = np.sin(0.5 * angle)
    return frequencies / frequencies[0], np.abs(top / top[0])


def cantilever(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies over the first one of a uniform beam, and modes at its tip."""
    waves = (np.arange(1, count + 1) - 0.5) * np.pi
    waves[:3] = np.array([1.8751040687, 4.6940911330, 7.8547574382])[:count]
    return (waves / waves[0]) ** 2, np.ones(count)


def times_of_forces(runs: int, periods: int) -> None:
    """Print the time per event of the generic scene under each force, and per sample."""
    scene, harmonic = SCENES["generic"], 0.0
    print("\ngeneric, under other forces; times in us/event")
    for name, force in FORCES.items():
        p = replace(scene, forcing=force)
        engine_time(p, 1, 2)  # compile
        spent, evaluations = engine_time(p, runs, periods)
        harmonic = harmonic or spent
        ratio = f"x {spent / harmonic:.2f}"
        print(f"  {name:30} {spent:8.3f}   {ratio}   {evaluations:.2f} evaluations per event")
    run = start_run(replace(scene, clearance=1e6, forcing=force))
    started = time.perf_counter()
    run.skip(periods)
    samples = run.evaluations
    print(
        f"  a sample of it, in free flight {1e6 * (time.perf_counter() - started) / samples:7.3f}"
    )


def times_of_equal_masses(runs: int, periods: int) -> None:
    """Print the time per event of both scenes with the free mass divided into equal masses."""
    for name, scene in SCENES.items():
        print(f"\n{name}, divided free mass; times in us/event")
        one = engine_time(scene, runs, periods)[0]
        for count in COUNTS:
            p = replace(scene, masses=damper.equal_masses(count, clearance_spread=0.2))
            engine_time(p, 1, 2)  # compile
            spent, evaluations = engine_time(p, runs // count, periods)
            ratio = f"x {spent / one:.1f}   {evaluations:.2f} evaluations per event"
            print(f"  {count:2} masses {spent:8.3f}   {ratio}")


def given_values(p: damper.Parameters) -> str:
    """List the parameters that are not their defaults."""
    values = ((q.name, getattr(p, q.name), q.default) for q in p.quantities)
    return ", ".join(f"{name} {value:g}" for name, value, default in values if value != default)


def engine_time(
    p: damper.Parameters, runs: int, periods: int, keep: bool = False
) -> tuple[float, float]:
    """Microseconds and evaluations per impact over many runs of slightly different clearance."""
    buffer = np.empty((LOG_ROWS, COLUMNS))
    trajectories = []
    for factor in np.linspace(0.98, 1.02, runs):
        if p.model == "structure":
            each = tuple(replace(one, clearance=one.clearance * factor) for one in p.each)
            trajectories.append(start_run(replace(p, each=each)))
        else:
            trajectories.append(start_run(replace(p, clearance=p.clearance * factor)))
    # Of the processor: a shared machine has other work, too.
    started = time.process_time()
    for trajectory in trajectories:
        if keep:
            for _ in trajectory.segments(periods, 0.0, buffer):
                pass
        else:
            trajectory.skip(periods)
    spent = time.process_time() - started
    # Events are impacts, sticks and releases; sticks and releases are few.
    events = sum(trajectory.events for trajectory in trajectories)
    evaluations = sum(trajectory.evaluations for trajectory in trajectories)
    return 1e6 * spent / events, evaluations / events


def plain_times() -> dict[str, float]:
    """Measure the same loop without numba, in a process of its own."""
    done = subprocess.run(
        [sys.executable, __file__, "--plain"],
        env=os.environ | {"DAMPER_COMPILE": "0"},
        capture_output=True,
        text=True,
        check=True,
    )
    return {name: float(value) for name, value in map(str.split, done.stdout.splitlines())}


def reference_impacts(p: damper.Parameters) -> list[float]:
    """First impact times to 40 digits, as many as were resolved one by one."""
    found = reference.exact_run(p.given, until=4 * p.cycle, digits=40).events
    return [event.time for event in found if event.kind == "impact"][:COMPARED]


def engine_error(p: damper.Parameters) -> tuple[float, int]:
    """Largest error of the first impact times, up to the first burst that the engine closes."""
    exact = reference_impacts(p)
    rows = damper.events(p, until=20 * p.cycle)
    first = int(np.argmax(rows["kind"] != 0)) if (rows["kind"] != 0).any() else len(rows)
    mine = rows["time"][: min(first, len(exact))]
    return max(abs(float(a - b)) for a, b in zip(mine, exact, strict=False)), len(mine)


def dop853(p: damper.Parameters, periods: int) -> tuple[float, str, float]:
    """The usual way: integrate to the next event, apply the impact law, start again."""
    mu, zeta, omega, d, r = (
        p.mass_ratio,
        p.damping_ratio,
        p.frequency_ratio,
        p.clearance,
        p.restitution,
    )

    def motion(t: float, s: np.ndarray) -> list[float]:
        return [s[1], np.sin(omega * t) - 2 * zeta * s[1] - s[0], s[3], 0.0]

    def right(t: float, s: np.ndarray) -> float:
        return d - (s[2] - s[0])

    def left(t: float, s: np.ndarray) -> float:
        return d + (s[2] - s[0])

    for wall in (right, left):
        wall.terminal, wall.direction = True, -1

    now, state, times = 0.0, np.zeros(4), []
    outcome = "finished"
    started = time.perf_counter()
    end = min(periods, 40) * p.cycle
    while now < end:
        done = solve_ivp(
            motion, (now, end), state, "DOP853", events=(right, left), rtol=1e-10, atol=1e-10
        )
        if done.status != 1:
            break
        now, state = done.t[-1], done.y[:, -1].copy()
        relative = state[3] - state[1]
        shared = state[1] + mu * state[3]
        state[1] = (shared + mu * r * relative) / (1 + mu)
        state[3] = (shared - r * relative) / (1 + mu)
        if times and now - times[-1] <= 1e-13 * now:
            outcome = f"stalls on a burst at t = {now:.6g}"
            break
        times.append(now)
        if abs(state[2] - state[0]) > d + 1e-6:
            outcome = f"leaves the box at t = {now:.6g}"
            break
        if time.perf_counter() - started > PATIENCE:
            outcome = f"given up after {PATIENCE:g} s at t = {now:.6g}"
            break
    spent = time.perf_counter() - started
    exact = reference_impacts(p)
    error = max(abs(float(a - b)) for a, b in zip(times, exact, strict=False))
    return 1e6 * spent / len(times), f"{len(times)} impacts, {outcome}", error


if __name__ == "__main__":
    main()
