"""`damper.continue_orbit`: periodic motions along a parameter, stable or not."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from damper.engine.compiled import compiling
from damper.models.sensitivity import neighbours
from damper.parameters import SIParameters
from damper.parameters.lazy import Axes, xr
from damper.parameters.named import named_quantity, rates_of, value_of, with_values
from damper.parameters.quantity import real, whole
from damper.parameters.structural import StructureParameters
from damper.parameters.units import LENGTH, SI_UNITS, SPEED, attributes_of, units_of
from damper.sweep.orbits import MARKERS
from damper.sweep.orbits.equation import OrbitEquation, OrbitPoint
from damper.sweep.orbits.periodic import PeriodicOrbit, check, require_force, require_in_step
from damper.sweep.orbits.walk import Walk
from damper.sweep.progress import progress_bar

#: Most special points that a branch shows.
_SHOWN = 6


def continue_orbit(
    orbit: PeriodicOrbit,
    parameter: str,
    start: float,
    stop: float,
    *,
    step: float = 0.02,
    max_orbits: int = 2000,
    until_change: bool = False,
) -> "Branch":
    """Follow a periodic motion along a parameter, both ways, also where it is unstable.

    Parameters
    ----------
    orbit : PeriodicOrbit
        Its own value of the parameter lies between `start` and `stop`.
    parameter : str
        Name of a parameter of the orbit, such as "restitution", or "gap" of `SIParameters`, or of a
        number of its force: "harmonic_2" is the amplitude of the second harmonic of
        `damper.Harmonics`, "harmonic_2_phase" its phase.
    start, stop : float
        Range of the parameter to stay in.
    step : float, default 0.02
        Largest step along the branch: 1 is the whole range, or a change of the state by its size.
    max_orbits : int, default 2000
        Orbits after which to stop, either way.
    until_change : bool, default False
        Whether to stop, either way, where the motion changes its kind: at the first special point
        that is no grazing.

    Returns
    -------
    Branch
        Its first end is the one that is met from `orbit` towards smaller values.

    Raises
    ------
    ValueError
        For a range without the orbit's own value or out of the parameter's own; when the motion
        does not satisfy Newton's method at its own value.
    TypeError
        For an unknown parameter.

    Examples
    --------
    >>> import damper
    >>> p = damper.Parameters(mass_ratio=0.1, damping_ratio=0.1, frequency_ratio=1.0,
    ...                       clearance=5.0, restitution=0.5)
    >>> branch = damper.continue_orbit(damper.periodic_orbit(p), "clearance", 4.5, 6.0)
    >>> [(point.kind, round(point.value, 9)) for point in branch.special_points]
    [('symmetry breaking', 4.616152418)]
    """
    if not isinstance(orbit, PeriodicOrbit):
        raise TypeError(f"orbit = {orbit!r}: must be a damper.PeriodicOrbit")
    most, step = whole("max_orbits", max_orbits, 1), require_step(step)
    first = _through(orbit, parameter, start, stop)
    with watched(f"following {parameter}", float(first.at[-1])) as watch:
        down = up = Walk(first.turned(-1.0), step, most, (), until_change, watch)
        if not down.closed:
            up = Walk(first.turned(1.0), step, most, down.special, until_change, watch)
    points = [*down.points[:0:-1], *up.points] if up is not down else down.points
    special = [*down.special[::-1], *up.special] if up is not down else down.special
    return Branch(
        parameter,
        tuple(point.orbit() for point in points),
        tuple(SpecialPoint(kind, point.value, point.orbit(), point) for kind, point in special),
        (down.end, up.end),
    )


@dataclass(frozen=True, eq=False)
class SpecialPoint:
    """Where motions are born, die, or change their kind."""

    kind: str
    """One of `damper.sweep.orbits.KINDS`."""
    value: float
    """Of the parameter, to 1e-10 of the range that is followed."""
    orbit: PeriodicOrbit = field(repr=False)
    found: OrbitPoint = field(repr=False)
    """The solution on the branch, from which `continue_point` goes on."""


@dataclass(frozen=True, repr=False, eq=False)
class Branch:
    """Periodic motions along a parameter, in the order of the branch; made by `continue_orbit`."""

    parameter: str
    orbits: tuple[PeriodicOrbit, ...]
    special_points: tuple[SpecialPoint, ...]
    ends: tuple[str, str]
    """Why the branch ends where its first and its last orbit are."""

    def __repr__(self) -> str:
        values, count = self.values, len(self.special_points)
        shown = [f"{point.kind} at {point.value:.6g}" for point in self.special_points[:_SHOWN]]
        shown += [f"{count - _SHOWN} more"] if count > _SHOWN else []
        points = f"; {', '.join(shown)}" if shown else ""
        return (
            f"<Branch of {len(values)} orbits, {self.parameter} {values.min():.6g} to "
            f"{values.max():.6g}{points}>"
        )

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the primary's largest displacement over the parameter.

        Motions that are not stable are dashed, and special points are marked.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw; in a new figure of pyplot when not given.

        Returns
        -------
        matplotlib.axes.Axes
        """
        if ax is None:
            from matplotlib import pyplot

            ax = pyplot.subplots(layout="constrained")[1]
            given = self.orbits[0].parameters.given.items()
            fixed = (f"{n} {v:g}" for n, v in given if n != self.parameter and isinstance(v, float))
            ax.set_title(", ".join(fixed), fontsize="small", wrap=True)
        values, peaks = self.values, np.array([orbit.peak for orbit in self.orbits])
        stable = np.array([orbit.stable for orbit in self.orbits])
        joined = np.convolve(~stable, [1, 1, 1], "same") > 0  # up to the stable neighbours
        for shown, style in ((stable, "k-"), (joined, "k--")):
            label = "stable" if style == "k-" else "not stable"
            if shown.any():
                ax.plot(values, np.where(shown, peaks, np.nan), style, label=label)
        for kind in dict.fromkeys(point.kind for point in self.special_points):
            found = [(p.value, p.orbit.peak) for p in self.special_points if p.kind == kind]
            mark: dict[str, Any] = {
                "ls": "",
                "marker": MARKERS[kind],
                "color": "k",
                "mfc": "white",
                "label": kind,
            }
            ax.plot(*np.transpose(found), **mark, zorder=3)
        about, (length, _) = self._attributes
        ax.set_xlabel(f"{about['long_name']} ({units_of(about)})".removesuffix(" (1)"))
        ax.set_ylabel(f"largest displacement of the primary ({units_of(length)})")
        ax.legend()
        return ax

    @property
    def idle(self) -> tuple[int, ...]:
        """Idle free masses, as `PeriodicOrbit.idle`: left out of the equation, their places given.

        The branch ends where one is touched.
        """
        return self.orbits[0].idle

    @property
    def values(self) -> np.ndarray:
        """Values of the parameter, one for each orbit."""
        return np.array([value_of(orbit.parameters, self.parameter) for orbit in self.orbits])

    def switch(self, point: SpecialPoint) -> PeriodicOrbit:
        """Find a motion on the branch that crosses this one at a special point.

        Parameters
        ----------
        point : SpecialPoint
            A period doubling, symmetry breaking or branch point.

        Returns
        -------
        PeriodicOrbit
            Of twice the period after a period doubling. `continue_orbit` follows it.

        Raises
        ------
        ValueError
            For a point of another kind, and when no such motion is found.
        TypeError
            For what is no special point.
        """
        require_point(point)
        if point.kind not in ("period doubling", "symmetry breaking", "branch point"):
            raise ValueError(f"no branch crosses at a point of the kind {point.kind!r}")
        doubled = point.kind == "period doubling"
        orbit = replace(point.orbit, period=2 * point.orbit.period) if doubled else point.orbit
        there = _through(orbit, self.parameter, self.values.min(), self.values.max())
        found = there.crossing()
        if found is None:
            raise ValueError(f"no branch found that crosses at the {point.kind} {point.value!r}")
        return found.orbit()

    def to_dataset(self) -> "xr.Dataset":
        """Return the branch as a Dataset: its orbits, and its special points.

        The states where they start have y and u of each free mass along ``body``, where there are
        several, and x and v of a structure along ``coordinate``.
        """
        orbits, points = self.orbits, self.special_points
        about, (length, speed) = self._attributes
        most = max(4, *(len(orbit.multipliers) for orbit in orbits))
        multipliers = np.full((len(orbits), most), np.nan, complex)
        for row, orbit in zip(multipliers, orbits, strict=True):
            row[: len(orbit.multipliers)] = orbit.multipliers
        variables: dict[str, Any] = {
            self.parameter: ("orbit", self.values, about),
            "multiplier_real": (("orbit", "multiplier"), multipliers.real),
            "multiplier_imaginary": (("orbit", "multiplier"), multipliers.imag),
            "stable": ("orbit", np.array([orbit.stable for orbit in orbits], "i1")),
            "impacts": ("orbit", np.array([orbit.impacts for orbit in orbits])),
            "slowest_impact": (
                "orbit",
                np.array([orbit.slowest_impact for orbit in orbits]),
                speed,
            ),
            "word": ("orbit", np.array([orbit.word for orbit in orbits], dtype=object)),
            "kind": ("point", np.array([point.kind for point in points], dtype=object)),
            "value": ("point", np.array([point.value for point in points], float), about),
        }
        for name, units in (("x", length), ("v", speed), ("y", length), ("u", speed)):
            states = np.array([getattr(orbit.state, name) for orbit in orbits])
            along = ("coordinate",) if name in "xv" else ("body",)
            own = along if states.ndim == 2 else ()
            variables[name] = (("orbit", *own), states, units)
            at = np.array([getattr(point.orbit.state, name) for point in points], float)
            at = at.reshape(len(points), *states.shape[1:])
            variables[f"point_{name}"] = (("point", *own), at, units)
        attributes = {
            "parameter": self.parameter,
            "period": orbits[0].period,
            "first_end": self.ends[0],
            "last_end": self.ends[1],
        }
        return xr.Dataset(variables, attrs=attributes)

    @property
    def _attributes(self) -> tuple[dict[str, str], tuple[dict[str, str], dict[str, str]]]:
        """Name and units of the parameter; units of lengths and of speeds."""
        p = self.orbits[0].parameters
        quantity, of = named_quantity(p, self.parameter), p.forcing.amplitude
        units = p.forcing.si_unit if quantity.units == "N" else quantity.units
        named = SI_UNITS if isinstance(p, SIParameters | StructureParameters) else {}
        length, speed = (attributes_of(named.get(unit, unit), of) for unit in (LENGTH, SPEED))
        return {"long_name": quantity.long_name, **attributes_of(units, of)}, (length, speed)


