"""Runs run in other ways: differences are the runs' condition; the method's errors are small."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from damper.figures.common.layout import legend, say, wrap
from damper.figures.common.style import BLUE, ORANGE, PAGE, PURPLE, VERMILION
from damper.verification.base import (
    Made,
    OptionalCaption,
)
from damper.verification.stress.tables.metamorphic import failures
from damper.verification.stress.verdicts import (
    ALLOWANCE,
    BORDER,
    CONDITIONS,
    EPS,
    GRAZING,
    GROWING,
    RELATIONS,
    SOUND,
    WELL,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Ways that change nothing but roundoff: what they differ by is roundoff times growth.
EXACT = tuple(name for name in RELATIONS if name not in ("sharper", "looser"))
_COLOURS = {WELL: BLUE, GROWING: VERMILION, GRAZING: PURPLE, BORDER: ORANGE}
_MARKS = {WELL: "o", GROWING: "^", GRAZING: "s", BORDER: "D"}
_DASHES = {WELL: "-", GROWING: "--", GRAZING: "-.", BORDER: ":"}
#: Where differences and backward errors of zero are drawn.
_NO_DIFFERENCE, _NO_ERROR = 1e-18, 1e-2


class MetamorphicFigure(Made):
    """How far runs are apart that must agree, beside what their condition makes of rounding."""

    reads: ClassVar[tuple[str, ...]] = ("metamorphic.nc",)

    caption: OptionalCaption = None


def draw(cube: xr.Dataset, *, caption: str | None = None) -> Figure:
    """Draw differences over the growth of a noise, and the distribution of backward errors.

    Parameters
    ----------
    cube : xarray.Dataset
        Of `damper.verification.stress.metamorphic_cube.gather_metamorphic`.
    caption : str, optional
        Heading; the dataset's title when not given.

    Returns
    -------
    matplotlib.figure.Figure
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(PAGE, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    count = cube.sizes["run"]
    words = [caption or cube.attrs.get("title", "")]
    if count:
        kinds = [kind for kind in _COLOURS if (cube.condition.values == kind).any()]
        _differences(left, cube, kinds)
        _errors(right, cube, kinds)
        handles = [
            left.plot([], [], _MARKS[kind], ms=3.5, ls=_DASHES[kind], lw=1.1, color=_COLOURS[kind])[
                0
            ]
            for kind in kinds
        ]
        for kind, handle in zip(kinds, handles, strict=True):
            runs = int((cube.condition.values == kind).sum())
            handle.set_label(f"{CONDITIONS[kind]} ({runs})")
        legend(figure, handles)
        failed = len(failures(cube))
        words.append(f"{count} runs, each made again in six ways; {failed or 'none'} failed")
    else:
        for ax in (left, right):
            say(ax, "no runs were compared")
            ax.set_axis_off()
    heading = [wrap(line.split(), 110.0) for line in words]
    figure.suptitle("\n".join(line for line in heading if line), fontsize=8.5)
    return figure


def largest(cube: xr.Dataset) -> np.ndarray:
    """Largest difference of each run in the ways that change roundoff only; NaN without any."""
    found = np.array([cube[f"{name}_difference"].values for name in EXACT])
    known = ~np.isnan(found)
    return np.where(known.any(axis=0), np.where(known, found, -1.0).max(axis=0), np.nan)


def _differences(ax: Axes, cube: xr.Dataset, kinds: list[int]) -> None:
    """Largest difference of the comparable events over the growth."""
    growth, found = cube.growth.values, largest(cube)
    shown = ~np.isnan(found)
    if not shown.any():
        say(ax, "no run has comparable events")
        return
    for kind in kinds:
        some = shown & (cube.condition.values == kind)
        ax.plot(
            growth[some],
            np.maximum(found[some], _NO_DIFFERENCE),
            _MARKS[kind],
            ms=2.2,
            mew=0.0,
            alpha=0.6,
            color=_COLOURS[kind],
            rasterized=True,
        )
    reach = np.array([1.0, max(10.0 * float(growth[shown].max()), 1e3)])
    ax.plot(reach, EPS * reach, color="black", lw=0.9)
    ax.plot(reach, ALLOWANCE * EPS * reach, color="black", lw=0.9, ls="--")
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlim(reach[0] / 2.0, reach[1])
    top = max(ALLOWANCE * EPS * reach[1], float(np.nanmax(found)))
    ax.set_ylim(_NO_DIFFERENCE / 3.0, 10.0 * top)
    ax.set_xlabel("growth of a small noise over the run")
    ax.set_ylabel("largest difference of comparable events")
    # Named where nothing lies: above the one line, and far below the other.
    ax.text(
        0.03,
        0.97,
        f"dashed: {ALLOWANCE:g} units of roundoff $\\times$ growth; beyond it\n"
        "judged by backward error\n"
        "solid: one unit roundoff $\\times$ growth",
        transform=ax.transAxes,
        va="top",
        fontsize=7.0,
    )


def _errors(ax: Axes, cube: xr.Dataset, kinds: list[int]) -> None:
    """Part of each class with at least a backward error."""
    from matplotlib.ticker import LogLocator

    errors = cube.backward_error.values
    if np.isnan(errors).all():
        say(ax, "no run has a backward error")
        return
    for kind in kinds:
        values = errors[(cube.condition.values == kind) & ~np.isnan(errors)]
        if not values.size:
            continue
        values = np.sort(np.maximum(values, _NO_ERROR))
        share = 1.0 - np.arange(values.size) / values.size
        ax.step(
            np.concatenate(([_NO_ERROR], values)),
            np.concatenate(([1.0], share)),
            where="pre",
            color=_COLOURS[kind],
            ls=_DASHES[kind],
            lw=1.1,
        )
        ax.plot(values[-1:], share[-1:], _MARKS[kind], ms=3.5, color=_COLOURS[kind])
    ax.axvline(SOUND, color="black", lw=0.9, ls="--")
    ax.annotate(
        "limit",
        (SOUND, 1.0),
        xycoords=("data", "axes fraction"),
        xytext=(-3, -2),
        textcoords="offset points",
        va="top",
        ha="right",
        fontsize=7.0,
    )
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlim(_NO_ERROR, max(10.0 * SOUND, 2.0 * float(np.nanmax(errors))))
    ax.xaxis.set_major_locator(LogLocator(numticks=8))
    ax.set_xlabel(r"backward error, in units of roundoff ($2^{-52}$)")
    ax.set_ylabel("part of the runs with at least that")
