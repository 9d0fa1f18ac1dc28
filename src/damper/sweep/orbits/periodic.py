"""`damper.periodic_orbit`: a periodic motion, stable or not, and its multipliers."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from textwrap import shorten
from typing import Any

import numpy as np

from damper.engine.compiled import compiling
from damper.engine.loop import FINISHED
from damper.engine.terminal import saying
from damper.models import check_state, start_run
from damper.models.sensitivity import Stencil, model_along, neighbours
from damper.models.tangent import OF_PARTED, parted_in
from damper.parameters import Parameters, SIParameters, State
from damper.parameters.forcing import FORCINGS
from damper.parameters.named import named_quantity, rates_of, value_of
from damper.parameters.names import common_name
from damper.parameters.quantity import whole
from damper.parameters.units import LENGTH, SPEED, Units
from damper.sweep.estimate import MOST_PERIODS
from damper.sweep.events import events
from damper.sweep.orbits.arcs import (
    RESTS,
    Arc,
    boxes_of,
    first_mass,
    leaders,
    run_arc,
    state_of,
    vector,
)
from damper.sweep.orbits.word import WallImpacts, bursts_of, word_of
from damper.sweep.points import one_run, require_parameters

#: Largest change of the state over the period, over the size of the state.
TOLERANCE = 1e-11
#: Steps of Newton's method, and halvings of one of them.
_STEPS, _HALVINGS = 60, 12
#: Longest period, that of the slowest time-varying free mass: each step is a run of that length.
_LONGEST = 1000
#: Condition of the linear equations from which on a derivative by a parameter is roundoff.
_SINGULAR = 1e12
#: Letters of a word that are shown at most.
_SHOWN = 60
#: Speed at a peak, over its displacement, that is rounding.
_AT_REST = 1e-8


def followed(kind: type[Parameters | SIParameters]) -> tuple[str, ...]:
    """Quantities along which a motion can be followed."""
    return tuple(q.name for q in kind.quantities if not q.whole)


#: Those of a study, of all masses.
FOLLOWED = followed(Parameters)


def is_followed(name: str) -> bool:
    """Whether motions of a study can be followed along a quantity, of all masses or of one."""
    return common_name(name) in FOLLOWED


@compiling(at_once=False)
def periodic_orbit(
    parameters: Parameters | SIParameters | None = None,
    period: int = 1,
    guess: State | None = None,
    *,
    settle: int = 200,
    **values: Any,
) -> "PeriodicOrbit":
    """Find a motion that repeats after some forcing periods, stable or not, by Newton's method.

    The derivative of the state after the period is that of `damper.models.tangent`, through
    impacts, completed chatter and sticking. No impact of the orbit is skipped: it is a run of the
    engine.

    Parameters
    ----------
    parameters : Parameters or SIParameters, optional
        With SIParameters, the orbit and what is found from it are in m, s and m/s.
    period : int, default 1
        Forcing periods after which it repeats, at most 1000. A shorter motion repeats then, too.
    guess : State, optional
        Where to look. Its time may be any: the search begins at the next start of a period. When
        not given, a run from rest, after it has settled. `state=` names it, too, as elsewhere.
    settle : int, default 200
        Forcing periods of that run.
    **values
        As `damper.events` takes them.

    Returns
    -------
    PeriodicOrbit

    Raises
    ------
    ValueError
        When none is found, with where the search stopped; when the period is no multiple of that
        of a time-varying free mass; under a force that does not repeat, and in free motion.

    Examples
    --------
    >>> import damper
    >>> p = damper.Parameters(mass_ratio=0.1, damping_ratio=0.02, frequency_ratio=1.3,
    ...                       clearance=0.05, restitution=0.3)
    >>> orbit = damper.periodic_orbit(p)
    >>> orbit.word, orbit.stable, orbit.events.size
    ('RS LS', True, 20)
    """
    period = whole("period", period, 1, most=_LONGEST)
    settle = whole("settle", settle, 0, most=MOST_PERIODS)
    if guess is None:
        guess = values.pop("state", None)
    parameters, guess = one_run(parameters, guess, values, structures=True)
    check(parameters, period)
    units, scaled = parameters.units, parameters.dimensionless
    with saying(f"a motion of period {period}: a run of {settle} cycles settles"):
        start = _settled(scaled, guess, settle, units)
    with saying(f"a motion of period {period}: Newton's method"):
        best = nearest_orbit(scaled, period, start)
    if best.change > TOLERANCE * max(1.0, float(np.abs(best.start).max())):
        raise ValueError(
            f"no motion of period {period} found: the search stopped at {best.state.times(units)}, "
            f"which the period changes by {best.change:.3g}; try another state or period"
        )
    return best.of(parameters)


@dataclass(frozen=True, repr=False, eq=False)
class PeriodicOrbit:
    """A motion that repeats after a number of forcing periods, also on a structure.

    Made by `periodic_orbit`.

    Attributes
    ----------
    parameters : Parameters or SIParameters
    period : int
        Forcing periods after which it repeats.
    state : State
        At time 0, the start of a forcing period: a run of `parameters` from here is on the orbit.
    derivative : ndarray (4, 4)
        Derivative of (x, v, y, u) after the period by its start; (x, v, y0, u0, y1, u1, ...) with
        several free masses; (x0, v0, x1, v1, ..., y0, u0, ...) on a structure. Masses in step move
        together, by the first of them.
    change : float
        Largest change of the state over the period, in dimensionless units: the residual.
    """

    parameters: Parameters | SIParameters
    period: int
    state: State
    derivative: np.ndarray
    change: float

    def __repr__(self) -> str:
        word = f'"{shorten(self.word, _SHOWN, placeholder=" ...")}"' if self.word else "no impacts"
        word += f" with idle masses {list(self.idle)}" if self.idle else ""
        largest = f"largest multiplier {np.abs(self.multipliers[0]):.4g}"
        return f"<PeriodicOrbit {word} of period {self.period}, {largest}: {self.parameters}>"

    @property
    def start(self) -> np.ndarray:
        """The state as an array (x, v, y, u); of several free masses (x, v, y0, u0, y1, ...)."""
        return vector(self.state)

    def of(self, parameters: Parameters | SIParameters) -> "PeriodicOrbit":
        """The orbit of dimensionless parameters in the units of others, of which these are."""
        sizes = sizes_of(parameters.units, len(self.derivative))
        return replace(
            self,
            parameters=parameters,
            state=self.state.times(parameters.units),
            derivative=self.derivative * sizes[:, None] / sizes,
        )

    @cached_property
    def scaled(self) -> "PeriodicOrbit":
        """The orbit in dimensionless units."""
        sizes = sizes_of(self.parameters.units, len(self.derivative))
        return replace(
            self,
            parameters=self.parameters.dimensionless,
            state=self.state.over(self.parameters.units),
            derivative=self.derivative * sizes / sizes[:, None],
        )

    @cached_property
    def multipliers(self) -> np.ndarray:
        """Floquet multipliers, complex, the largest first; shape (4,).

        Where a chatter sequence completes, two of them are zero. Beside a fixed stop there are only
        those of the primary; shape (2,). Each further free mass adds two. Of one that is in step
        with another they are infinite where they hit, for a small deviation that parts them does
        not stay small; zero where they stick together, too; and 1 where neither happens.
        """
        p, start = self.parameters.dimensionless, self.scaled.start
        moves = leaders(p, start)
        own = np.unique(moves[moves >= 0])
        derivative = (self.scaled.derivative @ (moves[:, None] == own))[own]
        values = np.linalg.eigvals(derivative).astype(complex)
        in_step = (moves >= 0) & (moves != np.arange(len(moves)))
        if in_step.any():
            arc = run_arc(p, start, 0.0, float(self.period))
            happens = parted_in(arc.trajectory.model, arc.rows)
            values = np.append(values, OF_PARTED[happens].ravel()[in_step[first_mass(p) :]])
        return values[np.lexsort((-values.imag, -abs(values)))]

    @cached_property
    def idle(self) -> tuple[int, ...]:
        """Numbers of the idle free masses, from 0: they meet no wall.

        Each may be anywhere between its walls, so a multiplier is 1, or two without friction, and
        the motion is not `stable`. `continue_orbit` leaves the place out of its equation.
        """
        p, moves = self.parameters.dimensionless, leaders(self.parameters.dimensionless, self.start)
        if (moves < 0).any():
            return ()
        own, first = np.unique(moves), first_mass(p)
        matrix = (self.scaled.derivative @ (moves[:, None] == own))[own]

        def is_idle(k: int) -> bool:
            y, u = np.searchsorted(own, moves[first + 2 * k : first + 2 * k + 2])
            alone, free = matrix.copy(), np.eye(len(own))
            if p.each[k].friction:
                return bool((alone[:, y] == free[y]).all())
            alone[y, u] = 0.0  # the time of a free flight
            rows, columns = alone[[y, u]], alone[:, [y, u]].T
            return bool((rows == free[[y, u]]).all() and (columns == free[[y, u]]).all())

        return tuple(k for k in range(len(p.each)) if is_idle(k))

    @property
    def stable(self) -> bool:
        """Whether small deviations die out: all multipliers inside the unit circle."""
        return bool(abs(self.multipliers[0]) < 1.0)

    def sensitivity(self, parameter: str) -> np.ndarray:
        """How the state at time 0 changes with a parameter, along this motion.

        Parameters
        ----------
        parameter : str
            Name of one of its parameters, such as "clearance", or of a number of its force, as for
            `continue_orbit`.

        Returns
        -------
        ndarray (4,)
            Derivative of (x, v, y, u), or of (x, v, y0, u0, y1, ...), to some 1e-9 of its size. By
            the inverse of its approach speed it grows where an impact grazes (`slowest_impact`),
            and it has no bound where a multiplier tends to 1.

        Raises
        ------
        TypeError
            For an unknown parameter.
        ValueError
            Where a multiplier is 1, as of a free mass that nothing touches, and where the parameter
            is infinite, as those may be that are left out.

        Examples
        --------
        >>> import damper
        >>> p = damper.Parameters(mass_ratio=0.1, damping_ratio=0.1, frequency_ratio=1.0,
        ...                       clearance=5.0, restitution=0.5)
        >>> damper.periodic_orbit(p).sensitivity("clearance").round(3).tolist()
        [0.314, 0.206, 0.443, -0.269]
        """
        change, _, grows = self._change_by(parameter)
        sizes, start = sizes_of(self.parameters.units, len(change)), self.scaled.start
        return change * sizes + start * np.resize(grows, len(start))

    @cached_property
    def peak(self) -> float:
        """Largest displacement of the primary, or of the first mass's box, either way."""
        return abs(self._peak[1]) * self.parameters.units.length

    def peak_sensitivity(self, parameter: str) -> float:
        """How the primary's largest displacement changes with a parameter, along this motion.

        As `sensitivity`. At an extremum of the displacement its time does not matter, so that this
        is the derivative at a fixed phase of the forcing.

        Raises
        ------
        ValueError
            As `sensitivity`, and where an impact ends the largest displacement.

        Examples
        --------
        >>> import damper
        >>> p = damper.Parameters(mass_ratio=0.1, damping_ratio=0.1, frequency_ratio=1.0,
        ...                       clearance=5.0, restitution=0.5)
        >>> round(damper.periodic_orbit(p).peak_sensitivity("clearance"), 4)
        -0.3682
        """
        change, stencil, (grows, _) = self._change_by(parameter)
        (time, value), scaled = self._peak, self.scaled
        p = scaled.parameters.dimensionless
        model = model_along(p, rates_of(self.parameters, parameter))
        arc = run_arc(p, scaled.start, 0.0, time / self._cycle, model)
        if abs(arc.watched[:-1] @ arc.end[1:]) > _AT_REST * abs(value):
            raise ValueError(f"no derivative of the peak: an impact ends it at {self!r}")
        grown = np.sign(value) * (arc.watched @ arc.change_by(stencil, change))
        return float(grown * self.parameters.units.length + abs(value) * grows)

    @property
    def _cycle(self) -> float:
        return self.parameters.dimensionless.cycle

    @cached_property
    def _peak(self) -> tuple[float, float]:
        """Time and displacement, in dimensionless units."""
        p = self.parameters.dimensionless
        return run_arc(p, self.scaled.start, 0.0, float(self.period)).peak()

    def _change_by(self, parameter: str) -> tuple[np.ndarray, Stencil, tuple[float, float]]:
        """Dimensionless derivative of the start, of the models, and growth of length and speed."""
        named_quantity(self.parameters, parameter)
        if math.isinf(value_of(self.parameters, parameter)):
            raise ValueError(f"no derivative by {parameter}: it is inf; give it a finite value")
        rates = rates_of(self.parameters, parameter)
        grows = rates.pop(LENGTH, 0.0), rates.pop(SPEED, 0.0)
        scaled = self.scaled
        p = scaled.parameters.dimensionless
        stencil = neighbours(p, rates)
        require_in_step(self, stencil, parameter)
        arc = run_arc(p, scaled.start, 0.0, float(self.period), model_along(p, rates))
        matrix = arc.fixed_point_matrix
        if np.linalg.cond(matrix) > _SINGULAR:
            raise ValueError(f"no derivative by {parameter}: a multiplier is 1 at {self!r}")
        # In contact the free mass moves with the wall.
        with_wall = np.zeros_like(arc.start)
        with_wall[first_mass(p) :: 2] = (
            np.where(arc.start_sides == RESTS, 0.0, arc.start_sides) * stencil.clearance
        )
        change = arc.change_by(stencil, with_wall) - with_wall
        change = arc.directions @ np.linalg.solve(matrix, change[arc.own]) + with_wall
        return change, stencil, grows

    @cached_property
    def events(self) -> np.ndarray:
        """Its events, as `damper.events` gives them, over the period."""
        until = self.period * self.parameters.cycle
        return events(self.parameters, self.state, until=until)

    @cached_property
    def bursts(self) -> "tuple[WallImpacts, ...]":
        """Its runs of impacts on one wall, the longest on the right wall first."""
        names = ("kind", "side", "approach_speed", "body")
        return bursts_of(*(self.events[name] for name in names))

    @property
    def word(self) -> str:
        """Its events: "R3 L2 RS" for three impacts right, two left, complete chatter right.

        A bar separates several free masses: "R1 L1 | R2 L1".
        """
        return word_of(self.bursts)

    @property
    def impacts(self) -> float:
        """Impacts in its period; infinitely many where a chatter sequence completes."""
        return sum(np.inf if burst.completes else burst.impacts for burst in self.bursts)

    @property
    def slowest_impact(self) -> float:
        """Smallest approach speed, but for impacts that complete; NaN without another one.

        The derivative grows by its inverse.
        """
        slowest = min((burst.slowest for burst in self.bursts), default=np.inf)
        return slowest if slowest < np.inf else np.nan


