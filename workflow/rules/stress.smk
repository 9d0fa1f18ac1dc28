"""The engine on corners, edges and random places of the box of parameters."""

STRESSES = {name: study for name, study in VERIFICATIONS.items() if study.kind == "stress"}
# (study, part) -> what is run in it
PARTS = {(s.name, part): run for s in STRESSES.values() for part, run in s.parts().items()}
TWINS = {(s.name, part): run for s in STRESSES.values() for part, run in s.twins().items()}


def _groups(wildcards):
    """Lists of lanes, with the files of their parts."""
    study = STRESSES[wildcards.study]
    return {
        origin: [f"{RESULTS}/{study.name}/parts/{part}.npz" for part in parts]
        for origin, parts in study.groups().items()
    }


# Without params, like the rule compile and for the same reason.
rule compile_checks:
    output:
        f"{RESULTS}/compiled_checks.txt",
    log:
        "logs/compile/checks.log",
    benchmark:
        "logs/benchmarks/compile/checks.tsv"
    message:
        "Compile the checks once, so that parallel jobs find them in the cache"
    script:
        "../scripts/compile_checks.py"


rule checks:
    input:
        ancient(f"{RESULTS}/compiled_checks.txt"),
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
        code=code_digest(SCRIPTS / "checks.py", EVERY_MODEL),
    message:
        "Check {wildcards.study}: {wildcards.part}"
    script:
        "../scripts/checks.py"


rule twins:
    input:
        ancient(f"{RESULTS}/compiled_checks.txt"),
    output:
        f"{RESULTS}/{{study}}/twins/{{part}}.npz",
    log:
        "logs/{study}/twins/{part}.log",
    benchmark:
        "logs/benchmarks/{study}/twins/{part}.tsv"
    wildcard_constraints:
        study=one_of(STRESSES),
        part=one_of({part for _, part in TWINS}),
    params:
        run=lambda wildcards: TWINS[wildcards.study, wildcards.part],
        code=code_digest(SCRIPTS / "twins.py", EVERY_MODEL),
    message:
        "Run lanes of {wildcards.study} in other ways: {wildcards.part}"
    script:
        "../scripts/twins.py"


rule stress:
    input:
        parts=lambda wildcards: [path for paths in _groups(wildcards).values() for path in paths],
        twins=lambda wildcards: [
            f"{RESULTS}/{wildcards.study}/twins/{part}.npz"
            for part in STRESSES[wildcards.study].twins()
        ],
    output:
        cube=f"{RESULTS}/{{study}}/cube.nc",
        twins=f"{RESULTS}/{{study}}/twins.nc",
    log:
        "logs/{study}/stress.log",
    benchmark:
        "logs/benchmarks/{study}/stress.tsv"
    wildcard_constraints:
        study=one_of(STRESSES),
    params:
        groups=_groups,
        about=lambda wildcards: STRESSES[wildcards.study].attributes(),
        code=code_digest(SCRIPTS / "stress.py", EVERY_MODEL),
    message:
        "Gather {wildcards.study}"
    script:
        "../scripts/stress.py"
