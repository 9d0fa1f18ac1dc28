"""What every figure and table has in common, and what it may ask of a study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

from pydantic import Field, TypeAdapter, ValidationError

from damper.observers import OBSERVERS, make_observers, writable
from damper.parameters.quantities import ALL, INITIAL_NAMES, nearest
from damper.parameters.variables import GREATER_IS_WORSE
from damper.study.axes import coordinate_name
from damper.study.fields import Coordinate, Entries, Some, Text, as_numbers, one_of
from damper.study.messages import Faults
from damper.study.settings import OBSERVER_SETTINGS, SECTIONS, given_settings
from damper.study.study_file import Made, See
from damper.study.yaml_file import as_part, show, words
from damper.sweep.branches import DIRECTIONS

#: What the observer `bursts` writes of single bursts that is compared with the rigid damper.
BURST_RECORDS = (
    "burst_onset",
    "burst_duration",
    "burst_accumulation_time",
    "burst_sticking_time",
)
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
}
Place = Annotated[
    dict[str, float | str],
    Entries(
        "axis",
        {**dict.fromkeys(ALL, Coordinate), **_BRANCHES},
        to="one of its values; also direction: up, draw: 0",
    ),
]
"""Values of some axes and branches."""
_PLACE: TypeAdapter[dict[str, Any]] = TypeAdapter(Place)


@dataclass(frozen=True)
class Offer:
    """What a study has to make figures and tables of."""

    axes: Mapping[str, tuple[float, ...] | None]
    """The values of every axis; an axis in error has none."""
    observers: Mapping[str, Any]
    """Observers with their settings, as written."""
    branches: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)
    """The values of the cube's dimensions beside the axes: direction, draw."""

    orbits: Mapping[str, Any] = field(default_factory=dict)
    """The periodic motions that are followed, as written."""

    @property
    def dimensions(self) -> dict[str, tuple[Any, ...] | None]:
        """Axes and branches with their values."""
        return {**self.axes, **self.branches}

    def set(self, observer: str, key: str) -> bool:
        """Whether the study has an observer with a setting that is neither zero nor false."""
        settings = self.observers.get(observer)
        return isinstance(settings, Mapping) and bool(settings.get(key))

    @property
    def variables(self) -> tuple[str, ...]:
        """What the cube has with one value at each point."""
        known = (name for name in self.observers if name in OBSERVERS)
        written = (name for observer in known for name in self._written(observer))
        return (*written, "status")

    def _written(self, observer: str) -> list[str]:
        """Return what an observer writes with one value at each point."""
        given = self.observers[observer]
        try:
            settings = OBSERVER_SETTINGS[observer].model_validate({} if given is None else given)
        except ValidationError:
            # Reported where it stands, so that it makes no second error here.
            found = [variable for variable, _ in writable(observer)]
        else:
            (made,) = make_observers({observer: given_settings(settings)})
            found = made.variables
        return [variable.name for variable in found if not variable.dims]


class Product(Made):
    """A figure or a table: its kind, and what it needs of the study."""

    of_theory: ClassVar[bool] = False
    """Whether it shows a theory of the rigid damper, whatever its settings are."""
    of_single_bursts: ClassVar[bool] = False
    """Whether it shows bursts one by one, whatever its settings are."""

    @property
    def theoretical(self) -> bool:
        """Whether it shows a theory of the rigid damper."""
        return self.of_theory or getattr(self, "theory", None) is not None

    @property
    def single_bursts(self) -> bool:
        """Whether it shows bursts one by one, so that the observer `bursts` has to list them."""
        compared = getattr(self, "variables", ())
        return self.of_single_bursts or any(name in BURST_RECORDS for name in compared)

    @classmethod
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        """Note what `settings`, as written, ask for and the study lacks."""
        raise NotImplementedError

    def fit_stretch(self, length: float, faults: Faults) -> None:
        """Note what it asks for and a sampled stretch of so many forcing periods lacks."""

    @property
    def beside(self) -> Mapping[str, str]:
        """What other studies measure for it -> the study; see `fit_beside`."""
        return {}

    @classmethod
    def fit_beside(cls, what: str, offer: Offer, faults: Faults) -> None:
        """Note why another study cannot measure what this one asks of it."""


