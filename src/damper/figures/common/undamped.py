"""Amplitudes without damper, to be drawn beside those with one."""

from __future__ import annotations

from typing import Any

from damper.figures.common.style import WITHOUT
from damper.parameters.lazy import xr

#: How they are drawn.
REFERENCE: dict[str, Any] = {"color": WITHOUT, "lw": 2.0}
#: Amplitude -> what it is over that without damper.
OVER = {"peak_displacement": "amplitude_ratio", "rms_displacement": "rms_ratio"}


def undamped(place: xr.Dataset, name: str, *along: str | None) -> xr.DataArray:
    """Amplitude without damper along some axes, from any place where its ratio is known."""
    ratio = place[OVER[name]]
    found = place[name] / ratio.where(ratio > 0.0)
    found.attrs = dict(place[name].attrs)
    return found.max([dim for dim in found.dims if dim not in along], keep_attrs=True)
