"""How solvers and failures look, the same in all figures of the comparison."""

from typing import Any

from damper.figures.common.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION
from damper.verification.comparison.errors import VERDICTS

#: One colour for a family of solvers; marker and line distinguish its members.
SOLVER_MARKS: dict[str, dict[str, Any]] = {
    "exact": {"color": BLACK, "marker": "o", "ls": "-"},
    "rk4_step_end": {"color": ORANGE, "marker": "v", "ls": "--"},
    "rk4_located": {"color": ORANGE, "marker": "^", "ls": "-"},
    "dop853": {"color": BLUE, "marker": "s", "ls": "-"},
    "dop853_free": {"color": BLUE, "marker": "d", "ls": ":"},
    "rk45": {"color": SKY, "marker": "D", "ls": "-"},
    "lsoda": {"color": GREEN, "marker": "P", "ls": "-"},
    "radau": {"color": GREEN, "marker": "X", "ls": "--"},
    "moreau_jean": {"color": VERMILION, "marker": "<", "ls": "-"},
    "compliant_flow": {"color": PURPLE, "marker": "p", "ls": "-"},
    "compliant_stiff": {"color": PURPLE, "marker": "h", "ls": "--"},
}
#: Names short enough for the heads of columns.
SHORT_LABELS = {
    "exact": "exact engine",
    "rk4_step_end": "RK4, step ends",
    "rk4_located": "RK4, located",
    "dop853": "DOP853",
    "dop853_free": "DOP853, no sticking",
    "rk45": "RK45",
    "lsoda": "LSODA",
    "radau": "Radau",
    "moreau_jean": "Moreau\N{EN DASH}Jean",
    "compliant_flow": "springs, exact",
    "compliant_stiff": "springs, Radau",
}
#: Failure -> how it is called at the margin, and the letter for it in a cell.
FAILURES = {
    "missed": ("events missed", "m"),
    "left_box": ("beyond a wall", "w"),
    "stalled": ("stalled", "s"),
    "capped": ("capped", "c"),
    "failed": ("failed", "f"),
}
assert set(FAILURES) == set(VERDICTS[1:])


def line_of(solver: str) -> dict[str, Any]:
    """Colour, marker and line of a solver."""
    return SOLVER_MARKS[solver] | {"ms": 3.2, "lw": 0.9, "mew": 0.0}
