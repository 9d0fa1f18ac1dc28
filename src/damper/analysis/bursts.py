"""The single bursts of a cube, and their statistics."""

from __future__ import annotations

from damper.analysis.places import places, require_variables, rows_at
from damper.analysis.stretches import BURST_VARIABLES, Burst, listed_bursts
from damper.parameters.lazy import pd, xr
from damper.parameters.quantity import in_range


def list_bursts(cube: xr.Dataset) -> pd.DataFrame:
    """Every burst that a cube lists.

    Parameters
    ----------
    cube : xarray.Dataset
        With the variables of the observer ``bursts`` with ``records``: the number of bursts of each
        run that are listed, the first ones of its window.

    Returns
    -------
    pandas.DataFrame
        One row for each burst, in the order of places and times. Columns are the axes and

        - ``onset``: time of the first impact since the start of the window;
        - ``wall``: -1 left, +1 right;
        - ``duration``: from the first impact to sticking, or to the last impact;
        - ``visible``: number of visible impacts;
        - ``complete``: whether it ends in sticking;
        - ``sticking``: time from there to release, NaN where incomplete or cut;
        - ``chatter``: whether it has at least five visible impacts.

        Times are in the cube's unit.

    Raises
    ------
    ValueError
        When the cube lists no bursts.

    Examples
    --------
    >>> import damper
    >>> cube = damper.simulate(mass_ratio=0.1, damping_ratio=0.02, frequency_ratio=1.3,
    ...                        clearance=0.05, restitution=[0.3, 0.6], transient=20, periods=5,
    ...                        observers={"bursts": {"records": 20}})
    >>> list_bursts(cube).groupby("restitution")["visible"].max().to_dict()
    {0.3: 3, 0.6: 8}
    """
    require_variables(cube, "bursts: {records: ...}", *BURST_VARIABLES, along=["burst"])
    names = [str(dim) for dim in cube.burst_onset.dims if dim != "burst"]
    rows = [
        (*where.values(), *burst, burst.chatter)
        for where in places(cube.burst_onset, "burst")
        for burst in listed_bursts(cube.sel(where))
    ]
    found = pd.DataFrame(rows, columns=[*names, *Burst._fields, "chatter"])
    return found.astype({"wall": int, "visible": int, "complete": bool, "chatter": bool})


def burst_statistics(cube: xr.Dataset, since: float = 0.0) -> pd.DataFrame:
    """Numbers, onsets and durations of the bursts that a cube lists, at every place.

    Parameters
    ----------
    cube : xarray.Dataset
        As for `list_bursts`.
    since : float, default 0
        Time since the start of the window, in the cube's unit, before which bursts do not count.

    Returns
    -------
    pandas.DataFrame
        One row for each place. Columns are the axes and

        - ``bursts``, of these ``chatter_bursts``, and of these ``complete_bursts``;
        - ``first_chatter`` and ``first_complete``: onsets of the first ones;
        - ``median_duration`` and ``median_sticking`` of complete chatter.

        NaN where there are no such bursts.
    """
    found = list_bursts(cube)
    found = found[found["onset"] >= in_range("since", since)]
    rows = []
    for where in places(cube.burst_onset, "burst"):
        here = rows_at(found, where)
        chatter = here[here["chatter"]]
        complete = chatter[chatter["complete"]]
        numbers = {
            "bursts": len(here),
            "chatter_bursts": len(chatter),
            "complete_bursts": len(complete),
            "first_chatter": chatter["onset"].min(),
            "first_complete": complete["onset"].min(),
            "median_duration": complete["duration"].median(),
            "median_sticking": complete["sticking"].median(),
        }
        rows.append(where | numbers)
    return pd.DataFrame(rows)
