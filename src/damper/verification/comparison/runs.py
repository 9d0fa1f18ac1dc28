"""Every solver at every setting on one scene: errors and outcome of each run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import nan
from typing import Any

import numpy as np

from damper.sweep.parts import PartData
from damper.verification.comparison import errors
from damper.verification.comparison.reference import Reference, as_floats
from damper.verification.comparison.scene import Scene, read_scene
from damper.verification.comparison.solvers import in_order, load


def run_part(
    needed: Sequence[PartData],
    scene: Mapping[str, Any],
    solvers: Mapping[str, Sequence[float]],
    cap: float,
) -> PartData:
    """Run all solvers on a scene as a job of the workflow, which needs its reference."""
    (reference,) = needed
    return PartData(run_scene(read_scene(**scene), solvers, as_floats(reference.about), cap))


def run_scene(
    scene: Scene, settings: Mapping[str, Sequence[float]], reference: Reference, cap: float
) -> dict[str, np.ndarray]:
    """Run all solvers on one scene, with their levels from coarse to fine.

    `cap` is what a run may cost, in seconds of a nominal machine; see `Solver.most_evaluations`.
    Arrays have the shape (solver, level), solvers in the order of `SOLVERS`, padded to the solver
    with the most levels: `MEASURES` and ``reached`` (NaN where there is no run), and ``outcome``
    (index in `OUTCOMES`, -1 where there is no run). And of the scene, without dimensions:
    ``reference_impacts`` that count, ``until``, ``periods``.
    """
    names = in_order(settings)
    shape = len(names), max(map(len, settings.values()))
    arrays = {name: np.full(shape, nan) for name in (*(v.name for v in errors.MEASURES), "reached")}
    arrays["outcome"] = np.full(shape, -1, dtype="i1")
    for row, name in enumerate(names):
        solver = load(name)
        for level, setting in enumerate(settings[name]):
            solution = solver.solve(scene, setting, solver.most_evaluations(cap))
            outcome, measured = errors.measure_errors(scene, reference, solution)
            for key, value in measured.items():
                arrays[key][row, level] = value
            arrays["outcome"][row, level] = errors.OUTCOMES.index(outcome)
            arrays["reached"][row, level] = solution.reached
    return arrays | {
        "reference_impacts": np.array(errors.counted_impacts(reference)),
        "until": np.array(scene.until),
        "periods": np.array(scene.periods),
    }
