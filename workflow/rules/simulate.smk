"""Slices of studies: one job simulates all lanes of one place along the fanned axes."""

# (study, part of the file name) -> coordinates of the slice
PLACES = {
    (study.name, study.slice_path(place)): place
    for study in STUDIES.values()
    for place in study.slices()
}


def _place(wildcards):
    return PLACES[wildcards.study, wildcards.place]


def _inner_axes(wildcards):
    study = STUDIES[wildcards.study]
    return {name: study.axis_values[name] for name in study.inner_axes}


rule compile:
    output:
        f"{RESULTS}/compiled.txt",
    log:
        "logs/compile.log",
    benchmark:
        "logs/benchmarks/compile.tsv"
    params:
        observers=lambda wildcards: sorted(
            {name for study in STUDIES.values() for name in study.observers}
        ),
        code=code_digest(SCRIPTS / "compile.py", observer_modules(STUDIES.values())),
    message:
        "Compile the engine once, so that parallel jobs find it in the cache"
    script:
        "../scripts/compile.py"


rule simulate:
    input:
        ancient(rules.compile.output),
    output:
        f"{RESULTS}/{{study}}/slices/{{place}}.npz",
    log:
        "logs/{study}/simulate/{place}.log",
    benchmark:
        "logs/benchmarks/{study}/simulate/{place}.tsv"
    wildcard_constraints:
        place=".+",
    params:
        fixed=lambda wildcards: STUDIES[wildcards.study].fixed | _place(wildcards),
        axes=_inner_axes,
        transient=lambda wildcards: STUDIES[wildcards.study].transient,
        periods=lambda wildcards: STUDIES[wildcards.study].periods,
        observers=lambda wildcards: observers_of(STUDIES[wildcards.study]),
        engine=ENGINE,
        code=lambda wildcards: code_digest(
            SCRIPTS / "simulate.py", observer_modules([STUDIES[wildcards.study]])
        ),
    message:
        "Simulate {wildcards.study}: {wildcards.place}"
    script:
        "../scripts/simulate.py"
