"""Several free masses on one primary: each rule in a scene of its own."""

from typing import Any

import numpy as np
import pytest
from scenes import GENERIC, QUIET

from damper import Parameters, State, equal_masses, events, periodic_orbit
from damper.models import start_run
from damper.models.tangent import derivative
from damper.observers.common.limits import mean_within
from damper.theory.two_impacts import orbits
from damper.verification.reference import exact_run

CALM: dict[str, Any] = {"damping_ratio": 0.0, "frequency_ratio": 1.0, "force_amplitude": 0.0}


def damper_of(*masses: dict[str, float], **given: float) -> Parameters:
    values = {"mass_ratio": 0.1, "clearance": 1.0, "restitution": 0.5} | CALM | given
    return Parameters(**values, masses=masses)


def told(table: np.ndarray) -> list[tuple[int, int, int]]:
    return [(row["kind"], row["body"], row["side"]) for row in table]


# --- rules of simultaneous contacts


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize(
    ("own", "damping", "v"),
    [({"gravity": 0.2}, 0.05, 0.0), ({}, 0.0, -0.3)],
    ids=["start", "release"],
)
def test_a_mass_that_only_touches_a_wall_adds_its_mass(
    order: int, own: dict[str, float], damping: float, v: float
) -> None:
    """Nothing presses it: at the start, or as it is released at the instant of the impact."""
    masses, y, u = ({}, {"mass_ratio": 0.2} | own), (-1.0, 1.0), (v - 0.5, v)
    p = damper_of(*masses[::order], damping_ratio=damping, restitution=0.8)
    state = State(0.0, v, y[::order], u[::order])
    table = events(p, state, until=0.3)
    hits = table[table["kind"] == 0]
    assert hits[["time", "approach_speed"]].tolist() == [(0.0, pytest.approx(0.5, abs=1e-15))]
    after = v - 0.1 * 1.8 * 0.5 / 1.3
    assert hits["v"] == pytest.approx(after, abs=1e-15)
    values = {"mass_ratio": 0.1, "clearance": 1.0, "restitution": 0.8} | CALM
    values |= {"damping_ratio": damping, "masses": masses[::order]}
    [exact] = exact_run(values, (0.0, v, y[::order], u[::order]), until=0.3, digits=16).events
    assert float(exact.v) == pytest.approx(after, abs=1e-15)


def test_a_deviation_parts_a_mass_that_only_touches_a_wall_from_the_impact() -> None:
    p = damper_of({}, {"gravity": 0.2})
    run = start_run(p, State(0.0, 0.0, [-1.0, 1.0], [-0.5, 0.0]))
    with pytest.raises(ValueError, match="no derivative"):
        derivative(run, *run.whole_periods(0.3))


def test_masses_that_chatter_on_one_wall_come_to_rest_at_one_instant() -> None:
    """With r = 0 as well: each impact of one kicks the other off, ever more weakly."""
    start = State(3.0, 0.0, [3.99, 3.95], [0.0, 0.0])
    for r in (0.0, 0.3):
        p = damper_of({}, {"clearance": 1.01}, restitution=r)
        table = events(p, start, until=1.4)
        last = {b: table[(table["kind"] == 1) & (table["body"] == b)]["time"][-1] for b in (0, 1)}
        assert last[0] == pytest.approx(last[1], abs=1e-11)
        kicks = table[(table["kind"] == 2) & (table["time"] < last[0])]
        assert len(kicks) >= 3
        ends = start_run(p, start)
        ends.skip(0.0, 1.4)
        at = ends.state_at(0.0, 1.4)
        assert at.u == (at.v, at.v)


def test_an_elastic_mass_comes_to_rest_with_those_that_it_kicks() -> None:
    """They lose what it gives them, again and again: when they rest is a geometric series."""
    p = damper_of({"restitution": 1.0, "mass_ratio": 0.5}, {"mass_ratio": 1.2}, gravity=-3.0)
    table = events(p, State(1.0, 0.0, [1.9, 2.0], [0.0, 0.0]), until=1.5)
    rests = table[table["kind"] == 1]
    assert rests["body"][-1] == 0
    assert set(rests["body"][:-1]) == {1}
    assert rests["time"][-1] == table["time"][-1]
    a, b, c = rests["time"][30:60:10]
    assert rests["time"][-1] == pytest.approx(c - (c - b) ** 2 / (c - 2 * b + a), abs=2e-12)


