"""What the parts of a run cost: all of it times, so none of it in files of the same bytes."""

from damper.observers import OBSERVERS

COSTS = {name: study for name, study in VERIFICATIONS.items() if study.kind == "cost"}
EVERY_OBSERVER = [f"damper.observers.{name}" for name in OBSERVERS]


@once
def cost_settings(study):
    return {
        "settings": COSTS[study].settings(),
        "code": digest("cost.py", *EVERY_MODEL, *EVERY_OBSERVER),
    }


SETTINGS["cost", "timed/cost.json"] = cost_settings


# It takes all cores, so that nothing else runs beside it.
rule cost:
    input:
        changed(cost_settings, f"{RESULTS}/{{study}}/timed/cost.json"),
    output:
        f"{RESULTS}/{{study}}/timed/cost.json",
    log:
        f"{LOGS}/{{study}}/cost.log",
    benchmark:
        f"{TIMES}/{{study}}/cost.tsv"
    wildcard_constraints:
        study=one_of(COSTS),
    threads: ALL_CORES
    params:
        job=job(cost_settings),
    message:
        "Measure what the parts of a run cost, alone on this machine"
    script:
        "../scripts/cost.py"
