"""`damper.events`: symmetries, its rows and its errors. Against many digits: tests/models."""

import math
from typing import Any

import numpy as np
import pytest

import damper
from damper.engine import segment
from damper.sweep.events import EVENT

IMPACT, STICK, RELEASE, STOPPED = range(4)


def events(scene: tuple, state: tuple = (0.0, 0.0, 0.0, 0.0), **settings: Any) -> np.ndarray:
    """Run the engine on a scene (mu, zeta, omega, d, r[, phase])."""
    return damper.events(damper.Parameters(*scene), damper.State(*state), **settings)


CHATTER = (0.1, 0.05, 0.2, 0.25, 0.6)


# --- phase and time


TURNED = ((0.1, 0.05, 0.2, 0.25, 0.6, 0.4), (0.1, -0.2, 0.15, 0.3))


def test_a_start_at_another_time_is_another_phase() -> None:
    scene, state = TURNED
    late = events(scene, (*state, 3.7), until=30.0)[:8]
    turned = events((*scene[:5], scene[5] + scene[2] * 3.7), state, until=26.3)[:8]
    assert late["kind"].tolist() == turned["kind"].tolist()
    assert np.abs(late["time"] - 3.7 - turned["time"]).max() < 1e-12


# --- the array, its end and its errors


def test_rows_are_in_order_and_within_the_run() -> None:
    found = events(CHATTER, until=200.0)
    assert found.dtype == EVENT
    assert found.dtype.names == (
        *("time", "kind", "side", "approach_speed", "x", "v"),
        *("cycle", "time_in_cycle", "body"),
    )
    assert np.all(np.diff(found["time"]) >= 0)
    assert 0 <= found["time"][0] <= found["time"][-1] <= 200.0
    assert set(np.abs(found["side"])) == {1}
    assert np.all((found["approach_speed"] > 0) == (found["kind"] == IMPACT))
    after_stick = np.flatnonzero(found["kind"] == STICK) + 1
    assert np.all(found["kind"][after_stick[after_stick < len(found)]] == RELEASE)


def test_an_event_at_the_end_still_counts() -> None:
    first = events(CHATTER, until=3.0)[0]
    assert len(events(CHATTER, until=float(first["time"]))) == 1
    assert len(events(CHATTER, until=np.nextafter(first["time"], 0))) == 0


@pytest.mark.parametrize("max_events", [1, 2, 5, 30, 34])
def test_max_events_ends_with_a_stopped_row(max_events: int) -> None:
    whole = events(CHATTER, until=60.0)
    found = events(CHATTER, until=60.0, max_events=max_events)
    assert len(found) == max_events + 1
    assert np.array_equal(found[:-1], whole[:max_events])
    last = found[-1]
    assert (last["kind"], last["side"], last["approach_speed"]) == (STOPPED, 0, 0.0)
    # It stops where the next event would be: same place, just before it.
    following = whole[max_events]
    assert last["time"] == pytest.approx(following["time"], abs=1e-13)
    assert last["x"] == pytest.approx(following["x"], abs=1e-13)


@pytest.mark.parametrize(
    ("name", "values", "allowed"),
    [
        ("until", [math.nan, math.inf, -1.0], "a finite time >= 0.0"),
        ("accuracy", [0.0, 1e-2, math.nan], "a number >= 1e-15 and <= 0.001"),
        ("max_events", [0, 2.5], "a whole number >= 1 and <= 10{15}$"),
    ],
)
def test_settings_are_checked(name: str, values: list[float], allowed: str) -> None:
    for value in values:
        with pytest.raises(ValueError, match=f"^{name} = {value!r}: must be {allowed}"):
            events(CHATTER, **{"until": 1.0, name: value})


def test_starts_out_of_place_are_refused() -> None:
    with pytest.raises(ValueError, match=r"\|y - x\| = 0.3 .*clearance = 0.25"):
        events(CHATTER, (0.0, 0.0, -0.3, 0.0), until=1.0)
    with pytest.raises(ValueError, match=r"^until = 1.0: must be a finite time >= 2.0"):
        events(CHATTER, (0.0, 0.0, 0.0, 0.0, 2.0), until=1.0)


def test_parameters_may_be_any_numbers() -> None:
    """Ints and NumPy scalars."""
    assert len(events((np.float64(0.1), 0, 1, np.int32(2), 1), until=20)) > 0


