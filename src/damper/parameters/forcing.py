"""The forces that a damper may be under, as users give them: `damper.Parameters(forcing=...)`.

Each is a shape, which `force_amplitude` multiplies. NumPy is loaded where arrays are given.
"""

import math
import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache
from typing import Any, ClassVar, Literal, get_args
from weakref import WeakValueDictionary

from damper.parameters.files import path_of, state_of
from damper.parameters.names import unknown_name
from damper.parameters.quantity import Quantity, finite, in_range, real, whole
from damper.parameters.record_file import Reading, read_samples, two_columns
from damper.parameters.units import AMPLITUDES, FORCE, FREE

#: Highest order of a harmonic: the engine has a place for each one below it.
MOST_ORDER = 1000
#: Meaning of samples; values after the last sample; frame of a moving base.
Of = Literal["force", "base_acceleration"]
After = Literal["zero", "hold"]
Frame = Literal["ground", "base"]


@dataclass(frozen=True)
class Forcing:
    """Base of the forces; `Parameters.force_amplitude` multiplies each of them."""

    kind: ClassVar[str]
    repeats: ClassVar[bool] = True
    """Whether it is the same again after a cycle of the clock."""
    has_phase: ClassVar[bool] = True
    """Whether it has a frequency, and `Parameters.phase` turns it."""

    @property
    def is_odd(self) -> bool:
        """Whether it is its own opposite half a cycle later."""
        return self.repeats

    @property
    def moves_frame(self) -> bool:
        """Whether displacements are relative to a base that moves."""
        return False

    @property
    def terms(self) -> int:
        """Harmonics to be summed at each moment."""
        return 1

    @property
    def samples(self) -> int:
        """Samples, each of which ends a segment."""
        return 0

    @property
    def end(self) -> float:
        """Time of its last sample, if it has any."""
        return 0.0

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Quantities of the force that may vary; `damper.parameters.named` finds them."""
        return ()

    @property
    def numbers(self) -> dict[str, float]:
        """Their values."""
        return {}

    def having(self, numbers: Mapping[str, float]) -> "Forcing":
        """Return the force with other values of some quantities."""
        return self

    @property
    def amplitude(self) -> str:
        """Name of the force's amplitude, one of `AMPLITUDES`, which the units of results follow."""
        return FORCE

    @property
    def si_unit(self) -> str:
        """Unit of `SIParameters.force_amplitude` under it."""
        return AMPLITUDES[self.amplitude][1]

    @property
    def highest_order(self) -> int:
        """Highest order of its harmonics; 1 for a force without harmonics."""
        return 1

    def force(self, amplitude: float, primary_mass: float, stiffness: float) -> float:
        """F0 in N, of which F0/K is the unit of length of a damper in SI units."""
        return amplitude

    def over(self, time: float) -> "Forcing":
        """Return the force with times in a unit that is `time` times as long."""
        return self

    @property
    def settings(self) -> dict[str, Any]:
        """Its kind and what it is made of, in plain values; `forcing_of` is the inverse."""
        return {"kind": self.kind} | {f.name: getattr(self, f.name) for f in fields(self)}


@dataclass(frozen=True)
class Harmonic(Forcing):
    """The force sin(omega t + phase) on the primary; the default.

    Examples
    --------
    >>> import damper
    >>> p = damper.Parameters(0.1, 0.05, 0.8, 1.0, 0.6)
    >>> p.forcing
    Harmonic()
    """

    kind = "harmonic"


@dataclass(frozen=True)
class NoForce(Forcing):
    """No force: free motion, as with ``force_amplitude=0``.

    Examples
    --------
    >>> import damper
    >>> p = damper.Parameters(0.1, 0.05, 0.8, 1.0, 0.6, forcing="none")
    >>> len(damper.events(p, damper.State(2.0, 0.0, 2.0, 0.0), until=10.0))
    4
    """

    kind = "none"
    has_phase = False

    @property
    def amplitude(self) -> str:
        return FREE


