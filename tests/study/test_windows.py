"""Transients and records as times: in the unit of the study, or to the end of what drives it."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from studies import MISTAKES, blame, cube_of, load

import damper
from damper.study import check
from damper.sweep.record import settings_of

POINT: dict[str, Any] = {
    "primary_mass": 2.0,
    "damping": 4.0,
    "stiffness": [200.0, 300.0],
    "free_mass": 0.2,
    "gap": 0.02,
    "restitution": 0.6,
    "force_amplitude": 1.0,
    "observers": {"response": {}, "impacts": {}, "trajectory": {}, "stroboscopic_section": {}},
}
SI = {n: POINT[n] for n in ("primary_mass", "damping", "free_mass", "gap", "force_amplitude")}
SI |= {"stiffness": 200.0}
SHAKEN = damper.Record([0.0, 0.4, 1.1, 2.3], [0.0, 3.0, -4.0, 0.0], of="base_acceleration")


def test_a_time_is_as_many_cycles() -> None:
    # Whole cycles give the same bytes; the clock may be any.
    hertz = 2.0 * math.pi
    cycles = damper.simulate(**POINT, forcing_frequency=2.0 * hertz, transient=6, periods=4)
    times = damper.simulate(
        **POINT, forcing_frequency=2.0 * hertz, transient={"time": 3.0}, periods={"time": 2.0}
    )
    assert settings_of(times)["periods"] == {"time": 2.0}
    for name in cycles.data_vars:
        np.testing.assert_array_equal(times[name], cycles[name])


def test_no_clock_counts_for_a_record() -> None:
    # Peak and rms over all of a record, whose end is in the midst of a cycle of either clock.
    given = POINT | {"forcing": SHAKEN, "transient": 0, "periods": {"time": "end"}}
    cube = damper.simulate(**given, forcing_frequency=[5.0, 7.3])
    assert float(cube.trajectory_time.max()) == pytest.approx(2.3, abs=2.0 * math.pi / 500.0)
    for name in ("peak_displacement", "rms_displacement", "max_approach_speed"):
        one, other = cube[name].transpose("forcing_frequency", ...).values
        np.testing.assert_allclose(one, other, rtol=1e-10)
    # What comes after is the rest of a longer run: whole cycles of a fast clock, to its end.
    for frequency in (5.0, 7.3):
        after = damper.simulate(
            **given | {"transient": {"time": "end"}, "periods": {"time": 1.0}},
            forcing_frequency=frequency,
        )
        last = damper.simulate(
            **given | {"transient": {"time": 2.0}, "periods": {"time": 1.3}},
            forcing_frequency=frequency,
        )
        most = np.maximum(after.peak_displacement, _peak(given, frequency, 2.0, 0.3))
        np.testing.assert_allclose(last.peak_displacement, most, rtol=1e-12)


def _peak(given: dict[str, Any], frequency: float, start: float, length: float) -> Any:
    window = {"transient": {"time": start}, "periods": {"time": length}}
    run = given | window | {"observers": ["response"]}
    return damper.simulate(**run, forcing_frequency=frequency).peak_displacement


def test_a_followed_run_goes_on_in_the_phase_that_it_ended_in() -> None:
    # The second point starts where the first one ended, half a cycle on: the force, too.
    given = {
        "mass_ratio": 0.1,
        "damping_ratio": 0.05,
        "frequency_ratio": 0.8,
        "clearance": [1.0, 1.0 + 1e-15],
        "restitution": 0.6,
        "transient": 0,
        "observers": ["response"],
    }
    half = {"time": 3.5 * 2.0 * math.pi / 0.8}
    chain = damper.simulate(**given, periods=half, follow={"clearance": "up"})
    alone = damper.simulate(**given | {"clearance": 1.0, "transient": half}, periods=half)
    second = chain.peak_displacement.isel(clearance=1).item()
    assert second == pytest.approx(alone.peak_displacement.item(), rel=1e-9)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"periods": {"tim": 1}}, "periods = {'tim': 1}: must be a whole number >= 1 (cycles), or"),
        ({"periods": {"time": 0}}, "or {'time': a number > 0, or 'end'}"),
        ({"periods": "end"}, "periods = 'end': must be a whole number"),
        ({"periods": {"time": "end"}, "forcing": "base"}, "only a record or noise ends"),
        ({"transient": {"time": 2.5}}, "ends at 2.3, before the window begins"),
    ],
)
def test_mistakes_in_python(change: dict[str, Any], message: str) -> None:
    given = POINT | {"forcing": SHAKEN, "periods": {"time": "end"}, "forcing_frequency": 1.0}
    with pytest.raises(ValueError, match=re.escape(message)):
        damper.simulate(**given | change)


STUDY = """\
title: Shaken
source: our own
forcing: {kind: record, time: [0, 0.5, 7.3], value: [0, 2, 0], of: base_acceleration}
parameters: {primary_mass: 2, damping: 4, stiffness: 200, free_mass: 0.2, gap: 0.02,
  restitution: 0.6, force_amplitude: 1}
