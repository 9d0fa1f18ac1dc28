"""What all kinds of figures share: the piece of a cube to draw, headings, scales, legends."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import chain
from typing import Any

import numpy as np

from damper.analysis.places import observed, value_on
from damper.analysis.reduction import runs_over
from damper.figures.common import style
from damper.parameters.lazy import Artist, Axes, Axis, Figure, Formatter, xr
from damper.parameters.names import unknown_name
from damper.parameters.quantities import ALL, INITIAL_NAMES, quantities_in
from damper.parameters.units import handy, units_of
from damper.sweep.grid import geometric
from damper.sweep.record import force_words, table_words, unused_quantities

#: Letters that fit in an inch of heading, of label, and of legend.
_HEADING, _LABEL, _LEGEND = 15.0, 19.0, 21.0
#: Kinds of force whose name alone says too little.
_FORCES = {"none": "no force", "base": "base motion"}


def select(
    cube: xr.Dataset,
    variables: Sequence[str],
    at: Mapping[str, Any] | None,
    keep: Collection[str | None],
) -> xr.Dataset:
    """Return the variables at the given values, with no dimensions but `keep`.

    Parameters
    ----------
    cube : xarray.Dataset
    variables : sequence of str
    at : mapping, optional
        Value of each dimension that is not kept; those of length one need none.
    keep : collection of str
        Dimensions that the figure shows; None stands for none.

    Returns
    -------
    xarray.Dataset

    Raises
    ------
    ValueError
        For an unknown variable or axis, a value farther than half a step from those of the axis
        (with the nearest), or a dimension without a place.
    """
    for name in variables:
        if name not in cube:
            raise ValueError(str(unknown_name("variable", name, map(str, cube.data_vars))))
    place = observed(cube, variables)
    for name, value in (at or {}).items():
        if name in place.dims:
            place = place.sel({name: value_on(place[name], value)})
        elif name not in place.coords or place[name].item() != value:
            known = ", ".join(map(str, place.dims))
            raise ValueError(f"at: no axis {name!r} with {value!r}: must be one of {known}")
    shown = [name for name in keep if name is not None]
    for name in shown:
        if name not in place.dims:
            raise ValueError(str(unknown_name("axis", name, map(str, place.dims))))
    place = place.squeeze([dim for dim in place.dims if dim not in shown and place.sizes[dim] == 1])
    for dim in place.dims:
        if dim not in shown:
            raise ValueError(
                f"{dim} has {place.sizes[dim]} values but no place in the figure: "
                f"give one in at, such as {{{dim!r}: {place[dim].values[0]}}}"
            )
    return place


def numbers(array: xr.DataArray, *dims: str | None) -> np.ndarray:
    """Return values as floats, NaN where there is none, dimensions in the given order."""
    values = array.transpose(*(dim for dim in dims if dim is not None)).values
    values = np.asarray(values, dtype=float)
    # Zero stands for the ratio to an infinite amplitude.
    return np.where(values == 0.0, np.nan, values) if array.name in style.RATIOS else values


def whole(array: xr.DataArray) -> bool:
    """Whether a variable's file holds whole numbers; it has floats where some may be missing."""
    return bool(np.issubdtype(array.encoding.get("dtype", array.dtype), np.integer))


def place_label(place: xr.Dataset, name: str, inches: float) -> str:
    """Label of an axis of the cube, in the cube's units, on as many lines as it needs."""
    units = units_of(place[name].attrs)
    text = style.axis_label(name, units)
    return wrap(_words(text.replace(" / ", "\xa0/\xa0")), inches * _LABEL - _prefix(units))


def place_text(place: xr.Dataset, name: str, value: Any) -> str:
    """Write the value of an axis of the cube, with the prefix of the unit that its values have."""
    units, values = units_of(place[name].attrs), place[name].values
    if name in ALL:
        factor, units = handy(float(np.abs(values).max()), units)
        value /= factor
    return style.value_text(name, value, units)


def variable_label(array: xr.DataArray, inches: float) -> str:
    """Label of a variable, on as many lines as it needs."""
    attrs = array.attrs
    name = str(array.name)
    meaning = style.VARIABLE_MEANINGS.get(name, attrs.get("long_name", name))
    units = units_of(attrs)
    rest = style.label("", style.VARIABLE_SYMBOLS.get(name, ""), units)
    return wrap([*_words(meaning), *([rest] if rest else [])], inches * _LABEL - _prefix(units))


