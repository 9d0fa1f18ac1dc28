"""Interactive figures: what the page is given, and what it makes of it in a browser."""

import base64
import math
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from browser import Browser

import damper
from damper.report.interactive import interactive, script_of
from damper.report.page import Chapter, ShownTable, page, plotly_script
from damper.study.config import load_study

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
        "best": "min",
    },
    "branch": {"kind": "bifurcation", "along": "frequency_ratio", "variables": ["displacement"]},
    "yielding": {
        "kind": "bifurcation",
        "along": "frequency_ratio",
        "variables": ["peak_displacement"],
    },
    "pair": {"kind": "bifurcation", "along": "frequency_ratio", "variables": ["displacement"]},
}
#: Upwards two impacts per cycle last to the end, downwards the run is irregular.
BRANCH = {
    "frequency_ratio": [1.0, 1.005, 1.01, 1.015, 1.02],
    "damping_ratio": [0.02],
    "clearance": [12.0],
    "restitution": [0.6],
}
AXES = {"diagram": DIAGRAM, "map": MAP, "branch": BRANCH, "yielding": BRANCH, "pair": BRANCH}
MORE: dict[str, Any] = {
    "branch": {"follow": {"frequency_ratio": "both"}},
    "yielding": {"yield_speed": 0.1},
    "pair": {"masses": [{}, {}], "observers": ["stroboscopic_section"]},
}


def made(name: str) -> tuple[xr.Dataset, dict[str, Any]]:
    """A cube, and what the page is given of it."""
    observers = ["stroboscopic_section", "response", "bursts", "motion"]
    given = {"follow": {}, "observers": observers} | MORE.get(name, {})
    cube = damper.simulate(**FIXED, **AXES[name], **given, **RUN)
    study = {"fixed": FIXED | {k: v for k, v in given.items() if k == "yield_speed"}}
    study |= {"axes": AXES[name], "follow": given["follow"], "run": RUN, "observers": {}}
    return cube, interactive(cube, SETTINGS[name], study | REST)


def unpacked(text: str, kind: str = "<f4") -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), kind)


def test_values_are_those_of_the_cube() -> None:
    cube, data = made("map")
    order = ("restitution", "clearance", "frequency_ratio")
    ratio = cube.rms_ratio.squeeze().transpose(*order).values.ravel()
    np.testing.assert_array_equal(unpacked(data["values"]), ratio.astype("f4"))
    assert [axis["name"] for axis in data["axes"]] == list(order)
    idle = (cube.bursts_per_period == 0.0).squeeze().transpose(*order).values.ravel()
    np.testing.assert_array_equal(unpacked(data["idle"], "u1"), idle)
    # Of those that are touched, the best row of each column, if it damps.
    ratio = np.where(idle | (ratio >= 1.0), np.inf, ratio).reshape(2, 4, 4)
    best = np.where(np.isfinite(ratio).any(axis=1), ratio.argmin(axis=1) + 1, 0).ravel()
    np.testing.assert_array_equal(unpacked(data["best"], "<u2"), best)


def test_dots_of_a_diagram_are_told_apart() -> None:
    cube, data = made("diagram")
    section, peak = data["variables"]
    counts = unpacked(section["counts"], "<u2")
    assert counts.sum() == len(unpacked(section["values"]))
    assert counts.max() <= RUN["periods"]
    assert counts.min() >= 1
    expected = cube.peak_displacement.squeeze().transpose("damping_ratio", "restitution")
    np.testing.assert_array_equal(unpacked(peak["values"]), expected.values.ravel().astype("f4"))


