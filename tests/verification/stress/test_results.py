"""Parts, cubes, tables and figures of the stress study, from made-up runs whose worst are known."""

import csv
import io

import numpy as np
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg

from damper.figures.common.style import style
from damper.observers import class_in
from damper.observers.common.laws import ENERGY_PER_SEGMENT, LAW_VARIABLES, LIMIT
from damper.study.study_file import Made
from damper.sweep.cube import write_cube
from damper.sweep.parts import PartData
from damper.sweep.points import read_point
from damper.verification.stress.box import corners, part, points_of, random_points
from damper.verification.stress.cube import METAMORPHIC_VARIABLES, gather, point_of
from damper.verification.stress.figures import metamorphic as metamorphic_figure
from damper.verification.stress.figures import stress as stress_figure
from damper.verification.stress.outcomes import RUN_VARIABLES
from damper.verification.stress.regimes import REGIMES, with_models
from damper.verification.stress.tables import metamorphic as metamorphic_table
from damper.verification.stress.tables import stress as stress_table
from damper.verification.stress.tables.stress import excesses, regimes
from damper.verification.stress.verdicts import (
    CHECKS,
    FAILED,
    NOT_APPLICABLE,
    PASSED,
    PASSED_BY_STEPS,
    RELATIONS,
    SOUND,
)

VALUES = {
    "mass_ratio": [1e-6, 0.3],
    "damping_ratio": [0.0, 10.0],
    "frequency_ratio": [1e-3, 1.0],
    "clearance": [1e-9, 1.0],
    "restitution": [0.0, 0.5, 1.0],
}
LAST = {name: values[-1:] for name, values in VALUES.items()}
RUNS = [
    *corners(VALUES, ("centre", "grazing")),
    *corners(LAST | {"support_stiffness_ratio": [0.0, 1.0]}, ("centre",)),
    *corners(LAST | {"modulation_depth": [0.5]}, ("centre",)),
    *corners(LAST | {"contact_stiffness_ratio": [1e8]}, ("centre",)),
]
#: Run that breaks the law of momentum, one that stops early, one that is refused.
BROKEN, STOPPED, REFUSED = 5, 11, 17


def checked(count):
    """Return arrays of runs that keep all laws."""
    arrays = {variable.name: np.full(count, 1e-16) for variable in LAW_VARIABLES}
    arrays["not_finite"][:] = 0.0
    arrays |= {v.name: np.full(count, 100, dtype=v.dtype) for v in RUN_VARIABLES}
    return arrays | {"status": np.zeros(count, dtype="i1")}


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    arrays = checked(len(RUNS))
    arrays["momentum"] = np.geomspace(1e-17, 1e-15, len(RUNS))
    arrays["momentum"][BROKEN] = 3e-12
    arrays["touch"][:] = np.nan
    arrays["status"][[STOPPED, REFUSED]] = 1, 3
    for variable in LAW_VARIABLES:
        arrays[variable.name][REFUSED] = np.nan
    arrays |= points_of(RUNS)
    parts = [
        PartData({name: part(values, number, 3) for name, values in arrays.items()})
        for number in range(3)
    ]
    return gather(parts, {"title": "Made-up runs"}, {"corner all": 3})


def test_parts_come_back_in_the_order_of_the_runs(cube):
    for number, run in enumerate(RUNS):
        defaults = {"initial_position", "initial_displacement", "support_stiffness_ratio"}
        assert point_of(cube, number).items() <= run.items()
        assert (
            run.keys() - point_of(cube, number).keys() <= defaults | {"mass_ratio"} | VALUES.keys()
        )
        assert point_of(cube, number).keys() <= run.keys()
    assert cube.momentum.values[BROKEN] == 3e-12
    for name, array in cube.variables.items():
        assert array.attrs["long_name"], name
    assert cube.status.attrs["flag_meanings"].split()[3] == "refused"


def test_models_are_those_of_the_parameters(cube):
    found = with_models(cube.to_dataframe().reset_index()).model
    assert found.tolist() == [read_point(run).parameters.model for run in RUNS]
    assert found.nunique() == 4


