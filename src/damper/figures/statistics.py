"""Means under noise over one axis: the energies, and the losses of power."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import Field

from damper.analysis.closed_forms import damper_at
from damper.analysis.statistics import means_under_noise
from damper.figures.common import layout
from damper.figures.common.panels import finish, legend_line, note_empty_panel, panel_grid
from damper.figures.common.style import BLACK, FREE_MASS, ORANGE, PAGE, PRIMARY
from damper.observers.statistics import MEANS
from damper.parameters.lazy import Figure, xr
from damper.study import products
from damper.study.fields import Text

#: Panels: title, axis and means of each, every mean with its style.
_ENERGIES: dict[str, dict[str, Any]] = {
    "mean_potential_energy": {"color": PRIMARY, "marker": "o", "label": "primary, potential"},
    "mean_kinetic_energy": {"color": PRIMARY, "marker": "x", "label": "primary, kinetic"},
    "mean_free_mass_energy": {"color": FREE_MASS, "marker": "s", "label": "free mass, kinetic"},
}
_POWERS: dict[str, dict[str, Any]] = {
    "mean_loss": {"color": BLACK, "marker": "D", "label": "lost, in all"},
    "mean_impact_loss": {"color": ORANGE, "marker": "v", "label": "lost in impacts"},
}
_POINTS: dict[str, Any] = {"ms": 3.5, "lw": 0.9, "mfc": "none"}
_LAW: dict[str, Any] = {"color": "#999999", "lw": 2.0, "zorder": 1.0}


class StatisticsFigure(products.OfNoise, products.FigureSettings):
    """Energies under noise over those of the primary alone, and the power that is lost.

    Bars are confidence limits, over all draws where there are several.
    """

    # All draws are one.
    overlays: ClassVar[bool] = True
    roles: ClassVar[Mapping[str, products.Role]] = {
        "along": products.Role(least=2),
        "each": products.Role(),
    }

    along: Annotated[Text, Field(description="Axis of the abscissa, such as the restitution.")]
    each: products.Each = None
    at: products.At = None
    caption: products.Caption = None


def draw(results: Mapping[str, Any], settings: StatisticsFigure) -> Figure:
    """Draw the means of energies and of power over one axis."""
    cube, along = results["cube"], settings.along
    names = [name for mean in MEANS for name in (mean, f"{mean}_error")]
    keep = [along, *({"draw"} & {*cube.dims})]
    place = layout.select(cube, names, settings.at, keep).sortby(along)
    means = means_under_noise(place).set_index(["mean", along])
    power = means.loc["mean_input"]["white"].astype(float)
    # Half of the temperature D / (2 zeta), in the cube's units.
    alone = [_alone(place.sel({along: value}), power.loc[value]) for value in power.index]
    figure, ((left, right),) = panel_grid(1, 2, height=3.1, sharex=False)
    for ax, drawn, size in ((left, _ENERGIES, alone), (right, _POWERS, power)):
        for name, style in drawn.items():
            found = means.loc[name]
            value, upper = (found[key].to_numpy(float) / size for key in ("value", "upper"))
            ax.errorbar(found.index, value, upper - value, **_POINTS | style)
        if means.loc["mean_input"]["value"].isna().all():
            note_empty_panel(ax)
            ax.set_xlim(min(found.index), max(found.index))
        ax.axhline(1.0, **_LAW)
        ax.set_ylim(bottom=0.0)
    label = layout.place_label(place, along, 0.4 * PAGE)
    left.set_xlabel(label)
    right.set_xlabel(label)
    left.set_ylabel("mean energy over that of the\nprimary without a damper")
    right.set_ylabel("power lost over that\nwhich white noise brings")
    handles = [
        legend_line(style["label"], **_POINTS | {k: v for k, v in style.items() if k != "label"})
        for style in (*_ENERGIES.values(), *_POWERS.values())
    ]
    handles.append(
        legend_line("closed form of white noise, on the left at a restitution of 1", **_LAW)
    )
    remarks = [f"means over {place.sizes['draw']} draws"] if "draw" in place.dims else []
    return finish(
        figure, place.drop_dims("draw", errors="ignore"), settings.caption, handles, remarks
    )


def _alone(place: xr.Dataset, power: float) -> float:
    """Mean potential energy of the primary without a damper, from the power of a cycle."""
    damper, _ = damper_at(place.isel(draw=0) if "draw" in place.dims else place)
    # An undamped primary alone has no mean.
    return power / damper.cycle / (4.0 * damper.damping_ratio) if damper.damping_ratio else math.inf
