"""Periodic motions of a study: its branches as a dataset, drawn and tabulated."""

from collections.abc import Iterator
from functools import partial

import numpy as np
import pytest
import xarray as xr

from damper.analysis import orbits as analysis
from damper.analysis.orbits import follow_orbits
from damper.figures import draw
from damper.figures.overlays import Panels
from damper.figures.overlays.orbits import overlay
from damper.parameters import Parameters
from damper.sweep.orbits.periodic import periodic_orbit
from damper.tables.special_points import SpecialPoints, make
from damper.theory.two_impacts import orbits as closed_form

FIXED = {"mass_ratio": 0.1, "damping_ratio": 0.1, "frequency_ratio": 1.0, "phase": 0.0}
#: Of the study's runs; no motion depends on it.
START = {"initial_relative_velocity": 0.1}
AXES = {"restitution": (0.4, 0.5), "clearance": (4.5, 4.8)}
ENTRY = {"along": "clearance", "start": 4.7, "period": 1, "max_orbits": 50, "settle": 60}
BREAKING = ENTRY | {
    "at": {"restitution": 0.5},
    "curves": {"symmetry breaking": {"restitution": (0.49, 0.51)}},
}


@pytest.fixture(scope="module", autouse=True)
def _coarse() -> Iterator[None]:
    """Follow in long steps: no test asks for places between."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(analysis, "continue_orbit", partial(analysis.continue_orbit, step=0.2))
        patch.setattr(analysis, "_STEP", 1.0)
        yield


@pytest.fixture(scope="module")
def branches() -> xr.Dataset:
    found = follow_orbits({"two": ENTRY}, FIXED | START, AXES, 0.25)
    for name in AXES:
        found[name].attrs["axis"] = 1
    return found


def test_branches_at_each_place_of_the_other_axes(branches: xr.Dataset) -> None:
    """Displacement and velocity are those of the closed form, a quarter of a period on."""
    assert branches.motion.values.tolist() == ["two"] * 2
    assert branches.restitution.values.tolist() == [0.4, 0.5]
    assert "initial_relative_velocity" not in branches.coords
    orbits = branches.isel(orbit=branches.branch.values == 1)
    assert (orbits.value.min(), orbits.value.max()) == AXES["clearance"]
    for k in (0, -1):
        orbit = orbits.isel(orbit=k, turn=0)
        p = Parameters(0.1, 0.1, 1.0, float(orbit.value), 0.5)
        known = closed_form(p)[0].stroboscopic(0.25)
        np.testing.assert_allclose([orbit.displacement, orbit.velocity], known, rtol=1e-9)
        assert bool(orbit.stable) == closed_form(p)[0].stable
        # The closed form has those of half the period.
        sizes = np.sort(abs(closed_form(p)[0].multipliers) ** 2)[::-1]
        np.testing.assert_allclose(orbit.multiplier, sizes, rtol=1e-7, atol=1e-9)


def test_every_variable_has_a_long_name_and_every_number_units(branches: xr.Dataset) -> None:
    for name, variable in branches.variables.items():
        assert len(variable.attrs["long_name"]) > 3, name
        assert variable.dtype.kind not in "fi" or variable.attrs["units"] in ("1", "rad"), name
    assert branches.point_velocity.attrs["scaled_by"] == "F0/sqrt(K M)"


def test_masses_in_step_have_the_branch_of_one(branches: xr.Dataset) -> None:
    """From rest they stay so; what parts them has the multipliers that are infinite."""
    two = follow_orbits(
        {"two": ENTRY | {"at": {"restitution": 0.5}}}, FIXED | {"mass_share": 0.5}, AXES, masses=2
    )
    one = branches.isel(point=branches.point_branch.values == 1)
    assert two.kind.values.tolist() == one.kind.values.tolist() == ["symmetry breaking"]
    assert two.point_value.values == pytest.approx(one.point_value.values, abs=1e-9)
    assert np.isinf(two.point_multiplier[:, :2]).all()
    assert two.point_multiplier.values[:, 2:] == pytest.approx(
        one.point_multiplier.values, rel=1e-6
    )


def test_along_the_clearance_of_one_mass() -> None:
    """To where the order of the impacts changes; each orbit is one that is found by itself."""
    own = {"mass_ratio_0": 0.1, "mass_ratio_1": 0.09, "clearance_0": 3.0, "gravity_1": 0.05}
    fixed = {"damping_ratio": 0.1, "frequency_ratio": 1.0, "restitution": 0.5, **own}
    entry = ENTRY | {"along": "clearance_1", "start": 3.85}
    found = follow_orbits({"two": entry}, fixed, {"clearance_1": (3.84, 3.92)}, masses=2)
    assert found.attrs["masses"] == 2
    assert found.mass_ratio_1.attrs["long_name"] == "mass ratio m/M, mass 1"
    assert found.first_end.item() == "clearance_1 = 3.84 is the end of the range"
    assert "where the masses 1 and 0 hit at one instant" in found.last_end.item()
    for k in (0, -1):
        orbit = found.isel(orbit=k, turn=0)
        masses = [
            {"mass_ratio": 0.1, "clearance": 3.0},
            {"mass_ratio": 0.09, "clearance": float(orbit.value), "gravity": 0.05},
        ]
        p = Parameters(9.0, 0.1, 1.0, 9.0, 0.5, masses=masses)
        known = periodic_orbit(p, settle=60)
        assert [orbit.displacement, orbit.velocity] == pytest.approx(known.start[:2], abs=1e-8)
        assert orbit.multiplier.values == pytest.approx(abs(known.multipliers), abs=1e-6)
        assert orbit.word == known.word


def test_a_curve_along_two_quantities_of_one_mass() -> None:
    """At its ends the orbit that is found by itself has the multiplier -1."""
    own = {"mass_ratio_0": 0.05, "mass_ratio_1": 0.05, "clearance_0": 4.0}
    fixed = {"damping_ratio": 0.05, "frequency_ratio": 1.0, "restitution": 0.6, **own}
    entry = ENTRY | {"along": "clearance_1", "start": 5.66, "settle": 80}
    entry["curves"] = {"period doubling": {"mass_ratio_1": (0.0499, 0.0501)}}
    found = follow_orbits({"two": entry}, fixed, {"clearance_1": (5.65, 5.68)}, masses=2)
    assert found.kind.values.tolist() == ["period doubling"]
    assert found.curve_other.item() == "mass_ratio_1"
    assert found.curve_other_value.values[[0, -1]].tolist() == [0.0499, 0.0501]
    for k in (0, -1):
        ratio, clearance = found.curve_other_value.values[k], found.curve_value.values[k]
        masses = [
            {"mass_ratio": 0.05, "clearance": 4.0},
            {"mass_ratio": float(ratio), "clearance": float(clearance)},
        ]
        p = Parameters(9.0, 0.05, 1.0, 9.0, 0.6, masses=masses)
        assert abs(periodic_orbit(p).multipliers + 1.0).min() < 1e-8


def test_a_motion_that_is_not_expected_is_named() -> None:
    entries = {"two": ENTRY | {"expect": "R1 L1"}, "three": ENTRY | {"expect": "R2 L1"}}
    found = follow_orbits(entries, FIXED, {**AXES, "restitution": (0.5,)})
    for name in AXES:
        found[name].attrs["axis"] = 1
    assert (found.branch.values == 0).all()
    assert found.first_end.values[1] == "the run at 4.7 is R1 L1, not R2 L1"
    text = make({"orbits": found}, SpecialPoints.model_construct()).markdown()
    assert "Ends of three (restitution 0.5): the run at 4.7 is R1 L1, not R2 L1; " in text


def test_table(branches: xr.Dataset) -> None:
    table = make({"orbits": branches}, SpecialPoints.model_construct())
    first = table.data[table.data.restitution == 0.5].iloc[0]
    assert (first.motion, first.point, first.word) == ("two", "symmetry breaking", "R1 L1")
    assert first.value == pytest.approx(4.616152418, abs=1e-9)
    assert "clearance = 4.8 is the end of the range" in str(table.body[3])


def test_drawn_over_a_row_of_a_diagram(branches: xr.Dataset) -> None:
    """Only those of the row's place; stable and unstable pieces, and the points."""
    from matplotlib.figure import Figure

    ax, multipliers = Figure().subplots(2)
    panel = xr.Dataset(coords={"clearance": [4.5, 4.8], "restitution": 0.5})
    axes = {"displacement": ax, "multiplier": multipliers, "peak_displacement": None}
    handles = overlay(Panels(axes, ("clearance",), panel, {"orbits": branches}))
    labels = [str(handle.get_label()) for handle in handles]
    assert labels[:2] == ["periodic motion, stable", "periodic motion, unstable"]
    assert "symmetry breaking" in labels
    stable, unstable = (
        np.concatenate([line.get_ydata() for line in multipliers.lines if line.get_ls() == style])
        for style in ("-", "--")
    )
    assert stable.max() < 1.0 < unstable.max()
    nowhere = panel.assign_coords(restitution=0.7)
    assert overlay(Panels(axes, ("clearance",), nowhere, {"orbits": branches})) == []


