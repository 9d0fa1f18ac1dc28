"""Solvers compared on scenes: references, errors, and run times in files of their own."""

from damper.verification.comparison.solvers import module_of

COMPARISONS = {name: study for name, study in VERIFICATIONS.items() if study.kind == "comparison"}
SCENES = {scene for study in COMPARISONS.values() for scene in study.scenes}


def _scene(study, scene):
    scene = COMPARISONS[study].scenes[scene]
    return {"values": scene.values, "until": scene.until}


def _code(script, study):
    """Digest of a script with the solvers of a study."""
    solvers = sorted({module_of(name) for name in COMPARISONS[study].solvers})
    return digest(script, *solvers, "damper.models.rigid", "damper.models.compliant")


def _compiled_solvers(wildcards):
    study = COMPARISONS[wildcards.study]
    return compiled(study.models, [SOLVERS, *sorted(study.solvers)])


@once
def reference_settings(study, scene):
    return {
        "scene": _scene(study, scene),
        "digits": COMPARISONS[study].digits,
        "code": digest("reference.py"),
    }


rule reference:
    input:
        changed(reference_settings, f"{RESULTS}/{{study}}/reference/{{scene}}.json"),
    output:
        f"{RESULTS}/{{study}}/reference/{{scene}}.json",
    log:
        f"{LOGS}/{{study}}/reference/{{scene}}.log",
    benchmark:
        f"{TIMES}/{{study}}/reference/{{scene}}.tsv"
    wildcard_constraints:
        study=one_of(COMPARISONS),
        scene=one_of(SCENES),
    params:
        job=job(reference_settings),
    message:
        "Work out the scene {wildcards.scene} to {params.job[digits]} digits"
    script:
        "../scripts/reference.py"


@once
def errors_settings(study, scene):
    return {
        "scene": _scene(study, scene),
        "solvers": COMPARISONS[study].solvers,
        "cap": COMPARISONS[study].cap,
        "code": _code("errors.py", study),
        "reference": fingerprint(reference_settings(study, scene)),
    }


rule errors:
    input:
        ancient(_compiled_solvers),
        reference=f"{RESULTS}/{{study}}/reference/{{scene}}.json",
        newer=changed(errors_settings, f"{RESULTS}/{{study}}/errors/{{scene}}.npz"),
    output:
        f"{RESULTS}/{{study}}/errors/{{scene}}.npz",
    log:
        f"{LOGS}/{{study}}/errors/{{scene}}.log",
    benchmark:
        f"{TIMES}/{{study}}/errors/{{scene}}.tsv"
    wildcard_constraints:
        study=one_of(COMPARISONS),
        scene=one_of(SCENES),
    params:
        job=job(errors_settings),
    message:
        "Run all solvers on the scene {wildcards.scene}"
    script:
        "../scripts/errors.py"


@once
def comparison_settings(study):
    scenes = COMPARISONS[study].scenes
    return {
        "titles": {name: scene.title for name, scene in scenes.items()},
        "solvers": COMPARISONS[study].solvers,
        "about": COMPARISONS[study].attributes(),
        "code": _code("comparison.py", study),
        "errors": [fingerprint(errors_settings(study, scene)) for scene in scenes],
    }


SETTINGS["comparison", "cube.nc"] = comparison_settings


rule comparison:
    input:
        errors=lambda wildcards: [
            f"{RESULTS}/{wildcards.study}/errors/{scene}.npz"
            for scene in COMPARISONS[wildcards.study].scenes
        ],
        newer=changed(comparison_settings, f"{RESULTS}/{{study}}/cube.nc"),
    output:
        f"{RESULTS}/{{study}}/cube.nc",
    log:
        f"{LOGS}/{{study}}/comparison.log",
    benchmark:
        f"{TIMES}/{{study}}/comparison.tsv"
    wildcard_constraints:
        study=one_of(COMPARISONS),
    params:
        job=job(comparison_settings),
    message:
        "Gather the errors of {wildcards.study}"
    script:
        "../scripts/comparison.py"


@once
def timings_settings(study):
    asked = COMPARISONS[study]
    return {
        "scenes": {name: _scene(study, name) for name in asked.scenes},
        "titles": {name: scene.title for name, scene in asked.scenes.items()},
        "solvers": asked.solvers,
        "about": asked.attributes(),
        "cap": asked.cap,
        "repeats": asked.repeats,
        "spend": asked.spend,
        "code": _code("timings.py", study),
    }


SETTINGS["comparison", "timed/timings.nc"] = timings_settings


# It takes all cores, so that nothing else runs beside it. It knows nothing of errors and figures:
# those do not make it run again.
rule timings:
    input:
        ancient(_compiled_solvers),
        changed(timings_settings, f"{RESULTS}/{{study}}/timed/timings.nc"),
    output:
        f"{RESULTS}/{{study}}/timed/timings.nc",
    log:
        f"{LOGS}/{{study}}/timings.log",
    benchmark:
        f"{TIMES}/{{study}}/timings.tsv"
    wildcard_constraints:
        study=one_of(COMPARISONS),
    threads: ALL_CORES
    params:
        job=job(timings_settings),
    message:
        "Time all solvers, alone on this machine"
    script:
        "../scripts/timings.py"
