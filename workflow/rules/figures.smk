"""Figures of a cube, as SVG and PNG."""

from damper.figures import modules


def _settings(wildcards):
    study = STUDIES[wildcards.study]
    name, place = study.figure_files()[wildcards.figure]
    settings = study.figure_settings(name)
    return settings | {"at": settings.get("at", {}) | place}


rule figure:
    input:
        f"{RESULTS}/{{study}}/cube.nc",
    output:
        svg=f"{RESULTS}/{{study}}/figures/{{figure}}.svg",
        png=f"{RESULTS}/{{study}}/figures/{{figure}}.png",
    log:
        "logs/{study}/figures/{figure}.log",
    benchmark:
        "logs/benchmarks/{study}/figures/{figure}.tsv"
    params:
        settings=_settings,
        code=lambda wildcards: code_digest(SCRIPTS / "figure.py", modules(_settings(wildcards))),
    message:
        "Draw {wildcards.study}: {wildcards.figure}"
    script:
        "../scripts/figure.py"
