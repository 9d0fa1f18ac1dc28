"""Verdicts on the papers' statements, from made-up cubes whose verdict is known."""

import csv
import io
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr

from damper.papers.base import FAILS, HOLDS, READING, UNTESTABLE, UNTESTED
from damper.papers.statements import STATEMENTS
from damper.papers.verdicts import judge, sentence, table

CLAIMS = {statement.name: statement for statement in STATEMENTS}
MASSES = (0.25, 0.1, 0.05, 0.001)
R = np.round(np.arange(0.0, 1.001, 0.01), 2)
THRESHOLDS = (0.01, 0.03, 0.1)
SAMPLES = 40


def intervals(
    edges: Callable[[float, float, float], tuple[float, float, float]],
    frequencies: tuple[float, ...] = (1.1, 1.5),
    points: Callable[[float], int] = lambda r: 1,
) -> xr.Dataset:
    """Cube of a restitution study.

    `edges` gives, for a mass ratio, a frequency ratio and a threshold, the lower edge of chatter,
    and the upper edges of complete and of any chatter; `points` the points on the section.
    """
    chatter = np.zeros((len(MASSES), len(frequencies), R.size, 3), dtype="i1")
    for i, mass in enumerate(MASSES):
        for j, frequency in enumerate(frequencies):
            for k, threshold in enumerate(THRESHOLDS):
                low, complete, incomplete = edges(mass, frequency, threshold)
                chatter[i, j, (low <= R) & (incomplete >= R), k] = 1
                chatter[i, j, (low <= R) & (complete >= R), k] = 2
    x = np.array([np.arange(SAMPLES) % points(r) for r in R], dtype=float)
    x = np.broadcast_to(x, (*chatter.shape[:3], SAMPLES))
    dims = ("mass_ratio", "frequency_ratio", "restitution")
    return xr.Dataset(
        {
            "chatter": (dims, chatter[..., 1]),
            "chatter_by_threshold": ((*dims, "threshold"), chatter),
            "displacement": ((*dims, "sample"), x.copy()),
        },
        {
            "mass_ratio": list(MASSES),
            "frequency_ratio": ("frequency_ratio", list(frequencies), {"assumed": "lost"}),
            "restitution": R,
            "threshold": list(THRESHOLDS),
            "clearance": ((), 0.05, {"assumed": "lost"}),
        },
    )


def paper_b(above: xr.Dataset, below: xr.Dataset | None = None) -> dict[str, xr.Dataset]:
    return {"restitution": above, "restitution_below_resonance": above if below is None else below}


def narrowing(mass: float, frequency: float, threshold: float) -> tuple[float, float, float]:
    """As B1 to B3 have it, for complete and incomplete chatter alike."""
    top = 0.9 - 0.2 * (frequency - 1.1) - 0.3 * mass
    return 0.5, round(top, 2), round(top, 2)


def everything_else(mass: float, frequency: float, threshold: float) -> tuple[float, float, float]:
    """The other way round."""
    top = 0.7 + 0.2 * (frequency - 1.1) + 0.3 * mass
    return 0.3, round(top, 2), round(top, 2)


@pytest.mark.parametrize("name", ["B1", "B2", "B3"])
def test_statements_on_the_interval(name: str) -> None:
    assert CLAIMS[name].judge(paper_b(intervals(narrowing))).verdict == HOLDS
    assert CLAIMS[name].judge(paper_b(intervals(everything_else))).verdict == FAILS


@pytest.mark.parametrize("name", ["B2", "B3"])
def test_statements_on_the_interval_hold_on_one_side_of_resonance(name: str) -> None:
    found = CLAIMS[name].judge(paper_b(intervals(narrowing), intervals(everything_else)))
    assert found.verdict == READING
    assert found.why == "complete chatter above resonance or any chatter above resonance"

    def complete(mass: float, frequency: float, threshold: float) -> tuple[float, float, float]:
        low, top, _ = narrowing(mass, frequency, threshold)
        return low, top, 1.0

    found = CLAIMS[name].judge(paper_b(intervals(complete), intervals(everything_else)))
    assert found.why == "complete chatter above resonance"
    # One frequency, or one mass, that does the opposite is enough.
    other = intervals(complete)
    place = {"mass_ratio": 0.1, "frequency_ratio": 1.5}
    other.chatter.loc[place] = 2
    assert CLAIMS[name].judge(paper_b(other)).verdict == FAILS


