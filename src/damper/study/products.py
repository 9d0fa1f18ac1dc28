"""The base class of figures and tables, and the parts of a study that they may use."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, ClassVar

from pydantic import Field

from damper.observers import OBSERVERS, make_observers, writable
from damper.observers.common.stretch import sample_steps
from damper.parameters.dampers import BASIC
from damper.parameters.forcing import HARMONIC, Forcing
from damper.parameters.names import nearest
from damper.parameters.quantities import ALL, INITIAL_NAMES
from damper.parameters.variables import WORST
from damper.study.axes import coordinate_name
from damper.study.fields import Coordinate, DistinctList, NamedMapping, Text, one_of
from damper.study.messages import Mistakes
from damper.study.settings import FollowedOrbit, given_settings
from damper.study.study_file import ProductBase, See
from damper.study.yaml_file import display, join_names
from damper.sweep.branches import DIRECTIONS

#: Variables of single bursts that are compared with the rigid damper.
BURST_RECORDS = ("burst_onset", "burst_duration", "burst_accumulation_time", "burst_sticking_time")
#: Names of the free travel.
FREE_TRAVEL = ("clearance", "gap")

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
_BRANCHES: dict[str, Any] = {
    "direction": Annotated[str, one_of(DIRECTIONS["both"])],
    "draw": Annotated[int, Field(ge=0)],
    "body": Annotated[int, Field(ge=0)],
}
Place = Annotated[
    dict[str, float | str],
    NamedMapping(
        "axis",
        {**dict.fromkeys(ALL, Coordinate), **_BRANCHES},
        to="one of its values; also direction: up, draw: 0, body: 0",
        masses=True,
    ),
]
"""Values of some axes and branches."""


@dataclass(frozen=True)
class StudyContents:
    """Parts of a study that figures and tables can use."""

    axes: Mapping[str, tuple[float, ...]]
    """The values of every axis."""
    branches: Mapping[str, tuple[Any, ...]]
    """The values of the cube's dimensions beside the axes: direction, draw."""
    observers: Mapping[str, Any]
    """Observers with their settings."""
    orbits: Mapping[str, FollowedOrbit]
    """The periodic motions that are followed."""
    periods: float
    """Length of the shortest window, in cycles."""
    starts: tuple[str, ...] = ()
    """Initial quantities that are drawn."""
    force: Forcing = HARMONIC
    """What drives the dampers; of several, one."""
    si: bool = False
    """Whether it is in SI units."""
    bodies: tuple[int, ...] = ()
    """Of several free masses those that observers see one by one."""

    @property
    def dimensions(self) -> dict[str, tuple[Any, ...]]:
        """Axes and branches with their values."""
        return {**self.axes, **self.branches}

    def asks(self, observer: str, key: str) -> bool:
        """Whether the study has an observer with a setting that is neither zero nor false."""
        return bool(getattr(self.observers.get(observer), key, False))

    @cached_property
    def made(self) -> dict[str, Any]:
        """Each observer with its settings."""
        given = ({name: given_settings(entry)} for name, entry in self.observers.items())
        return {one.name: one for each in given for one in make_observers(each)}

    @property
    def variables(self) -> tuple[str, ...]:
        """Variables of the cube with a value at each point, or at each free mass of a point."""
        written = (variable for made in self.made.values() for variable in made.variables)
        single = (v.name for v in written if v.dims in ((), ("body",)))
        return (*single, "status")

    @property
    def of_bodies(self) -> set[str]:
        """Variables of several free masses, one by one, and their observers."""
        found = {
            (observer, variable.name)
            for observer, made in self.made.items()
            for variable in made.variables
            if "body" in variable.dims
        }
        return {name for pair in found for name in pair if len(self.bodies) > 1}

    @property
    def stretch(self) -> float | None:
        """Cycles of the motion that are sampled; None if none lie in the window."""
        sampled = self.observers.get("trajectory")
        if sampled is None:
            return None
        start, length = sampled.start, sampled.length
        try:
            sample_steps(sampled.samples_per_period, start, length, self.periods)
        except ValueError:
            return None
        return float(self.periods - start if length is None else length)


@dataclass(frozen=True)
class Role:
    """A setting that names an axis: how many values it may have, and whether a branch will do.

    One that names `several` is a list.
    """

    least: int = 1
    most: int | None = None
    branches: bool = False
    several: bool = False
    bodies: bool = False
    """Whether it may be `body`."""


#: Settings that reduce the runs at each point to a number.
REDUCTIONS = {
    **{name: Role(branches=True, several=True) for name in ("worst", "band", "share")},
    "choose": Role(least=2, several=True),
}


