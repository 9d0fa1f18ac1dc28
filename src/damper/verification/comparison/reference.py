"""The answer to a scene in 50 digits, kept as a file of decimal strings.

`make_reference` computes it, with `reference_rigid` or `reference_compliant`; nothing of the engine
is used. Parameters and start count as the exact binary values they are, but for a start so near a
wall that only roundoff keeps it off: that is a start on the wall.
"""

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from mpmath import mp, mpf

from damper.models.walls import slack
from damper.parameters import Parameters, State
from damper.verification.comparison import reference_compliant, reference_rigid
from damper.verification.comparison.scene import Scene

#: Impacts slower than this are not listed (they are computed all the same). A bounce of speed w
#: rises w^2 / (2 a) above its wall, which is lost in the roundoff of doubles of size 1 at w of some
#: 1e-8. Nothing that works with absolute positions can distinguish slower ones from contact; this
#: leaves them a decade.
RESOLVED = 1e-9

#: Digits of the run that the perturbed ones are compared with, over those of the reference.
_PERTURBED_DIGITS = 0.7
#: The perturbation is 10 to minus this times the digits: 1e-30 for 50.
_PERTURBATION = 0.6


@dataclass(frozen=True)
class Reference:
    """Events and final state of a scene, as decimal strings and, rounded once, as floats.

    As many of the `digits` are right as the scene allows: a perturbation in the last one grows by
    `sensitivity`. The computation itself carries 15 more.
    """

    scene: Scene
    digits: int
    """Significant decimal digits of each number."""
    impact_time_digits: tuple[str, ...]
    impact_side_list: tuple[int, ...]
    approach_speed_digits: tuple[str, ...]
    stick_time_digits: tuple[str, ...]
    release_time_digits: tuple[str, ...]
    final_state_digits: tuple[str, ...]
    events: int
    """All impacts that were computed, also those below `RESOLVED`, and sticks and releases."""
    sensitivity: float
    """Change of the final state over a change of 1e-30 of either velocity at the start, whichever
    grows more; inf if that changes which events there are. See `make_reference`."""

    @property
    def impact_times(self) -> np.ndarray:
        """Times of impacts with an approach speed of at least `RESOLVED`, shape (impacts,)."""
        return _floats(self.impact_time_digits)

    @property
    def impact_sides(self) -> np.ndarray:
        """-1 left wall, +1 right wall; shape (impacts,)."""
        return np.array(self.impact_side_list, dtype=float)

    @property
    def approach_speeds(self) -> np.ndarray:
        """Relative speed just before each impact, shape (impacts,)."""
        return _floats(self.approach_speed_digits)

    @property
    def stick_times(self) -> np.ndarray:
        """When sticking begins, shape (sticks,). Compliant contact: when one has lasted one
        period of its own oscillation, which is what `damper.models.compliant` calls sticking."""
        return _floats(self.stick_time_digits)

    @property
    def release_times(self) -> np.ndarray:
        """When sticking ends, shape (releases,)."""
        return _floats(self.release_time_digits)

    @property
    def final_state(self) -> np.ndarray:
        """x, v, y, u at the end of the scene, shape (4,)."""
        return _floats(self.final_state_digits)


def make_reference(scene: Scene, digits: int = 50) -> Reference:
    """Compute a scene in many digits, and how strongly its end depends on its start.

    The run is repeated twice, with the primary's and with the free mass's velocity at the start
    larger by 10^(-0.6 digits), 1e-30 for 50 digits. `Reference.sensitivity` is the larger of the
    changes in the final state (largest component) over that.

    Parameters
    ----------
    scene : Scene
        With rigid walls or compliant contact.
    digits : int, default 50
        Decimal digits; 20 or more.

    Raises
    ------
    ValueError
        For fewer digits, a model without a reference, a scene that ends before it starts, a start
        outside the box.

    Examples
    --------
    >>> from damper.verification.comparison.scene import read_scene
    >>> scene = read_scene({"mass_ratio": 0.1, "damping_ratio": 0.05, "frequency_ratio": 0.2,
    ...                     "clearance": 0.25, "restitution": 0.6}, 10.0)
    >>> reference = make_reference(scene)
    >>> reference.impact_time_digits[0]
    '2.1586031892824394676789524498464178830291034500478'
    """
    if digits < 20:
        raise ValueError(f"digits = {digits!r}: must be at least 20")
    if scene.until < scene.state.time:
        raise ValueError(f"until = {scene.until!r}: the scene starts later, at {scene.state.time}")
    with mp.workdps(digits + reference_rigid.GUARD_DIGITS):
        start = _start(scene)
    exact = _run(scene, start, digits)
    text = _Text(digits)
    impacts = [event for event in exact.events if _resolved(event)]
    return Reference(
        scene,
        digits,
        text.all(event.time for event in impacts),
        tuple(event.side for event in impacts),
        text.all(event.approach_speed for event in impacts),
        text.all(event.time for event in exact.events if event.kind == "stick"),
        text.all(event.time for event in exact.events if event.kind == "release"),
        text.all(exact.final),
        len(exact.events),
        _sensitivity(scene, start, exact, digits),
    )


