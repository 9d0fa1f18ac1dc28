"""What is made of a cube: figures and tables.

To add a figure or a table, write its class of settings and enter it in its registry.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

from pydantic import Field
from pydantic_core import PydanticCustomError

from damper.quantities import ALL, INITIAL_NAMES, MODEL_NAMES
from damper.study.axes import coordinate_name
from damper.study.branches import DIRECTIONS
from damper.study.calibration.statements import STATEMENTS
from damper.study.fields import (
    STEM,
    STEM_WORDS,
    Choice,
    Coordinate,
    Faults,
    Flag,
    Kind,
    ListOf,
    Number,
    Range,
    Strict,
    Text,
    as_mapping,
    fault,
    nearest,
)
from damper.study.schema import Draft, Schema
from damper.study.settings import SECTIONS
from damper.study.tables import DAMPED, GOOD
from damper.study.yaml_file import as_part, show, words
from damper.variables import SI_UNITS, TIME

#: Observer -> what it writes with one value at each point; `status` is in every cube.
VARIABLES = {
    "impacts": ("impacts_per_period", "mean_approach_speed", "max_approach_speed"),
    "bursts": (
        "chatter",
        "visible_impacts",
        "bursts_per_period",
        "complete_fraction",
        "sticking_fraction",
    ),
    "burst_at": (
        "burst_at_onset",
        "burst_at_duration",
        "burst_at_sticking_time",
        "burst_at_visible_impacts",
        "burst_at_complete",
    ),
    "response": (
        "rms_displacement",
        "peak_displacement",
        "amplitude_ratio",
        "rms_ratio",
        "energy_input",
        "dashpot_loss",
        "impact_loss",
        "energy_residual",
    ),
    "accumulation": ("complete_bursts",),
    "trajectory": ("trajectory_start", "trajectory_events_left_out"),
}

#: What the small-mass limit speaks of, and names of the free travel.
_OF_BURSTS = ("complete_fraction", "chatter")
_FREE_TRAVEL = ("clearance", "gap")
#: Kinds that are theory themselves.
_THEORETICAL = ("slow_manifold", "small_mass_limit", "two_impacts")

SECTION_VARIABLES = ("displacement", "velocity")
"""What every section writes, sample by sample."""

MOST_VARIABLES = 4
"""Panels of curves that fit one above the other."""
MOST_LINES = 12
"""More lines in one panel cannot be told apart."""
MOST_COLUMNS = 3
"""More columns of phase portraits are too narrow for their titles."""
MOST_ROWS = 6
"""More rows of square panels do not fit a page."""
MOST_PANELS = 12
"""More panels do not fit a page."""

#: Dimensions of the cube beside the axes -> what their values may be.
_BRANCHES: dict[str, Kind] = {
    "direction": Choice(*DIRECTIONS["both"]),
    "draw": Number(ge=0, whole=True),
}


@dataclass(frozen=True)
class Offer:
    """What a study has to make figures and tables of."""

    axes: Mapping[str, tuple[float, ...] | None]
    """The values of every axis; an axis in error has none."""
    observers: Collection[str]
    branches: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)
    """The values of the cube's dimensions beside the axes: direction, draw."""

    @property
    def dimensions(self) -> dict[str, tuple[Any, ...] | None]:
        """Axes and branches with their values."""
        return {**self.axes, **self.branches}

    @property
    def variables(self) -> tuple[str, ...]:
        """What the cube has with one value at each point."""
        written = (VARIABLES.get(name, ()) for name in self.observers)
        return (*(variable for some in written for variable in some), "status")


