"""SI units: the same damper in kg, m, s, N, J, against formulas and integrations of its own."""

import dataclasses
import itertools
import math
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from figures.drawing import drawn
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf
from scenes import SI as SCENE_SI
from studies import load

import damper
from damper import Parameters, SIParameters, State, events, simulate
from damper.engine.compiled import plain
from damper.parameters import NO_UNITS, Units
from damper.parameters.quantities import (
    INITIAL_NAMES,
    PARAMETER_NAMES,
    SI_NAMES,
    SI_QUANTITIES,
)
from damper.parameters.units import AMPLITUDES, name_of, units_of
from damper.study.config import ConfigError
from damper.sweep.cube import CONVENTIONS, write_cube
from damper.sweep.orbits.periodic import followed
from damper.sweep.runs import run_points

#: F0/K = 0.05 m, sqrt(M/K) = 0.1 s, F0/sqrt(K M) = 0.5 m/s, F0^2/K = 0.5 J.
SI: dict[str, float] = SCENE_SI | {"phase": 0.3}
RATIOS = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.1,
    "frequency_ratio": 1.1,
    "clearance": 1.0,
    "restitution": 0.5,
    "phase": 0.3,
}
EVERYTHING: dict[str, Any] = {
    "stroboscopic_section": {"free_mass": True, "at": 0.1},
    "impacts": {"threshold": {"speed": 0.1}, "speeds": 9},
    "bursts": {"threshold": {"speed": 0.1}, "records": 4},
}
RUN: dict[str, Any] = {"transient": 2, "periods": 3, "observers": EVERYTHING}


# --- the conversion, by formulas of the definitions

#: Dimensionless quantity or unit -> its definition; the others are the same in both systems.
FORMULAS = {
    "mass_ratio": "free_mass / primary_mass",
    "damping_ratio": "damping / (2 * sqrt(stiffness * primary_mass))",
    "frequency_ratio": "forcing_frequency / sqrt(stiffness / primary_mass)",
    "clearance": "(gap / 2) * stiffness / force_amplitude",
    "force_amplitude": "mpf(1)",
    "gravity": "gravity * sin(inclination * pi / 180) * primary_mass / force_amplitude",
    "friction": "friction_coefficient * transverse_acceleration * primary_mass / force_amplitude",
    "yield_speed": "yield_speed * sqrt(stiffness * primary_mass) / force_amplitude",
    "support_stiffness_ratio": "support_stiffness / stiffness",
    "support_damping_ratio": "support_damping / (2 * sqrt(stiffness * primary_mass))",
    "contact_stiffness_ratio": "contact_stiffness / stiffness",
    "F0/K": "force_amplitude / stiffness",
    "sqrt(M/K)": "sqrt(primary_mass / stiffness)",
    "F0/sqrt(K M)": "force_amplitude / sqrt(stiffness * primary_mass)",
    "F0^2/K": "force_amplitude**2 / stiffness",
}
UNITS = {"F0/K": "m", "sqrt(M/K)": "s", "F0/sqrt(K M)": "m/s", "F0^2/K": "J"}
#: What these are called under each force.
NAMES = {name_of(unit, amplitude): unit for unit in UNITS for amplitude in AMPLITUDES}


def numbers(p: Parameters | SIParameters) -> dict[str, float]:
    """Its quantities."""
    return {q.name: getattr(p, q.name) for q in p.quantities}


def by_formula(name: str, si: dict[str, Any]) -> Any:
    """A dimensionless quantity or unit of a damper in SI units, in the digits of mpmath."""
    known = {key: mpf(value) for key, value in si.items()} | {"sqrt": mp.sqrt, "mpf": mpf}
    known |= {"sin": mp.sin, "pi": mp.pi}
    return eval(FORMULAS.get(name, name), known)


