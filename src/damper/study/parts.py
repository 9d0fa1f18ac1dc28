"""Jobs of a study that simulates: a slice each, and the cube that is gathered from them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from damper.study.estimate import estimate
from damper.study.jobs import Job
from damper.sweep.record import record

if TYPE_CHECKING:
    from damper.study.model import Study


def slices(study: Study, engine: Mapping[str, Any]) -> dict[str, Job]:
    """Return the jobs that simulate: all points of one place along the fanned axes each."""
    fixed, values = study.fixed, study.axis_values
    modules, takes = simulation_modules(study), estimate(study)
    every = {
        "axes": {name: values[name] for name in study.inner_axes},
        **study.run,
        **engine,
        "observers": study.observer_settings(),
        "primary": study.initial,
        "draws": study.draw_settings(),
        "follow": study.follow,
    }
    return {
        study.slice_path(place): Job(
            "damper.sweep.slices",
            {"fixed": fixed | place, **every},
            loads=modules,
            compiled=("engine",),
            resources=takes.simulate_resources,
        )
        for place in study.slices()
    }


def cube(study: Study, engine: Mapping[str, Any]) -> Job:
    """Return the job that gathers the slices into the cube."""
    values = study.axis_values
    # Orbits, figures and tables do not change a cube.
    measured = study.model_copy(update={"orbits": {}, "figures": {}, "tables": {}})
    about = {"title": study.title, "source": study.source, "study": measured.to_yaml()}
    followed = {name: values[name] for name in study.follow}
    run = record(study.observer_settings(), study.initial, {**study.run, **engine}, followed)
    return Job(
        "damper.sweep.cube",
        {
            "axes": values,
            "fan_axes": study.fan_axes,
            "fixed": study.fixed,
            "attributes": about | run,
            "notes": {"assumed": study.assumed, "stated": study.stated},
        },
        needs=tuple(map(study.slice_path, study.slices())),
        loads=simulation_modules(study),
        resources=estimate(study).gather_resources,
    )


def simulation_modules(study: Study) -> tuple[str, ...]:
    """Modules of the model and the observers of a study: others do not concern its results."""
    # Points of any model that do not ask for it, such as those without modulation, are rigid.
    models = sorted({"damper.models.rigid", f"damper.models.{study.model}"})
    return (
        *models,
        *(f"{model}.response" for model in models if study.observers.keys() & {"response", "laws"}),
        *(f"{model}.laws" for model in models if "laws" in study.observers),
        *sorted(f"damper.observers.{name}" for name in study.observers),
    )
