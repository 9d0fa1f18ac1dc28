"""Every declared quantity, set to what is not neutral, acts in all that computes, or is refused.

So does every force.

What is added to a damper and left out of one formula would give wrong numbers there, silently.
"""

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from cases import thinned
from project_copy import small_study
from scenes import QUIET
from studies import blame

import damper
from damper import Parameters, SIParameters, State, continue_orbit, periodic_orbit, theory
from damper.analysis.closed_forms import admissible_orbits, reduced_gap
from damper.models import start_run
from damper.models.sensitivity import follow_change, neighbours
from damper.models.tangent import derivative
from damper.observers import OBSERVERS
from damper.parameters.dampers import BASIC
from damper.parameters.forcing import FORCINGS
from damper.parameters.masses import Mass
from damper.parameters.models import MODELS, ON_PRIMARY
from damper.parameters.quantities import PARAMETER_NAMES
from damper.parameters.state import INITIAL_QUANTITIES
from damper.report.interactive import interactive
from damper.study.messages import Mistakes
from damper.study.products import Product
from damper.sweep.points import read_point
from damper.sweep.runs import run_points
from damper.theory import steady
from damper.theory.accumulation import predict
from damper.theory.steady import FREE_MASS
from damper.theory.two_impacts import largest_clearance, orbits
from damper.verification.comparison import settings as comparison

CONTACT = {"contact_stiffness_ratio": 1e4}
MODULATION = {"modulation_depth": 0.3}
#: Unlike: the motion of two equal masses sticks in step, and is long to follow.
MASSES = {"masses": (Mass(()), Mass((("mass_ratio", 0.02),)))}
#: Quantity -> what it is given with, and its own value.
VALUES: dict[str, tuple[dict[str, Any], float]] = {
    "mass_ratio": ({}, 0.2),
    "damping_ratio": ({}, 0.1),
    "frequency_ratio": ({}, 0.21),
    "clearance": ({}, 0.3),
    "restitution": ({}, 0.4),
    "phase": ({}, 1.0),
    "force_amplitude": ({}, 1.5),
    "gravity": ({}, 0.02),
    "restitution_left": ({}, 0.5),
    "yield_speed": ({}, 0.01),
    "yield_exponent": ({"yield_speed": 0.005}, 0.5),
    "support_stiffness_ratio": ({}, 0.05),
    "support_damping_ratio": ({}, 0.02),
    "contact_stiffness_ratio": ({}, 1e4),
    "contact_tension": (CONTACT, 1.0),
    "modulation_depth": ({}, 0.3),
    "modulation_order": (MODULATION, 3.0),
    "modulation_phase": (MODULATION, 1.0),
    "friction": ({}, 0.02),
    "mass_share": (MASSES, 0.5),
    "clearance_factor": (MASSES, 0.4),
    "walls": ({}, -1.0),
    "carrier": ({"mass_ratio": 0.0, "damping_ratio": 0.0}, 1.0),
    "initial_displacement": ({}, 0.1),
    "initial_velocity": ({}, 0.1),
    "initial_position": ({}, 0.5),
    "initial_relative_velocity": ({}, 0.1),
    "initial_spacing": (MASSES, 0.4),
}
#: Forces that are no single harmonic.
FORCES = (
    damper.NoForce(),
    damper.Harmonics((1, 2), (1.0, 0.5)),
    damper.Base(),
    damper.Base("base"),
    damper.Unbalance(),
    # With a jump at either end, or none.
    damper.Record([3.0, 5.0, 9.0, 70.0], [1.0, 2.0, -1.0, 3.0]),
    damper.Record([0.0, 5.0, 9.0, 70.0], [0.0, 2.0, -1.0, 0.3], "base_acceleration", "hold"),
    damper.Noise(1, 0.2, 60.0, (0.0, 2.0)),
)
INITIAL = tuple(name for name in VALUES if name.startswith("initial_"))
UNTIL = 60.0


def start_of(values: dict[str, float]) -> tuple[Parameters, State | None]:
    point = read_point(values)
    return point.parameters, point.start()


def run(values: dict[str, float]) -> Any:
    p, state = start_of(values)
    return damper.events(p, state, until=UNTIL).tolist()


def response(values: dict[str, float]) -> Any:
    arrays, _ = run_points([values], ["response"], transient=0, periods=2)
    return [array.tolist() for array in arrays.values()]


def exponents(values: dict[str, float]) -> Any:
    arrays, _ = run_points([values], ["lyapunov"], transient=0, periods=2)
    return arrays["lyapunov_exponents"].tolist()


def deviations(values: dict[str, float]) -> Any:
    return derivative(start_run(*start_of(values)), 1.0, 20.0).tolist()


