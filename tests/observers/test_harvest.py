"""The output of a harvester, from the approach speeds of all of its impacts."""

import math

import numpy as np
import pytest
from scenes import QUIET, SI

import damper
from damper import IMPACT, Parameters, SIParameters, simulate

RUN = {"transient": 2, "periods": 3}


def speeds_in(p: Parameters | SIParameters) -> np.ndarray:
    found = damper.events(p, until=5.0 * p.cycle)
    hits = found[(found["kind"] == IMPACT) & (found["time"] >= 2.0 * p.cycle)]
    return hits["approach_speed"]


def test_the_output_is_that_of_all_impacts_also_of_those_that_a_sequence_closes() -> None:
    """Rows of the table on a parabola: half way between two rows it is above the parabola."""
    speeds = speeds_in(Parameters(**QUIET))
    found = simulate(**QUIET, observers={"harvest": {"coefficient": 0.5}}, **RUN)
    expected = 0.5 * float((speeds**2).sum()) / 3.0
    assert float(found.harvested_per_cycle) == pytest.approx(expected, rel=1e-6)
    assert float(found.harvested_per_cycle) > expected
    assert float(found.largest_harvest) == pytest.approx(0.5 * speeds.max() ** 2, rel=1e-14)
    rows = np.linspace(0.0, 1.0, 4001)[1:]
    table = {"speeds": rows.tolist(), "energies": (0.5 * rows**2).tolist()}
    near = simulate(**QUIET, observers={"harvest": table}, **RUN)
    assert float(near.harvested_per_cycle) == pytest.approx(expected, rel=1e-4)


def test_a_table_is_linear_between_its_rows_and_ends_with_the_last() -> None:
    speeds = speeds_in(Parameters(**QUIET))
    line = {"speeds": [0.5, 1.0], "energies": [1.0, 4.0]}
    found = simulate(**QUIET, observers={"harvest": line}, **RUN)
    expected = float(np.interp(speeds, [0.0, 0.5, 1.0], [0.0, 1.0, 4.0]).sum()) / 3.0
    assert float(found.harvested_per_cycle) == pytest.approx(expected, rel=2e-3)
    short = {"speeds": [0.01], "energies": [1.0]}
    found = simulate(**QUIET, observers={"harvest": short}, **RUN)
    assert np.isnan(found.harvested_per_cycle)


def test_in_si_units_the_coefficient_is_a_mass_and_the_output_in_joule() -> None:
    speeds = speeds_in(SIParameters(**SI))
    assert len(speeds) > 2
    table = {"speeds": [0.5, 2.0], "energies": [0.1, 3.0]}
    for setting, output in (
        ({"coefficient": 0.02}, 0.02 * speeds**2),
        (table, np.interp(speeds, [0.0, 0.5, 2.0], [0.0, 0.1, 3.0])),
    ):
        found = simulate(**SI, observers={"harvest": setting}, **RUN)
        assert float(found.harvested_per_cycle) == pytest.approx(output.sum() / 3.0, rel=1e-12)
        assert found.harvested_per_cycle.attrs["units"] == "J"


def test_a_harvester_between_two_walls_of_a_box_of_prescribed_motion() -> None:
    """Two impacts a cycle, in closed form.

    At the right wall the box sin(theta), theta = w t, has the velocity w c, c = cos(theta) < 0, and
    the ball turns round: u = -(1 + r)/(1 - r) w c. It comes from the left wall, half a cycle
    before: 2 (d + sin(theta)) = u pi/w.
    """
    box = {"mass_ratio": 0, "damping_ratio": 0, "carrier": "prescribed", "frequency_ratio": 2.0}
    values = box | {"clearance": 2.0, "restitution": 0.5, "initial_relative_velocity": 2.0}
    found = simulate(**values, observers=["harvest", "impacts"], transient=100, periods=10)
    r, w = 0.5, 2.0
    k = 0.5 * math.pi * (1.0 + r) / (1.0 - r)
    c = -(2.0 * k + math.sqrt(k * k - 3.0)) / (k * k + 1.0)  # (2 + k c)^2 + c^2 = 1, for d = 2
    speed = -2.0 * w * c / (1.0 - r)
    assert float(found.impacts_per_period) == 2.0
    assert float(found.harvested_per_cycle) == pytest.approx(2.0 * speed**2, rel=1e-9)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"speeds": [1.0]}, "speeds has 1 values and energies has 0"),
        ({"speeds": [2.0, 1.0], "energies": [1.0, 2.0]}, "must rise"),
        ({"coefficient": 2.0, "speeds": [1.0], "energies": [1.0]}, "both given"),
        ({"coefficient": -1.0}, r"harvest\.coefficient = -1\.0: must be a number >= 0"),
    ],
)
def test_a_table_is_checked(given: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        simulate(**QUIET, observers={"harvest": given}, **RUN)