#: What each model and law adds to the rigid damper.
OPTIONS: dict[str, Callable[[random.Random], dict[str, float]]] = {
    "rigid": lambda chance: {},
    "yielding": lambda chance: {"yield_speed": 10 ** chance.uniform(-3, 0)},
    "differing": lambda chance: {"restitution_left": chance.uniform(0.4, 1.0)},
    "grounded": lambda chance: {
        "support_stiffness_ratio": 10 ** chance.uniform(-3, 0),
        "support_damping_ratio": 10 ** chance.uniform(-4, -1),
    },
    "grounded by a factor": lambda chance: {
        "support_stiffness_ratio": 0.1,
        "support_damping_factor": chance.uniform(0.1, 2.0),
    },
    "compliant": lambda chance: {
        "contact_stiffness_ratio": 10 ** chance.uniform(2, 6),
        "contact_tension": chance.choice([0.0, 1.0]),
    },
    "time_varying": lambda chance: {
        "modulation_depth": chance.uniform(0.1, 0.8),
        "modulation_order": chance.choice([1.0, 2.0]),
        "modulation_phase": chance.uniform(-3, 3),
    },
    "sliding": lambda chance: {
        "friction": 10 ** chance.uniform(-3, 1),
        "gravity": chance.uniform(-2.0, 2.0),
    },
}


def random_damper(kind: str, chance: random.Random) -> SIParameters:
    """A damper of any size, from a watch to a tower."""
    ratios = {
        "mass_ratio": 10 ** chance.uniform(-2, 1),
        "damping_ratio": 10 ** chance.uniform(-3, 0),
        "frequency_ratio": 10 ** chance.uniform(-0.7, 0.5),
        "clearance": chance.choice([0.0, *(10 ** chance.uniform(-2, 0.5) for _ in range(6))]),
        "restitution": chance.choice([chance.uniform(0.01, 0.1), chance.uniform(0.1, 1.0)]),
        "phase": chance.uniform(-7, 7),
    }
    p = Parameters(**ratios | OPTIONS[kind](chance))
    return SIParameters.of(p, *(10 ** chance.uniform(*decades) for decades in DECADES))


#: Of mass and stiffness of the primary, and of the force.
DECADES = ((-6, 6), (-3, 9), (-6, 6))


@pytest.mark.parametrize("kind", OPTIONS)
def test_ratios_and_units_are_those_of_the_formulas(kind: str) -> None:
    chance, acting = random.Random(kind), set()
    for _ in range(40):
        si = random_damper(kind, chance)
        p, units = si.dimensionless, si.units
        found = numbers(p) | {unit: units.size(unit) for unit in UNITS}
        with mp.workdps(30):
            for name, number in found.items():
                known = by_formula(name, numbers(si))
                assert number == known or abs(number - known) <= mpf(1e-15) * abs(known), name
        assert p.cycle * units.time == pytest.approx(si.cycle, rel=1e-15)
        assert si.cycle == pytest.approx(2 * math.pi / si.forcing_frequency, rel=1e-15)
        acting |= p.acting.keys()
    assert acting >= OPTIONS[kind](chance).keys() - {"contact_tension"}


def test_sizes_by_hand() -> None:
    si = SIParameters(**SI)
    assert numbers(si.dimensionless) == pytest.approx(numbers(Parameters(**RATIOS)), rel=1e-15)
    units = si.units
    assert [units.size(unit) for unit in (*UNITS, "1", "rad")] == [0.05, 0.1, 0.5, 0.5, 1.0, 1.0]
    assert Units(1.0, 1.0, 1.0) == NO_UNITS
    assert NO_UNITS.speed == 1.0


# --- the same motion


def observers(units: Units) -> dict[str, Any]:
    """All observers, with what they are given in units: thresholds and a time."""
    speed = {"threshold": {"speed": 0.05 * units.speed}}
    return {
        "stroboscopic_section": {"free_mass": True},
        "impacts": {"speeds": 9, **speed},
        "bursts": {"records": 4, **speed},
        "burst_at": {"time": 4.0 * units.time, **speed},
        "chatter_bursts": speed,
        "response": {"modulation_work": True},
        "lyapunov": {},
        "motion": {},
        "segments": {},
        "trajectory": {"samples_per_period": 9, "events": 9},
    }


