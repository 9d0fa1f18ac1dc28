"""SI units: the same damper in kg, m, s, N, J, against formulas and integrations of its own."""

import dataclasses
import itertools
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf
from scipy.integrate import solve_ivp

from damper import SIParameters, State, events, simulate
from damper.parameters import NO_UNITS, Units
from damper.parameters.quantities import PARAMETER_NAMES, QUANTITIES, SI_NAMES, SI_QUANTITIES
from damper.parameters.units import units_of
from damper.study.config import ConfigError, load_study
from damper.sweep.cube import CONVENTIONS, write_cube
from damper.sweep.runs import run_points

#: F0/K = 0.05 m, sqrt(M/K) = 0.1 s, F0/sqrt(K M) = 0.5 m/s, F0^2/K = 0.5 J.
SI: dict[str, float] = {
    "primary_mass": 2.0,
    "damping": 4.0,
    "stiffness": 200.0,
    "force_amplitude": 10.0,
    "forcing_frequency": 11.0,
    "free_mass": 0.2,
    "gap": 0.1,
    "restitution": 0.5,
    "phase": 0.3,
}
SIZES = {"m": 0.05, "s": 0.1, "m/s": 0.5, "J": 0.5}
RATIOS = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.1,
    "frequency_ratio": 1.1,
    "clearance": 1.0,
    "restitution": 0.5,
    "phase": 0.3,
}
RIGID = {q.name: q.default for q in QUANTITIES if q.name not in RATIOS}
EVERYTHING: dict[str, Any] = {
    "stroboscopic_section": {"free_mass": True, "at": 0.1},
    "impacts": {},
    "bursts": {"records": 4},
}
RUN: dict[str, Any] = {"transient": 2, "periods": 3, "observers": EVERYTHING}


