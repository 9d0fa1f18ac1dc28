"""The rigid reference: against a second implementation, other precisions, and a closed form.

`tests/reference/test_reference.py` has more: rules of single cases, and three methods in doubles.
"""

import pytest
from cases import thinned
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf
from reference import closed_form

from damper.verification.comparison.reference_rigid import Event, run

REST = (0, 0, 0, 0)
INSIDE = (0.1, 0.2, 0.1, -0.3)
#: mu, zeta, omega, d, r, phase; start; end.
SCENES = {
    "complete bursts": ((0.1, 0.05, 0.2, 0.25, 0.3, 0.0), REST, 20),
    "restitution 0": ((0.1, 0.05, 0.2, 0.25, 0.0, 0.0), REST, 18),
    "elastic": ((0.1, 0.05, 0.8, 0.25, 1.0, 0.3), REST, 12),
    "undamped resonance": ((0.1, 0.0, 1.0, 1.0, 0.7, 0.3), INSIDE, 12),
    "critical damping": ((0.1, 1.0, 0.7, 0.25, 0.7, 0.3), INSIDE, 12),
    "overdamped": ((0.1, 3.0, 0.7, 0.05, 0.6, 0.3), INSIDE, 3),
    "small mass ratio": ((1e-6, 0.1, 0.2, 0.25, 0.5, 0.0), REST, 20),
    "fast forcing": ((0.1, 0.1, 10.0, 0.005, 0.6, 0.0), REST, 1.2),
    "off the wall": ((0.1, 0.05, 0.8, 0.25, 0.9, 0.0), (0, 0, 0.25, -0.1), 12),
    "into the wall": ((0.1, 0.05, 0.8, 0.25, 0.9, 0.0), (0, 0, -0.25, -0.1), 12),
}


def listed(events: list) -> list[tuple]:
    """Time, kind, side, speed of all but slow impacts."""
    rows = [tuple(event[:4]) for event in events]
    return [row for row in rows if row[1] != "impact" or row[3] > 1e-3]


def assert_same(found: list, other: list, error: str) -> None:
    one, two = listed(found), listed(other)
    assert [row[1:3] for row in one] == [row[1:3] for row in two]
    assert len(one) >= 2
    for a, b in zip(one, two, strict=True):
        assert abs(a[0] - b[0]) < mpf(error)
        assert abs(a[3] - b[3]) < mpf(error)


@pytest.mark.parametrize("name", thinned(SCENES, {"restitution 0", "overdamped"}.__contains__))
def test_against_exponentials_brackets_and_extrapolation(name):
    numbers, state, until = SCENES[name]
    events, final = closed_form.run(numbers, state, until)
    found = run(numbers, state, until=until)
    with mp.workdps(70):
        assert_same(found.events, events, "1e-56")
        assert max(abs(a - b) for a, b in zip(found.final, final, strict=True)) < mpf("1e-56")


def of_kind(events: list[Event], kind: str) -> list[Event]:
    return [event for event in events if event.kind == kind]


@settings(deadline=None, max_examples=3)
@given(
    st.floats(1e-3, 3),
    st.floats(0, 2),
    st.floats(0.1, 3),
    st.floats(0.05, 1),
    st.floats(0, 1),
    st.floats(0, 6),
)
def test_mirror_and_continuation(mu, zeta, omega, d, r, phase):
    """The mirror image runs alike, and a run goes on from any state that it reaches."""
    numbers, start = (mu, zeta, omega, d, r, phase), (0.2, -0.1, 0.2 + d / 3, 0.7)
    whole = run(numbers, start, until=5, dps=30, max_impacts=60)
    if len(whole.events) >= 60:
        return
    with mp.workdps(45):
        mirrored = (*numbers[:5], mpf(phase) + mp.pi)
        mirror = run(mirrored, tuple(-value for value in start), until=5, dps=30)
        assert [e[1:3] for e in whole.events] == [(e.kind, -e.side) for e in mirror.events]
        assert max(abs(a + b) for a, b in zip(whole.final, mirror.final, strict=True)) < 1e-28
        first = run(numbers, start, until=2, dps=30)
        if any(e.kind == "stick" for e in first.events):
            return  # on a wall only to within the last digit
        second = run(numbers, first.final, start_time=2, until=5, dps=30)
        assert max(abs(a - b) for a, b in zip(whole.final, second.final, strict=True)) < 1e-25


@pytest.mark.parametrize("offset", ["-1e-12", "0", "1e-25"])
def test_end_in_and_about_the_tail_of_a_burst(offset):
    """Before the accumulation the free mass still bounces; after it, it sticks."""
    numbers = (0.1, 0.05, 0.2, 0.25, 0.3, 0.0)
    stick = of_kind(run(numbers, REST, until=18).events, "stick")[0]
    with mp.workdps(65):
        found = run(numbers, REST, until=stick.time + mpf(offset))
        x, v, y, u = found.final
        over = mpf(offset) > 0
        assert bool(of_kind(found.events, "stick")) == over or mpf(offset) == 0
        assert (abs(v - u) < mpf("1e-49")) == (mpf(offset) >= 0)
        assert abs(y - x) <= mpf(0.25) + mpf("1e-60")
        assert abs(x - stick.x - mpf(offset) * stick.v) < 1e-22


def test_no_clearance_moves_as_one():
    found = run((0.5, 0.1, 0.7, 0.0, 0.6, 0.0), (0.0, 0.3, 0.0, 0.0), until=9)
    assert found.events == []
    with mp.workdps(60):
        numbers = tuple(map(mpf, (0.5, 0.1, 0.7, 0.0, 0.6, 0.0)))
        x, v = closed_form.Flow(numbers, mpf(1.5), mpf(0), mpf(0), mpf(0.3) / mpf(1.5)).at(mpf(9))
        assert abs(found.final[0] - x) < 1e-58
        assert abs(found.final[1] - v) < 1e-58
    assert found.final[:2] == found.final[2:]
