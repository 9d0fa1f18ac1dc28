"""Rules between the parts of a study: parameters given once, axes that have a place."""

from __future__ import annotations

import math
from itertools import combinations, pairwise, product
from typing import Any

from damper.parameters.forcing import EACH_DRAW
from damper.parameters.masses import own_names, taken_by_none
from damper.parameters.models import own_feature
from damper.parameters.names import OF_ANY_MASS, common_name, split
from damper.parameters.quantities import INITIAL_NAMES, QUANTITIES, SI_QUANTITIES, is_si
from damper.study.estimate import MOST_SLICES, refuse_excess
from damper.study.fields import refused
from damper.study.forcing import NOT_FREE, check_undriven
from damper.study.messages import Mistakes
from damper.study.model import Study
from damper.study.products import StudyContents, check_listed
from damper.study.settings import OBSERVER_SETTINGS, FollowedOrbit, check_drawn
from damper.study.yaml_file import join_names
from damper.theory.steady import require_steady, steady_gain


def check_study(study: Study) -> None:
    """Check a study of which each part is sound by itself; ValidationError with all mistakes."""
    mistakes = Mistakes()
    with mistakes.at("forcing"):
        study.forcing.check_force(study._folder, mistakes)
    mistakes.raise_any()
    try:
        _ = study.windows
    except ValueError as error:
        key, _, words = str(error).partition(" = ")
        mistakes.add((key,), *words.split(": must be "))
    mistakes.raise_any()
    contents = study.contents
    _check_used(study, mistakes)
    _check_draws(study, mistakes)
    _check_observers(study, contents, mistakes)
    _check_displaced(study, mistakes)
    _check_followed(study, mistakes)
    _check_slices(study, mistakes)
    _check_window(study, contents, mistakes)
    _check_places(study, contents, mistakes)
    if _given_once(study, mistakes) and _makes_dampers(study, mistakes):
        _check_orbits(study, mistakes)
        _check_dampers(study, mistakes)
        _check_models(study, contents, mistakes)
        _check_theories(study, mistakes)
        _check_kept(study, mistakes)
        _check_steady(study, mistakes)
    for section, name, entry in study.products():
        with mistakes.at(section, name):
            entry.check_against(contents, mistakes)
    if not mistakes:
        refuse_excess(study, mistakes)
    mistakes.raise_any()


def _check_used(study: Study, mistakes: Mistakes) -> None:
    """Note a distance of masses where there is one, and what presses a mass that does not rub."""
    spacing, across, rubs = "initial_spacing", "transverse_acceleration", "friction_coefficient"
    for section, given in study.sections.items():
        if spacing in given and len(study.masses) < 2 and any(study.ends[spacing]):
            message = "it is the distance of several masses"
            mistakes.add((section, spacing), message, "masses: [{}, {}]")
        if across in given and not any(common_name(n) == rubs for n in study.ends):
            message = f"'{across}' has no effect without {rubs}"
            mistakes.add((section, across), message, "both or none")


def _check_observers(study: Study, contents: StudyContents, mistakes: Mistakes) -> None:
    if not study.observers:
        names = join_names(OBSERVER_SETTINGS)
        mistakes.add(("observers",), "at least one observer must be given", names)
    written = {name: [v.name for v in made.variables] for name, made in contents.made.items()}
    for one, other in combinations(written, 2):
        if both := [name for name in written[one] if name in written[other]]:
            message = f"{one} and {other} cannot both be asked for: both write {' and '.join(both)}"
            mistakes.add(("observers",), message, "one of the two")
    seen = {name: list(made.bodies) for name, made in contents.made.items() if made.bodies}
    for one, other in pairwise(seen):
        if seen[one] != seen[other]:
            message = f"observes other masses than {one}"
            mistakes.add(("observers", other, "bodies"), message, f"{seen[one]}, as {one}")


def _check_places(study: Study, contents: StudyContents, mistakes: Mistakes) -> None:
    """Refuse to observe runs that are not there, and to show more than those observed."""
    placed = {n: at for n, o in study.observers.items() if (at := getattr(o, "at", None))}
    for name, at in placed.items():
        for axis, value in at.items():
            check_listed(("observers", name, "at", axis), axis, value, contents.axes, mistakes)
        written = {variable.name for variable in contents.made[name].variables}
        for section, stem, made in study.products():
            shown = {getattr(made, "variable", None), *(getattr(made, "variables", None) or ())}
            needed = {
                name for one in made.needs for name in ((one,) if isinstance(one, str) else one)
            }
            own = getattr(made, "at", None) or {}
            if (name in needed or shown & written) and any(own.get(n) != v for n, v in at.items()):
                where = ", ".join(f"{axis}: {value:g}" for axis, value in at.items())
                message = f"shows what the observer {name} sees, which looks at {where} alone"
                mistakes.add((section, stem), message, f"at: {{{where}}}")


