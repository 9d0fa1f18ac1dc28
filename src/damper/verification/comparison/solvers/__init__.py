"""The solvers of a comparison, and how each describes itself."""

from __future__ import annotations

from collections.abc import Callable, Container
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # a solver is loaded when it is asked for
    from damper.verification.comparison.scene import Scene
    from damper.verification.comparison.solution import Solution

#: Name of each solver, in the order in which figures show them, and the module here that has it.
SOLVERS = {
    "exact": "exact",
    "rk4_step_end": "rk4_step_end",
    "rk4_located": "rk4_located",
    "dop853": "scipy_methods",
    "dop853_free": "scipy_methods",
    "rk45": "scipy_methods",
    "lsoda": "scipy_methods",
    "radau": "scipy_methods",
    "moreau_jean": "moreau_jean",
    "compliant_flow": "compliant_flow",
}


@dataclass(frozen=True)
class Solver:
    """One way to simulate the damper; a module here has one or more of them in its `SOLVERS`."""

    setting: str
    """The one thing that is varied to make it more exact, such as ``tolerance``."""
    finer: int
    """-1 or +1: whether a smaller or a larger setting is the finer one."""
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
    solver: Solver = import_module(module_of(name)).SOLVERS[name]
    return solver


def module_of(name: str) -> str:
    """Full name of the module that has a solver."""
    return f"{__name__}.{SOLVERS[name]}"


def in_order(names: Container[str]) -> list[str]:
    """Those of the `SOLVERS` that are asked for, in the order of figures and cubes."""
    return [name for name in SOLVERS if name in names]
