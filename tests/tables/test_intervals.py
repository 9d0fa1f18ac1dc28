"""The interval table: edges checked by runs of their own, and what is written about them."""

import csv
import io
import re
from typing import Any

import pytest
import xarray as xr

from damper import simulate
from damper.analysis import intervals as intervals_module
from damper.analysis.intervals import Interval
from damper.sweep.runs import run_points
from damper.tables import About
from damper.tables.intervals import (
    chatter_intervals,
    places,
    threshold_name,
    to_csv,
    to_markdown,
)

FIXED = {"damping_ratio": 0.02, "frequency_ratio": 1.3, "clearance": 0.05, "phase": 0.0}
GRID = [round(0.3 + 0.02 * k, 2) for k in range(31)]
MASSES = [0.25, 0.001]
THRESHOLDS = [0.01, 0.03, 0.1]
OBSERVER: dict[str, Any] = {"threshold": 0.03, "compare_thresholds": THRESHOLDS}
RUN: dict[str, Any] = {
    "transient": 60,
    "periods": 10,
    "accuracy": 1e-12,
    "max_events": 1_000_000,
}
RESOLUTION = 1e-3
HOLDS = {"complete": (2,), "any": (1, 2)}


def make_cube(observer: dict[str, Any] = OBSERVER, **axes: Any) -> xr.Dataset:
    return simulate(
        **{**FIXED, "mass_ratio": MASSES, "restitution": GRID, **axes},
        observers={"bursts": observer},
        **RUN,
    )


def table_of(
    cube: xr.Dataset, observer: dict[str, Any] = OBSERVER, along: str = "restitution"
) -> list[Interval]:
    return chatter_intervals(
        cube, along=along, resolution=RESOLUTION, observer=observer, settings=RUN
    )


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    return make_cube()


@pytest.fixture(scope="module")
def table(cube: xr.Dataset) -> list[Interval]:
    return table_of(cube)


def chatter(point: dict[str, float], threshold: Any = 0.03) -> int:
    """Chatter of one run from rest."""
    arrays, _ = run_points([{**FIXED, **point}], {"bursts": {"threshold": threshold}}, **RUN)
    return int(arrays["chatter"][0])


def where_of(found: list[Interval]) -> list[dict[str, float]]:
    """Places of a table in which each has an interval."""
    return [
        item.where for k, item in enumerate(found) if item.where not in [i.where for i in found[:k]]
    ]


def markdown(found: list[Interval], **changes: Any) -> str:
    settings: dict[str, Any] = {
        "about": About("A study", FIXED),
        "along": "restitution",
        "where": where_of(found),
        "resolution": RESOLUTION,
        "observer": OBSERVER,
    }
    return to_markdown(found, **{**settings, **changes})


def md_tables(text: str) -> list[list[list[str]]]:
    """Cells of every table of a Markdown text."""
    tables: list[list[list[str]]] = []
    open_table = False
    for line in text.splitlines():
        if not line.startswith("|"):
            open_table = False
            continue
        if not open_table:
            tables.append([])
            open_table = True
        if not set(line) <= set("|-"):
            tables[-1].append([cell.strip() for cell in line.strip("|").split("|")])
    return tables


# --- a real small study


def test_all_places_thresholds_and_predicates_in_order(table: list[Interval]) -> None:
    keys = [(item.where["mass_ratio"], item.threshold, item.chatter) for item in table]
    names = ["3 %", "1 %", "10 %"]  # the main one first, and once
    order = [(m, t, c) for m in MASSES for t in names for c in ("complete", "any")]
    assert [key for k, key in enumerate(keys) if key not in keys[:k]] == order
    for key in order:
        lowers = [item.lower for k, item in zip(keys, table, strict=True) if k == key]
        assert lowers == sorted(lowers)


