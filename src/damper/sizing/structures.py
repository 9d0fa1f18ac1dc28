"""`damper.design` on a structure: which box, which mass and which gap.

The worst case of a damper is the greatest value at the wanted point over frequencies of the band
and starts: at rest, on the motion without the damper, and at random. Dampers wait in the order of
the greatest value of their runs so far, which bounds their worst case from below; the first one
gets its next run, the hardest so far. The first that has all of its runs is the best: no other can
be better. Two finer grids about the best follow. Then fresh random starts, at frequencies between
those of the grid as well, that exceed its worst case also after ten times the transient raise it;
the hardest ones become cases of all dampers, and another one may be better.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from damper.parameters import State
from damper.parameters.dampers import SIParameters
from damper.parameters.lazy import pd
from damper.parameters.names import unknown_name
from damper.parameters.structure import Structure
from damper.parameters.unusual import unusual
from damper.sizing.clauses import EXCEEDED
from damper.sizing.machine import LARGEST_RESTITUTION
from damper.sizing.words import text_of
from damper.structures.structure.settings import StructureEntry
from damper.study.fields import DistinctList, Line, Pair, StrictModel, Text, Unit
from damper.study.messages import Mistakes
from damper.study.yaml_file import read_yaml
from damper.sweep.progress import Progress, progress_bar

#: What may be small: variable -> unit and words.
COUNTS = {
    "peak_displacement": ("m", "largest displacement"),
    "rms_displacement": ("m", "rms displacement"),
    "peak_acceleration": ("m/s2", "largest acceleration between impacts"),
}
#: Parts of the largest mass and the largest gap of the first grid, and ratios of finer ones.
_MASSES = (1.0, 0.5, 0.25)
_GAPS = tuple(2.0 ** (-0.5 * k) for k in range(13))
_FINER = (2.0**0.25, 2.0**0.0625)
#: Random starts at each frequency; fresh ones of a round, rounds at most, and those of the check.
_RANDOM, _FRESH, _ROUNDS, _CHECK = 2, 100, 12, 100
#: Hardest fresh starts of a round that all dampers get.
_KEPT = 5
#: Times the transient after which a fresh start that exceeds the worst case is judged.
_LONGER = 10


class StructureMachine(StrictModel):
    """A structure under a band of frequencies, the room for a damper on it, and what counts."""

    title: Annotated[Line, Field(description="What it is, for headings.")] = "A structure"
    structure: Annotated[StructureEntry, Field(description="As in a study of kind structure.")]
    force_amplitude: Annotated[
        float | None, Unit("N"), Field(gt=0, description="Of a harmonic force at its place.")
    ] = None
    base_amplitude: Annotated[
        float | None, Unit("m"), Field(gt=0, description="Of a harmonic motion of the base.")
    ] = None
    band: Annotated[
        Pair[float], Unit("Hz"), Field(description="Lowest and highest frequency, above 0.")
    ]
    frequencies: Annotated[
        int, Field(ge=2, le=200, description="Of the band in the worst case, its ends included.")
    ] = 11
    point: Annotated[Text, Field(description="Where the motion is to be small.")]
    boxes: Annotated[
        DistinctList[Text] | None, Field(description="Where a damper may be; all places if not.")
    ] = None
    largest_mass: Annotated[float, Unit("kg"), Field(gt=0, description="Of the free mass.")]
    largest_gap: Annotated[float, Unit("m"), Field(gt=0, description="Room for its travel.")]
    restitution: Annotated[
        float, Field(ge=0, le=LARGEST_RESTITUTION, description="Rebound over approach speed.")
    ]
    counts: Annotated[
        Literal["peak_displacement", "rms_displacement", "peak_acceleration"],
        Field(description="What is to be small."),
    ] = "peak_displacement"
    transient: Annotated[int, Field(ge=0, description="Cycles of a run before it counts.")] = 200
    periods: Annotated[int, Field(ge=1, description="Cycles that count.")] = 50
    folder: Annotated[str, Field(description="Where paths of the structure begin.")] = "."

    @classmethod
    def check_keys(cls, given: Any, mistakes: Mistakes) -> None:
        drives = ("force_amplitude", "base_amplitude")
        if sum(given.get(key) is not None for key in drives) != 1:
            mistakes.add(
                (), "the drive is missing, or there are two", f"one of {', '.join(drives)}"
            )

    def check_together(self, mistakes: Mistakes) -> None:
        if not self.band[0] > 0.0:
            mistakes.add(("band",), f"{self.band[0]:g} Hz", "frequencies above 0")
        try:
            made = self.made
        except (ValueError, TypeError, OSError) as error:
            mistakes.add(("structure",), str(error))
            return
        place = "force" if self.base_amplitude is None else "base"
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
    def drive(self) -> dict[str, Any]:
        """Force and amplitude, as parameters."""
        if self.base_amplitude is None:
            return {"force_amplitude": self.force_amplitude}
        return {"forcing": "base", "force_amplitude": self.base_amplitude}

    @property
    def hertz(self) -> list[float]:
        """Frequencies of the worst case."""
        return np.linspace(*self.band, self.frequencies).tolist()  # type: ignore[no-any-return]

    def alone(self, hertz: float) -> np.ndarray:
        """Complex amplitudes of the coordinates without a damper: real part of them by sin.

        (K - omega^2 M + i omega C) q = B f, as for any linear structure.
        """
        s, rate = self.made, 2.0 * math.pi * hertz
        if self.base_amplitude is None:
            assert s.force is not None
            push = float(self.force_amplitude or 0.0) * s.force
        else:
            assert s.base is not None
            push = self.base_amplitude * rate**2 * (s.mass @ s.base)
        return np.linalg.solve(s.stiffness - rate**2 * s.mass + 1j * rate * s.damping, push)  # type: ignore[no-any-return]

    def without(self, hertz: float) -> float:
        """What counts without a damper."""
        size = float(abs(self.made.points[self.point] @ self.alone(hertz)))
        by = {"rms_displacement": math.sqrt(0.5), "peak_acceleration": (math.tau * hertz) ** 2}
        return size * by.get(self.counts, 1.0)


class BoxedDamper(NamedTuple):
    """A free mass in kg in a box, and its gap in m."""

    box: str
    mass: float
    gap: float


class StructureCase(NamedTuple):
    """A frequency in Hz, and a start."""

    hertz: float
    part: float
    """Size of the motion of the structure, over that without a damper; and its phase in cycles."""
    turn: float
    place: float
    """Of the free mass between its walls, -1 to 1."""
    speed: float
    """Of the free mass relative to its box, over the largest speed of the box."""


@dataclass(frozen=True, kw_only=True, repr=False)
class StructureDesign:
    """The damper of a structure: where, how heavy, which gap, and what it does. Made by `design`.

    Numbers are in SI units; `worst` and `without` are of what counts at the point.
    """

    machine: StructureMachine
    box: str
    free_mass: float
    gap: float
    worst: float
    """The largest of its runs."""
    worst_frequency: float
    without: float
    """The largest in the band without a damper."""
    runs: int
    """Of all dampers."""
    fresh_share: float
    """Per cent of fresh random starts above the worst case."""
    fresh_ratio: float
    """The largest of these over the worst case."""
    boxes: pd.DataFrame = field(repr=False)
    """The best damper of each box; all but the first are from a coarser grid."""
    warnings: tuple[str, ...] = ()

    def __repr__(self) -> str:
        m = self.machine
        unit, words = COUNTS[m.counts]
        low, high = m.band
        rows = [
            ("box", self.box),
            ("free mass", text_of(self.free_mass, "kg")),
            ("gap, the whole travel", text_of(self.gap, "m")),
            ("coefficient of restitution", f"{m.restitution:g}"),
            (f"{words} at {m.point} without damper", text_of(self.without, unit)),
            ("worst case over frequencies and starts", text_of(self.worst, unit)),
            ("frequency of the worst case", text_of(self.worst_frequency, "Hz")),
            (f"fresh random runs above, of {_CHECK}", f"{self.fresh_share:.3g} %"),
            ("the largest fresh run, over the worst case", f"{self.fresh_ratio:.3g}"),
        ]
        head = f"{m.title}: a damper against the {words} at {m.point}, {low:g} to {high:g} Hz"
        lines = [f"! {text}" for text in self.warnings]
        lines += [f"  {text:<46}{value}" for text, value in rows]
        lines += ["The best damper of each box; all but the first from a coarser grid"]
        lines += [self.boxes.to_string(index=False)]
        lines += [
            f"- {m.transient} cycles pass before {m.periods} count; {self.runs} runs in all.",
            f"- The worst case is over {m.frequencies} frequencies, each with a start at rest, "
            f"one on the motion without damper and {_RANDOM} at random.",
        ]
        return "\n".join([head, *lines])

    def save(self, folder: Any) -> None:
        """Write the card and the table of boxes into a folder: design.txt and boxes.csv."""
        path = Path(folder)
        path.mkdir(parents=True, exist_ok=True)
        (path / "design.txt").write_text(f"{self!r}\n", "utf-8")
        self.boxes.to_csv(path / "boxes.csv", index=False)


class StructureSearch:
    """Dampers of a structure, with what is known of their worst cases."""

    def __init__(self, machine: StructureMachine) -> None:
        self.machine = machine
        self.runs = 0
        self.show: Progress | None = None
        random = np.random.default_rng(0)
        self.cases = [
            case
            for hertz in machine.hertz
            for case in (
                StructureCase(hertz, 0.0, 0.0, 0.0, 0.1),
                StructureCase(hertz, 1.0, 0.0, 0.0, 0.0),
                *(_at_random(random, hertz) for _ in range(_RANDOM)),
            )
        ]
        self.bounds: dict[BoxedDamper, float] = {}
        self.hardest: dict[BoxedDamper, StructureCase] = {}
        self._left: dict[BoxedDamper, list[StructureCase]] = {}
        self._hard: dict[StructureCase, float] = {}

    def best(self) -> BoxedDamper:
        """The best damper, once fresh starts no longer raise its worst case."""
        found = self.best_of(list(self.first_grid()))
        for ratio in _FINER:
            found = self.best_of([found, *self.about(found, ratio)])
        tried = []
        for seed in range(1, _ROUNDS + 1):
            tried.append(found)
            bound, cases = self.bounds[found], list(self.fresh(seed, _FRESH))
            values = {case: self.lasting(found, case) for case in cases}
            hard = sorted(cases, key=values.__getitem__)[-_KEPT:]
            if values[hard[-1]] <= bound:
                return found
            self._raise(found, hard[-1], values[hard[-1]])
            # A start that is hard for one damper is hard for others: it becomes a case of all.
            for damper, left in self._left.items():
                left += [case for case in hard if damper != found]
            self.cases += hard
            found = self.best_of([*self.bounds])
        # Another one might be the best only because its rare motions were missed.
        return self.best_of(tried)

    def first_grid(self) -> Iterator[BoxedDamper]:
        """Every box with parts of the largest mass and gap."""
        m = self.machine
        for box in m.boxes or m.made.boxes:
            if m.made.boxes[box].any():
                for mass in _MASSES:
                    for gap in _GAPS:
                        yield BoxedDamper(box, mass * m.largest_mass, gap * m.largest_gap)

    def about(self, one: BoxedDamper, ratio: float) -> list[BoxedDamper]:
        """Dampers near one in the same box, within the room there is."""
        m, made = self.machine, []
        for i in (0, -1, 1):
            for j in (0, -1, 1, -2, 2):
                mass = min(one.mass * ratio**i, m.largest_mass)
                made.append(BoxedDamper(one.box, mass, min(one.gap * ratio**j, m.largest_gap)))
        return list(dict.fromkeys(made))

    def best_of(self, dampers: Sequence[BoxedDamper]) -> BoxedDamper:
        """The damper of these whose worst case is least; of equals the first."""
        for damper in dampers:
            self._left.setdefault(damper, [*self.cases])
            self.bounds.setdefault(damper, 0.0)
        while True:
            first = min(dampers, key=self.bounds.__getitem__)
            if self.show:
                self.show(sum(self.bounds[one] > 0.0 for one in dampers), len(dampers))
            left = self._left[first]
            if not left:
                return first
            case = max(left, key=lambda one: self._hard.get(one, 0.0))
            left.remove(case)
            value = self._try(first, case)
            self._hard[case] = max(
                self._hard.get(case, 0.0), value / self.machine.without(case.hertz)
            )

    def fresh(self, seed: int, count: int) -> Iterator[StructureCase]:
        """Random starts at random frequencies of the band."""
        random = np.random.default_rng(seed)
        for _ in range(count):
            yield _at_random(random, float(random.uniform(*self.machine.band)))

    def _try(self, damper: BoxedDamper, case: StructureCase) -> float:
        value = self.value(damper, case)
        self._raise(damper, case, value)
        return value

    def _raise(self, damper: BoxedDamper, case: StructureCase, value: float) -> None:
        """Raise the worst case of a damper to a value that exceeds it."""
        if value > self.bounds[damper]:
            self.bounds[damper], self.hardest[damper] = value, case

    def lasting(self, damper: BoxedDamper, case: StructureCase) -> float:
        """What counts in one run; after a long transient where it exceeds the worst case."""
        value = self.value(damper, case)
        return value if value <= self.bounds[damper] else self.value(damper, case, _LONGER)

    def value(self, damper: BoxedDamper, case: StructureCase, longer: int = 1) -> float:
        """What counts in one run; infinite where it stopped early."""
        from damper.sweep.measured import measured  # the engine with it

        m, s = self.machine, self.machine.made
        mass = {"box": damper.box, "free_mass": damper.mass, "gap": damper.gap}
        p: Any = SIParameters(
            structure=s,
            masses=[mass | {"restitution": m.restitution}],
            forcing_frequency=2.0 * math.pi * case.hertz,
            **m.drive,
        )
        self.runs += 1
        found = measured(p, (longer * m.transient, m.periods), state=self.start(damper, case))
        value = float(found[m.counts][[*s.points].index(m.point)])
        return math.inf if math.isnan(value) else value

    def start(self, damper: BoxedDamper, case: StructureCase) -> State:
        """State of a case: a part of the motion without a damper, the free mass anywhere."""
        alone, rate = self.machine.alone(case.hertz), 2.0 * math.pi * case.hertz
        turned = case.part * np.exp(2j * math.pi * case.turn) * alone
        x, v = turned.imag, rate * turned.real  # of q sin(omega t) at 0
        box = self.machine.made.boxes[damper.box]
        fast = rate * float(abs(box @ alone))
        y = float(box @ x) + 0.5 * damper.gap * case.place
        return State(x.tolist(), v.tolist(), y, float(box @ v) + case.speed * fast)


def _at_random(random: np.random.Generator, hertz: float) -> StructureCase:
    part, turn = random.uniform(0.0, 1.5), random.uniform()
    return StructureCase(hertz, part, turn, random.uniform(-0.99, 0.99), random.uniform(-1.0, 1.0))


def structure_machine(machine: Any, given: Mapping[str, Any]) -> StructureMachine | None:
    """Return a machine that has a structure; None for any other.

    ConfigError or ValueError lists all that is wrong.
    """
    if isinstance(machine, StructureMachine):
        return machine
    if machine is None or isinstance(machine, Mapping):
        data = dict(machine or {}) | dict(given)
        return StructureMachine.checked("", data) if "structure" in data else None
    if not isinstance(machine, str | Path):
        return None
    file = read_yaml(Path(machine))
    if not isinstance(file.data, dict) or "structure" not in file.data:
        return None
    data = {"folder": str(Path(machine).parent)} | file.data | dict(given)
    return StructureMachine.checked_in(file, data)


def design_on(machine: StructureMachine) -> StructureDesign:
    """Size the damper of a structure for the worst case."""
    search = StructureSearch(machine)
    with progress_bar("dampers tried", "") as search.show:
        damper = search.best()
    worst = search.bounds[damper]
    fresh = [search.lasting(damper, case) for case in search.fresh(1000, _CHECK)]
    without = max(machine.without(hertz) for hertz in _fine(machine))
    share, ratio = 100.0 * float(np.mean([v > worst for v in fresh])), max(fresh) / worst
    room = {name: [getattr(machine, name)] for name in ("largest_mass", "largest_gap")}
    warnings = [*unusual(room)]
    if ratio > EXCEEDED:
        warnings.append(
            f"{share:.3g} % of fresh random runs exceed the worst case, by up to "
            f"{100.0 * ratio - 100.0:.2g} %."
        )
    if worst >= without:
        warnings.append("It does not help: the worst case is no better than without it.")
    return StructureDesign(
        machine=machine,
        box=damper.box,
        free_mass=damper.mass,
        gap=damper.gap,
        worst=worst,
        worst_frequency=search.hardest[damper].hertz,
        without=without,
        runs=search.runs,
        fresh_share=share,
        fresh_ratio=ratio,
        boxes=_of_each_box(search, damper),
        warnings=tuple(warnings),
    )


def _fine(m: StructureMachine) -> list[float]:
    """Frequencies at which the motion without a damper may be largest."""
    low, high = m.band
    own = [f for f in m.made.frequencies.tolist() if low <= f <= high]
    return [*np.linspace(low, high, 2001).tolist(), *own]


def _of_each_box(search: StructureSearch, best: BoxedDamper) -> pd.DataFrame:
    m = search.machine
    unit, words = COUNTS[m.counts]
    rows = []
    for box in dict.fromkeys(one.box for one in search.bounds):
        those = [one for one in search.bounds if one.box == box]
        one = best if box == best.box else search.best_of(those)
        value = search.bounds[one]
        rows.append(
            (value, box, text_of(one.mass, "kg"), text_of(one.gap, "m"), text_of(value, unit))
        )
    rows.sort()
    return pd.DataFrame([row[1:] for row in rows], columns=["box", "free mass", "gap", words])
