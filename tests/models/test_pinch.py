"""Two masses that pinch the primary: infinitely many impacts in no time, against many digits."""

import random
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from event_pairs import KINDS

from damper import Parameters, State, events
from damper.engine.segment import FLIGHT, IMPACT, TAIL
from damper.models import start_run
from damper.models.many import ACCUMULATION, CAUSE, GAP, MODE, RATE, SIDE
from damper.models.several.bodies import LEFT, WIDTH
from damper.models.several.log import segment_of_all
from damper.models.several.motion import state_in
from damper.models.several.pinch import close_pinch, share_of_pinch
from damper.models.tangent import derivative
from damper.observers.common.laws import broken
from damper.sweep.runs import run_points
from damper.verification.reference import exact_run

PINCH: dict[str, Any] = {
    "mass_ratio": 20.0,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.8,
    "clearance": 1.0,
    "restitution": 0.3,
    "masses": [{}, {"mass_ratio": 30.0, "restitution": 0.2}],
}
START = (0.5, 0.0, [-0.45, 1.45], [-1.0, 1.0])


def pinched(seed: int, parts: int = 1) -> tuple[Any, np.ndarray]:
    """A model of two heavy masses, and its bodies: mass 0 has hit, mass 1 comes next, in parts."""
    draw = random.Random(f"pinch, {seed}")
    masses = [
        {"mass_ratio": 10 ** draw.uniform(-0.5, 3), "restitution": draw.choice([0, 1]) * r}
        for r in (draw.uniform(0, 0.6), draw.uniform(0, 0.6))
    ]
    masses[1]["mass_ratio"] /= parts
    masses += [masses[1]] * (parts - 1)
    model = start_run(Parameters(**PINCH | {"masses": masses})).model
    bodies = np.zeros((1 + parts, WIDTH))
    bodies[:, MODE], bodies[:, SIDE], bodies[:, CAUSE] = FLIGHT, 1, -1
    bodies[0, SIDE], bodies[0, CAUSE] = -1, IMPACT
    bodies[0, RATE], bodies[1:, RATE] = draw.uniform(0, 1), -draw.uniform(0, 1)
    bodies[1:, GAP] = 1e-20
    return model, bodies


def impacts(model: Any, bodies: np.ndarray) -> list[tuple[Fraction, np.ndarray]]:
    """Two hundred impacts in whole numbers: time between, and bodies before; fewer if they end."""
    mass = [Fraction(float(ratio)) for ratio in model.masses[:, 0]]
    restitution = [Fraction(float(model.masses[k, LEFT + k])) for k in range(2)]
    gap, rate = ([Fraction(float(b[name])) for b in bodies] for name in (GAP, RATE))
    found: list[tuple[Fraction, np.ndarray]] = []
    for number in range(200):
        k = (number + 1) % 2
        if rate[k] >= 0:
            break
        # Digits beyond the two hundredth are cut: whole numbers would grow with each impact.
        step = Fraction(round(-gap[k] / rate[k] * 10**200), 10**200)
        before = bodies.copy()
        before[:, GAP], before[:, RATE] = [float(g) for g in gap], [float(w) for w in rate]
        before[1 - k, CAUSE], before[k, CAUSE] = IMPACT, -1
        found.append((step, before))
        gap[1 - k] = Fraction(round((gap[1 - k] + rate[1 - k] * step) * 10**200), 10**200)
        gap[k] = Fraction(0)
        rate[1 - k] += mass[k] * (1 + restitution[k]) * rate[k] / (1 + mass[k])
        rate[k] *= -restitution[k]
        rate = [Fraction(round(w * 10**200), 10**200) for w in rate]
    return found


def test_what_is_left_is_the_sum_of_all_impacts() -> None:
    """And a pinch is told from masses that part soon."""
    endless = 0
    for seed in range(60):
        model, bodies = pinched(seed)
        made = impacts(model, bodies)
        endless += len(made) == 200
        for number, (_, before) in enumerate(made[:50]):
            close_pinch(model, before)
            if before[0, MODE] == TAIL:
                left = float(sum(step for step, _ in made[number:]))
                # Each turn takes no more than its part of the one before.
                assert left * (1 - 1e-12) <= -before[0, ACCUMULATION] < 3 * left, seed
                break
        assert (before[0, MODE] == TAIL) == (len(made) == 200), seed
    assert 10 < endless < 50


