"""Slices of studies: one job simulates all points of one place along the fanned axes."""

from damper.study.estimate import estimate

# (study, part of the file name) -> coordinates of the slice
PLACES = {
    (study.name, study.slice_path(place)): place
    for study in STUDIES.values()
    for place in study.slices()
}


@once
def taken_by(study):
    """Return what the jobs of a study take."""
    return estimate(STUDIES[study])


@once
def simulate_settings(study, place):
    place, study = PLACES[study, place], STUDIES[study]
    return {
        "fixed": study.fixed | place,
        "axes": {name: study.axis_values[name] for name in study.inner_axes},
        "run": study.run | ENGINE,
        "observers": study.observer_settings(),
        "primary": study.initial,
        "draws": study.draw_settings(),
        "follow": study.follow,
        "code": digest("simulate.py", *simulation_modules(study)),
    }


rule simulate:
    input:
        ancient(lambda wildcards: compiled_for(STUDIES[wildcards.study])),
        changed(simulate_settings, f"{RESULTS}/{{study}}/slices/{{place}}.npz"),
    output:
        f"{RESULTS}/{{study}}/slices/{{place}}.npz",
    log:
        f"{LOGS}/{{study}}/simulate/{{place}}.log",
    benchmark:
        f"{TIMES}/{{study}}/simulate/{{place}}.tsv"
    wildcard_constraints:
        study=one_of(STUDIES),
        place=one_of({place for _, place in PLACES}),
    priority: of_papers(2)
    resources:
        mem_mb=lambda wildcards: taken_by(wildcards.study).simulate_resources["mem_mb"],
        runtime=lambda wildcards: taken_by(wildcards.study).simulate_resources["runtime"],
    params:
        job=job(simulate_settings),
    message:
        "Simulate {wildcards.study}: {wildcards.place}"
    script:
        "../scripts/simulate.py"
