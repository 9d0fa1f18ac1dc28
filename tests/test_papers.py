"""What the documents say of papers and theory is what their own examples give."""

import doctest
import re
from pathlib import Path

import numpy as np
import pytest

import damper
from damper import simulate
from damper.observers import OBSERVERS
from damper.study.config import load_study
from damper.study.kinds import FIGURES, TABLES

ROOT = Path(__file__).parents[1]
#: Kinds of the studies that check the engine, which docs/reference.md lists.
CHECKING = {"solver_errors", "solver_speed", "work_precision"}
STUDIES = sorted((ROOT / "config/studies").glob("paper_a_*.yaml"))


@pytest.mark.parametrize(("name", "least"), [("papers", 10), ("theory", 4), ("concepts", 2)])
def test_numbers_in_the_documents_are_found(name: str, least: int):
    failed, tried = doctest.testfile(
        str(ROOT / f"docs/{name}.md"), module_relative=False, encoding="utf-8"
    )
    assert tried >= least
    assert failed == 0


@pytest.mark.exhaustive
def test_cells_of_the_page_of_phenomena_draw_figures():
    text = (ROOT / "docs/phenomena.md").read_text()
    first, *cells = re.findall(r"```\{code-cell\}\n(.*?)```", text, re.DOTALL)
    assert len(cells) == text.count("\n## ")
    for cell in cells:
        assert len(cell.splitlines()) <= 15
        space: dict = {}
        *body, last = re.split(r"\n(?=\S)", f"{first}{cell}".strip())
        exec("\n".join(body), space)
        assert eval(last, space).axes


def test_torus_of_the_page_of_phenomena_begins_where_multipliers_leave_the_unit_circle():
    p = damper.Parameters(0.3, 0.05, 1.1, 4.3, 0.3)
    branch = damper.continue_orbit(damper.periodic_orbit(p), "clearance", 4.3, 4.46)
    (torus,), beyond = branch.special_points, branch.orbits[-1].multipliers[0]
    assert torus.kind == "torus"
    assert "clearance 4.413 " in (ROOT / "docs/phenomena.md").read_text()
    assert torus.value == pytest.approx(4.413, abs=5e-4)
    assert abs(beyond) > 1
    assert abs(beyond.imag) > 0.5
    cube = damper.simulate(
        mass_ratio=0.3,
        damping_ratio=0.05,
        frequency_ratio=1.1,
        restitution=0.3,
        clearance=4.46,
        transient=1000,
        periods=1000,
        observers=["lyapunov"],
    )
    first, second = cube.lyapunov_exponents.values.ravel()[:2]
    assert abs(first) < 2e-3
    assert second < -0.02


def test_lists_of_what_a_study_can_ask_for_are_whole():
    text = (ROOT / "docs/studies.md").read_text()
    analysis = {*damper.analysis.__all__}
    for name in {*OBSERVERS, *FIGURES, *TABLES, "orbits", "curves", "draws", "forcing"} | analysis:
        if name not in CHECKING:
            assert re.search(rf"[`{{]{name}\b|    {name}:", text), name


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_every_value_of_paper_a_says_where_it_comes_from(path: Path):
    study = load_study(path)
    told = {*study.assumed, *study.stated}
    assert {*study.parameters, *study.axes, "visibility_threshold"} <= told
    # All that the text states: the range of d in Fig. 3, the frequencies of Figs 5 to 7.
    stated = {"paper_a_clearance": {"clearance"}, "paper_a_histories": {"frequency_ratio"}}
    assert set(study.stated) == stated.get(path.stem, set())


def test_figures_of_paper_a_bear_its_numbers():
    files = [figure for path in STUDIES for figure in load_study(path).files("figures")]
    assert sorted(files) == [f"figures/paper_a_fig_{number}" for number in range(1, 8)]
    marked = load_study(ROOT / "config/studies/paper_a_clearance.yaml").figures["paper_a_fig_3"]
    assert marked.mark == (0.0, 1.35)


def test_contact_ends_where_the_start_from_rest_ends():
    """Beyond the largest displacement of the damped oscillator alone nothing is ever touched.

    That displacement by sampling its closed form from rest: steady response and free decay.
    """
    zeta, omega = 0.04, 0.3
    gain = 1.0 / (1.0 - omega**2 + 2j * zeta * omega)
    root = np.sqrt(1.0 - zeta**2)
    time = np.linspace(0.0, 300.0, 600_001)
    steady = (gain * np.exp(1j * omega * time)).imag
    x0, v0 = -gain.imag, -(gain * omega).real
    free = x0 * np.cos(root * time) + (v0 + zeta * x0) / root * np.sin(root * time)
    largest = float(abs(steady + np.exp(-zeta * time) * free).max())
    found = simulate(
        mass_ratio=0.5,
        damping_ratio=zeta,
        frequency_ratio=omega,
        restitution=0.6,
        clearance=[largest - 1e-3, largest + 1e-6],
        transient=0,
        periods=60,
        observers=["impacts"],
    )
    touched, idle = found.impacts_per_period.values
    assert touched > 0.0
    assert idle == 0.0
    assert largest == pytest.approx(1.3596, abs=5e-5)
