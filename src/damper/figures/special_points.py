"""Special points: where periodic motions change, as curves over two parameters."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from damper.figures import THEORY
from damper.figures.common.layout import head, legend, place_label, place_text
from damper.figures.common.style import COLUMN
from damper.figures.overlays.orbits import overlay_curves
from damper.parameters.quantities import ALL
from damper.parameters.units import attributes_of
from damper.study.fields import Text
from damper.study.messages import Faults
from damper.study.products import Caption, Offer, Product, need_orbits
from damper.study.study_file import See
from damper.study.yaml_file import words

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure

_PANEL = 2.2
"""Height of a panel in inches."""


class SpecialPointsFigure(Product):
    """Curves of special points over two parameters, a panel for each place of the other axes."""

    reads: ClassVar[tuple[str, ...]] = ("orbits.nc",)

    x: Annotated[Text, Field(description="Parameter of the abscissa.")]
    y: Annotated[
        Text,
        Field(description="Parameter of the ordinate; curves of the study's orbits have both."),
    ]
    theory: Annotated[
        Literal["small_mass_limit"] | None,
        Field(
            description="Theory to draw over it: the restitution up to which bursts complete, in "
            "the limit of a small free mass; over restitution and clearance."
        ),
    ] = None
    caption: Caption = None
    see: See = None

    @classmethod
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        need_orbits((), offer, faults)
        asked = settings.get("x"), settings.get("y")
        over = " and ".join(map(str, asked))
        pairs = _curves(offer.orbits)
        if offer.orbits and set(asked) not in [{*pair} for pair in pairs]:
            allowed = words(" and ".join(pair) for pair in pairs) or "curves in orbits"
            faults.add(("y",), f"the study follows no special points over {over}", allowed)
        elif settings.get("theory") and set(asked) != {"restitution", "clearance"}:
            message = f"the small-mass limit has no place over {over}"
            faults.add(("theory",), message, "restitution and clearance")


def _curves(orbits: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Pairs of parameters that the curves of a study have; its own checks report what is wrong."""
    entries = [entry for entry in orbits.values() if isinstance(entry, dict)]
    return [
        (str(entry.get("along")), str(other))
        for entry in entries
        for ranges in (entry.get("curves") or {}).values()
        for other in ranges
    ]


def draw(
    branches: xr.Dataset, *, x: str, y: str, theory: str | None = None, caption: str | None = None
) -> Figure:
    """Draw curves of special points.

    Parameters
    ----------
    branches : xarray.Dataset
        The study's orbits, from `damper.analysis.orbits.follow_orbits`.
    x, y : str
        Parameters of abscissa and ordinate.
    theory : {"small_mass_limit"}, optional
        Draw the small-mass limit of the restitution up to which bursts complete.
    caption : str, optional
        Heading above the line of parameters; the study's title when not given.

    Returns
    -------
    matplotlib.figure.Figure
    """
    from matplotlib.figure import Figure

    axes_of = (str(name) for name in branches.data_vars if branches[name].attrs.get("axis"))
    others = [name for name in axes_of if name not in (x, y)]
    panels = _panels(branches, x, y, others)
    size = (COLUMN, 1.0 + _PANEL * len(panels))
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False).ravel()
    drawn: dict[str, Artist] = {}
    for ax, panel in zip(axes, panels, strict=True):
        ax.set(xlim=panel[x].values, ylim=panel[y].values)
        handles = overlay_curves(ax, panel, x, y, branches)
        if theory:
            handles += import_module(THEORY[theory]).overlay(ax, panel, x, y)
        drawn |= {str(handle.get_label()): handle for handle in handles}
        ax.set_ylabel(place_label(panel, y, _PANEL))
        if len(panels) > 1:
            texts = (place_text(panel, name, float(panel[name])) for name in others)
            ax.set_title(", ".join(texts), loc="left")
    axes[-1].set_xlabel(place_label(panels[0], x, COLUMN))
    head(figure, panels[0].drop_vars(others if len(panels) > 1 else []), caption)
    legend(figure, list(drawn.values()))
    return figure


def _panels(branches: xr.Dataset, x: str, y: str, others: list[str]) -> list[xr.Dataset]:
    """Places of the other axes: scalar coordinates, and the ends of x and y, which all share."""
    import xarray as xr

    along = branches.along.values[branches.curve_branch.values]
    mine = [{a, b} == {x, y} for a, b in zip(along, branches.curve_other.values, strict=True)]
    points = branches.isel(curve_point=np.array(mine)[branches.curve.values])
    values = {True: points.curve_value, False: points.curve_other_value}
    ends = {}
    for name in (x, y):
        array = values[name == along[mine][0]]
        attrs = attributes_of(ALL[name].units)
        ends[name] = (name, [float(array.min()), float(array.max())], attrs)
    rows = np.unique(branches.curve_branch.values[mine])
    places = {tuple(float(branches[name][k]) for name in others): k for k in rows}
    fixed = {str(name): value for name, value in branches.coords.items() if value.ndim == 0}
    base = xr.Dataset(coords=fixed, attrs=branches.attrs)
    return [
        base.assign_coords({name: branches[name][k] for name in others} | ends)
        for k in places.values()
    ]
