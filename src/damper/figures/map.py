"""Maps: one variable in colour over two parameters."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field

from damper.analysis.labels import label_of
from damper.analysis.motions import attractors
from damper.analysis.optimum import SAME
from damper.analysis.places import in_handy_units
from damper.analysis.reduction import REDUCTIONS, least, reduced, worst
from damper.analysis.stretches import half_gap
from damper.figures.common import layout, panels, style
from damper.figures.overlays import Panels, draw_overlays
from damper.parameters.lazy import Artist, Axes, Figure, xr
from damper.parameters.quantities import INITIAL_NAMES
from damper.parameters.variables import Chatter
from damper.study import products
from damper.study.fields import Text
from damper.study.messages import Mistakes
from damper.study.yaml_file import join_names
from damper.sweep.grid import geometric
from damper.sweep.idle import CONTACT, contact, from_exact_rest, of_any_mass
from damper.sweep.record import observers_of

if TYPE_CHECKING:
    from matplotlib.collections import QuadMesh
    from matplotlib.colors import Colormap, Normalize

#: Variables drawn in classes, which are numbered from zero -> name and colour of each.
_CLASSES = {
    "chatter": (
        ("no contact", "#FFFFFF"),
        ("impacts without chatter", "#D9D9D9"),
        ("incomplete chatter", style.ORANGE),
        ("complete chatter", style.BLUE),
    ),
    "status": (
        ("finished", style.PALE),
        ("stopped: max_events reached", style.ORANGE),
        ("stopped: a search gave up", style.PURPLE),
    ),
}
_ATTRACTOR = "attractor"
#: How points are marked at which the walls are never touched.
_HATCH, _HATCHES = "////", "#909090"
#: Addition to the label of such a point where all runs start at exact rest.
_FROM_REST = " from exact rest (neutrally stable without friction)"
#: Colours of ratios on either side of 1: blue where the damper helps, orange where it harms.
ABOUT_ONE = ("#00253C", style.BLUE, "#FFFFFF", style.ORANGE, "#A84300")
#: Ratios beyond this and its inverse have the colours of these.
_LARGEST_RATIO = 10.0
#: Where all ratios of one side are nearer to 1, its last colour stands for this.
_SMALLEST_RATIO = 1.05
#: Height of a row of so many panels, in inches.
_HEIGHTS = {1: 2.4, 2: 2.6, 3: 2.0}
#: Width of the line at 1.
_CONTOUR = 0.7
#: Whole numbers up to this have a colour each.
_MOST_STEPS = 12
#: Up to so many ordinates beneath a curve are strips of this part of their least distance.
_STRIPS, _STRIP = 8, 0.4


#: Initial quantity -> the same of a state on a section.
_STARTS: dict[str, Callable[[xr.Dataset], xr.DataArray]] = {
    "initial_displacement": lambda s: s.displacement,
    "initial_velocity": lambda s: s.velocity,
    "initial_position": lambda s: (s.free_displacement - s.displacement) / half_gap(s),
    "initial_relative_velocity": lambda s: s.free_velocity - s.velocity,
}

#: What the small-mass limit speaks of.
_OF_BURSTS = ("complete_fraction", "chatter")


class Map(products.FigureSettings):
    """One variable in colour over two axes."""

    roles: ClassVar[Mapping[str, products.Role]] = {
        "x": products.Role(least=2),
        "y": products.Role(least=2),
        "panels": products.Role(most=products.MOST_PANELS, branches=True),
        "each": products.Role(),
        **{name: role for name, role in products.REDUCTIONS.items() if name != "band"},
    }

    variable: Annotated[
        Text,
        Field(
            description="Variable of the cube, with one value at each point. chatter and status "
            "are drawn in classes, all else with a colour bar. attractor: the motion that the run "
            "ends in, by the observer motion, in words in the legend; with a stroboscopic_section "
            "of both masses, over two initial quantities, the motions' own points are marked."
        ),
    ]
    x: Annotated[Text, Field(description="Axis of the abscissa.")]
    y: Annotated[Text, Field(description="Axis of the ordinate.")]
    panels: Annotated[
        Text | None,
        Field(description="Axis, or direction or draw, of whose values each makes a panel."),
    ] = None
    each: products.Each = None
    at: products.At = None
    worst: products.Worst = None
    share: products.Share = None
    above: products.Above = None
    choose: products.Choose = None
    best: Annotated[
        Literal["min", "max"] | None,
        Field(
            description="Mark, for every x, the y at which the variable is least (min) or "
            "greatest (max); of equals the smallest y. Points at which the walls are never touched "
            "do not count, nor those at which the damper amplifies."
        ),
    ] = None
    theory: Annotated[
        Literal["small_mass_limit", "steady_amplitude"] | None,
        Field(
            description="Theory to draw over it: the restitution up to which bursts complete, in "
            "the limit of a small free mass; with complete_fraction or chatter, over restitution "
            "and clearance (or gap). Or the steady amplitude without damper, over frequency_ratio "
            "and clearance."
        ),
    ] = None
    orbits: Annotated[
        bool,
        Field(description="Whether to draw the curves of special points of the study's orbits."),
    ] = False
    interactive: products.Interactive = False
    equal: Annotated[
        bool,
        Field(
            description="Whether cells have equal sizes and each value is written at its axis, as "
            "suits a few listed values."
        ),
    ] = False
    caption: products.Caption = None

    @property
    def reads(self) -> tuple[str, ...]:  # type: ignore[override]
        """Files of the study that it shows."""
        return ("cube.nc", "orbits.nc") if self.orbits else ("cube.nc",)

    def check_against(self, study: products.StudyContents, mistakes: Mistakes) -> None:
        super().check_against(study, mistakes)
        if self.orbits:
            products.require_orbits(("orbits",), study, mistakes)
        if self.variable == _ATTRACTOR:
            products.need(study, mistakes, "motion")
        else:
            products.check_written(("variable",), self.variable, study, mistakes)

    def check_together(self, mistakes: Mistakes) -> None:
        products.check_reduction([self.variable], self, mistakes)
        if self.interactive and self.choose:
            message = "a click shows one design, and this map one of its own at each point"
            mistakes.add(("interactive",), message, "interactive: false")
        if self.variable == _ATTRACTOR and self.share is not None:
            message = "motions are above no limit"
            mistakes.add(("share",), message, "kind: basins, for the part that ends in each")
        if self.theory == "small_mass_limit":
            self._check_limit(mistakes)
        axes = self.x, self.y
        if self.theory == "steady_amplitude" and axes != ("frequency_ratio", "clearance"):
            message = f"the steady amplitude has no place over {join_names(axes)}"
            mistakes.add(("theory",), message, "frequency_ratio as x and clearance as y")

    def _check_limit(self, mistakes: Mistakes) -> None:
        axes = self.x, self.y
        if self.variable not in _OF_BURSTS:
            message = f"the small-mass limit does not speak of '{self.variable}'"
            mistakes.add(("theory",), message, f"a map of {join_names(_OF_BURSTS)}")
        if "restitution" not in axes or not any(name in axes for name in products.FREE_TRAVEL):
            message = f"the small-mass limit has no place over {join_names(axes)}"
            mistakes.add(("theory",), message, "restitution and clearance (or gap) as x and y")


def draw(results: Mapping[str, Any], settings: Map) -> Figure:
    """Draw one variable in colour over two axes."""
    cube = results["cube"]
    x, y = settings.x, settings.y
    never = "walls never touched" + _FROM_REST * from_exact_rest(cube)
    place, variable, touched, classes = classified(
        cube, settings.model_dump(), x, y, settings.panels
    )
    if settings.equal:
        place = in_handy_units(place)
    written = {name: place[name].values for name in (x, y)} if settings.equal else {}
    for name, listed in written.items():
        place = place.assign_coords({name: (name, np.arange(listed.size), place[name].attrs)})
    if touched is not None:
        place = place.assign(touched=(touched.dims, touched.values))
    shown = panels.parts(place, settings.panels)
    figure, axes = panels.wrapped_panels(len(shown), _HEIGHTS, rest=1.0)
    colours, norm = _colours(place[variable], classes)
    handles = _classes(place[variable], classes, _missing(cube, settings.variable))
    for ax, (text, panel) in zip(axes, shown, strict=True):
        values = layout.numbers(panel[variable], y, x)
        mesh = _cells(ax, panel, values, colours, norm, settings)
        known = values
        if touched is not None:
            contacts = layout.numbers(panel.touched, y, x)
            known = np.where(contacts > 0.0, values, np.nan)
            handles += [] if classes else _hatch(ax, panel, x, y, contacts == 0.0, never)
        handles += _marks(ax, panel, variable, known, settings)
        if settings.variable == _ATTRACTOR and _in_section(cube, x, y) and not settings.worst:
            handles += _mark_motions(ax, cube, panel, settings, colours)
        over = Panels({variable: ax}, (x, y), panel, results)
        handles += draw_overlays(over, settings.theory, settings.orbits)
        _note_one_colour(ax, values, classes)
        panels.title(ax, text)
    width, height = (0.9 * size for size in panels.panel_size(axes, _HEIGHTS))
    panels.label_outer(
        axes, layout.place_label(place, x, width), layout.place_label(place, y, height)
    )
    for ax in axes if settings.equal else ():
        ax.set_xticks(place[x].values, [f"{value:g}" for value in written[x]])
        ax.set_yticks(place[y].values, [f"{value:g}" for value in written[y]])
    if not classes:
        _colour_bar(figure, axes, mesh, place[variable])
    remarks = layout.reductions(cube, settings)
    if {x, y} == {*INITIAL_NAMES} & {*cube.coords}:
        remarks.append("all other initial values 0")
    return panels.finish(figure, place, settings.caption, handles, remarks)


def _marks(
    ax: Axes, panel: xr.Dataset, variable: str, values: np.ndarray, settings: Map
) -> list[Artist]:
    """Mark where a ratio is 1, and the best places, of values where the walls are touched."""
    x, y = settings.x, settings.y
    marks = _contour(ax, panel, x, y, values) if variable in style.RATIOS else []
    if settings.best:
        # A ratio itself, or any variable beside the ratio of amplitudes.
        own = variable if variable in style.RATIOS else "amplitude_ratio"
        ratios = layout.numbers(panel[own], y, x) if own in panel else None
        rows = best_places(values, ratios, settings.best)
        marks += _best(ax, panel, x, y, rows, settings.best, variable)
    return marks


def _in_section(cube: xr.Dataset, *axes: str) -> bool:
    """Whether motions can be marked where they would start: both masses' states at that phase."""
    if "free_velocity" not in cube or not {*axes} <= _STARTS.keys():
        return False
    return observers_of(cube).get("stroboscopic_section", {"when": 1.0}).get("when", 0.0) == 0.0


