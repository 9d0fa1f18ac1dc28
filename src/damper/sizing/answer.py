"""`damper.design`: the damper of a machine, and what it will do."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from damper.analysis.labels import label_of
from damper.engine.compiled import compiling
from damper.parameters.files import path_of
from damper.parameters.lazy import pd, xr
from damper.sizing.clauses import Clause, clauses_of, table_of
from damper.sizing.contact import (
    BALLS,
    HARD_STEEL,
    STEEL,
    ball_diameter,
    contact_modulus,
    hertz_impact,
    yield_speed,
)
from damper.sizing.machine import LYING, MASS_RATIOS, Machine, machine_of, read_machine
from damper.sizing.search import DIGITS, MASS_PARTS, Search
from damper.sizing.structures import (
    CHECK,
    StructureJudge,
    StructureMachine,
    StructureSearch,
    structure_machine,
)
from damper.sizing.study import CHANGED, PART, Sizes, WorstCase, rounded
from damper.sizing.words import ROUNDING, text_of
from damper.sweep.progress import progress_bar

#: Steps along the gap when a periodic motion is followed, and motions at most.
_FOLLOW: Mapping[str, Any] = {"step": 0.05, "max_orbits": 120, "until_change": True}
_GAPS = (0.4, 2.5)
#: Digits of an answer, and of numbers without known sensitivity.
_USUAL = 3
#: Least width of the words of a card.
_WIDTH = 46
#: Slope that is nothing but roundoff.
_NO_SLOPE = 1e-9
#: Cycles of the machine in one run.
_MOST_CYCLES = 1e6
#: Room for the gap over the gap of the closed form.
_LEAST_GAP = 1e-3


def _number(words: str, unit: str = "1", digits: int = 3) -> Any:
    return field(default=math.nan, metadata={"words": words, "unit": unit, "digits": digits})


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class Design:
    """The damper of a machine or a structure, what it will do, how wrong things may be.

    Made by `design`.

    Numbers are in SI units, which `units` names; NaN is not known. `worst`, `without`, `as_built`
    and `closed_form` are of what counts: largest or rms displacement in the band, or time of decay.
    """

    machine: Machine | StructureMachine
    quick: bool
    """Whether it is by the closed forms alone."""
    box: str = ""
    """Of a structure: the box that the damper is in."""
    free_mass: float = _number("free mass", "kg", DIGITS)
    mass_ratio: float = _number("over {carrier}")
    count: float = _number("equal free masses side by side, which share it")
    gap: float = _number("gap, the whole travel", "m", DIGITS)
    restitution: float = _number("coefficient of restitution")
    without: float = _number("without damper", "*")
    worst: float = _number("worst case: the largest over {cases}", "*")
    runs: float = _number("runs of which it is the largest", digits=6)
    worst_frequency: float = _number("frequency of the worst case", "Hz")
    as_built: float = _number("as built: the same without tolerances", "*")
    fresh_share: float = _number("fresh random runs above the worst case", "%")
    fresh_ratio: float = _number("the largest fresh run, over the worst case")
    closed_form: float = _number("by the closed form", "*")
    alike: float = _number("the same with all masses exactly alike, as one mass", "*")
    band_ratio: float = _number("largest over that without damper, in the band")
    outside_ratio: float = _number("the same outside of the band")
    outside_frequency: float = _number("largest outside at", "Hz")
    weak_ratio: float = _number("largest over that without, half the record")
    strong_ratio: float = _number("the same, twice the record")
    impact_rate: float = _number("impacts, at most", "1/s")
    approach_speed: float = _number("hardest impact: speed of approach", "m/s")
    impulse: float = _number("hardest impact: impulse", "N s")
    impact_energy: float = _number("hardest impact: energy that it takes", "J")
    power: float = _number("power lost in the stops, less than", "W")
    lowest_gap: float = _number("its periodic motion changes below the gap", "m")
    highest_gap: float = _number("its periodic motion changes above the gap", "m")
    warnings: tuple[str, ...] = ()
    """What has to be known first."""
    assumed: tuple[str, ...] = ()
    clauses: tuple[Clause, ...] = ()
    """Each check with its number, limit and value."""
    response: pd.DataFrame | None = None
    """What counts over the frequency in Hz: without damper, as built, and in the worst case; of
    free motion peaks, and under a record displacements, in m over the time in s."""
    history: pd.DataFrame | None = None
    """Displacements in m over the time in s at the worst case of a band: without damper, with it,
    and of the free mass, or each of several, from the middle of its box."""
    tolerances: pd.DataFrame | None = None
    """What counts with each quantity off its value, the others as built."""
    changes: pd.DataFrame | None = None
    """What a little more of each quantity changes, as built and where the worst case is."""
    found_by: str = ""
    """How `changes` are found."""
    slopes: Mapping[str, float] = field(default_factory=dict)
    """Per cent by which what counts changes with a per cent of a quantity, as in `changes`."""
    motions: pd.DataFrame | None = None
    """Where random starts lead to at the worst frequency."""
    boxes: pd.DataFrame | None = None
    """The best damper of each box, and its worst case."""
    counts: pd.DataFrame | None = None
    """The best damper of each number of equal masses side by side, and its worst case."""
    materials: pd.DataFrame | None = None
    """The best damper of each material, and its worst case."""
    masses: pd.DataFrame | None = None
    """What lighter free masses leave."""
    gaps: pd.DataFrame | None = None
    """What other gaps leave."""
    studies: Mapping[str, dict[str, Any]] = field(default_factory=dict)
    """What every number is made from: name -> study, as a file has it."""

    @property
    def units(self) -> dict[str, str]:
        """Unit of each number."""
        own = self.machine.measured[1]
        found = {one.name: one.metadata.get("unit") for one in fields(self)}
        return {name: own if unit == "*" else unit for name, unit in found.items() if unit}

    @property
    def boxes_to_build(self) -> int:
        """Number of equal free masses side by side, each in a box of its own."""
        return 1 if math.isnan(self.count) else int(self.count)

    @property
    def lines(self) -> list[tuple[str, str, str]]:
        """Name, words and value with its unit of each number that is known."""
        units, made = self.units, []
        for one in fields(self):
            value = getattr(self, one.name)
            # Without tolerances the damper as built is the worst case.
            repeats = one.name == "as_built" and not self.machine.has_tolerances
            if one.name in units and not math.isnan(value) and not repeats:
                text = text_of(value, units[one.name], self.digits(one.name))
                m = self.machine
                words = one.metadata["words"].format(cases=m.cases, carrier=m.carrier)
                made.append((one.name, words, text))
        if material := self.machine.material(self.restitution):
            names = [line[0] for line in made]
            name, words, value = made[place := names.index("restitution")]
            made[place] = name, words, f"{value}, {material}"
        return [("box", "box", self.box), *made] if self.box else made

    @property
    def tables(self) -> Iterator[tuple[str, str, pd.DataFrame]]:
        """Heading, explanation and cells of each table that there is."""
        by = "by the closed forms" if self.quick else "in the worst case"
        coarse = "" if self.quick else "; all but the first are from a coarser grid of dampers"
        grid = "frequencies and starts" if self.machine.band else "starts"
        every = (
            (
                "Checks",
                "The number of a clause is the same on all cards; docs/sizing.md lists them.",
                table_of(self.clauses),
            ),
            ("What to build", _about_building(self), _to_build(self)),
            (
                "Free mass against what it leaves",
                f"Less mass{'' if self.box else ', its gap near the best one'}, {by}{coarse}.",
                self.masses,
            ),
            (
                "Gap against what it leaves",
                "Gaps that the search tried, the mass as found, in the worst case; all but the "
                "best one without rounds of fresh starts.",
                self.gaps,
            ),
            (
                "Units",
                "The best damper of each number of equal free masses side by side, in the worst "
                "case, each from a search of its own.",
                self.counts,
            ),
            ("Boxes", f"The best damper of each box, {by}{coarse}.", self.boxes),
            ("Materials", f"The best damper of each material, {by}{coarse}.", self.materials),
            (
                "How wrong things may be",
                f"The largest over a grid of {grid}, with one quantity off its value.",
                self.tolerances,
            ),
            (f"What {100.0 * PART:g} % more changes", self.found_by, self.changes),
            (
                "Where other starts lead",
                f"Random starts at {self.worst_frequency:.4g} Hz, as built; the worst case is over "
                "these, too. In brackets are the 95 % limits of their part."
                + (
                    " Motions are those of the first of the masses."
                    if self.boxes_to_build > 1
                    else ""
                ),
                self.motions,
            ),
        )
        return (one for one in every if one[2] is not None)  # type: ignore[misc]

    def digits(self, name: str) -> int:
        """Digits of a number that the sensitivity of the answer supports."""
        (most,) = (one.metadata["digits"] for one in fields(self) if one.name == name)
        if not self.slopes:
            return min(most, _USUAL)
        value, slope = getattr(self, name), abs(self.slopes.get(name, math.inf))
        if not value or not slope < math.inf:
            return most
        enough = (
            n for n in range(2, most) if slope * abs(rounded(value, n) / value - 1.0) <= ROUNDING
        )
        return next(enough, most)

    def ball_and_box(self, density: float) -> tuple[float, str, str]:
        """Return the diameter of one ball in m, and in words that and the length inside its box.

        Their difference is the gap, so all three end at the same decimal place.
        """
        diameter = ball_diameter(self.free_mass / self.boxes_to_build, density)
        digits = self.digits("gap")
        gap = rounded(self.gap, digits)
        digits = max(_USUAL, digits + _decade(diameter) - _decade(gap))
        inside = rounded(diameter, digits) + gap
        more = _decade(inside) - _decade(diameter)
        return diameter, text_of(diameter, "m", digits), text_of(inside, "m", digits + more)

    def __repr__(self) -> str:
        width = max(_WIDTH, *(len(text) + 1 for _, text, _ in self.lines))
        body = [f"  {text:<{width}}{value}" for _, text, value in self.lines]
        more = [f"! {text}" for text in self.warnings[len(self.machine.notes) :]]
        tables = [
            f"{heading}. {text}\n{frame.to_string(index=False)}"
            for heading, text, frame in self.tables
        ]
        first = opening(self.machine, self.quick)
        return "\n".join([first, *more, *body, *tables, *(f"- {text}" for text in self.assumed)])

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Write the page (HTML, Markdown), figures, CSV files and studies into a folder.

        The files of an older page there are deleted first. ValueError where the folder cannot be
        written.
        """
        from damper.sizing.page import write

        write(self, Path(path_of(folder, "folder", "folder")))