def test_intervals_hold_exactly_the_grid_values_with_chatter(
    cube: xr.Dataset, table: list[Interval]
) -> None:
    for mass in MASSES:
        for k, threshold in enumerate(THRESHOLDS):
            for predicate, levels in HOLDS.items():
                mine = [
                    item
                    for item in table
                    if item.where == {"mass_ratio": mass}
                    and item.threshold == f"{100 * threshold:g} %"
                    and item.chatter == predicate
                ]
                assert mine
                for r in GRID:
                    level = cube.chatter_by_threshold.isel(threshold=k).sel(
                        mass_ratio=mass, restitution=r
                    )
                    inside = any(item.lower <= r <= item.upper for item in mine)
                    assert inside == (int(level) in levels), (mass, threshold, predicate, r)


def test_edges_are_where_runs_from_rest_change(table: list[Interval]) -> None:
    """The edge has chatter; a value within the resolution outside of it has none."""
    checked = 0
    for item in table:
        threshold = float(item.threshold.removesuffix(" %")) / 100
        levels = HOLDS[item.chatter]
        for edge, end, outwards in ((item.lower, GRID[0], -1), (item.upper, GRID[-1], 1)):
            assert chatter({**item.where, "restitution": edge}, threshold) in levels
            if edge == end:
                assert item.cut
                continue
            # The last halving of a grid step of .02 that is still within the resolution.
            outside = edge + outwards * 0.02 / 32
            assert 0.02 / 32 <= RESOLUTION < 0.02 / 16
            assert chatter({**item.where, "restitution": outside}, threshold) not in levels
            checked += 1
    assert checked > 10


def test_lower_edge_of_complete_chatter(table: list[Interval]) -> None:
    """Model section 8, B1: five visible impacts at 3 % begin near .03^(1/4) = .416."""
    for mass in MASSES:
        wide = [
            item
            for item in table
            if item.where["mass_ratio"] == mass
            and (item.threshold, item.chatter, item.narrow) == ("3 %", "complete", False)
        ]
        assert 0.40 < wide[0].lower < 0.43


def test_upper_edge_rises_as_the_mass_ratio_falls(table: list[Interval]) -> None:
    """Model section 8, B2 at omega 1.3: .72 and .75."""
    upper = {
        mass: max(
            item.upper
            for item in table
            if item.where["mass_ratio"] == mass
            and (item.threshold, item.chatter, item.narrow) == ("3 %", "complete", False)
        )
        for mass in MASSES
    }
    assert upper[0.25] == pytest.approx(0.72, abs=0.015)
    assert upper[0.001] == pytest.approx(0.75, abs=0.015)


def test_every_value_is_simulated_once(cube: xr.Dataset, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[float, float]] = []

    def counting(parameters: Any, *arguments: Any, **keywords: Any) -> Any:
        parameters = list(parameters)
        seen.extend((values["mass_ratio"], values["restitution"]) for values in parameters)
        return run_points(parameters, *arguments, **keywords)

    monkeypatch.setattr(intervals_module, "run_points", counting)
    table_of(cube)
    assert len(seen) == len(set(seen)) > 10
    assert not {r for _, r in seen} & set(GRID), "grid values are known from the cube"


def test_order_of_dimensions_and_values_does_not_matter(
    cube: xr.Dataset, table: list[Interval]
) -> None:
    turned = cube.transpose("threshold", "restitution", "mass_ratio").isel(
        restitution=slice(None, None, -1)
    )
    assert table_of(turned) == table
    assert table_of(cube.isel(mass_ratio=[1, 0])) != table


def test_without_compared_thresholds_and_other_axes(table: list[Interval]) -> None:
    observer = {"threshold": 0.03}
    cube = make_cube(observer, mass_ratio=0.25)
    found = table_of(cube, observer)
    assert {item.threshold for item in found} == {"3 %"}
    assert all(item.where == {} for item in found)
    main = [item for item in table if item.where["mass_ratio"] == 0.25 and item.threshold == "3 %"]
    edges = [(item.chatter, item.lower, item.upper, item.narrow, item.cut) for item in main]
    assert [(i.chatter, i.lower, i.upper, i.narrow, i.cut) for i in found] == edges
    rows = list(csv.DictReader(io.StringIO(to_csv(found, "restitution", where_of(found)))))
    assert next(iter(rows[0])) == "threshold"
    (rows_of_md,) = md_tables(markdown(found, observer=observer))
    assert rows_of_md[0] == ["complete", "any"]
    assert len(rows_of_md) == 2