def _check_window(study: Study, contents: StudyContents, mistakes: Mistakes) -> None:
    """Refuse a sampled stretch or counted parts that do not lie in the window."""
    # The classes of their settings are made when they are asked for.
    sampled: Any = study.observers.get("trajectory")
    if sampled is not None and contents.stretch is None:
        length = contents.periods - sampled.start if sampled.length is None else sampled.length
        message = (
            f"the stretch (start {sampled.start:g}, length {length:g}) does not lie in the "
            f"window of {contents.periods} cycles"
        )
        allowed = f"start + length <= {contents.periods}, at least one sample step"
        mistakes.add(("observers", "trajectory"), message, allowed)
    for name, made in contents.made.items():
        with refused(("observers", name), mistakes):
            for cycle, *cycles in study.windows:
                made.require_drive(study.force.kind, study.force.end, cycle * sum(cycles))
    counted: Any = study.observers.get("chatter_bursts")
    for i, start in enumerate(counted.since if counted else ()):
        if start >= contents.periods:
            message = f"begins {start:g} cycles into a window of {contents.periods}"
            allowed = f"number >= 0 and < {contents.periods}"
            mistakes.add(("observers", "chatter_bursts", "since", i), message, allowed)


def _check_orbits(study: Study, mistakes: Mistakes) -> None:
    """Refuse to follow a motion along what is no axis, or out of it."""
    if not study.orbits:
        return
    from damper.sweep.orbits.periodic import FOLLOWED, is_followed, require_force

    axes = study.axis_values
    drawn = [name for name in study.drawn if name not in INITIAL_NAMES]
    if is_si(study.ends) or drawn or any(name in INITIAL_NAMES for name in axes):
        message = "periodic motions are followed over dimensionless parameters alone"
        allowed = "a study without SI units, drawn parameters and axes of initial quantities"
        mistakes.add(("orbits",), message, allowed)
        return
    try:
        for point in study.corners:
            require_force(point, "an orbit")
    except ValueError as error:
        mistakes.add(("orbits",), str(error), "a study without orbits, or under another force")
    for name, entry in study.orbits.items():
        if entry.along not in axes:
            mistakes.unknown(("orbits", name, "along"), "axis", entry.along, axes)
        elif not is_followed(entry.along) or len(axes[entry.along]) < 2:
            message = f"a motion cannot be followed along {entry.along}"
            allowed = "an axis of several values"
            allowed += "" if is_followed(entry.along) else f" of {join_names(FOLLOWED)}"
            mistakes.add(("orbits", name, "along"), message, allowed)
        elif not min(axes[entry.along]) <= entry.start <= max(axes[entry.along]):
            message = f"'start' is outside of the axis {entry.along} (value: {entry.start:g})"
            allowed = f"{min(axes[entry.along]):g} to {max(axes[entry.along]):g}"
            mistakes.add(("orbits", name, "start"), message, allowed)
        else:
            with mistakes.at("orbits", name):
                _check_curves(study, entry, mistakes)


def _check_curves(study: Study, entry: FollowedOrbit, mistakes: Mistakes) -> None:
    """Refuse places that no axis has, and curves that do not begin in their range."""
    from damper.sweep.orbits.periodic import FOLLOWED, is_followed

    axes = study.axis_values
    given = {name: (value,) for name, value in study.fixed.items()} | axes
    others = {name: values for name, values in axes.items() if name != entry.along}
    for axis, value in entry.at.items():
        check_listed(("at", axis), axis, value, others, mistakes)
    for kind, ranges in entry.curves.items():
        for name, (low, high) in ranges.items():
            loc = ("curves", kind, name)
            common, k = split(name) or (name, -1)
            # Of a mass without one of its own that of all.
            own = given.get(name, given.get(common, (0.0,)))
            own = (entry.at[name],) if name in entry.at else own
            if name == entry.along or not is_followed(name):
                message = f"a point cannot be followed along {entry.along} and {name}"
                allowed = join_names(each for each in FOLLOWED if each != entry.along)
                mistakes.add(loc, message, allowed)
            elif k >= len(study.masses):
                message = f"'{name}' is of mass {k}, but masses lists {len(study.masses)}, from 0"
                mistakes.add(loc, message, "a quantity of a mass that there is")
            elif not low <= min(own) <= max(own) <= high:
                message = f"the motion has {name} from {min(own):g} to {max(own):g}"
                allowed = "a range that holds these values; or give one value in at"
                mistakes.add(loc, message, allowed)