def assert_scaled(cube: xr.Dataset, ratios: xr.Dataset, units: Units) -> None:
    """Numbers with units are multiplied by their sizes; counts and codes are the same ones."""
    assert set(cube.data_vars) == set(ratios.data_vars)
    for name, variable in ratios.data_vars.items():
        unit = units_of(variable.attrs)
        unit = NAMES.get(unit, unit)
        assert cube[name].attrs["units"] == UNITS.get(unit, unit)
        assert cube[name].dtype == variable.dtype
        scaled = variable.values * units.size(unit) if unit in UNITS else variable.values
        np.testing.assert_array_equal(cube[name].values, scaled, err_msg=name)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", OPTIONS)
def test_a_run_in_si_is_the_dimensionless_one_in_other_units(kind: str, seed: int) -> None:
    """Every variable of every observer, and every column of the events, to the last bit."""
    chance = random.Random(f"{kind} {seed}")
    si = random_damper(kind, chance)
    p, units = si.dimensionless, si.units
    sizes = dict(zip(INITIAL_NAMES, (units.length, units.speed, 1.0, units.speed), strict=True))
    start = {name: size * chance.uniform(-1, 1) for name, size in sizes.items()}
    # Two sections exclude each other, and theory knows one damper.
    asked = [(observers(units), observers(NO_UNITS)), ({"impact_section": {}},) * 2]
    asked += [({"accumulation": {}},) * 2] if kind == "rigid" else []
    run = {"transient": 1, "periods": 6, "max_events": 500}
    inside = {name: value / sizes[name] for name, value in start.items()}
    for named, scaled in asked:
        cube = simulate(**si.given, **start, **run, observers=named)
        assert_scaled(cube, simulate(**p.given, **inside, **run, observers=scaled), units)
        for name, value in start.items():
            assert float(cube[name]) == value
    place = p.clearance * chance.uniform(-1, 1)
    state = State(0.3, chance.uniform(-1, 1), 0.3 + place, 0.1, chance.uniform(0.0, 3.0))
    until = state.time + 6.0 * p.cycle
    for most in (4, 500):
        found = events(si, state.times(units), until=until * units.time, max_events=most)
        ratios = events(p, state, until=until * units.time / units.time, max_events=most)
        assert found.dtype == ratios.dtype
        of = {"x": units.length, "v": units.speed, "approach_speed": units.speed}
        of |= {"time": units.time, "time_in_period": units.time}
        for name in found.dtype.names:
            np.testing.assert_array_equal(found[name], ratios[name] * of.get(name, 1), name)


@pytest.mark.parametrize("kind", OPTIONS)
def test_an_orbit_in_si_is_the_dimensionless_one_in_other_units(kind: str) -> None:
    """Its sensitivities too: by the chain rule, with derivatives of the formulas."""
    more = OPTIONS[kind](random.Random(3))
    p = Parameters(0.1, 0.1, 1.0, 5.0, 0.5, 0.4, **more)
    si = SIParameters.of(p, 2e3, 3e-2, 4e2)
    p, units = si.dimensionless, si.units
    period = int(p.modulation_order)
    ratios = plain(damper.periodic_orbit)(p, period)
    orbit = plain(damper.periodic_orbit)(si, period, ratios.state.times(units))
    sizes = np.array([units.length, units.speed] * 2)
    assert (orbit.word, orbit.parameters) == (ratios.word, si)
    np.testing.assert_allclose(orbit.start, ratios.start * sizes, rtol=1e-9)
    np.testing.assert_allclose(orbit.multipliers, ratios.multipliers, rtol=1e-6)
    np.testing.assert_allclose(
        orbit.derivative, ratios.derivative * sizes[:, None] / sizes, rtol=1e-6
    )
    assert orbit.slowest_impact == pytest.approx(ratios.slowest_impact * units.speed, rel=1e-9)
    own = {
        name: orbit.scaled.sensitivity(name) for name in p.acting if name in followed(Parameters)
    }
    for name in set(si.given) & set(followed(SIParameters)):

        def rate(what: str, name: str = name) -> float:
            def at(value: Any) -> Any:
                return by_formula(what, numbers(si) | {name: value})

            with mp.workdps(30):
                return float(mp.diff(at, getattr(si, name)))

        known = sum(sensitivity * rate(of) for of, sensitivity in own.items()) * sizes
        grows = np.array([rate("F0/K"), rate("F0/sqrt(K M)")] * 2)
        known += ratios.start * grows
        found = orbit.sensitivity(name)
        np.testing.assert_allclose(found, known, rtol=1e-6, atol=1e-8 * abs(known).max())


