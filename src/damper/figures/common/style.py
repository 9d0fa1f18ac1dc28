"""The style of all figures, and files with the same bytes every time."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from damper.parameters.lazy import Figure, Formatter
from damper.parameters.quantities import ALL, OfQuantities
from damper.parameters.units import (
    ACCELERATION,
    AMPLITUDES,
    ENERGY,
    FORCE,
    HERTZ,
    IMPULSE,
    LENGTH,
    SI_UNITS,
    SPEED,
    SPRING_FORCE,
    TIME,
    name_of,
)

#: Okabe-Ito: distinguishable with any colour vision and in grey.
BLUE, ORANGE, GREEN, VERMILION = "#0072B2", "#E69F00", "#009E73", "#D55E00"
SKY, PURPLE, YELLOW, BLACK = "#56B4E9", "#CC79A7", "#F0E442", "#000000"
#: One colour for one thing in all figures, and on the page of results; the last is of closed forms
#: and of periodic motions that are followed.
PRIMARY, FREE_MASS, RELATIVE, WITHOUT = BLACK, VERMILION, GREEN, "#BBBBBB"
THEORY = "#8F3B6C"
#: Of lines of other things, in turn.
COLOURS = (BLUE, ORANGE, PURPLE, SKY, "#7A7200", "#5B4636")

#: Width of one and of two printed columns, in inches.
COLUMN, PAGE = 3.5, 7.2

#: Points of which no run came to its end.
MISSING = "#B0B0B0"
#: The class of a map in which nothing happens.
PALE = "#F2F2F2"

#: Dark and light of each hue that motions have.
_HUES = (
    ("#5B4636", "#C3AB97"),
    ("#00664A", "#5CC9A7"),
    ("#8F3B6C", "#E3A6C8"),
    ("#A84300", "#F4A873"),
    (BLUE, "#8CC8F0"),
    ("#7A7200", YELLOW),
    (ORANGE, "#F7D98B"),
)

#: How stretches in which the masses stick are shaded.
STUCK: dict[str, Any] = {"color": YELLOW, "alpha": 0.45, "lw": 0.0}

SYMBOLS = OfQuantities(ALL, lambda quantity: quantity.symbol)
LONG_NAMES = OfQuantities(
    ALL, lambda quantity: quantity.long_name.replace("mass ratio m/M", "mass ratio")
)
#: Symbols of variables that have one.
VARIABLE_SYMBOLS = {
    "displacement": "$x$",
    "velocity": r"$\dot x$",
    "relative_displacement": "$(y - x)/d$",
    "relative_velocity": r"$\dot y - \dot x$",
    "approach_speed": "",  # v is the velocity of the primary
    "rms_displacement": r"$x_\mathrm{rms}$",
    "peak_displacement": r"$x_\mathrm{max}$",
    "amplitude_ratio": r"$x_\mathrm{max} / A$",
    "rms_ratio": r"$x_\mathrm{rms} / (A/\sqrt{2})$",
    "multiplier": r"$|\lambda|$",
}
#: Meanings of variables whose long names are too long for a label.
VARIABLE_MEANINGS = {
    "amplitude_ratio": "largest displacement over that without damper",
    "rms_ratio": "rms displacement over that without damper",
    "burst_at_duration": "duration of the burst",
    "peak_displacement": "largest displacement",
    "rms_displacement": "rms displacement",
}
#: Ratios that are 1 where the damper changes nothing.
RATIOS = ("amplitude_ratio", "rms_ratio")
#: Units as the cube has them -> as a label shows them.
_UNITS = {
    "1": "",
    LENGTH: "$F_0/K$",
    SPEED: r"$F_0/\sqrt{KM}$",
    TIME: r"$\sqrt{M/K}$",
    ENERGY: "$F_0^2/K$",
    FORCE: "$F_0$",
    SPRING_FORCE: "$F_0$",
    ACCELERATION: "$F_0/M$",
    IMPULSE: r"$F_0\sqrt{M/K}$",
    "degree": "°",
}
# Those of other forces than F0.
_UNITS |= {
    name: f"${name}$".replace("sqrt(K/M)", r"\sqrt{K/M}")
    .replace("sqrt(K M)", r"\sqrt{K M}")
    .replace(" ", r"\,")
    for amplitude in AMPLITUDES
    for unit in SI_UNITS
    if (name := name_of(unit, amplitude)) not in _UNITS
}
_BRANCHES = {("direction", "up"): "continued upwards", ("direction", "down"): "continued downwards"}

_STYLE: dict[str, Any] = {
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.labelsize": 8.0,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 7.0,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.direction": "out",
    "ytick.direction": "out",
    # 1.6 over an axis marked 10^-3 rather than 0.0016, as metres ask for.
    "axes.formatter.limits": (-3, 5),
    "axes.formatter.use_mathtext": True,
    "hatch.linewidth": 0.5,
    # Of PNG, and of what is pixels in SVG: dots and maps. At 300 they take twice the bytes.
    "savefig.dpi": 200,
    "svg.hashsalt": "damper",
    "svg.fonttype": "path",
}


@contextmanager
def style() -> Iterator[None]:
    """Draw and save inside this context."""
    import matplotlib as mpl

    with mpl.rc_context({**mpl.rcParamsDefault, "backend": "agg", **_STYLE}):  # type: ignore[dict-item]
        yield


def save(figure: Figure, path: Path) -> None:
    """Save as SVG or PNG, without a date, so the same figure gives the same bytes.

    Every file has the layout of the one saved first: fitting panels and labels takes as long as
    drawing them. `Figure.savefig` would draw each twice, to know the layout beforehand.
    """
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    _write_numbers_plainly(figure)
    figure.dpi = mpl.rcParams["savefig.dpi"]
    if path.suffix == ".svg":
        FigureCanvasSVG(figure).print_svg(path, metadata={"Date": None})
    else:
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        _save_picture(canvas.buffer_rgba(), path, figure.dpi)
    figure.set_layout_engine("none")


def _save_picture(pixels: Any, path: Path, dpi: float) -> None:
    """Save as PNG with a palette of 256 colours, half as large, where that looks the same."""
    import numpy as np
    from PIL import Image, ImageChops

    picture = Image.fromarray(np.asarray(pixels)).convert("RGB")
    # By the most colours that are unlike: rims of letters and lines have hundreds that are alike.
    small = picture.quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    same = np.asarray(ImageChops.difference(small.convert("RGB"), picture)).max() <= 16
    # Not `optimize`, nor the highest level: 7 % smaller in eight times the time.
    (small if same else picture).save(path, "PNG", compress_level=6, dpi=(dpi, dpi))


def _write_numbers_plainly(figure: Figure) -> None:
    """Keep mathematics to the power of ten at an axis' end: it takes ten times as long as text."""
    from matplotlib.ticker import ScalarFormatter

    for ax in figure.axes:
        for axis in (ax.xaxis, ax.yaxis):
            if type(axis.get_major_formatter()) is ScalarFormatter:
                axis.set_major_formatter(in_unit(1.0))


