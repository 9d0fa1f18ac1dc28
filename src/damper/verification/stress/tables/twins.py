"""Table of the lanes run in other ways: what differs, and whether condition or method is why."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from damper.tables import markdown_table
from damper.verification.base import Made
from damper.verification.stress.parts import lane_of
from damper.verification.stress.verdicts import (
    ALLOWANCE,
    CHECKS,
    CONDITIONS,
    FAILED,
    IDENTITIES,
    NOT_APPLICABLE,
    PASSED,
    PASSED_BACKWARD,
    PASSED_LAWS,
    SOUND,
)

if TYPE_CHECKING:
    import xarray as xr

#: Line of the CSV: what it is about, which one, which quantity, and its value.
Line = tuple[str, str, str, str]

_CLOSING = "backward_closing"
#: Damping ratio from which the primary creeps: its speed is some 1 / (2 zeta).
HEAVY = 100.0

_WORDS = {
    "mirrored": "mirrored",
    "shifted": "3 periods later",
    "shifted_far": "2^20 periods later",
    "units": "SI units and back",
    "sharper": "accuracy 1e-14",
    "looser": "accuracy 1e-10",
}
_CONDITION_WORDS = {**CONDITIONS, 1: "error growth (chaos)"}
_CHECK_WORDS = {
    "clock": "clock: duration of a segment",
    "motion": "motion of the masses over a segment",
    "contact": "gap and approach speed at an impact",
    "law": "momentum and restitution in an impact",
    "release": "no thrust at a release",
    "inside": "between the walls in flight, pushed by one in sticking",
    "tail": "time left of a burst",
}
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


class TwinsTable(Made):
    """Each identity: lanes that agree, lanes that backward error judges, and the worst ones."""

    reads: ClassVar[tuple[str, ...]] = ("twins.nc",)


def make(twins: xr.Dataset) -> tuple[str, str]:
    """Make the table.

    Parameters
    ----------
    twins : xarray.Dataset
        Of `damper.verification.stress.twins_cube.gather_twins`.

    Returns
    -------
    csv, markdown : str
        One value a line, and what a person reads.
    """
    count = twins.sizes["lane"]
    lines: list[Line] = [("all", "all", "lanes", str(count))]
    text = ["# The same lane in other ways", ""]
    if not count:
        return _csv(lines), "\n".join([*text, "No lanes were compared.", ""])
    failed = failures(twins)
    text += [
        f"{count} lanes were run again in six ways that must not matter. {_outcome(twins, failed)}",
        "",
        f"Where roundoff alone moves an event, two runs may differ by it: allowed are {ALLOWANCE:g}"
        " units of roundoff (2.2e-16) times the growth of a small noise over the run, and, where "
        "the accuracy is another one, its error times that growth. A lane whose noise grows beyond "
        "all comparison, or that ends in other events, is judged step by step: the backward error "
        "says by how many units of roundoff the equations would have to be changed for each of its "
        f"segments to be exact. Up to {SOUND:g} of them ({SOUND * 2.0**-52:.0e}) the method is "
        "sound, and the difference is the lane's own. Lanes of models other than the rigid damper "
        "must keep the laws of the other table instead (impact, continuity, energy), which is less "
        "than a backward error.",
        "",
        "## Ways",
        "",
    ]
    found, rows = _ways(twins)
    lines += found
    text += markdown_table(["run again", "lanes", *_COUNTED.values(), *_RATIOS], rows)
    text += [
        "",
        "Ratio: largest difference over what is allowed, of the lanes that have events to compare.",
        _beyond(twins),
        "",
        "## Condition",
        "",
    ]
    found, rows = _conditions(twins)
    lines += found
    heads = ["lanes that are", "lanes", "share", "median comparable events", "of events"]
    text += markdown_table([*heads, "median growth", "worst backward error [2^-52]"], rows)
    text += ["", "## Backward error", ""]
    found, rows = _checks(twins)
    lines += found
    heads = ["check", "median [2^-52]", "99 %", "worst", "lane", "its parameters"]
    text += markdown_table(heads, rows)
    text += ["", "## Failed", ""]
    if not len(failed):
        text += ["None."]
    else:
        rows = []
        for lane in failed:
            ways = [name for name in IDENTITIES if _verdicts(twins, name)[lane] == FAILED]
            judged = [_number(float(twins[n].values[lane])) for n in ("backward_error", _CLOSING)]
            condition = _CONDITION_WORDS[int(twins.condition.values[lane])]
            words = ", ".join(_WORDS[name] for name in ways)
            place = parameters_of(twins, int(lane))
            rows.append([str(lane), words, condition, *judged, place])
            lines.append(("failed", str(lane), "ways", " ".join(ways)))
            lines.append(("failed", str(lane), "parameters", place))
        heads = ["lane", "run again", "the lane", "backward error [2^-52]", "closing"]
        text += markdown_table([*heads, "its parameters"], rows)
    return _csv(lines), "\n".join([*text, ""])


def failures(twins: xr.Dataset) -> np.ndarray:
    """Return the numbers of the lanes that fail in any way."""
    if not twins.sizes["lane"]:
        return np.zeros(0, dtype=int)
    return np.flatnonzero(np.any([_verdicts(twins, n) == FAILED for n in IDENTITIES], axis=0))


def parameters_of(twins: xr.Dataset, lane: int) -> str:
    """Write the quantities of a lane that are not their defaults, in full digits."""
    arrays = {str(name): array.values for name, array in twins.data_vars.items()}
    values = lane_of(arrays, lane).items()
    return ", ".join(f"{name.replace('_', ' ')} {value:.16g}" for name, value in values)


def _verdicts(twins: xr.Dataset, name: str) -> np.ndarray:
    return twins[f"{name}_verdict"].values


def _outcome(twins: xr.Dataset, failed: np.ndarray) -> str:
    ran = twins.condition.values >= 0
    outright = np.all(
        [np.isin(_verdicts(twins, n), (PASSED, NOT_APPLICABLE)) for n in IDENTITIES], axis=0
    )
    same = int((outright & ran).sum())
    refused = int((~ran).sum())
    words = f"{same} agree outright in all of them, {int(ran.sum()) - same - len(failed)} do not, "
    words += f"but are sound step by step, and {len(failed)} fail."
    return words + (f" {refused} were refused with an error." if refused else "")


def _beyond(twins: xr.Dataset) -> str:
    above = np.any([twins[f"{name}_ratio"].values > 1.0 for name in IDENTITIES], axis=0)
    heavy = above & (twins.damping_ratio.values >= HEAVY)
    return (
        "A ratio above 1 is no failure where the backward errors of both runs are sound. "
        f"{int(above.sum())} lanes have one; {int(heavy.sum())} of them have a damping ratio of at "
        f"least {HEAVY:g}, where the primary creeps. The noise of the twins understates there what "
        "roundoff does, or the method's own roundoff is more than it: the comparison does not say."
    )


def _ways(twins: xr.Dataset) -> tuple[list[Line], list[list[str]]]:
    lines: list[Line] = []
    rows = []
    for name in IDENTITIES:
        verdicts = _verdicts(twins, name)
        counts = {words: int((verdicts == code).sum()) for code, words in _COUNTED.items()}
        ratios = twins[f"{name}_ratio"].values
        ratios = ratios[~np.isnan(ratios)]
        found = {w: form(ratios) if ratios.size else math.nan for w, form in _RATIOS.items()}
        lines += [("way", name, words, str(value)) for words, value in counts.items()]
        lines += [("way", name, words, f"{value:.3g}") for words, value in found.items()]
        shown = [str(value) for value in counts.values()]
        total = str(sum(counts.values()))
        rows.append([_WORDS[name], total, *shown, *(_number(value) for value in found.values())])
    return lines, rows


def _conditions(twins: xr.Dataset) -> tuple[list[Line], list[list[str]]]:
    lines: list[Line] = []
    rows = []
    kinds = twins.condition.values
    for code, name in CONDITIONS.items():
        chosen = kinds == code
        lanes = int(chosen.sum())
        if not lanes and code < 0:
            continue
        found = {
            "comparable events": _median(twins.comparable_events.values[chosen]),
            "events": _median(twins.compared_of_events.values[chosen]),
            "growth": _median(twins.growth.values[chosen]),
            "worst backward error": _largest(twins.backward_error.values[chosen]),
        }
        lines.append(("condition", name, "lanes", str(lanes)))
        lines += [("condition", name, words, f"{value:.3g}") for words, value in found.items()]
        share = f"{lanes / len(kinds):.1%}"
        events, growth = list(found.values())[:2], list(found.values())[2:]
        shown = [f"{value:g}" for value in events] + [_number(value) for value in growth]
        shown = [word if lanes else "none" for word in shown]
        rows.append([_CONDITION_WORDS[code], str(lanes), share, *shown])
    return lines, rows


def _checks(twins: xr.Dataset) -> tuple[list[Line], list[list[str]]]:
    lines: list[Line] = []
    rows = []
    described = {f"backward_{name}": _CHECK_WORDS[name] for name in CHECKS} | {
        _CLOSING: "end of a burst, over the accuracy asked for",
        "laws_excess": "other models: worst law, over its limit",
    }
    for name, words in described.items():
        values = twins[name].values
        known = values[~np.isnan(values)]
        if not known.size:
            continue
        lane = int(np.nanargmax(values))
        found = [float(np.median(known)), float(np.quantile(known, 0.99)), float(known.max())]
        place = parameters_of(twins, lane) if found[-1] > 0.0 else "none"
        for quantity, value in zip(("median", "99 %", "worst"), found, strict=True):
            lines.append(("check", name, quantity, f"{value:.3g}"))
        lines.append(("check", name, "lane", str(lane)))
        rows.append([words, *(_number(value) for value in found), str(lane), place])
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
