"""Events of every model under every force, and at the corners, against many digits."""

from typing import Any

import pytest
from cases import thinned
from event_pairs import assert_as_in_digits, largest_error, length_of, pairs_of, rows_of_engine
from scenes import CASES, QUIET, SEVERAL, scene_of

from damper import Parameters, State
from damper.engine.model import read_segment
from damper.engine.segment import IMPACT, RELEASE, RESTING, SLIP, STICKING, TAIL
from damper.models import start_run
from damper.models.many import MODE
from damper.parameters.dampers import BASIC
from damper.verification.reference import exact_run

REST = (0, 0, 0, 0)
#: Of each model with one mass some with each feature, of several masses some of all models.
OFTEN = [case for k, case in enumerate(CASES) if k % (3 if case[0] in SEVERAL else 7) == 0]


@pytest.mark.parametrize(("model", "force", "features"), thinned(CASES, OFTEN.__contains__))
def test_random_scenes(model: str, force: str, features: str) -> None:
    """The first events, of one scene after another until there are two.

    Weight may hold a soft damper on its wall.
    """
    count = 0
    for seed in range(5):
        values, state = scene_of(model, force, seed, features)
        until = length_of(values, state, 40) if model in SEVERAL else 0.5 * length_of(values, state)
        count += len(assert_as_in_digits(values, state, until))
        if count >= 2:
            return
    assert count >= 2


@pytest.mark.exhaustive
@pytest.mark.parametrize(("model", "force", "features"), CASES)
def test_many_random_scenes(model: str, force: str, features: str) -> None:
    """Most with chatter, sticking and releases; of several masses with all that these do."""
    kinds: set[str] = set()
    for seed in range(30 if model in SEVERAL else 100):
        values, state = scene_of(model, force, seed, features)
        until = length_of(values, state, 40 if model in SEVERAL else 20)
        kinds |= set(assert_as_in_digits(values, state, until))
        if model in SEVERAL:
            kinds |= happened(values, state, until)
    wanted = {"impact", "stick", "release"}
    if model in ("compliant", "tension"):
        wanted = {"impact", "separation"}
        wanted |= {"contact"} if model == "compliant" and "gravity" in features else set()
    if "sliding" in model:
        wanted |= {"rest", "slip", "reversal"}
    if model in SEVERAL:
        wanted |= {"tail", "two stuck", "kick", "together"}
    if model == "several, sliding":
        wanted |= {"two rest", "one breaks away", "moved"}
    assert kinds >= wanted


def happened(values: dict[str, Any], state: tuple[Any, ...], until: float) -> set[str]:
    """What several masses do, alone and to each other."""
    run, found = start_run(Parameters(**values), State(*state)), set()
    before = None
    for log in run.segments(*run.whole_periods(until)):
        for row in log:
            s = read_segment(run.model, row)
            modes = s.bodies[:, MODE].tolist()
            found |= {"tail"} if TAIL in modes else set()
            found |= {"two stuck"} if modes.count(STICKING) > 1 else set()
            found |= {"two rest"} if modes.count(RESTING) > 1 else set()
            found |= {"kick"} if s.cause == RELEASE and s.gap_rate > 0.0 else set()
            if s.cause == SLIP:
                found.add("moved" if s.gap_rate else "one breaks away")
            found |= {"together"} if s.cause == before == IMPACT and s.duration == 0.0 else set()
            before = s.cause
    return found


@pytest.mark.parametrize(
    ("values", "u"),
    [
        ((0.4, 0.05, 0.8, 0.0, 0.6, 0.3), -0.2),
        ((0.4, 2.0, 0.8, 0.0, 0.6, 0.3), 0.7),
        ((0.5, 0.1, 0.7, 0.0, 0.5, 0.0, 2.0, 0.3), 0.4),
    ],
    ids=["underdamped", "overdamped", "grounded"],
)
def test_without_a_clearance_both_masses_move_as_one(values: tuple[float, ...], u: float) -> None:
    """From the momentum that both have, without an event."""
    given, start = grounded(*values) if len(values) > 6 else of(*values), (0.3, -0.2, 0.3, u)
    run = start_run(Parameters(**given), State(*start))
    run.skip(*run.whole_periods(60.0))
    assert run.events == 0
    end = run.state_at(*run.whole_periods(60.0))
    known = exact_run(given, start, until=60.0, digits=25).final
    assert [end.x, end.v, end.y, end.u] == pytest.approx([*map(float, known)], abs=1e-12)


