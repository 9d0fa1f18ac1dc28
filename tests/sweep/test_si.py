"""SI units: the same damper in kg, m, s, N, J, against formulas and integrations of its own."""

import dataclasses
import itertools
import math
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from cases import thinned
from figures.drawing import drawn
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf
from scenes import FORCES, MODELS, scene_of
from scenes import SI as SCENE_SI
from studies import blame, load

import damper
from damper import Parameters, SIParameters, State, events, simulate
from damper.observers import OBSERVERS, observer_class
from damper.parameters import NO_UNITS, Units
from damper.parameters.quantities import INITIAL_NAMES
from damper.parameters.units import AMPLITUDES, name_of, units_of
from damper.sweep.orbits.periodic import followed

#: F0/K = 0.05 m, sqrt(M/K) = 0.1 s, F0/sqrt(K M) = 0.5 m/s, F0^2/K = 0.5 J.
SI: dict[str, float] = SCENE_SI | {"phase": 0.3}
EVERYTHING: dict[str, Any] = {
    "stroboscopic_section": {"free_mass": True, "when": 0.1},
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
    "clearance": "gap / 2 / length",
    "force_amplitude": "mpf(1)",
    "gravity": "gravity * sin(inclination * pi / 180) * primary_mass / stiffness / length",
    "friction": (
        "friction_coefficient * transverse_acceleration * primary_mass / stiffness / length"
    ),
    "yield_speed": "yield_speed * sqrt(primary_mass / stiffness) / length",
    "support_stiffness_ratio": "support_stiffness / stiffness",
    "support_damping_ratio": "support_damping / (2 * sqrt(stiffness * primary_mass))",
    "contact_stiffness_ratio": "contact_stiffness / stiffness",
    "F0/K": "length",
    "sqrt(M/K)": "sqrt(primary_mass / stiffness)",
    "F0/sqrt(K M)": "length * sqrt(stiffness / primary_mass)",
    "F0^2/K": "stiffness * length**2",
}
#: What a force's amplitude is called -> the unit of length.
LENGTHS = {
    "F0": "force_amplitude / stiffness",
    "B": "force_amplitude",
    "U": "force_amplitude / primary_mass",
    "A": "force_amplitude * primary_mass / stiffness",
}
UNITS = {"F0/K": "m", "sqrt(M/K)": "s", "F0/sqrt(K M)": "m/s", "F0^2/K": "J"}
#: What these are called under each force.
NAMES = {name_of(unit, amplitude): unit for unit in UNITS for amplitude in AMPLITUDES}


def numbers(p: Parameters | SIParameters) -> dict[str, float]:
    """Its quantities."""
    return {q.name: getattr(p, q.name) for q in p.quantities}


def by_formula(name: str, si: SIParameters, **changed: Any) -> Any:
    """A dimensionless quantity or unit of a damper in SI units, in the digits of mpmath."""
    known = {key: mpf(value) for key, value in numbers(si).items()} | changed
    known |= {"sqrt": mp.sqrt, "mpf": mpf, "sin": mp.sin, "pi": mp.pi}
    known["length"] = eval(LENGTHS[si.forcing.amplitude], known)
    return eval(FORMULAS.get(name, name), known)


#: Models and laws under each force; free motion has its lengths in half of the gap.
SCENES = [(model, force) for model, force in itertools.product(MODELS, FORCES) if force != "none"]
#: Of mass and stiffness of the primary, and of the force.
DECADES = ((-6, 6), (-3, 9), (-6, 6))


def random_damper(model: str, force: str, seed: int) -> SIParameters:
    """A damper of any size, from a watch to a tower, in a box that is inclined."""
    chance = random.Random(f"{model}, {force}, {seed}")
    values, _ = scene_of(model, force, seed)
    p = Parameters(**values, gravity=chance.uniform(-2.0, 2.0))
    si = SIParameters.of(p, *(10 ** chance.uniform(*decades) for decades in DECADES))
    return dataclasses.replace(si, inclination=chance.uniform(1.0, 90.0))


