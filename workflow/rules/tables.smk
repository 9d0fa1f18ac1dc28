"""Tables, as CSV and Markdown; edges are bisected with runs of their own."""

TABLES = products("tables")


def _runs_more(study):
    """Whether tables of a study may run more points: of its model, with its observers."""
    return study.name in STUDIES


def table_settings(table):
    study, product, settings = TABLES[table]
    made_by = type(product).__module__
    more = simulation_modules(study) if _runs_more(study) else []
    return {
        "settings": settings,
        "module": made_by,
        "code": digest("table.py", made_by, *more),
        "shown": [MADE.fingerprint_of(path) for path in shown(study, product).values()],
    }


MADE |= {f"{RESULTS}/{name}.md": partial(table_settings, name) for name in TABLES}


def _compiled(wildcards):
    study = TABLES[wildcards.table][0]
    return compiled_for(study) if _runs_more(study) else []


def no_longer_made():
    """Return figures and tables that no entry of their study makes any more."""
    made = {f"{name}.{end}" for name in FIGURES for end in SUFFIXES["figures"]}
    made |= {f"{name}.{end}" for name in TABLES for end in SUFFIXES["tables"]}
    made |= {f"{name}.js" for name in INTERACTIVE}
    return list(left_over(Path(RESULTS), CONFIG.studies, made))


def remove_left_over(log):
    """Remove these files, and write their names into a log."""
    found = no_longer_made()
    for path in found:
        path.unlink()
    Path(log).write_text("".join(f"{path}\n" for path in found))


def report_left_over():
    """Say which files these are, and how to remove them."""
    if found := no_longer_made():
        names = "".join(f"\n  {path}" for path in found)
        print(
            f"No entry of a study makes these any more; `snakemake --cores 1 tidy` removes them:{names}",
            file=sys.stderr,
        )


rule table:
    input:
        unpack(lambda wildcards: shown(*TABLES[wildcards.table][:2])),
        compiled=ancient(_compiled),
        rerun=rerun_if_changed(f"{RESULTS}/{{table}}.md"),
    output:
        csv=report(
            f"{RESULTS}/{{table}}.csv",
            category=lambda wildcards: TABLES[wildcards.table][0].name,
            subcategory="tables",
            labels=lambda wildcards: {"table": wildcards.table.rpartition("/")[2]},
        ),
        md=f"{RESULTS}/{{table}}.md",
    log:
        f"{LOGS}/{{table}}.log",
    benchmark:
        f"{TIMES}/{{table}}.tsv"
    wildcard_constraints:
        table=one_of(TABLES),
    priority: of_papers(2)
    resources:
        mem_mb=lambda wildcards: memory_with_cube(TABLES[wildcards.table][0]),
    params:
        job=job,
    message:
        "Write {wildcards.table}"
    script:
        "../scripts/table.py"
