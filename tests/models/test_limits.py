"""The limits of the mass ratio: a free mass that does not act back, and a fixed stop."""

import math
from itertools import pairwise

import numpy as np
import pytest
import scenes

import damper
from damper import IMPACT, STICK, Parameters, State, simulate
from damper.observers.common.laws import LAW_NAMES, broken


def test_between_two_stops_the_primary_flies_along_parts_of_sines() -> None:
    """x'' + x = 0: from stop to stop it takes 2 atan2(d, v), and v falls by r."""
    d, r, speed, time = 0.7, 0.99, 5.0, 0.0
    stops = Parameters(math.inf, 0.0, 1.0, d, r, forcing="none")
    found = damper.events(stops, State(d, speed, 0.0, 0.0), until=200.0)[:200]
    for k, event in enumerate(found):
        assert event["time"] == pytest.approx(time, rel=1e-14)
        assert event["approach_speed"] == pytest.approx(speed, rel=1e-13)
        assert event["x"] == (d if k % 2 == 0 else -d)
        speed *= r
        time += 2.0 * math.atan2(d, speed)
    assert len(found) == 200


def test_pressed_on_a_stop_the_primary_comes_to_exact_rest_and_leaves_with_the_force() -> None:
    """The stop at x = 1 holds it while sin(t/5) > 1/4 of the force, whatever the damping."""
    p = Parameters(math.inf, 0.3, 0.2, 1.0, 0.5, force_amplitude=4.0)
    found = damper.events(p, until=20.0)
    stick = int(np.flatnonzero(found["kind"] == STICK)[0])
    assert (found[stick]["x"], found[stick]["v"], found[stick]["side"]) == (1.0, 0.0, -1)
    assert found[stick + 1]["time"] == pytest.approx(5.0 * (math.pi - math.asin(0.25)), rel=1e-15)
    run = damper.start(p)
    run.advance(12.0)
    assert (run.state.x, run.state.v, run.state.y, run.state.u) == (1.0, 0.0, 0.0, 0.0)


def test_sensitivities_beside_a_fixed_stop_and_at_mass_ratio_zero() -> None:
    def start(name: str, p: Parameters, state: State | None) -> np.ndarray:
        orbit = damper.periodic_orbit(p, state=state)
        assert orbit.events.size
        return orbit.start if name == "at" else orbit.sensitivity(name)

    stops = [Parameters(math.inf, 0.05, 0.9, d, 0.9) for d in (0.35 - 1e-5, 0.35, 0.35 + 1e-5)]
    low, _, high = (start("at", p, None) for p in stops)
    change = start("clearance", stops[1], None)
    assert change == pytest.approx((high - low) / 2e-5, abs=1e-6)
    light = [Parameters(mu, 0.05, 0.9, 0.8, 0.9) for mu in (0.0, 1e-6)]
    state = State(0.0, 0.0, 0.0, 1.0)
    low, high = (start("at", p, state) for p in light)
    assert start("mass_ratio", light[0], state) == pytest.approx((high - low) / 1e-6, rel=1e-4)


def test_a_ball_that_does_not_act_back_bounces_on_a_primary_that_stays_at_rest() -> None:
    """No sag, and no drift by the weight: x is 0 to the last bit."""
    p = Parameters(0.0, 0.05, 1.0, 1.0, 0.5, forcing="none", gravity=2.0)
    found = damper.events(p, State(0.0, 0.0, 0.0, 0.0), until=100.0)
    first = found[found["kind"] == IMPACT]
    assert not found["x"].any()
    assert not found["v"].any()
    assert first["time"][0] == 1.0
    assert found["time"][-1] == pytest.approx(3.0, rel=1e-15)


def test_several_masses_of_which_some_do_not_act_back() -> None:
    """A ball of no mass does not change the events of the other one."""
    values = scenes.GENERIC | {"clearance": 0.5}
    both = simulate_events(values | {"masses": [{}, {"mass_ratio": 0.0, "restitution": 0.3}]})
    alone = simulate_events(values)
    mine = both[both["body"] == 0]
    assert len(alone) > 20
    assert mine["time"] == pytest.approx(alone["time"], rel=1e-11)
    assert (both["body"] == 1).sum() > 20


