"""What a feature costs a scene that does not use it: the ratio to a run without the feature.

Both run in turns, as everything in `damper.verification.cost.paired`. Where the feature is part of
the compiled engine, the engine without it is a model of its own that shares all the rest with the
rigid damper; where it is what a process has loaded, each side has its own process.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from damper.engine import model as declared
from damper.engine.compiled import compile_at_once
from damper.engine.trajectory import Trajectory
from damper.models import MODELS, model_of, start_run, walls
from damper.models.rigid import Rigid
from damper.observers import OBSERVERS
from damper.parameters import Parameters
from damper.parameters.quantities import QUANTITIES
from damper.parameters.quantity import Declared, shared
from damper.sweep.runs import run_points
from damper.verification.cost.ladder import bare
from damper.verification.cost.paired import spread, take_turns
from damper.verification.cost.process import Worker


class _Unclosed(Rigid):
    """A rigid damper whose engine closes no chatter sequence."""


walls.have_rigid_walls(_Unclosed)
for _function in (declared.motion, walls.fly, walls.stick, walls.stays, walls.complete):
    _function.share(_Unclosed, Rigid)


@walls.time_to_completion.of(_Unclosed)
def _never(model, segment, start):
    return 0.0, math.inf


class _RigidAlone(Declared, shares=Parameters):
    """Parameters of a software that knows the rigid damper only."""

    mass_ratio: float = shared()
    damping_ratio: float = shared()
    frequency_ratio: float = shared()
    clearance: float = shared()
    restitution: float = shared()
    phase: float = shared(default=0.0)

    def __post_init__(self) -> None:
        self.check_each()


def unused(
    parameters: Mapping[str, float],
    *,
    lanes: int,
    periods: int,
    repeats: int,
) -> dict[str, Any]:
    """Measure what a rigid damper without bursts pays for what it does not use.

    Parameters
    ----------
    parameters : mapping of str to float
        A rigid damper, dimensionless, whose runs know no bursts: those are not used, then.
    lanes, periods : int
        What each run consists of.
    repeats : int

    Returns
    -------
    dict
        Feature -> ratio of the run time with it to that without it: [lower quartile, median, upper
        quartile]. The first one, ``noise``, compares two runs that are the same.

    Raises
    ------
    ValueError
        When a run is not free of bursts, or not rigid.
    """
    points = [
        dict(parameters) | {"clearance": parameters["clearance"] * (1.0 + 1e-3 * k / lanes)}
        for k in range(lanes)
    ]
    if Parameters(**parameters).model != "rigid":
        raise ValueError("parameters: must be those of a rigid damper")
    compile_at_once()
    known, unknown = (run_as(kind, points, periods) for kind in (Rigid, _Unclosed))
    if known != unknown:
        raise ValueError(f"parameters: must give no bursts within {periods} periods")
    ready = [Parameters(**point) for point in points]
    written = [_written_out() | point for point in points]
    with Worker() as lean, Worker() as full:
        run: dict[str, Any] = {
            "function": f"{bare.__module__}:bare",
            "points": points,
            "periods": periods,
        }
        full.call(f"{__name__}:load_all", parameters=dict(parameters))
        pairs: dict[str, tuple[Callable[[], Any], Callable[[], Any]]] = {
            "noise": (partial(bare, points, periods), partial(bare, points, periods)),
            "bursts in the engine": (
                partial(run_as, Rigid, points, periods),
                partial(run_as, _Unclosed, points, periods),
            ),
            "parameters of other models": (
                partial(run_checked, Parameters, points, periods, ready),
                partial(run_checked, _RigidAlone, points, periods, ready),
            ),
            "other models' zeros written out": (
                partial(bare, written, periods),
                partial(bare, points, periods),
            ),
            "other models and all observers loaded": (
                partial(full.call, **run),
                partial(lean.call, **run),
            ),
        }
        cases = [case for pair in pairs.values() for case in pair]
        for case in cases:
            case()  # compile
        seconds = take_turns(cases, repeats)
    return {name: spread(seconds[:, 2 * k] / seconds[:, 2 * k + 1]) for k, name in enumerate(pairs)}


def run_as(kind: type, points: Sequence[Mapping[str, float]], periods: int) -> int:
    """Run rigid dampers in the engine of another kind of model; return the number of events."""
    events = 0
    for values in points:
        trajectory = Trajectory(kind(*model_of(Parameters(**values))))
        trajectory.skip(periods)
        events += trajectory.events
    return events


def run_checked(
    kind: type,
    points: Sequence[Mapping[str, float]],
    periods: int,
    ready: Sequence[Parameters],
) -> int:
    """Check points by a class of parameters, run those that are ready; return the events."""
    events = 0
    for values, parameters in zip(points, ready, strict=True):
        kind(**values)
        trajectory = start_run(parameters)
        trajectory.skip(periods)
        events += trajectory.events
    return events


def load_all(parameters: Mapping[str, float]) -> None:
    """Load and run every model, and every observer of the rigid one."""
    for extra in MODELS.values():
        bare([dict(parameters) | extra], 2)
    for name in OBSERVERS:
        run_points([dict(parameters)], [name], transient=0, periods=2)


def _written_out() -> dict[str, float]:
    """Return the parameters of other models with the values that ask for none."""
    return {q.name: q.default for q in QUANTITIES if q.model and q.default is not None}
