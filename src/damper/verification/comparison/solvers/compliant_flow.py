"""Stiff springs for rigid walls, by the exact flow of the engine's own model of such walls.

What the springs do to the solution is its only error. Sticking is a contact that lasts for at least
one period of its own oscillation, twice as long as a bounce; it begins where that contact begins.
"""

import cmath
import math
from dataclasses import replace

from damper.engine.trajectory import DEFAULT_ACCURACY
from damper.models.compliant.restitution import contact_damping
from damper.verification.comparison.scene import Scene
from damper.verification.comparison.solution import Solution
from damper.verification.comparison.solvers import Solver, exact


def solve(scene: Scene, setting: float, max_evaluations: int) -> Solution:
    """Run a scene with walls of stiffness `setting`, in units of the primary's.

    Dashpots keep the restitution. A contact ends when its force vanishes; one of restitution 0
    never would: it is critically damped, and its force may be tensile.
    """
    p = scene.parameters
    tension = p.restitution == 0.0
    walls = replace(p, contact_stiffness_ratio=float(setting), contact_tension=float(tension))
    found = exact.solve(replace(scene, parameters=walls), DEFAULT_ACCURACY, max_evaluations)
    frequency = math.sqrt(setting * (1.0 + p.mass_ratio) / p.mass_ratio)
    # The engine reports that a contact sticks once it has lasted for one period.
    found.stick_times -= 2.0 * math.pi / frequency
    if len(found.approach_speeds):
        z = contact_damping(p.restitution, tension)
        deepest = cmath.acos(z) / cmath.sqrt(1.0 - z * z) if z != 1.0 else 1.0
        found.penetration = (
            float(found.approach_speeds.max()) / frequency * math.exp(-z * deepest.real)
        )
    return found


SOLVERS = {"compliant_flow": Solver("contact_stiffness", +1, 4e6, solve)}
