"""What holds for every model: symmetry, conservation, limits, and that it alone is imported."""

import inspect
import math
from importlib import import_module
from itertools import combinations, product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from cases import thinned
from event_pairs import log_of
from new_process import in_new_process
from scenes import MODELS as OF_ONE
from scenes import QUIET as SCENE

from damper import Parameters, equal_masses, events, periodic_orbit, simulate
from damper.engine.forcing import derivative_of, phase_at
from damper.engine.segment import DURATION
from damper.models import start_run
from damper.models.forces import drive_of
from damper.observers import OBSERVERS, observer_class
from damper.observers.common.laws import broken
from damper.parameters.forcing import Base, Harmonics, NoForce, Noise, Record, Unbalance
from damper.parameters.models import ON_PRIMARY
from damper.sweep.runs import run_points

#: Model -> what makes it, beside SCENE; where impacts, sticking and releases happen.
MADE = OF_ONE | {
    "several": {"masses": equal_masses(3, 0.3)},
    "several, sliding": {"masses": equal_masses(3, 0.3), "friction": 0.02},
}
each = pytest.mark.parametrize("name", MADE)


def parameters(name: str, **changes: float) -> Parameters:
    return Parameters(**{**SCENE, **MADE[name], **changes})


def test_all_models_are_here() -> None:
    assert {parameters(name).main_feature for name in MADE} == set(ON_PRIMARY)


@each
def test_gap_stays_open(name: str) -> None:
    """Dense samples inside the segments; a compliant wall gives, but not without a force."""
    p = parameters(name)
    run = start_run(p)
    depth = 0.0
    for row in log_of(run, 50.0 if name in OF_ONE else 15.0):
        for part in np.linspace(0.0, 1.0, 40).tolist():
            _, _, gap, _ = run.motion_in(row, part * row[DURATION])
            depth = min(depth, gap)
            assert gap <= 2.0 * p.clearance + 1e-15
    assert depth == 0.0 if p.model != "compliant" else -1e-2 < depth < -1e-4


# --- energy


@pytest.mark.parametrize(
    "scene",
    [
        SCENE,
        {**SCENE, "mass_ratio": 2.0, "damping_ratio": 3.0, "clearance": 0.02},
        {**SCENE, "clearance": 0.0},
    ],
    ids=["chatter", "overdamped", "no clearance"],
)
@each
def test_energy_balance_closes(name: str, scene: dict[str, float]) -> None:
    """Flow, events, what impacts lose and all integrals at once, over windows cut anywhere.

    Under every force: test_quantities.py.
    """
    if "several" in name and scene != SCENE:
        return  # many rows; no clearance is refused
    observers = {"response": {"modulation_work": True}}
    length = {"transient": 1, "periods": 2} if "several" in name else {"transient": 2, "periods": 5}
    found = simulate(**{**scene, **MADE[name]}, **length, observers=observers)
    parts = ("energy_input", "dashpot_loss", "impact_loss")
    scale = max(abs(float(found[part])) for part in parts) + float(found.peak_displacement) ** 2
    assert found.status == 0
    assert found.impact_loss > 0.0 or scene["clearance"] == 0.0
    assert abs(float(found.energy_residual)) < 2e-14 * scale
    varies = abs(float(found.modulation_work)) > 1e-9 * scale
    assert varies == (name == "time_varying")


FORCES: dict[str, dict[str, Any]] = {
    "harmonics": {"forcing": Harmonics((1, 2, 5), (1.0, 0.7, 0.3), (0.0, 1.0, 2.0))},
    "in its frame": {"forcing": Base("base"), "force_amplitude": 15.0},
    "of the base": {
        "forcing": Record(
            5.0 * np.arange(60),
            np.random.default_rng(5).normal(size=60),
            of="base_acceleration",
            after="hold",
        )
    },
}


