"""Schematics: the mechanical models of both papers, drawn from springs, dashpots and masses.

They show no results, so they need no cube. Lengths are those of the drawing itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from textwrap import wrap
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from damper.figures.common.style import BLACK, COLUMN
from damper.parameters.lazy import Axes, Figure
from damper.study.fields import Text
from damper.study.products import Product
from damper.study.study_file import See

_LINE: dict[str, Any] = {"color": BLACK, "lw": 0.9, "solid_capstyle": "butt"}
_THIN: dict[str, Any] = {"color": BLACK, "lw": 0.5, "solid_capstyle": "butt"}
_HATCH: dict[str, Any] = {"color": "#555555", "lw": 0.5}
_BODY: dict[str, Any] = {"facecolor": "#DCE6EE", "edgecolor": BLACK, "lw": 0.9}
_FREE: dict[str, Any] = {"facecolor": "#F6D9B8", "edgecolor": BLACK, "lw": 0.9}
_LETTERS = 9.0
"""Size of the symbols, in points."""
_CAPTION = 58
"""Letters in a line of the heading."""


class Schematic(Product):
    """The mechanical model of a paper, drawn by code; it shows no results and waits for none."""

    reads: ClassVar[tuple[str, ...]] = ()

    drawing: Annotated[
        Literal["impact_damper", "two_degrees_of_freedom", "collision_system", "damper"],
        Field(
            description="Paper A's free mass in a box; its form with two degrees of freedom; "
            "paper B's model; the damper in the symbols of docs/concepts.md."
        ),
    ]
    caption: Annotated[Text | None, Field(description="Heading; none when not given.")] = None
    see: See = None


def draw(results: Mapping[str, Any], settings: Schematic) -> Figure:
    """Draw the schematic of a mechanical model."""
    figure, ax = sheet()
    DRAWINGS[settings.drawing](ax)
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    height = COLUMN * (top - bottom) / (right - left)
    if settings.caption is not None:
        lines = wrap(settings.caption, _CAPTION)
        figure.suptitle("\n".join(lines), fontsize=8.5)
        height += 0.15 * (len(lines) + 1)
    figure.set_size_inches(COLUMN, height)
    return figure


def sheet() -> tuple[Figure, Axes]:
    """Return a figure to draw on: nothing but what is drawn, and lengths alike either way."""
    from matplotlib.figure import Figure

    figure = Figure(layout="constrained")
    ax = figure.subplots()
    ax.set_aspect("equal")
    ax.set_axis_off()
    return figure, ax


def _impact_damper(ax: Axes) -> None:
    """Draw paper A's Fig. 1: a free mass between the walls of a box on spring and dashpot."""
    box(ax, "$M$", "$m$", "$K_1$", "$C_1$", "$F(t)$", "$X_1$", "$X_2$")
    _clearances(ax)


def _damper(ax: Axes) -> None:
    """Draw the same in the symbols of docs/concepts.md."""
    box(ax, "$M$", "$m$", "$K$", "$C$", "$F(t)$", "$x$", "$y$")
    _clearances(ax)


def _clearances(ax: Axes) -> None:
    for first, last in ((3.6, 5.2), (6.2, 7.8)):
        dimension(ax, first, last, 1.6, "$D$")


def _collision_system(ax: Axes) -> None:
    """Draw paper B's Fig. 1: the rigid damper in the paper's symbols; the gap has no symbol."""
    box(ax, "$M_1$", "$M_2$", "$K$", "$C$", "$F$", "$X$", "$Y$")


def _two_degrees_of_freedom(ax: Axes) -> None:
    """Draw paper A's Fig. 2: the two masses tied to the fixed end, with stops between them."""
    from matplotlib.patches import Polygon

    _ground(ax, (0.0, 5.2), (0.0, 0.0))
    _ground(ax, (0.0, 0.0), (9.6, 0.0))
    # Between its stops the primary leaves room for the tongue of the free mass below it.
    stops = [(3.2, 2.9), (4.3, 2.9), (4.3, 2.2), (4.7, 2.2), (4.7, 3.4), (7.7, 3.4), (7.7, 2.2)]
    ax.add_patch(Polygon([*stops, (8.2, 2.2), (8.2, 4.8), (3.2, 4.8)], closed=True, **_BODY))
    tongue = [(6.6, 1.9), (6.6, 3.1), (5.8, 3.1), (5.8, 1.9)]
    free = [(3.2, 0.4), (8.2, 0.4), (8.2, 1.9), *tongue, (3.2, 1.9)]
    ax.add_patch(Polygon(free, closed=True, **_FREE))
    for x in (3.9, 7.5):
        _wheel(ax, x)
    _spring(ax, 0.0, 3.2, 4.3, "$K_1$")
    _dashpot(ax, 0.0, 3.2, 3.25, "$C_1$")
    _spring(ax, 0.0, 3.2, 1.7, "$K_2$")
    _dashpot(ax, 0.0, 3.2, 0.65, "$C_2$")
    _write(ax, 6.2, 4.1, "$M$")
    _write(ax, 6.2, 1.15, "$m(t)$")
    for first, last in ((4.7, 5.8), (6.6, 7.7)):
        dimension(ax, first, last, 2.55, "$D$")
    _arrow(ax, (8.2, 3.8), (9.5, 3.8), "$F(t)$")
    _coordinate(ax, 3.2, 4.8, "$X_1$")
    _arrow(ax, (8.2, 1.15), (9.15, 1.15), "$X_2$", thin=True)
    ax.set_xlim(-0.5, 9.8)
    ax.set_ylim(-0.5, 5.8)


