"""What all observers share: settings, arrays, the window, what counts as visible."""

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from types import SimpleNamespace
from typing import Any, ClassVar, NamedTuple

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.model import count_masses, speeds_in_tail, with_walls_at
from damper.engine.segment import Segment
from damper.engine.trajectory import Trajectory
from damper.observers.common.settings import Setting
from damper.parameters.models import ONE_MASS, models_of, unknown_model
from damper.parameters.names import unknown_name
from damper.parameters.variables import NO_VALUE, Variable


class Window(NamedTuple):
    """Window of a run: from `periods` cycles plus `time` on, `length` cycles long."""

    periods: float
    time: float
    length: float

    def end(self, cycle: float) -> tuple[float, float]:
        """Whole cycles and the rest of the moment at which it ends."""
        periods = self.periods + self.length
        whole = math.floor(periods)
        time = self.time + (periods - whole) * cycle
        return (whole, time) if time < cycle else (whole + 1.0, time - cycle)


class Observer:
    """Base of the observers: their settings, and one array per variable with the run as first axis.

    A class declares its settings as `Setting` attributes and its `variables`, as an attribute or
    as a property that follows from the settings. An object holds the settings' values under their
    names. A subclass fixes a setting by giving its value in its place.

    Raises
    ------
    ValueError
        For an unknown setting (with the known ones) or a value out of range.
    """

    models: ClassVar[tuple[str, ...]] = ONE_MASS
    """Models of the damper that it knows; a `Setting` may know less."""
    bodies: Any = ()
    """Of an observer with this setting: the free masses that it is made for, one by one."""
    sees_all: ClassVar[bool] = False
    """Whether one of it observes all these masses."""
    shared: ClassVar[tuple[str, ...]] = ()
    """Variables of such an observer that are the same for each mass, written by the first."""
    of_box: ClassVar[tuple[str, ...]] = ()
    """Shared variables of which, on a structure, each mass writes its own: those of its box."""
    is_first = True
    """Whether it is the first one of those for several masses."""
    throughout = False
    """Whether noise must last as long as the window."""
    settings: ClassVar[dict[str, Setting]] = {}
    """The class's own first, then those of its bases."""

    @property
    def variables(self) -> Sequence[Variable]:
        """What it writes."""
        raise NotImplementedError

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        names = dict.fromkeys((*vars(cls), *cls.settings))
        found = {name: getattr(cls, name) for name in names}
        cls.settings = {name: s for name, s in found.items() if isinstance(s, Setting)}

    def __init__(self, **given: Any) -> None:
        for name in given:
            if name not in self.settings:
                raise ValueError(f"{self.name}: {unknown_name('setting', name, self.settings)}")
        for name, setting in self.settings.items():
            value = given.get(name, setting.default)
            setattr(self, name, setting.checked(f"{self.name}.{name}", value))
        #: Setting -> the models that know it; the key "" holds the models of the observer itself.
        self._known = {"": self.models} | {
            name: s.models for name, s in self.settings.items() if s.models and getattr(self, name)
        }

    @property
    def place(self) -> Mapping[str, float]:
        """Values of the axes at which it observes runs; empty for all runs."""
        return getattr(self, "at", None) or {}

    def check_together(self) -> None:
        """Raise ValueError where settings, each in its range, contradict each other."""

    @property
    def name(self) -> str:
        """The observer's name, that of its file."""
        return type(self).__module__.rpartition(".")[2]

    def require_drive(self, kind: str, last: float, end: float) -> None:
        """Raise ValueError for a window that ends at `end`, after its noise does."""
        if self.throughout and kind == "noise" and last < end * (1.0 - 1e-9):
            raise ValueError(
                f"{self.name}: the window ends at {end:g}, after the noise, which ends at "
                f"{last:g}: must be a window within it"
            )

    def allocate(self, runs: int, window_length: int) -> None:
        """Make `arrays`: NaN (real) or `NO_VALUE` (integer) until a finished run fills them."""
        self.arrays: dict[str, np.ndarray] = {}
        for variable in self.variables:
            shape = (runs, *self._shape(variable, window_length))
            missing = np.nan if variable.dtype.startswith("f") else NO_VALUE
            self.arrays[variable.name] = np.full(shape, missing, dtype=variable.dtype)

    def bytes_per_run(self, window_length: int) -> int:
        """Bytes that `allocate` takes for each run."""
        return sum(
            math.prod(self._shape(variable, window_length)) * np.dtype(variable.dtype).itemsize
            for variable in self.variables
        )

    def _shape(self, variable: Variable, window_length: int) -> tuple[int, ...]:
        return tuple(self.size(dim, window_length) for dim in variable.dims)

    def size(self, dim: str, window_length: int) -> int:
        """Length of one of the observer's own dimensions."""
        raise NotImplementedError

    def coordinates(self) -> dict[str, np.ndarray]:
        """Coordinate values of the observer's own dimensions; none by default."""
        return {}

    def refusals(self, models: Iterable[str], masses: int = 1) -> dict[str, tuple[str, str]]:
        """Why it cannot observe a damper of these models, by the setting; "" is the observer.

        With each reason goes what to give; "" is another model.
        """
        found: dict[str, tuple[str, str]] = {}
        for model, (name, known) in product(models, self._known.items()):
            if model in known or name in found:
                continue
            each = not name or {*known} >= {*ONE_MASS}
            if model == "several" and "bodies" in self.settings and each:
                if not self.bodies:
                    reason = f"{self.name} observes free masses by their numbers"
                    some = ", or some of them" if masses > 1 else ""
                    found[""] = reason, f"bodies: {list(range(masses))}{some}"
            else:
                found[name] = unknown_model(f"{self.name}.{name}".rstrip("."), model, known), ""
        return found

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run, by its number; observers add what they need for it."""
        model = trajectory.model
        for reason, way in self.refusals(models_of(model), count_masses(model)).values():
            raise ValueError(f"{reason}: give {way}" if way else reason)
        self._run = run
        self._model = model
        # Compiled passes know one kind of window.
        self._window = Window(*map(float, window))

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        raise NotImplementedError

    def finish(self, finished: bool) -> None:
        """Write the run's results.

        Where the run stopped early, `finished` is False: averages and counts stay missing, while
        samples and records keep what came before the stop.
        """

    def _put(self, values: Mapping[str, Any]) -> None:
        """Write the run's values of some variables."""
        for name, value in values.items():
            if self.is_first or name not in self.shared:
                self.arrays[name][self._run] = value


