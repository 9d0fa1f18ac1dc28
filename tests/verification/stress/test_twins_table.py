"""Dataset and table of lanes run in other ways, made up and from a small real run."""

import csv
import io

import numpy as np
import pytest
import xarray as xr

from damper.parameters.quantities import ALL
from damper.sweep.cube import write_cube
from damper.verification.stress.backward import LONG
from damper.verification.stress.box import random_lanes
from damper.verification.stress.identities import run_identities
from damper.verification.stress.parts import LANE_NAMES, write_part
from damper.verification.stress.tables.twins import HEAVY, failures, make, parameters_of
from damper.verification.stress.twins_cube import VARIABLES, gather_twins
from damper.verification.stress.verdicts import (
    CONDITIONS,
    FAILED,
    IDENTITIES,
    NOT_APPLICABLE,
    PASSED,
    PASSED_BACKWARD,
    PASSED_LAWS,
    VERDICTS,
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
#: Lane that fails in one way, one that is refused, one of another model.
BAD, REFUSED, OTHER = 4, 7, 2


def made_up(count: int) -> dict[str, np.ndarray]:
    """Return what well-conditioned lanes give that agree in all ways."""
    arrays = {name: np.linspace(1.0, 2.0, count) for name in VARIABLES}
    arrays |= {name: np.full(count, 10, dtype="i4") for name in VARIABLES if "_events" in name}
    arrays |= {f"{name}_verdict": np.full(count, PASSED, dtype="i1") for name in IDENTITIES}
    return arrays | {
        "condition": np.zeros(count, dtype="i1"),
        "laws_excess": np.full(count, np.nan),
    }


@pytest.fixture(scope="module")
def twins(tmp_path_factory) -> xr.Dataset:
    lanes = random_lanes(8, 1, BOX)
    arrays = made_up(8)
    arrays["condition"][:] = [0, 0, 1, 2, 1, 3, 0, -1]
    arrays["units_verdict"][BAD] = FAILED
    arrays["mirrored_verdict"][BAD] = PASSED_BACKWARD
    arrays["looser_verdict"][OTHER] = PASSED_LAWS
    arrays["backward_error"][:] = [1.0, 2.0, np.nan, 4.0, 3000.0, 6.0, 7.0, np.nan]
    arrays["backward_motion"][3] = 55.0
    arrays["laws_excess"][OTHER] = 0.25
    for name in IDENTITIES:
        arrays[f"{name}_verdict"][REFUSED] = NOT_APPLICABLE
        arrays[f"{name}_ratio"][REFUSED] = np.nan
    folder = tmp_path_factory.mktemp("twins")
    paths = []
    for number, (first, end) in enumerate(((0, 3), (3, 8))):
        paths.append(folder / f"{number}.npz")
        some = {name: values[first:end] for name, values in arrays.items()}
        write_part(paths[-1], lanes[first:end], some)
    return gather_twins(paths, {"title": "Made-up twins"})


def lines(twins: xr.Dataset) -> dict[tuple[str, str, str], str]:
    rows = csv.DictReader(io.StringIO(make(twins)[0]))
    return {(row["about"], row["name"], row["quantity"]): row["value"] for row in rows}


def test_lanes_are_in_order(twins):
    lanes = random_lanes(8, 1, BOX)
    for name in lanes[0]:
        assert twins[name].values.tolist() == [lane[name] for lane in lanes]
    assert twins.condition.values.tolist() == [0, 0, 1, 2, 1, 3, 0, -1]


def test_every_variable_is_described(twins):
    assert set(twins.data_vars) == {*VARIABLES, *LANE_NAMES}
    for name, array in twins.variables.items():
        assert array.attrs["long_name"], name
        assert array.attrs["units"], name
    for name, flags in (("condition", CONDITIONS), ("units_verdict", VERDICTS)):
        attrs = twins[name].attrs
        assert attrs["flag_values"].tolist() == list(flags)
        assert len(attrs["flag_meanings"].split()) == len(flags)
    assert twins.clearance.attrs["long_name"] == ALL["clearance"].long_name


def test_verdicts_are_counted(twins):
    found = lines(twins)
    assert found["all", "all", "lanes"] == "8"
    ways = {"compared outright": "6", "failed": "1", "by backward error": "0", "by the laws": "0"}
    for quantity, value in (ways | {"not applicable": "1"}).items():
        assert found["way", "units", quantity] == value
    assert found["way", "mirrored", "by backward error"] == "1"
    assert found["way", "looser", "by the laws"] == "1"
    ratios = twins.units_ratio.values[:7]
    assert float(found["way", "units", "worst ratio"]) == pytest.approx(ratios.max(), rel=1e-2)
    assert float(found["way", "units", "median ratio"]) == pytest.approx(
        np.median(ratios), rel=1e-2
    )


def test_ratios_beyond_what_is_allowed_are_explained(twins):
    some = twins.copy(deep=True)
    for name in IDENTITIES:
        some[f"{name}_ratio"][:] = 0.5
    some.units_ratio[1:4] = 7.0
    some.damping_ratio[:] = 0.1
    some.damping_ratio[3:] = HEAVY
    assert "3 lanes have one; 1 of them" in make(some)[1]


def test_conditions_and_checks_name_the_worst_lane(twins):
    found = lines(twins)
    assert found["condition", "well-conditioned", "lanes"] == "3"
    assert found["condition", "well-conditioned", "worst backward error"] == "7"
    assert found["condition", "error growth", "worst backward error"] == "3e+03"
    assert found["condition", "refused with an error", "lanes"] == "1"
    assert found["check", "backward_motion", "worst"] == "55"
    assert found["check", "backward_motion", "lane"] == "3"
    assert found["check", "laws_excess", "lane"] == str(OTHER)


def test_a_failure_is_named_with_its_parameters(twins):
    assert failures(twins).tolist() == [BAD]
    assert lines(twins)["failed", str(BAD), "ways"] == "units"
    markdown = make(twins)[1]
    failed = markdown.split("## Failed")[1]
    assert "SI units and back" in failed
    assert "mirrored" not in failed
    assert f"clearance {twins.clearance.values[BAD]:.16g}" in failed
    assert parameters_of(twins, BAD) in failed
    assert "5 agree outright in all of them, 1 do not" in markdown
    assert "1 fail. 1 were refused" in markdown
    good = make(twins.drop_sel(lane=BAD))[1]
    assert good.split("## Failed")[1].strip() == "None."


def test_no_lanes(tmp_path):
    twins = gather_twins([], {"title": "None"})
    write_cube(twins, tmp_path / "twins.nc")
    text, markdown = make(xr.open_dataset(tmp_path / "twins.nc"))
    assert "No lanes were compared" in markdown
    assert text.splitlines()[1:] == ["all,all,lanes,0"]


@pytest.mark.skipif(not LONG, reason="long double has no digits to spare")
def test_a_real_run(tmp_path):
    lanes = random_lanes(20, 3, BOX)
    write_part(tmp_path / "0.npz", lanes, run_identities(lanes))
    twins = gather_twins([tmp_path / "0.npz"], {"title": "Twins"})
    write_cube(twins, tmp_path / "twins.nc")
    with xr.open_dataset(tmp_path / "twins.nc") as read:
        assert make(read.load()) == make(twins)
    assert not len(failures(twins))
    assert (
        sum(int(v) for k, v in lines(twins).items() if k[0] == "condition" and k[2] == "lanes")
        == 20
    )
