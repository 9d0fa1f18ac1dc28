"""The closed-form motion with two impacts per period: its ranges, and simulation beside it."""

from __future__ import annotations

import math

import numpy as np

from damper.analysis.closed_forms import admissible_orbits, section_point
from damper.analysis.intervals import intervals
from damper.analysis.places import places, require_axes, require_variables
from damper.parameters.lazy import pd, xr
from damper.parameters.quantity import in_range
from damper.study.settings import SECTIONS
from damper.sweep.record import observers_of

#: Impacts per period are a quotient of whole numbers.
_TWO = 1e-9
#: Largest difference between the samples of a motion that has settled, in dimensionless units.
SETTLED = 1e-9
#: Kind of range -> least state.
RANGES = {"exists": 1, "stable": 2}
#: Dimensions along which runs of one point lie.
_BRANCHES = ("direction", "draw", "sample")


def two_impact_ranges(cube: xr.Dataset, along: str, resolution: float = 1e-3) -> pd.DataFrame:
    """Ranges of one axis in which a motion with two impacts per period exists, and is stable.

    They follow from the closed form; nothing of the cube counts but its axes.

    Parameters
    ----------
    cube : xarray.Dataset
        Of the rigid damper.
    along : str
        Axis of a parameter.
    resolution : float, default 1e-3
        Ends are bisected to this distance, between differing neighbours on the grid.

    Returns
    -------
    pandas.DataFrame
        One row for each range. Columns are the other axes, ``range`` (``exists`` or ``stable``),
        ``<along>_lower`` and ``<along>_upper``, and ``cut``, where the range reaches the end of the
        axis.
    """
    require_axes(cube, along)
    require_variables(cube, "stroboscopic_section", "displacement")
    in_range("resolution", resolution, minimum=0, above=True)
    grid = np.sort(cube[along].values).tolist()
    found = []
    for where in _places(cube, along):
        place = cube.sel(where)
        states = [_state(place, along, value) for value in grid]
        for kind, least in RANGES.items():

            def holds_at(value: float, place: xr.Dataset = place, least: int = least) -> bool:
                return _state(place, along, value) >= least

            inside = [state >= least for state in states]
            for one in intervals(grid, inside, holds_at, resolution):
                found.append((*where.values(), kind, one.lower, one.upper, one.cut))
    columns = ("range", f"{along}_lower", f"{along}_upper", "cut")
    return pd.DataFrame(found, columns=[*_others(cube, along), *columns])


def two_impact_errors(cube: xr.Dataset, along: str) -> pd.DataFrame:
    """Differences between simulated sections and the closed form, where it is stable.

    Of sections the last sample counts; all directions and draws count together.

    Parameters
    ----------
    cube : xarray.Dataset
        With the variables of a section and of the observer ``impacts``.
    along : str
        Axis of a parameter.

    Returns
    -------
    pandas.DataFrame
        One row for each place along the other axes. Columns are these axes and

        - ``simulated``: runs at which a stable motion exists, of these ``compared`` with two
          impacts per period, and of these ``settled``, whose samples repeat to 1e-9;
        - ``median``, ``largest``: differences of displacement or velocity, dimensionless, over all
          compared runs, and ``largest_settled`` over the settled ones; NaN where there are none.

    Raises
    ------
    ValueError
        When the cube has no such axis, no impacts, or not one section.
    """
    require_axes(cube, along)
    require_variables(cube, "impacts", "impacts_per_period")
    require_variables(cube, "stroboscopic_section", "displacement", "velocity", along=["sample"])
    section = {name: given for name, given in observers_of(cube).items() if name in SECTIONS}
    found = []
    for where in _places(cube, along):
        place = cube.sel(where)
        simulated, differences, spreads = 0, [], []
        for k, (both, units) in enumerate(admissible_orbits(place, along, place[along].values)):
            stable = [orbit for orbit in both if orbit and orbit.stable]
            if not stable:
                continue
            point = place.isel({along: k})
            impacts = np.atleast_1d(point.impacts_per_period.values).ravel()
            simulated += impacts.size
            samples = np.stack(
                [
                    point.displacement.transpose(..., "sample").values / units.length,
                    point.velocity.transpose(..., "sample").values / units.speed,
                ],
                axis=-1,
            ).reshape(impacts.size, -1, 2)
            expected = np.array([section_point(orbit, section) for orbit in stable])
            for run in samples[abs(impacts - 2.0) < _TWO]:
                known = run[np.isfinite(run).all(axis=1)]
                if known.size:
                    differences.append(abs(known[-1] - expected).max(axis=1).min())
                    spreads.append(np.ptp(known, axis=0).max())
        apart, spread = np.array(differences), np.array(spreads)
        settled = apart[spread < SETTLED] if apart.size else apart
        numbers = (
            float(np.median(apart)) if apart.size else math.nan,
            float(apart.max()) if apart.size else math.nan,
            float(settled.max()) if settled.size else math.nan,
        )
        found.append((*where.values(), simulated, apart.size, settled.size, *numbers))
    columns = ("simulated", "compared", "settled", "median", "largest", "largest_settled")
    return pd.DataFrame(found, columns=[*_others(cube, along), *columns])


def _state(place: xr.Dataset, along: str, value: float) -> int:
    """2 where a motion is stable, 1 where there are unstable ones alone, 0 where there is none."""
    ((both, _),) = admissible_orbits(place, along, [value])
    known = [orbit for orbit in both if orbit is not None]
    return 2 if any(orbit.stable for orbit in known) else int(bool(known))


def _places(cube: xr.Dataset, along: str) -> list[dict[str, float]]:
    return places(cube.displacement, along, *_BRANCHES)


def _others(cube: xr.Dataset, along: str) -> list[str]:
    return [str(dim) for dim in cube.displacement.dims if dim not in (along, *_BRANCHES)]
