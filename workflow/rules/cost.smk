"""What the parts of a run cost: all of it times, so none of it in files of the same bytes."""

from damper.observers import OBSERVERS

COSTS = {name: study for name, study in VERIFICATIONS.items() if study.kind == "cost"}
EVERY_OBSERVER = [f"damper.observers.{name}" for name in OBSERVERS]


# It takes all cores, so that nothing else runs beside it.
rule cost:
    output:
        f"{RESULTS}/{{study}}/timed/cost.json",
    log:
        "logs/{study}/cost.log",
    benchmark:
        "logs/benchmarks/{study}/cost.tsv"
    wildcard_constraints:
        study=one_of(COSTS),
    threads: ALL_CORES
    params:
        settings=lambda wildcards: COSTS[wildcards.study].settings(),
        code=code_digest(SCRIPTS / "cost.py", EVERY_MODEL + EVERY_OBSERVER),
    message:
        "Measure what the parts of a run cost, alone on this machine"
    script:
        "../scripts/cost.py"
