"""The interval table: what is written about intervals whose places are known."""

from typing import Any

import pandas as pd
import pytest
import xarray as xr

import damper
from damper.tables import Table, make
from damper.tables import intervals as module

COLUMNS = ("mass_ratio", "threshold", "chatter", "restitution_lower", "restitution_upper")
FLAGS = ("narrow", "cut", "lower_survives", "upper_survives")
#: Two places whose hulls move by known amounts from 1 % to 10 %: narrow, cut, and where an edge is
#: chance whether the lower and the upper one survive.
MADE_UP = [
    (0.1, "3 %", "complete", 0.400, 0.700, False, False),
    (0.1, "3 %", "complete", 0.750, 0.760, True, False),
    (0.1, "3 %", "complete", 0.800, 1.000, False, True, False, True),
    (0.1, "3 %", "any", 0.400, 1.000, False, True),
    (0.1, "1 %", "complete", 0.300, 0.700, False, False),
    (0.1, "1 %", "any", 0.300, 0.950, False, False, True, False),
    (0.1, "10 %", "complete", 0.550, 0.600, False, False),
    (0.1, "10 %", "complete", 0.650, 0.690, False, False),
    (0.1, "10 %", "any", 0.550, 0.990, False, False),
    (0.2, "3 %", "any", 0.500, 0.510, True, False),
    (0.2, "1 %", "complete", 0.350, 0.500, False, False),
    (0.2, "1 %", "any", 0.350, 0.600, False, False),
    (0.2, "10 %", "any", 0.410, 0.570, False, False, False, False),
]


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return a function that makes the table of given intervals."""

    def table(found: list[tuple], stated: Any = None, **observer: Any) -> Table:
        rows = [(*row, True, True)[: len(COLUMNS) + len(FLAGS)] for row in found]
        frame = pd.DataFrame(rows, columns=[*COLUMNS, *FLAGS]).astype(dict.fromkeys(FLAGS, bool))
        monkeypatch.setattr(module.intervals, "chatter_intervals", lambda *_: frame)
        settings = {"threshold": 0.03, "compare_thresholds": [0.01, 0.03, 0.1], **observer}
        cube: xr.Dataset = damper.simulate(
            mass_ratio=[0.1, 0.2], damping_ratio=0.02, frequency_ratio=1.3, clearance=0.05,
            restitution=[0.5, 0.6, 0.7], transient=1, periods=1, observers={"bursts": settings},
        )  # fmt: skip
        return make("intervals", {"cube": cube}, along="restitution", stated=stated)

    return table


def test_stated_range_beside_what_is_found(made: Any) -> None:
    table = made(MADE_UP, stated=(0.5, 0.6))
    heads = [part for part in table.body if isinstance(part, str)]
    assert "## Chatter beside the stated range, 0.5 to 0.6" in heads
    rows = table.body[3 + 1]
    assert list(rows["mass ratio"]) == ["0.1", "0.2"]
    assert {*rows["values with chatter in the range"]} == {"2 of 2"}
    assert {*rows["values with chatter outside"]} == {"1 of 1"}
    assert {*rows["outermost ones"]} == {"0.5, 0.7"}


def test_main_table_by_hand(made: Any) -> None:
    table = made(MADE_UP)
    assert len(table.data) == len(MADE_UP)
    main = table.body[2]
    assert list(main.columns) == ["mass ratio", "complete", "any"]
    assert main.to_numpy().tolist() == [
        ["0.1", "0.400–0.700, ~0.800–1.000+, 1 narrow", "0.400–1.000+"],
        ["0.2", "none", "1 narrow"],
    ]
    assert "`~`: an edge that is chance" in table.body[1]
    assert "1e-13 to 1e-12" in table.body[1]


def test_edges_in_si_units_have_the_digits_to_which_they_are_bisected(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    edges = {"gap_lower": 0.00123, "gap_upper": 0.00456, "forcing_frequency": 80.0}
    marks = {"narrow": False, "cut": False, "lower_survives": True, "upper_survives": True}
    row = {"threshold": "3 %", "chatter": "any", **edges, **marks}
    monkeypatch.setattr(module.intervals, "chatter_intervals", lambda *_: pd.DataFrame([row]))
    cube = damper.simulate(
        primary_mass=1.0, damping=1.0, stiffness=6400.0, force_amplitude=1.0, free_mass=0.1,
        restitution=0.6, forcing_frequency=[80.0, 90.0], gap=[1e-3, 2e-3], transient=1, periods=1,
        observers={"bursts": {"threshold": 0.03}},
    )  # fmt: skip
    table = make("intervals", {"cube": cube}, along="gap", resolution=1e-5)
    assert table.title.endswith("chatter intervals in gap, m")
    rows = next(part for part in table.body if isinstance(part, pd.DataFrame))
    assert rows.columns[0] == "forcing frequency, rad/s"
    assert rows["any"].tolist() == ["0.00123–0.00456", "none"]


def test_threshold_table_by_hand(made: Any) -> None:
    moves = made(MADE_UP).body[5]
    assert list(moves.columns) == [
        "mass ratio",
        *("complete, 1 %", "complete, 3 %", "complete, 10 %"),
        *("any, 1 %", "any, 3 %", "any, 10 %"),
    ]
    assert moves.to_numpy().tolist() == [
        [
            "0.1",
            *("0.300–0.700", "0.400–1.000", "0.550–0.690"),
            *("0.300–~0.950", "0.400–1.000", "0.550–0.990"),
        ],
        ["0.2", "0.350–0.500", "none", "none", "0.350–0.600", "none", "~0.410–~0.570"],
    ]


def test_how_edges_move_by_hand(made: Any) -> None:
    assert made(MADE_UP).body[6].splitlines() == [
        "- complete, from 1 % to 10 %: the lower edge moves by +0.250 to +0.250, "
        "the upper edge by -0.010 to -0.010 (1 of 2 rows have intervals at both); "
        "in 1 rows they vanish.",
        "- any, from 1 % to 10 %: the lower edge moves by +0.060 to +0.250, "
        "the upper edge by -0.030 to +0.040 (2 of 2 rows have intervals at both).",
    ]
