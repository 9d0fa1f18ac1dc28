"""Interactive figures: what the page is given, and what it makes of it in a browser."""

import base64
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from browser import CHROMIUM, Browser

import damper
from damper.models import start_run
from damper.report import interactive as module
from damper.report.interactive import STRETCH, interactive, script_of
from damper.report.page import Chapter, ShownTable, page, plotly_script
from damper.study.config import load_study
from damper.sweep.points import read_point

ROOT = Path(__file__).parents[2]
TEMPLATE = ROOT / "workflow/report/page.html"
RUN = {"transient": 20, "periods": 6}
REST: dict[str, Any] = {"primary": "rest", "draws": {}}
FIXED = {"mass_ratio": 0.1, "phase": 0.4}
#: Of the free motion: none, little, critical and more than critical damping; chatter and sticking.
DIAGRAM = {
    "damping_ratio": [0.0, 0.05, 1.0, 3.0],
    "restitution": [0.0, 0.3, 0.6, 1.0],
    "frequency_ratio": [0.5],
    "clearance": [0.2],
}
MAP = {
    "restitution": [0.3, 0.6],
    "frequency_ratio": [0.25, 0.5, 0.75, 1.0],
    "clearance": [0.1, 0.5, 2.5, 12.5],
    "damping_ratio": [0.05],
}
SETTINGS = {
    "diagram": {
        "kind": "bifurcation",
        "along": "restitution",
        "rows": "damping_ratio",
        "variables": ["displacement", "peak_displacement"],
    },
    "map": {
        "kind": "map",
        "variable": "rms_ratio",
        "x": "frequency_ratio",
        "y": "clearance",
        "panels": "restitution",
    },
}
AXES = {"diagram": DIAGRAM, "map": MAP}


def made(name: str) -> tuple[xr.Dataset, dict[str, Any]]:
    """A cube, and what the page is given of it."""
    observers = ["stroboscopic_section", "response", "bursts"]
    cube = damper.simulate(**FIXED, **AXES[name], observers=observers, **RUN)
    study = {"fixed": FIXED, "axes": AXES[name], "follow": {}, "run": RUN, **REST}
    return cube, interactive(cube, SETTINGS[name], study)


def unpacked(text: str, kind: str = "<f4") -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), kind)


def points(data: dict[str, Any]) -> list[dict[str, float]]:
    """Place of each run along the axes of the page."""
    kept = {
        axis["name"]: [axis["values"][k] for k in axis["kept"] or range(len(axis["values"]))]
        for axis in data["axes"]
    }
    grid = np.meshgrid(*kept.values(), indexing="ij")
    return [dict(zip(kept, place, strict=True)) for place in zip(*map(np.ravel, grid), strict=True)]


def test_values_are_those_of_the_cube() -> None:
    cube, data = made("map")
    order = ("restitution", "clearance", "frequency_ratio")
    ratio = cube.rms_ratio.squeeze().transpose(*order).values.ravel()
    np.testing.assert_array_equal(unpacked(data["values"]), ratio.astype("f4"))
    where = points(data)
    assert len(where) == len(data["runs"]) == 32
    for one in data["measured"]:
        array = next(a for a in cube.data_vars.values() if a.attrs["long_name"] == one["label"])
        expected = [array.sel(place).item() for place in where]
        np.testing.assert_array_equal(unpacked(one["values"]), np.array(expected, "f4"))
    for run, place in zip(data["runs"], where, strict=True):
        assert {name: run[name] for name in place} == place


def test_dots_of_a_diagram_are_told_apart() -> None:
    cube, data = made("diagram")
    section, peak = data["variables"]
    counts = unpacked(section["counts"], "<u2")
    assert counts.sum() == len(unpacked(section["values"]))
    assert counts.max() <= RUN["periods"]
    assert counts.min() >= 1
    expected = cube.peak_displacement.squeeze().transpose("damping_ratio", "restitution")
    np.testing.assert_array_equal(unpacked(peak["values"]), expected.values.ravel().astype("f4"))


def test_few_runs_are_kept_and_a_followed_axis_is_run_as_a_whole(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "MOST_RUNS", 6)
    axes = {"frequency_ratio": np.linspace(1.0, 1.3, 7).tolist()}
    fixed = FIXED | {"damping_ratio": 0.02, "clearance": 5.0, "restitution": 0.6}
    study = {
        "fixed": fixed,
        "axes": axes,
        **REST,
        "run": RUN,
        "follow": {"frequency_ratio": "both"},
    }
    follow = {"frequency_ratio": "both"}
    cube = damper.simulate(**fixed, **axes, follow=follow, observers="response", **RUN)
    settings = {
        "kind": "bifurcation",
        "along": "frequency_ratio",
        "variables": ["peak_displacement"],
    }
    data = interactive(cube, settings, study)
    direction, along = data["axes"]
    assert (data["overlaid"], direction["values"]) == (["direction"], ["up", "down"])
    assert along["kept"] == [0, 3, 6]
    peaks = next(one for one in data["measured"] if "largest" in one["label"])
    for place, run, peak in zip(points(data), data["runs"], unpacked(peaks["values"]), strict=True):
        assert run["frequency_ratio"] == float(place["frequency_ratio"])
        rows = unpacked(run["rows"], "<f8").reshape(6, -1)
        assert np.abs(rows[1]).max() <= peak * (1 + 1e-6)
        assert peak == np.float32(
            cube.peak_displacement.sel(
                direction=place["direction"], frequency_ratio=float(place["frequency_ratio"])
            )
        )


