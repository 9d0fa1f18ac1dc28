"""Single bursts of a cube, against its own totals and by hand."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from damper import State, simulate
from damper.analysis import burst_statistics, chatter_intervals, list_bursts

POINT = {"mass_ratio": 0.1, "damping_ratio": 0.02, "frequency_ratio": 1.3, "clearance": 0.05}


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    return simulate(
        **POINT,
        restitution=[0.3, 0.6, 0.9],
        transient=20,
        periods=10,
        observers={"bursts": {"records": 100}},
    )


def test_bursts_are_those_that_were_counted(cube: xr.Dataset) -> None:
    found = list_bursts(cube).groupby("restitution")
    assert found["visible"].max().tolist() == cube.visible_impacts.values.tolist()
    complete = found["complete"].mean()
    np.testing.assert_allclose(complete, cube.complete_fraction, rtol=1e-12)
    assert found["onset"].apply(lambda onset: onset.is_monotonic_increasing).all()
    kinds = [int(2 if (b["chatter"] & b["complete"]).any() else b["chatter"].any())
             for _, b in found]  # fmt: skip
    assert kinds == cube.chatter.values.tolist()


def test_statistics_are_those_of_the_list(cube: xr.Dataset) -> None:
    bursts = list_bursts(cube)
    for since in (0.0, 20.0):
        found = burst_statistics(cube, since).set_index("restitution")
        for r, row in found.iterrows():
            here = bursts[(bursts["restitution"] == r) & (bursts["onset"] >= since)]
            assert row["bursts"] == len(here)
            chatter = [b for b in here.to_dict("records") if b["visible"] >= 5]
            complete = [b for b in chatter if b["complete"]]
            assert (row["chatter_bursts"], row["complete_bursts"]) == (len(chatter), len(complete))
            if complete:
                assert row["first_complete"] == complete[0]["onset"]
                assert row["median_duration"] == np.median([b["duration"] for b in complete])
            else:
                assert pd.isna(row["median_duration"])


def test_cubes_without_a_list_or_of_given_states_are_refused() -> None:
    cube = simulate(
        **POINT, restitution=[0.3, 0.6, 0.9], transient=1, periods=1, observers=["bursts"],
        state=State(0.0, 0.0, 0.0, 0.1),
    )  # fmt: skip
    with pytest.raises(ValueError, match="no variable 'burst_onset'"):
        list_bursts(cube)
    with pytest.raises(ValueError, match="runs from a given state"):
        chatter_intervals(cube, "restitution")