# --- corners, and scenes of their own


def of(*numbers: float, **more: float) -> dict[str, float]:
    """Mass, damping and frequency ratio, clearance, restitution, phase; and what makes a model."""
    return dict(zip(BASIC, numbers, strict=False)) | more


def grounded(*numbers: float) -> dict[str, float]:
    """The same, and stiffness and damping ratio of the support."""
    *basic, stiffness, damping = numbers
    return of(*basic, support_stiffness_ratio=stiffness, support_damping_ratio=damping)


def compliant(*numbers: float, tension: int = 0) -> dict[str, float]:
    """The same, and the stiffness of the walls."""
    *basic, stiffness = numbers
    return of(*basic, contact_stiffness_ratio=stiffness, contact_tension=tension)


def varying(*numbers: float, **modulation: float) -> dict[str, float]:
    return of(*numbers, **{f"modulation_{name}": value for name, value in modulation.items()})


CHATTER, CALM = (0.1, 0.05, 0.2, 0.25, 0.6), tuple(QUIET.values())
#: Name -> values, start, end (or a number of events), largest error.
SCENES: dict[str, tuple[dict[str, float], tuple[float, ...], float | int, float]] = {
    "generic": (of(0.1, 0.05, 0.8, 1.0, 0.6), REST, 20, 2e-12),
    "undamped": (of(0.1, 0.0, 1.0, 3.0, 0.6), REST, 20, 2e-12),
    "elastic": (of(0.05, 0.2, 0.9, 1.0, 1.0), REST, 20, 2e-12),
    "chatter": (of(*CHATTER), REST, 60.0, 5e-13),
    "slow force": (of(0.01, 0.5, 1e-3, 0.25, 0.9), (0.0, 0.0, 0.1, 1.0), 15, 1e-11),
    "fast force": (of(0.1, 0.05, 1e3, 1e-7, 0.6), (0.0, 0.0, 0.0, 1e-3), 15, 1e-11),
    "fast force on a swing": (of(0.3, 0.1, 1e3, 1e-3, 0.7), (1.0, 0.0, 1.0, 0.0), 15, 1e-11),
    "overdamped": (of(0.1, 10.0, 0.5, 0.05, 0.8), (0.0, 0.0, 0.0, 1.0), 3.0, 1e-11),
    "light": (of(1e-6, 0.05, 0.7, 0.4, 0.6), REST, 15, 1e-11),
    "heavy": (of(1e18, 0.05, 0.7, 0.4, 0.6), REST, 15, 1e-11),
    "heavy, chatter": (of(1e6, 0.05, 0.05, 0.1, 0.7), REST, 15, 1e-11),
    "undamped at resonance": (of(0.1, 0.0, 1.0, 2.0, 0.7), REST, 15, 1e-11),
    "next to resonance": (of(0.1, 0.0, 1.0 + 1e-9, 2.0, 0.7), REST, 15, 1e-11),
    "critical damping": (of(0.1, 1.0, 0.3, 0.2, 0.7), REST, 15, 1e-11),
    "hardly a clearance": (of(0.1, 0.05, 0.8, 1e-9, 0.5), REST, 12.0, 1e-11),
    "wide box": (of(0.1, 0.05, 0.8, 500.0, 0.9), (0.0, 0.0, 3.0, 200.0), 90.0, 1e-11),
    # Speeds are small enough to close a sequence that still meets the other wall.
    "hardly a clearance, soft": (
        of(0.1, 0.24, 0.035, 1e-12, 0.7, 2.96), (-2.6, -2.0, -2.6, 0.8), 1e-4, 1e-12
    ),
    # On a wall at zero acceleration the third derivative decides.
    "pressed at the start": (of(0.1, 0.05, 0.2, 0.5, 0.6), (1, 0, 1.5, 0), 12.0, 1e-11),
    "parted at the start": (of(0.1, 0.05, 0.2, 0.5, 0.6), (1, 0, 0.5, 0), 12.0, 1e-11),
    "parted by the third": (of(0.1, 0.05, 0.2, 0.5, 0.6), (0, 0, 0.5, 0), 12.0, 1e-11),
    "pressed by the third": (of(0.1, 0.05, 0.2, 0.5, 0.6), (0, 0, -0.5, 0), 12.0, 1e-11),
    "yielding": (of(0.1, 0.05, 0.8, 1.0, 0.6, yield_speed=0.3), REST, 13.0, 1e-11),
    "yielding, light": (of(1e-6, 0.05, 0.8, 1.0, 0.6, yield_speed=1e-3), REST, 10.0, 1e-11),
    "yielding, heavy": (of(30.0, 0.05, 0.8, 1.0, 1.0, yield_speed=0.1), REST, 25.0, 1e-11),
    "power law": (
        of(*CHATTER, yield_speed=0.02, yield_exponent=0.03, restitution_left=0.7), REST, 60.0, 1e-11
    ),
    "power law, one rebound speed": (
        of(0.1, 0.05, 0.8, 0.3, 0.6, yield_speed=0.2, yield_exponent=1.0), REST, 20.0, 1e-11
    ),
    "weak support": (grounded(*CHATTER, 0.0, 0.01, 0.002), REST, 60.0, 2e-13),
    "support, chatter": (grounded(*CHATTER, 0.0, 0.05, 0.02), REST, 40.0, 2e-13),
    "dashpot alone": (grounded(0.1, 0.0, 0.2, 0.25, 0.6, 0.0, 0.0, 0.02), REST, 40.0, 2e-13),
    "plastic, spring alone": (
        grounded(0.1, 0.05, 0.2, 0.25, 0.0, 0.0, 0.02, 0.0), REST, 40.0, 2e-13
    ),
    "support, elastic": (grounded(0.1, 0.05, 0.9, 0.25, 1.0, 0.3, 0.02, 0.01), REST, 12.0, 2e-13),
    "support, start in flight": (
        grounded(0.5, 0.2, 0.3, 0.5, 0.6, 0.4, 0.3, 0.1), (0.2, 0.1, 0.7, -0.3), 30.0, 2e-13
    ),
    "support, overdamped": (
        grounded(2.0, 3.0, 0.5, 0.2, 0.8, 0.0, 1.0, 4.0), (0.1, 0.0, 0.0, 1.0), 20.0, 2e-13
    ),
    "support, light": (grounded(1e-3, 0.02, 1.3, 0.05, 0.6, 0.0, 0.01, 0.0002), REST, 8.0, 2e-13),
    "support, stiff": (grounded(0.05, 0.02, 0.4, 0.4, 0.7, 0.0, 100.0, 0.05), REST, 8.0, 2e-13),
    "support, heavily damped": (
        grounded(0.05, 0.02, 0.4, 0.4, 0.7, 0.0, 2.0, 5.0), REST, 6.0, 2e-13
    ),
    # The fastest supports that are promised: 2000 sqrt(K/M).
    "fast spring": (
        grounded(0.01, 0.02, 0.7, 0.3, 0.6, 0.0, 4e4, 0.0), (0.0, 0.1, 0.29, 400.0), 0.05, 2e-13
    ),
    "fast dashpot": (
        grounded(1e-3, 0.02, 0.7, 0.3, 0.6, 0.0, 0.1, 0.99), (0.0, 1.0, 0.299, 0.0), 1.0, 2e-13
    ),
    "stiff walls": (compliant(*CHATTER, 1e8), REST, 20.0, 1e-12),
    "stiff walls that pull": (compliant(*CHATTER, 1e8, tension=1), REST, 20.0, 1e-12),
    # A chatter sequence that ends in a lasting contact, and its release.
    "lasting contact": (compliant(*CALM, 1e4, tension=1), REST, 19.5, 1e-12),
    "lasting contact that ends": (compliant(*CALM, 1e4), REST, 17.6, 1e-12),
    "soft walls": (compliant(0.5, 0.2, 0.7, 0.1, 0.05, 30.0), REST, 8.0, 1e-12),
    "soft walls, elastic": (compliant(0.3, 0.02, 0.9, 0.4, 0.8, 30.0), REST, 11.4, 1e-12),
    # Contacts that begin again before the gap has reopened.
    "renewed contacts": (compliant(1.15, 0.1, 0.42, 0.328, 0.2, 71.1), REST, 8.0, 1e-12),
    "pressed into the left wall": (
        compliant(*CHATTER, 100.0) | {"restitution_left": 0.3}, (0.0, 0.0, -0.3, 0.0), 8.0, 1e-12
    ),
    # It leaves so fast that the dashpot of the left wall pulls at once, and that of the other not.
    "let go by the left wall": (
        compliant(*CHATTER, 100.0) | {"restitution_left": 0.3}, (0.0, 0.0, -0.26, 0.6), 8.0, 1e-12
    ),
    "kept by the right wall": (
        compliant(*CHATTER, 100.0) | {"restitution_left": 0.3}, (0.0, 0.0, 0.26, -0.6), 8.0, 1e-12
    ),
    "varying": (varying(*CALM, depth=0.4), REST, 40, 2e-13),
    "varying, subharmonic": (varying(*CALM, depth=0.4, order=3, phase=1.0), REST, 40, 2e-13),
    "varying, deep": (varying(2.0, 0.05, 0.2, 0.25, 0.3, depth=0.99, phase=-2.0), REST, 40, 2e-13),
    "varying, undamped": (varying(0.5, 0.0, 1.0, 0.2, 0.5, depth=0.5), REST, 20.0, 5e-13),
    "varying, critical": (varying(0.5, 1.0, 0.6, 0.05, 0.3, depth=0.5), REST, 20.0, 5e-13),
    "varying, overdamped": (varying(0.5, 10.0, 0.6, 0.01, 0.3, depth=0.5), REST, 12.0, 2e-13),
    "varying, plastic": (varying(0.5, 0.1, 0.3, 0.05, 0.0, depth=0.9, order=2), REST, 40, 2e-13),
}  # fmt: skip
#: What the suite leaves to `pytest -m exhaustive`.
SELDOM = (
    "slow",
    "fast",
    "overdamped",
    "heavy",
    "resonance",
    "wide",
    "weak",
    "alone",
    "light",
    "walls",
)


