"""Jobs of a study that simulates: a slice each, and the cube that is gathered from them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import partial
from typing import Any

from damper.parameters.forcing import NoForce
from damper.parameters.models import room_of
from damper.study.estimate import estimate
from damper.study.jobs import Job, Jobs, shares
from damper.study.model import Study
from damper.sweep.record import record


class SimulatedStudy(Study):  # type: ignore[misc]
    """A study with the jobs that make its cube."""

    def parts(self, engine: Mapping[str, Any]) -> Jobs:
        """Return the jobs that simulate: all points of one place along the fanned axes each."""
        return Jobs(self._slices(), partial(self._parts, engine))

    def _parts(self, engine: Mapping[str, Any]) -> dict[str, Job]:
        fixed, values = self.fixed, self.axis_values
        modules, takes = simulation_modules(self), estimate(self)
        every = {
            "axes": {name: values[name] for name in self.inner_axes},
            **self.run_settings(engine),
            "observers": self.observer_settings(),
            "primary": self.initial,
            "follow": self.follow,
            **self.forcing_settings,
            **self.beside,
        }
        return {
            path: Job(
                "damper.sweep.slices",
                {"fixed": fixed | place, "draws": draws, **every},
                files=self.force_files,
                loads=modules,
                resources=takes.simulate_resources,
            )
            for path, (place, draws) in self._slices().items()
        }

    def _slices(self) -> dict[str, tuple[dict[str, float], dict[str, Any]]]:
        """Path of each slice -> its place along the fanned axes, and its draws."""
        found, draws = {}, self.draw_settings()
        for place in self.slices():
            path = self.slice_path(place)
            if self.jobs == 1:
                found[path] = place, draws
            else:
                for first, end in shares(draws["count"], self.jobs):
                    found[f"{path}/draws~{first}"] = place, draws | {"only": [first, end]}
        return found

    def gathered(self, engine: Mapping[str, Any]) -> Jobs:
        """Return the job that gathers the slices into the cube."""
        return Jobs(("cube.nc",), lambda: {"cube.nc": self._gathered(engine)})

    def _gathered(self, engine: Mapping[str, Any]) -> Job:
        values = self.axis_values
        # Orbits, figures and tables do not change a cube.
        measured = self.model_copy(update={"orbits": {}, "figures": {}, "tables": {}})
        about = {"title": self.title, "source": self.source, "study": measured.to_yaml()}
        followed = {name: values[name] for name in self.follow}
        run = record(
            self.observer_settings(),
            self.initial,
            self.run_settings(engine),
            followed,
            **self.beside,
        )
        if self.forcing_settings:
            run["forcing"] = json.dumps(self.forcing.about(self._folder))
        return Job(
            "damper.sweep.cube",
            {
                "axes": values,
                "fan_axes": self.fan_axes,
                "fixed": self.fixed,
                "attributes": about | run,
                "amplitude": self.force.amplitude,
                "notes": {"assumed": self.assumed, "stated": self.stated},
                "in_hertz": self.in_hertz,
            },
            needs=tuple(self._slices()),
            loads=simulation_modules(self),
            resources=estimate(self).gather_resources,
        )


def engine_parts(study: Study) -> tuple[str, ...]:
    """Names of the event loops under a study's forces, as the rule `compile` has them."""
    return tuple(sorted({engine_part(corner) for corner in study.corners}))


def engine_part(p: Any) -> str:
    """Name of the event loop for the dimensionless parameters of a damper.

    Code is compiled for each class of constants: noise is a record; a base seen from the ground, or
    an unbalance, is a harmonic force. A force that acts on the free mass as well has a class of its
    own, and so have a weight and friction of several masses, or on a structure.
    """
    force = p.forcing if p.force_amplitude else NoForce()
    kind = {"noise": "record", "unbalance": "harmonic"}.get(force.kind, force.kind)
    words = [kind, getattr(force, "of", getattr(force, "frame", None))]
    if words in (["harmonic", None], ["base", "ground"]):
        words = []
    beside = "weight" if any(one.pull for one in p.each) else None
    if p.rubs and {"several", "structure"} & {*p.features}:
        beside = "friction"
    return "_".join(["engine", *filter(None, [*words, beside])])


def simulation_modules(study: Study) -> tuple[str, ...]:
    """Modules of the model and the observers of a study: others do not concern its results."""
    # Points at a model's default, such as points without modulation, are rigid.
    models = sorted({"damper.models.masses", f"damper.models.{room_of(study.main_feature)}"})
    energies = {"decay", "laws", "response", "statistics"} | (
        {"impacts"} if study.contents.asks("impacts", "largest") else set()
    )
    return (
        *models,
        *(f"{model}.response" for model in models if study.observers.keys() & energies),
        *(f"{model}.laws" for model in models if "laws" in study.observers),
        *sorted(f"damper.observers.{name}" for name in study.observers),
    )
