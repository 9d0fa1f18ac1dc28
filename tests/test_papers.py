"""What the documents say of papers and theory is what their own examples give."""

import doctest
from pathlib import Path

import numpy as np
import pytest

from damper import simulate
from damper.study.config import load_study

ROOT = Path(__file__).parents[1]
STUDIES = sorted((ROOT / "config/studies").glob("paper_a_*.yaml"))


@pytest.mark.parametrize(("name", "least"), [("papers", 10), ("theory", 4), ("concepts", 2)])
def test_numbers_in_the_documents_are_found(name: str, least: int):
    failed, tried = doctest.testfile(
        str(ROOT / f"docs/{name}.md"), module_relative=False, encoding="utf-8"
    )
    assert tried >= least
    assert failed == 0


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
