"""Fingerprints: a result says itself what it was made of, and whether it is whole.

Snakemake's own records lie in ``.snakemake``, which a clone, a copy or a clean-up loses. So every
file of results ends with two digests: that of the settings of its job (parameters, engine, code,
and the fingerprints of the files it was made from), and that of its own bytes. Whether a file is
up to date, and as it was written, is read off the file.
"""

import json
import re
import zlib
from collections.abc import Callable, Iterable
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Any, BinaryIO

_WRITTEN = re.compile(rb"fingerprint\W{1,4}([0-9a-f]{16}) ([0-9a-f]{16})")
_TAIL = 256


def fingerprint(settings: Any) -> str:
    """Digest of the settings of a job, 16 hexadecimal digits; TypeError for what JSON cannot hold.

    Order counts: that of axes is the order of a cube's dimensions.
    """
    return sha256(json.dumps(settings).encode()).hexdigest()[:16]


def stamp(paths: Iterable[Path | str], settings: Any) -> None:
    """Write the fingerprint of a job's settings, and of their bytes, into the files it has made.

    CSV has no place for it: the fingerprint in the Markdown beside it holds for both.
    """
    made_of = fingerprint(settings)
    for path in map(Path, paths):
        if path.suffix in _ENDS:
            last, end = _ENDS[path.suffix]
            with path.open("r+b") as file:
                found = re.search(last + rb"\Z", _tail(file))
                if found is None:
                    raise ValueError(f"{path} does not end as a whole {path.suffix} file does")
                size = file.seek(-len(found[0]), 2)
                file.truncate()
                written = end(f"{made_of} {_content(path, file, size, made_of)}")
                file.write(written)


def fingerprint_in(path: Path | str) -> str | None:
    """Return the fingerprint of a file, or None where it is missing or the bytes have changed.

    All of it is read. `Checked` remembers of which files that has been done.
    """
    path = Path(path)
    if not path.is_file():  # to read a pipe would wait for ever
        return None
    with path.open("rb") as file:
        tail = _tail(file)
        if found := _WRITTEN.findall(tail):
            made_of, content = (digest.decode() for digest in found[-1])
            end = _ENDS[path.suffix][1](f"{made_of} {content}")
            size = file.seek(0, 2) - len(end)
            if tail.endswith(end) and _content(path, file, size, made_of) == content:
                return made_of
    return None


class Checked:
    """Fingerprints of files that have been read, for as long as their sizes and times are the same.

    Parameters
    ----------
    record : Path
        A file that keeps them for the next process. A line is added for each file that is read.
    """

    def __init__(self, record: Path) -> None:
        self.record = record
        self._known: dict[str, tuple[str, str]] = {}
        lines = record.read_bytes().splitlines(keepends=True) if record.is_file() else []
        for line in lines:
            with suppress(ValueError, TypeError):  # cut, where a process was killed
                path, state, found = json.loads(line)
                self._known[path] = state, found
        if len(lines) > 2 * len(self._known):
            record.write_text("".join(_line(path, *known) for path, known in self._known.items()))

    def fingerprint_in(self, path: Path | str) -> str | None:
        """Return what `fingerprint_in` does, without reading a file a second time."""
        path = Path(path)
        state, known = _state(path), self._known.get(str(path))
        if known and known[0] == state:
            return known[1]
        found = fingerprint_in(path)
        if found:
            self._known[str(path)] = state, found
            with self.record.open("a") as file:
                file.write(_line(str(path), state, found))
        return found


def _line(*known: str) -> str:
    return json.dumps(known) + "\n"


def _state(path: Path) -> str:
    """Return what changes with the bytes of a file, or of the CSV beside it.

    The time of modification can be set back, the time of the last change cannot.
    """
    found = (one.stat() for one in (path, *_beside(path)))
    return " ".join(f"{one.st_size} {one.st_mtime_ns} {one.st_ctime_ns}" for one in found)


def _beside(path: Path) -> list[Path]:
    """Return the file whose bytes the digest in this one covers as well."""
    csv = path.with_suffix(".csv")
    return [csv] if path.suffix == ".md" and csv.is_file() else []


def _tail(file: BinaryIO) -> bytes:
    file.seek(max(0, file.seek(0, 2) - _TAIL))
    return file.read()


def _content(path: Path, file: BinaryIO, size: int, made_of: str) -> str:
    """Digest of the first bytes of a file, with its fingerprint, and of the CSV beside it."""
    digest = sha256(made_of.encode())
    file.seek(0)
    while size > 0 and (part := file.read(min(size, 2**20))):
        digest.update(part)
        size -= len(part)
    for other in _beside(path):
        digest.update(other.read_bytes())
    return digest.hexdigest()[:16]


def _chunk(text: str) -> bytes:
    """Return a chunk of text for a PNG, and the last chunk of one."""
    data = b"tEXtfingerprint\0" + text.encode()
    length, check = len(data) - 4, zlib.crc32(data)
    return length.to_bytes(4, "big") + data + check.to_bytes(4, "big") + _IEND


def _zip_comment(text: str) -> bytes:
    comment = f"fingerprint: {text}".encode()
    return len(comment).to_bytes(2, "little") + comment


def _after(form: str) -> tuple[bytes, Callable[[str], bytes]]:
    return b"", lambda text: form.format(f"fingerprint: {text}").encode()


_IEND = b"\0\0\0\0IEND\xaeB`\x82"
# Suffix -> how a file ends (a pattern), and what takes the place of that, with both digests in it.
_ENDS: dict[str, tuple[bytes, Callable[[str], bytes]]] = {
    # HDF5 knows the length of its own data, and reads nothing beyond.
    ".nc": _after("\n{}\n"),
    ".npz": (rb"\0\0", _zip_comment),
    ".png": (re.escape(_IEND), _chunk),
    ".json": (rb"\s*}\s*", lambda text: f',\n "fingerprint": "{text}"\n}}\n'.encode()),
    ".js": _after("// {}\n"),
    **dict.fromkeys((".svg", ".md", ".html"), _after("<!-- {} -->\n")),
}
