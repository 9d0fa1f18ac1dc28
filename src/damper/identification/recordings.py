"""What was recorded of a damper: motion over time, impacts, or peaks; from arrays and files."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from damper.parameters.dampers import SI_NAME
from damper.parameters.files import path_of
from damper.parameters.names import NAMES_BY_SYMBOL, unknown_name
from damper.parameters.quantities import ALL, si_units
from damper.parameters.quantity import finite, real
from damper.parameters.record_file import Reading, read_samples, two_columns
from damper.parameters.unit_text import each_number, number_in

#: Kind of record -> SI unit of its values, and what it is in words.
KINDS = {
    "displacement": ("m", "displacement of the primary over time"),
    "velocity": ("m/s", "velocity of the primary over time"),
    "acceleration": ("m/s2", "acceleration of the primary over time"),
    "peaks": ("m", "extremes of the displacement, in their order, and their times"),
    "impacts": ("s", "times of the impacts from the start on"),
    "intervals": ("s", "times between the impacts"),
}
#: Kinds that have a value at each of many times.
SAMPLED = ("displacement", "velocity", "acceleration")
#: Kinds that have times alone.
TIMES = ("impacts", "intervals")
#: Loudness of an impact over that of the record's quiet half, and least part of the loudest one.
_LOUD, _LEAST = 8.0, 0.05
#: Time in s after a sound in which another one is not heard.
DEAD_TIME = 0.02
#: How far the times of a record with a filter may be from equal steps, over the step.
_EQUAL = 1e-3


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """A record of a damper for `damper.identify`.

    Parameters
    ----------
    times : sequence of float
        Times of the samples in s (in units of sqrt(M/K) of a dimensionless damper), increasing. For
        ``kind="intervals"`` the times between the impacts.
    values : sequence of float, optional
        Samples, or peaks.
    kind : str, default "displacement"
        "displacement", "velocity" or "acceleration" of the primary; "peaks", its extremes in order
        (only the upper ones where no value is negative); "impacts", from the start of the run on;
        "intervals" between impacts.
    label : str, optional
        What answers call it.
    noise : float, optional
        Standard deviation of its noise. Where it is left out, each kind of record has the one that
        is found.
    known : mapping of str to float, optional
        Quantities of this record alone, such as its `initial_displacement`.
    ball : bool, default True
        Whether the free mass was there.
    offset, trend : bool, optional
        Whether a constant, and a drift in proportion to time, are unknown parts of the record. An
        offset is so by itself for samples without a high-pass.
    high_pass : float, optional
        Corner frequency, in Hz, of a high-pass of the first order that the record went through.
    blank : float, optional
        Time after an impact in which samples of velocity and acceleration do not count; two steps.
        Of times of impacts: one that comes sooner than this after the last one may be missing.
    begins : float, optional
        Time at which the motion begins; the first sample or peak, or 0 for times of impacts.
    unit : str, optional
        Unit that the record's file gives.

    Raises
    ------
    ValueError, TypeError
        With the name, the value and what is allowed.
    """

    times: Any
    values: Any = None
    kind: str = "displacement"
    label: str = "record"
    noise: float | None = None
    known: Mapping[str, float] = field(default_factory=dict)
    ball: bool = True
    offset: bool | None = None
    trend: bool = False
    high_pass: float | None = None
    blank: float | None = None
    begins: float | None = None
    unit: str = ""

    def __post_init__(self) -> None:
        _check_kind(self.kind)
        given = self.__dict__
        given["times"] = self._column("times", self.times)
        if self.kind in TIMES:
            if self.values is not None:
                raise ValueError(f"{self.label}: {self.kind} have times alone: leave out values")
            given["values"] = self.times
        elif self.values is None:
            raise ValueError(f"{self.label}: values are missing: {self.kind} has times and values")
        given["values"] = self._column("values", self.values)
        count, values = len(self.times), len(given["values"])
        if count != values:
            raise ValueError(f"{self.label}: {count} times and {values} values: must be as many")
        back = np.flatnonzero(np.diff(self.times) <= 0.0)
        if self.kind == "intervals":
            if (self.times <= 0.0).any():
                raise ValueError(f"{self.label}: a time between impacts must be > 0")
        elif back.size:
            k = int(back[0])
            raise ValueError(
                f"{self.label}: time {self.times[k + 1]:g} follows {self.times[k]:g} (sample "
                f"{k + 1} from 0): times must increase"
            )
        given["known"] = plain_numbers(self.known, f"{self.label}: known")
        units = {"noise": KINDS[self.kind][0], "high_pass": "Hz", "blank": "s", "begins": "s"}
        for name, unit in units.items():
            value = given[name] = number_in(f"{self.label}: {name}", given[name], [unit])
            if value is not None and not (
                math.isfinite(real(name, value)) and (value > 0.0 or name == "begins")
            ):
                raise ValueError(f"{self.label}: {name} = {value!r}: must be a number > 0")
        for name, value in self.known.items():
            if name not in ALL:
                raise unknown_name("known quantity", name, ALL)
            finite(f"{self.label}: {name}", value)
        if self.offset is None:
            given["offset"] = self.is_sampled and self.high_pass is None
        if (self.trend or self.offset or self.high_pass) and not self.is_sampled:
            raise ValueError(
                f"{self.label}: offset, trend and high_pass are of {', '.join(SAMPLED)}, not of "
                f"{self.kind}"
            )
        steps = np.diff(self.times)
        if self.high_pass and np.ptp(steps) > _EQUAL * steps.mean():
            raise ValueError(f"{self.label}: high_pass: times must have equal steps")
        if self.begins is None:
            given["begins"] = 0.0 if self.kind in TIMES else float(self.times[0])
        if self.kind != "intervals" and self.times[0] < self.begins:
            raise ValueError(
                f"{self.label}: begins = {self.begins:g}: must be <= {self.times[0]:g}, its first "
                "time"
            )

    def __repr__(self) -> str:
        first, last = (f"{float(self.times[k]):.6g}" for k in (0, -1))
        return (
            f"<Recording {self.label}: {self.kind}, {len(self.times)} times from {first} to {last}>"
        )

    @property
    def is_sampled(self) -> bool:
        """Whether it has samples over time."""
        return self.kind in SAMPLED

    @property
    def step(self) -> float:
        """Mean step of its times."""
        return float((self.times[-1] - self.times[0]) / (len(self.times) - 1))

    @cached_property
    def own_noise(self) -> tuple[float, float] | None:
        """Its noise and the degrees of freedom it is known with, as far as no fit is needed.

        The stated noise; of samples in equal steps that by the median of their third differences,
        in which smooth motion is small; else None. Against the residual of the same n samples it
        scatters as a standard deviation of 0.39 n degrees of freedom would.
        """
        if self.noise:
            return self.noise, math.inf
        steps = np.diff(self.times)
        if not self.is_sampled or len(steps) <= 20 or np.ptp(steps) > _EQUAL * steps.mean():
            return None
        differences = abs(np.diff(self.values, 3))
        noise = float(np.median(differences)) / (0.6745 * math.sqrt(20.0))
        return noise, 0.39 * len(differences)

    def _column(self, name: str, given: Any) -> np.ndarray:
        try:
            column = np.array(given, dtype=float)
        except (TypeError, ValueError):
            raise TypeError(f"{self.label}: {name} must be numbers, not {given!r:.60}") from None
        if column.ndim != 1 or len(column) < 2:
            raise ValueError(f"{self.label}: {name} must be a list of two numbers or more")
        if not np.isfinite(column).all():
            k = int(np.flatnonzero(~np.isfinite(column))[0])
            raise ValueError(f"{self.label}: {name}[{k}] = {column[k]}: must be finite")
        return column


def _check_kind(kind: Any) -> None:
    if not isinstance(kind, str) or kind not in KINDS:
        raise ValueError(str(unknown_name("kind", kind, KINDS)))


def plain_numbers(values: Mapping[str, Any], what: str = "known") -> dict[str, Any]:
    """Return values by names or symbols of quantities; texts with a unit as numbers in SI units.

    ValueError where a unit does not go with its quantity; TypeError, with `what`, for no mapping.

    Examples
    --------
    >>> plain_numbers({"gap": ["5 mm", "1 cm"], "r": "60 %", "forcing": "none"})
    {'gap': [0.005, 0.01], 'r': 0.6, 'forcing': 'none'}
    """

    if not isinstance(values, Mapping):
        raise TypeError(f"{what} = {values!r}: must be a mapping of names to values")

    def read(name: str, value: Any) -> Any:
        usual = NAMES_BY_SYMBOL.get(name, name)
        quantity = ALL.get(SI_NAME.get(usual, usual))
        units = si_units(quantity) if quantity else []
        return each_number(value, lambda text: number_in(name, text, units))

    return {name: read(name, value) for name, value in values.items()}


def read_recording(
    path: str | os.PathLike[str],
    kind: str = "displacement",
    *,
    columns: Sequence[str | int] | None = None,
    delimiter: str | None = None,
    step: float | None = None,
    factor: float | None = None,
    **about: Any,
) -> Recording:
    """Read a record from a CSV, PEER (`.AT2`), `.mat`, `.wav` or universal (`.uff`) file.

    Parameters
    ----------
    path : path
        CSV: columns of time and value, or of times alone; their heads may have units, of which
        multiples such as ms, mm or g are converted. MATLAB file (up to version 7): two variables.
        WAV: samples; where `kind` is "impacts", the onsets of sounds in it, `blank` apart or more.
        Universal file, with pyuff: a time response, by its number in `columns`.
    kind, **about
        As `Recording`.
    columns : two of str or int, optional
        Columns or variables of time and value, where there are more than these; of a WAV file its
        channel.
    delimiter : str, optional
        What stands between columns.
    step : float, optional
        Time between samples, in s, of a file with values alone.
    factor : float, optional
        By what values are multiplied, in place of the unit that the file gives; of a WAV file
        its value at full scale.

    Raises
    ------
    ValueError, OSError
        With the file, the line, and what is allowed.
    """
    path_of(path)
    about = {"label": Path(path).name} | about
    own = [one.name for one in fields(Recording) if one.name not in ("times", "values")]
    for name in about:
        if name not in own:
            raise unknown_name("setting of a record", name, [*own, *Reading._fields])
    _check_kind(kind)
    columns = None if columns is None else two_columns(columns)
    unit = KINDS[kind][0]
    is_sound = kind == "impacts" and Path(path).suffix.lower() == ".wav"
    if kind in TIMES and not is_sound:
        if step is not None or factor is not None:
            raise ValueError(f"{path}: step and factor are of values: {kind} have times alone")
        if Path(path).suffix.lower() != ".mat":
            columns = (columns or (0,))[:1]
        found = read_samples(path, ("s", unit), Reading(columns, delimiter, 1.0))
        return Recording(found.values, None, kind, unit=found.unit, **about)
    found = read_samples(path, ("s", unit), Reading(columns, delimiter, step, factor))
    if is_sound:
        blank = about.pop("blank", None) or DEAD_TIME
        rate = 1.0 / found.times[1]
        return Recording(onsets(found.values, rate, blank), kind=kind, blank=blank, **about)
    return Recording(found.times, found.values, kind, unit=found.unit, **about)


def onsets(samples: np.ndarray, rate: float, dead_time: float = DEAD_TIME) -> np.ndarray:
    """Times at which a sound sets in.

    Its loudness is the rms of the samples' differences over 1 ms. A sound begins where the loudness
    exceeds eight times the median, and 5 % of the largest one, and not within `dead_time` after the
    loudness last did.

    Parameters
    ----------
    samples : ndarray
    rate : float
        Samples in a second.
    dead_time : float, default 0.02
        In s.
    """
    width = max(int(1e-3 * rate), 1)
    power = np.diff(samples, prepend=samples[:1]) ** 2
    sums = np.cumsum(np.concatenate([np.zeros(width), power]))
    loud = np.sqrt((sums[width:] - sums[:-width]) / width)
    over = np.flatnonzero(loud > max(_LOUD * float(np.median(loud)), _LEAST * float(loud.max())))
    first = over[np.diff(over, prepend=-math.inf) > dead_time * rate]
    return first / rate  # type: ignore[no-any-return]
