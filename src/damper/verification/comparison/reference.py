"""The answer to a scene in 50 digits, kept as decimal strings.

`make_reference` computes it with `damper.verification.reference`; nothing of the engine is used.
Parameters and start count as the exact binary values they are.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from typing import Any

from mpmath import mp, mpf

from damper.parameters import Parameters
from damper.sweep.parts import PartData
from damper.verification import reference
from damper.verification.comparison.solvers import Scene, read_scene
from damper.verification.reference import RESOLVED


def make_reference(scene: Scene, digits: int = 50) -> dict[str, Any]:
    """Compute a scene with rigid walls in many digits; the computation carries 15 more.

    Returns what JSON can hold, numbers as decimal strings with all their digits: the scene, and the
    fields of `damper.verification.comparison.errors.Reference`.
    """
    s = scene.state
    start = [mpf(value) for value in (s.x, s.v, s.y, s.u)]
    exact = reference.exact_run(
        _values(scene), start, until=scene.until, digits=digits, start_time=scene.state.time
    )
    impacts, sticks, releases = (
        [event for event in exact.events if event.kind == kind]
        for kind in ("impact", "stick", "release")
    )
    impacts = [event for event in impacts if event.approach_speed >= RESOLVED]
    numbers = {
        "impact_times": [event.time for event in impacts],
        "approach_speeds": [event.approach_speed for event in impacts],
        "stick_times": [event.time for event in sticks],
        "release_times": [event.time for event in releases],
        "final_state": exact.final,
    }
    return {
        "parameters": _values(scene),
        "start": asdict(scene.state),
        "until": scene.until,
        "digits": digits,
        "resolved": RESOLVED,
        "impact_sides": [event.side for event in impacts],
    } | {
        name: [mp.nstr(value, digits, strip_zeros=False) for value in values]
        for name, values in numbers.items()
    }


def run_part(needed: Sequence[PartData], scene: Mapping[str, Any], digits: int) -> PartData:
    """Work out a scene, given as arguments of `read_scene`, as a job of the workflow."""
    return PartData({}, make_reference(read_scene(**scene), digits))


def gather(parts: Sequence[PartData], scenes: Sequence[str]) -> dict[str, Any]:
    """Return the references of all scenes by name, for a file that people read."""
    return {name: part.about for name, part in zip(scenes, parts, strict=True)}


def _values(scene: Scene) -> dict[str, float]:
    """The parameters that are not their defaults."""
    given = ((field, getattr(scene.parameters, field.name)) for field in fields(Parameters))
    return {field.name: value for field, value in given if value != field.default}
