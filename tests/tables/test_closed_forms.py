"""Tables of theory beside simulation, and how mistakes in asking for them are told."""

import csv
import io
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
import yaml

import damper
from damper.analysis.closed_forms import damper_at, dense, reduced_gap
from damper.study.config import ConfigError, Study, load_study
from damper.sweep.runs import run_points
from damper.tables import About, make
from damper.theory.small_mass import critical_restitution
from damper.theory.two_impacts import orbits

RUN = {"transient": 5, "periods": 5, "primary": "steady", "accuracy": 1e-12, "max_events": 10**6}


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


# --- small-mass limit


@pytest.fixture(scope="module")
def light() -> tuple[xr.Dataset, str, str]:
    cube = damper.simulate(
        mass_ratio=1e-4,
        damping_ratio=0.05,
        frequency_ratio=[0.3, 1.2],
        # Not in order, and the last one beyond G = pi below resonance.
        clearance=[1.0, 0.2, 3.0],
        restitution=np.linspace(0.0, 0.8, 9),
        initial="steady",
        transient=5,
        periods=5,
        observers=["bursts"],
    )
    about = About("Light", {"mass_ratio": 1e-4}, {"bursts": {}}, {"mass_ratio": "small"}, RUN)
    return cube, *make("small_mass_limit", cube, {"resolution": 1e-4}, about)


def test_borders_lie_at_the_limit(light: tuple[xr.Dataset, str, str]) -> None:
    found = rows(light[1])
    assert [(row["frequency_ratio"], row["clearance"]) for row in found] == [
        (w, d) for w in ("0.3", "1.2") for d in ("0.2", "1", "3")
    ]
    for row in found:
        omega, d = float(row["frequency_ratio"]), float(row["clearance"])
        amplitude = 1.0 / math.hypot(1.0 - omega**2, 0.1 * omega)
        gap = 2.0 * d / amplitude
        assert float(row["reduced_gap"]) == pytest.approx(gap, rel=1e-5)
        if gap > math.pi:
            assert row["critical_restitution"] == "nan"
            continue
        limit = float(critical_restitution(gap))
        assert float(row["critical_restitution"]) == pytest.approx(limit, abs=1e-6)
        assert float(row["border"]) == pytest.approx(limit, abs=4e-4)
        assert float(row["difference"]) == pytest.approx(float(row["border"]) - limit, abs=2e-6)
        assert row["single"] == "true"
        # Bisected: all bursts complete just below the border and not just above it.
        for side, all_complete in ((-1e-4, True), (1e-4, False)):
            point = {
                "mass_ratio": 1e-4, "damping_ratio": 0.05, "frequency_ratio": omega,
                "clearance": d, "restitution": float(row["border"]) + side,
            }  # fmt: skip
            arrays, _ = run_points([point], ["bursts"], **RUN)
            assert (arrays["complete_fraction"][0] == 1.0) == all_complete


def test_words_give_the_largest_distance(light: tuple[xr.Dataset, str, str]) -> None:
    _, csv_text, text = light
    differences = [abs(float(row["difference"])) for row in rows(csv_text)]
    largest = max(x for x in differences if math.isfinite(x))
    assert f"Largest distance between border and limit: {largest:.1e}." in text
    assert "| 0.3 | 2 of 3 |" in text
    assert "| 1.2 | 3 of 3 |" in text
    assert "- mass ratio: small" in text


def test_borders_that_are_not_on_the_axis(light: tuple[xr.Dataset, str, str]) -> None:
    cube = light[0].isel(frequency_ratio=[0])
    about = About("Light", {}, {}, {}, RUN)
    low = cube.sel(restitution=slice(0.0, 0.05))  # one value, complete, and above the limit at 3
    text, words = make("small_mass_limit", low, {"resolution": 1e-4}, about)
    assert [row["border"] for row in rows(text)] == ["nan"] * 3
    assert "Largest distance between border and limit: none." in words
    high = cube.sel(restitution=slice(0.65, 0.85))
    text, _ = make("small_mass_limit", high, {"resolution": 1e-4}, about)
    assert [row["border"] for row in rows(text)] == ["nan"] * 3