def positive(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers over many decades."""
    return st.floats(math.log(low), math.log(high)).map(math.exp)


def dampers() -> st.SearchStrategy[dict[str, float]]:
    """Dampers of any size, from a watch to a tower, with ratios in their ranges."""

    def in_si(
        M: float, K: float, F0: float, zeta: float, omega: float, mu: float, **rest: float
    ) -> dict[str, float]:
        return {
            "primary_mass": M,
            "damping": 2.0 * zeta * math.sqrt(K * M),
            "stiffness": K,
            "force_amplitude": F0,
            "forcing_frequency": omega * math.sqrt(K / M),
            "free_mass": mu * M,
            **rest,
        }

    return st.builds(
        in_si,
        M=positive(1e-6, 1e6),
        K=positive(1e-3, 1e9),
        F0=positive(1e-6, 1e6),
        zeta=st.just(0.0) | positive(1e-6, 9.0),
        omega=positive(2e-3, 900.0),
        mu=positive(2e-6, 1e9),
        gap=st.just(0.0) | positive(1e-6, 10.0),
        restitution=st.floats(0, 1),
        phase=st.floats(-7, 7),
    )


def by_formula(si: dict[str, float]) -> tuple[dict[str, mpf], dict[str, mpf]]:
    """Ratios and units from the definitions in the model's description, in 30 digits."""
    M, C, K, F0, Omega, m, gap, r, phase = (mpf(si[name]) for name in SI)
    ratios = {
        "mass_ratio": m / M,
        "damping_ratio": C / (2 * mp.sqrt(K * M)),
        "frequency_ratio": Omega / mp.sqrt(K / M),
        "clearance": (gap / 2) * K / F0,
        "restitution": r,
        "phase": phase,
    }
    sizes = {"m": F0 / K, "s": mp.sqrt(M / K), "m/s": F0 / mp.sqrt(K * M), "J": F0**2 / K}
    return ratios, sizes


def one(variable: xr.DataArray | xr.Dataset) -> Any:
    return variable.values


# --- the conversion


@given(si=dampers())
def test_ratios_and_units_by_formula(si: dict[str, float]) -> None:
    damper = SIParameters(**si)
    with mp.workdps(30):
        ratios, sizes = by_formula(si)
        numbers = dataclasses.asdict(damper.dimensionless)
        for name in RATIOS:
            assert abs(numbers[name] - ratios[name]) <= mpf(6e-16) * abs(ratios[name]), name
        units = damper.units
        found = {"m": units.length, "s": units.time, "m/s": units.speed, "J": units.energy}
        for unit, number in found.items():
            assert abs(number - sizes[unit]) <= mpf(6e-16) * sizes[unit], unit
        assert abs(damper.period - 2 * mp.pi / mpf(si["forcing_frequency"])) < 1e-15 * damper.period
        # Period in both systems: the same stretch of time.
        assert damper.dimensionless.period * units.time == pytest.approx(damper.period, rel=1e-15)


def test_sizes_by_hand() -> None:
    damper = SIParameters(**SI)
    assert dataclasses.asdict(damper.dimensionless) == pytest.approx(RATIOS | RIGID, rel=1e-15)
    units = damper.units
    assert (units.length, units.time, units.speed, units.energy) == (0.05, 0.1, 0.5, 0.5)
    assert [units.size(u) for u in ("F0/K", "sqrt(M/K)", "F0/sqrt(K M)", "F0^2/K")] == [
        *(0.05, 0.1, 0.5, 0.5)
    ]
    assert units.size("1") == units.size("rad") == 1.0
    assert Units(1.0, 1.0, 1.0) == NO_UNITS
    assert NO_UNITS.speed == 1.0


# --- the same motion


def assert_scaled(cube: xr.Dataset, plain: xr.Dataset, sizes: dict[str, Any]) -> None:
    """Numbers with units are multiplied by their sizes; counts and codes are the same ones."""
    names = {"F0/K": "m", "sqrt(M/K)": "s", "F0/sqrt(K M)": "m/s", "F0^2/K": "J"}
    assert set(cube.data_vars) == set(plain.data_vars)
    for name, variable in plain.data_vars.items():
        units = units_of(variable.attrs)
        assert cube[name].attrs["units"] == names.get(units, units)
        assert cube[name].dtype == variable.dtype
        if units in names:
            expected = variable.values * float(sizes[names[units]])
            np.testing.assert_allclose(cube[name].values, expected, rtol=3e-15, err_msg=name)
        else:
            np.testing.assert_array_equal(cube[name].values, variable.values, err_msg=name)


@settings(max_examples=8)
@given(si=dampers(), initial=st.tuples(*[st.floats(-1, 1)] * 4))
def test_si_cube_is_the_dimensionless_one_in_other_units(
    si: dict[str, float], initial: tuple[float, ...]
) -> None:
    damper = SIParameters(**si)
    ratios = dataclasses.asdict(damper.dimensionless)
    assume(ratios["mass_ratio"] < 1e3 and ratios["damping_ratio"] < 1e2)
    assume(1e-2 < ratios["frequency_ratio"] < 1e2)
    with mp.workdps(30):
        sizes = {name: float(size) for name, size in by_formula(si)[1].items()}
    run = {**RUN, "transient": 1, "periods": 2, "max_events": 500}
    x, v, place, relative = initial
    units = damper.units
    given = dict(zip(INITIAL, initial, strict=True))
    # The numbers that the run starts from, in units of the code: chaos forgives no rounding.
    inside = {
        "initial_displacement": x / units.length,
        "initial_velocity": v / units.speed,
        "initial_position": place,
        "initial_relative_velocity": relative / units.speed,
    }
    cube = simulate(**si, **given, **run)
    plain = simulate(**ratios, **inside, **run)
    assert_scaled(cube, plain, sizes)
    for name, value in (si | given).items():
        assert float(cube[name]) == value


INITIAL = (
    "initial_displacement",
    "initial_velocity",
    "initial_position",
    "initial_relative_velocity",
)


def test_other_observers_in_si() -> None:
    run = {"transient": 1, "periods": 2, "observers": ["response", "accumulation", "trajectory"]}
    ratios = dataclasses.asdict(SIParameters(**SI).dimensionless)
    assert_scaled(simulate(**SI, **run), simulate(**ratios, **run), SIZES)


def integrate(si: dict[str, float], start: State, until: float) -> tuple[list[float], np.ndarray]:
    """Impact times and last state, by an integration of the equations in SI units."""
    half = si["gap"] / 2

    def slope(t: float, z: np.ndarray) -> list[float]:
        x, v, _, u = z
        force = si["force_amplitude"] * math.sin(si["forcing_frequency"] * t + si["phase"])
        inner = -si["damping"] * v - si["stiffness"] * x
        return [v, (force + inner) / si["primary_mass"], u, 0.0]

    def right(_: float, z: np.ndarray) -> float:
        return (half - (z[2] - z[0])) / half

    def left(_: float, z: np.ndarray) -> float:
        return (half + (z[2] - z[0])) / half

    for wall in (right, left):
        wall.terminal, wall.direction = True, -1
    t, z, times = start.time, np.array([start.x, start.v, start.y, start.u]), []
    M, m, r = si["primary_mass"], si["free_mass"], si["restitution"]
    while True:
        run = solve_ivp(
            slope,
            (t, until),
            z,
            method="DOP853",
            rtol=1e-12,
            atol=1e-14,
            events=(right, left),
            max_step=0.01,
        )
        if run.status != 1:
            return times, run.y[:, -1]
        t, (x, v, y, u) = run.t[-1], run.y[:, -1]
        times.append(t)
        momentum, relative = M * v + m * u, -r * (u - v)
        v = (momentum - m * relative) / (M + m)
        side = math.copysign(1.0, y - x)
        z = np.array([x, v, x + side * half * (1 - 1e-13), v + relative])


def test_against_an_integration_in_metres_and_seconds() -> None:
    """Nothing scaled anywhere: wrong units of anything would show."""
    si = {**SI, "gap": 0.4}
    start = State(0.02, -0.1, 0.1, 0.3, 0.07)
    period = 2 * math.pi / 11.0
    times, end = integrate(si, start, 0.07 + 4 * period)
    assert len(times) >= 5
    observers = {"stroboscopic_section": {"free_mass": True}, "impacts": {"threshold": 1e-9}}
    cube = simulate(**si, state=start, transient=0, periods=5, observers=observers)
    found = (cube.displacement, cube.velocity, cube.free_displacement, cube.free_velocity)
    np.testing.assert_allclose([float(a[0]) for a in found], [0.02, -0.1, 0.1, 0.3], rtol=1e-13)
    np.testing.assert_allclose([float(a[4]) for a in found], end, atol=1e-8)
    cube = simulate(**si, state=start, transient=0, periods=4, observers=observers)
    assert float(cube.impacts_per_period) * 4 == len(times)


# --- cubes


def test_cube_named_by_si_names(tmp_path: Path) -> None:
    axes = {"stiffness": [100.0, 200.0, 300.0], "gap": [0.05, 0.1]}
    cube = simulate(**SI | axes, initial_displacement=[0.0, 0.01], **RUN)
    assert cube.displacement.dims == ("stiffness", "gap", "initial_displacement", "sample")
    units = {quantity.name: quantity.units for quantity in SI_QUANTITIES}
    for name in SI:
        assert cube[name].attrs["units"] == units[name]
        assert cube[name].attrs["long_name"]
    assert [units[name] for name in SI] == [
        *("kg", "N s/m", "N/m", "N", "rad/s", "kg", "m", "1", "rad")
    ]
    assert cube.initial_displacement.attrs["units"] == "m"
    assert cube.displacement.attrs["units"] == "m"
    assert cube.velocity.attrs["units"] == cube.max_approach_speed.attrs["units"] == "m/s"
    assert cube.burst_onset.attrs["units"] == "s"
    assert not set(cube.variables) & (set(PARAMETER_NAMES) - set(SI_NAMES))
    write_cube(cube, tmp_path / "cube.nc")
    with xr.open_dataset(tmp_path / "cube.nc") as back:
        xr.testing.assert_identical(back.load(), cube.assign_attrs(Conventions=CONVENTIONS))


def test_each_point_has_its_own_units() -> None:
    """Along axes that change every unit, with draws beside them."""
    axes = {"primary_mass": [1.0, 2.0], "stiffness": [100.0, 200.0], "force_amplitude": [5.0, 10.0]}
    drawn = {"count": 2, "seed": 1, "initial_velocity": [-1, 1], "initial_position": [-1, 1]}
    cube = simulate(**SI | axes, **RUN, draws=drawn)
    for place in itertools.product(*axes.values()):
        where = dict(zip(axes, place, strict=True))
        for number in range(2):
            start = {name: float(cube[name][number]) for name in drawn if name in INITIAL}
            alone = simulate(**SI | where | start, **RUN)
            for name, variable in alone.data_vars.items():
                found = cube[name].sel(where).isel(draw=number)
                np.testing.assert_array_equal(one(found), one(variable), err_msg=name)


STATE = {"stroboscopic_section": {"free_mass": True}}


def test_state_is_in_metres_and_seconds() -> None:
    state = State(0.01, -0.2, 0.05, 0.4, 0.123)
    cube = simulate(**SI, state=state, **{**RUN, "transient": 0, "observers": STATE})
    found = (cube.displacement, cube.velocity, cube.free_displacement, cube.free_velocity)
    np.testing.assert_allclose([float(a[0]) for a in found], [0.01, -0.2, 0.05, 0.4], rtol=1e-14)
    # The force at that time is what makes it move on.
    later = simulate(**SI, state=State(0.01, -0.2, 0.05, 0.4), **{**RUN, "observers": STATE})
    assert abs(later.velocity - cube.velocity).max() > 1e-3
    with pytest.raises(ValueError, match="outside the box"):
        simulate(**SI, state=State(0.0, 0.0, 0.06, 0.0), **RUN)
    on_the_wall = simulate(**SI, state=State(0.31, 0.0, 0.31 + 0.05, 0.0), **RUN)
    assert on_the_wall.status == 0


def test_steady_start_in_metres() -> None:
    scene = {**SI, "gap": 1e3}
    cube = simulate(**scene, initial="steady", transient=0, periods=3, observers=STATE)
    gain = 10.0 / complex(200.0 - 2.0 * 11.0**2, 4.0 * 11.0)
    turning = gain * complex(math.cos(0.3), math.sin(0.3))
    np.testing.assert_allclose(cube.displacement, turning.imag, rtol=1e-12)
    np.testing.assert_allclose(cube.velocity, 11.0 * turning.real, rtol=1e-12)


# --- thresholds and events


def test_absolute_threshold_where_units_differ_along_an_axis() -> None:
    si = {**SI, "gap": 0.02, "stiffness": [100.0, 200.0, 400.0]}
    run = {"transient": 5, "periods": 20}
    observers = {"impacts": {"threshold": {"speed": 0.1}}, "bursts": {"threshold": {"speed": 0.1}}}
    cube = simulate(**si, **run, observers=observers)
    for k in si["stiffness"]:
        damper = SIParameters(**{**si, "stiffness": k})
        limit = {"threshold": {"speed": 0.1 / damper.units.speed}}
        ratios = dataclasses.asdict(damper.dimensionless)
        plain = simulate(**ratios, **run, observers={"impacts": limit, "bursts": limit})
        here = cube.sel(stiffness=k)
        assert here.impacts_per_period == plain.impacts_per_period
        assert here.visible_impacts == plain.visible_impacts
        np.testing.assert_allclose(
            here.mean_approach_speed, plain.mean_approach_speed * damper.units.speed, rtol=1e-14
        )


def test_events_in_metres_and_seconds() -> None:
    damper = SIParameters(**{**SI, "gap": 0.02})
    start = State(0.001, 0.02, 0.005, 0.0, 0.05)
    found = events(damper, start, until=2.0)
    inside = State(0.02, 0.04, 0.1, 0.0, 0.5)
    plain = events(damper.dimensionless, inside, until=20.0)
    assert len(found) == len(plain) > 20
    assert set(found["kind"]) == {0, 1, 2}
    np.testing.assert_array_equal(found["kind"], plain["kind"])
    np.testing.assert_array_equal(found["side"], plain["side"])
    few = 20  # before chaos has made rounding visible
    sizes = {"time": 0.1, "x": 0.05, "v": 0.5, "approach_speed": 0.5}
    if "time_in_period" in found.dtype.names:
        sizes["time_in_period"] = 0.1
        np.testing.assert_array_equal(found["period"][:few], plain["period"][:few])
    for name, size in sizes.items():
        np.testing.assert_allclose(
            found[name][:few], size * plain[name][:few], rtol=1e-9, atol=1e-12, err_msg=name
        )
    assert found["time"][0] >= 0.05
    assert found["time"][-1] <= 2.0
    stopped = events(damper, until=20.0, max_events=3)[-1]
    assert stopped["kind"] == 3
    assert stopped["time"] < 2.0


# --- refusals


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("gap", -1e300),
        ("stiffness", 0.0),
        ("damping", math.nan),
        ("free_mass", "1"),
        ("phase", None),
    ],
)
def test_value_out_of_range_is_named(name: str, value: Any) -> None:
    kind = ValueError if isinstance(value, float) else TypeError
    with pytest.raises(kind, match=re.escape(f"{name} = {value!r}: must be a")):
        SIParameters(**{**SI, name: value})


