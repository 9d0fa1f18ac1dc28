"""`damper.events`: symmetries, its rows and its errors. Against many digits: tests/models."""

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
    ("name", "said"),
    [
        ("speed", "'speed' .did you mean 'approach_speed'"),
        ("time_in_period", "'time_in_period': write time_in_cycle$"),
    ],
)
def test_misspelt_columns_get_the_nearest(name: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        events(CHATTER, until=10.0)[name]


def test_parameters_may_be_any_numbers() -> None:
    """Ints and NumPy scalars."""
    assert len(events((np.float64(0.1), 0, 1, np.int32(2), 1), until=20)) > 0


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
