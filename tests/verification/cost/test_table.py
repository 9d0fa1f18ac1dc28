"""Tables of timings: nothing lost, nothing made up."""

import csv
import io

import pytest
from verification.cost.cost_timings import TIMINGS

from damper.verification.cost.tables.cost import make


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


@pytest.mark.parametrize("show", ["suite", "growth"])
def test_every_entry_has_a_row_and_the_machine_is_named(show):
    table = make(TIMINGS, show, "A title")
    text, markdown = table.csv(), table.markdown()
    lines = markdown.splitlines()
    assert lines[0] == "# A title"
    assert "A processor, 2 cores" in markdown
    cells = [line for line in lines if line.startswith("|")]
    assert len(cells) - 2 == len(rows(text)) == {"suite": 3, "growth": 12}[show]
    assert len({line.count("|") for line in cells}) == 1


def test_suite_keeps_digits_and_rounds_for_readers():
    table = make(TIMINGS, "suite", "Suite")
    text, markdown = table.csv(), table.markdown()
    bare, observed, grounded = rows(text)
    assert float(observed["over_bare_median"]) == 1.0625
    assert observed["over_rigid_median"] == bare["memory"] == ""
    assert grounded["over_rigid_upper"] == "2.5"
    assert observed["memory"] == "3000000"
    row = "| impacts | 0.250 | 0.270 | 1.062 [1.000, 1.125] |  |  | 3.00 | 0.25 |"
    assert row in markdown
    assert "| bare engine | 0.250 |  |" in markdown


def test_growth_is_given_per_run_and_with_its_exponents():
    markdown = make(TIMINGS, "growth", "Growth").markdown()
    assert "| runs | bare | 1000 | 0.04 | 40 | 0.02 | 0.00 |" in markdown
    assert "periods, slope 0.99 observed." in markdown
    assert "observed by impact section" in markdown
