"""`damper.run` on a structure: a run with its events, motion, results and figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from damper.notebook.shown import shown_in_notebooks
from damper.parameters import State
from damper.parameters.lazy import Figure, xr
from damper.parameters.names import counted, unknown_name
from damper.parameters.structural import StructureParameters
from damper.sweep.events import IMPACT, STICK, EventTable
from damper.sweep.started import start as started
from damper.sweep.structures import structure_cube

#: Panels' height, and that of all else, in inches.
_PANEL, _REST = 1.6, 1.1


class StructureRun:
    """A run on a structure, from the time of `state` or from 0; made by `run`.

    Attributes
    ----------
    parameters : StructureParameters
    state : State or None
        Where it started.
    """

    def __init__(
        self,
        parameters: StructureParameters,
        until: float,
        state: State | None,
        samples_per_period: int,
    ) -> None:
        self.parameters, self.state = parameters, state
        self._begun = state.time if state else 0.0
        self._run = started(parameters, state)
        self._run.advance(until)
        self._samples = samples_per_period

    def __repr__(self) -> str:
        events, found = self.events, self.results
        impacts, sticks = (int((events["kind"] == kind).sum()) for kind in (IMPACT, STICK))
        width = max(map(len, (*self.parameters.structure.points, "point")))
        lines = [
            f"<Run on {self.parameters.structure}",
            f" from time {self._begun:.6g} to {self._run.time:.6g}: {counted(impacts, 'impact')}, "
            f"{counted(sticks, 'start')} of sticking>",
            f"{'point':>{width}} {'peak':>11} {'rms':>11} {'amplitude':>11}",
        ]
        for name in found.point.values:
            one = found.sel(point=name)
            values = one.peak_displacement, one.rms_displacement, one.amplitude
            shown = " ".join(f"{float(value):9.4g} m" for value in values)
            lines.append(f"{name:>{width}} {shown}")
        power = ", ".join(f"{float(value):.4g}" for value in found.impact_power)
        lines.append(f"power, W: {float(found.input_power):.4g} put in, lost in impacts {power}")
        return "\n".join(lines)

    @property
    def events(self) -> EventTable:
        """All events, as `damper.events` gives them."""
        return self._run.events

    @cached_property
    def motion(self) -> xr.Dataset:
        """Motion of points, free masses and modes in equal steps; as `OngoingRun.motion`."""
        length = self._run.time - self._begun
        steps = math.ceil(length / self.parameters.cycle * self._samples)
        return self._run.motion(np.linspace(self._begun, self._run.time, steps + 1))

    @cached_property
    def results(self) -> xr.Dataset:
        """Response of each point, energies, impacts and losses over the whole run.

        Variables are those of `damper.simulate` on a structure; they are exact, whatever
        `samples_per_period` is.
        """
        points = [*self.parameters.structure.points]
        return structure_cube(self._run.measured(), {}, points, {"title": repr(self.parameters)})

    def plot(
        self, start: float = 0.0, stop: float | None = None, points: Sequence[str] | None = None
    ) -> Figure:
        """Draw the displacement of points, of free masses in their boxes, and energies by mode.

        Parameters
        ----------
        start, stop : float
            In cycles from the start of the run; all of it when `stop` is left out.
        points : sequence of str, optional
            All of them when left out.

        Raises
        ------
        ValueError
            For an unknown point, and a stretch that the run does not have.
        """
        names = [*self.parameters.structure.points]
        for name in points or ():
            if name not in names:
                raise unknown_name("point", name, names)
        cycle = self.parameters.cycle
        first = self._begun + start * cycle
        last = self._run.time if stop is None else self._begun + stop * cycle
        motion = self.motion.sel(time=slice(first, last * (1.0 + 1e-12)))
        if motion.sizes["time"] < 2:
            raise ValueError(f"start = {start!r}, stop = {stop!r}: the run has no such stretch")
        return _drawn(self.parameters, motion, [*(points or names)])


def _drawn(p: StructureParameters, motion: xr.Dataset, names: Sequence[str]) -> Figure:
    """Displacements above, places in the boxes, and energies below."""
    from damper.figures.common import panels
    from damper.figures.common.style import COLOURS, PAGE, label, style

    time, count = motion.time.values, len(p.each)
    with style():
        figure, grid = panels.panel_grid(3, width=PAGE, height=3 * _PANEL + _REST)
        top, boxes, energies = grid[:, 0]
        handles: list[Any] = []
        for k, name in enumerate(names):
            line = {"color": COLOURS[k % len(COLOURS)], "lw": 0.9}
            top.plot(time, motion.displacement.sel(point=name), **line)
            handles.append(panels.legend_line(name, **line))
        for k, one in enumerate(p.each):
            line = {"color": COLOURS[k % len(COLOURS)], "lw": 0.9, "ls": "--"}
            apart = motion.free_displacement.isel(body=k) - motion.displacement.sel(point=one.box)
            boxes.plot(time, apart / one.clearance, **line)
            text = "free mass" if count == 1 else f"mass {k}"
            handles.append(panels.legend_line(f"{text} in {one.box}", **line))
        for k, mode in enumerate(motion.mode.values):
            line = {"color": COLOURS[k % len(COLOURS)], "lw": 0.9, "ls": "-."}
            energies.semilogy(time, motion.mode_energy.isel(mode=k), **line)
            handles.append(panels.legend_line(f"mode {mode}", **line))
        top.set_ylabel(label("displacement", "", "m"))
        boxes.set_ylabel("place in box")
        energies.set_ylabel(label("energy", "", "J"))
        energies.set_xlabel(label("time", "", "s"))
        figure = panels.finish(
            figure, motion, f"Run on a structure of {p.structure.size_in_words}", handles
        )
    return shown_in_notebooks(figure)
