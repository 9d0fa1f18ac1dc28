"""Verdicts on the papers' statements, from the cubes of the studies that bear on them."""

# Verdicts, and the page, belong to everything if all studies that verdicts need do. A run of one
# study does not overwrite them; they can still be asked for by name.
COMPLETE = all(name in DEFAULT for name in JUDGED_BY)


def claims_if_complete():
    """Files of the verdicts."""
    return [f"{RESULTS}/claims.csv", f"{RESULTS}/claims.md"] if COMPLETE else []


# Cubes that are made by default and that a verdict needs.
JUDGED = {name: f"{RESULTS}/{name}/cube.nc" for name in JUDGED_BY if name in DEFAULT}


def claims_settings():
    return {
        # Links to figures that are not made would lead nowhere.
        "figures": [name for name, (study, *_) in FIGURES.items() if study.name in DEFAULT],
        "code": digest("claims.py"),
        "cubes": {name: MADE.fingerprint_of(path) for name, path in JUDGED.items()},
    }


MADE[f"{RESULTS}/claims.md"] = claims_settings


rule claims:
    input:
        **JUDGED,
        rerun=rerun_if_changed(f"{RESULTS}/claims.md"),
    output:
        csv=report(f"{RESULTS}/claims.csv", category="papers", labels={"table": "claims"}),
        md=f"{RESULTS}/claims.md",
    log:
        f"{LOGS}/claims.log",
    benchmark:
        f"{TIMES}/claims/claims.tsv"
    priority: 4
    params:
        job=job,
    message:
        "Judge the papers' statements"
    script:
        "../scripts/claims.py"


rule papers:
    input:
        [everything_of(DEFAULT[name]) for name in JUDGED],
        claims_if_complete(),
    message:
        "The papers' figures, tables and verdicts are made"
