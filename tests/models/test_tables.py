"""Restitution by a table: linear in the logarithm of the approach speed between its rows."""

import json
import random
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from event_pairs import assert_as_in_digits, length_of
from scenes import GENERIC, QUIET, SI, scene_of

from damper import Parameters, SIParameters, events, periodic_orbit, simulate
from damper.engine.impact import TabledRestitution, rebound_slope, restitution_change
from damper.observers.laws import LAW_NAMES
from damper.study.config import load_study
from damper.study.yaml_file import ConfigError
from damper.sweep.record import recorded
from damper.sweep.runs import run_points
from damper.sweep.slices import run_part

IMPACT = 0
TABLE = [(0.05, 0.5), (0.1, 0.6), (0.4, 0.45), (2.0, 0.4)]
BASE = {name: value for name, value in GENERIC.items() if name != "restitution"}
SLOW = {name: value for name, value in QUIET.items() if name != "restitution"}
BOTH = {"restitution_table": TABLE}


def table(draw: random.Random, r: float, speed: float) -> list[tuple[float, float]]:
    """A table that begins with this row, and both falls and rises."""
    rows = [(speed, r)]
    for _ in range(draw.randint(0, 4)):
        decades = draw.uniform(0.1, 1.5)
        least = rows[-1][1] / (1.0 + decades) + 1e-9
        most = max(least, min(0.9, rows[-1][1] + 0.2))
        rows.append((rows[-1][0] * float(np.exp(decades)), draw.uniform(least, most)))
    return rows


def scene(model: str, seed: int, features: str = "") -> tuple[dict[str, Any], tuple[Any, ...]]:
    """A random damper, with tables in place of most restitutions."""
    values, state = scene_of(model, "two harmonics", seed, features)
    draw = random.Random(f"{model}, {seed}")
    for own in (values, *values.get("masses", ())):
        own.pop("yield_speed", None)
        for name in ("restitution", "restitution_left"):
            if name in own and (own is values or draw.random() < 0.7):
                rows = table(draw, own.pop(name), 10 ** draw.uniform(-3.0, -0.5))
                own[name.replace("restitution", "restitution_table")] = rows
    return values, state


@pytest.mark.parametrize(
    ("model", "features"),
    [
        ("rigid", "unlike walls"),
        ("grounded", ""),
        pytest.param("time_varying", "gravity", marks=pytest.mark.exhaustive),
        ("sliding", "unlike walls"),
        ("several", ""),
        ("several, sliding", ""),
        ("several, grounded", ""),
    ],
)
def test_events_are_those_of_many_digits(model: str, features: str) -> None:
    """Of the reference, which has the table by a formula of its own."""
    kinds: set[str] = set()
    for seed in range(1):
        values, state = scene(model, seed, features)
        kinds |= {*assert_as_in_digits(values, state, length_of(values, state, 25))}
    assert {"impact"} <= kinds


@pytest.mark.parametrize("more", [{}, {"masses": [{}, {"clearance": 0.3}]}])
def test_a_table_of_one_row_is_a_constant_restitution(more: dict[str, Any]) -> None:
    """To the bit; also where the walls differ, and one of them has a number."""
    constant = events(Parameters(**SLOW, restitution=0.3, restitution_left=0.4, **more), until=40.0)
    for walls in (
        {"restitution_table": [(7.0, 0.3)], "restitution_table_left": [(0.1, 0.4)]},
        {"restitution_table": [(7.0, 0.3)], "restitution_left": 0.4},
        {"restitution": 0.3, "restitution_table_left": [(0.1, 0.4)]},
    ):
        assert events(Parameters(**SLOW, **walls, **more), until=40.0).tobytes() == (
            constant.tobytes()
        )


def test_a_change_on_the_way_to_small_speeds_counts() -> None:
    """The coefficient is the limit again at 0.4, yet the sequence from there is another one."""
    law = TabledRestitution(np.array([(0.1, 0.5), (0.2, 0.6), (0.4, 0.5), (0.8, 0.45)]))
    changes = [restitution_change(law, speed) for speed in (0.1, 0.2, 0.4, 0.8)]
    np.testing.assert_allclose(changes, [0.0, 0.1, 0.1, 0.1], atol=1e-15)
    slopes = [0.5, 0.6 + 0.1 / np.log(2.0), 0.5 - 0.1 / np.log(2.0), 0.45]
    found = [rebound_slope(law, speed) for speed in (0.05, 0.2, 0.4, 0.9)]
    np.testing.assert_allclose(found, slopes, atol=1e-15)