def _mark_motions(
    ax: Axes, cube: xr.Dataset, panel: xr.Dataset, settings: Map, colours: Colormap
) -> list[Artist]:
    """Mark the motions that runs end in by their points once per cycle, projected."""
    x, y = settings.x, settings.y
    at = dict(settings.at or {})
    if settings.panels:
        at[settings.panels] = panel[settings.panels].item()
    bodies = [f"{body}{of}" for body in ("", "free_") for of in ("displacement", "velocity")]
    place = layout.select(cube, [*bodies, "motion_period"], at, (x, y, "sample"))
    look: dict[str, Any] = {"ls": "", "marker": "o", "ms": 4.5, "mec": style.BLACK, "mew": 0.8}
    limits = ax.get_xlim(), ax.get_ylim()
    spans = [high - low for low, high in limits]
    for number in np.unique(panel[_ATTRACTOR].values[np.isfinite(panel[_ATTRACTOR])]):
        shown = (panel[_ATTRACTOR] == number) & (place.motion_period > 0)
        points = np.stack([_STARTS[name](place).where(shown).values.ravel() for name in (x, y)], -1)
        points = points[np.isfinite(points).all(axis=1)]
        _, first = np.unique(np.round(1e3 * points / spans), axis=0, return_index=True)
        ax.plot(*points[first].T, mfc=colours(int(number)), **look)
    ax.set(xlim=limits[0], ylim=limits[1])
    return [panels.legend_line("motions once per cycle, projected", mfc="white", **look)]