Each = Annotated[
    Text | None, Field(description="Axis of whose values each makes a file of its own.")
]
At = Annotated[
    Place | None,
    Field(
        description="Value of each axis that has no other place in the figure, exactly as the "
        "axis lists it; also direction: up or down, and draw: the number of a draw."
    ),
]
Worst = Annotated[
    Some[Text] | None,
    Field(
        description="Axes, or direction or draw, of whose runs the worst counts: at each point the "
        f"greatest value, of {words(GREATER_IS_WORSE)}."
    ),
]
Share = Annotated[
    Some[Text] | None,
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
Caption = Annotated[
    Text | None,
    Field(description="Heading above the line of parameters; the study's title when not given."),
]
Interactive = Annotated[
    bool,
    Field(
        description="Whether the page of results has it interactively as well: values at the "
        "pointer, other axes by choice, and the motion at some hundred points. Of rigid walls."
    ),
]


@dataclass(frozen=True)
class Role:
    """A setting that names an axis: how many values it may have, and whether a branch will do.

    One that names `several` is a list.
    """

    least: int = 1
    most: int | None = None
    branches: bool = False
    several: bool = False


#: What reduces the runs at each point to one number.
REDUCTIONS = {name: Role(branches=True, several=True) for name in ("worst", "share")}


class FigureSettings(Product):
    """A figure in which every axis with several values has its place."""

    roles: ClassVar[Mapping[str, Role]] = {}
    overlays: ClassVar[bool] = False
    """Whether branches without a place are drawn over each other."""

    see: See = None

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

    @classmethod
    def _says_where(cls, settings: dict[str, Any]) -> bool:
        """Whether the settings that place axes are all there and well formed."""
        required = {key for key, info in cls.model_fields.items() if info.is_required()}
        roles = [
            settings[key] if role.several else [settings[key]]
            for key, role in cls.roles.items()
            if settings.get(key) is not None
        ]
        try:
            _PLACE.validate_python(as_numbers(settings.get("at") or {}))
        except ValidationError:
            return False
        return required <= settings.keys() <= cls.model_fields.keys() and all(
            isinstance(names, list | tuple) and all(isinstance(name, str) for name in names)
            for names in roles
        )

    @classmethod
    def _take_roles(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> dict[str, str]:
        """Return axis -> the role that takes it."""
        used: dict[str, str] = {}
        for key, role in cls.roles.items():
            take_role(key, role, settings.get(key), used, offer, faults)
        return used

    @classmethod
    def _without_place(
        cls, name: str, values: tuple[Any, ...] | None, settings: dict[str, Any], faults: Faults
    ) -> None:
        branch = name not in ALL
        free = [
            key
            for key, role in cls.roles.items()
            if (role.several or settings.get(key) is None)
            and (role.branches if branch else not role.several)
        ]
        ways = f"name it as {' or '.join(free)}, or give its value" if free else "give its value"
        if not branch and values is not None and len(values) > 1:
            message = f"axis '{name}' has {len(values)} values but no place in the figure"
            faults.add((), message, f"{ways} in at")
        if branch and not cls.overlays and (values is None or len(values) > 1):
            example = "{direction: up}" if name == "direction" else "{draw: 0}"
            message = f"the study has several runs at each point ({name}), the figure shows one"
            faults.add((), message, f"{ways}: at: {example}")


def take_role(
    key: str, role: Role, given: Any, used: dict[str, str], offer: Offer, faults: Faults
) -> None:
    """Note what is wrong with the axes that a setting names, and that these are used by it."""
    names = given if role.several and isinstance(given, list | tuple) else [given]
    known = offer.dimensions if role.branches else offer.axes
    for name in names:
        if not isinstance(name, str):
            continue
        if name not in known:
            faults.unknown((key,), "axis", name, known)
        if name in used:
            faults.add((key,), f"'{name}' is {used[name]} already", "an axis without a place")
        used[name] = key
        count_values((key,), name, known.get(name), role, faults)


def check_reduction(variables: Any, settings: Mapping[str, Any], faults: Faults) -> None:
    """Note variables that have no worst, and a share without its limit."""
    for name in variables if settings.get("worst") is not None else ():
        if isinstance(name, str) and name not in GREATER_IS_WORSE:
            message = f"more of '{name}' is not worse"
            faults.add(("worst",), message, words(GREATER_IS_WORSE))
    given, missing = ("share", "above") if settings.get("above") is None else ("above", "share")
    if settings.get(given) is not None and settings.get(missing) is None:
        allowed = "a number" if missing == "above" else "[draw]"
        faults.add((missing,), f"'{given}' is given, but '{missing}' is missing", allowed)


def _take_values(at: Any, used: Mapping[str, str], offer: Offer, faults: Faults) -> dict[str, str]:
    """Check `at` against the study; return axis -> "at"."""
    taken = {}
    for name, data in at.items() if isinstance(at, dict) else ():
        loc = ("at", as_part(name))
        if name in used:
            faults.add(loc, f"'{name}' is {used[name]} already", "an axis without a place")
        elif name in offer.dimensions:
            taken[name] = "at"
            check_listed(loc, name, data, offer.dimensions[name], faults)
        elif name in ALL or name in _BRANCHES:  # `Place` reports what is neither
            faults.unknown(loc, "axis", name, offer.dimensions)
    return taken


def check_listed(
    loc: tuple[str, ...], name: str, data: Any, values: tuple[Any, ...] | None, faults: Faults
) -> None:
    """Note a value that an axis does not have."""
    try:
        value = _PLACE.validate_python(as_numbers({name: data}))[name]
    except ValidationError:
        return  # `Place` reports it
    if values is None or value in values:
        return
    if isinstance(value, str):
        allowed = words(values)
    else:
        close = min(values, key=lambda listed: abs(listed - value))
        allowed = f"one of its {len(values)} values; the nearest is {show(close)}"
    faults.add(loc, f"'{name}' has no value {show(value)}", allowed)


def count_values(
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


def need_orbits(loc: tuple[str, ...], offer: Offer, faults: Faults) -> None:
    """Note that the study follows no periodic motion."""
    if not offer.orbits:
        message = "shows periodic motions, but the study follows none"
        faults.add(loc, message, "orbits: {a name: {along: an axis, start: a value of it}}")


def check_written(loc: tuple[str | int, ...], name: Any, offer: Offer, faults: Faults) -> None:
    """Note a variable that the cube does not have with one value at each point."""
    if not isinstance(name, str) or name in offer.variables:
        return
    known = words(offer.variables)
    for observer in OBSERVERS:
        for variable, setting in writable(observer):
            if name == variable.name and not variable.dims:
                there = observer in offer.observers
                lacks = f"where {setting} is set" if there else "which the study lacks"
                faults.add(loc, f"'{name}' is written by the observer {observer}, {lacks}", known)
                return
    message = f"no observer of the study writes {show(name)} as one value at each point"
    faults.add(loc, message, known, nearest(name, offer.variables))


def fit_axis(
    key: str, role: Role, settings: Mapping[str, Any], offer: Offer, faults: Faults
) -> None:
    """Note that the setting `key` names no axis, or one with too few or too many values."""
    name = settings.get(key)
    if not isinstance(name, str):
        return
    if name not in offer.axes:
        faults.unknown((key,), "axis", name, offer.axes)
    count_values((key,), name, offer.axes.get(name), role, faults)


def need(offer: Offer, faults: Faults, *observers: str) -> None:
    """Note which of these observers the study lacks."""
    for name in observers:
        if name not in offer.observers:
            faults.add((), f"needs {name} among the observers", name)


def need_section(offer: Offer, faults: Faults) -> None:
    """Note that the study has no section."""
    if not any(section in offer.observers for section in SECTIONS):
        faults.add((), "needs a section among the observers", " or ".join(SECTIONS))


def need_listed_bursts(offer: Offer, faults: Faults) -> None:
    """Note that the study has no bursts; `Product.single_bursts` is for those without a list."""
    if "bursts" not in offer.observers:
        faults.add((), "needs bursts among the observers", "bursts: {records: 50}")


def need_starts(offer: Offer, faults: Faults, along: str | None) -> None:
    """Note that the study has one start at each point of an axis."""
    if not {*INITIAL_NAMES, "draw"} & {*offer.dimensions} - {along}:
        faults.add((), "needs several starts", "draws, or axes of initial quantities")


def need_one_run(offer: Offer, faults: Faults, bisected: str | None = None) -> None:
    """Note that the study has several runs at each point, and what is bisected by single ones."""
    if not offer.branches:
        return
    several = f"at each point ({', '.join(offer.branches)})"
    message = f"this study has several runs {several}"
    if bisected is not None:
        start = f"{bisected} are bisected by runs from one initial state"
        message = f"{start}, but this study has several {several}"
    faults.add((), message, "a study without follow and without draws")
