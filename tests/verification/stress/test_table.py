"""Parts, cube and tables of the stress study, from made-up runs whose worst ones are known."""

import csv
import io

import numpy as np
import pytest
import xarray as xr

from damper.sweep.points import read_point
from damper.verification.stress.box import corners, part
from damper.verification.stress.cube import gather_checks
from damper.verification.stress.laws import ENERGY_PER_SEGMENT, LAW_VARIABLES, LIMIT, RUN_VARIABLES
from damper.verification.stress.parts import point_of, read_parts, write_part
from damper.verification.stress.regimes import REGIMES, models
from damper.verification.stress.tables.stress import excesses, make, regimes

VALUES = {
    "mass_ratio": [1e-6, 0.3],
    "damping_ratio": [0.0, 10.0],
    "frequency_ratio": [1e-3, 1.0],
    "clearance": [1e-9, 1.0],
    "restitution": [0.0, 0.5, 1.0],
}
SUPPORTED = {name: values[-1:] for name, values in VALUES.items()} | {
    "support_stiffness_ratio": [0.0, 1.0]
}
RUNS = [*corners(VALUES, ("centre", "grazing")), *corners(SUPPORTED, ("centre",))]
#: Run that breaks the law of momentum, one that stops early, one that is refused.
BROKEN, STOPPED, REFUSED = 5, 11, 17


def results(count):
    """Return arrays of runs that keep all laws."""
    arrays = {variable.name: np.full(count, 1e-16) for variable in LAW_VARIABLES}
    arrays |= {name: np.zeros(count) for name in ("backwards", "not_finite")}
    return arrays | {
        variable.name: np.full(count, 100, dtype=variable.dtype)
        if variable.name != "status"
        else np.zeros(count, dtype="i1")
        for variable in RUN_VARIABLES
    }


@pytest.fixture(scope="module")
def cube(tmp_path_factory) -> xr.Dataset:
    arrays = results(len(RUNS))
    arrays["momentum"][BROKEN] = 3e-12
    arrays["touch"][:] = np.nan
    arrays["status"][STOPPED] = 1
    arrays["status"][REFUSED] = 3
    for variable in LAW_VARIABLES:
        arrays[variable.name][REFUSED] = np.nan
    folder = tmp_path_factory.mktemp("parts")
    paths = []
    for number in range(3):
        paths.append(folder / f"{number}.npz")
        some = {name: part(values, number, 3) for name, values in arrays.items()}
        write_part(paths[-1], part(RUNS, number, 3), some)
    return gather_checks({"corner": paths}, {"title": "Made-up runs"})


def test_parts_come_back_in_the_order_of_the_runs(cube):
    values = {name: array.values for name, array in cube.data_vars.items()}
    for number, run in enumerate(RUNS):
        back = point_of(values, number)
        assert back == {name: value for name, value in run.items() if name in back}
        assert not any(value for name, value in run.items() if name not in back)
    assert cube.momentum.values[BROKEN] == 3e-12


def test_parts_have_the_same_bytes(tmp_path):
    for name in "ab":
        write_part(tmp_path / f"{name}.npz", RUNS[:4], results(4))
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    assert read_parts([tmp_path / "a.npz"])["clearance"].tolist() == [
        run["clearance"] for run in RUNS[:4]
    ]


def test_every_variable_is_described(cube):
    for name, array in cube.variables.items():
        assert array.attrs["long_name"], name
        if name != "origin":
            assert array.attrs["units"], name
    assert cube.status.attrs["flag_meanings"].split()[3] == "refused"


def test_models_are_those_of_the_parameters(cube):
    for number in (0, len(RUNS) - 1):
        assert models(cube).values[number] == read_point(RUNS[number]).parameters.model
    assert models(cube).values[-1] == "grounded"


def test_all_runs_and_their_ends_are_counted(cube):
    everything = regimes(cube)[0]
    assert everything.runs == len(RUNS)
    assert everything.outcomes == (len(RUNS) - 2, 1, 0, 1)
    assert everything.broken == 1
    assert everything.law == "momentum"
    assert everything.point["mass_ratio"] == RUNS[BROKEN]["mass_ratio"]
    assert everything.point.items() <= (RUNS[BROKEN]).items()
    assert everything.worst["momentum"] == 3e-12
    assert everything.nearest["momentum"] == pytest.approx(3.0)
    assert np.isnan(everything.worst["touch"])


def test_a_regime_has_the_runs_of_its_condition(cube):
    rows = {row.name: row for row in regimes(cube)}
    untied = [run for run in RUNS if not run.get("support_stiffness_ratio")]
    heavy = [run for run in untied if run["damping_ratio"] >= 10.0]
    assert rows["heavy damping"].runs == len(heavy)
    assert rows["heavy damping"].broken == (RUNS[BROKEN] in heavy)
    tiny = [run for run in RUNS if run["clearance"] == 1e-9]
    assert rows["tiny clearance"].runs == len(tiny)
    assert rows["grounded"].runs == 1
    assert rows["grazing start"].runs == 48
    assert "compliant" not in rows
    assert "large clearance" not in rows


def test_every_regime_says_what_it_is_and_why():
    assert len({regime.name for regime in REGIMES}) == len(REGIMES)
    for regime in REGIMES:
        assert regime.condition
        assert regime.reason


def test_the_energy_balance_may_add_a_rounding_for_each_segment(cube):
    changed = cube.copy(deep=True)
    changed["segments"][:] = 1e6
    allowed = LIMIT + 1e6 * ENERGY_PER_SEGMENT
    changed["energy"][:2] = [0.99 * allowed, 1.01 * allowed]
    assert (excesses(changed)["energy"][:2] > 1.0).tolist() == [False, True]


def test_table(cube):
    table = make(cube, title="A study")
    markdown = table.markdown()
    rows = {row["regime"]: row for row in csv.DictReader(io.StringIO(table.csv()))}
    assert rows["all"]["max_events_reached"] == "1"
    assert rows["all"]["worst_law"] == "momentum"
    assert float(rows["all"]["momentum"]) == 3e-12
    assert f"mass_ratio={RUNS[BROKEN]['mass_ratio']:g}" in rows["all"]["worst_point"]
    assert "1 stopped by their event budget, 1 refused with an error" in markdown
    assert f"| momentum | {len(RUNS) - 1} | {len(RUNS) - 3} | 1 | 1 | 3.0e-12 |" in markdown
    assert "| gap at impact | 0 | 0 | 0 | 0 | none |" in markdown
    for regime in REGIMES:
        assert (regime.reason in markdown) == (regime.name in rows)