def test_no_force_is_refused_with_the_reason() -> None:
    for call in (lambda: SIParameters(**{**SI, "force_amplitude": 0}), lambda: simulate(**NONE)):
        with pytest.raises(ValueError, match=r"lengths are scaled by F0/K, so free vibration"):
            call()


NONE: dict[str, Any] = {**SI, "force_amplitude": [1.0, 0.0]}


@settings(max_examples=50)
@given(
    masses=st.tuples(*[st.floats(5e-324, 1.7e308)] * 2),
    rest=st.tuples(*[st.floats(5e-324, 1.7e308)] * 5),
)
def test_any_numbers_give_a_damper_or_a_refusal(
    masses: tuple[float, ...], rest: tuple[float, ...]
) -> None:
    """Sound parameters and units, or words; nothing else is raised."""
    M, m = masses
    C, K, F0, Omega, gap = rest
    try:
        damper = SIParameters(M, C, K, F0, Omega, m, gap, 0.5)
    except ValueError as error:
        words = ("cannot be scaled", ": must be a finite number with ")
        assert any(text in str(error) for text in words)  # noqa: PT017
        return
    units = damper.units
    for size in (units.length, units.time, units.speed, units.energy):
        assert 0.0 < size < math.inf
    assert damper.dimensionless.clearance > 0.0


