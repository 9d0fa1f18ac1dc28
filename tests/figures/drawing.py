"""What the tests of all kinds of figures share."""

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from damper.figures import draw
from damper.figures.common.style import save, style
from damper.observers import class_in
from damper.parameters.variables import ENERGY, LENGTH, NO_VALUE, SPEED, Variable
from damper.study.study_file import ProductBase
from damper.sweep.cube import dataset

WHERE = "once per cycle"
VARIABLES = {
    variable.name: variable
    for variable in (
        Variable("rms_ratio", "rms displacement over that of the steady response", "1"),
        Variable("peak_displacement", "largest primary displacement, either way", LENGTH),
        Variable("energy_input", "work of the force per cycle", ENERGY),
        Variable("visible_impacts", "most visible impacts in one burst", "1", (), "i4"),
        Variable("chatter", "chatter: 0 none, 1 incomplete, 2 complete", "1", (), "i1"),
        Variable("displacement", f"primary displacement {WHERE}", LENGTH, ("sample",)),
        Variable("velocity", f"primary velocity {WHERE}", SPEED, ("sample",)),
    )
}
#: A damper in SI units, all but gap and forcing frequency.
SI = {
    "primary_mass": 2.0,
    "damping": 1.2,
    "stiffness": 800.0,
    "force_amplitude": 4.0,
    "free_mass": 0.2,
    "restitution": 0.6,
}
FIXED = {"mass_ratio": 0.1, "damping_ratio": 0.02, "clearance": 0.05, "restitution": 0.5}


def made_up(
    axes: Mapping[str, Sequence[float]],
    branches: Mapping[str, Sequence[Any]] | None = None,
    **arrays: Any,
) -> xr.Dataset:
    """Cube over axes, then branches, of variables whose values are given."""
    fixed = {name: value for name, value in (FIXED | {"phase": 0.0}).items() if name not in axes}
    lengths = [len(values) for values in (*axes.values(), *(branches or {}).values())]
    runs = int(np.prod(lengths))
    data = {
        name: np.asarray(values, VARIABLES[name].dtype).reshape(runs, -1)
        if VARIABLES[name].dims
        else np.broadcast_to(values, lengths).reshape(runs).astype(VARIABLES[name].dtype)
        for name, values in arrays.items()
    }
    # A run without a value has stopped.
    missing = [np.isnan(v) if v.dtype.kind == "f" else v == NO_VALUE for v in data.values()]
    stopped = np.any([m.reshape(runs, -1).any(axis=1) for m in missing], axis=0)
    status = {"status": stopped.astype("i1")}
    variables = [VARIABLES[name] for name in arrays]
    attributes = {"title": "A made-up study"}
    return dataset(axes, fixed, data | status, variables, {}, attributes, branches)


def drawn(
    kind: str, cube: xr.Dataset | None = None, branches: xr.Dataset | None = None, **settings: Any
) -> Figure:
    """Figure of a cube and of branches of orbits, with every warning an error."""
    with style(), warnings.catch_warnings():
        warnings.simplefilter("error")
        return draw(kind, {"cube": cube, "orbits": branches}, **settings)


def drawn_by(kind: ModuleType, results: Mapping[str, Any], **settings: Any) -> Figure:
    """Laid-out figure of a kind that belongs to a study of its own, by its module."""
    with style():
        return laid_out(kind.draw(results, class_in(kind, ProductBase).model_construct(**settings)))


def laid_out(figure: Figure) -> Figure:
    """Make the layout of a figure, which takes most of the time of drawing it."""
    with style(), warnings.catch_warnings():
        warnings.simplefilter("error")
        canvas = FigureCanvasAgg(figure)
        for _ in range(2):  # as saving does: ticks may change with the first layout
            canvas.draw()
    return figure


def legend_texts(figure: Figure) -> list[str]:
    """Entries of the legend, each as one line."""
    texts = (text.get_text() for legend in figure.legends for text in legend.get_texts())
    return [" ".join(text.split()) for text in texts]


def assert_nothing_overlaps(figure: Figure) -> None:
    """Heading, panels and legend lie within the page and apart."""
    renderer = laid_out(figure).canvas.get_renderer()
    with style():  # ticks are made as they are needed
        boxes = [ax.get_tightbbox(renderer) for ax in figure.axes]
        boxes += [legend.get_window_extent(renderer) for legend in figure.legends]
        boxes.append(figure._suptitle.get_window_extent(renderer))
    whole = figure.bbox
    for k, box in enumerate(boxes):
        assert box.x0 >= whole.x0 - 1
        assert box.x1 <= whole.x1 + 1
        assert box.y0 >= whole.y0 - 1
        assert box.y1 <= whole.y1 + 1
        for other in boxes[k + 1 :]:
            apart = (
                box.x1 <= other.x0 + 2
                or other.x1 <= box.x0 + 2
                or box.y1 <= other.y0 + 2
                or other.y1 <= box.y0 + 2
            )
            assert apart


def svg_of(figure: Figure, folder: Path) -> str:
    """Text of a figure's SVG, which is of a fair size."""
    path = folder / "figure.svg"
    with style(), warnings.catch_warnings():
        warnings.simplefilter("error")
        save(figure, path)
    assert 5_000 < path.stat().st_size < 2_000_000
    return path.read_text(encoding="utf-8")
