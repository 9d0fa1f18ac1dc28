"""How the points of a cube were run: written into its attributes, and read from there."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from damper.parameters.forcing import (
    EACH_DRAW,
    HARMONIC,
    Forcing,
    class_of,
    force_text,
    forcing_of,
)
from damper.parameters.quantities import is_si
from damper.parameters.setting import END
from damper.parameters.units import units_of

#: Settings of runs that a cube's attributes name otherwise.
_ATTRIBUTES = {"transient": "transient_periods", "periods": "recorded_periods"}


def record(
    observers: Iterable[str] | Mapping[str, Mapping[str, Any] | None],
    primary: str,
    run: Mapping[str, Any],
    followed: Mapping[str, Sequence[float]],
    forcing: Forcing = HARMONIC,
    masses: int = 0,
    tables: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Attributes of a cube from the arguments of `damper.sweep.runs.run_points`.

    `primary` is empty for runs from a given state; `run` are the settings of every run; `followed`
    is the axis of continuation, if any, with all its values: a part of the cube has fewer.
    """
    if isinstance(observers, str):
        observers = [observers]
    settings = observers if isinstance(observers, Mapping) else dict.fromkeys(observers)
    plain = {name: dict(given or {}) for name, given in settings.items()}
    return {
        **{
            _ATTRIBUTES.get(name, name): f"time {value['time']}"
            if isinstance(value, Mapping)
            else value
            for name, value in run.items()
        },
        "observers": json.dumps(
            plain, default=lambda value: getattr(value, "tolist", lambda: [*value])()
        ),
        "primary_starts": primary,
        **({"followed": json.dumps(dict(followed))} if followed else {}),
        **({} if forcing == HARMONIC else {"forcing": json.dumps(forcing.settings)}),
        **({"masses": masses} if masses else {}),
        **({"restitution_tables": json.dumps(dict(tables))} if tables else {}),
    }


def observers_of(cube: Any) -> dict[str, dict[str, Any]]:
    """Observers that a cube was made with -> their settings, as `damper.simulate` takes them.

    Raises
    ------
    ValueError
        When the cube does not say so.
    """
    return _said(cube, "observers", _settings)  # type: ignore[no-any-return]


def force_of(cube: Any) -> dict[str, Forcing]:
    """Return what drives a cube's dampers, as an argument; none where it is the default.

    Raises
    ------
    ValueError
        Where it is a record, whose samples the cube has not, or a noise of each draw.
    """
    settings = force_settings(cube)
    if not settings:
        return {}
    if settings.get("seed") == EACH_DRAW:
        if "noise_seed" not in cube.coords or cube.noise_seed.ndim:
            raise ValueError("each draw of the cube has a noise of its own: choose a draw")
        settings["seed"] = int(cube.noise_seed)
    return {"forcing": forcing_of(settings)}


def force_settings(cube: Any) -> dict[str, Any]:
    """Return kind and settings of a cube's force, empty for the default; ValueError if damaged."""
    return _said(cube, "forcing", _force) if "forcing" in cube.attrs else {}


def force_words(cube: Any) -> str:
    """Return what drives a cube's dampers in words, nothing for the default.

    Structures, whose cubes have modes, are in SI units.
    """
    force, names = force_settings(cube), list(map(str, cube.coords))
    return force_text(force, "mode" in names or is_si(names)) if force else ""


def unused_quantities(cube: Any) -> tuple[str, ...]:
    """Quantities that say nothing under a cube's force, as the clock of one without a frequency."""
    force = force_settings(cube)
    none = force.get("kind") == "none"
    clock = ("phase", "frequency_ratio", "forcing_frequency") if none or "of" in force else ()
    return (*clock, "force_amplitude") if none else clock


def masses_of(cube: Any) -> dict[str, Any]:
    """Return how many masses a cube's dampers list, and their tables, as arguments of
    `damper.parameters.tables.beside_numbers`; none where there are none."""
    read: dict[str, tuple[str, Callable[[Any], Any]]] = {
        "masses": ("masses", int),
        "tables": ("restitution_tables", _mapping),
    }
    return {k: _said(cube, name, of) for k, (name, of) in read.items() if name in cube.attrs}


def table_words(cube: Any) -> list[str]:
    """Return each table of restitution in words, from its first row to its last one."""
    tables = masses_of(cube).get("tables", {})
    return [
        f"{n.replace('_', ' ')} {rows[0][1]:g} to {rows[-1][1]:g}" for n, rows in tables.items()
    ]


