"""`damper.simulate`: a parameter study in Python, without files."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from damper.engine.trajectory import DEFAULT_ACCURACY, DEFAULT_MAX_EVENTS
from damper.parameters import State
from damper.parameters.quantities import ALL, INITIAL_NAMES
from damper.sweep.branches import DIRECTIONS
from damper.sweep.cube import REFERENCES, gather
from damper.sweep.slices import simulate_slice

#: What a parameter may be: a number, or a sequence that makes a dimension.
Values = float | Sequence[float]


def simulate(
    *,
    mass_ratio: Values | None = None,
    damping_ratio: Values | None = None,
    frequency_ratio: Values | None = None,
    clearance: Values | None = None,
    primary_mass: Values | None = None,
    damping: Values | None = None,
    stiffness: Values | None = None,
    force_amplitude: Values | None = None,
    forcing_frequency: Values | None = None,
    free_mass: Values | None = None,
    gap: Values | None = None,
    restitution: Values | None = None,
    phase: Values = 0.0,
    support_stiffness_ratio: Values | None = None,
    support_damping_ratio: Values | None = None,
    support_stiffness: Values | None = None,
    support_damping: Values | None = None,
    support_damping_factor: Values | None = None,
    contact_stiffness_ratio: Values | None = None,
    contact_stiffness: Values | None = None,
    contact_tension: Values | None = None,
    modulation_depth: Values | None = None,
    modulation_order: Values | None = None,
    modulation_phase: Values | None = None,
    initial_displacement: Values | None = None,
    initial_velocity: Values | None = None,
    initial_position: Values | None = None,
    initial_relative_velocity: Values | None = None,
    transient: int = 200,
    periods: int = 50,
    observers: Iterable[str] | Mapping[str, Mapping[str, Any] | None] = (
        "stroboscopic_section",
        "impacts",
        "bursts",
    ),
    follow: Mapping[str, str] | None = None,
    initial: str | Mapping[str, Any] = "rest",
    state: State | None = None,
    accuracy: float = DEFAULT_ACCURACY,
    max_events: int = DEFAULT_MAX_EVENTS,
) -> xr.Dataset:
    """Simulate every combination of the given values.

    A sequence makes a dimension of its name, in the order of the list below; a number makes a
    scalar coordinate.

    Parameters
    ----------
    mass_ratio, damping_ratio, frequency_ratio, clearance : float or 1-D
        The parameters of `damper.Parameters`.
    primary_mass, damping, stiffness, force_amplitude, forcing_frequency, free_mass, gap
        The parameters of `damper.SIParameters`, in place of the four ratios; the dataset is in m, s
        and J then.
    restitution, phase : float or 1-D
        Of both.
    support_stiffness_ratio, ..., modulation_phase : float or 1-D, optional
        The other parameters of `damper.Parameters` and `damper.SIParameters`, which choose a model
        other than the rigid damper.
    initial_displacement, initial_velocity : float or 1-D, optional
        Of the primary; 0 when not given.
    initial_position : float or 1-D, optional
        Of the free mass between the walls: -1 left wall, 0 centre, 1 right wall.
    initial_relative_velocity : float or 1-D, optional
        Of the free mass relative to the primary.
    transient, periods : int
        Forcing periods to discard, then to record.
    observers : iterable of str, or mapping of str to settings
        What to measure: ``stroboscopic_section`` or ``impact_section``, ``impacts``, ``bursts``,
        ``response``, ``trajectory``; see `damper.observers`. What is not asked for costs nothing.

    Other Parameters
    ----------------
    follow : mapping of str to str, optional
        Continuation: an axis -> "up", "down" or "both". Each of its points starts from its
        neighbour's end, and the dataset has a dimension ``direction``.
    initial : {"rest", "steady"} or mapping
        Where the primary starts: at rest or on its steady linear response. A mapping gives random
        states along a dimension ``draw``:
        ``{"draws": 20, "seed": 1, "initial_position": [-1, 1]}``.
    state : State, optional
        Start of every run, in place of all that.
    accuracy : float, default 1e-12
        Largest error of an accumulation time, in units of sqrt(M/K).
    max_events : int, default 1_000_000
        Budget of one run, after which it stops and `status` says so: events, and hundreds of
        evaluations that find none (`damper.engine.trajectory.Trajectory`).

    Returns
    -------
    xarray.Dataset
        Dimensions are the given sequences, ``direction`` and ``draw`` if asked for, and those of
        the observers (``sample``, ...). Lengths in units of F0/K, times in sqrt(M/K), or SI.

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
    everything = locals()
    given = {name: everything[name] for name in everything if name in ALL}
    given = {name: value for name, value in given.items() if value is not None}
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
    settings = _checked_initial(initial, given, state)
    follow = _checked_follow(follow, axes)
    part = simulate_slice(
        fixed,
        axes,
        transient=transient,
        periods=periods,
        observers=observers,
        accuracy=accuracy,
        max_events=max_events,
        initial=settings,
        follow=follow,
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
    if state is not None:
        attributes["initial"] = repr(state)
    elif settings:
        attributes["initial"] = ", ".join(f"{k}: {v}" for k, v in settings.items())
    for name, way in follow.items():
        attributes["follow"] = f"{name}: {way}"
    return gather([part], axes, (), fixed, attributes)


def _checked_initial(
    initial: str | Mapping[str, Any], given: Mapping[str, Any], state: State | None
) -> dict[str, Any]:
    """Check where runs start by the rules of the study language."""
    names = [name for name in INITIAL_NAMES if name in given]
    if state is not None and (names or initial != "rest"):
        raise ValueError("state stands alone: no initial quantities and no initial beside it")
    if initial == "rest":
        return {}
    from damper.study.settings import Initial  # pydantic with it

    data: Any = initial
    if isinstance(initial, Mapping):
        numpy = (np.generic, np.ndarray)
        data = {k: v.tolist() if isinstance(v, numpy) else v for k, v in initial.items()}
    settings = Initial.checked("initial", data).settings()
    for name in names:
        if name in settings:
            raise ValueError(f"{name} is given, and random in initial as well: one of the two")
    return settings


def _checked_follow(follow: Mapping[str, str] | None, axes: Mapping[str, Any]) -> dict[str, str]:
    if not isinstance(follow or {}, Mapping):
        raise TypeError(f"follow = {follow!r}: must be a mapping of an axis to a direction")
    follow = dict(follow or {})
    if len(follow) > 1:
        raise ValueError(f"follow = {follow!r}: one axis at most, a run has one neighbour")
    for name, way in follow.items():
        if name not in axes or name in INITIAL_NAMES:
            allowed = ", ".join(axis for axis in axes if axis not in INITIAL_NAMES) or "none here"
            raise ValueError(f"follow: {name!r} is not a sequence of a parameter: {allowed}")
        if not isinstance(way, str) or way not in DIRECTIONS:
            raise ValueError(f"follow = {follow!r}: must be one of {', '.join(DIRECTIONS)}")
    return follow