def test_needed_restitution_depends_on_what_is_visible() -> None:
    def edges(mass: float, frequency: float, threshold: float) -> tuple[float, float, float]:
        return {0.01: 0.3, 0.03: 0.41, 0.1: 0.55}[threshold], 0.86, 1.0

    found = CLAIMS["B1"].judge(paper_b(intervals(edges)))
    assert found.verdict == READING
    assert "threshold c of 10%;" in found.why
    assert "any chatter up to 1" in found.found
    # The fourth roots of 1, 3 and 10 %.
    assert found.numbers[1:] == [
        ("1%", "0.3", "0.316", "0.86", ""),
        ("3%", "0.41", "0.416", "0.86", ""),
        ("10%", "0.55", "0.562", "0.86", ""),
    ]


def test_large_restitution_chatters_more_at_small_mass() -> None:
    assert CLAIMS["B4"].judge(paper_b(intervals(narrowing))).verdict == HOLDS
    assert CLAIMS["B4"].judge(paper_b(intervals(everything_else))).verdict == FAILS
    mixed = CLAIMS["B4"].judge(paper_b(intervals(everything_else), intervals(narrowing)))
    assert mixed.verdict == READING
    assert "below resonance" in mixed.why


def test_bifurcation_above_a_half() -> None:
    more = intervals(narrowing, points=lambda r: 1 + int(r > 0.5))
    assert CLAIMS["B6"].judge(paper_b(more)).verdict == HOLDS
    less = intervals(narrowing, points=lambda r: 1 + int(0.3 < r < 0.6))
    assert CLAIMS["B6"].judge(paper_b(less)).verdict == FAILS
    found = CLAIMS["B6"].judge(paper_b(less, more))
    assert found.verdict == READING
    assert found.why == "below resonance"
    # Of the restitutions up to a half .31 to .5 do, then all up to .59.
    assert found.numbers[1][:4] == ("above resonance", "0.31", "39%", "90%")


def test_figures_of_paper_b() -> None:
    samples = [[1.0, 1.0, 1.0, 1.0], [1.0, 2.0, 1.0, 2.0]]
    portraits = xr.Dataset(
        {"displacement": (("restitution", "mass_ratio", "sample"), np.stack([samples] * 2, 1))},
        {"restitution": [0.6, 0.7], "mass_ratio": [0.25, 0.1]},
    )
    cubes = paper_b(intervals(narrowing))
    cubes |= {"paper_b_portraits": portraits, "paper_b_histories": cubes["restitution"]}
    found = CLAIMS["B5"].judge(cubes)
    assert found.verdict == UNTESTABLE
    assert "0.6 (1 point on the section), 0.7 (2 points on the section)" in found.found


# --- paper A


def clearances(limit: float, samples: int = 1, above: float = 0.0) -> dict[str, xr.Dataset]:
    """Chatter up to a limit; `samples` points on the section beyond it."""
    d = np.round(np.arange(0.0, 2.001, 0.05), 2)
    x = np.array([np.arange(SAMPLES) % (samples if one > limit else 7) for one in d], dtype=float)
    cube = xr.Dataset(
        {
            "chatter": ("clearance", np.where(d <= limit, 2, 0)),
            "impacts_per_period": ("clearance", np.where(d <= limit, 9.0, above)),
            "displacement": (("clearance", "sample"), x),
        },
        {"clearance": d},
    )
    return {"paper_a_clearance": cube}


@pytest.mark.parametrize(
    ("limit", "verdict"), [(1.35, HOLDS), (1.25, HOLDS), (1.1, FAILS), (1.6, FAILS), (0.0, FAILS)]
)
def test_chatter_over_clearance(limit: float, verdict: str) -> None:
    found = CLAIMS["A1"].judge(clearances(limit))
    assert found.verdict == verdict


