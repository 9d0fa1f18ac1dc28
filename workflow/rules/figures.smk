"""Figures of a cube, as SVG and PNG; schematics need none."""


def _figure(wildcards):
    """The figure behind a file, and the coordinates at which the file is made."""
    study = STUDIES[wildcards.study]
    name, place = study.figure_files()[wildcards.figure]
    return study.figures[name], place


def _settings(wildcards):
    figure, place = _figure(wildcards)
    return figure.drawn_with(place)


def _cube(wildcards):
    """The cube that a figure shows: none for a schematic, which then waits for no simulation."""
    figure, _ = _figure(wildcards)
    return f"{RESULTS}/{wildcards.study}/cube.nc" if figure.of_cube else []


rule figure:
    input:
        _cube,
    output:
        svg=f"{RESULTS}/{{study}}/figures/{{figure}}.svg",
        png=f"{RESULTS}/{{study}}/figures/{{figure}}.png",
    log:
        "logs/{study}/figures/{figure}.log",
    benchmark:
        "logs/benchmarks/{study}/figures/{figure}.tsv"
    params:
        settings=_settings,
        code=lambda wildcards: code_digest(
            SCRIPTS / "figure.py",
            [f"damper.figures.{_settings(wildcards)['kind']}"],
        ),
    message:
        "Draw {wildcards.study}: {wildcards.figure}"
    script:
        "../scripts/figure.py"