def test_curves_of_special_points() -> None:
    """On the curve the multiplier of half the period is -1; drawn over a map of both axes."""
    from matplotlib.figure import Figure

    found = follow_orbits({"two": BREAKING}, FIXED, AXES)
    for name in AXES:
        found[name].attrs["axis"] = 1
    assert found.restitution.values.tolist() == [0.5]
    assert found.curve_kind.values.tolist() == ["symmetry breaking"]
    assert found.curve_other_value.values[[0, -1]].tolist() == [0.49, 0.51]
    for clearance, r in zip(found.curve_value.values, found.curve_other_value.values, strict=True):
        known = closed_form(Parameters(0.1, 0.1, 1.0, clearance, r))[0].multipliers
        assert abs(known + 1.0).min() < 1e-9
    table = make({"orbits": found}, SpecialPoints.model_construct())
    assert table.data.restitution.tolist()[1:] == found.curve_other_value.values.tolist()
    assert "restitution = 0.51 is the end of the range" in str(table.body)
    ax = Figure().subplots()
    panel = xr.Dataset(coords={"clearance": [4.5, 4.8], "restitution": [0.4, 0.5]})
    over = Panels({"chatter": ax}, ("restitution", "clearance"), panel, {"orbits": found})
    (handle,) = overlay(over)
    assert handle.get_label() == "symmetry breaking"
    np.testing.assert_array_equal(ax.lines[0].get_ydata(), found.curve_value)
    assert overlay(over._replace(over=("restitution", "mass_ratio"))) == []
    (ax,) = draw("special_points", {"orbits": found}, x="clearance", y="restitution").axes
    np.testing.assert_array_equal(ax.lines[0].get_ydata(), found.curve_other_value)
    assert ax.get_ylim() == (0.49, 0.51)
    none = found.isel(curve=slice(0), curve_point=slice(0))
    (ax,) = draw("special_points", {"orbits": none}, x="clearance", y="restitution").axes
    assert ax.texts[0].get_text() == "no such special point was found"