def simulate_events(values: dict) -> np.ndarray:
    return damper.events(Parameters(**values), until=100.0)


LIMITS = {"no mass": {"mass_ratio": 0.0}, "stop": {"mass_ratio": math.inf}}
#: Feature -> what it adds, and the limits that do not have it.
FEATURES = {
    "plain": ({}, ()),
    "unlike walls": ({"restitution_left": 0.3}, ()),
    "yielding": ({"yield_speed": 0.05}, ()),
    "stuck": ({"clearance": 0.0}, ()),
    "gravity": ({"gravity": 0.3}, ("stop",)),
    "friction": ({"friction": 0.05}, ("stop",)),
    "one wall": ({"walls": "left", "initial_velocity": 1.0}, ()),
    "one wall below": ({"walls": "left", "gravity": 0.2}, ("stop",)),
    "support": ({"support_stiffness_ratio": 0.05}, ("no mass", "stop")),
    "dashpot": ({"support_damping_ratio": 0.05}, ("no mass", "stop")),
    "compliant": ({"contact_stiffness_ratio": 1e3}, ("no mass", "stop")),
    "time_varying": ({"modulation_depth": 0.3}, ("no mass", "stop")),
    "several": ({"masses": [{}, {"clearance": 0.4}]}, ("stop",)),
    "base": ({"forcing": damper.Base(frame="base")}, ("stop",)),
    "quake": ({"forcing": damper.Record([0, 1, 2], [0, 1, 0], of="base_acceleration")}, ("stop",)),
    "record": ({"forcing": damper.Record([0, 1, 3], [1, 2, -1], after="hold")}, ()),
    "harmonics": ({"forcing": damper.Harmonics((1, 2), (1.0, 0.5))}, ()),
    "free motion": ({"forcing": "none", "initial_velocity": 1.0}, ()),
}


@pytest.mark.parametrize("limit", LIMITS)
@pytest.mark.parametrize("feature", FEATURES)
def test_each_feature_works_at_a_limit_or_is_refused_by_name(feature: str, limit: str) -> None:
    more, refused = FEATURES[feature]
    values = scenes.QUIET | LIMITS[limit] | more
    if limit in refused:
        name = "mass_ratio = inf" if feature == "several" else f"^{[*more][-1]}"
        with pytest.raises(ValueError, match=name):
            Parameters(**values)
        return
    cube = simulate(**values, observers=["laws", "response"], transient=0, periods=1)
    found = {name: np.atleast_1d(cube[name].values) for name in (*LAW_NAMES, "status")}
    assert not found["status"].any()
    assert not broken(found | {"segments": np.atleast_1d(cube.segments.values)}).any(), found
    size = float(cube.dashpot_loss + cube.impact_loss + abs(cube.energy_input)) + 1.0
    assert abs(float(cube.energy_residual)) < 1e-13 * size


def test_a_stop_stands_still_however_a_run_starts() -> None:
    run = damper.start(**scenes.QUIET | {"mass_ratio": math.inf}, initial_displacement=0.1)
    run.advance(50.0)
    assert (run.state.y, run.state.u) == (0.0, 0.0)
    walls = run.events[run.events["kind"] == IMPACT]
    assert {*walls["x"].tolist()} == {-0.25, 0.25}
    with pytest.raises(ValueError, match=r"state: u = 0\.1 of a fixed stop"):
        damper.events(run.parameters, State(0.0, 0.0, 0.0, 0.1), until=1.0)
    with pytest.raises(ValueError, match=r"^initial_relative_velocity = 1 with mass_ratio = inf"):
        damper.events(
            **scenes.QUIET | {"mass_ratio": math.inf}, initial_relative_velocity=1, until=1
        )