def in_unit(factor: float) -> Formatter:
    """Write of values on a linear axis how many times a unit they are, as text."""
    from matplotlib.ticker import ScalarFormatter

    class InUnit(ScalarFormatter):
        def set_locs(self, locs: Any) -> None:
            super().set_locs([x / factor for x in locs])

        def __call__(self, x: float, pos: int | None = None) -> str:
            text = super().__call__(x / factor, pos)
            return text.removeprefix(r"$\mathdefault{").removesuffix("}$")

    made = InUnit()
    if factor != 1.0:
        # Its size is that of the values: nothing is left for a power of ten at the end.
        made.set_scientific(False)
        made.set_useOffset(False)
    return made


def shades(count: int) -> list[Any]:
    """Colours of lines over the values of an axis: from dark to light, black for a single one."""
    from matplotlib import colormaps

    if count == 1:
        return [BLACK]
    # The lightest colours of the map are lost on white paper.
    return [colormaps["cividis"](0.8 * index / (count - 1)) for index in range(count)]


def mirror_kind(name: str) -> tuple[object, ...]:
    """Key of a motion by its name in `damper.analysis.attractors`, the same for its mirror image.

    Examples
    --------
    >>> mirror_kind("period 1, impacts 1 left, 2 right") == mirror_kind(
    ...     "period 1, impacts 2 left, 1 right")
    True
    """
    numbers = [int(number) for number in re.findall(r"\d+", name)]
    if not numbers:
        return (name,)
    impacts = numbers[1:] * (2 if "each wall" in name else 1)
    return (numbers[0], "symmetric" in name, *sorted(impacts))


