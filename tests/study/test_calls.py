"""What functions refuse, before anything is run: mistakes.yaml has arguments and messages."""

from collections.abc import Callable
from typing import Any

import pytest
from scenes import SI, STUDY
from studies import MISTAKES

import damper
from damper.sweep.points import read_point
from damper.sweep.runs import run_points

CHATTER = damper.Parameters(0.1, 0.05, 0.2, 0.25, 0.6)
SHAKEN = damper.Record([0.0, 0.4, 1.1, 2.3], [0.0, 3.0, -4.0, 0.0], of="base_acceleration")
RECORD: dict[str, Any] = {"forcing": SHAKEN, "periods": {"time": "end"}, "observers": "response"}


def two_points(*, second: dict[str, Any] | None = None, **given: Any) -> None:
    """Run two points, of which the second differs, and say when one is done."""
    run = {"observers": ["impacts"], "transient": 1, "periods": 1, "progress": pytest.fail} | given
    wide = STUDY | {"clearance": 1.0}
    run_points([wide, wide | (second or {})], **run)


def on_a_structure(**given: Any) -> None:
    shapes = {"tip": [1.0], "force": "tip"}
    beam = damper.Structure.from_modes([1.0], [0.1], shapes)
    ball = {"box": "tip", "free_mass": 0.1, "gap": 0.04, "restitution": 0.6}
    force = {"force_amplitude": 2.0, "forcing_frequency": "1 Hz"}
    p = damper.SIParameters(structure=beam, masses=[ball], **force)
    damper.simulate(p, **{"transient": 1, "periods": 1} | given)


def shock(**given: Any) -> None:
    orbit = damper.periodic_orbit(damper.Parameters(0.1, 0.1, 1.0, 5.0, 0.5))
    damper.smallest_shock(orbit, **given)


CALLS: dict[str, Callable[..., Any]] = {
    "read_point": lambda **given: read_point(STUDY | given),
    "read_point in SI units": lambda **given: read_point(SI | given),
    "read_point of what is given": lambda **given: read_point(given),
    "run_points": two_points,
    "events": lambda **given: damper.events(**{"parameters": CHATTER, "until": 1.0} | given),
    "run": lambda **given: damper.run(CHATTER, **{"until": 5.0} | given),
    "simulate": lambda **given: damper.simulate(**{**STUDY, "transient": 3, "periods": 4, **given}),
    "simulate of a record": lambda **given: damper.simulate(**STUDY, **RECORD, **given),
    "simulate on a structure": on_a_structure,
    "smallest_shock": shock,
}


@pytest.mark.parametrize(
    ("call", "row"), [(call, row) for call in CALLS for row in MISTAKES["calls"][call]], ids=str
)
def test_refused(call: str, row: list[Any]) -> None:
    given, *parts = row
    if isinstance(given.get("state"), list):
        given = given | {"state": damper.State(*given["state"])}
    with pytest.raises((TypeError, ValueError)) as caught:
        CALLS[call](**given)
    assert [part for part in parts if part not in str(caught.value)] == [], caught.value
