"""Jobs that the workflow runs, for every kind of study.

A kind of study says its `parts`, and which files are `gathered` from them or `timed`. Two rules run
them all. So what a job does lies in a module that knows nothing of the study language: a job loads
what it needs and no more.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property, lru_cache
from hashlib import sha256
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from damper.study.fingerprint import fingerprint_in

if TYPE_CHECKING:
    from damper.sweep.parts import PartData

#: Megabytes and minutes of a job that is small.
USUAL_RESOURCES = {"mem_mb": 1000, "runtime": 30}


class Job(NamedTuple):
    """A job of the workflow and its resources."""

    module: str
    """Has the function that does it, by the job's rule: `run_part(needed, **settings)` returns a
    `damper.sweep.parts.PartData`; `gather(parts, **settings)` and `measure(**settings)` return a
    dataset, or what JSON can hold."""
    settings: dict[str, Any]
    """Plain values, as JSON holds them."""
    needs: tuple[str, ...] = ()
    """Names of the study's parts that the function is given, in this order."""
    loads: tuple[str, ...] = ()
    """Modules that are loaded by name: they belong to the code behind the result."""
    compiled: tuple[str, ...] = ()
    """Code to compile before the job, as the rule `compile` names it. For a study that simulates
    the rules find it."""
    resources: Mapping[str, int] = USUAL_RESOURCES
    files: Mapping[str, str] = {}
    """Files that the function of a part is given as well: argument -> path."""


class Jobs(Mapping[str, Job]):
    """Jobs by name. They are made when one is asked for, because that may read all of a record.

    Parameters
    ----------
    names : iterable of str
    make : callable
        Returns the mapping of these names to their jobs.
    """

    def __init__(self, names: Iterable[str], make: Callable[[], Mapping[str, Job]]) -> None:
        self._names, self._make = tuple(names), make

    @cached_property
    def _made(self) -> Mapping[str, Job]:
        return self._make()

    def __getitem__(self, name: str) -> Job:
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


def shares(count: int, jobs: int) -> list[tuple[int, int]]:
    """Return the first and one past the last of the runs of each job that share `count` runs.

    Examples
    --------
    >>> shares(5, 2)
    [(0, 2), (2, 5)]
    """
    return list(pairwise(k * count // jobs for k in range(jobs + 1)))


def read_parts(paths: Sequence[str], fingerprints: Iterable[str]) -> list[PartData]:
    """Read parts for a job; SystemExit names those that are not as they should be.

    The damaged parts are removed, so that the same command makes them anew.
    """
    # Not above: studies are read without numpy.
    from damper.sweep.parts import DamagedPartError, read_part

    parts, refused = [], []
    for path, made_of in zip(map(Path, paths), fingerprints, strict=True):
        try:
            found = fingerprint_in(path)
            if found != made_of:
                what = "of other parameters, settings or code" if found else "damaged"
                raise DamagedPartError(f"{path} is {what}")
            parts.append(read_part(path))
        except DamagedPartError as error:
            refused.append(str(error))
            path.unlink(missing_ok=True)
    if refused:
        lines = "\n".join(refused)
        raise SystemExit(f"{lines}\nThey are removed: the same command again makes them anew.")
    return parts


def file_digest(path: Path | str) -> str:
    """Digest of the bytes of a file that a job reads, in 16 hexadecimal digits."""
    # Loads the parameters, which jobs that read no file of a user do without.
    from damper.parameters.files import state_of

    return _digest(str(path), state_of(path))


@lru_cache
def _digest(path: str, state: tuple[int, ...]) -> str:
    from damper.parameters.files import contents

    return sha256(contents(path)).hexdigest()[:16]


def read_files(paths: Mapping[str, str], digests: Mapping[str, str]) -> Mapping[str, str]:
    """Return the files of a job by its arguments; SystemExit where one has changed meanwhile."""
    for argument, path in paths.items():
        if not Path(path).exists() or file_digest(path) != digests[argument]:
            raise SystemExit(f"{path} has changed since this run began: start the run again")
    return paths


def write(made: Any, path: str, code: str) -> None:
    """Write what a job has gathered or measured: a dataset as netCDF, with its code, or JSON."""
    if isinstance(made, dict):
        Path(path).write_text(f"{json.dumps(made, indent=1)}\n", encoding="utf-8", newline="\n")
        return
    from damper.sweep.cube import REFERENCES, write_cube

    write_cube(made.assign_attrs(references=REFERENCES, code_digest=code), Path(path))