def test_si_points_are_in_millimetres_and_draws_are_listed() -> None:
    study = load_study(ROOT / "config/studies/machine_frame.yaml")
    axes = {"forcing_frequency": [190.0, 200.0], "gap": [2e-4, 4e-4]}
    draws = study.draw_settings()
    observers = ["response", "impacts"]
    cube = damper.simulate(**study.fixed, **axes, draws=draws, observers=observers, **RUN)
    plan = {"fixed": study.fixed, "axes": axes, "primary": "rest", "draws": draws}
    plan |= {"follow": {}, "run": RUN, "observers": {}}
    data = interactive(cube, study.interactive["amplitude"], plan)
    # Colours are those of the worst draw; a drop-down chooses one, whose run is shown.
    assert data["overlaid"] == ["draw"]
    assert {len(values) for values in data["draws"].values()} == {4}
    peaks = 1e3 * cube.peak_displacement.max("draw").transpose("gap", ...)
    np.testing.assert_array_equal(unpacked(data["values"]), peaks.values.ravel().astype("f4"))
    assert data["label"].endswith("worst of 4 draws")
    gap = next(axis for axis in data["axes"] if axis["name"] == "gap")
    assert (gap["values"], gap["own"], gap["units"]) == ([0.2, 0.4], [2e-4, 4e-4], "mm")
    shown = {one["name"]: one for one in data["parameters"]}
    assert (shown["gap"]["units"], shown["gap"]["scale"]) == ("mm", 1e3)
    assert shown["forcing_frequency"]["label"] == "angular forcing frequency"
    about = cube.forcing_frequency.attrs | {"units": "Hz"}
    frequencies = cube.forcing_frequency.values / (2.0 * np.pi)
    hertz = cube.assign_coords(forcing_frequency=("forcing_frequency", frequencies, about))
    listed = interactive(hertz, study.interactive["amplitude"], plan)["parameters"]
    (one,) = (one for one in listed if one["name"] == "forcing_frequency")
    assert (one["label"], one["units"]) == ("forcing frequency", "Hz")
    assert shown["stiffness"]["value"] == study.fixed["stiffness"]


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
    text = page([one], [], {"intervals": lambda settings: "<p>How.</p>"}, TEMPLATE)
    (folder / "report.html").write_text(text)
    (folder / "plotly.js").write_text(plotly_script())
    return folder


