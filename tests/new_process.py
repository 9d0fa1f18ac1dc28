"""Code that runs in an interpreter of its own, such as one without numba."""

import json
import os
import subprocess
import sys
from typing import Any


def in_new_process(code: str, *options: str, **environment: str) -> Any:
    """Run code that prints JSON in a new interpreter, with options such as ``-W error``."""
    done = subprocess.run(
        [sys.executable, *options, "-c", code],
        capture_output=True,
        text=True,
        env={**os.environ, **environment},
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


_PLAIN_LANES = """
import json
from damper.engine.compiled import COMPILED
from damper.sweep.runs import run_points
arrays, _ = run_points({lanes!r}, {observers!r}, **{settings!r})
assert not COMPILED
print(json.dumps({{name: array.tolist() for name, array in arrays.items()}}))
"""


def plain_lanes(lanes: list[dict[str, float]], observers: Any, **settings: Any) -> dict[str, Any]:
    """Return the arrays of `run_points`, as lists, by a core that is not compiled."""
    code = _PLAIN_LANES.format(lanes=lanes, observers=observers, settings=settings)
    return in_new_process(code, "-W", "error", DAMPER_COMPILE="0")
