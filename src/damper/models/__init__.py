"""The models of the damper, a room each: motion, search, sticking, response integrals.

To add one, write its folder and enter it in `damper.parameters.models`. Only the model in use is
imported.
"""

import math
from importlib import import_module
from typing import Any

import numpy as np

from damper.engine.compiled import plain
from damper.engine.impact import LAWS, DifferingWalls, TabledRestitution
from damper.engine.trajectory import DEFAULT_ACCURACY, DEFAULT_MAX_EVENTS, Trajectory
from damper.models.forces import drive_of, primary_of
from damper.models.walls import box_at, slack
from damper.parameters import NO_UNITS, Parameters, State, Units
from damper.parameters.models import room_of
from damper.parameters.run import checked


def model_of(
    parameters: Parameters, accuracy: float = DEFAULT_ACCURACY, along_friction: bool = False
) -> Any:
    """Constants of a run, a NamedTuple of the model that these parameters ask for.

    Parameters
    ----------
    parameters : Parameters
    accuracy : float, default 1e-12
        Largest error of an accumulation time, in units of sqrt(M/K) (of 1/omega where that is
        shorter). Everything else is exact to roundoff.
    along_friction : bool, optional
        Whether slides stop also where there is no friction yet, for rigid walls.
    """
    room = import_module(f"damper.models.{room_of(parameters.features[0])}")
    more = {"along_friction": True} if along_friction else {}
    return room.prepare(parameters, law_of(parameters), float(accuracy), **more)


def start_run(
    parameters: Parameters,
    state: State | None = None,
    accuracy: float = DEFAULT_ACCURACY,
    max_events: int = DEFAULT_MAX_EVENTS,
) -> Trajectory:
    """Start one run.

    Raises
    ------
    ValueError
        When the state lies outside the box, or accuracy or max_events is out of range.
    """
    accuracy, max_events = checked("accuracy", accuracy), checked("max_events", max_events)
    if state is not None:
        check_state(parameters, state)
    elif "prescribed" in parameters.features:
        x, v = box_motion(parameters, State(0.0, 0.0, 0.0, 0.0))
        state = State(x, v, x, v)
    trajectory = Trajectory(model_of(parameters, accuracy), state, max_events)
    trajectory.parameters = parameters
    return trajectory


def box_motion(parameters: Any, state: State) -> tuple[float, float]:
    """Displacement and velocity at a state's time of a box whose motion is prescribed.

    They are those of the state where the box's acceleration is prescribed.
    """
    x, v = float(state.x), float(state.v)
    primary = primary_of(parameters, drive_of(parameters))
    return plain(box_at)(primary, 0.0, state.time, x, v)  # type: ignore[no-any-return]


def check_state(parameters: Any, state: State, units: Units = NO_UNITS) -> None:
    """Raise ValueError unless the free mass is between the walls; SI `units` speak of the gap.

    Compliant walls let it in deeper.
    """
    places, speeds = state.of_each(len(parameters.each))
    if parameters.hits_stop and speeds[0]:
        raise ValueError(f"state: u = {state.u!r} of a fixed stop, which does not move: must be 0")
    for k, (one, y, x) in enumerate(
        zip(parameters.each, places, _boxes_at(parameters, state), strict=True)
    ):
        apart = y - x
        side = getattr(one, "walls", 0.0)
        distance = side * apart if side else abs(apart)
        allowed = one.clearance + slack(one.clearance, x, y)
        if distance > allowed and parameters.model != "compliant":
            limit = "clearance" if units is NO_UNITS else "gap / 2"
            name = "y" if len(places) == 1 else f"y[{k}]"
            box = "x" if parameters.model != "structure" else f"that of box {one.box!r}"
            raise ValueError(
                f"state: |{name} - {box}| = {distance * units.length!r} is outside the box: "
                f"must be at most {limit} = {one.clearance * units.length!r}"
            )


def _boxes_at(parameters: Any, state: State) -> list[float]:
    """Displacement of the box of each free mass."""
    if "prescribed" in parameters.features:
        return [box_motion(parameters, state)[0]]
    if parameters.model != "structure":
        return state.of_coordinates(1)[0] * len(parameters.each)
    structure = parameters.structure
    x, _ = state.of_coordinates(len(structure.mass))
    return [float(structure.boxes[one.box] @ x) for one in parameters.each]


def law_of(parameters: Parameters) -> Any:
    """Contact law of a run."""
    if parameters.law == "tabled":
        left, right = (TabledRestitution(np.array(rows)) for rows in parameters.tables)
        return right if np.array_equal(*parameters.tables) else DifferingWalls(left, right)
    law = LAWS[parameters.law]
    right = law(*[getattr(parameters, name) for name in law._fields])
    if parameters.restitution_left == math.inf:
        return right
    return DifferingWalls(right._replace(restitution=parameters.restitution_left), right)