def test_at_one_value_of_the_followed_axis_runs_are_those_of_their_branch() -> None:
    axes = {"frequency_ratio": [1.0, 1.1, 1.2], "restitution": [0.5, 0.6]}
    fixed = FIXED | {"damping_ratio": 0.02, "clearance": 5.0}
    follow, at = {"frequency_ratio": "both"}, {"frequency_ratio": 1.2}
    observers = ["stroboscopic_section", "response"]
    cube = damper.simulate(**fixed, **axes, follow=follow, observers=observers, **RUN)
    settings = {"kind": "bifurcation", "along": "restitution", "variables": ["displacement"]}
    study = {"fixed": fixed, "axes": axes, "run": RUN, "follow": follow, **REST}
    data = interactive(cube, settings | {"at": at}, study)
    shown = [unpacked(run["rows"], "<f8").reshape(6, -1)[1, 0] for run in data["runs"]]
    there = cube.sel(at).transpose("direction", "restitution", ...)
    begins = there.displacement[..., RUN["periods"] - STRETCH["periods"]].values
    np.testing.assert_allclose(shown, begins.ravel(), rtol=1e-9)
    assert len(np.unique(np.round(shown, 3))) == 3  # downwards both begin at rest, out of reach


def test_si_runs_are_scaled() -> None:
    study = load_study(ROOT / "config/studies/machine_frame.yaml")
    axes = {"forcing_frequency": [190.0, 200.0], "gap": [2e-4, 4e-4]}
    draws = study.draw_settings()
    observers = ["response", "impacts"]
    cube = damper.simulate(**study.fixed, **axes, draws=draws, observers=observers, **RUN)
    plan = {"fixed": study.fixed, "axes": axes, "primary": "rest", "draws": draws}
    plan |= {"follow": {}, "run": RUN}
    data = interactive(cube, study.interactive["amplitude"], plan)
    # Colours are those of the worst draw; a drop-down chooses one, whose run is shown.
    assert data["overlaid"] == ["draw"]
    assert len(data["runs"]) == 4 * 4
    peaks = 1e3 * cube.peak_displacement.max("draw").transpose("gap", ...)
    np.testing.assert_array_equal(unpacked(data["values"]), peaks.values.ravel().astype("f4"))
    assert data["label"].endswith("worst of 4 draws")
    assert data["run_units"] == ["mm", "s", "mm/s"]
    for place, run in zip(points(data), data["runs"], strict=True):
        assert 2.0 * run["clearance"] * run["length"] == pytest.approx(place["gap"])
        assert run["frequency_ratio"] / run["time"] == pytest.approx(place["forcing_frequency"])


