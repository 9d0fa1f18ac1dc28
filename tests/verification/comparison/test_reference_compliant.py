"""The compliant reference: against a solver in absolute coordinates, in its limits, by digits."""

import pytest
from cases import thinned
from mpmath import mp, mpf
from reference import compliant

from damper.models.compliant.restitution import contact_damping, restitution_of
from damper.parameters import Parameters
from damper.verification.comparison import reference_compliant, reference_rigid
from damper.verification.comparison.reference_compliant import damping_of, run

REST = (0, 0, 0, 0)
GENERIC = (0.1, 0.05, 0.2, 0.25, 0.6)
QUIET = (0.1, 0.05, 0.2, 0.25, 0.3)


def walls(scene: tuple, k: float, tension: int = 0) -> Parameters:
    return Parameters(*scene, contact_stiffness_ratio=k, contact_tension=tension)


#: Scene, stiffness, tension, start, end.
SCENES = {
    "very stiff": (GENERIC, 1e8, 0, REST, 6.0),
    "sticking at once": ((0.5, 0.2, 0.7, 0.1, 0.05), 30.0, 0, REST, 8.0),
    "soft": ((0.3, 0.02, 0.9, 0.4, 0.8), 30.0, 0, REST, 8.0),
    "tension": ((0.3, 0.02, 0.9, 0.4, 0.8), 300.0, 1, (0.1, 0.2, 0.1, -0.3), 6.0),
    "critical contact": ((0.1, 0.05, 0.8, 0.25, 0.0), 100.0, 1, REST, 3.5),
    "elastic": ((0.1, 0.05, 0.8, 0.25, 1.0), 1e6, 0, REST, 7.0),
}


@pytest.mark.parametrize("name", thinned(SCENES, {"soft", "critical contact"}.__contains__))
def test_against_absolute_coordinates(name):
    """Taylor steps and matrix exponentials there, a secant rule for the roots."""
    scene, k, tension, state, until = SCENES[name]
    with mp.workdps(60):
        z = damping_of(scene[4], bool(tension))
    other = compliant.Scene(*scene[:4], k, z, bool(tension))
    changes, final = compliant.exact_run(other, state, until)
    touches = [change for change in changes if change.kind == "touch"]
    found = run(walls(scene, k, tension), state, until=until)
    impacts = [event for event in found.events if event.kind == "impact"]
    with mp.workdps(60):
        assert [event.side for event in impacts] == [touch.side for touch in touches]
        for event, touch in zip(impacts, touches, strict=True):
            assert abs(event.time - touch.time) < 1e-31
            assert abs(event.approach_speed - touch.speed) < 1e-31
            assert abs(event.x - touch.x) < 1e-31
            assert abs(event.v - touch.v) < 1e-31
        for event in found.events:
            if event.kind == "release":
                (part,) = (c for c in changes if c.kind == "part" and abs(c.time - event.time) < 1)
                assert abs(part.time - event.time) < 1e-31
        assert max(abs(a - b) for a, b in zip(found.final, final, strict=True)) < 1e-31


def test_sticks_and_releases_are_where_contacts_last():
    found = run(walls(SCENES["sticking at once"][0], 30.0), REST, until=8.0).events
    assert [event.kind for event in found] == [*(["impact", "stick", "release"] * 2), "impact"]
    with mp.workdps(50):
        lasting = 2 * mp.pi / mp.sqrt(30 * mpf(1.5) / mpf(0.5))
        assert abs(found[1].time - found[0].time - lasting) < 1e-45