def opening(machine: Any, quick: bool) -> str:
    """First lines of a card, which are known before the search: title and notes."""
    method = "closed forms alone" if quick else "exact runs"
    head = f"{machine.title}: a damper against the {machine.measured[2]} ({method})"
    return "\n".join([head, *(f"! {text}" for text in machine.notes)])


def design(
    machine: Machine | StructureMachine | Mapping[str, Any] | str | os.PathLike[str] | None = None,
    *,
    quick: bool = False,
    **given: Any,
) -> Design:
    """Size the damper of a machine for the worst case.

    Parameters
    ----------
    machine : path or mapping, optional
        YAML file, or settings, of the machine; `damper.sizing.machine.Machine` lists them. Else
        they are given by name. With `structure`, a mapping or a `damper.Structure`, they are those
        of `damper.sizing.structures.StructureMachine`.
    quick : bool, default False
        Use the closed forms alone, without runs.
    **given
        Settings of the machine, in SI units and Hz; over those of `machine`.

    Returns
    -------
    Design
        Its text is a card; `save` writes a page and the studies behind its numbers.

    Raises
    ------
    ValueError
        With all that is wrong, and what would be feasible.

    Examples
    --------
    >>> import damper
    >>> found = damper.design(mass=100, stiffness=4e6, damping_ratio=0.02, force_amplitude=200,
    ...                       band=[25, 40], largest_mass=10, largest_gap=5e-3, restitution=0.3,
    ...                       quick=True)
    >>> round(found.gap, 6), found.units["gap"], round(found.closed_form, 6)
    (0.001055, 'm', 0.000181)
    """
    on_structure = structure_machine(machine, given)
    judge: Any = (
        StructureJudge(on_structure) if on_structure else WorstCase(machine_from(machine, given))
    )
    if quick and on_structure:
        raise ValueError("quick: there are no closed forms for structures: leave out quick")
    if quick:
        _check_quick(judge.machine)
        return _checked(_by_closed_forms(judge))
    if not on_structure:
        _check_runs(judge)
    with compiling():  # a search takes thousands of runs
        return _searched(judge, _answer_on if on_structure else _answer)