class Product(Strict):
    """A figure or a table: its kind, and what it needs of the study."""

    of_cube: ClassVar[bool] = True
    """Whether it shows results: what does not is made without a simulation."""

    kind: Annotated[str, Text(), Field(description="Which kind of figure or table this is.")]

    @property
    def theoretical(self) -> bool:
        """Whether it shows a theory of the rigid damper."""
        return getattr(self, "theory", None) is not None or self.kind in _THEORETICAL

    @classmethod
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        """Note what `settings`, as written, ask of the study in vain."""
        raise NotImplementedError

    def drawn_with(self, place: Mapping[str, Any]) -> dict[str, Any]:
        """Return the settings with which the file at a place, see `files`, is made."""
        return self.model_dump(exclude_none=True)

    def files(self, stem: str, axes: Mapping[str, tuple[float, ...]]) -> dict[str, dict[str, Any]]:
        """Return the file stems with the coordinates at which each is made."""
        return {stem: {}}

    def measured(self, observers: Mapping[str, dict[str, Any]]) -> dict[str, Any]:
        """Return further settings: what it must know of how the study measures."""
        return {}

    @property
    def beside(self) -> Mapping[str, str]:
        """What other studies measure for it -> the study; see `fit_beside`."""
        return {}

    @classmethod
    def fit_beside(cls, what: str, offer: Offer, faults: Faults) -> None:
        """Note why another study cannot measure what this one asks of it."""


class Place(Kind):
    """Values of some axes and branches."""

    words = "mapping from axes to one of their values each; also direction: up, draw: 0"
    sort = "mapping"

    def check(self, value: Any, context: Any) -> dict[str, Any]:
        faults = Faults()
        kept: dict[str, Any] = {}
        for name, data in as_mapping(value, self.words).items():
            if name not in ALL and name not in _BRANCHES:
                faults.unknown((as_part(name),), "axis", name, (*ALL, *_BRANCHES), data)
                continue
            with faults.of(name):
                kept[name] = self.value(name, data)
        faults.settle()
        return kept

    def schema(self, draft: Draft, name: str | None) -> Schema:
        kinds = {**dict.fromkeys(ALL, Coordinate()), **_BRANCHES}
        values = {key: kind.schema(draft, key) for key, kind in kinds.items()}
        made = {"type": "object", "properties": values, "additionalProperties": False}
        return draft.once("place", made)

    @staticmethod
    def value(name: str, data: Any) -> Any:
        """Return the checked value of one axis or branch."""
        return _BRANCHES.get(name, Coordinate()).check(data, name)


Each = Annotated[
    str | None, Text(), Field(description="Axis of whose values each makes a file of its own.")
]
At = Annotated[
    dict[str, Any] | None,
    Place(),
    Field(
        description="Value of each axis that has no other place in the figure, exactly as the "
        "axis lists it; also direction: up or down, and draw: the number of a draw."
    ),
]
Caption = Annotated[
    str | None,
    Text(),
    Field(description="Heading above the line of parameters; the study's title when not given."),
]


@dataclass(frozen=True)
class Role:
    """A setting that names an axis: how many values it may have, and whether a branch will do."""

    least: int = 1
    most: int | None = None
    branches: bool = False


