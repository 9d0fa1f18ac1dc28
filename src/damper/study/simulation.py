"""`damper.simulate`: a parameter study in Python, without files."""

import json
import os
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from inspect import Parameter, Signature, signature
from typing import Any

import numpy as np
import xarray as xr

from damper.observers import observer_class, requests
from damper.parameters import Parameters, SIParameters, State
from damper.parameters.forcing import HARMONIC, Forcing, read_forcing
from damper.parameters.masses import listed, own_names, own_values, refuse_untaken, taken_by_none
from damper.parameters.named import completed
from damper.parameters.names import common_name, unknown_name
from damper.parameters.quantities import ALL, INITIAL_NAMES, is_si, ordered
from damper.parameters.quantity import filled, real
from damper.parameters.run import DEFAULTS, settings_text
from damper.parameters.structural import StructureParameters
from damper.parameters.tables import TABLE_OF, Table, listed_tables, read_table
from damper.parameters.unit_text import number_in
from damper.parameters.units import SI_UNITS
from damper.parameters.unusual import unusual_damper
from damper.parameters.warned import warn
from damper.study.axes import clean
from damper.sweep.branches import DIRECTIONS
from damper.sweep.cube import REFERENCES, gather
from damper.sweep.grid import nearest_value
from damper.sweep.points import require_parameters
from damper.sweep.progress import progress_bar
from damper.sweep.record import record
from damper.sweep.slices import simulate_slice
from damper.sweep.structures import simulate_structure

#: What a parameter may be: a number, or a sequence that makes a dimension.
Values = float | Sequence[float]

#: Observers of a call that names none.
USUAL = ("stroboscopic_section", "impacts", "bursts")


