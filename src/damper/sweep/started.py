"""`damper.start`: a run that is advanced step by step, as another simulation asks for it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from damper.engine import segment
from damper.engine.compiled import plain
from damper.engine.loop import FINISHED
from damper.engine.model import count_masses, masses_at, read_segment
from damper.engine.trajectory import DEFAULT_ACCURACY, DEFAULT_MAX_EVENTS
from damper.parameters import Parameters, SIParameters, State
from damper.parameters.lazy import xr
from damper.parameters.quantity import real
from damper.parameters.structural import StructureParameters
from damper.parameters.units import LENGTH, SI_UNITS, SPEED, TIME, attributes_of
from damper.sweep.events import EventTable, Started

#: Variable -> its place in a state, its meaning, and its unit.
_MOTION = {
    "displacement": (0, "displacement of the primary", LENGTH),
    "velocity": (1, "velocity of the primary", SPEED),
    "free_displacement": (2, "displacement of the free mass", LENGTH),
    "free_velocity": (3, "velocity of the free mass", SPEED),
}


class OngoingRun:
    """A run that can be advanced; from `damper.start`.

    It keeps its log, 128 bytes a segment and as many more for each of several masses, so that
    `events` and `motion` look back to the start. However a run is split, its events and motion are
    those of one run, to the last bit.

    Attributes
    ----------
    parameters : Parameters or SIParameters
    time : float
        How far it has been advanced, in units of sqrt(M/K), or in s with SIParameters.
    """

    def __init__(self, started: Started) -> None:
        self._started = started
        self.parameters = started.parameters
        self.time = started.begun * started.units.time
        #: Whole segments in pieces, and the last one, which is cut where the run has stopped.
        self._pieces: list[np.ndarray] = []
        self._cut = np.empty((0, started.trajectory.columns))
        self._new = self._run_to(self.time)

    def __repr__(self) -> str:
        return f"<run of {self.parameters}\n at time {self.time:.6g}: {len(self.events)} events>"

    def advance(self, until: float) -> EventTable:
        """Run on to a time.

        Parameters
        ----------
        until : float
            Time, not earlier than that reached so far.

        Returns
        -------
        EventTable
            Events that no call before has returned, as `damper.events` gives them.

        Raises
        ------
        ValueError
            For a time that lies before `time`, is not finite or is a billion cycles after the
            start; where the run stopped early, as its last event says.
        TypeError
            For what is not a number.
        """
        if real("until", until) < self.time:
            raise ValueError(f"until = {until!r}: must be >= {self.time!r}, the time reached")
        if self._started.trajectory.status != FINISHED:
            raise ValueError(f"the run stopped early, at {float(self.events['time'][-1])!r}")
        found, self._new = [*self._new, *self._run_to(until)], []
        return self._started.table(found)

    @property
    def events(self) -> EventTable:
        """All events so far, as `damper.events` gives them."""
        started = self._started
        return started.table([started.events_in(self._log), *started.stopped(self._cut)])

    @property
    def state(self) -> State:
        """The state at `time`, from which `damper.start` and `damper.events` can go on."""
        x, v, y, u = self._state_at(self.time, self._cut)
        units = self._started.units
        state = State(x, v, y, u, self.time / units.time)
        return state.times(units)

    @property
    def sticking(self) -> tuple[bool, ...]:
        """Whether each free mass moves with a wall at `time`."""
        model, row = self._started.trajectory.model, self._cut[-1]
        masses = np.empty((count_masses(model), 3))
        segment_here = plain(read_segment)(model, row)
        plain(masses_at)(model, segment_here, float(row[segment.DURATION]), masses)
        return tuple((masses[:, 2] == segment.STICKING).tolist())

    def motion(self, times: Any) -> xr.Dataset:
        """Motion of all masses at moments between the start and `time`.

        Parameters
        ----------
        times : float or sequence of float
            In units of sqrt(M/K), or in s with SIParameters. At the very time of an impact the
            velocities are those after it.

        Returns
        -------
        xarray.Dataset
            ``displacement``, ``velocity``, ``free_displacement`` and ``free_velocity`` over
            ``time``; the last two also over ``body`` where there are several free masses. On a
            structure the first two are of each ``point`` with a name, and ``mode_energy`` is that
            of each mode.

        Raises
        ------
        ValueError
            For a time before the start or after `time`, and for more than one dimension.
        """
        moments = np.atleast_1d(np.asarray(times, dtype=float))
        if moments.ndim > 1:
            raise ValueError(f"times: must be one-dimensional, not of shape {moments.shape}")
        begun = self._started.begun * self._started.units.time
        outside = moments[~((begun <= moments) & (moments <= self.time))]
        if len(outside):
            first = float(outside[0])
            raise ValueError(f"times: {first!r} is outside the run, {begun!r} to {self.time!r}")
        log = self._log
        states = [self._state_at(moment, log) for moment in moments.tolist()]
        several = self._cut.shape[1] > segment.COLUMNS
        units = self._started.units
        if isinstance(self.parameters, StructureParameters):
            return _motion_of_structure(self.parameters, moments, states)
        found = {}
        for name, (place, meaning, unit) in _MOTION.items():
            values = np.array([state[place] for state in states]) * units.size(unit)
            dims = ("time", "body") if several and place > 1 else ("time",)
            found[name] = (dims, values, self._attributes(meaning, unit))
        return xr.Dataset(found, {"time": ("time", moments, self._attributes("time", TIME))})

    def measured(self) -> dict[str, Any]:
        """Measure a run on a structure, from its start to `time`.

        Returns
        -------
        dict of str to array
            What `damper.simulate` has of each run.
        """
        from damper.observers.common.base import Window
        from damper.sweep.measured import Measured  # for structures alone

        trajectory, units = self._started.trajectory, self._started.units
        length = (self.time / units.time - self._started.begun) / trajectory.cycle
        window = Window(*trajectory.start, length)
        seen = Measured(self.parameters, trajectory, window)
        seen.observe(self._log)
        return seen.found()

    def _attributes(self, meaning: str, unit: str) -> dict[str, str]:
        named = {} if isinstance(self.parameters, Parameters) else SI_UNITS
        amplitude = self.parameters.forcing.amplitude
        return {"long_name": meaning, **attributes_of(named.get(unit, unit), amplitude)}

    @property
    def _log(self) -> np.ndarray:
        return np.concatenate([*self._pieces, self._cut])

    def _run_to(self, until: float) -> list[np.ndarray]:
        """Run on to a time and return the events that are new."""
        started = self._started
        rows = np.concatenate([piece.copy() for piece in started.pieces(until)])
        # The run computes the segment that was cut again; its event is known.
        new = [started.events_in(rows[len(self._cut) :])]
        self._pieces.append(rows[:-1])
        self._cut = rows[-1:]
        new += started.stopped(self._cut)
        self.time = float(until)
        if started.trajectory.status != FINISHED:
            self.time = float(started.table(new)["time"][-1])
        return new

    def _state_at(self, time: float, log: np.ndarray) -> tuple[float, float, Any, Any]:
        """Dimensionless state after the events of that time, by rows of the log about it."""
        trajectory = self._started.trajectory
        periods, rest = trajectory.whole_periods(time / self._started.units.time)
        elapsed = (periods - log[:, segment.PERIODS]) * trajectory.cycle + (
            rest - log[:, segment.TIME]
        )
        row = max(int(np.searchsorted(-elapsed, 0.0, side="right")) - 1, 0)
        tau = min(max(float(elapsed[row]), 0.0), float(log[row, segment.DURATION]))
        return trajectory.state_in(log[row], tau)


def _motion_of_structure(
    parameters: StructureParameters, times: np.ndarray, states: Sequence[Any]
) -> xr.Dataset:
    """Motion of all points of a structure, of its free masses, and its energy by mode."""
    structure, units = parameters.structure, parameters.units
    x, v, y, u = (
        np.array(column) * (units.speed if place % 2 else units.length)
        for place, column in enumerate(zip(*states, strict=True))
    )
    names = list(structure.points)
    points = np.array([structure.points[name] for name in names]).reshape(-1, len(structure)).T
    energies = structure.mode_energies(x, v)
    found = {
        "displacement": (("time", "point"), x @ points, "displacement of the point", "m"),
        "velocity": (("time", "point"), v @ points, "velocity of the point", "m/s"),
        "free_displacement": (("time", "body"), y, _MOTION["free_displacement"][1], "m"),
        "free_velocity": (("time", "body"), u, _MOTION["free_velocity"][1], "m/s"),
        "mode_energy": (("time", "mode"), energies, "energy of the mode of the structure", "J"),
    }
    return xr.Dataset(
        {
            name: (dims, values, {"long_name": text, "units": unit})
            for name, (dims, values, text, unit) in found.items()
        },
        {
            "time": ("time", times, {"long_name": "time", "units": "s"}),
            "point": names,
            "mode": np.arange(1, len(structure) + 1),
        },
    )


def start(
    parameters: Parameters | SIParameters | StructureParameters | None = None,
    state: State | None = None,
    *,
    accuracy: float = DEFAULT_ACCURACY,
    max_events: int = DEFAULT_MAX_EVENTS,
    **values: Any,
) -> OngoingRun:
    """Start a run that is advanced step by step.

    Parameters
    ----------
    parameters, state, accuracy, max_events, **values
        As for `damper.events`.

    Returns
    -------
    OngoingRun

    Raises
    ------
    ValueError, TypeError
        As `damper.events`.

    Examples
    --------
    >>> import damper
    >>> p = damper.Parameters(mass_ratio=0.1, damping_ratio=0.05, frequency_ratio=0.2,
    ...                       clearance=0.25, restitution=0.6)
    >>> run = damper.start(p)
    >>> len(run.advance(3.0)), len(run.advance(10.0)), len(run.events)
    (1, 1, 2)
    >>> run.motion([2.0, 4.0]).displacement.values.round(4).tolist()
    [0.2065, 0.8115]
    """
    return OngoingRun(Started(parameters, state, accuracy, max_events, values))