def _searched(judge: Any, answer: Callable[[Any, Any], Design]) -> Design:
    """The best damper by runs, and those about it."""
    m, on_structure = judge.machine, isinstance(judge, StructureJudge)
    searches = [_search_for(m, count) for count in m.counts_of_masses]
    tried, search = list[tuple[Any, Any]](), searches[0]
    with progress_bar(lambda: search.doing, "") as show:
        for search in searches:
            search.show = show
            tried.append((search, search.best()))
        if len(tried) > 1:  # of equals the fewest masses
            tried.sort(key=lambda one: one[0].bounds[one[1]])
        search, damper = tried[0]
        each = search.best_of_each(damper, "restitution") if m.materials else []
        boxes = search.best_of_each(damper, "box") if on_structure else []
        lighter = search.best_of_masses(damper)
        about = search.gaps_about(damper)
    found = answer(search, damper)
    materials, in_boxes, masses, gaps = (
        [(one, search.bounds[one]) for one in some] for some in (each, boxes, lighter, about)
    )
    return _checked(
        replace(
            found,
            counts=_counts(m, tried),
            boxes=_of_each(m, in_boxes, lambda one: [{"box": one.box}]),
            materials=_materials(m, materials),
            masses=_masses(judge, masses),
            gaps=_masses(judge, gaps),
        )
    )


def machine_from(machine: Any, given: Mapping[str, Any]) -> Machine:
    """Return a machine from the arguments of `design`."""
    if isinstance(machine, str | os.PathLike):
        return read_machine(Path(machine), given)
    if isinstance(machine, Machine):
        if not given:
            return machine
        machine = machine.model_dump(exclude_unset=True)
    if not isinstance(machine, Mapping | None):
        raise TypeError(
            f"machine = {machine!r}: must be the path of a YAML file, or a mapping of settings"
        )
    return machine_of(dict(machine or {}) | dict(given))


def _check_quick(m: Machine) -> None:
    """Raise ValueError for what the closed forms do not know."""
    if m.counts_of_masses != [1]:
        asked = ", ".join(map(str, m.units or ()))
        raise ValueError(
            f"quick: units = [{asked}]: the closed forms know one free mass alone: leave out quick "
            "or units"
        )
    for name in ("orientation", "friction_coefficient"):
        if m.weight and (value := getattr(m, name)) not in (0.0, LYING):
            raise ValueError(
                f"quick: {name} = {value}: the closed forms know neither weight nor friction: "
                f"leave out quick or {name}"
            )


def _check_runs(judge: WorstCase) -> None:
    """Raise ValueError for runs that would not end, or have too many impacts."""
    m = judge.machine
    cycles = 0.0 if m.band else judge.seconds * m.rate / math.tau
    if cycles > _MOST_CYCLES:
        what = f"decay_to = {m.decay_to:g}: the decay" if m.is_free else "the record"
        raise ValueError(
            f"{what} takes {cycles:.2g} cycles of the machine: must be at most {_MOST_CYCLES:g}"
        )
    least = _LEAST_GAP * min(judge.closed_form_gap(m.largest_mass, r) for r in m.restitutions)
    least *= judge.distance
    if m.largest_gap < least:
        raise ValueError(
            f"largest_gap = {m.largest_gap:g}: in {text_of(m.largest_gap, 'm')} a free mass does "
            f"nothing here: must be at least {text_of(least, 'm')}, a thousandth of the gap that "
            "the closed form asks for"
        )


