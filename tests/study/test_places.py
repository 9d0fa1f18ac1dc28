"""Observers of chosen points: `at`."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from studies import MISTAKES, blame, cube_of, load

import damper
from damper.figures import draw
from damper.study.estimate import estimate

POINT: dict[str, Any] = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": [0.8, 1.1],
    "clearance": [0.5, 1.0, 3.0],
    "restitution": 0.6,
    "transient": 3,
    "periods": 4,
}
KEPT = {"response": {}, "trajectory": {"samples_per_period": 20}}

STUDY = """\
title: One trajectory
source: our own
parameters: {primary_mass: 2, damping: 4, stiffness: 200, free_mass: 0.2, restitution: 0.6,
  force_amplitude: 10}
axes:
  forcing_frequency: {values: [1.2, 1.6], unit: Hz, fan: true}
  gap: {values: [0.02, 0.05, 0.1]}
draws: {count: 3, seed: 1, initial_position: [-1, 1]}
jobs: 2
transient: 3
periods: 4
observers:
  response:
  trajectory: {samples_per_period: 20, at: {forcing_frequency: 1.6, gap: 0.05}}
figures:
  history: {kind: trajectory, at: {forcing_frequency: 1.6, gap: 0.05, draw: 1}}
"""


def same_there(cube: xr.Dataset, whole: xr.Dataset, **at: float) -> None:
    """The kept runs are those of a cube that keeps all, and so are all other variables."""
    for name, variable in whole.data_vars.items():
        if str(name).startswith("trajectory"):
            assert not {*cube[name].dims} & {*at}
            np.testing.assert_array_equal(cube[name], variable.sel(at))
            assert json.loads(cube[name].attrs["observed_at"]) == at
        else:
            xr.testing.assert_identical(cube[name], variable)


@pytest.mark.parametrize("follow", [None, {"clearance": "both"}])
def test_one_trajectory_of_many(follow: dict[str, str] | None) -> None:
    whole = damper.simulate(**POINT, observers=KEPT, follow=follow)
    for at in ({"clearance": 1.0}, {"clearance": 3.0, "frequency_ratio": 0.8}):
        kept = KEPT | {"trajectory": KEPT["trajectory"] | {"at": at}}
        cube = damper.simulate(**POINT, observers=kept, follow=follow)
        same_there(cube, whole, **at)


def test_a_place_is_the_nearest_one_half_a_step_away_at_most() -> None:
    def run(**at: float) -> xr.Dataset:
        return damper.simulate(**POINT, observers={"segments": {"at": at}})

    with pytest.warns(UserWarning, match="clearance = 1.4 is no value of the cube: the nearest, 1"):
        near = run(clearance=1.4)
    assert near.segment_time.attrs["observed_at"] == '{"clearance": 1.0}'
    with pytest.raises(
        ValueError, match=r"clearance = 5.0: outside the cube, .* nearest value is 3"
    ):
        run(clearance=5)
    for name in ("clearence", "restitution"):
        with pytest.raises(ValueError, match=f"segments.at: unknown axis '{name}'"):
            run(**{name: 1.0})
    with pytest.raises(ValueError, match=r"trajectory.at = 3: must be a mapping of axes"):
        damper.simulate(**POINT, observers={"trajectory": {"at": 3}})


def test_a_study_keeps_what_its_jobs_do(tmp_path: Path) -> None:
    study = load(tmp_path, STUDY)
    whole = load(tmp_path, STUDY.replace(", at: {forcing_frequency: 1.6, gap: 0.05}}\nf", "}\nf"))
    at = {"forcing_frequency": 1.6, "gap": 0.05}
    cube = cube_of(study)
    assert cube.trajectory_displacement.dims == ("draw", "instant")
    every = cube_of(whole)
    same_there(cube, every, **at)
    for name, figure in study.figures["history"].files("history", study).items():
        settings = {key: value for key, value in figure.items() if key != "kind"}
        shown = draw("trajectory", {"cube": cube}, **settings)
        lines = [line.get_xydata() for ax in shown.axes for line in ax.lines]
        assert lines, name
        of_all = draw("trajectory", {"cube": every}, **settings)
        others = [line.get_xydata() for ax in of_all.axes for line in ax.lines]
        assert all(map(np.array_equal, lines, others))
        assert shown.get_suptitle() == of_all.get_suptitle()
    with pytest.raises(ValueError, match="no axis 'gap' with"):
        draw("trajectory", {"cube": cube}, at=at | {"gap": 0.02, "draw": 1})
    # Memory is counted for what is kept: of a job, a third of its runs.
    small, large = estimate(study).job, estimate(whole).job
    assert large.array_bytes / 3 < small.array_bytes < large.array_bytes / 2.5


@pytest.mark.parametrize(("old", "new", "message"), MISTAKES["places"])
def test_mistakes(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert message in blame(tmp_path, STUDY.replace(old, new))
