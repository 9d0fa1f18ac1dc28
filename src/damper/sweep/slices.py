"""Slices: the part of a study's cube that one simulation job makes."""

import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from damper.observers import make_observers
from damper.parameters import State, Units
from damper.parameters.forcing import EACH_DRAW, Forcing, forcing_of
from damper.parameters.quantities import is_si
from damper.parameters.run import RunSettings
from damper.parameters.tables import beside_numbers
from damper.parameters.variables import SI_UNITS, Variable
from damper.sweep.branches import branches, noise_seeds
from damper.sweep.estimate import Workload, run_sizes
from damper.sweep.grid import lies_at, product
from damper.sweep.parts import PartData
from damper.sweep.progress import Progress, progress_lines


def run_part(
    needed: Sequence[PartData] = (),
    *,
    forcing: Mapping[str, Any] | None = None,
    samples: str | None = None,
    **settings: Any,
) -> PartData:
    """Simulate a slice as a job of the workflow, whose log says how far it is.

    `forcing` is a force in plain values, and `samples` the file of a record; other `settings` are
    arguments of `simulate_slice`.
    """
    settings["progress"] = progress_lines(sys.stderr)
    if forcing is None:
        return simulate_slice(**settings)
    own = forcing.get("seed") == EACH_DRAW
    force = forcing_of({**forcing, "seed": 0} if own else forcing, samples)
    return simulate_slice(**settings, forcing=force, own_noise=own)


def simulate_slice(
    fixed: Mapping[str, float],
    axes: Mapping[str, Sequence[float]],
    *,
    observers: Iterable[str] | Mapping[str, Mapping[str, Any] | None],
    primary: str = "rest",
    forcing: Forcing | str | None = None,
    own_noise: bool = False,
    masses: int = 0,
    tables: Mapping[str, Any] | None = None,
    draws: Mapping[str, Any] | None = None,
    follow: Mapping[str, str] | None = None,
    state: State | None = None,
    progress: Progress | None = None,
    workers: int | None = 1,
    **run: Any,
) -> PartData:
    """Simulate one slice.

    Parameters
    ----------
    fixed : mapping of str to float
        Fixed quantities, and the slice's place along the fanned axes.
    axes : mapping of str to values
        The axes that run inside the job.
    observers, primary, forcing, masses, tables, state, progress, workers, **run
        As for `damper.sweep.runs.run_points`.
    own_noise : bool, default False
        Whether each draw has its own: `forcing` with another seed.
    draws : mapping, optional
        As for `damper.sweep.branches.draw`.
    follow : mapping of str to str, optional
        The axis to be followed by continuation -> "up", "down" or "both".

    Returns
    -------
    PartData
        Arrays over the runs: the product of the axes and of `branches`, such as both directions of
        a continuation. In SI units if the points are given in them. About them: ``variables``
        describes them, ``coordinates`` are along the observers' own dimensions, ``branches`` along
        those of the runs, and ``labels`` are drawn quantities along the branch dimension `draw`, as
        are ``noise_seeds``, if any.

    Raises
    ------
    ValueError, TypeError
        As `run_points`, and for too many runs before they are listed.
    """
    # Loads the engine, and numba with it; reading a slice needs neither.
    from damper.sweep.points import read_point
    from damper.sweep.runs import run_points

    observers = list(observers) if isinstance(observers, Iterator) else observers
    counts = {name: len(values) for name, values in axes.items()}
    draws = draws or {}
    first, end = draws.get("only", (0, draws.get("count", 0)))
    sizes = run_sizes(counts, end - first, follow or {})
    settings = RunSettings(**run)
    if not settings.timed:  # else it is known with the points
        Workload(sizes, *settings.cycles(1.0, 0.0), make_observers(observers)).refuse_excess()
    plan = branches(product(axes, fixed), axes, draws, follow or {})
    points: list[dict[str, Any]] = list(plan.points)
    seeds = noise_seeds(draws) if own_noise else []
    if seeds:  # the draws lie last
        noises = [replace(forcing, seed=seed) for seed in seeds]  # type: ignore[type-var]
        points = [{**p, "forcing": noises[k % len(seeds)]} for k, p in enumerate(points)]
    elif forcing is not None:
        points = [{**point, "forcing": forcing} for point in points]
    if every := beside_numbers(masses, tables):
        points = [{**point, **every} for point in points]
    arrays, made = run_points(
        points,
        observers,
        primary=primary,
        state=state,
        predecessor=plan.predecessor,
        progress=progress,
        workers=workers,
        **run,
    )
    variables = tuple(variable for observer in made for variable in observer.variables)
    places = {v.name: dict(one.place) for one in made if one.place for v in one.variables}
    if is_si([*fixed, *axes, *plan.labels]):
        units = [read_point(point).units for point in points]
        variables = _in_si(arrays, variables, points, units, places)
    coordinates = {k: v.tolist() for observer in made for k, v in observer.coordinates().items()}
    about = {
        "variables": [asdict(variable) for variable in variables],
        "coordinates": coordinates,
        "branches": plan.dimensions,
        "labels": plan.labels,
        **({"places": places} if places else {}),
        **({"noise_seeds": seeds} if seeds else {}),
    }
    return PartData(arrays, about)


def _in_si(
    arrays: dict[str, np.ndarray],
    variables: tuple[Variable, ...],
    points: Sequence[Mapping[str, Any]],
    units: list[Units],
    places: Mapping[str, Mapping[str, float]],
) -> tuple[Variable, ...]:
    """Scale arrays to SI units, each run by its own; return their descriptions."""
    for variable in variables:
        if variable.units in SI_UNITS:
            array, place = arrays[variable.name], places.get(variable.name, {})
            there = [lies_at(point, place) for point in points]
            sizes = np.array([unit.size(variable.units) for unit in units])[there]
            array *= sizes.reshape(-1, *[1] * (array.ndim - 1))
    return tuple(replace(v, units=SI_UNITS.get(v.units, v.units)) for v in variables)