@dataclass(frozen=True)
class Harmonics(Forcing):
    """Sum of amplitudes[i] sin(orders[i] (omega t + phase) + phases[i]), a force on the primary.

    Parameters
    ----------
    orders : sequence of int
        Multiples of the frequency, 1 to 1000, each once.
    amplitudes : sequence of float
        Of each, in units of `force_amplitude`; not all of them zero.
    phases : sequence of float, optional
        Of each, in rad; zero when left out.

    Raises
    ------
    ValueError, TypeError
        With the name and what is allowed.

    Examples
    --------
    >>> Harmonics((1, 2), (1.0, 0.3)).is_odd  # an even one breaks the mirror
    False
    >>> Harmonics((0,), (1.0,))
    Traceback (most recent call last):
    ...
    ValueError: Harmonics.orders[0] = 0: must be a whole number >= 1 and <= 1000
    """

    kind = "harmonics"

    orders: Sequence[int]
    amplitudes: Sequence[float]
    phases: Sequence[float] = ()

    def __post_init__(self) -> None:
        orders = tuple(
            whole(f"Harmonics.orders[{k}]", value, 1, most=MOST_ORDER)
            for k, value in enumerate(_sequence("Harmonics.orders", self.orders))
        )
        given = {
            name: tuple(
                finite(f"Harmonics.{name}[{k}]", value)
                for k, value in enumerate(_sequence(f"Harmonics.{name}", getattr(self, name)))
            )
            for name in ("amplitudes", "phases")
        }
        given["phases"] = given["phases"] or (0.0,) * len(orders)
        for name, values in given.items():
            if len(values) != len(orders):
                raise ValueError(
                    f"Harmonics.{name} has {len(values)} values: must be as many as "
                    f"Harmonics.orders, which has {len(orders)}"
                )
        for order, times in Counter(orders).most_common(1):
            if times > 1:
                raise ValueError(f"Harmonics.orders: {order} is given {times} times: give it once")
        if not any(given["amplitudes"]):
            raise ValueError("Harmonics.amplitudes are all zero: give damper.NoForce()")
        self.__dict__.update(orders=orders, **given)

    @property
    def is_odd(self) -> bool:
        """Whether no harmonic of even order acts."""
        return all(k % 2 for k, a in zip(self.orders, self.amplitudes, strict=True) if a)

    @property
    def terms(self) -> int:
        """Harmonics to be summed at each moment."""
        return len(self.orders)

    @property
    def highest_order(self) -> int:
        return max(self.orders)

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Amplitude and phase of each harmonic."""
        found = []
        for k in self.orders:
            of = f"the harmonic of order {k}"
            found.append(Quantity(f"harmonic_{k}", f"$a_{{{k}}}$", f"amplitude of {of}"))
            symbol = rf"$\varphi_{{{k}}}$"
            found.append(Quantity(f"harmonic_{k}_phase", symbol, f"phase of {of}", "rad"))
        return tuple(found)

    @property
    def numbers(self) -> dict[str, float]:
        """Their values."""
        values = (v for pair in zip(self.amplitudes, self.phases, strict=True) for v in pair)
        return {q.name: value for q, value in zip(self.quantities, values, strict=True)}

    def having(self, numbers: Mapping[str, float]) -> "Harmonics":
        """Return the force with other values of some quantities."""
        values = tuple((self.numbers | dict(numbers)).values())
        return replace(self, amplitudes=values[::2], phases=values[1::2])


@dataclass(frozen=True)
class Base(Forcing):
    """Motion z = sin(omega t + phase) of the base that the primary stands on.

    `force_amplitude` is its amplitude B: of 1 in `Parameters`, whose lengths are in units of B
    then, and in m in `SIParameters`.

    Parameters
    ----------
    frame : {"ground", "base"}
        Whether x and y are those of the ground, or relative to the base. The motion is the same,
        but for a free mass on a support: that stands on the ground, or on the base.

    Examples
    --------
    >>> Base(frame="wall")
    Traceback (most recent call last):
    ...
    ValueError: unknown Base.frame 'wall': must be one of ground, base
    """

    kind = "base"

    frame: Frame = "ground"

    def __post_init__(self) -> None:
        _one_of("Base.frame", self.frame, get_args(Frame))

    @property
    def moves_frame(self) -> bool:
        return self.frame == "base"

    @property
    def amplitude(self) -> str:
        return "B"

    def force(self, amplitude: float, primary_mass: float, stiffness: float) -> float:
        """That by which the base moves the primary through a spring at rest."""
        return stiffness * amplitude


@dataclass(frozen=True)
class Unbalance(Forcing):
    """A rotating unbalance: the force omega^2 sin(omega t + phase) on the primary.

    `force_amplitude` is mass times eccentricity: of 1 in `Parameters`, whose lengths are in units
    of that over M, and in kg m in `SIParameters`.
    """

    kind = "unbalance"

    @property
    def amplitude(self) -> str:
        return "U"

    def force(self, amplitude: float, primary_mass: float, stiffness: float) -> float:
        """That by which the spring holds the primary where the unbalance turns fast."""
        return stiffness * amplitude / primary_mass


class _Sampled(Forcing):
    """A force on the primary, or an acceleration of its base, given by samples."""

    repeats = False
    has_phase = False

    of: Of
    after: After

    @property
    def moves_frame(self) -> bool:
        return self.of == "base_acceleration"

    @property
    def amplitude(self) -> str:
        return FORCE if self.of == "force" else "A"

    def force(self, amplitude: float, primary_mass: float, stiffness: float) -> float:
        """That of inertia, where the base is accelerated."""
        return amplitude if self.of == "force" else primary_mass * amplitude

    def _check_words(self) -> None:
        _one_of(f"{type(self).__name__}.of", self.of, get_args(Of))
        _one_of(f"{type(self).__name__}.after", self.after, get_args(After))


@dataclass(frozen=True, eq=False, repr=False)
class Record(_Sampled):
    """A force, or the base's acceleration, that is linear between its samples.

    There is none before the first sample. Under an acceleration of the base x and y are relative
    to it. It has no frequency: a cycle, in which a study counts, is 2 pi sqrt(M/K), or a second
    with `SIParameters`, unless a frequency is given as a clock.

    Parameters
    ----------
    time : array_like
        Times of the samples, rising, in units of sqrt(M/K); in s with `SIParameters`.
    value : array_like
        Value at each, in units of `force_amplitude`: with `SIParameters` those of a record in N, or
        in m/s2 for the base, and ``force_amplitude=1``, or 9.81 for one in units of g.
    of : {"force", "base_acceleration"}
        What it is: a force on the primary, or the acceleration of the base.
    after : {"zero", "hold"}
        What follows the last sample: nothing, or its value for ever.

    Raises
    ------
    ValueError, TypeError
        With the name, and the sample that is wrong.

    Examples
    --------
    >>> import damper
    >>> pulse = damper.Record([0.0, 0.5, 1.0], [0.0, 4.0, 0.0])
    >>> p = damper.Parameters(0.1, 0.05, 0.8, 1.0, 0.6, forcing=pulse)
    >>> print(damper.events(p, until=5.0)["side"])
    [-1  1]
    >>> damper.Record([0.0, 1.0, 1.0], [0.0, 1.0, 0.0])
    Traceback (most recent call last):
    ...
    ValueError: Record.time[2] = 1.0 is given twice: times must rise
    """

    kind = "record"

    time: Any
    value: Any
    of: Of = "force"
    after: After = "zero"

    layout: ClassVar[str] = ""
    """Separator and decimal sign of its file in words, where they are not commas and points."""

    def __post_init__(self) -> None:
        self._check_words()
        arrays = {name: _array(name, getattr(self, name)) for name in ("time", "value")}
        if wrong := _wrong_sample(**arrays):
            name, number, words = wrong
            place = "" if number is None else f"[{number}] = {arrays[name][number].item()!r}"
            raise ValueError(f"Record.{name}{place}{words}")
        self.__dict__.update(arrays)

    def __repr__(self) -> str:
        first, last = self.time[0], self.time[-1]
        return (
            f"Record(<{self.time.size} samples from {first:g} to {last:g}>, of={self.of!r}, "
            f"after={self.after!r})"
        )

    @cached_property
    def _key(self) -> tuple[Any, ...]:
        # One zero: the other one is equal to it.
        return (self.of, self.after, (self.time + 0.0).tobytes(), (self.value + 0.0).tobytes())

    def __eq__(self, other: object) -> bool:
        return self._key == other._key if isinstance(other, Record) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._key)

    @property
    def samples(self) -> int:
        """Samples, each of which ends a segment."""
        return int(self.time.size)

    @property
    def end(self) -> float:
        """Time of its last sample, if it has any."""
        return float(self.time[-1])

    @property
    def settings(self) -> dict[str, Any]:
        """Its kind and settings, with the number of samples in place of the samples."""
        return {"kind": self.kind, "samples": self.samples, "of": self.of, "after": self.after}

    def __reduce__(self) -> tuple[Any, ...]:
        return Record, (self.time, self.value, self.of, self.after)

    @cached_property
    def _scaled(self) -> "WeakValueDictionary[float, Record]":
        return WeakValueDictionary()

    def over(self, time: float) -> "Record":
        """Return the force with times in a unit that is `time` times as long.

        Dampers of one unit of time share one such record.
        """
        made = self._scaled.get(time)
        if made is None:
            made = self._scaled[time] = Record(self.time / time, self.value, self.of, self.after)
        return made

    @classmethod
    def read(
        cls,
        path: str | os.PathLike[str],
        columns: Sequence[str | int] | None = None,
        *,
        of: Of = "force",
        after: After = "zero",
        delimiter: str | None = None,
        step: float | None = None,
        factor: float | None = None,
    ) -> "Record":
        """Read a record from a file of CSV (one sample a line), PEER (AT2), MATLAB, WAV or UFF.

        A process reads a file once; `layout` describes what was found in it: columns and
        separators, and units that are converted.

        Parameters
        ----------
        path : path
            Lines that are empty, or begin with #, are skipped. The first one, or a comment before
            the samples, may name the columns and their units: s for times, N for a force, m/s2
            for an acceleration; multiples such as ms, kN and g are converted, another unit is
            refused. Text is in UTF-8, or in UTF-16 with its mark.
        columns : (str or int, str or int), optional
            Those of time and value, where there are more than these two: their names, or numbers
            that count from 0. With `step`, and of a WAV or universal file, one alone.
        of, after : str
            As for `Record`.
        delimiter : str, optional
            What stands between columns; else it is found: tabs, semicolons, blanks or commas. Where
            it is no comma, numbers may have decimal commas.
        step : float, optional
            Time between samples, of a file with values alone; the first one is at 0.
        factor : float, optional
            By what values are multiplied, in place of the unit that the file gives; of a WAV file
            its value at full scale, else 1.

        Raises
        ------
        ValueError
            With the line, and what is wrong in it.
        TypeError
            When `path` is none.

        Examples
        --------
        >>> import tempfile
        >>> with tempfile.NamedTemporaryFile("w", suffix=".csv") as file:
        ...     _ = file.write("time (s),acceleration (m/s2)\\n0,0\\n0.01,0.3\\n0.02,-0.1\\n")
        ...     file.flush()
        ...     Record.read(file.name, of="base_acceleration")
        Record(<3 samples from 0 to 0.02>, of='base_acceleration', after='zero')
        """
        _one_of("Record.of", of, get_args(Of))
        _one_of("Record.after", after, get_args(After))
        file = path_of(path)
        if columns is not None:
            columns = two_columns(columns)
        for name, number in (("step", step), ("factor", factor)):
            least = 0.0 if name == "step" else -math.inf
            if number is not None and not (real(name, number) and least < number < math.inf):
                allowed = "> 0" if name == "step" else "other than 0"
                raise ValueError(f"{name} = {number!r}: must be a number {allowed}")
        if delimiter is not None and not (isinstance(delimiter, str) and len(delimiter) == 1):
            raise ValueError(f"delimiter = {delimiter!r}: must be one character")
        how = Reading(columns, delimiter, step, factor)
        return _read_record(file, state_of(file), how, of, after)


@dataclass(frozen=True)
class Noise(_Sampled):
    """Noise in a band of frequencies: a record that a seed makes, the same on all platforms.

    It is a sum of sines of one amplitude and of random phases, at all multiples of
    2 pi / duration in the band, sampled, and linear in between. Its spectrum is flat in the band
    and zero outside, but for the lines between samples: at the shortest period that is allowed they
    take 3 % of the amplitude. Its mean is 0 and its rms 1 over the duration: `force_amplitude` is
    the rms of the force (in N with `SIParameters`, in m/s2 for the base), and
    force_amplitude^2 / (lines 2 pi / duration) its one-sided spectral density, for angular
    frequencies: that of the band as far as its lines reach.

    Parameters
    ----------
    seed : int
        Which one, >= 0.
    step : float
        Time from one sample to the next, in units of sqrt(M/K) (s with `SIParameters`); at most a
        tenth of the shortest period.
    duration : float
        Time that it lasts, a whole number of steps from time 0; the shift by one is then a period.
    band : (float, float)
        Lowest and highest angular frequency, in units of sqrt(K/M) (rad/s with `SIParameters`).
    of : {"force", "base_acceleration"}
        What it is: a force on the primary, or the acceleration of the base.
    after : {"zero", "hold"}
        What follows its end: nothing, or its last value for ever.

    Raises
    ------
    ValueError, TypeError
        With the name and what is allowed.

    Examples
    --------
    >>> import damper
    >>> noise = damper.Noise(seed=1, step=0.1, duration=200.0, band=(0.5, 2.0))
    >>> noise.lines, noise.record
    (48, Record(<2001 samples from 0 to 200>, of='force', after='zero'))
    >>> print(noise.record.value[:3].round(3))
    [-0.077 -0.198 -0.296]
    """

    kind = "noise"

    seed: int
    step: float
    duration: float
    band: tuple[float, float]
    of: Of = "force"
    after: After = "zero"

    #: Most samples: more take minutes.
    MOST: ClassVar[int] = 2**18
    #: Fewest lines in the band, and samples in the shortest period.
    FEWEST: ClassVar[int] = 10
    #: Roundoff in the number of a line or of a sample.
    _ROUNDING: ClassVar[float] = 1e-9

    def __post_init__(self) -> None:
        low, high = self._checked_band()
        self.__dict__.update(
            seed=whole("Noise.seed", self.seed, 0),
            step=in_range("Noise.step", self.step, minimum=0.0, above=True),
            duration=in_range("Noise.duration", self.duration, minimum=0.0, above=True),
            band=(low, high),
        )
        self._check_words()
        coarsest = 2.0 * math.pi / (self.FEWEST * high)
        if not self.step <= coarsest * (1.0 + self._ROUNDING):
            raise ValueError(
                f"Noise.step = {self.step!r}: too coarse for Noise.band up to {high!r}: must be at "
                f"most 2 pi / ({self.FEWEST} {high!r}) = {coarsest:.6g}"
            )
        count = self.duration / self.step
        if not count <= self.MOST + 0.5:
            raise ValueError(
                f"Noise.duration = {self.duration!r} with Noise.step = {self.step!r}: "
                f"{count:.6g} samples; must be at most {self.MOST}"
            )
        if abs(count - round(count)) > self._ROUNDING * count:
            raise ValueError(
                f"Noise.duration = {self.duration!r}: must be a whole number of steps of "
                f"{self.step!r}"
            )
        if not self.lines >= self.FEWEST:
            raise ValueError(
                f"Noise.duration = {self.duration!r}: too short for Noise.band = {self.band!r}, in "
                f"which lie {self.lines} multiples of 2 pi / duration; must be {self.FEWEST} or "
                "more"
            )

    def _checked_band(self) -> tuple[float, float]:
        values = [
            in_range(f"Noise.band[{k}]", value, minimum=0.0)
            for k, value in enumerate(_sequence("Noise.band", self.band))
        ]
        if len(values) != 2 or not values[0] < values[1]:
            raise ValueError(f"Noise.band = {self.band!r}: must be (low, high) with low < high")
        return values[0], values[1]

    @property
    def _ends(self) -> tuple[int, int]:
        """Numbers of its first and last line."""
        turns = self.duration / (2.0 * math.pi)
        low, high = (edge * turns for edge in self.band)
        first = math.ceil(low - self._ROUNDING * max(low, 1.0))
        return max(first, 1), math.floor(high + self._ROUNDING * high)

    @property
    def lines(self) -> int:
        """Number of sines that it is made of."""
        first, last = self._ends
        return last - first + 1

    @cached_property
    def record(self) -> Record:
        """Its samples."""
        import numpy as np

        from damper.parameters.noise import noise

        count = round(self.duration / self.step)
        time = np.arange(count + 1) * self.step
        return Record(time, noise(self.seed, count, *self._ends), self.of, self.after)

    def over(self, time: float) -> "Noise":
        """Return the force with times in a unit that is `time` times as long."""
        low, high = self.band
        band = (low * time, high * time)
        return Noise(self.seed, self.step / time, self.duration / time, band, self.of, self.after)

    @property
    def samples(self) -> int:
        """Samples, each of which ends a segment."""
        return round(self.duration / self.step) + 1

    @property
    def end(self) -> float:
        """Time of its last sample, if it has any."""
        return self.duration


#: Kind -> class.
FORCINGS: dict[str, type[Forcing]] = {
    each.kind: each for each in (NoForce, Harmonic, Harmonics, Base, Unbalance, Record, Noise)
}
HARMONIC = Harmonic()
#: Seed of a noise in the settings of a study whose draws have a seed each.
EACH_DRAW = "draw"
#: Kinds that have no settings, or defaults for all: their name is enough.
BY_NAME = ("none", "harmonic", "base", "unbalance")


def read_forcing(given: Any) -> Forcing:
    """Return a force, or that of a kind without settings by its name.

    Raises
    ------
    ValueError, TypeError
        For anything else, with what is allowed.
    """
    if isinstance(given, Forcing):
        return given
    if not isinstance(given, str):
        names = ", ".join(cls.__name__ for cls in FORCINGS.values())
        raise TypeError(f"forcing = {given!r}: must be a name, or a force of damper: {names}")
    _one_of("forcing", given, FORCINGS)
    if given not in BY_NAME:
        raise ValueError(f"forcing = {given!r}: give damper.{FORCINGS[given].__name__}(...)")
    return FORCINGS[given]()


def class_of(kind: Any) -> type[Forcing]:
    """Return the class of a kind of force. A user's own class is known once its file is loaded."""
    loaded = [each for each in Forcing.__subclasses__() if hasattr(each, "kind")]
    known = {each.kind: each for each in loaded} | FORCINGS
    _one_of("kind of forcing", kind, known)
    return known[kind]