class Classified(NamedTuple):
    """The piece of a cube to show, and its variable's name there; where walls are touched; names
    and colours of classes."""

    place: xr.Dataset
    variable: str
    touched: xr.DataArray | None
    classes: list[tuple[str, str]]


def classified(cube: xr.Dataset, settings: Mapping[str, Any], *keep: str | None) -> Classified:
    """Return what a map of these settings shows; of several runs at a point one number."""
    variable = settings["variable"]
    classes = list(_CLASSES.get(variable, ()))
    if variable == _ATTRACTOR:
        motions, names = attractors(cube)
        cube = cube.assign({variable: motions})
        classes = list(style.motion_colours(names).items())
    beside = [name for name in (*CONTACT, "amplitude_ratio") if name in cube and name != variable]
    over = [name for key in REDUCTIONS for name in settings.get(key) or ()]
    if settings.get("choose"):
        beside = []  # of other designs
    at = settings.get("at") or {}
    if "body" in at:  # contacts of that free mass alone
        beside = [n for n in beside if n not in CONTACT or "body" in cube[n].dims]
    else:
        cube = cube.assign({name: of_any_mass(cube[name]) for name in beside})
    place = layout.select(cube, [variable, *beside], at, (*keep, *over))
    place = place.sortby([settings["x"], settings["y"]])
    touched = contact(place)
    if settings.get("share"):
        classes = []
    elif variable == "chatter":
        classes = _split_no_chatter(place, touched, classes, from_exact_rest(cube))
    if over:
        # Touched in one run is touched; amplified in one run is amplified.
        touched = None if touched is None else touched.astype(float).max(over, skipna=False)
        ratio = {name: worst(place[name], over) for name in ("amplitude_ratio",) if name in beside}
        place, (variable,) = reduced(place, [variable], settings)
        place = place.assign(ratio)
    return Classified(place, variable, touched, classes)