def _without(judge: Any, frequencies: list[float]) -> np.ndarray:
    """What counts without the damper, at each frequency; else one number."""
    m = judge.machine
    if m.is_recorded and isinstance(judge, StructureJudge):
        return np.array([judge.alone])
    if m.is_free:
        lost = -math.log(m.decay_to) / m.rate
        return np.array([lost / m.damping_ratio if m.damping_ratio else math.inf])
    if m.is_recorded:
        return cube_of(judge.without())[m.measured[0]].values.reshape(1)
    return np.array([m.counted(m.undamped(f), f) for f in frequencies])


def _by_closed_forms(judge: WorstCase) -> Design:
    m = judge.machine
    if m.is_recorded:
        raise ValueError(
            "quick: the closed forms hold under one frequency and in free motion, not under a "
            "record: leave out quick"
        )
    every = [(judge.closed_form_gap(m.largest_mass, r), r) for r in m.restitutions]
    dampers = [
        Sizes(m.largest_mass, min(rounded(gap, DIGITS), m.largest_gap), r) for gap, r in every
    ]
    closed_forms = [judge.closed_form(damper) for damper in dampers]
    # Of a large motion that is possible as well the least, then that of the closed form.
    values = [
        (form.get("largest", form["value"]), form["value"]) if form else (math.inf,)
        for form in closed_forms
    ]
    best = min(range(len(dampers)), key=values.__getitem__)
    damper, closed_form = dampers[best], closed_forms[best]
    if not closed_form:
        low, high = m.band or (0.0, 0.0)
        raise ValueError(
            f"band = [{low:g}, {high:g}] Hz: the closed forms hold at the natural frequency, "
            f"{m.rate / math.tau:.4g} Hz: must be a band around it; or leave out quick"
        )
    of_each = [(one, found[0]) for one, found in zip(dampers, values, strict=True)]
    found = _design(judge, damper, quick=True, closed_form=closed_form["value"])
    lighter = [
        Sizes(
            part * damper.mass,
            judge.closed_form_gap(part * damper.mass, damper.restitution),
            damper.restitution,
        )
        for part in MASS_PARTS
    ]
    rounds = [
        one._replace(mass=rounded(one.mass, DIGITS), gap=rounded(one.gap, DIGITS))
        for one in lighter
    ]
    masses = [
        (one, judge.closed_form(one).get("value", math.inf))
        for one in rounds
        if one.gap <= m.largest_gap
    ]
    return replace(found, materials=_materials(m, of_each), masses=_masses(judge, masses))


def _row(m: Any, damper: Any, value: float, alone: float | None = None) -> dict[str, str]:
    """A damper with what counts, and that over the one without damper where that is given."""
    row = {
        "free mass": text_of(damper.mass, "kg"),
        "gap": text_of(damper.gap, "m"),
        m.measured[2]: text_of(value, m.measured[1]),
    }
    if alone is not None:
        row["of that without"] = f"{100.0 * value / alone:.3g} %" if alone < math.inf else ""
    return row


def _of_each(
    m: Any, of_each: Sequence[tuple[Any, float]], named: Callable[[Any], list[dict[str, str]]]
) -> pd.DataFrame | None:
    """Dampers by what counts, with what names each of them; it may have several names."""
    rows = [
        names | _row(m, damper, value)
        for damper, value in sorted(of_each, key=lambda one: one[1])
        for names in named(damper)
    ]
    return pd.DataFrame(rows) if rows else None


def _counts(m: Any, tried: Sequence[tuple[Any, Any]]) -> pd.DataFrame | None:
    """The best damper of each number of masses side by side; the best of all first."""
    if not getattr(m, "units", None):
        return None
    judge = tried[0][0].judge
    alone = float(_without(judge, judge.fine).max())
    return pd.DataFrame(
        {"units": f"{search.judge.count}"} | _row(m, damper, search.bounds[damper], alone)
        for search, damper in tried
    )


def _materials(m: Any, of_each: Sequence[tuple[Any, float]]) -> pd.DataFrame | None:
    """The best damper of each material, and what counts."""

    def named(damper: Any) -> list[dict[str, str]]:
        return [
            {"material": name, "restitution": f"{damper.restitution:g}"}
            for name, material in m.materials.items()
            if material.restitution == damper.restitution
        ]

    return _of_each(m, of_each, named)


def _masses(judge: Any, of_each: Sequence[tuple[Sizes, float]]) -> pd.DataFrame | None:
    """Table of dampers with the largest value of each, and that over the one without."""
    m, alone = judge.machine, float(_without(judge, judge.fine).max())
    rows = [_row(m, damper, value, alone) for damper, value in of_each if value < math.inf]
    return pd.DataFrame(rows) if len(rows) > 1 else None


def _decade(value: float) -> int:
    """Power of ten of a number's first digit."""
    return math.floor(math.log10(value))


def _stops(m: Any) -> Any:
    """Material of the stops, for the contact force."""
    return STEEL if m.stop_modulus is None else STEEL._replace(modulus=m.stop_modulus)


def _to_build(found: Design) -> pd.DataFrame:
    """The ball of each material, the box that it needs, and its hardest impact by Hertz."""
    m, rows, boxes = found.machine, [], found.boxes_to_build
    reduced = found.free_mass / (boxes + found.mass_ratio)
    for name, ball in BALLS.items():
        diameter, *lengths = found.ball_and_box(ball.density)
        row = {"boxes": f"{boxes}"} if boxes > 1 else {}
        row |= {"ball of": name} | dict(zip(("diameter", "length inside"), lengths, strict=True))
        if found.approach_speed > 0.0:
            modulus = contact_modulus(ball, _stops(m))
            hit = hertz_impact(reduced, found.approach_speed, 0.5 * diameter, modulus)
            row |= {
                "contact force": text_of(rounded(hit.force, 2), "N", 2),
                "contact time": text_of(hit.time, "s", 2),
                "pressed in by": text_of(hit.depth, "m", 2),
            }
        rows.append(row)
    return pd.DataFrame(rows)


