"""Fingerprints: a result says itself what it was made of.

Snakemake's own records lie in ``.snakemake``, which a clone, a copy or a clean-up loses. So every
file of results carries a digest of the settings of its job: parameters, engine, code, and the
fingerprints of the files it was made from. Whether a file is up to date is read off the file.
"""

import json
import re
import zlib
from collections.abc import Callable, Iterable
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any
from zipfile import ZipFile

_WRITTEN = re.compile(rb"fingerprint\W{1,4}([0-9a-f]{16})")
_TAIL = 256


def fingerprint(settings: Any) -> str:
    """Digest of the settings of a job, 16 hexadecimal digits; TypeError for what JSON cannot hold.

    Order counts: that of axes is the order of a cube's dimensions.
    """
    return sha256(json.dumps(settings).encode()).hexdigest()[:16]


def stamp(paths: Iterable[Path | str], settings: Any) -> None:
    """Write the fingerprint of a job's settings into the files it has made.

    CSV has no place for it, and is passed over.
    """
    for path in map(Path, paths):
        if write := _WRITERS.get(path.suffix):
            write(path, fingerprint(settings))


def fingerprint_in(path: Path | str) -> str | None:
    """Return the fingerprint that a file carries; None if it has none or was cut short."""
    with Path(path).open("rb") as file:
        file.seek(0, 2)
        file.seek(max(0, file.tell() - _TAIL))
        found = _WRITTEN.search(file.read())
    return found[1].decode() if found else None


def _stamp_npz(path: Path, digest: str) -> None:
    with ZipFile(path, "a") as file:
        file.comment = f"fingerprint: {digest}".encode()


def _stamp_png(path: Path, digest: str) -> None:
    """Insert a chunk of text before the last chunk, of twelve bytes."""
    chunk = b"tEXtfingerprint\0" + digest.encode()
    length, check = len(chunk) - 4, zlib.crc32(chunk)
    data = path.read_bytes()
    path.write_bytes(
        data[:-12] + length.to_bytes(4, "big") + chunk + check.to_bytes(4, "big") + data[-12:]
    )


def _stamp_json(path: Path, digest: str) -> None:
    data = json.loads(path.read_text(encoding="utf-8"))
    text = json.dumps(data | {"fingerprint": digest}, indent=1)
    path.write_text(f"{text}\n", encoding="utf-8", newline="\n")


def _append(path: Path, digest: str, comment: str) -> None:
    with path.open("a", encoding="utf-8", newline="\n") as file:
        file.write(comment.format(f"fingerprint: {digest}") + "\n")


_comment = partial(_append, comment="<!-- {} -->")
_WRITERS: dict[str, Callable[[Path, str], None]] = {
    # HDF5 knows the length of its own data, and reads nothing beyond.
    ".nc": partial(_append, comment="\n{}"),
    ".npz": _stamp_npz,
    ".png": _stamp_png,
    ".json": _stamp_json,
    ".js": partial(_append, comment="// {}"),
    **dict.fromkeys((".svg", ".md", ".html"), _comment),
}
