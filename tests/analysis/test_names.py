"""What `damper.analysis` offers is there, documented, and loaded late."""

import inspect
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import damper
from damper.analysis import HOME

STUDIES = Path(__file__).parents[2] / "docs/studies.md"


def test_every_function_is_there_and_in_the_documents() -> None:
    text = STUDIES.read_text()
    for name in HOME:
        assert inspect.isfunction(getattr(damper.analysis, name))
        assert f"`{name}`" in text


CUBE = damper.simulate(
    **{"mass_ratio": 0.1, "damping_ratio": 0.02, "frequency_ratio": 1.3, "clearance": 0.05},
    **{"restitution": [0.3, 0.6], "transient": 2, "periods": 2},
    observers={"bursts": {"records": 2}, "stroboscopic_section": {}},
)


@pytest.mark.parametrize("name", HOME)
def test_what_is_no_cube_is_refused(name: str) -> None:
    function = getattr(damper.analysis, name)
    parameters = inspect.signature(function).parameters.values()
    first, *needed = [p.name for p in parameters if p.default is p.empty]
    if first == "cube":
        with pytest.raises(TypeError, match=r"cube is a \w+: must be an xarray.Dataset"):
            function(CUBE.chatter, **dict.fromkeys(needed, "restitution"))


@pytest.mark.parametrize(
    ("name", "given", "message"),
    [
        ("chatter_intervals", {"along": 3}, "unknown axis 3: must be one of restitution"),
        (
            "chatter_intervals",
            {"along": "restitution", "resolution": "fine"},
            "resolution = 'fine'",
        ),
        ("chatter_intervals", {"along": "restitution", "resolution": 0}, "resolution = 0: must be"),
        ("chatter_in_range", {"along": "restitution", "low": "a", "high": 1}, "low = 'a': must"),
        ("chatter_in_range", {"along": "restitution", "low": 1, "high": 0}, "low = 1, high = 0"),
        ("burst_statistics", {"since": "x"}, "since = 'x': must be a real number"),
        ("section_period", {"same": "x"}, "same = 'x': must be a real number"),
    ],
)
def test_slips_are_named(name: str, given: dict[str, Any], message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        getattr(damper.analysis, name)(CUBE, **given)


@pytest.mark.parametrize("distance", [[1.0], None])
def test_order_of_convergence_needs_two_sequences_of_one_length(distance: Any) -> None:
    with pytest.raises(ValueError, match="must be two sequences of one length"):
        damper.analysis.order_of_convergence([1.0, 2.0], distance)


def test_names_load_nothing_until_they_are_used() -> None:
    code = (
        "import sys, damper; assert 'best_clearance' in dir(damper.analysis);"
        "print(sorted({'numpy', 'pandas', 'xarray'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
