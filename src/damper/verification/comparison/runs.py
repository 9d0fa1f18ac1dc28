"""Every solver at every setting on one scene: what each run is off by, and how it ended."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from math import nan
from typing import TYPE_CHECKING

import numpy as np

from damper.verification.comparison.errors import (
    MEASURES,
    VERDICTS,
    counted_impacts,
    measure_errors,
    verdict,
)
from damper.verification.comparison.solution import OUTCOMES
from damper.verification.comparison.solvers import SOLVERS, Solver, load

if TYPE_CHECKING:  # these bring mpmath and the engine along
    from damper.verification.comparison.reference import Reference
    from damper.verification.comparison.scene import Scene

#: Code in place of that of an outcome: the solver has no such model, or no such level.
NOT_APPLICABLE = -1


def run_scene(
    scene: Scene, settings: Mapping[str, Sequence[float]], reference: Reference, cap: float
) -> dict[str, np.ndarray]:
    """Run all solvers on one scene.

    Parameters
    ----------
    scene : Scene
    settings : mapping of str to sequence of float
        Levels of each solver, coarse to fine.
    reference : Reference
    cap : float
        What a run may cost, in seconds of a nominal machine: a solver may make ``cap`` times its
        ``evaluations_per_second`` evaluations, so that what is capped is the same on every machine.

    Returns
    -------
    dict of str to ndarray
        Of shape (solver, level), solvers in the order of `SOLVERS`, padded to the solver with the
        most levels: `MEASURES` and ``setting``, ``reached`` (NaN where there is no run), and
        ``outcome`` (index in `OUTCOMES`, or `NOT_APPLICABLE`), ``verdict`` (likewise in
        `damper.verification.comparison.errors.VERDICTS`). And of the scene, without dimensions:
        ``reference_impacts`` that count, ``sensitivity``, ``until``, ``periods``, ``rigid`` (1 or
        0).

    Raises
    ------
    ValueError
        For an unknown solver, with the nearest known one, or levels that are not positive.
    """
    names = solver_names(settings)
    shape = (len(names), max(map(len, settings.values()), default=0))
    arrays = {name: np.full(shape, nan) for name in ("setting", *MEASURES, "reached")}
    for name in ("outcome", "verdict"):
        arrays[name] = np.full(shape, NOT_APPLICABLE, dtype="i1")
    for row, name in enumerate(names):
        solver = load(name)
        arrays["setting"][row, : len(settings[name])] = settings[name]
        if scene.model not in solver.models:
            continue
        for level, setting in enumerate(settings[name]):
            solution = solver.solve(
                scene,
                setting,
                times=[scene.until],
                balance=True,
                max_evaluations=most_evaluations(solver, cap),
            )
            measured = measure_errors(scene, reference, solution)
            for key, value in measured.items():
                arrays[key][row, level] = value
            found = verdict(scene, solution, measured)
            arrays["verdict"][row, level] = VERDICTS.index(found)
            arrays["outcome"][row, level] = OUTCOMES.index(solution.outcome)
            arrays["reached"][row, level] = solution.reached
    arrays["reference_impacts"] = np.array(counted_impacts(reference))
    arrays["sensitivity"] = np.array(float(reference.sensitivity))
    arrays["until"] = np.array(scene.until)
    arrays["periods"] = np.array(scene.periods)
    arrays["rigid"] = np.array(scene.model == "rigid", dtype="i1")
    return arrays


def solver_names(settings: Mapping[str, Sequence[float]]) -> list[str]:
    """Names of the solvers in `SOLVERS`' order, once they and their levels are known to be right.

    Raises
    ------
    ValueError
        For an unknown solver, with the nearest known one, or levels that are not positive.

    Examples
    --------
    >>> solver_names({"lsoda": [1e-6], "exact": [1e-12]})
    ['exact', 'lsoda']
    >>> solver_names({"exakt": [1e-12]})
    Traceback (most recent call last):
    ...
    ValueError: unknown solver 'exakt': did you mean 'exact'?
    """
    for name, levels in settings.items():
        if name not in SOLVERS:
            close = get_close_matches(name, SOLVERS, 1)
            hint = (
                f"did you mean {close[0]!r}?" if close else f"must be one of {', '.join(SOLVERS)}"
            )
            raise ValueError(f"unknown solver {name!r}: {hint}")
        if not levels or not all(0.0 < level < np.inf for level in levels):
            raise ValueError(f"{name} = {list(levels)!r}: must be finite numbers above 0")
    return [name for name in SOLVERS if name in settings]


def most_evaluations(solver: Solver, cap: float) -> int:
    """Evaluations that a cap in seconds stands for."""
    return max(int(cap * solver.evaluations_per_second), 1)
