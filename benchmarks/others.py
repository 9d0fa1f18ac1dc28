"""Published and measured numbers beside those of the engine: the tables of docs/others.md.

python benchmarks/others.py [case ...]

`snakemake --cores 1 others` compares them with the document.
"""

import math
import sys
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

import damper
from damper import Parameters, SIParameters, State
from damper.models import start_run
from damper.theory.steady import steady_gain, steady_state
from damper.theory.two_impacts import orbits


class Row(NamedTuple):
    """A number of somebody else's and ours, and why they differ, if they do."""

    what: str
    theirs: float | complex
    ours: float | complex
    verdict: str = ""

    @property
    def off(self) -> float:
        """The difference over theirs."""
        return abs(self.ours - self.theirs) / abs(self.theirs)


def ball(restitution: float, gravity: float, gap: float = 10.0, **law: float) -> Parameters:
    """A ball in a box at rest: a free mass that does not act back; all in m and s."""
    more: dict[str, Any] = {"force_amplitude": 0.0, "forcing": "none", **law}
    return Parameters(0.0, 0.0, 1.0, 0.5 * gap, restitution, gravity=gravity, **more)


def impacts(p: Parameters, height: float, speed: float, count: int) -> np.ndarray:
    """Times of so many impacts of a ball that starts at a height above the lower wall.

    Each flight is a run of its own: a run would close the rest after the first impact.
    """
    times, state = [], State(0.0, 0.0, height - p.clearance, speed)
    for _ in range(count):
        hit = damper.events(p, state, until=state.time + 20.0)[0]
        time, side, x, v, w = (
            float(hit[name]) for name in ("time", "side", "x", "v", "approach_speed")
        )
        times.append(time)
        r = p.restitution * min(1.0, p.yield_speed / w) ** p.yield_exponent
        state = State(x, v, x + side * p.clearance, v - side * r * w, time)
    return np.array(times)


def ball_on_a_floor() -> Iterator[Row]:
    p = ball(0.9, 9.81)
    times = impacts(p, 1.0, 0.0, 41)
    theirs = {1: 0.451523640986, 2: 1.26426619476, 3: 1.995734493157, 41: 8.458818653237}
    for count, time in theirs.items():
        yield Row(f"impact {count}, s", time, float(times[count - 1]))
    end = float(damper.events(p, State(0.0, 0.0, -4.0, 0.0), until=9.0)["time"][-1])
    yield Row("accumulation, s", 8.57894917872889, end)
    rests = damper.events(ball(0.0, 9.81), State(0.0, 0.0, -4.0, 0.0), until=9.0)
    yield Row("e 0: impact, s", 0.4515236409857311, float(rests["time"][0]))
    yield Row("e 0: speed, m/s", 4.429446918070021, float(rests["approach_speed"][0]))


def ball_between_two_plates() -> Iterator[Row]:
    times = impacts(ball(0.8, 10.0, 1.5), 1.0, 10.0, 41)
    theirs = {
        1: 0.0513167019494863,
        2: 0.2283187800528825,
        3: 0.4665486160195453,
        4: 0.7413599657472209,
        6: 2.709075785229291,
        11: 5.060959695903369,
        21: 6.084156627761077,
        41: 6.205818219187,
    }
    for count, time in theirs.items():
        late = "ours: 6.20581821921576 flight by flight in 40 digits" if count == 41 else ""
        yield Row(f"impact {count}, s", time, float(times[count - 1]), late)


def impact_oscillator() -> Iterator[Row]:
    """The oscillator is the primary, the stop a fixed stop: a free mass of infinite mass."""
    theirs = {
        0.36: (0.43378 + 0.49732j, 0.4091),
        0.35805: (0.40333 + 0.52232j, 0.3591),
        0.35429: (0.30715 + 0.58408j, None),
    }
    for amplitude, (multiplier, speed) in theirs.items():
        p = Parameters(math.inf, 0.02, 0.81, 11.0, 0.9, 0.5 * math.pi, force_amplitude=amplitude)
        run = start_run(p, State(0.0, 0.0, -10.0, 0.0))
        run.skip(400.0)
        settled = run.state_at(400.0)
        orbit = damper.periodic_orbit(p, 2, State(settled.x, settled.v, -10.0, 0.0))
        ours = max(orbit.multipliers, key=lambda m: m.imag)
        why = (
            "both, within the digits that A is given with, beside a grazing"
            if speed is None
            else ""
        )
        yield Row(f"A {amplitude}: multiplier", multiplier, complex(ours), why)
        if speed is not None:
            (found,) = orbit.events["approach_speed"]
            yield Row(f"A {amplitude}: impact speed", speed, float(found))