@pytest.fixture(scope="module")
def browser(folder: Path) -> Iterator[Browser]:
    with Browser((folder / "report.html").as_uri()) as browser:
        browser.value("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
        for name in SETTINGS:
            browser.value(f"{figure(name)}.scrollIntoView()")
            browser.wait(f"{figure(name)}.querySelectorAll('.panel .main-svg').length > 0")
        yield browser
        assert browser.errors == []


def figure(name: str) -> str:
    return f"document.querySelector('[data-figure=\"study/interactive/{name}\"]')"


def enter(browser: Browser, name: str, value: str, field: str = ".sliders input") -> None:
    """Write a value into a field of a figure: that of its first slider unless told."""
    browser.value(
        f"""(() => {{
            const field = {figure(name)}.querySelector({field!r});
            field.value = "{value}";
            field.dispatchEvent(new Event("input"));
        }})()"""
    )


def follow(browser: Browser, name: str, direction: int) -> None:
    """Choose the direction of a branch: 0 upwards, 1 downwards."""
    browser.value(
        f"""(() => {{
            const pick = [...{figure(name)}.querySelectorAll('.controls select')].at(-1);
            pick.value = {direction};
            pick.dispatchEvent(new Event("change"));
        }})()"""
    )


def said(browser: Browser, name: str, text: str) -> str:
    """What the page says of a run, once a text is in it."""
    shown = f"{figure(name)}.querySelector('.said').textContent"
    browser.wait(f"{shown}.includes({text!r}) && !{shown}.startsWith('Computing')")
    return browser.value(shown)


def test_the_form_says_which_number_is_wrong(browser: Browser) -> None:
    told = "document.getElementById('own-said').textContent"
    for value, words in ((-1, "gap, mm: must be a number, at least 1e-6."), (0.9, "It moves 0.2")):
        browser.value(
            f"""(() => {{
                const field = document.querySelector('#own [name=gap]');
                field.value = {value};
                field.dispatchEvent(new Event('input', {{ bubbles: true }}));
            }})()"""
        )
        browser.wait(f"{told}.startsWith({words!r})", 60.0)


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
    shown = said(browser, "map", "0.75")
    legend = browser.value(f"{figure('map')}.querySelector('.panel .legend').textContent")
    assert "best clearance to each wall at each frequency ratio" in legend
    assert shown.endswith(
        "at coefficient of restitution 0.3, frequency ratio 0.75, clearance to each wall 2.5 F₀/K"
    )
    cube, _ = made("map")
    here = cube.sel(restitution=0.3, clearance=2.5, frequency_ratio=0.75).squeeze()
    values = browser.value(
        f"""Object.fromEntries([...{figure("map")}.querySelectorAll('.values > div')].map((one) =>
            [one.children[0].textContent, parseFloat(one.children[1].textContent)]))"""
    )
    assert values["largest displacement"] == pytest.approx(here.peak_displacement.item(), rel=0.05)
    work = values["work of the force per cycle"]
    parts = [values[f"of it {what}"] for what in ("lost in the dashpot", "lost in impacts")]
    assert sum(parts) + values["of it stored"] == pytest.approx(work, rel=1e-3)


def test_means_of_a_motion_are_those_of_the_curve_between_its_samples(browser: Browser) -> None:
    """Of a sine in 60 samples; along straight lines between them the rms lacks 5e-4 of itself."""
    found = browser.value(
        """(() => {
            const cycle = 2 * Math.PI, free = { strength: 1, damping: 0.1 };
            const model = { mass: 0.1, free, omega: 1, phase: 0.5, gravity: 0, cycle };
            const rows = Array.from({ length: 61 }, (_, k) => {
                const t = k * cycle / 60;
                return [t, Math.sin(t), Math.cos(t), 0, 0];
            });
            return damper.measured({ model, cycles: 1, from: 0, segments: [] }, rows);
        })()"""
    )
    assert found["rms"] == pytest.approx(math.sqrt(0.5), rel=1e-6)
    assert found["dashpot"] == pytest.approx(0.2 * math.pi, rel=1e-6)
    assert found["work"] == pytest.approx(math.pi * math.sin(0.5), rel=1e-6)


def test_the_free_mass_moves_until_it_is_paused(browser: Browser) -> None:
    button = f"{figure('map')}.querySelector('.bar button')"
    clock = f"{figure('map')}.querySelector('.stage + p').textContent"
    assert browser.value(f"{button}.textContent") == "Pause"  # after the click before
    now = browser.value(clock)
    browser.wait(f"{clock} !== {now!r}")
    browser.value(f"{button}.focus()")
    browser.press("Enter")
    browser.wait(f"{button}.textContent === 'Play'")
    now = browser.value(clock)
    time.sleep(0.3)
    assert browser.value(clock) == now


def test_a_kept_point_stands_beside_the_next(browser: Browser) -> None:
    """Its curves are dotted beneath those of the next one, its values beside them."""
    buttons = f"[...{figure('diagram')}.querySelectorAll('.bar button')]"
    button = f"{buttons}.find((one) => /point/.test(one.textContent))"
    peak = f"{figure('diagram')}.querySelector('.values > div').textContent"
    curves = f"[...{figure('diagram')}.querySelector('.history').data].map((one) => one.name)"
    enter(browser, "diagram", "0.3")
    first = said(browser, "diagram", "0.3")
    browser.wait(f"{figure('diagram')}.querySelector('.history').data !== undefined")
    before = browser.value(peak)
    browser.value(f"{button}.click()")
    enter(browser, "diagram", "0.6")
    assert said(browser, "diagram", "0.6") != first
    browser.wait(f"{peak}.includes('kept')")
    assert browser.value(peak).endswith(f"kept: {before.removeprefix('largest displacement')}")
    browser.wait(f"{curves}.includes('primary, kept')")
    rows = f"{figure('diagram')}.querySelector('.history').data"
    old, new = (
        browser.value(f"Array.from({rows}.find((one) => one.name === {name!r}).y)")
        for name in ("primary, kept", "primary")
    )
    assert max(map(abs, old)) == pytest.approx(
        float(before.split()[1].removeprefix("displacement")), rel=0.02
    )
    assert old != new
    assert first in browser.value(f"{figure('diagram')}.querySelector('.values .told').textContent")
    browser.value(f"{button}.click()")
    browser.wait(f"!{curves}.includes('primary, kept')")
    assert "kept" not in browser.value(peak)


def test_a_page_that_draws_no_picture_computes(browser: Browser) -> None:
    """As in a tab that nobody sees."""
    browser.value("window.drawn = requestAnimationFrame, window.requestAnimationFrame = () => 0")
    enter(browser, "diagram", "0.7")
    assert said(browser, "diagram", "0.7")
    browser.value("window.requestAnimationFrame = window.drawn")


def test_what_is_a_picture_says_what_it_shows(browser: Browser) -> None:
    pictures = "[...document.querySelectorAll('[role=img]')]"
    assert browser.value(f"{pictures}.length") >= len(SETTINGS)
    assert browser.value(f"{pictures}.every((one) => one.getAttribute('aria-label'))")


def test_colours_of_ratios_are_those_of_the_data(browser: Browser) -> None:
    cube, _ = made("map")
    trace = f"{figure('map')}.querySelector('.panel').data[0]"
    shown = browser.value(f"(({{ zmin, zmax }}) => [zmin, zmax])({trace})")
    ratios = np.log10(cube.rms_ratio.values)
    assert shown == pytest.approx([max(ratios.min(), -1), min(ratios.max(), 1)], abs=1e-6)
    ticks = np.log10(browser.value(f"{trace}.colorbar.ticktext.map(Number)"))
    assert any(shown[0] <= tick < 0.0 for tick in ticks)
    assert any(0.0 < tick <= shown[1] for tick in ticks)
    white = browser.value(f"{trace}.colorscale.find((one) => one[1] === '#FFFFFF')[0]")
    assert white == pytest.approx(shown[0] / (shown[0] - shown[1]))


def test_a_link_leads_to_what_was_chosen(folder: Path, browser: Browser) -> None:
    enter(browser, "diagram", "0.45")
    shown = said(browser, "diagram", "0.45")
    browser.wait("location.hash.includes('restitution=0.45')")
    link = browser.value("location.href")
    with Browser(link) as other:
        other.wait(f"{figure('diagram')}.querySelectorAll('.said').length > 0")
        assert said(other, "diagram", "0.45") == shown
        assert other.errors == []


def test_an_address_that_leads_nowhere_says_so(folder: Path) -> None:
    page = (folder / "report.html").as_uri()
    with Browser(f"{page}#stdy/tables/t") as browser:
        lost = "document.querySelector('#lost').textContent"
        assert browser.value(f"{lost}.includes('“stdy/tables/t”')")
        assert browser.value("document.querySelector('#lost a').hash") == "#study/tables/t"
        asked = "damping_ratio=3.5e3&restitution=0.45&shwn=1"
        browser.value(f"location.hash = 'figure=study/interactive/diagram&{asked}'")
        assert browser.value("document.querySelector('#lost').hidden")
        browser.wait(f"{figure('diagram')}.querySelectorAll('.said').length > 0")
        said(browser, "diagram", "0.45")
        wrong = browser.value(f"{figure('diagram')}.querySelector('[role=alert]').textContent")
        assert "damping_ratio=3.5e3, shwn=1" in wrong
        # Another address of the same page is followed, too.
        browser.value("location.hash = 'figure=study/interactive/diagram&restitution=0.55'")
        said(browser, "diagram", "0.55")
        assert not browser.value(f"{figure('diagram')}.querySelector('[role=alert]').textContent")
        assert browser.errors == []


def test_what_is_copied_runs_the_same(browser: Browser, tmp_path: Path) -> None:
    copied = {}
    for words in ("Python", "YAML"):
        browser.value(
            f"[...{figure('map')}.querySelectorAll('button')]"
            f".find((one) => one.textContent === 'Copy as {words}').click()"
        )
        copied[words] = browser.value(f"{figure('map')}.querySelector('textarea').value")
    scope: dict[str, Any] = {}
    exec(copied["Python"].replace("run.plot", "# run.plot"), scope)
    path = tmp_path / "point.yaml"
    path.write_text(copied["YAML"])
    fixed = load_study(path).fixed
    for name in ("mass_ratio", "phase", "clearance", "frequency_ratio"):
        assert fixed[name] == getattr(scope["point"], name)


def test_a_followed_point_is_that_of_its_branch(browser: Browser) -> None:
    cube, _ = made("branch")
    for number, direction in enumerate(("up", "down")):
        follow(browser, "branch", number)
        enter(browser, "branch", "1.015")
        shown = said(browser, "branch", f"{direction}, frequency ratio 1.015")
        history = f"{figure('branch')}.querySelector('.history')"
        browser.wait(f"{history}.getAttribute('aria-label') === {'Time history: ' + shown!r}")
        x = browser.value(f"{history}.data[0].y[0]")
        there = cube.displacement.sel(direction=direction, frequency_ratio=1.015).squeeze()
        assert np.abs(there.values - x).min() < 1e-6


def test_what_takes_long_begins_with_the_first_cycles_and_moves_after_each_choice(
    browser: Browser,
) -> None:
    one = figure("branch")
    clock = f"{one}.querySelector('.stage + p').textContent"
    browser.value(f"{one}.scrollIntoView()")
    run = "damper.figures['study/interactive/branch'].run"
    browser.value(
        f"{run}.transient = 20000, damper.figures['study/interactive/branch'].ends = {{}}"
    )
    for value in ("1.01", "1.02"):
        enter(browser, "branch", value)
        browser.wait(f"{one}.querySelector('.said').textContent.startsWith('Computing')")
        began = browser.value(f"{one}.querySelector('.said').textContent")
        end = {"up": "1", "down": "1.02"}[began.split("direction ")[1].split(",")[0]]
        first = f", at frequency ratio {end}, where its branch begins."
        assert f"frequency ratio {value}. Meanwhile its first 8 cycles from the start" in began
        assert began.endswith(first if value != end else "from the start.")
        said(browser, "branch", f"frequency ratio {value}")
        now = browser.value(clock)
        browser.wait(f"{clock} !== {now!r}")
    browser.value(f"{run}.transient = {RUN['transient']}, null")


@pytest.mark.parametrize(
    ("name", "what"), [("yielding", "yield speed of the contact"), ("pair", "2 free masses")]
)
def test_what_the_page_does_not_know_is_named(browser: Browser, name: str, what: str) -> None:
    shown = said(browser, name, "does not compute")
    assert f"does not compute {what}; damper.run in Python does" in shown
