"""The motions of a ball on an oscillating table, drawn over a diagram of approach speeds."""

from __future__ import annotations

from itertools import count
from typing import Any

import numpy as np

from damper.analysis.closed_forms import damper_at, dense
from damper.figures.common.panels import legend_line
from damper.figures.common.style import THEORY
from damper.figures.overlays import Panels, reach
from damper.parameters.lazy import Artist
from damper.theory.ball_on_table import bounce

#: Points of a curve between two of the diagram, and most of them in all.
_BETWEEN, _MOST = 8, 2000
_CURVE: dict[str, Any] = {"color": THEORY, "alpha": 0.6, "lw": 3.4, "zorder": 1.5}


def overlay(panels: Panels) -> list[Artist]:
    """Draw the approach speed of each stable motion of the ball with one impact in n periods."""
    axes, (along,), panel, *_ = panels
    values = dense(panel[along].values, _BETWEEN, _MOST)
    dampers = [damper_at(panel, **{along: value}) for value in values]
    for n in count(1):
        found = [(bounce(damper, n), units) for damper, units in dampers]
        if all(b.acceleration <= b.onset for b, _ in found):
            break
        shown = [b.approach_speed * u.speed if b.stable else np.nan for b, u in found]
        axes["approach_speed"].plot(values, shown, **_CURVE)
        reach(axes["approach_speed"], np.array([v for v in shown if v == v]))
    return [legend_line("one impact in $n$ periods, closed form: stable", **_CURVE)]