class Product(ProductBase):
    """A figure or a table: its kind, and what it needs of the study."""

    of_theory: ClassVar[bool] = False
    """Whether it shows a theory of the rigid damper, whatever its settings are."""
    knows: ClassVar[tuple[str, ...]] = BASIC
    """Quantities that its theory knows."""
    needs: ClassVar[tuple[str | tuple[str, ...], ...]] = ()
    """Observers that it reads, whatever its settings are; of several in one place any will do."""
    roles: ClassVar[Mapping[str, Role]] = {}
    """Settings that name axes."""
    marks_chatter: ClassVar[bool] = False
    """Whether it marks bursts of chatter where the study has them."""
    runs_more: ClassVar[bool] = False
    """Whether it runs more points than there are in the cube."""

    @property
    def theoretical(self) -> bool:
        """Whether it shows a theory of the rigid damper."""
        return self.of_theory or getattr(self, "theory", None) is not None

    def check_against(self, study: StudyContents, mistakes: Mistakes) -> None:
        """Note what it asks for and the study lacks; here, observers and axes."""
        need(study, mistakes, *self.needs)
        self.take_roles(study, mistakes)

    def shows_chatter(self, study: StudyContents) -> bool:
        """Whether it shows bursts that an observer counts."""
        counting = {"bursts", "burst_at", "chatter_bursts"} & {*study.observers}
        written = {variable.name for name in counting for variable in study.made[name].variables}
        named = {getattr(self, "variable", None), *(getattr(self, "variables", None) or ())}
        named.update(*((one,) if isinstance(one, str) else one for one in self.needs))
        return bool(counting) and (self.marks_chatter or bool(named & (counting | written)))

    def take_roles(self, study: StudyContents, mistakes: Mistakes) -> dict[str, str]:
        """Note what is wrong with the axes that settings name; return axis -> the setting."""
        used: dict[str, str] = {}
        for key, role in self.roles.items():
            given = getattr(self, key) or ()
            known = {**(study.dimensions if role.branches else study.axes)}
            known |= {"body": study.bodies} if role.bodies and study.bodies else {}
            for name in given if role.several else (given,) if given else ():
                if name not in known:
                    mistakes.unknown((key,), "axis", name, known)
                elif name in used:
                    message = f"'{name}' is {used[name]} already"
                    mistakes.add((key,), message, "an axis without a place")
                else:
                    count_values((key,), name, known[name], role, mistakes)
                used[name] = key
        return used


class OfNoise(Product):
    """A figure or table of means under noise beside their closed forms."""

    of_theory: ClassVar[bool] = True
    knows: ClassVar[tuple[str, ...]] = (*BASIC, "force_amplitude", "forcing")
    needs = ("statistics",)

    def check_against(self, study: StudyContents, mistakes: Mistakes) -> None:
        super().check_against(study, mistakes)
        if getattr(study.force, "of", "") != "force" or study.force.kind != "noise":
            message = "shows the laws of noise, a force on the primary, and this study has none"
            mistakes.add((), message, "forcing: {kind: noise, ...}")


Each = Annotated[
    Text | None, Field(description="Axis of whose values each makes a file of its own.")
]
At = Annotated[
    Place | None,
    Field(
        description="Value of each axis that has no other place in the figure, as the axis lists "
        "it, or with its unit, such as 20 mm; also direction: up or down, draw: the number of a "
        "draw, and body: that of a free mass."
    ),
]
_LEAST = [name for name, which in WORST.items() if which == "least"]
Worst = Annotated[
    DistinctList[Text] | None,
    Field(
        description="Axes, or direction or draw, of whose runs the worst counts: at each point the "
        f"greatest value, the least of {join_names(_LEAST)}. Of {join_names(WORST)}."
    ),
]
Band = Annotated[
    DistinctList[Text] | None,
    Field(
        description="The same, and a band shows the runs' values from the worst to the best, of "
        "three runs or more with their median; after worst."
    ),
]
Share = Annotated[
    DistinctList[Text] | None,
    Field(
        description="Axes, or direction or draw, of whose runs the part is shown in which the "
        "variable is above a limit; with above. Where worst is given as well, it comes first."
    ),
]
Above = Annotated[
    float | None,
    Field(
        description="That limit, in the variable's units: 1 for a ratio to the response without "
        "damper, 0 for chatter of any kind, 1 for complete chatter; with share."
    ),
]
Choose = Annotated[
    DistinctList[Text] | None,
    Field(
        description="Axes that are free to be chosen: at each point they have the values at which "
        "the (first) variable, reduced by worst or share, is least, or greatest where more is "
        "better; points at which a run stopped are left out."
    ),
]
Caption = Annotated[
    Text | None,
    Field(description="Heading above the line of parameters; the study's title when not given."),
]
Interactive = Annotated[
    bool,
    Field(
        description="Whether the page of results has it interactively as well: values at the "
        "pointer, other axes by choice, and the motion at any point of a damper with rigid walls."
    ),
]


