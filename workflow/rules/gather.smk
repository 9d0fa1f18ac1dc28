"""Cubes: the slices of a study gathered into one netCDF file."""


def _about(wildcards):
    """Global attributes that describe the study; figures and tables do not change a cube."""
    study = STUDIES[wildcards.study]
    measured = study.model_copy(update={"figures": {}, "tables": {}})
    return {"title": study.title, "source": study.source, "study": measured.to_yaml()}


def _notes(wildcards):
    study = STUDIES[wildcards.study]
    return {"assumed": study.assumed, "stated": study.stated}


rule gather:
    input:
        slices_of,
    output:
        f"{RESULTS}/{{study}}/cube.nc",
    log:
        "logs/{study}/gather.log",
    benchmark:
        "logs/benchmarks/{study}/gather.tsv"
    priority: of_papers
    params:
        about=_about,
        notes=_notes,
        axes=lambda wildcards: STUDIES[wildcards.study].axis_values,
        fan_axes=lambda wildcards: STUDIES[wildcards.study].fan_axes,
        fixed=lambda wildcards: STUDIES[wildcards.study].fixed,
        observers=lambda wildcards: STUDIES[wildcards.study].observer_settings(),
        primary=lambda wildcards: STUDIES[wildcards.study].initial.primary,
        run=run_settings,
        code=lambda wildcards: code_digest(
            SCRIPTS / "gather.py", simulation_modules(STUDIES[wildcards.study])
        ),
    message:
        "Gather {wildcards.study} into {output}"
    script:
        "../scripts/gather.py"