DRAWINGS: dict[str, Callable[[Axes], None]] = {
    "impact_damper": _impact_damper,
    "two_degrees_of_freedom": _two_degrees_of_freedom,
    "collision_system": _collision_system,
    "damper": _damper,
}


def box(
    ax: Axes,
    body: str,
    free: str,
    stiffness: str,
    damping: str,
    force: str,
    displacement: str,
    free_displacement: str,
) -> None:
    """Draw a ball between the walls of a box that a spring and a dashpot tie to the ground."""
    from matplotlib.patches import Circle, Polygon, Rectangle

    _ground(ax, (0.0, 3.9), (0.0, 0.0))
    _ground(ax, (0.0, 0.0), (9.6, 0.0))
    outside = [(3.2, 0.4), (8.2, 0.4), (8.2, 3.5), (3.2, 3.5)]
    ax.add_patch(Polygon(outside, closed=True, **_BODY))
    ax.add_patch(Rectangle((3.6, 1.1), 4.2, 2.0, facecolor="white", edgecolor=BLACK, lw=0.9))
    for x in (3.9, 7.5):
        _wheel(ax, x)
    ax.add_patch(Circle((5.7, 1.6), 0.5, **_FREE))
    _spring(ax, 0.0, 3.2, 2.8, stiffness)
    _dashpot(ax, 0.0, 3.2, 1.4, damping)
    _write(ax, 5.7, 0.75, body)
    _write(ax, 5.7, 1.6, free)
    if force:
        _arrow(ax, (8.2, 2.2), (9.5, 2.2), force)
    _coordinate(ax, 3.2, 3.5, displacement)
    _coordinate(ax, 5.7, 2.1, free_displacement)
    ax.set_xlim(-0.5, 9.8)
    ax.set_ylim(-0.5, 4.5)


def box_with_ball(
    ax: Axes,
    inside: float,
    gap: float,
    ball: str,
    travel: str,
    length: str,
    boxes: int = 1,
    motion: str = "direction of motion",
) -> None:
    """Draw a ball at one wall of its box, and with a dashed line where it comes to rest last.

    Several boxes alike stand side by side across the direction of motion.
    """
    from matplotlib.patches import Circle, Rectangle

    size, wall = inside - gap, 0.5
    high = size + 0.1
    step, dashed = high + wall, {"fill": False, "edgecolor": "#555555", "lw": 0.6}
    top, below = (boxes - 1) * step + high + wall, -wall
    ax.add_patch(Rectangle((-wall, -wall), inside + 2 * wall, top + wall, **_BODY))
    for k in range(boxes):
        low, at = k * step, k * step + 0.5 * size
        inner = Rectangle((0.0, low), inside, high, facecolor="white", edgecolor=BLACK, lw=0.9)
        ax.add_patch(inner)
        last = Circle((0.5 * size + gap, at), 0.5 * size, ls=(0, (4, 3)), **dashed)
        ax.add_patch(last)
        ax.add_patch(Circle((0.5 * size, at), 0.5 * size, **_FREE))
    for x in (0.0, size, inside):
        ax.plot([x, x], [0.0 if x == size else below, below - 1.2], **_THIN)
    ax.plot([size, size], [0.5 * size, 0.0], **_THIN)
    dimension(ax, 0.0, size, below - 0.6, ball, 7.0)
    dimension(ax, size, inside, below - 0.6, travel, 7.0)
    for x in (0.0, inside):
        ax.plot([x, x], [below - 1.2, below - 1.8], **_THIN)
    dimension(ax, 0.0, inside, below - 1.6, length, 7.0)
    arrow = {"arrowstyle": "<|-|>", "shrinkA": 0.0, "shrinkB": 0.0, "mutation_scale": 9.0}
    at = 0.5 * inside
    ends = (at + 1.5, top + 0.3), (at - 1.5, top + 0.3)
    ax.annotate("", *ends, arrowprops=arrow | {"color": BLACK, "lw": 1.2})
    _write(ax, at, top + 0.45, motion, "bottom", 7.0)
    ax.set_xlim(-wall - 0.2, inside + wall + 0.2)
    ax.set_ylim(below - 2.0, top + 1.1)