def _about_building(found: Design) -> str:
    text = "One ball has the whole free mass; the length inside is its diameter and the gap."
    if (boxes := found.boxes_to_build) > 1:
        text = (
            f"{boxes} boxes side by side, with a ball of 1/{boxes} of the free mass in each; the "
            "length inside is its diameter and the gap. The hardest impact is of one ball."
        )
    if not found.approach_speed > 0.0:
        return text
    own = found.machine.stop_modulus
    of = "steel" if own is None else f"a Young's modulus of {text_of(own, 'Pa')}"
    text += (
        " Force, time and depth of the hardest impact are an estimate by Hertz: elastic, a ball on "
        f"flat stops of {of} (stop_modulus; Poisson's ratio 0.3), that are thick, on stiff "
        "walls."
    )
    limit = yield_speed(contact_modulus(STEEL, STEEL), HARD_STEEL, STEEL.density)
    if own is None and found.approach_speed > limit:
        text += (
            f" Even hard steel yields a little from {text_of(limit, 'm/s', 2)} on: then the force "
            "is less and the time longer."
        )
    return text


def _design(judge: Any, damper: Any, quick: bool, **numbers: Any) -> Design:
    m = judge.machine
    without = float(_without(judge, judge.fine).max())
    clauses = tuple(clauses_of(judge, damper, numbers | {"without": without}))
    if getattr(m, "units", None):
        numbers["count"] = float(judge.count)
    failed = tuple(one.warning for one in clauses if one.warning and not one.passed)
    return Design(
        machine=m,
        quick=quick,
        free_mass=damper.mass,
        mass_ratio=damper.mass / judge.carrier_mass(damper),
        gap=damper.gap,
        restitution=damper.restitution,
        without=without,
        clauses=clauses,
        warnings=m.notes + failed + _by_size(judge, damper),
        assumed=tuple(judge.assumptions(quick)),
        **numbers,
    )


def _by_size(judge: Any, damper: Any) -> tuple[str, ...]:
    """Warnings that need no runs."""
    m = judge.machine
    if damper.gap >= 0.999 * m.largest_gap:
        more = ""
        if m.has_closed_forms:
            asked = judge.closed_form_gap(damper.mass, damper.restitution)
            more = f"; the closed form asks for {text_of(asked, 'm')}"
        return (f"The gap is as large as there is room for{more}.",)
    return ()


def _answer(search: Search, damper: Sizes) -> Design:
    judge = search.judge
    every = search.every_run(damper)
    studies = {"worst_case": judge.worst_case(damper), "check": judge.check(damper)}
    cube = cube_of(studies["worst_case"])
    numbers: dict[str, Any] = {"closed_form": judge.closed_form(damper).get("value", math.nan)}
    frequency = 0.0
    if judge.machine.is_free:
        studies["envelope"] = judge.envelope(damper)
        numbers |= _decay_numbers(cube, cube_of(studies["envelope"]), judge.machine)
        numbers |= _hardest(every)
    elif judge.machine.is_recorded:
        studies |= {"without": judge.without(), "history": judge.history(damper)}
        numbers |= _record_numbers(every, cube, judge, studies)
    else:
        frequency = float(every.frequency.iloc[every.value.argmax()])
        studies |= {"sweep": judge.sweep(damper), "motions": judge.motions(damper, frequency)}
        motions = cube_of(studies["motions"])
        motions = motions.isel(body=0) if "body" in motions.dims else motions
        numbers["motions"] = _motions(motions, judge.machine)
        every = pd.concat([every, _runs_of(motions, judge.machine, frequency)])
        numbers |= {"worst_frequency": frequency} | _band_numbers(every, cube, judge)
        numbers |= _history(judge, damper, search.hardest[damper], studies)
    studies["worst"] = judge.one(damper, search.hardest[damper])
    numbers |= _largest(every, cube_of(studies["check"])[judge.machine.measured[0]])
    if judge.count > 1:
        numbers["alike"], one, case = _alike(judge.machine, damper)
        studies["alike"] = one.one(damper, case)
    orbit = _orbit(judge, damper, frequency)
    if orbit:
        numbers |= _margins(orbit, damper.gap)
    numbers |= _changes(judge, damper, frequency, orbit, studies)
    return _design(judge, damper, quick=False, studies=studies, **numbers)


def _search_for(m: Any, count: int) -> Any:
    """A search among dampers of so many masses side by side."""
    if isinstance(m, StructureMachine):
        return StructureSearch(StructureJudge(m, count=count))
    return Search(WorstCase(m, count))


def _alike(m: Any, damper: Any) -> tuple[float, Any, Any]:
    """Worst case of a damper whose masses move as one, who judges it, and the case."""
    one = _search_for(m, 1)
    return one.worst(damper), one.judge, one.hardest[damper]