@pytest.mark.parametrize(
    ("name", "force"),
    [*((name, "") for name in MADE), *product(("rigid", "grounded"), FORCES)],
)
def test_response_against_samples(name: str, force: str) -> None:
    """Mean square, peak, work of the force and what each part takes, by samples of a full record.

    None of the forces jumps in the window: samples would be off by a part of one.
    """
    p = parameters(name, **FORCES.get(force, {}))
    bodies = {"bodies": range(len(p.each))} if p.masses else {}
    sampled = {"samples_per_period": 4000, "events": 400} | bodies
    ask = {"response": {"friction_loss": p.friction > 0.0}, "trajectory": sampled}
    found = simulate(p, transient=1, periods=1, observers=ask)
    rows = found.isel(instant=np.isfinite(found.trajectory_time.values))
    time, x = rows.trajectory_time.values, rows.trajectory_displacement.values
    v, u = rows.trajectory_velocity.values, np.atleast_2d(rows.trajectory_free_velocity.values)
    peak = float(found.peak_displacement)
    assert np.abs(x).max() * (1 - 1e-15) <= peak == pytest.approx(np.abs(x).max(), rel=1e-5)
    mean = np.trapezoid(x * x, time) / p.cycle
    assert float(found.rms_displacement) == pytest.approx(math.sqrt(mean), rel=1e-6)
    shape, amplitude, share = drive_of(p)
    push = [
        amplitude * derivative_of(shape, phase_at(shape, 1.0, float(now)), 0)
        for now in time + float(found.trajectory_start)
    ]
    ratios = np.array([one.mass_ratio for one in p.each])
    work = np.trapezoid(push * (v + share * ratios @ u), time)
    # Few samples lie in a contact of stiff walls.
    rough = 1e-3 if p.model == "compliant" else 1e-5
    assert float(found.energy_input) == pytest.approx(work, rel=rough)
    moves = p.damping_ratio * v * v + p.support_damping_ratio * (u * u).sum(axis=0)
    assert float(found.dashpot_loss) == pytest.approx(2.0 * np.trapezoid(moves, time), rel=rough)
    if p.friction:
        rubs = ratios * [one.friction for one in p.each]
        loss = np.trapezoid(rubs @ abs(u - v), time)
        assert float(found.friction_loss) == pytest.approx(loss, rel=1e-5)


# --- limits


@pytest.mark.parametrize(
    "nearly",
    [
        {"support_stiffness_ratio": 1e-16},
        {"support_damping_ratio": 1e-16},
        {"modulation_depth": 1e-15, "modulation_order": 3},
        {"friction": 1e-16},
    ],
    ids=str,
)
@pytest.mark.parametrize("restitution", [0.3, 0.0])
def test_what_vanishes_leaves_the_rigid_run(nearly: dict[str, float], restitution: float) -> None:
    scene = {**SCENE, "restitution": restitution}
    rigid = events(Parameters(**scene), until=40.0)
    p = Parameters(**scene, **nearly)
    assert p.main_feature != "rigid"
    found = events(p, until=40.0)
    # How many impacts of a sequence are resolved may differ by one; what they lead to may not.
    # Rests off the walls are friction's own, however short.
    pairs = [[rows[np.isin(rows["kind"], (1, 2))] for rows in (rigid, found)]]
    pairs.append([rows[rows["kind"] == 0][:3] for rows in (rigid, found)])
    for one, other in pairs:
        assert len(one) == len(other) >= 2
        for field in ("time", "side", "kind", "approach_speed", "x", "v"):
            assert one[field] == pytest.approx(other[field], rel=0, abs=2e-11)


@pytest.mark.parametrize("tension", [0, 1])
def test_stiff_contact_converges_to_the_rigid_damper(tension: int) -> None:
    """Impacts, onset of sticking and release approach the rigid ones as k^(-1/2)."""
    rigid = events(Parameters(**SCENE), until=21.0)
    stiffness = [1e6, 1e7, 1e8]
    distances = []
    for k in stiffness:
        p = Parameters(**SCENE, contact_stiffness_ratio=k, contact_tension=tension)
        found = events(p, until=21.0)
        row = [abs(found["time"][i] - rigid["time"][i]) for i in (1, 2, 3)]
        for kind in (1, 2):
            one, other = (e["time"][e["kind"] == kind][0] for e in (found, rigid))
            row.append(abs(one - other))
        distances.append(row)
    slopes = np.polyfit(np.log(stiffness), np.log(distances), 1)[0]
    # The release forgets the way to it: it may converge faster.
    assert np.all(slopes < -0.44)
    assert np.all(slopes[:3] > -0.56)
    assert max(distances[-1]) < 2e-2


#: Another value that is the same: walls alike, and a yield speed that nothing reaches.
SAME = {"restitution_left": SCENE["restitution"], "yield_speed": 1e300, "gravity": -0.0}


