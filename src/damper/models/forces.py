"""The force of a run, from the one that its parameters name."""

import math
from typing import Any, NamedTuple

import numpy as np

from damper.engine.forcing.harmonic import harmonic
from damper.parameters import Parameters
from damper.parameters import forcing as given


class Drive(NamedTuple):
    """What drives a damper."""

    forcing: Any
    """NamedTuple of `damper.engine.forcing`."""
    amplitude: float
    """What its shape is multiplied by to give the force on the primary."""
    share: float
    """Acceleration of the free mass by the force, over that of the primary.

    0 for a force on the primary; 1 for that of inertia in the frame of a base that moves.
    """


def drive_of(parameters: Parameters) -> Drive:
    """What drives the damper of these parameters."""
    p = parameters
    spec, amplitude = p.forcing, p.force_amplitude
    omega = p.frequency_ratio
    if amplitude == 0.0 or isinstance(spec, given.NoForce):
        from damper.engine.forcing.none import NoForce

        return Drive(NoForce(0.0), 0.0, 0.0)
    if isinstance(spec, given.Harmonic):
        return Drive(harmonic(omega, p.phase), amplitude, 0.0)
    if isinstance(spec, given.Unbalance):
        return Drive(harmonic(omega, p.phase), amplitude * omega * omega, 0.0)
    if isinstance(spec, given.Base):
        if spec.frame == "base":  # -z''
            return Drive(harmonic(omega, p.phase), amplitude * omega * omega, 1.0)
        drag = 2.0 * p.damping_ratio * omega
        phase = p.phase + math.atan(drag)
        return Drive(harmonic(omega, phase), amplitude * math.hypot(1.0, drag), 0.0)
    if isinstance(spec, given.Harmonics):
        if tuple(spec.orders) == (1,) and spec.amplitudes[0] > 0.0:
            phase = p.phase + spec.phases[0]
            return Drive(harmonic(omega, phase), amplitude * spec.amplitudes[0], 0.0)
        return Drive(_sum_of_harmonics(spec, omega, p.phase), amplitude, 0.0)
    if isinstance(spec, given.Noise):
        spec = spec.record
    if isinstance(spec, given.Record):
        of_base = spec.of == "base_acceleration"
        return Drive(_pieces(spec, p.cycle, -1.0 if of_base else 1.0), amplitude, float(of_base))
    raise TypeError(f"forcing = {spec!r}: no model knows it")


def _sum_of_harmonics(spec: given.Harmonics, omega: float, phase: float) -> Any:
    from damper.engine.forcing.harmonics import harmonics

    highest = max(k for k, a in zip(spec.orders, spec.amplitudes, strict=True) if a)
    sine, cosine = np.zeros(highest), np.zeros(highest)
    for k, a, angle in zip(spec.orders, spec.amplitudes, spec.phases, strict=True):
        if a:
            sine[k - 1] += a * math.cos(angle)
            cosine[k - 1] += a * math.sin(angle)
    return harmonics(omega, phase, sine, cosine)


def _pieces(spec: given.Record, cycle: float, sign: float) -> Any:
    from damper.engine.forcing.record import record

    slope = np.append(np.diff(spec.value) / np.diff(spec.time), 0.0)
    last = spec.value[-1] if spec.after == "hold" else 0.0
    return record(cycle, spec.time, sign * np.append(spec.value[:-1], last), sign * slope)
