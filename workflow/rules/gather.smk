"""Cubes: the slices of a study gathered into one netCDF file."""


def slices_of(wildcards):
    """Return the files of all slices of a study."""
    study = STUDIES[wildcards.study]
    paths = [study.slice_path(place) for place in study.slices()]
    return [f"{RESULTS}/{study.name}/slices/{path}.npz" for path in paths]


@once
def gather_settings(study):
    study = STUDIES[study]
    # Orbits, figures and tables do not change a cube.
    measured = study.model_copy(update={"orbits": {}, "figures": {}, "tables": {}})
    return {
        "about": {"title": study.title, "source": study.source, "study": measured.to_yaml()},
        "notes": {"assumed": study.assumed, "stated": study.stated},
        "axes": study.axis_values,
        "fan_axes": study.fan_axes,
        "fixed": study.fixed,
        "observers": study.observer_settings(),
        "primary": study.initial,
        "run": study.run | ENGINE,
        "followed": {name: study.axis_values[name] for name in study.follow},
        "code": digest("gather.py", *simulation_modules(study)),
        "slices": [
            fingerprint(simulate_settings(study.name, study.slice_path(place)))
            for place in study.slices()
        ],
    }


SETTINGS["parameters", "cube.nc"] = gather_settings


def memory_with_cube(study):
    """Return the megabytes of a job that opens a cube; those of checks of the engine are small."""
    gathering = taken_by(study.name).gather_resources["mem_mb"] if study.name in STUDIES else 0
    return max(1000, 500 + gathering)


rule gather:
    input:
        slices=slices_of,
        newer=changed(gather_settings, f"{RESULTS}/{{study}}/cube.nc", parts=slices_of),
    output:
        f"{RESULTS}/{{study}}/cube.nc",
    log:
        f"{LOGS}/{{study}}/gather.log",
    benchmark:
        f"{TIMES}/{{study}}/gather.tsv"
    wildcard_constraints:
        study=one_of(STUDIES),
    priority: of_papers(2)
    resources:
        mem_mb=lambda wildcards: taken_by(wildcards.study).gather_resources["mem_mb"],
        runtime=lambda wildcards: taken_by(wildcards.study).gather_resources["runtime"],
    params:
        job=job(gather_settings),
    message:
        "Gather {wildcards.study} into {output}"
    script:
        "../scripts/gather.py"
