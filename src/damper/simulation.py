"""`damper.simulate`: a parameter study in Python, without files."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from damper.engine import DEFAULT_ACCURACY, DEFAULT_MAX_EVENTS
from damper.parameters import PARAMETER_NAMES, State
from damper.study.cube import REFERENCES, gather
from damper.study.slices import simulate_slice


def simulate(
    *,
    mass_ratio: float | Sequence[float],
    damping_ratio: float | Sequence[float],
    frequency_ratio: float | Sequence[float],
    clearance: float | Sequence[float],
    restitution: float | Sequence[float],
    phase: float | Sequence[float] = 0.0,
    transient: int = 200,
    periods: int = 50,
    observers: Iterable[str] | Mapping[str, Mapping[str, Any] | None] = (
        "stroboscopic_section",
        "impacts",
        "bursts",
    ),
    state: State | None = None,
    accuracy: float = DEFAULT_ACCURACY,
    max_events: int = DEFAULT_MAX_EVENTS,
) -> xr.Dataset:
    """Simulate every combination of the given parameter values.

    Parameters
    ----------
    mass_ratio, damping_ratio, frequency_ratio, clearance, restitution, phase : float or 1-D
        The parameters of `damper.Parameters`. A sequence makes a dimension of that name, in the
        order of this list; a number makes a scalar coordinate.
    transient, periods : int
        Forcing periods to discard, then to record.
    observers : iterable of str, or mapping of str to settings
        What to measure: ``stroboscopic_section`` or ``impact_section``, ``impacts``, ``bursts``;
        see `damper.observers`. What is not asked for costs nothing.

    Other Parameters
    ----------------
    state : State, optional
        Start of every run; from rest with y = 0 when not given.
    accuracy : float, default 1e-12
        Largest error of an accumulation time, in units of sqrt(M/K).
    max_events : int, default 1_000_000
        Events after which one run stops; `status` says so.

    Returns
    -------
    xarray.Dataset
        Dimensions are the given sequences plus those of the observers (``sample``, ...). Lengths
        in units of F0/K, times in sqrt(M/K).

    Raises
    ------
    ValueError, TypeError
        Names parameter, value and range for bad input; before anything is run.

    Examples
    --------
    >>> import damper
    >>> cube = damper.simulate(mass_ratio=0.1, damping_ratio=0.02, frequency_ratio=1.3,
    ...                        clearance=0.05, restitution=[0.3, 0.6], transient=20, periods=5)
    >>> cube.chatter.sizes
    Frozen({'restitution': 2})
    >>> cube.displacement.dims
    ('restitution', 'sample')
    """
    given = dict(
        zip(
            PARAMETER_NAMES,
            (mass_ratio, damping_ratio, frequency_ratio, clearance, restitution, phase),
            strict=True,
        )
    )
    axes: dict[str, list[float]] = {}
    fixed: dict[str, float] = {}
    for name, value in given.items():
        if np.ndim(value) == 0:
            fixed[name] = value  # type: ignore[assignment]
            continue
        values = np.asarray(value)
        if values.ndim != 1 or values.size == 0:
            raise ValueError(
                f"{name}: must be a number or a non-empty one-dimensional sequence, "
                f"not an array of shape {values.shape}"
            )
        axes[name] = values.tolist()
    part = simulate_slice(
        fixed,
        axes,
        transient=transient,
        periods=periods,
        observers=observers,
        accuracy=accuracy,
        max_events=max_events,
        state=state,
    )
    attributes = {
        "title": "Impact damper simulation",
        "references": REFERENCES,
        "transient_periods": int(transient),
        "recorded_periods": int(periods),
        "accuracy": accuracy,
        "max_events": int(max_events),
    }
    return gather([part], axes, (), fixed, attributes)
