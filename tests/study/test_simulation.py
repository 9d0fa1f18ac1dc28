"""`damper.simulate`: dimensions, coordinates, refusals, and the same numbers as single runs."""

import inspect
import itertools
import math
import sys
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scenes import STUDY as POINT

import damper
from damper import State, simulate
from damper.observers.common.laws import broken
from damper.parameters.quantities import ALL
from damper.parameters.tables import WALL_TABLES
from damper.sweep.grid import product
from damper.sweep.runs import run_points

SHORT: dict[str, Any] = {"transient": 3, "periods": 4}


def test_sequences_become_dimensions_in_the_order_of_the_parameters() -> None:
    cube = simulate(
        **{**POINT, "restitution": [0.2, 0.4, 0.6], "mass_ratio": (0.1, 0.2), "phase": [0.5]},
        **SHORT,
    )
    assert cube.chatter.dims == ("mass_ratio", "restitution", "phase")
    assert cube.displacement.dims == ("mass_ratio", "restitution", "phase", "sample")
    assert dict(cube.sizes) == {"mass_ratio": 2, "restitution": 3, "phase": 1, "sample": 4}
    np.testing.assert_array_equal(cube.restitution, [0.2, 0.4, 0.6])
    np.testing.assert_array_equal(cube.mass_ratio, [0.1, 0.2])
    for name in ("damping_ratio", "frequency_ratio", "clearance"):
        assert cube[name].ndim == 0
        assert float(cube[name]) == POINT[name]


def test_same_numbers_as_single_runs() -> None:
    axes = {"mass_ratio": [0.05, 0.3], "clearance": [0.02, 0.4, 9.0], "restitution": [0.0, 0.7]}
    observers: dict[str, Any] = {
        "stroboscopic_section": {"free_mass": True, "when": 0.1},
        "impacts": None,
        "bursts": {"records": 3, "compare_thresholds": [0.1, 0.01]},
    }
    cube = simulate(**{**POINT, **axes}, observers=observers, **SHORT)
    for point in product(axes, {}):
        arrays, _ = run_points([POINT | point], observers, **SHORT)
        assert set(cube.data_vars) == set(arrays)
        for name, array in arrays.items():
            np.testing.assert_array_equal(cube[name].sel(point), array[0], err_msg=name)


def test_settings_reach_the_engine() -> None:
    stopped = simulate(**POINT, **SHORT, max_events=10)
    assert int(stopped.status) == 1
    assert np.isnan(stopped.chatter)
    assert (stopped.attrs["runs"], stopped.attrs["runs_stopped_early"]) == (1, 1)
    assert int(simulate(**POINT, **SHORT).status) == 0
    state = State(0.3, 0.2, 0.31, 0.1)
    cube = simulate(**POINT, transient=0, periods=1, state=state)
    assert cube.displacement.values.tolist() == [0.3]
    cube = simulate(**POINT, **SHORT, accuracy=1e-6, max_events=10_000)
    assert cube.attrs["accuracy"] == 1e-6
    assert cube.attrs["max_events"] == 10_000
    assert cube.attrs["transient_periods"] == 3
    assert cube.attrs["recorded_periods"] == 4
    coarse = simulate(**POINT, transient=20, periods=5, accuracy=1e-3)
    assert not np.array_equal(coarse.displacement, simulate(**POINT, transient=20, periods=5))


@pytest.mark.parametrize("count", [1, 2])
def test_masses_are_observed_without_a_word_on_observers(count: int) -> None:
    """The bursts of each mass; and one mass in a list is that one."""
    cube = simulate(**POINT, masses=[{}] * count, **SHORT)
    alone = simulate(**POINT | {"mass_ratio": count * POINT["mass_ratio"]}, **SHORT)
    assert set(cube.data_vars) == set(alone.data_vars)
    assert cube.chatter.sizes == {"body": count}
    assert cube.visible_impacts.values == pytest.approx([float(alone.visible_impacts)] * count)
    laws = simulate(**POINT, masses=[{}] * count, observers=["laws"], **SHORT)
    assert not broken({name: v.values[None] for name, v in laws.data_vars.items()}).any()
    with pytest.raises(ValueError, match=r"bursts observes free masses by their numbers: give bod"):
        simulate(**POINT, masses=[{}] * count, observers=["bursts"], **SHORT)


