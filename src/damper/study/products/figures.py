"""Settings of the figures, a class for each kind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import Field

from damper.parameters.variables import SI_UNITS, TIME
from damper.study.fields import Choice, Faults, Flag, ListOf, Number, Range, Text
from damper.study.products.base import (
    FREE_TRAVEL,
    MOST_COLUMNS,
    MOST_LINES,
    MOST_PANELS,
    MOST_ROWS,
    MOST_VARIABLES,
    SECTION_VARIABLES,
    At,
    Caption,
    Each,
    Figure,
    Offer,
    Product,
    Role,
    check_written,
    need,
    need_listed_bursts,
    need_section,
)
from damper.study.settings import SECTIONS
from damper.study.yaml_file import show, words

#: What the small-mass limit speaks of.
_OF_BURSTS = ("complete_fraction", "chatter")


class Bifurcation(Figure):
    """The section over one axis, with a row of panels for each value of a second one.

    Both directions of a continuation are drawn, and all random initial states over each other.
    """

    roles: ClassVar[Mapping[str, Role]] = {
        "along": Role(),
        "each": Role(),
        "rows": Role(most=MOST_PANELS),
    }
    overlays: ClassVar[bool] = True

    along: Annotated[str, Text(), Field(description="Axis of the abscissa.")]
    each: Each = None
    rows: Annotated[
        str | None, Text(), Field(description="Axis of whose values each makes a row of panels.")
    ] = None
    at: At = None
    variables: Annotated[
        tuple[str, ...],
        ListOf(Choice(*SECTION_VARIABLES), least=1),
        Field(description="What is drawn, a panel each; one alone fits a printed column."),
    ] = SECTION_VARIABLES
    mark: Annotated[
        tuple[float, float] | None,
        Range(),
        Field(
            description="Part of the abscissa to mark by a bracket, such as a range that the "
            "source states; above the panels stands how far the chatter found agrees with it."
        ),
    ] = None
    mark_label: Annotated[str | None, Text(), Field(description="What the mark is; with mark.")] = (
        None
    )
    theory: Annotated[
        str | None,
        Choice("two_impacts"),
        Field(
            description="Theory to draw over it: the closed-form motion with two impacts per "
            "period, where it exists and where it is stable."
        ),
    ] = None
    caption: Caption = None

    def measured(self, observers: Mapping[str, dict[str, Any]]) -> dict[str, Any]:
        """Return the section, if theory is to be drawn on it."""
        if self.theory is None:
            return {}
        return {"section": {name: observers[name] for name in SECTIONS if name in observers}}

    @classmethod
    def needs(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        need_section(offer, faults)
        if "mark" in settings and "bursts" not in offer.observers:
            faults.add(("mark",), "needs bursts among the observers, to compare with", "bursts")

    @classmethod
    def relate(cls, data: dict[str, Any], model: Bifurcation | None, faults: Faults) -> None:
        if model is not None and (model.mark is None) != (model.mark_label is None):
            given, missing = ("mark", "mark_label") if model.mark else ("mark_label", "mark")
            allowed = Text.words if model.mark else Range.words
            faults.add((missing,), f"'{given}' is given, but '{missing}' is missing", allowed)


class Map(Figure):
    """One variable in colour over two axes."""

    roles: ClassVar[Mapping[str, Role]] = {
        "x": Role(least=2),
        "y": Role(least=2),
        "panels": Role(most=MOST_PANELS, branches=True),
        "each": Role(),
    }

    variable: Annotated[
        str,
        Text(),
        Field(
            description="Variable of the cube, with one value at each point. chatter and status "
            "are drawn in classes, all else with a colour bar."
        ),
    ]
    x: Annotated[str, Text(), Field(description="Axis of the abscissa.")]
    y: Annotated[str, Text(), Field(description="Axis of the ordinate.")]
    panels: Annotated[
        str | None,
        Text(),
        Field(description="Axis, or direction or draw, of whose values each makes a panel."),
    ] = None
    each: Each = None
    at: At = None
    best: Annotated[
        str | None,
        Choice("min", "max"),
        Field(
            description="Mark, for every x, the y at which the variable is least (min) or "
            "greatest (max); of equals the smallest y."
        ),
    ] = None
    theory: Annotated[
        str | None,
        Choice("small_mass_limit"),
        Field(
            description="Theory to draw over it: the restitution up to which bursts complete, in "
            "the limit of a small free mass; with complete_fraction or chatter, over restitution "
            "and clearance (or gap)."
        ),
    ] = None
    caption: Caption = None

    @classmethod
    def needs(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        check_written(("variable",), settings.get("variable"), offer, faults)
        if settings.get("theory") == "small_mass_limit":
            cls._fits_limit(settings, faults)

    @classmethod
    def _fits_limit(cls, settings: dict[str, Any], faults: Faults) -> None:
        variable, axes = settings.get("variable"), [settings.get("x"), settings.get("y")]
        if isinstance(variable, str) and variable not in _OF_BURSTS:
            message = f"the small-mass limit does not speak of '{variable}'"
            faults.add(("theory",), message, f"a map of {words(_OF_BURSTS)}")
        if all(isinstance(name, str) for name in axes) and not (
            "restitution" in axes and any(name in axes for name in FREE_TRAVEL)
        ):
            message = f"the small-mass limit has no place over {words(axes)}"
            faults.add(("theory",), message, "restitution and clearance (or gap) as x and y")


class Curves(Figure):
    """Variables over one axis, each in a panel of its own, with a line for each value of another.

    Amplitude ratios have a thin line at 1, where the damper changes nothing.
    """

    roles: ClassVar[Mapping[str, Role]] = {
        "along": Role(least=2),
        "lines": Role(most=MOST_LINES, branches=True),
        "each": Role(),
        "best": Role(),
    }

    variables: Annotated[
        tuple[str, ...],
        ListOf(Text(), least=1),
        Field(
            description="Variables of the cube, each with one value at each point; a panel each, "
            f"{MOST_VARIABLES} at most."
        ),
    ]
    along: Annotated[str, Text(), Field(description="Axis of the abscissa.")]
    lines: Annotated[
        str | None,
        Text(),
        Field(
            description="Axis, or direction or draw, of whose values each makes a line; "
            f"{MOST_LINES} at most."
        ),
    ] = None
    each: Each = None
    at: At = None
    best: Annotated[
        str | None,
        Text(),
        Field(
            description="Axis that is set, for each line, to the value at which the greatest "
            "value of the first variable along the abscissa is least."
        ),
    ] = None
    log: Annotated[bool, Flag(), Field(description="Whether ordinates are logarithmic.")] = False
    caption: Caption = None

    @classmethod
    def needs(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        names = settings.get("variables")
        for i, name in enumerate(names) if isinstance(names, list | tuple) else ():
            check_written(("variables", i), name, offer, faults)

    @classmethod
    def relate(cls, data: dict[str, Any], model: Curves | None, faults: Faults) -> None:
        if model is not None and len(model.variables) > MOST_VARIABLES:
            message = f"{len(model.variables)} variables are too many for one figure"
            faults.add(("variables",), message, f"at most {MOST_VARIABLES}")


class Trajectory(Figure):
    """Displacements and velocities of both masses over time, at one point."""

    roles: ClassVar[Mapping[str, Role]] = {"each": Role()}

    each: Each = None
    at: At = None
    start: Annotated[
        float,
        Number(ge=0),
        Field(
            description="Where the figure starts, in forcing periods since the start of the "
            "stretch that the observer samples."
        ),
    ] = 0.0
    stop: Annotated[
        float | None,
        Number(gt=0),
        Field(description="Where it ends, likewise; the end of the stretch when not given."),
    ] = None
    caption: Caption = None

    @classmethod
    def needs(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        need(offer, faults, "trajectory")

    @classmethod
    def relate(cls, data: dict[str, Any], model: Trajectory | None, faults: Faults) -> None:
        if model is not None and model.stop is not None and model.stop <= model.start:
            message = f"start ({show(model.start)}) must be less than stop ({show(model.stop)})"
            faults.add(("stop",), message, f"number > {show(model.start)}")


class SlowManifold(Figure):
    """Amplitude of the free mass against that of the primary, cycle by cycle, over the manifold.

    Uses the events of the trajectory; a light free mass and a slowly changing amplitude show it.
    """

    roles: ClassVar[Mapping[str, Role]] = {"panels": Role(most=MOST_PANELS), "each": Role()}

    panels: Annotated[
        str | None, Text(), Field(description="Axis of whose values each makes a panel.")
    ] = None
    each: Each = None
    at: At = None
    caption: Caption = None

    @classmethod
    def needs(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        need(offer, faults, "trajectory")


class Histories(Trajectory):
    """The free mass between the walls over time, with a panel for each value of an axis.

    Bursts of chatter and stretches of sticking are shaded.
    """

    roles: ClassVar[Mapping[str, Role]] = {"panels": Role(most=MOST_PANELS), "each": Role()}

    panels: Annotated[str, Text(), Field(description="Axis of whose values each makes a panel.")]

    @classmethod
    def needs(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        super().needs(settings, offer, faults)
        need_listed_bursts(offer, faults)


class PhasePortrait(Figure):
    """Phase portraits of the primary and of the relative motion, and the Poincaré map."""

    roles: ClassVar[Mapping[str, Role]] = {"columns": Role(most=MOST_COLUMNS), "each": Role()}

    columns: Annotated[
        str | None,
        Text(),
        Field(
            description="Axis of whose values each makes a column of panels; "
            f"{MOST_COLUMNS} at most."
        ),
    ] = None
    each: Each = None
    at: At = None
    caption: Caption = None

    @classmethod
    def needs(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        need(offer, faults, "trajectory")
        need_section(offer, faults)


class Accumulation(Figure):
    """Errors of the predicted completion of bursts over the rebound speed, log-log.

    Completion time on the left, completion point on the right; both orders of theory, the first
    impact of each burst apart, and the slopes 2 and 3 that the errors should have.
    """

    roles: ClassVar[Mapping[str, Role]] = {"each": Role(), "rows": Role(most=MOST_ROWS)}
    overlays: ClassVar[bool] = True

    each: Each = None
    rows: Annotated[
        str | None,
        Text(),
        Field(description=f"Axis of whose values each makes a row of panels; {MOST_ROWS} at most."),
    ] = None
    at: At = None
    caption: Caption = None

    @classmethod
    def needs(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        need(offer, faults, "accumulation")


class FreeMass(Figure):
    """The free mass in time, absolute and relative: the whole history beside one burst.

    Onset, duration and sticking of that burst are annotated, chatter and sticking are shaded.
    """

    roles: ClassVar[Mapping[str, Role]] = {"each": Role()}

    each: Each = None
    at: At = None
    near: Annotated[
        float | None,
        Number(ge=0, units=f"{TIME}, {SI_UNITS[TIME]}"),
        Field(
            description="Time since the start of the record: the burst of chatter with the onset "
            "nearest to it is shown at large; the first one of the stretch when not given."
        ),
    ] = None
    stop: Annotated[
        float | None,
        Number(gt=0, units=f"{TIME}, {SI_UNITS[TIME]}"),
        Field(
            description="Where the whole history ends, likewise; with the stretch that the "
            "observer samples when not given."
        ),
    ] = None
    caption: Caption = None

    @classmethod
    def needs(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        need(offer, faults, "trajectory")
        need_listed_bursts(offer, faults)


class Schematic(Product):
    """The mechanical model of a paper, drawn by code; it shows no results and waits for none."""

    of_cube: ClassVar[bool] = False

    drawing: Annotated[
        str,
        Choice("impact_damper", "two_degrees_of_freedom", "collision_system"),
        Field(
            description="Paper A's free mass in a box; its form with two degrees of freedom; "
            "paper B's model."
        ),
    ]
    caption: Annotated[str | None, Text(), Field(description="Heading; none when not given.")] = (
        None
    )

    @classmethod
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        """Nothing to note: a schematic asks nothing of the study."""