def test_lyapunov_exponents_beside_a_stop_are_those_of_the_primary() -> None:
    """Flights shrink areas with the dashpot, and each impact by the square of r."""
    values = {**scenes.GENERIC, "mass_ratio": math.inf, "clearance": 0.35, "restitution": 0.9}
    cube = simulate(**values, observers=["lyapunov", "impacts"], transient=20, periods=20)
    exponents = cube.lyapunov_exponents.values
    assert np.isnan(exponents[2:]).all()
    damped = 4.0 * math.pi * values["damping_ratio"] / values["frequency_ratio"]
    lost = 2.0 * math.log(0.9) * float(cube.impacts_per_period)
    assert exponents[:2].sum() == pytest.approx(lost - damped, rel=1e-12)


def test_the_stops_of_neighbours_stay_where_they_are() -> None:
    values = scenes.GENERIC | {"mass_ratio": math.inf, "clearance": [0.2, 0.3, 0.4]}
    follow = {"follow": {"clearance": "both"}, "transient": 5, "periods": 3}
    cube = simulate(**values, observers=["trajectory"], **follow)
    assert not cube.status.any()
    assert float(abs(cube.trajectory_free_displacement).max()) < 1e-15


# --- one wall, and a box whose motion is prescribed

TABLE = {
    "mass_ratio": 0.0,
    "damping_ratio": 0.0,
    "frequency_ratio": 1.0,
    "clearance": 0.0,
    "walls": "left",
    "carrier": "prescribed",
}


def test_a_bouncing_ball_in_closed_form() -> None:
    """A ball falls from 1 m on a fixed floor."""
    p = Parameters(**TABLE, restitution=0.9, gravity=9.81, forcing="none")
    found = damper.events(p, State(0.0, 0.0, 1.0, 0.0), until=10.0)
    time = math.sqrt(2.0 / 9.81)
    speed = 9.81 * time
    for k in range(200):
        assert found["time"][k] == pytest.approx(time, rel=1e-14)
        assert found["approach_speed"][k] == pytest.approx(speed, rel=1e-13)
        speed *= 0.9
        time += 2.0 * speed / 9.81
    assert found["kind"][-1] == STICK
    assert found["time"][-1] == pytest.approx(8.57894917872889, rel=1e-15)


def test_one_stop_sends_back_half_sines() -> None:
    """x'' + x = 0 with a stop at x = 0: an impact each half of a period."""
    p = Parameters(math.inf, 0.0, 1.0, 0.0, 0.9, walls="left", forcing="none")
    found = damper.events(p, State(0.0, -1.0, 0.0, 0.0), until=630.0)[:200]
    assert found["time"] == pytest.approx(math.pi * np.arange(1.0, 201.0), rel=1e-14)
    assert found["approach_speed"] == pytest.approx(0.9 ** np.arange(200.0), rel=1e-13)
    assert not found["x"].any()


def test_flights_beside_one_stop_under_a_force_are_those_of_the_closed_form() -> None:
    """Each flight of x'' + x = A cos(t/2), from the one before: x(t) = 4A/3 cos(t/2) + ..."""
    amplitude, d = 2.0, 0.5
    forced = {"phase": math.pi / 2, "force_amplitude": amplitude, "walls": "left"}
    p = Parameters(math.inf, 0.0, 0.5, d, 0.9, **forced)
    found = damper.events(p, until=1200.0)
    hits = found[found["kind"] == IMPACT][:200]
    gain = amplitude / (1.0 - 0.25)
    assert len(hits) == 200
    for before, after in pairwise(hits):
        t0, t1 = before["time"], after["time"]
        c, s = d - gain * math.cos(t0 / 2), before["v"] + 0.5 * gain * math.sin(t0 / 2)
        x = c * math.cos(t1 - t0) + s * math.sin(t1 - t0) + gain * math.cos(t1 / 2)
        v = s * math.cos(t1 - t0) - c * math.sin(t1 - t0) - 0.5 * gain * math.sin(t1 / 2)
        stuck = ((found["kind"] == STICK) & (found["time"] > t0) & (found["time"] < t1)).any()
        if not stuck and t1 - t0 > 1e-3:
            # The displacement errs by the speed times the roundoff of the clock.
            assert x == pytest.approx(d, abs=1e-12)
            assert v == pytest.approx(after["approach_speed"], rel=1e-11, abs=1e-12)


