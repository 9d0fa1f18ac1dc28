"""The models of the damper: what the event loop asks of each, one package for each.

A model is a NamedTuple of constants that starts with the fields of `damper.models.rigid.Rigid`.
The functions below are declarations: each model's package implements them for its class
(`damper.engine.compiled.by_model`). Only the package of the model in use is imported.

Side, gap and its rate are relative to the wall of the segment, as in `damper.engine.search`; `a`
and `j` are the primary's second and third derivative in flight, `sin` and `cos` those of the
forcing phase, `periods` and `time` the moment as whole forcing periods and the rest.
"""

from collections.abc import Callable
from functools import lru_cache
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np

from damper.engine.compiled import by_model
from damper.parameters import Parameters

#: Constants of one run, a NamedTuple of floats and of tuples of floats.
Model = Any


def model_of(parameters: Parameters, accuracy: float) -> Model:
    """Constants of a run of the model that these parameters ask for.

    Parameters
    ----------
    parameters : Parameters
    accuracy : float
        Largest error of an accumulation time.
    """
    return _module(parameters.model).prepare(parameters, accuracy)


@lru_cache
def loop_of(model: str, run: Callable, place: Callable) -> tuple[Callable, Callable]:
    """Event loop and start of a run: the model's own where it has them, else those given."""
    module = _module(model)
    return getattr(module, "run", run), getattr(module, "place", place)


@lru_cache
def _module(model: str) -> ModuleType:
    return import_module(f"damper.models.{model}")


@by_model
def flight(
    model: Model,
    cause: float,
    side: float,
    x: float,
    v: float,
    gap: float,
    rate: float,
    a: float,
    j: float,
    sin: float,
    cos: float,
) -> tuple[float, ...]:
    """First contact with either wall after a segment's start; `cause` is what began it.

    Returns
    -------
    duration, hit, dx, v, rate, steps : float
        As `damper.engine.search.find_impact`.
    """


@by_model
def cut_flight(
    model: Model,
    side: float,
    x: float,
    v: float,
    gap: float,
    rate: float,
    sin: float,
    cos: float,
    duration: float,
) -> tuple[float, ...]:
    """State after a flight without an event.

    Returns
    -------
    dx, v, gap, rate : float
        Change of the primary's displacement, its velocity, the gap and its rate.
    """


@by_model
def sticking(
    model: Model,
    periods: float,
    time: float,
    side: float,
    x: float,
    v: float,
    sin: float,
    cos: float,
) -> tuple[float, ...]:
    """End of sticking; `side` is 0 where there is no clearance, and then there is no release.

    Returns
    -------
    duration, released, dx, v, steps : float
        As `damper.engine.search.find_release`.
    """


@by_model
def rests(
    model: Model,
    periods: float,
    time: float,
    side: float,
    x: float,
    v: float,
    a: float,
    j: float,
    sin: float,
    cos: float,
) -> bool:
    """Whether masses in contact with no relative velocity stay together."""


@by_model
def time_to_sticking(
    model: Model,
    periods: float,
    time: float,
    side: float,
    x: float,
    v: float,
    rate: float,
    a: float,
    j: float,
    sin: float,
    cos: float,
) -> tuple[float, ...]:
    """Time that is left of a complete burst after an impact with rebound speed `rate`.

    Returns
    -------
    duration, error : float
        As `damper.engine.search.tail_duration`.
    """


@by_model
def settle(
    model: Model,
    periods: float,
    time: float,
    side: float,
    x: float,
    v: float,
    rate: float,
    sin: float,
    cos: float,
    duration: float,
) -> tuple[float, ...]:
    """Motion over the closed rest of a burst.

    Returns
    -------
    dx, v : float
        Change of the primary's displacement, and the common velocity at sticking.
    """


@by_model
def mass_ratio_at(model: Model, periods: float, time: float) -> float:
    """Mass ratio at a moment: constant unless a model says otherwise."""
    return model.mass_ratio


@by_model
def motion(model: Model, row: np.ndarray, tau: float) -> tuple[float, ...]:
    """State inside a segment, a time `tau` after its start.

    Returns
    -------
    x, v, gap, rate : float
        Of the primary, and of the gap at the segment's wall.
    """
