"""Errors of predicted accumulation: exact laws on made-up cubes, loops on a simulated one."""

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

import damper
from damper.analysis.accumulation import accumulation_errors, errors_of
from damper.tables import make

AXES = {"damping_ratio": [0.01, 0.5], "restitution": [0.6, 0.8, 0.97]}


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    """Return paper A's preset with more damping and other restitutions; 0.97 completes nothing."""
    return damper.simulate(
        mass_ratio=0.2,
        damping_ratio=AXES["damping_ratio"],
        frequency_ratio=0.25,
        clearance=0.03,
        restitution=AXES["restitution"],
        transient=0,
        periods=6,
        observers={"accumulation": {"bursts": 8, "impacts": 100}},
    )


def made_up(
    *, bursts: int = 4, impacts: int = 40, powers: tuple[float, float] = (2.0, 3.0), **changes: Any
) -> xr.Dataset:
    """One point whose errors are exact powers of the speed, of another size and sign each burst."""
    dims = ("complete_burst", "burst_impact")
    speed = 0.1 * 0.7 ** np.arange(impacts) * np.ones((bursts, 1))
    sizes = np.array([3.0, -0.7, 0.02, -8.0])[:bursts, None]
    left = 5.0 * speed
    values: dict[str, Any] = {
        "rebound_speed": speed,
        "remaining_time": left,
        "remaining_displacement": -2.0 * left,
        "prediction_error_estimate": speed**2,
    }
    for order, power in zip(("first", "second"), powers, strict=True):
        for quantity in ("time", "displacement"):
            resolved = values[f"remaining_{quantity}"]
            values[f"{order}_order_{quantity}"] = resolved + sizes * speed**power
    values |= {name: np.asarray(value) for name, value in changes.items()}
    data: dict[str, Any] = {
        name: (dims, value, {"units": "sqrt(M/K)"}) for name, value in values.items()
    }
    for quantity in ("time", "displacement"):
        data[f"accumulation_{quantity}_uncertainty"] = (dims[:1], np.full(bursts, 1e-14))
    data["complete_bursts"] = ((), bursts)
    return xr.Dataset(data, {dims[1]: np.arange(1.0, impacts + 1)})


def one(cube: xr.Dataset, quantity: str = "time", order: int = 1) -> dict[str, Any]:
    found = accumulation_errors(cube).set_index(["quantity", "order"])
    return found.loc[quantity, order].to_dict()


# --- slopes


@pytest.mark.parametrize("quantity", ["time", "displacement"])
@pytest.mark.parametrize(("order", "power"), [(1, 2.0), (2, 3.0)])
def test_slope_is_the_power(quantity: str, order: int, power: float) -> None:
    """Whatever the size and sign of each burst's errors: a pooled fit would see these."""
    found = one(made_up(), quantity, order)
    assert found["slope"] == pytest.approx(power, abs=1e-3)
    assert found["impacts"] == found["predicted_impacts"] == 160


def test_only_what_is_sharp_and_asymptotic_counts() -> None:
    cube = made_up()
    found = errors_of(cube, "time", "second")
    w, size = cube.rebound_speed.values, np.array([3.0, 0.7, 0.02, 8.0])[:, None]
    expected = (size * w**3 > 100 * 1e-14) & (w**2 < 1e-2)
    assert 0 < expected.sum() < expected.size
    np.testing.assert_array_equal(found.asymptotic, expected)
    assert found.slope()[1] == expected.sum()


def test_slope_bears_errors_that_change_their_sign() -> None:
    """Near the zero of an error its size says nothing of the law."""
    cube = made_up()
    w = cube.rebound_speed.values
    first = cube.first_order_time.values.copy()
    first[0] = cube.remaining_time.values[0] + 3.0 * w[0] ** 2 - 3e4 * w[0] ** 3
    assert one(made_up(first_order_time=first))["slope"] == pytest.approx(2.0, abs=0.02)


def test_a_slope_spans_a_factor_of_four() -> None:
    """Between neighbours, errors that are large and small in turn have slopes from -2 to 7."""
    cube = made_up()
    speed, left = cube.rebound_speed.values, cube.remaining_time.values
    first = left + speed**2 * 2.2 ** (np.arange(40) % 4)
    assert one(made_up(first_order_time=first))["slope"] == pytest.approx(2.0, abs=1e-9)


# --- first impacts, and where agreement begins


def test_missing_first_predictions_are_counted_not_averaged() -> None:
    second = made_up().second_order_time.values.copy()
    second[1:, 0] = np.nan
    found = one(made_up(second_order_time=second), order=2)
    assert found["predicted_impacts"] == 157
    assert found["first_impact_predicted"] == 1
    assert found["first_impact_median_error"] == pytest.approx(3.0 * 1e-3)
    assert found["first_impact_worst_error"] == found["first_impact_median_error"]
    second[:, 0] = np.nan
    found = one(made_up(second_order_time=second), order=2)
    assert found["first_impact_predicted"] == 0
    assert math.isnan(found["first_impact_median_error"])


def test_agreement_begins_where_all_later_ones_agree() -> None:
    """Relative errors are size w / 5 here: within 1 % from w <= .05 / size on."""
    found = one(made_up())
    speeds = 0.1 * 0.7 ** np.arange(40)
    starts = [float(np.argmax(size * speeds / 5 <= 0.01)) + 1 for size in (3, 0.7, 0.02, 8)]
    assert found["within_from_median"] == np.median(starts)
    assert found["within_from_worst"] == max(starts) > min(starts)
    left = [speeds[int(start) - 1] / 0.1 for start in starts]
    assert found["within_left_percent"] == pytest.approx(100 * np.median(left))
    # One later failure moves the beginning behind it.
    first = made_up().first_order_time.values.copy()
    first[2, 20] = np.nan
    assert one(made_up(first_order_time=first))["within_from_worst"] == 22.0


# --- the table


def test_table_says_what_was_found(cube: xr.Dataset) -> None:
    table = make("accumulation", {"cube": cube})
    assert table.data.equals(accumulation_errors(cube))
    rows = [line for line in table.markdown().splitlines() if line.startswith("|")]
    rows = rows[4:]  # below what sums up all points
    assert len(rows) == 2 * (2 + 12)
    assert sum("| 0.97 | 1 | 0 | 0 | 0 of 0 | – |" in line for line in rows) == 4
    assert "within 1 % from impact" in rows[0]
    assert "error there, sqrt(M/K)" in rows[0]
    assert "error there, F0/K" in rows[14]
    first = table.data.iloc[0]
    assert f"{first['slope']:.3f} ({first['slope_points']})" in rows[2]
    both = first["first_impact_median_error"], first["first_impact_worst_error"]
    assert f"{both[0]:.3g}, {both[1]:.3g}" in rows[2]
