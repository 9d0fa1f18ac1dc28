"""Runs that stopped early, and idle runs: how many each study has, for those who read results."""

from collections.abc import Iterable
from pathlib import Path


def stopped_early(cube: Path) -> str:
    """Return how many runs of a cube stopped early, in words, or nothing if none did.

    Only attributes are read. A cube without them, of a study that checks the engine, has none.
    """
    from netCDF4 import Dataset

    with Dataset(cube) as file:
        stopped = int(getattr(file, "runs_stopped_early", 0))
        return f"{stopped} of {int(file.runs)} runs stopped early" if stopped else ""


def idle_runs(cube: Path) -> str:
    """Return how many runs of a cube are idle because they start at exact rest, in words."""
    from netCDF4 import Dataset

    with Dataset(cube) as file:
        idle = int(getattr(file, "runs_idle_from_rest", 0))
        return f"{idle} of {int(file.runs)} runs never touch a wall" if idle else ""


def stopped_lines(results: Path, studies: Iterable[str]) -> list[str]:
    """Return a line for each study whose cube has such runs."""
    cubes = {name: results / name / "cube.nc" for name in studies}
    found = {name: stopped_early(path) for name, path in cubes.items() if path.is_file()}
    return [f"{name}: {text} (`status` in the cube)" for name, text in found.items() if text]