def _prefix(units: str) -> int:
    """Letters that a prefix may add to units."""
    return int(any(handy(size, units)[0] != 1.0 for size in (1e-4, 1e12)))


def head(
    figure: Figure, place: xr.Dataset, caption: str | None, *, remarks: Iterable[str] = ()
) -> None:
    """Write the heading: caption or title, then every value that is the same throughout.

    A value that a study need not give, such as a phase of 0, is left out.
    """
    coords = place.coords
    hidden = unused_quantities(place)
    # The number of a draw is where it starts.
    hidden = (*hidden, *INITIAL_NAMES) if "draw" in coords else hidden
    values = [
        place_text(place, name, coords[name].item())
        for name in (*quantities_in(coords), "direction", "draw", "body")
        if name in coords and coords[name].ndim == 0 and name not in hidden
        if name not in ALL or coords[name].item() != ALL[name].default
    ]
    values += table_words(place)
    if force := force_words(place):
        kind, *rest = force.split(", ")
        values += [_FORCES.get(kind, kind), *rest]
    values += remarks
    values = [f"{text}," for text in values[:-1]] + values[-1:]
    words = _words(caption or place.attrs.get("title", ""))
    letters = figure.get_figwidth() * _HEADING
    pieces = (_words(text) if _length(text) > letters else [text] for text in values)
    heading(figure, words, chain(*pieces), letters=letters)


def heading(figure: Figure, *lines: Iterable[str], letters: float) -> None:
    """Write above a figure lines of words, each wrapped to so many letters, but no empty ones."""
    wrapped = (wrap(words, letters) for words in lines)
    figure.suptitle("\n".join(line for line in wrapped if line), fontsize=8.5)


def wrap(parts: Iterable[str], letters: float) -> str:
    """Join parts by blanks into lines of at most so many letters."""
    lines: list[list[str]] = [[]]
    length = 0
    for part in parts:
        more = _length(part) + 1
        if lines[-1] and length + more > letters:
            lines.append([])
            length = 0
        lines[-1].append(part)
        length += more
    return "\n".join(" ".join(line) for line in lines)


def reductions(cube: xr.Dataset, settings: Any) -> list[str]:
    """Say for a heading how a figure's runs were reduced."""
    most = "most chatter" if getattr(settings, "variable", "") == "chatter" else "worst"
    remarks = [f"{most} of {runs_over(cube, settings.worst)}"] if settings.worst else []
    if settings.choose:
        axes = " and ".join(style.SYMBOLS[name] for name in settings.choose)
        remarks.append(f"at each point the best {axes} of the grid")
    return remarks


def idle(place: xr.Dataset) -> list[str]:
    """Say for a heading that runs of the cube are idle because they start at exact rest."""
    return ["where idle, from exact rest alone"] if place.attrs.get("runs_idle_from_rest") else []


def legend(figure: Figure, handles: Sequence[Artist]) -> int:
    """Put a legend below all panels, where it hides nothing, in as many columns as fit.

    Returns how many lines it has.
    """
    if not handles:
        return 0
    room = (figure.get_figwidth() - 0.6) * _LEGEND
    for handle in handles:
        handle.set_label(wrap(_words(str(handle.get_label())), room))
    lines = [line for handle in handles for line in str(handle.get_label()).split("\n")]
    widest = max(map(_length, lines))
    columns = max(int((figure.get_figwidth() + 0.14) / (widest / _LEGEND + 0.47)), 1)
    rows = math.ceil(len(handles) / columns)
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=math.ceil(len(handles) / rows),
        frameon=False,
    )
    return rows + len(lines) - len(handles)


def few_decades(ax: Axes) -> None:
    """Mark logarithmic axes over less than two decades at 1, 2 and 5 (or more), in plain numbers.

    Otherwise labels such as 3 x 10^-2 stand so close that they overlap.
    """
    for axis in (ax.xaxis, ax.yaxis):
        low, high = sorted(axis.get_view_interval())
        if axis.get_scale() == "log" and high < 100.0 * low and low >= 1e-3 and high <= 1e4:
            _mark(axis)
            axis.set_major_formatter("{x:g}")


