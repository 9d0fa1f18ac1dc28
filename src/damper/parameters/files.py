"""Files that users name: their bytes, and what SciPy reads of them."""

import io
import os
import stat
from pathlib import Path
from typing import Any

#: Most bytes of a file of samples: some 50 million of them.
MOST_BYTES = 10**9


def contents(path: str | os.PathLike[str], most: int = MOST_BYTES) -> bytes:
    """Return the bytes of a regular file.

    Raises
    ------
    OSError
        Where it cannot be read, has too many bytes, or is a pipe, a device or a folder.
    """
    found = os.stat(path)
    if not (stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode)):
        raise OSError(22, "it is a pipe or a device, not a regular file", str(path))
    if found.st_size > most:
        size = f"it has {found.st_size / 1e6:.0f} MB, more than {most / 1e6:g} MB"
        raise OSError(27, size, str(path))
    with Path(path).open("rb") as file:
        # Files of the system, such as /proc/kmsg, have size 0 and may have no end.
        return file.read(found.st_size)


def path_of(given: Any, name: str = "path", kind: str = "file") -> str:
    """Return the path of a file or folder as text; TypeError with `name` for anything else."""
    path = os.fspath(given) if isinstance(given, str | os.PathLike) else None
    if not isinstance(path, str) or not path or "\0" in path:
        raise TypeError(f"{name} = {given!r}: must be the path of a {kind}")
    return path


def state_of(path: str | os.PathLike[str]) -> tuple[int, ...]:
    """Return numbers that change when the file does: its place on the disk, size and times."""
    found = os.stat(path)
    return found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns


def scipy_io(path: str | os.PathLike[str]) -> Any:
    """Return `scipy.io`; ValueError with the file that needs it where SciPy is not there."""
    try:
        from scipy import io as readers
    except ImportError:
        raise ValueError(f"{path}: reading it needs scipy, of damper[workflow]") from None
    return readers


def matlab_variables(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the variables of a MATLAB file up to version 7; ValueError or OSError for others."""
    readers, data = scipy_io(path), io.BytesIO(contents(path))
    try:
        found = readers.loadmat(data)
    # Also an error of its own, which is a plain Exception.
    except Exception as error:
        raise ValueError(
            f"{path}: not a file of MATLAB up to version 7 (save it with -v7): {error}"
        ) from None
    return {name: array for name, array in found.items() if not name.startswith("__")}
