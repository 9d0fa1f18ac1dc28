"""Functions called in a new interpreter, and how much memory it takes.

This file imports the standard library only: a new interpreter has loaded nothing else.
"""

import json
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any


def fresh(function: str, **keywords: Any) -> Any:
    """Call a function in an interpreter of its own.

    Parameters
    ----------
    function : str
        ``module:name``; takes and returns what JSON can hold.
    **keywords
        Its arguments.

    Raises
    ------
    RuntimeError
        When it fails; its own error is on standard error.
    """
    done = subprocess.run(
        [sys.executable, "-m", "damper.verification.cost.process", function],
        input=json.dumps(keywords),
        stdout=subprocess.PIPE,
        text=True,
        encoding="utf-8",
    )
    if done.returncode:
        raise RuntimeError(f"{function} failed in its process: see the error above")
    return json.loads(done.stdout)


def peak_memory() -> int:
    """Most memory that this process has had at a time, in bytes; -1 where that is not known.

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


def _answer(function: str) -> None:
    # Whatever else is printed must not mix with the answer.
    answer, sys.stdout = sys.stdout, sys.stderr
    module, _, name = function.partition(":")
    json.dump(getattr(import_module(module), name)(**json.load(sys.stdin)), answer)


if __name__ == "__main__":
    _answer(sys.argv[1])
