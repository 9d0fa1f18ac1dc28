"""Settings of the tables, a class for each kind."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from damper.parameters.quantities import INITIAL_NAMES
from damper.study.fields import Faults, Number, Text
from damper.study.products.base import (
    FREE_TRAVEL,
    Offer,
    Product,
    Role,
    count_values,
    fit_axis,
    need,
    need_one_run,
    need_section,
)
from damper.study.yaml_file import words
from damper.tables import DAMPED, GOOD


class Intervals(Product):
    """The intervals of one axis in which bursts are chatter."""

    along: Annotated[str, Text(), Field(description="Axis on which the intervals lie.")]
    resolution: Annotated[
        float,
        Number(gt=0),
        Field(description="How closely the ends of the intervals are found, in units of the axis."),
    ] = 1e-3

    @classmethod
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        need(offer, faults, "bursts")
        need_one_run(offer, faults, bisected="edges")
        fit_axis("along", Role(least=3), settings, offer, faults)


class Agreement(Product):
    """How well theory predicts when and where complete bursts end, at each point of the study."""

    within: Annotated[
        float,
        Number(gt=0, lt=1),
        Field(
            description="Part of what is left of the burst to which a prediction must be right to "
            "agree: the table says from which impact on it does."
        ),
    ] = 0.01

    @classmethod
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        need(offer, faults, "accumulation")


class Performance(Product):
    """How well the damper damps: the best clearance, its band, statements on good damping."""

    along: Annotated[str, Text(), Field(description="Axis of the forcing frequency.")]
    over: Annotated[
        str,
        Text(),
        Field(description="Axis, such as the clearance, of which the best value is looked for."),
    ]
    good: Annotated[
        float, Number(gt=0, lt=1), Field(description="Rms ratio below which damping is good.")
    ] = GOOD
    damped: Annotated[
        float, Number(gt=0, le=1), Field(description="Amplitude ratio below which the band lies.")
    ] = DAMPED

    @classmethod
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        need(offer, faults, "response", "impacts", "bursts")
        need_one_run(offer, faults)
        name = settings.get("over")
        if isinstance(name, str) and name in offer.axes and name == settings.get("along"):
            faults.add(("over",), f"'{name}' is along already", "two distinct axes")
        for key in ("along", "over"):
            fit_axis(key, Role(least=2), settings, offer, faults)


class SmallMassLimit(Product):
    """The border between complete and incomplete bursts beside its small-mass limit."""

    resolution: Annotated[
        float, Number(gt=0), Field(description="Restitution to which borders are bisected.")
    ] = 1e-4

    @classmethod
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        need(offer, faults, "bursts")
        need_one_run(offer, faults, bisected="borders")
        for names in (("restitution",), FREE_TRAVEL):
            found = next((name for name in names if name in offer.axes), None)
            if found is None:
                faults.add((), f"needs an axis of the {' or '.join(names)}", words(names))
            else:
                count_values((), found, offer.axes[found], Role(least=2), faults)


class TwoImpacts(Product):
    """Where the closed-form motion with two impacts per period exists and is stable."""

    along: Annotated[str, Text(), Field(description="Axis on which the ranges lie.")]
    resolution: Annotated[
        float,
        Number(gt=0),
        Field(description="How closely the ends of the ranges are found, in units of the axis."),
    ] = 1e-3

    @classmethod
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        need_section(offer, faults)
        need(offer, faults, "impacts")
        name = settings.get("along")
        if isinstance(name, str) and name in offer.axes and name in INITIAL_NAMES:
            message = f"'{name}' sets where a run starts, which the closed form does not depend on"
            faults.add(("along",), message, "an axis of a parameter")
        fit_axis("along", Role(least=2), settings, offer, faults)
