"""The best value of an axis, such as the clearance, and how well the damper damps there."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from damper.analysis.places import places, require_axes, require_variables, within
from damper.analysis.reduction import as_low, dimensions, least
from damper.analysis.reduction import worst as worst_of
from damper.parameters.lazy import pd, xr
from damper.parameters.quantity import in_range
from damper.parameters.variables import Chatter
from damper.sweep.idle import of_any_mass

#: Rms ratio below which damping is good, and amplitude ratio below which the damped band lies.
GOOD, DAMPED = 0.5, 0.9
#: Relative distance from the resonance that still counts as near it.
NEAR = 0.1
#: Two impacts per forcing period, to this tolerance, is the classical damper motion.
_TWO = 0.05
#: A ratio to the response without damper is 1 within this: transients have not quite died.
SAME = 1e-3


def best_clearance(
    cube: xr.Dataset,
    along: str = "frequency_ratio",
    over: str = "clearance",
    damped: float = DAMPED,
    worst: Sequence[str] = (),
) -> pd.DataFrame:
    """Best clearance at every place along the other axes, and how well it damps.

    The best clearance is the one whose largest amplitude over the whole frequency range is
    smallest. Amplitude ratios compare with the exact linear response without the damper.

    Parameters
    ----------
    cube : xarray.Dataset
        With the variables of the observers ``response``, ``impacts`` and ``bursts``.
    along : str, default "frequency_ratio"
        Axis of the frequency.
    over : str, default "clearance"
        Axis that is chosen best; ``gap`` in SI units.
    damped : float, default 0.9
        Amplitude ratio below which a frequency belongs to the damped band.
    worst : sequence of str, optional
        Dimensions whose values are runs at one point, of which the worst counts: ``draw``,
        ``direction``, or axes.

    Returns
    -------
    pandas.DataFrame
        One row for each place, none where a run stopped early at every clearance. Columns are the
        other axes and

        - ``best_<over>``, ``interior``: False at the first and the last value of the axis, and
          ``equally_good``: how many more values have the same largest amplitude;
        - ``worst_amplitude``: largest amplitude over the range there, with those at the
          neighbouring clearances ``_below`` and ``_above`` (NaN beyond the axis) and
          ``undamped_amplitude``, all in the cube's unit of length;
        - ``band``: width of the damped frequencies, in the unit of `along`; ``amplified``: of those
          at which the amplitude is larger than without damper;
        - ``highest_amplitude_ratio``; ``lowest_amplitude_ratio``, ``lowest_at_<along>``, and there
          ``impacts_per_period``, ``sticking_fraction`` and ``chatter``, of the worst run.

    Raises
    ------
    ValueError
        When the cube lacks an axis or a variable.

    Examples
    --------
    >>> import damper
    >>> cube = damper.simulate(mass_ratio=0.1, damping_ratio=0.02, frequency_ratio=[0.9, 1.0, 1.1],
    ...                        clearance=[2.0, 9.0, 30.0], restitution=0.3, transient=100,
    ...                        periods=20, observers=["response", "impacts", "bursts"])
    >>> best_clearance(cube)[["best_clearance", "interior"]]
       best_clearance  interior
    0             9.0      True
    """
    require_axes(cube, along, over)
    in_range("damped", damped, minimum=0, above=True)
    _require_observers(cube, "peak_displacement", "amplitude_ratio")
    cube = _of_any_mass(cube)
    worst = dimensions(cube.amplitude_ratio, worst, "worst") if worst else []
    for name in worst:
        if name in (along, over):
            raise ValueError(f"worst: {name!r} has another part already: must be another dimension")
    amplitudes = cube.peak_displacement, cube.amplitude_ratio
    peak, ratio = (worst_of(each, worst) if worst else each for each in amplitudes)
    found = []
    names = [str(dim) for dim in ratio.dims if dim not in (along, over)]
    for where in places(ratio, along, over):
        # Where a run stopped early nothing is known, so that clearance cannot be the best.
        largest = peak.sel(where).max(along, skipna=False)
        if not np.isfinite(largest).any():
            continue
        place = least(largest.values)
        ratios = ratio.sel(where).isel({over: place}).values
        low = int(np.argmin(ratios))
        line = cube.sel(where).isel({over: place})
        point = line.isel({along: low})
        if worst:
            point = point.isel(point.amplitude_ratio.argmax(worst))
        around = np.pad(largest.values, 1, constant_values=math.nan)
        widths = _widths(line[along].values)
        found.append(
            where
            | {
                f"best_{over}": float(largest[over][place]),
                "worst_amplitude": float(largest[place]),
                "worst_amplitude_below": float(around[place]),
                "worst_amplitude_above": float(around[place + 2]),
                "undamped_amplitude": float((line.peak_displacement / line.amplitude_ratio).max()),
                "band": float(widths[ratios < damped].sum()),
                "amplified": float(widths[ratios > 1.0 + SAME].sum()),
                "highest_amplitude_ratio": float(ratios.max()),
                "lowest_amplitude_ratio": float(ratios[low]),
                f"lowest_at_{along}": float(line[along][low]),
                "impacts_per_period": float(point.impacts_per_period),
                "sticking_fraction": float(point.sticking_fraction),
                "chatter": int(point.chatter),
                "interior": 0 < place < largest.size - 1,
                "equally_good": int(as_low(largest.values).sum()) - 1,
            }
        )
    columns = (
        *(f"best_{over}", "worst_amplitude", "worst_amplitude_below", "worst_amplitude_above"),
        *("undamped_amplitude", "band", "amplified", "highest_amplitude_ratio"),
        *("lowest_amplitude_ratio", f"lowest_at_{along}"),
        *("impacts_per_period", "sticking_fraction", "chatter", "interior", "equally_good"),
    )
    return pd.DataFrame(found, columns=[*names, *columns])


def damping_shares(
    cube: xr.Dataset, along: str = "frequency_ratio", good: float = GOOD
) -> dict[str, float]:
    """Return shares and medians over the well damped runs of a cube.

    Parameters
    ----------
    cube : xarray.Dataset
        With the variables of the observers ``response``, ``impacts`` and ``bursts``. Of several
        runs at a point each counts.
    along : str, default "frequency_ratio"
        Axis of the frequency.
    good : float, default 0.5
        Rms ratio, to the response without damper, below which a run is well damped.

    Returns
    -------
    dict of str to float
        Numbers of runs ``with_impacts``, of these ``well_damped``, and of these
        ``well_damped_two_impacts``: with two impacts per period and neither chatter nor sticking.
        ``lasting`` and ``lasting_well_damped``: part of the runs with impacts, and of the well
        damped ones, that chatter or stick. ``median_rms_lasting``, ``median_rms_two_impacts``:
        median rms ratios of both groups. ``near_resonance``: part of the well damped points with
        two impacts within 10 % of the resonance; ``lowest`` and ``highest`` are the ends of all,
        in the unit of `along`. ``amplified_below`` and ``amplified_above``: part of the runs with
        impacts further than that below, and above, the resonance whose rms is larger than without
        damper. NaN where there are no such runs.
    """
    require_axes(cube, along)
    in_range("good", good, minimum=0, above=True)
    _require_observers(cube, "rms_ratio", "peak_displacement", "amplitude_ratio")
    cube = _of_any_mass(cube)
    contact = cube.impacts_per_period > 0.0
    lasting = contact & ((cube.chatter > Chatter.NONE) | (cube.sticking_fraction > 0.0))
    two = contact & ~lasting & (abs(cube.impacts_per_period - 2.0) < _TWO)
    well = contact & (cube.rms_ratio < good)
    undamped = (cube.peak_displacement / cube.amplitude_ratio).max(
        [dim for dim in cube.amplitude_ratio.dims if dim != along]
    )
    resonance = float(undamped.idxmax(along))
    near = within(cube[along], (1.0 - NEAR) * resonance, (1.0 + NEAR) * resonance)
    where = cube[along].where(two & well)
    amplified = contact & (cube.rms_ratio > 1.0)
    far = contact & ~near
    below, above = far & (cube[along] < resonance), far & (cube[along] > resonance)
    return {
        "with_impacts": int(contact.sum()),
        "well_damped": int(well.sum()),
        "well_damped_two_impacts": int((two & well).sum()),
        "lasting": _share(lasting, contact),
        "lasting_well_damped": _share(lasting, well),
        "median_rms_lasting": float(cube.rms_ratio.where(lasting).median()),
        "median_rms_two_impacts": float(cube.rms_ratio.where(two).median()),
        "near_resonance": _share(near, two & well),
        "lowest": float(where.min()),
        "highest": float(where.max()),
        "amplified_below": _share(amplified & below, below),
        "amplified_above": _share(amplified & above, above),
    }


def _require_observers(cube: xr.Dataset, *of_response: str) -> None:
    require_variables(cube, "response", *of_response)
    require_variables(cube, "impacts", "impacts_per_period")
    require_variables(cube, "bursts", "chatter", "sticking_fraction")


def _of_any_mass(cube: xr.Dataset) -> xr.Dataset:
    """Return a cube with the most chatter and sticking of all free masses at each point."""
    return cube.assign({n: of_any_mass(cube[n]) for n in ("chatter", "sticking_fraction")})


def _share(some: xr.DataArray, of_all: xr.DataArray) -> float:
    count = int(of_all.sum())
    return float((some & of_all).sum() / count) if count else math.nan


def _widths(values: np.ndarray) -> np.ndarray:
    """Width of the cell around each value of an axis; the end cells are half ones."""
    order = np.argsort(values)
    edges = np.concatenate([values[order][:1], values[order], values[order][-1:]])
    widths = np.empty(len(values))
    widths[order] = 0.5 * (edges[2:] - edges[:-2])
    return widths