def _split_no_chatter(
    place: xr.Dataset, touched: xr.DataArray | None, classes: list[tuple[str, str]], rest: bool
) -> list[tuple[str, str]]:
    """Tell contact without chatter from no contact, in place; return the classes there are."""
    if touched is None:  # not known
        return [("no chatter", style.PALE), *classes[2:]]
    place["chatter"] = place.chatter + touched.where(place.chatter == Chatter.NONE, 1)
    name, colour = classes[0]
    return [(name + _FROM_REST * rest, colour), *classes[1:]]


def _colours(array: xr.DataArray, names: Sequence[tuple[str, str]]) -> tuple[Colormap, Normalize]:
    """Colours and their norm, the same for all panels."""
    from matplotlib import colormaps
    from matplotlib.colors import (
        BoundaryNorm,
        LinearSegmentedColormap,
        ListedColormap,
        Normalize,
    )

    if names:
        classes = ListedColormap([colour for _, colour in names])
        steps = np.arange(classes.N + 1) - 0.5
        return classes.with_extremes(bad=style.MISSING), BoundaryNorm(steps, classes.N)
    low, high = _range(array)
    if array.name in style.RATIOS:
        ratios = LinearSegmentedColormap.from_list("ratios", ABOUT_ONE)
        return ratios.with_extremes(bad=style.MISSING), _about_one(low, high)
    colours = colormaps["cividis"].with_extremes(bad=style.MISSING)
    if layout.whole(array) and high - low < _MOST_STEPS:
        return colours, BoundaryNorm(np.arange(low, high + 2.0) - 0.5, colours.N)
    return colours, Normalize(low, high if high > low else low + 1.0)


