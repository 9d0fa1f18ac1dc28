"""The engine on corners, edges and random places of the box of parameters."""

STRESSES = {name: study for name, study in VERIFICATIONS.items() if study.kind == "stress"}
# (study, part) -> what is run in it
PARTS = {(s.name, part): run for s in STRESSES.values() for part, run in s.parts().items()}
METAMORPHIC = {
    (s.name, part): run for s in STRESSES.values() for part, run in s.metamorphic().items()
}
# What the checks load by name.
CHECK_MODULES = [
    *EVERY_MODEL,
    *(f"{model}.response" for model in EVERY_MODEL),
    *(f"damper.verification.stress.{model.rpartition('.')[2]}_checks" for model in EVERY_MODEL),
]


def _compiled_checks(wildcards):
    return compiled(STRESSES[wildcards.study].models, [CHECKS])


@once
def checks_settings(study, part):
    return {
        "run": PARTS[study, part],
        "accuracy": STRESSES[study].accuracy,
        "max_events": STRESSES[study].max_events,
        "code": digest("checks.py", *CHECK_MODULES),
    }


rule checks:
    input:
        ancient(_compiled_checks),
        changed(checks_settings, f"{RESULTS}/{{study}}/parts/{{part}}.npz"),
    output:
        f"{RESULTS}/{{study}}/parts/{{part}}.npz",
    log:
        f"{LOGS}/{{study}}/checks/{{part}}.log",
    benchmark:
        f"{TIMES}/{{study}}/checks/{{part}}.tsv"
    wildcard_constraints:
        study=one_of(STRESSES),
        part=one_of({part for _, part in PARTS}),
    params:
        job=job(checks_settings),
    message:
        "Check {wildcards.study}: {wildcards.part}"
    script:
        "../scripts/checks.py"


@once
def metamorphic_settings(study, part):
    return {
        "run": METAMORPHIC[study, part],
        "code": digest("metamorphic.py", *CHECK_MODULES),
    }


rule metamorphic:
    input:
        ancient(_compiled_checks),
        changed(metamorphic_settings, f"{RESULTS}/{{study}}/metamorphic/{{part}}.npz"),
    output:
        f"{RESULTS}/{{study}}/metamorphic/{{part}}.npz",
    log:
        f"{LOGS}/{{study}}/metamorphic/{{part}}.log",
    benchmark:
        f"{TIMES}/{{study}}/metamorphic/{{part}}.tsv"
    wildcard_constraints:
        study=one_of(STRESSES),
        part=one_of({part for _, part in METAMORPHIC}),
    params:
        job=job(metamorphic_settings),
    message:
        "Run points of {wildcards.study} in other ways: {wildcards.part}"
    script:
        "../scripts/metamorphic.py"


@once
def stress_settings(study):
    groups, metamorphic = STRESSES[study].groups(), STRESSES[study].metamorphic()
    return {
        "groups": groups,
        "about": STRESSES[study].attributes(),
        "code": digest("stress.py", *CHECK_MODULES),
        "parts": [
            fingerprint(checks_settings(study, part)) for parts in groups.values() for part in parts
        ],
        "metamorphic": [fingerprint(metamorphic_settings(study, part)) for part in metamorphic],
    }


SETTINGS["stress", "cube.nc"] = SETTINGS["stress", "metamorphic.nc"] = stress_settings


rule stress:
    input:
        parts=lambda wildcards: [
            f"{RESULTS}/{wildcards.study}/parts/{part}.npz"
            for parts in STRESSES[wildcards.study].groups().values()
            for part in parts
        ],
        metamorphic=lambda wildcards: [
            f"{RESULTS}/{wildcards.study}/metamorphic/{part}.npz"
            for part in STRESSES[wildcards.study].metamorphic()
        ],
        newer=changed(
            stress_settings,
            f"{RESULTS}/{{study}}/cube.nc",
            f"{RESULTS}/{{study}}/metamorphic.nc",
        ),
    output:
        cube=f"{RESULTS}/{{study}}/cube.nc",
        metamorphic=f"{RESULTS}/{{study}}/metamorphic.nc",
    log:
        f"{LOGS}/{{study}}/stress.log",
    benchmark:
        f"{TIMES}/{{study}}/stress.tsv"
    wildcard_constraints:
        study=one_of(STRESSES),
    params:
        job=job(stress_settings),
    message:
        "Gather {wildcards.study}"
    script:
        "../scripts/stress.py"