@pytest.mark.parametrize(("k", "tension"), [(1e4, 0), (1e4, 1), (1e8, 0)])
def test_two_precisions_and_without_modes(k, tension, monkeypatch):
    """A burst, a lasting contact, its release; modes only save steps, they change no digit."""
    scene = walls(QUIET, k, tension)
    few, many = (run(scene, REST, until=19.2, dps=dps) for dps in (50, 70))
    assert [event.kind for event in few.events][-2:] == ["stick", "release"]
    runs = [many]
    if k < 1e6 and tension:
        monkeypatch.setattr(reference_compliant, "_DISTINCT", 1e9)
        runs.append(run(scene, REST, until=19.2, dps=30))
    with mp.workdps(90):
        for other, error in zip(runs, (1e-60, 1e-40), strict=False):
            assert [e[1:3] for e in few.events] == [e[1:3] for e in other.events]
            for a, b in zip(few.events, other.events, strict=True):
                assert max(abs(a[i] - b[i]) for i in (0, 3, 4, 5)) < error
            assert max(abs(a - b) for a, b in zip(few.final, other.final, strict=True)) < error


def test_ring_that_never_dies_is_not_stepped_over(monkeypatch):
    """Pushed more and then less, an elastic contact ends in a dip of its ring."""
    scene, start = walls((0.1, 0.0, 0.8, 0.25, 1.0), 340.0), (0, 2, 0.25, 2)
    with_modes = run(scene, start, until=5, dps=30)
    monkeypatch.setattr(reference_compliant, "_DISTINCT", 1e9)
    without = run(scene, start, until=5, dps=30)
    assert len(without.events) >= 2
    with mp.workdps(40):
        assert [e[1:3] for e in with_modes.events] == [e[1:3] for e in without.events]
        for a, b in zip(with_modes.events, without.events, strict=True):
            assert abs(a.time - b.time) < 1e-30


@pytest.mark.parametrize("tension", [0, 1])
def test_stiff_walls_are_nearly_rigid(tension):
    """Impact times differ from rigid ones by the time of contact, k^(-1/2)."""
    rigid = reference_rigid.run((*GENERIC, 0.0), REST, until=15, dps=30).events
    errors = []
    for k in (1e6, 1e8):
        found = run(walls(GENERIC, k, tension), REST, until=15, dps=30).events
        errors.append(float(abs(found[2].time - rigid[2].time)))
        assert [event.side for event in found] == [event.side for event in rigid]
    assert errors[0] / errors[1] == pytest.approx(10, rel=0.1)


@pytest.mark.parametrize("tension", [False, True])
@pytest.mark.parametrize("r", [1e-6, 0.1, 0.135335283236612, 0.14, 0.6, 0.999, 1.0])
def test_damping_in_all_digits(r, tension):
    with mp.workdps(60):
        z = damping_of(r, tension)
        assert float(z) == pytest.approx(contact_damping(r, tension), rel=1e-14)
        assert restitution_of(float(z), tension) == pytest.approx(r, rel=1e-13)
        if 0 < z < 1 and not tension:
            back = mp.exp(-2 * mp.acos(z) * z / mp.sqrt(1 - z**2))
            assert abs(back / mpf(r) - 1) < 1e-50


def test_start_in_touch_on_the_wall_and_without_clearance():
    """Pressed 1e-20 into the wall or that far from it: nearly the same run as from its surface."""
    for scene, y, u in (
        ((0.1, 0.05, 0.8, 0.1, 0.5), 0.1, 0.1),
        ((0.1, 0.05, 0.8, 0.0, 0.5), 0, 0.1),
    ):
        p = walls(scene, 100.0)
        with mp.workdps(50):
            near, on, inside = (
                run(p, (0, 0, mpf(y) + mpf(shift), u), until=2, dps=30)
                for shift in ("-1e-20", "0", "1e-20")
            )
            assert on.events[0][1:3] == ("impact", 1)
            assert on.events[0].time == 0
            assert len(near.events) == len(on.events)
            # From inside it is in touch already: no impact is counted, the rest is the same.
            assert len(inside.events) == len(on.events) - 1
            for other in (near, inside):
                gap = max(abs(a - b) for a, b in zip(other.final, on.final, strict=True))
                assert 0 < gap < 1e-17