def test_a_free_mass_between_walls_that_stand_still() -> None:
    """It flies half the gap at .5 m/s, then the whole gap, each time at half the speed before."""
    si = SIParameters(**SI | {"free_mass": 2e-6, "force_amplitude": 1e-6})
    found = events(si, State(0.0, 0.0, 0.0, 0.5), until=2.0)
    assert found["time"] == pytest.approx([0.1, 0.1 + 0.1 / 0.25, 0.5 + 0.1 / 0.125], rel=1e-5)
    assert found["approach_speed"] == pytest.approx([0.5, 0.25, 0.125], rel=1e-4)
    assert found["side"].tolist() == [1, -1, 1]


# --- forces

#: Force, its force_amplitude, and the unit of length that follows, of the primary of `SI`.
FORCES: dict[str, tuple[Any, float, float]] = {
    "harmonics": (damper.Harmonics((1, 2), (1.0, 0.5), (0.0, 0.2)), 10.0, 10.0 / 200.0),
    "base": (damper.Base(), 0.03, 0.03),
    "base, in its frame": (damper.Base("base"), 0.03, 0.03),
    "unbalance": (damper.Unbalance(), 0.08, 0.08 / 2.0),
    "record": (damper.Record([0.0, 0.2, 0.5], [0.0, 8.0, -8.0]), 1.0, 1.0 / 200.0),
    "record of the base": (
        damper.Record([0.0, 0.2, 0.5], [0.0, 1.0, -0.5], of="base_acceleration", after="hold"),
        9.81,
        9.81 * 2.0 / 200.0,
    ),
    "noise": (damper.Noise(1, 0.02, 20.0, (2.0, 20.0)), 10.0, 10.0 / 200.0),
}


@pytest.mark.parametrize(
    ("force", "names"),
    [
        ("harmonic", ["F0/K", "F0/sqrt(K M)", "F0^2/K"]),
        ("none", ["L", "L sqrt(K/M)", "K L^2"]),
        ("base", ["B", "B sqrt(K/M)", "K B^2"]),
        ("unbalance", ["U/M", "(U/M) sqrt(K/M)", "K (U/M)^2"]),
        (FORCES["record of the base"][0], ["A M/K", "(A M/K) sqrt(K/M)", "K (A M/K)^2"]),
    ],
)
def test_dimensionless_results_name_the_units_of_their_force(force: Any, names: list[str]) -> None:
    point = {"mass_ratio": 0.1, "damping_ratio": 0.1, "frequency_ratio": 1.0, "restitution": 0.5}
    asked = ["stroboscopic_section", "response"]
    run = {"transient": 0, "periods": 1, "observers": asked, "initial_displacement": 0.1}
    cube = simulate(**point, clearance=[0.5, 1.0], forcing=force, **run)
    found = cube.displacement, cube.velocity, cube.dashpot_loss
    assert [array.attrs["scaled_by"] for array in found] == names
    assert cube.clearance.attrs["scaled_by"] == cube.initial_displacement.attrs["scaled_by"]
    if force == "harmonic":
        free = simulate(**point, clearance=1.0, force_amplitude=0.0, **run)
        assert free.displacement.attrs["scaled_by"] == "L"
    figure = drawn("curves", cube, variables=["peak_displacement"], along="clearance")
    length = {"F0/K": "($F_0/K$)", "A M/K": r"($A\,M/K$)", "U/M": "($U/M$)"}
    shown = length.get(names[0], f"${names[0]}$")
    assert (
        figure.axes[0].get_xlabel().replace("\n", " ").replace("\xa0", " ").endswith(f"/ {shown}")
    )