def _about_one(low: float, high: float) -> Normalize:
    """Logarithmic on either side of 1, whose colour is in the middle, to the ends of the data."""
    from matplotlib.colors import FuncNorm

    below = np.log(min(max(1.0 / low, _SMALLEST_RATIO), _LARGEST_RATIO))
    above = np.log(min(max(high, _SMALLEST_RATIO), _LARGEST_RATIO))

    def place(ratio: Any) -> Any:
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = np.log(np.ma.filled(ratio, np.nan))
        return np.where(distance < 0.0, distance / below, distance / above)

    def ratio(place: Any) -> Any:
        return np.exp(np.where(np.asarray(place) < 0.0, place * below, place * above))

    return FuncNorm((place, ratio), float(np.exp(-below)), float(np.exp(above)))


def _range(array: xr.DataArray) -> tuple[float, float]:
    """Least and greatest value."""
    values = layout.numbers(array)
    values = values[np.isfinite(values)]
    return (float(values.min()), float(values.max())) if values.size else (1.0, 1.0)


def _cells(
    ax: Axes, panel: xr.Dataset, values: np.ndarray, colours: Colormap, norm: Any, settings: Map
) -> QuadMesh:
    """Draw each value in a cell as large as its place on the axes, or in a strip."""
    x, y = settings.x, settings.y
    ends, levels = layout.edges(panel[x].values), panel[y].values
    # Rasterised: a vector cell each makes files that no reader opens.
    look: dict[str, Any] = {"cmap": colours, "norm": norm, "rasterized": True}
    if settings.equal:
        look |= {"edgecolors": "white", "lw": 0.8}
    if settings.orbits and 1 < len(levels) <= _STRIPS:
        # Between few ordinates the curve says more than wide cells would.
        half = 0.5 * _STRIP * np.diff(levels).min()
        for level, row in zip(levels, values, strict=True):
            mesh = ax.pcolormesh(ends, [level - half, level + half], row[None], **look)
        ax.set_ylim(levels[0] - 2.0 * half, levels[-1] + 2.0 * half)
    else:
        mesh = ax.pcolormesh(ends, layout.edges(levels), values, **look)
    for name, axis in ((x, "x"), (y, "y")):
        if geometric(panel[name].values):
            ax.set(**{f"{axis}scale": "log"})
    layout.few_decades(ax)
    ax.spines[:].set_visible(True)
    return mesh


def _note_one_colour(ax: Axes, values: np.ndarray, classes: Sequence[tuple[str, str]]) -> None:
    """Write in a panel of one colour why it looks empty."""
    known = values[np.isfinite(values)]
    if not known.size:
        panels.note_empty_panel(ax)
    elif classes and (known == known[0]).all():
        panels.note_empty_panel(ax, f"{classes[int(known[0])][0]} throughout")


def _hatch(
    ax: Axes, panel: xr.Dataset, x: str, y: str, idle: np.ndarray, text: str
) -> list[Artist]:
    """Hatch the points at which the walls are never touched."""
    if not idle.any():
        return []
    # Every edge twice, so that areas end where cells do.
    ends = (np.repeat(layout.edges(panel[name].values), 2)[1:-1] for name in (x, y))
    place = *ends, np.repeat(np.repeat(idle.astype(float), 2, axis=0), 2, axis=1)
    area = ax.contourf(*place, [0.5, 1.5], colors="none", hatches=[_HATCH])
    area.set(edgecolor=_HATCHES, linewidth=0.0)
    ax.contour(*place, [0.5], colors=_HATCHES, linewidths=0.5)
    return [panels.legend_patch(text, facecolor="white", edgecolor=_HATCHES, hatch=_HATCH, lw=0.5)]


def _contour(ax: Axes, panel: xr.Dataset, x: str, y: str, values: np.ndarray) -> list[Artist]:
    """Draw where a ratio is 1."""
    values = np.where(np.abs(values - 1.0) < SAME, 1.0 + SAME, values)
    if not ((values < 1.0).any() and (values > 1.0).any()):
        return []
    ax.contour(
        panel[x].values, panel[y].values, values, [1.0], colors=style.BLACK, linewidths=_CONTOUR
    )
    return [panels.legend_line("ratio = 1", color=style.BLACK, lw=_CONTOUR)]


