"""Cubes and tables of the comparison, of solvers whose errors and times are known."""

import csv
import io
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from verification.comparison.fake_solvers import SETTINGS, fake_cubes

from damper.sweep.cube import write_cube
from damper.verification.comparison.best import best_error, relative_to_base, time_to_reach
from damper.verification.comparison.cube import ERRORS, order_at
from damper.verification.comparison.errors import MEASURES, VERDICTS
from damper.verification.comparison.tables import solver_errors, solver_speed
from damper.verification.comparison.tables.solver_speed import _time_text


@pytest.fixture(scope="module")
def cubes() -> Iterator[tuple[xr.Dataset, xr.Dataset]]:
    with pytest.MonkeyPatch.context() as patch:
        yield fake_cubes(patch)


@pytest.fixture(scope="module")
def errors(cubes: tuple[xr.Dataset, xr.Dataset]) -> xr.Dataset:
    return cubes[0]


@pytest.fixture(scope="module")
def timings(cubes: tuple[xr.Dataset, xr.Dataset]) -> xr.Dataset:
    return cubes[1]


# --- cubes


def test_every_variable_says_what_it_is(errors: xr.Dataset, timings: xr.Dataset) -> None:
    for cube in (errors, timings):
        assert set(cube.dims) == {"scene", "solver", "level"}
        for name, variable in cube.variables.items():
            assert variable.attrs.get("long_name"), name
            if variable.dtype.kind == "f":
                assert variable.attrs.get("units"), name
    assert set(MEASURES) <= set(errors.data_vars)
    assert errors.attrs["title"] == "Fakes compared"
    assert timings.attrs["processor"] == "A processor"


def test_scenes_and_solvers_are_in_their_places(errors: xr.Dataset) -> None:
    assert errors.scene.values.tolist() == ["hard", "soft"]
    assert errors.title.values.tolist() == ["hard walls", "compliant contact"]
    assert errors.solver.values.tolist() == list(SETTINGS)
    assert errors.finer.values.tolist() == [-1, 1, 1, -1, -1, -1, -1]
    assert set(errors.setting_name.values.tolist()) == {"step"}
    at = {"scene": "hard", "solver": "rk45", "level": 2}
    assert float(errors.state_error.sel(at)) == pytest.approx(0.3 * 0.01)
    assert float(errors.setting.sel(solver="rk45", level=2)) == 0.01
    assert int(errors.reference_impacts.sel(scene="hard")) == 3


def test_verdicts_and_outcomes_are_flags(errors: xr.Dataset) -> None:
    for name in ("outcome", "verdict"):
        assert errors[name].encoding == {"dtype": np.int8, "_FillValue": -1}
        meanings = errors[name].attrs["flag_meanings"].split()
        assert len(meanings) == len(errors[name].attrs["flag_values"])
        assert errors[name].attrs["flag_values"][0] == 0
        assert errors[name].min() >= 0  # what is not applicable is missing, and in no average
    hard = errors.verdict.sel(scene="hard", level=1)
    assert [VERDICTS[int(k)] if k >= 0 else None for k in hard.values] == [
        *("good", "left_box", "good", "good", "stalled", "missed", None)
    ]
    soft = errors.verdict.sel(scene="soft", level=1)
    assert [VERDICTS[int(k)] if k >= 0 else None for k in soft.values] == [
        *("good", *[None] * 5, "failed")
    ]


def test_orders_are_those_of_the_fakes(errors: xr.Dataset) -> None:
    orders = errors.order_state_error.sel(scene="hard").to_series()
    # The finest level of the first is below rounding.
    assert orders["exact"] == pytest.approx(2.0)
    assert orders["rk4_located"] == pytest.approx(3.0)
    assert orders["rk45"] != orders["rk45"]  # two good levels are too few
    assert orders["rk4_step_end"] != orders["rk4_step_end"]
    assert set(ERRORS) == {
        name.removeprefix("order_") for name in errors.data_vars if name.startswith("order_")
    }
    impact = float(errors.order_impact_time_error.sel(scene="hard", solver="rk4_located"))
    assert impact == pytest.approx(3.0, rel=1e-6)