def light_damper() -> Iterator[Row]:
    """Also with mass ratio, damping ratio and distance from resonance over 100."""
    why = "ours: the exact motion; theirs is a limit of light masses"
    theirs = {
        0.985: (0.121532, 0.018320),
        0.990: (0.171146, 0.023425),
        0.995: (0.281011, 0.037865),
        0.9972: (0.379793, 0.055751),
        1.0: (0.492322, 0.169994),
    }
    for part in (1, 100):
        share, damping = 0.02 / part, 0.001 / part
        # Their frequency and damping ratio are those of the whole mass.
        slower = math.sqrt(1.0 - share)
        for ratio, both in theirs.items():
            p = Parameters(
                share / (1.0 - share),
                damping / slower,
                (1.0 - (1.0 - ratio) / part) * slower,
                0.15 / (2.0 * damping),
                0.8,
            )
            for amplitude, orbit in zip(both, orbits(p), strict=True):
                speed = 0.5 * (orbit.velocity_before + orbit.velocity_after)
                ours = math.hypot(orbit.displacement, speed / p.frequency_ratio) * 2.0 * damping
                lighter = "" if part == 1 else f", all of it over {part}"
                yield Row(f"ratio {ratio}{lighter}", amplitude, ours, "" if lighter else why)


def gap_of_a_centred_ball() -> Iterator[Row]:
    for damping in (0.01, 0.05, 0.2):
        low, high = 1.0, 2.5
        while high - low > 1e-14:
            middle = 0.5 * (low + high)
            p = Parameters(0.0, damping, 1.0, middle, 0.5, force_amplitude=0.0, forcing="none")
            hits = len(damper.events(p, State(1.0, 0.0, 1.0, 0.0), until=4.0 * math.pi))
            low, high = (middle, high) if hits else (low, middle)
        exact = 1.0 + math.exp(-math.pi * damping / math.sqrt(1.0 - damping**2))
        why = f"ours: 1 + exp(-pi zeta/sqrt(1 - zeta^2)) = {exact:.12f}"
        yield Row(f"damping ratio {damping}", 2.0, low, why)


def elastic_gap() -> Iterator[Row]:
    ratio = 1.5 / (2.0 * math.sqrt(10.0))
    restitution = math.exp(-2.0 * ratio * math.acos(ratio) / math.sqrt(1.0 - ratio**2))
    # A frame that nothing holds; the reduced mass, which the contact feels, is 1.
    free: dict[str, Any] = {"damping": 0.0, "force_amplitude": 0.0, "forcing": "none"}
    frame = {"primary_mass": 1e6, "stiffness": 1e-7, "forcing_frequency": 1e-8}
    mass, stiffness = 1e6 / (1e6 - 1.0), 10.0
    p = SIParameters(
        **frame,
        **free,
        free_mass=mass,
        gap=10.0,
        restitution=restitution,
        contact_stiffness=stiffness,
    )
    scaled, units = p.dimensionless, p.units
    run = start_run(scaled, State(0.0, 0.0, -6.5, 0.0).over(units))
    end = run.whole_periods(3.0 / units.time)
    run.skip(*end)
    state = run.state_at(*end).times(units)
    ours = state.u - state.v
    yield Row("speed, m/s", 3.427150, ours, "ours: 3.42714650670526 in 60 digits")


def leaves_a_table() -> Iterator[Row]:
    ratio, damping, clearance = 0.5, 0.05, 50.0
    theirs = {1.05: 1.260952, 1.5: 0.729728, 2.0: 0.523599, 5.0: 0.201358}
    amplitude = abs(steady_gain(damping, ratio))
    for gamma, phase in theirs.items():
        p = Parameters(0.0, damping, ratio, clearance, 0.3, -0.5 * math.pi)
        x, v = steady_state(p)
        weight = amplitude * ratio**2 / gamma
        start = State(x, v, x - clearance, v)
        found = damper.events(p, start, until=12.0, gravity=weight)
        leaves = found[found["kind"] == 2][0]
        ours = math.atan2(float(leaves["x"]) * ratio, float(leaves["v"]))
        yield Row(f"Gamma {gamma}: phase", phase, ours)


