"""Compliant contact: in place of rigid walls, and how deep the free mass gets into it."""

import math
from dataclasses import replace

import numpy as np

from damper.engine.segment import CONTACT, DURATION, MODE, SPEED
from damper.engine.trajectory import Trajectory
from damper.verification.comparison.scene import Scene


def with_springs(scene: Scene, stiffness: float) -> Scene:
    """Replace rigid walls by springs with dashpots that keep the restitution.

    A contact ends when its force vanishes. One of restitution 0 never would: it is critically
    damped, and its force may be tensile.

    Parameters
    ----------
    scene : Scene
        With rigid walls.
    stiffness : float
        Of the springs, in units of the primary's.
    """
    parameters = replace(
        scene.parameters,
        contact_stiffness_ratio=float(stiffness),
        contact_tension=0.0 if scene.parameters.restitution > 0.0 else 1.0,
    )
    return replace(scene, parameters=parameters)


def deepest(run: Trajectory, log: np.ndarray) -> float:
    """Depth that the fastest impact in a piece of the engine's log gets to.

    Taken where two free bodies would be deepest, at acos(z) / (w sqrt(1 - z^2)) with the contact's
    frequency w and damping ratio z. The depth is level there, so what else acts on them changes it
    to second order only.

    Parameters
    ----------
    run : Trajectory
        With compliant contact.
    log : ndarray (rows, COLUMNS)
    """
    contacts = log[log[:, MODE] == CONTACT]
    if len(contacts) == 0:
        return 0.0
    row = contacts[contacts[:, SPEED].argmax()]
    touch = run.model.touch
    frequency = math.sqrt(touch.relative_stiffness)
    z = 0.5 * touch.relative_damping / frequency
    root = math.sqrt(abs((1.0 - z) * (1.0 + z)))
    angle = math.atan2(root, z) if z < 1.0 else math.asinh(root)
    duration = (angle / root if root > 1e-8 else 1.0) / frequency
    _, _, gap, _ = run.motion_in(row, min(duration, float(row[DURATION])))
    return max(-gap, 0.0)