@pytest.mark.parametrize("name", OF_ONE)
def test_values_that_say_nothing_change_no_byte(name: str) -> None:
    known = events(parameters(name), until=100.0)
    assert {1, 2} <= set(known["kind"])
    for given, value in SAME.items():
        if given == "yield_speed" and name in ("yielding", "compliant", "tension"):
            continue
        found = events(parameters(name, **{given: value}), until=100.0)
        assert found.tobytes() == known.tobytes()


NONE = """
import json, sys
import damper
from damper import Parameters
base = (0.1, 0.05, 0.2, 0.25, 0.3)
rigid = damper.events(Parameters(*base), until=50).tobytes()
same = [
    damper.events(Parameters(*base, **given), until=50).tobytes() == rigid
    for given in (
        dict(support_stiffness_ratio=0.0, support_damping_ratio=0.0),
        dict(modulation_depth=0.0, modulation_order=3, modulation_phase=1.0),
        dict(friction=0.0),
    )
]
names = ("compliant", "time_varying", "several")
unused = [name for name in sys.modules if name.startswith("damper.models.") and any(
    model in name for model in names)]
print(json.dumps([*same, unused]))
"""


def test_nothing_of_it_is_the_rigid_damper_byte_for_byte() -> None:
    """And its code: that of the other models is not even imported."""
    assert in_new_process(NONE, "-W", "error", DAMPER_COMPILE="0") == [True] * 3 + [[]]


class Unknown(NamedTuple):
    """A model, a law, a forcing or what moves, of which nothing is implemented."""

    mass_ratio: float = 0.1
    damping: float = 0.0


#: Where functions are declared that each class implements for itself.
DECLARING = (
    "engine.forcing",
    "engine.impact",
    "engine.model",
    "engine.peak",
    "engine.search",
    "models.laws",
    "models.response",
    "models.tangent",
    "models.walls",
)
DECLARED = sorted(
    {
        f"{function.__module__}.{function.__name__}": function
        for name in DECLARING
        for function in vars(import_module(f"damper.{name}")).values()
        if inspect.isfunction(function) and hasattr(function, "like")
    }.items()
)
#: Functions with an answer for what does not say. Aids of searches; a Taylor series of the
#: derivatives that each force gives; the law of one wall, where the walls are alike. The row of a
#: log is that of one free mass, as are its motion, its deviations, its losses beside a primary
#: alone in flight, and what the laws are told of it. Without dry friction it neither rests off the
#: walls nor slides. No force but a weighed one has a weight. Sums of energies, and the laws of
#: walls, are those of one primary mass, read from what its model holds.
GENERAL = (
    *("begin_samples", "longer_step", "proves_inside", "shorter_step", "stays_below", "taylor"),
    *("law_at", "read_segment", "write_row", "stored_energy", "masses_at", "over_time"),
    *("lost_at_start", "own_share", "primary_of", "lost_in", "course_of", "turned", "stays"),
    *("rest_or_slide", "fly_on", "bounce_of", "state_by_start", "exactly", "own_state", "box_at"),
    *("travel_of", "only_wall_of", "free_mass", "begun", "rebound_of", "sample", "tells_all"),
    *("braked_by", "has_no_time", "common", "strength_of", "weight_of", "with_height"),
    *("drag_of", "fastest_rate", "inertias_of", "is_of_box", "longest_product", "law_of_mass"),
)


@pytest.mark.parametrize(("name", "function"), DECLARED)
def test_nothing_is_assumed_of_what_does_not_say(name: str, function: Any) -> None:
    arguments = (Unknown(), *[1.0] * (len(inspect.signature(function).parameters) - 1))
    if function.__name__ not in GENERAL:
        with pytest.raises(TypeError, match="is not implemented for Unknown"):
            function(*arguments)


# --- which features combine

