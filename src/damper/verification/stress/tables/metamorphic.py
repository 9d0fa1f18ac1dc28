"""Table of the metamorphic tests: what differs, and whether condition or method is why."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from damper.tables import markdown_table
from damper.verification.base import Made
from damper.verification.labels import label
from damper.verification.stress.parts import point_of
from damper.verification.stress.verdicts import (
    ALLOWANCE,
    CHECKS,
    CONDITIONS,
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

#: Line of the CSV: what it is about, which one, which quantity, and its value.
Line = tuple[str, str, str, str]

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


def make(cube: xr.Dataset) -> tuple[str, str]:
    """Make the table.

    Parameters
    ----------
    cube : xarray.Dataset
        Of `damper.verification.stress.metamorphic_cube.gather_metamorphic`.

    Returns
    -------
    csv, markdown : str
        One value a line, and what a person reads.
    """
    count = cube.sizes["run"]
    lines: list[Line] = [("all", "all", "runs", str(count))]
    text = ["# Metamorphic tests", ""]
    if not count:
        return _csv(lines), "\n".join([*text, "No runs were compared.", ""])
    failed = failures(cube)
    text += [
        f"{count} runs were made again in six ways that must not matter. {_outcome(cube, failed)}",
        "",
        f"Where roundoff alone moves an event, two runs may differ by it: allowed are {ALLOWANCE:g}"
        " units of roundoff (2.2e-16) times the growth of a small noise over the run, and, where "
        "the accuracy is another one, its error times that growth. A run whose noise grows beyond "
        "all comparison, or that ends in other events, is judged step by step: the backward error "
        "is the change of the equations, in units of roundoff, that would make each segment exact. "
        f"Up to {SOUND:g} of them ({SOUND * 2.0**-52:.0e}) the method is sound, and the difference "
        "is the run's own. Runs of models other than the rigid damper must keep the laws of the "
        "other table instead (impact, continuity, energy), which is less than a backward error.",
        "",
        "## Ways",
        "",
    ]
    found, rows = _ways(cube)
    lines += found
    text += markdown_table(["made again", "runs", *_COUNTED.values(), *_RATIOS], rows)
    text += [
        "",
        "Ratio: largest difference over what is allowed, of the runs that have events to compare.",
        _beyond(cube),
        "",
        "## Condition",
        "",
    ]
    found, rows = _conditions(cube)
    lines += found
    heads = ["runs that are", "runs", "share", "median comparable events", "of events"]
    text += markdown_table([*heads, "median growth", "worst backward error [2^-52]"], rows)
    text += ["", "## Backward error", ""]
    found, rows = _checks(cube)
    lines += found
    heads = ["check", "median [2^-52]", "99 %", "worst", "run", "its parameters"]
    text += markdown_table(heads, rows)
    text += ["", "## Failed", ""]
    if not len(failed):
        text += ["None."]
    else:
        rows = []
        for run in failed:
            ways = [name for name in RELATIONS if _verdicts(cube, name)[run] == FAILED]
            judged = [_number(float(cube[n].values[run])) for n in ("backward_error", _CLOSING)]
            condition = CONDITIONS[int(cube.condition.values[run])]
            words = ", ".join(RELATIONS[name] for name in ways)
            place = parameters_of(cube, int(run))
            rows.append([str(run), words, condition, *judged, place])
            lines.append(("failed", str(run), "ways", " ".join(ways)))
            lines.append(("failed", str(run), "parameters", place))
        heads = ["run", "made again", "condition", "backward error [2^-52]", "closing"]
        text += markdown_table([*heads, "its parameters"], rows)
    return _csv(lines), "\n".join([*text, ""])


def failures(cube: xr.Dataset) -> np.ndarray:
    """Return the numbers of the runs that fail in any way."""
    if not cube.sizes["run"]:
        return np.zeros(0, dtype=int)
    return np.flatnonzero(np.any([_verdicts(cube, n) == FAILED for n in RELATIONS], axis=0))


def parameters_of(cube: xr.Dataset, run: int) -> str:
    """Write the quantities of a run that are not their defaults, in full digits."""
    arrays = {str(name): array.values for name, array in cube.data_vars.items()}
    values = point_of(arrays, run).items()
    return ", ".join(f"{label(name)} {value:.16g}" for name, value in values)


def _verdicts(cube: xr.Dataset, name: str) -> np.ndarray:
    return cube[f"{name}_verdict"].values


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


def _ways(cube: xr.Dataset) -> tuple[list[Line], list[list[str]]]:
    lines: list[Line] = []
    rows = []
    for name in RELATIONS:
        verdicts = _verdicts(cube, name)
        counts = {words: int((verdicts == code).sum()) for code, words in _COUNTED.items()}
        ratios = cube[f"{name}_ratio"].values
        ratios = ratios[~np.isnan(ratios)]
        found = {w: form(ratios) if ratios.size else math.nan for w, form in _RATIOS.items()}
        lines += [("way", name, words, str(value)) for words, value in counts.items()]
        lines += [("way", name, words, f"{value:.3g}") for words, value in found.items()]
        shown = [str(value) for value in counts.values()]
        total = str(sum(counts.values()))
        rows.append([RELATIONS[name], total, *shown, *(_number(value) for value in found.values())])
    return lines, rows


def _conditions(cube: xr.Dataset) -> tuple[list[Line], list[list[str]]]:
    lines: list[Line] = []
    rows = []
    kinds = cube.condition.values
    for code, name in CONDITIONS.items():
        chosen = kinds == code
        runs = int(chosen.sum())
        if not runs and code < 0:
            continue
        found = {
            "comparable events": _median(cube.comparable_events.values[chosen]),
            "events": _median(cube.compared_of_events.values[chosen]),
            "growth": _median(cube.growth.values[chosen]),
            "worst backward error": _largest(cube.backward_error.values[chosen]),
        }
        lines.append(("condition", name, "runs", str(runs)))
        lines += [("condition", name, words, f"{value:.3g}") for words, value in found.items()]
        share = f"{runs / len(kinds):.1%}"
        events, growth = list(found.values())[:2], list(found.values())[2:]
        shown = [f"{value:g}" for value in events] + [_number(value) for value in growth]
        shown = [word if runs else "none" for word in shown]
        rows.append([CONDITIONS[code], str(runs), share, *shown])
    return lines, rows


def _checks(cube: xr.Dataset) -> tuple[list[Line], list[list[str]]]:
    lines: list[Line] = []
    rows = []
    described = {f"backward_{name}": words for name, words in CHECKS.items()} | {
        _CLOSING: "end of a burst, over the accuracy asked for",
        "laws_excess": "other models: worst law, over its limit",
    }
    for name, words in described.items():
        values = cube[name].values
        known = values[~np.isnan(values)]
        if not known.size:
            continue
        run = int(np.nanargmax(values))
        found = [float(np.median(known)), float(np.quantile(known, 0.99)), float(known.max())]
        place = parameters_of(cube, run) if found[-1] > 0.0 else "none"
        for quantity, value in zip(("median", "99 %", "worst"), found, strict=True):
            lines.append(("check", name, quantity, f"{value:.3g}"))
        lines.append(("check", name, "run", str(run)))
        rows.append([words, *(_number(value) for value in found), str(run), place])
    return lines, rows


def _median(values: np.ndarray) -> float:
    known = values[~np.isnan(values)]
    return float(np.median(known)) if known.size else math.nan


def _largest(values: np.ndarray) -> float:
    known = values[~np.isnan(values)]
    return float(known.max()) if known.size else math.nan


def _number(value: float) -> str:
    return "none" if math.isnan(value) else f"{value:.2g}"


def _csv(lines: list[Line]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["about", "name", "quantity", "value"])
    writer.writerows(lines)
    return text.getvalue()
