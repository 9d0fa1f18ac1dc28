"""Figures, as SVG and PNG."""

from damper.figures import modules

FIGURES = products("figures")


def figure_settings(figure):
    study, product, settings = FIGURES[figure]
    drawn_by = type(product).__module__
    return {
        "settings": settings,
        "module": drawn_by,
        "code": digest("figure.py", *modules(drawn_by, settings)),
        "shown": [MADE.fingerprint_of(path) for path in shown(study, product).values()],
    }


for name in FIGURES:
    for end in SUFFIXES["figures"]:
        MADE[f"{RESULTS}/{name}.{end}"] = partial(figure_settings, name)


def memory_with_cube(study):
    """Return the megabytes of a job that opens a cube; those of checks of the engine are small."""
    gathering = taken_by(study.name).gather_resources["mem_mb"] if study.name in STUDIES else 0
    return max(1000, 500 + gathering)


# What shows times lies beside them, in a folder of its own.
rule figure:
    input:
        unpack(lambda wildcards: shown(*FIGURES[wildcards.figure][:2])),
        rerun=rerun_if_changed(f"{RESULTS}/{{figure}}.svg", f"{RESULTS}/{{figure}}.png"),
    output:
        svg=report(
            f"{RESULTS}/{{figure}}.svg",
            category=lambda wildcards: FIGURES[wildcards.figure][0].name,
            subcategory="figures",
            labels=lambda wildcards: {"figure": wildcards.figure.rpartition("/")[2]},
        ),
        png=f"{RESULTS}/{{figure}}.png",
    log:
        f"{LOGS}/{{figure}}.log",
    benchmark:
        f"{TIMES}/{{figure}}.tsv"
    wildcard_constraints:
        figure=one_of(FIGURES),
    priority: of_papers(1)
    resources:
        mem_mb=lambda wildcards: memory_with_cube(FIGURES[wildcards.figure][0]),
    params:
        job=job,
    message:
        "Draw {wildcards.figure}"
    script:
        "../scripts/figure.py"
