"""The reference of structures against that of one oscillator, and against published numbers."""

import math

import pytest

import damper
from damper.verification import reference
from damper.verification.structures import exact_run

ONE = damper.Structure(1.0, 0.1, 1.0, boxes={"tip": 1.0}, force=0)


HEAVY = {"mass_ratio": 0.1, "clearance": 0.25, "restitution": 0.2, "gravity": 0.3}
OTHER = {"mass_ratio": 0.2, "clearance": 0.35, "restitution": 0.1, "gravity": 0.3}


@pytest.mark.parametrize(
    ("masses", "until"), [([HEAVY], 4.2), ([HEAVY | {"gravity": 0.4}, OTHER], 1.325)]
)
def test_one_coordinate_is_the_oscillator(masses, until):
    """Bursts end a little sooner or later: one is extrapolated, the other followed to the end."""
    values = {"damping_ratio": 0.05, "frequency_ratio": 0.8, "masses": masses} | masses[0]
    start = (0, 0, *[[0] * len(masses)] * 2)
    other = reference.exact_run(values, start, until=until, digits=30)
    own = [
        {
            "free_mass": one["mass_ratio"],
            "gap": 2.0 * one["clearance"],
            "restitution": one["restitution"],
            "gravity": one["gravity"],
        }
        for one in masses
    ]
    p = damper.SIParameters(structure=ONE, force_amplitude=1.0, forcing_frequency=0.8, masses=own)
    run = exact_run(p, until=until, digits=30)
    found, wanted = (
        [e for e in events if e.kind != "impact" or e.approach_speed > 1e-8]
        for events in (run.events, other.events)
    )
    assert {e.kind for e in found} == {"impact", "stick", "release"}
    for one, two in zip(found, wanted, strict=True):
        assert (one.kind, one.side, one.body) == (two.kind, two.side, two.body)
        for name in ("time", "approach_speed", "x", "v"):
            assert abs(getattr(one, name) - getattr(two, name)) < 1e-18


def test_free_motion_of_two_modes():
    hertz = [1.0 / (2.0 * math.pi), 2.7 / (2.0 * math.pi)]
    modes = damper.Structure.from_modes(hertz, 0.01, {"tip": [1.0, 0.6]})
    p = damper.SIParameters(
        structure=modes, forcing="none", free_mass=0.1, gap=2.0, restitution=0.6
    )
    run = exact_run(p, damper.State([2.0, 0.3], [0.0, 0.0], 2.18, 0.0), until=2.7, digits=30)
    assert [e.side for e in run.events] == [1, -1]
    found = [float(v) for e in run.events for v in (e.time, e.approach_speed)]
    wanted = [0.8654351775263009, 1.8519143280624, 2.575966985714633, 1.2355699265415]
    assert found == pytest.approx(wanted, rel=1e-13)