def test_regimes_count_their_runs_and_name_the_worst(cube):
    rows = {row.regime.name: row for row in regimes(cube)}
    everything = rows["all"]
    assert everything.outcomes == [len(RUNS) - 2, 1, 0, 1]
    assert everything.broken == 1
    assert everything.law == "momentum"
    assert everything.point == point_of(cube, BROKEN)
    assert everything.worst["momentum"] == 3e-12
    assert everything.nearest["momentum"] == pytest.approx(3.0)
    assert np.isnan(everything.worst["touch"])
    rigid = [run for run in RUNS if read_point(run).parameters.model == "rigid"]
    heavy = [run for run in rigid if run["damping_ratio"] >= 10.0]
    assert rows["heavy damping"].runs == len(heavy)
    assert rows["tiny clearance"].runs == sum(run["clearance"] == 1e-9 for run in rigid)
    assert rows["grounded"].runs == rows["stiff contact"].runs == 1
    assert rows["grazing start"].runs == 48
    assert "large clearance" not in rows


def test_every_regime_can_be_evaluated(cube):
    runs = with_models(cube.to_dataframe().reset_index())
    assert len({regime.name for regime in REGIMES}) == len(REGIMES)
    for regime in REGIMES:
        assert regime.holds(runs).dtype == bool


def test_the_energy_balance_may_add_a_rounding_for_each_segment(cube):
    changed = cube.copy(deep=True)
    changed["segments"][:] = 1e6
    allowed = LIMIT + 1e6 * ENERGY_PER_SEGMENT
    changed["energy_balance"][:2] = [0.99 * allowed, 1.01 * allowed]
    assert (excesses(changed).energy_balance[:2] > 1.0).tolist() == [False, True]


def test_table_of_the_laws(cube):
    table = stress_table.make({"cube": cube}, None)
    markdown = table.markdown()
    rows = {row["regime"]: row for row in csv.DictReader(io.StringIO(table.csv()))}
    assert rows["all"]["max_events_reached"] == "1"
    assert rows["all"]["worst_law"] == "momentum"
    assert float(rows["all"]["momentum"]) == 3e-12
    assert f"mass_ratio={RUNS[BROKEN]['mass_ratio']:g}" in rows["all"]["worst_point"]
    assert "1 stopped by their event budget, 1 refused with an error" in markdown
    assert f"| momentum | {len(RUNS) - 1} | {len(RUNS) - 3} | 1 | 1 | 3e-12 | 1e-12 |" in markdown
    assert "| gap at impact | 0 | 0 | 0 | 0 | none |" in markdown


def drawn(kind, cube):
    with style():
        figure = kind.draw(
            {"cube": cube, "metamorphic": cube}, class_in(kind, Made).model_construct()
        )
        FigureCanvasAgg(figure).draw()
    return figure


def test_figure_of_the_laws_shows_every_run_and_the_worst_of_each_regime(cube):
    upper, lower = drawn(stress_figure, cube).axes
    lines = {line.get_label(): line for line in upper.lines}
    assert "gap at impact" not in lines
    x, y = lines["momentum"].get_data()
    for place, share in zip(x, y, strict=True):
        known = cube.momentum.values[~np.isnan(cube.momentum.values)]
        assert share == pytest.approx((known >= place * (1.0 - 1e-9)).mean())
    assert x.max() == pytest.approx(3e-12)
    rows = [row.regime.name for row in regimes(cube)]
    texts = {text.get_position(): text.get_text() for text in lower.texts}
    column = stress_table.GRADED.index("momentum")
    assert texts[column, 0] == "3e-12"
    assert texts[stress_table.GRADED.index("touch"), 0] == "\N{EN DASH}"
    assert [label.get_text().split(" (")[0] for label in lower.get_yticklabels()] == rows


# --- metamorphic tests

#: Run that fails in one way, one that is refused, one that is judged by the laws alone.
BAD, OUT, OTHER = 4, 7, 2
COUNT = 8
BOX = {"parameters": {name: {"range": [1.0, 2.0]} for name in VALUES}}


