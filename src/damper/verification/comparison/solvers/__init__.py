"""The solvers of a comparison, and how each describes itself."""

from __future__ import annotations

from collections.abc import Callable, Container
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # a solver is loaded when it is asked for
    from damper.verification.comparison.scene import Scene
    from damper.verification.comparison.solution import Solution

#: Names of the modules with a `SOLVER`, in the order of figures and cubes.
SOLVERS = ("exact", "dop853", "rk4_located", "rk4_step_end", "moreau_jean")


@dataclass(frozen=True)
class Solver:
    """One way to simulate the damper."""

    setting: str
    """The one thing that is varied to make it more exact, such as ``tolerance``."""
    evaluations_per_second: float
    """How fast it is, roughly; see `most_evaluations`."""
    solve: Callable[[Scene, float, int], Solution]
    """Runs a scene with a setting and a limit on the evaluations, after which it is given up.

    A failure is an outcome of the solution, not an error.
    """

    def most_evaluations(self, cap: float) -> int:
        """Evaluations that a cap in seconds is kept as, so that the machine's load is no matter."""
        return max(int(cap * self.evaluations_per_second), 1)


def load(name: str) -> Solver:
    """Return a solver; no other module of this package is imported."""
    solver: Solver = import_module(f"{__name__}.{name}").SOLVER
    return solver


def in_order(names: Container[str]) -> list[str]:
    """Return the names in the order of `SOLVERS`."""
    return [name for name in SOLVERS if name in names]
