"""Figures of a cube, as SVG and PNG; schematics need none."""

from damper.figures import modules


def _settings(wildcards):
    return STUDIES[wildcards.study].figure_settings(wildcards.figure)


def _figure(wildcards):
    study = STUDIES[wildcards.study]
    name, _ = study.figure_files()[wildcards.figure]
    return study.figures[name]


def _cube(wildcards):
    """The cube that a figure shows: none for a schematic, which then waits for no simulation."""
    return f"{RESULTS}/{wildcards.study}/cube.nc" if _figure(wildcards).of_cube else []


rule figure:
    input:
        cube=_cube,
        beside=lambda wildcards: cubes_beside(_figure(wildcards)),
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