class FigureSettings(Product):
    """A figure in which every axis with several values has its place."""

    overlays: ClassVar[bool] = False
    """Whether branches without a place are drawn over each other."""
    draws_bodies: ClassVar[bool] = False
    """Whether it draws all free masses."""

    see: See = None

    def check_against(self, study: StudyContents, mistakes: Mistakes) -> None:
        need(study, mistakes, *self.needs)
        used = self.take_roles(study, mistakes)
        used |= self._take_values(used, study, mistakes)
        # Where a role is wrong, this would make a second mistake of the first.
        if mistakes:
            return
        for name, values in study.dimensions.items():
            if name not in used and len(values) > 1:
                self._without_place(name, len(values), mistakes)
        if "body" not in used and not self.draws_bodies:
            self._require_body(study, mistakes)

    def _require_body(self, study: StudyContents, mistakes: Mistakes) -> None:
        """Note a mistake: it shows a single free mass, and the study has several."""
        shown = {getattr(self, "variable", None), *(getattr(self, "variables", None) or ())}
        shown |= {name for name in self.needs if isinstance(name, str)}
        # The relative motion of a section is that of a free mass.
        shown = {name and name.replace("relative_", "free_") for name in shown}
        for name in sorted(filter(None, shown & study.of_bodies)):
            ways = [f"{key}: body, or " for key, role in self.roles.items() if role.bodies]
            allowed = f"{''.join(ways)}at: {{body: {study.bodies[0]}}}"
            mistakes.add((), f"shows one free mass, and {name} has {len(study.bodies)}", allowed)
            return

    def files(self, stem: str, study: Any) -> dict[str, dict[str, Any]]:
        left_out = {"each", "see", "interactive"}
        settings = {"at": {}} | self.model_dump(exclude=left_out, exclude_none=True)
        each = getattr(self, "each", None)
        if each is None:
            return {stem: settings}
        at = settings.pop("at")
        return {
            f"{stem}_{coordinate_name(each, value)}": settings | {"at": at | {each: value}}
            for value in study.axis_values[each]
        }

    def _take_values(
        self, used: Mapping[str, str], study: StudyContents, mistakes: Mistakes
    ) -> dict[str, str]:
        """Check the values in `at`; return axis -> "at"."""
        given = getattr(self, "at", None) or {}
        for name, value in given.items():
            if name in used:
                message = f"'{name}' is {used[name]} already"
                mistakes.add(("at", name), message, "an axis without a place")
            else:
                known = study.dimensions | ({"body": study.bodies} if study.bodies else {})
                check_listed(("at", name), name, value, known, mistakes)
        return dict.fromkeys(given, "at")

    def _without_place(self, name: str, count: int, mistakes: Mistakes) -> None:
        """Note an axis or a branch of several values that has no place."""
        branch = name not in ALL
        free = [
            key
            for key, role in self.roles.items()
            if (role.several or getattr(self, key) is None)
            and (role.branches if branch else not role.several)
        ]
        ways = f"name it as {' or '.join(free)}, or give its value" if free else "give its value"
        if not branch:
            message = f"axis '{name}' has {count} values but no place in the figure"
            mistakes.add((), message, f"{ways} in at")
        elif not self.overlays:
            example = "{direction: up}" if name == "direction" else "{draw: 0}"
            message = f"the study has several runs at each point ({name}), the figure shows one"
            mistakes.add((), message, f"{ways}: at: {example}")


def check_reduction(variables: Sequence[str], settings: Any, mistakes: Mistakes) -> None:
    """Note variables that have no worst or best, and a share without its limit."""
    of = {"worst": variables, "band": variables, "choose": variables[:1]}
    for key, names in of.items():
        for name in names if getattr(settings, key, None) else ():
            if name not in WORST:
                message = f"no value of '{name}' is worse than another"
                mistakes.add((key,), message, join_names(WORST), nearest(name, WORST))
    if (settings.share is None) != (settings.above is None):
        given, missing = ("share", "above") if settings.share else ("above", "share")
        allowed = "a number" if missing == "above" else "[draw]"
        mistakes.add((missing,), f"'{given}' is given, but '{missing}' is missing", allowed)