def test_threshold_as_speed_reaches_the_runs() -> None:
    observer = {"threshold": {"speed": 0.02}}
    cube = make_cube(observer, mass_ratio=0.25)
    found = table_of(cube, observer)
    assert {item.threshold for item in found} == {"speed 0.02"}
    (first, *_) = (item for item in found if item.chatter == "complete")
    assert not first.cut
    point = {"mass_ratio": 0.25, "restitution": first.lower}
    assert chatter(point, {"speed": 0.02}) == 2
    point["restitution"] -= 0.02 / 32
    assert chatter(point, {"speed": 0.02}) != 2


def test_along_another_axis() -> None:
    frequencies = [round(1.1 + 0.1 * k, 1) for k in range(10)]
    cube = make_cube(
        {"threshold": 0.03}, mass_ratio=0.25, frequency_ratio=frequencies, restitution=[0.5, 0.6]
    )
    found = table_of(cube, {"threshold": 0.03}, along="frequency_ratio")
    assert {tuple(item.where.items()) for item in found} <= {
        (("restitution", 0.5),),
        (("restitution", 0.6),),
    }
    inner = [item for item in found if item.upper < frequencies[-1]]
    assert inner
    for item in inner:
        point = {**item.where, "mass_ratio": 0.25, "frequency_ratio": item.upper}
        assert chatter(point) in HOLDS[item.chatter]


# --- CSV


def test_csv_has_a_line_per_interval(table: list[Interval]) -> None:
    text = to_csv(table, "restitution", where_of(table))
    assert text.endswith("\n")
    assert "\r" not in text
    rows = list(csv.DictReader(io.StringIO(text)))
    assert list(rows[0]) == [
        "mass_ratio",
        "threshold",
        "chatter",
        "restitution_lower",
        "restitution_upper",
        "narrow",
        "cut",
    ]
    assert len(rows) == len(table)
    for row, item in zip(rows, table, strict=True):
        assert float(row["mass_ratio"]) == item.where["mass_ratio"]
        assert row["threshold"] == item.threshold
        assert row["chatter"] == item.chatter
        assert float(row["restitution_lower"]) == pytest.approx(item.lower, abs=1e-6)
        assert float(row["restitution_upper"]) == pytest.approx(item.upper, abs=1e-6)
        assert row["narrow"] == ("true" if item.narrow else "false")
        assert row["cut"] == ("true" if item.cut else "false")


def test_csv_without_intervals_is_a_head() -> None:
    (line,) = to_csv([], "restitution", [{}]).splitlines()
    assert line == "threshold,chatter,restitution_lower,restitution_upper,narrow,cut"


# --- Markdown


def item(
    mass: float,
    threshold: str,
    kind: str,
    edges: tuple[float, float],
    narrow: bool = False,
    cut: bool = False,
) -> Interval:
    return Interval({"mass_ratio": mass}, threshold, kind, *edges, narrow, cut)


#: Two places whose hulls move by known amounts from 1 % to 10 %.
MADE_UP = [
    item(0.1, "3 %", "complete", (0.400, 0.700)),
    item(0.1, "3 %", "complete", (0.750, 0.760), narrow=True),
    item(0.1, "3 %", "complete", (0.800, 1.000), cut=True),
    item(0.1, "3 %", "any", (0.400, 1.000), cut=True),
    item(0.1, "1 %", "complete", (0.300, 0.700)),
    item(0.1, "1 %", "any", (0.300, 0.950)),
    item(0.1, "10 %", "complete", (0.550, 0.600)),
    item(0.1, "10 %", "complete", (0.650, 0.690)),
    item(0.1, "10 %", "any", (0.550, 0.990)),
    item(0.2, "3 %", "any", (0.500, 0.510), narrow=True),
    item(0.2, "1 %", "complete", (0.350, 0.500)),
    item(0.2, "1 %", "any", (0.350, 0.600)),
    item(0.2, "10 %", "any", (0.410, 0.570)),
]


