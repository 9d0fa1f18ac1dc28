"""The solvers of a comparison, one file each.

A solver is a module here with

``LABEL``
    its name in figures and tables;
``SETTING``
    the one thing that is varied to make it more exact, such as ``tolerance``;
``FINER``
    -1 or +1: whether a smaller or a larger value of it is the finer one;
``MODELS``
    the models of the damper that it takes on, of ``rigid`` and ``compliant``;
``EVALUATIONS_PER_SECOND``
    how fast it is, roughly: a cap in seconds is kept as a cap in evaluations, so that what is
    capped does not change with the load of the machine;
``solve(scene, setting, *, times=(), balance=False, max_evaluations=...)``
    which returns a `damper.verification.comparison.solution.Solution` and never raises for what a
    scene does to it: failures are outcomes. ``times`` are where states are wanted, ascending;
    ``balance`` asks for the energy residual. What is not asked for is not computed.
"""

from importlib import import_module
from types import ModuleType

#: Names of all solvers, in the order in which figures show them.
SOLVERS = (
    "exact",
    "rk4_step_end",
    "rk4_located",
    "dop853",
    "dop853_free",
    "rk45",
    "lsoda",
    "radau",
    "moreau_jean",
    "compliant_flow",
    "compliant_stiff",
)


def load(name: str) -> ModuleType:
    """Return the module of a solver; nothing else of this package's solvers is imported."""
    return import_module(f"damper.verification.comparison.solvers.{name}")
