"""What a run may be given, and what each mistake is told as."""

import dataclasses
import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from damper.parameters import Parameters, State
from damper.parameters.quantities import PARAMETER_NAMES, QUANTITIES, check_quantity

GOOD = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.8,
    "clearance": 1.0,
    "restitution": 0.6,
    "phase": 0.25,
}
RANGES = {
    "mass_ratio": "mass_ratio > 0",
    "damping_ratio": "damping_ratio >= 0",
    "frequency_ratio": "frequency_ratio > 0",
    "clearance": "clearance >= 0",
    "restitution": "0 <= restitution <= 1",
    "phase": "any phase in rad",
}
#: What chooses another model than the rigid one: name -> range, default.
OPTIONS = {
    "support_stiffness_ratio": ("support_stiffness_ratio >= 0", 0.0),
    "support_damping_ratio": (
        "support_damping_ratio >= 0 (C2 / (2 sqrt(K M)), with K and M of the primary)",
        0.0,
    ),
    "support_damping_factor": ("support_damping_factor >= 0", 0.0),
    "contact_stiffness_ratio": (
        "contact_stiffness_ratio > 0 (leave it out for a rigid wall)",
        math.inf,
    ),
    "contact_tension": (
        "0 <= contact_tension <= 1, whole (0: it lets go when its force vanishes, "
        "1: it holds until the gap reopens)",
        0.0,
    ),
    "modulation_depth": ("0 <= modulation_depth < 1", 0.0),
    "modulation_order": ("modulation_order >= 1, whole", 1.0),
    "modulation_phase": ("any modulation_phase in rad", 0.0),
}
DEFAULTS = {name: default for name, (_, default) in OPTIONS.items()}
RANGES |= {name: words for name, (words, _) in OPTIONS.items()}
TINY = 5e-324
OUT_OF_RANGE = [
    *((name, value) for name in GOOD for value in (math.nan, math.inf, -math.inf)),
    ("mass_ratio", 0.0),
    ("mass_ratio", -0.1),
    ("damping_ratio", -TINY),
    ("frequency_ratio", 0.0),
    ("frequency_ratio", -2),
    ("clearance", -1e-300),
    ("restitution", -TINY),
    ("restitution", math.nextafter(1.0, 2.0)),
    ("support_stiffness_ratio", -TINY),
    ("support_damping_factor", math.inf),
    ("contact_stiffness_ratio", 0.0),
    ("contact_stiffness_ratio", math.nan),
    ("contact_tension", 0.5),
    ("contact_tension", 2),
    ("modulation_depth", 1.0),
    ("modulation_order", 1.5),
    ("modulation_order", 0),
]


@pytest.mark.parametrize(("name", "value"), OUT_OF_RANGE)
def test_out_of_range_names_field_value_and_range(name: str, value: float) -> None:
    message = f"{name} = {value!r}: must be a finite number with {RANGES[name]}"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        Parameters(**{**GOOD, name: value})


@pytest.mark.parametrize("name", GOOD)
@pytest.mark.parametrize("value", [True, "0.5", b"0.5", None, 1j, [0.5], 10**400])
def test_not_a_number_names_field_and_value(name: str, value: object) -> None:
    message = f"{name} = {value!r}: must be a real number"
    with pytest.raises(TypeError, match=f"^{re.escape(message)}$"):
        Parameters(**{**GOOD, name: value})


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("mass_ratio", TINY),
        ("damping_ratio", 0),
        ("frequency_ratio", 1e-300),
        ("clearance", 0),
        ("restitution", 0),
        ("restitution", 1),
        ("phase", -1e9),
    ],
)
def test_ends_of_the_ranges_are_allowed(name: str, value: float) -> None:
    assert getattr(Parameters(**{**GOOD, name: value}), name) == value


@given(
    mass_ratio=st.floats(0, exclude_min=True, allow_infinity=False),
    damping_ratio=st.floats(0, allow_infinity=False),
    frequency_ratio=st.floats(0, exclude_min=True, allow_infinity=False),
    clearance=st.floats(0, allow_infinity=False),
    restitution=st.floats(0, 1),
    phase=st.floats(allow_nan=False, allow_infinity=False),
)
def test_every_allowed_value_is_kept(**values: float) -> None:
    assert dataclasses.asdict(Parameters(**values)) == values | DEFAULTS


