"""`damper.design` on a structure: which box, which mass and which gap.

The worst case of a damper is the greatest value at the wanted point over tolerances, frequencies of
the band and starts: at rest, on the motion without the damper, and at random; under a record, over
places of the free mass. The search is that of a machine of one mass, on coarser grids: a run takes
longer. Fresh random starts that exceed the worst case also after ten times the transient raise it;
the hardest ones become cases of all dampers, and another one may be better.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from damper.parameters.dampers import SIParameters
from damper.parameters.lazy import pd
from damper.parameters.masses import equal_masses
from damper.parameters.names import unknown_name
from damper.parameters.run import RunSettings
from damper.parameters.structure import Structure
from damper.sizing.machine import COUNTS, ONE_OF_STOPS, RECORDS, Room, RoomSettings, of_folder
from damper.sizing.search import Grid, Search, measure
from damper.sizing.study import (
    AFTER,
    APART,
    FINE,
    PART,
    PLACES,
    SHOWN,
    SPREAD,
    Judge,
    in_words,
    rounded,
)
from damper.structures.structure.settings import StructureEntry, entry_of
from damper.study.fields import DistinctList, Line, Text, Unit
from damper.study.messages import Mistakes
from damper.study.yaml_file import read_yaml, words_of
from damper.sweep.points import thrown_back

_DRIVES = ("force_amplitude", "base_amplitude", *RECORDS)
_ONE_OF: dict[tuple[str, ...], str] = {
    _DRIVES: "the drive is missing: what makes it vibrate",
    **ONE_OF_STOPS,
}
#: The grid: parts of the largest mass, gaps down to `_LEAST_GAP` of the largest.
_GRID = Grid(2.0**0.5, (1.0, 0.5, 0.25), (2.0**0.125, 2.0**0.03125))
_LEAST_GAP = 1.0 / 64.0
#: Random starts at each frequency, and fresh ones of a round and of the check.
_RANDOM, _FRESH, CHECK = 2, 100, 100
#: Hardest fresh starts of a round that all dampers get.
_KEPT = 5
#: Times the transient after which a fresh start that exceeds the worst case is judged.
_LONGER = 10
#: A gap in m that no free mass crosses.
_NO_WALLS = 1e6
#: Samples of a time history in a period of the mode of the lowest frequency.
_SAMPLES = 40


class StructureMachine(Room, RoomSettings):  # type: ignore[misc]
    """A structure, what drives it, the room for a damper on it, and what counts.

    Exactly one of force_amplitude, base_amplitude, force_record and acceleration_record says what
    drives it, and one of restitution, restitution_range and materials what the stops are of.
    """

    one_of = _ONE_OF
    carrier = "the structure's mass that its box feels"

    title: Annotated[Line, Field(description="What it is, for headings.")] = "A structure"
    structure: Annotated[StructureEntry, Field(description="As in a study of kind structure.")]
    force_amplitude: Annotated[
        float | None, Unit("N"), Field(gt=0, description="Of a harmonic force at its place.")
    ] = None
    base_amplitude: Annotated[
        float | None, Unit("m"), Field(gt=0, description="Of a harmonic motion of the base.")
    ] = None
    frequencies: Annotated[
        int, Field(ge=2, le=200, description="Of the band in the worst case, its ends included.")
    ] = 11
    point: Annotated[Text, Field(description="Where the motion is to be small.")]
    boxes: Annotated[
        DistinctList[Text] | None, Field(description="Where a damper may be; all places if not.")
    ] = None
    counts: Annotated[
        Literal["peak_displacement", "rms_displacement", "peak_acceleration"],
        Field(description="What is to be small."),
    ] = "peak_displacement"
    transient: Annotated[int, Field(ge=0, description="Cycles of a run before it counts.")] = 200
    periods: Annotated[int, Field(ge=1, description="Cycles that count.")] = 50
    folder: Annotated[str, Field(description="Where paths of the structure begin.")] = "."

    def check_together(self, mistakes: Mistakes) -> None:
        if self.is_recorded and self.band is not None:
            mistakes.add(("band",), "a record has no band of frequencies", "left out")
        elif not self.is_recorded and self.band is None:
            mistakes.add(("band",), "band is missing", "band: [lowest, highest] in Hz")
        elif self.band is not None and not self.band[0] > 0.0:
            mistakes.add(("band",), f"{self.band[0]:g} Hz", "frequencies above 0")
        if not self.mass_tolerance < self.largest_mass:
            message = f"a free mass of up to {self.largest_mass:g} kg is within its tolerance"
            mistakes.add(("largest_mass",), message, "more than mass_tolerance")
        self.check_record(mistakes)
        self.check_room(mistakes)
        try:
            made = self.made
        except (ValueError, TypeError, OSError) as error:
            mistakes.add(("structure",), words_of(error))
            return
        place = "base" if self.is_based else "force"
        if getattr(made, place) is None:
            mistakes.add(("structure",), f"it has no {place}, which moves it", f"a {place}")
        asked = [("point", self.point, made.points)]
        asked += [("boxes", name, made.boxes) for name in self.boxes or ()]
        for key, name, known in asked:
            if name not in known:
                mistakes.add((key,), str(unknown_name(key, name, known)))

    @cached_property
    def made(self) -> Structure:
        """The structure; ValueError, TypeError or OSError where there is none."""
        return self.structure.made(Path(self.folder))

    @property
    def is_based(self) -> bool:
        """Whether its base moves."""
        return self.base_amplitude is not None or self.acceleration_record is not None

    @property
    def force(self) -> tuple[str, float]:
        """Kind of the forcing and its amplitude, as a study has them."""
        if self.is_recorded:
            return "record", 1.0
        kind = "harmonic" if self.base_amplitude is None else "base"
        return kind, float(self.force_amplitude or self.base_amplitude or 0.0)

    @property
    def measured(self) -> tuple[str, str, str]:
        """Of what counts: variable of a cube, unit, words."""
        variable, unit, words = COUNTS[self.counts]
        from_base = " from the base" if self.is_based and unit == "m" else ""
        return variable, unit, f"{words} at {self.point}{from_base}"

    @property
    def least_mass(self) -> float:
        """Least free mass in kg; it may be off by its tolerance."""
        return 1e-9 * float(self.largest_mass)

    @property
    def has_closed_forms(self) -> bool:
        """There are none for structures."""
        return False

    @property
    def size(self) -> float:
        """What is measured is in SI units."""
        return 1.0

    @property
    def hertz(self) -> list[float]:
        """Frequencies of the worst case."""
        return [] if self.band is None else np.linspace(*self.band, self.frequencies).tolist()

    @cached_property
    def lowest(self) -> float:
        """Lowest frequency of a mode that vibrates, in Hz."""
        return float(min((f for f in self.made.frequencies.tolist() if f > 0.0), default=1.0))

    def alone(self, hertz: float) -> np.ndarray:
        """Complex amplitudes of the coordinates without a damper: real part of them by sin.

        (K - omega^2 M + i omega C) q = B f, as for any linear structure.
        """
        s, rate, size = self.made, 2.0 * math.pi * hertz, self.force[1]
        place: Any = s.base if self.is_based else s.force
        push = size * (rate**2 * (s.mass @ place) if self.is_based else place)
        return np.linalg.solve(s.stiffness - rate**2 * s.mass + 1j * rate * s.damping, push)  # type: ignore[no-any-return]

    def undamped(self, hertz: float) -> float:
        """Amplitude in m at the point without the damper at a frequency in Hz."""
        return float(abs(self.made.points[self.point] @ self.alone(hertz)))

    def mass_at(self, box: str) -> float:
        """Mass in kg that a blow on a box feels: 1 / (b . M^-1 b)."""
        b = self.made.boxes[box]
        return 1.0 / float(b @ np.linalg.solve(self.made.mass, b))

    def written(self) -> dict[str, Any]:
        """Its settings as a file has them, with paths of the structure that hold in any folder."""
        found, folder = super().written(), Path(self.folder).resolve()
        found.pop("folder", None)
        entry, paths = found["structure"], self.structure.files
        for name, path in paths.items():
            (entry if name in entry else entry["matrices"])[name] = str(folder / path)
        return found  # type: ignore[no-any-return]


class BoxedDamper(NamedTuple):
    """A free mass in kg, its gap in m, the restitution of its stops, and its box."""

    mass: float
    gap: float
    restitution: float
    box: str


class StructureCase(NamedTuple):
    """A start, and how far a damper is off."""

    part: float = 0.0
    """Size of the motion of the structure, over that without a damper; and its phase in cycles."""
    turn: float = 0.0
    place: float = 0.0
    """Of the free mass between its walls, -1 to 1."""
    speed: float = 0.0
    """Of the free mass relative to its box, over the largest speed of the box."""
    spacing: float = 0.0
    """Of several masses, between the places of one and the next."""
    hertz: tuple[float, ...] = ()
    """The frequency, if there is one."""
    off: tuple[float, ...] = (0, 0, 0)
    """Parts of the tolerances of mass, gap and restitution."""
    longer: int = 1
    """Factor of the transient."""


class BoxedRun(NamedTuple):
    """A case of a damper."""

    damper: BoxedDamper
    case: StructureCase


@dataclass(frozen=True)
class StructureJudge(Judge):
    """How dampers on a structure are judged; every run that was made is kept."""

    machine: StructureMachine
    workers: int | None = None
    """Threads; that of the cores when not given."""
    count: int = 1
    """Number of equal free masses side by side, which share the mass of a damper."""
    seen: dict[BoxedRun, dict[str, float]] = field(default_factory=dict)

    observers = None

    @property
    def band(self) -> list[float]:
        """Frequencies in the band, in Hz."""
        return self.machine.hertz

    @property
    def fine(self) -> list[float]:
        """Frequencies at which the motion without a damper may be largest, in Hz."""
        if self.machine.band is None:
            return []
        low, high = self.machine.band
        own = [f for f in self.machine.made.frequencies.tolist() if low <= f <= high]
        return [*np.linspace(low, high, 2001).tolist(), *own]

    @cached_property
    def cases(self) -> list[StructureCase]:
        """Cases of any damper; fresh ones that are hard for one damper are added to them."""
        random, made = np.random.default_rng(0), []
        for off in self.corners:
            if self.machine.is_recorded:
                made += [
                    StructureCase(place=place, spacing=spacing, off=off)
                    for place in PLACES
                    for spacing in self.spacings
                ]
            for hertz in self.band:
                made += self.starts(hertz, off)
                made += [self._at_random(random, hertz)._replace(off=off) for _ in range(_RANDOM)]
        return made

    @property
    def spacings(self) -> list[float]:
        """Several masses begin alike and apart."""
        return [0.0, APART] if self.count > 1 else [0.0]

    def starts(self, hertz: float, off: tuple[float, ...] = (0, 0, 0)) -> list[StructureCase]:
        """Starts at rest, the free mass stirred, and on the motion without damper."""
        rest = StructureCase(speed=0.1, hertz=(hertz,), off=off)
        both = rest, rest._replace(part=1.0, speed=0.0)
        return [one._replace(spacing=spacing) for spacing in self.spacings for one in both]

    def _at_random(self, random: np.random.Generator, hertz: float) -> StructureCase:
        part, turn = random.uniform(0.0, 1.5), random.uniform()
        place, speed = random.uniform(-0.99, 0.99), random.uniform(-1.0, 1.0)
        spacing = random.uniform(0.0, 4.0) if self.count > 1 else 0.0
        return StructureCase(part, turn, place, speed, spacing, (hertz,))

    def fresh(self, seed: int, count: int) -> list[StructureCase]:
        """Random starts at random frequencies of the band, of dampers anyhow within tolerances."""
        random, m = np.random.default_rng(seed), self.machine
        made = []
        for _ in range(count):
            if m.band is None:
                one = StructureCase(place=random.uniform(-1.0, 1.0))
                if self.count > 1:
                    one = one._replace(spacing=random.uniform(0.0, 4.0))
            else:
                one = self._at_random(random, float(random.uniform(*m.band)))
            off = random.uniform(-1.0, 1.0, 3).tolist()
            kept = (part if t else 0.0 for part, t in zip(off, self.tolerances, strict=True))
            made.append(one._replace(off=tuple(kept)))
        return made

    def near(self, worst: StructureCase) -> list[StructureCase]:
        """No more cases about the worst one: fresh ones are everywhere."""
        return []

    def chain(self, damper: BoxedDamper, case: StructureCase) -> list[BoxedRun]:
        """The run of a case."""
        return [BoxedRun(damper, case)]

    def observed(self, chains: Sequence[Sequence[BoxedRun]], observers: Any) -> dict[str, Any]:
        """Make the runs that are new, and return what is measured in each."""
        from damper.sweep.runs import in_threads

        runs = [one for chain in chains for one in chain]
        new = [one for one in dict.fromkeys(runs) if one not in self.seen]
        rows = in_threads([partial(self.measured, one) for one in new], self.workers)
        self.seen.update(zip(new, rows, strict=True))
        names = (self.machine.measured[0], *_OF_MASS)
        return {name: np.array([self.seen[one][name] for one in runs]) for name in names}

    def measured(self, run: BoxedRun) -> dict[str, float]:
        """Measure one run, at the point and of the free mass; NaN where it stopped."""
        from damper.sweep.measured import measured  # the engine with it

        m = self.machine
        p = self.parameters(run)
        found = measured(p, self.cycles(p, run.case.longer), state=p.started(**self.start(run)))
        at_point = float(found[m.counts][[*m.made.points].index(m.point)])
        of_masses = {name: float(np.nanmax(found[name], initial=0.0)) for name in _OF_MASS}
        return of_masses | {m.counts: at_point, "impact_power": float(found["impact_power"].sum())}

    def parameters(self, run: BoxedRun) -> Any:
        """The structure with its damper, as it is driven."""
        m, (kind, size) = self.machine, self.machine.force
        driven = {"forcing": m.record if m.is_recorded else kind, "force_amplitude": size}
        if run.case.hertz:
            driven["forcing_frequency"] = 2.0 * math.pi * run.case.hertz[0]
        if run.damper.gap != _NO_WALLS:
            driven |= m.weight
        return SIParameters(structure=m.made, masses=self.masses(run), **driven)  # type: ignore[arg-type]

    def masses(self, run: BoxedRun) -> list[dict[str, Any]]:
        """The free masses, as a study has them; gaps of several differ a little."""
        sizes, made = self.sizes(run.damper, run.case.off), []
        for one in equal_masses(self.count, SPREAD if self.count > 1 else 0.0):
            own = {"free_mass": sizes["free_mass"] * one["mass_share"]}
            own["gap"] = sizes["gap"] * one["clearance_factor"]
            made.append({"box": run.damper.box, **sizes, **own})
        return made

    def cycles(self, p: Any, longer: int = 1) -> tuple[float, float]:
        """Cycles of a run before its window, and in it."""
        m = self.machine
        if not m.is_recorded:
            return longer * m.transient, m.periods
        after = 0.0 if m.counts == "rms_displacement" else AFTER / m.lowest
        run = {"transient": 0, "periods": {"time": rounded(m.record.end + after, 8)}}
        return RunSettings(**run).cycles(p.cycle, p.forcing.end)  # type: ignore[arg-type]

    def start(self, run: BoxedRun) -> dict[str, list[float]]:
        """Start of a case: a part of the motion without a damper, the free mass anywhere.

        Arguments of `StructureParameters.started`.
        """
        case, box = run.case, self.machine.made.boxes[run.damper.box]
        places = [thrown_back(case.place + k * case.spacing) for k in range(self.count)]
        if not case.hertz:
            return {"position": places}
        alone, rate = self.machine.alone(case.hertz[0]), 2.0 * math.pi * case.hertz[0]
        turned = case.part * np.exp(2j * math.pi * case.turn) * alone
        x, v = turned.imag, rate * turned.real  # of q sin(omega t) at 0
        return {
            "displacement": x.tolist(),
            "velocity": v.tolist(),
            "position": places,
            "relative_velocity": [case.speed * rate * float(abs(box @ alone))] * self.count,
        }

    def nearby(
        self, damper: BoxedDamper, frequency: float
    ) -> Iterator[tuple[str, tuple[float, ...]]]:
        """Worst values with a little less of each quantity, as built, and with a little more."""
        places = [StructureCase(place=place) for place in PLACES]
        cases = self.starts(frequency) if frequency else places
        for key, (name, value) in zip(damper._fields, self.sizes(damper).items(), strict=False):
            if not value or (name == "restitution" and value > 0.99):
                continue
            sizes = ({key: (1.0 + part * PART) * value} for part in (-1, 0, 1))
            about = [damper._replace(**size) for size in sizes]  # type: ignore[arg-type]
            chains = ([self.chain(one, case) for case in cases] for one in about)
            yield name, tuple(float(measure(self, some).max()) for some in chains)

    def carrier_mass(self, damper: BoxedDamper) -> float:
        """Mass in kg that a free mass is compared with."""
        return self.machine.mass_at(damper.box)

    def history(self, damper: BoxedDamper) -> pd.DataFrame:
        """Displacement of the point under a record as built, and without damper, over the time."""
        from damper.sweep.measured import measured  # the engine with it

        m, made = self.machine, dict[str, Any]()
        place = [*m.made.points].index(m.point)
        for name, gap in (("without", _NO_WALLS), ("as_built", damper.gap)):
            run = BoxedRun(damper._replace(gap=gap), StructureCase())
            p = self.parameters(run)
            cycles = self.cycles(p)
            samples = math.ceil(_SAMPLES * m.lowest * 2.0 * math.pi / p.forcing_frequency)
            state = p.started(**self.start(run))
            found = measured(p, cycles, samples, math.floor(cycles[1]), state)
            made |= {"time": found["time"], name: found["displacement"][:, place]}
        return pd.DataFrame(made)

    def motion(self, damper: BoxedDamper, case: StructureCase) -> pd.DataFrame:
        """The motion in a case about its largest displacement, and without damper.

        As `damper.sizing.answer.Design.history`.
        """
        from damper.sweep.measured import measured  # the engine with it

        run, place = BoxedRun(damper, case), [*self.machine.made.points].index(self.machine.point)
        p = self.parameters(run)
        cycles, state = self.cycles(p, case.longer), p.started(**self.start(run))
        sampled = {"samples_per_period": FINE, "events": 0, "bodies": list(range(self.count))}
        how = (cycles, FINE, int(cycles[1]), state)
        found = measured(p, *how, observers={"trajectory": sampled})
        apart = self.parameters(run._replace(damper=damper._replace(gap=_NO_WALLS)))
        moved = found["displacement"][:, place]
        made = {"without": measured(apart, *how)["displacement"][:, place], "with_damper": moved}
        away = found["trajectory_free_displacement"] - found["trajectory_displacement"]
        for k, one in enumerate(away[:, : len(moved)]):
            made["relative" if self.count == 1 else f"relative_{k}"] = one
        first = max(round(np.nanargmax(np.abs(moved)) / FINE) - SHOWN // 2, 0)
        first = min(first, max(int(cycles[1]) - SHOWN, 0)) * FINE
        table = pd.DataFrame({"time": found["time"] - found["time"][first]} | made)
        return table.iloc[first : first + SHOWN * FINE + 1].reset_index(drop=True)

    def studies(self, damper: BoxedDamper, hardest: StructureCase) -> dict[str, dict[str, Any]]:
        """Runs from rest with the damper as built and with walls out of reach; the hardest case.

        Where weight acts it does so without walls, too, and the second of them is left out.
        """
        rest = self._study("from rest", BoxedRun(damper, StructureCase(hertz=tuple(self.band[:1]))))
        for one in rest["masses"]:
            del one["gap"]
        gaps = [damper.gap] if self.machine.weight else [damper.gap, _NO_WALLS]
        rest["axes"] = {"gap": {"values": gaps}}
        if self.band:
            del rest["parameters"]["forcing_frequency"]
            rest["axes"]["forcing_frequency"] = {"values": self.band, "unit": "Hz"}
        run = BoxedRun(damper, hardest)
        worst = self._study("its worst case", run) | {"start": self.start(run)}
        return {"from_rest": rest, "worst": worst}

    def _study(self, title: str, run: BoxedRun) -> dict[str, Any]:
        """The study of one run, from rest."""
        m, p = self.machine, self.parameters(run)
        transient, periods = self.cycles(p, run.case.longer)
        driven = {"force_amplitude": m.force[1], **m.weight}
        driven |= {"forcing_frequency": p.forcing_frequency} if run.case.hertz else {}
        return {
            "title": f"{m.title}: {title}",
            "source": "damper design",
            "kind": "structure",
            "structure": m.written()["structure"],
            "masses": self.masses(run),
            "parameters": driven,
            "forcing": m.forcing,
            "transient": transient,
            "periods": math.ceil(periods),
        }

    @cached_property
    def alone(self) -> float:
        """What counts under a record without a damper."""
        none = BoxedDamper(self.machine.largest_mass, _NO_WALLS, 0.0, next(iter(self.boxes)))
        return float(measure(self, [self.chain(none, StructureCase())])[0])

    @property
    def boxes(self) -> list[str]:
        """Boxes that a damper may be in, and that some mode moves."""
        m = self.machine
        return [name for name in m.boxes or m.made.boxes if m.made.boxes[name].any()]

    def closed_form(self, damper: BoxedDamper) -> dict[str, float]:
        """Nothing: there are no closed forms for structures."""
        return {}

    def idle(self, damper: BoxedDamper) -> float:
        """What counts where no wall of a damper reaches a free mass at rest; else 0."""
        m, box = self.machine, self.machine.made.boxes[damper.box]
        if m.weight:  # it lays the free mass on a wall, or friction takes it along
            return 0.0
        still = (h for h in self.band if abs(box @ m.alone(h)) < 0.5 * damper.gap)
        return max((m.counted(m.undamped(h), h) for h in still), default=0.0)

    def assumptions(self, quick: bool) -> Iterator[str]:
        """Sentences of a card on what was assumed."""
        m = self.machine
        yield in_words(m.weight, self.count)
        if m.weight.get("gravity"):
            yield "Displacements count from where the structure rests without the free mass."
        yield f"Linear modes of the structure: {len(m.made)}; impacts take no time."
        if m.is_recorded:
            yield "All begins at rest, the free mass anywhere in the box."
            yield "Another record is another case."
            return
        yield (
            f"Starts at each of {len(self.band)} frequencies: at rest, on the motion without "
            f"damper, and {_RANDOM} at random. {m.transient} cycles pass before {m.periods} count."
        )


#: Measured of the free mass.
_OF_MASS = ("max_approach_speed", "impacts_per_cycle", "impact_power")


class StructureSearch(Search):
    """Dampers of a structure, with what is known of their worst cases."""

    judge: StructureJudge
    promising, first_cases = 2, 1
    _grid = _GRID  # type: ignore[assignment]

    def first_grid(self) -> list[Any]:
        """Every box with parts of the largest mass and gap."""
        m = self.judge.machine
        count = round(-math.log(_LEAST_GAP) / math.log(_GRID.ratio))
        gaps = [m.largest_gap * _GRID.ratio**-k for k in range(count + 1)]
        masses = [self._mass(part * m.largest_mass) for part in _GRID.masses]
        return [
            damper
            for box in self.judge.boxes
            for damper in self._dampers(
                BoxedDamper(0.0, 0.0, 0.0, box), masses, gaps, m.restitutions
            )
        ]

    def best_of_masses(self, found: Any) -> list[Any]:
        """The damper `found`, and the best one of each lighter mass of the grid in its box."""
        most, made = self.judge.machine.largest_mass, [found]
        for mass in (self._mass(part * most) for part in _GRID.masses):
            some = [one for one in self.bounds if one.mass == mass and one.box == found.box]
            made += [self.best_of(some)] if mass < found.mass and some else []
        return made

    def every_run(self, damper: Any) -> pd.DataFrame:
        """All runs of a damper: value, frequency, how far it is off, its hardest impact."""
        self.worst(damper)
        judge, m = self.judge, self.judge.machine
        cases = [*judge.cases, *self.near[damper]]
        if m.band is not None:
            cases += [case for hertz in judge.beyond for case in judge.starts(hertz)]
        found = judge.observed([judge.chain(damper, case) for case in cases], None)
        sizes = pd.DataFrame([judge.sizes(damper, case.off) for case in cases])
        own, speed = m.mass_at(damper.box), found["max_approach_speed"]
        each = sizes.free_mass / judge.count
        reduced = each * own / (each + own)
        hertz = np.array([case.hertz[0] if case.hertz else 1.0 for case in cases])
        values = found[m.counts]
        return pd.DataFrame(
            {
                "value": np.where(np.isnan(values), np.inf, values),
                "frequency": hertz,
                "off": [case.off for case in cases],
                "built": [not any(case.off) for case in cases],
                "beyond": ~np.isin(hertz, judge.band) & np.isin(hertz, judge.beyond),
                "approach_speed": speed,
                "impulse": reduced * (1.0 + sizes.restitution) * speed,
                "impact_energy": 0.5 * reduced * (1.0 - sizes.restitution**2) * speed**2,
                "impact_rate": hertz * found["impacts_per_cycle"],
                "power": found["impact_power"],
            }
        )

    def lasting(self, damper: BoxedDamper, cases: Sequence[StructureCase]) -> np.ndarray:
        """What counts in each; after a long transient where it exceeds the worst case."""
        values = measure(self.judge, [self.judge.chain(damper, case) for case in cases])
        above: list[int] = np.flatnonzero(values > self.bounds[damper]).tolist()
        if not self.judge.machine.is_recorded and above:
            again = [cases[k]._replace(longer=_LONGER) for k in above]
            values[above] = measure(self.judge, [self.judge.chain(damper, one) for one in again])
        return values

    def _rises(self, damper: Any, seed: int) -> bool:
        """Try fresh starts; once one exceeds the worst case, hard ones are cases of all dampers."""
        cases, every = self.judge.fresh(seed + 1, _FRESH), self.judge.cases
        values = self.lasting(damper, cases)
        if not values.max() > self.bounds[damper]:
            return False
        longer = 1 if self.judge.machine.is_recorded else _LONGER
        hard = [cases[k]._replace(longer=longer) for k in np.argsort(values)[-_KEPT:]]
        for left in self._left.values():
            left += range(len(every), len(every) + len(hard))
        every += hard
        self._hard = np.pad(self._hard, ((0, 0), (0, len(hard))))
        return True


def structure_machine(machine: Any, given: Mapping[str, Any]) -> StructureMachine | None:
    """Return a machine that has a structure; None for any other.

    ConfigError or ValueError lists all that is wrong.
    """
    if isinstance(machine, StructureMachine):
        if not given:
            return machine
        machine = machine.model_dump(exclude_unset=True)
    if machine is None or isinstance(machine, Mapping):
        data = dict(machine or {}) | dict(given)
        if isinstance(data.get("structure"), Structure):
            data["structure"] = entry_of(data["structure"])
        return StructureMachine.checked("", data) if "structure" in data else None
    if not isinstance(machine, str | Path):
        return None
    file = read_yaml(Path(machine))
    if not isinstance(file.data, dict) or "structure" not in file.data:
        return None
    data = {"folder": str(Path(machine).parent)} | of_folder(file.data, machine) | dict(given)
    return StructureMachine.checked_in(file, data)