def primary_of(cube: Any) -> str:
    """Where the primary of a cube's runs starts; ValueError for runs from a given state."""
    primary = _said(cube, "primary_starts", _start)
    if not primary:
        raise ValueError(
            "runs from a given state: more points of this cube cannot be run, except by damper.run"
        )
    return primary


def followed(cube: Any) -> dict[str, list[float]]:
    """Axis of a cube's continuation, if it is one -> all values that were followed.

    Raises
    ------
    ValueError
        When the cube does not say so.
    """
    if "direction" in cube.coords and "followed" not in cube.attrs:
        raise ValueError(
            "the cube has a dimension 'direction' and does not say what was followed: make it again"
        )
    return _said(cube, "followed", _mapping) if "followed" in cube.attrs else {}


def recorded(cube: Any, *observers: str) -> dict[str, Any]:
    """Arguments of `damper.sweep.runs.run_points` with which more points of a cube are run.

    Parameters
    ----------
    cube : xarray.Dataset
        From `damper.simulate`, or a study's.
    *observers : str
        Names of the observers; all observers of the cube when no name is given.

    Raises
    ------
    ValueError
        When the cube does not say how it was made, or was made without one of these observers, or
        its runs depend on more than their point: on a given state, a neighbour or a draw.
    """
    settings = observers_of(cube)
    # A cube of one direction has no such dimension but has neighbours.
    depend = {"direction": followed(cube), "draw": "draw" in cube.dims}
    for dim, several in depend.items():
        if several:
            raise ValueError(
                f"the cube has a dimension {dim!r}: more of its points can only be run where "
                "there is one run at each, from rest or from the steady response"
            )
    primary = primary_of(cube)
    for name in observers:
        if name not in settings:
            raise ValueError(f"the cube was made without the observer {name!r}, which is needed")
    return {
        # More points are not those that an observer was asked for.
        "observers": {
            name: {key: one for key, one in settings[name].items() if key != "at"}
            for name in observers or settings
        },
        "primary": primary,
        **force_of(cube),
        **masses_of(cube),
        **settings_of(cube),
    }


def settings_of(cube: Any) -> dict[str, Any]:
    """Return the settings of every run of a cube, as `damper.simulate` takes them."""
    from damper.parameters.run import DEFAULTS

    return {name: setting_of(cube, name) for name in DEFAULTS}


def setting_of(cube: Any, name: str) -> Any:
    """Return one setting of every run of a cube; ValueError where the cube does not say it."""
    from damper.parameters.run import DEFAULTS

    def read(value: Any) -> Any:
        if not isinstance(value, str):
            return type(DEFAULTS[name])(value)
        time = value.removeprefix("time ")
        return {"time": time if time == END else float(time)}

    return _said(cube, _ATTRIBUTES.get(name, name), read)


def _said(cube: Any, name: str, read: Callable[[Any], Any]) -> Any:
    """Return what `read` makes of an attribute; ValueError where it is missing or damaged."""
    try:
        return read(cube.attrs[name])
    except (KeyError, TypeError, ValueError):
        wrong = f"{cube.attrs[name]!r:.60}" if name in cube.attrs else "missing"
        raise ValueError(
            "the cube does not say how its points were run: make it by damper.simulate or a study "
            f"(its attribute {name!r} is {wrong})"
        ) from None


def _mapping(text: str) -> dict[str, Any]:
    return dict(json.loads(text))


def _start(text: str) -> str:
    if text not in ("", "rest", "steady"):
        raise ValueError
    return text


def _settings(text: str) -> dict[str, dict[str, Any]]:
    found = {name: dict(given) for name, given in _mapping(text).items()}
    if "at" in found.get("stroboscopic_section", ()):
        raise ValueError  # of an earlier version, where that was its `when`
    return found


def _force(text: str) -> dict[str, Any]:
    settings = _mapping(text)
    return settings | {"kind": class_of(settings["kind"]).kind}


def length_text(cube: Any) -> str:
    """Return how long the window of a cube's runs is, in words; nothing where it does not say."""
    length = str(cube.attrs.get(_ATTRIBUTES["periods"], ""))
    if length == f"time {END}":
        return f"all until the {force_settings(cube)['kind']} ends"
    if length.startswith("time "):
        time = units_of(cube.trajectory_time.attrs)
        return f"{float(length.removeprefix('time ')):g} {time}"
    return length and f"{length} cycles"