# --- in a browser


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page with both figures, and the files beside it."""
    folder = tmp_path_factory.mktemp("page")
    paths = [f"study/interactive/{name}" for name in SETTINGS]
    (folder / "study/interactive").mkdir(parents=True)
    for name, path in zip(SETTINGS, paths, strict=True):
        (folder / f"{path}.js").write_text(script_of(path, made(name)[1]))
    (folder / "cost.txt").write_text("nothing\n")
    figures = [(path, "A figure", "Steps.") for path in paths]
    tables = [ShownTable("study/tables/t", "intervals", ["n", "m"], [["10", "x"], ["9", "y"]])]
    one = Chapter("study", "A study", "ours", "sticking", tables=tables, interactive=figures)
    text = page([one], [], {"intervals": "<p>How.</p>"}, TEMPLATE)
    (folder / "report.html").write_text(text)
    (folder / "plotly.js").write_text(plotly_script())
    return folder


@pytest.fixture(scope="module")
def browser(folder: Path) -> Iterator[Browser]:
    if CHROMIUM is None:
        pytest.skip("no Chromium is installed")
    with Browser((folder / "report.html").as_uri()) as browser:
        for name in SETTINGS:
            browser.value(f"{figure(name)}.scrollIntoView()")
            browser.wait(f"{figure(name)}.querySelectorAll('.runs .main-svg').length > 5")
        yield browser
        assert browser.errors == []


def figure(name: str) -> str:
    return f"document.querySelector('[data-figure=\"study/interactive/{name}\"]')"


@pytest.mark.parametrize("name", SETTINGS)
def test_the_page_computes_what_the_engine_does(browser: Browser, name: str) -> None:
    runs = browser.value(
        f"damper.figures['study/interactive/{name}'].runs.map("
        "(run) => damper.sampled(run).filter((_, k) => k % 29 == 0))"
    )
    names = [axis["name"] for axis in made(name)[1]["axes"]]
    compared = 0
    for rows, place in zip(runs, points(made(name)[1]), strict=True):
        single = {n: values[0] for n, values in AXES[name].items() if n not in names}
        point = read_point(FIXED | single | {n: float(v) for n, v in place.items()})
        trajectory = start_run(point.parameters)
        first = RUN["transient"] + RUN["periods"] - STRETCH["periods"]
        for time, *state in rows:
            whole = math.floor(time / trajectory.cycle)
            local = time - whole * trajectory.cycle
            trajectory.skip(first + whole, local)
            there = trajectory.state_at(first + whole, local)
            assert state[0] == pytest.approx(there.x, abs=1e-9)
            assert state[2] == pytest.approx(there.y, abs=1e-9)
            # Beside an impact, at whose very time velocities are those of one side.
            trajectory.skip(first + whole, local)
            compared += abs(state[1] - there.v) < 1e-9 and abs(state[3] - there.u) < 1e-9
    assert compared > 0.95 * sum(map(len, runs))


def chosen(browser: Browser, name: str) -> str:
    return browser.value(f"{figure(name)}.querySelector('.said').textContent")


def test_a_click_shows_the_run_there(browser: Browser) -> None:
    browser.value(f"{figure('map')}.scrollIntoView()")
    x, y = browser.value(
        f"""(() => {{
            const panel = {figure("map")}.querySelector('.panel');
            const box = panel.getBoundingClientRect(), {{ xaxis: x, yaxis: y }} = panel._fullLayout;
            return [box.x + x._offset + x.d2p(0.77), box.y + y._offset + y.d2p(2.7)];
        }})()"""
    )
    browser.click(x, y)
    browser.wait(f"{figure('map')}.querySelector('.said').textContent.includes('0.75')")
    assert chosen(browser, "map").endswith(
        "at coefficient of restitution 0.3, clearance to each wall 2.5 F0/K, frequency ratio 0.75"
    )
    cube, _ = made("map")
    here = cube.sel(restitution=0.3, clearance=2.5, frequency_ratio=0.75).squeeze()
    shown = browser.value(f"{figure('map')}.querySelector('.values').textContent")
    assert f"{here.rms_displacement.item():.5g} F0/K" in shown
    top = f"Math.max(...{figure('map')}.querySelector('.history').data[0].y)"
    assert browser.value(top) == pytest.approx(here.peak_displacement.item(), rel=0.05)


def test_keys_choose_a_run_as_a_click_does(browser: Browser) -> None:
    browser.value(f"{figure('diagram')}.scrollIntoView()")
    browser.value(f"[...{figure('diagram')}.querySelectorAll('select')].at(-1).focus()")
    before = chosen(browser, "diagram")
    browser.press("ArrowDown")
    browser.wait(f"{figure('diagram')}.querySelector('.said').textContent !== {before!r}")
    assert "coefficient of restitution 1" in chosen(browser, "diagram")


def test_search_and_sorting(browser: Browser) -> None:
    hidden = "[...document.querySelectorAll('nav li')].filter((li) => li.hidden).length"
    for word, count, said in (
        ("sticking", 2, "1 section"),
        ("xyzzy", 3, "No sections"),
        ("", 0, ""),
    ):
        browser.value(
            f"(search.value = '{word}', search.dispatchEvent(new Event('input')), {hidden})"
        )
        assert browser.value(hidden) == count
        assert browser.value("document.querySelector('#found').textContent") == said
    column = "[...document.querySelectorAll('#study table.cells')].at(-1)"
    cells = f"[...{column}.tBodies[0].rows].map((row) => row.cells[0].textContent)"
    assert browser.value(cells) == ["10", "9"]
    browser.value(f"{column}.querySelector('th button').click()")
    assert browser.value(cells) == ["9", "10"]


def test_a_narrow_page_does_not_scroll_sideways(folder: Path) -> None:
    if CHROMIUM is None:
        pytest.skip("no Chromium is installed")
    with Browser((folder / "report.html").as_uri(), 420, 900) as browser:
        browser.value(f"{figure('map')}.scrollIntoView()")
        browser.wait(f"{figure('map')}.querySelectorAll('.runs .main-svg').length > 5")
        assert browser.value("document.documentElement.scrollWidth") == 420
        assert browser.errors == []
