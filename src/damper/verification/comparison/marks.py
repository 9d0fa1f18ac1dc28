"""How solvers and failures look, the same in all figures of the comparison."""

from typing import Any

from damper.figures.common.style import BLACK, BLUE, ORANGE, VERMILION

#: One colour for a family of solvers; marker and line distinguish its members.
SOLVER_MARKS: dict[str, dict[str, Any]] = {
    "exact": {"color": BLACK, "marker": "o", "ls": "-"},
    "rk4_step_end": {"color": ORANGE, "marker": "v", "ls": "--"},
    "rk4_located": {"color": ORANGE, "marker": "^", "ls": "-"},
    "dop853": {"color": BLUE, "marker": "s", "ls": "-"},
    "moreau_jean": {"color": VERMILION, "marker": "<", "ls": "-"},
}
#: Failure -> how it is called at the margin, and the letter for it in a cell.
FAILURES = {
    "missed": ("events missed", "m"),
    "left_box": ("beyond a wall", "w"),
    "stalled": ("stalled", "s"),
    "capped": ("capped", "c"),
    "failed": ("failed", "f"),
}


def line_of(solver: str) -> dict[str, Any]:
    """Colour, marker and line of a solver."""
    return SOLVER_MARKS[solver] | {"ms": 3.2, "lw": 0.9, "mew": 0.0}
