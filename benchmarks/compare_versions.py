"""One version of damper in a process of its own, asked through its public interface only."""

import os
import sys
from collections.abc import Callable
from multiprocessing import TimeoutError, get_context
from pathlib import Path
from typing import Any

#: Old name of a parameter -> its name in versions that do not know the old one.
RENAMED: dict[str, str] = {}
#: Seconds after which a call has hung, or its process has died.
PATIENCE = 120


class Version:
    """A process that imports damper from one folder; what it calls must import damper itself."""

    def __init__(self, source: Path) -> None:
        self._source = str(source.resolve())
        self._start()

    def _start(self) -> None:
        self._pool = get_context("spawn").Pool(1, _prepare, (self._source,))

    def call(self, function: Callable, *arguments: Any) -> Any:
        """Return what a function returns in that process, or the exception that it raises."""
        try:
            return self._pool.apply_async(function, arguments).get(PATIENCE)
        except TimeoutError:
            self._pool.terminate()
            self._start()
            return RuntimeError(f"no answer within {PATIENCE} s")
        except Exception as error:
            return error


def _prepare(source: str) -> None:
    sys.path.insert(0, source)
    if hasattr(os, "sched_setaffinity"):
        # One core: a version may use all that it finds.
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def parameters_of(values: dict[str, Any]) -> dict[str, Any]:
    """Parameters by the names of this process's version."""
    from damper import Parameters

    known = Parameters.__dataclass_fields__
    return {name if name in known else RENAMED.get(name, name): values[name] for name in values}