def test_numbers_of_other_types_become_floats() -> None:
    p = Parameters(np.float32(0.5), 0, np.int64(2), np.float64(1.5), np.array(1.0))
    values = dataclasses.astuple(p)
    assert values == (0.5, 0.0, 2.0, 1.5, 1.0, 0.0, *DEFAULTS.values())
    assert {type(value) for value in values} == {float}


def test_parameters_are_frozen_and_hashable() -> None:
    p = Parameters(**GOOD)
    with pytest.raises(dataclasses.FrozenInstanceError):
        p.restitution = 2.0
    assert {p: 1}[Parameters(**GOOD)] == 1


def test_period() -> None:
    assert Parameters(**GOOD).period == pytest.approx(2 * math.pi / 0.8, rel=1e-15)


def test_quantities_describe_the_parameters() -> None:
    fields = dataclasses.fields(Parameters)
    assert tuple(field.name for field in fields) == PARAMETER_NAMES
    assert (*GOOD, *OPTIONS) == PARAMETER_NAMES
    for quantity, field in zip(QUANTITIES, fields, strict=True):
        assert quantity.allowed == RANGES[quantity.name]
        has_default = field.default is not dataclasses.MISSING
        assert quantity.default == (field.default if has_default else None)


@pytest.mark.parametrize(
    ("options", "model"),
    [
        ({}, "rigid"),
        (DEFAULTS, "rigid"),
        ({"modulation_order": 3, "modulation_phase": 1.0}, "rigid"),
        ({"support_stiffness_ratio": 0.1}, "grounded"),
        ({"support_damping_factor": 2.0}, "grounded"),
        ({"contact_stiffness_ratio": 1e4, "contact_tension": 1}, "compliant"),
        ({"modulation_depth": 0.1}, "time_varying"),
    ],
)
def test_values_choose_the_model(options: dict[str, float], model: str) -> None:
    assert Parameters(**GOOD, **options).model == model


def test_damping_of_the_support_is_given_in_two_ways() -> None:
    p = Parameters(**GOOD, support_damping_factor=3.0)
    assert p.support_damping == 3.0 * 0.05
    assert p.support_damping == Parameters(**GOOD, support_damping_ratio=3.0 * 0.05).support_damping
    # A multiple of nothing is nothing: model.md calls it inert.
    undamped = Parameters(**{**GOOD, "damping_ratio": 0.0}, support_damping_factor=3.0)
    assert undamped.model == "rigid"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            {"support_stiffness_ratio": 0.1, "modulation_depth": 0.1},
            "support_stiffness_ratio (grounded) and modulation_depth (time_varying) ask for",
        ),
        (
            {"support_damping_ratio": 0.1, "contact_stiffness_ratio": 9.0},
            "support_damping_ratio (grounded) and contact_stiffness_ratio (compliant) ask for",
        ),
        (
            {"support_damping_ratio": 0.1, "support_damping_factor": 1.0},
            "support_damping_factor and support_damping_ratio both give",
        ),
        ({"contact_tension": 1}, "contact_tension = 1: a rigid wall cannot pull"),
        (
            {"contact_stiffness_ratio": 9.0, "restitution": 0.0},
            "restitution = 0: a contact that cannot pull always rebounds; must be > 0",
        ),
    ],
)
def test_one_model_at_a_time(options: dict[str, float], words: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(words)}"):
        Parameters(**{**GOOD, **options})


def test_check_quantity_refuses_an_unknown_name() -> None:
    with pytest.raises(KeyError):
        check_quantity("sharpness", 1.0)


@pytest.mark.parametrize("name", ["x", "v", "y", "u", "time"])
def test_state_errors(name: str) -> None:
    values = {"x": 0.1, "v": 0.2, "y": 0.3, "u": 0.4, "time": 0.5}
    assert dataclasses.asdict(State(**values)) == values
    for value in (math.nan, math.inf):
        message = f"^{name} = {value!r}: must be a finite number$"
        with pytest.raises(ValueError, match=message):
            State(**{**values, name: value})
    with pytest.raises(TypeError, match=f"^{name} = '0': must be a real number$"):
        State(**{**values, name: "0"})


def test_state_time_defaults_to_zero() -> None:
    assert State(0, 0, 0, 0).time == 0.0
