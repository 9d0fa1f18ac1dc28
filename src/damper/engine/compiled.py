"""Compile the scalar core with numba where it is installed; leave it plain Python elsewhere.

One source serves both: functions under `compiled` use floats and `math` only. Set the
environment variable ``DAMPER_COMPILE=0`` to run the plain version although numba is there; numba's
own ``NUMBA_DISABLE_JIT=1`` does the same.

Plain and compiled code give the same bytes. So each function begins as plain Python, and is
compiled once it has run for as long as compiling (some seconds) or loading from the cache would
take. A run thus takes at most twice the time of the better choice. Sweeps compile all that they
call together (`compiling`).

numba's disk cache does not notice an edit in a *called* module: a cached caller keeps the old
result. The cache therefore lives in a folder named by the digest of all of damper's source.
"""

import gc
import hashlib
import importlib.util
import os
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, update_wrapper, wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numpy as np

from damper.engine.terminal import saying
from damper.parameters.warned import warn

P = ParamSpec("P")
Result = TypeVar("Result")

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
    if given := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(given) / "damper"
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "damper"


@cache
def _cache() -> Path:
    """Folder of the compiled code of the source that this process has loaded."""
    return cache_folder()


def _warn(trouble: str) -> None:
    """Say once in a process that it cannot keep what it compiles."""
    global _warned
    if not _warned:
        _warned = True
        warn(f"the cache of compiled code: {trouble}; compiling without it", RuntimeWarning)


def cache_trouble() -> str:
    """Make the folder of compiled code ready; return why it cannot be used, or nothing.

    Write access to the cache is the right to run code as this user. So the cache is used only where
    every folder, from the parent of ``damper`` down, belongs to the user and nobody else may write
    to it. The oldest caches of other versions are dropped.
    """
    folder = cache_folder()
    is_new = not folder.is_dir()
    try:
        for each in (folder.parents[1], folder.parent, folder):
            each.mkdir(mode=0o700, parents=True, exist_ok=True)
            if trouble := _distrust(each):
                return trouble
        # numba leaves the modes of what it makes to the umask; nobody gets into a closed folder.
        if folder.stat().st_mode & 0o077:
            for each in filter(Path.is_dir, folder.iterdir()):
                if trouble := _distrust(each):
                    return trouble
        if os.access(folder, os.W_OK):
            # When it was last used: another process may be using any version younger than a day.
            os.utime(folder)
            if is_new:
                _drop_unused(folder)
            return ""
    except OSError:
        pass
    return f"{folder} cannot be written"


def _distrust(folder: Path) -> str:
    """Return who else may write to a folder; empty if nobody, and on Windows, which does not
    say."""
    if not hasattr(os, "geteuid"):
        return ""
    about = folder.stat()
    if about.st_uid != os.geteuid():
        return f"{folder} belongs to another user (uid {about.st_uid})"
    others = 0o002 if _is_own_group(about.st_gid) else 0o022
    if about.st_mode & others:
        return f"others may write to {folder} (mode {about.st_mode & 0o777:o})"
    return ""


def _is_own_group(number: int) -> bool:
    """Whether a group is this user's alone, as many systems make one for each user."""
    import grp
    import pwd

    try:
        group, user = grp.getgrgid(number), pwd.getpwuid(os.geteuid()).pw_name
    except KeyError:
        return False
    return group.gr_name == user and set(group.gr_mem) <= {user}


def _make_cache_folder() -> Path | None:
    """Make the folder of compiled code and return it; warn and return None where it cannot be
    used."""
    if trouble := cache_trouble():
        _warn(trouble)
        return None
    return cache_folder()


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


#: How compiled code treats x / 0: as arithmetic does, not as Python. It runs without the
#: interpreter's lock, so threads share the cores.
OPTIONS = {"error_model": "numpy", "nogil": True}
#: Options of functions that only compiled code calls. They become a part of their caller, so
#: segments stay in registers, without an entry for Python and without machine code of their own
#: (`damper.engine.inner`), which would take long to compile.
INNER_OPTIONS: Any = {
    **OPTIONS,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    "forceinline": True,
}