@pytest.mark.parametrize(
    ("slip", "message"),
    [
        ({"parameters": {}}, "parameters = {}: must be damper.Parameters or SIParameters"),
        ({"state": (0, 0, 0, 0)}, r"state = \(0, 0, 0, 0\): must be a damper.State"),
        ({"until": "x"}, "until = 'x': must be a real number"),
        ({"restituton": 0.5}, "unknown parameter 'restituton' .did you mean 'restitution'"),
        ({"masses": 5}, "masses = 5: must be a sequence of mappings"),
        ({"acuracy": 1e-9}, "unknown parameter 'acuracy' .did you mean 'accuracy'"),
        ({"parameters": None, "clearance": 1}, "missing parameters: mass_ratio, "),
    ],
)
def test_slips_are_named(slip: dict[str, Any], message: str) -> None:
    given: dict[str, Any] = {"parameters": damper.Parameters(*CHATTER), "until": 1.0}
    with pytest.raises(TypeError, match=message):
        damper.events(**(given | slip))


def test_dampers_and_starts_are_given_in_one_way() -> None:
    """As objects, by name, or both: the same bytes, in SI units too."""
    p = damper.Parameters(*CHATTER)
    si = damper.SIParameters(100, 80, 4e6, 300, 200, 10, 1e-3, 0.6)
    for one, size in ((p, p.clearance), (si, 0.5 * si.gap)):
        state = damper.State(0.0, 0.0, 0.5 * size, 0.1)
        other = damper.State(0.0, 0.0, -size, 0.1)
        start = {"initial_position": 0.5, "initial_relative_velocity": 0.1}
        until = 20.0 * one.cycle
        found = damper.events(one, state, until=until).tobytes()
        assert damper.events(**one.given, **start, until=until).tobytes() == found
        assert damper.events(one, **start, until=until).tobytes() == found
        assert damper.run(one, until, **start).events.tobytes() == (
            damper.run(one, until, state).events.tobytes()
        )
        run = {"transient": 0, "periods": 5, "observers": ["response"]}
        by_name = damper.simulate(**one.given, **start, **run)
        assert damper.simulate(one, **start, **run).equals(by_name)
        assert damper.simulate(one, restitution=[0.3, 0.6], **run).sizes["restitution"] == 2
        with pytest.raises(ValueError, match="state stands alone"):
            damper.events(one, other, **start, until=until)


def test_misspelt_names_get_the_nearest() -> None:
    with pytest.raises(TypeError, match=r"'clearence' .did you mean 'clearance'"):
        damper.Parameters(0.1, 0.02, 1.3, clearence=0.05, restitution=0.5)  # type: ignore[call-arg]
    with pytest.raises(ValueError, match=r"'speed' .did you mean 'approach_speed'"):
        damper.events(damper.Parameters(*CHATTER), until=10.0)["speed"]
    with pytest.raises(ValueError, match=r"'time_in_period': write time_in_cycle$"):
        damper.events(damper.Parameters(*CHATTER), until=10.0)["time_in_period"]


def test_kinds_of_events_have_names() -> None:
    """Of the numbers that the table, the log and the words of a shown table have."""
    found = events(CHATTER, until=60.0)
    words = [line.split()[1] for line in repr(found[:12]).splitlines()[2:]]
    assert words == [damper.EventKind(kind).name.lower() for kind in found["kind"][:12]]
    assert set(found["kind"]) == {damper.IMPACT, damper.STICK, damper.RELEASE}
    for kind in damper.EventKind:
        assert getattr(damper, kind.name) is kind
        assert getattr(segment, kind.name) == kind
        assert type(getattr(segment, kind.name)) is float


def test_events_are_shown_as_a_table_and_are_plain_in_all_else() -> None:
    found = events(CHATTER, until=60.0)
    assert str(found) == repr(found)
    head, fields, *rows = repr(found).splitlines()
    assert head == f"<{len(found)} events>"
    assert set(fields.split()) < set(EVENT.names or ())
    assert (len(rows), rows[5].strip()) == (11, "...")
    assert rows[7].split()[1] == "stick"
    assert len(repr(found[:12]).splitlines()) == 14
    assert repr(found[:0]).startswith("<0 events>")
    for part in (found["time"], found[["x", "v"]], found[3]):
        assert type(part) in (np.ndarray, np.void)
    plain = found.view(np.ndarray)
    assert repr(found == plain) == repr(plain == plain)
    assert np.concatenate([found, plain]).tobytes() == 2 * plain.tobytes()