#: Clearance that no free mass ever crosses.
_FAR = 1e100
#: Models whose free mass leaves the primary alone where it meets no wall.
LEAVE_ALONE = ("rigid", "grounded", "time_varying", "compliant", "several")


def primary_alone(trajectory: Trajectory) -> Trajectory:
    """Start the run of a damper's primary alone: the walls are out of reach."""
    model = with_walls_at(trajectory.model, _FAR)
    return Trajectory(model, trajectory.initial, trajectory.max_events)


def describe(threshold: tuple[float, float]) -> str:
    """Say in words what counts as visible."""
    fraction, speed = threshold
    if speed:
        return f"visible: approach speed >= {speed:g}"
    return f"visible: approach speed >= {fraction:g} of the first one of the burst"


def record_type(*fields: str) -> np.dtype:
    """Type of an array whose entries compiled code reads and writes by field name.

    Plain Python would read NumPy's own attribute of a record where a field had its name.
    """
    if hidden := [field for field in fields if hasattr(np.record, field)]:
        raise ValueError(f"NumPy's records have {', '.join(hidden)} already: give another name")
    return np.dtype((np.record, [(field, "f8") for field in fields]))


def fields_of(kind: np.dtype) -> tuple[str, ...]:
    """Names of the fields of a `record_type`."""
    return kind.names or ()


def read_record(record: np.ndarray) -> SimpleNamespace:
    """The only entry of an array of `record_type`, for Python, where a record is slow to read."""
    return SimpleNamespace(**dict(zip(fields_of(record.dtype), record[0].item(), strict=True)))


@compiled
def since(segment: Segment, period: float, periods: float, time: float) -> float:
    """Time from a moment (whole cycles plus time) to a segment's start; negative if before."""
    return (segment.periods - periods) * period + (segment.time - time)


@compiled
def part_within(segment: Segment, period: float, window: Window) -> tuple[float, float, float]:
    """Part of a segment in the window: `start`, `low`, `high`.

    Time from the window's start to the segment's, negative if before; the ends of the part, from
    the segment's start. There is none where `high` is below `low`.
    """
    start = since(segment, period, window.periods, window.time)
    end = since(segment, period, window.periods + window.length, window.time)
    return start, max(-start, 0.0), min(segment.duration, -end)


@compiled
def visible_in_tail(model: Any, tail: Segment, limit: float) -> int:
    """Impacts at or above the speed `limit` that a closed tail still holds.

    Their approach speeds fall geometrically.
    """
    speed, ratio = speeds_in_tail(model, tail)
    if not (ratio > 0.0 and 0.0 < limit <= speed):
        return 0
    return 1 + math.floor(math.log(limit / speed) / math.log(ratio))
