"""Figures of a cube, as SVG and PNG."""


def _settings(wildcards):
    study = STUDIES[wildcards.study]
    name, place = study.figure_files()[wildcards.figure]
    settings = study.figures[name].model_dump(exclude={"each"}, exclude_none=True)
    return settings | ({"at": settings.get("at", {}) | place} if place else {})


def _cubes_beside_figure(wildcards):
    study = STUDIES[wildcards.study]
    name, _ = study.figure_files()[wildcards.figure]
    return cubes_beside(study.figures[name])


rule figure:
    input:
        cube=f"{RESULTS}/{{study}}/cube.nc",
        beside=_cubes_beside_figure,
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
