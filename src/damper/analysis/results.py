"""The files behind a figure, a table or the verdicts."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any

from damper.parameters.lazy import xr


class Results(Mapping[str, Any]):
    """Results by name, netCDF or JSON, each opened when it is first asked for.

    A context, whose end closes them. Where it ends by an error and a file that was asked for is
    damaged, that is removed, so that the workflow makes it anew, and SystemExit names it.

    Parameters
    ----------
    paths : mapping of str to path
        Name -> file: ``cube``, ``orbits``, ``timings``, or what another study measures.
    """

    def __init__(self, paths: Mapping[str, Path | str]) -> None:
        self._paths = paths
        self._asked: dict[str, Path] = {}
        self._opened: dict[str, Any] = {}
        self._files = ExitStack()

    def __getitem__(self, name: str) -> Any:
        if name not in self._opened:
            path = self._asked[name] = Path(self._paths[name])
            self._opened[name] = _open(path, self._files)
        return self._opened[name]

    def __contains__(self, name: object) -> bool:
        return name in self._paths

    def __iter__(self) -> Iterator[str]:
        return iter(self._paths)

    def __len__(self) -> int:
        return len(self._paths)

    def __enter__(self) -> Results:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        self._files.close()
        if not isinstance(error, OSError | RuntimeError | ValueError):
            return
        damaged = [path for path in self._asked.values() if not _readable(path)]
        if not damaged:
            return
        for path in damaged:
            path.unlink(missing_ok=True)  # another job may have done so
        names = ", ".join(map(str, damaged))
        raise SystemExit(
            f"Damaged, and now removed: {names}. The same command again makes it anew."
        ) from None


def _open(path: Path, stack: ExitStack) -> Any:
    if path.suffix == ".json":
        return json.loads(path.read_text(encoding="utf-8"))
    # A schematic does not wait for this to load.
    return stack.enter_context(xr.open_dataset(path))


def _readable(path: Path) -> bool:
    try:
        with ExitStack() as stack:
            result = _open(path, stack)
            if not isinstance(result, dict):
                result.load()
    except (OSError, RuntimeError, ValueError):
        return False
    return True