def _answer_on(search: StructureSearch, damper: Any) -> Design:
    """The answer on a structure; each of its runs is known."""
    judge, m = search.judge, search.judge.machine
    every = search.every_run(damper)
    own = every[~every.beyond]
    numbers: dict[str, Any] = _largest(own, search.lasting(damper, judge.fresh(1000, CHECK)))
    numbers |= _hardest(own) | {"power": float(own.power.max())}
    numbers["tolerances"] = _off_by(own, m, judge.sizes(damper), judge.tolerances)
    if m.is_recorded:
        numbers["response"] = judge.history(damper)
    else:
        numbers["worst_frequency"] = float(own.frequency.iloc[own.value.argmax()])
        numbers |= _over_frequencies(every, judge)
        numbers["history"] = judge.motion(damper, search.hardest[damper])
    studies = judge.studies(damper, search.hardest[damper])
    numbers |= _changes(judge, damper, numbers.get("worst_frequency", 0.0), None, studies)
    if judge.count > 1:
        numbers["alike"], one, case = _alike(m, damper)
        studies["alike"] = one.studies(damper, case)["worst"]
    return _design(judge, damper, quick=False, box=damper.box, studies=studies, **numbers)


def _over_frequencies(every: pd.DataFrame, judge: StructureJudge) -> dict[str, Any]:
    """What counts over frequencies in the band and beyond; a run belongs to the nearest one."""
    hertz = np.array(sorted([*judge.band, *judge.beyond]))
    nearest = np.abs(every.frequency.values[:, None] - hertz).argmin(axis=1)
    worst, built = np.zeros(len(hertz)), np.zeros(len(hertz))
    np.maximum.at(worst, nearest, every.value.values)
    np.maximum.at(built, nearest[every.built], every.value.values[every.built])
    over = every.value / _without(judge, every.frequency.tolist())
    outside = over.where(every.beyond, 0.0)
    return {
        "band_ratio": float(over[~every.beyond].max()),
        "outside_ratio": float(outside.max()),
        "outside_frequency": float(every.frequency[outside.argmax()]),
        "response": pd.DataFrame(
            {
                "frequency": hertz,
                "without": _without(judge, hertz.tolist()),
                "as_built": built,
                "worst": worst,
            }
        ),
    }


def _off_by(
    every: pd.DataFrame, m: StructureMachine, sizes: Mapping[str, float], tolerances: Sizes
) -> pd.DataFrame | None:
    """What counts with one quantity off its value, over frequencies and starts."""
    rows = []
    for k, (name, off) in enumerate(zip(sizes, tolerances, strict=True)):
        if off:
            aside = [(0,) * k + (part,) + (0,) * (2 - k) for part in (-1, 0, 1)]
            found = [float(every.value[every.off == one].max()) for one in aside]
            text = text_of(off, {"free_mass": "kg", "gap": "m"}.get(name, "1"))
            values = (text_of(value, m.measured[1]) for value in found)
            rows.append([f"{label_of(name)}, {text}", *values])
    return _table_of_tolerances(rows)


def _hardest(every: pd.DataFrame) -> dict[str, float]:
    """Of all runs the hardest impact, and the most impacts and power of a run that repeats."""
    names = [name for name in ("approach_speed", "impulse", "impact_energy") if name in every]
    found = {name: float(every[name].max()) for name in names}
    if "impact_rate" in every:
        found["impact_rate"] = float(every.impact_rate.max())
        found["power"] = float((every.impact_rate * every.impact_energy).max())
    return found


def _largest(every: pd.DataFrame, fresh: Any) -> dict[str, Any]:
    """The worst case of all runs, and how many of the fresh ones exceed it."""
    worst, fresh = float(every.value.max()), np.nan_to_num(fresh, nan=np.inf, posinf=np.inf)
    return {
        "worst": worst,
        "runs": float(len(every)),
        "as_built": float(every.value[every.built].max()),
        "fresh_share": 100.0 * float((fresh > worst).mean()),
        "fresh_ratio": float(fresh.max()) / worst,
    }


def cube_of(study: Mapping[str, Any]) -> xr.Dataset:
    """Run a study as its file would be run, and return its cube."""
    from damper.study.messages import in_plain_words
    from damper.study.parts import SimulatedStudy
    from damper.study.rules import check_study
    from damper.sweep.cube import gather
    from damper.sweep.slices import simulate_slice

    with in_plain_words():
        made = SimulatedStudy.model_validate(dict(study))
        check_study(made)
    (job,) = made.parts({}).values()
    with progress_bar(made.title.rpartition(": ")[2], "runs") as show:
        settings = job.settings | {"forcing": made.force, "workers": None, "progress": show}
        part = simulate_slice(**settings)
    (job,) = made.gathered({}).values()
    return gather([part], **job.settings)


def _worst(array: xr.DataArray, keep: str = "") -> xr.DataArray:
    """The greatest value; infinite where a run stopped."""
    return array.fillna(np.inf).max([dim for dim in array.dims if dim != keep])


def _decay_numbers(cube: xr.Dataset, envelope: xr.Dataset, m: Machine) -> dict[str, Any]:
    times = cube.fall_time.isel(part=0)
    peaks = envelope[["peak_time", "peak_amplitude"]].to_dataframe().dropna().reset_index()
    numbers: dict[str, Any] = {"tolerances": _tolerances(times, m)}
    if len(peaks):  # under heavy damping there are none
        time, built = peaks.peak_time - peaks.peak_time.iloc[0], peaks.peak_amplitude
        alone = built.iloc[0] * np.exp(-m.damping_ratio * m.rate * time)
        table = {"time": time, "without": alone, "as_built": built}
        numbers["response"] = pd.DataFrame(table)
    return numbers