def test_main_table_by_hand() -> None:
    (main, _) = md_tables(markdown(MADE_UP))
    assert main == [
        ["mass ratio", "complete", "any"],
        ["0.1", "0.400–0.700, 0.800–1.000+, 1 narrow", "0.400–1.000+"],
        ["0.2", "none", "1 narrow"],
    ]


def test_threshold_table_by_hand() -> None:
    (_, moves) = md_tables(markdown(MADE_UP))
    assert moves == [
        [
            "mass ratio",
            *("complete, 1 %", "complete, 3 %", "complete, 10 %"),
            *("any, 1 %", "any, 3 %", "any, 10 %"),
        ],
        [
            "0.1",
            *("0.300–0.700", "0.400–1.000", "0.550–0.690"),
            *("0.300–0.950", "0.400–1.000", "0.550–0.990"),
        ],
        ["0.2", "0.350–0.500", "none", "none", "0.350–0.600", "none", "0.410–0.570"],
    ]


def test_sensitivity_note_by_hand() -> None:
    notes = [line for line in markdown(MADE_UP).splitlines() if line.startswith("- ")]
    assert notes == [
        "- complete, from 1 % to 10 %: the lower edge moves by +0.250 to +0.250, "
        "the upper edge by -0.010 to -0.010 (1 of 2 rows have intervals at both); "
        "in 1 rows they vanish.",
        "- any, from 1 % to 10 %: the lower edge moves by +0.060 to +0.250, "
        "the upper edge by -0.030 to +0.040 (2 of 2 rows have intervals at both).",
    ]


def test_sensitivity_note_without_intervals_at_both() -> None:
    found = [
        item(0.1, "3 %", "complete", (0.4, 0.7)),
        item(0.1, "1 %", "complete", (0.3, 0.7)),
        item(0.1, "10 %", "complete", (0.5, 0.52), narrow=True),
    ]
    notes = [line for line in markdown(found).splitlines() if line.startswith("- ")]
    assert notes[0].startswith("- complete, from 1 % to 10 %: no row has intervals at both")
    assert "in 1 rows they vanish" in notes[0]
    assert notes[1] == "- any, from 1 % to 10 %: no row has intervals at both."


def test_speed_and_fractions_are_not_one_scale() -> None:
    """A main threshold in absolute speed is no point between fractions of the first speed."""
    found = [
        item(0.1, "speed 0.02", "complete", (0.4, 0.7)),
        item(0.1, "1 %", "complete", (0.3, 0.7)),
        item(0.1, "10 %", "complete", (0.5, 0.7)),
    ]
    observer = {"threshold": {"speed": 0.02}, "compare_thresholds": [0.01, 0.1]}
    text = markdown(found, observer=observer)
    assert "from speed" not in text
    assert "complete, from 1 % to 10 %: the lower edge moves by +0.200 to +0.200" in text


def test_numbers_of_the_real_table_recomputed(table: list[Interval]) -> None:
    """From the CSV text, by a loop over its rows."""
    rows = list(csv.DictReader(io.StringIO(to_csv(table, "restitution", where_of(table)))))
    text = markdown(table)
    main, moves = md_tables(text)
    assert [row[0] for row in main[1:]] == ["0.25", "0.001"]

    def hull(mass: str, threshold: str, kind: str) -> tuple[float, float] | None:
        wide = [
            row
            for row in rows
            if (row["mass_ratio"], row["threshold"], row["chatter"], row["narrow"])
            == (mass, threshold, kind, "false")
        ]
        if not wide:
            return None
        return (
            min(float(row["restitution_lower"]) for row in wide),
            max(float(row["restitution_upper"]) for row in wide),
        )

    for row in moves[1:]:
        for head, cell in zip(moves[0][1:], row[1:], strict=True):
            kind, threshold = head.split(", ")
            expected = hull(row[0], threshold, kind)
            if expected is None:
                assert cell == "none"
            else:
                got = [float(number) for number in cell.split("–")]
                assert got == pytest.approx(expected, abs=0.0006)

    for kind in ("complete", "any"):
        (note,) = (line for line in text.splitlines() if line.startswith(f"- {kind}, from 1 %"))
        numbers = [float(number) for number in re.findall(r"[+-]\d\.\d{3}", note)]
        pairs = [
            (low, high)
            for mass in ("0.25", "0.001")
            if (low := hull(mass, "1 %", kind)) and (high := hull(mass, "10 %", kind))
        ]
        lower = [high[0] - low[0] for low, high in pairs]
        upper = [high[1] - low[1] for low, high in pairs]
        expected_moves = [min(lower), max(lower), min(upper), max(upper)]
        assert numbers == pytest.approx(expected_moves, abs=0.0011)
        assert f"({len(pairs)} of 2 rows" in note