@contextmanager
def watched(what: str, start: float) -> Iterator[Callable[[float], None]]:
    """Show how much of a range from 0 to 1 is followed, by the places of the points."""
    low = high = start
    with progress_bar(what, "% of the range") as show, compiling(at_once=False):

        def watch(at: float) -> None:
            nonlocal low, high
            low, high = max(min(low, at), 0.0), min(max(high, at), 1.0)
            if show:
                show(int(100.0 * (high - low)), 100)

        yield watch


def _through(orbit: PeriodicOrbit, name: str, start: float, stop: float) -> OrbitPoint:
    """Return the orbit as a point of its branch."""
    p, state = orbit.parameters, orbit.scaled.start
    check(p, orbit.period)
    low, high = require_range(orbit, name, start, stop)
    own = value_of(p, name)
    line = (name,), np.array([low]), np.array([high - low])
    equation = OrbitEquation(p, *line, orbit.period, state.copy(), np.zeros(1), orbit.idle)
    equation.state[equation.given[1::2]] = 0.0
    at = equation.at(state[None, :], (own - low) / (high - low))
    found = equation.over(at)
    if found is None:
        raise ValueError(f"the orbit cannot be run: {orbit.state} of {p}")
    return OrbitPoint(equation, at, found, np.eye(len(at))[-1]).recentred()