def _mark(axis: Axis) -> None:
    """Mark a logarithmic axis over a few decades at a few numbers."""
    from matplotlib.ticker import LogLocator, NullFormatter

    low, high = sorted(axis.get_view_interval())
    steps = (1.0, 2.0, 5.0) if high >= 5.0 * low else (1.0, 2.0, 3.0, 4.0, 5.0, 7.0)
    axis.set_major_locator(LogLocator(subs=steps))
    axis.set_minor_formatter(NullFormatter())


#: The unit at the end of an axis' label.
_UNIT = re.compile(r"(?<=/[ \xa0])(\(?)([^()$]+)(\)?)$")


def write_prefixes(figure: Figure) -> None:
    """Write axes in SI units with the prefix that suits what they span: 1.6 mm, not 0.0016 m.

    An axis without a label has the unit of that in its row, or in its column.
    """
    labelled: dict[Any, float] = {}
    bare: dict[Axis, Any] = {}
    made: list[Formatter] = []
    for ax in figure.axes:
        place = ax.get_subplotspec()
        rows = (place.colspan, place.rowspan) if place else (ax, ax)
        for number, axis in enumerate((ax.xaxis, ax.yaxis)):
            row = number, rows[number]
            if found := _UNIT.search(label := axis.get_label_text()):
                size = max(map(abs, axis.get_view_interval()))
                factor, units = handy(float(size), found[2].replace("s²", "s2"))
                if factor != 1.0 and _write_in(axis, factor, made):
                    axis.set_label_text(_UNIT.sub(rf"\1{style.units_text(units)}\3", label))
                    labelled[row] = factor
            elif not label:
                bare[axis] = row
    for axis, row in bare.items():
        if row in labelled:
            _write_in(axis, labelled[row], made)


def _write_in(axis: Axis, factor: float, made: list[Formatter]) -> bool:
    """Write the numbers of an axis in a unit so many times as large; False for ticks of words.

    `made` are the formatters that have been set, which axes with the same limits share.
    """
    from matplotlib.ticker import FuncFormatter, LogFormatter, ScalarFormatter, StrMethodFormatter

    shown = axis.get_major_formatter()
    if shown in made:
        return True
    if not isinstance(shown, ScalarFormatter | LogFormatter | StrMethodFormatter):
        return False
    form = style.in_unit(factor)
    if axis.get_scale() == "log":
        low, high = (end / factor for end in sorted(axis.get_view_interval()))
        if high < 100.0 * low:
            _mark(axis)
        plain = low >= 1e-3 and high <= 1e4
        form = FuncFormatter(lambda x, _: f"{x / factor:g}" if plain else _power(x / factor))
    made.append(form)
    axis.set_major_formatter(form)
    return True


def _power(value: float) -> str:
    """Write a power of ten."""
    return rf"$\mathdefault{{10^{{{math.log10(value):.0f}}}}}$"


def jumps(heights: np.ndarray, times: float, least: float) -> np.ndarray:
    """Numbers of the points to which a line jumps.

    That is a step so many times as high as those beside it, and at least such a part of the line.
    """
    steps = np.abs(np.diff(heights))
    beside = np.maximum(np.append(steps[1:], np.nan), np.insert(steps[:-1], 0, np.nan))
    known = heights[np.isfinite(heights)]
    lowest = least * (known.max() - known.min()) if known.size else 0.0
    return 1 + np.flatnonzero((steps > times * beside) & (steps > lowest))


def edges(values: np.ndarray) -> np.ndarray:
    """Edges of the cells about ascending values: half way between, on the axis' own scale."""
    if geometric(values):
        return np.exp(edges(np.log(values)))
    middle = 0.5 * (values[1:] + values[:-1])
    first, last = 1.5 * values[:1] - 0.5 * values[1:2], 1.5 * values[-1:] - 0.5 * values[-2:-1]
    return np.concatenate([first, middle, last])


def section_text(array: xr.DataArray) -> list[str]:
    """Say for a heading where a section lies, from what its samples are."""
    text = array.attrs.get("long_name", "")  # "primary displacement once per cycle"
    where = text.removeprefix("primary displacement ").removeprefix("primary velocity ")
    return [f"section {where}"] if where else []


def _words(text: str) -> list[str]:
    """Split at blanks that may be broken at, but not within mathtext."""
    return re.findall(r"(?:\$[^$]*\$|[^ \n])+", text)


def _length(text: str) -> int:
    """Letters of a text, roughly: of mathtext a command is one, and braces are none."""
    return len(re.sub(r"[${}^_]", "", re.sub(r"\\[A-Za-z]+ ?", "x", text)))
