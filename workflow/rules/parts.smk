"""What a study of any kind runs: its parts, the files gathered from them, and its times.

The kind of study says what its jobs do (`damper.study.jobs`); here they become jobs of Snakemake.
"""


def jobs_of(ask):
    """Return the jobs that `ask` names of each study, each as a function that returns it."""
    found = {name: ask(study) for name, study in CONFIG.studies.items()}
    return {
        (n, name): partial(jobs.__getitem__, name) for n, jobs in found.items() for name in jobs
    }


PARTS = jobs_of(lambda study: study.parts(ENGINE))
GATHERED = jobs_of(lambda study: study.gathered(ENGINE))
TIMED = jobs_of(lambda study: study.timed())


def part_path(study, part):
    return f"{RESULTS}/{study}/parts/{part}.npz"


def file_path(study, file):
    return f"{RESULTS}/{study}/{file}"


def settings_of_job(study, script, find):
    """Return the settings of a job of a study."""
    job = find()
    return {
        "module": job.module,
        "settings": job.settings,
        "code": digest(script, job.module, *job.loads),
        "needs": [MADE.fingerprint_of(part_path(study, part)) for part in job.needs],
        "files": {argument: file_digest(path) for argument, path in job.files.items()},
    }


for jobs, by, path_of in (
    (PARTS, "part.py", part_path),
    (GATHERED, "gather.py", file_path),
    (TIMED, "timed.py", file_path),
):
    for (study, name), each in jobs.items():
        MADE[path_of(study, name)] = partial(settings_of_job, study, by, each)


def needs_of(jobs):
    """Input function: the parts that one of these jobs needs."""
    return lambda wildcards: [
        part_path(wildcards.study, part) for part in jobs[tuple(wildcards)]().needs
    ]


def compiled_before(jobs):
    """Input function: the marks that the code which one of these jobs runs is compiled."""

    def marks(wildcards):
        study = CONFIG.studies[wildcards.study]
        if isinstance(study, Study):
            return compiled_for(study)
        wanted = jobs[tuple(wildcards)]().compiled
        return compiled(study.models, wanted) if wanted else []

    return marks


# By content, for the times of these files mean nothing.
rule part:
    input:
        needs=needs_of(PARTS),
        compiled=ancient(compiled_before(PARTS)),
        rerun=rerun_if_changed(part_path("{study}", "{part}"), needs=needs_of(PARTS)),
    output:
        part_path("{study}", "{part}"),
    log:
        f"{LOGS}/{{study}}/parts/{{part}}.log",
    benchmark:
        f"{TIMES}/{{study}}/parts/{{part}}.tsv"
    wildcard_constraints:
        study=one_of({study for study, _ in PARTS}),
        part=one_of({part for _, part in PARTS}),
    priority: of_papers(3)
    resources:
        mem_mb=lambda wildcards: PARTS[tuple(wildcards)]().resources["mem_mb"],
        runtime=lambda wildcards: PARTS[tuple(wildcards)]().resources["runtime"],
    params:
        job=job,
        # No input: their bytes count, not their dates, and their names may look like wildcards.
        files=lambda wildcards: PARTS[tuple(wildcards)]().files,
    message:
        "Run {wildcards.study}: {wildcards.part}"
    script:
        "../scripts/part.py"


rule gather:
    input:
        needs=needs_of(GATHERED),
        rerun=rerun_if_changed(file_path("{study}", "{file}"), needs=needs_of(GATHERED)),
    output:
        file_path("{study}", "{file}"),
    log:
        f"{LOGS}/{{study}}/gather/{{file}}.log",
    benchmark:
        f"{TIMES}/{{study}}/gather/{{file}}.tsv"
    wildcard_constraints:
        study=one_of({study for study, _ in GATHERED}),
        file=one_of({file for _, file in GATHERED}),
    priority: of_papers(3)
    resources:
        mem_mb=lambda wildcards: GATHERED[tuple(wildcards)]().resources["mem_mb"],
        runtime=lambda wildcards: GATHERED[tuple(wildcards)]().resources["runtime"],
    params:
        job=job,
    message:
        "Gather {wildcards.study} into {output}"
    script:
        "../scripts/gather.py"


# It takes all cores, so that nothing else runs beside it. It knows nothing of errors and figures:
# those do not make it run again.
rule timed:
    input:
        compiled=ancient(compiled_before(TIMED)),
        rerun=rerun_if_changed(file_path("{study}", "{file}")),
    output:
        file_path("{study}", "{file}"),
    log:
        f"{LOGS}/{{study}}/{{file}}.log",
    benchmark:
        f"{TIMES}/{{study}}/{{file}}.tsv"
    wildcard_constraints:
        study=one_of({study for study, _ in TIMED}),
        file=one_of({file for _, file in TIMED}),
    threads: ALL_CORES
    params:
        job=job,
    message:
        "Take times for {wildcards.study}, alone on this machine"
    script:
        "../scripts/timed.py"