def nearest_orbit(
    parameters: Parameters, period: int, start: np.ndarray, steps: int = _STEPS
) -> "PeriodicOrbit":
    """Run Newton's method from a state at time 0, and return the state with the least change."""

    def over(start: np.ndarray) -> Arc:
        return run_arc(parameters, start, 0.0, float(period))

    best = found = over(start)
    for _ in range(steps):
        if found.change <= TOLERANCE * max(1.0, float(np.abs(found.start).max())):
            break
        if (found.sides != found.start_sides).any():
            # It ends in contact, or no more: the next period begins as this one ends.
            found = over(found.end)
        elif (stepped := _newton(found, over)) is None:
            break
        else:
            found = stepped
        best = min(best, found, key=lambda each: each.change)
    state = state_of(best.start, 0.0, first_mass(parameters) // 2)
    return PeriodicOrbit(parameters, period, state, best.derivative, best.change)


def check(parameters: Parameters | SIParameters, period: int) -> None:
    """Refuse what is not followed."""
    require_parameters(parameters, structures=True)
    require_force(parameters, "an orbit")
    p = parameters.dimensionless
    order = p.modulation_order if p.model == "time_varying" else 1
    if period % order:
        raise ValueError(f"period = {period}: must be a multiple of modulation_order = {order}")


def require_in_step(orbit: PeriodicOrbit, stencil: Stencil, name: str) -> None:
    """Raise ValueError where a parameter parts masses that move in step."""
    p = orbit.parameters.dimensionless
    moves = leaders(p, orbit.scaled.start)[2::2] // 2 - 1
    if "several" not in p.features or (moves == np.arange(len(moves))).all():
        return
    # All but their mass, by which masses in step may differ.
    each = [m.masses[:, 1:] for m in stencil.models]
    # Yield speeds may be infinite.
    changes = np.zeros_like(each[0])
    np.subtract(each[1], each[0], out=changes, where=each[1] != each[0])
    for k in np.flatnonzero((changes != changes[moves]).any(axis=1)):
        raise ValueError(
            f"{name} parts the masses {moves[k]} and {k}, which move in step: what parts masses "
            "that hit together has no derivative; take a motion on which they are apart"
        )


def require_force(parameters: Parameters | SIParameters, what: str) -> None:
    """Raise ValueError unless a force acts that repeats with the clock."""
    p = parameters.dimensionless
    if p.force_amplitude == 0.0 or p.forcing.kind == "none":
        cause = "forcing = none" if p.force_amplitude else "force_amplitude = 0"
        raise ValueError(f"{what} in free motion ({cause}): nothing repeats that no force drives")
    if not p.forcing.repeats:
        repeating = ", ".join(k for k, c in FORCINGS.items() if c.repeats and k != "none")
        raise ValueError(
            f"{what} under a {p.forcing.kind}: the force does not repeat; forcing must be one of "
            f"{repeating}"
        )


def sizes_of(units: Units, count: int) -> np.ndarray:
    """Sizes of the units of so many components (x, v, y, u, ...)."""
    return np.resize([units.length, units.speed], count)


def _newton(found: Arc, over: Callable[[np.ndarray], Arc]) -> Arc | None:
    """As much of a Newton step as makes the change smaller; None where nothing does."""
    matrix = found.fixed_point_matrix
    residual = (found.end - found.start)[found.own]
    step = found.directions @ np.linalg.lstsq(matrix, residual, rcond=None)[0]
    for halving in range(_HALVINGS):
        start = found.start + 0.5**halving * step
        clearances = np.array([one.clearance for one in found.parameters.each])
        walls = np.array([getattr(one, "walls", 0.0) for one in found.parameters.each])
        first = first_mass(found.parameters)
        apart = start[first::2] - boxes_of(found.parameters) @ start[:first:2]
        deep = np.where(walls == 0.0, abs(apart), walls * apart)
        within = deep <= clearances * (1.0 + 1e-15)
        if within.all() or found.parameters.model == "compliant":
            passed = over(start)
            if passed.change < found.change:
                return passed
    return None


def _settled(parameters: Parameters, state: State | None, settle: int, units: Units) -> np.ndarray:
    """State at the start of a forcing period: the first one after the state, or of a long run."""
    start = state.over(units) if state else None
    if start:
        check_state(parameters, start, units)
    trajectory = start_run(parameters, start)
    at = float(settle) if state is None else trajectory.start[0] + (trajectory.start[1] > 0.0)
    trajectory.skip(at)
    if trajectory.status != FINISHED:
        run = f"settle = {settle}" if state is None else f"state = {state!r}"
        raise ValueError(f"{run}: the run stopped early, max_events are used up")
    return vector(trajectory.state_at(at))