axes: {forcing_frequency: {values: [1, 2], unit: Hz}}
transient: 0
periods: {time: end}
observers: {trajectory: {start: 1, length: 2}}
"""


ALONE = STUDY.replace("axes: {forcing_frequency: {values: [1, 2], unit: Hz}}", "")
GIVEN = ALONE.replace("parameters: {", "parameters: {forcing_frequency: 1 Hz, ")


def test_a_study_knows_its_shortest_and_longest_run(tmp_path: Path) -> None:
    study = load(tmp_path, STUDY)
    assert study.run == {"transient": 0, "periods": {"time": "end"}}
    assert study.contents.periods == pytest.approx(7.3)
    assert study.most_cycles == (0, pytest.approx(14.6))


@pytest.mark.parametrize(
    ("forcing", "clock"),
    [
        (SHAKEN, {"forcing_frequency": 2.0 * math.pi}),
        ("none", {"forcing_frequency": 2.0 * math.pi, "force_amplitude": 0.0}),
        (damper.Noise(1, 0.01, 5.0, (0.0, 30.0)), {"frequency_ratio": 1.0}),
        ("none", {"frequency_ratio": 1.0}),
    ],
)
def test_a_force_without_frequency_asks_for_none(forcing: Any, clock: dict[str, float]) -> None:
    si = "forcing_frequency" in clock
    numbers = SI if si else {"mass_ratio": 0.1, "damping_ratio": 0.1, "clearance": 0.1}
    left_out = {n: v for n, v in numbers.items() if n not in clock} | {"restitution": 0.6}
    kind = damper.SIParameters if si else damper.Parameters
    assert kind(**left_out, forcing=forcing) == kind(**left_out, **clock, forcing=forcing)
    run = {"transient": 1, "periods": 2, "initial_velocity": 0.3, "forcing": forcing}
    assert damper.simulate(**left_out, **run).identical(damper.simulate(**left_out, **run, **clock))
    one, other = (
        damper.events(**left_out, **more, forcing=forcing, initial_velocity=0.3, until=4.0)
        for more in ({}, clock)
    )
    assert len(one)
    assert np.array_equal(one, other)
    with pytest.raises(TypeError, match=f"missing .*{next(iter(clock))}"):
        damper.simulate(**left_out, forcing="base")


def test_a_study_of_a_record_counts_in_seconds(tmp_path: Path, capsys: Any) -> None:
    study, own = load(tmp_path, ALONE), load(tmp_path, GIVEN, "given")
    assert study.contents.periods == 7.3
    assert cube_of(study).equals(cube_of(own))
    note = "forcing_frequency is no more than the clock: a force of kind record has no frequency"
    assert check.main([str(tmp_path / "study.yaml")]) == 0
    assert note not in capsys.readouterr().out
    check.main([str(tmp_path / "given.yaml")])
    assert note in capsys.readouterr().out
    # What has a frequency asks for it.
    base = re.sub("forcing: .*", "forcing: base", ALONE).replace("time: end", "time: 9")
    assert "'forcing_frequency' is not given" in blame(tmp_path, base)


@pytest.mark.parametrize(("old", "new", "message"), MISTAKES["windows"])
def test_mistakes_in_a_study(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert message in blame(tmp_path, STUDY.replace(old, new))


def test_decay_is_observed_after_a_record_alone(tmp_path: Path) -> None:
    text = STUDY.replace("{trajectory: {start: 1, length: 2}}", "{decay: }")
    assert "after a record" in blame(tmp_path, text)
    text = text.replace("transient: 0", "transient: {time: end}")
    load(tmp_path, text.replace("periods: {time: end}", "periods: {time: 9}"))