def under(name: str, **changed: Any) -> SIParameters:
    force, amplitude, _ = FORCES[name]
    own = {"forcing": force, "force_amplitude": amplitude}
    return SIParameters(**{n: v for n, v in SI.items() if n != "phase"} | own | changed)


@pytest.mark.parametrize("name", FORCES)
def test_a_force_in_si_is_the_dimensionless_one_in_other_units(name: str) -> None:
    si, length = under(name), FORCES[name][2]
    p, units = si.dimensionless, si.units
    # sqrt(M/K) = 0.1 s
    assert (units.length, units.time) == pytest.approx((length, 0.1), rel=1e-15)
    assert p.clearance == pytest.approx(0.05 / length, rel=1e-15)
    assert p.force_amplitude == 1.0
    found, ratios = events(si, until=4.0), events(p, until=4.0 / units.time)
    assert len(found) > 5
    for column, size in (("time", units.time), ("x", units.length), ("v", units.speed)):
        np.testing.assert_array_equal(found[column], ratios[column] * size)
    cube = simulate(**si.given, transient=1, periods=2)
    scaled = simulate(**p.given, transient=1, periods=2)
    assert_scaled(cube, scaled, units)
    assert cube.force_amplitude.attrs["units"] == si.forcing.si_unit
    # The same damper, however its dimensionless twin was scaled.
    twice = dataclasses.replace(p, force_amplitude=2.0) if name != "noise" else p
    again = SIParameters.of(twice, 2.0, 200.0, si.force_amplitude)
    assert again.force_amplitude == twice.force_amplitude * si.force_amplitude
    assert again.gap == pytest.approx(0.1, rel=1e-14)
    if isinstance(si.forcing, damper.Record):
        np.testing.assert_allclose(again.forcing.time, si.forcing.time, rtol=1e-15)
        assert again.forcing.value.tolist() == si.forcing.value.tolist()


def test_noise_in_seconds_has_the_numbers_of_noise_in_other_units() -> None:
    si = under("noise")
    noise = si.dimensionless.forcing
    assert noise.band == pytest.approx((0.2, 2.0), rel=1e-15)
    np.testing.assert_array_equal(noise.record.value, si.forcing.record.value)
    np.testing.assert_allclose(noise.record.time * 0.1, si.forcing.record.time, rtol=1e-14)