def best_places(values: np.ndarray, ratios: np.ndarray | None, best: str) -> np.ndarray:
    """Row of the best value in each column where ratios are below 1, -1 where there is none."""
    values = values if ratios is None else np.where(ratios < 1.0, values, np.nan)
    signed = values if best == "min" else -values
    return np.array([least(c) if np.isfinite(c).any() else -1 for c in signed.T])


def _best(
    ax: Axes, panel: xr.Dataset, x: str, y: str, rows: np.ndarray, best: str, variable: str
) -> list[Artist]:
    """Mark the best y of every x."""
    known = rows >= 0
    look: dict[str, Any] = {
        "ls": "",
        "marker": "o",
        "ms": 2.6 if rows.size <= 60 else 1.8,
        "mfc": "white",
        "mec": style.BLACK,
        "mew": 0.4,
    }
    ax.plot(panel[x].values[known], panel[y].values[rows[known]], **look)
    name = style.VARIABLE_SYMBOLS.get(variable, label_of(variable))
    extreme = "least" if best == "min" else "greatest"
    place = map(label_of, (y, x))
    text = f"best {' at each '.join(place)} ({extreme} {name})"
    return [panels.legend_line(text, **look)]


def _colour_bar(figure: Figure, axes: list[Axes], mesh: QuadMesh, array: xr.DataArray) -> None:
    from matplotlib.colors import BoundaryNorm
    from matplotlib.ticker import MaxNLocator

    low, high = _range(array)
    norm: Any = mesh.norm  # its limits are known by now
    first, last = max(low, norm.vmin), min(high, norm.vmax)
    beyond = {(True, False): "min", (False, True): "max", (True, True): "both"}
    extend = beyond.get((low < first, high > last), "neither")
    bar = figure.colorbar(mesh, ax=axes, aspect=30, pad=0.02, extend=extend)
    bar.set_label(layout.variable_label(array, figure.get_figheight() - 1.4))
    bar.outline.set_linewidth(0.6)
    if array.name in style.RATIOS:
        ticks = _ratio_ticks(first, last)
        bar.set_ticks(ticks, labels=[f"{tick:g}" for tick in ticks])
        if first < last:  # the colours that occur
            bar.ax.set_ylim(first, last)
    elif isinstance(norm, BoundaryNorm):
        bar.set_ticks(0.5 * (norm.boundaries[1:] + norm.boundaries[:-1]))
    elif layout.whole(array):
        bar.locator = MaxNLocator(integer=True, min_n_ticks=1)
    bar.minorticks_off()


def _ratio_ticks(low: float, high: float) -> list[float]:
    from matplotlib.ticker import MaxNLocator

    ticks: Sequence[float] = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
    if high < 3.0 * low:
        ticks = MaxNLocator(6).tick_values(low, high)
    shown = [float(tick) for tick in ticks if low <= tick <= high]
    # The colours of one side of 1 have a number, however narrow its range is.
    if low < 0.99 and not any(tick < 1.0 for tick in shown):
        shown.insert(0, math.ceil(100.0 * low) / 100.0)
    if high > 1.01 and not any(tick > 1.0 for tick in shown):
        shown.append(math.floor(100.0 * high) / 100.0)
    return shown


def _missing(cube: xr.Dataset, variable: str) -> str:
    """Say why points have no value: runs stopped, or the variable has none, as of no impact."""
    finished = variable in cube and bool((cube[variable].isnull() & (cube.status == 0)).any())
    return "no value" if finished or variable in style.RATIOS else "run stopped"


def _classes(array: xr.DataArray, classes: Sequence[tuple[str, str]], missing: str) -> list[Artist]:
    """Legend entries of the classes that occur, and of points without a value."""
    values, rim = layout.numbers(array), {"edgecolor": style.BLACK, "lw": 0.4}
    handles = [
        panels.legend_patch(text, facecolor=colour, **rim)
        for index, (text, colour) in enumerate(classes)
        if (values == index).any()
    ]
    if np.isnan(values).any():
        handles.append(panels.legend_patch(missing, facecolor=style.MISSING, **rim))
    return handles
