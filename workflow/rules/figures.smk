"""Figures of a cube, as SVG and PNG; schematics need none."""

from damper.figures import modules


def _figure(wildcards):
    """A figure, and the settings of this file of it."""
    return STUDIES[wildcards.study].files("figures")[f"figures/{wildcards.figure}"]


def _cube(wildcards):
    """The cube that a figure shows: none for a schematic, which then waits for no simulation."""
    return f"{RESULTS}/{wildcards.study}/cube.nc" if _figure(wildcards)[0].of_cube else []


rule figure:
    input:
        cube=_cube,
        beside=lambda wildcards: cubes_beside(_figure(wildcards)[0]),
    output:
        svg=f"{RESULTS}/{{study}}/figures/{{figure}}.svg",
        png=f"{RESULTS}/{{study}}/figures/{{figure}}.png",
    log:
        "logs/{study}/figures/{figure}.log",
    benchmark:
        "logs/benchmarks/{study}/figures/{figure}.tsv"
    priority: of_papers
    params:
        settings=lambda wildcards: _figure(wildcards)[1],
        code=lambda wildcards: code_digest(SCRIPTS / "figure.py", modules(_figure(wildcards)[1])),
    message:
        "Draw {wildcards.study}: {wildcards.figure}"
    script:
        "../scripts/figure.py"