def test_diagram_over_frequency() -> None:
    x = np.ones((6, SAMPLES))
    cube = xr.Dataset(
        {
            "displacement": (("frequency_ratio", "sample"), x.copy()),
            "chatter": ("frequency_ratio", [0, 0, 0, 1, 1, 0]),
        },
        {"frequency_ratio": np.linspace(0.1, 0.6, 6)},
    )
    cube.displacement[2, ::2] = 3.0
    found = CLAIMS["A2"].judge({"paper_a_frequency": cube})
    assert found.verdict == UNTESTABLE
    assert "change 2 times" in found.found


Burst = tuple[float, float, int, int]


def histories(
    slow: list[Burst], middle: list[Burst] | None = None, fast: list[Burst] | None = None
) -> dict[str, xr.Dataset]:
    """Bursts (onset, duration, complete, visible impacts) at the three frequency ratios."""
    rows = [slow, middle or slow, fast or slow]
    table = np.full((3, 12, 4), np.nan)
    for i, bursts in enumerate(rows):
        table[i, : len(bursts)] = np.reshape(bursts, (-1, 4))
    dims = ("frequency_ratio", "burst")
    names = ("onset", "duration", "complete", "visible_impacts")
    variables = {f"burst_{name}": (dims, table[..., k]) for k, name in enumerate(names)}
    variables["burst_wall"] = (dims, np.ones(table.shape[:2]))
    variables["burst_sticking_time"] = (dims, np.where(table[..., 2] == 1, 1.5, np.nan))
    return {"paper_a_histories": xr.Dataset(variables, {"frequency_ratio": [0.2, 0.25, 0.3]})}


HALF = 5 * np.pi


def steady(onset: float, duration: float, complete: int = 1) -> list[Burst]:
    return [(onset + k * HALF, duration, complete, 20) for k in range(8)]


def test_burst_at_low_frequency() -> None:
    """Statement A3: about 332, about 11."""
    single = histories([(331.0, 10.8, 1, 20)])
    assert CLAIMS["A3"].judge(single).verdict == HOLDS
    early = histories([(200.0, 10.8, 1, 20), (331.0, 10.8, 1, 20)])
    found = CLAIMS["A3"].judge(early)
    assert found.verdict == READING
    assert "331" in found.found
    assert "first chatter burst begins at 200" in found.found
    for other in (
        [(331.0, 10.8, 0, 20)],
        [(331.0, 7.0, 1, 20)],
        [(340.0, 10.8, 1, 20)],
        [(331.0, 10.8, 1, 4)],
        [],
    ):
        assert CLAIMS["A3"].judge(histories(other)).verdict == FAILS


def test_same_duration_at_two_frequencies() -> None:
    slow = steady(200.0, 10.9)
    assert CLAIMS["A4"].judge(histories(slow, steady(200.0, 10.2))).verdict == HOLDS
    found = CLAIMS["A4"].judge(histories(slow, steady(200.0, 9.4)))
    assert found.verdict == READING
    assert found.why.startswith("in forcing periods;")
    assert CLAIMS["A4"].judge(histories(slow, steady(200.0, 7.0))).verdict == FAILS
    assert CLAIMS["A4"].judge(histories(slow, steady(200.0, 10.9, 0))).verdict == FAILS
    # What the transient does is of no account.
    late = [(10.0, 3.0, 0, 9), *steady(200.0, 10.4)]
    assert CLAIMS["A4"].judge(histories(slow, late)).verdict == HOLDS
    assert CLAIMS["A4"].judge(histories(slow, [(10.0, 3.0, 0, 2)])).verdict == FAILS


def test_incomplete_at_high_frequency() -> None:
    slow = steady(200.0, 10.9)
    assert CLAIMS["A5"].judge(histories(slow, slow, steady(100.0, 9.0, 0))).verdict == HOLDS
    mixed = [(10.0, 9.0, 1, 9), *steady(200.0, 9.0, 0)]
    found = CLAIMS["A5"].judge(histories(slow, slow, mixed))
    assert (found.verdict, found.why) == (
        READING,
        "after the transient; during it some bursts complete",
    )
    assert CLAIMS["A5"].judge(histories(slow, slow, slow)).verdict == FAILS
    assert CLAIMS["A5"].judge(histories(slow, slow, [(5.0, 1.0, 0, 3)])).verdict == FAILS