def test_each_mass_loses_what_its_impacts_take() -> None:
    """Impact by impact; of heavy masses these are many thousands. Masses in step share."""
    shares = []
    for seed in range(60):
        model, bodies = pinched(seed)
        if len(impacts(model, bodies)) < 200:
            continue
        rate, speed, k, lost = float(bodies[0, RATE]), -float(bodies[1, RATE]), 1, [0.0, 0.0]
        while speed > 1e-9:
            mu, r = float(model.masses[k, 0]), float(model.masses[k, LEFT + k])
            lost[k] += mu / (1 + mu) * (1 - r * r) * speed**2
            rate, speed, k = r * speed, mu * (1 + r) / (1 + mu) * speed - rate, 1 - k
        bodies[:, MODE] = TAIL
        found = [share_of_pinch(model, bodies, k) for k in range(2)]
        assert found == pytest.approx(np.array(lost) / sum(lost), rel=1e-10), seed
        model, bodies = pinched(seed, parts=3)
        bodies[:, MODE] = TAIL
        thirds = [share_of_pinch(model, bodies, k) for k in range(4)]
        assert thirds == pytest.approx([found[0], *[found[1] / 3] * 3], rel=1e-9), seed
        shares.append(found[0])
    assert min(shares) < 0.35 < 0.65 < max(shares)
    bodies[3, MODE] = FLIGHT
    assert share_of_pinch(model, bodies, 3) == 0.0


def test_against_many_digits() -> None:
    """Impacts, where they come to an end, the common velocity, and all that follows."""
    table = events(Parameters(**PINCH), State(*START), until=4.0)
    end = float(table["time"][table["kind"] != 0][0])
    exact = exact_run(PINCH, START, until=end - 1e-13, digits=20)
    found = table[table["time"] < end - 1e-12]
    assert len(found) > 12
    for row, e in zip(found, exact.events, strict=False):
        assert (row["kind"], row["body"], row["side"]) == (KINDS[e.kind], e.body, e.side)
        assert row["time"] == pytest.approx(float(e.time), abs=1e-15)
        assert row["approach_speed"] == pytest.approx(float(e.approach_speed), abs=1e-13)
    # The last times of one body are a geometric series.
    *_, a, b, c = [e.time for e in exact.events if e.body == 0]
    assert end == pytest.approx(float(c - (c - b) ** 2 / (c - 2 * b + a)), abs=1e-14)
    # The centre goes on as if nothing had happened, and is where both are at their walls.
    x, v, y0, u0, y1, u1 = exact.final
    v = (v + 20 * u0 + 30 * u1) / 51
    x = (x + 20 * y0 + 30 * y1) / 51 + v * 1e-13 + (20 - 30) / 51
    last = table[table["time"] == end][-1]
    assert [last["x"], last["v"]] == pytest.approx([float(x), float(v)], abs=1e-14)
    after = exact_run(PINCH, (x, v, [x - 1, x + 1], [v, v]), until=4.0, start_time=end, digits=16)
    later = [e for e in after.events if e.time > end + 1e-9]
    rows = table[table["time"] > end]
    assert {"impact", "stick", "release"} == {e.kind for e in later}
    sticks = [[r["time"] for r in rows if r["kind"] == 1], [e.time for e in later]]
    sticks[1] = [float(e.time) for e in later if e.kind == "stick"]
    assert sticks[0] == pytest.approx(sticks[1], abs=1e-11)