def _makes_dampers(study: Study, mistakes: Mistakes) -> bool:
    """Whether there are dampers of all the values."""
    try:
        return bool(study.corners)
    except ValueError as error:
        mistakes.add(("parameters",), str(error))
        return False


def _check_dampers(study: Study, mistakes: Mistakes) -> None:
    """Refuse to compare a damper with a theory of another one."""
    points = study.corners
    acting = {name for point in points for name in point.acting}
    shown = {(section, name): made for section, name, made in study.products() if made.theoretical}
    places: dict[Any, Any] = {place: made.knows for place, made in shown.items()}
    laws = {point.law for point in points} - {"constant"}
    other = min(laws, default="constant")
    by_law = f"its formulas have a constant restitution, this damper the {other} law"
    if "accumulation" in study.observers and laws:
        mistakes.add(("observers", "accumulation"), by_law, "a study with constant restitution")
    for place, known in places.items():
        main = study.main_feature
        if main != "rigid" and not (main == "prescribed" and "carrier" in known):
            has = own_feature(main)
            message = f"its formulas are those of rigid walls alone, this damper has {has}"
        elif laws:
            message = by_law
        elif unknown := acting.difference(known):
            message = f"its formulas do not know {_acting_text(min(unknown), study)}"
        else:
            continue
        mistakes.add(place, message, "a study of the rigid damper with constant restitution")
    if "decay" in study.observers:
        _check_free(study, mistakes)


def _check_models(study: Study, contents: StudyContents, mistakes: Mistakes) -> None:
    """Refuse what does not know this model of the damper, and masses that there are not."""
    fewest, most = (fewer(len(point.each) for point in study.corners) for fewer in (min, max))
    for name, made in contents.made.items():
        if made.bodies and max(made.bodies) >= fewest:
            message = f"there is no mass {max(made.bodies)}: the damper has {fewest}, from 0"
            mistakes.add(("observers", name, "bodies"), message, f"whole numbers < {fewest}")
        for key, (message, way) in made.refusals(study.features, most).items():
            place = ("observers", name, key) if key else ("observers", name)
            mistakes.add(place, message, way or "a study without it, or of one of these models")


def _check_free(study: Study, mistakes: Mistakes) -> None:
    """Refuse to observe the decay of a vibration that is not free."""
    begins = [cycles * before for cycles, before, _ in study.windows]
    amplitudes = (point.force_amplitude for point in study.corners)
    if not check_undriven(study.force, amplitudes, begins, mistakes):
        return
    if "time_varying" in study.features:
        message = "the variation of the free mass drives the damper"
        mistakes.add(("observers", "decay"), f"{message}{NOT_FREE}", "a constant mass")


def _acting_text(name: str, study: Study) -> str:
    """A quantity that acts, and of the force its kind."""
    return f"{name}: {study.force.kind}" if name == "forcing" else name


def _check_draws(study: Study, mistakes: Mistakes) -> None:
    """Refuse draws of nothing, and noise of draws that there are not."""
    with mistakes.at("draws"):
        if not study.forcing.drawn:
            check_drawn(study.draws, mistakes)
    count = study.draw_settings().get("count", 0)
    if study.jobs > max(count, 1):
        message = f"{study.jobs} jobs cannot share {count} draws"
        mistakes.add(("jobs",), message, f"at most {count}" if count else "draws, or no jobs")
    if study.forcing.drawn and not study.draws:
        message = f"'{EACH_DRAW}' is another seed in each draw, but there are no draws"
        mistakes.add(("forcing", "seed"), message, "a whole number, or draws: {count: 20, seed: 1}")


def _check_kept(study: Study, mistakes: Mistakes) -> None:
    """Refuse to run more points of a cube that does not keep what drives them."""
    for section, name, made in study.products() if study.force.kind == "record" else ():
        if made.runs_more:
            message = "it runs further points, but the cube does not hold the record's samples"
            mistakes.add((section, name), message, "left out, or in a study under another force")


def _check_theories(study: Study, mistakes: Mistakes) -> None:
    """Refuse theories of one damper where its parameters are drawn, unless one draw is shown."""
    drawn = [name for name in study.drawn if name not in INITIAL_NAMES]
    for section, stem, made in study.products() if drawn else ():
        if made.theoretical and "draw" not in (getattr(made, "at", None) or {}):
            message = f"its formulas take one {drawn[0]}, which is drawn here"
            mistakes.add((section, stem), message, "at: {draw: 0}, or a fixed value")