def motion_colours(names: Sequence[str]) -> dict[str, str]:
    """Colour of each motion that `damper.analysis.attractors` names, the same in all figures.

    Its hue is that of its period and impacts, dark and light for a mirror pair. Where two kinds of
    one figure would share a hue, the later takes the next that is free.
    """
    taken: dict[tuple[object, ...], int] = {}
    colours = {}
    for name in names:
        numbers = [int(number) for number in re.findall(r"\d+", name)]
        if not numbers:
            colours[name] = PALE if name == "other motions" else "#555555"
            continue
        period, impacts = numbers[0], numbers[1:] * (2 if "each wall" in name else 1)
        # Modulo seven a motion, its period doubled and doubled again have three hues.
        order = [(period + sum(impacts) + k) % len(_HUES) for k in range(len(_HUES))]
        free = [hue for hue in order if hue not in taken.values()] or order
        hue = taken.setdefault(mirror_kind(name), free[0])
        colours[name] = _HUES[hue]["to the left" in name or impacts != sorted(impacts)]
    return colours


def units_text(units: str) -> str:
    """Return units as a label shows them; nothing for a number."""
    return _UNITS.get(units, units.replace("s2", "s²"))


def label(meaning: str, symbol: str, units: str) -> str:
    """Label of an axis: meaning, symbol and units."""
    shown = units_text(units)
    if "/" in shown or " " in shown:
        shown = f"({shown})"
    return " ".join(part for part in (meaning, symbol, shown and f"/ {shown}") if part)


def axis_label(name: str, units: str | None = None) -> str:
    """Label of a quantity's axis; `units` where they are not those of `ALL`."""
    return label(long_name(name, units), _symbol(name, units), units or ALL[name].units)


def long_name(name: str, units: str | None = None) -> str:
    """Words for a quantity; for an angular frequency in Hz, those for it over 2 pi."""
    return LONG_NAMES[name].removeprefix("angular ") if units == HERTZ else LONG_NAMES[name]


def _symbol(name: str, units: str | None) -> str:
    """Symbol of a quantity; of an angular frequency in Hz, of it over 2 pi."""
    return f"{SYMBOLS[name][:-1]}/2\\pi$" if units == HERTZ else SYMBOLS[name]


def value_text(name: str, value: Any, units: str | None = None) -> str:
    """Write the value of a quantity, or of a branch, as in a panel's title."""
    if name == "body":
        return f"mass {value}"
    if name not in ALL:
        return _BRANCHES.get((name, value), f"{name} {value}")
    if ALL[name].words:
        return f"{name}: {ALL[name].text_of(value)}"
    shown = units_text(units or ALL[name].units)
    return f"{_symbol(name, units)} = {_number(value)} {shown}".rstrip()


def _number(value: float) -> str:
    mantissa, _, exponent = f"{value:g}".partition("e")
    return rf"${mantissa}\times 10^{{{int(exponent)}}}$" if exponent else mantissa