@pytest.mark.parametrize(
    ("values", "error", "parts"),
    [
        (
            {**RATIOS, "stiffness": 200.0},
            ValueError,
            ["stiffness (SI units)", "mass_ratio", "(dimensionless) are mixed"],
        ),
        (
            {"stiffness": 200.0, "restitution": 0.5},
            TypeError,
            ["missing parameters: primary_mass, damping, force_amplitude"],
        ),
        ({**SI, "gap": [0.1, -0.1]}, ValueError, ["gap = -0.1", "gap >= 0"]),
    ],
    ids=lambda value: str(value)[:20] if isinstance(value, list) else "",
)
def test_mixed_missing_or_wrong_names(
    values: dict[str, Any], error: type[Exception], parts: list[str]
) -> None:
    with pytest.raises(error) as caught:
        simulate(**values)
    for part in parts:
        assert part in str(caught.value)


def test_options_of_the_models_are_scaled() -> None:
    """K = 200 N/m, sqrt(K M) = 20 N s/m."""
    grounded = SIParameters(**SI, support_stiffness=5.0, support_damping=0.8).dimensionless
    assert grounded.support_stiffness_ratio == 0.025
    assert grounded.support_damping == pytest.approx(0.02, rel=1e-15)
    compliant = SIParameters(**SI, contact_stiffness=2e6, contact_tension=1).dimensionless
    assert compliant.contact_stiffness_ratio == 1e4
    assert compliant.contact_tension == 1.0
    modulation = {"modulation_depth": 0.2, "modulation_order": 3, "modulation_phase": 0.4}
    modulated = dataclasses.asdict(SIParameters(**SI, **modulation).dimensionless)
    assert {name: modulated[name] for name in modulation} == modulation