def simulate(
    parameters: Parameters | SIParameters | None = None,
    *,
    observers: Iterable[str] | Mapping[str, Mapping[str, Any] | None] = USUAL,
    follow: Mapping[str, str] | None = None,
    initial: str = "rest",
    forcing: Forcing | str = HARMONIC,
    masses: Sequence[Mapping[str, Any]] | None = None,
    restitution_table: Sequence[Sequence[float]] | str | os.PathLike[str] | None = None,
    restitution_table_left: Sequence[Sequence[float]] | str | os.PathLike[str] | None = None,
    draws: Mapping[str, Any] | None = None,
    state: State | None = None,
    workers: int | None = None,
    **given: Any,
) -> xr.Dataset:
    """Simulate every combination of the given values.

    With `structure`, or parameters that have one, runs are those of free masses on a structure:
    sequences make dimensions of `gap_0`, `mode_1_frequency` and other numbers, and every run is
    measured whole: motion of each point, energy of each mode, impacts of each free mass, powers.
    docs/structures.md lists the observers that go with a structure.

    Else the parameters are those of `damper.Parameters`, or in their place those of
    `damper.SIParameters`: then initial quantities, yield speed and dataset are in m, s and J, too.
    A sequence makes a dimension of its name, in the order of these classes; a number makes a scalar
    coordinate. A value of a sequence that differs from a decimal by roundoff alone, as those of
    `numpy.linspace` do, becomes this decimal, so that ``cube.sel(clearance=0.3)`` finds it.

    Parameters
    ----------
    parameters : Parameters or SIParameters, optional
        A damper, also on a structure, instead of all its values by name; those that are given
        replace its own.
    {quantities}
    {run}
    observers : iterable of str, or mapping of str to settings
        What to measure: ``stroboscopic_section`` or ``impact_section``, ``impacts``, ``bursts``,
        ``response``, ``trajectory``; see `damper.observers`. What is not asked for costs nothing.
        When not given: ``stroboscopic_section``, ``impacts`` and ``bursts``, those of each of
        `masses`.

    Other Parameters
    ----------------
    {options}
    follow : mapping of str to str, optional
        Continuation: an axis -> "up", "down" or "both". Each of its points starts from its
        neighbour's end, and the dataset has a dimension ``direction``.
    initial : {"rest", "steady"}
        Where the primary starts: at rest or on its steady linear response.
    forcing : Forcing or str
        Force on every damper, as for `damper.Parameters`; a harmonic force by default.
    masses : sequence of mapping, optional
        Several free masses, as for `damper.Parameters`, counted from 0. A sequence among their
        values makes a dimension, such as ``clearance_1`` of mass 1; these names may be arguments
        and drawn as well. A quantity that every mass gives may be left out for all.
    restitution_table, restitution_table_left : sequence of (float, float) or path, optional
        In place of `restitution` and `restitution_left`, as for `damper.Parameters`.
    draws : mapping, optional
        Quantities at random, the same draws at every point, along a dimension ``draw``:
        ``{"count": 20, "seed": 1, "initial_position": [-1, 1], "restitution": [0.5, 0.7]}``. In
        place of a range, a mapping of ``range``, ``spacing`` ("linear" or "log"), and ``values``,
        from which a ``share`` of the draws take theirs.
    state : State, optional
        Start of every run, in place of `initial` and `draws` of the state.
    workers : int, optional
        Threads to use. By default each core has a thread; fewer than eight points share a single
        thread. The result is the same for any number of threads. Without numba there is one.

    Returns
    -------
    xarray.Dataset
        Dimensions are the given sequences, ``direction`` and ``draw`` if asked for, and those of
        the observers (``sample``, ...). Lengths are in units of F0/K, or of what takes its place
        under `forcing`, which `scaled_by` says; times in units of sqrt(M/K); or all in SI.

    Raises
    ------
    ValueError, TypeError
        Names parameter, value and range for bad input, and what to change where the runs would not
        end or not go into memory; before anything is run.

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
    run = DEFAULTS | {name: given.pop(name) for name in DEFAULTS if name in given}
    if isinstance(parameters, StructureParameters) or given.get("structure") is not None:
        given |= {} if forcing is HARMONIC else {"forcing": forcing}
        tabled = {
            "masses": masses,
            "restitution_table": restitution_table,
            "restitution_table_left": restitution_table_left,
        }
        given |= {name: value for name, value in tabled.items() if value is not None}
        asked = [] if observers is USUAL else requests(observers)
        _refuse_on_structures(
            observers=any("structure" not in observer_class(n).models for n, _ in asked),
            follow=_is_given(follow),
            initial=not (isinstance(initial, str) and initial == "rest"),
            draws=_is_given(draws),
        )
        with progress_bar() as progress:
            on_structure: Any = parameters
            return simulate_structure(
                on_structure, given, run, state, progress, dict(asked), workers
            )
    for name in given:
        if name not in ALL:
            raise unknown_name("argument", name, _SIGNATURE.parameters)
    given = {name: value for name, value in given.items() if value is not None}
    tables: dict[str, Any] = {
        "restitution_table": restitution_table,
        "restitution_table_left": restitution_table_left,
    }
    given, tables, force, count = _damper_of(
        parameters, given, masses, tables, forcing, draws if isinstance(draws, Mapping) else ()
    )
    random = _checked_starts(initial, draws, given, state)
    values = {"phase": 0.0} | given
    fixed, axes = _fixed_and_axes({n: values[n] for n in ordered(values) if n not in random}, force)
    if observers is USUAL and count:
        observers = {name: {} for name in USUAL} | {"bursts": {"bodies": list(range(count))}}
    observers = list(observers) if isinstance(observers, Iterator) else observers
    observers = _placed(observers, axes)
    follow = _checked_follow(follow, axes)
    if is_si(fixed | axes):
        for text in unusual_damper({n: [v] for n, v in fixed.items()} | axes, force.kind):
            warn(text)
    with progress_bar() as progress:
        part = simulate_slice(
            fixed,
            axes,
            observers=observers,
            primary=initial,
            forcing=force,
            masses=count,
            tables=tables,
            draws=random,
            follow=follow,
            state=state,
            progress=progress,
            workers=workers,
            **run,
        )
    attributes = {
        "title": "Impact damper simulation",
        "references": REFERENCES,
        **record(
            observers,
            "" if state else initial,
            {n: v if isinstance(v, Mapping) else type(DEFAULTS[n])(v) for n, v in run.items()},
            {name: axes[name] for name in follow},
            force,
            count,
            tables,
        ),
    }
    if state is not None:
        attributes["initial"] = repr(state)
    if random:
        attributes["draws"] = json.dumps(random)
    return gather([part], axes, (), fixed, attributes, amplitude=force.amplitude)


def _damper_of(
    parameters: Parameters | SIParameters | None,
    given: dict[str, Any],
    masses: Sequence[Mapping[str, Any]] | None,
    tables: dict[str, Any],
    forcing: Forcing | str,
    draws: Collection[str],
) -> tuple[dict[str, Any], dict[str, Table], Forcing, int]:
    """Return quantities, tables by name, force and number of listed masses of what is given."""
    count, asked = 0, dict(given)
    if masses is not None:
        made = listed(masses)
        count, values = len(made), own_values(made)
        tables["masses"] = made
        for name in values:
            if name in given:
                raise ValueError(f"{name} is given, and in masses as well: one of the two")
        given |= values
    if parameters is not None:
        require_parameters(parameters)
        beside: dict[str, Any] = dict(parameters.given)
        force = beside.pop("forcing", HARMONIC)
        forcing = force if forcing is HARMONIC else forcing
        there = beside.pop("masses", ())
        if there and masses is None:
            count, beside = len(there), beside | own_values(map(dict, there))
            tables["masses"] = there
        for name, table in TABLE_OF.items():
            rows = beside.pop(table, None)
            if tables[table] is None and name not in given:
                tables[table] = rows
            elif tables[table] is not None:
                beside.pop(name, None)
        given = beside | given
    # A constant of all masses may be there, although no mass takes it.
    own = own_names(given, tables.get("masses"))
    untaken = [name for name in given if taken_by_none(name, own)]
    replaces = parameters is not None
    varied = [n for n in untaken if n in asked and (replaces or np.ndim(asked[n]))]
    refuse_untaken([*varied, *draws], own)
    given = {name: value for name, value in given.items() if name not in untaken}
    named = listed_tables(tables)
    unit = "m/s" if named and is_si(given) else "1"
    found = {name: read_table(name, rows, unit) for name, rows in named.items()}
    applied = read_forcing(forcing)
    values = completed(given | {"forcing": applied})
    del values["forcing"]
    return values, found, applied, count


def _fixed_and_axes(
    quantities: Mapping[str, Any], force: Forcing
) -> tuple[dict[str, float], dict[str, list[float]]]:
    """Return the numbers among the quantities, and the values of each sequence."""
    si = is_si(quantities)
    units = {q.name: q.units for q in (SIParameters if si else Parameters).quantities}
    units |= {name: SI_UNITS.get(ALL[name].units, "1") for name in INITIAL_NAMES if si}
    units |= {"force_amplitude": force.si_unit} if si else {}
    fixed: dict[str, float] = {}
    axes: dict[str, list[float]] = {}
    for name, value in quantities.items():
        wanted = f"{name}: must be a number or a non-empty one-dimensional sequence"
        own = [units.get(common_name(name), "1")]
        value = number_in(name, value, own)
        if hasattr(value, "__array__") and np.asarray(value).dtype.kind in "OU":
            value = np.asarray(value).tolist()
        words = value if isinstance(value, list | tuple) else [value]
        if any(isinstance(word, str) for word in words):
            read = [number_in(name, ALL[name].number_of(word), own) for word in words]
            value = read if isinstance(value, list | tuple) else read[0]
        try:
            column = np.asarray(value)
        except ValueError:
            raise ValueError(f"{wanted}, not {value!r}") from None
        if column.ndim == 0:
            real(name, value)
            fixed[name] = value
            continue
        if column.ndim != 1 or column.size == 0:
            raise ValueError(f"{wanted}, not an array of shape {column.shape}")
        for item in value if isinstance(value, list | tuple) else ():
            real(name, item)  # numpy makes text of all items where one is text
        numbers = column.dtype.kind in "iuf"
        axes[name] = clean(column.tolist()) if numbers else column.tolist()
        most, times = Counter(axes[name]).most_common(1)[0]
        if times > 1:
            raise ValueError(f"{name}: {most!r} is given {times} times")
    return fixed, axes


def _placed(observers: Any, axes: Mapping[str, Sequence[float]]) -> Any:
    """Return observers with the values of axes that their places mean."""
    if not isinstance(observers, Mapping):
        return observers
    found = dict(observers)
    for name, given in observers.items():
        if isinstance(given, Mapping) and isinstance(at := given.get("at"), Mapping):
            for axis in at:
                if axis not in axes:
                    raise ValueError(f"{name}.at: {unknown_name('axis', axis, axes)}")
            found[name] = {**given, "at": {n: nearest_value(n, axes[n], v) for n, v in at.items()}}
    return found


def _is_given(value: Any) -> bool:
    return value is not None and not (isinstance(value, Mapping) and not value)


def _refuse_on_structures(**given: bool) -> None:
    """Raise TypeError for an argument that is given, and that runs on structures do not know."""
    for name, is_given in given.items():
        if is_given:
            raise TypeError(
                f"{name} is not known on a structure: all of its points, masses and modes are "
                "always measured, in one run from rest or from state; leave it out"
            )


def _with_names(plain: Signature) -> Signature:
    """Signature with every quantity and setting of a run by name, in place of ``**given``."""
    named = [
        Parameter(q.name, Parameter.KEYWORD_ONLY, default=q.default, annotation="Values")
        for q in ALL.values()
    ]
    named += [
        Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=type(default))
        for name, default in DEFAULTS.items()
    ]
    first, *rest = plain.parameters.values()
    others = [p for p in rest if p.kind is Parameter.KEYWORD_ONLY]
    return plain.replace(parameters=[first, *named, *others])


# For `help` and for completion: what the declarations of the quantities say.
_SIGNATURE = _with_names(signature(simulate))
simulate.__signature__ = _SIGNATURE  # type: ignore[attr-defined]
simulate.__doc__ = filled(simulate.__doc__, ALL.values(), kind="float or 1-D").replace(
    "{run}\n", settings_text()
)


def _checked_starts(
    initial: str, draws: Mapping[str, Any] | None, given: Mapping[str, Any], state: State | None
) -> dict[str, Any]:
    """Check where runs start and what is drawn by the rules of the study language; the latter."""
    if not isinstance(initial, str):
        raise TypeError(f"initial = {initial!r}: must be 'rest' or 'steady'; a state is `state`")
    if not isinstance({} if draws is None else draws, Mapping):
        raise TypeError(f"draws = {draws!r}: must be a mapping of count, seed and quantities")
    names = [name for name in INITIAL_NAMES if name in given or name in (draws or ())]
    if state is not None and (names or initial != "rest"):
        raise ValueError("state stands alone: no initial quantities and no initial beside it")
    if initial == "rest" and not draws:
        return {}
    from damper.study.settings import Starts, draw_settings  # pydantic with it

    starts = Starts.checked("", {"initial": initial, "draws": _plain(draws or {})})
    for name in starts.draws:
        if name in given:
            raise ValueError(f"{name} is given, and drawn as well: one of the two")
    return draw_settings(starts.draws)


def _plain(data: Any) -> Any:
    """Return what is given with numpy's numbers and arrays as Python's."""
    if isinstance(data, Mapping):
        return {key: _plain(value) for key, value in data.items()}
    return data.tolist() if isinstance(data, np.generic | np.ndarray) else data


def _checked_follow(follow: Mapping[str, str] | None, axes: Mapping[str, Any]) -> dict[str, str]:
    if not isinstance({} if follow is None else follow, Mapping):
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
