"""The results of metamorphic tests as a dataset."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from damper.parameters.lazy import xr
from damper.parameters.quantities import ALL, DIMENSIONLESS_NAMES
from damper.parameters.variables import Variable
from damper.sweep.parts import PartData
from damper.verification.metamorphic.verdicts import (
    ALLOWANCE,
    CHECKS,
    NOT_APPLICABLE,
    RELATION_VERDICTS,
    RELATIONS,
)

_RELATION = {
    "difference": (
        "largest difference of comparable events",
        "of phase, displacement and speeds, over the run's sizes",
    ),
    "ratio": (
        "largest difference over what the condition allows",
        f"allowed: {ALLOWANCE:g} units of roundoff times the growth; for another accuracy, its "
        "error times the growth too",
    ),
    "verdict": ("verdict", ""),
}
#: What `damper.verification.metamorphic.relations.run_metamorphic` finds of each run.
METAMORPHIC_VARIABLES = (
    Variable("growth", "amplification of a small perturbation", "1", comment="at least 1"),
    Variable(
        "comparable_events",
        "events up to which a comparison is meaningful",
        "1",
        comment="growth leaves roundoff below 1e-6, and the noise changes no event's kind",
    ),
    Variable("compared_of_events", "events of the run, its end included", "1"),
    Variable(
        "backward_error",
        "largest backward error of a segment",
        "1",
        comment="rigid damper only; over the sizes of the terms, in units of roundoff, 2^-52",
    ),
    *(
        Variable(f"backward_{name}", f"backward error: {words}", "1", comment="units of 2^-52")
        for name, words in CHECKS.items()
    ),
    Variable("laws_excess", "largest violation of a law over its limit", "1"),
    *(
        Variable(f"{name}_{what}", f"{long_name}: {words}", "1", comment=comment)
        for name, words in RELATIONS.items()
        for what, (long_name, comment) in _RELATION.items()
    ),
)
_VARIABLES = {v.name: v for v in METAMORPHIC_VARIABLES}


def gather(parts: Sequence[PartData], attributes: Mapping[str, Any]) -> xr.Dataset:
    """Put all parts together along ``run``, each a stretch of neighbours.

    Quantities that a point does not give have their defaults, an infinite contact stiffness among
    them: a rigid wall.
    """

    from damper.sweep.cube import described

    data = {}
    for name in parts[0].arrays:
        array = np.concatenate([part.arrays[name] for part in parts])
        data[name] = described(_described(name), array, ["run"], name.endswith("_verdict"))
    runs = np.arange(sum(len(part.arrays["growth"]) for part in parts))
    coords = {"run": described(Variable("run", "run", "1", ("run",)), runs)}
    return xr.Dataset(data, coords, dict(attributes))


def point_of(cube: xr.Dataset, run: int) -> dict[str, float]:
    """Return the quantities of a run that are not their defaults, as `read_point` takes them."""
    values = {name: float(cube[name][run]) for name in DIMENSIONLESS_NAMES}
    return {name: value for name, value in values.items() if value != ALL[name].default}


def _described(name: str) -> Variable:
    """Return what is declared of a quantity or of what was found."""
    if name in DIMENSIONLESS_NAMES:
        return Variable(name, ALL[name].long_name, ALL[name].units)
    if name.endswith("_verdict"):
        flags = (words for code, words in RELATION_VERDICTS.items() if code != NOT_APPLICABLE)
        return replace(_VARIABLES[name], flags=tuple(flags))
    return _VARIABLES[name]
