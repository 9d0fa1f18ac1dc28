"""Compile the scalar core with numba where it is installed; leave it plain Python elsewhere.

One source serves both: functions under `compiled` use floats and `math` only. Set the
environment variable ``DAMPER_COMPILE=0`` to run the plain version although numba is there.

numba's disk cache does not notice an edit in a *called* module: a cached caller keeps the old
result. The cache therefore lives in a folder named by the digest of all of damper's source.
"""

import hashlib
import os
import shutil
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from functools import wraps
from pathlib import Path
from typing import Any

_KEPT_CACHES = 4
#: Seconds since a process last started with a cache, before which it may still be in use.
_UNUSED = 86400.0


def cache_folder() -> Path:
    """Folder of the compiled code of exactly this source, by its digest.

    Returns
    -------
    pathlib.Path
        Below ``NUMBA_CACHE_DIR`` if set, else below the user's cache folder.
    """
    return _cache_root() / source_digest()[:16]


def source_digest() -> str:
    """Hexadecimal SHA-256 of every Python file of damper, newlines normalised."""
    folder = Path(__file__).parent.parent
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py"), key=lambda path: path.relative_to(folder).as_posix()):
        digest.update(path.relative_to(folder).as_posix().encode())
        digest.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()


def _cache_root() -> Path:
    if "NUMBA_CACHE_DIR" in os.environ:
        return Path(os.environ["NUMBA_CACHE_DIR"]) / "damper"
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")
    return Path(base) / "damper"


def _make_cache_folder() -> Path | None:
    """Make the folder and drop the oldest of earlier versions; None where it cannot be written.

    Its time of modification becomes that of its last use: another process may be using any version
    that is younger than a day.
    """
    folder = cache_folder()
    try:
        is_new = not folder.is_dir()
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK):
            return None
        os.utime(folder)
        if is_new:
            _drop_unused(folder)
        return folder
    except OSError:
        return None


def _drop_unused(folder: Path) -> None:
    """Delete other versions' caches but for the newest, and those used within a day."""
    last_used = {}
    for path in folder.parent.iterdir():
        # Another process may delete one meanwhile.
        with suppress(OSError):
            if path.is_dir() and path != folder:
                last_used[path] = path.stat().st_mtime
    oldest_last = sorted(last_used, key=last_used.__getitem__, reverse=True)
    for path in oldest_last[_KEPT_CACHES:]:
        if last_used[path] < time.time() - _UNUSED:
            shutil.rmtree(path, ignore_errors=True)


def _load_numba() -> Any:
    if os.environ.get("DAMPER_COMPILE", "1") == "0":
        return None
    try:
        import numba
    except ImportError:
        return None
    return numba


_numba = _load_numba()
#: How compiled code treats x / 0: as arithmetic does, not as Python.
_OPTIONS = {"error_model": "numpy"}
_folder = _make_cache_folder() if _numba else None

#: True when the core runs as compiled code.
COMPILED = _numba is not None


def compiled(function: Callable) -> Callable:
    """Compile `function` (a decorator); return it unchanged where numba is missing or off."""
    if _numba is None:
        return function
    before = _numba.config.CACHE_DIR
    # numba reads this setting while it decorates; other packages' caches keep their place.
    _numba.config.CACHE_DIR = str(_folder) if _folder else ""
    try:
        return _numba.njit(cache=_folder is not None, **_OPTIONS)(function)
    finally:
        _numba.config.CACHE_DIR = before


def by_model(function: Callable) -> Callable:
    """Make a function that each model of the damper implements for itself (a decorator).

    A model is a NamedTuple of constants. ``@function.of(Model)`` gives the implementation for one
    class of model, and ``function.share(Model, Other)`` takes over that of another; the class of
    the first argument chooses among them. The function itself is for the classes without one.
    Compiled code chooses while it is compiled, so a run pays nothing for the choice, nor for models
    it does not use: those need not even be imported.
    """
    chosen: dict[type, Callable] = {}

    @wraps(function)
    def choose(model: tuple, *rest: Any) -> Any:
        return chosen.get(type(model), function)(model, *rest)

    def of(kind: type) -> Callable:
        def implement(implementation: Callable) -> Callable:
            chosen[kind] = compiled(implementation)
            return chosen[kind]

        return implement

    def share(kind: type, other: type) -> None:
        chosen[kind] = chosen[other]

    choose.share = share  # type: ignore[attr-defined]
    choose.of = of  # type: ignore[attr-defined]
    if _numba is not None:
        from numba.extending import overload

        def typed(model: Any, *rest: Any) -> Callable:
            implementation = chosen.get(model.instance_class, function)
            return getattr(implementation, "py_func", implementation)

        overload(choose, jit_options=_OPTIONS, strict=False)(typed)
    return choose
