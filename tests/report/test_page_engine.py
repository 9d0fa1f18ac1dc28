"""The rigid damper as the page's script computes it, beside Python's, at random points."""

import json
import random
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import Browser

import damper
from damper.observers.motion import in_words

SCRIPT = Path(__file__).parents[2] / "workflow/report/engine.js"
RUN = """
damper.run = (model, from, cycles, see, most) => {
  const work = damper.stepwise(model, from, cycles, see, most);
  for (let turn = work.next(); ; turn = work.next()) if (turn.done) return turn.value;
};
"""
POINTS, CYCLES, TRANSIENT, RECORD = 500, 12, 150, 40
#: Events of a run that are compared: elastic impacts under a lasting force never end.
MOST = 3000


@cache
def points() -> list[tuple[dict[str, float], tuple[float, ...]]]:
    """Parameters from all regimes, and where the masses start."""
    drawn, rng = [], random.Random(3)
    for number in range(POINTS):
        p = {
            "mass_ratio": 10 ** rng.uniform(-3, 0),
            "damping_ratio": rng.choice([0.0, 0.02, 0.1, 0.5, 1.0, 2.0]),
            "frequency_ratio": 10 ** rng.uniform(-1, 0.6),
            "clearance": 10 ** rng.uniform(-2, 1),
            "restitution": rng.choice([0.0, 1.0, *np.linspace(0.05, 0.95, 8)]),
            "phase": rng.uniform(-3, 3),
        }
        p |= {"gravity": rng.uniform(-0.3, 0.3)} if number % 7 == 0 else {}
        p |= {"restitution_left": rng.random()} if number % 5 == 0 else {}
        p |= {"force_amplitude": 0.5} if number % 11 == 0 else {}
        x, v, place, rate = (rng.uniform(-1, 1) for _ in range(4))
        drawn.append((p, (x, v, x + place * p["clearance"], v + rate)))
    return drawn


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    page = tmp_path_factory.mktemp("page") / "page.html"
    page.write_text(f"<meta charset=utf-8><script>{SCRIPT.read_text()}{RUN}</script>")
    with Browser(page.as_uri()) as browser:
        browser.value(f"points = {json.dumps(points())}, null")
        yield browser
        assert browser.errors == []


def python_events(p: dict[str, float], start: tuple[float, ...]) -> np.ndarray:
    parameters = damper.Parameters(**p)
    state = damper.State(*start)
    found = damper.events(parameters, state, until=CYCLES * parameters.cycle, max_events=MOST)
    names = ("kind", "side", "time", "approach_speed", "x", "v")
    return np.column_stack([found[name].astype(float) for name in names])[:MOST]


def first_difference(one: np.ndarray, other: np.ndarray, limit: float) -> int:
    """Events that two runs have in common, to a part of their sizes."""
    count = min(len(one), len(other))
    one, other = one[:count], other[:count]
    near = (one[:, :2] == other[:, :2]).all(axis=1)
    size = 1.0 + abs(other[:, 2:]).max(axis=0, initial=0.0)
    near &= (abs(one[:, 2:] - other[:, 2:]) <= limit * size).all(axis=1)
    return count if near.all() else int(near.argmin())


def test_events_are_those_of_python(browser: Browser) -> None:
    found = browser.value(
        f"""points.map(([p, start]) => {{
            const model = damper.model(p), events = [];
            damper.run(model, damper.begin(model, start), {CYCLES}, (s) => s.cause < 0 ||
                events.push([s.cause, s.side, s.cycles * model.cycle + s.time, s.speed, s.x, s.v]),
                {MOST} + 1);
            return events.slice(0, {MOST});
        }})"""
    )
    whole = compared = 0
    for rows, (p, start) in zip(found, points(), strict=True):
        expected = python_events(p, start)
        page = np.reshape(np.array(rows, float), (-1, 6))
        same = first_difference(page, expected, 1e-9)
        whole += same == len(expected) == len(page)
        compared += same
        if same < max(len(expected), len(page)):
            # Then a start moved by 1e-12 has led elsewhere by there, too: the motion is unstable.
            x, v, y, u = start
            moved = python_events(p, (x + 1e-12, v, y + 1e-12, u))
            assert first_difference(moved, expected, 1e-9) <= same, (p, start)
    assert whole > 0.85 * POINTS, whole
    assert compared > 20_000, compared


def lossy() -> list[tuple[dict[str, float], tuple[float, ...]]]:
    """Some of the points, all with losses at impacts: they settle."""
    return [point for point in points() if point[0]["restitution"] < 1.0][::21]


def class_of(p: dict[str, float], start: tuple[float, ...], offset: float = 0.0) -> tuple[str, int]:
    x, v, y, u = start
    cube = damper.simulate(
        **p,
        initial_displacement=x + offset,
        initial_velocity=v,
        initial_position=(y - x) / p["clearance"],
        initial_relative_velocity=u - v,
        observers=["motion", "bursts"],
        transient=TRANSIENT,
        periods=RECORD,
    )
    values: dict[str, Any] = {name: array.item() for name, array in cube.data_vars.items()}
    return in_words(values), int(values["chatter"])


def test_classes_are_those_of_python(browser: Browser) -> None:
    found = browser.value(
        f"""{json.dumps(lossy())}.map(([p, start]) => {{
            const model = damper.model(p);
            const watch = damper.watch(model, {TRANSIENT}, {{cycles: {RECORD}}});
            const settled = damper.run(model, damper.begin(model, start), {TRANSIENT});
            damper.run(model, settled, {TRANSIENT + RECORD}, watch.see);
            return [damper.in_words(watch.result()), watch.result().chatter];
        }})"""
    )
    others = 0
    for (p, start), one in zip(lossy(), map(tuple, found), strict=True):
        if one != class_of(p, start):
            # Then a start as near as 1e-8 ends so in Python, too: the motion is chance.
            assert any(one == class_of(p, start, k * 1e-10) for k in range(1, 100)), (p, start, one)
            others += 1
    assert others < 0.1 * len(lossy())


def test_the_machine_of_the_form_moves_as_its_periodic_orbit(browser: Browser) -> None:
    """100 kg at 31.8 Hz under 200 N; the peak that Python finds as a root of the motion's speed."""
    given = {"mass": 100.0, "hertz": 31.8, "damping": 0.02, "force": 200.0, "free": 10.0}
    given |= {"gap": 0.9e-3, "restitution": 0.3}
    found = browser.value(f"damper.machine({json.dumps(given)})")
    size = 200.0 / (100.0 * (2.0 * np.pi * 31.8) ** 2)
    p = damper.Parameters(0.1, 0.02, 1.0, clearance=0.45e-3 / size, restitution=0.3)
    orbit = damper.periodic_orbit(p)
    assert orbit.stable
    assert found["peak"] == pytest.approx(orbit.peak * size, rel=1e-3)
    assert found["impacts"] == pytest.approx(2.0, abs=0.05)
    assert found["alone"] == pytest.approx(25.0 * size, rel=1e-12)
    far = browser.value(f"damper.machine({json.dumps(given | {'gap': 1e3})})")  # no wall comes
    assert far["peak"] == pytest.approx(far["alone"], rel=1e-3)
    assert far["impacts"] == 0
