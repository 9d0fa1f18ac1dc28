"""Results of metamorphic tests, from made-up runs whose worst are known."""

import numpy as np
import pytest
import xarray as xr
from figures.drawing import drawn_by

from damper.parameters.quantities import ALL, DIMENSIONLESS_NAMES
from damper.sweep.branches import draw
from damper.sweep.parts import PartData
from damper.verification.metamorphic import verdicts
from damper.verification.metamorphic.cube import (
    METAMORPHIC_VARIABLES,
    gather,
    point_of,
)
from damper.verification.metamorphic.figures import metamorphic as metamorphic_figure
from damper.verification.metamorphic.tables import metamorphic as metamorphic_table

#: Run that fails in one way, one that is refused, one that is judged by the laws alone.
BAD, OUT, OTHER = 4, 7, 2
COUNT = 8
NAMES = ("mass_ratio", "damping_ratio", "frequency_ratio", "clearance", "restitution")
DRAWN = draw({"count": COUNT, "seed": 1, **{name: {"range": (0.5, 0.9)} for name in NAMES}})


@pytest.fixture(scope="module")
def again() -> xr.Dataset:
    arrays = {variable.name: np.linspace(1.0, 2.0, COUNT) for variable in METAMORPHIC_VARIABLES}
    arrays |= {
        f"{name}_verdict": np.full(COUNT, verdicts.PASSED, dtype="i1")
        for name in verdicts.RELATIONS
    }
    arrays["units_verdict"][BAD] = verdicts.FAILED
    arrays["mirrored_verdict"][BAD] = verdicts.PASSED_BY_STEPS
    arrays["backward_error"] = np.array([1.0, 2.0, np.nan, 4.0, 3000.0, 6.0, 7.0, np.nan])
    arrays["backward_motion"][3] = 55.0
    arrays["growth"][OUT] = np.nan
    for name in verdicts.RELATIONS:
        arrays[f"{name}_verdict"][OUT] = verdicts.NOT_APPLICABLE
        arrays[f"{name}_ratio"][OUT] = arrays[f"{name}_difference"][OUT] = np.nan
    arrays |= {name: np.full(COUNT, ALL[name].default, dtype=float) for name in DIMENSIONLESS_NAMES}
    arrays |= {name: np.array(values) for name, values in DRAWN.items()}
    stretches = (slice(0, 3), slice(3, COUNT))
    parts = [PartData({name: v[some] for name, v in arrays.items()}) for some in stretches]
    return gather(parts, {"title": "Made-up runs"})


def test_stretches_come_back_in_order(again):
    for number in range(COUNT):
        assert point_of(again, number) == {name: v[number] for name, v in DRAWN.items()}
    assert again.units_verdict.min() == verdicts.PASSED  # what is not applicable is missing
    for name, array in again.variables.items():
        assert array.attrs["long_name"], name
        assert array.attrs["units"], name


def test_table_of_the_relations(again):
    table = metamorphic_table.make({"cube": again}, None)
    found = table.data.set_index("relation")
    assert list(found.index) == list(verdicts.RELATIONS)
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
    assert cells[f"{verdicts.CHECKS['motion']} [2^-52]"][3:5] == ["55", "3"]
    failed = markdown.split("## Failed")[1]
    assert "SI units and back" in failed
    assert "mirrored" not in failed
    assert f"clearance {again.clearance.values[BAD]:.16g}" in failed


def test_figure_of_the_differences(again):
    left, right = drawn_by(metamorphic_figure, {"cube": again}).axes
    lines = {line.get_label(): line for line in left.lines}
    assert len(lines["compared directly"].get_xdata()) == COUNT - 2
    np.testing.assert_array_equal(
        lines["judged step by step (right)"].get_xdata(), again.growth.values[[BAD]]
    )
    np.testing.assert_array_equal(
        lines["judged step by step (right)"].get_ydata(), again.units_difference.values[[BAD]]
    )
    assert right.lines[0].get_xdata().max() == 3000.0
    assert list(right.lines[1].get_xdata()) == [verdicts.SOUND, verdicts.SOUND]
    assert "1 failed" in left.figure.get_suptitle()
