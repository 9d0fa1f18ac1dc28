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


def modules_after(code: str, *options: str, **environment: str) -> set[str]:
    """Names of all modules that are loaded once code has run in a new interpreter."""
    show = "import json, sys\nprint(json.dumps(list(sys.modules)))"
    return set(in_new_process(f"{code}\n{show}", *options, **environment))
