"""Unknown quantities, and what the records say that a damper with some values of them misses."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from damper.identification.motion import ComputedMotion, Direction, direction_of, run_motion
from damper.identification.recordings import KINDS, SAMPLED, TIMES, Recording
from damper.parameters import Parameters, SIParameters, State
from damper.parameters.dampers import SI_NAME
from damper.parameters.masses import (
    no_such_mass,
    own_names,
    own_values,
    refuse_untaken,
    with_own,
)
from damper.parameters.names import NAMES_BY_SYMBOL, common_name, split, unknown_name
from damper.parameters.quantities import ALL, INITIAL_NAMES, SI_ONLY, is_si
from damper.parameters.quantity import Quantity, finite
from damper.parameters.tables import TABLE_OF
from damper.parameters.units import SI_UNITS
from damper.sweep.points import read_damper

#: Unknown parts of a record itself.
OF_RECORD = {
    "scale": "factor of the record",
    "offset": "constant in the record",
    "trend": "drift of the record in a unit of time",
    "settling": "what the high-pass had before the record",
}
#: Beginnings of the names of quantities of the free mass. Where it is not there, it does not act
#: back, and its walls are as far as this over the motion.
_OF_BALL = (
    *("free_mass", "mass", "gap", "clearance", "restitution", "friction", "transverse", "gravity"),
    *("inclination", "support", "contact", "modulation", "yield", "initial_p", "initial_r"),
)
_FAR = 1e4
#: Values of starts of a quantity without value or range, and whether they are spread by factors; of
#: some over the critical damping, the primary's mass or its largest displacement.
_USUAL = {
    "restitution": (0.1, 0.95, False),
    "restitution_left": (0.1, 0.95, False),
    "damping_ratio": (1e-4, 0.1, True),
    "damping": (1e-4, 0.1, True),
    "mass_ratio": (5e-3, 0.5, True),
    "free_mass": (5e-3, 0.5, True),
    "clearance": (0.05, 4.0, True),
    "gap": (0.05, 4.0, True),
    "friction": (1e-3, 0.3, True),
    "friction_coefficient": (0.01, 0.5, True),
    "initial_position": (-0.95, 0.95, False),
}
#: How far starts go from a displacement and velocity that samples show, over the largest ones.
_FOUND = 0.25
#: How far starts go from a value that is given, as a factor.
_FACTOR = 3.0
#: Part of an allowed range that is kept away from its ends.
_INSIDE = 1e-6
#: A run goes on by this part beyond the last impact or peak that is compared.
_BEYOND = 0.35
#: Step of differences, as a part of the value.
_DIFFERENCE = 1e-6
#: Differences of samples that show a jump, of which order, and how large over their median.
_DIFFERENCED, _JUMP = 3, 8.0
#: Longest time, over the dead time, within which computed impacts may not have been recorded.
_UNHEARD = 2.0
#: Residual over the noise of what cannot be run.
_IMPOSSIBLE = 1e3


@dataclass(frozen=True)
class Unknown:
    """An unknown quantity of the damper, or of one record."""

    name: str
    record: int | None
    """Number of the record that it belongs to; None for the damper."""
    label: str
    unit: str
    allowed: tuple[float, float]
    starts: tuple[float, float]
    """From where to where starts are spread."""
    by_factors: bool = False
    value: float | None = None
    """The start that is given or found."""

    def at(self, part: float) -> float:
        """Start at a part, from 0 to 1, of the range of starts."""
        low, high = self.starts
        if self.by_factors:
            return float(low * (high / low) ** part)
        return float(low + part * (high - low))


class RecordedDamper:
    """Which damper, with which unknowns, made these records.

    Parameters
    ----------
    known : mapping of str to value
        Quantities of the damper and of its start, `forcing` and `masses`.
    records : sequence of Recording
    free : sequence of str
        Names of the unknowns.
    starts, ranges : mapping
        Value, and lowest and highest value, of some of them.

    Raises
    ------
    ValueError, TypeError
        With the name, the value and what is allowed.
    """

    def __init__(
        self,
        known: Mapping[str, Any],
        records: Sequence[Recording],
        free: Sequence[str],
        starts: Mapping[str, float],
        ranges: Mapping[str, Sequence[float]],
    ) -> None:
        self.records, self.known = records, dict(known)
        self.si = is_si(known)
        self.masses = with_own(self.known.get("masses"), {})
        #: Whether derivatives are the engine's own, or differences of runs, which take less time.
        self.fine = False
        #: Unknowns that the engine has no derivative by.
        self.differences: set[str] = set()
        named = {"free": free, "starts": starts, "ranges": ranges}
        names = {what: [self._name(what, name) for name in given] for what, given in named.items()}
        self.free = names["free"]
        if not self.free:
            raise ValueError("free: must name one unknown quantity or more")
        for what in ("starts", "ranges"):
            for name in names[what]:
                if name not in self.free:
                    raise ValueError(
                        f"{what}: {name} is not free: must be one of {', '.join(free)}"
                    )
        for wall, table in TABLE_OF.items():
            if wall in self.free and self.known.get(table) is not None:
                raise ValueError(
                    f"{wall} is free, and {table} is given: the two exclude each other; leave one "
                    "of them out"
                )
        refuse_untaken(self.free, own_names(self.free, self.masses))
        if len(set(self.free)) < len(self.free):
            raise ValueError(f"free = {list(free)}: names one quantity twice")
        if "scale" in self.free and not any(record.is_sampled for record in records):
            raise ValueError(f"scale is free: must be of a record of {', '.join(SAMPLED)}")
        given = zip(names["starts"], starts.values(), strict=True)
        self.given = {name: finite(f"starts: {name}", value) for name, value in given}
        self.ranges = dict(zip(names["ranges"], ranges.values(), strict=True))
        self._check_units()
        self._check_samples()
        self.unknowns = list(self._all())
        #: Samples of each record that impacts hide, of every run the same: else a run that hides
        #: more might leave out the largest noise.
        self.hidden = [self._struck(k) for k in range(len(records))]
        self.noise = [record.noise or self.size(k) for k, record in enumerate(records)]

    def check(self, point: np.ndarray) -> None:
        """Raise TypeError or ValueError where records are too short, or one cannot be run."""
        count = sum(len(record.times) for record in self.records)
        if count <= len(self.unknowns):
            labels = ", ".join(unknown.label for unknown in self.unknowns)
            raise ValueError(
                f"records: {count} data for {len(self.unknowns)} unknowns ({labels}): must be more "
                "data than unknowns"
            )
        for k, record in enumerate(self.records):
            self.start(self.values_of(point, k), record.begins or 0.0)

    def _name(self, what: str, name: str) -> str:
        """Return the name of a quantity in the damper's units."""
        kind = SIParameters if self.si else Parameters
        allowed = [q.name for q in kind.quantities if not q.whole] + [*INITIAL_NAMES[:4], "scale"]
        found = name if name in allowed else NAMES_BY_SYMBOL.get(name, name)
        if found not in allowed and self.si:
            found = SI_NAME.get(found, found)
        common, k = split(found) or (found, -1)
        if not self.si and common in SI_ONLY:
            raise ValueError(
                f"{what}: {name} is in SI units, and the damper is dimensionless: must be of a "
                "machine in SI units (primary_mass, stiffness, ...)"
            )
        if common not in allowed:
            raise unknown_name(f"name in {what}", name, allowed, SI_NAME if self.si else ())
        if k >= len(self.masses):
            raise ValueError(f"{what}: {name} {no_such_mass(k, len(self.masses))}")
        return found

    def _check_units(self) -> None:
        for record in self.records:
            if record.unit and not self.si:
                raise ValueError(
                    f"{record.label}: is in {record.unit}, and the damper is dimensionless: must "
                    "be a damper in SI units (primary_mass, stiffness, ...)"
                )

    def _check_samples(self) -> None:
        """Raise ValueError where samples show no motion, or one slower than the machine's."""
        period = math.tau / self.rate
        is_known = {"stiffness", "primary_mass"}.isdisjoint(self.free)
        for record in self.records:
            if record.is_sampled and not np.ptp(record.values):
                raise ValueError(
                    f"{record.label}: all values are {record.values[0]:g}: must show a motion"
                )
            if record.is_sampled and is_known and record.step > period:
                unit = " s" if self.si else ""
                raise ValueError(
                    f"{record.label}: a step of {record.step:.3g}{unit}, and a period of the "
                    f"machine of {period:.3g}{unit}: must be several samples in a period; the head "
                    "of the file may say another unit of time, such as ms"
                )

    def size(self, k: int) -> float:
        """Size of what a record shows: its noise before anything is known."""
        record = self.records[k]
        if record.kind in TIMES:
            steps = np.diff(record.times) if record.kind == "impacts" else record.times
            return 0.1 * float(np.mean(steps))
        return 0.1 * float(np.std(self._shown(k))) or 1.0

    # Unknowns.

    def _all(self) -> Any:
        for name in self.free:
            if name not in INITIAL_NAMES and name != "scale":
                yield self._unknown(name, None)
        for k, record in enumerate(self.records):
            own = [
                n for n in self.free if n in INITIAL_NAMES or (n == "scale" and record.is_sampled)
            ]
            if not record.ball:
                own = [n for n in own if n not in ("initial_position", "initial_relative_velocity")]
            own += [n for n in ("offset", "trend") if getattr(record, n)]
            own += ["settling"] if record.high_pass else []
            for name in own:
                if name not in record.known:
                    yield self._unknown(name, k)

    def _unknown(self, name: str, k: int | None) -> Unknown:
        """Return an unknown with its range and its starts."""
        label = name if k is None or len(self.records) == 1 else f"{name} ({self.records[k].label})"
        if name in OF_RECORD:
            unit = KINDS[self.records[k or 0].kind][0] if self.si and name != "scale" else "1"
            first, span = (1.0, (0.5, 2.0)) if name == "scale" else (0.0, (0.0, 0.0))
            return Unknown(name, k, label, unit, (-math.inf, math.inf), span, value=first)
        quantity = self._quantity(name)
        allowed = self._allowed(name, quantity)
        value = self.given.get(name)
        if value is None and k is not None:
            value = self.records[k].known.get(name)
        if value is None:
            value = self._known(name)
        if value is not None and not allowed[0] <= value <= allowed[1]:
            raise ValueError(
                f"{name} = {value:g}: starts outside of its range, {allowed[0]:g} to {allowed[1]:g}"
            )
        low, high, by_factors = self._span(name, k, value, allowed)
        low, high = max(low, allowed[0]), min(high, allowed[1])
        unit = quantity.units if self.si else "1"
        unit = SI_UNITS.get(unit, unit)
        return Unknown(name, k, label, unit, allowed, (low, high), by_factors, value)

    def _known(self, name: str) -> float | None:
        """Given value of a quantity; a mass without a value takes the common one."""
        given = self.known | own_values(self.masses)
        value = given.get(name, given.get(common_name(name)))
        return None if value is None else float(value)

    def _quantity(self, name: str) -> Quantity:
        kind, common = SIParameters if self.si else Parameters, common_name(name)
        return next((q for q in kind.quantities if q.name == common), None) or ALL[common]

    def _allowed(self, name: str, quantity: Quantity) -> tuple[float, float]:
        low, high = quantity.minimum, quantity.maximum
        if quantity.above or quantity.below or name == "initial_position":
            inside = _INSIDE * (high - low if high < math.inf else 1e-6)
            low, high = low + inside, high - inside
        if name in self.ranges:
            try:
                least, most = map(float, self.ranges[name])
            except (TypeError, ValueError):
                raise ValueError(f"ranges: {name} must have a lowest and a highest value") from None
            if not low <= least < most <= high:
                raise ValueError(
                    f"ranges: {name} = {least:g} to {most:g}: must go up within {low:g} to {high:g}"
                )
            return least, most
        return low, high

    def _span(
        self, name: str, k: int | None, value: float | None, allowed: tuple[float, float]
    ) -> tuple[float, float, bool]:
        """Where starts are spread, and whether by factors."""
        if name in self.ranges:
            low, high = allowed
            return low, high, low > 0.0 and high > 10.0 * low
        if value and name not in INITIAL_NAMES:
            if allowed[1] == 1.0:
                return max(value - 0.3, 0.05), min(value + 0.3, 0.97), False
            return *sorted((value / _FACTOR, value * _FACTOR)), value > 0.0  # type: ignore[return-value]
        common = common_name(name)
        size = self._unit_of(common)
        if common in _USUAL and size:
            low, high, by_factors = _USUAL[common]
            return low * size, high * size, by_factors
        if name in INITIAL_NAMES:
            size = self._speed_or_size(name, k or 0)
            value = value if value is not None else self._first(name, k or 0)
            return value - size, value + size, False
        raise ValueError(f"{name} is free: must have a value, a start or a range")

    def _unit_of(self, name: str) -> float:
        """By what the usual values of a quantity are multiplied; 0 where that is not known."""
        mass, stiffness = (float(self.known.get(n) or 0.0) for n in ("primary_mass", "stiffness"))
        sizes = {"damping": 2.0 * math.sqrt(mass * stiffness), "free_mass": mass}
        lengths = dict.fromkeys(("gap", "clearance", "friction"), self._amplitude)
        return (sizes | lengths).get(name, 1.0)

    @cached_property
    def rate(self) -> float:
        """Natural frequency of the primary, in rad per unit of time."""
        k, m = self.known.get("stiffness"), self.known.get("primary_mass")
        return math.sqrt(float(k) / float(m)) if self.si and k and m else 1.0

    @cached_property
    def _amplitude(self) -> float:
        """Size of the displacement; 0 where no record shows it."""
        for k, record in enumerate(self.records):
            order = {"displacement": 0, "peaks": 0, "velocity": 1, "acceleration": 2}.get(
                record.kind
            )
            if order is not None:
                values = self._shown(k)
                values = values - (0.0 if record.kind == "peaks" else values.mean())
                return float(abs(values).max()) / self.rate**order
        return abs(float(self.known.get("initial_displacement", 0.0)))

    def _first(self, name: str, k: int) -> float:
        """Displacement or velocity with which a record begins, or 0."""
        record = self.records[k]
        if record.kind == "peaks" and name == INITIAL_NAMES[0]:
            return float(record.values[0])
        if not record.is_sampled or name not in INITIAL_NAMES[:2]:
            return 0.0
        # A quarter of a vibration, in which impacts change the motion a little.
        phases = self.rate * (record.times - record.begins)
        few = max(int(np.searchsorted(phases, 0.5 * math.pi)), 4)
        turned = phases[:few, None] + 0.5 * math.pi * (SAMPLED.index(record.kind) - np.arange(2))
        samples = record.values[:few] - (self._shown(k).mean() if record.offset else 0.0)
        calm = ~self._struck(k)[:few]
        fitted = np.linalg.lstsq(np.cos(turned[calm]), samples[calm], rcond=None)[0]
        fitted /= self.rate ** SAMPLED.index(record.kind)
        return float(fitted[0] if name == INITIAL_NAMES[0] else fitted[1] * self.rate)

    def _speed_or_size(self, name: str, k: int) -> float:
        """How far starts of an initial quantity are spread."""
        found = self.records[k].is_sampled and name in INITIAL_NAMES[:2]
        size = (self._amplitude or 1.0) * (_FOUND if found else 1.0)
        return size * self.rate if name.endswith("velocity") else size

    # Runs.

    def values_of(self, point: np.ndarray, k: int) -> dict[str, Any]:
        """Values of damper and start, with those of a record, by name."""
        record = self.records[k]
        values = self.known | dict(record.known)
        for unknown, value in zip(self.unknowns, point.tolist(), strict=True):
            if unknown.name not in OF_RECORD and unknown.record in (None, k):
                if unknown.record is None and unknown.name in record.known:
                    continue
                values[unknown.name] = value
        return values if record.ball else self._alone(values)

    def _alone(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Return values of the machine without its free mass: none that would ever touch it."""
        made = {name: v for name, v in values.items() if not name.startswith(_OF_BALL)}
        mass, gap = ("free_mass", "gap") if self.si else ("mass_ratio", "clearance")
        return made | {mass: 0.0, gap: _FAR * (self._amplitude or 1.0), "restitution": 0.5}

    def run(
        self, point: np.ndarray, k: int, until: float, derivatives: bool
    ) -> tuple[ComputedMotion, list[int]]:
        """Motion of a record's run, and the numbers of the unknowns it has derivatives by."""
        record, values = self.records[k], self.values_of(point, k)
        parameters, state = self.start(values, record.begins or 0.0)
        directions: dict[str, Direction] = {}
        which = []
        for j, unknown in enumerate(self.unknowns if derivatives else ()):
            name = unknown.name
            if name in OF_RECORD or unknown.record not in (None, k):
                continue
            absent = not record.ball and name.startswith(_OF_BALL)
            if unknown.record is None and (name in record.known or absent):
                continue
            try:
                directions[name] = direction_of(parameters, state, name)
            except ValueError:
                self.differences.add(name)
            else:
                which.append(j)
        sampled = record.is_sampled or record.kind == "peaks"
        run = run_motion(parameters, state, until, directions, sampled, self.free)
        return run, which

    def start(self, values: Mapping[str, Any], begins: float) -> tuple[Any, State]:
        """Return damper and dimensionless start of values."""
        point, parameters = read_damper(values)
        state = point.start() or State(0.0, 0.0, 0.0, 0.0)
        if "several" in parameters.dimensionless.features and not isinstance(state.y, tuple):
            each = len(parameters.dimensionless.each)
            state = replace(state, y=(state.y,) * each, u=(state.u,) * each)
        if begins:
            state = replace(state, time=begins / parameters.units.time)
        return parameters, state

    # Comparison.

    def residuals(
        self, point: np.ndarray, part: float = 1.0, derivatives: bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Residual of the first part of each record: record less run, over the noise.

        Returns
        -------
        residuals : ndarray (n,)
        jacobian : ndarray (n, unknowns)
            Zero unless `derivatives` is set.
        """
        found = []
        for k, record in enumerate(self.records):
            count = self.count(k, part)
            try:
                values, changes = self.computed(point, k, count, derivatives and self.fine)
            except ValueError:
                # No run, such as from outside the box: worse than any.
                values = record.values[:count] + _IMPOSSIBLE * self.noise[k]
                changes = np.zeros((count, len(point)))
            if derivatives and (self.differences or not self.fine):
                self._by_differences(point, k, values, changes)
            missed = values - record.values[:count]
            missed[np.isnan(missed)] = 0.0
            found.append((missed / self.noise[k], changes / self.noise[k]))
        return np.concatenate([r for r, _ in found]), np.concatenate([j for _, j in found])

    def hide(self, point: np.ndarray) -> bool:
        """Leave out the samples that the impacts of this run hide, of any; whether others were."""
        before = self.hidden
        self.hidden = [self._struck(k) for k in range(len(self.records))]
        for k, (record, hidden) in enumerate(zip(self.records, self.hidden, strict=True)):
            if record.kind in SAMPLED[1:]:
                motion, _ = self.run(point, k, float(record.times[-1]), False)
                for time, _, _ in motion.impacts:
                    hidden |= abs(record.times - time) <= (record.blank or 2.0 * record.step)
        return any((b != after).any() for b, after in zip(before, self.hidden, strict=True))

    def _shown(self, k: int) -> np.ndarray:
        """Values of a record, without those beside its jumps."""
        return self.records[k].values[~self._struck(k)]  # type: ignore[no-any-return]

    def _struck(self, k: int) -> np.ndarray:
        """Samples beside a jump of the record, which neither noise nor a vibration makes."""
        record = self.records[k]
        struck = np.zeros(len(record.times), bool)
        if record.kind in SAMPLED[1:] and len(struck) > _DIFFERENCED:
            jumps = abs(np.diff(record.values, _DIFFERENCED))
            vibration = (self.rate * record.step) ** _DIFFERENCED * abs(record.values).max()
            for first in np.flatnonzero(jumps > _JUMP * np.median(jumps) + vibration):
                struck[first + 1 : first + _DIFFERENCED] = True
        return struck

    def count(self, k: int, part: float) -> int:
        """Data in the first part of a record."""
        return max(math.ceil(part * len(self.records[k].times)), 2)

    def _by_differences(
        self, point: np.ndarray, k: int, values: np.ndarray, changes: np.ndarray
    ) -> None:
        """Fill in derivatives by what the engine has none of, or by all."""
        for j, unknown in enumerate(self.unknowns):
            if unknown.name in OF_RECORD or unknown.record not in (None, k):
                continue
            if self.fine and unknown.name not in self.differences:
                continue
            step = _DIFFERENCE * (abs(point[j]) or 1.0)
            step *= -1.0 if point[j] + step > unknown.allowed[1] else 1.0
            there = point.copy()
            there[j] += step
            with suppress(ValueError):
                other = self.computed(there, k, len(values), False)[0]
                changes[:, j] = np.nan_to_num(other - values) / step

    def computed(
        self, point: np.ndarray, k: int, count: int, derivatives: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """What a record's first samples would be; NaN where an impact hides them; derivatives."""
        record = self.records[k]
        times, begins = record.times[:count], record.begins or 0.0
        hidden = self.hidden[k][:count]
        if record.is_sampled:
            motion, which = self.run(point, k, float(times[-1]), derivatives)
            values, changes = motion.at(times, SAMPLED.index(record.kind))
        else:
            span = float(times.sum() + times.max() if record.kind == "intervals" else times[-1])
            until = begins + (1.0 + _BEYOND) * (
                span - (0.0 if record.kind == "intervals" else begins)
            )
            motion, which = self.run(point, k, until, derivatives)
            values, changes = _listed(motion, record, count, until)
        jacobian = np.zeros((count, len(point)))
        jacobian[:, which] = changes
        values, jacobian = self._recorded(point, k, times, values, jacobian)
        values[hidden], jacobian[hidden] = math.nan, 0.0
        return values, jacobian

    def _recorded(
        self, point: np.ndarray, k: int, times: np.ndarray, values: np.ndarray, jacobian: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """What the record makes of the motion: filter, scale, offset and trend."""
        record = self.records[k]
        own = {
            u.name: j for j, u in enumerate(self.unknowns) if u.record == k and u.name in OF_RECORD
        }
        if record.high_pass:
            values, jacobian = _filtered(record, values), _filtered(record, jacobian)
            decay = np.exp(-math.tau * record.high_pass * (times - times[0]))
            values = values + point[own["settling"]] * decay
            jacobian[:, own["settling"]] = decay
        if "scale" in own:
            jacobian *= point[own["scale"]]
            jacobian[:, own["scale"]] = values
            values = values * point[own["scale"]]
        if "offset" in own:
            values = values + point[own["offset"]]
            jacobian[:, own["offset"]] = 1.0
        if "trend" in own:
            since = times - 0.5 * (record.times[0] + record.times[-1])
            values = values + point[own["trend"]] * since
            jacobian[:, own["trend"]] = since
        return values, jacobian


def _listed(
    motion: ComputedMotion, record: Recording, count: int, until: float
) -> tuple[np.ndarray, np.ndarray]:
    """The first impacts, times between them, or peaks; those that never come are at the end."""
    columns = motion.count
    if record.kind == "peaks":
        _, values, changes = motion.peaks()
        one_side = (record.values >= 0.0).all()
        kept = values > 0.0 if one_side else np.ones(len(values), bool)
        values, changes, late = values[kept], changes[kept], 0.0
    else:
        values = np.array([time for time, _, _ in motion.impacts])
        changes = np.array(motion.later).reshape(len(values), -1)
        if record.kind == "intervals":
            values, changes = np.diff(values), np.diff(changes, axis=0)
        elif record.blank:
            heard = _heard(record.times[:count], values, _UNHEARD * record.blank)
            values, changes = values[heard], changes[heard]
        late = until if record.kind == "impacts" else 0.0
    columns = changes.shape[1] if len(changes) else columns
    missing = max(count - len(values), 0)
    values = np.concatenate([values[:count], np.full(missing, late)])
    return values, np.concatenate([changes[:count], np.zeros((missing, columns))])


def _heard(times: np.ndarray, computed: np.ndarray, blank: float) -> list[int]:
    """Numbers of the computed impacts that a record has, as near to it as may be, in order.

    It may lack those that follow another one within `blank`, and has all others. By dynamic
    programming.
    """
    quick = np.diff(computed, prepend=-math.inf) < blank
    if not quick.any():
        return list(range(len(computed)))
    # Least sum of squares where the last impact of the record is a computed one.
    least: list[float] = []
    befores = []
    for time in times.tolist():
        squares, before = [], []
        most = math.inf if least else 0.0
        last = -1
        for k, other in enumerate(computed.tolist()):
            squares.append(most + (time - other) ** 2)
            before.append(last)
            ended = least[k] if least else math.inf
            if not quick[k] or ended < most:
                most, last = ended, k
        if min(squares) == math.inf:
            break
        least = squares
        befores.append(before)
    found = [int(np.argmin(least))]
    for before in reversed(befores[1:]):
        found.append(before[found[-1]])
    return found[::-1]


def _filtered(record: Recording, signals: np.ndarray) -> np.ndarray:
    """A high-pass of the first order of signals, columns in equal steps; from rest."""
    from scipy.signal import lfilter

    corner = math.tan(math.pi * (record.high_pass or 0.0) * record.step)
    gain, back = 1.0 / (1.0 + corner), (1.0 - corner) / (1.0 + corner)
    return lfilter([gain, -gain], [1.0, -back], signals, axis=0)  # type: ignore[no-any-return]
