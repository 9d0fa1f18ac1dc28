"""Laws of a cube: regimes, table and figure, from made-up runs whose worst are known."""

import csv
import io
from typing import Any

import numpy as np
import pytest
import xarray as xr
from figures.drawing import drawn, laid_out

from damper import Parameters, tables
from damper.analysis.laws import GRADED, REGIMES, excesses, regimes, runs_of
from damper.observers.common.laws import ENERGY_PER_SEGMENT, LAW_NAMES, LIMIT
from damper.parameters.quantities import ALL

AXES: dict[str, list[float]] = {
    "mass_ratio": [1e-6, 0.3],
    "damping_ratio": [0.0, 10.0],
    "frequency_ratio": [1e-3, 1.0],
    "restitution": [0.0, 0.5, 1.0],
}
#: Of each draw: the rigid damper twice, then each other model.
DRAWN: dict[str, list[float]] = {
    "clearance": [1e-9, 1.0, 1.0, 1.0, 1.0],
    "support_stiffness_ratio": [0.0, 0.0, 1.0, 0.0, 0.0],
    "modulation_depth": [0.0, 0.0, 0.0, 0.5, 0.0],
    "contact_stiffness_ratio": [np.inf, np.inf, np.inf, np.inf, 1e8],
    "contact_tension": [0.0, 0.0, 0.0, 0.0, 1.0],
}
MODELS = ["rigid", "rigid", "grounded", "time_varying", "compliant"]
SHAPE = (*map(len, AXES.values()), 5)
COUNT = int(np.prod(SHAPE))
#: Run that breaks the law of momentum, and one that stops early.
BROKEN, STOPPED = 5, 11


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    dims = (*AXES, "draw")
    data = {name: np.full(COUNT, 1e-16) for name in LAW_NAMES}
    data |= {"not_finite": np.zeros(COUNT), "segments": np.full(COUNT, 100.0)}
    data["momentum"] = np.geomspace(1e-17, 1e-15, COUNT)
    data["momentum"][BROKEN] = 3e-12
    data["touch"][:] = np.nan
    status = np.zeros(COUNT, "i1")
    status[STOPPED] = 1
    coords: dict[str, Any] = {**AXES, "phase": 0.5, "draw": range(5)}
    coords |= {name: ("draw", values) for name, values in DRAWN.items()}
    arrays = {n: (dims, values.reshape(SHAPE)) for n, values in (data | {"status": status}).items()}
    return xr.Dataset(arrays, coords, {"title": "Made up", "recorded_periods": 4})


def test_runs_are_those_of_the_cube(cube: xr.Dataset) -> None:
    runs = runs_of(cube)
    assert runs.model.tolist() == MODELS * (COUNT // 5)
    assert runs.momentum.tolist() == cube.momentum.values.ravel().tolist()
    assert set(runs.phase) == {0.5}
    assert set(runs.initial_velocity) == {0.0}
    one = cube.isel(dict.fromkeys(cube.dims, 0))
    assert runs_of(one).model.tolist() == ["rigid"]


def test_regimes_count_their_runs_and_name_the_worst(cube: xr.Dataset) -> None:
    rows = {row.regime.name: row for row in regimes(cube)}
    everything = rows["all"]
    assert everything.outcomes == [COUNT - 1, 1, 0]
    assert (everything.runs, everything.stopped, everything.broken) == (COUNT, 1, 1)
    assert everything.law == "momentum"
    place = dict(zip(cube.momentum.dims, np.unravel_index(BROKEN, SHAPE), strict=True))
    point = cube.isel(place)
    assert everything.point == {
        name: float(point[name])
        for name, quantity in ALL.items()
        if name in point.coords and float(point[name]) != quantity.default
    }
    assert everything.worst["momentum"] == 3e-12
    assert everything.nearest["momentum"] == pytest.approx(3.0)
    assert np.isnan(everything.worst["touch"])
    assert rows["heavy damping"].runs == 24  # of the rigid damper
    assert rows["tiny clearance"].runs == 24
    assert rows["grounded"].runs == rows["stiff contact"].runs == 24
    assert not {"large clearance", "long runs", "grazing start"} & rows.keys()
    assert "long runs" in {
        row.regime.name for row in regimes(cube.assign_attrs(recorded_periods=1e6))
    }


def test_every_regime_can_be_evaluated(cube: xr.Dataset) -> None:
    runs = runs_of(cube)
    assert len({regime.name for regime in REGIMES}) == len(REGIMES)
    for regime in REGIMES:
        assert regime.holds(runs).dtype == bool
    given = runs.loc[BROKEN, [q.name for q in Parameters.quantities]].to_dict()
    assert runs.support_damping[BROKEN] == Parameters(**given).support_damping_ratio


def test_the_energy_balance_may_add_a_rounding_for_each_segment(cube: xr.Dataset) -> None:
    changed = cube.copy(deep=True)
    changed["segments"][:] = 1e6
    allowed = LIMIT + 1e6 * ENERGY_PER_SEGMENT
    changed.energy_balance.values.flat[:2] = [0.99 * allowed, 1.01 * allowed]
    assert (excesses(changed).energy_balance[:2] > 1.0).tolist() == [False, True]


def test_table_of_the_laws(cube: xr.Dataset) -> None:
    table = tables.make("laws", {"cube": cube})
    markdown = table.markdown()
    rows = {row["regime"]: row for row in csv.DictReader(io.StringIO(table.csv()))}
    assert rows["all"]["max_events_reached"] == "1"
    assert rows["all"]["worst_law"] == "momentum"
    assert float(rows["all"]["momentum"]) == 3e-12
    assert "restitution=" in rows["all"]["worst_point"]
    assert f"{COUNT} runs: {COUNT - 1} finished, 1 stopped by their event budget" in markdown
    assert f"| momentum | {COUNT} | {COUNT - 2} | 1 | 1 | 3e-12 | 1e-12 |" in markdown
    assert "| gap at impact | 0 | 0 | 0 | 0 | none |" in markdown


def test_figure_of_the_laws_shows_every_run_and_the_worst_of_each_regime(cube: xr.Dataset) -> None:
    upper, lower = laid_out(drawn("laws", cube)).axes
    lines = {line.get_label(): line for line in upper.lines}
    assert "gap at impact" not in lines
    x, y = lines["momentum"].get_data()
    known = cube.momentum.values
    for place, share in zip(x, y, strict=True):
        assert share == pytest.approx((known >= place * (1.0 - 1e-9)).mean())
    assert x.max() == pytest.approx(3e-12)
    rows = [row.regime.name for row in regimes(cube)]
    texts = {text.get_position(): text.get_text() for text in lower.texts}
    assert texts[GRADED.index("momentum"), 0] == "3e-12"
    assert texts[GRADED.index("touch"), 0] == "\N{EN DASH}"
    assert [label.get_text().split(" (")[0] for label in lower.get_yticklabels()] == rows