def test_a_tail_is_cut_where_another_mass_hits() -> None:
    """The same sequence, with and without a second mass that arrives in its midst."""
    alone, both = damper_of({}), damper_of({}, {"mass_ratio": 1e-3})
    first = events(alone, State(3.0, 0.0, 4.0, 0.5), until=1.5)
    ends = float(first["time"][first["kind"] == 1][0])
    impacts = first["time"][first["kind"] == 0]
    assert ends - impacts[-1] < 1e-3
    # It arrives when nine tenths of what a tail would close are over.
    arrives = ends - 0.1 * (ends - impacts[-1])
    speed = 2.0
    x = first["x"][first["kind"] == 1][0]
    y = float(x) + 1.0 - speed * arrives
    table = events(both, State(3.0, 0.0, [4.0, y], [0.5, speed]), until=1.5)
    hit = table[table["body"] == 1][0]
    assert hit["time"] == pytest.approx(arrives, abs=1e-4)
    before = table[(table["body"] == 0) & (table["time"] < hit["time"])]
    assert (before["kind"] == 0).sum() >= len(impacts) - 1


def test_another_impact_can_throw_a_stuck_mass_off_by_the_dashpot() -> None:
    """x'' of the joined motion jumps by 2 zeta dv: the contact force is negative at once."""
    values = {"damping_ratio": 5.0, "restitution": 0.0}
    p = damper_of({"mass_ratio": 0.01, "gravity": 0.4}, {"mass_ratio": 0.2}, **values)
    start = State(0.0, 0.0, [-1.0, 0.8], [0.0, -1.0])
    table = events(p, start, until=3.0)
    hit = table[table["body"] == 1][0]
    thrown = table[(table["body"] == 0) & (table["kind"] == 2)]
    assert hit["side"] == -1 or len(thrown)
    assert len(thrown)


# --- small deviations


def test_multipliers_of_masses_in_step_are_those_of_one() -> None:
    """And infinite of what parts them: impacts together are not one after the other."""
    one = Parameters(0.1, 0.1, 1.0, 5.5, 0.5)
    known = next(each for each in orbits(one) if each.stable)
    s = known.start
    many = Parameters(0.1, 0.1, 1.0, 5.5, 0.5, masses=[{"mass_ratio": 0.05}] * 2)
    orbit = periodic_orbit(many, state=State(s.x, s.v, [s.y] * 2, [s.u] * 2, s.time))
    assert orbit.word == "R1 L1 | R1 L1"
    assert np.all(np.isinf(orbit.multipliers[:2]))
    np.testing.assert_allclose(
        np.sort_complex(orbit.multipliers[2:]), np.sort_complex(known.multipliers**2), rtol=1e-9
    )


# --- conservation and limits


@pytest.mark.parametrize("count", [1, 2, 5])
@pytest.mark.parametrize("friction", [0.0, 0.005, 0.05, 0.1])
@pytest.mark.parametrize("gravity", [0.0, 0.05])
def test_equal_masses_in_step_are_one(count: int, friction: float, gravity: float) -> None:
    """N of them that move as one behave as one of N times the mass, to rounding.

    They hit, stick, break away, slide and rest together.
    """
    given = QUIET | {"friction": friction, "gravity": gravity}
    one = events(Parameters(**given), until=40.0)
    masses = [{"mass_ratio": QUIET["mass_ratio"] / count}] * count
    many = events(Parameters(**given, masses=masses), until=40.0)
    assert len(one) > 8
    for body in range(count):
        own = many[many["body"] == body]
        assert np.array_equal(own["kind"], one["kind"])
        for name in ("time", "x", "v", "approach_speed"):
            assert own[name] == pytest.approx(one[name], abs=2e-12)