def forcing_of(settings: Mapping[str, Any], file: str | os.PathLike[str] | None = None) -> Forcing:
    """Return the force of `Forcing.settings`; of a record, its samples or the `file` beside it.

    ValueError for a record without samples; TypeError or ValueError, with the nearest name, for
    settings that there are not.

    Examples
    --------
    >>> forcing_of(Base("base").settings)
    Base(frame='base')
    """
    given = dict(settings)
    kind = class_of(name := given.pop("kind", None))
    if kind is Record and file is not None:
        return Record.read(file, **given)
    if kind is Record and "time" not in given:
        if "samples" in given:
            raise ValueError(f"forcing: its {given['samples']} samples are not kept with the cube")
        raise ValueError("forcing: a record needs its file, or time and value")
    known = [field.name for field in fields(kind)]
    for setting in given:
        if setting not in known:
            raise unknown_name(f"setting of {name}", setting, known)
    return kind(**given)


#: Setting of a force -> its unit, of a dimensionless damper and in SI units.
SETTING_UNITS = {
    "step": ("√(M/K)", "s"),
    "duration": ("√(M/K)", "s"),
    "band": ("√(K/M)", "rad/s"),
}


def force_text(settings: Mapping[str, Any], si: bool = False) -> str:
    """Return `Forcing.settings` in words, for headings; what is as always is not said.

    With `si` its times are in s, and its frequencies in rad/s.

    Examples
    --------
    >>> force_text({"kind": "noise", "step": 0.1, "duration": 50.0, "band": [0.5, 2.0]})
    'noise, step 0.1 √(M/K), duration 50 √(M/K), band 0.5 to 2 √(K/M)'
    >>> force_text(Harmonics((1, 3), (1.0, 0.2)).settings)
    'harmonics, orders 1 and 3, amplitudes 1 and 0.2, phases 0 and 0'
    """
    words = [str(settings["kind"])]
    always = {field.name: field.default for field in fields(class_of(settings["kind"]))}
    for name, value in settings.items():
        if name not in ("kind", "digest") and value != always.get(name):
            values = value if isinstance(value, list | tuple) else [value]
            shown = (f"{v:g}" if isinstance(v, float | int) else str(v) for v in values)
            text = (" to " if name == "band" else " and ").join(shown)
            if name == "of":
                words[0] += f" of {text.replace('_', ' ')}"
            elif value == EACH_DRAW:
                words.append(f"a {name} each draw")
            else:
                unit = SETTING_UNITS.get(name, ("", ""))[si]
                said = f"{text} samples" if name == "samples" else f"{name} {text} {unit}"
                words.append(said.rstrip())
    return ", ".join(words)


