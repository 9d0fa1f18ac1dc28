"""The metamorphic tests of all runs as one dataset."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from damper.parameters.variables import Variable
from damper.sweep.cube import integers
from damper.verification.stress.parts import attributes_of
from damper.verification.stress.verdicts import (
    ALLOWANCE,
    CHECKS,
    CONDITIONS,
    NOT_APPLICABLE,
    RELATION_VERDICTS,
    RELATIONS,
)

_ROUNDING = "2^-52"


def _variables() -> list[Variable]:
    found = [
        Variable("growth", "growth of a small noise over the run", "1", comment="at least 1"),
        Variable(
            "comparable_events",
            "events up to which a comparison is meaningful",
            "1",
            comment="growth leaves roundoff below 1e-6, and the noise changes no event's kind",
        ),
        Variable("compared_of_events", "events of the run, its end included", "1"),
        Variable("condition", "how sharply the run's events are determined", "1"),
        Variable(
            "backward_error",
            "largest backward error of a segment",
            _ROUNDING,
            comment="rigid model only; over the sizes of the terms, in units of roundoff",
        ),
        Variable(
            "backward_displacement",
            "backward error of the displacement alone",
            _ROUNDING,
            comment="over where and how far it goes; not judged",
        ),
        Variable(
            "backward_closing",
            "error of the time at which a burst ends",
            "1",
            comment="over the accuracy asked for, in units of the faster of the two rates",
        ),
        Variable(
            "laws_excess",
            "largest violation of a law over its limit",
            "1",
            comment="models other than the rigid one",
        ),
    ]
    found += [
        Variable(f"backward_{name}", f"backward error: {words}", _ROUNDING)
        for name, words in CHECKS.items()
    ]
    for name, words in RELATIONS.items():
        found += [
            Variable(
                f"{name}_difference",
                f"largest difference of comparable events: {words}",
                "1",
                comment="of phase, displacement and speeds, over the run's sizes",
            ),
            Variable(
                f"{name}_ratio",
                f"largest difference over what the condition allows: {words}",
                "1",
                comment=f"allowed: {ALLOWANCE:g} units of roundoff times the growth; for another "
                "accuracy, its error times the growth too",
            ),
            Variable(f"{name}_verdict", f"verdict: {words}", "1"),
        ]
    return found


#: What `damper.verification.stress.metamorphic.run_metamorphic` finds of each run.
METAMORPHIC_VARIABLES = {variable.name: variable for variable in _variables()}


def gather_metamorphic(paths: Sequence[Path], attributes: Mapping[str, Any]) -> xr.Dataset:
    """Put all parts together.

    Parameters
    ----------
    paths : sequence of Path
        Parts in the order of their runs, each of which is a stretch of neighbours. None at all
        make a dataset that has no run and no variable.
    attributes : mapping
        Global attributes.

    Returns
    -------
    xarray.Dataset
        With the one dimension ``run``.
    """
    parts = []
    for path in paths:
        with np.load(path) as file:
            parts.append({name: file[name] for name in file.files})
    data = {}
    for name in parts[0] if parts else ():
        made = "run", np.concatenate([part[name] for part in parts]), _attributes(name)
        data[name] = integers(*made) if name.endswith("_verdict") else made
    count = sum(len(part["condition"]) for part in parts)
    coords = {"run": ("run", np.arange(count), {"long_name": "run", "units": "1"})}
    return xr.Dataset(data, coords, dict(attributes))


def _attributes(name: str) -> dict[str, Any]:
    verdicts = {code: text for code, text in RELATION_VERDICTS.items() if code != NOT_APPLICABLE}
    flags = verdicts if name.endswith("_verdict") else {}
    return attributes_of(name, METAMORPHIC_VARIABLES, CONDITIONS if name == "condition" else flags)
