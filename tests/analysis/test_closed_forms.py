"""Closed forms beside simulation."""

import math

import numpy as np
import pytest
import xarray as xr

import damper
from damper.analysis import small_mass_border, two_impact_errors, two_impact_ranges
from damper.analysis.closed_forms import damper_at, dense, reduced_gap
from damper.sweep.runs import run_points
from damper.tables import make
from damper.theory.small_mass import critical_restitution
from damper.theory.two_impacts import orbits

RUN = {"transient": 5, "periods": 5, "primary": "steady"}


@pytest.mark.parametrize("own", [{}, {"gravity": 0.1}], ids=["alike", "unlike"])
def test_listed_masses_are_not_taken_for_one(own: dict[str, float]) -> None:
    point = {"mass_ratio": 0.1, "damping_ratio": 0.1, "frequency_ratio": 1.0, "clearance": 5.0}
    observers = ["stroboscopic_section"]
    cube = damper.simulate(
        **point, restitution=0.5, masses=[{}, own], transient=1, periods=1, observers=observers
    )
    p, _ = damper_at(cube)
    assert [one.gravity for one in p.each] == [0.0, own.get("gravity", 0.0)]
    with pytest.raises(ValueError, match=r"^the closed form is that of the rigid damper"):
        two_impact_ranges(cube.expand_dims("clearance"), "clearance")


# --- small-mass limit


@pytest.fixture(scope="module")
def light() -> xr.Dataset:
    return damper.simulate(
        mass_ratio=1e-4,
        damping_ratio=0.05,
        frequency_ratio=[0.3, 1.2],
        # Not in order, and the last one beyond G = pi below resonance.
        clearance=[1.0, 0.2, 3.0],
        restitution=np.linspace(0.0, 0.8, 9),
        initial="steady",
        transient=5,
        periods=5,
        observers=["bursts"],
    )


def test_borders_lie_at_the_limit(light: xr.Dataset) -> None:
    found = small_mass_border(light)
    places = list(zip(found["frequency_ratio"], found["clearance"], strict=True))
    assert places == [(w, d) for w in (0.3, 1.2) for d in (0.2, 1.0, 3.0)]
    assert found["single"].all()
    for row in found.to_dict("records"):
        omega, d = row["frequency_ratio"], row["clearance"]
        amplitude = 1.0 / math.hypot(1.0 - omega**2, 0.1 * omega)
        gap = 2.0 * d / amplitude
        assert row["reduced_gap"] == pytest.approx(gap, rel=1e-12)
        if gap > math.pi:
            assert math.isnan(row["critical_restitution"])
            continue
        limit = float(critical_restitution(gap))
        assert row["critical_restitution"] == pytest.approx(limit, abs=1e-12)
        assert row["border"] == pytest.approx(limit, abs=4e-4)
        assert row["difference"] == row["border"] - row["critical_restitution"]
        # Bisected: all bursts complete just below the border and not just above it.
        for side, all_complete in ((-1e-4, True), (1e-4, False)):
            point = {
                "mass_ratio": 1e-4, "damping_ratio": 0.05, "frequency_ratio": omega,
                "clearance": d, "restitution": row["border"] + side,
            }  # fmt: skip
            arrays, _ = run_points([point], ["bursts"], **RUN)
            assert (arrays["complete_fraction"][0] == 1.0) == all_complete


def test_table_gives_the_largest_distance(light: xr.Dataset) -> None:
    table = make("small_mass_limit", {"cube": light}, resolution=1e-2)
    text = table.markdown()
    largest = table.data["difference"].abs().max()
    assert f"Largest distance between border and limit: {largest:.1e}." in text
    assert "| 0.3 | 2 of 3 |" in text
    assert "| 1.2 | 3 of 3 |" in text


def test_borders_that_are_not_on_the_axis(light: xr.Dataset) -> None:
    cube = light.isel(frequency_ratio=[0])
    low = cube.sel(restitution=slice(0.0, 0.05))  # one value, complete, and above the limit at 3
    table = make("small_mass_limit", {"cube": low}, resolution=1e-4)
    assert table.data["border"].isna().all()
    assert "Largest distance between border and limit: none." in table.markdown()
    high = cube.sel(restitution=slice(0.65, 0.85))
    assert small_mass_border(high)["border"].isna().all()


def test_several_borders_are_told() -> None:
    cube = damper.simulate(
        mass_ratio=1e-4, damping_ratio=0.05, frequency_ratio=0.3, clearance=[0.2, 1.0],
        restitution=[0.0, 0.1, 0.2, 0.3, 0.4], transient=0, periods=1, observers=["bursts"],
    )  # fmt: skip
    complete = np.array([[1, 1], [1, 0.5], [0.5, 0.5], [1, 0.5], [0, 0]], dtype=float)
    cube["complete_fraction"] = (("restitution", "clearance"), complete)
    found = small_mass_border(cube, resolution=0.2)
    assert found["single"].tolist() == [False, True]
    assert found["border"].to_numpy() == pytest.approx([0.15, 0.05])


def test_a_border_is_unknown_where_a_run_stops_early(light: xr.Dataset) -> None:
    cube = light.isel(frequency_ratio=[0]).sel(clearance=[0.2])
    cube.attrs["max_events"] = 30
    assert small_mass_border(cube)["border"].isna().all()


# --- two impacts per period

SECTION = {"stroboscopic_section": {"at": 0.25, "free_mass": False}}


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


def test_directions_and_draws_are_compared_together() -> None:
    cube = damper.simulate(
        mass_ratio=0.1, damping_ratio=0.02, frequency_ratio=1.0, restitution=0.6,
        clearance=[9.0, 10.0, 11.0], follow={"clearance": "both"}, transient=150, periods=5,
        observers={"impact_section": {"wall": "left", "samples": 7}, "impacts": {}},
    )  # fmt: skip
    (row,) = two_impact_errors(cube, "clearance").to_dict("records")
    assert (row["simulated"], row["compared"]) == (6, 6)
    assert row["largest"] < 1e-6


# --- shared


def test_damper_at_reads_both_systems_of_units() -> None:
    si = damper.SIParameters(2.0, 4.0, 200.0, 10.0, 11.0, 0.2, 0.02, 0.6)
    names = list(damper.SIParameters.__dataclass_fields__)
    place = xr.Dataset(coords={name: getattr(si, name) for name in names if name != "gap"})
    parameters, units = damper_at(place, gap=0.02)
    assert parameters == si.dimensionless
    assert units == si.units
    assert reduced_gap(damper.Parameters(1.0, 0.0, 1.0, 1.0, 0.5)) == 0.0


def test_dense_values_keep_the_grid() -> None:
    grid = np.array([3.0, 1.0, 1.5])
    found = dense(grid, between=4, most=100)
    assert set(grid) <= set(found)
    assert len(found) == 9
    np.testing.assert_array_equal(dense(grid, between=4, most=3), np.sort(grid))
