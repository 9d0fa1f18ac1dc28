"""Slices: the part of a study's cube that one simulation job makes."""

import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from damper.observers import make_observers
from damper.parameters import State
from damper.parameters.quantities import is_si
from damper.parameters.run import RunSettings
from damper.parameters.variables import SI_UNITS, Variable
from damper.sweep.branches import Branches, branches
from damper.sweep.estimate import Workload, run_sizes
from damper.sweep.grid import product
from damper.sweep.parts import PartData
from damper.sweep.progress import Progress, progress_lines


@dataclass(frozen=True)
class Slice:
    """What a simulation job made: arrays over its runs, their descriptions and coordinates.

    The runs are the product of the job's axes and of `branches`, such as both directions of a
    continuation. `labels` are drawn quantities along the branch dimension `draw`.
    """

    arrays: dict[str, np.ndarray]
    variables: tuple[Variable, ...]
    coordinates: dict[str, list[float]]
    branches: dict[str, list[Any]] = field(default_factory=dict)
    labels: dict[str, list[float]] = field(default_factory=dict)

    @property
    def part(self) -> PartData:
        """The slice as a file holds it."""
        about = asdict(replace(self, arrays={}))
        del about["arrays"]
        return PartData(self.arrays, about)

    @classmethod
    def of(cls, part: PartData) -> "Slice":
        """Return the slice that a file holds."""
        about = dict(part.about)
        variables = tuple(
            Variable(**{**entry, "dims": tuple(entry["dims"]), "flags": tuple(entry["flags"])})
            for entry in about.pop("variables")
        )
        return cls(part.arrays, variables, **about)


def run_part(needed: Sequence[PartData] = (), **settings: Any) -> PartData:
    """Simulate a slice as a job of the workflow, whose log says how far it is.

    `settings` are arguments of `simulate_slice`.
    """
    return simulate_slice(**settings, progress=progress_lines(sys.stderr)).part


def simulate_slice(
    fixed: Mapping[str, float],
    axes: Mapping[str, Sequence[float]],
    *,
    observers: Iterable[str] | Mapping[str, Mapping[str, Any] | None],
    primary: str = "rest",
    draws: Mapping[str, Any] | None = None,
    follow: Mapping[str, str] | None = None,
    state: State | None = None,
    progress: Progress | None = None,
    workers: int | None = 1,
    **run: Any,
) -> Slice:
    """Simulate one slice.

    Parameters
    ----------
    fixed : mapping of str to float
        Fixed quantities, and the slice's place along the fanned axes.
    axes : mapping of str to values
        The axes that run inside the job.
    observers, primary, state, progress, workers, **run
        As for `damper.sweep.runs.run_points`.
    draws : mapping, optional
        As for `damper.sweep.branches.draw`.
    follow : mapping of str to str, optional
        The axis to be followed by continuation -> "up", "down" or "both".

    Returns
    -------
    Slice
        In SI units if the points are given in them.

    Raises
    ------
    ValueError, TypeError
        As `run_points`, and for too many runs before they are listed.
    """
    # Loads the engine, and numba with it; reading a slice needs neither.
    from damper.sweep.runs import run_points

    settings = RunSettings(**run)
    observers = list(observers) if isinstance(observers, Iterator) else observers
    counts = {name: len(values) for name, values in axes.items()}
    draws = draws or {}
    sizes = run_sizes(counts, draws.get("count"), follow or {})
    made = make_observers(observers)
    Workload(sizes, settings.transient, settings.periods, made).refuse_excess()
    plan = branches(product(axes, fixed), axes, draws, follow or {})
    arrays, made = run_points(
        plan.points,
        observers,
        primary=primary,
        state=state,
        after=plan.after,
        progress=progress,
        workers=workers,
        **run,
    )
    variables = tuple(variable for observer in made for variable in observer.variables)
    if is_si([*fixed, *axes, *plan.labels]):
        variables = _in_si(arrays, variables, plan)
    return Slice(
        arrays,
        variables,
        {k: v.tolist() for observer in made for k, v in observer.coordinates().items()},
        plan.dimensions,
        plan.labels,
    )


def _in_si(
    arrays: dict[str, np.ndarray], variables: tuple[Variable, ...], plan: Branches
) -> tuple[Variable, ...]:
    """Scale arrays to SI units, each run by its own; return their descriptions."""
    from damper.sweep.points import read_point

    units = [read_point(point).units for point in plan.points]
    for variable in variables:
        if variable.units in SI_UNITS:
            array = arrays[variable.name]
            sizes = np.array([unit.size(variable.units) for unit in units])
            array *= sizes.reshape(-1, *[1] * (array.ndim - 1))
    return tuple(replace(v, units=SI_UNITS.get(v.units, v.units)) for v in variables)