def test_several_borders_are_told() -> None:
    cube = damper.simulate(
        mass_ratio=1e-4, damping_ratio=0.05, frequency_ratio=0.3, clearance=[0.2, 1.0],
        restitution=[0.0, 0.1, 0.2, 0.3, 0.4], transient=0, periods=1, observers=["bursts"],
    )  # fmt: skip
    complete = np.array([[1, 1], [1, 0.5], [0.5, 0.5], [1, 0.5], [0, 0]], dtype=float)
    cube["complete_fraction"] = (("restitution", "clearance"), complete)
    text, _ = make("small_mass_limit", cube, {"resolution": 0.2}, About("", {}, {}, {}, RUN))
    assert [row["single"] for row in rows(text)] == ["false", "true"]
    assert [row["border"] for row in rows(text)] == ["0.15", "0.05"]


# --- two impacts per period

SECTION = {"stroboscopic_section": {"at": 0.25, "free_mass": False}}


@pytest.fixture(scope="module")
def motion() -> tuple[xr.Dataset, str, str]:
    cube = damper.simulate(
        mass_ratio=0.1,
        damping_ratio=0.02,
        frequency_ratio=1.0,
        clearance=np.arange(2.0, 16.1, 1.0),
        restitution=[0.3, 0.6],
        transient=200,
        periods=10,
        observers={**SECTION, "impacts": {}},
    )
    about = About("Motion", {"mass_ratio": 0.1}, {**SECTION, "bursts": {}})
    return cube, *make("two_impacts", cube, {"along": "clearance", "resolution": 1e-4}, about)


def test_ranges_end_where_the_motion_does(motion: tuple[xr.Dataset, str, str]) -> None:
    found = [row for row in rows(motion[1]) if row["row"] != "comparison"]
    assert {row["row"] for row in found} == {"exists", "stable"}
    for row in found:
        wanted = (lambda o: o.admissible and o.stable) if row["row"] == "stable" else (
            lambda o: o.admissible
        )  # fmt: skip

        def holds(d: float, r: str = row["restitution"], wanted: Any = wanted) -> bool:
            return any(map(wanted, orbits(damper.Parameters(0.1, 0.02, 1.0, d, float(r)))))

        lower, upper = float(row["clearance_lower"]), float(row["clearance_upper"])
        assert holds(lower + 1e-4)
        assert holds(upper - 1e-4)
        for end, beyond in ((lower, lower - 3e-4), (upper, upper + 3e-4)):
            if 2.0 < end < 16.0:
                assert not holds(beyond)
        assert (row["cut"] == "true") == (lower == 2.0 or upper == 16.0)


def test_simulation_agrees_to_rounding(motion: tuple[xr.Dataset, str, str]) -> None:
    compared = [row for row in rows(motion[1]) if row["row"] == "comparison"]
    assert [row["restitution"] for row in compared] == ["0.3", "0.6"]
    for row in compared:
        assert 4 <= int(row["settled"]) <= int(row["compared"]) <= int(row["simulated"]) <= 6
        assert float(row["largest_settled"]) < 1e-8
        assert float(row["largest_settled"]) <= float(row["largest"])
    assert "two impacts per period" in motion[2]


def test_a_wrong_simulation_is_seen(motion: tuple[xr.Dataset, str, str]) -> None:
    cube = motion[0].copy()
    cube["velocity"] = cube.velocity + 1e-3
    about = About("Motion", {}, SECTION)
    text, _ = make("two_impacts", cube, {"along": "clearance", "resolution": 1.0}, about)
    compared = [row for row in rows(text) if row["row"] == "comparison"]
    assert all(float(row["largest_settled"]) == pytest.approx(1e-3, rel=1e-3) for row in compared)
    cube["impacts_per_period"] = cube.impacts_per_period + 1.0
    text, words = make("two_impacts", cube, {"along": "clearance", "resolution": 1.0}, about)
    assert all(row["compared"] == "0" for row in rows(text) if row["row"] == "comparison")
    assert "none" in words


