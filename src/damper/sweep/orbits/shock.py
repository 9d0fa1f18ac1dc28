"""`damper.smallest_shock`: how large a shock on the carrier throws a motion out."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from damper.engine.compiled import compiling
from damper.engine.loop import FINISHED
from damper.engine.model import count_masses
from damper.engine.terminal import saying
from damper.engine.trajectory import Trajectory
from damper.models import model_of
from damper.observers.common.base import Window
from damper.observers.motion import in_words
from damper.parameters import State
from damper.parameters.models import MODELS, models_of, require_model
from damper.parameters.names import unknown_name
from damper.parameters.quantity import real, whole
from damper.sweep.estimate import MOST_PERIODS
from damper.sweep.orbits.arcs import state_of, vector
from damper.sweep.orbits.periodic import PeriodicOrbit
from damper.sweep.runs import observed

#: Distance, over the size of the primary's motion, at which a run is back on the orbit.
_BACK = 1e-5
#: Sizes that are tried, over the largest; each is a quarter larger than the one before.
_SIZES = np.geomspace(5e-3, 1.0, 25)
#: Largest size, over the primary's largest speed, where none is given, and the most that it may
#: be: the smallest size that is tried is then five times that speed, and misses all below.
_LARGEST, _MOST = 10.0, 1000
#: Most moments of a forcing period: at each there are up to 50 runs of 1000 periods.
_MOMENTS = 1000
#: Smallest part of a size to which it can be bisected: smaller ones are roundoff.
_FINEST = 1e-12
#: Forcing periods that a run may wander before it settles.
_WANDER = 1000
#: Longest period of a motion that a run may settle on.
_LONGEST = 8


@saying("looking for the smallest shock")
@compiling(at_once=False)
def smallest_shock(
    orbit: PeriodicOrbit,
    *,
    moments: int = 16,
    largest: float | None = None,
    settle: int | None = None,
    tolerance: float = 1e-3,
    place: str | None = None,
) -> "Shock":
    """Find the smallest sudden change of the primary's velocity that throws a motion out.

    On a structure an impulse hits a place, and the size is the change of that place's velocity.
    A shock on the machine changes the velocity by its impulse over the primary's mass. Shocks are
    tried at several moments, in both directions, of sizes that grow by a quarter, until the motion
    does not come back after one. The size is then bisected. This is a search on a grid and no
    proof: basins may be interwoven, so a smaller shock at an untried size or moment may throw the
    motion out as well.

    Parameters
    ----------
    orbit : PeriodicOrbit
        A stable motion.
    moments : int, default 16
        How many moments of each forcing period to try, at most 1000.
    largest : float, optional
        Largest size to try, in units of F0/sqrt(K M) (m/s with SIParameters), and 200 times the
        smallest; at most 1000 times the primary's largest speed. Ten times that when not given.
    settle : int, optional
        Forcing periods after which a run that is neither back nor on another periodic motion counts
        as thrown out. When not given, 1000 more than a small deviation takes to fall by 1e5 times.
    tolerance : float, default 1e-3
        How closely the size is bisected, as a part of it; from 1e-12 on.
    place : str, optional
        Of a structure: the box or point that is hit, and whose velocity changes by the size of the
        shock; where the force acts when left out.

    Returns
    -------
    Shock

    Raises
    ------
    ValueError
        For a motion that is not stable, and where no shock up to the largest throws it out; for a
        place that no coordinate moves.
    TypeError
        For what is no PeriodicOrbit, and for a place without a structure.

    Examples
    --------
    >>> import damper
    >>> p = damper.Parameters(mass_ratio=0.25, damping_ratio=0.02, frequency_ratio=0.74,
    ...                       clearance=4.62, restitution=0.5)
    >>> orbit = damper.periodic_orbit(p, guess=damper.State(-1.2, 1.1, -5.4, 4.0))
    >>> shock = damper.smallest_shock(orbit, moments=1, tolerance=0.1)
    >>> orbit.word, round(shock.size, 1), shock.direction
    ('R2 L1', 0.2, 1)
    """
    if not isinstance(orbit, PeriodicOrbit):
        raise TypeError(f"orbit = {orbit!r}: must be a damper.PeriodicOrbit")
    p = orbit.parameters.dimensionless
    if p.model != "structure":
        require_model(p, MODELS, "smallest_shock")
    weights = _place_of(p, place)
    if not orbit.stable:
        growth = abs(orbit.multipliers[0])
        raise ValueError(
            f"orbit: its largest multiplier has the size {growth:.6g}, and only a stable motion, "
            "of less than 1, comes back after any shock"
        )
    moments, tolerance = whole("moments", moments, 1, most=_MOMENTS), real("tolerance", tolerance)
    if not _FINEST <= tolerance < 1.0:
        raise ValueError(
            f"tolerance = {tolerance!r}: must be a number with {_FINEST:g} <= tolerance < 1"
        )
    units, tried = orbit.parameters.units, _Shocks(orbit.scaled, moments, settle, weights)
    most = _LARGEST * tried.speed if largest is None else real("largest", largest) / units.speed
    if not 0.0 < most <= _MOST * tried.speed:
        raise ValueError(
            f"largest = {largest!r}: must be a positive number <= "
            f"{_MOST * tried.speed * units.speed:.6g}, {_MOST} times the largest speed there"
        )
    ways = [(k, direction) for k in range(moments * orbit.period) for direction in (1, -1)]
    smaller = 0.0
    for size in (most * _SIZES).tolist():
        thrown = [way for way in ways if tried.leaves(size, *way)]
        if thrown:
            found = tried.smallest(smaller, size, thrown, tolerance)
            return replace(
                found,
                size=found.size * units.speed,
                returns=found.returns * units.speed,
                state=found.state.times(units),
            )
        smaller = size
    raise ValueError(
        f"no shock up to {most * units.speed:.6g} throws the motion out: try a larger one, or more "
        "moments"
    )


def _place_of(p: Any, place: str | None) -> np.ndarray:
    """Displacement of what is hit in a unit displacement of each coordinate."""
    if p.model != "structure":
        if place is not None:
            raise TypeError(f"place = {place!r}: a shock hits the one primary mass; leave it out")
        return np.ones(1)
    s, given = p.structure, p.origin.structure
    if place is None and given.force is None:
        raise ValueError(f"place is missing: must be one of {', '.join(s.points)}")
    if place is not None and place not in s.points:
        raise unknown_name("place of a shock", place, s.points)
    weights = np.asarray(s.force if place is None else s.points[place])
    if not weights.any():
        raise ValueError(f"place = {place!r}: no coordinate moves it, so no shock moves any")
    return weights


@dataclass(frozen=True)
class Shock:
    """A shock after which a motion does not come back; from `smallest_shock`."""

    size: float
    """Change of the velocity of what is hit, in units of F0/sqrt(K M), or in m/s."""
    returns: float
    """Largest size below it, at the same moment and in the same direction, that was seen to come
    back."""
    direction: int
    """1 or -1: the sign of the change."""
    moment: float
    """Forcing periods after the orbit's start."""
    state: State
    """Just after the shock."""
    motion: str
    """What the run ends in, in words; of several masses what each does."""


