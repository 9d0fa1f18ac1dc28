"""What a run may be given, and the message for each mistake."""

import dataclasses
import math
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from new_process import modules_after
from scenes import GENERIC, SI

from damper.parameters import Parameters, SIParameters, State
from damper.parameters.named import damper_of
from damper.parameters.quantities import ALL, PARAMETER_NAMES
from damper.parameters.tables import WALL_TABLES

MISTAKES = yaml.safe_load((Path(__file__).parent / "mistakes.yaml").read_text())
GOOD = GENERIC | {"phase": 0.25}
RANGES = MISTAKES["ranges"]


def refused(kind: type, values: dict[str, float]) -> str:
    with pytest.raises(ValueError) as caught:  # noqa: PT011
        kind(**values)
    return str(caught.value)


@pytest.mark.parametrize("name", RANGES)
def test_range_and_its_ends(name: str) -> None:
    outside, words, ends = RANGES[name]
    for value in (math.nan, *outside):
        message = f"{name} = {value!r}: must be a finite number with {words}"
        assert refused(Parameters, {**GOOD, name: value}) == message
    (needs,) = (q.needs for q in Parameters.quantities if q.name == name)
    beside = {needs: 0.0 if needs != "yield_speed" else 1.0} if needs else {}
    for value in ends:
        assert getattr(Parameters(**{**GOOD, **beside, name: value}), name) == value


@pytest.mark.parametrize("value", [True, "0.5", None, 1j, 10**400])
def test_not_a_number_names_field_and_value(value: object) -> None:
    name = "mass_ratio"
    message = f"{name} = {value!r}: must be a real number"
    with pytest.raises(TypeError, match=f"^{re.escape(message)}$"):
        Parameters(**{**GOOD, name: value})


@pytest.mark.parametrize("kind", [Parameters, SIParameters])
def test_fields_are_the_declarations(kind: type) -> None:
    """Names, defaults and docstring; what both systems share has one default."""
    fields = [
        field
        for field in dataclasses.fields(kind)
        if field.name not in ("forcing", "masses", "structure", *WALL_TABLES)
    ]
    assert [field.name for field in fields] == [quantity.name for quantity in kind.quantities]
    for quantity, field in zip(kind.quantities, fields, strict=True):
        required = field.default is dataclasses.MISSING or quantity.unless
        assert quantity.default == (None if required else field.default)
        assert f"\n{quantity.name} : float" in kind.__doc__
        # Lengths are scaled by the force, so that in SI units it has to be given.
        assert quantity.default == ALL[quantity.name].default or quantity.name == "force_amplitude"
    units = {quantity.name: quantity.units for quantity in SIParameters.quantities}
    assert units["yield_speed"] == "m/s"


@pytest.mark.parametrize(
    ("options", "model"),
    [
        ({}, "rigid"),
        ({name: ALL[name].default for name in PARAMETER_NAMES[6:]}, "rigid"),
        (
            {"modulation_depth": 0, "modulation_order": 3, "modulation_phase": 1, "yield_speed": 1},
            "rigid",
        ),
        ({"support_stiffness_ratio": 0.1, "yield_speed": 1.0}, "grounded"),
        ({"contact_stiffness_ratio": 1e4, "contact_tension": 1}, "compliant"),
        ({"modulation_depth": 0.1, "yield_speed": 1.0}, "time_varying"),
    ],
    ids=str,
)
def test_values_choose_the_model(options: dict[str, float], model: str) -> None:
    p = Parameters(**GOOD, **options)
    assert p.main_feature == model
    assert p.model == (model if model in ("compliant", "time_varying") else "rigid walls")


def test_each_has_every_mass_and_masses_the_list_as_given() -> None:
    """Without a list there is one mass; a list of one mass stays a list."""
    alone = Parameters(**GOOD, friction=0.1)
    assert (alone.masses, alone.each, alone.features) == (None, (alone,), ("sliding",))
    listed = Parameters(**GOOD, friction=0.1, masses=[{}])
    assert (listed.masses, listed.each) == (((),), (alone,))
    assert listed.features == ("several", "sliding")


def test_what_each_mass_has_need_not_be_given_of_all() -> None:
    """In the arguments of a damper as in those of a run."""
    each = [{"mass_ratio": 0.05, "clearance": 0.1}, {"mass_ratio": 0.03, "clearance": 0.2}]
    own = {name: value for name, value in GOOD.items() if name not in each[0]}
    made = Parameters(**own, masses=each)
    assert (
        made.each == Parameters(**GOOD, masses=each).each == damper_of(own | {"masses": each}).each
    )
    for kind in (Parameters, SIParameters):
        for masses, of in ((None, ""), ([*each, {}], ", of all masses or of each")):
            with pytest.raises(TypeError, match=f"^missing parameters{of}: .*(clearance|gap)"):
                kind(restitution=0.5, masses=masses)


@pytest.mark.parametrize(("options", "words"), MISTAKES["options"])
def test_options_that_contradict_each_other(options: dict[str, float], words: str) -> None:
    assert refused(Parameters, {**GOOD, **options}).startswith(words)


@pytest.mark.parametrize(("change", "words"), MISTAKES["si"])
def test_si_values_that_leave_a_range(change: dict[str, float], words: str) -> None:
    assert refused(SIParameters, {**SI, **change}).startswith(words)


def test_state_errors() -> None:
    name = "y"
    values = {"x": 0.1, "v": 0.2, "y": 0.3, "u": 0.4, "time": 0.5}
    assert dataclasses.asdict(State(**values)) == values
    for value in (math.nan, math.inf):
        message = f"^{name} = {value!r}: must be a finite number$"
        with pytest.raises(ValueError, match=message):
            State(**{**values, name: value})
    with pytest.raises(TypeError, match=f"^{name} = '0': must be a real number$"):
        State(**{**values, name: "0"})
    for unordered in ({0.1: 0}, {0.1}, b"0"):
        with pytest.raises(TypeError, match=f"^{name} = .*: must be a real number$"):
            State(**{**values, name: unordered})


def test_parameters_load_no_numerics() -> None:
    loaded = modules_after("import damper.parameters.quantities")
    assert not loaded & {"numpy", "numba", "pydantic", "damper.engine"}


def test_a_state_taken_to_si_units_comes_back_to_the_last_bit() -> None:
    """A chaotic motion would not be the same one after a rounding."""
    units = SIParameters(**SI).units
    for state in (State(*values) for values in np.random.default_rng(1).normal(size=(200, 5))):
        scaled = state.times(units)
        assert scaled.y == state.y * units.length
        assert scaled.over(units) == state


def test_values_with_units() -> None:
    given = {"gap": "20 mm", "free_mass": "2e2 g", "forcing_frequency": "600 rpm"}
    made = SIParameters(**SI | given, masses=[{"gap": "3 cm"}, {}])
    assert (made.gap, made.free_mass, made.forcing_frequency) == (0.02, 0.2, 2 * math.pi * 10)
    assert [one.clearance for one in made.dimensionless.each] == [
        one.clearance
        for one in SIParameters(**made.given | {"masses": [{"gap": 0.03}, {}]}).dimensionless.each
    ]
    assert (
        SIParameters(**SI | {"forcing": "base", "force_amplitude": "2 mm"}).force_amplitude == 0.002
    )
    with pytest.raises(ValueError, match=r"masses\[0\].gap = '3 s': has the unit 's'"):
        SIParameters(**SI, masses=[{"gap": "3 s"}])
    for value in ("20 mm", "20 F0/K"):
        with pytest.raises(ValueError, match=f"clearance = '{value}': has the unit"):
            Parameters(**GENERIC | {"clearance": value})
