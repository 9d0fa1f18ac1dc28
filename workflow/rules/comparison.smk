"""Solvers compared on scenes: references, errors, and run times in files of their own."""

from damper.verification.comparison.solvers import module_of

COMPARISONS = {name: study for name, study in VERIFICATIONS.items() if study.kind == "comparison"}
SCENES = {scene for study in COMPARISONS.values() for scene in study.scenes}


def _scene(wildcards):
    scene = COMPARISONS[wildcards.study].scenes[wildcards.scene]
    return {"values": scene.values, "until": scene.until}


def _scenes(wildcards):
    study = COMPARISONS[wildcards.study]
    return {
        name: {"values": scene.values, "until": scene.until} for name, scene in study.scenes.items()
    }


def _solvers(wildcards):
    return dict(COMPARISONS[wildcards.study].solvers)


def _solver_modules(wildcards):
    names = COMPARISONS[wildcards.study].solvers
    return [
        *sorted({module_of(name) for name in names}),
        "damper.models.rigid",
        "damper.models.compliant",
    ]


def _compiled_solvers(wildcards):
    """The mark that the solvers of a study are compiled, named by models and solvers."""
    study = COMPARISONS[wildcards.study]
    models, names = "+".join(study.models), "+".join(sorted(study.solvers))
    return f"{RESULTS}/compiled_solvers/{models}/{names}.txt"


def _engines(wildcards):
    """Marks that the engine of each model is compiled."""
    return [f"{RESULTS}/compiled/{model}/engine.txt" for model in wildcards.models.split("+")]


def _titles(wildcards):
    return {name: scene.title for name, scene in COMPARISONS[wildcards.study].scenes.items()}


def _about_comparison(wildcards):
    return COMPARISONS[wildcards.study].attributes()


rule reference:
    output:
        f"{RESULTS}/{{study}}/reference/{{scene}}.json",
    log:
        "logs/{study}/reference/{scene}.log",
    benchmark:
        "logs/benchmarks/{study}/reference/{scene}.tsv"
    wildcard_constraints:
        study=one_of(COMPARISONS),
        scene=one_of(SCENES),
    params:
        scene=_scene,
        digits=lambda wildcards: COMPARISONS[wildcards.study].digits,
        code=code_digest(SCRIPTS / "reference.py"),
    message:
        "Work out the scene {wildcards.scene} to {params.digits} digits"
    script:
        "../scripts/reference.py"


# Without params, like the rule compile and for the same reason.
rule compile_solvers:
    input:
        ancient(_engines),
    output:
        f"{RESULTS}/compiled_solvers/{{models}}/{{solvers}}.txt",
    log:
        "logs/compile/solvers/{models}/{solvers}.log",
    benchmark:
        "logs/benchmarks/compile/solvers/{models}/{solvers}.tsv"
    wildcard_constraints:
        models=r"[a-z_+]+",
    message:
        "Compile the solvers once, so that parallel jobs find them in the cache"
    script:
        "../scripts/compile_solvers.py"


rule errors:
    input:
        f"{RESULTS}/{{study}}/reference/{{scene}}.json",
        ancient(_compiled_solvers),
    output:
        f"{RESULTS}/{{study}}/errors/{{scene}}.npz",
    log:
        "logs/{study}/errors/{scene}.log",
    benchmark:
        "logs/benchmarks/{study}/errors/{scene}.tsv"
    wildcard_constraints:
        study=one_of(COMPARISONS),
        scene=one_of(SCENES),
    params:
        scene=_scene,
        solvers=_solvers,
        cap=lambda wildcards: COMPARISONS[wildcards.study].cap,
        code=lambda wildcards: code_digest(SCRIPTS / "errors.py", _solver_modules(wildcards)),
    message:
        "Run all solvers on the scene {wildcards.scene}"
    script:
        "../scripts/errors.py"


rule comparison:
    input:
        lambda wildcards: [
            f"{RESULTS}/{wildcards.study}/errors/{scene}.npz"
            for scene in COMPARISONS[wildcards.study].scenes
        ],
    output:
        f"{RESULTS}/{{study}}/cube.nc",
    log:
        "logs/{study}/comparison.log",
    benchmark:
        "logs/benchmarks/{study}/comparison.tsv"
    wildcard_constraints:
        study=one_of(COMPARISONS),
    params:
        titles=_titles,
        solvers=_solvers,
        about=_about_comparison,
        code=lambda wildcards: code_digest(SCRIPTS / "comparison.py", _solver_modules(wildcards)),
    message:
        "Gather the errors of {wildcards.study}"
    script:
        "../scripts/comparison.py"


# It takes all cores, so that nothing else runs beside it. It knows nothing of errors and figures:
# those do not make it run again.
rule timings:
    input:
        ancient(_compiled_solvers),
    output:
        f"{RESULTS}/{{study}}/timed/timings.nc",
    log:
        "logs/{study}/timings.log",
    benchmark:
        "logs/benchmarks/{study}/timings.tsv"
    wildcard_constraints:
        study=one_of(COMPARISONS),
    threads: ALL_CORES
    params:
        scenes=_scenes,
        titles=_titles,
        solvers=_solvers,
        about=_about_comparison,
        cap=lambda wildcards: COMPARISONS[wildcards.study].cap,
        repeats=lambda wildcards: COMPARISONS[wildcards.study].repeats,
        spend=lambda wildcards: COMPARISONS[wildcards.study].spend,
        code=lambda wildcards: code_digest(SCRIPTS / "timings.py", _solver_modules(wildcards)),
    message:
        "Time all solvers, alone on this machine"
    script:
        "../scripts/timings.py"