def left_out(forcing: Forcing, si: bool) -> dict[str, float]:
    """Return what need not be given under a force, with its values.

    A force without a frequency leaves the clock free: a cycle is a second, or 2 pi sqrt(M/K).

    Examples
    --------
    >>> left_out(Harmonic(), True), left_out(NoForce(), False)
    ({}, {'frequency_ratio': 1.0})
    """
    if forcing.has_phase:
        return {}
    if not si:
        return {"frequency_ratio": 1.0}
    none = {"force_amplitude": 0.0} if isinstance(forcing, NoForce) else {}
    return {"forcing_frequency": math.tau, **none}


def check_force(
    forcing: Forcing, phase: float, force_amplitude: float, only: Sequence[float]
) -> None:
    """Raise ValueError where what is given beside a force contradicts it.

    `only` are the amplitudes that may stand beside no force.
    """
    if phase and not forcing.has_phase:
        raise ValueError(
            f"phase = {phase!r} with forcing = {forcing!r}: forcing '{forcing.kind}' has no phase; "
            "leave phase out"
        )
    if isinstance(forcing, NoForce) and force_amplitude not in only:
        raise ValueError(
            f"force_amplitude = {force_amplitude!r} with forcing = {forcing!r}: there is no force; "
            "leave out one of the two, or give force_amplitude = 0"
        )