# --- study files


STUDY = """\
title: SI
source: ours
parameters:
  primary_mass: 2
  damping: 4
  force_amplitude: 10
  forcing_frequency: 11
  free_mass: 0.2
  restitution: 0.5
axes:
  stiffness: {values: [100, 200]}
  gap: {start: 0.05, stop: 0.1, num: 2, fan: true}
transient: 2
periods: 3
observers:
  impacts:
"""


def load(folder: Path, text: str) -> Any:
    path = folder / "si.yaml"
    path.write_text(text)
    return load_study(path)


def test_study_in_si(tmp_path: Path) -> None:
    study = load(tmp_path, STUDY)
    assert study.fixed == {**{name: SI[name] for name in study.parameters}, "phase": 0.0}
    assert study.slices() == [{"gap": 0.05}, {"gap": 0.1}]
    assert study.slice_path({"gap": 0.05}) == "gap~0.05"
    assert load(tmp_path, study.to_yaml()) == study
    assert load(tmp_path, study.to_yaml()).to_yaml() == study.to_yaml()


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("  damping: 4\n", "", ["'damping' is not given", "damping >= 0 in N s/m, under"]),
        ("primary_mass: 2", "M: 2", ["unknown parameter 'M'", "mean 'primary_mass'?", "1 error "]),
        ("stiffness: {", "K: {", ["unknown axis 'K'", "did you mean 'stiffness'?", "1 error "]),
        (
            "force_amplitude: 10",
            "force_amplitude: 0",
            [
                "parameters.force_amplitude\n    out of range (value: 0)",
                "number in N, force_amplitude > 0 (lengths are scaled by F0/K, so free vibration",
            ],
        ),
        ("[100, 200]", "[100, 0]", ["stiffness.values[1]", "number in N/m, stiffness > 0"]),
        (
            "  damping: 4",
            "  damping_ratio: 0.1",
            ["(SI units) and damping_ratio (dimensionless) are mixed", "stiffness", "1 error "],
        ),
    ],
    ids=lambda value: "" if isinstance(value, list) else value.strip()[:20],
)
def test_mistake_in_a_study_in_si(tmp_path: Path, old: str, new: str, parts: list[str]) -> None:
    assert STUDY.count(old) == 1
    with pytest.raises(ConfigError) as caught:
        load(tmp_path, STUDY.replace(old, new))
    for part in parts:
        assert part in str(caught.value)


def test_ratio_that_leaves_its_range_along_an_axis_of_a_study(tmp_path: Path) -> None:
    """Known when the file is read, from the ends of the axes."""
    with pytest.raises(ConfigError, match=r"parameters\n +damping_ratio = 10\.6.*, from damping"):
        load(tmp_path, STUDY.replace("damping: 4", "damping: 300"))


def test_undamped_resonance_in_a_study_in_si(tmp_path: Path) -> None:
    """Known when the file is read, as for a study in ratios."""
    text = STUDY.replace("damping: 4", "damping: 0").replace("frequency: 11", "frequency: 10")
    load(tmp_path, text)
    with pytest.raises(ConfigError, match=r"initial\n.*no steady linear response"):
        load(tmp_path, text + "initial: steady\n")


# --- runs


def test_a_mixed_grid_is_refused_before_anything_is_run() -> None:
    done: list[int] = []
    with pytest.raises(ValueError, match="mixed"):
        run_points([SI, {**SI, "clearance": 1.0}], [], transient=1, periods=1, progress=done.append)
    assert done == []