def test_directions_and_draws_are_compared_together() -> None:
    cube = damper.simulate(
        mass_ratio=0.1, damping_ratio=0.02, frequency_ratio=1.0, restitution=0.6,
        clearance=[9.0, 10.0, 11.0], follow={"clearance": "both"}, transient=150, periods=5,
        observers={"impact_section": {"wall": "left", "samples": 7}, "impacts": {}},
    )  # fmt: skip
    about = About("", {}, {"impact_section": {"wall": "left", "samples": 7}})
    text, _ = make("two_impacts", cube, {"along": "clearance", "resolution": 1e-2}, about)
    (row,) = [row for row in rows(text) if row["row"] == "comparison"]
    assert (row["simulated"], row["compared"]) == ("6", "6")
    assert float(row["largest"]) < 1e-6


# --- shared


def test_damper_at_reads_both_systems_of_units() -> None:
    si = damper.SIParameters(2.0, 4.0, 200.0, 10.0, 11.0, 0.2, 0.02, 0.6)
    names = list(damper.SIParameters.__dataclass_fields__)
    place = xr.Dataset(coords={name: getattr(si, name) for name in names if name != "gap"})
    parameters, units = damper_at(place, gap=0.02)
    assert parameters == si.dimensionless
    assert units == si.units
    assert reduced_gap(damper.Parameters(1.0, 0.0, 1.0, 1.0, 0.5)) == 0.0


def test_dense_values_keep_the_grid() -> None:
    grid = np.array([3.0, 1.0, 1.5])
    found = dense(grid, between=4, most=100)
    assert set(grid) <= set(found)
    assert len(found) == 9
    np.testing.assert_array_equal(dense(grid, between=4, most=3), np.sort(grid))


# --- mistakes in a study

GOOD: dict[str, Any] = {
    "title": "t",
    "source": "s",
    "parameters": {"damping_ratio": 0.02, "mass_ratio": 0.1, "frequency_ratio": 1},
    "axes": {"clearance": {"values": [1, 2, 3]}, "restitution": {"values": [0.3, 0.6]}},
    "transient": 10,
    "periods": 10,
    "observers": {"stroboscopic_section": {"at": 0.5}, "bursts": None, "impacts": None},
}
MAP = {"kind": "map", "x": "clearance", "y": "restitution", "theory": "small_mass_limit"}
LINE = {"kind": "bifurcation", "along": "clearance", "rows": "restitution"}


def load(folder: Path, **changes: Any) -> Study:
    path = folder / "good.yaml"
    path.write_text(yaml.safe_dump({**GOOD, **changes}))
    return load_study(path)


def blame(folder: Path, **changes: Any) -> str:
    with pytest.raises(ConfigError) as caught:
        load(folder, **changes)
    message = str(caught.value)
    assert message.startswith("1 error "), message
    return message


def test_good_ones(tmp_path: Path) -> None:
    figures = {
        "a": MAP | {"variable": "complete_fraction"},
        "b": MAP | {"variable": "chatter", "x": "restitution", "y": "clearance"},
        "c": LINE | {"theory": "two_impacts"},
        "d": LINE,
    }
    tables = {"a": {"kind": "small_mass_limit"}, "b": {"kind": "two_impacts", "along": "clearance"}}
    study = load(tmp_path, figures=figures, tables=tables)
    section = {"stroboscopic_section": {"at": 0.5, "free_mass": False}}
    assert study.figure_settings("c")["section"] == section
    assert "section" not in study.figure_settings("d")
    assert "section" not in study.figure_settings("a")
    assert study.figure_settings("a")["theory"] == "small_mass_limit"
    assert study.tables["a"].resolution == 1e-4