def check_listed(
    loc: tuple[str, ...],
    name: str,
    value: Any,
    dimensions: Mapping[str, tuple[Any, ...]],
    mistakes: Mistakes,
) -> None:
    """Note an axis that is not there, or a value that it does not have."""
    values = dimensions.get(name)
    if values is None:
        mistakes.unknown(loc, "axis", name, dimensions)
    elif value not in values:
        allowed = join_names(map(str, values))
        if not any(isinstance(each, str) for each in (value, *values)):
            close = min(values, key=lambda listed: abs(listed - value))
            allowed = f"one of its {len(values)} values; the nearest is {display(close)}"
        mistakes.add(loc, f"'{name}' has no value {display(value)}", allowed)


def count_values(
    loc: tuple[str, ...], name: str, values: tuple[Any, ...], role: Role, mistakes: Mistakes
) -> None:
    """Note an axis with too few or too many values for its role."""
    if len(values) < role.least:
        message = f"axis '{name}' has too few values ({len(values)})"
        mistakes.add(loc, message, f"an axis with at least {role.least} values")
    if role.most is not None and len(values) > role.most:
        message = f"axis '{name}' has too many values ({len(values)})"
        mistakes.add(loc, message, f"an axis with at most {role.most} values, or one value in at")


def check_written(
    loc: tuple[str | int, ...], name: str, study: StudyContents, mistakes: Mistakes
) -> None:
    """Note a variable that the cube does not have with one value at each point."""
    if name in study.variables:
        return
    known = join_names(study.variables)
    for observer in OBSERVERS:
        for variable, setting in writable(observer):
            if name == variable.name and not variable.dims:
                there = observer in study.observers
                lacks = f"where {setting} is set" if there else "which the study lacks"
                mistakes.add(loc, f"'{name}' is written by the observer {observer}, {lacks}", known)
                return
    message = f"no observer of the study writes {display(name)} as one value at each point"
    mistakes.add(loc, message, known, nearest(name, study.variables))


def require_orbits(loc: tuple[str, ...], study: StudyContents, mistakes: Mistakes) -> None:
    """Note that the study follows no periodic motion."""
    if not study.orbits:
        message = "shows periodic motions, but the study follows none"
        mistakes.add(loc, message, "orbits: {a name: {along: an axis, start: a value of it}}")


def need(study: StudyContents, mistakes: Mistakes, *observers: str | tuple[str, ...]) -> None:
    """Note which of these observers the study lacks; of several in one place any will do."""
    for wanted in observers:
        names = (wanted,) if isinstance(wanted, str) else wanted
        if not any(name in study.observers for name in names):
            either = " or ".join(names)
            mistakes.add((), f"needs {either} among the observers", either)


def require_laws(study: StudyContents, mistakes: Mistakes) -> None:
    """Note that the study does not measure the laws, or not of a dimensionless damper."""
    need(study, mistakes, "laws")
    if study.si:
        message = "sorts runs by dimensionless parameters, and the study is in SI units"
        mistakes.add((), message, "a dimensionless study")


def require_listed_bursts(study: StudyContents, mistakes: Mistakes) -> None:
    """Note that the study does not list bursts one by one."""
    if "bursts" not in study.observers:
        mistakes.add((), "needs bursts among the observers", "bursts: {records: 50}")
    elif not study.asks("bursts", "records"):
        message = "shows bursts one by one, but the observer bursts lists none"
        mistakes.add((), message, "records >= 1 for bursts, such as records: 50")


def require_starts(study: StudyContents, mistakes: Mistakes, along: str | None) -> None:
    """Note that the study has one start at each point of an axis, or several motions of a start."""
    if "motion" in study.of_bodies:
        message = f"counts motions of one free mass, and motion has {len(study.bodies)}"
        mistakes.add((), message, f"observers: {{motion: {{bodies: [{study.bodies[0]}]}}}}")
    elif not study.starts and not {*INITIAL_NAMES} & {*study.dimensions} - {along}:
        mistakes.add((), "needs several starts", "draws, or axes, of initial quantities")


def require_one_run(study: StudyContents, mistakes: Mistakes, bisected: str | None = None) -> None:
    """Note that the study has several runs at each point, and what is bisected by single ones."""
    if not study.branches:
        return
    several = f"at each point ({', '.join(study.branches)})"
    message = f"this study has several runs {several}"
    if bisected is not None:
        start = f"{bisected} are bisected by runs from one initial state"
        message = f"{start}, but this study has several {several}"
    mistakes.add((), message, "a study without follow and without draws")
