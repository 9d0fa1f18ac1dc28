"""Settings that the figure and the table of a calibration share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from damper.papers.statements import SCORES
from damper.parameters.quantities import ALL
from damper.study.fields import Entries, Some, Text, one_of
from damper.study.messages import Faults
from damper.study.products import Offer, Place, Product, check_listed, need_one_run
from damper.study.yaml_file import as_part


class Scores(Product):
    """What a table or figure of a calibration scores."""

    statements: Annotated[
        Some[Annotated[str, one_of(SCORES)]],
        Field(description="Statements of the papers that this study tests; they are joined."),
    ]
    also: Annotated[
        Annotated[
            dict[str, Text], Entries("statement", tuple(SCORES), to="the study that tests it")
        ]
        | None,
        Field(
            description="More statements to join -> the studies that test them; these are to be "
            "among the studies of the configuration. Parameters that only the other study varies "
            "take their best values."
        ),
    ] = None
    preset: Annotated[
        Place | None,
        Field(
            description="Values of some axes whose place in the ranking is listed, exactly as the "
            "axes list them."
        ),
    ] = None

    @property
    def beside(self) -> Mapping[str, str]:
        """Statement -> the study that tests it."""
        return self.also or {}

    @classmethod
    def relate(cls, data: dict[str, Any], model: Scores | None, faults: Faults) -> None:
        if model is None:
            return
        for name in model.beside:
            if name in model.statements:
                message = f"'{name}' is among the statements that this study tests"
                faults.add(("also", name), message, "each statement once")

    @classmethod
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        need_one_run(offer, faults)
        names = settings.get("statements")
        listed = names if isinstance(names, list | tuple) else ()
        named = [name for name in listed if isinstance(name, str) and name in SCORES]
        for name in named:
            cls.fit_beside(name, offer, faults)
        about = {axis for name in named for axis in SCORES[name].axes}
        if named and not faults.lines and not set(offer.axes) - about:
            message = "no axis is left whose values could be ranked"
            faults.add((), message, "an axis that no statement is about")
        preset = settings.get("preset")
        for axis, value in preset.items() if isinstance(preset, dict) else ():
            if axis in offer.axes:
                check_listed(("preset", as_part(axis)), axis, value, offer.axes[axis], faults)
            elif axis in ALL:
                faults.unknown(("preset", axis), "axis", axis, offer.axes)

    @classmethod
    def fit_beside(cls, what: str, offer: Offer, faults: Faults) -> None:
        """Note what a study lacks to test the statement `what`."""
        statement = SCORES[what]
        for observer in statement.observers:
            if observer not in offer.observers:
                message = f"{what} needs {observer} among the observers"
                faults.add((), message, observer)
        for axis, needed in statement.needs.items():
            values = offer.axes.get(axis, ())
            if values is not None and not needed.met(values):
                faults.add((), f"{what} needs an axis {axis} with {needed.words}")