def write_reference(path: Path, reference: Reference) -> None:
    """Write a reference as JSON: the same bytes for the same reference."""
    parameters = {
        field.name: value
        for field in fields(Parameters)
        if (value := getattr(reference.scene.parameters, field.name)) != field.default
    }
    finite = math.isfinite(reference.sensitivity)
    content = {
        "parameters": parameters,
        "start": asdict(reference.scene.state),
        "until": reference.scene.until,
        "digits": reference.digits,
        "resolved": RESOLVED,
        "events": reference.events,
        "impact_times": reference.impact_time_digits,
        "impact_sides": reference.impact_side_list,
        "approach_speeds": reference.approach_speed_digits,
        "stick_times": reference.stick_time_digits,
        "release_times": reference.release_time_digits,
        "final_state": reference.final_state_digits,
        "sensitivity": reference.sensitivity if finite else None,
    }
    text = json.dumps(content, indent=1, sort_keys=True, allow_nan=False)
    Path(path).write_text(text + "\n", encoding="utf-8", newline="\n")


def read_reference(path: Path) -> Reference:
    """Read what `write_reference` wrote.

    Raises
    ------
    ValueError
        If the file is not a reference.
    """
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
        sensitivity = content["sensitivity"]
        return Reference(
            Scene(Parameters(**content["parameters"]), State(**content["start"]), content["until"]),
            content["digits"],
            tuple(content["impact_times"]),
            tuple(content["impact_sides"]),
            tuple(content["approach_speeds"]),
            tuple(content["stick_times"]),
            tuple(content["release_times"]),
            tuple(content["final_state"]),
            content["events"],
            math.inf if sensitivity is None else sensitivity,
        )
    except (KeyError, TypeError, json.JSONDecodeError) as error:
        raise ValueError(f"{path}: not a reference of a scene ({error})") from error


def _floats(digits: Sequence[str]) -> np.ndarray:
    return np.array([float(one) for one in digits])


class _Text:
    """Numbers as decimal strings with all their digits."""

    def __init__(self, digits: int) -> None:
        self.digits = digits

    def all(self, values: Iterable[mpf]) -> tuple[str, ...]:
        """Strings of several numbers."""
        return tuple(mp.nstr(value, self.digits, strip_zeros=False) for value in values)


def _start(scene: Scene) -> tuple[mpf, ...]:
    """x, v, y, u; a free mass within roundoff of a wall is on it, as it is for the engine."""
    s, d = scene.state, scene.parameters.clearance
    x, v, y, u = (mpf(value) for value in (s.x, s.v, s.y, s.u))
    side = 1 if y >= x else -1
    if abs(d - side * (y - x)) <= slack(d, s.x, s.y):
        y = x + side * mpf(d)
    return x, v, y, u


def _run(scene: Scene, start: Sequence[mpf], digits: int) -> reference_rigid.ReferenceRun:
    p = scene.parameters
    settings: dict[str, Any] = {
        "until": scene.until,
        "start_time": scene.state.time,
        "dps": digits,
    }
    if scene.model == "rigid":
        numbers = (
            p.mass_ratio,
            p.damping_ratio,
            p.frequency_ratio,
            p.clearance,
            p.restitution,
            p.phase,
        )
        return reference_rigid.run(numbers, start, **settings)
    if scene.model == "compliant":
        return reference_compliant.run(p, start, **settings)
    raise ValueError(
        f"the {scene.model} model has no reference in many digits: only the rigid and the "
        "compliant one have"
    )


def _resolved(event: reference_rigid.Event) -> bool:
    return event.kind == "impact" and event.approach_speed >= RESOLVED


def _pattern(run: reference_rigid.ReferenceRun) -> list[tuple[str, int]]:
    """Which events there are, in order."""
    return [
        (event.kind, event.side)
        for event in run.events
        if event.kind != "impact" or _resolved(event)
    ]


def _sensitivity(
    scene: Scene, start: Sequence[mpf], exact: reference_rigid.ReferenceRun, digits: int
) -> float:
    """Growth of a perturbation of either velocity; see `make_reference`."""
    growth = 0.0
    for component in (1, 3):
        with mp.workdps(digits + reference_rigid.GUARD_DIGITS):
            step = mpf(10) ** -round(_PERTURBATION * digits)
            moved = [mpf(value) for value in start]
            moved[component] += step
            other = _run(scene, moved, round(_PERTURBED_DIGITS * digits))
            if _pattern(other) != _pattern(exact):
                return math.inf
            change = max(abs(a - b) for a, b in zip(other.final, exact.final, strict=True))
            growth = max(growth, float(mp.nstr(change / step, 6)))
    return growth
