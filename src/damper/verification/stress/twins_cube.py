"""Lanes run in other ways that must not matter, as one dataset."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from damper.parameters.quantities import ALL
from damper.parameters.variables import Variable
from damper.verification.stress.parts import LANE_NAMES
from damper.verification.stress.verdicts import ALLOWANCE, CHECKS, CONDITIONS, IDENTITIES, VERDICTS

_ROUNDING = "2^-52"
_OTHERWISE = {
    "mirrored": "mirrored, all signs changed and the forcing half a period later",
    "shifted": "started 3 forcing periods later",
    "shifted_far": "started 2^20 forcing periods later",
    "units": "taken to SI units and back",
    "sharper": "accuracy 1e-14 instead of 1e-12",
    "looser": "accuracy 1e-10 instead of 1e-12",
}
_CHECKED = {
    "clock": "duration of a segment",
    "motion": "motion over a segment",
    "contact": "gap and approach speed at an impact",
    "law": "momentum and restitution in an impact",
    "release": "thrust at a release",
    "inside": "depth beyond a wall in flight, or pull of the wall in sticking",
    "tail": "time left of a burst, by its formula",
}


def _variables() -> list[Variable]:
    found = [
        Variable("growth", "growth of a small noise over the run", "1", comment="at least 1"),
        Variable(
            "comparable_events",
            "events up to which a comparison says something",
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
        Variable(f"backward_{name}", f"backward error: {_CHECKED[name]}", _ROUNDING)
        for name in CHECKS
    ]
    for name in IDENTITIES:
        found += [
            Variable(
                f"{name}_difference",
                f"largest difference of comparable events: {_OTHERWISE[name]}",
                "1",
                comment="of phase, displacement and speeds, over the run's sizes",
            ),
            Variable(
                f"{name}_ratio",
                f"largest difference over what the condition allows: {_OTHERWISE[name]}",
                "1",
                comment=f"allowed: {ALLOWANCE:g} units of roundoff times the growth; for another "
                "accuracy, its error times the growth too",
            ),
            Variable(f"{name}_verdict", f"verdict: {_OTHERWISE[name]}", "1"),
        ]
    return found


#: What `damper.verification.stress.identities.run_identities` finds of each lane.
VARIABLES = {variable.name: variable for variable in _variables()}


def gather_twins(paths: Sequence[Path], attributes: Mapping[str, Any]) -> xr.Dataset:
    """Put all parts together.

    Parameters
    ----------
    paths : sequence of Path
        Parts in the order of their lanes, each of which is a stretch of neighbours. None at all
        make a dataset that has no lane and no variable.
    attributes : mapping
        Global attributes.

    Returns
    -------
    xarray.Dataset
        With the one dimension ``lane``.
    """
    parts = []
    for path in paths:
        with np.load(path) as file:
            parts.append({name: file[name] for name in file.files})
    data = {
        name: ("lane", np.concatenate([part[name] for part in parts]), _attributes(name))
        for name in (parts[0] if parts else ())
    }
    count = sum(len(part["condition"]) for part in parts)
    coords = {"lane": ("lane", np.arange(count), {"long_name": "lane", "units": "1"})}
    return xr.Dataset(data, coords, dict(attributes))


def _attributes(name: str) -> dict[str, Any]:
    about: Any = ALL[name] if name in LANE_NAMES else VARIABLES[name]
    attrs: dict[str, Any] = {"long_name": about.long_name, "units": about.units}
    if getattr(about, "comment", ""):
        attrs["comment"] = about.comment
    flags = CONDITIONS if name == "condition" else VERDICTS if name.endswith("_verdict") else {}
    if flags:
        attrs["flag_values"] = np.array(list(flags), dtype="i1")
        attrs["flag_meanings"] = " ".join(
            words.replace(" ", "_").replace("-", "_") for words in flags.values()
        )
    return attrs
