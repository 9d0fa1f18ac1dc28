"""The files behind a figure, a table or the verdicts."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any


@contextmanager
def opened(
    paths: Sequence[Path | str],
    settings: dict[str, Any] | None = None,
    beside: Sequence[Path | str] = (),
) -> Iterator[list[Any]]:
    """Open the results, netCDF or JSON, that a figure or table shows, and cubes beside them.

    In the `also` of its settings the name of each study gives way to its cube, the files `beside`
    in that order. SystemExit names a file that is damaged; it is removed, so that the workflow
    makes it anew.
    """
    with ExitStack() as stack:
        try:
            others = [_open(other, stack) for other in beside]
            if settings is not None and others:
                settings["also"] = dict(zip(settings["also"], others, strict=True))
            yield [_open(path, stack) for path in paths]
        except (OSError, RuntimeError, ValueError):
            stack.close()
            if damaged := [path for path in (*paths, *beside) if not _readable(path)]:
                for path in map(Path, damaged):
                    path.unlink(missing_ok=True)  # another job may have done so
                names = ", ".join(map(str, damaged))
                raise SystemExit(
                    f"Damaged, and now removed: {names}. The same command again makes it anew."
                ) from None
            raise


def _open(path: Path | str, stack: ExitStack) -> Any:
    if Path(path).suffix == ".json":
        return json.loads(Path(path).read_text(encoding="utf-8"))
    # A schematic does not wait for this to load.
    import xarray as xr

    return stack.enter_context(xr.open_dataset(path))


def _readable(path: Path | str) -> bool:
    try:
        with ExitStack() as stack:
            result = _open(path, stack)
            if not isinstance(result, dict):
                result.load()
    except (OSError, RuntimeError, ValueError):
        return False
    return True
