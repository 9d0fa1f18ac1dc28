"""`damper.run`: a run with its events, motion, bursts and figures."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from damper.analysis.bursts import list_bursts
from damper.analysis.places import require_cube, value_on
from damper.figures import draw
from damper.notebook.shown import shown_in_notebooks
from damper.parameters import Parameters, SIParameters, State
from damper.parameters.lazy import Figure, pd, xr
from damper.parameters.names import counted
from damper.parameters.quantity import real, whole
from damper.parameters.run import RunSettings
from damper.parameters.structural import StructureParameters
from damper.study.products import MOST_COLUMNS
from damper.study.simulation import simulate
from damper.sweep.estimate import MOST_PERIODS
from damper.sweep.events import IMPACT, STICK, events
from damper.sweep.points import one_run
from damper.sweep.record import settings_of

if TYPE_CHECKING:
    from damper.notebook.structure import StructureRun

#: Most bursts and events that a run lists beside its motion.
MOST = 10_000


@dataclass(frozen=True, eq=False, repr=False)
class Run:
    """A run from the time of `state`, or from 0; made by `run` and by ``cube.damper.run``.

    Attributes
    ----------
    parameters : Parameters or SIParameters
    cube : xarray.Dataset
        Its window, with the variables of the observers ``trajectory``, ``bursts`` and
        ``stroboscopic_section``.
    """

    parameters: Parameters | SIParameters
    cube: xr.Dataset
    state: State | None = None

    def __repr__(self) -> str:
        found, stretch = self.events, self.motion.time.values
        impacts, sticks = ((found["kind"] == kind).sum() for kind in (IMPACT, STICK))
        return (
            f"<Run of {self.parameters}\n from time {stretch[0]:.6g} to {stretch[-1]:.6g}: "
            f"{counted(impacts, 'impact')}, {counted(sticks, 'start')} of sticking>"
        )

    @cached_property
    def events(self) -> np.ndarray:
        """Events within the window, as `damper.events` gives them."""
        stretch = self.motion.time.values
        given = {name: self.cube.attrs[name] for name in ("accuracy", "max_events")}
        found = events(self.parameters, self.state, until=stretch[-1], **given)
        return found[found["time"] >= stretch[0]]

    @cached_property
    def motion(self) -> xr.Dataset:
        """All masses' motion over ``time``, in equal steps; the events stand in `events`.

        Variables are ``displacement``, ``velocity``, ``free_displacement`` and ``free_velocity``;
        these two have a dimension ``body`` where there are several free masses.
        """
        prefix = "trajectory_"
        rows = self.cube[[str(n) for n in self.cube.data_vars if "instant" in self.cube[n].dims]]
        rows = rows.drop_vars("trajectory_body", errors="ignore")
        rows = rows.rename({name: str(name).removeprefix(prefix) for name in rows.data_vars})
        sampled = np.isfinite(rows.time.values) & np.isnan(rows.event.values)
        rows = rows.isel(instant=sampled).set_coords("time").drop_vars("event")
        attributes = rows.time.attrs | {"long_name": "time"}
        moved = rows.time + float(self.cube.trajectory_start) + self._begun
        return rows.assign_coords(time=moved.assign_attrs(attributes)).swap_dims(instant="time")

    @property
    def bursts(self) -> pd.DataFrame:
        """Bursts that begin within its motion; see `damper.analysis.list_bursts`.

        A burst may go on after the motion. It is left out where it goes on beyond the cycle in
        which the motion ends.
        Onsets count from the start of the run, as all its times do.
        """
        found = list_bursts(self.cube)
        found = found[found["onset"] <= float(self.cube.trajectory_time.max())]
        return found.assign(onset=found["onset"] + self._begun)

    @property
    def _begun(self) -> float:
        """Time at which its window begins."""
        cycle, begun = self.parameters.cycle, self.state.time if self.state else 0.0
        length = RunSettings(**settings_of(self.cube))
        return length.cycles(cycle, self.parameters.forcing.end - begun)[0] * cycle + begun

    def plot(self, start: float = 0.0, stop: float | None = None) -> Figure:
        """Draw all masses over time, from and to so many cycles of the window."""
        return drawn("trajectory", self.cube, start=start, stop=stop)

    def portrait(self, *bodies: int) -> Figure:
        """Draw its phase portraits and its stroboscopic section.

        Of several free masses the first three, or those of these numbers, in columns.
        """
        if "body" not in self.cube.dims:
            return drawn("phase_portrait", self.cube)
        known = self.cube.body.values.tolist()
        for body in bodies:
            if body not in known:
                raise ValueError(f"body = {body!r}: must be one of {', '.join(map(str, known))}")
        shown = self.cube.sel(body=list(bodies or known[:MOST_COLUMNS]))
        return drawn("phase_portrait", shown, columns="body")


def drawn(
    kind: str, cube: xr.Dataset, branches: xr.Dataset | None = None, **settings: Any
) -> Figure:
    """Draw a figure of a kind as the workflow does; a notebook shows it."""
    from damper.figures.common.style import style

    require_cube(cube)
    if isinstance(at := settings.get("at"), Mapping):
        texts = {n: v for n, v in at.items() if isinstance(v, str) and n in cube.dims}
        settings["at"] = {**at, **{name: value_on(cube[name], v) for name, v in texts.items()}}
    with style():
        return shown_in_notebooks(draw(kind, {"cube": cube, "orbits": branches}, **settings))


def run(
    parameters: Parameters | SIParameters | StructureParameters | None = None,
    until: float | None = None,
    state: State | None = None,
    *,
    samples_per_period: int = 200,
    **values: Any,
) -> Run | StructureRun:
    """Run one damper, from time 0 or that of `state`, and keep its motion.

    Parameters
    ----------
    parameters : Parameters or SIParameters, optional
    until : float
        Time to which it runs, in sqrt(M/K) or s.
    state : State, optional
        Where it starts; at rest, with the free mass in the middle, when not given.
    samples_per_period : int, default 200
        Steps of the motion in a cycle, at least: the last one ends at `until`. They move no event.
    **values
        As `damper.events` takes them.

    Returns
    -------
    Run
        On a structure a `damper.notebook.structure.StructureRun`: it has `events`, `motion` and
        `plot` as well, and in `results` the response of each point, energies and impacts.

    Raises
    ------
    ValueError, TypeError
        As `damper.events` and `damper.simulate`.

    Examples
    --------
    >>> import damper
    >>> p = damper.Parameters(mass_ratio=0.1, damping_ratio=0.05, frequency_ratio=0.2,
    ...                       clearance=0.25, restitution=0.6)
    >>> damper.run(p, until=100.0)
    <Run of Parameters(mass_ratio=0.1, damping_ratio=0.05, frequency_ratio=0.2, clearance=0.25, \
restitution=0.6)
     from time 0 to 100: 40 impacts, 1 start of sticking>
    """
    if until is None:
        raise TypeError("until is missing: give the time at which the run ends")
    parameters, state = one_run(parameters, state, values, structures=True)
    start = state.time if state else 0.0
    samples_per_period = whole("samples_per_period", samples_per_period, 1)
    length = (real("until", until) - start) / parameters.cycle
    if not 1.0 <= length * samples_per_period < math.inf:
        first = start + parameters.cycle / samples_per_period
        raise ValueError(f"until = {until!r}: must be a time >= {first!r}, the first step")
    if length > MOST_PERIODS:
        raise ValueError(
            f"until = {until!r}: ends after {length:.3g} cycles; at most {MOST_PERIODS}"
        )
    if isinstance(parameters, StructureParameters):
        from damper.notebook.structure import StructureRun

        return StructureRun(parameters, until, state, samples_per_period)
    return recorded(
        parameters,
        state=state,
        transient=0,
        periods=math.ceil(length),
        trajectory={"samples_per_period": samples_per_period, "length": length, "to_end": True},
    )


def recorded(
    parameters: Parameters | SIParameters,
    *,
    trajectory: Mapping[str, Any],
    state: State | None,
    **given: Any,
) -> Run:
    """Return the run of a point with what `Run` needs."""
    damper = parameters.dimensionless
    each = {"bodies": range(len(damper.each))} if "several" in damper.features else {}
    observers = {
        "trajectory": {"events": MOST, **trajectory, **each},
        "bursts": {"records": MOST, **each},
        "stroboscopic_section": {},
    }
    cube = simulate(state=state, observers=observers, **(given | parameters.given))
    return Run(parameters, cube, state)
