"""Periodic motions of studies that ask for them, followed along an axis."""

ORBITS = {name: study for name, study in STUDIES.items() if study.orbits}


def orbits_settings(study):
    study = STUDIES[study]
    return {
        "about": {"title": study.title, "source": study.source},
        "orbits": {
            name: {"settle": math.ceil(study.most_cycles[0]), **entry.model_dump()}
            for name, entry in study.orbits.items()
        },
        "fixed": study.fixed,
        "axes": study.axis_values,
        "forcing": study.forcing_settings.get("forcing"),
        **study.beside,
        "when": study.observer_settings().get("stroboscopic_section", {}).get("when", 0.0),
        "code": digest("orbits.py", *simulation_modules(study)),
    }


MADE |= {f"{RESULTS}/{name}/orbits.nc": partial(orbits_settings, name) for name in ORBITS}


def _compiled_with_tangents(wildcards):
    """Return the marks of the event loop, and of what follows its derivatives."""
    marks = compiled_for(STUDIES[wildcards.study])
    alike = models_of(wildcards.study) == ["rigid"] and parts_of(wildcards.study) == ("engine",)
    return [*marks, *(compiled(["rigid"], ["orbits"]) if alike else [])]


rule orbits:
    input:
        ancient(_compiled_with_tangents),
        rerun_if_changed(f"{RESULTS}/{{study}}/orbits.nc"),
    output:
        f"{RESULTS}/{{study}}/orbits.nc",
    log:
        f"{LOGS}/{{study}}/orbits.log",
    benchmark:
        f"{TIMES}/{{study}}/orbits.tsv"
    wildcard_constraints:
        study=one_of(ORBITS),
    params:
        job=job,
    message:
        "Follow periodic motions of {wildcards.study}"
    script:
        "../scripts/orbits.py"