def test_a_mass_that_rests_among_those_that_pinch_has_no_speed_left() -> None:
    """It comes to rest on its wall at the instant at which the speeds of others fade away."""
    model, bodies = pinched(0)
    bodies[:, [MODE, GAP, RATE]] = TAIL, 0.0, 0.0
    bodies[:, ACCUMULATION] = -1e-200, 0.0
    segment = segment_of_all(0.0, 0.0, 0.1, 0.2, bodies)
    x, v, y, u = state_in(model, segment, 0.0)
    assert (x, v, u.tolist()) == (0.1, 0.2, [0.2, 0.2])
    assert y.tolist() == [0.1 - 1.0, 0.1 + 1.0]


def test_laws_and_energy() -> None:
    ask = {"transient": 0, "periods": 1}
    found, _ = run_points([PINCH], ["laws", "response"], state=State(*START), **ask)
    assert found["status"] == 0
    assert not broken(found).any()
    turnover = found["energy_input"] + found["dashpot_loss"] + found["impact_loss"]
    assert abs(found["energy_residual"]) < 1e-12 * turnover


def test_masses_in_step_pinch_as_one() -> None:
    parts = [PINCH["masses"][0], *[{"mass_ratio": 15.0, "restitution": 0.2}] * 2]
    whole = events(Parameters(**PINCH), State(*START), until=0.5)
    x, v, y, u = START
    many = events(
        Parameters(**PINCH | {"masses": parts}), State(x, v, [*y, y[1]], [*u, u[1]]), until=0.5
    )
    for body in range(3):
        one, own = whole[whole["body"] == min(body, 1)], many[many["body"] == body]
        assert np.array_equal(own["kind"], one["kind"])
        for name in ("time", "x", "v", "approach_speed"):
            assert own[name] == pytest.approx(one[name], abs=1e-12)


def test_an_elastic_mass_rests_where_one_at_the_other_wall_loses_its_speed() -> None:
    """It has no sequence of its own. They rest at one instant, a geometric series."""
    values = {"damping_ratio": 0.0, "force_amplitude": 0.0, "frequency_ratio": 1.0}
    masses = [{"restitution": 1.0}, {"restitution": 0.66, "gravity": 400.0}]
    p = Parameters(mass_ratio=19.0, clearance=1.0, restitution=0.6, masses=masses, **values)
    table = events(p, State(0.0, 0.0, [0.9999, -0.9998], [0.0, 0.0]), until=0.1)
    rests = table[table["kind"] == 1]
    assert rests["body"].tolist() == [0, 1]
    assert rests["time"][0] == rests["time"][1]
    hits = table[table["body"] == 0]["time"]
    a, b, c = hits[-41:-10:15]
    assert rests["time"][0] == pytest.approx(c - (c - b) ** 2 / (c - 2 * b + a), abs=1e-12)
    found, _ = run_points(
        [p.given], ["laws"], state=State(0.0, 0.0, [0.9999, -0.9998], 0.0), transient=0, periods=1
    )
    assert not broken(found).any()


def test_what_a_search_leaves_open_is_not_in_the_log(monkeypatch: pytest.MonkeyPatch) -> None:
    """A run ends where its search gave up, whatever others would do later."""
    monkeypatch.setattr("damper.engine.search.MAX_STEPS", 3)
    found, _ = run_points([PINCH], ["laws"], state=State(*START), transient=0, periods=1)
    assert found["status"] == 2
    assert not broken(found).any()


def test_deviations_are_differences_of_runs() -> None:
    p = Parameters(**PINCH)
    start = np.array([START[0], START[1], START[2][0], START[3][0], START[2][1], START[3][1]])

    def at_end(z: np.ndarray) -> np.ndarray:
        run = start_run(p, State(z[0], z[1], z[2::2].tolist(), z[3::2].tolist()))
        run.skip(*run.whole_periods(0.5))
        s = run.state_at(*run.whole_periods(0.5))
        return np.array([s.x, s.v, s.y[0], s.u[0], s.y[1], s.u[1]])

    [direction] = np.random.default_rng(3).normal(size=(1, 6))
    h = 1e-7
    slope = (at_end(start + h * direction) - at_end(start - h * direction)) / (2 * h)
    run_ = start_run(p, State(*START))
    found = derivative(run_, *run_.whole_periods(0.5)) @ direction
    assert found == pytest.approx(slope, abs=1e-6)
