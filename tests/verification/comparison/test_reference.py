"""References of scenes: what they hold, and how they are kept."""

import numpy as np
import pytest
from mpmath import mp, mpf
from scenes import QUIET as BURST

from damper.sweep.parts import PartData, read_part, write_part
from damper.verification.comparison.errors import Reference
from damper.verification.comparison.reference import RESOLVED, make_reference, run_part
from damper.verification.comparison.solvers import read_scene
from damper.verification.reference import exact_run


@pytest.fixture(scope="module")
def burst():
    return make_reference(read_scene(BURST, 20.0))


def test_events_and_state_of_a_burst(burst):
    found = Reference(*(np.array(burst[name], float) for name in Reference._fields))
    # These printed digits belong to decimal parameters; doubles are some 1e-14 away.
    assert found.stick_times == pytest.approx([17.868561780955439], abs=1e-13)
    assert found.release_times == pytest.approx([18.992457098508703], abs=1e-13)
    assert np.all(np.diff(found.impact_times) > 0)
    assert RESOLVED <= found.approach_speeds.min() < 1e-9 / BURST["restitution"]
    assert set(found.impact_sides) == {-1.0, 1.0}
    sharper = exact_run(BURST, until=20, digits=70)
    with mp.workdps(60):
        for text, right in zip(burst["final_state"], sharper.final, strict=True):
            assert abs(mpf(text) - right) < mpf("1e-50")


def test_written_and_read_again_with_the_same_bytes(burst, tmp_path):
    paths = [tmp_path / "a.npz", tmp_path / "b.npz"]
    write_part(PartData({}, burst), paths[0])
    write_part(run_part([], scene={"values": BURST, "until": 20.0}, digits=50), paths[1])
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert read_part(paths[0]).about == burst