def test_arguments_are_the_quantities_and_the_settings() -> None:
    first, *parameters = inspect.signature(simulate).parameters
    assert first == "parameters"
    assert [*parameters][: len(ALL)] == [*ALL]
    assert [*parameters][len(ALL) :] == [
        *("transient", "periods", "accuracy", "max_events"),
        *("observers", "follow", "initial", "forcing", "masses", *WALL_TABLES),
        *("draws", "state", "workers"),
    ]
    for name in parameters:
        assert name in simulate.__doc__
    for wrong, right in (("clearence", "clearance"), ("mu", "mass_ratio"), ("periodes", "periods")):
        message = rf"unknown argument '{wrong}' \(did you mean '{right}'\?\): must be one of param"
        with pytest.raises(TypeError, match=message):
            simulate(**POINT, **{wrong: 1.0})


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"observers": None}, "observers = None: must be names, or a mapping from names"),
        ({"observers": {"impacts": [1]}}, r"impacts = \[1\]: must be a mapping of settings"),
        ({"state": (0, 0, 0, 0)}, r"state = \(0, 0, 0, 0\): must be a damper.State"),
        ({"initial": np.zeros(4)}, r"initial = array\(\[0\., .*: must be 'rest' or 'steady'"),
        ({"clearance": [0.1, 0.2, 0.1]}, "clearance: 0.1 is given 2 times"),
        ({"periods": None}, "periods = None: must be a real number"),
        ({"max_events": 1.5}, "max_events = 1.5: must be a whole number >= 1"),
        ({"max_events": 10**30}, "max_events = 10{30}: must be a whole number >= 1 and <= 10{15}"),
        (
            {"restitution": [0.5, [0.6]]},
            r"restitution: must be a number or .*, not \[0.5, \[0.6\]\]",
        ),
        ({"restitution": [0.5, "b"]}, "restitution = 'b': must be a real number"),
        ({"restitution": {0.5}}, "restitution = {0.5}"),
        ({"masses": np.array(0.3)}, r"masses = array\(0.3\): must be a sequence of mappings"),
        ({"phase": [[0.1, 0.2]]}, "phase.*one-dimensional"),
        ({"phase": []}, "phase.*one-dimensional"),
        ({"clearance": (0.5, True)}, "clearance = True: must be a real number"),
        ({"follow": False}, "follow = False: must be a mapping of an axis to a direction"),
        (
            {"observers": {"chatter_bursts": {"since": [0, 4]}}},
            "chatter_bursts.since = 4.0: begins after the window of 4 cycles",
        ),
        ({"observers": [None]}, "unknown observer None: must be one of accumulation, "),
        ({"observers": {"impacts": {3: 4}}}, "impacts = {3: 4}: settings have names"),
    ],
)
def test_slips_are_named(given: dict[str, Any], message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        simulate(**{**POINT, **SHORT, **given})


OF_A_MACHINE: dict[str, Any] = {
    **{"primary_mass": 100.0, "damping": 800.0, "stiffness": 4e6, "force_amplitude": 200.0},
    **{"forcing_frequency": 200.0, "free_mass": 10.0, "gap": 0.002, "restitution": 0.3},
}


def test_arrays_may_be_text_with_a_unit_and_initial_quantities_too() -> None:
    wanted = simulate(**OF_A_MACHINE | {"gap": [0.001, 0.002]}, initial_velocity=[0.05], **SHORT)
    for texts in (np.array(["1 mm", "2 mm"]), pd.Series(["1 mm", "0.2 cm"])):
        given = OF_A_MACHINE | {"gap": texts, "initial_velocity": ["5 cm/s"]}
        assert simulate(**given, **SHORT).identical(wanted)
    point = {n: float(wanted[n].values.flat[0]) for n in ("gap", "initial_velocity")}
    text = {"gap": "1 mm", "initial_velocity": "50 mm/s"}
    first, second = (damper.events(**OF_A_MACHINE | given, until=0.1) for given in (point, text))
    assert first.tobytes() == second.tobytes()


def test_units_that_are_not_taken_are_refused() -> None:
    """In the attributes of an array, and with an amplitude that has none."""
    gaps = xr.DataArray([1.0, 2.0], attrs={"units": "mm"})
    with pytest.raises(ValueError, match="gap: has the attribute units = 'mm': must be in m;"):
        simulate(**OF_A_MACHINE | {"gap": gaps}, **SHORT)
    with pytest.raises(ValueError, match="gap: has the attribute units = 'mm': must be in m;"):
        damper.SIParameters(**OF_A_MACHINE | {"gap": gaps[0]})
    with pytest.raises(ValueError, match=r"clearance: has .* = 'mm': must be without"):
        simulate(**POINT | {"clearance": gaps}, **SHORT)
    in_metres = (1e-3 * gaps).assign_attrs(units="m")
    cube = simulate(**OF_A_MACHINE | {"gap": in_metres}, **SHORT)
    assert cube.identical(simulate(**OF_A_MACHINE | {"gap": cube.gap}, **SHORT))
    with pytest.raises(TypeError, match="stiffness = 'soft': must be a real number"):
        simulate(**OF_A_MACHINE | {"stiffness": "soft"}, **SHORT)
    for amplitude in ("2 N", ["2 N"]):
        with pytest.raises(ValueError, match="force_amplitude = '2 N': has the unit 'N'"):
            simulate(**POINT, force_amplitude=amplitude, **SHORT)


def test_one_observer_may_be_given_by_its_name() -> None:
    cube = simulate(**POINT, observers="impacts", **SHORT)
    assert cube.identical(simulate(**POINT, observers=["impacts"], **SHORT))
    with pytest.raises(ValueError, match="unknown observer 'impact'"):
        simulate(**POINT, observers="impact", **SHORT)


@pytest.mark.parametrize("watched", [True, False])
def test_progress_is_shown_to_a_person_at_a_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], watched: bool
) -> None:
    monkeypatch.setattr("damper.sweep.progress.monotonic", itertools.count().__next__)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: watched)
    axes = {"restitution": [0.2, 0.4, 0.6], "clearance": [0.1, 0.2]}
    simulate(**{**POINT, **axes}, **SHORT, follow={"clearance": "both"}, workers=1)
    assert ("12 of 12 points" in capsys.readouterr().err) == watched


def test_values_of_equal_steps_are_found_by_their_decimals() -> None:
    """As `numpy.linspace` makes them, with roundoff; and no number that is more than that moves."""
    cube = simulate(
        mass_ratio=0.1, damping_ratio=0.02, frequency_ratio=[math.tau / 6, math.tau / 7],
        clearance=np.linspace(0.1, 0.5, 5), restitution=0.5, periods=1, transient=0,
        initial_position=np.arange(-0.3, 0.31, 0.1), observers=["impacts"],
    )  # fmt: skip
    assert np.linspace(0.1, 0.5, 5)[2] != 0.3
    assert cube.sel(clearance=0.3, initial_position=0.0).clearance == 0.3
    assert cube.initial_position.values.tolist() == [-0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3]
    assert cube.frequency_ratio.values.tolist() == [math.tau / 6, math.tau / 7]
