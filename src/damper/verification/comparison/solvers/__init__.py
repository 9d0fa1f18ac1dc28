"""The solvers of a comparison, and how each describes itself."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
    "compliant_stiff": "scipy_methods",
}


@dataclass(frozen=True)
class Solver:
    """One way to simulate the damper; a module here has one or more of them in its `SOLVERS`."""

    setting: str
    """The one thing that is varied to make it more exact, such as ``tolerance``."""
    finer: int
    """-1 or +1: whether a smaller or a larger setting is the finer one."""
    models: tuple[str, ...]
    """Models of the damper that it simulates, of ``rigid`` and ``compliant``."""
    evaluations_per_second: float
    """How fast it is, roughly: a cap in seconds is kept as a cap in evaluations, so that what is
    capped does not change with the load of the machine."""
    method: Callable[[Scene, float, Sequence[float], bool, int], Solution]
    """What `solve` calls, with all of its arguments by position."""

    def solve(
        self,
        scene: Scene,
        setting: float,
        *,
        times: Sequence[float] = (),
        balance: bool = False,
        max_evaluations: int | None = None,
    ) -> Solution:
        """Run a scene. What is not asked for is not computed.

        Parameters
        ----------
        scene : Scene
        setting : float
        times : sequence of float, optional
            Where states are wanted, ascending.
        balance : bool, default False
            Whether the energy residual is wanted.
        max_evaluations : int, optional
            Evaluations after which the run is given up; those of two seconds when not given.

        Returns
        -------
        Solution
            A failure is an outcome of it, not an error.

        Raises
        ------
        ValueError
            For a setting out of range.
        """
        most = max_evaluations or int(2.0 * self.evaluations_per_second)
        return self.method(scene, setting, times, balance, most)


def load(name: str) -> Solver:
    """Return a solver; no other module of this package is imported."""
    solver: Solver = import_module(module_of(name)).SOLVERS[name]
    return solver


def module_of(name: str) -> str:
    """Full name of the module that has a solver."""
    return f"{__name__}.{SOLVERS[name]}"
