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
    "damper.verification.stress.compliant_checks",
    "damper.verification.stress.grounded_checks",
]


def _compiled_checks(wildcards):
    """Marks that the checks of all models that a study runs are compiled."""
    models = STRESSES[wildcards.study].models
    return [f"{RESULTS}/compiled_checks/{model}.txt" for model in models]


def _groups(wildcards):
    """Lists of runs, with the files of their parts."""
    study = STRESSES[wildcards.study]
    return {
        origin: [f"{RESULTS}/{study.name}/parts/{part}.npz" for part in parts]
        for origin, parts in study.groups().items()
    }


# Without params, like the rule compile and for the same reason.
rule compile_checks:
    input:
        ancient(f"{RESULTS}/compiled/{{model}}/engine.txt"),
    output:
        f"{RESULTS}/compiled_checks/{{model}}.txt",
    log:
        "logs/compile/checks/{model}.log",
    benchmark:
        "logs/benchmarks/compile/checks/{model}.tsv"
    wildcard_constraints:
        model=one_of(("rigid", *MODEL_NAMES)),
    message:
        "Compile the checks of the {wildcards.model} model"
    script:
        "../scripts/compile_checks.py"


rule checks:
    input:
        ancient(_compiled_checks),
    output:
        f"{RESULTS}/{{study}}/parts/{{part}}.npz",
    log:
        "logs/{study}/checks/{part}.log",
    benchmark:
        "logs/benchmarks/{study}/checks/{part}.tsv"
    wildcard_constraints:
        study=one_of(STRESSES),
        part=one_of({part for _, part in PARTS}),
    params:
        run=lambda wildcards: PARTS[wildcards.study, wildcards.part],
        accuracy=lambda wildcards: STRESSES[wildcards.study].accuracy,
        max_events=lambda wildcards: STRESSES[wildcards.study].max_events,
        code=code_digest(SCRIPTS / "checks.py", CHECK_MODULES),
    message:
        "Check {wildcards.study}: {wildcards.part}"
    script:
        "../scripts/checks.py"


rule metamorphic:
    input:
        ancient(_compiled_checks),
    output:
        f"{RESULTS}/{{study}}/metamorphic/{{part}}.npz",
    log:
        "logs/{study}/metamorphic/{part}.log",
    benchmark:
        "logs/benchmarks/{study}/metamorphic/{part}.tsv"
    wildcard_constraints:
        study=one_of(STRESSES),
        part=one_of({part for _, part in METAMORPHIC}),
    params:
        run=lambda wildcards: METAMORPHIC[wildcards.study, wildcards.part],
        code=code_digest(SCRIPTS / "metamorphic.py", CHECK_MODULES),
    message:
        "Run points of {wildcards.study} in other ways: {wildcards.part}"
    script:
        "../scripts/metamorphic.py"


rule stress:
    input:
        parts=lambda wildcards: [path for paths in _groups(wildcards).values() for path in paths],
        metamorphic=lambda wildcards: [
            f"{RESULTS}/{wildcards.study}/metamorphic/{part}.npz"
            for part in STRESSES[wildcards.study].metamorphic()
        ],
    output:
        cube=f"{RESULTS}/{{study}}/cube.nc",
        metamorphic=f"{RESULTS}/{{study}}/metamorphic.nc",
    log:
        "logs/{study}/stress.log",
    benchmark:
        "logs/benchmarks/{study}/stress.tsv"
    wildcard_constraints:
        study=one_of(STRESSES),
    params:
        groups=_groups,
        about=lambda wildcards: STRESSES[wildcards.study].attributes(),
        code=code_digest(SCRIPTS / "stress.py", CHECK_MODULES),
    message:
        "Gather {wildcards.study}"
    script:
        "../scripts/stress.py"
