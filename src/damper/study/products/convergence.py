"""Settings of the comparison of a compliant contact with the rigid damper."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import Field

from damper.parameters.quantities import MODEL_NAMES
from damper.study.fields import Faults, ListOf, Text
from damper.study.products.base import (
    BURST_RECORDS,
    MOST_VARIABLES,
    At,
    Caption,
    Figure,
    Offer,
    Product,
    Role,
    check_written,
    fit_axis,
)
from damper.study.settings import SECTIONS
from damper.study.yaml_file import words

#: What may be compared with the rigid damper beside what has one value at each point -> observers.
_RECORDED = {
    "displacement": SECTIONS,
    "velocity": SECTIONS,
    **dict.fromkeys(BURST_RECORDS, ("bursts",)),
}
_STIFFNESSES = ("contact_stiffness_ratio", "contact_stiffness")

Compared = Annotated[
    tuple[str, ...],
    ListOf(Text(), least=1),
    Field(
        description="Variables of the cube, each with one value at each point; or displacement "
        "or velocity, of which the section's last sample counts, or burst_onset, burst_duration, "
        "burst_accumulation_time, burst_sticking_time, of which the first record counts "
        "(records: 1); 4 at most."
    ),
]
Stiffness = Annotated[str, Text(), Field(description="Axis of the contact's stiffness.")]
Conventions = Annotated[
    str | None,
    Text(),
    Field(description="Axis of whose values, two at most, each makes a line: contact_tension."),
]


def _fit_convergence(settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
    """Note what a comparison with the rigid damper asks of a study in vain."""
    names = settings.get("variables")
    for i, name in enumerate(names) if isinstance(names, list | tuple) else ():
        needed = _RECORDED.get(name) if isinstance(name, str) else None
        if needed is None:
            check_written(("variables", i), name, offer, faults)
        elif not any(observer in offer.observers for observer in needed):
            message = f"'{name}' needs {' or '.join(needed)} among the observers"
            faults.add(("variables", i), message, " or ".join(needed))
    if isinstance(names, list | tuple) and len(names) > MOST_VARIABLES:
        message = f"{len(names)} variables are too many for one figure"
        faults.add(("variables",), message, f"at most {MOST_VARIABLES}")
    along = settings.get("along")
    if isinstance(along, str) and along in offer.axes and along not in _STIFFNESSES:
        faults.add(("along",), f"'{along}' is no stiffness of the contact", words(_STIFFNESSES))
    for name in offer.axes:
        if name not in MODEL_NAMES["compliant"]:
            message = f"axis '{name}' is not of the contact: the rigid damper is run at one point"
            faults.add((), message, "a study with no axes but those of the contact")


class Convergence(Figure):
    """The distance to the rigid damper over the stiffness of a compliant contact, and its order."""

    roles: ClassVar[Mapping[str, Role]] = {"along": Role(least=2), "lines": Role(most=2)}

    variables: Compared
    along: Stiffness
    lines: Conventions = None
    at: At = None
    caption: Caption = None

    @classmethod
    def needs(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        _fit_convergence(settings, offer, faults)


class ConvergenceTable(Product):
    """The same as a table: value, rigid value and distance at each stiffness, and the order."""

    variables: Compared
    along: Stiffness
    lines: Conventions = None

    @classmethod
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        _fit_convergence(settings, offer, faults)
        for role, least, most in (("along", 2, None), ("lines", 1, 2)):
            fit_axis(role, Role(least, most), settings, offer, faults)
