"""Make the records of this folder: python config/records/make.py

`half-sine.csv` is a shock of 11 ms, `earthquake.csv` a made-up earthquake of 20 s: white noise
through the filter of Kanai (Bull. Earthq. Res. Inst. 1957, 35, 309) and Tajimi (Proc. 2nd World
Conf. Earthq. Eng. 1960, 781), the ground on stiff soil as an oscillator that the rock below shakes,
between a rise and a fall. Both have a largest value of 1: `force_amplitude` says how much that is.
"""

import math
from pathlib import Path
from random import Random

FOLDER = Path(__file__).parent
#: Of the ground: natural frequency in rad/s, damping ratio.
GROUND = 15.0, 0.6
SEED, STEP, LENGTH = 1, 0.02, 20.0


def half_sine(length: float = 0.011, pieces: int = 44) -> list[tuple[float, float]]:
    """Samples of half a sine; between them it is off by (pi / pieces)^2 / 8, 0.06 %, at most."""
    return [(length * k / pieces, math.sin(math.pi * k / pieces)) for k in range(pieces + 1)]


def earthquake() -> list[tuple[float, float]]:
    """Samples of the ground's absolute acceleration, without its mean."""
    omega, zeta = GROUND
    random = Random(SEED)
    damped, decay = omega * math.sqrt(1.0 - zeta * zeta), math.exp(-zeta * omega * STEP)
    sine, cosine = math.sin(damped * STEP) / damped, math.cos(damped * STEP)
    x = v = 0.0
    times = [STEP * k for k in range(round(LENGTH / STEP) + 1)]
    values = []
    for time in times:
        values.append(_envelope(time) * -(omega * omega * x + 2.0 * zeta * omega * v))
        # Exact for noise that is constant over a step.
        rest = -random.gauss(0.0, 1.0) / omega**2
        away = x - rest
        x = rest + decay * (away * cosine + (v + zeta * omega * away) * sine)
        v = decay * (v * cosine - (omega * omega * away + zeta * omega * v) * sine)
    mean = sum(values) / len(values)
    values = [value - mean * _envelope(time) for time, value in zip(times, values, strict=True)]
    most = max(map(abs, values))
    return [(time, value / most) for time, value in zip(times, values, strict=True)]


def _envelope(time: float) -> float:
    """Rise over 2 s, and fall from 8 s on to nothing at the end."""
    fall = math.exp(-0.35 * max(time - 8.0, 0.0)) * min((LENGTH - time) / 2.0, 1.0)
    return min(time / 2.0, 1.0) ** 2 * fall


def write(name: str, samples: list[tuple[float, float]]) -> None:
    """Write a record as CSV, in digits that every platform agrees on."""
    lines = ["time (s),acceleration", *(f"{time:.6g},{value:.5f}" for time, value in samples)]
    (FOLDER / name).write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


if __name__ == "__main__":
    write("half-sine.csv", half_sine())
    write("earthquake.csv", earthquake())
