"""One style for all figures, and files with the same bytes every time."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from damper.quantities import ALL

#: Okabe-Ito: distinguishable with any colour vision and in grey.
BLUE, ORANGE, GREEN, VERMILION, SKY, PURPLE, YELLOW, BLACK = (
    "#0072B2",
    "#E69F00",
    "#009E73",
    "#D55E00",
    "#56B4E9",
    "#CC79A7",
    "#F0E442",
    "#000000",
)

#: Width of one and of two printed columns, in inches.
COLUMN, PAGE = 3.5, 7.2

SYMBOLS = {name: quantity.symbol for name, quantity in ALL.items()}
LONG_NAMES = {name: quantity.long_name for name, quantity in ALL.items()}

_STYLE = {
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
    "savefig.dpi": 300,
    "svg.hashsalt": "damper",
    "svg.fonttype": "path",
}


@contextmanager
def style() -> Iterator[None]:
    """Draw and save inside this context."""
    with mpl.rc_context({**mpl.rcParamsDefault, "backend": "agg", **_STYLE}):
        yield


def save(figure: Figure, path: Path) -> None:
    """Save without a date, so the same figure gives the same bytes."""
    metadata = {"svg": {"Date": None}, "png": {"Software": None}}
    figure.savefig(path, metadata=metadata.get(Path(path).suffix[1:]))


def axis_label(name: str) -> str:
    """Label of a parameter's axis: meaning and symbol."""
    return f"{LONG_NAMES[name]} {SYMBOLS[name]}"


def value_text(name: str, value: float) -> str:
    """Write a parameter's value, as in a panel's title."""
    return f"{SYMBOLS[name]} = {value:g}"