#: True when the core runs as compiled code.
COMPILED = (
    os.environ.get("DAMPER_COMPILE", "1") != "0"
    and os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0")
    and importlib.util.find_spec("numba") is not None
)

#: Seconds of a processor that a process runs plain before it loads compiled code.
LOADING = 0.3
#: Seconds that a function runs plain before it is compiled, where the cache does not hold it.
COMPILING = 5.0
#: Seconds that it runs plain between two looks into the cache.
LOOKING = 0.01

#: Thresholds of the collector of garbage while numba compiles: a compilation makes millions of
#: objects that all last until it ends, and looking at them took 7 % of its time.
_SELDOM = 200_000, 10, 100

_lock = threading.RLock()
_NUMBERS = frozenset((float, int))
#: Flags of an array: writeable, and in the order of C or else of Fortran. One row has both.
_WRITEABLE, _C_ORDER, _FORTRAN_ORDER = 0x400, 0x1, 0x2
#: Class of a NamedTuple -> for each structure of its instances: a function that lists the types
#: that may differ, these types, and the text of all types.
_structures: dict[type, list[tuple[Callable[[tuple], list], list, str]]] = {}
#: The last instance, and its text: a run calls several functions with one model.
_last_kind: tuple[object, str] = (None, "")


class _Plain(threading.local):
    """Whether this thread runs plain Python."""

    running = False


_plain = _Plain()
_at_once = _together = False
_spent = 0.0
_warned = False
_numba: Any = None
_folder: Path | None = None
_waiting: list[Callable[[], None]] = []


def when_numba_loads(action: Callable[[], None]) -> None:
    """Do something as soon as numba is loaded: at once if it is, never where it is not used."""
    if _numba is not None:
        action()
    elif COMPILED:
        _waiting.append(action)


def _load_numba() -> Any:
    """Import numba and make the declarations that waited for it; compilation is single-file."""
    global _numba, _folder
    with _lock:
        if _numba is None:
            import numba
            from numba.core import types
            from numba.extending import typeof_impl

            # A numba with other private classes compiles as it always does: slower, to the same.
            with suppress(Exception):
                from damper.engine.inner import tried_compiler

                INNER_OPTIONS["pipeline_class"] = tried_compiler(INNER_OPTIONS)
            # To compiled code a `Compiled` is the function that it holds.
            typeof_impl.register(Compiled)(lambda value, _: types.Dispatcher(value.inner))
            _folder = _make_cache_folder()
            _numba = numba
            for action in _waiting:
                action()
            _waiting.clear()
    return _numba


