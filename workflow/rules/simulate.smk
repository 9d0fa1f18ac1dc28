"""Slices of studies: one job simulates all points of one place along the fanned axes."""

from damper.observers import OBSERVERS, observer_class

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


def compiled_for(wildcards):
    """Return the marks that the code a study needs is compiled.

    Points of any model that do not ask for it, such as those without modulation, are rigid.
    """
    study = STUDIES[wildcards.study]
    return [
        f"{RESULTS}/compiled/{model}/{part}.txt"
        for model in sorted({"rigid", study.model})
        for part in ("engine", *sorted(study.observers))
    ]


def compiled_before(wildcards):
    """Return the marks of what the code of a part builds on: the engine, and other observers."""
    if wildcards.part == "engine":
        return []
    bases = observer_class(wildcards.part).__mro__[1:]
    built_on = {base.__module__.rpartition(".")[2] for base in bases}.intersection(OBSERVERS)
    folder = f"{RESULTS}/compiled/{wildcards.model}"
    return [f"{folder}/{part}.txt" for part in ("engine", *sorted(built_on))]


# No params, on purpose: Snakemake 9 checks no further reason to run a job whose (even ancient) input
# is about to be made again, so a compile job that reran after an edit would hide, for that run, that
# the simulations must rerun too. After an edit the simulation jobs compile for themselves.
#
# One job for the event loop of a model and one for each observer of it, after what its code builds
# on, so that no two jobs compile the same code.
rule compile:
    input:
        ancient(compiled_before),
    output:
        f"{RESULTS}/compiled/{{model}}/{{part}}.txt",
    log:
        "logs/compile/{model}/{part}.log",
    benchmark:
        "logs/benchmarks/compile/{model}/{part}.tsv"
    wildcard_constraints:
        model=one_of(("rigid", *MODEL_NAMES)),
        part=r"\w+",
    priority: lambda wildcards: int(wildcards.model == "rigid")
    message:
        "Compile {wildcards.part} of the {wildcards.model} model"
    script:
        "../scripts/compile.py"


rule simulate:
    input:
        ancient(compiled_for),
    output:
        f"{RESULTS}/{{study}}/slices/{{place}}.npz",
    log:
        "logs/{study}/simulate/{place}.log",
    benchmark:
        "logs/benchmarks/{study}/simulate/{place}.tsv"
    wildcard_constraints:
        place=one_of({place for _, place in PLACES}),
    priority: of_papers
    params:
        fixed=lambda wildcards: STUDIES[wildcards.study].fixed | _place(wildcards),
        axes=_inner_axes,
        run=run_settings,
        observers=lambda wildcards: STUDIES[wildcards.study].observer_settings(),
        initial=lambda wildcards: STUDIES[wildcards.study].initial.settings(),
        follow=lambda wildcards: STUDIES[wildcards.study].follow,
        code=lambda wildcards: code_digest(
            SCRIPTS / "simulate.py", simulation_modules(STUDIES[wildcards.study])
        ),
    message:
        "Simulate {wildcards.study}: {wildcards.place}"
    script:
        "../scripts/simulate.py"
