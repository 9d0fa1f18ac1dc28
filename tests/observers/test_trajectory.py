"""Sampled trajectory against the sections, the event list and the log."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_events import Scene
from scenes import SCENES

from damper import Parameters, events
from damper.sweep.runs import run_points

NAMES = ("generic", "chattering", "slow", "study", "elastic", "plastic", "stuck", "free")
COLUMN_NAMES = ("time", "displacement", "velocity", "free_displacement", "free_velocity")
SAMPLE, IMPACT_ROW, STICK, RELEASE = -1, 0, 1, 2


def observed(values: dict[str, float], setting: dict | None = None, **run: object) -> dict:
    """Arrays of one run, without the filler; and the number of rows with it."""
    arrays, _ = run_points([values], {"trajectory": setting or {}}, **run)
    found = {name.removeprefix("trajectory_"): array[0] for name, array in arrays.items()}
    return used(found)


def used(found: dict) -> dict:
    n = int(np.isfinite(found["time"]).sum())
    assert np.isnan(found["time"][n:]).all()
    for name in COLUMN_NAMES:
        assert np.isnan(found[name][n:]).all()
        assert np.isfinite(found[name][:n]).all()
    assert (found["event"][n:] == -1).all()
    assert (found["mode"][n:] == -1).all()
    size = len(found["time"])
    rows = {k: v[:n] if np.ndim(v) else v for k, v in found.items()}
    return {**rows, "size": size}


# --- samples


@pytest.mark.parametrize(("start", "transient"), [(0, 0), (1.37, 3)])
@pytest.mark.parametrize("name", ["chattering", "plastic", "stuck"])
def test_samples_are_those_of_the_stroboscopic_section(
    name: str, start: float, transient: int
) -> None:
    """Bit for bit, at every fraction of the period."""
    run = {"transient": transient, "periods": 6}
    found = observed(SCENES[name], {"start": start, "length": 2}, **run)
    samples = {k: found[k][found["event"] == SAMPLE] for k in COLUMN_NAMES}
    assert len(samples["time"]) == 201
    for k in range(0, 200, 19):
        step = round(start * 100) + k
        section, _ = run_points(
            [SCENES[name]],
            {"stroboscopic_section": {"when": step % 100 / 100, "free_mass": True}},
            **run,
        )
        for column in COLUMN_NAMES[1:]:
            assert samples[column][k] == section[column][0][step // 100], (column, k)
    period = 2 * math.pi / SCENES[name]["frequency_ratio"]
    np.testing.assert_allclose(
        samples["time"], np.arange(201) * period / 100, rtol=0, atol=3e-16 * 8 * period
    )


# --- events


@pytest.mark.parametrize("name", NAMES)
def test_event_rows_are_those_of_the_event_list(name: str) -> None:
    transient = 4
    scene = Scene(SCENES[name], transient, 6)
    found = observed(scene.parameters, **scene.run())
    p = Parameters(**scene.parameters)
    rows = events(p, until=(transient + 6) * p.cycle)
    rows = rows[rows["time"] >= scene.start]
    kinds = found["event"]
    # Of the two rows of an impact the second shows the state after it.
    of_impacts = np.flatnonzero(kinds == IMPACT_ROW)
    assert len(of_impacts) == 2 * (rows["kind"] == 0).sum()
    before, after = of_impacts[::2], of_impacts[1::2]
    assert (after == before + 1).all()
    at = np.sort(np.concatenate([after, np.flatnonzero(kinds > 0)]))
    np.testing.assert_array_equal(kinds[at], rows["kind"])
    np.testing.assert_array_equal(found["displacement"][at], rows["x"])
    np.testing.assert_array_equal(found["velocity"][at], rows["v"])
    np.testing.assert_allclose(found["time"][at] + scene.start, rows["time"], rtol=1e-15)
    assert found["events_left_out"] == 0
    # At the wall, and apart from it at the speeds of the impact law.
    d, r = p.clearance, p.restitution
    relative = found["free_displacement"][at] - found["displacement"][at]
    np.testing.assert_allclose(relative, rows["side"] * d, rtol=0, atol=1e-14)
    hits = rows[rows["kind"] == 0]
    speeds = found["free_velocity"] - found["velocity"]
    bound = 1e-14 * (1 + np.abs(found["velocity"][before]))
    sides, approach = hits["side"], hits["approach_speed"]
    assert (np.abs(sides * speeds[before] - approach) <= bound).all()
    assert (np.abs(sides * speeds[after] + r * approach) <= bound).all()
    for column in ("time", "displacement", "free_displacement"):
        np.testing.assert_array_equal(found[column][before], found[column][after])
    momentum = found["velocity"] + p.mass_ratio * found["free_velocity"]
    np.testing.assert_allclose(momentum[before], momentum[after], rtol=0, atol=1e-14)


@settings(max_examples=30)
@given(
    mass_ratio=st.sampled_from([1e-3, 0.1, 2.0]),
    damping_ratio=st.sampled_from([0.0, 0.02, 1.0, 10.0]),
    frequency_ratio=st.sampled_from([0.05, 0.7, 1.3, 20.0]),
    clearance=st.sampled_from([0.0, 0.02, 0.4]),
    restitution=st.floats(0, 1),
    start=st.sampled_from([0.0, 0.5, 1.0, 1 / 3, math.pi / 3]),
    length=st.sampled_from([None, 0.5, 0.77, 1.5]),
    rate=st.integers(1, 40),
    most=st.sampled_from([0, 3, 1000]),
)
def test_rows_are_in_order_and_complete(
    start: float, length: float | None, rate: int, most: int, **values: float
) -> None:
    setting = {"samples_per_period": rate, "start": start, "length": length, "events": most}
    if round((length or 1.0) * rate) < 1 or start + round((length or 1.0) * rate) / rate > 3:
        return
    found = observed(values, setting, transient=2, periods=3)
    period = 2 * math.pi / values["frequency_ratio"]
    steps = round(length * rate) if length else math.floor((3 - start) * rate + 1e-9)
    assert found["size"] == steps + 1 + 2 * most
    assert (np.diff(found["time"]) >= 0).all()
    assert (found["event"] == SAMPLE).sum() == steps + 1
    low, high = (2 + start) * period, (2 + start + steps / rate) * period
    rows = events(Parameters(**values), until=5 * period)
    slack = 1e-12 * period
    surely = ((rows["time"] > low + slack) & (rows["time"] < high - slack)).sum()
    perhaps = ((rows["time"] > low - slack) & (rows["time"] < high + slack)).sum()
    kinds = found["event"]
    written = (kinds == IMPACT_ROW).sum() // 2 + (kinds > 0).sum()
    assert written <= most
    assert surely <= written + found["events_left_out"] <= perhaps
    assert found["events_left_out"] == 0 or written == most


def test_events_that_do_not_fit_are_counted() -> None:
    values = SCENES["chattering"]
    whole = observed(values, transient=0, periods=6)
    all_events = (whole["event"] == 0).sum() // 2 + (whole["event"] > 0).sum()
    assert all_events > 40
    few = observed(values, {"events": 10}, transient=0, periods=6)
    assert few["events_left_out"] == all_events - 10
    none = observed(values, {"events": 0}, transient=0, periods=6)
    assert none["events_left_out"] == all_events
    samples = whole["event"] == SAMPLE
    for name in COLUMN_NAMES:
        np.testing.assert_array_equal(none[name], whole[name][samples])
        first = few["event"] == SAMPLE
        np.testing.assert_array_equal(few[name][first], whole[name][samples])


# --- settings, pieces, stops


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"start": 3.0}, r"start = 3\.0, length = None: holds no whole .* 3 cycles"),
        ({"start": 2.5, "length": 1}, r"start = 2\.5, length = 1.0: .* ends 3\.5 .* 3 cycles long"),
        ({"start": 1 + 5e-10, "length": 2}, "the stretch ends 3"),
        ({"length": 3.01}, r"length = 3\.01: the stretch ends 3\.01"),
        ({"length": 0.001}, "holds no whole sample step of 1/100"),
    ],
)
def test_a_stretch_beyond_the_record_is_refused(setting: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        observed(SCENES["generic"], setting, transient=0, periods=3)