def _check_steady(study: Study, mistakes: Mistakes) -> None:
    """Refuse a start on a steady response that does not exist."""
    if study.initial != "steady":
        return
    try:
        for point in study.corners:
            require_steady(point)
    except ValueError as error:
        mistakes.add(("initial",), str(error), "rest")
        return
    given = study.ends
    if is_si(given):
        # The frequency ratio as `SIParameters` forms it.
        sizes = (given[n] for n in ("primary_mass", "stiffness", "forcing_frequency"))
        resonant = 0.0 in given["damping"] and any(
            omega * math.sqrt(mass / stiffness) == 1.0 for mass, stiffness, omega in product(*sizes)
        )
    else:
        resonant = 0.0 in given["damping_ratio"] and 1.0 in given["frequency_ratio"]
    if resonant:
        try:
            steady_gain(0.0, 1.0)
        except ValueError as error:
            mistakes.add(("initial",), str(error), "rest")


def _given_once(study: Study, mistakes: Mistakes) -> bool:
    """Whether every quantity that a damper has to have is given, in one system of units."""
    given: dict[str, str] = {}
    for section, entries in study.sections.items():
        for name in entries:
            first = given.setdefault(name, section)
            if first != section:
                message = f"'{name}' is given twice: under {first} and under {section}"
                mistakes.add((section, name), message, "one of the two")
    try:
        si = is_si(given)
    except ValueError as error:
        mistakes.add(("parameters",), str(error))
        return False
    if not _has_masses(study, mistakes):
        return False
    # A quantity that every mass gives by itself need not be given for all.
    own = own_names(given, study.masses)
    every = {name for name in OF_ANY_MASS if taken_by_none(name, own)}
    for section in ("axes", "draws"):
        for name in study.sections[section]:
            if name in every:
                message = f"'{name}' is varied, and each of masses has its own"
                mistakes.add((section, name), message, f"{name}_0, or no {name} in one of masses")
    missing = [
        quantity
        for quantity in (SI_QUANTITIES if si else QUANTITIES)
        if quantity.name not in {*given, *every, *study.left_out} and quantity.default is None
        # With a table, or one in a mass, the damper itself is asked.
        if not (quantity.unless and "tables" in study.beside)
    ]
    for quantity in missing:
        units = quantity.units
        if quantity.name == "force_amplitude":
            units = study.force.si_unit
        within = f" in {units}" if si and units != "1" else ""
        masses = " or in each of masses" if study.masses and quantity.name in OF_ANY_MASS else ""
        allowed = f"{quantity.allowed}{within}, under parameters, axes or draws{masses}"
        mistakes.add(("parameters", quantity.name), f"'{quantity.name}' is not given", allowed)
    return not missing


def _has_masses(study: Study, mistakes: Mistakes) -> bool:
    """Whether there are the masses of which axes or draws are quantities."""
    count, there = len(study.masses), True
    for section in ("axes", "draws"):
        for name in study.sections[section]:
            common, k = split(name) or ("", -1)
            if count <= k:
                message = f"'{name}' is of mass {k}, but masses lists {count}, from 0"
                names = [f"{common}_{n}" for n in range(count)]
                mistakes.add((section, name), message, join_names(names or ["masses: [{}, {}]"]))
                there = False
    return there


def _check_displaced(study: Study, mistakes: Mistakes) -> None:
    """Refuse to move a primary that starts on its steady response."""
    for section, entries in study.sections.items() if study.initial == "steady" else ():
        for name in ("initial_displacement", "initial_velocity"):
            if name in entries:
                message = f"'{name}' is given, but the primary starts on its steady response"
                mistakes.add((section, name), message, "one of the two")


def _check_followed(study: Study, mistakes: Mistakes) -> None:
    if not study.follow:
        return
    first, *others = study.follow
    for name in others:
        message = f"'{first}' is followed already: a run has one neighbour to start from"
        mistakes.add(("axes", name, "follow"), message, "follow on one axis")
    if first in INITIAL_NAMES:
        message = f"'{first}' sets where a run starts, so it cannot be followed"
        mistakes.add(("axes", first, "follow"), message, "follow on an axis of a parameter")


def _check_slices(study: Study, mistakes: Mistakes) -> None:
    fanned = {name: len(study.axis_values[name]) for name in study.fan_axes}
    count = study.jobs * math.prod(fanned.values())
    if count > MOST_SLICES:
        sizes = ", ".join(f"{name} ({size} values)" for name, size in fanned.items())
        sizes += f", with {study.jobs} jobs at each" * (study.jobs > 1)
        longest = max(fanned, key=lambda name: fanned[name])
        message = f"the fanned axes make {count} slices: {sizes}"
        allowed = f"at most {MOST_SLICES} slices; take 'fan: true' from {longest}"
        mistakes.add(("axes",), message, allowed)
