"""What no setting of a study can check alone: parameters given once, axes that have a place."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import product as combinations
from typing import TYPE_CHECKING, Any

from damper.engine.steady import need_steady, steady_gain
from damper.observers.common.stretch import sample_steps
from damper.parameters import Parameters, SIParameters
from damper.parameters.dampers import BASIC
from damper.parameters.quantities import (
    ALL,
    DIMENSIONLESS_ONLY,
    INITIAL_NAMES,
    QUANTITIES,
    SI_ONLY,
    SI_QUANTITIES,
    is_si,
    nearest,
)
from damper.study.axes import axis_values
from damper.study.estimate import MOST_SLICES, refuse_excess
from damper.study.kinds import FIGURES, TABLES
from damper.study.messages import Faults
from damper.study.products import Offer, check_listed
from damper.study.settings import MOST_DRAWS, OBSERVER_SETTINGS, SECTIONS, Axis
from damper.study.yaml_file import as_part, words
from damper.sweep.branches import DIRECTIONS

if TYPE_CHECKING:
    from damper.study.model import Study
    from damper.study.settings import FollowedOrbit


def relate(raw: dict[str, Any], study: Study | None, faults: Faults) -> None:
    """Note what is wrong between the parts of a study, as written, with a mapping under every key.

    `study` is the same as checked; None after any fault in a part.
    """
    parameters, axes, observers = raw["parameters"], raw["axes"], raw["observers"]
    if isinstance(observers, dict):
        _relate_observers(observers, faults)
    if not isinstance(axes, dict):
        return
    sound = _sound_axes(axes) if study is None else study.axes
    if isinstance(parameters, dict):
        _give_once(parameters, axes, faults)
        _relate_initial(raw["initial"], parameters, axes, faults)
    if study is not None and not faults.lines:
        _check_dampers(study, faults)
        _check_steady(study, faults)
        _check_stretch(study, faults)
        _check_parts(study, faults)
        _check_records(study, faults)
        _check_orbits(study, faults)
    _follow_one(sound, faults)
    values = {name: axis_values(axis) if axis else None for name, axis in sound.items()}
    _limit_slices({n: len(axis_values(a)) for n, a in sound.items() if a and a.fan}, faults)
    if study is not None and not faults.lines:
        refuse_excess(study, faults)
    if not isinstance(observers, dict):
        return
    orbits = raw["orbits"] if isinstance(raw["orbits"], dict) else {}
    offer = Offer(values, observers, _branch_values(sound, raw["initial"]), orbits)
    for section, registry in (("figures", FIGURES), ("tables", TABLES)):
        entries = raw[section]
        for stem, settings in entries.items() if isinstance(entries, dict) else ():
            kind = settings.get("kind") if isinstance(settings, dict) else None
            if isinstance(kind, str) and kind in registry:
                found = Faults()
                registry[kind].fit(settings, offer, found)
                with faults.of(section, as_part(stem)):
                    found.settle()


def _check_stretch(study: Study, faults: Faults) -> None:
    """Refuse a sampled stretch that leaves the record, and a figure that starts after it."""
    # The classes of observers' settings are made when they are asked for.
    sampled: Any = study.observers.get("trajectory")
    if sampled is None:
        return
    loc = ("observers", "trajectory")
    length = study.periods - sampled.start if sampled.length is None else sampled.length
    try:
        sample_steps(sampled.samples_per_period, sampled.start, sampled.length, study.periods)
    except ValueError:
        message = (
            f"the stretch (start {sampled.start:g}, length {length:g}) does not lie in the "
            f"record of {study.periods} periods"
        )
        faults.add(loc, message, f"start + length <= {study.periods}, at least one sample step")
        return
    for section, stem, product in study.products():
        found = Faults()
        product.fit_stretch(length, found)
        with faults.of(section, stem):
            found.settle()


def _check_parts(study: Study, faults: Faults) -> None:
    """Refuse a part of the record that begins after it."""
    counted: Any = study.observers.get("chatter_bursts")
    for i, start in enumerate(counted.since if counted else ()):
        if start >= study.periods:
            message = f"begins {start:g} periods into a record of {study.periods}"
            allowed = f"number >= 0 and < {study.periods}"
            faults.add(("observers", "chatter_bursts", "since", i), message, allowed)


def _check_records(study: Study, faults: Faults) -> None:
    """Refuse figures and tables of single bursts where bursts are not listed."""
    bursts: Any = study.observers.get("bursts")
    if bursts is None or bursts.records:  # the products themselves report that there are none
        return
    for section, stem, product in study.products():
        if product.single_bursts:
            message = "shows bursts one by one, but the observer bursts lists none"
            faults.add((section, stem), message, "records >= 1 for bursts, such as records: 50")


def _check_orbits(study: Study, faults: Faults) -> None:
    """Refuse to follow a motion along what is no axis, or out of it."""
    if not study.orbits:
        return
    from damper.sweep.orbits.periodic import FOLLOWED

    axes = study.axis_values
    if is_si({**study.fixed, **axes}) or any(name in INITIAL_NAMES for name in axes):
        message = "periodic motions are followed over dimensionless parameters alone"
        faults.add(("orbits",), message, "a study without SI units and axes of initial quantities")
    for name, entry in study.orbits.items():
        if entry.along not in axes:
            faults.unknown(("orbits", name, "along"), "axis", entry.along, axes)
        elif entry.along not in FOLLOWED or len(axes[entry.along]) < 2:
            message = f"a motion cannot be followed along {entry.along}"
            faults.add(("orbits", name, "along"), message, "an axis of several values")
        elif not min(axes[entry.along]) <= entry.start <= max(axes[entry.along]):
            message = f"'start' is outside of the axis {entry.along} (value: {entry.start:g})"
            allowed = f"{min(axes[entry.along]):g} to {max(axes[entry.along]):g}"
            faults.add(("orbits", name, "start"), message, allowed)
        else:
            with faults.of("orbits", name):
                _check_curves(study, entry, faults)


def _check_curves(study: Study, entry: FollowedOrbit, faults: Faults) -> None:
    """Refuse places that no axis has, and curves that do not begin in their range."""
    from damper.sweep.orbits.periodic import FOLLOWED

    axes = study.axis_values
    others = [name for name in axes if name != entry.along]
    for axis, value in entry.at.items():
        if axis not in others:
            faults.unknown(("at", axis), "axis", axis, others)
        else:
            check_listed(("at", axis), axis, value, axes[axis], faults)
    for kind, ranges in entry.curves.items():
        for name, (low, high) in ranges.items():
            loc = ("curves", kind, name)
            own = axes.get(name, (study.fixed.get(name, 0.0),))
            own = (entry.at[name],) if name in entry.at else own
            if name == entry.along or name not in FOLLOWED:
                message = f"a point cannot be followed along {entry.along} and {name}"
                faults.add(loc, message, words(each for each in FOLLOWED if each != entry.along))
            elif not low <= min(own) <= max(own) <= high:
                message = f"the motion has {name} from {min(own):g} to {max(own):g}"
                faults.add(loc, message, "a range that holds these values; or give one value in at")


def corners(study: Study) -> list[Parameters]:
    """Parameters at the ends of all axes; ValueError when a value there is refused.

    Each dimensionless parameter is monotone in what it is formed from, so the ends show what the
    values between them are allowed to be and which model they ask for.
    """
    given = study.axis_values | {name: (value,) for name, value in study.fixed.items()}
    ends = {n: {min(v), max(v)} for n, v in given.items() if n not in INITIAL_NAMES}
    kind = SIParameters if is_si(ends) else Parameters
    points = (
        kind(**dict(zip(ends, values, strict=True))) for values in combinations(*ends.values())
    )
    return [p.dimensionless if isinstance(p, SIParameters) else p for p in points]


def _check_dampers(study: Study, faults: Faults) -> None:
    """Refuse values that no damper has, and to compare a damper with a theory of another one."""
    try:
        points = corners(study)
    except ValueError as error:
        faults.add(("parameters",), str(error))
        return
    acting = {name for point in points for name in point.acting}
    for name in study.interactive:
        if study.model != "rigid":
            message = (
                f"the page evaluates motions of the rigid damper, this is the {study.model} one"
            )
        elif unknown := acting.difference(BASIC, ("yield_speed",)):
            message = f"the page does not know {min(unknown)}"
        else:
            break
        faults.add(("figures", name, "interactive"), message, "false")
    if study.model != "rigid":
        message = f"its formulas are those of the rigid damper, this is the {study.model} one"
    elif laws := {point.law for point in points} - {"constant"}:
        message = f"its formulas have a constant restitution, this damper the {min(laws)} law"
    elif unknown := acting.difference(BASIC):
        message = f"its formulas do not know {min(unknown)}"
    else:
        return
    places = [("observers", "accumulation")] if "accumulation" in study.observers else []
    for section, made in (("figures", study.figures), ("tables", study.tables)):
        places += [(section, name) for name, product in made.items() if product.theoretical]
    for place in places:
        faults.add(place, message, "a study of the rigid damper with constant restitution")


def _check_steady(study: Study, faults: Faults) -> None:
    """Refuse a start on a steady response that does not exist."""
    if study.initial.primary != "steady":
        return
    try:
        for point in corners(study):
            need_steady(point)
    except ValueError as error:
        faults.add(("initial", "primary"), str(error), "rest")
        return
    given = study.axis_values | {name: (value,) for name, value in study.fixed.items()}
    if is_si(given):
        # The frequency ratio as `SIParameters` forms it.
        sizes = (given[n] for n in ("primary_mass", "stiffness", "forcing_frequency"))
        resonant = 0.0 in given["damping"] and any(
            omega * math.sqrt(mass / stiffness) == 1.0
            for mass, stiffness, omega in combinations(*sizes)
        )
    else:
        resonant = 0.0 in given["damping_ratio"] and 1.0 in given["frequency_ratio"]
    if resonant:
        try:
            steady_gain(0.0, 1.0)
        except ValueError as error:
            faults.add(("initial", "primary"), str(error), "rest")


def _relate_observers(observers: dict[str, Any], faults: Faults) -> None:
    if not observers:
        faults.add(("observers",), "at least one observer must be given", words(OBSERVER_SETTINGS))
    if all(section in observers for section in SECTIONS):
        both = " and ".join(SECTIONS)
        message = f"{both} cannot both be asked for: both write displacement and velocity"
        faults.add(("observers",), message, "one of the two")


def _give_once(parameters: dict[str, Any], axes: dict[str, Any], faults: Faults) -> None:
    given = [name for name in (*parameters, *axes) if isinstance(name, str)]
    for name in parameters:
        if name in axes and name in ALL:
            message = f"'{name}' is given twice: under parameters and under axes"
            faults.add(("axes", name), message, "one of the two")
    meant = {nearest(name, ALL) for name in given if name not in ALL}
    try:
        si = is_si(given)
    except ValueError as error:
        faults.add(("parameters",), str(error))
        return
    if not si and not any(name in DIMENSIONLESS_ONLY for name in given):
        si = any(name in SI_ONLY for name in meant)
    for quantity in SI_QUANTITIES if si else QUANTITIES:
        name = quantity.name
        if name not in given and name not in meant and quantity.default is None:
            units = f" in {quantity.units}" if si and quantity.units != "1" else ""
            allowed = f"{quantity.allowed}{units}, under parameters or as an axis"
            faults.add(("parameters", name), f"'{name}' is not given", allowed)


def _relate_initial(
    initial: Any, parameters: dict[str, Any], axes: dict[str, Any], faults: Faults
) -> None:
    steady = initial == "steady" or (isinstance(initial, dict) and "steady" in initial.values())
    for name in INITIAL_NAMES:
        places = [
            place
            for place, entries in (("parameters", parameters), ("axes", axes), ("initial", initial))
            if isinstance(entries, dict) and entries.get(name) is not None
        ]
        if "initial" in places and len(places) > 1:
            message = f"'{name}' is random here and given under {places[0]} as well"
            faults.add(("initial", name), message, "one of the two")
        if steady and places and name in ("initial_displacement", "initial_velocity"):
            message = f"'{name}' is given, but the primary starts on its steady response"
            faults.add((places[0], name), message, "one of the two")


def _follow_one(axes: Mapping[str, Axis | None], faults: Faults) -> None:
    followed = [name for name, axis in axes.items() if axis and axis.follow]
    for name in followed[1:]:
        message = f"'{followed[0]}' is followed already: a run has one neighbour to start from"
        faults.add(("axes", name, "follow"), message, "follow on one axis")
    for name in followed[:1]:
        if name in INITIAL_NAMES:
            message = f"'{name}' sets where a run starts, so it cannot be followed"
            faults.add(("axes", name, "follow"), message, "follow on an axis of a parameter")


def _branch_values(axes: Mapping[str, Axis | None], initial: Any) -> dict[str, tuple[Any, ...]]:
    """Return the dimensions of several runs at each point, with their values."""
    values: dict[str, tuple[Any, ...]] = {}
    for axis in axes.values():
        if axis and axis.follow:
            values["direction"] = DIRECTIONS[axis.follow]
    draws = initial.get("draws") if isinstance(initial, dict) else None
    if isinstance(draws, int) and 1 <= draws <= MOST_DRAWS:
        values["draw"] = tuple(range(draws))
    return values


def _sound_axes(axes: dict[str, Any]) -> dict[str, Axis | None]:
    sound: dict[str, Axis | None] = {name: None for name in axes if name in ALL}
    for name in sound:
        with Faults().of():
            sound[name] = Axis.model_validate(axes[name], context=name)
    return sound


def _limit_slices(fanned: dict[str, int], faults: Faults) -> None:
    count = math.prod(fanned.values())
    if count > MOST_SLICES:
        sizes = ", ".join(f"{name} ({size} values)" for name, size in fanned.items())
        longest = max(fanned, key=lambda name: fanned[name])
        message = f"the fanned axes make {count} slices: {sizes}"
        allowed = f"at most {MOST_SLICES} slices; take 'fan: true' from {longest}"
        faults.add(("axes",), message, allowed)
