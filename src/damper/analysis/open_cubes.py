"""The files behind a figure or table. Apart from how cubes are made, which is not their concern."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr


@contextmanager
def open_cubes(
    path: Path | str | None, settings: dict[str, Any], beside: Sequence[Path | str] = ()
) -> Iterator[xr.Dataset | None]:
    """Open the cube that a figure or table is made of, and those of the other studies it names.

    Parameters
    ----------
    path : Path or None
        The cube's file; None for a schematic, which has no cube.
    settings : dict
        The figure's or table's; in `also`, the name of each study gives way to its cube.
    beside : sequence of Path
        The files of those cubes, in that order.

    Yields
    ------
    xarray.Dataset or None
    """
    if path is None and not beside:
        # A schematic does not wait for xarray to load.
        yield None
        return
    import xarray as xr

    with ExitStack() as stack:
        if beside:
            others = [stack.enter_context(xr.open_dataset(other)) for other in beside]
            settings["also"] = dict(zip(settings["also"], others, strict=True))
        yield None if path is None else stack.enter_context(xr.open_dataset(path))


def read_results(path: Path) -> Any:
    """Read what a study that checks the engine has found.

    Parameters
    ----------
    path : Path
        A netCDF file, or JSON.

    Returns
    -------
    xarray.Dataset, or dict
    """
    if path.suffix == ".json":
        return json.loads(path.read_text(encoding="utf-8"))
    import xarray as xr

    return xr.load_dataset(path)
