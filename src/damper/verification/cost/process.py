"""Functions called in an interpreter of their own, and how much memory one has taken.

A worker reads calls from its standard input, one JSON text a line, and writes what they return.
This file loads the standard library only, so a worker has loaded nothing else before its first
call.
"""

import json
import sys
from importlib import import_module
from pathlib import Path
from typing import Any


class Worker:
    """A fresh interpreter that calls functions of this package by name; used with `with`."""

    def __init__(self) -> None:
        import subprocess

        self._process = subprocess.Popen(
            [sys.executable, "-m", "damper.verification.cost.process"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            encoding="utf-8",
        )

    def __enter__(self) -> "Worker":
        return self

    def __exit__(self, *exception: object) -> None:
        self._process.communicate()

    def call(self, function: str, **keywords: Any) -> Any:
        """Call a function there.

        Parameters
        ----------
        function : str
            ``module:name``; takes and returns what JSON can hold.
        **keywords
            Its arguments.

        Raises
        ------
        RuntimeError
            When the worker ended instead of answering; its own error is on standard error.
        """
        assert self._process.stdin
        assert self._process.stdout
        try:
            self._process.stdin.write(json.dumps([function, keywords]) + "\n")
            self._process.stdin.flush()
            line = self._process.stdout.readline()
        except BrokenPipeError:
            line = ""
        if not line:
            raise RuntimeError(f"{function} failed in its process: see the error above")
        return json.loads(line)


def fresh(function: str, **keywords: Any) -> Any:
    """Call a function in an interpreter of its own; see `Worker.call`."""
    with Worker() as worker:
        return worker.call(function, **keywords)


def peak_memory() -> int:
    """Most memory that this process has had at a time, in bytes.

    On Linux from /proc: `getrusage` counts there also what the parent had when it started this
    process, so that a large parent would hide what a small child takes.
    """
    status = Path("/proc/self/status")
    if status.exists():
        for line in status.read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    try:
        import resource
    except ImportError:  # Windows
        return -1
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024


def _answer() -> None:
    """Answer calls until the input ends."""
    # Whatever else is printed must not mix with the answers.
    answers, sys.stdout = sys.stdout, sys.stderr
    for line in sys.stdin:
        function, keywords = json.loads(line)
        module, _, name = function.partition(":")
        value = getattr(import_module(module), name)(**keywords)
        print(json.dumps(value), file=answers, flush=True)


if __name__ == "__main__":
    _answer()