class Compiled:
    """A function that numba compiles when it is first called.

    Called from Python, the function is compiled with its callees and kept in the cache. Called from
    compiled code, it becomes a part of the caller, without an entry for Python and for the cache:
    these entries cost more than half of the compile time.
    """

    def __init__(self, function: Callable, is_apart: bool = False) -> None:
        update_wrapper(self, function)
        self.py_func = function
        self._is_apart = is_apart
        self._inner: Any = None
        self._outer: Any = None
        self._entries: dict[tuple, Callable] = {}
        self._spent: dict[tuple, float] = {}
        self._looks: dict[tuple, float] = {}
        """Seconds of plain running at which the next look into the cache is due."""

    @property
    def inner(self) -> Any:
        """The function as compiled code calls it."""
        with _lock:
            if self._inner is None:
                numba = _load_numba()
                options = INNER_OPTIONS | ({"forceinline": False} if self._is_apart else {})
                self._inner = numba.njit(**options)(self.py_func)
        return self._inner

    @property
    def outer(self) -> Any:
        """The function as Python calls it."""
        with _lock:
            if self._outer is None:
                numba = _load_numba()
                before = numba.config.CACHE_DIR
                # numba reads this when it decorates; other packages' caches keep their place.
                numba.config.CACHE_DIR = str(_folder) if _folder else ""
                try:
                    # numba keeps no code of a function that is in no file (`damper.engine.tuples`).
                    kept = _folder is not None and Path(self.py_func.__code__.co_filename).exists()
                    self._outer = numba.njit(cache=kept, **OPTIONS)(self.py_func)
                finally:
                    numba.config.CACHE_DIR = before
        return self._outer

    def __call__(self, *arguments: Any) -> Any:
        if _plain.running:
            return self.py_func(*arguments)
        kinds = _kinds(arguments)
        entry = self._entries.get(kinds)
        if entry:
            return entry(*arguments)
        if self._waits(kinds):
            return self._run_plain(kinds, arguments)
        return self._first_call(kinds, arguments)

    def ready(self, *arguments: Any) -> Callable | None:
        """Return compiled code for these arguments, or None to run plain Python first (the run may
        be short)."""
        if _plain.running:
            return self.py_func
        kinds = _kinds(arguments)
        entry = self._entries.get(kinds)
        return None if entry is None and self._waits(kinds) else entry or self

    def is_kept(self, *arguments: Any) -> bool:
        """Whether the cache holds it for these arguments."""
        return self._note(_kinds(arguments)).exists()

    def _waits(self, kinds: tuple) -> bool:
        global _at_once
        if _at_once:
            return False
        if _numba is None and _spent < LOADING:
            return True
        spent = self._spent.get(kinds, 0.0)
        if spent >= COMPILING:
            _at_once = _together
            return False
        if spent < self._looks.get(kinds, 0.0):
            return True
        if self._note(kinds).exists():
            return False
        # Another process may compile it meanwhile; to look takes 20 us.
        self._looks[kinds] = spent + LOOKING
        return True

    def _note(self, kinds: tuple) -> Path:
        """File that is there once the cache has this function for arguments of these kinds."""
        code = self.py_func.__code__
        text = f"{code.co_filename} {code.co_qualname} {kinds}"
        return _cache() / f"{hashlib.sha256(text.encode()).hexdigest()[:16]}.txt"

    def _first_call(self, kinds: tuple, arguments: tuple) -> Any:
        """Call, and keep the machine code for arguments of these kinds.

        numba's own way to it takes 15 us for a model, a tuple of tuples: more than a short run.
        """
        try:
            entry = _compile(self.outer, arguments)
        except Exception as error:
            # A damaged file, or no room for a new one.
            self._forget_cache(error)
            entry = _compile(self.outer, arguments)
        self._entries[kinds] = entry
        if _folder is not None:
            with suppress(OSError):
                self._note(kinds).touch()
        return entry(*arguments)

    def _forget_cache(self, error: Exception) -> None:
        """Drop this function's part of the cache, for the next process, and do without for this."""
        with _lock:
            folder = self._outer.stats.cache_path
            if folder is None:
                raise error
            code = self.py_func.__code__
            for path in Path(folder).glob(f"*.{code.co_qualname}-{code.co_firstlineno}.*"):
                with suppress(OSError):
                    path.unlink()
            _warn(f"a file in {folder} cannot be used ({error or type(error).__name__})")
            self._outer = _load_numba().njit(**OPTIONS)(self.py_func)

    def _run_plain(self, kinds: tuple, arguments: tuple) -> Any:
        global _spent
        # What it takes of a processor: on a busy machine a short run stays one.
        started = time.thread_time()
        try:
            return _plainly(self.py_func, *arguments)
        finally:
            passed = time.thread_time() - started
            _spent += passed
            self._spent[kinds] = self._spent.get(kinds, 0.0) + passed


def _compile(outer: Any, arguments: tuple) -> Callable:
    """Machine code for arguments of these types, compiled or from the cache."""
    from numba.core.compiler_lock import global_compiler_lock

    types = tuple(outer.typeof_pyval(argument) for argument in arguments)
    # One thread compiles at a time; what it leaves to collect is little.
    with global_compiler_lock:
        before = gc.get_threshold()
        gc.set_threshold(*_SELDOM)
        try:
            with saying(f"compiling {outer.py_func.__module__}, once for this version of damper"):
                return outer.compile(types)
        finally:
            gc.set_threshold(*before)