def _one_of(name: str, value: Any, names: Iterable[str]) -> None:
    if not isinstance(value, str) or value not in names:
        raise ValueError(str(unknown_name(name, value, names)))


def _sequence(name: str, values: Any) -> list[Any]:
    if isinstance(values, str | bytes | Mapping) or not isinstance(values, Iterable):
        raise TypeError(f"{name} = {values!r}: must be a sequence of numbers")
    return list(values)


def _array(name: str, values: Any) -> Any:
    """Return a column of a record as an array of its own, which nobody can write to."""
    import numpy as np

    for word in ("units", "unit"):
        if hasattr(values, word):
            raise ValueError(
                f"Record.{name} has units {getattr(values, word)!s}: give plain numbers, of which "
                "damper.Record says the unit"
            )
    if isinstance(values, np.ma.MaskedArray):
        values = np.ma.filled(values.astype(float), np.nan)
    try:
        array = np.asarray(values)
    except ValueError:
        array = np.asarray(None)
    if array.dtype.kind not in "iuf":
        raise TypeError(f"Record.{name}: must be a sequence of numbers")
    if array.ndim != 1:
        raise ValueError(f"Record.{name} has the shape {array.shape}: must be one column")
    if array.dtype != float or array.flags.writeable or array.base is not None:
        array = np.array(array, dtype=float)  # a copy
    array.setflags(write=False)
    return array