@pytest.mark.parametrize("name", ["stiffness", "primary_mass"])
def test_sensitivities_are_differences_of_orbits(name: str) -> None:
    """In SI units, where a parameter moves the table's speeds against those of the damper."""
    values = {key: value for key, value in SI.items() if key != "restitution"}
    p = SIParameters(**values, restitution_table=[(0.01, 0.9), (2.0, 0.3)])
    orbit = periodic_orbit(p, settle=20)
    speeds = orbit.events["approach_speed"]
    assert 0.01 < speeds.min() < speeds.max() < 2.0
    step = 1e-5 * getattr(p, name)
    ends = [
        periodic_orbit(replace(p, **{name: getattr(p, name) + k * step}), state=orbit.state).state
        for k in (-1, 1)
    ]
    low, high = (np.array([end.x, end.v, end.y, end.u]) for end in ends)
    known = (high - low) / (2.0 * step)
    np.testing.assert_allclose(orbit.sensitivity(name), known, atol=1e-6 * abs(known).max())


def test_exponents_add_up_to_what_volumes_shrink_by() -> None:
    """Each impact multiplies them by d(r v)/dv and r: the slope of the table, by hand."""
    rows = [(v, r + 0.3) for v, r in TABLE]
    p = Parameters(**BASE, restitution_table=rows)
    cube = simulate(p, transient=2, periods=10, observers=["lyapunov"])
    found = events(p, until=12 * p.cycle)
    time, speed = found["time"], found["approach_speed"]
    inside = (found["kind"] == IMPACT) & (time >= 2 * p.cycle)
    assert (found["kind"] == IMPACT).all()
    (log_v, r), v = np.log(np.array(rows)).T, speed[inside]
    r = np.exp(r)
    at = np.interp(np.log(v), log_v, r)
    which = np.clip(np.searchsorted(log_v, np.log(v)) - 1, 0, len(r) - 2)
    slope = np.where(
        (v < rows[0][0]) | (v > rows[-1][0]), 0.0, (np.diff(r) / np.diff(log_v))[which]
    )
    shrunk = np.log(at * (at + slope)).sum() / 10 - 2.0 * p.damping_ratio * p.cycle
    assert float(cube.lyapunov_exponents.sum()) == pytest.approx(shrunk, abs=1e-10)


def test_a_cube_keeps_its_tables() -> None:
    """More of its points can be run; no law of the model is broken."""
    axes: dict[str, Any] = {"clearance": [0.2, 0.25]}
    seen = {"response": {}, "laws": {}}
    masses = [{"restitution": 0.4}, {"restitution_table_left": [(0.1, 0.5)]}]
    cube = simulate(**SLOW | axes | BOTH, masses=masses, transient=0, periods=1, observers=seen)
    assert max(float(cube[name].max()) for name in LAW_NAMES) < 1e-12
    place = {name: float(cube[name][()] if not cube[name].ndim else 0.25) for name in SLOW}
    again, _ = run_points([place | {"restitution_0": 0.4}], **recorded(cube))
    assert again["rms_displacement"][0] == float(cube.rms_displacement[1])
    alone = cube.damper.run(clearance=0.25).parameters
    assert [q.law for q in alone.each] == ["constant", "tabled"]
    assert alone.each[1].tables[0] == ((0.1, 0.5),)


REFUSED = {
    "rows 1 and 2: from (0.1, 0.6) to (0.2, 0.2) the rebound speed falls": (
        {"restitution_table": [(0.05, 0.5), (0.1, 0.6), (0.2, 0.2)]}
    ),
    "rows 0 and 1: speeds = 0.2, 0.1: must rise": {"restitution_table": [(0.2, 0.5), (0.1, 0.5)]},
    "row 1: restitution = 1.01: must be from 0 to 1": (
        {"restitution_table": [(0.1, 0.9), (0.2, 1.01)]}
    ),
    "row 0: speed = 0.0: must be": {"restitution_table": [(0, 0.9)]},
    "it is empty": {"restitution_table": []},
    "must be rows": {"restitution_table": [np.array(0.5)]},
    "restitution = 0.6 and restitution_table: the table says it": BOTH | {"restitution": 0.6},
    "yield_speed (yielding) and restitution_table (tabled) ask for different contact laws": (
        BOTH | {"yield_speed": 0.1}
    ),
    "restitution_table and contact_stiffness_ratio: compliant contact has a constant": (
        BOTH | {"contact_stiffness_ratio": 1e3}
    ),
}


@pytest.mark.parametrize("message", REFUSED)
def test_what_is_refused(message: str) -> None:
    with pytest.raises((ValueError, TypeError)) as caught:
        Parameters(**BASE, **REFUSED[message])
    assert message in str(caught.value)