@pytest.mark.exhaustive
def test_elastic_masses_share_their_energy_equally() -> None:
    """Means over a million impacts: a quarter each to x, to v and to each mass, to one per cent.

    Between events the primary swings and each mass flies, so these means have closed forms.
    Confidence limits are those of 40 batches.
    """
    p = damper_of({}, {"mass_ratio": 0.3, "clearance": 0.7}, restitution=1.0)
    x0, v0, u0 = 0.6, 0.3, [0.9, -0.4]
    until, batches = 1e6, 40
    start = State(x0, v0, [0.5, 0.5], u0)
    table = events(p, start, until=until, max_events=10**7)
    assert len(table) > 1e6
    assert set(table["kind"]) == {0}
    time = np.concatenate([[0.0], table["time"], [until]])
    x, v = (np.concatenate([[at], table[name]]) for at, name in ((x0, "x"), (v0, "v")))
    length = np.diff(time)
    # Of x = x0 cos t + v0 sin t.
    cos2, sin2 = 0.5 * np.sin(2.0 * length) / 2.0, np.sin(length) ** 2
    square = x * x * (length / 2.0 + cos2) + v * v * (length / 2.0 - cos2) + x * v * sin2
    twice = [square, (x * x + v * v) * length - square]
    energy = 0.5 * (x * x + v * v)
    for body, each in enumerate(p.each):
        own = table["v"] - table["side"] * table["approach_speed"]
        hit = np.concatenate([[True], table["body"] == body])
        last = np.maximum.accumulate(np.where(hit, np.arange(len(hit)), 0))
        u = np.concatenate([[u0[body]], own])[last]
        energy += 0.5 * each.mass_ratio * u * u
        twice.append(each.mass_ratio * u * u * length)
    assert energy == pytest.approx(energy[0], rel=5e-12)
    first = np.searchsorted(time[:-1], np.linspace(0.0, until, batches + 1)[:-1])
    lengths = np.add.reduceat(length, first)
    for part in twice:
        mean, error = mean_within(np.add.reduceat(part, first), lengths, 0.95)
        share, limit = mean / (2.0 * energy[0]), error / (2.0 * energy[0])
        assert limit < 0.012 / 4.0
        assert abs(share - 0.25) < 2.0 * limit


# --- units of measure, and what is refused


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"masses": []}, r"^masses: 0 are given; must be 1 to 100"),
    ({"masses": [{}] * 101}, r"^masses: 101 are given"),
    ({"masses": {"clearance": 1.0}}, r"^masses = .*: must be a sequence of mappings"),
    ({"masses": [0.3]}, r"^masses\[0\] = 0\.3: must be a mapping"),
    ({"masses": [{}, {"clearence": 1}]}, r"^masses\[1\]: .*'clearence' \(did you mean 'clearance'"),
    ({"masses": [{"damping_ratio": 1}]}, r"^masses\[0\]: unknown quantity of a mass 'damping_rat"),
    ({"masses": [{}, {"restitution": 2}]}, r"^mass 1: restitution = 2\.0: must be"),
    ({"masses": [{}, {"clearance": 0}]}, r"^clearance = 0\.0 of mass 1: each of several must"),
    ({"masses": [{}], "modulation_depth": 0.1}, r"^masses and modulation_depth: "),
    ({"masses": [{"mass_share": 0}]}, r"^mass 0: mass_share = 0\.0: must be .* <= mass_share"),
    ({"masses": {"count": 1.5}}, r"^count = 1\.5: must be a whole number >= 1 and <= 100"),
    ({"masses": {"count": 2, "clearance_spread": 1}}, r"^clearance_spread = 1: must be .* < 1"),
    ({"masses": {"count": 2, "clearances": 1}}, r"^unknown key of masses 'clearances'"),
    ({"unit_count": 2}, r"^unknown parameter 'unit_count': write masses: \{count: 4, clearance_sp"),
]


@pytest.mark.parametrize(("given", "message"), REFUSED, ids=lambda part: str(part)[:40])
def test_refused_by_name(given: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        Parameters(**GENERIC, **given)


def test_a_start_has_a_value_for_each() -> None:
    p = Parameters(**GENERIC, masses=equal_masses(2))
    with pytest.raises(ValueError, match=r"^state: y has 3 values for 2 free masses: must be one"):
        events(p, State(0.0, 0.0, [0.0, 0.1, 0.2], 0.0), until=1.0)
    with pytest.raises(ValueError, match=r"^state: u has 2 values for 1 free mass: must be one"):
        events(Parameters(**GENERIC), State(0.0, 0.0, 0.0, [0.1, 0.2]), until=1.0)
    far = GENERIC["clearance"] * 1.5
    with pytest.raises(ValueError, match=r"^state: .y\[1\] - x. = .* is outside the box"):
        events(p, State(0.0, 0.0, [0.0, far], 0.0), until=1.0)