def _record_numbers(
    every: pd.DataFrame, cube: xr.Dataset, judge: WorstCase, studies: dict[str, Any]
) -> dict[str, Any]:
    m, history = judge.machine, cube_of(studies["history"])
    sizes = cube[m.measured[0]]
    over = _worst(sizes, "force_amplitude") / sizes.force_amplitude / _without(judge, [])[0]
    cube = cube.sel(force_amplitude=1.0)
    table = pd.DataFrame(
        {
            "time": history.trajectory_time.values,
            "without": _alone(judge, studies, history),
            "as_built": history.trajectory_displacement.values,
        }
    )
    return {
        "response": table.dropna().reset_index(drop=True),
        "tolerances": _tolerances(cube[m.measured[0]], m),
        "weak_ratio": float(over[0]),
        "strong_ratio": float(over[2]),
        **_hardest(every),
    }


def _as_built(array: xr.DataArray, but: str = "") -> xr.DataArray:
    """The runs without tolerances, or with those of one quantity."""
    for name in ("free_mass", "gap", "restitution"):
        if name in array.dims and name != but:
            array = array.isel({name: 1})
    return array


def _tolerances(array: xr.DataArray, m: Machine) -> pd.DataFrame | None:
    rows = []
    for name, unit in (("free_mass", "kg"), ("gap", "m"), ("restitution", "1")):
        if name in array.dims:
            found = _worst(_as_built(array, name), name)
            off = text_of(float(found[name][2] - found[name][1]), unit)
            values = (text_of(value, m.measured[1]) for value in found.values.tolist())
            rows.append([f"{label_of(name)}, {off}", *values])
    return _table_of_tolerances(rows)


def _table_of_tolerances(rows: list[list[str]]) -> pd.DataFrame | None:
    return pd.DataFrame(rows, columns=["off by", "less", "as built", "more"]) if rows else None


def _runs_of(motions: xr.Dataset, m: Machine, frequency: float) -> pd.DataFrame:
    """The runs of the study of motions, as the search has its own."""
    made = {
        "value": motions[m.measured[0]].fillna(np.inf).values,
        "frequency": frequency,
        "built": True,
        "impact_rate": frequency * motions.impacts_per_period.values,
        "approach_speed": motions.max_approach_speed.values,
        "impulse": motions.max_impulse.values,
        "impact_energy": motions.max_impact_loss.values,
    }
    return pd.DataFrame(made)


def _band_numbers(every: pd.DataFrame, cube: xr.Dataset, judge: WorstCase) -> dict[str, Any]:
    m = judge.machine
    axis, band, beyond = "forcing_frequency", judge.band, judge.beyond
    array = cube[m.measured[0]]
    hertz = np.array(sorted([*band, *beyond]))
    inside = np.isin(hertz, band)
    worst, built = _worst(array, axis).values, _worst(_as_built(array), axis).values
    # A run between the frequencies of the band belongs to the nearest one.
    nearest = np.abs(every.frequency.values[:, None] - np.array(band)).argmin(axis=1)
    places = np.flatnonzero(inside)[nearest]
    np.maximum.at(worst, places, every.value.values)
    np.maximum.at(built, places[every.built], every.value.values[every.built])
    without = _without(judge, hertz.tolist())
    ratio = worst / without
    out = np.argmax(np.where(inside, 0.0, ratio))
    table = {"frequency": hertz, "without": without, "as_built": built, "worst": worst}
    return {
        "band_ratio": float((every.value / _without(judge, every.frequency.tolist())).max()),
        "outside_ratio": float(ratio[out]),
        "outside_frequency": float(hertz[out]),
        **_hardest(every),
        "response": pd.DataFrame(table),
        "tolerances": _tolerances(array.isel({axis: np.flatnonzero(inside)}), m),
    }


def _history(
    judge: WorstCase, damper: Sizes, case: Any, studies: dict[str, Any]
) -> dict[str, pd.DataFrame]:
    """The motion in the worst case about its largest displacement; its study is added."""
    whole = cube_of(judge.motion(damper, case))
    moved = np.abs(np.nan_to_num(whole.trajectory_displacement.values.squeeze()))
    about = float(whole.trajectory_time.values.squeeze()[moved.argmax()]) * case.hertz[-1]
    if not moved.any():  # it stopped before the window
        return {}
    studies["history"] = judge.motion(damper, case, about)
    found = cube_of(studies["history"]).squeeze()
    table = {
        "time": found.trajectory_time.values,
        "without": _alone(judge, studies, found),
        "with_damper": found.trajectory_displacement.values,
    }
    free = found.trajectory_free_displacement.values
    for k, one in enumerate(np.atleast_2d(free)):
        name = f"relative_{k}" if judge.count > 1 else "relative"
        table[name] = one - table["with_damper"]
    return {"history": pd.DataFrame(table).dropna(subset="time").reset_index(drop=True)}


def _alone(judge: WorstCase, studies: dict[str, Any], history: xr.Dataset) -> np.ndarray:
    """Displacement of the machine alone at the samples of a time history; NaN at its events.

    Where the free mass rubs it is from a study of its own, which is added.
    """
    if "trajectory_alone" in history:
        return history.trajectory_alone.values
    studies["history_without"] = judge.apart(studies["history"])
    alone = cube_of(studies["history_without"]).squeeze().trajectory_displacement.values
    sampled = history.trajectory_event.isnull() & history.trajectory_time.notnull()
    found = np.full(sampled.shape, np.nan)
    found[sampled.values] = alone[: int(sampled.sum())]
    return found


