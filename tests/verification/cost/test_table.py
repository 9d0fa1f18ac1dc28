"""Tables of timings: nothing lost, nothing made up."""

import csv
import io

import pytest
from verification.cost.cost_timings import TIMINGS

from damper.verification.cost.tables.cost import PARTS, make


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


@pytest.mark.parametrize("part", PARTS)
def test_every_part_has_one_row_for_each_entry_and_names_the_machine(part):
    text, markdown = make(TIMINGS, part, "A title")
    lines = markdown.splitlines()
    assert lines[0] == "# A title"
    assert "A processor, 2 cores" in markdown
    table = [line for line in lines if line.startswith("|")]
    assert len(table) - 2 == len(rows(text))
    assert len({line.count("|") for line in table}) == 1
    assert all(None not in row and None not in row.values() for row in rows(text))


def test_ladder_keeps_digits_and_rounds_for_readers():
    text, markdown = make(TIMINGS, "ladder", "Ladder")
    _, observed, grounded = rows(text)
    assert float(observed["over_bare_median"]) == 1.0625
    assert observed["over_rigid_median"] == ""
    assert grounded["over_rigid_upper"] == "2.5"
    assert observed["memory_more"] == "3000000"
    assert "| 1.062 [1.000, 1.125] |" in markdown
    assert "| 3.00 | 0.25 |" in markdown


def test_scaling_is_given_per_lane_and_with_its_exponents():
    _, markdown = make(TIMINGS, "scaling", "Scaling")
    assert "| lanes | bare | 1000 | 0.04 | 40 | 0.02 | 0.00 |" in markdown
    assert "lanes, bare: 0.99" in markdown


def test_jobs_that_a_target_does_not_need_are_none():
    text, _ = make(TIMINGS, "jobs", "Jobs")
    counts = {row["rule"]: row for row in rows(text)}
    assert {rule: row["a_schematic"] for rule, row in counts.items()} == {
        "figure": "1",
        "simulate": "0",
        "total": "1",
    }
    assert counts["total"]["everything"] == "122"


def test_wall_times_stand_beside_the_imports_of_their_rule():
    text, _ = make(TIMINGS, "startup", "Startup")
    simulate, drawn = rows(text)
    assert (simulate["jobs"], simulate["median"]) == ("68", "1.5")
    assert (drawn["jobs"], drawn["loaded"]) == ("", "numpy, matplotlib")


def test_a_part_that_is_not_there_is_refused():
    with pytest.raises(ValueError, match="unknown part 'memory'"):
        make(TIMINGS, "memory", "")
    with pytest.raises(ValueError, match="have no jobs"):
        make({"machine": "", "core": ""}, "jobs", "")
