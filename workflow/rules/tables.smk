"""Tables of a cube, as CSV and Markdown; edges are bisected with runs of their own."""


rule table:
    input:
        cube=f"{RESULTS}/{{study}}/cube.nc",
        compiled=ancient(compiled_for),
    output:
        csv=f"{RESULTS}/{{study}}/tables/{{table}}.csv",
        md=f"{RESULTS}/{{study}}/tables/{{table}}.md",
    log:
        "logs/{study}/tables/{table}.log",
    benchmark:
        "logs/benchmarks/{study}/tables/{table}.tsv"
    params:
        settings=lambda wildcards: STUDIES[wildcards.study].tables[wildcards.table].model_dump(),
        title=lambda wildcards: STUDIES[wildcards.study].title,
        observer=lambda wildcards: STUDIES[wildcards.study].observer_settings()["bursts"],
        assumed=lambda wildcards: STUDIES[wildcards.study].assumed,
        fixed=lambda wildcards: STUDIES[wildcards.study].fixed,
        run=lambda wildcards: {
            "transient": STUDIES[wildcards.study].transient,
            "periods": STUDIES[wildcards.study].periods,
            "primary": STUDIES[wildcards.study].initial.primary,
            **ENGINE,
        },
        code=code_digest(SCRIPTS / "table.py", ["damper.observers.bursts"]),
    message:
        "Bisect and write {wildcards.study}: {wildcards.table}"
    script:
        "../scripts/table.py"
