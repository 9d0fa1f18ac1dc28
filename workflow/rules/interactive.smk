"""Interactive figures of the page: scripts with their values."""

INTERACTIVE = {
    f"{study.name}/interactive/{name}": (study, settings)
    for study in STUDIES.values()
    for name, settings in study.interactive.items()
}


def interactive_settings(figure):
    study, settings = INTERACTIVE[figure]
    return {
        "settings": settings,
        "study": {
            "fixed": study.fixed,
            "axes": study.axis_values,
            "primary": study.initial,
            "draws": study.draw_settings(),
            "follow": study.follow,
            "run": study.run_settings(ENGINE),
            "observers": study.observer_settings(),
        },
        "code": digest(
            "interactive.py",
        ),
        "shown": MADE.fingerprint_of(f"{RESULTS}/{study.name}/cube.nc"),
    }


MADE |= {f"{RESULTS}/{name}.js": partial(interactive_settings, name) for name in INTERACTIVE}


# Those of the page.
DEFAULT_INTERACTIVE = [name for name, (study, _) in INTERACTIVE.items() if study.name in DEFAULT]


rule interactive:
    input:
        cube=lambda wildcards: f"{RESULTS}/{INTERACTIVE[wildcards.figure][0].name}/cube.nc",
        rerun=rerun_if_changed(f"{RESULTS}/{{figure}}.js"),
    output:
        f"{RESULTS}/{{figure}}.js",
    log:
        f"{LOGS}/{{figure}}.log",
    benchmark:
        f"{TIMES}/{{figure}}.tsv"
    wildcard_constraints:
        figure=one_of(INTERACTIVE),
    resources:
        mem_mb=lambda wildcards: memory_with_cube(INTERACTIVE[wildcards.figure][0]),
    params:
        job=job,
    message:
        "Prepare {wildcards.figure} for the page"
    script:
        "../scripts/interactive.py"