#: Features of a damper by their names in docs/models.md; two of them make a pair.
FEATURES: dict[str, dict[str, Any]] = {
    "gravity": {"gravity": 0.1},
    "walls that differ": {"restitution_left": 0.5},
    "r = 0": {"restitution": 0.0},
    "r = 1": {"restitution": 1.0},
    "yielding walls": {"yield_speed": 0.05},
    "table": {"restitution": math.inf, "restitution_table": [(0.01, 0.4), (1.0, 0.3)]},
    "one wall": {"walls": "left"},
    "support": {"support_stiffness_ratio": 0.02},
    "friction": {"friction": 0.01},
    "masses": {"masses": [{}, {"clearance": 0.3}]},
    "compliant contact": {"contact_stiffness_ratio": 1e4},
    "time-varying mass": {"modulation_depth": 0.2},
    "mass ratio 0": {"mass_ratio": 0.0},
    "fixed stop": {"mass_ratio": math.inf},
    "prescribed box": {"mass_ratio": 0.0, "damping_ratio": 0.0, "carrier": "prescribed"},
    "no force": {"forcing": NoForce()},
    "harmonics": {"forcing": Harmonics((1, 2), (1.0, 0.5))},
    "unbalance": {"forcing": Unbalance()},
    "base in the ground's frame": {"forcing": Base("ground")},
    "base in its own frame": {"forcing": Base("base")},
    "record of a force": {"forcing": Record([0, 1, 30], [1, 2, -1], after="hold")},
    "record of the base": {"forcing": Record([0, 5, 30], [1, -2, 1], of="base_acceleration")},
    "noise": {"forcing": Noise(3, 0.2, 60.0, (0.4, 2.5))},
}
#: Features that the same parameter makes are no pair.
PAIRS = [(a, b) for a, b in combinations(FEATURES, 2) if not {*FEATURES[a]} & {*FEATURES[b]}]


def refused_in_docs(heading: str) -> set[tuple[str, str]]:
    """Pairs of names in a table of docs/models.md, from its first two columns."""
    _, _, text = (Path(__file__).parents[2] / "docs/models.md").read_text().partition(heading)
    rows = [row.split("|")[1:3] for row in text.partition("\n\n")[0].splitlines()[2:]]
    return {
        (one.strip(" `"), other.strip())
        for ones, others in rows
        for one in ones.split(",")
        for other in others.split(",")
    }


REFUSED = refused_in_docs("| feature | refused with | why |")
REFUSED_BY = refused_in_docs("| asks | refused with | why |")


def test_the_tables_in_docs_name_features() -> None:
    assert {name for pair in REFUSED for name in pair} <= {*FEATURES}
    assert {name for _, name in REFUSED_BY} <= {*FEATURES}
    assert {name for name, _ in REFUSED_BY} <= {*OBSERVERS, "periodic_orbit"}
    assert all({pair, pair[::-1]} & {*PAIRS} for pair in REFUSED)


def is_often(pair: tuple[str, str]) -> bool:
    return "forcing" not in FEATURES[pair[1]] or pair in REFUSED or pair[::-1] in REFUSED


@pytest.mark.parametrize(("one", "other"), thinned(PAIRS, is_often))
def test_two_features_combine_or_are_refused(one: str, other: str) -> None:
    """No law of the model is broken; a refusal names a parameter of the pair."""
    values = SCENE | FEATURES[one] | FEATURES[other]
    if {(one, other), (other, one)} & REFUSED:
        with pytest.raises(ValueError, match="|".join((*FEATURES[one], *FEATURES[other]))):
            Parameters(**values)
        return
    observer = "bursts" if "prescribed box" in (one, other) else "laws"
    arrays, _ = run_points([values], [observer], transient=0, periods=1)
    assert arrays["status"][0] == 0
    assert observer == "bursts" or not broken(arrays).any()


@pytest.mark.parametrize("observer", OBSERVERS)
def test_what_an_observer_asks_a_feature_has_or_is_refused(observer: str) -> None:
    for name, given in FEATURES.items():
        settings = {}
        if name == "masses" and "bodies" in observer_class(observer).settings:
            settings = {"bodies": [0, 1]}
        ask = {"transient": 0, "periods": 1, "max_events": 2}
        if (observer, name) in REFUSED_BY:
            with pytest.raises(ValueError, match=f"^{observer}"):
                run_points([SCENE | given], {observer: settings}, **ask)
        else:
            run_points([SCENE | given], {observer: settings}, **ask)


@pytest.mark.parametrize("name", sorted(name for asks, name in REFUSED_BY if asks[0] == "p"))
def test_what_a_periodic_motion_asks_a_force_has_or_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match=r"^an orbit "):
        periodic_orbit(Parameters(**SCENE | FEATURES[name]))
