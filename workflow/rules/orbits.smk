"""Periodic motions of studies that ask for them, followed along an axis."""

ORBITS = {name: study for name, study in STUDIES.items() if study.orbits}


@once
def orbits_settings(study):
    study = STUDIES[study]
    return {
        "about": {"title": study.title, "source": study.source},
        "orbits": {
            name: {"settle": study.transient, **entry.model_dump()}
            for name, entry in study.orbits.items()
        },
        "fixed": study.fixed,
        "axes": study.axis_values,
        "at": study.observer_settings().get("stroboscopic_section", {}).get("at", 0.0),
        "code": digest("orbits.py", *simulation_modules(study)),
    }


SETTINGS["parameters", "orbits.nc"] = orbits_settings


rule orbits:
    input:
        ancient(lambda wildcards: compiled_for(STUDIES[wildcards.study])),
        changed(orbits_settings, f"{RESULTS}/{{study}}/orbits.nc"),
    output:
        f"{RESULTS}/{{study}}/orbits.nc",
    log:
        f"{LOGS}/{{study}}/orbits.log",
    benchmark:
        f"{TIMES}/{{study}}/orbits.tsv"
    wildcard_constraints:
        study=one_of(ORBITS),
    params:
        job=job(orbits_settings),
    message:
        "Follow periodic motions of {wildcards.study}"
    script:
        "../scripts/orbits.py"