def test_order_is_a_median_over_pairs_of_good_levels(errors: xr.Dataset) -> None:
    place = errors.sel(scene="hard", solver="rk4_located").copy(deep=True)
    place.state_error[1] *= 50.0  # one of four is far off
    slopes = []
    log_error, log_setting = np.log(place.state_error.values), np.log(place.setting.values)
    for i in range(4):
        for j in range(i):
            slopes.append((log_error[i] - log_error[j]) / (log_setting[i] - log_setting[j]))
    assert order_at(place, "state_error") == pytest.approx(-np.median(slopes))
    place.verdict[1] = VERDICTS.index("missed")
    assert order_at(place, "state_error") == pytest.approx(3.0)
    place.verdict[0] = VERDICTS.index("missed")
    assert math.isnan(order_at(place, "state_error"))


def test_rounding_grows_with_the_motion(errors: xr.Dataset) -> None:
    place = errors.sel(scene="hard", solver="exact").copy(deep=True)
    assert order_at(place, "state_error") == pytest.approx(2.0)
    place["sensitivity"] = 1e10  # all errors but the largest may be rounding
    assert math.isnan(order_at(place, "state_error"))
    assert math.isfinite(order_at(place, "energy_residual"))


def test_compliant_contact_has_no_order_of_penetration(errors: xr.Dataset) -> None:
    place = errors.sel(scene="hard", solver="rk4_located").copy(deep=True)
    place["penetration"] = place.state_error
    assert order_at(place, "penetration") == pytest.approx(3.0)
    place["rigid"] = 0
    assert math.isnan(order_at(place, "penetration"))


def test_same_bytes_twice(errors: xr.Dataset, timings: xr.Dataset, tmp_path: Path) -> None:
    for cube in (errors, timings):
        for name in "ab":
            write_cube(cube, tmp_path / name)
        assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
        with xr.open_dataset(tmp_path / "a") as back:
            xr.testing.assert_identical(back.load(), cube)


# --- work and precision


def test_best_error_is_that_of_a_good_run(errors: xr.Dataset) -> None:
    best = best_error(errors, "state_error").sel(scene="hard").to_series()
    assert best["rk45"] == pytest.approx(0.003)  # the finest one was capped
    assert best["exact"] == 0.0
    for name in ("rk4_step_end", "lsoda", "radau", "compliant_flow"):
        assert math.isnan(best[name])


def test_time_to_reach_is_that_of_the_cheapest(errors: xr.Dataset, timings: xr.Dataset) -> None:
    times = time_to_reach(errors, timings, "state_error", 0.0031).sel(scene="hard").to_series()
    assert times["exact"] == pytest.approx(1e-3)  # 0.003 at 0.1
    assert times["rk45"] == pytest.approx(1e-2)
    assert math.isnan(times["radau"])
    found = relative_to_base(time_to_reach(errors, timings, "state_error", 0.0031))
    ratios = found.sel(scene="hard").to_series()
    assert (ratios["exact"], ratios["rk45"]) == (1.0, pytest.approx(10.0))
    alone = time_to_reach(errors, timings, "state_error", 1.0).drop_sel(solver="exact")
    assert np.isnan(relative_to_base(alone)).all()


def test_runs_of_other_settings_are_refused(errors: xr.Dataset, timings: xr.Dataset) -> None:
    for other in (timings.isel(scene=[0]), timings.assign(setting=2.0 * timings.setting)):
        with pytest.raises(ValueError, match="not those of the same scenes and settings"):
            time_to_reach(errors, other, "state_error", 1.0)


# --- tables