def sensitivity(values: dict[str, float]) -> Any:
    """What becomes of the end of a run with each of the quantities that it is given."""
    p, state = start_of(values)
    found = []
    # The cycle of the clock is no frequency of a record: test_orbits.py has how that is refused.
    asked = p.acting if p.forcing.repeats else p.acting.keys() - {"frequency_ratio"}
    for name in (*[n for n in PARAMETER_NAMES if n in asked], *p.forcing.numbers):
        trajectory = start_run(p, state)
        change, stencil = np.zeros((2 + 2 * len(p.each), 1)), neighbours(p, {name: 1.0})
        for log in trajectory.segments(1.0, 20.0):
            follow_change(trajectory.model, stencil, log, change, False)
        found.append(change.tolist())
    return found


def orbit(values: dict[str, float]) -> Any:
    """A motion, and where it goes along a parameter."""
    point = read_point(values)
    found = periodic_orbit(point.parameters, settle=20)
    near = continue_orbit(found, "damping_ratio", 0.0, 10.0, step=1e-3, max_orbits=1)
    return found.start.tolist(), found.multipliers.tolist(), near.orbits[0].start.tolist()


def si(values: dict[str, float]) -> Any:
    """Events of a machine in SI units."""
    point = read_point(values)
    machine = SIParameters.of(point.parameters, 2.0, 200.0, 10.0)
    state = point.start()
    return damper.events(machine, state and state.times(machine.units), until=5.0).tolist()


def start(values: dict[str, float]) -> Any:
    return read_point(values, "steady").start()


def motions(values: dict[str, float]) -> Any:
    own = values | {"clearance": 2.0 * values["clearance"]}
    return [(orbit.speed, orbit.start) for orbit in orbits(Parameters(**own))]


def prediction(values: dict[str, float]) -> Any:
    p = Parameters(**values)
    # A box of prescribed motion presses on one wall at a time.
    sides = (1,) if p.carrier else (-1, 1)
    return [predict(p, side, 2.0, side * 2.0, side * 0.1, 0.02) for side in sides]


def largest(values: dict[str, float]) -> Any:
    return largest_clearance(Parameters(**values))


def gap(values: dict[str, float]) -> Any:
    return reduced_gap(Parameters(**values))


#: What takes quantities -> those that it does not depend on.
CONSUMERS: dict[Callable[[dict[str, float]], Any], tuple[str, ...]] = {
    run: (),
    response: (),
    exponents: (),
    deviations: (),
    sensitivity: (),
    orbit: INITIAL,
    si: (),
    start: (*FREE_MASS, "initial_relative_velocity"),
    motions: INITIAL,
    # It is that of speeds below the yield speed.
    prediction: ("clearance", "yield_exponent", *INITIAL),
    largest: ("clearance", "phase", *INITIAL),
    gap: ("mass_ratio", "restitution", "phase", *INITIAL),
}


def test_every_quantity_is_here() -> None:
    assert set(VALUES) == {q.name for q in (*Parameters.quantities, *INITIAL_QUANTITIES)}


@pytest.mark.parametrize("name", VALUES)
@pytest.mark.parametrize("consumer", CONSUMERS, ids=lambda consumer: consumer.__name__)
def test_a_quantity_acts_or_is_refused(consumer: Callable, name: str) -> None:
    if name in CONSUMERS[consumer]:
        return
    company, value = VALUES[name]
    values = QUIET | company | {name: value}
    found = answer(consumer, values)
    if isinstance(found, str):
        p, _ = start_of(values)
        assert {name, p.main_feature, p.law}.intersection(re.findall(r"\w+", found)), found
    else:
        assert repr(found) != unchanged(consumer, *company.items())


#: Observers that count, which may come to the same; one that is here by itself; and one of free
#: vibrations: under a force studies refuse it, and all that it writes stays missing.
OTHERS = {"burst_at", "chatter_bursts", "motion", "response", "decay"}


def observed(name: str) -> Callable[[dict[str, Any]], Any]:
    """What an observer makes of a run."""

    def consumer(values: dict[str, Any]) -> Any:
        arrays, _ = run_points([values], [name], transient=1, periods=3)
        return [array.tolist() for array in arrays.values()]

    consumer.__name__ = name
    return consumer


def page(values: dict[str, Any]) -> Any:
    """What the page is given of a figure."""
    others = dict(values)
    forcing, axes = others.pop("forcing", "harmonic"), {"clearance": [0.2, 0.25]}
    del others["clearance"]
    length = {"transient": 0, "periods": 4}
    cube = damper.simulate(**others, **axes, forcing=forcing, observers=["impacts"], **length)
    settings = {"kind": "bifurcation", "along": "clearance", "variables": ["max_approach_speed"]}
    study = {"fixed": others | {"phase": 0.0}, "axes": axes, "run": length}
    study |= {"primary": "rest", "draws": {}, "follow": {}, "observers": {}}
    return [str(interactive(cube, settings, study))]


