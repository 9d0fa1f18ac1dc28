"""Compiled code, made once, so that parallel jobs find it in the cache."""

from damper.observers import OBSERVERS, observer_class

CHECKS, SOLVERS = "checks", "solvers"


def compiled(models, parts):
    """Return the marks that these parts are compiled for these models."""
    return [f"{RESULTS}/compiled/{model}/{part}.txt" for model in models for part in parts]


def compiled_for(study):
    """Return the marks that the code a study needs is compiled.

    Points of any model that do not ask for it, such as those without modulation, are rigid.
    """
    return compiled(sorted({"rigid", study.model}), ["engine", *sorted(study.observers)])


def compiled_before(wildcards):
    """Return the marks of what the code of a part builds on: the engine, and other observers."""
    part, built_on = wildcards.part, ["engine"]
    if part == "engine":
        return []
    if part in OBSERVERS:
        bases = [base.__module__.rpartition(".")[2] for base in observer_class(part).__mro__[1:]]
        built_on += sorted(set(bases).intersection(OBSERVERS))
    return compiled([wildcards.model], built_on)


# No settings, on purpose: Snakemake 9 checks no further reason to run a job whose (even ancient)
# input is about to be made again, so a compile job that reran after an edit would hide, for that
# run, that the simulations must rerun too. After an edit the simulation jobs compile for themselves.
#
# One job for the event loop of a model and one for each part that is built on it, so that no two
# jobs compile the same code.
rule compile:
    input:
        ancient(compiled_before),
    output:
        f"{RESULTS}/compiled/{{model}}/{{part}}.txt",
    log:
        f"{LOGS}/compile/{{model}}/{{part}}.log",
    benchmark:
        f"{TIMES}/compile/{{model}}/{{part}}.tsv"
    wildcard_constraints:
        model=one_of(("rigid", *MODEL_NAMES)),
        part=rf"{one_of((*OBSERVERS, 'engine', CHECKS))}|{SOLVERS}\+[a-z0-9_+]+",
    priority: lambda wildcards: int(wildcards.model == "rigid")
    message:
        "Compile {wildcards.part} of the {wildcards.model} model"
    script:
        "../scripts/compile.py"
