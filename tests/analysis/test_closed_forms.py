"""Closed forms beside simulation."""

import numpy as np
import pytest
import xarray as xr

import damper
from damper.analysis import two_impact_errors, two_impact_ranges
from damper.analysis.closed_forms import damper_at, reduced_gap
from damper.tables import make
from damper.theory.two_impacts import orbits


@pytest.mark.parametrize("own", [{}, {"gravity": 0.1}], ids=["alike", "unlike"])
def test_listed_masses_are_not_taken_for_one(own: dict[str, float]) -> None:
    point = {"mass_ratio": 0.1, "damping_ratio": 0.1, "frequency_ratio": 1.0, "clearance": 5.0}
    observers = ["stroboscopic_section"]
    cube = damper.simulate(
        **point, restitution=0.5, masses=[{}, own], transient=1, periods=1, observers=observers
    )
    p, _ = damper_at(cube)
    assert [one.gravity for one in p.each] == [0.0, own.get("gravity", 0.0)]
    with pytest.raises(ValueError, match=r"^the closed form is that of rigid walls alone"):
        two_impact_ranges(cube.expand_dims("clearance"), "clearance")


# --- two impacts per period

SECTION = {"stroboscopic_section": {"when": 0.25, "free_mass": False}}


@pytest.fixture(scope="module")
def motion() -> xr.Dataset:
    return damper.simulate(
        mass_ratio=0.1,
        damping_ratio=0.02,
        frequency_ratio=1.0,
        clearance=np.arange(2.0, 16.1, 1.0),
        restitution=[0.3, 0.6],
        transient=200,
        periods=10,
        observers={**SECTION, "impacts": {}},
    )


def test_ranges_end_where_the_motion_does(motion: xr.Dataset) -> None:
    found = two_impact_ranges(motion, "clearance", 1e-4)
    assert set(found["range"]) == {"exists", "stable"}
    for row in found.to_dict("records"):
        stable = row["range"] == "stable"

        def holds(d: float, r: float = row["restitution"], stable: bool = stable) -> bool:
            both = orbits(damper.Parameters(0.1, 0.02, 1.0, d, r))
            return any(o.admissible and (o.stable or not stable) for o in both)

        lower, upper = row["clearance_lower"], row["clearance_upper"]
        assert holds(lower)
        assert holds(upper)
        for end, beyond in ((lower, lower - 1.1e-4), (upper, upper + 1.1e-4)):
            if 2.0 < end < 16.0:
                assert not holds(beyond)
        assert row["cut"] == (lower == 2.0 or upper == 16.0)


def test_simulation_agrees_to_rounding(motion: xr.Dataset) -> None:
    found = two_impact_errors(motion, "clearance")
    assert found["restitution"].tolist() == [0.3, 0.6]
    for row in found.to_dict("records"):
        assert 4 <= row["settled"] <= row["compared"] <= row["simulated"] <= 6
        assert row["largest_settled"] < 1e-8
        assert row["largest_settled"] <= row["largest"]


def test_table_has_ranges_and_comparisons(motion: xr.Dataset) -> None:
    table = make("two_impacts", {"cube": motion}, along="clearance", resolution=1e-2)
    assert set(table.data["row"]) == {"exists", "stable", "comparison"}
    assert len(table.csv().splitlines()) == 1 + len(table.data)
    assert table.csv().splitlines()[1].endswith(",,,,,,")
    (row,) = (line for line in table.markdown().splitlines() if line.startswith("| 0.6 |"))
    compared = two_impact_errors(motion, "clearance").to_dict("records")[1]
    assert f"| {compared['compared']} of {compared['simulated']} |" in row


def test_a_wrong_simulation_is_seen(motion: xr.Dataset) -> None:
    cube = motion.copy()
    cube["velocity"] = cube.velocity + 1e-3
    found = two_impact_errors(cube, "clearance")
    assert found["largest_settled"].to_numpy() == pytest.approx(1e-3, rel=1e-3)
    cube["impacts_per_period"] = cube.impacts_per_period + 1.0
    found = two_impact_errors(cube, "clearance")
    assert found["compared"].tolist() == [0, 0]
    assert found["median"].isna().all()


# --- shared


def test_damper_at_reads_both_systems_of_units() -> None:
    si = damper.SIParameters(2.0, 4.0, 200.0, 10.0, 11.0, 0.2, 0.02, 0.6)
    names = list(damper.SIParameters.__dataclass_fields__)
    place = xr.Dataset(coords={name: getattr(si, name) for name in names if name != "gap"})
    parameters, units = damper_at(place, gap=0.02)
    assert parameters == si.dimensionless
    assert units == si.units
    assert reduced_gap(damper.Parameters(1.0, 0.0, 1.0, 1.0, 0.5)) == 0.0