def _wrong_sample(time: Any, value: Any) -> tuple[str, int | None, str] | None:
    """Column, number, if it is one, and words for what is wrong with samples."""
    import numpy as np

    if time.size != value.size:
        return "value", None, f" has {value.size} samples, time has {time.size}: must be as many"
    if time.size < 2:
        return "time", None, f" has {time.size} samples: must be two or more"
    for name, column in (("time", time), ("value", value)):
        for number in np.flatnonzero(~np.isfinite(column))[:1].tolist():
            return name, number, ": must be a finite number: a record has no gaps"
    for number in (np.flatnonzero(np.diff(time) <= 0.0)[:1] + 1).tolist():
        if time[number] == time[number - 1]:
            return "time", number, " is given twice: times must rise"
        return "time", number, f" follows {time[number - 1].item()!r}: times must rise"
    with np.errstate(over="ignore"):
        slopes = np.diff(value) / np.diff(time)
    for number in np.flatnonzero(~np.isfinite(slopes))[:1].tolist():
        return "value", number + 1, ": the slope to it is infinite"
    if not value.any():
        return "value", None, " is zero everywhere: give damper.NoForce()"
    return None


@lru_cache(maxsize=4)
def _read_record(
    path: str,
    state: tuple[int, ...],
    how: Reading,
    of: Of,
    after: After,
) -> Record:
    """Read a record from a file in a certain state, which is checked."""
    read = read_samples(path, ("s", "N" if of == "force" else "m/s2"), how)
    samples = {"time": read.times, "value": read.values}
    if wrong := _wrong_sample(**samples):
        name, number, words = wrong
        where = "" if number is None or read.line_of is None else f", line {read.line_of(number)}"
        found = "" if number is None else f" = {samples[name][number].item()!r}"
        raise ValueError(f"{path}{where}: {name}{found}{words}")
    record = Record(read.times, read.values, of, after)
    record.__dict__["layout"] = read.found
    return record
