"""Estimated cost of a study, from its settings alone: time, memory, disk, resources of jobs.

The numbers are rough upper figures, for compiled code on one core. Estimated over measured, for the
22 studies with a cube of a default run on two cores: time of a study's simulation jobs 3.7 in the
median, 1.6 to 17 (one short run); time of the longest job 3.7, 1.1 to 17; memory of the largest job
1.4, 1.4 to 1.6, where it is not so short that numba is not loaded; memory to gather 1.4, 1.3 to
1.5; disk 1.6, 1.2 to 2.2. A million points of the study `atlas`, with few impacts, took a
fourteenth of their time.
"""

from __future__ import annotations

from math import ceil, prod
from typing import NamedTuple

from damper.observers import make_observers
from damper.study.messages import Mistakes
from damper.study.model import Study
from damper.sweep.estimate import MOST_MEMORY, Workload, amount, run_sizes

MOST_SLICES = 1000
"""One slice is one job. A dry run took 13 s for 1000 of them, 29 s for 2000, and was not done
after 25 minutes for 10 000, on a busy machine."""

PLAIN_SECONDS = 0.03
"""Of runs, as estimated, for which plain Python takes no longer than to compile for them: it is 20
to 700 times as slow."""
COMPILE_SECONDS = 60.0
"""To compile for one model with all observers: 17 to 27 s of a core in fact, 50 to 60 on a busy
machine."""

# Of a gather job: it starts in 85 MB and holds all arrays up to three times; compression takes
# up to 0.25 us for a byte, twice that on a busy machine.
_GATHER_BYTES = 150 * 10**6
_GATHER_COPIES = 3
_GATHER_SECONDS = 6.0
_WRITE_SECONDS = 5e-7
#: Bytes of a slice's file beside its arrays, and of a cube's.
_SLICE_BYTES, _CUBE_BYTES = 40_000, 100_000


class Estimate(NamedTuple):
    """What a study takes.

    `job` is one simulation job; times are in seconds on one core, sizes in bytes.
    """

    slices: int
    points: int
    job: Workload
    gather_memory: int
    gather_seconds: float
    disk: int

    @property
    def runs(self) -> int:
        """Runs of all slices: points times directions times draws."""
        return self.slices * self.job.runs

    @property
    def impacts(self) -> float:
        """Impacts of all runs, as a rough number."""
        return self.slices * self.job.impacts

    @property
    def seconds(self) -> float:
        """Time of all simulation jobs, one after the other."""
        return self.slices * self.job.seconds

    @property
    def run_seconds(self) -> float:
        """Time of all runs alone, without what a job takes to start."""
        return self.slices * self.job.run_seconds

    @property
    def simulate_resources(self) -> dict[str, int]:
        """Resources of a simulation job, as rules of the workflow give them."""
        return _resources(self.job.memory, self.job.seconds)

    @property
    def gather_resources(self) -> dict[str, int]:
        """Resources of the job that gathers the slices."""
        return _resources(self.gather_memory, self.gather_seconds)


def estimate(study: Study) -> Estimate:
    """Estimate what a study takes."""
    sizes = {name: len(values) for name, values in study.axis_values.items()}
    slices = study.jobs * prod(sizes[name] for name in study.fan_axes)
    draws = ceil(study.draw_settings().get("count", 0) / study.jobs)
    times = {"primary_mass", "stiffness"}  # of the unit of time
    copies = prod(sizes[name] for name in times.intersection(study.inner_axes))
    if study.forcing.drawn or times.intersection(study.drawn):
        copies *= draws
    job = Workload(
        run_sizes({n: sizes[n] for n in study.inner_axes}, draws, study.follow),
        *study.most_cycles,
        make_observers(study.observer_settings()),
        study.main_feature,
        study.force,
        copies,
    )
    arrays = slices * job.array_bytes
    return Estimate(
        slices,
        prod(sizes.values()),
        job,
        _GATHER_BYTES + _GATHER_COPIES * arrays,
        _GATHER_SECONDS + _WRITE_SECONDS * arrays,
        2 * arrays + slices * _SLICE_BYTES + _CUBE_BYTES,
    )


def refuse_excess(study: Study, mistakes: Mistakes) -> None:
    """Note what makes a study so large that it cannot end, with the estimate."""
    found = estimate(study)
    excess, job = found.job.excess(), found.job
    if excess is not None:
        loc, todo = _place(study, excess.key), ""
        if excess.key in study.observers:
            todo = ": fewer periods, samples or records"
        elif excess.key in job.sizes:
            todo = f": fewer values{_fan(study, found)}"
        mistakes.add(loc, excess.message, excess.allowed + todo)
    elif found.gather_memory > MOST_MEMORY:
        message = f"to gather {found.runs} runs takes some {amount(found.gather_memory)} of memory"
        allowed = f"at most {amount(MOST_MEMORY)}: fewer values or observers, or several studies"
        mistakes.add(("axes",) if study.axes else ("observers",), message, allowed)


def _place(study: Study, key: str) -> tuple[str, ...]:
    """Return where a study says what an `Excess` names."""
    if key in study.axes:
        return "axes", key
    if key in study.observers:
        return "observers", key
    return {"draws": ("draws", "count"), "direction": ("axes",)}.get(key, (key,))


def _fan(study: Study, found: Estimate) -> str:
    """Return the advice to fan the longest axis that can be, if there is one."""
    if found.gather_memory > MOST_MEMORY:
        return ""  # more jobs would not make a smaller cube
    most = MOST_SLICES // found.slices
    free = {n: s for n, s in found.job.sizes.items() if n in study.axes and n not in study.follow}
    free = {name: size for name, size in free.items() if size <= most}
    if not free:
        return ""
    longest = max(free, key=lambda name: free[name])
    return f", or 'fan: true' at {longest}, to make each of its values a job"


def _resources(memory: int, seconds: float) -> dict[str, int]:
    # A job that the scheduler cuts is lost, so compiling with an empty cache is included: minutes
    # and up to 450 MB.
    return {"mem_mb": ceil(memory / 1e6) + 250, "runtime": ceil(seconds / 60.0) + 5}
