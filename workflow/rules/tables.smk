"""Tables of a cube, as CSV and Markdown; edges are bisected with runs of their own."""

from damper.study.kinds import TABLES


def _table_settings(wildcards):
    return STUDIES[wildcards.study].tables[wildcards.table].model_dump(exclude_none=True)


rule table:
    input:
        cube=f"{RESULTS}/{{study}}/cube.nc",
        beside=lambda wildcards: cubes_beside(STUDIES[wildcards.study].tables[wildcards.table]),
        compiled=ancient(compiled_for),
    output:
        csv=f"{RESULTS}/{{study}}/tables/{{table}}.csv",
        md=f"{RESULTS}/{{study}}/tables/{{table}}.md",
    log:
        "logs/{study}/tables/{table}.log",
    benchmark:
        "logs/benchmarks/{study}/tables/{table}.tsv"
    priority: of_papers
    params:
        settings=_table_settings,
        code=lambda wildcards: code_digest(
            SCRIPTS / "table.py",
            [
                TABLES.modules[_table_settings(wildcards)["kind"]],
                *simulation_modules(STUDIES[wildcards.study]),
            ],
        ),
    message:
        "Write {wildcards.study}: {wildcards.table}"
    script:
        "../scripts/table.py"
