"""Timings that are made up, in the form of `damper.verification.cost.measure.measure`."""

from typing import Any


def _rung(model: str, observers: list[str], **more: Any) -> dict[str, Any]:
    return {
        "model": model,
        "observers": observers,
        "parameters": {"mass_ratio": 0.1},
        "events": 4000,
        "bare": [0.24, 0.25, 0.27],
        "time": [0.26, 0.27, 0.28],
        "over_bare": [1.0, 1.0625, 1.125],
        "over_base": [0.99, 1.0, 1.02],
        "memory": {"bare": 90_000_000, "peak": 93_000_000, "more": 3_000_000, "asked": 250_000},
    } | more


def _sizes(seconds: list[float], memory: list[int], asked: list[int]) -> dict[str, Any]:
    return {
        "size": [10, 1000, 100_000],
        "seconds": seconds,
        "repeats": [5, 5, 1],
        "memory": memory,
        "asked": asked,
        "time_slope": 0.99,
        "memory_slope": 0.0,
    }


TIMINGS: dict[str, Any] = {
    "machine": "A processor, 2 cores, Python 3.12",
    "core": "numba",
    "ladder": {
        "lanes": 10,
        "periods": 200,
        "repeats": 30,
        "noise": [0.99, 1.0, 1.01],
        "rungs": {
            "bare engine": _rung("rigid", []),
            "impacts": _rung("rigid", ["impacts"]),
            "grounded": _rung("grounded", [], over_rigid=[1.5, 2.0, 2.5], over_base=[1.4, 2.0, 3]),
        },
    },
    "unused": {
        "lanes": 10,
        "periods": 200,
        "repeats": 30,
        "ratios": {"noise": [0.99, 1.0, 1.01], "bursts in the engine": [1.0, 1.01, 1.02]},
    },
    "scaling": {
        "lane_periods": 10,
        "observers": ["impacts"],
        "lanes": {
            "bare": _sizes([4e-4, 0.04, 4.0], [20_000, 20_000, 20_000], [0, 0, 0]),
            "observed": _sizes([6e-4, 0.06, 6.0], [0, 400_000, 40_000_000], [90, 9_000, 900_000]),
        },
        "periods": {
            "bare": _sizes([2e-5, 6e-4, 0.06], [0, 0, 0], [0, 0, 0]),
            "observed": _sizes(
                [1e-4, 9e-4, 0.09], [0, 16_000, 1_600_000], [160, 16_000, 1_600_000]
            ),
        },
    },
    "startup": {
        "simulate": {
            "seconds": 0.4,
            "interpreter": 0.1,
            "modules": 500,
            "loaded": ["numpy", "numba"],
        },
        "figure: map": {
            "seconds": 1.0,
            "interpreter": 0.1,
            "modules": 900,
            "loaded": ["numpy", "matplotlib"],
        },
    },
    "times": {"simulate": {"jobs": 68, "median": 1.5, "total": 90.0}},
    "jobs": {"a schematic": {"figure": 1}, "everything": {"figure": 54, "simulate": 68}},
}