def require_point(point: SpecialPoint) -> None:
    """Raise TypeError unless it is a special point."""
    if not isinstance(point, SpecialPoint):
        raise TypeError(f"point = {point!r}: must be one of a branch's special_points")


def require_step(step: float) -> float:
    """Check the largest step along a branch or a curve, a part of the range."""
    step = real("step", step)
    if not 0.0 < step <= 1.0:
        raise ValueError(f"step = {step!r}: must be a number with 0 < step <= 1")
    return step


def require_range(
    orbit: PeriodicOrbit, name: str, start: float, stop: float
) -> tuple[float, float]:
    """Least and greatest value of a range of an orbit's parameter, its own value between them.

    Raises
    ------
    TypeError
        For an unknown parameter.
    ValueError
        For a range without its own value, or out of the range of what the parameter may be; where
        the parameter parts masses that move in step.
    """
    p = orbit.parameters
    quantity = named_quantity(p, name)
    low, high = sorted((quantity.check(start), quantity.check(stop)))
    own = value_of(p, name)
    if not low <= own <= high or low == high:
        raise ValueError(
            f"{name} from {start!r} to {stop!r}: must be a range with the orbit's own {own!r}"
        )
    for end in (low, high):
        require_force(with_values(p, {name: end}), f"{name} from {start!r} to {stop!r}")
    rates = {key: rate for key, rate in rates_of(p, name).items() if key not in SI_UNITS}
    require_in_step(orbit, neighbours(p.dimensionless, rates), name)
    return low, high