def test_place_without_any_chatter_has_a_row() -> None:
    """A reader must see that a place was looked at and has none."""
    observer = {"threshold": 0.03}
    cube = make_cube(observer, mass_ratio=0.25, clearance=[0.05, 50.0])
    found = table_of(cube, observer)
    where = places(cube, "restitution")
    assert where == [{"clearance": 0.05}, {"clearance": 50.0}]
    (rows,) = md_tables(markdown(found, where=where, observer=observer))
    assert [row[0] for row in rows[1:]] == ["0.05", "50"]
    assert rows[2][1:] == ["none", "none"]


def test_study_without_any_chatter_has_its_columns() -> None:
    """A file's columns do not depend on what was found."""
    observer = {"threshold": 0.03}
    cube = make_cube(observer, clearance=50.0)
    found = table_of(cube, observer)
    assert found == []
    (line,) = to_csv(found, "restitution", places(cube, "restitution")).splitlines()
    assert line.split(",")[0] == "mass_ratio"
    (rows,) = md_tables(markdown(found, where=places(cube, "restitution"), observer=observer))
    assert rows[1:] == [["0.25", "none", "none"], ["0.001", "none", "none"]]


def test_places_are_the_product_of_the_other_axes(cube: xr.Dataset) -> None:
    assert places(cube, "restitution") == [{"mass_ratio": 0.25}, {"mass_ratio": 0.001}]
    along_mass = places(cube, "mass_ratio")
    assert along_mass == [{"restitution": r} for r in GRID]


def test_text_says_what_was_done(table: list[Interval]) -> None:
    text = markdown(
        table,
        about=About("My title", FIXED, assumed={"damping_ratio": "lost in the text"}),
        resolution=0.0025,
        stopped=3,
    )
    lines = text.splitlines()
    assert lines[0] == "# My title: chatter intervals in restitution"
    assert "threshold 3 %" in text
    assert "bisected to 0.0025" in text
    assert "damping_ratio = 0.02, frequency_ratio = 1.3, clearance = 0.05, phase = 0" in text
    assert "3 points stopped early" in text
    assert "- damping ratio: lost in the text" in lines
    assert text.endswith("\n")
    plain = markdown(table)
    assert "Assumed" not in plain
    assert "stopped" not in plain


def test_columns_of_every_markdown_row_agree(table: list[Interval]) -> None:
    for text in (markdown(table), markdown(MADE_UP)):
        for rows in md_tables(text):
            assert len({len(row) for row in rows}) == 1
        # A line of dashes under each head, or it is no table.
        lines = text.splitlines()
        heads = [k for k, line in enumerate(lines) if line.startswith("| mass ratio")]
        assert len(heads) == 2
        for k in heads:
            assert lines[k + 1].count("---") == lines[k].count("|") - 1


@pytest.mark.parametrize(
    ("threshold", "name"),
    [
        (0.03, "3 %"),
        (0.005, "0.5 %"),
        (0.125, "12.5 %"),
        ({"fraction": 0.1}, "10 %"),
        ({"speed": 0.02}, "speed 0.02"),
    ],
)
def test_threshold_in_words(threshold: Any, name: str) -> None:
    assert threshold_name(threshold) == name
