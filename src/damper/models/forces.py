"""The force of a run, from the one that its parameters name.

A user's own force is a class beside the classes of `damper.parameters.forcing`, and a function for
this class that is registered with `drive`: docs/extending.md.
"""

import math
from functools import singledispatch
from typing import Any, NamedTuple

import numpy as np

from damper.engine.bodies import Ballistic, FixedStop, Prescribed
from damper.engine.dispatch import by_class_or_default
from damper.engine.forcing import second_derivative
from damper.engine.forcing.harmonic import harmonic
from damper.engine.forcing.weighed import WeighedForce
from damper.engine.oscillator import Oscillator, oscillator
from damper.parameters import Parameters
from damper.parameters import forcing as given


class Drive(NamedTuple):
    """What drives a damper."""

    forcing: Any
    """NamedTuple of `damper.engine.forcing`."""
    amplitude: float
    """Factor of its shape in the force on the primary, >= 0."""
    share: float
    """Acceleration of the free mass by the force, over that of the primary.

    0 for a force on the primary; 1 for that of inertia in the frame of a base that moves.
    """


def weighed(
    damping: float, stiffness: float, strength: float, forcing: Any, weight: float
) -> Oscillator:
    """Make an oscillator with a constant acceleration beside the force."""
    if not weight:
        return oscillator(damping, stiffness, strength, forcing)
    from damper.engine.forcing.weighed import WeighedForce

    return oscillator(damping, stiffness, 1.0, WeighedForce(forcing, strength, weight))


def free_mass_of(
    parameters: Parameters, drive: Drive, primary: Oscillator
) -> Ballistic | FixedStop | Oscillator:
    """The free mass in flight, under force, gravity and support."""
    p, strength = parameters, drive.share * drive.amplitude
    if p.mass_ratio == math.inf:
        return FixedStop(primary)
    if p.carrier:
        return Ballistic(0.0 - p.pull)
    if p.support_damping_ratio or p.support_stiffness_ratio:
        damping = p.support_damping_ratio / p.mass_ratio
        stiffness = p.support_stiffness_ratio / p.mass_ratio
        # Without a spring the support is its dashpot alone; an oscillator needs some stiffness.
        return weighed(damping, stiffness or 1e-100, strength, drive.forcing, -p.pull)
    if drive.share:
        return weighed(0.0, 0.0, strength, drive.forcing, -p.pull)
    return Ballistic(0.0 - p.pull)  # no gravity is no negative zero


def drive_of(parameters: Parameters) -> Drive:
    """What drives the damper of these parameters."""
    return drive(parameters.forcing if parameters.force_amplitude else given.NoForce(), parameters)


def primary_of(parameters: Parameters, drive: Drive) -> Any:
    """The primary in flight; or the box whose motion is prescribed."""
    p = parameters
    if not p.carrier:
        return oscillator(p.damping_ratio, 1.0, drive.amplitude, drive.forcing)
    if p.forcing.samples and p.force_amplitude:  # its acceleration, which drives masses as -value
        from damper.engine.forcing.weighed import WeighedForce

        force = WeighedForce(drive.forcing, -drive.amplitude, 0.0)
        return oscillator(0.0, 0.0, 1.0, force)
    strength, force = second_derivative(drive.forcing, drive.amplitude)
    made = oscillator(0.0, 0.0, strength, force)._asdict()
    return Prescribed(**made, place=drive.forcing, size=drive.amplitude)


@singledispatch
def drive(force: given.Forcing, parameters: Parameters) -> Drive:
    """The engine's form of a force, by its class.

    Raises
    ------
    TypeError
        For a class that is not registered.
    """
    raise TypeError(f"forcing = {force!r}: no function for it is registered with {__name__}.drive")


@drive.register
def _no_force(force: given.NoForce, parameters: Parameters) -> Drive:
    from damper.engine.forcing import none

    return Drive(none.ZeroForce(0.0), 0.0, 0.0)


@drive.register
def _harmonic(force: given.Harmonic, parameters: Parameters) -> Drive:
    p = parameters
    return Drive(harmonic(p.frequency_ratio, p.phase), p.force_amplitude, 0.0)


@drive.register
def _unbalance(force: given.Unbalance, parameters: Parameters) -> Drive:
    p = parameters
    omega = p.frequency_ratio
    return Drive(harmonic(omega, p.phase), p.force_amplitude * omega * omega, 0.0)


@drive.register
def _base(force: given.Base, parameters: Parameters) -> Drive:
    p = parameters
    omega = p.frequency_ratio
    if force.frame == "base":  # the inertia, -z''
        return Drive(harmonic(omega, p.phase), p.force_amplitude * omega * omega, 1.0)
    # Spring and dashpot pass on z + 2 zeta z'.
    drag = 2.0 * p.damping_ratio * omega
    amplitude = p.force_amplitude * math.hypot(1.0, drag)
    return Drive(harmonic(omega, p.phase + math.atan(drag)), amplitude, 0.0)


@drive.register
def _harmonics(force: given.Harmonics, parameters: Parameters) -> Drive:
    from damper.engine.forcing.harmonics import harmonics

    p = parameters
    acting = [
        (k, a, phase)
        for k, a, phase in zip(force.orders, force.amplitudes, force.phases, strict=True)
        if a
    ]
    if len(acting) == 1 and acting[0][0] == 1 and acting[0][1] > 0.0:
        # The same motion, without the arrays.
        _, a, phase = acting[0]
        return Drive(harmonic(p.frequency_ratio, p.phase + phase), p.force_amplitude * a, 0.0)
    sine, cosine = np.zeros(max(acting)[0]), np.zeros(max(acting)[0])
    for k, a, phase in acting:
        sine[k - 1] = a * math.cos(phase)
        cosine[k - 1] = a * math.sin(phase)
    return Drive(harmonics(p.frequency_ratio, p.phase, sine, cosine), p.force_amplitude, 0.0)


@drive.register
def _record(force: given.Record, parameters: Parameters) -> Drive:
    from damper.engine.forcing.record import record

    p = parameters
    of_base = force.of == "base_acceleration"
    sign = -1.0 if of_base else 1.0
    slope = np.append(np.diff(force.value) / np.diff(force.time), 0.0)
    last = force.value[-1] if force.after == "hold" else 0.0
    pieces = record(p.cycle, force.time, sign * np.append(force.value[:-1], last), sign * slope)
    return Drive(pieces, p.force_amplitude, float(of_base))


@drive.register
def _noise(force: given.Noise, parameters: Parameters) -> Drive:
    return _record(force.record, parameters)


@by_class_or_default
def oscillator_under(
    forcing: Any, damping: float, stiffness: float, strength: float, weight: float
) -> Any:
    """Make an oscillator with a constant acceleration beside the force; here there is none."""
    return oscillator(damping, stiffness, strength, forcing)


@oscillator_under.of(WeighedForce)
def _driven_weighed(forcing, damping, stiffness, strength, weight):
    return oscillator(damping, stiffness, 1.0, WeighedForce(forcing.forcing, strength, weight))