#: Of each ball the deviation of a single drop, and the means of five drops: s.
BALLS = {
    "golf": (0.009, (0.8396, 0.7503, 0.6723, 0.6018, 0.5387, 0.4820, 0.4280, 0.3797)),
    "rubber": (0.007, (0.5947, 0.5154, 0.4532, 0.4022, 0.3540, 0.3142, 0.2796, 0.2524)),
    "tennis": (0.004, (0.5007, 0.3805, 0.2895, 0.2303)),
}


#: Laws of a ball's restitution: name -> what its parameters beside r are called, where the fit
#: starts, and what they are of a damper.
LAWS: dict[str, tuple[str, float, Callable[[float], dict[str, float]]] | None] = {
    "constant": None,
    # From 1 on, so that steps over the value are steps at 0 as well.
    "power": ("p", 1.03, lambda q: {"yield_speed": 1.0, "yield_exponent": q - 1.0}),
    "yield": ("v_y", 2.0, lambda speed: {"yield_speed": speed, "yield_exponent": 0.25}),
}


def measured_balls() -> Iterator[str]:
    """Fits of a constant restitution, of r (1 m/s / v)^p, and of r (v_y / v)^(1/4) above v_y.

    The criterion of Akaike is chi-square, of the stated deviations, plus twice the number of
    parameters.
    """
    from scipy.optimize import least_squares

    g = 9.81
    for name, (deviation, measured) in BALLS.items():
        times, sigma = np.array(measured), deviation / math.sqrt(5.0)
        rows = []
        for law, more in LAWS.items():

            def misses(q: np.ndarray, times=times, sigma=sigma, more=more) -> np.ndarray:  # type: ignore[no-untyped-def]
                p = ball(float(q[1]), g, **(more[2](float(q[2])) if more else {}))
                ends = impacts(p, 0.0, 0.5 * g * float(q[0]), len(times))
                return (np.diff(ends, prepend=0.0) - times) / sigma

            start = (times[0], 0.85, *(more[1:2] if more else ()))
            last = (0.0, 20.0) if law == "yield" else (1.0, 2.0)
            bounds = [(0.0, 2.0), (0.0, 1.0), last][: len(start)]
            fit = least_squares(misses, start, diff_step=1e-4, bounds=np.transpose(bounds))
            own = 1.96 * np.sqrt(np.diag(np.linalg.pinv(fit.jac.T @ fit.jac)))
            words = f"r {fit.x[1]:.3f} +- {own[1]:.3f}"
            if more:
                found = fit.x[2] - (1.0 if law == "power" else 0.0)
                words += f", {more[0]} {found:.2f} +- {own[2]:.2f}"
            rows.append((law, words, 2.0 * fit.cost, len(start)))
        best = min(chi + 2.0 * count for _, _, chi, count in rows)
        for law, words, chi, count in rows:
            off = chi + 2.0 * count - best
            yield (f"| {name} | {law} | {words} | {chi:.1f} | {len(times) - count} | {off:.1f} |")


CASES: dict[str, Callable[[], Iterator[Row]]] = {
    "floor": ball_on_a_floor,
    "plates": ball_between_two_plates,
    "oscillator": impact_oscillator,
    "light": light_damper,
    "centred": gap_of_a_centred_ball,
    "contact": elastic_gap,
    "table": leaves_a_table,
}


def text(value: complex) -> str:
    """A number with the digits that matter."""
    if isinstance(value, complex):
        return f"{value.real:.5f} + {value.imag:.5f}i"
    return f"{value:.13g}"


def main(*names: str) -> None:
    """Print the tables of all cases, or of some."""
    print("# Cases of other people\n\n## Numbers\n")
    print("| case | number | theirs | ours | difference, relative | right where they differ |")
    print("|---|---|---|---|---|---|")
    for name in names or CASES:
        for row in CASES[name]():
            # Below that it is another number with each change of the engine.
            off = f"{row.off:.1g}" if row.off >= 1e-14 else "< 1e-14"
            both = f"{text(row.theirs)} | {text(row.ours)}"
            print(f"| {name} | {row.what} | {both} | {off} | {row.verdict} |")
    if not names:
        print("\n## Measured balls\n")
        print("| ball | law | values | chi-square | degrees of freedom | Akaike's criterion |")
        print("|---|---|---|---|---|---|")
        print("\n".join(measured_balls()))


if __name__ == "__main__":
    main(*sys.argv[1:])
