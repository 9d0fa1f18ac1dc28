"""A scene with rigid walls, with stiff springs in their place."""

from dataclasses import replace

from damper.comparison.scene import Scene


def with_springs(scene: Scene, stiffness: float) -> Scene:
    """Replace rigid walls by springs with dashpots that keep the restitution.

    A contact lets go when its force vanishes. One of restitution 0 never would: it may pull, and is
    critically damped.

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
