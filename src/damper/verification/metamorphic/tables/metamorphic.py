"""Table of the metamorphic tests: what differs, and whether the method is why."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from damper.analysis.labels import label_of, short
from damper.engine.roundoff import EPSILON
from damper.parameters.lazy import pd, xr
from damper.tables import Table
from damper.verification.base import Made
from damper.verification.metamorphic.cube import point_of
from damper.verification.metamorphic.verdicts import (
    ALLOWANCE,
    CHECKS,
    FAILED,
    NOT_APPLICABLE,
    PASSED,
    RELATION_VERDICTS,
    RELATIONS,
    SOUND,
)

_PARTS = {"median": 0.5, "99 %": 0.99, "worst": 1.0}
_RATIOS = {f"{name} ratio": part for name, part in _PARTS.items()}
_JUDGED = {f"backward_{name}": f"{words} [2^-52]" for name, words in CHECKS.items()} | {
    "laws_excess": "worst law, over its limit"
}


class MetamorphicTable(Made):
    """Each relation: runs that agree, runs that are judged step by step, and the worst ones."""


def make(results: Mapping[str, Any], settings: MetamorphicTable) -> Table:
    """Make the table: the data have a row for each relation, the body tables of more."""
    cube = results["cube"]
    count = cube.sizes["run"]
    failed = failures(cube)
    verdicts = verdicts_of(cube)
    data = pd.DataFrame(
        {words: (verdicts == code).sum() for code, words in RELATION_VERDICTS.items()}
    )
    data.insert(0, "runs", count)
    ratios = pd.DataFrame({name: cube[f"{name}_ratio"].values for name in RELATIONS})
    data = data.assign(**{words: ratios.quantile(part) for words, part in _RATIOS.items()})
    cells = data.assign(
        **{words: data[words].map(partial(short, missing="none")) for words in _RATIOS}
    )
    same = int(verdicts.isin((PASSED, NOT_APPLICABLE)).all(axis=1).sum())
    refused = int(cube.growth.isnull().sum())
    return Table(
        "Metamorphic tests",
        data.rename_axis("relation").reset_index(),
        [
            f"{count} runs were repeated in six ways that must not change them. {same - refused} "
            f"agree outright in all of them, {count - same - len(failed)} do not, but are sound "
            f"step by step, and {len(failed)} fail. {refused} were refused with an error.",
            "Where roundoff alone moves an event, two runs may differ by it: allowed are "
            f"{ALLOWANCE:g} units of roundoff (2.2e-16) times the amplification of a small "
            "perturbation and, where the accuracy is another one, its error times that. A run "
            "whose perturbation outgrows all comparison, or that ends in other events, is judged "
            "step by step. It must keep the laws of the other table (impact, continuity, energy), "
            "and if it is one of the rigid damper, its backward error must be small: the change of "
            "the equations, in units of roundoff, that would make each segment exact. Up to "
            f"{SOUND:g} of them ({SOUND * EPSILON:.0e}) the method is sound, and the difference is "
            "the run's own.",
            "## Relations",
            cells.rename(RELATIONS).rename_axis("made again").reset_index(),
            "Ratio: largest difference over what is allowed, of the runs that have events to "
            "compare. Above 1 it is no failure where the steps of both runs are sound: the noisy "
            "runs may understate what roundoff does.",
            "## Steps",
            pd.DataFrame([_judgement(cube, name) for name in _JUDGED]),
            "## Failed",
            pd.DataFrame([_failure(cube, run) for run in failed]) if failed else "None.",
        ],
    )


def verdicts_of(cube: xr.Dataset) -> pd.DataFrame:
    """Verdict on each run, a row, and relation."""
    found = {name: cube[f"{name}_verdict"].fillna(NOT_APPLICABLE).values for name in RELATIONS}
    return pd.DataFrame(found)


def failures(cube: xr.Dataset) -> list[int]:
    """Return the numbers of the runs that fail in any way."""
    return np.flatnonzero((verdicts_of(cube) == FAILED).any(axis=1)).tolist()


def _judgement(cube: xr.Dataset, name: str) -> dict[str, str]:
    values = cube[name].values
    known = values[~np.isnan(values)]
    found = {"of each step": _JUDGED[name]}
    if not known.size:
        return found | dict.fromkeys(_PARTS, "none")
    parts = np.quantile(known, list(_PARTS.values())).tolist()
    found |= dict(zip(_PARTS, map(short, parts), strict=True))
    run = int(np.nanargmax(values))
    return found | {"run": str(run), "its parameters": _parameters(cube, run)}


def _failure(cube: xr.Dataset, run: int) -> dict[str, str]:
    failed = [words for n, words in RELATIONS.items() if cube[f"{n}_verdict"][run] == FAILED]
    return {
        "run": str(run),
        "made again": ", ".join(failed),
        "backward error [2^-52]": short(float(cube.backward_error[run]), "none"),
        "worst law": short(float(cube.laws_excess[run]), "none"),
        "its parameters": _parameters(cube, run),
    }


def _parameters(cube: xr.Dataset, run: int) -> str:
    """Quantities of a run that are not their defaults, in full digits."""
    return ", ".join(f"{label_of(n)} {value:.16g}" for n, value in point_of(cube, run).items())
