"""Compiled code, made once, so that parallel jobs find it in the cache."""

from damper.study.estimate import PLAIN_SECONDS, estimate
from damper.study.parts import engine_parts


def compiled(models, parts):
    """Return the marks that these parts are compiled for these models."""
    return [f"{RESULTS}/compiled/{model}/{'+'.join(parts)}.txt" for model in models]


@functools.cache
def models_of(name):
    """Return the models of a study's points: those at its corners."""
    return sorted({point.main_feature for point in STUDIES[name].corners})


@functools.cache
def parts_of(name):
    """Return the event loops of a study: one for each sort of force."""
    return engine_parts(STUDIES[name])


@functools.cache
def taken_by(name):
    """Return what the jobs of a study take."""
    return estimate(STUDIES[name])


# Studies of the default run that simulate.
SIMULATED = [study for study in STUDIES.values() if study.name in DEFAULT]


def engine_of(model, studies, part="engine"):
    """Return the mark of a model's event loop with all observers that studies ask for.

    Of the studies, those count that need this part: they are under one sort of force.

    One process compiles what these share only once. A few short runs are done sooner without.
    """
    if not workflow.is_main_process:  # which has waited for it
        return []
    using = [s for s in studies if model in models_of(s.name) and part in parts_of(s.name)]
    more = any(study.orbits for study in using)
    if not more and sum(taken_by(study.name).run_seconds for study in using) < PLAIN_SECONDS:
        return []
    names = set().union(*(study.observers for study in using))
    return compiled([model], [part, *sorted(names)])


def compiled_for(study):
    """Return the marks that the code of a study is compiled, with that of all the default run."""
    together = SIMULATED if study.name in DEFAULT else [study]
    return [
        mark
        for model in models_of(study.name)
        for part in parts_of(study.name)
        for mark in engine_of(model, together, part)
    ]


def compiled_first(wildcards):
    """Return the marks of what checks and solvers build on."""
    model, parts = wildcards.model, wildcards.parts
    return [] if parts.startswith("engine") else engine_of(model, SIMULATED)


# No settings, on purpose: Snakemake 9 checks no further reason to run a job whose (even ancient)
# input is about to be made again, so a compile job that reran after an edit would hide, for that
# run, that the simulations must rerun too. After an edit the simulation jobs compile for themselves.
rule compile:
    input:
        ancient(compiled_first),
    output:
        f"{RESULTS}/compiled/{{model}}/{{parts}}.txt",
    log:
        f"{LOGS}/compile/{{model}}/{{parts}}.log",
    benchmark:
        f"{TIMES}/compile/{{model}}/{{parts}}.tsv"
    wildcard_constraints:
        model=one_of(("rigid", "structure", *MODEL_NAMES)),
        parts=r"[a-z0-9_+]+",
    # The verdicts wait for the first one; others take long: last of all, they would leave cores idle.
    priority: lambda wildcards: 4 if f"{wildcards.model}/{wildcards.parts}+".startswith("rigid/engine+") else 1
    message:
        "Compile for the {wildcards.model} model: {wildcards.parts}"
    script:
        "../scripts/compile.py"