class Figure(Product):
    """A figure in which every axis with several values has its place."""

    roles: ClassVar[Mapping[str, Role]] = {}
    overlays: ClassVar[bool] = False
    """Whether branches without a place are drawn over each other."""

    @classmethod
    def needs(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        """Note what the figure shows and the study does not measure."""

    @classmethod
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        cls.needs(settings, offer, faults)
        used = cls._take_roles(settings, offer, faults)
        used |= _take_values(settings.get("at"), used, offer, faults)
        # Where a role is missing or wrong, this would make a second error of the first.
        if faults.lines or not cls._says_where(settings):
            return
        for name, values in offer.dimensions.items():
            if name not in used:
                cls._without_place(name, values, settings, faults)

    def files(self, stem: str, axes: Mapping[str, tuple[float, ...]]) -> dict[str, dict[str, Any]]:
        each = getattr(self, "each", None)
        if each is None:
            return {stem: {}}
        return {f"{stem}_{coordinate_name(each, value)}": {each: value} for value in axes[each]}

    def drawn_with(self, place: Mapping[str, Any]) -> dict[str, Any]:
        settings = self.model_dump(exclude={"each"}, exclude_none=True)
        return settings | {"at": settings.get("at", {}) | dict(place)}

    @classmethod
    def _says_where(cls, settings: dict[str, Any]) -> bool:
        """Whether the settings that place axes are all there and well formed."""
        required = {key for key, info in cls.model_fields.items() if info.is_required()}
        roles = [settings[key] for key in cls.roles if settings.get(key) is not None]
        at = Faults()
        with at.of():
            Place().check(settings.get("at") or {}, None)
        return (
            required <= settings.keys() <= cls.model_fields.keys()
            and all(isinstance(name, str) for name in roles)
            and not at.lines
        )

    @classmethod
    def _take_roles(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> dict[str, str]:
        """Return axis -> the role that takes it."""
        used: dict[str, str] = {}
        for key, role in cls.roles.items():
            name = settings.get(key)
            if not isinstance(name, str):
                continue
            names = offer.dimensions if role.branches else offer.axes
            if name not in names:
                faults.unknown((key,), "axis", name, names)
            if name in used:
                faults.add((key,), f"'{name}' is {used[name]} already", "an axis without a place")
            used[name] = key
            _count((key,), name, names.get(name), role, faults)
        return used

    @classmethod
    def _without_place(
        cls, name: str, values: tuple[Any, ...] | None, settings: dict[str, Any], faults: Faults
    ) -> None:
        branch = name not in ALL
        free = [
            key
            for key, role in cls.roles.items()
            if settings.get(key) is None and (role.branches or not branch)
        ]
        ways = f"name it as {' or '.join(free)}, or give its value" if free else "give its value"
        if not branch and values is not None and len(values) > 1:
            message = f"axis '{name}' has {len(values)} values but no place in the figure"
            faults.add((), message, f"{ways} in at")
        if branch and not cls.overlays and (values is None or len(values) > 1):
            example = "{direction: up}" if name == "direction" else "{draw: 0}"
            message = f"the study has several runs at each point ({name}), the figure shows one"
            faults.add((), message, f"{ways}: at: {example}")


def _take_values(at: Any, used: Mapping[str, str], offer: Offer, faults: Faults) -> dict[str, str]:
    """Check `at` against the study; return axis -> "at"."""
    taken = {}
    for name, data in at.items() if isinstance(at, dict) else ():
        loc = ("at", as_part(name))
        if name in used:
            faults.add(loc, f"'{name}' is {used[name]} already", "an axis without a place")
        elif name in offer.dimensions:
            taken[name] = "at"
            _listed(loc, name, data, offer.dimensions[name], faults)
        elif name in ALL or name in _BRANCHES:  # what is neither is told by `Place`
            faults.unknown(loc, "axis", name, offer.dimensions)
    return taken


def _listed(
    loc: tuple[str, ...], name: str, data: Any, values: tuple[Any, ...] | None, faults: Faults
) -> None:
    """Note a value that an axis does not have."""
    try:
        value = Place.value(name, data)
    except PydanticCustomError:
        return  # told by `Place`
    if values is None or value in values:
        return
    if isinstance(value, str):
        allowed = words(values)
    else:
        close = min(values, key=lambda listed: abs(listed - value))
        allowed = f"one of its {len(values)} values; the nearest is {show(close)}"
    faults.add(loc, f"'{name}' has no value {show(value)}", allowed)


def _count(
    loc: tuple[str, ...],
    name: str,
    values: tuple[Any, ...] | None,
    role: Role,
    faults: Faults,
) -> None:
    """Note an axis with too few or too many values for its role."""
    if values is None:
        return
    if len(values) < role.least:
        message = f"axis '{name}' has too few values ({len(values)})"
        faults.add(loc, message, f"an axis with at least {role.least} values")
    if role.most is not None and len(values) > role.most:
        message = f"axis '{name}' has too many values ({len(values)})"
        faults.add(loc, message, f"an axis with at most {role.most} values, or one value in at")


def _written(loc: tuple[str | int, ...], name: Any, offer: Offer, faults: Faults) -> None:
    """Note a variable that the cube does not have with one value at each point."""
    if not isinstance(name, str) or name in offer.variables:
        return
    known = words(offer.variables)
    for observer, variables in VARIABLES.items():
        if name in variables:
            message = f"'{name}' is written by the observer {observer}, which the study lacks"
            faults.add(loc, message, known)
            return
    message = f"no observer of the study writes {show(name)} as one value at each point"
    faults.add(loc, message, known, nearest(name, offer.variables))


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
        if not any(section in offer.observers for section in SECTIONS):
            faults.add((), "needs a section among the observers", " or ".join(SECTIONS))
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
        _written(("variable",), settings.get("variable"), offer, faults)
        if settings.get("theory") == "small_mass_limit":
            cls._fits_limit(settings, faults)

    @classmethod
    def _fits_limit(cls, settings: dict[str, Any], faults: Faults) -> None:
        variable, axes = settings.get("variable"), [settings.get("x"), settings.get("y")]
        if isinstance(variable, str) and variable not in _OF_BURSTS:
            message = f"the small-mass limit does not speak of '{variable}'"
            faults.add(("theory",), message, f"a map of {words(_OF_BURSTS)}")
        if all(isinstance(name, str) for name in axes) and not (
            "restitution" in axes and any(name in axes for name in _FREE_TRAVEL)
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
            _written(("variables", i), name, offer, faults)

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
        if "trajectory" not in offer.observers:
            faults.add((), "needs trajectory among the observers", "trajectory")

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
        if "trajectory" not in offer.observers:
            faults.add((), "needs trajectory among the observers", "trajectory")


class Histories(Trajectory):
    """The free mass between the walls over time, with a panel for each value of an axis.

    Bursts of chatter and stretches of sticking are shaded.
    """

    roles: ClassVar[Mapping[str, Role]] = {"panels": Role(most=MOST_PANELS), "each": Role()}

    panels: Annotated[str, Text(), Field(description="Axis of whose values each makes a panel.")]

    @classmethod
    def needs(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        super().needs(settings, offer, faults)
        if "bursts" not in offer.observers:
            faults.add((), "needs bursts among the observers", "bursts: {records: 50}")


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
        if "trajectory" not in offer.observers:
            faults.add((), "needs trajectory among the observers", "trajectory")
        if not any(section in offer.observers for section in SECTIONS):
            faults.add((), "needs a section among the observers", " or ".join(SECTIONS))


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
        if "accumulation" not in offer.observers:
            faults.add((), "needs accumulation among the observers", "accumulation")


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
        for name in ("trajectory", "bursts"):
            if name not in offer.observers:
                faults.add((), f"needs {name} among the observers", name)


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
        if "bursts" not in offer.observers:
            faults.add((), "needs bursts among the observers", "bursts")
        if offer.branches:
            message = (
                "edges are bisected by runs from one initial state, but this study has "
                f"several at each point ({', '.join(offer.branches)})"
            )
            faults.add((), message, "a study without follow and without draws")
        name = settings.get("along")
        if not isinstance(name, str):
            return
        if name not in offer.axes:
            faults.unknown(("along",), "axis", name, offer.axes)
        _count(("along",), name, offer.axes.get(name), Role(least=3), faults)


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
        if "accumulation" not in offer.observers:
            faults.add((), "needs accumulation among the observers", "accumulation")


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
        for name in ("response", "impacts", "bursts"):
            if name not in offer.observers:
                faults.add((), f"needs {name} among the observers", name)
        if offer.branches:
            message = f"this study has several runs at each point ({', '.join(offer.branches)})"
            faults.add((), message, "a study without follow and without draws")
        for role in ("along", "over"):
            name = settings.get(role)
            if not isinstance(name, str):
                continue
            if name not in offer.axes:
                faults.unknown((role,), "axis", name, offer.axes)
            elif role == "over" and name == settings.get("along"):
                faults.add((role,), f"'{name}' is along already", "two distinct axes")
            _count((role,), name, offer.axes.get(name), Role(least=2), faults)


#: What may be compared with the rigid damper beside what has one value at each point -> observers.
_RECORDED = {
    "displacement": SECTIONS,
    "velocity": SECTIONS,
    "burst_onset": ("bursts",),
    "burst_duration": ("bursts",),
    "burst_accumulation_time": ("bursts",),
    "burst_sticking_time": ("bursts",),
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
            _written(("variables", i), name, offer, faults)
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
            name = settings.get(role)
            if not isinstance(name, str):
                continue
            if name not in offer.axes:
                faults.unknown((role,), "axis", name, offer.axes)
            _count((role,), name, offer.axes.get(name), Role(least, most), faults)


class OtherStudies(Kind):
    """Statements that other studies test -> these studies."""

    words = "mapping from statements to the names of other studies"
    sort = "mapping"
    limits = "a statement each time"

    def check(self, value: Any, context: Any) -> dict[str, str]:
        faults = Faults()
        kept: dict[str, str] = {}
        for name, data in as_mapping(value, self.words).items():
            if name not in STATEMENTS:
                faults.unknown((as_part(name),), "statement", name, STATEMENTS, data)
                continue
            with faults.of(name):
                kept[name] = Text().check(data, None)
        faults.settle()
        return kept

    def schema(self, draft: Draft, name: str | None) -> Schema:
        values = dict.fromkeys(STATEMENTS, Text().schema(draft, None))
        return {"type": "object", "properties": values, "additionalProperties": False}


class Scores(Product):
    """What a table or figure of a calibration scores, and how strictly."""

    statements: Annotated[
        tuple[str, ...],
        ListOf(Choice(*STATEMENTS), least=1),
        Field(description="Statements of the papers that this study tests; they are joined."),
    ]
    also: Annotated[
        dict[str, str] | None,
        OtherStudies(),
        Field(
            description="More statements to join -> the studies that test them; these are to be "
            "among the studies of the configuration. Parameters that only the other study varies "
            "take their best values."
        ),
    ] = None
    onset_tolerance: Annotated[
        float,
        Number(gt=0, units=TIME),
        Field(description="Deviation of an onset that halves the score."),
    ] = 1.0
    duration_tolerance: Annotated[
        float,
        Number(gt=0, units=TIME),
        Field(description="Deviation of a duration that halves the score."),
    ] = 1.0
    ratio_tolerance: Annotated[
        float,
        Number(gt=0),
        Field(description="Deviation from 1 of a ratio of durations that halves the score."),
    ] = 0.1
    preset: Annotated[
        dict[str, Any] | None,
        Place(),
        Field(
            description="Values of some axes whose place in the ranking is told, exactly as the "
            "axes list them."
        ),
    ] = None

    @property
    def beside(self) -> Mapping[str, str]:
        """Statement -> the study that tests it."""
        return self.also or {}

    @classmethod
    def relate(cls, data: dict[str, Any], model: Scores | None, faults: Faults) -> None:
        for name in model.beside if model is not None else ():
            if name in model.statements:
                message = f"'{name}' is among the statements that this study tests"
                faults.add(("also", name), message, "each statement once")

    @classmethod
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        if offer.branches:
            message = f"this study has several runs at each point ({', '.join(offer.branches)})"
            faults.add((), message, "a study without follow and without draws")
        names = settings.get("statements")
        named = [n for n in names if n in STATEMENTS] if isinstance(names, list | tuple) else []
        for name in named:
            cls.fit_beside(name, offer, faults)
        about = {axis for name in named for axis in STATEMENTS[name].axes}
        if named and not faults.lines and not set(offer.axes) - about:
            message = "no axis is left whose values could be ranked"
            faults.add((), message, "an axis that no statement is about")
        preset = settings.get("preset")
        for axis, value in preset.items() if isinstance(preset, dict) else ():
            if axis in offer.axes:
                _listed(("preset", as_part(axis)), axis, value, offer.axes[axis], faults)
            elif axis in ALL:
                faults.unknown(("preset", axis), "axis", axis, offer.axes)

    @classmethod
    def fit_beside(cls, what: str, offer: Offer, faults: Faults) -> None:
        """Note what a study lacks to test the statement `what`."""
        statement = STATEMENTS[what]
        for observer in statement.observers:
            if observer not in offer.observers:
                message = f"{what} needs {observer} among the observers"
                faults.add((), message, observer)
        for axis, needed in statement.needs.items():
            values = offer.axes.get(axis, ())
            if values is not None and not needed.met(values):
                faults.add((), f"{what} needs an axis {axis} with {needed.words}")


class Ranking(Scores):
    """The sets of parameters in the order of their scores, and what the statements pin down."""

    rows: Annotated[
        int,
        Number(ge=1, le=100_000, whole=True),
        Field(description="How many of the best sets the CSV lists."),
    ] = 200


class Profiles(Scores):
    """The best score that each value of a parameter allows, for each statement and for all.

    Axes with two values, such as the phase, make a row of panels each.
    """

    caption: Caption = None


class SmallMassLimit(Product):
    """The border between complete and incomplete bursts beside its small-mass limit."""

    resolution: Annotated[
        float, Number(gt=0), Field(description="Restitution to which borders are bisected.")
    ] = 1e-4

    @classmethod
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        if "bursts" not in offer.observers:
            faults.add((), "needs bursts among the observers", "bursts")
        if offer.branches:
            message = (
                "borders are bisected by runs from one initial state, but this study has "
                f"several at each point ({', '.join(offer.branches)})"
            )
            faults.add((), message, "a study without follow and without draws")
        for names in (("restitution",), _FREE_TRAVEL):
            found = next((name for name in names if name in offer.axes), None)
            if found is None:
                faults.add((), f"needs an axis of the {' or '.join(names)}", words(names))
            else:
                _count((), found, offer.axes[found], Role(least=2), faults)


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
        if not any(section in offer.observers for section in SECTIONS):
            faults.add((), "needs a section among the observers", " or ".join(SECTIONS))
        if "impacts" not in offer.observers:
            faults.add((), "needs impacts among the observers", "impacts")
        name = settings.get("along")
        if not isinstance(name, str):
            return
        if name not in offer.axes:
            faults.unknown(("along",), "axis", name, offer.axes)
        elif name in INITIAL_NAMES:
            message = f"'{name}' sets where a run starts, which the closed form does not depend on"
            faults.add(("along",), message, "an axis of a parameter")
        _count(("along",), name, offer.axes.get(name), Role(least=2), faults)


FIGURES: dict[str, type[Product]] = {
    "bifurcation": Bifurcation,
    "map": Map,
    "curves": Curves,
    "trajectory": Trajectory,
    "profiles": Profiles,
    "accumulation": Accumulation,
    "histories": Histories,
    "phase_portrait": PhasePortrait,
    "free_mass": FreeMass,
    "schematic": Schematic,
    "slow_manifold": SlowManifold,
    "convergence": Convergence,
}
TABLES: dict[str, type[Product]] = {
    "intervals": Intervals,
    "performance": Performance,
    "ranking": Ranking,
    "accumulation": Agreement,
    "small_mass_limit": SmallMassLimit,
    "two_impacts": TwoImpacts,
    "convergence": ConvergenceTable,
}


def product(registry: Mapping[str, type[Product]]) -> Callable[[str, Any], Product]:
    """Return what checks the settings of a figure or a table."""

    def entry(stem: str, data: Any) -> Product:
        faults = Faults()
        if not STEM.fullmatch(stem):
            faults.add((), f"{show(stem)} cannot be the name of a file", STEM_WORDS)
        with faults.of():
            made = _kind_of(data, registry).entry(stem, data)
        faults.settle()
        return made

    return entry


def _kind_of(data: Any, registry: Mapping[str, type[Product]]) -> type[Product]:
    data, faults = as_mapping(data, "kind and its settings"), Faults()
    with faults.of("kind"):
        if "kind" not in data:
            raise fault("'kind' is missing", words(registry))
        kind = Choice(*registry).check(data["kind"], None)
    faults.settle()
    return registry[kind]