def test_a_rebound_that_falls_between_two_rows_is_refused() -> None:
    """It does so where r + dr/d(log v) < 0 at the end of the interval: r must fall less than so."""
    for decades in (0.1, 0.7, 3.0):
        limit = 0.8 / (1.0 + decades)
        rows = [(0.1, 0.8), (0.1 * np.exp(decades), limit * (1.0 + 1e-9))]
        speeds = np.geomspace(rows[0][0], rows[1][0], 1001)
        r = np.interp(np.log(speeds), *np.array([(np.log(v), r) for v, r in rows]).T)
        assert all(low <= high for low, high in pairwise(r * speeds))
        Parameters(**BASE, restitution_table=rows)
        with pytest.raises(ValueError, match=r"rows 0 and 1.*rebound speed falls"):
            Parameters(**BASE, restitution_table=[rows[0], (rows[1][0], limit * (1.0 - 1e-9))])


def test_a_missing_restitution_is_asked_for() -> None:
    for more in ({}, {"restitution_table_left": TABLE}, {"masses": [{}, BOTH]}):
        with pytest.raises(TypeError, match=r"missing.*: restitution or restitution_table$"):
            Parameters(**BASE, **more)


def test_si_units_are_scaled_with_the_speed() -> None:
    values = {key: value for key, value in SI.items() if key != "restitution"}
    masses = [{}, {"restitution_table_left": [(1.0, 0.4)], "gap": 0.02}]
    p = SIParameters(**values, restitution_table=[(0.1, 0.6), (1.0, 0.5)], masses=masses)
    assert p.dimensionless.restitution_table == ((0.2, 0.6), (2.0, 0.5))
    assert p.dimensionless.each[1].restitution_table_left == ((2.0, 0.4),)
    assert SIParameters.of(p.dimensionless, 2.0, 200.0, 10.0).given == p.given


STUDY = """
title: Tables
source: Ours.
parameters:
  mass_ratio: 0.1
  damping_ratio: 0.05
  frequency_ratio: 0.2
  restitution_table: [[0.1, 0.6], [1, 0.5]]
masses: [{}, {restitution_table_left: [[0.1, 0.3]]}, {restitution: 0.2}]
axes: {clearance: {values: [0.2, 0.25]}}
periods: 1
transient: 0
observers: {response: {}}
"""


def test_a_study_has_tables(tmp_path: Path) -> None:
    """Of all masses and of one, in its jobs as in the call; a mistake names the rows."""
    path = tmp_path / "study.yaml"
    path.write_text(STUDY)
    study = load_study(path)
    (job,) = study.parts({}).values()
    part = run_part(**json.loads(json.dumps(job.settings)))
    masses = [{}, {"restitution_table_left": [(0.1, 0.3)]}, {"restitution": 0.2}]
    values = SLOW | {"clearance": [0.2, 0.25], "restitution_table": [(0.1, 0.6), (1.0, 0.5)]}
    seen = {"response": {}}
    cube = simulate(**values, masses=masses, observers=seen, transient=0, periods=1)
    np.testing.assert_array_equal(part.arrays["rms_displacement"], cube.rms_displacement)
    path.write_text(STUDY.replace("[1, 0.5]", "[0.11, 0.2]"))
    with pytest.raises(ConfigError, match=r"rows 0 and 1: from .* the rebound speed falls"):
        load_study(path)


def test_a_table_stands_in_a_file(tmp_path: Path) -> None:
    """Of a call, of a study in the same folder, and with units in its head."""
    path, rows = tmp_path / "measured.csv", ((0.1, 0.6), (1.0, 0.5))
    path.write_text("v,r\n0.1,0.6\n1,0.5\n")
    assert Parameters(**BASE, restitution_table=path).restitution_table == rows
    (tmp_path / "study.yaml").write_text(STUDY.replace("[[0.1, 0.6], [1, 0.5]]", "measured.csv"))
    study = load_study(tmp_path / "study.yaml")
    assert study.parameters["restitution_table"] == rows
    path.write_text("v (mm/s),r\n100,0.6\n1000,0.5\n")
    with pytest.raises(ConfigError, match=r"v is in mm/s: must be in 1, or without unit"):
        load_study(tmp_path / "study.yaml")
    values = {key: value for key, value in SI.items() if key != "restitution"}
    assert SIParameters(**values, restitution_table=str(path)).restitution_table == rows
    path.write_text("v,r\n0.1,0.6\n0.11,0.2\n")
    with pytest.raises(ConfigError, match=r"rows 0 and 1: from .* the rebound speed falls"):
        load_study(tmp_path / "study.yaml")