def rotor(ax: Axes, unbalance: str) -> None:
    """Draw a rotor with an unbalance on the box."""
    from matplotlib.patches import Circle

    ax.add_patch(Circle((8.75, 2.2), 0.55, **_BODY))
    ax.add_patch(Circle((8.75, 2.2), 0.06, fc="white", ec=BLACK, lw=0.7))
    ax.add_patch(Circle((9.0, 2.45), 0.13, fc=BLACK, ec=BLACK, lw=0.0))
    turn = {"arrowstyle": "-|>", "connectionstyle": "arc3,rad=0.45", "shrinkA": 0.0, "shrinkB": 0.0}
    arrow = turn | {"color": BLACK, "lw": 0.5, "mutation_scale": 6.0}
    ax.annotate("", (8.3, 2.8), (9.2, 2.8), arrowprops=arrow)
    _write(ax, 8.75, 3.65, unbalance, "bottom")


def moving_base(ax: Axes, text: str) -> None:
    """Draw how the ground moves."""
    arrow = {"arrowstyle": "<|-|>", "shrinkA": 0.0, "shrinkB": 0.0, "mutation_scale": 9.0}
    ax.annotate("", (0.75, 3.9), (-0.45, 3.9), arrowprops=arrow | {"color": BLACK, "lw": 1.2})
    _write(ax, 0.15, 4.05, text, "bottom")


def _write(
    ax: Axes, x: float, y: float, text: str, vertical: str = "center", size: float = _LETTERS
) -> None:
    ax.text(x, y, text, ha="center", va=vertical, fontsize=size)


def _spring(ax: Axes, first: float, last: float, y: float, text: str) -> None:
    lead = 0.16 * (last - first)
    heights = np.full(14, y)
    heights[1:-1] += 0.22 * np.resize([1.0, -1.0], 12)
    coil = np.linspace(first + lead, last - lead, 14)
    ax.plot([first, *coil, last], [y, *heights, y], **_LINE)
    _write(ax, 0.5 * (first + last), y + 0.3, text, "bottom")


def _dashpot(ax: Axes, first: float, last: float, y: float, text: str) -> None:
    """Draw a cylinder on the wall's side and a piston on the mass's."""
    length = last - first
    back, front, piston = first + 0.34 * length, first + 0.66 * length, first + 0.54 * length
    ax.plot([first, back], [y, y], **_LINE)
    ax.plot([front, back, back, front], [y + 0.22, y + 0.22, y - 0.22, y - 0.22], **_LINE)
    ax.plot([piston, piston], [y - 0.17, y + 0.17], **(_LINE | {"lw": 1.6}))
    ax.plot([piston, last], [y, y], **_LINE)
    _write(ax, 0.5 * (first + last), y + 0.28, text, "bottom")


def _ground(ax: Axes, first: tuple[float, float], last: tuple[float, float]) -> None:
    """Draw a fixed line, hatched on its right side as one goes from first to last."""
    start, end = np.array(first), np.array(last)
    along = (end - start) / np.hypot(*(end - start))
    out = np.array([along[1], -along[0]])
    ax.plot(*zip(first, last, strict=True), **_LINE)
    for distance in np.arange(0.12, np.hypot(*(end - start)), 0.24):
        foot = start + distance * along
        tip = foot + 0.26 * (out - 0.8 * along)
        ax.plot(*zip(foot, tip, strict=True), **_HATCH)


def _wheel(ax: Axes, x: float) -> None:
    """Draw a wheel below a mass: it moves along the ground without friction."""
    from matplotlib.patches import Circle

    ax.add_patch(Circle((x, 0.2), 0.2, fc="white", ec=BLACK, lw=0.7))


def dimension(
    ax: Axes, first: float, last: float, y: float, text: str, size: float = _LETTERS
) -> None:
    """Draw a length with its arrows, and its text above."""
    arrow = {"arrowstyle": "<|-|>", "shrinkA": 0.0, "shrinkB": 0.0, "mutation_scale": 5.0}
    ax.annotate("", (last, y), (first, y), arrowprops=arrow | {"color": BLACK, "lw": 0.5})
    _write(ax, 0.5 * (first + last), y + 0.08, text, "bottom", size)


def _arrow(
    ax: Axes, first: tuple[float, float], last: tuple[float, float], text: str, thin: bool = False
) -> None:
    width, head = (0.5, 6.0) if thin else (1.2, 9.0)
    arrow = {"arrowstyle": "-|>", "shrinkA": 0.0, "shrinkB": 0.0, "mutation_scale": head}
    ax.annotate("", last, first, arrowprops=arrow | {"color": BLACK, "lw": width})
    _write(ax, 0.5 * (first[0] + last[0]), last[1] + 0.12, text, "bottom")


def _coordinate(ax: Axes, x: float, y: float, text: str) -> None:
    """Draw the mark of a displacement: from a point on the mass, positive to the right."""
    ax.plot([x, x], [y, y + 0.55], **_THIN)
    arrow = {"arrowstyle": "-|>", "shrinkA": 0.0, "shrinkB": 0.0, "mutation_scale": 6.0}
    ax.annotate(
        "", (x + 0.95, y + 0.4), (x, y + 0.4), arrowprops=arrow | {"color": BLACK, "lw": 0.5}
    )
    ax.text(x + 1.05, y + 0.4, text, ha="left", va="center", fontsize=_LETTERS)