@pytest.mark.parametrize(
    ("first", "second", "verdict"),
    [
        (0.05, 0.01, HOLDS),
        (0.3, 0.05, READING),
        (0.5, 0.3, READING),
        (1.0, 1.0, FAILS),
        (0.5, np.nan, FAILS),
    ],
)
def test_prediction(first: float, second: float, verdict: str) -> None:
    """Statement A6, on bursts of four impacts whose predictions get better by halves."""
    left = np.array([8.0, 4.0, 2.0, 1.0])
    better = 0.25 ** np.arange(4)
    cube = xr.Dataset({"complete_bursts": ("restitution", [1])}, {"restitution": [0.6]})
    dims = ("restitution", "complete_burst", "burst_impact")
    for quantity in ("time", "displacement"):
        cube[f"remaining_{quantity}"] = dims, left[None, None]
        cube[f"accumulation_{quantity}_uncertainty"] = dims[:2], [[1e-12]]
        for order, part in (("first", first), ("second", second)):
            cube[f"{order}_order_{quantity}"] = dims, (left * (1 + part * better))[None, None]
    cube["rebound_speed"] = dims, (left / 4.0)[None, None]
    cube["prediction_error_estimate"] = dims, np.full((1, 1, 4), 1e-3)
    found = CLAIMS["A6"].judge({"accumulation": cube})
    assert found.verdict == verdict
    whys = {
        (0.3, 0.05): "with the second-order formula",
        (0.5, 0.3): "if made from impact 2 of the burst on",
        (1.0, 1.0): "within 10% only for the last 25% of a burst (median at the worst point), "
        "from impact 3 on in the worst burst",
    }
    assert found.why == whys.get((first, second), found.why)
    # Errors say relative to what; at the first impact, of all 8 that are left there.
    if np.isfinite(second):
        assert "at the first impact relative to the burst (its duration, or the" in found.found
        assert "later relative to what is left" in found.found
        assert [*found.numbers[0][4:6]] == [
            "worst error of a time / duration",
            "worst error of a point / largest distance",
        ]
        assert [*found.numbers[2][4:6]] == [f"{second:.0%}"] * 2


def test_chatter_after_a_transient() -> None:
    assert CLAIMS["A7"].judge(histories(steady(200.0, 10.0))).verdict == HOLDS
    found = CLAIMS["A7"].judge(histories(steady(200.0, 10.0), steady(5.0, 9.0)))
    assert found.verdict == FAILS
    assert found.numbers[2][:2] == ["0.25", "0.199"]
    early = [(5.0, 9.0, 0, 9), *steady(200.0, 9.0)]
    found = CLAIMS["A7"].judge(histories(steady(200.0, 10.0), early))
    assert found.verdict == READING
    assert found.why.startswith("of complete chatter")


@pytest.mark.parametrize(
    ("powers", "verdict"),
    [((0.5, -0.2, 0.1), HOLDS), ((0.4, -1.0, 0.0), READING), ((0.1, -0.5, 0.3), FAILS)],
)
def test_duration_and_amplitude(powers: tuple[float, ...], verdict: str) -> None:
    d, omega, zeta = (np.geomspace(0.1, 1.0, n) for n in (5, 4, 3))
    grid = np.meshgrid(d, omega, zeta, indexing="ij")
    duration = 3.0 * grid[0] ** -powers[0] * grid[1] ** powers[1] * grid[2] ** powers[2]
    dims = ("clearance", "frequency_ratio", "damping_ratio")
    # An incomplete burst among complete ones does not count.
    complete = np.ones_like(duration)
    complete[1, 2, 0] = 0.0
    duration[1, 2, 0] = 99.0
    cube = xr.Dataset(
        {"burst_at_duration": (dims, duration), "burst_at_complete": (dims, complete)},
        {"clearance": d, "frequency_ratio": omega, "damping_ratio": zeta},
    )
    found = CLAIMS["A11"].judge({"burst_duration": cube})
    assert found.verdict == verdict
    for power in powers:
        assert f"{power:.2f} of the" in found.found


