"""Estimated cost of a job's runs, from their settings alone.

No engine here, and no numpy: studies are checked with it each time the Snakefile is read. How far
the numbers are off: `damper.study.estimate`.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil, prod
from typing import TYPE_CHECKING, NamedTuple

from damper.parameters.forcing import HARMONIC, Forcing
from damper.parameters.models import MODELS
from damper.sweep.branches import DIRECTIONS

if TYPE_CHECKING:
    from damper.observers.common.base import Observer

MOST_PERIODS = 1_000_000_000
"""Of one run, a thousand times the longest that has been checked. No budget of events ends a run
without impacts: of these it takes 17 minutes."""
#: Most cycles of a run on a structure: more take days.
MOST_CYCLES = 1_000_000
MOST_SECONDS = 30 * 86400.0
"""Of a job: no queue of a cluster lets one run for longer."""
MOST_MEMORY = 256 * 10**9
"""Bytes of a job: a large node of a cluster."""

WORTH_COMPILING = 1.0
"""Seconds of runs, as estimated, that plain Python is sure to take longer for than compiling: it
takes 20 to 300 times the estimate."""

IMPACTS_PER_PERIOD = 20.0
"""Impacts resolved in a cycle: the mean over the studies of the default run.

In the seven cubes of these with `impacts_per_period`, which counts visible impacts alone, the means
go from 1.2 to 12. All events, counted in up to 1000 runs of each of the 21 studies with a cube, are
1 to 72 in a period, the median of the studies is 14 and their mean 20.
"""

# Seconds, with compiled code, on one core of the shared machine of the project's measurements.
_MOST = 2.0  # times that, with many impacts or on a busy machine
_PROCESS_SECONDS = 2.0  # to start, and to load compiled code
_RUN_SECONDS = 1e-4  # of a run, and of each observer in it
_PERIOD_SECONDS = 1e-6  # without impacts
_BYTE_SECONDS = 4e-9
_OBSERVED_SECONDS = 3e-7  # an impact, or a sample of a force, for each observer of it
_SAMPLE_SECONDS = 5e-7  # of a force that is a record
_READ_SECONDS = 2e-6  # of a sample of a record in a file

# Bytes: jobs of one small run came to 165 to 215 MB; 100 000 runs to 0.9 kB more for each, 1.4 kB
# in SI units. A record of 1e6 and 2e6 samples: 145 B for each, from its file to the engine.
_PROCESS_BYTES = 250 * 10**6
_RUN_BYTES = 1500
_SAMPLE_BYTES = 200
_COPY_BYTES = 16


class Excess(NamedTuple):
    """Why a job cannot end.

    `key` is what to change: ``transient``, ``periods``, an observer's name or a dimension.
    """

    key: str
    message: str
    allowed: str


@dataclass(frozen=True)
class Workload:
    """Runs of one process and their cost.

    Parameters
    ----------
    sizes : mapping of str to int
        Dimension of the runs -> its length, see `run_sizes`.
    transient, periods : float
        Cycles of each run, discarded and recorded.
    observers : sequence of Observer
        As made by `damper.observers.make_observers`.
    model : str, default "rigid"
        The model of the damper; of several the dearest.
    forcing : Forcing
        A sum of harmonics takes each impact as many times as long at most; a record ends a segment
        at each of its samples.
    copies : int, default 1
        Copies of the record's samples: each unit of time, and each noise, has a copy.
    parts : mapping of str to float, optional
        Part of the runs that an observer observes, where that is not all; by default what its
        `place` leaves of `sizes`.
    """

    sizes: Mapping[str, int]
    transient: float
    periods: float
    observers: Sequence["Observer"]
    model: str = "rigid"
    forcing: Forcing = HARMONIC
    copies: int = 1
    parts: Mapping[str, float] = field(default_factory=dict)

    @property
    def runs(self) -> int:
        """Number of runs."""
        return prod(self.sizes.values())

    @property
    def impacts(self) -> float:
        """Impacts of all runs, as a rough number."""
        return self.runs * (self.transient + self.periods) * IMPACTS_PER_PERIOD

    @property
    def seconds(self) -> float:
        """Time of the process on one core, a rough upper figure."""
        begin = _PROCESS_SECONDS + self.forcing.samples * _READ_SECONDS
        return _MOST * (begin + self.run_seconds)

    @property
    def run_seconds(self) -> float:
        """Time of its runs alone, with as many impacts as is usual."""
        return self.runs * self._run_seconds

    @property
    def array_bytes(self) -> int:
        """Bytes of the arrays of all runs, as the observers describe them."""
        return ceil(self.runs * self._run_bytes)

    @property
    def memory(self) -> int:
        """Bytes of the process."""
        return self._memory(self.runs)

    def excess(self, most_memory: float = MOST_MEMORY) -> Excess | None:
        """Return why the job cannot end, or None."""
        periods = self.transient + self.periods
        if periods > MOST_PERIODS:
            return Excess(
                "periods" if self.periods >= self.transient else "transient",
                f"{self.transient:.15g} + {self.periods:.15g} cycles (transient + periods) take "
                f"some {duration(self._run_seconds)} a run",
                f"at most {MOST_PERIODS} in a run",
            )
        memory = f"at most {amount(most_memory)} in one process"
        kept = {one.name: one.bytes_per_run(ceil(self.periods)) for one in self.observers}
        largest = max(kept, key=lambda name: kept[name], default="")
        if self.observers and self._memory(1) > most_memory:
            return Excess(largest, f"one run keeps {amount(kept[largest])} in memory", memory)
        longest = max(self.sizes, key=lambda name: self.sizes[name], default="points")
        runs = " x ".join(f"{name} ({size})" for name, size in self.sizes.items()) or longest
        runs += f": {self.runs} runs in one process take some"
        if self.memory > most_memory:
            message = f"{runs} {amount(self.memory)} of memory"
            if self._run_bytes > _RUN_BYTES:
                message += f", {amount(kept[largest])} a run for {largest}"
            return Excess(longest, message, memory)
        if self.seconds > MOST_SECONDS:
            allowed = f"at most {duration(MOST_SECONDS)} in one process"
            return Excess(longest, f"{runs} {duration(self.seconds)}", allowed)
        return None

    def refuse_excess(self) -> None:
        """Raise ValueError for what cannot end, or does not go into this machine's memory."""
        excess = self.excess(machine_memory())
        if excess:
            raise ValueError(f"{excess.key}: {excess.message}; {excess.allowed}")

    @property
    def _run_seconds(self) -> float:
        observers = len(self.observers)
        impacts = IMPACTS_PER_PERIOD * MODELS[self.model].impact_seconds * self.forcing.terms
        observed = IMPACTS_PER_PERIOD * _OBSERVED_SECONDS * observers
        return (
            _RUN_SECONDS * (1 + observers)
            + _BYTE_SECONDS * self._run_bytes
            + (self.transient + self.periods) * (_PERIOD_SECONDS + impacts)
            + self.periods * observed
            + self.forcing.samples * (_SAMPLE_SECONDS + _OBSERVED_SECONDS * observers)
        )

    def _memory(self, runs: int) -> int:
        # The run at work keeps its results twice.
        samples = self.forcing.samples * (_SAMPLE_BYTES + min(runs, self.copies) * _COPY_BYTES)
        kept = ceil(runs * self._run_bytes) + self._one_bytes
        return _PROCESS_BYTES + samples + runs * _RUN_BYTES + kept

    @property
    def _one_bytes(self) -> int:
        """Bytes of a run that all observers observe."""
        return sum(one.bytes_per_run(ceil(self.periods)) for one in self.observers) + 1  # status

    @property
    def _run_bytes(self) -> float:
        """Bytes of a run in the mean."""
        kept = (one.bytes_per_run(ceil(self.periods)) * self._part(one) for one in self.observers)
        return sum(kept) + 1

    def _part(self, observer: "Observer") -> float:
        whole = prod(self.sizes.get(name, 1) for name in observer.place)
        return self.parts.get(observer.name, 1.0 / whole)


def run_sizes(axes: Mapping[str, int], draws: int, follow: Mapping[str, str]) -> dict[str, int]:
    """Return the length of each dimension of the runs: axes, directions, draws."""
    sizes = dict(axes)
    for way in follow.values():
        sizes["direction"] = len(DIRECTIONS[way])
    if draws:
        sizes["draws"] = draws
    return sizes


def amount(size: float) -> str:
    """Return bytes in words, such as 1.6 GB."""
    for unit in ("B", "kB", "MB", "GB", "TB"):
        if size < 999.5:
            return f"{size:.3g} {unit}"
        size /= 1000
    return f"{size:.3g} PB"


def duration(seconds: float) -> str:
    """Return a time in words, such as 3.2 h."""
    for unit, length in (("s", 1.0), ("min", 60.0), ("h", 3600.0)):
        if seconds < 99.5 * length:
            return f"{seconds / length:.2g} {unit}"
    return f"{seconds / 86400.0:.3g} days"


def machine_memory() -> float:
    """Return the bytes of this machine, or the limit of a study where Python does not know."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, OSError, ValueError):
        return MOST_MEMORY