def _kinds(arguments: tuple) -> tuple:
    """Key of the machine code for these arguments: all types, inner types included."""
    return tuple([t if (t := type(a)) in _NUMBERS else _kind(a) for a in arguments])


def _kind(argument: Any) -> Any:
    global _last_kind
    kind = type(argument)
    if kind is np.ndarray:
        flags = argument.flags.num
        order = _C_ORDER if flags & _C_ORDER else _FORTRAN_ORDER
        return argument.dtype, argument.ndim, flags & (_WRITEABLE | order)
    known = _last_kind
    if known[0] is argument:
        return known[1]
    for list_types, types, text in _structures.get(kind, ()):
        try:
            if list_types(argument) == types:
                _last_kind = argument, text
                return text
        except (LookupError, TypeError):
            continue  # another structure, without all of these parts
    if not isinstance(argument, tuple):
        return kind
    return (kind, *_kinds(argument)) if kind is tuple else _new_structure(argument)


def _new_structure(argument: tuple) -> str:
    """All types in a NamedTuple, as a text.

    Walking through a model takes a tenth of the time of a short run. So each class and structure
    gets a function that lists only the types that may differ between instances.
    """
    list_types = eval(f"lambda a: [{', '.join(_listing(argument, 'a'))}]", {"kind": _kind})
    text = repr(_all_types(argument))
    _structures.setdefault(type(argument), []).append((list_types, list_types(argument), text))
    return text


def _listing(argument: tuple, path: str) -> Iterator[str]:
    """Code of what may differ in a tuple that is found at a path.

    Not fields of type float: compiled code takes any number for one.
    """
    fields = getattr(argument, "_fields", ())
    declared = [type(argument).__annotations__.get(name) for name in fields]
    if not declared:
        yield f"len({path})"
    for k, part in enumerate(argument):
        if not (declared and declared[k] is float is type(part)):
            yield f"type({path}[{k}])"
        if isinstance(part, tuple):
            yield from _listing(part, f"{path}[{k}]")
        elif isinstance(part, np.ndarray):
            yield f"kind({path}[{k}])"


def _all_types(argument: Any) -> Any:
    if isinstance(argument, tuple):
        return type(argument), *map(_all_types, argument)
    return _kind(argument)


def compile_at_once() -> None:
    """Let this process compile what it calls without running it plain first."""
    global _at_once
    _at_once = True


@contextmanager
def compiling(at_once: bool = True) -> Iterator[None]:
    """Compile within it what is called without running it plain first: all of it will run often.

    If not `at_once`, that begins when the first function has run plain for long enough.
    """
    global _at_once, _together
    before = _at_once, _together
    _at_once, _together = _at_once or at_once, True
    try:
        yield
    finally:
        _at_once, _together = before


def plain(function: Callable[P, Result]) -> Callable[P, Result]:
    """Run `function`, with all that it calls, as plain Python (a decorator).

    For what makes a NamedTuple: numba builds it for Python by a call that a user's interrupt can
    break off, which ends the process. It also takes longer.
    """

    @wraps(function)
    def run(*arguments: P.args, **named: P.kwargs) -> Result:
        return _plainly(function, *arguments, **named)

    return run


def _plainly(function: Callable[P, Result], *arguments: P.args, **named: P.kwargs) -> Result:
    before = _plain.running
    _plain.running = True
    try:
        return function(*arguments, **named)
    finally:
        _plain.running = before


def compiled(function: Callable) -> Callable:
    """Compile `function` (a decorator); return it unchanged where numba is missing or off."""
    return Compiled(function) if COMPILED else function


def compiled_apart(function: Callable) -> Callable:
    """As `compiled`, but callers share the code: for a long function that several call.

    Each call counts references to the arrays of its arguments, some 5 ns an array.
    """
    return Compiled(function, is_apart=True) if COMPILED else function