@pytest.fixture(scope="module")
def again() -> xr.Dataset:
    arrays = {variable.name: np.linspace(1.0, 2.0, COUNT) for variable in METAMORPHIC_VARIABLES}
    arrays |= {f"{name}_verdict": np.full(COUNT, PASSED, dtype="i1") for name in RELATIONS}
    arrays["units_verdict"][BAD] = FAILED
    arrays["mirrored_verdict"][BAD] = PASSED_BY_STEPS
    arrays["backward_error"] = np.array([1.0, 2.0, np.nan, 4.0, 3000.0, 6.0, 7.0, np.nan])
    arrays["backward_motion"][3] = 55.0
    arrays["growth"][OUT] = np.nan
    for name in RELATIONS:
        arrays[f"{name}_verdict"][OUT] = NOT_APPLICABLE
        arrays[f"{name}_ratio"][OUT] = arrays[f"{name}_difference"][OUT] = np.nan
    runs = random_points(COUNT, 1, BOX)
    arrays |= points_of(runs)
    stretches = (slice(0, 3), slice(3, COUNT))
    parts = [PartData({name: v[some] for name, v in arrays.items()}) for some in stretches]
    return gather(parts, {"title": "Made-up runs"})


def test_stretches_come_back_in_order(again):
    for number, run in enumerate(random_points(COUNT, 1, BOX)):
        assert point_of(again, number) == run
    assert again.units_verdict.min() == PASSED  # what is not applicable is missing
    for name, array in again.variables.items():
        assert array.attrs["long_name"], name
        assert array.attrs["units"], name


def test_table_of_the_relations(again):
    table = metamorphic_table.make({"metamorphic": again}, None)
    found = table.data.set_index("relation")
    assert list(found.index) == list(RELATIONS)
    counts = {"compared outright": 6, "failed": 1, "step by step": 0, "not applicable": 1}
    assert {name: found[name]["units"] for name in counts} == counts
    assert found["step by step"]["mirrored"] == 1
    ratios = again.units_ratio.values[:7]
    assert found["worst ratio"]["units"] == ratios.max()
    assert found["median ratio"]["units"] == pytest.approx(np.median(ratios))
    markdown = table.markdown()
    assert "6 agree outright in all of them, 0 do not" in markdown
    assert "1 fail. 1 were refused" in markdown
    rows = [line.strip("| ").split(" | ") for line in markdown.splitlines() if line[:1] == "|"]
    cells = {row[0]: row for row in rows}
    assert cells[f"{CHECKS['motion']} [2^-52]"][3:5] == ["55", "3"]
    failed = markdown.split("## Failed")[1]
    assert "SI units and back" in failed
    assert "mirrored" not in failed
    assert f"clearance {again.clearance.values[BAD]:.16g}" in failed


def test_figure_of_the_differences(again):
    left, right = drawn(metamorphic_figure, again).axes
    lines = {line.get_label(): line for line in left.lines}
    assert len(lines["compared outright"].get_xdata()) == COUNT - 2
    np.testing.assert_array_equal(lines["step by step"].get_xdata(), again.growth.values[[BAD]])
    np.testing.assert_array_equal(
        lines["step by step"].get_ydata(), again.units_difference.values[[BAD]]
    )
    assert right.lines[0].get_xdata().max() == 3000.0
    assert list(right.lines[1].get_xdata()) == [SOUND, SOUND]
    assert "1 failed" in left.figure.get_suptitle()


def test_no_runs(tmp_path):
    write_cube(gather([], {"title": "None"}), tmp_path / "metamorphic.nc")
    cube = xr.open_dataset(tmp_path / "metamorphic.nc")
    assert "No runs were compared" in metamorphic_table.make({"metamorphic": cube}, None).markdown()
    figure = drawn(metamorphic_figure, cube)
    assert [text.get_text() for text in figure.axes[0].texts] == ["no runs were compared"]
