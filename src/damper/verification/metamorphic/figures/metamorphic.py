"""Runs run in other ways: differences are the runs' condition; the method's errors are small."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from damper.engine.roundoff import EPSILON
from damper.figures.common.layout import heading
from damper.figures.common.panels import note_empty_panel, panel_grid
from damper.figures.common.style import BLUE, VERMILION
from damper.parameters.lazy import Axes, Figure, xr
from damper.verification.base import Made, OptionalCaption, See
from damper.verification.metamorphic.tables.metamorphic import failures
from damper.verification.metamorphic.verdicts import ALLOWANCE, PASSED, RELATIONS, SOUND

#: Ways that change nothing but roundoff: what they differ by is roundoff times growth.
EXACT = tuple(name for name in RELATIONS if name not in ("sharper", "looser"))
#: Where differences and backward errors of zero are drawn.
_NO_DIFFERENCE, _NO_ERROR = 1e-19, 1e-2


class MetamorphicFigure(Made):
    """How far runs are apart that must agree, beside what their condition makes of rounding."""

    caption: OptionalCaption = None
    see: See = None


def draw(results: Mapping[str, Any], settings: MetamorphicFigure) -> Figure:
    """Draw differences over the growth of a noise, and the distribution of backward errors."""
    cube = results["cube"]
    figure, ((left, right),) = panel_grid(1, 2, height=3.3, sharex=False)
    count = cube.sizes["run"]
    _differences(left, cube)
    _errors(right, cube)
    words = [
        settings.caption or cube.attrs.get("title", ""),
        f"{count} runs, each repeated in six ways; {len(failures(cube)) or 'none'} failed",
    ]
    heading(figure, *(line.split() for line in words), letters=110.0)
    return figure


def _differences(ax: Axes, cube: xr.Dataset) -> None:
    """Largest difference of each run's comparable events over the growth, in all exact ways."""
    growth = cube.growth.values
    found = np.array([cube[f"{name}_difference"].values for name in EXACT])
    known = ~np.isnan(found).all(axis=0)
    if not known.any():
        note_empty_panel(ax, "no run has comparable events")
        return
    growth, found = growth[known], np.nanmax(found[:, known], axis=0)
    outright = [(cube[f"{name}_verdict"].fillna(PASSED) == PASSED).values for name in EXACT]
    agree = np.all(outright, axis=0)[known]
    looks = (
        (agree, "o", BLUE, "compared directly"),
        (~agree, "^", VERMILION, "judged step by step (right)"),
    )
    for chosen, mark, colour, label in looks:
        height = np.maximum(found[chosen], _NO_DIFFERENCE)
        (line,) = ax.plot(growth[chosen], height, mark, color=colour, label=label)
        line.set(markersize=2.2, markeredgewidth=0.0, alpha=0.6, rasterized=True)
    reach = np.array([1.0, max(10.0 * float(growth.max()), 1e3)])
    ax.plot(reach, EPSILON * reach, color="black", lw=0.9, label="roundoff $\\times$ amplification")
    limit = ALLOWANCE * EPSILON * reach
    limit_text = f"limit of round marks: {ALLOWANCE:g} times that"
    ax.plot(reach, limit, color="black", lw=0.9, ls="--", label=limit_text)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlim(reach[0] / 2.0, reach[1])
    top = 10.0 * max(limit[1], float(found.max()))
    ax.set_ylim(_NO_DIFFERENCE / 3.0, top)
    exponents = range(-18, int(np.log10(top)) + 1, 3)
    names = ["0", *(f"$10^{{{exponent}}}$" for exponent in exponents)]
    ax.set_yticks([_NO_DIFFERENCE, *(10.0**exponent for exponent in exponents)], names)
    ax.minorticks_off()
    ax.set_xlabel("amplification of a small perturbation")
    ax.set_ylabel("largest difference of comparable events")
    ax.legend(frameon=False, fontsize=7.0, loc="upper left", markerscale=1.8)


def _errors(ax: Axes, cube: xr.Dataset) -> None:
    """Part of the runs with at least a backward error."""
    from matplotlib.ticker import LogLocator

    errors = cube.backward_error.values
    values = np.sort(np.maximum(errors[~np.isnan(errors)], _NO_ERROR))
    if not values.size:
        note_empty_panel(ax, "no run has a backward error")
        return
    ax.ecdf(values, complementary=True, color=BLUE, lw=1.1)
    ax.axvline(SOUND, color="black", lw=0.9, ls="--")
    ax.text(0.9 * SOUND, 1.0, "limit", va="top", ha="right", fontsize=7.0)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlim(_NO_ERROR, max(10.0 * SOUND, 2.0 * float(values[-1])))
    ax.set_ylim(0.5 / values.size, 1.2)
    ax.xaxis.set_major_locator(LogLocator(numticks=8))
    ax.set_xlabel(r"backward error, in units of roundoff ($2^{-52}$)")
    ax.set_ylabel("share of runs with at least that error")