def test_errors_table(errors: xr.Dataset) -> None:
    table = solver_errors.make(errors)
    markdown = table.markdown()
    rows = list(csv.DictReader(io.StringIO(table.csv())))
    levels = {name: len(values) for name, values in SETTINGS.items()}
    assert len(rows) == sum(levels.values()) - 1 + levels["exact"] + 1
    for row in rows:
        at = {"scene": row["scene"], "solver": row["solver"]}
        place = errors.sel(at)
        (level,) = np.flatnonzero(np.isclose(place.setting, float(row["setting"]), rtol=1e-5))
        assert row["verdict"] == VERDICTS[int(place.verdict[level])]
        for name in MEASURES:
            value = float(row[name]) if row[name] else math.nan
            assert value == pytest.approx(float(place[name][level]), rel=1e-5, nan_ok=True)
    assert markdown.startswith("# Fakes compared: errors\n")
    hard, soft = markdown.split("## ")[1:]
    assert hard.startswith("Hard walls\n")
    assert "3 impacts count" in hard
    tables = [line for line in markdown.splitlines() if line.startswith("|")]
    assert len(tables) == 2 * (2 + len(SETTINGS))
    assert len({line.count("|") for line in tables}) == 1
    lines = [line.strip("| ").split(" | ") for line in hard.splitlines() if line.startswith("|")]
    cells = dict(zip(SETTINGS, lines[2:], strict=True))
    assert cells["exact"][1] == "step 1e-10"
    assert cells["exact"][5] == "0.0e0 (2.00)"
    assert cells["exact"][-1] == "good"
    assert cells["rk4_step_end"][-1] == "beyond a wall by 0.1"
    assert cells["rk45"][5] == "3.0e-3"
    assert cells["rk45"][-1] == "0.1, 0.01: good; 0.001: capped at t = 0.5"
    assert cells["lsoda"][-1] == "stalled at t = 2, missed 1 impact"
    assert cells["radau"][-1] == "missed 1 impact"
    assert cells["compliant_flow"][-1] == "another model"
    assert "failed at t = 2" in soft


@pytest.mark.parametrize(
    ("seconds", "text"), [(9.999e-4, "1 ms"), (1.23e-5, "12 µs"), (2.0, "2 s"), (3e-8, "30 ns")]
)
def test_times_are_rounded_before_their_unit_is_chosen(seconds: float, text: str) -> None:
    assert _time_text(seconds) == text


def test_times_table(errors: xr.Dataset, timings: xr.Dataset) -> None:
    table = solver_speed.make(errors, timings)
    markdown = table.markdown()
    rows = list(csv.DictReader(io.StringIO(table.csv())))
    one = next(row for row in rows if row["solver"] == "rk45" and row["setting"] == "0.01")
    assert float(one["run_time"]) == pytest.approx(0.01)
    assert float(one["run_time_low"]) == pytest.approx(0.009)
    assert float(one["time_per_impact"]) == pytest.approx(0.01 / 3, rel=1e-3)
    assert float(one["time_per_period"]) == pytest.approx(0.01 * math.pi / 6, rel=1e-3)
    assert one["repeats"] == "3"
    assert "Machine: A processor, 2 cores, numpy 9.9." in markdown
    states = markdown.split("## Error of the end state")[1]
    lines = [line.strip("| ").split(" | ") for line in states.splitlines() if line[:1] == "|"]
    assert lines[0] == ["solver", "1e-3", "1e-6", "1e-9", "1e-12", "per impact", "per period"]
    hard = lines[2:8]
    assert hard[0][1:3] == ["10 ms", "100 ms"]  # 3e-5 and 3e-7
    # 3.0e-4 at 10, 3.8e-5 and so on down to 5.9e-7 at 80; the latter takes 8 ms.
    assert hard[2][1:3] == ["1 ms (×0.1)", "8 ms (×0.08)"]
    assert hard[3][1:3] == ["not reached", "not reached"]
    assert hard[3][-2:] == ["3.3 ms", "5.2 ms"]
    assert hard[4][1:] == ["not reached"] * 4 + ["–", "–"]
    assert "| exact engine | 100 ms | 500 ms |" in markdown
    # A call costs 20 us, and a scene's three impacts what the scene does.
    assert "| Hard walls | 20 µs | 20 µs | 18 ms | 0.2; 0.2 | 0.08; 0.08 | – | – |" in markdown
    assert float(one["call_time"]) == pytest.approx(2e-5)