class _Shocks:
    """Shocks on an orbit."""

    def __init__(
        self, orbit: PeriodicOrbit, moments: int, settle: int | None, weights: np.ndarray
    ) -> None:
        self.orbit, self.moments = orbit, moments
        self.model = model_of(orbit.parameters.dimensionless)
        growth = abs(orbit.multipliers[0])
        if settle is None:
            lasts = math.log(_BACK) / math.log(growth) if growth > 0.0 else 0.0
            settle = _WANDER + orbit.period * math.ceil(lasts)
        self.settle = whole("settle", settle, 1, most=MOST_PERIODS)
        trajectory, states = Trajectory(self.model, orbit.state), []
        for k in range(moments * orbit.period):
            place = self._place(k)
            trajectory.skip(*place)
            states.append(vector(trajectory.state_at(*place)))
        #: At each of the moments, over the whole period.
        self.states = np.array(states)
        p: Any = orbit.parameters
        self.size = 2 * len(weights)
        self.speed = float(abs(self.states[:, 1 : self.size : 2] @ weights).max())
        self.back = _BACK * float(abs(self.states[:, : self.size]).max())
        #: Change of each coordinate's velocity by an impulse that changes that of the place by 1.
        self.pushed = np.ones(1)
        if p.model == "structure":
            moved = np.linalg.solve(p.structure.mass, weights)
            self.pushed = moved / (weights @ moved)
        #: A run that changes less in a period has settled; one that comes back changes more.
        self.still = 0.5 * self.back * (1.0 - growth)

    def _place(self, k: int) -> tuple[float, float]:
        """Whole forcing periods and time of a moment."""
        periods, part = divmod(k, self.moments)
        return float(periods), part / self.moments * self.orbit.parameters.cycle

    def after(self, size: float, k: int, direction: int) -> State:
        """State just after a shock at a moment."""
        start = self.states[k].copy()
        start[1 : self.size : 2] += direction * size * self.pushed
        periods, time = self._place(k)
        time += periods * self.orbit.parameters.cycle
        return state_of(start, time, self.size // 2)

    def leaves(self, size: float, k: int, direction: int) -> int:
        """Forcing periods after which the run has settled elsewhere; 0 where it comes back.

        It is back if it is on the orbit, maybe some forcing periods later than without the shock.
        """
        state = self.after(size, k, direction)
        trajectory = Trajectory(self.model, state)
        periods, time = self._place(k)
        same = self.states[k % self.moments :: self.moments]
        recent = np.full((_LONGEST, self.states.shape[1]), np.inf)
        for passed in range(1, self.settle + 1):
            trajectory.skip(periods + passed, time)
            if trajectory.status != FINISHED:
                return passed
            now = vector(trajectory.state_at(periods + passed, time))
            if abs(same - now).max(axis=1).min() <= self.back:
                return 0
            if abs(recent - now).max(axis=1).min() <= self.still:
                return passed
            recent[passed % _LONGEST] = now
        return self.settle

    def smallest(
        self, smaller: float, size: float, ways: list[tuple[int, int]], tolerance: float
    ) -> Shock:
        """The smallest size between two, of these moments and directions."""
        best, below = ways[0], smaller
        for way in ways:
            if way != best and not self.leaves(size, *way):
                continue
            best, below = way, smaller
            while size - below > tolerance * size:
                middle = 0.5 * (below + size)
                if self.leaves(middle, *way):
                    size = middle
                else:
                    below = middle
        k, direction = best
        return Shock(
            size=size,
            returns=below,
            direction=direction,
            moment=k / self.moments,
            state=self.after(size, k, direction),
            motion=self._ends_in(size, k, direction),
        )

    def _ends_in(self, size: float, k: int, direction: int) -> str:
        """The motion that a run after a shock ends in, in words; of several masses that of each."""
        several = "several" in models_of(self.model)
        bodies = range(count_masses(self.model)) if several else ()
        trajectory = Trajectory(self.model, self.after(size, k, direction))
        periods, time = trajectory.start
        # Twice as long: a run that barely leaves passes an unstable motion.
        settled = periods + 2 * self.leaves(size, k, direction)
        window = Window(settled, time, 2 * _LONGEST + 2)
        wanted = {"motion": {"longest": _LONGEST, "bodies": bodies}}
        found = {v.name: array for v, array in observed(trajectory, window, wanted)}
        if trajectory.status != FINISHED:
            return "the run stopped early"
        every = zip(*(np.ravel(array).tolist() for array in found.values()), strict=True)
        words = [in_words(dict(zip(found, one, strict=True))) for one in every]
        if len(words) == 1:
            return words[0]
        return "; ".join(f"mass {k}: {w}" for k, w in enumerate(words))