MISTAKES: dict[str, tuple[dict[str, Any], tuple[str, ...]]] = {
    "axes of the map": (
        {
            "figures": {"a": MAP | {"variable": "chatter", "y": "mass_ratio"}},
            "parameters": {"damping_ratio": 0.02, "frequency_ratio": 1, "restitution": 0.5},
            "axes": {"clearance": {"values": [1, 2]}, "mass_ratio": {"values": [0.1, 0.2]}},
        },
        (
            "figures.a.theory\n    the small-mass limit has no place over clearance, mass_ratio",
            "allowed: restitution and clearance (or gap) as x and y",
        ),
    ),
    "variable of the map": (
        {"figures": {"a": MAP | {"variable": "impacts_per_period"}}},
        ("does not speak of 'impacts_per_period'", "a map of complete_fraction, chatter"),
    ),
    "theory of another kind": (
        {"figures": {"a": MAP | {"variable": "chatter", "theory": "two_impacts"}}},
        ("figures.a.theory\n    not one of the choices (value: 'two_impacts')", "small_mass_limit"),
    ),
    "no such theory": (
        {"figures": {"a": LINE | {"theory": "two_impact"}}},
        ("not one of the choices (value: 'two_impact')", "did you mean 'two_impacts'?"),
    ),
    "manifold without a trajectory": (
        {
            "figures": {
                "a": {"kind": "slow_manifold", "panels": "restitution", "at": {"clearance": 1}}
            }
        },
        ("needs trajectory among the observers",),
    ),
    "limit without bursts": (
        {"observers": {"impacts": None}, "tables": {"a": {"kind": "small_mass_limit"}}},
        ("needs bursts among the observers",),
    ),
    "limit of a followed study": (
        {
            "axes": {
                "clearance": {"values": [1, 2], "follow": "up"},
                "restitution": {"values": [0.3, 0.6]},
            },
            "tables": {"a": {"kind": "small_mass_limit"}},
        },
        ("borders are bisected by runs from one initial state", "without follow and without draws"),
    ),
    "limit without its axes": (
        {
            "parameters": GOOD["parameters"] | {"restitution": 0.5},
            "axes": {"clearance": {"values": [1, 2]}},
            "tables": {"a": {"kind": "small_mass_limit"}},
        },
        ("needs an axis of the restitution",),
    ),
    "motion without a section": (
        {
            "observers": {"impacts": None},
            "tables": {"a": {"kind": "two_impacts", "along": "clearance"}},
        },
        ("needs a section among the observers",),
    ),
    "motion without impacts": (
        {
            "observers": {"stroboscopic_section": None},
            "tables": {"a": {"kind": "two_impacts", "along": "clearance"}},
        },
        ("needs impacts among the observers",),
    ),
    "motion along a misspelt axis": (
        {"tables": {"a": {"kind": "two_impacts", "along": "clearence"}}},
        ("unknown axis 'clearence'", "did you mean 'clearance'?"),
    ),
    "motion along an initial quantity": (
        {
            "axes": GOOD["axes"] | {"initial_velocity": {"values": [0, 1]}},
            "tables": {"a": {"kind": "two_impacts", "along": "initial_velocity"}},
        },
        ("which the closed form does not depend on", "an axis of a parameter"),
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_refused(tmp_path: Path, name: str) -> None:
    changes, parts = MISTAKES[name]
    message = blame(tmp_path, **changes)
    for part in parts:
        assert part in message, message


@pytest.mark.parametrize(
    "asked",
    [
        {"figures": {"a": MAP | {"variable": "chatter"}}},
        {"figures": {"a": LINE | {"theory": "two_impacts"}}},
        {"tables": {"a": {"kind": "small_mass_limit"}}},
        {"tables": {"a": {"kind": "two_impacts", "along": "clearance"}}},
    ],
)
def test_other_models_are_refused(tmp_path: Path, asked: dict[str, Any]) -> None:
    parameters = GOOD["parameters"] | {"support_stiffness_ratio": 0.1}
    message = blame(tmp_path, parameters=parameters, **asked)
    assert "its formulas are those of the rigid damper, this is the grounded one" in message
    load(tmp_path, parameters=parameters, figures={"a": LINE})
