"""Cases of other people, as docs/others.md lists them."""

import importlib.util
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs/others.md").read_text(encoding="utf-8")
#: Largest difference from theirs; where it is theirs that is off, from ours as the page has it.
LIMITS = {
    "floor": 1e-12,
    "plates": 1e-11,
    "oscillator": 2e-4,
    "light": 0.11,
    "contact": 2e-6,
    "table": 1e-5,
}


@pytest.fixture(scope="module")
def others() -> Any:
    spec = importlib.util.spec_from_file_location("others", ROOT / "benchmarks/others.py")
    assert spec
    assert spec.loader
    sys.modules["others"] = module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("case", LIMITS)
def test_the_engine_agrees_with_others(case: str, others: Any) -> None:
    """Each number is in the document, with what they have and, to some digits, what we have."""
    rows = list(others.CASES[case]())
    assert rows
    for row in rows:
        assert row.off < LIMITS[case], row
        start = f"| {case} | {row.what} | {others.text(row.theirs)} | "
        (line,) = (line for line in PAGE.splitlines() if line.startswith(start))
        ours = line.removeprefix(start).partition(" | ")[0]
        shown = complex(ours.replace(" ", "").replace("i", "j"))
        assert abs(shown - row.ours) < 2e-5 * abs(shown)


@pytest.mark.exhaustive
def test_where_a_centred_ball_is_hit(others: Any) -> None:
    for row in others.gap_of_a_centred_ball():
        assert row.ours == pytest.approx(float(row.verdict.split("= ")[-1]), abs=1e-11)


@pytest.mark.exhaustive
def test_laws_of_measured_balls(others: Any) -> None:
    for line in others.measured_balls():
        assert line in PAGE