def _motions(cube: xr.Dataset, m: Machine) -> pd.DataFrame:
    """Where random starts lead to, how often, and what counts there."""
    from damper.analysis.basins import basin_fractions
    from damper.analysis.motions import attractors

    classes, names = attractors(cube)
    fractions = basin_fractions(cube).set_index("motion")
    rows = []
    variable, unit, words = m.measured
    for number, name in enumerate(names):
        some = cube.where(classes == number)
        row = fractions.loc[name]
        rows.append(
            {
                "motion": name,
                "of starts": f"{row.fraction:.0%} ({row.lower:.0%} to {row.upper:.0%})",
                words: text_of(float(some[variable].max()), unit),
                "impacts per cycle": f"{float(some.impacts_per_period.mean()):.3g}",
            }
        )
    return pd.DataFrame(rows)


def _orbit(judge: WorstCase, damper: Sizes, frequency: float) -> Any:
    """The stable motion at a frequency, as built, if one cycle repeats; else None."""
    import damper as package

    if not frequency or judge.count > 1:
        return None
    kind = judge.machine.force[0]
    given = judge.machine.primary | judge.machine.weight | judge.sizes(damper)
    p = package.SIParameters(**given, forcing_frequency=2.0 * math.pi * frequency, forcing=kind)
    try:
        orbit = package.periodic_orbit(p, settle=judge.run["transient"])
    except ValueError:
        return None
    return orbit if orbit.stable and orbit.impacts else None


def _margins(orbit: Any, gap: float) -> dict[str, float]:
    """Gaps at which a periodic motion changes its kind."""
    from damper import continue_orbit

    low, high = (part * gap for part in _GAPS)
    branch = continue_orbit(orbit, "gap", low, high, **_FOLLOW)
    values = [point.value for point in branch.special_points if point.kind != "grazing"]
    below = [value for value in values if value < gap]
    above = [value for value in values if value > gap]
    found = {"lowest_gap": max(below)} if below else {}
    return found | ({"highest_gap": min(above)} if above else {})


def _changes(
    judge: Any, damper: Any, frequency: float, orbit: Any, studies: dict[str, Any]
) -> dict[str, Any]:
    """What a little more of each quantity changes; a study is added where runs say so."""
    m, slopes = judge.machine, {}
    variable, _, words = m.measured
    if orbit and variable == "peak_displacement":
        try:
            slopes = {
                name: orbit.peak_sensitivity(name) * getattr(orbit.parameters, name) / orbit.peak
                for name in CHANGED
            }
            how = "by the derivative of the periodic motion"
        except ValueError:
            pass
    if not slopes:
        nearby: Iterable[tuple[str, Any]]
        if isinstance(judge, StructureJudge):
            nearby = judge.nearby(damper, frequency)
        else:
            studies["nearby"] = judge.nearby(damper, frequency)
            nearby = _nearby(cube_of(studies["nearby"])[variable])
        with np.errstate(invalid="ignore"):  # all infinite
            slopes = {n: (more - less) / (2.0 * PART * at) for n, (less, at, more) in nearby}
        how = "by differences of runs from the same starts, which may jump"
    where = f" at {frequency:.4g} Hz" if frequency else ""
    rows = [
        [
            f"{label_of(name)}, {100.0 * PART:g} %",
            f"{100.0 * PART * slope if abs(slope) > _NO_SLOPE else 0.0:+.2g} %",
        ]
        for name, slope in slopes.items()
    ]
    return {
        "slopes": slopes,
        "changes": pd.DataFrame(rows, columns=["more of", f"changes the {words} by"]),
        "found_by": f"Changes of the {words}{where}, found {how}.",
    }


def _nearby(array: xr.DataArray) -> Iterator[tuple[str, np.ndarray]]:
    """Worst values with a little less of each quantity, as built, and with a little more."""
    for name in (name for name in CHANGED if name in array.dims):
        others = {n: 1 for n in CHANGED if n in array.dims and n != name}
        yield name, _worst(array.isel(others), name).values


def _checked(found: Design) -> Design:
    """Return it; ValueError where it is not within the limit, with what would be feasible."""
    m, value = found.machine, found.closed_form if found.quick else found.worst
    most = math.inf if m.limit is None else m.limit
    if value <= most and not math.isinf(value):
        return found
    unit, words = m.measured[1:]
    sizes = {name: text for name, _, text in found.lines}
    best = f"the best one, {sizes['free_mass']} with a gap of {sizes['gap']}"
    asked = f"limit = {most:g} {unit}" if most < math.inf else "no end of the decay"
    feasible = f"limit >= {text_of(value, unit)}" if value < math.inf else "a larger decay_to"
    needed = _mass_for(m, most) if m.has_closed_forms else 0.0
    more = f"; by the closed form a mass of some {text_of(needed, 'kg')}" if needed else ""
    raise ValueError(
        f"{asked}: no damper of up to {text_of(m.largest_mass, 'kg')} and "
        f"{text_of(m.largest_gap, 'm')} holds it: {best}, has the {words} {text_of(value, unit)}; "
        f"must be {feasible}{more}"
    )


def _mass_for(m: Machine, limit: float) -> float:
    """Free mass in kg whose closed form at resonance gives the limit; 0 where there is none."""
    if m.band is None or not limit < math.inf:
        return 0.0
    lost = m.counted(m.static, m.rate / math.tau) / limit - 2.0 * m.damping_ratio
    bounciest = max(m.restitutions)
    ratio = lost * math.pi / 4.0 * (1.0 - bounciest) / (1.0 + bounciest)
    return ratio * m.mass if m.largest_mass / m.mass < ratio <= MASS_RATIOS[1] else 0.0
