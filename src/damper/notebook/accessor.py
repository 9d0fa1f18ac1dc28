"""The accessor ``damper`` of a cube: figures of it, and a run of any of its points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import xarray as xr

from damper.notebook.run import Run, drawn, recorded
from damper.parameters import Parameters, SIParameters, State
from damper.parameters.quantities import ALL, INITIAL_NAMES, check_quantity, is_si, unknown_name
from damper.sweep.orbits.periodic import PeriodicOrbit, periodic_orbit
from damper.sweep.record import observers_of, settings_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@xr.register_dataset_accessor("damper")
class CubeAccessor:
    """Figures of a cube, and runs of its points: ``cube.damper``.

    A point is given by its values along the cube's dimensions, such as
    ``cube.damper.history(restitution=0.6, frequency_ratio=1.3)``; the nearest one of the grid is
    taken. What lies along a dimension of one value may be left out.

    Examples
    --------
    >>> import damper, damper.notebook
    >>> cube = damper.simulate(mass_ratio=0.1, damping_ratio=0.02, frequency_ratio=1.3,
    ...                        clearance=0.05, restitution=[0.3, 0.6], transient=20, periods=5)
    >>> run = cube.damper.run(restitution=0.3)
    >>> run.parameters.restitution, len(run.bursts)
    (0.3, 10)
    """

    def __init__(self, cube: xr.Dataset) -> None:
        self._cube = cube

    def bifurcation(self, along: str, **settings: Any) -> Figure:
        """Draw a bifurcation diagram; settings are the keys of that kind of figure."""
        return drawn("bifurcation", self._cube, along=along, **settings)

    def map(self, x: str, y: str, variable: str, **settings: Any) -> Figure:
        """Draw a map; settings are the keys of that kind of figure."""
        return drawn("map", self._cube, x=x, y=y, variable=variable, **settings)

    def curves(self, along: str, variables: list[str], **settings: Any) -> Figure:
        """Draw curves; settings are the keys of that kind of figure."""
        return drawn("curves", self._cube, along=along, variables=variables, **settings)

    def run(self, *, samples_per_period: int = 200, **point: Any) -> Run:
        """Run one point again, with the cube's transient and record, and keep its motion.

        Raises
        ------
        ValueError
            For a point that does not say where along which dimension, or is no run by itself, and
            for a cube that is of no study.
        """
        parameters, values = self._point(point)
        primary = self._cube.attrs.get("primary_starts") or "rest"
        sampled = {"samples_per_period": samples_per_period}
        given = settings_of(self._cube)
        return recorded(parameters, values, trajectory=sampled, initial=primary, **given)

    def history(self, *, start: float = 0.0, stop: float = 10.0, **point: Any) -> Figure:
        """Draw both masses of one point over so many forcing periods of its record."""
        return self.run(**point).plot(start, stop)

    def portrait(self, **point: Any) -> Figure:
        """Draw phase portraits and the stroboscopic section of one point."""
        return self.run(**point).portrait()

    def orbit(self, period: int = 1, **point: Any) -> PeriodicOrbit:
        """Return the periodic motion of one point, from where its run settles.

        Raises
        ------
        ValueError
            As `damper.periodic_orbit`.
        """
        parameters, values = self._point(point)
        if isinstance(parameters, SIParameters):
            parameters = parameters.dimensionless
        if set(values) & set(INITIAL_NAMES):
            raise ValueError("orbit: initial quantities of this cube do not settle where it starts")
        return periodic_orbit(parameters, period)

    def _point(
        self, point: Mapping[str, float]
    ) -> tuple[Parameters | SIParameters, dict[str, float]]:
        """Parameters of a point of the grid, and all values of its run."""
        observers_of(self._cube)  # refuses what is no cube
        if "follow" in self._cube.attrs or "draw" in self._cube.dims:
            raise ValueError("a run of continuation or of a random start is no run by itself")
        if self._cube.attrs.get("initial", "").startswith(State.__name__):
            raise ValueError("the runs of this cube start from a state of their own: damper.run")
        axes = {name: self._cube[name] for name in ALL if name in self._cube.dims}
        lacking = [name for name, axis in axes.items() if axis.size > 1 and name not in point]
        wrong = [name for name in point if name not in axes]
        if wrong:
            raise ValueError(str(unknown_name("dimension", wrong[0], axes)))
        if lacking:
            raise ValueError(
                f"{lacking[0]} is not given; a point says where it lies along {', '.join(axes)}"
            )
        point = {name: check_quantity(name, value) for name, value in point.items()}
        place = self._cube.sel(point, method="nearest") if point else self._cube
        values = {name: place[name].item() for name in ALL if name in place.coords}
        kind = SIParameters if is_si(values) else Parameters
        of_damper = {name: v for name, v in values.items() if name not in INITIAL_NAMES}
        return kind(**of_damper), values
