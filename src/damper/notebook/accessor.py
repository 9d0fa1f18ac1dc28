"""The accessor ``damper`` of a cube: figures of it, and a run of any of its points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import xarray as xr

from damper.analysis.places import fixed_values, require_coordinates, require_cube, value_on
from damper.engine.loop import FINISHED
from damper.notebook.run import Run, drawn, recorded
from damper.parameters import Parameters, SIParameters, State
from damper.parameters.lazy import Figure
from damper.parameters.named import damper_of
from damper.parameters.names import unknown_name
from damper.parameters.quantities import is_si, quantities_in
from damper.parameters.tables import beside_numbers
from damper.sweep.orbits.periodic import PeriodicOrbit, periodic_orbit
from damper.sweep.record import (
    followed,
    force_of,
    force_settings,
    masses_of,
    observers_of,
    primary_of,
    setting_of,
    settings_of,
)
from damper.sweep.runs import last_of_chain

if TYPE_CHECKING:
    from damper.engine.trajectory import Trajectory
    from damper.observers.common.base import Window


class CubeAccessor:
    """Figures of a cube, and runs of its points: ``cube.damper``.

    A point is given by its values along the cube's dimensions, such as
    ``cube.damper.history(restitution=0.6, frequency_ratio=1.3)``, and by its ``direction`` and
    ``draw``; the nearest one of the grid is taken, at most half a step away, and a warning names
    it. A dimension with a single value may be left out. A point of a continuation moves as in the
    cube: its branch is run again up to this point.

    Examples
    --------
    >>> import damper
    >>> cube = damper.simulate(mass_ratio=0.1, damping_ratio=0.02, frequency_ratio=1.3,
    ...                        clearance=0.05, restitution=[0.3, 0.6], transient=20, periods=5)
    >>> run = cube.damper.run(restitution=0.3)
    >>> run.parameters.restitution, len(run.bursts)
    (0.3, 10)
    """

    def __init__(self, cube: xr.Dataset) -> None:
        self._cube = cube

    def __repr__(self) -> str:
        named = (name for name in vars(CubeAccessor) if not name.startswith("_"))
        return f"<cube.damper: {', '.join(named)}>"

    def bifurcation(
        self, along: str, *, orbits: Mapping[str, Mapping[str, Any]] | None = None, **settings: Any
    ) -> Figure:
        """Draw a bifurcation diagram; settings are the keys of that kind of figure.

        `orbits` are periodic motions to follow and to draw over it, stable or not, as a study names
        them: ``{"two impacts": {"start": 5.0}}`` is the motion that a run from rest has there.
        """
        if not orbits:
            return drawn("bifurcation", self._cube, along=along, **settings)
        branches = self._followed(along, orbits)
        return drawn("bifurcation", self._cube, branches, along=along, orbits=True, **settings)

    def map(self, x: str, y: str, variable: str, **settings: Any) -> Figure:
        """Draw a map; settings are the keys of that kind of figure."""
        return drawn("map", self._cube, x=x, y=y, variable=variable, **settings)

    def curves(self, along: str, variables: list[str], **settings: Any) -> Figure:
        """Draw curves; settings are the keys of that kind of figure."""
        return drawn("curves", self._cube, along=along, variables=variables, **settings)

    def run(self, *, samples_per_period: int = 200, **point: Any) -> Run:
        """Run one point again, with the cube's transient and window, and keep its motion.

        Raises
        ------
        ValueError
            For a point that does not say where along which dimension, or lies beyond the grid, and
            for a cube that does not say how its runs were made, or has lost what they depend on.
        """
        parameters, start, last, _ = self._started(point)
        state = None if start is None else start.times(last.units)
        sampled = {"samples_per_period": samples_per_period}
        return recorded(parameters, trajectory=sampled, state=state, **settings_of(self._cube))

    def history(self, *, start: float = 0.0, stop: float = 10.0, **point: Any) -> Figure:
        """Draw both masses of one point over so many cycles of its window."""
        return self.run(**point).plot(start, stop)

    def portrait(self, **point: Any) -> Figure:
        """Draw phase portraits and the stroboscopic section of one point."""
        return self.run(**point).portrait()

    def orbit(self, period: int = 1, **point: Any) -> PeriodicOrbit:
        """Return the periodic motion of one point, from where its run settles.

        Raises
        ------
        ValueError
            As `run` and `damper.periodic_orbit`, and where the run stopped early.
        """
        parameters, start, last, window = self._started(point)
        if start is None:
            return periodic_orbit(parameters, period)
        end = window.end(last.cycle)
        last.skip(*end)
        if last.status != FINISHED:
            raise ValueError("orbit: the run of this point stopped early, max_events are used up")
        return periodic_orbit(parameters, period, last.state_at(*end).times(last.units))

    def _followed(self, along: str, orbits: Mapping[str, Mapping[str, Any]]) -> xr.Dataset:
        """Branches of the cube's damper; ValueError where it is in SI units."""
        from damper.analysis.orbits import follow_orbits
        from damper.study.settings import FollowedOrbit

        require_cube(self._cube)
        axes = {name: self._cube[name].values.tolist() for name in quantities_in(self._cube.dims)}
        fixed = fixed_values(self._cube)
        if is_si([*axes, *fixed]):
            raise ValueError("orbits: periodic motions are followed over dimensionless cubes alone")
        if not isinstance(transient := setting_of(self._cube, "transient"), int):
            raise ValueError(
                f"orbits: transient = {transient!r}: must be cycles, for a run to settle"
            )
        entries = {
            name: FollowedOrbit.checked(name, {"along": along, **entry}).model_dump()
            | {"settle": transient}
            for name, entry in orbits.items()
        }
        section = observers_of(self._cube).get("stroboscopic_section", {})
        force = force_settings(self._cube) or None
        when = section.get("when", 0.0)
        return follow_orbits(entries, fixed, axes, when, force, **masses_of(self._cube))

    def _started(
        self, point: Mapping[str, Any]
    ) -> tuple[Parameters | SIParameters, State | None, Trajectory, Window]:
        """Parameters of a point of the grid, where its run starts, that run, and its window."""
        require_cube(self._cube)
        primary = primary_of(self._cube)
        place = self._cube.sel(self._place(point))
        values: dict[str, Any] = fixed_values(place) | force_of(place)
        values |= beside_numbers(**masses_of(place))
        chain = [values]
        for name, along in followed(place).items():
            require_coordinates(place, "direction")
            up, here = place.direction.item() == "up", values[name]
            before = sorted(v for v in along if (v < here if up else v > here))
            chain = [values | {name: v} for v in (*(before if up else before[::-1]), here)]
        return damper_of(values), *last_of_chain(chain, primary, **settings_of(self._cube))

    def _place(self, point: Mapping[str, Any]) -> dict[str, Any]:
        """Values of the grid that a point means, along all axes and branches."""
        branches = (name for name in ("direction", "draw") if name in self._cube.dims)
        axes = {name: self._cube[name] for name in (*quantities_in(self._cube.dims), *branches)}
        for name in point:
            if name not in axes:
                raise ValueError(str(unknown_name("dimension", name, axes)))
        place = {}
        for name, axis in axes.items():
            if name in point:
                place[name] = value_on(axis, point[name])
            elif axis.size > 1:
                raise ValueError(
                    f"{name} is not given; a point says where it lies along {', '.join(axes)}"
                )
            else:
                place[name] = axis.item()
        return place