def performance(**changes: Any) -> xr.Dataset:
    """Cube of two restitutions, two clearances and three frequencies, all well damped."""
    dims = ("restitution", "frequency_ratio", "clearance")
    shape = (2, 3, 2)
    values = {
        "peak_displacement": 2.0,
        "amplitude_ratio": 0.4,
        "rms_ratio": 0.4,
        "impacts_per_period": 2.0,
        "bursts_per_period": 2.0,
        "complete_fraction": 1.0,
        "sticking_fraction": 0.3,
        "chatter": 0,
    } | changes
    coords = {
        "restitution": [0.0, 0.8],
        "frequency_ratio": [0.5, 1.0, 1.5],
        "clearance": [1.0, 2.0],
    }
    arrays = {name: (dims, np.broadcast_to(value, shape)) for name, value in values.items()}
    return xr.Dataset(arrays, coords)


def of_performance(name: str, cube: xr.Dataset) -> str:
    return CLAIMS[name].judge({"performance": cube}).verdict


def test_good_damping_with_and_without_chatter() -> None:
    half = np.array([0.0, 0.3]).reshape(2, 1, 1)
    good = np.array([0.9, 0.1]).reshape(2, 1, 1)
    assert of_performance("A8", performance(sticking_fraction=half, rms_ratio=good)) == HOLDS
    assert of_performance("A8", performance(sticking_fraction=half, rms_ratio=good[::-1])) == FAILS
    assert of_performance("A8", performance(sticking_fraction=0.0)) == UNTESTED


def test_plastic_impacts() -> None:
    assert of_performance("A9", performance()) == HOLDS
    assert of_performance("A9", performance(complete_fraction=0.5)) == READING
    assert of_performance("A9", performance(chatter=1)) == FAILS
    assert of_performance("A9", performance().sel(restitution=[0.8])) == UNTESTED


def test_band_and_two_impacts_per_period() -> None:
    wide = np.array([0.4, 1.0]).reshape(2, 1, 1)
    # The linear response peak / ratio is largest in the middle.
    peak = np.array([0.5, 2.0, 0.5]).reshape(1, 3, 1) * wide
    near = np.array([0.9, 0.4, 0.9]).reshape(1, 3, 1)
    common = {"sticking_fraction": 0.0, "peak_displacement": peak, "amplitude_ratio": wide}
    assert of_performance("A10", performance(**common, rms_ratio=near)) == HOLDS
    assert of_performance("A10", performance(**common, rms_ratio=0.4)) == READING
    common |= {"peak_displacement": peak[::-1], "amplitude_ratio": wide[::-1]}
    assert of_performance("A10", performance(**common, rms_ratio=0.4)) == FAILS
    assert of_performance("A10", performance().isel(restitution=0)) == UNTESTED


# --- all of them


def test_every_statement_has_its_claim_and_its_studies() -> None:
    names = [*(f"A{k}" for k in range(1, 12)), *(f"B{k}" for k in range(1, 7))]
    assert list(CLAIMS) == names
    assert all(statement.studies and statement.where for statement in STATEMENTS)


def test_pages() -> None:
    cubes = paper_b(intervals(narrowing), intervals(everything_else))
    cubes["restitution"].attrs["assumed_visibility_threshold"] = "ours"
    cubes["restitution"].chatter.attrs["comment"] = "x; visible: approach speed >= 0.03 of it"
    found = judge(cubes)
    page = table(found, [CLAIMS["B6"].figures[0]])
    rows = list(csv.DictReader(io.StringIO(page.csv())))
    assert [row["claim"] for row in rows] == list(CLAIMS)
    b2 = next(row for row in rows if row["claim"] == "B2")
    assert b2["verdict"] == READING
    assert "above resonance" in b2["why"]
    assert b2["numbers"].startswith("reading | frequency ratio | length (span)")
    assert "visibility threshold: approach speed >= 0.03 of it" in b2["assumptions"]
    figure = CLAIMS["B6"].figures[0]
    text = page.markdown()
    assert text.count(f"({figure}.png)") == sum(figure in c.figures for c in CLAIMS.values())
    assert f"({CLAIMS['A3'].figures[0]}.png)" not in text
    for item in found:
        assert f"## {item.statement.name}: {item.statement.text}" in text
        assert f"| {sentence(item)} |" in text