def test_forces_in_si_that_are_the_same_one() -> None:
    """By their formulas: a base that moves, and an unbalance, as forces in N."""
    C, K, omega = SI["damping"], SI["stiffness"], SI["forcing_frequency"]
    harmonic = {"forcing": "harmonic", "phase": 0.0}
    pairs = [
        (
            under("base"),
            {"force_amplitude": 0.03 * math.hypot(K, C * omega), "phase": math.atan(C * omega / K)},
        ),
        (under("unbalance"), {"force_amplitude": 0.08 * omega**2}),
    ]
    for si, force in pairs:
        other = dataclasses.replace(si, **harmonic | force)
        found, known = events(si, until=4.0), events(other, until=4.0)
        assert len(found) == len(known) > 5
        for column in ("time", "approach_speed", "x", "v"):
            np.testing.assert_allclose(found[column], known[column], rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("force", [damper.Unbalance(), damper.Base(), damper.Base("base")], ids=str)
def test_what_an_orbit_owes_to_quantities_in_si_under_other_forces(force: Any) -> None:
    """Against differences: the unit of length depends on other quantities under each force."""
    p = Parameters(0.1, 0.1, 1.0, 5.0, 0.5, forcing=force)
    orbit = plain(damper.periodic_orbit)(SIParameters.of(p, 2.0, 200.0, 0.1))
    for name in ("primary_mass", "stiffness", "force_amplitude", "gap", "forcing_frequency"):
        own = getattr(orbit.parameters, name)
        beside = [
            plain(damper.periodic_orbit)(
                dataclasses.replace(orbit.parameters, **{name: own * (1.0 + part)}),
                state=orbit.state,
            ).start
            for part in (-1e-4, 1e-4)
        ]
        found = orbit.sensitivity(name)
        difference = (beside[1] - beside[0]) / (2e-4 * own)
        np.testing.assert_allclose(found, difference, rtol=0, atol=1e-5 * abs(found).max())


def test_a_base_that_is_accelerated_in_si() -> None:
    """a = 0.4 m/s2 for ever, from rest: y = -a t^2 / 2, and x rings down to -a M / K."""
    step = damper.Record([0.0, 1.0], [1.0, 1.0], of="base_acceleration", after="hold")
    si = under("record of the base", forcing=step, force_amplitude=0.4, gap=0.4)
    (first, *_) = events(si, until=1.5)
    t, (zeta, rate) = first["time"], (0.1, 10.0)
    turning = rate * math.sqrt(1.0 - zeta**2)
    rings = math.cos(turning * t) + zeta * rate / turning * math.sin(turning * t)
    x = -0.4 * 2.0 / 200.0 * (1.0 - math.exp(-zeta * rate * t) * rings)
    assert first["side"] == -1
    assert first["x"] == pytest.approx(x, rel=1e-12)
    assert -0.2 * t**2 - x == pytest.approx(-0.2, rel=1e-12)


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
            start = {name: float(cube[name][number]) for name in drawn if name in INITIAL_NAMES}
            alone = simulate(**SI | where | start, **RUN)
            for name, variable in alone.data_vars.items():
                found = cube[name].sel(where).isel(draw=number)
                np.testing.assert_array_equal(found, variable, err_msg=name)


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


# --- refusals


def test_free_motion_has_its_lengths_in_half_of_the_gap() -> None:
    free = SIParameters(**SI | {"force_amplitude": 0})
    p, units = free.dimensionless, free.units
    assert (p.force_amplitude, p.clearance, units.length) == (0.0, 1.0, 0.05)
    start = State(1.5, 0.0, 1.5, 0.3)
    found = events(free, start.times(units), until=20.0 * units.time)
    ratios = events(p, start, until=20.0)
    assert len(found) > 3
    np.testing.assert_array_equal(found["time"], ratios["time"] * units.time)
    # F0/K grows as the force does, and half of the gap does not.
    assert free.rates("force_amplitude") == {"force_amplitude": 1.0 / (200.0 * 0.05)}
    assert free.rates("gap") == {"F0/K": 0.5, "F0/sqrt(K M)": 5.0}
    with pytest.raises(ValueError, match=r"^gap = 0.0 with force_amplitude = 0.0: free motion"):
        simulate(**SI | {"force_amplitude": [1.0, 0.0], "gap": 0.0})


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
            "force_amplitude: -1",
            ["force_amplitude\n    out of range (value: -1)", "number, force_amplitude >= 0"],
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
    with pytest.raises(ValueError, match=r"stiffness \(SI units\) and mass_ratio.* are mixed"):
        simulate(**RATIOS, stiffness=200.0)
    with pytest.raises(ValueError, match=r"gap = -0\.1: .*gap >= 0"):
        simulate(**SI | {"gap": [0.1, -0.1]})
    with pytest.raises(ValueError, match="mixed"):
        run_points([SI, {**SI, "clearance": 1.0}], [], transient=1, periods=1, progress=done.append)
    assert done == []
