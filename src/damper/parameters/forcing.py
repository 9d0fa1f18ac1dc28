"""The forces that a damper may be under, as users give them: `damper.Parameters(forcing=...)`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from damper.parameters.quantity import Quantity


@dataclass(frozen=True)
class Forcing:
    """Base of the forces; `Parameters.force_amplitude` multiplies each of them."""

    kind: ClassVar[str]
    repeats: ClassVar[bool] = True
    """Whether it is the same again after a cycle of the clock."""

    @property
    def is_odd(self) -> bool:
        """Whether it is its own opposite half a cycle later."""
        return self.repeats

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """What its own numbers are that may vary; `damper.parameters.named` finds them."""
        return ()

    @property
    def numbers(self) -> dict[str, float]:
        """Their values."""
        return {}

    def having(self, numbers: Mapping[str, float]) -> "Forcing":
        """The same force with other values of some of them."""
        return self


@dataclass(frozen=True)
class Harmonic(Forcing):
    """The force sin(omega t + phase)."""

    kind = "harmonic"


@dataclass(frozen=True)
class NoForce(Forcing):
    """No force: free motion."""

    kind = "none"


@dataclass(frozen=True)
class Harmonics(Forcing):
    """Sum of amplitudes[i] sin(orders[i] (omega t + phase) + phases[i])."""

    kind = "harmonics"

    orders: Sequence[int]
    amplitudes: Sequence[float]
    phases: Sequence[float] = ()

    @property
    def is_odd(self) -> bool:
        """Whether no harmonic of even order acts."""
        return all(k % 2 for k, a in zip(self.orders, self.amplitudes, strict=True) if a)

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
        phases = self.phases or (0.0,) * len(self.orders)
        values = (v for pair in zip(self.amplitudes, phases, strict=True) for v in pair)
        return {q.name: value for q, value in zip(self.quantities, values, strict=True)}

    def having(self, numbers: Mapping[str, float]) -> "Harmonics":
        """The same force with other values of some of them."""
        values = tuple((self.numbers | dict(numbers)).values())
        return replace(self, amplitudes=values[::2], phases=values[1::2])


@dataclass(frozen=True)
class Base(Forcing):
    """Motion z = sin(omega t + phase) of the base, in the frame of the ground or of the base."""

    kind = "base"

    frame: str = "ground"


@dataclass(frozen=True)
class Unbalance(Forcing):
    """A rotating unbalance: omega^2 sin(omega t + phase)."""

    kind = "unbalance"


@dataclass(frozen=True, eq=False)
class Record(Forcing):
    """A force, or the base's acceleration, that is linear between its samples."""

    kind = "record"
    repeats = False

    time: Any
    value: Any
    of: str = "force"
    after: str = "zero"

    def __post_init__(self) -> None:
        import numpy as np

        for name in ("time", "value"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=float))


#: Kind -> class.
FORCINGS: dict[str, type[Forcing]] = {
    each.kind: each for each in (NoForce, Harmonic, Harmonics, Base, Unbalance, Record)
}
HARMONIC = Harmonic()