@pytest.mark.parametrize(("model", "force"), SCENES)
def test_ratios_and_units_are_those_of_the_formulas(model: str, force: str) -> None:
    for seed in range(5):
        si = random_damper(model, force, seed)
        p, units = si.dimensionless, si.units
        found = numbers(p) | {unit: units.size(unit) for unit in UNITS}
        with mp.workdps(30):
            for name, number in found.items():
                known = by_formula(name, si)
                assert number == known or abs(number - known) <= mpf(2e-15) * abs(known), name
        assert p.cycle * units.time == pytest.approx(si.cycle, rel=1e-15)
        assert si.cycle == pytest.approx(2 * math.pi / si.forcing_frequency, rel=1e-15)


# --- the same motion


def observers(units: Units, model: str = "rigid", coefficient: float = 1.0) -> dict[str, Any]:
    """All that know a model, with what they are given in units: thresholds, a time, a mass."""
    speed = {"threshold": {"speed": 0.05 * units.speed}}
    given: dict[str, Any] = dict.fromkeys(OBSERVERS) | {
        "stroboscopic_section": {"free_mass": True},
        "impacts": {"speeds": 9, **speed},
        "bursts": {"records": 4, **speed},
        "burst_at": {"time": 4.0 * units.time, **speed},
        "chatter_bursts": speed,
        "harvest": {"coefficient": coefficient},
        "response": {"modulation_work": True},
        "statistics": {"above": 0.05 * units.speed},
        "trajectory": {"samples_per_period": 9, "events": 9},
    }
    # Two sections exclude each other; theory knows no weight.
    others = ("impact_section", "accumulation")
    return {
        name: settings
        for name, settings in given.items()
        if model in observer_class(name).models and name not in others
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


@pytest.mark.parametrize(
    ("model", "force"), thinned(SCENES, lambda pair: SCENES.index(pair) % 7 == 0)
)
def test_a_run_in_si_is_the_dimensionless_one_in_other_units(model: str, force: str) -> None:
    """Every variable of every observer, and every column of the events, to the last bit."""
    chance, si = random.Random(f"{model}, {force}"), random_damper(model, force, 0)
    p, units = si.dimensionless, si.units
    *of_one, _ = INITIAL_NAMES  # the last one spaces several masses
    sizes = dict(zip(of_one, (units.length, units.speed, 1.0, units.speed), strict=True))
    start = {name: size * chance.uniform(-1, 1) for name, size in sizes.items()}
    harvest = units.speed**2 / units.energy
    asked = [(observers(units, p.main_feature), observers(NO_UNITS, p.main_feature, harvest))]
    asked += [({"impact_section": {}},) * 2]
    run = {"transient": 1, "periods": 2, "max_events": 200}
    inside = {name: value / sizes[name] for name, value in start.items()}
    for named, scaled in asked:
        cube = simulate(**si.given, **start, **run, observers=named)
        assert_scaled(cube, simulate(**p.given, **inside, **run, observers=scaled), units)
        for name, value in start.items():
            assert float(cube[name]) == value
    assert cube.force_amplitude.attrs["units"] == si.forcing.si_unit
    place = p.clearance * chance.uniform(-1, 1)
    state = State(0.3, chance.uniform(-1, 1), 0.3 + place, 0.1, chance.uniform(0.0, 3.0))
    until = state.time + 6.0 * p.cycle
    for most in (4, 200):
        found = events(si, state.times(units), until=until * units.time, max_events=most)
        ratios = events(p, state, until=until * units.time / units.time, max_events=most)
        assert found.dtype == ratios.dtype
        of = {"x": units.length, "v": units.speed, "approach_speed": units.speed}
        of |= {"time": units.time, "time_in_cycle": units.time}
        for name in found.dtype.names:
            np.testing.assert_array_equal(found[name], ratios[name] * of.get(name, 1), name)


@pytest.mark.parametrize(
    ("model", "force"),
    [
        *((model, "harmonic") for model in MODELS),
        *(("rigid", force) for force in FORCES if "base in" in force or force == "unbalance"),
    ],
)
def test_an_orbit_in_si_is_the_dimensionless_one_in_other_units(model: str, force: str) -> None:
    """Its sensitivities too: by the chain rule, with derivatives of the formulas."""
    driven = {"phase": 0.4, "gravity": 0.02, "forcing": FORCES[force](random.Random())}
    p = Parameters(0.1, 0.1, 1.0, 5.0, 0.5, **MODELS[model] | driven)
    si = SIParameters.of(p, 2e3, 3e-2, 4e2)
    si = dataclasses.replace(si, gravity=2.0 * si.gravity, inclination=30.0)
    p, units = si.dimensionless, si.units
    period = int(p.modulation_order)
    ratios = damper.periodic_orbit(p, period)
    orbit = damper.periodic_orbit(si, period, ratios.state.times(units))
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
                return by_formula(what, si, **{name: value})

            with mp.workdps(30):
                return float(mp.diff(at, getattr(si, name)))

        known = sum(sensitivity * rate(of) for of, sensitivity in own.items()) * sizes
        grows = np.array([rate("F0/K"), rate("F0/sqrt(K M)")] * 2)
        known += ratios.start * grows
        found = orbit.sensitivity(name)
        np.testing.assert_allclose(found, known, rtol=1e-6, atol=1e-8 * abs(known).max())


# --- forces

BASE_RECORD = damper.Record([0.0, 2.0, 5.0], [0.0, 1.0, -0.5], of="base_acceleration")


@pytest.mark.parametrize(
    ("force", "names"),
    [
        ("harmonic", ["F0/K", "F0/sqrt(K M)", "F0^2/K"]),
        ("none", ["L", "L sqrt(K/M)", "K L^2"]),
        ("base", ["B", "B sqrt(K/M)", "K B^2"]),
        ("unbalance", ["U/M", "(U/M) sqrt(K/M)", "K (U/M)^2"]),
        (BASE_RECORD, ["A M/K", "(A M/K) sqrt(K/M)", "K (A M/K)^2"]),
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


# --- cubes


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
    run = {"transient": 0, "periods": 8, "initial_position": 0.5}
    cube = simulate(free, initial_displacement=0.1, **run, observers=observers(units))
    harvest = units.speed**2 / units.energy
    asked = observers(NO_UNITS, coefficient=harvest)
    scaled = simulate(p, initial_displacement=2.0, **run, observers=asked)
    assert cube.half_cycles > 3
    assert_scaled(cube, scaled, units)
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


#: What is in its place, and what is said.
MISTAKES = {
    "  damping: 4\n": ("", "'damping' is not given", "damping >= 0 in N s/m, under"),
    "primary_mass: 2": ("M: 2", "unknown parameter 'M'", "mean 'primary_mass'?"),
    "stiffness: {": ("K: {", "unknown axis 'K'", "did you mean 'stiffness'?"),
    "amplitude: 10": ("amplitude: -1", "out of range (value: -1)", "number, force_amplitude >= 0"),
    "[100, 200]": ("[100, 0]", "stiffness.values[1]", "number in N/m, stiffness > 0"),
    "damping: 4": ("damping_ratio: 0.1", "(SI units) and damping_ratio (dimensionless) are mixed"),
}


@pytest.mark.parametrize("old", MISTAKES, ids=str.strip)
def test_mistake_in_a_study_in_si(tmp_path: Path, old: str) -> None:
    new, *parts = MISTAKES[old]
    message = blame(tmp_path, STUDY.replace(old, new))
    assert message.startswith("1 error ")
    assert [part for part in parts if part not in message] == []