def overlaid(values: dict[str, Any]) -> Any:
    """Closed forms at the place of a cube."""
    cube = damper.simulate(**values, observers=["impacts"], transient=0, periods=1)
    return [str(admissible_orbits(cube, "restitution", [0.3]))]


def test_every_force_is_here() -> None:
    assert {type(force) for force in FORCES} == {*FORCINGS.values()} - {damper.Harmonic}


@pytest.mark.parametrize("force", FORCES, ids=str)
@pytest.mark.parametrize(
    "consumer",
    [*CONSUMERS, *(observed(name) for name in OBSERVERS if name not in OTHERS), page, overlaid],
    ids=lambda consumer: consumer.__name__,
)
def test_a_force_acts_or_is_refused(consumer: Callable, force: Any) -> None:
    found = answer(consumer, QUIET | {"forcing": force})
    if isinstance(found, str):
        assert {"forcing", force.kind}.intersection(re.findall(r"\w+", found)), found
    else:
        assert repr(found) != unchanged(consumer)


#: Of several masses one force in three: tests/models/test_forces.py draws such dampers.
FORCED = [(force, model) for model in ON_PRIMARY for force in FORCES]


@pytest.mark.parametrize(
    ("force", "model"),
    thinned(FORCED, lambda pair: pair[1] != "several" or FORCES.index(pair[0]) % 3 == 0),
    ids=str,
)
def test_the_energy_balance_closes_with_every_force(force: Any, model: str) -> None:
    values = QUIET | MODELS[model].example | {"forcing": force, "initial_velocity": 1.0}
    found = check_energy(values)
    assert (found["energy_input"] == 0.0) == (force.kind == "none")
    # Of what has no amplitude of its own, no ratio to it.
    missing = force.kind not in ("base", "unbalance")
    assert np.isnan([found["amplitude_ratio"], found["rms_ratio"]]).tolist() == [missing, missing]


def check_energy(values: dict[str, Any]) -> dict[str, float]:
    arrays, _ = run_points([values], ["response"], transient=1, periods=1)
    found = {name: float(array[0]) for name, array in arrays.items()}
    scale = abs(found["energy_input"]) + found["dashpot_loss"] + found["peak_displacement"] ** 2
    assert found["impact_loss"] > 0.0
    assert abs(found["energy_residual"]) < 2e-14 * scale
    return found


def answer(consumer: Callable, values: dict[str, float]) -> Any:
    """What a consumer computes, or the words in which it refuses."""
    try:
        return consumer(values)
    except ValueError as error:
        return str(error)


@cache
def unchanged(consumer: Callable, *company: tuple[str, float]) -> str:
    """What it computes of the scene, and of what a quantity is given with."""
    return repr(answer(consumer, QUIET | dict(company)))


@pytest.fixture
def less_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make the phase a quantity that no formula has heard of."""
    for module in (theory, comparison):
        monkeypatch.setattr(module, "BASIC", tuple(n for n in BASIC if n != "phase"))
    monkeypatch.setattr(Product, "knows", tuple(n for n in BASIC if n != "phase"))
    monkeypatch.setattr(steady, "PRIMARY", ("damping_ratio", "frequency_ratio"))


@pytest.mark.usefixtures("less_known")
@pytest.mark.parametrize("consumer", [start, motions, largest, gap])
def test_formulas_refuse_by_name_what_they_do_not_list(consumer: Callable) -> None:
    with pytest.raises(
        ValueError, match=r"^phase = 0\.4: .* holds for .*damping_ratio.* only; leave phase out$"
    ):
        consumer(QUIET | {"phase": 0.4})


@pytest.mark.usefixtures("less_known")
def test_studies_refuse_by_name_what_formulas_do_not_list(tmp_path: Path) -> None:
    study = small_study(initial="steady")
    study["parameters"]["phase"] = 0.4
    study["figures"] = {
        "one": {"kind": "bifurcation", "along": "restitution"}
        | {"theory": "two_impacts", "at": {"mass_ratio": 0.1}}
    }
    message = blame(tmp_path, study)
    assert "initial\n    phase = 0.4: the steady response holds for" in message
    assert message.count("its formulas do not know phase") == 1


@pytest.mark.usefixtures("less_known")
def test_scenes_refuse_by_name_what_other_solvers_do_not_list() -> None:
    mistakes = Mistakes()
    comparison.SceneSettings.check_together(SceneStub(QUIET | {"phase": 0.4}), mistakes)
    assert "phase = 0.4: the comparison holds for" in str(mistakes.lines)


class SceneStub(NamedTuple):
    values: dict[str, float]
