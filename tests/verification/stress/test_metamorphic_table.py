"""Dataset and table of runs run in other ways, made up and from a small real run."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from damper.parameters.quantities import ALL
from damper.sweep.cube import write_cube
from damper.verification.stress.backward import LONG
from damper.verification.stress.box import random_points
from damper.verification.stress.metamorphic import run_metamorphic
from damper.verification.stress.metamorphic_cube import METAMORPHIC_VARIABLES, gather_metamorphic
from damper.verification.stress.parts import POINT_NAMES, write_part
from damper.verification.stress.tables.metamorphic import HEAVY, failures, make, parameters_of
from damper.verification.stress.verdicts import (
    CHECKS,
    CONDITIONS,
    FAILED,
    NOT_APPLICABLE,
    PASSED,
    PASSED_BACKWARD,
    PASSED_LAWS,
    RELATION_VERDICTS,
    RELATIONS,
)

BOX = {
    "share": 0.3,
    "parameters": {
        "mass_ratio": {"range": [1e-9, 1e6]},
        "damping_ratio": {"range": [1e-12, 1e6], "values": [0.0, 1.0]},
        "frequency_ratio": {"range": [1e-4, 1e4], "values": [1.0]},
        "clearance": {"range": [1e-12, 1e6], "values": [0.0, 1.0]},
        "restitution": {"range": [0.0, 1.0], "values": [0.0, 1.0]},
    },
}
#: Run that fails in one way, one that is refused, one of another model.
BAD, REFUSED, OTHER = 4, 7, 2


def made_up(count: int) -> dict[str, np.ndarray]:
    """Return what well-conditioned runs give that agree in all ways."""
    arrays = {name: np.linspace(1.0, 2.0, count) for name in METAMORPHIC_VARIABLES}
    arrays |= {
        name: np.full(count, 10, dtype="i4") for name in METAMORPHIC_VARIABLES if "_events" in name
    }
    arrays |= {f"{name}_verdict": np.full(count, PASSED, dtype="i1") for name in RELATIONS}
    return arrays | {
        "condition": np.zeros(count, dtype="i1"),
        "laws_excess": np.full(count, np.nan),
    }


@pytest.fixture(scope="module")
def cube(tmp_path_factory) -> xr.Dataset:
    runs = random_points(8, 1, BOX)
    arrays = made_up(8)
    arrays["condition"][:] = [0, 0, 1, 2, 1, 3, 0, -1]
    arrays["units_verdict"][BAD] = FAILED
    arrays["mirrored_verdict"][BAD] = PASSED_BACKWARD
    arrays["looser_verdict"][OTHER] = PASSED_LAWS
    arrays["backward_error"][:] = [1.0, 2.0, np.nan, 4.0, 3000.0, 6.0, 7.0, np.nan]
    arrays["backward_motion"][3] = 55.0
    arrays["laws_excess"][OTHER] = 0.25
    for name in RELATIONS:
        arrays[f"{name}_verdict"][REFUSED] = NOT_APPLICABLE
        arrays[f"{name}_ratio"][REFUSED] = np.nan
    folder = tmp_path_factory.mktemp("metamorphic")
    paths = []
    for number, (first, end) in enumerate(((0, 3), (3, 8))):
        paths.append(folder / f"{number}.npz")
        some = {name: values[first:end] for name, values in arrays.items()}
        write_part(paths[-1], runs[first:end], some)
    return gather_metamorphic(paths, {"title": "Made-up runs"})


def relations(cube: xr.Dataset) -> pd.DataFrame:
    return make(cube).data.set_index("relation")


def test_runs_are_in_order(cube):
    runs = random_points(8, 1, BOX)
    for name in runs[0]:
        assert cube[name].values.tolist() == [run[name] for run in runs]
    assert cube.condition.values.tolist() == [0, 0, 1, 2, 1, 3, 0, -1]


def test_every_variable_is_described(cube):
    assert set(cube.data_vars) == {*METAMORPHIC_VARIABLES, *POINT_NAMES}
    for name, array in cube.variables.items():
        assert array.attrs["long_name"], name
        assert array.attrs["units"], name
    assert cube.units_verdict.min() == PASSED  # what is not applicable is missing
    verdicts = [code for code in RELATION_VERDICTS if code != NOT_APPLICABLE]
    for name, flags in (("condition", CONDITIONS), ("units_verdict", verdicts)):
        attrs = cube[name].attrs
        assert attrs["flag_values"].tolist() == list(flags)
        assert len(attrs["flag_meanings"].split()) == len(flags)
    assert cube.clearance.attrs["long_name"] == ALL["clearance"].long_name


def test_verdicts_are_counted(cube):
    found = relations(cube)
    assert list(found.index) == list(RELATIONS)
    counts = {"compared outright": 6, "failed": 1, "by backward error": 0, "by the laws": 0}
    for quantity, value in (counts | {"not applicable": 1, "runs": 8}).items():
        assert found[quantity]["units"] == value
    assert found["by backward error"]["mirrored"] == 1
    assert found["by the laws"]["looser"] == 1
    ratios = cube.units_ratio.values[:7]
    assert found["worst ratio"]["units"] == ratios.max()
    assert found["median ratio"]["units"] == np.median(ratios)
    markdown = make(cube).markdown()
    assert f"| SI units and back | 8 | 6 | 0 | 0 | 1 | 1 | {np.median(ratios):.2g} |" in markdown


def test_ratios_beyond_what_is_allowed_are_explained(cube):
    some = cube.copy(deep=True)
    for name in RELATIONS:
        some[f"{name}_ratio"][:] = 0.5
    some.units_ratio[1:4] = 7.0
    some.damping_ratio[:] = 0.1
    some.damping_ratio[3:] = HEAVY
    assert "3 runs have one; 1 of them" in make(some).markdown()


def test_conditions_and_checks_name_the_worst_run(cube):
    markdown = make(cube).markdown()
    assert "| well-conditioned | 3 | 37.5% |" in markdown
    rows = [line.strip("| ").split(" | ") for line in markdown.splitlines() if line[:1] == "|"]
    found = {row[0]: row for row in rows}
    assert found["well-conditioned"][-1] == "7"
    assert found["error growth"][-1] == "3e+03"
    assert found["refused with an error"][1] == "1"
    assert found[CHECKS["motion"]][3:5] == ["55", "3"]
    assert found["other models: worst law, over its limit"][4] == str(OTHER)


def test_a_failure_is_named_with_its_parameters(cube):
    assert failures(cube).tolist() == [BAD]
    markdown = make(cube).markdown()
    failed = markdown.split("## Failed")[1]
    assert "SI units and back" in failed
    assert "mirrored" not in failed
    assert f"clearance {cube.clearance.values[BAD]:.16g}" in failed
    assert parameters_of(cube, BAD) in failed
    assert "5 agree outright in all of them, 1 do not" in markdown
    assert "1 fail. 1 were refused" in markdown
    good = make(cube.drop_sel(run=BAD)).markdown()
    assert good.split("## Failed")[1].strip() == "None."


def test_no_runs(tmp_path):
    cube = gather_metamorphic([], {"title": "None"})
    write_cube(cube, tmp_path / "metamorphic.nc")
    table = make(xr.open_dataset(tmp_path / "metamorphic.nc"))
    assert "No runs were compared" in table.markdown()
    assert table.csv() == "relation\n"


@pytest.mark.skipif(not LONG, reason="long double has no digits to spare")
def test_a_real_run(tmp_path):
    runs = random_points(20, 3, BOX)
    write_part(tmp_path / "0.npz", runs, run_metamorphic(runs))
    cube = gather_metamorphic([tmp_path / "0.npz"], {"title": "Again"})
    write_cube(cube, tmp_path / "metamorphic.nc")
    with xr.open_dataset(tmp_path / "metamorphic.nc") as read:
        assert make(read.load()).markdown() == make(cube).markdown()
    assert not len(failures(cube))
    assert (relations(cube)["runs"] == 20).all()
