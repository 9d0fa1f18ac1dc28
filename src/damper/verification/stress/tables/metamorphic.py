"""Table of the metamorphic tests: what differs, and whether condition or method is why."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from damper.tables import Table
from damper.verification.base import Made
from damper.verification.labels import label_of
from damper.verification.stress.parts import point_of
from damper.verification.stress.verdicts import (
    ALLOWANCE,
    CHECKS,
    CONDITIONS,
    EPS,
    FAILED,
    NOT_APPLICABLE,
    PASSED,
    PASSED_BACKWARD,
    PASSED_LAWS,
    RELATIONS,
    SOUND,
)

if TYPE_CHECKING:
    import xarray as xr

_CLOSING = "backward_closing"
#: Damping ratio from which the primary creeps: its speed is some 1 / (2 zeta).
HEAVY = 100.0

_COUNTED = {
    PASSED: "compared outright",
    PASSED_BACKWARD: "by backward error",
    PASSED_LAWS: "by the laws",
    FAILED: "failed",
    NOT_APPLICABLE: "not applicable",
}
_RATIOS: Mapping[str, Callable[[np.ndarray], float]] = {
    "median ratio": lambda values: float(np.median(values)),
    "99 % ratio": lambda values: float(np.quantile(values, 0.99)),
    "worst ratio": lambda values: float(values.max()),
}


class MetamorphicTable(Made):
    """Each relation: runs that agree, runs that backward error judges, and the worst ones."""

    reads: ClassVar[tuple[str, ...]] = ("metamorphic.nc",)


def make(cube: xr.Dataset) -> Table:
    """Make the table: the data have a row for each relation, the body tables of more.

    Parameters
    ----------
    cube : xarray.Dataset
        Of `damper.verification.stress.metamorphic_cube.gather_metamorphic`.

    Returns
    -------
    Table
    """
    import pandas as pd

    count = cube.sizes["run"]
    if not count:
        return Table(
            "Metamorphic tests", pd.DataFrame(columns=["relation"]), ["No runs were compared."]
        )
    failed = failures(cube)
    data = pd.DataFrame([_relation(cube, name) for name in RELATIONS])
    cells = data.assign(**{name: data[name].map(_number) for name in _RATIOS})
    cells["relation"] = list(RELATIONS.values())
    return Table(
        "Metamorphic tests",
        data,
        [
            f"{count} runs were made again in six ways that must not matter. "
            f"{_outcome(cube, failed)}",
            "Where roundoff alone moves an event, two runs may differ by it: allowed are "
            f"{ALLOWANCE:g} units of roundoff (2.2e-16) times the growth of a small noise over the "
            "run, and, where the accuracy is another one, its error times that growth. A run whose "
            "noise grows beyond all comparison, or that ends in other events, is judged step by "
            "step: the backward error is the change of the equations, in units of roundoff, that "
            f"would make each segment exact. Up to {SOUND:g} of them ({SOUND * EPS:.0e}) the "
            "method is sound, and the difference is the run's own. Runs of models other than the "
            "rigid damper must keep the laws of the other table instead (impact, continuity, "
            "energy), which is less than a backward error.",
            "## Relations",
            cells.rename(columns={"relation": "made again"}),
            "Ratio: largest difference over what is allowed, of the runs that have events to "
            f"compare.\n{_beyond(cube)}",
            "## Condition",
            pd.DataFrame(_conditions(cube)),
            "## Backward error",
            pd.DataFrame(_checks(cube)),
            "## Failed",
            pd.DataFrame([_failure(cube, int(run)) for run in failed]) if len(failed) else "None.",
        ],
    )


def failures(cube: xr.Dataset) -> np.ndarray:
    """Return the numbers of the runs that fail in any way."""
    if not cube.sizes["run"]:
        return np.zeros(0, dtype=int)
    return np.flatnonzero(np.any([_verdicts(cube, n) == FAILED for n in RELATIONS], axis=0))


def parameters_of(cube: xr.Dataset, run: int) -> str:
    """Write the quantities of a run that are not their defaults, in full digits."""
    arrays = {str(name): array.values for name, array in cube.data_vars.items()}
    values = point_of(arrays, run).items()
    return ", ".join(f"{label_of(name)} {value:.16g}" for name, value in values)


def _verdicts(cube: xr.Dataset, name: str) -> np.ndarray:
    return cube[f"{name}_verdict"].fillna(NOT_APPLICABLE).values


def _outcome(cube: xr.Dataset, failed: np.ndarray) -> str:
    ran = cube.condition.values >= 0
    outright = np.all(
        [np.isin(_verdicts(cube, n), (PASSED, NOT_APPLICABLE)) for n in RELATIONS], axis=0
    )
    same = int((outright & ran).sum())
    refused = int((~ran).sum())
    words = f"{same} agree outright in all of them, {int(ran.sum()) - same - len(failed)} do not, "
    words += f"but are sound step by step, and {len(failed)} fail."
    return words + (f" {refused} were refused with an error." if refused else "")


def _beyond(cube: xr.Dataset) -> str:
    above = np.any([cube[f"{name}_ratio"].values > 1.0 for name in RELATIONS], axis=0)
    heavy = above & (cube.damping_ratio.values >= HEAVY)
    return (
        "A ratio above 1 is no failure where the backward errors of both runs are sound. "
        f"{int(above.sum())} runs have one; {int(heavy.sum())} of them have a damping ratio of at "
        f"least {HEAVY:g}, where the primary creeps. The noisy runs understate there what "
        "roundoff does, or the method's own roundoff is more than it: no verdict."
    )


def _relation(cube: xr.Dataset, name: str) -> dict[str, Any]:
    verdicts = _verdicts(cube, name)
    counts = {words: int((verdicts == code).sum()) for code, words in _COUNTED.items()}
    ratios = cube[f"{name}_ratio"].values
    ratios = ratios[~np.isnan(ratios)]
    found = {w: form(ratios) if ratios.size else math.nan for w, form in _RATIOS.items()}
    return {"relation": name, "runs": sum(counts.values())} | counts | found


def _conditions(cube: xr.Dataset) -> Iterator[dict[str, str]]:
    kinds = cube.condition.values
    for code, name in CONDITIONS.items():
        chosen = kinds == code
        runs = int(chosen.sum())
        if not runs and code < 0:
            continue
        shown = {
            "median comparable events": f"{_median(cube.comparable_events.values[chosen]):g}",
            "of events": f"{_median(cube.compared_of_events.values[chosen]):g}",
            "median growth": _number(_median(cube.growth.values[chosen])),
            "worst backward error [2^-52]": _number(_largest(cube.backward_error.values[chosen])),
        }
        counted = {"runs that are": name, "runs": str(runs), "share": f"{runs / len(kinds):.1%}"}
        yield counted | {head: text if runs else "none" for head, text in shown.items()}


def _checks(cube: xr.Dataset) -> Iterator[dict[str, str]]:
    described = {f"backward_{name}": words for name, words in CHECKS.items()} | {
        _CLOSING: "end of a burst, over the accuracy asked for",
        "laws_excess": "other models: worst law, over its limit",
    }
    for name, words in described.items():
        values = cube[name].values
        known = values[~np.isnan(values)]
        if known.size:
            run = int(np.nanargmax(values))
            yield {
                "check": words,
                "median [2^-52]": _number(float(np.median(known))),
                "99 %": _number(float(np.quantile(known, 0.99))),
                "worst": _number(float(known.max())),
                "run": str(run),
                "its parameters": parameters_of(cube, run) if known.max() > 0.0 else "none",
            }


def _failure(cube: xr.Dataset, run: int) -> dict[str, str]:
    failed = [words for name, words in RELATIONS.items() if _verdicts(cube, name)[run] == FAILED]
    return {
        "run": str(run),
        "made again": ", ".join(failed),
        "condition": CONDITIONS[int(cube.condition.values[run])],
        "backward error [2^-52]": _number(float(cube.backward_error.values[run])),
        "closing": _number(float(cube[_CLOSING].values[run])),
        "its parameters": parameters_of(cube, run),
    }


def _median(values: np.ndarray) -> float:
    known = values[~np.isnan(values)]
    return float(np.median(known)) if known.size else math.nan


def _largest(values: np.ndarray) -> float:
    known = values[~np.isnan(values)]
    return float(known.max()) if known.size else math.nan


def _number(value: float) -> str:
    return "none" if math.isnan(value) else f"{value:.2g}"
