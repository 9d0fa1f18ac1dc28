"""Cubes: the slices of a study gathered into one netCDF file."""


def _about(wildcards):
    """Global attributes that describe the study; figures and tables do not change a cube."""
    study = STUDIES[wildcards.study]
    measured = study.model_copy(update={"figures": {}, "tables": {}})
    return {"title": study.title, "source": study.source, "study": measured.to_yaml()}


def _notes(wildcards):
    study = STUDIES[wildcards.study]
    return {"assumed": study.assumed, "stated": study.stated}


def _run(wildcards):
    """How the points were run, for those who run more of them."""
    study = STUDIES[wildcards.study]
    return {
        "transient": study.transient,
        "periods": study.periods,
        "observers": study.observer_settings(),
        "primary": study.initial.primary,
        **ENGINE,
    }


rule gather:
    input:
        slices_of,
    output:
        f"{RESULTS}/{{study}}/cube.nc",
    log:
        "logs/{study}/gather.log",
    benchmark:
        "logs/benchmarks/{study}/gather.tsv"
    params:
        about=_about,
        notes=_notes,
        axes=lambda wildcards: STUDIES[wildcards.study].axis_values,
        fan_axes=lambda wildcards: STUDIES[wildcards.study].fan_axes,
        fixed=lambda wildcards: STUDIES[wildcards.study].fixed,
        run=_run,
        code=lambda wildcards: code_digest(
            SCRIPTS / "gather.py", simulation_modules(STUDIES[wildcards.study])
        ),
    message:
        "Gather {wildcards.study} into {output}"
    script:
        "../scripts/gather.py"