@pytest.mark.parametrize(
    "name", thinned(SCENES, lambda name: not any(word in name for word in SELDOM))
)
def test_scenes(name: str) -> None:
    values, state, end, error = SCENES[name]
    until = length_of(values, state, end) if isinstance(end, int) else end
    assert len(assert_as_in_digits(values, state, until, error, digits=25)) >= 3


# --- rules of several masses, and of friction


def swinging(*masses: dict[str, float], clearance: float = 1.0, **more: float) -> dict[str, Any]:
    """Masses on a primary that nothing drives or damps; one that is alone is not listed."""
    values = of(0.1, 0.0, 1.0, clearance, 0.5, force_amplitude=0.0) | more
    return values | ({"masses": masses} if len(masses) > 1 else masses[0])


#: Name -> values, start, end, largest error, and what happens: to which mass, at which wall. A `=`
#: is between events of one instant, a full stop at the last event.
RULES: dict[str, tuple[dict[str, Any], tuple[Any, ...], float, float, str]] = {
    "masses that arrive together hit together": (
        swinging({}, {"mass_ratio": 0.3, "restitution": 0.2}),
        (0.0, 0.0, [0.0, -1.0], [1.0, 2.0]), 1.5, 1e-15, "impact 0 right = impact 1 right",
    ),
    "masses that hit opposite walls together balance": (
        swinging({}, {}),
        (0.0, 0.0, [0.0, 0.0], [1.0, -1.0]), 1.5, 1e-15, "impact 0 right = impact 1 left.",
    ),
    # It arrives at the same instant, and is not hit: complementarity gives it no impulse.
    "a slow mass loses the wall that a hard impact takes away": (
        swinging({"mass_ratio": 1.0}, {}),
        (0.0, 0.0, [0.0, 1.0 - 1e-3], [10.0, 1e-2]), 0.2, 1e-15, "impact 0 right",
    ),
    "a mass that is stuck on the same wall is kicked off": (
        swinging({}, {}),
        (0.5, 0.0, [1.5, 0.5], [0.0, 30.0]), 0.8, 1e-15,
        "stick 0 right, impact 1 right = release 0 right",
    ),
    "a mass that is stuck on the opposite wall stays and adds its mass": (
        swinging({"mass_ratio": 0.5}, {}),
        (0.5, 0.0, [1.5, 0.5], [0.0, -30.0]), 0.06, 1e-15, "stick 0 right, impact 1 left.",
    ),
    "masses that are stuck on one wall are released at one instant, and land at one": (
        swinging({}, {"mass_ratio": 0.02}),
        (0.5, 0.0, [1.5, 1.5], [0.0, 0.0]), 6.0, 1e-14,
        "stick 0 right = stick 1 right, release 0 right = release 1 right, "
        "impact 0 left = impact 1 left",
    ),
    "speeds of bounces against friction fall, and it comes to rest on the wall": (
        swinging({"friction": 0.6}, mass_ratio=1e-6, restitution=0.7),
        (1.0, 0.0, 2.0, 1e-3 / 0.7), 0.1, 1e-13,
        "impact 0 right, reversal 0, impact 0 right, reversal 0",
    ),
    "friction gives way where the common acceleration reaches it": (
        swinging({"friction": 0.2, "mass_ratio": 0.5}),
        (0.0, 0.5, 0.0, 0.5), 3.0, 1e-13, "rest 0, slip 0",
    ),
    "the weaker friction gives way first": (
        swinging({"friction": 0.2}, {"friction": 0.5, "mass_ratio": 0.4}, clearance=5.0),
        (0.0, 0.5, [0.0, 1.0], [0.5, 0.5]), 2.0, 1e-15, "rest 0 = rest 1, slip 0.",
    ),
    "an impact moves the box under a mass that rests": (
        swinging({"friction": 0.5, "clearance": 5.0}, {"mass_ratio": 0.3}),
        (0.0, 0.0, [2.0, 0.0], [0.0, 1.0]), 1.1, 1e-15, "rest 0, impact 1 right = slip 0.",
    ),
    # It pushes the primary no more: x'' jumps from about 0 to what is beyond the other's hold.
    "a mass that stops lets another one break away": (
        swinging({"friction": 1.0, "mass_ratio": 1.0}, {"friction": 0.2}, clearance=5.0),
        (1.0, 0.0, [1.0, 1.0], [0.5, 0.0]), 0.6, 1e-15, "rest 1, rest 0 = slip 1.",
    ),
    "a wall holds one of two alike that friction does not hold": (
        swinging({}, {}, friction=0.2),
        (-0.5, 0.0, [-1.5, -0.5], [0.0, 0.0]), 2.4, 1e-14, "stick 0 left",
    ),
    "a mass without friction never slides": (
        of(0.1, 0.05, 1.0, 1.0, 0.8, masses=[{"gravity": 0.2}, {"friction": 0.3}]),
        (0.0, 0.0, [1.0, 0.0], [0.0, 0.1]), 5.0, 2e-15, "rest 1, slip 1, reversal 1",
    ),
    # On the brink for good: with the primary where it hangs, nothing ever happens.
    "weight and friction that are equal hold": (
        swinging({"friction": 0.25}, {"friction": 0.5}, clearance=5.0, gravity=0.25),
        (-0.05, 0.0, [0.0, 1.0], [0.0, 0.0]), 50.0, 1e-15, "rest 0 = rest 1.",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", RULES)
def test_rules(name: str) -> None:
    values, state, until, error, told = RULES[name]
    assert largest_error(pairs_of(values, state, until, digits=25)) < error
    walls, found, before = {1: " right", -1: " left", 0: ""}, "", -1.0
    for row in rows_of_engine(values, state, until):
        found += " = " if row.time == before else ", "
        found += f"{row.kind} {row.body}{walls[row.side]}"
        before = row.time
    assert f"{found}.".removeprefix(", ").startswith(told)
