"""Timings that are made up, in the form of `damper.verification.cost.measure.measure`."""

from typing import Any


def _case(model: str, **more: Any) -> dict[str, Any]:
    return {"model": model, "observers": [], "events": 4000, "bare": [0.24, 0.25, 0.27]} | more


def _sizes(seconds: list[float], memory: list[int], arrays: list[int]) -> dict[str, Any]:
    return {
        "size": [10, 1000, 100_000],
        "seconds": seconds,
        "peak": [90_000_000] * 3,
        "memory": memory,
        "arrays": arrays,
        "slope": 0.99,
    }


TIMINGS: dict[str, Any] = {
    "machine": {"processor": "A processor", "cores": "2", "python": "3.12"},
    "suite": {
        "runs": 10,
        "periods": 200,
        "repeats": 30,
        "noise": [0.99, 1.0, 1.01],
        "cases": {
            "bare_engine": _case("rigid", over_base=[0.99, 1.0, 1.02]),
            "impacts": _case(
                "rigid",
                observers=["impacts"],
                observed=[0.26, 0.27, 0.28],
                over_bare=[1.0, 1.0625, 1.125],
                memory=3_000_000,
                arrays=250_000,
            ),
            "grounded": _case("grounded", over_rigid=[1.5, 2.0, 2.5], over_base=[1.4, 2.0, 3.0]),
        },
    },
    "growth": {
        "observers": ["impact_section"],
        "runs": {
            "bare": _sizes([4e-4, 0.04, 4.0], [20_000, 20_000, 20_000], [0, 0, 0]),
            "observed": _sizes([6e-4, 0.06, 6.0], [0, 400_000, 40_000_000], [90, 9_000, 900_000]),
        },
        "periods": {
            "bare": _sizes([2e-5, 6e-4, 0.06], [0, 0, 0], [0, 0, 0]) | {"slope": None},
            "observed": _sizes(
                [1e-4, 9e-4, 0.09], [0, 16_000, 1_600_000], [160, 16_000, 1_600_000]
            ),
        },
    },
}