def test_a_prescribed_table_is_a_primary_that_does_not_feel_the_ball() -> None:
    """Of a resonant primary with damping 1/2 the steady motion has the amplitude 1."""
    values = {"gravity": 0.6, "restitution": 0.5}
    primary = values | TABLE | {"damping_ratio": 0.5, "carrier": "oscillator"}
    moving = damper.events(Parameters(**values, **TABLE), State(0.0, 1.0, 2.0, 0.0), until=60.0)
    p = Parameters(**primary, phase=math.pi / 2)
    steady = damper.events(p, State(0.0, 1.0, 2.0, 0.0), until=60.0)
    assert {*moving["kind"].tolist()} == {0, 1, 2}
    assert moving["kind"].tolist() == steady["kind"].tolist()
    assert moving["time"] == pytest.approx(steady["time"], rel=1e-13, abs=1e-11)
    assert abs(moving["x"] - np.sin(moving["time"])).max() < 1e-14


def test_a_table_that_shakes_at_random_falls_away_from_the_ball() -> None:
    """Between samples the box accelerates with 3 t: the ball stays to where that is -g."""
    quake = damper.Record([0.0, 1.0, 2.0], [0.0, -3.0, -3.0], of="base_acceleration")
    p = Parameters(**TABLE, restitution=0.0, gravity=1.5, forcing=quake)
    found = damper.events(p, State(0.0, 0.0, 0.0, 0.0), until=2.0)
    assert found["kind"].tolist() == [STICK, damper.RELEASE]
    assert found["time"][1] == pytest.approx(0.5, rel=1e-15)
    assert found["v"][1] == pytest.approx(-0.375, rel=1e-15)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"mass_ratio": 0.1}, r"mass_ratio = 0\.1 with carrier = 'prescribed': nothing acts back"),
        ({"damping_ratio": 0.1}, r"damping_ratio = 0\.1 with carrier = 'prescribed': there is no"),
        ({"forcing": damper.Record([0, 1], [0, 1])}, "would jump in velocity"),
        ({"forcing": damper.Base(frame="base")}, "give damper.Harmonic"),
        ({"masses": [{}]}, "masses and carrier"),
        ({"contact_stiffness_ratio": 1e3}, "different models"),
        ({"contact_stiffness_ratio": 1e3, "carrier": "oscillator"}, "walls and contact_stiffness"),
        ({"walls": 2}, r"walls = 2: must be a finite number with -1 <= walls <= 1, whole"),
    ],
)
def test_what_a_box_does_not_have_is_refused_by_name(given: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Parameters(**{**TABLE, "restitution": 0.5, **given})


def test_words_name_walls_and_carrier() -> None:
    p = Parameters(**TABLE, restitution=0.5)
    assert "walls='left', carrier='prescribed'" in repr(p)
    assert eval(repr(p), vars(damper)) == p
    for name, word in (("walls", "up"), ("carrier", "rail")):
        with pytest.raises(TypeError, match=f"unknown {name} '{word}': must be one of"):
            Parameters(**{**TABLE, "restitution": 0.5, name: word})
    with pytest.raises(ValueError, match="response does not know a prescribed box"):
        simulate(**TABLE, restitution=0.5, observers=["response"], periods=1)


@pytest.mark.parametrize(("walls", "lines"), [("left", 1), ("both", 2)])
def test_figures_show_the_walls_that_there_are(walls: str, lines: int) -> None:
    values = {**TABLE, "walls": walls, "clearance": 0.5, "restitution": 0.5, "until": 5.0}
    above, *_ = damper.run(**values).plot().axes
    drawn = [line for line in above.get_lines() if line.get_color() == "#777777"]
    assert len(drawn) == lines
    assert bool(above.collections) == (walls == "both")
